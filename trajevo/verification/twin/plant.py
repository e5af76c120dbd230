"""The plant: a robot with its payload in MuJoCo, joint by joint from trajevo's model.

MuJoCo's Runge-Kutta integrator of fourth order moves it under efforts that are held from step to step. There are no
contacts and no stops. Dry friction is MuJoCo's, a force up to a limit that holds a joint almost still: where a joint
rubs unequally in both directions, a constant force makes up the difference.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError
from trajevo.robot.robot import Robot
from trajevo.robot.transmission import Direct

#: Time constant of dry friction in integration steps, the shortest that MuJoCo allows, and how hard it is [1].
_FRICTION_STEPS, _FRICTION_HARDNESS = 2.0, 0.99


def _engine() -> Any:
    """MuJoCo, with what plays many motions in one call.

    Raises:
        InvalidInputError: it is not installed.
    """
    try:
        import mujoco
        import mujoco.rollout
    except ImportError as error:
        raise InvalidInputError(
            f"simulate: needs the package mujoco, pip install 'trajevo[twin]' brings it: {error}"
        ) from error
    return mujoco


@final
class Plant:
    """Copies of a robot that MuJoCo moves, one for each motion, with the same joints and masses of their own.

    Args:
        robot: the robot: its friction, armature, tool and gravity.
        models: one Pinocchio model for all copies, or one for each, with what they carry.
        step: integration step [s].

    Raises:
        InvalidInputError: MuJoCo is not installed or refuses the masses, or joints follow others.
    """

    def __init__(self, robot: Robot, models: Sequence[Any], step: float) -> None:
        self._mujoco = _engine()
        if not isinstance(robot.transmission, Direct):
            raise InvalidInputError(
                f"robot {robot.name!r}: expected actuators that drive one joint each; MuJoCo couples joints only "
                "softly, so coupled ones and followers are not simulated"
            )
        self._models = [self._compiled(robot, model, step) for model in models]
        first = self._models[0]
        self._columns = np.array([first.joint(name).dofadr[0] for name in robot.joint_names])
        self._spec = self._mujoco.mjtState.mjSTATE_FULLPHYSICS
        self._size = self._mujoco.mj_stateSize(first, self._spec)
        self._data = [self._mujoco.MjData(first)]
        self._player = self._mujoco.rollout.Rollout(nthread=0)
        # Forward friction less the mean of both directions.
        self._uneven = 0.5 * (robot.friction.coulomb - np.asarray(robot.friction.coulomb_backward))
        self._is_uneven = bool(self._uneven.any())

    def at(self, q: Array, v: Array) -> Array:
        """States of MuJoCo, shape (B, size), of copies at positions and velocities (B, n_joints) [SI]."""
        states = np.empty((len(q), self._size))
        data, model = self._data[0], self._models[0]
        for row, position, velocity in zip(states, q, v, strict=True):
            data.qpos[self._columns], data.qvel[self._columns] = position, velocity
            self._mujoco.mj_getState(model, data, row, self._spec)
        return states

    def positions(self, states: Array) -> Array:
        """Positions of the joints, shape (B, n_joints) [rad or m]."""
        return states[:, 1 + self._columns]

    def velocities(self, states: Array) -> Array:
        """Velocities of the joints, shape (B, n_joints) [rad/s or m/s]."""
        return states[:, 1 + len(self._columns) + self._columns]

    def moved(self, states: Array, efforts: Array, rows: Array) -> Array:
        """States after some integration steps, shape (B, size).

        Args:
            states: states before, shape (B, size).
            efforts: efforts of every step, shape (B, steps, n_joints) [N·m or N].
            rows: numbers of the copies that these are, shape (B,).
        """
        models = self._models * len(rows) if len(self._models) == 1 else [self._models[row] for row in rows]
        controls = np.ascontiguousarray(efforts - self._uneven if self._is_uneven else efforts)
        after = np.empty((*controls.shape[:2], self._size))
        # Shapes are right by construction; looking at them takes twice as long as a motion's step.
        self._player.rollout(
            models,
            self._data,
            np.ascontiguousarray(states),
            controls,
            skip_checks=True,
            nstep=controls.shape[1],
            state=after,
        )
        last: Array = after[:, -1]
        return last

    def _compiled(self, robot: Robot, model: Any, step: float) -> Any:
        mujoco = self._mujoco
        spec = mujoco.MjSpec()
        # Masses as they stand: none made physical; a body without mass that an armature moves weighs ten femtograms.
        spec.compiler.degree, spec.compiler.balanceinertia = False, False
        spec.compiler.boundmass = spec.compiler.boundinertia = 1e-14
        spec.option.timestep, spec.option.gravity = step, np.array(model.gravity.linear)
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
        off = mujoco.mjtDisableBit
        disabled = off.mjDSBL_CONTACT | off.mjDSBL_LIMIT | off.mjDSBL_AUTORESET
        spec.option.disableflags = int(disabled if robot.friction.is_dry else disabled | off.mjDSBL_CONSTRAINT)
        self._add_bodies(spec, robot, model, step)
        try:
            return spec.compile()
        except ValueError as error:
            raise InvalidInputError(f"robot {robot.name!r}: MuJoCo refuses it: {error}") from error

    def _add_bodies(self, spec: Any, robot: Robot, model: Any, step: float) -> None:
        """Bodies, joints and motors, each as the Pinocchio model and the robot's friction have them."""
        mujoco, friction = self._mujoco, robot.friction
        dry = 0.5 * (friction.coulomb + np.asarray(friction.coulomb_backward))
        axes, turns = robot.joint_axes
        bodies, quaternion = [spec.worldbody], np.empty(4)
        for number in range(1, model.njoints):
            k, placement, inertia = number - 1, model.jointPlacements[number], model.inertias[number]
            mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(placement.rotation).ravel())
            own = np.array(inertia.inertia)
            body = bodies[model.parents[number]].add_body(
                pos=placement.translation,
                quat=quaternion,
                mass=inertia.mass,
                ipos=inertia.lever,
                fullinertia=[*own.diagonal(), own[0, 1], own[0, 2], own[1, 2]],
                explicitinertial=True,
            )
            name = robot.joint_names[k]
            joint = body.add_joint(
                name=name,
                type=mujoco.mjtJoint.mjJNT_HINGE if turns[k] else mujoco.mjtJoint.mjJNT_SLIDE,
                axis=axes[k],
            )
            joint.armature, joint.frictionloss = friction.armature[k], dry[k]
            joint.damping = [friction.viscous[k], *[0.0] * (np.size(joint.damping) - 1)]
            joint.solref_friction = [_FRICTION_STEPS * step, 1.0]
            joint.solimp_friction[:2] = _FRICTION_HARDNESS
            spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT).set_to_motor()
            bodies.append(body)
