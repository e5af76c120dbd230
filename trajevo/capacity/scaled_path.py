"""Efforts and joint limits of a motion that is scaled uniformly in time: the speeds they allow, and their proof.

The allowed speeds have a closed form, see :mod:`trajevo.dynamics.path_effort`; instants are added where the effort
peaks between samples. The least factor of time that they leave is then enlarged until enclosures of the efforts prove
that no instant exceeds a limit. Effort need not fall with the speed, so that only the proof itself decides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.capacity.capacity import your_margin
from trajevo.capacity.dlcc import sampled_motion
from trajevo.capacity.scaled_constraints import ScaledConstraints, Watched, least_kept, next_allowed
from trajevo.dynamics.enclosure import decide
from trajevo.dynamics.path_effort import EffortOfPath, allowed_speeds
from trajevo.dynamics.payload_masses import mass_bounds
from trajevo.dynamics.piece_bounds import PieceBounds, Pieces
from trajevo.dynamics.rollout import Rollout
from trajevo.front.front import Solution
from trajevo.robot.payload import Payload
from trajevo.solvers.gradient.weighted_sum import WeightedOptimum
from trajevo.trajectory.peak_shares import peak_shares

#: Limits of joints that can bound the speed, in the order of a slowdown's utilisation.
SCALED_LIMITS = ("velocity", "acceleration", "jerk", "effort")

#: Share of an effort limit that counts as rounding.
_ROUNDING = 1e-12

#: Utilisation from which a peak of effort between samples is searched, and number of peaks at a time.
_NEAR, _PEAKS = 0.9, 64

#: Number of new instants between the neighbours of a peak, and greatest number of rounds that add them.
_ZOOM, _ROUNDS = 21, 16

#: Relative change of the speed that ends the search.
_SETTLED = 1e-11

#: Number of nodes of each piece in a proof.
_NODES = 10

#: By how much the least factor of time is enlarged until it is proven, as a share of it.
_ENLARGED = tuple(10.0**power for power in range(-8, -1))

#: Halvings of the last of these steps.
_HALVINGS = 3

#: Greatest number of times that instants are added where a proof found an effort beyond its limit.
_CORRECTIONS = 8


class Bound(NamedTuple):
    """What bounds the speed: name of the limit, name of the joint or ``""``, instant of the original motion [s]."""

    limit: str
    joint: str
    time: float


@final
class ScaledPath:
    """One motion: its effort by powers of the speed, at instants that are added as needed, and its other limits.

    Args:
        motion: a solution of a front, an optimum, or the first trajectory of a rollout.
        samples: instants per segment at the start, both ends included.
        shape: a payload that gives shape and model; the motion's own if None.
        full: whether the robot's full limits are meant, without the margins of the motion's problem.
    """

    def __init__(
        self,
        motion: Solution | Rollout | WeightedOptimum,
        samples: int,
        shape: Payload | None = None,
        *,
        full: bool = False,
    ) -> None:
        given = sampled_motion(motion, samples)
        if shape is not None and shape != given.dynamics.payload:
            given = replace(given, dynamics=replace(given.dynamics, payload=shape))
        self.rollout = replace(given, kept_limits=None) if full else given
        self.constraints = ScaledConstraints.of(motion, full=full)
        self.limits = self.rollout.limits
        self.t: Array = self.rollout.t[0]
        v = self.rollout.without_rounding(self.rollout.v)
        self.effort = EffortOfPath.of(self.rollout, self.rollout.q[0], v[0], self.rollout.a[0], self.rollout.segments)
        trajectory = self.rollout.trajectory
        #: Share of the limit at the original speed, rows velocity, acceleration, jerk.
        self.shares = np.concatenate(
            [
                peak_shares(trajectory, order, self.limits.sides(name))
                for order, name in enumerate(SCALED_LIMITS[:3], start=1)
            ]
        )
        with np.errstate(divide="ignore"):
            self.greatest_speeds = self.shares ** (-1.0 / np.array([[1.0], [2.0], [3.0]]))

    @property
    def _masses_at_rest(self) -> tuple[Array, Array]:
        return mass_bounds(self.effort.held, self.effort.held_per_kilogram, self.limits.sides("effort"))

    @cached_property
    def static_bound(self) -> float:
        """The greatest payload [kg] held at rest at all instants; -inf if no mass, not even 0, can be held."""
        least, greatest = (masses.ravel() for masses in self._masses_at_rest)
        return float(greatest.min()) if least.max() <= greatest.min() else -np.inf

    def held(self, mass: float) -> bool:
        """Whether a payload [kg] can be held at rest at all instants."""
        held = self.effort.held + mass * self.effort.held_per_kilogram
        return bool((np.abs(held) <= self.limits.sides("effort").toward(held) * (1.0 + _ROUNDING)).all())

    def not_held(self, mass: float) -> str:
        """Text that says which mass the robot cannot hold at rest, and which it can."""
        least, greatest = self._masses_at_rest
        binding, short = (least, mass < least.max()) if mass < least.max() else (-greatest, False)
        instant, joint = (int(i) for i in np.unravel_index(binding.argmax(), binding.shape))
        where = f"{self.rollout.robot.joint_names[joint]} can hold at rest at {self.t[instant]:.4f} s of this motion"
        margin = self.rollout.effort_margin
        if margin:
            where += f" with {your_margin(margin)}"
        if np.isinf(least.max()):
            return f"expected a path along which the robot can hold itself, but no mass is what {where}"
        bound = (
            f"at least {least.max():.6f} kg as a counterweight, the least that"
            if short
            else (f"at most {greatest.min():.6f} kg, which")
        )
        return f"expected {bound} {where}, got {mass:g} kg"

    def carrying(self, payload: Payload) -> Rollout:
        """The motion with a payload."""
        return replace(self.rollout, dynamics=replace(self.rollout.dynamics, payload=payload))

    def allowed(self, mass: float) -> tuple[Array, Bound | None]:
        """Factors of time that all limits with a closed form but that of the duration allow, and what bounds them.

        Instants are added until the least factor settles.

        Args:
            mass: mass of a payload of the path's shape [kg].

        Returns:
            Ascending intervals, shape (K, 2), none if no speed suits, and the bound of the least; None if nothing
            bounds it.
        """
        before = -1.0
        for _ in range(_ROUNDS):
            speeds, bound = self._speeds(mass)
            if bound < 0 or abs(float(speeds[-1, 1]) - before) <= _SETTLED * before:
                break
            before = float(speeds[-1, 1])
            self._look_closer(mass, before)
        with np.errstate(divide="ignore"):
            return 1.0 / speeds[::-1, ::-1], None if bound < 0 else self._bound(bound)

    def _speeds(self, mass: float) -> tuple[Array, int]:
        """Allowed speeds, and the index of the binding interval: joints first, then constraints, then efforts."""
        lower, upper = self.effort.carrying(mass).excluded(self.limits.sides("effort").times(1.0 + _ROUNDING))
        others = [scaling.greatest_speed for scaling in self.constraints.scalings]
        bounded = np.concatenate([self.greatest_speeds.ravel(), others])
        return allowed_speeds(
            np.concatenate([bounded, lower.ravel()]), np.concatenate([np.full_like(bounded, np.inf), upper.ravel()])
        )

    def _bound(self, index: int) -> Bound:
        names, scalings = self.rollout.robot.joint_names, self.constraints.scalings
        if index < self.shares.size:
            kind, joint = divmod(index, len(names))
            derivative = self.rollout.trajectory.evaluate(self.t[None], kind + 1)[0, :, joint]
            counted = self.limits.sides(SCALED_LIMITS[kind])[joint].as_lesser(derivative)
            return Bound(SCALED_LIMITS[kind], names[joint], float(self.t[counted.argmax()]))
        index -= self.shares.size
        if index < len(scalings):
            return Bound(scalings[index].name, "", scalings[index].time)
        index -= len(scalings)
        _, instant, place = np.unravel_index(index, (4, len(self.t), len(names)))
        return Bound("effort", names[int(place)], float(self.t[instant]))

    def utilisation(self, mass: float, speed: float) -> Array:
        """Share of each limit of each joint at a speed, rows as :data:`SCALED_LIMITS`; effort at the instants."""
        used = self.limits.sides("effort").share(self.effort.carrying(mass).at(speed))
        return np.vstack([self.shares * speed ** np.array([[1.0], [2.0], [3.0]]), used.max(axis=0)])

    def _look_closer(self, mass: float, speed: float) -> None:
        """Add instants around the greatest peaks of effort at a speed."""
        used = self.limits.sides("effort").share(self.effort.carrying(mass).at(speed))
        padded = np.pad(used, ((1, 1), (0, 0)), constant_values=-np.inf)
        peaks = np.where((used >= padded[:-2]) & (used >= padded[2:]) & (used >= _NEAR), used, -np.inf).max(axis=1)
        order = np.argsort(-peaks, kind="stable")[:_PEAKS]
        chosen = order[peaks[order] > -np.inf]
        if not len(chosen):
            return
        low, high = self.t[np.maximum(chosen - 1, 0)], self.t[np.minimum(chosen + 1, len(self.t) - 1)]
        shares = np.linspace(0.0, 1.0, _ZOOM + 2)[1:-1]
        # Breaks are among the instants twice, so none of these ranges crosses a break.
        self._add(low[:, None] + (high - low)[:, None] * shares)

    def _add(self, instants: Array) -> None:
        new = np.setdiff1d(instants, self.t)
        if not len(new):
            return
        trajectory = self.rollout.trajectory
        q, v, a = (trajectory.evaluate(new[None], order) for order in range(3))
        segments = self.rollout.segments_at(new)[0]
        extra = EffortOfPath.of(self.rollout, q[0], self.rollout.without_rounding(v)[0], a[0], segments)
        sorted_places = np.argsort(np.concatenate([self.t, new]), kind="stable")
        self.t = np.concatenate([self.t, new])[sorted_places]
        self.effort = self.effort.joined(extra, sorted_places)

    def proves(self, motion: Rollout, factor: float) -> bool | None:
        """Whether every effort keeps its limit at every instant of a scaled motion, None if that is not decided.

        Where one does not, the instant is added to those of the path.

        Args:
            motion: the original motion with a payload, see :meth:`carrying`.
            factor: factor of time.
        """
        limits = self.limits.sides("effort").lesser
        if np.isinf(limits).all():
            return True
        slower = replace(motion, trajectory=motion.trajectory.slowed(factor))
        watch = Watched(PieceBounds.of(slower).efforts, limits)
        found = decide(watch, Pieces.of(slower, _NODES), limits, motions=1)[0]
        if (found <= limits).all():
            return True
        if watch.most <= 1.0:
            return None
        self._add(np.array([watch.instant / factor]))
        return False


@final
@dataclass(frozen=True, eq=False)
class LeastFactor:
    """The least factor of time for one or more payloads along one path.

    Attributes:
        factor: the factor, proven if that is possible.
        sampled: the least factor at instants alone.
        proven: whether every limit of the joints is proven to be kept at every instant at ``factor``.
        allowed: factors that all limits with a closed form allow, as ascending intervals, shape (K, 2).
        bounds: what bounds the factor, for each payload; None if nothing does.
        not_kept: names of constraints of the problem that are broken at ``factor``.
    """

    factor: float
    sampled: float
    proven: bool
    allowed: Array
    bounds: tuple[Bound | None, ...]
    not_kept: tuple[str, ...]


def least_factor(paths: Sequence[ScaledPath], payloads: Sequence[Payload], *, prove: bool = True) -> LeastFactor | None:
    """The least factor of time with which a path carries each of several payloads; None if no factor does.

    Args:
        paths: the same path with the shape of each payload.
        payloads: the payloads.
        prove: whether to enlarge the factor until it is proven; otherwise it is that at the instants.
    """
    motions = [path.carrying(payload) for path, payload in zip(paths, payloads, strict=True)]
    for corrections in range(_CORRECTIONS + 1):
        found = _at_instants(paths, payloads, motions)
        if found is None or not prove or found.sampled == 0.0:  # 0 where nothing bounds the speed
            break
        found, corrected = _proven(found, paths, motions, correcting=corrections < _CORRECTIONS)
        if not corrected:
            break
    return found


def _at_instants(
    paths: Sequence[ScaledPath], payloads: Sequence[Payload], motions: Sequence[Rollout]
) -> LeastFactor | None:
    """The least factor at the paths' instants."""
    each = [path.allowed(payload.mass) for path, payload in zip(paths, payloads, strict=True)]
    allowed, bounds = _common([intervals for intervals, _ in each]), [bound for _, bound in each]
    if not len(allowed):
        return None
    constraints = paths[0].constraints
    longest = constraints.longest[0]
    within = allowed[allowed[:, 0] <= longest]
    within = np.column_stack([within[:, 0], np.minimum(within[:, 1], longest)])
    factor, asked = least_kept(motions, constraints, within if len(within) else allowed)
    if asked:
        bounds = [Bound(asked[0], "", np.nan)] * len(bounds)
    return LeastFactor(factor, factor, False, within, tuple(bounds), _broken(constraints, motions, factor))


