"""Effort of a motion that is sped up or slowed down: a quadratic in the speed, and the speeds that limits allow.

If time is stretched by the factor s, with the speed u = 1/s, the motion q(t/s) requires of every joint the effort

    τ(u) = g(q) ± dry friction + (viscous friction) u + (M q'' + C q' q' + armature q'') u²,

where primes are derivatives with respect to the time of the original motion. The velocity-dependent term of a
transmission is quadratic in u as well, so it is part of the last term. Both sides of -limit <= τ(u) <= limit are
quadratic inequalities, whose solutions are intervals.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import partial
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.rollout import Rollout
from trajevo.robot.joints import Sides


@final
@dataclass(frozen=True, eq=False)
class Effort:
    """Effort constant + linear u + quadratic u² at the speed u, arrays of shape (..., T, n_joints) [N·m or N].

    Attributes:
        constant: effort at rest and dry friction.
        linear: viscous friction.
        quadratic: inertial effort.
    """

    constant: Array
    linear: Array
    quadratic: Array

    def at(self, speed: float) -> Array:
        """Effort at a speed, relative to that of the original motion, shape (..., T, n_joints) [N·m or N]."""
        effort: Array = self.constant + speed * (self.linear + speed * self.quadratic)
        return effort

    def excluded(self, limit: Array | Sides) -> tuple[Array, Array]:
        """Speeds at which the effort exceeds a limit of shape (n_joints,), of both directions or each; it may be inf.

        Returns:
            Lower and upper ends of open intervals, two for each side of the limit, shapes (4, ..., T, n_joints); an
            interval whose ends are equal is empty.
        """
        sides = Sides.of(limit)
        ends = []
        for sign, side in ((1.0, sides.forward), (-1.0, sides.backward)):
            bounded = np.where(np.isfinite(side), side, 0.0)
            found = _positive(sign * self.constant - bounded, sign * self.linear, sign * self.quadratic)
            ends.append([np.where(np.isfinite(side), each, 0.0) for each in found])
        lower, upper = (np.concatenate(each) for each in zip(*ends, strict=True))
        return lower, upper


@final
@dataclass(frozen=True, eq=False)
class EffortOfPath:
    """Effort at instants of a motion by powers of its speed, without payload and per kilogram, (..., T, n_joints).

    Attributes:
        held: effort at rest, without payload [N·m or N].
        held_per_kilogram: what each kilogram adds to ``held`` [N·m/kg or N/kg].
        dry: dry friction in the direction of motion [N·m or N].
        viscous: viscous friction at the speed of the original motion [N·m or N].
        inertial: inertial effort at that speed, without payload [N·m or N].
        inertial_per_kilogram: what each kilogram adds to ``inertial`` [N·m/kg or N/kg].
    """

    held: Array
    held_per_kilogram: Array
    dry: Array
    viscous: Array
    inertial: Array
    inertial_per_kilogram: Array

    @classmethod
    def of(cls, rollout: Rollout, q: Array, v: Array, a: Array, segments: Array | None = None) -> EffortOfPath:
        """The terms in given states of a rollout's motions, shapes (..., T, n_joints), with its payload per kilogram.

        Velocities that are mere rounding should be 0, see
        :meth:`~trajevo.dynamics.rollout.Rollout.without_rounding`. The segments of the states, shape (T,), are needed
        where loads change on the way.
        """
        unloaded, per_kilogram = (
            partial(effort, segments=segments, axis=q.ndim - 2)
            for effort in (rollout.dynamics.unloaded_effort, rollout.dynamics.effort_per_kilogram)
        )
        still = np.zeros_like(v)
        held, held_per_kilogram = unloaded(q, still, still), per_kilogram(q, still, still)
        friction = rollout.robot.friction
        rubbing, viscous = friction.effort(v, still), friction.viscous * v
        return cls(
            held=held,
            held_per_kilogram=held_per_kilogram,
            dry=rubbing - viscous,
            viscous=viscous,
            inertial=unloaded(q, v, a) - held - rubbing,
            inertial_per_kilogram=per_kilogram(q, v, a) - held_per_kilogram,
        )

    def joined(self, other: EffortOfPath, places: Array) -> EffortOfPath:
        """Instants of this and of another motion, in the order of the indices ``places``, (T + T of the other,)."""
        return EffortOfPath(
            *(
                np.concatenate([getattr(self, field.name), getattr(other, field.name)])[places]
                for field in fields(EffortOfPath)
            )
        )

    def carrying(self, mass: float | Array) -> Effort:
        """Effort with a payload [kg]; for several motions, one mass for each, shape (B, 1, 1)."""
        return Effort(
            self.held + mass * self.held_per_kilogram + self.dry,
            self.viscous,
            self.inertial + mass * self.inertial_per_kilogram,
        )


def allowed_speeds(lower: Array, upper: Array) -> tuple[Array, int]:
    """The closed intervals that are left of [0, inf) when open intervals are removed.

    Args:
        lower: their lower ends, shape (N,).
        upper: their upper ends, shape (N,).

    Returns:
        Closed intervals of more than one speed, ascending, shape (K, 2), and the index of the open interval that bounds
        the last of them from above, -1 if none does or nothing is left.
    """
    real = np.flatnonzero(upper > lower)
    order = real[np.argsort(lower[real], kind="stable")]
    ends = np.append(lower[order], np.inf)
    begins = np.append(0.0, np.maximum.accumulate(upper[order]))
    gaps = np.flatnonzero(ends > begins)
    bound = int(order[gaps[-1]]) if len(gaps) and gaps[-1] < len(order) else -1
    return np.column_stack([begins[gaps], ends[gaps]]), bound


def greatest_allowed(lower: Array, upper: Array) -> Array:
    """The greatest speed of [0, inf) that is left when open intervals are removed, for many motions at once.

    Args:
        lower: their lower ends, shape (B, N).
        upper: their upper ends, shape (B, N).

    Returns:
        Shape (B,), 0 where no more than one speed is left; inf where nothing bounds it.
    """
    order = np.argsort(np.where(upper > lower, lower, np.inf), axis=1, kind="stable")
    begins, ends = (np.take_along_axis(side, order, axis=1) for side in (lower, upper))
    real, none = ends > begins, np.zeros((len(lower), 1))
    begins = np.concatenate([np.where(real, begins, np.inf), none + np.inf], axis=1)
    covered = np.maximum.accumulate(np.concatenate([none, np.where(real, ends, 0.0)], axis=1), axis=1)
    greatest: Array = np.where(begins > covered, begins, 0.0).max(axis=1)
    return greatest


def _positive(constant: Array, linear: Array, quadratic: Array) -> tuple[Array, Array]:
    """Where constant + linear u + quadratic u² > 0 for u >= 0: ends of two open intervals, shapes (2, ...)."""
    discriminant = linear**2 - 4.0 * quadratic * constant
    real = discriminant > 0.0
    # The root of greater magnitude first: computed alike, the other would be a difference of almost equal numbers.
    sum_of_both = -0.5 * (linear + np.copysign(np.sqrt(np.where(real, discriminant, 0.0)), linear))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        roots = sum_of_both / quadratic, constant / sum_of_both
    low, high = np.fmin(*roots), np.fmax(*roots)
    line = constant / np.where(linear != 0.0, -linear, 1.0)
    # A parabola is positive outside its roots if it opens upwards, else between them; a line on one side of its root.
    up, down, rising, falling = quadratic > 0.0, quadratic < 0.0, linear > 0.0, linear < 0.0
    flat = (quadratic == 0.0) & (linear == 0.0)
    straight = (quadratic == 0.0) & ~flat
    everywhere = (up & ~real) | (flat & (constant > 0.0))
    first = np.select([everywhere, straight & rising, up, down & real], [0.0, line, high, low], 0.0)
    first_end = np.select([everywhere | (straight & rising) | up, down & real], [np.inf, high], 0.0)
    second_end = np.select([everywhere, straight & falling, up], [0.0, line, low], 0.0)
    lower = np.maximum(np.stack([first, np.zeros_like(first)]), 0.0)
    return lower, np.maximum(np.stack([first_end, second_end]), lower)
