"""Ways to find the weights of objectives: from spread, from comparisons in pairs, and from bounds alone.

Guo et al. (2016) name six ways and define none. Given weights (direct assignment) need no function. Entropy,
comparisons in pairs (the eigenvector method) and least information are here, as the literature defines them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from typing import Any, Literal, final

import numpy as np

from trajevo.base.arrays import Array, numbers
from trajevo.errors import InvalidInputError, UnknownNameError, checked_name
from trajevo.formulation.problem import Weights

#: Weights as rules take them: one per objective in order, by the objectives' names, or those of a paper.
GivenWeights = Sequence[float] | Mapping[str, float] | Weights

#: How values become shares before their entropy is taken.
Normalisation = Literal["sum", "range"]
_NORMALISATIONS = ("sum", "range")

#: Mean index of consistency of random comparisons of 1, 2, ... objectives, and the greatest ratio that is accepted
#: (Saaty 1980).
_RANDOM_INDEX = (0.0, 0.0, 0.58, 0.90, 1.12, 1.24, 1.32, 1.41)
CONSISTENT = 0.10

#: How far the product of a comparison and its reverse may be from 1: people write 0.33 for a third.
_RECIPROCAL = 0.0101

#: How far weights may be from what bounds and order ask for.
_KEPT = 1e-9


@final
@dataclass(frozen=True)
class EntropyWeights:
    """Weights by the spread of the objectives on a front: one that hardly differs among the solutions hardly counts.

    Attributes:
        weights: share of each objective; they sum to 1.
        entropies: entropy of each objective's shares, 1 if all solutions have the same, at least 0.
        normalisation: how values became shares, ``"sum"`` or ``"range"``.
    """

    weights: tuple[float, ...]
    entropies: tuple[float, ...]
    normalisation: Normalisation


@final
@dataclass(frozen=True)
class ComparisonWeights:
    """Weights by comparisons in pairs, and how far these agree with one another.

    Attributes:
        weights: share of each objective; they sum to 1.
        eigenvalue: greatest eigenvalue of the comparisons: their number of objectives n if they are consistent, else
            more.
        index: index of consistency, (eigenvalue - n) / (n - 1).
        ratio: the index over that of random comparisons; 0 for two objectives, which cannot contradict each other.
    """

    weights: tuple[float, ...]
    eigenvalue: float
    index: float
    ratio: float


@final
@dataclass(frozen=True)
class LeastInformationWeights:
    """Weights that say no more than was given.

    Attributes:
        weights: share of each objective; they sum to 1.
        divergence: what they add to the prior weights, the relative entropy to these [nat].
    """

    weights: tuple[float, ...]
    divergence: float


def in_order(weights: GivenWeights, names: Sequence[str]) -> Sequence[float] | Weights:
    """Weights in the order of the objectives.

    Args:
        weights: one per objective, or by name.
        names: names of the objectives.

    Raises:
        UnknownNameError: a weight of something that is no objective.
        InvalidInputError: an objective without a weight.
    """
    if not isinstance(weights, Mapping):
        return weights
    for name in weights:
        if name not in names:
            raise UnknownNameError("objective", name, names)
    missing = [name for name in names if name not in weights]
    if missing:
        raise InvalidInputError(f"weights: expected one for each of {', '.join(names)}, got none of {missing[0]}")
    return [weights[name] for name in names]


def unit_weights(weights: Sequence[float] | Weights, count: int, *, name: str = "weights") -> Array:
    """Weights that sum to 1, shape (count,).

    Args:
        weights: non-negative numbers that are not all zero; only their ratios matter.
        count: number of objectives.
        name: name of the argument, for the message.

    Raises:
        InvalidInputError: a wrong number of weights, a negative one, or weights that are all zero.
    """
    w = numbers(weights.weights if isinstance(weights, Weights) else weights, name=name, shape=(count,))
    if (w < 0.0).any() or w.sum() <= 0.0:
        raise InvalidInputError(f"{name}: expected non-negative numbers that are not all zero, got {w.tolist()}")
    total: Array = w / w.sum()
    return total


def entropy_weights(F: Array, *, normalisation: Normalisation = "sum") -> EntropyWeights:
    """Weights by how much the solutions differ in each objective (Shannon's entropy).

    With shares p of an objective among N solutions, its entropy is e = -Σ p ln p / ln N and its weight proportional to
    1 - e. These weights measure spread, not importance, and change with the normalisation. By ``"sum"`` a share is a
    value over the sum of all; it does not depend on the unit, but on where zero is. By ``"range"`` it is the distance
    from the worst value over the sum of these, which depends on neither, but on the ends of the front.

    Args:
        F: objective values, SI, shape (N, n_obj), of at least two solutions; for ``"sum"`` none may be negative.
        normalisation: ``"sum"`` or ``"range"``.

    Raises:
        InvalidInputError: fewer than two solutions, negative values with ``"sum"``, or no objective with any spread.
        UnknownNameError: no such normalisation.
    """
    points = numbers(F, name="F", shape=("N", "n_obj"))
    checked_name("normalisation", normalisation, _NORMALISATIONS)
    if len(points) < 2:
        raise InvalidInputError(f"F: expected at least 2 solutions, whose spread weighs objectives, got {len(points)}")
    if normalisation == "sum" and (points < 0.0).any():
        column = int(np.argmax((points < 0.0).any(axis=0)))
        raise InvalidInputError(
            f"F: expected no negative values for shares of a sum, got {points[:, column].min():.6g} in column {column};"
            ' normalisation="range" takes them'
        )
    parts = points if normalisation == "sum" else points.max(axis=0) - points
    spread = np.ptp(points, axis=0) > 0.0
    shares = np.full_like(points, 1.0 / len(points))
    shares[:, spread] = parts[:, spread] / parts[:, spread].max(axis=0)
    shares[:, spread] /= shares[:, spread].sum(axis=0)
    logs = np.log(np.where(shares > 0.0, shares, 1.0))
    entropies = np.where(spread, -(shares * logs).sum(axis=0) / np.log(len(points)), 1.0)
    diversities = np.where(spread, 1.0 - entropies, 0.0).clip(0.0)
    if not diversities.any():
        raise InvalidInputError("F: expected an objective in which the solutions differ, all have the same values")
    weights = diversities / diversities.sum()
    return EntropyWeights(tuple(weights.tolist()), tuple(entropies.tolist()), normalisation)


def comparison_weights(
    comparisons: Sequence[Sequence[float]] | Array, *, names: Sequence[str] | None = None
) -> ComparisonWeights:
    """Weights by comparing objectives in pairs: the principal eigenvector of the comparisons (Saaty 1980).

    Args:
        comparisons: shape (n, n), of at most 8 objectives; entry (i, k) is how many times objective i is as important
            as objective k, and entry (k, i) its reciprocal. ``[[1, 3], [1 / 3, 1]]``: the first three times as much as
            the second.
        names: the objectives, for messages; numbers from 1 if None.

    Raises:
        InvalidInputError: not a square of positive numbers, entries that are not reciprocal, or comparisons that
            contradict one another: a ratio of consistency above 0.10.
    """
    matrix = numbers(comparisons, name="comparisons", shape=("n", "n"))
    count = len(matrix)
    told = [str(k + 1) for k in range(count)] if names is None else list(names)
    if matrix.shape != (len(told), len(told)) or not 1 <= count <= len(_RANDOM_INDEX):
        wanted = f"{len(told)} rows and columns" if names is not None else f"a square of 1 to {len(_RANDOM_INDEX)} rows"
        raise InvalidInputError(f"comparisons: expected {wanted}, got {matrix.shape[0]} by {matrix.shape[1]}")
    if (matrix <= 0.0).any():
        raise InvalidInputError(f"comparisons: expected positive numbers, got {matrix.min():g}")
    if (np.diag(matrix) != 1.0).any():
        wrong = int(np.argmax(np.diag(matrix) != 1.0))
        raise InvalidInputError(f"comparisons: expected 1 of {told[wrong]} with itself, got {matrix[wrong, wrong]:.4g}")
    products = np.abs(matrix * matrix.T - 1.0)
    if products.max() > _RECIPROCAL:
        i, k = (int(at) for at in np.argwhere(np.triu(products) == np.triu(products).max())[0])
        raise InvalidInputError(
            f"comparisons: expected {told[k]} over {told[i]} to be {1.0 / matrix[i, k]:.4g}, the reciprocal of "
            f"{told[i]} over {told[k]}, got {matrix[k, i]:.4g}"
        )
    found = _principal(matrix)
    if found.ratio > CONSISTENT:
        i, k, value = _worst_comparison(matrix)
        raise InvalidInputError(
            f"comparisons: expected a ratio of consistency of at most {CONSISTENT:g}, got {found.ratio:.3g}: "
            f"{told[i]} over {told[k]} is {matrix[i, k]:.4g}, but by the other comparisons {value:.4g}"
        )
    return found


def _principal(matrix: Array) -> ComparisonWeights:
    """The principal eigenvector of positive comparisons, shape (n, n), and their consistency."""
    count = len(matrix)
    values, vectors = np.linalg.eig(matrix)
    first = int(np.argmax(values.real))
    vector = np.abs(vectors[:, first].real)
    eigenvalue = float(values[first].real)
    index = (eigenvalue - count) / (count - 1) if count > 1 else 0.0
    ratio = index / _RANDOM_INDEX[count - 1] if count > 2 else 0.0
    return ComparisonWeights(tuple((vector / vector.sum()).tolist()), eigenvalue, index, ratio)


def _worst_comparison(matrix: Array) -> tuple[int, int, float]:
    """The comparison of three or more objectives whose change mends most, and what it is by all ways round it."""
    logs = np.log(matrix)
    tried = []
    for i, k in combinations(range(len(matrix)), 2):
        others = [m for m in range(len(matrix)) if m not in (i, k)]
        value = float(np.exp(np.mean([logs[i, m] + logs[m, k] for m in others])))
        changed = matrix.copy()
        changed[i, k], changed[k, i] = value, 1.0 / value
        # Among equals, as in every contradiction of three, the comparison of the two that are farthest apart.
        tried.append((round(_principal(changed).ratio, 9), i - k, i, k, value))
    return min(tried)[2:]


def least_information_weights(
    names: Sequence[str],
    *,
    least: Mapping[str, float] | None = None,
    most: Mapping[str, float] | None = None,
    order: Sequence[str] = (),
    prior: GivenWeights | None = None,
) -> LeastInformationWeights:
    """The weights that add least information to prior ones, and keep bounds and an order (Kullback 1959).

    They minimise the relative entropy Σ w ln(w / prior). Without bounds and order they are the prior; equal priors make
    it the principle of greatest entropy.

    Args:
        names: the objectives.
        least: objective -> least weight; 0 if not given. Weights sum to 1.
        most: objective -> greatest weight; 1 if not given.
        order: objectives by falling importance, each at least as important as the next; others are free.
        prior: positive weights, one per objective; equal ones if None.

    Raises:
        InvalidInputError: repeated names, bounds outside 0 to 1, a prior weight of 0, or bounds and order that no
            weights keep.
        UnknownNameError: a bound or an order of something that is no objective.
    """
    names = tuple(names)
    if not names or len(set(names)) != len(names):
        raise InvalidInputError(f"names: expected at least one objective, each once, got {list(names)}")
    start = unit_weights([1.0] * len(names) if prior is None else in_order(prior, names), len(names), name="prior")
    if not start.all():
        raise InvalidInputError(f"prior: expected positive weights, got 0 for {names[int(np.argmin(start))]}")
    low, high = _bounds("least", least, names, 0.0), _bounds("most", most, names, 1.0)
    steps = _order(order, names)
    feasible = _feasible(low, high, steps)
    if feasible is None:
        said = f"; the least weights sum to {low.sum():.4g}" if low.sum() > 1.0 else ""
        said = said or (f"; the greatest weights sum to {high.sum():.4g}" if high.sum() < 1.0 else "")
        raise InvalidInputError(f"weights: no weights that sum to 1 keep the bounds and the order{said}")
    weights = _least_divergence(start, low, high, steps, feasible)
    logs = np.log(np.where(weights > 0.0, weights / start, 1.0))
    return LeastInformationWeights(tuple(weights.tolist()), max(float((weights * logs).sum()), 0.0))


def _bounds(argument: str, given: Mapping[str, float] | None, names: Sequence[str], usual: float) -> Array:
    """Bounds of all weights, shape (n,)."""
    bounds = np.full(len(names), usual)
    for name, value in (given or {}).items():
        if name not in names:
            raise UnknownNameError("objective", name, names)
        bounds[names.index(name)] = numbers(value, name=f"{argument} of {name}", shape=())
    if (bounds < 0.0).any() or (bounds > 1.0).any():
        wrong = int(np.argmax((bounds < 0.0) | (bounds > 1.0)))
        raise InvalidInputError(f"{argument}: expected weights from 0 to 1, got {bounds[wrong]:g} of {names[wrong]}")
    return bounds


def _order(order: Sequence[str], names: Sequence[str]) -> Array:
    """Rows whose products with the weights must not be negative, shape (R, n)."""
    for name in order:
        if name not in names:
            raise UnknownNameError("objective", name, names)
    places = [names.index(name) for name in order]
    if isinstance(order, str) or len(set(places)) != len(places):
        raise InvalidInputError(f"order: expected objectives, each once, got {order!r}")
    rows = np.zeros((max(len(places) - 1, 0), len(names)))
    for row, (above, below) in zip(rows, pairwise(places), strict=True):
        row[above], row[below] = 1.0, -1.0
    return rows


def _feasible(low: Array, high: Array, steps: Array) -> Array | None:
    """Weights as far inside all bounds and steps as a linear program finds, shape (n,); None if there are none."""
    from scipy.optimize import linprog  # imported where it computes, since that takes long

    count, inside = len(low), np.ones((1, 1))
    bounded = np.block([[-np.eye(count), np.ones((count, 1))], [np.eye(count), np.ones((count, 1))]])
    ordered = np.hstack([-steps, np.repeat(inside, len(steps), axis=0)])
    found = linprog(
        np.append(np.zeros(count), -1.0),
        A_ub=np.vstack([bounded, ordered]),
        b_ub=np.concatenate([-low, high, np.zeros(len(steps))]),
        A_eq=np.append(np.ones(count), 0.0)[None],
        b_eq=[1.0],
        bounds=[(None, None)] * count + [(None, 1.0)],
    )
    return found.x[:count] if found.status == 0 and found.x[count] >= -_KEPT else None


def _least_divergence(prior: Array, low: Array, high: Array, steps: Array, start: Array) -> Array:
    """The convex program, by sequential quadratic programs from weights that keep everything; shape (n,)."""
    from scipy.optimize import minimize  # imported where it computes, since that takes long

    tiny = np.finfo(float).tiny

    def divergence(w: Array) -> float:
        return float((w * np.log(np.maximum(w, tiny) / prior)).sum())

    def slope(w: Array) -> Array:
        found: Array = np.log(np.maximum(w, tiny) / prior) + 1.0
        return found

    conditions: list[dict[str, Any]] = [
        {"type": "eq", "fun": lambda w: w.sum() - 1.0, "jac": lambda w: np.ones_like(w)},
    ]
    if len(steps):
        conditions.append({"type": "ineq", "fun": lambda w: steps @ w, "jac": lambda _: steps})
    found = minimize(
        divergence,
        np.clip(start, low, high),
        jac=slope,
        method="SLSQP",
        bounds=list(zip(low, high, strict=True)),
        constraints=conditions,
        options={"ftol": 1e-15, "maxiter": 500},
    )
    weights = np.clip(found.x, low, high)
    total: Array = weights / weights.sum()
    return total
