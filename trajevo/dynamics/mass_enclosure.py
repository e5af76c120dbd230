"""Payload masses with which motions keep effort limits at every instant: an interval, enclosed from both sides.

Effort is affine in the payload's mass, τ₀ + m τ₁. Over a piece of a motion (:mod:`trajevo.dynamics.piece_bounds`), τ₀
and τ₁ are polynomials through the same nodes, up to errors e₀ and e₁ and dry friction between d₋ and d₊. As a sum of
polynomials is the sum of their Bernstein coefficients b₀ and b₁, the effort keeps a limit over the whole piece if

    b₀ + m b₁ + e₀ + m e₁ + d₊ <= limit   and   -b₀ - m b₁ + e₀ + m e₁ - d₋ <= limit

for every coefficient. Each is linear in m, so that the piece has an interval of masses in closed form. The interval
common to all pieces is proven. The one that the samples allow is an outer bound. Pieces whose interval is narrower
than the outer one by more than the tolerance are halved.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, final

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.dynamics.complex_bounds import EffortReach
from trajevo.dynamics.payload_masses import mass_bounds
from trajevo.dynamics.piece_bounds import (
    LEAST_WIDTH,
    Pieces,
    dry_range,
    interpolation_errors,
    motion_bounds,
)
from trajevo.dynamics.rollout import Rollout
from trajevo.robot.joints import Sides
from trajevo.trajectory.bernstein import bernstein_halves, gauss, hull

#: Number of nodes of a piece.
_NODES = 14
#: Pieces that are bounded together, few enough for a processor's cache.
_BLOCK = 256
#: Greatest number of pieces of one motion to halve at a time; with more, its interval stays as wide as it is.
_MOST_PIECES = 2000
#: Share of a limit that a proven mass leaves unused, and by which a bound may exceed the limit and still count as
#: within, for rounding exactly at the limit; certificates allow as much.
_WITHIN = 1e-9
#: Masses are not told apart more finely than the mass whose effort is this share of a limit.
_FINEST = 1e-8


@final
@dataclass(frozen=True, eq=False)
class MassEnclosure:
    """The masses with which B motions keep every effort limit at every instant: an interval for each motion.

    Attributes:
        least: the interval from ``least`` to ``most`` is proven, shape (B,) [kg]; nothing is proven where it is empty.
        most: the other end, inf where no limit is ever reached, shape (B,) [kg].
        lower: some sample breaks a limit with any mass below ``lower`` or above ``upper``, shape (B,) [kg]; where
            ``lower`` exceeds ``upper``, with every mass.
        upper: the other end, inf where no sample bounds it, shape (B,) [kg].
        joint: index of the joint that sets ``upper``, -1 where none does, shape (B,).
        instants: instants that set ``lower`` and ``upper``, NaN where none does, shape (B, 2) [s].
        pieces: number of pieces that each motion was cut into, shape (B,).
    """

    least: Array
    most: Array
    lower: Array
    upper: Array
    joint: np.ndarray[Any, np.dtype[np.intp]]
    instants: Array
    pieces: np.ndarray[Any, np.dtype[np.intp]]

    @property
    def proven(self) -> Array:
        """Whether some mass is proven to keep every limit, shape (B,), bool."""
        return np.asarray(self.least <= self.most)


def enclose_masses(rollout: Rollout, effort_limits: Array | Sides, *, tolerance: float) -> MassEnclosure:
    """Enclose the masses with which motions keep effort limits, by adaptive subdivision.

    Args:
        rollout: one robot on B motions; its samples give the first outer bounds. Which masses it carries does not
            matter.
        effort_limits: limits of both directions or of each, inf for none, shape (n_joints,) [N·m or N].
        tolerance: greatest gap between either proven end of the interval and the outer bound, as a share of the bound;
            masses whose effort is below 1e-8 of a limit are not told apart. The gap is wider only where rounding or the
            greatest number of pieces ends the search.
    """
    count = len(rollout.trajectory)
    sides = Sides.of(effort_limits)
    outer, inner = _OuterMasses(rollout, sides), _InnerMasses(rollout, sides)
    least, most, used = np.zeros(count), np.full(count, np.inf), np.zeros(count, dtype=np.intp)
    shortest = LEAST_WIDTH * rollout.trajectory.duration.real
    pieces = Pieces.of(rollout, _NODES)
    while len(pieces.owner):
        low, high = inner.over(pieces, outer)
        most_least, least_most = outer.enough(tolerance)
        open_ = ~((low <= most_least[pieces.owner]) & (high >= least_most[pieces.owner]))
        open_ &= (outer.lower <= outer.upper)[pieces.owner] & (pieces.width > shortest[pieces.owner])
        open_ &= (np.bincount(pieces.owner[open_], minlength=count) <= _MOST_PIECES)[pieces.owner]
        np.maximum.at(least, pieces.owner[~open_], low[~open_])
        np.minimum.at(most, pieces.owner[~open_], high[~open_])
        np.add.at(used, pieces.owner[~open_], 1)
        pieces = pieces.rows(open_).halved()
    return MassEnclosure(
        least=frozen(np.maximum(least, outer.lower)),
        most=frozen(np.minimum(most, outer.upper)),
        lower=frozen(outer.lower),
        upper=frozen(outer.upper),
        joint=outer.joint,
        instants=frozen(outer.instants),
        pieces=used,
    )


@final
class _OuterMasses:
    """The masses that the samples so far allow: attributes as those of :class:`MassEnclosure`."""

    def __init__(self, rollout: Rollout, effort_limits: Sides) -> None:
        count = len(rollout.trajectory)
        self.effort_limits = effort_limits
        self.lower, self.upper = np.zeros(count), np.full(count, np.inf)
        self.joint = np.full(count, -1)
        self.instants = np.full((count, 2), np.nan)
        per_kilogram = rollout.effort_per_kilogram.real
        self.update(np.arange(count), rollout.t, rollout.unloaded_effort.real, per_kilogram)
        with np.errstate(divide="ignore"):
            scale = (effort_limits.lesser / np.abs(per_kilogram).max(axis=1)).min(axis=1)
        self.finest = _FINEST * np.where(np.isfinite(scale), scale, 0.0)

    def update(self, owner: Array, t: Array, unloaded: Array, per_kilogram: Array) -> None:
        """Take in samples at instants (K, N) of K pieces: efforts (K, N, n_joints)."""
        lower, upper = mass_bounds(unloaded, per_kilogram, self.effort_limits)
        for column, bound, best in ((0, -lower, -self.lower), (1, upper, self.upper)):
            flat = bound.reshape(len(bound), -1)
            where = flat.argmin(axis=1)
            value, before = flat[np.arange(len(flat)), where], best.copy()
            np.minimum.at(best, owner, value)
            setting = np.flatnonzero((value == best[owner]) & (value < before[owner]))
            instant, joint = np.divmod(where[setting], bound.shape[2])
            self.instants[owner[setting], column] = t[setting, instant]
            if column:
                self.joint[owner[setting]] = joint
            else:
                self.lower = -best

    def enough(self, tolerance: float) -> tuple[Array, Array]:
        """Ends of a proven interval that is wide enough, each (B,): the least may be so great, the most so small."""
        lower = self.lower + np.maximum(tolerance * self.lower, self.finest)
        finite = np.isfinite(self.upper)
        upper = np.where(finite, self.upper, 0.0)
        return lower, np.where(finite, upper - np.maximum(tolerance * upper, self.finest), self.upper)


@final
class _InnerMasses:
    """The masses that are proven over pieces of motions."""

    def __init__(self, rollout: Rollout, effort_limits: Sides) -> None:
        self.dynamics, self.friction = rollout.dynamics.of_real_parts, rollout.robot.friction
        self.reach = EffortReach.of(rollout.dynamics, any_mass=True)
        self.standing, self.degree = rollout.standing, rollout.trajectory.degree
        self.limited = np.flatnonzero(effort_limits.limited)
        self.limits = effort_limits[self.limited]

    def over(self, pieces: Pieces, outer: _OuterMasses) -> tuple[Array, Array]:
        """Least and greatest proven mass of each piece, shapes (K,) [kg]; its samples are taken into the outer ones."""
        low, high = np.empty(len(pieces.owner)), np.empty(len(pieces.owner))
        for start in range(0, len(low), _BLOCK):
            block = slice(start, start + _BLOCK)
            low[block], high[block] = self._over(Pieces(*(x[block] for x in pieces)), outer)
        return low, high

    def _over(self, pieces: Pieces, outer: _OuterMasses) -> tuple[Array, Array]:
        size = pieces.states.shape[1]
        q, v, a = np.split(pieces.states, 3, axis=-1)
        standing = self.standing[pieces.owner]
        dynamics = self.dynamics.of_rows(pieces.owner)
        per_kilogram = dynamics.effort_per_kilogram(q, v, a, pieces.segment)
        smooth = dynamics.unloaded_effort(q, v, a, pieces.segment) - self.friction.dry(v)
        exact = smooth + self.friction.dry(np.where(np.abs(v) <= standing[:, None], 0.0, v))
        instants = pieces.start[:, None] + pieces.width[:, None] * gauss(size)[0]
        outer.update(pieces.owner, instants, exact, per_kilogram)
        lowest, highest = dry_range(self.friction, *hull(np.moveaxis(v, 1, -1)), standing)
        with np.errstate(over="ignore", invalid="ignore"):
            bounds = motion_bounds(pieces.states, self.degree)
            magnitudes = self.reach.unloaded_and_per_kilogram(bounds, pieces.segment)
        constant, slope = (
            _Bernstein.of(values[..., self.limited], magnitude[..., self.limited])
            for values, magnitude in zip((smooth, per_kilogram), magnitudes, strict=True)
        )
        slope = slope.without_rounding()
        above, below = constant.error + highest[:, self.limited], constant.error - lowest[:, self.limited]
        sides = (
            _allowed(
                sign * constant.coefficients + more[..., None],
                sign * slope.coefficients + slope.error[..., None],
                limits,
            )
            for sign, more, limits in ((1.0, above, self.limits.forward), (-1.0, below, self.limits.backward))
        )
        (low, high), (other_low, other_high) = sides
        return np.maximum(low, other_low), np.minimum(high, other_high)


class _Bernstein(NamedTuple):
    """Functions over K pieces as polynomials: Bernstein coefficients of their halves (K, n, 2 N), errors (K, n)."""

    coefficients: Array
    error: Array
    rounding: Array

    @classmethod
    def of(cls, values: Array, magnitude: Array) -> _Bernstein:
        """From values at the nodes (K, N, n), and bounds of the magnitude on ellipses (K, ellipses, n)."""
        coefficients, slack = bernstein_halves(np.moveaxis(values, 1, -1))
        error, rounding = interpolation_errors([magnitude], values.shape[1])
        return cls(coefficients, error + slack, rounding + slack)

    def without_rounding(self) -> _Bernstein:
        """With functions that are mere rounding everywhere set to 0: such a joint does not feel a payload."""
        felt = ~(np.abs(self.coefficients).max(axis=-1) + self.error <= 2.0 * self.rounding)
        return _Bernstein(self.coefficients * felt[..., None], np.where(felt, self.error, 0.0), self.rounding)


def _allowed(constant: Array, slope: Array, limits: Array) -> tuple[Array, Array]:
    """Least and greatest m >= 0, (K,), with constant + m slope <= limit, shapes (K, n, C) twice and (n,)."""
    limits = limits[:, None]
    room = (1.0 - _WITHIN) * limits - constant
    room = np.where((room < 0.0) & (room >= -2.0 * _WITHIN * limits), 0.0, room)
    with np.errstate(divide="ignore", invalid="ignore"):
        mass = room / slope
    high = np.where(slope > 0.0, mass, np.inf).min(axis=(1, 2), initial=np.inf)
    low = np.where(slope < 0.0, mass, np.where((slope == 0.0) & (room < 0.0), np.inf, 0.0))
    return low.max(axis=(1, 2), initial=0.0), np.where(np.isnan(high), -np.inf, high)
