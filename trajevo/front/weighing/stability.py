"""How stable a choice is when weights move: shares of all weights, and the least change that makes another choice.

All weights that sum to 1 are a simplex, and all of them count alike. Where a weighted sum chooses a point, they form a
convex polytope: an interval for two objectives and a polygon for three, whose sizes are computed exactly. For more
objectives, and for TOPSIS, shares are counted at Sobol's points, and their errors told.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError, checked_name
from trajevo.formulation.problem import Weights
from trajevo.front.selection import comparable, squared_distances, topsis, weighted
from trajevo.front.weighing.weights import unit_weights

#: Rules whose choices are followed.
WeightRule = Literal["weighted", "topsis"]
WEIGHT_RULES: tuple[WeightRule, ...] = ("weighted", "topsis")

#: Choices of a rule by M sets of weights: (M, n_obj) -> M rows.
Chooser = Callable[[Array], Array]

#: Independent scramblings of Sobol's points, and binary logarithm of the points of each.
_REPLICATES, _POINTS = 16, 11

#: Numbers of weights times points of the front that are compared at a time, which fit into the cache.
_AT_A_TIME = 2**18

#: Greatest number of objectives whose shares of a weighted sum are exact, greatest share that counts as none, and how
#: far above another point, as a share of what separates them, a sum may be by rounding.
_EXACT, _NOTHING, _ROUNDING = 3, 1e-12, 1e-13


@final
@dataclass(frozen=True)
class WeightChange:
    """The least change of weights that makes a weighted sum choose another point.

    Attributes:
        size: by how much the weights change, at most; weights sum to 1.
        weights: where that ends, the weights by which both points have the same sum, one per objective.
        row: the other point.
    """

    size: float
    weights: tuple[float, ...]
    row: int


@final
@dataclass(frozen=True)
class WeightStability:
    """How far a choice depends on weights.

    Attributes:
        rule: ``"weighted"`` or ``"topsis"``.
        weights: the given weights, which sum to 1, one per objective.
        scales: what objectives are divided by for the weighted sum, in their SI units; None if they are normalised.
        row: what they choose.
        rows: all rows that some weights choose, the greatest share first.
        shares: share of all weights that choose each of these rows; they sum to 1.
        errors: standard error of each share; 0 where it is exact.
        change: least change of the given weights that makes another choice; None where no weights do, and for TOPSIS,
            whose limits are no planes.
    """

    rule: WeightRule
    weights: tuple[float, ...]
    scales: tuple[float, ...] | None
    row: int
    rows: tuple[int, ...]
    shares: tuple[float, ...]
    errors: tuple[float, ...]
    change: WeightChange | None

    __repr__ = brief

    @property
    def share(self) -> float:
        """Share of all weights that make the same choice as the given ones."""
        return self._own(self.shares)

    @property
    def error(self) -> float:
        """Standard error of :attr:`share`."""
        return self._own(self.errors)

    def _own(self, values: Sequence[float]) -> float:
        return values[self.rows.index(self.row)] if self.row in self.rows else 0.0

    @property
    def told(self) -> str:
        """The share of the choice, with its error if it has one [%]."""
        return f"{100.0 * self.share:.3g}" + (f" ± {100.0 * self.error:.1g}" if self.error else "")

    def __str__(self) -> str:
        said = f"row {self.row} by {self.told} % of all weights, {len(self.rows)} rows by some"
        if self.change is None:
            return said
        return f"{said}; weights that change by {self.change.size:.3g} choose row {self.change.row}"


def stability(F: Array, weights: Sequence[float] | Weights, *, rule: WeightRule = "weighted") -> WeightStability:
    """How stable the choice of a rule is when weights move.

    Args:
        F: objective values, shape (N, n_obj).
        weights: one non-negative number per objective, not all zero, or those of a paper.
        rule: ``"weighted"`` or ``"topsis"``.

    Raises:
        InvalidInputError: weights that cannot be used.
        UnknownNameError: no such rule.
    """
    checked_name("rule", rule, WEIGHT_RULES)
    w = unit_weights(weights, F.shape[1])
    row = (weighted if rule == "weighted" else topsis)(F, weights).index
    values = comparable(F, weights)
    if rule == "weighted" and F.shape[1] <= _EXACT:
        shares = {one: _size(corners) for one, corners in cells(values).items()}
        total = sum(shares.values())
        shares = {one: share / total for one, share in shares.items() if share > _NOTHING * total}
        errors = dict.fromkeys(shares, 0.0)
    else:
        shares, errors = _counted(F.shape[1], chooser(F, weights, rule))
    rows = tuple(sorted(shares, key=lambda one: (-shares[one], one)))
    change = least_change(values, w, row) if rule == "weighted" else None
    own, close = (tuple(of[one] for one in rows) for of in (shares, errors))
    scales = weights.scales if isinstance(weights, Weights) else None
    return WeightStability(rule, tuple(w.tolist()), scales, row, rows, own, close, change)


def chooser(F: Array, weights: Sequence[float] | Weights, rule: WeightRule) -> Chooser:
    """The choices of a rule by other weights: a function of M sets of weights, (M, n_obj), that gives M rows.

    Args:
        F: objective values, shape (N, n_obj).
        weights: weights whose scales, if they have any, stay.
        rule: ``"weighted"`` or ``"topsis"``.
    """
    from_best, from_worst = squared_distances(F)
    values = comparable(F, weights)

    def best(part: Array) -> Array:
        if rule == "weighted":
            losses = part @ values.T
        else:  # the closeness falls with the ratio of the distances, which needs no roots
            losses = -(part**2 @ from_worst.T) / np.maximum(part**2 @ from_best.T, np.finfo(float).tiny)
        found: Array = losses.argmin(axis=1)
        return found

    def chosen(others: Array) -> Array:
        count = max(_AT_A_TIME // len(F), 1)
        parts = [best(others[at : at + count]) for at in range(0, len(others), count)]
        return np.concatenate([np.empty(0, dtype=np.intp), *parts])

    return chosen


def simplex(shares: Array) -> Array:
    """Points of a cube as weights, such that equal volumes stay equal volumes.

    Args:
        shares: shape (M, n_obj - 1), from 0 to 1.

    Returns:
        Shape (M, n_obj), non-negative, sums of 1.
    """
    ends = np.concatenate([np.zeros((len(shares), 1)), np.sort(shares, axis=1), np.ones((len(shares), 1))], axis=1)
    return np.diff(ends, axis=1)


def _counted(count: int, chosen: Chooser) -> tuple[dict[int, float], dict[int, float]]:
    """Shares of the rows at Sobol's points, and their standard errors from independent scramblings."""
    from scipy.stats import qmc  # imported where it computes, since that takes long

    if count == 1:
        row = int(chosen(np.ones((1, 1)))[0])
        return {row: 1.0}, {row: 0.0}
    found = []
    for replicate in range(_REPLICATES):
        points = qmc.Sobol(count - 1, rng=np.random.default_rng(replicate)).random_base2(_POINTS)
        found.append(chosen(simplex(points)))
    rows = np.unique(found)
    shares = np.array([(np.array(each)[:, None] == rows).mean(axis=0) for each in found])
    errors = shares.std(axis=0, ddof=1) / np.sqrt(_REPLICATES)
    whole = rows.tolist()
    return dict(zip(whole, shares.mean(axis=0).tolist(), strict=True)), dict(zip(whole, errors.tolist(), strict=True))


