"""Limits of a robot's joints, and the friction and armature that actuators add to the effort of the rigid bodies."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from trajevo.base.arrays import Array, read_only
from trajevo.errors import InvalidInputError


@dataclass(frozen=True, eq=False)
class JointLimits:
    """Limits of each joint, arrays of shape (n_joints,), SI: rad or m, s, N·m or N.

    Every limit is a number or an explicit ``inf``; none has a default.

    Attributes:
        lower: least position [rad or m].
        upper: greatest position [rad or m].
        velocity: greatest speed [rad/s or m/s].
        acceleration: greatest acceleration [rad/s² or m/s²].
        jerk: greatest jerk [rad/s³ or m/s³].
        effort: greatest torque or force [N·m or N].

    Raises:
        InvalidInputError: shapes differ, a limit is NaN or not positive, or lower is not below upper.
    """

    lower: Array
    upper: Array
    velocity: Array
    acceleration: Array
    jerk: Array
    effort: Array

    def __post_init__(self) -> None:
        for field in fields(self):
            values = read_only(getattr(self, field.name))
            object.__setattr__(self, field.name, values)
            if values.shape != self.lower.shape or values.ndim != 1:
                raise InvalidInputError(f"limits.{field.name}: expected shape {self.lower.shape}, got {values.shape}")
            if np.isnan(values).any():
                raise InvalidInputError(f"limits.{field.name}: expected numbers or inf, got NaN")
            if field.name not in ("lower", "upper") and not (values > 0.0).all():
                raise InvalidInputError(f"limits.{field.name}: expected positive numbers or inf, got {values.tolist()}")
        if not (self.lower < self.upper).all():
            raise InvalidInputError(
                f"limits: lower must be below upper, got {self.lower.tolist()} and {self.upper.tolist()}"
            )

    def range_used(self, q: Array) -> Array:
        """Share of its range that every joint uses at positions of shape (..., n_joints): 1 at an end of the range.

        With two finite limits this is |q - middle| over half the range. With one it is 1 + excess / |limit|, where a
        limit of 0 counts as 1 rad or m. Without any it is -inf.
        """
        low, high = np.isfinite(self.lower), np.isfinite(self.upper)
        finite = np.where(low, self.lower, np.where(high, self.upper, 0.0))
        one_sided = np.where(finite != 0.0, np.abs(finite), 1.0)
        half = 0.5 * (np.where(low & high, self.upper, 0.0) - np.where(low & high, self.lower, 0.0))
        size = np.where(low & high, half, one_sided)
        used: Array = np.where(low | high, 1.0 + np.maximum(q - self.upper, self.lower - q) / size, -np.inf)
        return used


@dataclass(frozen=True, eq=False)
class Friction:
    """What the actuators add to the rigid-body effort: viscous v + dry friction sign(v) + armature a, (n_joints,).

    Attributes:
        viscous: viscous friction [N·m·s/rad or N·s/m].
        coulomb: dry friction of a joint that moves forward [N·m or N].
        armature: inertia of motor and gear seen at the joint [kg·m² or kg].
        coulomb_backward: dry friction of a joint that moves backward [N·m or N]; as forward if None.

    Raises:
        InvalidInputError: shapes differ, or a number is negative or not finite.
    """

    viscous: Array
    coulomb: Array
    armature: Array
    coulomb_backward: Array | None = None

    def __post_init__(self) -> None:
        if self.coulomb_backward is None:
            object.__setattr__(self, "coulomb_backward", self.coulomb)
        for field in fields(self):
            values = read_only(getattr(self, field.name))
            object.__setattr__(self, field.name, values)
            if values.shape != self.viscous.shape or values.ndim != 1:
                raise InvalidInputError(
                    f"friction.{field.name}: expected shape {self.viscous.shape}, got {values.shape}"
                )
            if not (np.isfinite(values).all() and (values >= 0.0).all()):
                raise InvalidInputError(f"friction.{field.name}: expected numbers from 0 on, got {values.tolist()}")

    @cached_property
    def none(self) -> bool:
        """Whether all friction and armature is zero."""
        return not any(getattr(self, field.name).any() for field in fields(self))

    @cached_property
    def is_dry(self) -> bool:
        """Whether any joint has dry friction."""
        return bool(self.coulomb.any() or np.any(self.coulomb_backward))

    def effort(self, v: Array, a: Array) -> Array:
        """Added effort [N·m or N] at v and a of shape (..., n_joints); a joint at rest has no dry friction."""
        added: Array = self.viscous * v + self.dry(v) + self.armature * a
        return added

    def dry(self, v: Array) -> Array:
        """Dry friction alone at velocities of shape (..., n_joints) [N·m or N]."""
        against: Array = np.where(v.real > 0.0, self.coulomb, -np.asarray(self.coulomb_backward)) * (v.real != 0.0)
        return against


def least_share(kept: Array, full: Array) -> float:
    """Least share of the finite full limits that the kept ones are, shapes (n_joints,); 1 if nothing is limited."""
    limited = np.isfinite(full)
    return float((kept[limited] / full[limited]).min(initial=1.0))
