"""Sixteen robots of twelve makers by file, each small and with the traits of the published one that gave it its name.

Each function writes the files of a robot into a folder and returns the arguments of ``load_robot``.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tests.robot.arms import GEN3, JACO
from trajevo import Robot

VELOCITY = {"velocity": 2.0}
NO_EFFORT = {"effort": float("inf")}


def body(name: str, mass: float, com: str, moments: str = "0.01 0.02 0.015") -> str:
    ixx, iyy, izz = moments.split()
    return (
        f'<link name="{name}"><inertial><origin xyz="{com}" rpy="0 0.1 0.2"/><mass value="{mass}"/>'
        f'<inertia ixx="{ixx}" ixy="0" ixz="0.0005" iyy="{iyy}" iyz="0" izz="{izz}"/></inertial></link>'
    )


def joint(name: str, ends: str, origin: str, axis: str, limit: str, more: str = "", kind: str = "revolute") -> str:
    parent, child = ends.split(" > ")
    lower, upper, velocity, effort = limit.split()
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/><origin xyz="{origin}"/>'
        f'<axis xyz="{axis}"/><limit lower="{lower}" upper="{upper}" velocity="{velocity}" effort="{effort}"/>'
        f"{more}</joint>"
    )


def fixed(ends: str, origin: str = "0 0 0") -> str:
    parent, child = ends.split(" > ")
    return (
        f'<joint name="{parent}-{child}" type="fixed"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{origin}"/></joint>'
    )


def written(file: Path, text: str) -> Path:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")
    return file


def kinova_gen3(folder: Path) -> dict[str, Any]:
    """Continuous joints without a range, one of them without an effort limit."""
    text = GEN3.replace(
        '<axis xyz="0 0 1"/><limit effort="39" velocity="1.39"/></joint>', '<axis xyz="0 0 1"/></joint>', 1
    )
    return {"name": written(folder / "gen3.urdf", text), "limits": {"velocity": 1.39, "effort": {"joint_1": 39.0}}}


def kinova_jaco(folder: Path) -> dict[str, Any]:
    """Fingers and a bar that follow; several tips."""
    return {"name": written(folder / "jaco.urdf", JACO), "tool": "tool"}


def so_100(folder: Path) -> dict[str, Any]:
    """MJCF with spaces in names, one class for all, servos with a force range, and a jaw that is locked."""
    text = """<mujoco model="so_arm100">
      <compiler angle="radian" autolimits="true"/>
      <default><default class="so"><joint frictionloss="0.05" armature="0.028" damping="0.6"/>
        <position kp="50" forcerange="-3.5 3.5"/></default></default>
      <worldbody><body name="Base" childclass="so">
        <inertial pos="0 0 0.03" mass="0.56" diaginertia="5e-4 4e-4 4e-4"/>
        <body name="Rotation Pitch" pos="0 -0.0452 0.0165" quat="0.707105 0.707108 0 0">
          <inertial pos="-9e-5 0.059 0.031" quat="0.36 0.79 -0.37 0.31" mass="0.119" diaginertia="6e-5 5e-5 4e-5"/>
          <joint name="Shoulder Pan" axis="0 1 0" range="-1.92 1.92"/>
          <body name="Upper Arm" pos="0 0.1025 0.0306" euler="1.57079 0 0">
            <inertial pos="-0.0017 0.0701 0.0031" mass="0.162" fullinertia="2e-4 1.8e-4 1.2e-4 1e-6 2e-6 -1e-6"/>
            <joint name="Shoulder Lift" axis="1 0 0" range="-1.7 1.7"/>
            <body name="Fixed Jaw" pos="0 0.112 0.028">
              <inertial pos="0.001 0.03 0.02" mass="0.1" diaginertia="5e-5 4e-5 3e-5"/>
              <joint name="Wrist Roll" axis="0 1 0" range="-2.7 2.7"/>
              <body name="Moving Jaw" pos="-0.02 0.02 0">
                <inertial pos="0 0.03 0" mass="0.02" diaginertia="1e-5 1e-5 5e-6"/>
                <joint name="Jaw" axis="0 0 1" range="-0.2 1.7"/></body>
              <site name="grip" pos="0 0.08 0"/>
            </body></body></body></body></worldbody>
      <actuator><position class="so" name="Rotation" joint="Shoulder Pan"/>
        <position class="so" name="Pitch" joint="Shoulder Lift"/><position class="so" name="Roll" joint="Wrist Roll"/>
        <position class="so" name="Jaw" joint="Jaw"/></actuator>
    </mujoco>"""
    file = written(folder / "so_arm100.xml", text)
    return {"name": file, "tool": "grip", "lock": {"Jaw": 0.3}, "limits": VELOCITY}


XACRO = 'xmlns:xacro="http://ros.org/wiki/xacro"'


def _industrial(folder: Path, maker: str, model: str, *, prefix: str, limits: str, masses: bool) -> Path:
    """A package of ROS-Industrial: a top file, a macro with a prefix, and another package for colours."""
    package = folder / f"{maker}_{model}_support"
    links = "".join(f'<link name="${{prefix}}link_{k}">{_inertial(k) if masses else ""}</link>' for k in range(1, 4))
    axes = ("0 0 1", "0 1 0", "0 -1 0")
    joints = "".join(
        f'<joint name="${{prefix}}joint_{k}" type="revolute"><origin xyz="${{reach[{k - 1}]}} 0 0.2" rpy="0 0 0"/>'
        f'<parent link="${{prefix}}{"base_link" if k == 1 else f"link_{k - 1}"}"/><child link="${{prefix}}link_{k}"/>'
        f'<axis xyz="{axis}"/>{limits}</joint>'
        for k, axis in enumerate(axes, start=1)
    )
    macro = f"""<?xml version="1.0" ?><robot {XACRO}>
      <xacro:include filename="$(find {maker}_resources)/urdf/common_materials.xacro"/>
      <xacro:macro name="{maker}_{model}" params="prefix">
        <xacro:property name="reach" value="${{[0.0, 0.15, 0.6]}}"/>
        <link name="${{prefix}}base_link"/>{links}{joints}
        <link name="${{prefix}}tool0"/><link name="${{prefix}}base"/>
        <joint name="${{prefix}}joint_3-tool0" type="fixed"><parent link="${{prefix}}link_3"/>
          <child link="${{prefix}}tool0"/><origin xyz="0.1 0 0" rpy="0 ${{radians(90)}} 0"/></joint>
        <joint name="${{prefix}}base_link-base" type="fixed"><origin xyz="0 0 0.45"/>
          <parent link="${{prefix}}base_link"/><child link="${{prefix}}base"/></joint>
      </xacro:macro></robot>"""
    written(
        folder / f"{maker}_resources/urdf/common_materials.xacro", f'<robot {XACRO}><material name="yellow"/></robot>'
    )
    written(package / f"urdf/{model}_macro.xacro", macro)
    top = f"""<robot name="{maker}_{model}" {XACRO}>
      <xacro:include filename="$(find {maker}_{model}_support)/urdf/{model}_macro.xacro"/>
      <xacro:{maker}_{model} prefix="{prefix}"/></robot>"""
    return written(package / f"urdf/{model}.xacro", top)


def _inertial(k: int) -> str:
    return (
        f'<inertial><origin xyz="0.1 0 {0.05 * k}"/><mass value="{30 - 8 * k}"/>'
        '<inertia ixx="0.5" ixy="0" ixz="0.01" iyy="0.6" iyz="0" izz="0.4"/></inertial>'
    )


def fanuc_m10ia(folder: Path) -> dict[str, Any]:
    """ROS-Industrial: no masses, effort limits of 0, several tips."""
    limit = '<limit lower="${radians(-170)}" upper="${radians(170)}" effort="0" velocity="${radians(225)}"/>'
    file = _industrial(folder, "fanuc", "m10ia", prefix="", limits=limit, masses=False)
    return {"name": file, "tool": "tool0", "limits": NO_EFFORT}


def abb_irb2400(folder: Path) -> dict[str, Any]:
    """ROS-Industrial: a prefix, and numbers alone."""
    limit = '<limit lower="-2.9" upper="2.9" effort="0" velocity="2.618"/>'
    file = _industrial(folder, "abb", "irb2400", prefix="left_", limits=limit, masses=False)
    return {"name": file, "tool": "left_tool0", "limits": NO_EFFORT}


def staubli_rx160(folder: Path) -> dict[str, Any]:
    """ROS-Industrial with masses and friction, and no effort limits."""
    limit = '<limit lower="-2.5" upper="2.5" effort="0" velocity="2.8"/><dynamics damping="40" friction="20"/>'
    file = _industrial(folder, "staubli", "rx160", prefix="", limits=limit, masses=True)
    return {"name": file, "tool": "tool0", "limits": NO_EFFORT}


def universal_robots_ur5e(folder: Path) -> dict[str, Any]:
    """Arguments, limits in YAML in degrees, and a type of robot that chooses the folder of its files."""
    package = folder / "ur_description"
    written(
        package / "config/ur5e/joint_limits.yaml",
        "joint_limits:\n"
        + "".join(
            f"  {name}:\n    max_effort: {effort}\n    max_velocity: !degrees 180.0\n"
            "    min_position: !degrees -360.0\n    max_position: !degrees 360.0\n"
            for name, effort in (("shoulder_pan", 150.0), ("shoulder_lift", 150.0), ("elbow_joint", 150.0))
        ),
    )
    macro = f"""<robot {XACRO}>
      <xacro:macro name="turning" params="name limits parent child *origin">
        <joint name="${{tf}}${{name}}" type="revolute">
          <parent link="${{tf}}${{parent}}"/><child link="${{tf}}${{child}}"/>
          <xacro:insert_block name="origin"/><axis xyz="0 0 1"/>
          <limit lower="${{limits['min_position']}}" upper="${{limits['max_position']}}"
            effort="${{limits['max_effort']}}" velocity="${{limits['max_velocity']}}"/>
          <dynamics damping="0" friction="0"/></joint>
        <link name="${{tf}}${{child}}"><inertial><mass value="3.5"/><origin xyz="0 -0.02 0.1"/>
          <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.005"/></inertial></link>
      </xacro:macro>
      <xacro:macro name="ur_robot" params="tf_prefix limits_file">
        <xacro:property name="tf" value="${{tf_prefix}}" scope="parent"/>
        <xacro:property name="all" value="${{load_yaml(limits_file)['joint_limits']}}"/>
        <link name="${{tf}}base_link"/>
        <xacro:turning name="shoulder_pan" limits="${{all['shoulder_pan']}}" parent="base_link" child="shoulder">
          <origin xyz="0 0 0.16"/></xacro:turning>
        <xacro:turning name="shoulder_lift" limits="${{all['shoulder_lift']}}" parent="shoulder" child="upper_arm">
          <origin rpy="${{pi / 2}} 0 0"/></xacro:turning>
        <xacro:turning name="elbow_joint" limits="${{all['elbow_joint']}}" parent="upper_arm" child="forearm">
          <origin xyz="-0.425 0 0"/></xacro:turning>
      </xacro:macro></robot>"""
    written(package / "urdf/ur_macro.xacro", macro)
    top = f"""<robot name="$(arg name)" {XACRO}>
      <xacro:arg name="name" default="ur"/><xacro:arg name="ur_type" default="ur5x"/>
      <xacro:arg name="tf_prefix" default=""/>
      <xacro:arg name="joint_limit_params" default="$(find ur_description)/config/$(arg ur_type)/joint_limits.yaml"/>
      <xacro:include filename="$(find ur_description)/urdf/ur_macro.xacro"/>
      <xacro:ur_robot tf_prefix="$(arg tf_prefix)" limits_file="$(arg joint_limit_params)"/></robot>"""
    return {
        "name": written(package / "urdf/ur.urdf.xacro", top),
        "xacro": {"name": "ur5e", "ur_type": "ur5e", "tf_prefix": "a_"},
    }


def doosan_m1013(folder: Path) -> dict[str, Any]:
    """A xacro whose truth values and numbers choose links; the base is lifted by a block."""
    text = f"""<robot name="m1013" {XACRO}>
      <xacro:arg name="gripper" default="none"/><xacro:arg name="table" default="false"/>
      <xacro:arg name="height" default="0.0"/>
      <link name="world"/><link name="base_0"/>
      <joint name="world_fixed" type="fixed"><parent link="world"/><child link="base_0"/>
        <origin xyz="0 0 $(arg height)"/></joint>
      {body("link1", 4.12, "0 0 -0.05")}{body("link2", 10.8, "0.25 0 0.1")}
      {joint("joint1", "base_0 > link1", "0 0 0.1525", "0 0 1", "-6.2832 6.2832 2.0944 346")}
      {joint("joint2", "link1 > link2", "0 0.0345 0", "0 1 0", "-6.2832 6.2832 2.0944 346")}
      <xacro:if value="$(arg table)">{fixed("world > table")}<link name="table"/></xacro:if>
      <xacro:unless value="${{'$(arg gripper)' == 'none'}}"><link name="gripper"/>{fixed("link2 > gripper", "0.6 0 0")}
      </xacro:unless></robot>"""
    file = written(folder / "m1013.urdf.xacro", text)
    return {"name": file, "xacro": {"table": False, "gripper": "robotiq", "height": 0.75}}


def kuka_iiwa14(folder: Path) -> dict[str, Any]:
    """MJCF whose efforts are limited at the joints, with servos without a force range."""
    text = """<mujoco model="iiwa14">
      <compiler angle="radian"/>
      <default><default class="iiwa"><joint axis="0 0 1"/>
        <general gaintype="fixed" biastype="affine" gainprm="2000" biasprm="0 -2000 -200"/>
        <default class="joint1"><joint range="-2.96706 2.96706" actuatorfrcrange="-320 320"/></default>
        <default class="joint2"><joint range="-2.0944 2.0944" actuatorfrcrange="-176 176"/></default>
      </default></default>
      <worldbody><body name="base" childclass="iiwa"><inertial mass="5" pos="-0.1 0 0.07" diaginertia="0.05 0.06 0.03"/>
        <body name="link1" pos="0 0 0.1575"><inertial mass="5.76" pos="0 -0.03 0.12" diaginertia="0.033 0.0333 0.0123"/>
          <joint name="joint1" class="joint1"/>
          <body name="link2" pos="0 0 0.2025" quat="0 0 1 1"><joint name="joint2" class="joint2"/>
            <inertial mass="6.35" pos="0.0003 0.059 0.042" quat="0.98 0.14 0 0" diaginertia="0.0305 0.0304 0.011"/>
            <body name="link3" pos="0 0.2045 0" quat="0 0 1 1"><joint name="joint3" class="joint1"/>
              <inertial mass="3.5" pos="0 0.03 0.13" diaginertia="0.025 0.0238 0.0076"/>
              <site name="attachment_site" pos="0 0 0.2"/></body></body></body></body></worldbody>
      <actuator><general class="iiwa" name="actuator1" joint="joint1" ctrlrange="-2.96706 2.96706"/>
        <general class="iiwa" name="actuator2" joint="joint2"/><general class="iiwa" joint="joint3"/></actuator>
      <keyframe><key name="home" qpos="0 0.785398 0" ctrl="0 0.785398 0"/></keyframe>
    </mujoco>"""
    return {"name": written(folder / "iiwa14.xml", text), "limits": VELOCITY}


def franka_panda(folder: Path) -> dict[str, Any]:
    """MJCF with classes in classes, quaternions that are not of length 1, fingers coupled and driven by a tendon."""
    text = """<mujoco model="panda">
      <compiler angle="radian" meshdir="assets" autolimits="true"/>
      <default><default class="panda"><joint armature="0.1" damping="1" axis="0 0 1" range="-2.8973 2.8973"/>
          <general dyntype="none" biastype="affine" ctrlrange="-2.8973 2.8973" forcerange="-87 87"/>
          <default class="finger"><joint axis="0 1 0" type="slide" range="0 0.04"/></default>
          <default class="visual"><geom type="mesh" contype="0" conaffinity="0" group="2"/></default>
          <default class="collision"><geom type="mesh" group="3"/>
            <default class="pad"><geom type="box" size="0.0085 0.004 0.0085" pos="0 0.0055 0.0445"/></default></default>
      </default></default>
      <asset><mesh name="link1_c" file="link1.stl"/><material name="white" class="panda" rgba="1 1 1 1"/></asset>
      <worldbody><light name="top" pos="0 0 2"/><body name="link0" childclass="panda">
        <inertial mass="0.63" pos="-0.041 0 0.05" fullinertia="0.00315 0.00388 0.004285 8.29e-7 0.00015 8.2e-6"/>
        <body name="link1" pos="0 0 0.333"><joint name="joint1"/>
          <inertial mass="4.97" pos="0.0039 0.0021 -0.0476" fullinertia="0.703 0.707 0.0091 -0.00014 0.0068 0.0192"/>
          <geom mesh="link1_c" class="visual"/>
          <body name="link2" quat="1 -1 0 0"><joint name="joint2" range="-1.7628 1.7628"/>
            <inertial mass="0.647" pos="-0.0031 -0.0287 0.0035" fullinertia="0.012 0.0281 0.026 -0.0039 0.0003 0.0007"/>
            <body name="hand" pos="0 -0.4 0" quat="0.9238795 0 0 -0.3826834">
              <inertial mass="0.73" pos="-0.01 0 0.03" diaginertia="0.001 0.0025 0.0017"/>
              <body name="left" pos="0 0 0.0584"><joint name="finger_joint1" class="finger"/>
                <inertial mass="0.015" pos="0 0 0" diaginertia="2.375e-6 2.375e-6 7.5e-7"/><geom class="pad"/></body>
              <body name="right" pos="0 0 0.0584" quat="0 0 0 1"><joint name="finger_joint2" class="finger"/>
                <inertial mass="0.015" pos="0 0 0" diaginertia="2.375e-6 2.375e-6 7.5e-7"/><geom class="pad"/></body>
            </body></body></body></body></worldbody>
      <tendon><fixed name="split"><joint joint="finger_joint1" coef="0.5"/>
        <joint joint="finger_joint2" coef="0.5"/></fixed></tendon>
      <equality><joint joint1="finger_joint1" joint2="finger_joint2" solimp="0.95 0.99 0.001"/></equality>
      <actuator><general class="panda" joint="joint1" gainprm="4500" biasprm="0 -4500 -450"/>
        <general class="panda" joint="joint2" gainprm="4500" biasprm="0 -4500 -450" ctrlrange="-1.7628 1.7628"/>
        <general class="panda" name="fingers" tendon="split" forcerange="-100 100" ctrlrange="0 255"/></actuator>
    </mujoco>"""
    file = written(folder / "panda.xml", text)
    return {"name": file, "tool": "hand", "limits": VELOCITY | {"effort": {"finger_joint2": 70.0}}}


def ufactory_xarm7(folder: Path) -> dict[str, Any]:
    """An ending in capitals, a world link, friction, and elements that nobody reads."""
    extra = '<safety_controller soft_lower_limit="-6" soft_upper_limit="6" k_position="20" k_velocity="10"/>'
    rub = '<dynamics damping="10" friction="1"/>' + extra
    text = f"""<robot name="UF_ROBOT"><material name="Silver"><color rgba="0.8 0.8 0.8 1"/></material>
      <link name="world"/>
      <link name="link_base"/>{fixed("world > link_base")}
      {body("link1", 2.5, "-0.002 0.027 -0.014")}{body("link2", 1.7, "0.02 -0.17 0.01")}<link name="link_eef"/>
      {joint("joint1", "link_base > link1", "0 0 0.267", "0 0 1", "-6.28 6.28 3.14 50", rub)}
      {joint("joint2", "link1 > link2", "0 0 0", "0 1 0", "-2.059 2.0944 3.14 50", rub)}
      {fixed("link2 > link_eef", "0 -0.3 0")}
      <transmission name="t1"><type>hardware/SimpleTransmission</type><joint name="joint1"/></transmission>
      <gazebo reference="link1"><selfCollide>true</selfCollide></gazebo></robot>"""
    return {"name": written(folder / "xarm7.URDF", text)}


def yaskawa_parallel(folder: Path) -> dict[str, Any]:
    """A palletiser whose parallel bars keep the flange level: one joint follows two others by way of a third."""
    follow = '<mimic joint="joint_2_l" multiplier="-1"/>'
    text = f"""<robot name="mpl"><link name="base_link"/><link name="base"/>{fixed("base_link > base")}
      {body("link_s", 20, "0 0 0.2", "0.5 0.6 0.4")}{body("link_l", 12, "0 0 0.4", "0.4 0.4 0.1")}
      {body("link_u", 8, "0.4 0 0", "0.05 0.3 0.3")}{body("link_b", 2, "0.05 0 -0.05")}<link name="tool0"/>
      {joint("joint_1_s", "base_link > link_s", "0 0 0.5", "0 0 1", "-3 3 2.4 900")}
      {joint("joint_2_l", "link_s > link_l", "0.2 0 0", "0 1 0", "-1.2 1.4 2.4 900")}
      {joint("joint_3_u", "link_l > link_u", "0 0 1.0", "0 1 0", "-2 2 2.4 900", follow)}
      {joint("joint_4_b", "link_u > link_b", "1.1 0 0", "0 1 0", "-1.5 1.5 4 90")}
      {fixed("link_b > tool0", "0 0 -0.2")}</robot>"""
    return {"name": written(folder / "mpl.urdf", text), "tool": "tool0"}


def denso_vs060(folder: Path) -> dict[str, Any]:
    """Links and joints that share their names, and an ending that could be anything."""
    text = f"""<?xml version="1.0" ?><robot name="vs060"><link name="world"/><link name="BASE"/>{fixed("world > BASE")}
      {body("J1", 3, "0 0 0.1")}{body("J2", 2, "0 0 0.15")}{body("J3", 1, "0.1 0 0")}
      {joint("J1", "BASE > J1", "0 0 0.345", "0 0 1", "-2.96 2.96 3.9 100")}
      {joint("J2", "J1 > J2", "0 0 0", "0 1 0", "-2.09 2.09 2.6 100")}
      {joint("J3", "J2 > J3", "0 0 0.305", "0 1 0", "0.3 2.7 2.8 60")}</robot>"""
    return {"name": written(folder / "vs060.xml", text)}


def scara_mjcf(folder: Path) -> dict[str, Any]:
    """MJCF in degrees with motors and gears, a spindle that slides and turns in one body, and masses from geoms."""
    text = """<mujoco model="scara"><compiler angle="degree"/><option gravity="0 0 -9.81"/>
      <default><motor ctrllimited="true"/><geom density="2700"/></default>
      <worldbody><geom name="floor" type="plane" size="2 2 0.1"/><body name="column" pos="0 0 0.4">
        <geom type="cylinder" size="0.08 0.2"/>
        <body name="arm" pos="0 0 0.1"><joint name="shoulder" damping="2" range="-130 130"/>
          <geom type="capsule" fromto="0 0 0 0.35 0 0" size="0.04"/>
          <body name="forearm" pos="0.35 0 0.08"><joint name="elbow" damping="1" frictionloss="0.8" range="-145 145"/>
            <geom type="box" size="0.15 0.04 0.03" pos="0.15 0 0"/>
            <body name="spindle" pos="0.3 0 0">
              <joint name="lift" type="slide" axis="0 0 -1" range="0 0.2" armature="3"/>
              <joint name="turn" armature="0.002" range="-350 350"/>
              <geom type="cylinder" size="0.012 0.2"/><geom type="sphere" size="0.03" pos="0.02 0 -0.2"/>
              <site name="tip" pos="0 0 -0.2"/></body></body></body></body></worldbody>
      <actuator><motor joint="shoulder" gear="80" ctrlrange="-2 2"/>
        <motor joint="elbow" gear="50" ctrlrange="-1.5 1.5"/>
        <motor joint="lift" gear="-600" ctrlrange="-0.7 0.7"/>
        <motor joint="turn" gear="20" ctrlrange="-0.5 0.5"/></actuator>
    </mujoco>"""
    return {"name": written(folder / "scara.mjcf", text), "limits": VELOCITY}


def dh_table(folder: Path) -> dict[str, Any]:
    """A folder with robot.toml: a table, gears, and a gripper, on a pedestal."""
    joints = "".join(
        f"""
