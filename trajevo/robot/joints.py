"""Limits of a robot's joints, and the friction and armature that actuators add to the effort of the rigid bodies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, final

import numpy as np

from trajevo.base.arrays import Array, read_only
from trajevo.base.shown.brief import brief
from trajevo.base.shown.html import Piece, table
from trajevo.base.units import per_time, pretty
from trajevo.errors import InvalidInputError

if TYPE_CHECKING:
    from trajevo.robot.robot import Robot

#: Limits that may differ by the direction of the joint, and what ends the names of those of the negative one.
DIRECTED, _BACKWARD = ("velocity", "acceleration", "effort"), "_backward"


@final
@dataclass(frozen=True, eq=False)
class Sides:
    """What a quantity of each joint may be at most forward and backward, both magnitudes, arrays (n_joints,).

    Attributes:
        forward: greatest positive value, inf for none [SI unit of the quantity].
        backward: greatest magnitude of a negative value, inf for none [the same unit]; the same array if both
            directions agree.
    """

    forward: Array
    backward: Array

    __repr__ = brief

    @classmethod
    def of(cls, limit: Array | Sides) -> Sides:
        """Sides from a limit of both directions, shape (n_joints,); sides stay as they are."""
        return limit if isinstance(limit, Sides) else cls(limit, limit)

    @property
    def agree(self) -> bool:
        """Whether every joint has one limit for both directions."""
        return self.backward is self.forward

    @cached_property
    def lesser(self) -> Array:
        """The lesser of both directions, shape (n_joints,)."""
        return self.forward if self.agree else np.minimum(self.forward, self.backward)

    @cached_property
    def greater(self) -> Array:
        """The greater of both directions, shape (n_joints,)."""
        return self.forward if self.agree else np.maximum(self.forward, self.backward)

    @property
    def limited(self) -> Array:
        """Which joints have a limit in a direction at least, shape (n_joints,)."""
        return np.isfinite(self.lesser)

    @property
    def both(self) -> Array:
        """Forward and backward along a new first axis, shape (2, n_joints)."""
        return np.stack([self.forward, self.backward])

    def __getitem__(self, chosen: Any) -> Sides:
        """The sides of chosen joints."""
        forward: Array = self.forward[chosen]
        return Sides(forward, forward if self.agree else self.backward[chosen])

    def times(self, factor: float | Array) -> Sides:
        """Both directions times a factor, also one for each joint (n_joints,)."""
        forward = self.forward * factor
        return Sides(forward, forward if self.agree else self.backward * factor)

    def told(self, values: Array) -> Array:
        """The limit in the direction of each value, shape (..., n_joints); the other where only that is limited."""
        toward = self.toward(values)
        return toward if self.agree else np.where(np.isfinite(toward), toward, self.lesser)

    def opposite(self) -> Sides:
        """The sides of a joint that turns the other way."""
        return Sides(self.backward, self.forward)

    def toward(self, values: Array) -> Array:
        """The limit in the direction of each value of shape (..., n_joints); of complex ones the real parts count."""
        return self.forward if self.agree else np.where(values.real < 0.0, self.backward, self.forward)

    def share(self, values: Array) -> Array:
        """Share of the limit in its direction that each real value uses, shape (..., n_joints)."""
        used: Array = np.abs(values) / self.toward(values)
        return used

    def share_between(self, least: Array, greatest: Array) -> Array:
        """Greatest share that least and greatest values use, shape (..., n_joints), complex steps kept."""
        up, down = greatest / self.forward, -least / self.backward
        return np.where(up.real >= down.real, up, down)

    def as_lesser(self, values: Array) -> Array:
        """Magnitudes that use the same share of the lesser limit as values (..., n_joints) of that in their direction.

        Where no direction is limited, and where both agree, these are the plain magnitudes.
        """
        return np.asarray(np.abs(values) if self.agree else np.abs(values) * self.weights(values))

    def weights(self, values: Array) -> Array:
        """Factor of the magnitude of each value in :meth:`as_lesser`, shape (..., n_joints)."""
        toward = np.where(self.limited, self.toward(values), 1.0)
        return np.where(self.limited, self.lesser / toward, 1.0)


@dataclass(frozen=True, eq=False)
class JointLimits:
    """Limits of each joint, arrays of shape (n_joints,), SI: rad or m, s, N·m or N.

    Every limit is a number or an explicit ``inf``; none has a default. Limits of velocity, acceleration and effort are
    magnitudes for both directions, unless those of the negative direction are given apart.

    Attributes:
        lower: least position [rad or m].
        upper: greatest position [rad or m].
        velocity: greatest speed [rad/s or m/s].
        acceleration: greatest acceleration [rad/s² or m/s²].
        jerk: greatest jerk [rad/s³ or m/s³].
        effort: greatest torque or force [N·m or N].
        velocity_backward: greatest speed of a joint that moves backward [rad/s or m/s]; None if as forward.
        acceleration_backward: greatest magnitude of a negative acceleration [rad/s² or m/s²]; None if as forward.
        effort_backward: greatest magnitude of a negative effort [N·m or N]; None if as forward.

    Raises:
        InvalidInputError: shapes differ, a limit is NaN or not positive, or lower is not below upper.
    """

    lower: Array
    upper: Array
    velocity: Array
    acceleration: Array
    jerk: Array
    effort: Array
    velocity_backward: Array | None = None
    acceleration_backward: Array | None = None
    effort_backward: Array | None = None

    __repr__ = brief

    def __post_init__(self) -> None:
        for field in fields(self):
            if getattr(self, field.name) is None and field.name.endswith(_BACKWARD):
                continue
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
        for name in DIRECTED:  # limits that agree are one limit, so that replacing it replaces both
            if np.array_equal(getattr(self, name), getattr(self, name + _BACKWARD)):
                object.__setattr__(self, name + _BACKWARD, None)

    def sides(self, name: str) -> Sides:
        """Limits of ``"velocity"``, ``"acceleration"``, ``"jerk"`` or ``"effort"`` in both directions."""
        forward: Array = getattr(self, name)
        backward: Array | None = getattr(self, name + _BACKWARD) if name in DIRECTED else None
        return Sides(forward, forward if backward is None else backward)

    def bounds(self, name: str) -> tuple[Array, Array]:
        """Least and greatest value of a quantity of each joint, two arrays (n_joints,) [SI unit of the quantity]."""
        if name == "position":
            return self.lower, self.upper
        sides = self.sides(name)
        return -sides.backward, sides.forward

    def scaled(self, shares: Mapping[str, float]) -> JointLimits:
        """The same with shares of limits, by name, of which both directions are scaled."""
        changed = {name: getattr(self, name) * share for name, share in shares.items()}
        for name, share in shares.items():
            backward = getattr(self, name + _BACKWARD) if name in DIRECTED else None
            if backward is not None:
                changed[name + _BACKWARD] = backward * share
        return replace(self, **changed)

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

    __repr__ = brief

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


def limits_table(limits: JointLimits, names: Sequence[str], units: Sequence[str]) -> Piece:
    """The limits of all joints as a notebook shows them, with their units; two where the directions differ."""
    rows = []
    for k, (name, unit) in enumerate(zip(names, units, strict=True)):
        told = [name, f"{limits.lower[k]:.4g} to {limits.upper[k]:.4g} {unit}"]
        for order, quantity in enumerate(("velocity", "acceleration", "jerk", "effort"), start=1):
            of = ("N·m" if unit == "rad" else "N") if quantity == "effort" else pretty(per_time(unit, order))
            sides = limits.sides(quantity)
            both = dict.fromkeys((f"{sides.forward[k]:.4g}", f"{sides.backward[k]:.4g}"))
            told.append("none" if list(both) == ["inf"] else f"{' / '.join(both)} {of}")
        rows.append(told)
    return table(("joint", "position", "velocity", "acceleration", "jerk", "effort"), rows)


def length_unit(robot: Robot) -> str:
    """Unit in which lengths of a robot are shown: mm if all joints are linear, as of machine tools, otherwise m."""
    return "mm" if set(robot.joint_units) == {"m"} else "m"


def position_unit(robot: Robot) -> str:
    """Unit of a position of any joint: rad, m, or both if the robot has revolute and prismatic joints."""
    return " or ".join(sorted(set(robot.joint_units), reverse=True))
