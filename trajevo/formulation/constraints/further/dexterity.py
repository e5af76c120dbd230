"""Limits of how near a robot comes to its singular postures, at the samples of a rollout.

They are measured on the Jacobian of the tool: all six of its rows for arms of six joints or more, those of the linear
velocity for others, and of these only the directions in which the tool can move at all, such as those of the plane of a
planar arm. Manipulability is √det(J Jᵀ), the product of J's singular values (Yoshikawa, International Journal of
Robotics Research 4(2), 1985); the least singular value is the distance to the nearest singular matrix.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import final

import numpy as np

from trajevo.base.arrays import Array, read_only
from trajevo.dynamics.rollout import Rollout
from trajevo.formulation.constraints.constraint import Constraint, Limited, LimitKind, LimitParameter
from trajevo.robot.kinematics import ToolKinematics
from trajevo.robot.robot import Robot

#: Joints from which on the tool's angular velocity counts too.
_WHOLE = 6
#: Random postures that tell in which directions a tool moves, and share of the greatest motion that is none.
_TRIED, _NONE = 24, 1e-9


@final
@dataclass(frozen=True, eq=False)
class Dexterity:
    """How far a robot's postures are from singular ones; made by :meth:`of`.

    Attributes:
        kinematics: of the tool.
        directions: orthonormal directions of the tool's velocity that count, shape (D, 6).
    """

    kinematics: ToolKinematics
    directions: Array

    @classmethod
    def of(cls, robot: Robot) -> Dexterity:
        """That of a robot.

        Raises:
            InvalidInputError: the robot is joints and limits alone.
        """
        kinematics = ToolKinematics.of(robot)
        rows = 6 if robot.dof >= _WHOLE else 3
        postures = np.random.default_rng(0).uniform(-1.0, 1.0, (_TRIED, robot.dof))
        moved = np.concatenate(list(kinematics.jacobian(postures)[:, :rows]), axis=1)
        directions, sizes, _ = np.linalg.svd(moved)
        count = int((sizes > _NONE * sizes[0]).sum())
        whole = np.zeros((count, 6))
        whole[:, :rows] = directions[:, :count].T
        if count == rows:
            whole[:, :rows] = np.eye(rows)
        return cls(kinematics, read_only(whole))

    def manipulability(self, q: Array) -> Array:
        """√det(J Jᵀ), joint positions (..., n_joints) -> (...) [m and rad per rad or m, their product]."""
        jacobian = self._jacobian(q)
        turned = np.swapaxes(jacobian, -1, -2)
        wide = jacobian.shape[-2] <= jacobian.shape[-1]
        squared = np.linalg.det(jacobian @ turned if wide else turned @ jacobian)
        found: Array = np.sqrt(np.where(squared.real > 0.0, squared, 0.0))
        return found

    def least_singular_value(self, q: Array) -> Array:
        """Least singular value of J, joint positions (..., n_joints) -> (...); its derivative by complex steps too."""
        jacobian = self._jacobian(q)
        left, sizes, right = np.linalg.svd(jacobian.real, full_matrices=False)
        found: Array = sizes[..., -1]
        if np.iscomplexobj(jacobian):
            stepped = (left[..., :, -1, None] * jacobian.imag * right[..., -1, None, :]).sum(axis=(-1, -2))
            found = found + 1j * stepped
        return found

    def _jacobian(self, q: Array) -> Array:
        found: Array = self.directions @ self.kinematics.jacobian(q)
        return found


@final
@dataclass(frozen=True, eq=False)
class TooLittle:
    """What lacks of a least value at every sample, as a share of it, shape (B, T).

    Attributes:
        measure: joint positions (..., n_joints) -> measure, shape (...).
        least: the least value.
    """

    measure: Callable[[Array], Array]
    least: float

    def __call__(self, rollout: Rollout) -> Array:
        """The shares."""
        lacking: Array = 1.0 - self.measure(rollout.q) / self.least
        return lacking


@final
@dataclass(frozen=True, eq=False)
class _Worst:
    """The greatest of the terms, shape (B, 1)."""

    terms: Callable[[Rollout], Array]

    def __call__(self, rollout: Rollout) -> Array:
        worst: Array = self.terms(rollout).max(axis=1, keepdims=True)
        return worst


def _limit(name: str, measure: Callable[[Array], Array], least: float) -> Constraint:
    terms = TooLittle(measure, least)
    return Constraint((name,), f"{name} of at least {least:g}", _Worst(terms), terms, quantity=name, unit="1")


def manipulability_limit(limited: Limited, manipulability: float) -> Constraint:
    """The share by which the manipulability at the samples falls short of a least one."""
    limited.robot.check_body("a limit of manipulability")
    return _limit("manipulability", Dexterity.of(limited.robot).manipulability, manipulability)


def singular_value_limit(limited: Limited, least_singular_value: float) -> Constraint:
    """The share by which the Jacobian's least singular value at the samples falls short of a least one."""
    limited.robot.check_body("a limit of the least singular value")
    measure = Dexterity.of(limited.robot).least_singular_value
    return _limit("least singular value", measure, least_singular_value)


MANIPULABILITY = LimitKind(
    "manipulability",
    "manipulability √det(J Jᵀ) of the tool's Jacobian, at the samples",
    manipulability_limit,
    (LimitParameter("manipulability", "1", "least manipulability, from lengths in m and angles in rad"),),
)

SINGULARITY = LimitKind(
    "least_singular_value",
    "least singular value of the tool's Jacobian, the distance to singularities, at the samples",
    singular_value_limit,
    (LimitParameter("least_singular_value", "1", "least singular value, from lengths in m and angles in rad"),),
)
