"""Rules that choose one point of a front: each takes objective values and returns a row and the reason.

The rules use normalised objectives: 0 at the best value on the front, 1 at the worst. Exceptions are the least value of
one objective, a weighted sum with given scales, and TOPSIS, which divides by the root of the sum of squares.
"""

from __future__ import annotations

import operator
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from trajevo.base.arrays import Array, numbers
from trajevo.errors import InvalidInputError, NoSuchRowError
from trajevo.formulation.problem import Weights
from trajevo.front.weighing.weights import unit_weights


@dataclass(frozen=True)
class Choice:
    """A chosen row of a front.

    Attributes:
        index: the row.
        rule: name of the rule that chose it.
        reason: one sentence for the report.
    """

    index: int
    rule: str
    reason: str


def by_hand(row: int) -> Choice:
    """A row that was asked for by its number."""
    return Choice(row, "row", f"row {row} of the front, by hand")


def rows_of(asked: Any, count: int) -> int | Array:
    """The row, or ascending rows of shape (R,), that an index of a front means.

    Args:
        asked: a row, negative ones from the end; or a slice, several rows, or a mask of shape (N,).
        count: number N of rows.

    Raises:
        NoSuchRowError: no such row.
        InvalidInputError: neither rows nor a mask of as many entries as there are rows.
    """
    if isinstance(asked, slice):
        try:
            return np.unique(np.arange(count)[asked])
        except (TypeError, ValueError) as error:
            raise InvalidInputError(f"front: expected whole numbers in a slice of rows, got {asked!r}") from error
    found = np.asarray(asked) if isinstance(asked, Sequence | np.ndarray) and not isinstance(asked, str) else None
    if found is not None and found.shape == (count,) and found.dtype == bool:
        return np.flatnonzero(found)
    if found is not None and found.ndim == 1 and (not found.size or np.issubdtype(found.dtype, np.integer)):
        rows = {_row(one, count) for one in found.tolist()}
        return np.array(sorted(rows), dtype=np.intp)
    if isinstance(asked, bool | np.bool) or not hasattr(asked, "__index__") or found is not None:
        name = f"; front.pick({asked!r}) takes the name of a rule" if isinstance(asked, str) else ""
        got = f"an array of {found.dtype} of shape {found.shape}" if found is not None else repr(asked)
        raise InvalidInputError(f"front: expected a row, a slice, rows or a mask of {count} entries, got {got}{name}")
    return _row(operator.index(asked), count)


def _row(asked: int, count: int) -> int:
    if not -count <= asked < count:
        known = f"rows are 0 to {count - 1}" if count else "it is empty"
        raise NoSuchRowError(f"front: no row {asked}: {known}")
    return asked % count


def normalised(F: Array) -> Array:
    """Objectives from 0 (best on the front) to 1 (worst), shape (N, n_obj); an objective without spread is 0."""
    points = numbers(F, name="F", shape=("N", "n_obj"))
    if not points.size:
        raise InvalidInputError("F: expected at least one point")
    width = np.ptp(points, axis=0)
    scaled: Array = (F - F.min(axis=0)) / np.where(width > 0.0, width, 1.0)
    return scaled


def knee(F: Array) -> Choice:
    """The point that bulges furthest below the plane through the worst value of each normalised objective.

    For two objectives this is the classical knee, the greatest distance from the line between the ends of the front
    (Das 1999).

    Args:
        F: objective values, shape (N, n_obj).
    """
    f = normalised(F)
    distance = (1.0 - f.sum(axis=1)) / np.sqrt(f.shape[1])
    index = int(np.argmax(distance))
    return Choice(
        index, "knee", f"furthest below the plane of the worst values, by {distance[index]:.3f} of the normalised box"
    )


def nearest_to_utopia(F: Array) -> Choice:
    """The point with the least Euclidean distance to the best values of all normalised objectives."""
    distance = np.linalg.norm(normalised(F), axis=1)
    index = int(np.argmin(distance))
    return Choice(
        index, "utopia", f"nearest to the best value of every objective, at {distance[index]:.3f} of the normalised box"
    )


def weighted(F: Array, weights: Sequence[float] | Weights) -> Choice:
    """The least weighted sum of the normalised objectives, or of objectives divided by given scales.

    Args:
        F: objective values, shape (N, n_obj).
        weights: one non-negative number per objective, not all zero; only their ratios matter. Or :class:`Weights`
            with the scales of a paper.

    Raises:
        InvalidInputError: a wrong number of weights or scales, a negative weight, weights that are all zero, or a scale
            that is not positive.
    """
    if isinstance(weights, Weights) and weights.scales is not None:
        scales = _scales(weights.scales, F.shape[1])
        unit_weights(weights, F.shape[1])
        sums = F @ (np.array(weights.weights) / scales)
        how = f"weights {_shown(weights.weights)} over scales {_shown(scales)}"
    else:
        w = unit_weights(weights, F.shape[1])
        sums = normalised(F) @ w
        how = f"weights {_shown(w)}"
    index = int(np.argmin(sums))
    return Choice(index, "weighted", f"least weighted sum {sums[index]:.6g} with {how}")


