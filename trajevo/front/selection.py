"""Rules that choose one point of a front: each takes objective values and returns a row and the reason.

The rules use normalised objectives: 0 at the best value on the front, 1 at the worst. Exceptions are the least value of
one objective, and a weighted sum with given scales.
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
        scales = numbers(weights.scales, name="scales", shape=(F.shape[1],))
        if (scales <= 0.0).any():
            raise InvalidInputError(f"scales: expected positive numbers, got {scales.tolist()}")
        _weights(weights.weights, F.shape[1])
        sums = F @ (np.array(weights.weights) / scales)
        how = f"weights {_shown(weights.weights)} over scales {_shown(scales)}"
    else:
        w = _weights(weights.weights if isinstance(weights, Weights) else weights, F.shape[1])
        sums = normalised(F) @ w
        how = f"weights {_shown(w)}"
    index = int(np.argmin(sums))
    return Choice(index, "weighted", f"least weighted sum {sums[index]:.6g} with {how}")


def pseudo_weights(F: Array, weights: Sequence[float]) -> Choice:
    """The point whose pseudo-weights are nearest to the given weights.

    A pseudo-weight is the relative distance to the worst value of an objective.

    Args:
        F: objective values, shape (N, n_obj).
        weights: as for :func:`weighted`.

    Raises:
        InvalidInputError: as for :func:`weighted`.
    """
    w = _weights(weights, F.shape[1])
    if (np.ptp(F, axis=0) > 0.0).all():
        # What pymoo.mcdm does, whose import takes a name that SciPy is about to drop.
        distances = (F.max(axis=0) - F) / (F.max(axis=0) - F.min(axis=0))
        shares = distances / np.sum(distances, axis=1)[:, None]
        index = int(np.argmin(np.sum(np.abs(shares - w), axis=1)))
    else:  # the spread of an objective is 0 for a front of one point or a constant objective
        index = weighted(F, weights).index
    return Choice(index, "pseudo_weights", f"pseudo-weights nearest to {_shown(w)}")


def least(F: Array, objective: int, name: str) -> Choice:
    """The point with the least value of one objective."""
    index = int(np.argmin(F[:, objective]))
    return Choice(index, f"least_{name}", f"least {name} on the front")


def _weights(weights: Sequence[float], count: int) -> Array:
    w = numbers(weights, name="weights", shape=(count,))
    if (w < 0.0).any() or w.sum() <= 0.0:
        raise InvalidInputError(f"weights: expected non-negative numbers that are not all zero, got {w.tolist()}")
    total: Array = w / w.sum()
    return total


def _shown(weights: Sequence[float] | Array) -> str:
    return "(" + ", ".join(f"{weight:.3g}" for weight in weights) + ")"