def _broken(constraints: ScaledConstraints, motions: Sequence[Rollout], factor: float) -> tuple[str, ...]:
    """Names of constraints that motions at a factor of time do not keep."""
    longest, name = constraints.longest
    too_long = (name,) if factor > longest else ()
    if factor == 0.0:
        return constraints.never_kept
    others = [name for motion in motions for name in constraints.broken(motion, factor)]
    return tuple(dict.fromkeys((*constraints.never_kept, *too_long, *others)))


def _proven(
    found: LeastFactor, paths: Sequence[ScaledPath], motions: Sequence[Rollout], *, correcting: bool
) -> tuple[LeastFactor, bool]:
    """The factor enlarged until it is proven, and whether instants were added instead that call for another factor."""
    allowed = found.allowed if len(found.allowed) else np.array([[found.sampled, np.inf]])
    broken: dict[float, tuple[str, ...]] = {}

    def proves(factor: float) -> bool | None:
        if not np.isfinite(factor):
            return None
        broken[factor] = _broken(paths[0].constraints, motions, factor)
        if set(broken[factor]) - set(found.not_kept):
            return None
        verdicts = [path.proves(motion, factor) for path, motion in zip(paths, motions, strict=True)]
        return False if False in verdicts else None if None in verdicts else True

    low = found.sampled
    by_effort = any(bound is not None and bound.limit == "effort" for bound in found.bounds)
    for share in _ENLARGED if by_effort else (0.0, *_ENLARGED):
        factor = next_allowed(allowed, found.sampled * (1.0 + share))
        verdict = proves(factor)
        if verdict is False and share and correcting:
            return found, True
        if verdict:
            for _ in range(_HALVINGS if share > _ENLARGED[0] else 0):
                middle = next_allowed(allowed, float(np.sqrt(low * factor)))
                low, factor = (low, middle) if middle < factor and proves(middle) else (max(low, middle), factor)
            return replace(found, factor=factor, proven=True, not_kept=broken[factor]), False
        low = factor
    return found, False


def _common(allowed: Sequence[Array]) -> Array:
    """What several unions of ascending intervals, each (K, 2), have in common, as such a union."""
    common = allowed[0]
    for intervals in allowed[1:]:
        low = np.maximum(common[:, None, 0], intervals[:, 0])
        high = np.minimum(common[:, None, 1], intervals[:, 1])
        both = low < high
        order = np.argsort(low[both])
        common = np.column_stack([low[both][order], high[both][order]])
    return common