def comparable(F: Array, weights: Sequence[float] | Weights) -> Array:
    """What :func:`weighted` weighs: objectives over the scales of a paper, or normalised ones, shape (N, n_obj)."""
    if isinstance(weights, Weights) and weights.scales is not None:
        values: Array = F / _scales(weights.scales, F.shape[1])
        return values
    return normalised(F)


def topsis(F: Array, weights: Sequence[float] | Weights) -> Choice:
    """The point that is near the ideal and far from its opposite (TOPSIS, Hwang and Yoon 1981).

    Objectives are divided by the root of their sum of squares over the front and weighted. The closeness of a point is
    its distance from the worst values over the sum of its distances from best and worst ones: 1 at the ideal. It may
    change with the other points of the front.

    Args:
        F: objective values, shape (N, n_obj).
        weights: as for :func:`weighted`; scales change nothing here.

    Raises:
        InvalidInputError: as for :func:`weighted`.
    """
    w = unit_weights(weights, F.shape[1])
    found = closeness(F, w[None])[0]
    index = int(np.argmax(found))
    how = f"closeness {found[index]:.4f} to the ideal, by weights {_shown(w)}"
    return Choice(index, "topsis", f"nearest to the best and farthest from the worst values, with {how}")


def closeness(F: Array, weights: Array) -> Array:
    """Closeness of each point to the ideal by TOPSIS, from 0 to 1; all values at the ideal is 1.

    Args:
        F: objective values, shape (N, n_obj).
        weights: M sets of weights, shape (M, n_obj), which sum to 1.

    Returns:
        Shape (M, N).
    """
    from_best, from_worst = squared_distances(F)
    squares = weights**2
    best, worst = np.sqrt(squares @ from_best.T), np.sqrt(squares @ from_worst.T)
    together = best + worst
    shares: Array = np.where(together > 0.0, worst / np.where(together > 0.0, together, 1.0), 1.0)
    return shares


def squared_distances(F: Array) -> tuple[Array, Array]:
    """Squares of distances from best and worst values, of objectives over the roots of their sums of squares.

    Args:
        F: objective values, shape (N, n_obj).

    Returns:
        Two arrays of shape (N, n_obj); their products with squares of weights are those of TOPSIS' distances.
    """
    points = numbers(F, name="F", shape=("N", "n_obj"))
    largest = np.abs(points).max(axis=0, initial=0.0)
    parts = points / np.where(largest > 0.0, largest, 1.0)
    root = np.sqrt((parts**2).sum(axis=0))
    parts = parts / np.where(root > 0.0, root, 1.0)
    return (parts - parts.min(axis=0)) ** 2, (parts - parts.max(axis=0)) ** 2


def pseudo_weights(F: Array, weights: Sequence[float] | Weights) -> Choice:
    """The point whose pseudo-weights are nearest to the given weights.

    A pseudo-weight is the relative distance to the worst value of an objective.

    Args:
        F: objective values, shape (N, n_obj).
        weights: as for :func:`weighted`.

    Raises:
        InvalidInputError: as for :func:`weighted`.
    """
    w = unit_weights(weights, F.shape[1])
    if (np.ptp(F, axis=0) > 0.0).all():
        # What pymoo.mcdm does, whose import takes a name that SciPy is about to drop.
        distances = (F.max(axis=0) - F) / (F.max(axis=0) - F.min(axis=0))
        shares = distances / np.sum(distances, axis=1)[:, None]
        index = int(np.argmin(np.sum(np.abs(shares - w), axis=1)))
    else:  # the spread of an objective is 0 for a front of one point or a constant objective
        index = weighted(F, weights.weights if isinstance(weights, Weights) else weights).index
    return Choice(index, "pseudo_weights", f"pseudo-weights nearest to {_shown(w)}")


def least(F: Array, objective: int, name: str) -> Choice:
    """The point with the least value of one objective."""
    index = int(np.argmin(F[:, objective]))
    return Choice(index, f"least_{name}", f"least {name} on the front")


def _scales(given: Sequence[float], count: int) -> Array:
    scales = numbers(given, name="scales", shape=(count,))
    if (scales <= 0.0).any():
        raise InvalidInputError(f"scales: expected positive numbers, got {scales.tolist()}")
    return scales


def _shown(weights: Sequence[float] | Array) -> str:
    return "(" + ", ".join(f"{weight:.3g}" for weight in weights) + ")"