def cells(values: Array) -> dict[int, Array]:
    """Where a weighted sum chooses each point, for one to three objectives.

    Args:
        values: what is weighed, shape (N, n_obj).

    Returns:
        Row -> corners of its weights, shape (corners, n_obj), in order around the polygon; rows that are chosen
        nowhere, or at single weights only, are left out. Of equal points the first is chosen.
    """
    if not 1 <= values.shape[1] <= _EXACT:
        raise InvalidInputError(f"F: expected 1 to {_EXACT} objectives, got {values.shape[1]}")
    _, first = np.unique(values, axis=0, return_index=True)
    found = {}
    for row in np.sort(first).tolist():
        corners = _cell(values, row)
        if len(corners) >= values.shape[1]:
            found[row] = corners
    return found


def _cell(values: Array, row: int) -> Array:
    """Corners of the weights by which no other point has a lesser sum; fewer than n_obj if there are none."""
    gaps = values - values[row]
    corners = np.eye(values.shape[1])
    for _ in range(len(values)):
        heights = gaps @ corners.T
        lowest = heights.min(axis=1)
        deepest = int(np.argmin(lowest))
        if lowest[deepest] >= -_ROUNDING * max(np.abs(gaps[deepest]).max(), np.finfo(float).tiny):
            return corners
        corners = _clipped(corners, heights[deepest])
        if len(corners) < values.shape[1]:
            return corners
    return corners


