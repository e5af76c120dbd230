"""One motion at different paces: what it carries under each limit, and which one binds, by the cycle time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, frozen, numbers
from trajevo.base.shown import html
from trajevo.base.shown.brief import brief
from trajevo.capacity.accuracy.found import CAUSES, CauseLimit, FullCapacity
from trajevo.capacity.accuracy.full_capacity import deviation_of, full_capacity
from trajevo.capacity.dlcc import sampled_motion
from trajevo.capacity.drives.drive_capacity import DENSE
from trajevo.dynamics.drives.duty import checked_dwell
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.front.front import Solution
from trajevo.solvers.gradient.weighted_sum import WeightedOptimum
from trajevo.trajectory.batch import TrajectoryBatch

#: Durations that are looked at if none are given, as multiples of that of the motion.
FACTORS = tuple(np.geomspace(0.5, 4.0, 31).tolist())


@final
@dataclass(frozen=True, eq=False)
class PaceCapacity:
    """What one motion carries at P paces.

    Attributes:
        factors: durations over that of the given motion, ascending, shape (P,) [1].
        durations: of the motion, shape (P,) [s].
        cycle_times: the same with the time at rest, shape (P,) [s].
        capacities: under all limits, at every pace.
        least_duration: the least duration that velocity, acceleration and jerk of the joints allow [s].
    """

    factors: Array
    durations: Array
    cycle_times: Array
    capacities: tuple[FullCapacity, ...]
    least_duration: float

    __repr__ = brief

    @property
    def causes(self) -> tuple[str, ...]:
        """What limits the payload at some pace, in the order of :data:`CAUSES`."""
        known = {limit.cause for found in self.capacities for limit in found.limits}
        return tuple(cause for cause in CAUSES if cause in known)

    @property
    def mass(self) -> Array:
        """The largest payload, shape (P,) [kg]; 0 where none is feasible."""
        return frozen(np.array([found.mass for found in self.capacities]))

    @property
    def binding(self) -> tuple[str, ...]:
        """What binds at every pace; empty where nothing does."""
        return tuple(found.cause for found in self.capacities)

    def by(self, cause: str) -> Array:
        """The largest payload that one cause alone allows, shape (P,) [kg]; inf where it limits nothing, 0 for none."""
        return frozen(np.array([max(found.by(cause), 0.0) for found in self.capacities]))

    def limit(self, cause: str, pace: int) -> CauseLimit | None:
        """What one cause allows at a pace, with its place and instant; None if it is not known."""
        return next((one for one in self.capacities[pace].limits if one.cause == cause), None)

    @property
    def spans(self) -> tuple[tuple[str, float, float], ...]:
        """Causes that bind, from slow to fast, with the greatest and least cycle time looked at of each [s]."""
        rows = list(zip(self.binding, self.cycle_times.tolist(), strict=True))[::-1]
        groups = [(cause, [time for _, time in members]) for cause, members in groupby(rows, lambda row: row[0])]
        return tuple((cause, times[0], times[-1]) for cause, times in groups)

    def __str__(self) -> str:
        told = [f"{CAUSES.get(cause, 'nothing')} from {slow:.4g} to {fast:.4g} s" for cause, slow, fast in self.spans]
        return f"what binds as the cycle shortens, at {len(self.factors)} paces: {', '.join(told)}"

    def _repr_html_(self) -> str:
        few = np.unique(np.linspace(0, len(self.factors) - 1, min(len(self.factors), 12)).round().astype(int)).tolist()
        rows = []
        for k in few:
            found = self.capacities[k]
            what = CAUSES.get(found.cause, "")
            rows.append((f"{self.cycle_times[k]:.4g}", f"{found.mass:.5g}", what, found.place))
        table = html.table(("cycle time [s]", "largest payload [kg]", "limited by", "at"), rows)
        return html.shown("What binds, by the pace", html.sentence(str(self)), table)


def check_paces(given: Array, name: str) -> None:
    """Refuse paces with which the numbers of a motion would leave the range of floats.

    Args:
        given: speeds or durations over those of a motion, ascending and positive, shape (K,) [1].
        name: of the argument.

    Raises:
        InvalidInputError: one that is not from a millionth to a million.
    """
    if not (given[0] >= 1e-6 and given[-1] <= 1e6):
        wrong = given[0] if given[0] < 1e-6 else given[-1]
        raise InvalidInputError(f"{name}: expected numbers from 1e-06 to 1e+06, got {wrong:g}")


def capacity_by_pace(
    motion: Solution | Rollout | WeightedOptimum,
    *,
    factors: Sequence[float] = FACTORS,
    deviation: float | None = None,
    counted: str = "all",
    dwell: float = 0.0,
    cycles: int | None = None,
    samples: int = DENSE,
) -> PaceCapacity:
    """The payload under each limit when a motion is made faster or slower along the same path.

    Args:
        motion: as for :func:`full_capacity`.
        factors: durations over that of the motion, positive [1].
        deviation: as for :func:`full_capacity`.
        counted: as for :func:`full_capacity`.
        dwell: time at rest after the motion, the same at every pace [s].
        cycles: as for :func:`full_capacity`.
        samples: as for :func:`full_capacity`.

    Raises:
        InvalidInputError: no factors, or one that is not positive, or as for :func:`full_capacity`.
    """
    sorted_ = np.unique(numbers(factors, name="factors", shape=("paces",)))
    if not len(sorted_) or not (sorted_ > 0.0).all():
        raise InvalidInputError(f"factors: expected positive numbers, at least one, got {list(factors)}")
    check_paces(sorted_, "factors")
    rollout = sampled_motion(motion, samples)
    most, counted = deviation_of(motion, deviation, counted)
    given: dict[str, Any] = {"deviation": most, "counted": counted, "dwell": checked_dwell(dwell), "cycles": cycles}
    scaled = [replace(rollout, trajectory=rollout.trajectory.slowed(factor)) for factor in sorted_.tolist()]
    durations = sorted_ * float(rollout.trajectory.duration[0])
    return PaceCapacity(
        factors=frozen(sorted_),
        durations=frozen(durations),
        cycle_times=frozen(durations + given["dwell"]),
        capacities=tuple(full_capacity(each, samples=samples, **given) for each in scaled),
        least_duration=_least_factor(rollout.trajectory, rollout) * float(rollout.trajectory.duration[0]),
    )


def _least_factor(trajectory: TrajectoryBatch, rollout: Rollout) -> float:
    """The least duration over that of a motion with which its joints keep velocity, acceleration and jerk."""
    limits = (rollout.limits.sides(name).lesser for name in ("velocity", "acceleration"))
    all_limits = [*limits, rollout.limits.jerk]
    used = [
        float((trajectory.peak(order)[0] / limit).max()) ** (1.0 / order)
        for order, limit in enumerate(all_limits, start=1)
    ]
    return float(max(used))
