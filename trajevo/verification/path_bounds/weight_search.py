"""A front along a path against all time laws: more weights of both objectives, and finer cells of the path."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar, final

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.dynamics.integrals.efforts import integrated_square_effort
from trajevo.errors import InvalidInputError
from trajevo.formulation.objectives import integrated_square_jerk, total_time
from trajevo.front.front import Front
from trajevo.front.hypervolume import hypervolume
from trajevo.verification.front_bound import FrontSearch, LowerSet
from trajevo.verification.path_bounds.bound import PathQuestion, solved_at
from trajevo.verification.path_bounds.weighted_sums import WeightedSums

#: Number of weights at first besides 0, and of stations at first and at most.
_WEIGHTS, _STATIONS, _MOST_STATIONS = 12, 25, 800

#: Share of the gap that another weight, or twice the stations, has to promise or to have brought.
_WORTH = 0.04

#: Factor between the least or greatest weight and one beyond it.
_BEYOND = 4.0

#: Least and greatest power of the time with which the other objective is taken to fall along a front.
_POWERS = (1.0, 200.0)


@final
class WeightSearch(FrontSearch):
    """Least weighted sums of time and squared jerk or effort, each by linear programs, until the gap is small.

    Weights are put where they promise most; where none does, all sums are bounded anew with twice the stations.

    Args:
        front: the front.
        corner: far corner of the box, (2,) [SI].

    Raises:
        InvalidInputError: the path has corners, or other objectives.
    """

    method: ClassVar[str] = "weighted sums along a path"

    def __init__(self, front: Front, corner: Array) -> None:
        self.question, self.corner = PathQuestion.of(front.problem), corner
        self.time_at, self.of_jerk = _objectives(front)
        # Time first, as the weights have it.
        self.F = np.asarray(front.F, dtype=np.float64)[:, [self.time_at, 1 - self.time_at]]
        self.own = hypervolume(front.F[(corner > front.F).all(axis=1)], corner)
        self.weights = np.concatenate([[0.0], _weights(self.F, _WEIGHTS)])
        self.values, self.solved = np.zeros(len(self.weights)), np.zeros(len(self.weights), dtype=np.int64)
        self.stations, self.done, self.before = _STATIONS, 0, np.inf
        self.left_out = _left_out(front, self.question)

    @property
    def gap(self) -> float:
        """Share of the box between the front and the bound."""
        return max(0.0, self._sums().area(self.corner) - self.own)

    @property
    def missing(self) -> float:
        """Nothing is found on the way."""
        return 0.0

    @property
    def cells(self) -> int:
        """Cells of the path in all programs."""
        return self.done

    def step(self, over: Callable[[], bool]) -> bool:
        """Bound one weighted sum, a new one or an old one with more stations."""
        open_ = np.flatnonzero(self.solved < self.stations)
        if len(open_):
            self._solve(int(open_[0]), over)
            return True
        weight, share = self._promising()
        if share >= _WORTH * self.gap:
            at = int(np.searchsorted(self.weights, weight))
            for name, new in (("weights", weight), ("values", 0.0), ("solved", 0)):
                setattr(self, name, np.insert(getattr(self, name), at, new))
            self._solve(at, over)
            return True
        if self.before - self.gap < _WORTH * self.gap or 2 * self.stations > _MOST_STATIONS:
            return False
        self.before, self.stations = self.gap, 2 * self.stations
        return True

    def finish(self) -> None:
        """Nothing is left to measure."""

    def kept(self) -> tuple[dict[str, Any], dict[str, Array]]:
        """Weights and what is known of them."""
        about = {"stations": self.stations, "done": self.done, "before": self.before if self.before < np.inf else None}
        return about, {"weights": self.weights, "values": self.values, "solved": self.solved}

    def go_on(self, about: dict[str, Any], arrays: dict[str, Array]) -> None:
        """Go on from what was kept."""
        self.weights, self.values, self.solved = (arrays[name].copy() for name in ("weights", "values", "solved"))
        self.stations, self.done = int(about["stations"]), int(about["done"])
        self.before = np.inf if about["before"] is None else float(about["before"])

    def found(self) -> tuple[str, LowerSet, Array, Array, tuple[str, ...]]:
        """The bound."""
        sums = self._sums()
        points = sums.envelope(self.corner)
        lower = points.min(axis=0) if len(points) else np.array([sums.values[0], 0.0])
        back = [self.time_at, 1 - self.time_at]  # a swap is its own inverse
        kind = "all time laws that rise from one end of the path to the other, at rest and without acceleration there"
        return kind, sums, lower[back], self.F.min(axis=0)[back], self.left_out

    def _sums(self) -> WeightedSums:
        return WeightedSums(frozen(self.weights.copy()), frozen(self.values.copy()), self.time_at)

    def _solve(self, at: int, over: Callable[[], bool]) -> None:
        """Bound one weighted sum with the stations of now; one that is cut short is bounded again later."""
        weight = float(self.weights[at])
        found = solved_at(self.question, self.stations, (weight, 0.0) if self.of_jerk else (0.0, weight), over=over)
        self.values[at] = max(self.values[at], found.least)
        self.solved[at] = 0 if over() else self.stations
        self.done += found.rounds * len(found.places)

    def _promising(self) -> tuple[float, float]:
        """The weight that promises to take most off the gap, and which share of the box.

        Between neighbours the envelope has a corner. A line of another weight cuts it off, at best as high as the
        front allows and as far below it as its neighbours are.
        """
        w, v = self.weights, self.values
        reached = (self.F[:, :1] + self.F[:, 1:] * w).min(axis=0)
        lost = reached - v
        best = (0.0, 0.0)
        longest, most = self.corner[[self.time_at, 1 - self.time_at]]
        for k in range(len(w)):
            last = k + 1 == len(w)
            after = 0.0 if last else 1.0 / w[k + 1]  # slope of the line on the right, that of X >= 0 at the end
            time = v[0] if k == 0 else v[k] if last else (w[k + 1] * v[k] - w[k] * v[k + 1]) / (w[k + 1] - w[k])
            height = 0.0 if last else max(0.0, (v[k + 1] - time) * after)
            weight = w[k + 1] / _BEYOND if k == 0 else w[k] * _BEYOND if last else float(np.sqrt(w[k] * w[k + 1]))
            at_best = (self.F[:, 0] + self.F[:, 1] * weight).min() - lost[k : k + 2].max()
            rise = min((at_best - time) / weight, most) - height
            if rise <= 0.0 or time >= longest:
                continue
            left = 0.0 if k == 0 else rise / (1.0 / w[k] - 1.0 / weight)
            right = min(rise / (1.0 / weight - after), longest - time)
            share = 0.5 * rise * (left + right) / (longest * most)
            best = max(best, (weight, share), key=lambda each: each[1])
        return best


def _objectives(front: Front) -> tuple[int, bool]:
    """Which objective is the time, and whether the other one is the squared jerk."""
    functions = [one.function for one in front.problem.objectives]
    others = [one for one in functions if one is not total_time]
    if len(functions) != 2 or others not in ([integrated_square_jerk], [integrated_square_effort]):
        raise InvalidInputError(
            "front: expected the time and the exact integral of the squared jerk (quadrature='gauss') or of the "
            f"squared effort as objectives, got {', '.join(front.objective_names)}"
        )
    return functions.index(total_time), others == [integrated_square_jerk]


def _left_out(front: Front, question: PathQuestion) -> tuple[str, ...]:
    names = {one.quantity or ", ".join(one.names) for one in front.problem.constraints}
    return tuple(sorted(names - {*question.limited, "duration"}))


def _weights(F: Array, count: int) -> Array:
    """Weights from that with which the front's fast end is least to that of its slow end, (count,) or one."""
    rows = F[np.argsort(F[:, 0])]
    if len(rows) < 2 or rows[0, 0] == rows[-1, 0]:
        return rows[:1, 0] / (5.0 * rows[:1, 1])
    steps = np.geomspace(rows[0, 0], rows[-1, 0], 40)
    other = np.interp(np.log(steps), np.log(rows[:, 0]), np.log(np.maximum(rows[:, 1], 1e-300)))
    falls = np.clip(-np.gradient(other, np.log(steps)), *_POWERS)
    weights = steps / (falls * np.exp(other))
    return np.geomspace(weights.min(), weights.max(), count)
