"""MJCF files with the traits of published ones, and what MuJoCo makes of them."""

import mujoco
import numpy as np

#: Joints off their bodies' frames, references, two joints of a body, frames, every notation of an orientation, masses
#: from geoms of every shape, default classes in each other, and a range in degrees beside one of a slide.
ARM = """<mujoco model="arm">
  <compiler angle="degree" eulerseq="XYz"/>
  <option gravity="0.5 0 -9.7"/>
  <default>
    <joint armature="0.1" damping="1"/>
    <geom density="700"/>
    <default class="big">
      <joint frictionloss="0.5" axis="0 1 0" range="-90 120"/>
      <default class="bigger"><joint damping="3" range="-60 60"/></default>
    </default>
  </default>
  <worldbody>
    <geom type="plane" size="1 1 1"/>
    <body name="base" pos="0.1 0.2 0.3" euler="10 20 30">
      <geom type="box" size="0.1 0.1 0.1" mass="2"/>
      <body name="upper" pos="0 0 0.3" childclass="big">
        <joint name="my joint" pos="0.01 0.02 0.03" ref="10"/>
        <inertial mass="2" pos="0 0 0.1" quat="1 0.3 0 0" diaginertia="0.02 0.02 0.01"/>
        <geom type="mesh" mesh="nowhere" contype="0" conaffinity="0"/>
        <body name="lower" pos="0.3 0 0" axisangle="1 0 0 30">
          <joint name="elbow" axis="1 1 0" class="bigger"/>
          <geom type="capsule" size="0.05 0.2" density="1000"/>
          <geom type="sphere" size="0.05" pos="0.1 0 0" mass="0.3"/>
          <geom type="ellipsoid" size="0.05 0.06 0.07" pos="0 0.1 0" zaxis="1 1 0"/>
          <geom type="cylinder" size="0.03" fromto="0 0 0 0.1 0.1 0.05"/>
          <frame pos="0.05 0 0" euler="0 0 40">
            <body pos="0.05 0 0" xyaxes="0 1 0 -1 0 0">
              <joint name="slide" type="slide" axis="0 0 2" range="-0.1 0.2" ref="0.05"/>
              <joint name="turn" axis="1 0 0" pos="0 0.01 0" range="-50 50"/>
              <inertial mass="1" pos="0 0.1 0" fullinertia="0.02 0.03 0.025 0.001 0.002 0.003"/>
              <site name="tcp" pos="0 0 0.1" euler="0 90 0"/>
            </body>
          </frame>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor joint="my joint" gear="50" ctrlrange="-2 2"/>
    <position joint="elbow" kp="10" gear="-3" forcerange="-10 20"/>
    <general joint="slide" gainprm="4" ctrlrange="-5 5"/>
    <position joint="turn" forcerange="-9 9"/>
    <velocity joint="turn" forcerange="-4 4"/>
  </actuator>
  <keyframe><key name="home" qpos="0 0 0.1 0"/></keyframe>
</mujoco>
"""


class Mujoco:
    """MuJoCo's own reading of the text of an MJCF or URDF, without contacts, stops, couplings and dry friction."""

    def __init__(self, text, gravity=None):
        spec = mujoco.MjSpec.from_string(text)
        if gravity is not None:
            spec.option.gravity = gravity
        for geom in [geom for geom in spec.geoms if geom.meshname]:
            spec.delete(geom)
        for mesh in spec.meshes:  # whose files are not at hand, and from which no mass here follows
            spec.delete(mesh)
        self.model = spec.compile()
        self.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT | mujoco.mjtDisableBit.mjDSBL_CONTACT)
        self.data = mujoco.MjData(self.model)

    def states(self, robot, q, v, a):
        """The state of the model for every row of positions, velocities and accelerations of the robot's joints."""
        names = list(robot.model.names)[1:]
        columns = [self.model.joint(name).dofadr[0] for name in names]
        for state in zip(*robot.transmission.motion(q, v, a), strict=True):
            data = self.data
            for array, values in zip((data.qpos, data.qvel, data.qacc), state, strict=True):
                array[:] = 0.0
                array[columns] = values
            for name, position in robot.locked.items():
                data.qpos[self.model.joint(name).qposadr[0]] = position
            yield columns

    def effort(self, robot, q, v, a):
        """Efforts of the robot's joints by ``mj_inverse``, with armature and damping, without dry friction."""
        found = []
        for columns in self.states(robot, q, v, a):
            mujoco.mj_inverse(self.model, self.data)
            found.append(self.data.qfrc_inverse[columns])
        return robot.transmission.effort(q, np.array(found))

    def site(self, robot, q, name):
        """Positions (T, 3) and rotations (T, 3, 3) of a site."""
        positions, rotations = [], []
        for _ in self.states(robot, q, 0.0 * q, 0.0 * q):
            mujoco.mj_forward(self.model, self.data)
            positions.append(self.data.site(name).xpos.copy())
            rotations.append(self.data.site(name).xmat.reshape(3, 3).copy())
        return np.array(positions), np.array(rotations)
