"""The order of least cost for points of which some may be visited in any order, with the best states of each.

A generalised travelling salesman's problem: every point has several states, and the cost of a step is that between two
states. Up to some 13 free points it is solved exactly by dynamic programming over sets of visited points (Held and
Karp, Journal of SIAM 10, 1962), beyond by local search with exact states for every order.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.path.choices.orders import FreeOrder
from trajevo.path.choices.sequences import best_states

#: Greatest number of steps, pairs of states and sets, with which the order is found exactly, and of free points.
_EXACT, _EXACT_POINTS = 4e8, 14

#: Starts of the local search, ways to change an order that it compares at most, and numbers that it compares at a time.
_STARTS, _MOST_WAYS, _AT_A_TIME = 3, 10_000, 2_000_000


@final
@dataclass(frozen=True, eq=False)
class Tour:
    """An order and its states.

    Attributes:
        order: number of the point at each place, shape (K,).
        states: number of the state at each place, shape (K,).
        cost: its cost [s].
        exact: whether no order has a lower cost; else the local search found none.
    """

    order: Array
    states: Array
    cost: float
    exact: bool


def best_tour(free: FreeOrder, times: Array, *, seed: int = 0) -> Tour:
    """The order of least cost.

    Args:
        free: which points are free, and their precedence.
        times: costs from the states of every point to those of every other one, shape (K, K, S, S) [s]; inf where a
            point has no such state.
        seed: seed of the starts of the local search.
    """
    count = len(free.free)
    exact = count <= _EXACT_POINTS and 2.0**count * (count * times.shape[2]) ** 2 <= _EXACT
    order = _exact(free, times) if exact else _local(free, times, np.random.default_rng(seed))
    states, cost = best_states(order[None], times)
    return Tour(order, states[0], float(cost[0]), exact)


def _exact(free: FreeOrder, times: Array) -> Array:
    """The order of least cost, by dynamic programming over the set of free points visited so far.

    A layer holds, for every set that can be visited by a place and every point that can be there, the least costs to
    reach its states.
    """
    bit = {point: 1 << k for k, point in enumerate(free.free)}
    needs = {p: sum(bit[first] for first in free.free if free.before[first, p]) for p in free.free}
    sets, last = np.zeros(1, dtype=np.int64), list(_members(free, 0)[:1])
    layers: list[tuple[Array, list[int], Array]] = []
    cost = np.zeros((0, 0, 0))
    for place in range(free.count):
        here = _members(free, place)
        moved = [(p, _followed(sets, bit.get(p, 0), needs.get(p, 0))) for p in here]
        new_sets = np.unique(np.concatenate([sets[rows] | bit.get(p, 0) for p, rows in moved]))
        new = np.full((len(new_sets), len(here), times.shape[2]), np.inf)
        for k, (p, rows) in enumerate(moved):
            into = np.searchsorted(new_sets, sets[rows] | bit.get(p, 0))
            new[into, k] = _begun(times, p) if place == 0 else _reached(cost[rows], times[last, p])
        layers.append((sets, last, cost))
        sets, last, cost = new_sets, list(here), new
    return _backward(free, times, layers, (sets, last, cost), bit, needs)


def _members(free: FreeOrder, place: int) -> tuple[int, ...]:
    group = free.group_of.get(place)
    return (place,) if group is None else free.groups[group]


def _followed(sets: Array, own: int, needed: int) -> Array:
    """Rows of the sets after which a point can come: it is not in them, and all that it needs is."""
    return np.flatnonzero(((sets & own) == 0) & ((sets & needed) == needed))


def _begun(times: Array, point: int) -> Array:
    return np.where(np.isfinite(times[point]).any(axis=(0, 2)), 0.0, np.inf)


def _reached(cost: Array, step: Array) -> Array:
    """Least costs (N, S) from costs (N, L, S) of the last points and steps (L, S, S)."""
    found = np.full((len(cost), step.shape[2]), np.inf)
    for k in range(len(step)):
        for state in range(step.shape[1]):
            np.minimum(found, cost[:, k, state, None] + step[k, state], out=found)
    return found


def _backward(
    free: FreeOrder,
    times: Array,
    layers: list[tuple[Array, list[int], Array]],
    end: tuple[Array, list[int], Array],
    bit: dict[int, int],
    needs: dict[int, int],
) -> Array:
    """The order that leads to the least cost of the last layer."""
    sets, last, cost = end
    row, point, state = (int(k) for k in np.unravel_index(cost.argmin(), cost.shape))
    order, value, visited = [last[point]], float(cost[row, point, state]), int(sets[row])
    for place in range(free.count - 1, 0, -1):
        sets, last, cost = layers[place]
        visited &= ~bit.get(order[-1], 0)
        row = int(np.searchsorted(sets, visited))
        totals = cost[row] + times[last, order[-1]][:, :, state]
        point, state = (int(k) for k in np.unravel_index(np.abs(totals - value).argmin(), totals.shape))
        order.append(last[point])
        value = float(cost[row, point, state])
    return np.array(order[::-1])


def _local(free: FreeOrder, times: Array, random: np.random.Generator) -> Array:
    """The best order found from several starts by moving and turning round parts of the order."""
    starts = np.concatenate([_greedy(free, times)[None], free.decoded(random.random((_STARTS - 1, len(free.free))))])
    best, least = starts[0], np.inf
    for order in starts:
        cost = best_states(order[None], times)[1][0]
        while True:
            near = neighbours(free, order)
            at_a_time = max(1, _AT_A_TIME // times.shape[2] ** 2)
            parts = [near[k : k + at_a_time] for k in range(0, len(near), at_a_time)]
            found = np.concatenate([best_states(part, times)[1] for part in parts]) if len(near) else np.array([np.inf])
            if found.min() >= cost * (1.0 - 1e-12):
                break
            order, cost = near[found.argmin()], found.min()
        if cost < least:
            best, least = order, cost
    return np.asarray(best)


def _greedy(free: FreeOrder, times: Array) -> Array:
    """The order that goes to the nearest point that may come next."""
    order: list[int] = []
    nearest, left = times.min(axis=(2, 3)), set(range(free.count))
    for place in range(free.count):
        can = [p for p in _members(free, place) if p in left and not any(free.before[q, p] for q in left)]
        order.append(min(can, key=lambda p: nearest[order[-1], p] if order else 0.0))
        left.remove(order[-1])
    return np.array(order)


def neighbours(free: FreeOrder, order: Array) -> Array:
    """Orders with one part turned round, or with up to three points moved elsewhere, that keep the precedence.

    Args:
        free: which points are free.
        order: number of the point at each place, shape (K,).

    Returns:
        Shape (N, K).
    """
    found = [order[None][:0]]
    for group in free.groups:
        places = np.array(group)
        changed = order[places][_rearranged(len(group))]
        orders = np.tile(order, (len(changed), 1))
        orders[:, places] = changed
        found.append(orders)
    every = np.concatenate(found)
    return np.asarray(every[free.keeps(every)])


@cache
def _rearranged(size: int) -> Array:
    """Ways to turn round one part of so many points, or to move up to three elsewhere, as indices (N, size).

    Of many points only those ways are taken that change not too many places, so that there are not too many of them.
    """
    widest = max(3, _MOST_WAYS // (6 * size))
    index, found = np.arange(size), []
    for i in range(size):
        for j in range(i + 1, min(size, i + 1 + widest)):
            found.append(np.concatenate([index[:i], index[i : j + 1][::-1], index[j + 1 :]]))
    for length in (1, 2, 3):
        for i in range(size - length + 1):
            part, rest = index[i : i + length], np.delete(index, np.arange(i, i + length))
            for j in range(max(0, i - widest), min(len(rest), i + widest) + 1):
                if j != i:
                    for way in (part, part[::-1]) if length > 1 else (part,):
                        found.append(np.concatenate([rest[:j], way, rest[j:]]))
    ways = np.unique(np.array(found), axis=0)
    ways.setflags(write=False)
    return ways