[joints.{name}]
position = {{ lower = -160.0, upper = 160.0, unit = "deg" }}
velocity = {{ limit = 120.0, unit = "deg/s" }}
acceleration = {{ limit = 6.0, unit = "rad/s^2" }}
jerk = {{ limit = 60.0, unit = "rad/s^3" }}
effort = {{ limit = 150.0, unit = "N*m" }}
rotor_inertia = {{ value = 0.0001, unit = "kg*m^2" }}
gear_ratio = 100
"""
        for name in ("waist", "shoulder", "elbow")
    )
    text = f"""format = 1
name = "puma_like"
tool = "gripper"
reference = "made up"
gravity = {{ vector = [0.0, 0.0, -9.81], unit = "m/s^2" }}

[base]
position = [0.0, 0.0, "600 mm"]

[[tools]]
name = "gripper"
parent = "flange"
position = [0.0, 0.0, 0.1]
mass = 0.8
com = [0.0, 0.0, -0.03]

[dh]
convention = "modified"
rows = [
  {{ a = 0.0, alpha = 0.0, d = 0.0 }},
  {{ a = 0.0, alpha = "-90 deg", d = 0.24 }},
  {{ a = 0.43, alpha = 0.0, d = -0.09 }},
]
names = ["waist", "shoulder", "elbow"]
masses = [3.0, 12.0, 5.0]
coms = [[0.0, 0.0, 0.05], [0.07, 0.006, 0.016], [0.0, -0.07, 0.014]]
inertias = [[0.1, 0.1, 0.05], [0.13, 0.52, 0.54], [0.19, 0.02, 0.2]]
{joints}"""
    written(folder / "puma_like/robot.toml", text)
    return {"name": folder / "puma_like"}


def planar(folder: Path) -> Robot:
    """Links in a plane that stands upright on its side, by its base."""
    del folder
    limits = {"position": [-2.0, 2.0], "velocity": 2.0, "acceleration": 6.0, "jerk": 60.0, "effort": 60.0}
    base = {"position": [0.0, 0.0, 1.0], "rpy": ["90 deg", 0.0, 0.0]}
    return Robot.planar([0.4, 0.3], [2.0, 1.0], [0.2, 0.15], [0.03, 0.01], limits=limits, base=base)


ROBOTS = {
    make.__name__: make
    for make in (
        *(kinova_gen3, kinova_jaco, so_100, fanuc_m10ia, abb_irb2400, universal_robots_ur5e, kuka_iiwa14, franka_panda),
        *(ufactory_xarm7, staubli_rx160, yaskawa_parallel, denso_vs060, doosan_m1013, scara_mjcf, dh_table, planar),
    )
}
