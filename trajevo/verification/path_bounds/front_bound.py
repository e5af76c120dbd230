"""How good a front of time and squared jerk along a path is at best: what no time law can be better than."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, frozen, numbers
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError
from trajevo.front.front import Front
from trajevo.front.quantities import with_unit
from trajevo.verification.path_bounds.bound import PathQuestion, path_bound

#: The objectives that are bounded.
_OBJECTIVES = ("time", "jerk")

#: Share below which slopes, and values at the end of the box, are the same.
_SAME = 1e-9

#: Number of weights unless another is given, and bounds of it.
_WEIGHTS, _MOST_WEIGHTS = 16, 200

#: Least and greatest power of the time with which the jerk is taken to fall along a front: a slower run of the same
#: law has it fall with the fifth.
_POWERS = (5.0, 200.0)


@final
@dataclass(frozen=True, eq=False)
class PathFrontBound:
    """What no time law along a path can be better than: T + weight ∫ ‖jerk‖² dt >= value for K weights.

    Attributes:
        kind: the motions for which it holds, in words.
        names: names of the objectives, time and squared jerk.
        units: their units.
        corner: far corner of the box in which the gap is measured, (2,) [SI].
        weights: of the squared jerk, rising from 0, (K,) [s per unit of the squared jerk].
        values: least values of the weighted sums, proven, (K,) [s].
        lower: least value that each objective can have in the box, proven, (2,) [SI].
        upper: the least value in the front, (2,) [SI].
        gap: share of the box between the front and the bound: the front misses no more.
        better: by what share a time law can be better than each solution of the front in both objectives at once, at
            most, (N,); negative if the bound were broken.
        stations: number of cells of the path, at least.
        cpu_time: CPU time [s].
        left_out: limits of the problem that were not used; with them the truth can only lie above the bound.
        front: the front's :attr:`~trajevo.front.front.Front.digest`.
    """

    kind: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    corner: Array
    weights: Array
    values: Array
    lower: Array
    upper: Array
    gap: float
    better: Array
    stations: int
    cpu_time: float
    left_out: tuple[str, ...]
    front: str

    __repr__ = brief

    def __str__(self) -> str:
        return f"{self.told} ({self.stations} stations, {self.cpu_time:.1f} s of CPU)"

    @property
    def told(self) -> str:
        """What is proven, in a sentence."""
        return (
            f"the front misses at most {100.0 * self.gap:.2g} % of the box; no time law along the path is better than "
            f"any of its solutions by more than {100.0 * self.better.max():.2g} % in both objectives"
        )

    @property
    def rows(self) -> tuple[tuple[str, str, str], ...]:
        """For each objective its name, what no motion is below, and the least value in the front."""
        ends = zip(self.names, self.units, self.lower, self.upper, strict=True)
        return tuple(
            (name, with_unit(f"{low:.7g}", unit), with_unit(f"{high:.7g}", unit)) for name, unit, low, high in ends
        )

    def jerk_at(self, time: Any) -> Array:
        """What the squared jerk of a motion of a time is at least, (M,) -> (M,) [SI]; inf below the least time."""
        given = numbers(time, name="time", shape=("n_times",))
        least = ((self.values[1:] - given[:, None]) / self.weights[1:]).max(axis=1, initial=0.0)
        return np.where(given < self.values[0], np.inf, least)

    def points(self) -> Array:
        """Corners of the lower convex envelope of all motions in the box, by time, (M, 2) [SI]."""
        return frozen(_envelope(self.weights, self.values, self.corner))


def path_front_bound(front: Front, *, weights: int = _WEIGHTS, stations: int = 100) -> PathFrontBound:
    """Bound a front of time and squared jerk along a fixed path from below, over all time laws along the path.

    Args:
        front: front of a problem along a fixed path with the objectives time and jerk.
        weights: number of weights of the jerk besides 0, spread over the front evenly by their logarithms.
        stations: number of cells of the path, see :func:`path_bound`.

    Returns:
        The bound, with its gap to the front.

    Raises:
        InvalidInputError: another problem or other objectives, an empty front, or numbers out of range.
    """
    if isinstance(weights, bool) or not isinstance(weights, int) or not 1 <= weights <= _MOST_WEIGHTS:
        raise InvalidInputError(f"weights: expected a whole number from 1 to {_MOST_WEIGHTS}, got {weights!r}")
    if not isinstance(front, Front):
        raise InvalidInputError(
            f"front: expected a front, as trajevo.optimise gives it or Front.load reads it, got {type(front).__name__}"
        )
    problem = front.problem
    question = PathQuestion.of(problem)
    if tuple(front.objective_names) != _OBJECTIVES:
        raise InvalidInputError(f"front: expected the objectives time and jerk, got {', '.join(front.objective_names)}")
    if not len(front):
        raise InvalidInputError("front: expected one solution at least, got none")
    F = np.asarray(front.F, dtype=np.float64)
    chosen = np.concatenate([[0.0], np.unique(_weights(F, weights))])
    found = [path_bound(problem, square_jerk=float(weight), stations=stations) for weight in chosen]
    values = np.array([bound.least for bound in found])
    corner = _corner(problem, F)
    envelope = _envelope(chosen, values, corner)
    box = np.prod(corner - envelope.min(axis=0))
    inside = F[(corner > F).all(axis=1)]
    reached = _attained(inside, corner)
    names = {constraint.quantity for constraint in problem.constraints} - {*question.limited, "duration"}
    return PathFrontBound(
        kind="all time laws that rise from one end of the path to the other, at rest and without acceleration there",
        names=tuple(front.objective_names),
        units=tuple(objective.unit for objective in problem.objectives),
        corner=frozen(corner),
        weights=frozen(chosen),
        values=frozen(values),
        lower=frozen(envelope.min(axis=0)),
        upper=frozen(F.min(axis=0)),
        gap=float((_above(envelope, corner) - reached) / box),
        better=frozen(1.0 - (values / (F[:, :1] + F[:, 1:] * chosen)).max(axis=1)),
        stations=min(bound.stations for bound in found),
        cpu_time=sum(bound.cpu_seconds for bound in found),
        left_out=tuple(sorted(names)),
        front=front.digest,
    )


def _weights(F: Array, count: int) -> Array:
    """Weights of the jerk from that with which the front's fast end is least to that of its slow end, (count,)."""
    rows = F[np.argsort(F[:, 0])]
    if len(rows) < 2 or rows[0, 0] == rows[-1, 0]:
        return rows[:1, 0] / (_POWERS[0] * rows[:1, 1])
    steps = np.geomspace(rows[0, 0], rows[-1, 0], 40)
    jerk = np.interp(np.log(steps), np.log(rows[:, 0]), np.log(np.maximum(rows[:, 1], 1e-300)))
    falls = np.clip(-np.gradient(jerk, np.log(steps)), *_POWERS)
    weights = steps / (falls * np.exp(jerk))
    return np.geomspace(weights.min(), weights.max(), count)


