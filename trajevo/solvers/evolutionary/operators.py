"""Simulated binary crossover and polynomial mutation, faster than pymoo's and equal to them to the bit.

pymoo repeats bounds and settings for every variable and raises both branches of every formula to a power. Here each
number is computed once, from the same random draws. Powers are taken of arrays like pymoo's, so that results are equal.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from pymoo.operators.crossover.sbx import SBX
from pymoo.operators.mutation.pm import PM

from trajevo.base.arrays import Array

#: Distance up to which pymoo treats two values of parents as equal.
_CLOSE = 1e-14


def crossed(operator: Any, problem: Any, parents: Array, random: np.random.Generator) -> Array:
    """Children of pairs of parents.

    Args:
        operator: a crossover of pymoo, of two parents into two children.
        problem: a problem of pymoo, whose bounds are used.
        parents: decision vectors, shape (2, N, n_var).
        random: random generator.

    Returns:
        Shape (2, N, n_var); the parents themselves where the operator's probability leaves a pair as it is.
    """
    chosen = random.random(parents.shape[1]) < _value(operator.prob)
    if not chosen.any():
        return parents
    settings = _numbers(operator, SBX, "prob_var", "eta", "prob_exch", "prob_bin")
    if settings is None:
        children = operator._do(problem, parents, random_state=random)
    else:
        children = _simulated_binary(parents, problem.xl, problem.xu, settings, random)
    return np.where(chosen[:, None], children, parents)


def mutated(operator: Any, problem: Any, X: Array, random: np.random.Generator) -> Array:
    """Decision vectors after a mutation.

    Args:
        operator: a mutation of pymoo.
        problem: a problem of pymoo, whose bounds are used.
        X: decision vectors, shape (N, n_var).
        random: random generator.

    Returns:
        Shape (N, n_var); the same vectors where the operator's probability leaves them as they are.
    """
    settings = _numbers(operator, PM, "eta", "at_least_once")
    rate = None if settings is None else operator.get_prob_var(problem)
    if settings is None or settings[1] or not isinstance(rate, int | float):
        changed = np.asarray(operator._do(problem, X, random_state=random), dtype=np.float64)
    else:
        changed = _polynomial(X, problem.xl, problem.xu, rate, settings[0], random)
    chosen = random.random(len(X)) <= _value(operator.prob)
    if chosen.all():
        return changed
    return np.where(chosen[:, None], changed, X)


def _simulated_binary(
    parents: Array, low: Array, high: Array, settings: tuple[float, ...], random: np.random.Generator
) -> Array:
    rate, index, exchange_rate, swap_rate = settings
    _, matings, n_var = parents.shape
    draws = random.random((n_var + 1) * matings)
    cross = draws[matings:].reshape(matings, n_var) < rate
    cross &= np.abs(parents[0] - parents[1]) > _CLOSE
    cross &= low != high
    (where,) = cross.reshape(-1).nonzero()
    column = where % n_var
    pairs = parents.reshape(2, -1).take(where, axis=1)
    lesser, greater = np.minimum(*pairs), np.maximum(*pairs)
    room = np.empty_like(pairs)
    np.subtract(lesser, low.take(column), out=room[0])
    np.subtract(high.take(column), greater, out=room[1])
    drawn, swapping = random.random(pairs.shape)
    apart, total = greater - lesser, lesser + greater
    spread = _spread(room, apart, drawn, index) * apart
    down, up = 0.5 * (total - spread[0]), 0.5 * (total + spread[1])
    swapped = swapping < swap_rate
    if exchange_rate < 1.0:
        swapped &= (draws[:matings] <= exchange_rate)[where // n_var]
    children = parents.copy()
    # The lower child is the first one unless they are swapped, whichever parent is the lower one.
    first, second = children.reshape(2, -1)
    first[where], second[where] = np.where(swapped, up, down), np.where(swapped, down, up)
    return _clamped(children, low, high)


def _spread(room: Array, apart: Array, drawn: Array, index: float) -> Array:
    """Distance of children over distance of parents, towards the lower and the upper bound, shape (2, K)."""
    # Parents outside their bounds may give NaN here; pymoo uses 0 then.
    with np.errstate(all="ignore"):
        alpha = 2.0 - np.power(1.0 + 2.0 * room / apart, np.full(room.shape, -(index + 1.0)))
        scaled = drawn * alpha
        base = np.where(drawn <= 1.0 / alpha, scaled, 1.0 / (2.0 - scaled))
        spread: Array = np.power(base, np.full(room.shape, 1.0 / (index + 1.0)))
    spread[np.isnan(alpha)] = 0.0
    return spread


def _polynomial(X: Array, low: Array, high: Array, rate: float, index: float, random: np.random.Generator) -> Array:
    size, n_var = X.shape
    mutate = random.random((size, n_var)) < rate
    mutate &= low != high
    (where,) = mutate.reshape(-1).nonzero()
    column = where % n_var
    x, least, most = X.take(where), low.take(column), high.take(column)
    width = most - least
    drawn = random.random(len(where))
    down = drawn <= 0.5
    power = np.full(len(where), index + 1.0)
    # Variables outside their bounds may give NaN here.
    with np.errstate(invalid="ignore"):
        kept = np.power(1.0 - np.where(down, x - least, most - x) / width, power)
        # pymoo has one formula for each side. Random numbers are multiples of 2^-53, so that 1 - drawn is exact.
        twice = 2.0 * np.minimum(drawn, 1.0 - drawn)
        root = np.power(twice + (1.0 - twice) * kept, 1.0 / power)
        step = np.where(down, root - 1.0, 1.0 - root)
    changed = X.copy()
    changed.reshape(-1)[where] = x + step * width
    return _clamped(changed, low, high)


def _clamped(X: Array, low: Array, high: Array) -> Array:
    """Clip an array to the bounds, in place; not by minimum and maximum, which do not distinguish -0 and 0."""
    np.copyto(X, low, where=np.less(X, low))
    np.copyto(X, high, where=np.greater(X, high))
    return X


def _numbers(operator: Any, kind: type, *names: str) -> tuple[float, ...] | None:
    """Settings of an operator; None if its class is not exactly ``kind``, or a setting is not a plain number."""
    if type(operator) is not kind:
        return None
    values = [getattr(getattr(operator, name), "value", getattr(operator, name)) for name in names]
    return tuple(values) if all(isinstance(value, int | float) for value in values) else None


def _value(setting: Any) -> float:
    return float(getattr(setting, "value", setting))