def _clipped(corners: Array, heights: Array) -> Array:
    """The part of a segment or a convex polygon whose heights are not negative; none if it has no size."""
    kept: list[Array] = []
    for k in range(len(corners)):
        after = (k + 1) % len(corners)
        if heights[k] >= 0.0:
            kept.append(corners[k])
        if heights[k] * heights[after] < 0.0 and (len(corners) > 2 or k == 0):
            share = heights[k] / (heights[k] - heights[after])
            kept.append(corners[k] + share * (corners[after] - corners[k]))
    return np.array(kept).reshape(-1, corners.shape[1])


def _size(corners: Array) -> float:
    """Share of the simplex within the corners of a segment or a polygon."""
    if corners.shape[1] == 1:
        return 1.0
    if corners.shape[1] == 2:
        return float(np.ptp(corners[:, 0]))
    x, y = corners[:, 0], corners[:, 1]
    return float(abs((x * np.roll(y, -1) - y * np.roll(x, -1)).sum()))


def least_change(values: Array, weights: Array, row: int) -> WeightChange | None:
    """The least change of weights by which another point has the same weighted sum, by linear programs.

    Args:
        values: what is weighed, shape (N, n_obj).
        weights: weights that sum to 1, shape (n_obj,).
        row: the point that they choose.

    Returns:
        The change; None if no weights choose another point.
    """
    gaps = values - values[row]
    margins = gaps @ weights
    # Without the bounds of 0, a change of size d lowers a margin by at most d times the sum of |gaps - their median|.
    reach = np.abs(gaps - np.median(gaps, axis=1, keepdims=True)).sum(axis=1)
    other = (gaps < 0.0).any(axis=1)
    bounds = np.where(other & (reach > 0.0), margins / np.where(reach > 0.0, reach, 1.0), np.inf)
    best: WeightChange | None = None
    for rival in np.argsort(bounds, kind="stable").tolist():
        if not np.isfinite(bounds[rival]) or (best is not None and bounds[rival] >= best.size):
            break
        found = _change_for(gaps[rival], weights, rival)
        if found is not None and (best is None or found.size < best.size):
            best = found
    return best


def _change_for(gap: Array, weights: Array, rival: int) -> WeightChange | None:
    """The least change for one other point: minimise d with |w - weights| <= d, w >= 0, sum 1 and gap w <= 0."""
    from scipy.optimize import linprog  # imported where it computes, since that takes long

    count = len(weights)
    aside = np.ones((count, 1))
    found = linprog(
        np.append(np.zeros(count), 1.0),
        A_ub=np.vstack(
            [
                np.hstack([np.eye(count), -aside]),
                np.hstack([-np.eye(count), -aside]),
                np.append(gap / np.abs(gap).max(), 0.0)[None],
            ]
        ),
        b_ub=np.concatenate([weights, -weights, [0.0]]),
        A_eq=np.append(np.ones(count), 0.0)[None],
        b_eq=[1.0],
        bounds=[(0.0, None)] * (count + 1),
    )
    if found.status != 0:
        return None
    ends = np.clip(found.x[:count], 0.0, None)
    return WeightChange(float(found.x[count]), tuple((ends / ends.sum()).tolist()), rival)