def _corner(problem: Any, F: Array) -> Array:
    """Far corner of the box: the problem's reference point, or a little beyond the front's greatest values."""
    given = getattr(problem, "reference_point", None)
    return F.max(axis=0) * 1.01 if given is None else np.asarray(given, dtype=np.float64)


def _envelope(weights: Array, values: Array, corner: Array) -> Array:
    """Corners of the convex envelope, from where it enters the box to where it leaves it, (M, 2)."""
    lines = np.column_stack([values[1:], 1.0 / weights[1:]])  # jerk >= (value - time) / weight
    # Lines meet where times and jerks agree; a point counts if no line, and not the least time, lies above it.
    before, after = (lines[part] for part in np.triu_indices(len(lines), 1))
    with np.errstate(divide="ignore", invalid="ignore"):
        met = (before[:, 0] * before[:, 1] - after[:, 0] * after[:, 1]) / (before[:, 1] - after[:, 1])
    at_top = lines[:, 0] - corner[1] / lines[:, 1]
    at = np.unique(np.concatenate([met[np.isfinite(met)], at_top, lines[:, 0], [values[0], corner[0]]]))
    at = at[(at >= values[0]) & (at <= corner[0])]
    height = ((lines[:, 0] - at[:, None]) * lines[:, 1]).max(axis=1, initial=0.0)
    inside = height <= corner[1] * (1.0 + _SAME)
    points = np.column_stack([at[inside], height[inside]])
    return points[_bent(points)]


def _bent(points: Array) -> Array:
    """Both ends of a line of points, and those where it bends, (M,)."""
    bent = np.ones(len(points), dtype=bool)
    if len(points) > 2:
        slopes = np.diff(points[:, 1]) / np.diff(points[:, 0])
        bent[1:-1] = np.abs(np.diff(slopes)) > _SAME * np.abs(slopes).max()
    return bent


def _attained(F: Array, corner: Array) -> float:
    """Area of the box that points in it dominate."""
    rows = F[np.argsort(F[:, 0])]
    best = np.minimum.accumulate(rows[:, 1]) if len(rows) else rows[:, 1]
    return float((np.diff(np.append(rows[:, 0], corner[0])) * (corner[1] - best)).sum())


def _above(envelope: Array, corner: Array) -> float:
    """Area of the box above the envelope."""
    heights = corner[1] - envelope[:, 1]
    return float((np.diff(envelope[:, 0]) * 0.5 * (heights[:-1] + heights[1:])).sum())
