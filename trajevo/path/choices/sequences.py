"""The best postures for points in a given order, under a cost that is a sum over the steps from point to point.

Every point has states, joint positions that reach it, and every state has a label: states of the same posture that
differ by whole turns of joints have the same one. :func:`best_sequences` lists the best sequences of labels, each with
its best states, exactly; :func:`best_states` finds the best states for many orders at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from trajevo.base.arrays import Array, frozen


@final
@dataclass(frozen=True, eq=False)
class Sequences:
    """Sequences of states through the points, the best first.

    Attributes:
        cost: their costs, shape (R,) [s].
        states: number of the state at each point, shape (R, K).
    """

    cost: Array
    states: Array


def best_sequences(costs: Sequence[Array], labels: Sequence[Array], count: int) -> Sequences:
    """The best sequences of labels, each with the states of least cost.

    A dynamic program keeps, at every state, the best ``count`` sequences of labels that lead there. That is exact: if a
    sequence's beginning is not among them, as many others have a better beginning, and with the same end they are all
    better.

    Args:
        costs: from the states of each point to those of the next one, shapes (S_k, S_k+1) [s]; inf where there is no
            way.
        labels: labels of the states of each point, whole numbers, shapes (S_k,).
        count: greatest number of sequences.

    Returns:
        At most ``count`` sequences of finite cost, all with different labels.
    """
    cost = np.zeros((len(labels[0]), 1))
    ids = _told_apart(np.zeros((len(labels[0]), 1), dtype=np.int64), labels[0])
    steps: list[tuple[Array, Array]] = []
    for step, label in zip(costs, labels[1:], strict=True):
        width = cost.shape[1]
        totals = (step.T[:, :, None] + cost[None]).reshape(len(label), -1)
        chosen = _distinct(totals, np.broadcast_to(ids.reshape(-1), totals.shape), count)
        cost = np.take_along_axis(totals, chosen, axis=1)
        cost[chosen < 0] = np.inf
        steps.append((chosen // width, chosen % width))
        ids = _told_apart(ids.reshape(-1)[chosen], label)
    last = _distinct(cost.reshape(1, -1), ids.reshape(1, -1), count)[0]
    last = last[(last >= 0) & np.isfinite(cost.reshape(-1)[last])]
    states = np.empty((len(last), len(labels)), dtype=np.int64)
    state, way = last // cost.shape[1], last % cost.shape[1]
    for k in range(len(labels) - 1, 0, -1):
        states[:, k] = state
        state, way = steps[k - 1][0][state, way], steps[k - 1][1][state, way]
    states[:, 0] = state
    states.setflags(write=False)
    return Sequences(frozen(cost.reshape(-1)[last]), states)


def _told_apart(before: Array, labels: Array) -> Array:
    """Numbers of sequences of labels (S, R), from those of their beginnings and the labels (S,) that follow."""
    pairs = np.stack([before, np.broadcast_to(labels[:, None], before.shape)], axis=-1).reshape(-1, 2)
    found = np.unique(pairs, axis=0, return_inverse=True)[1]
    return np.asarray(found, dtype=np.int64).reshape(before.shape)


def _distinct(totals: Array, ids: Array, count: int) -> Array:
    """In every row the columns of least total, the best of each id, at most ``count``; -1 where there are fewer."""
    rows = np.arange(len(totals))[:, None]
    by_total = np.argsort(totals, axis=1, kind="stable")
    sorted_ids = ids[rows, by_total]
    by_id = np.argsort(sorted_ids, axis=1, kind="stable")
    grouped = sorted_ids[rows, by_id]
    leads = np.concatenate([np.ones((len(totals), 1), dtype=bool), grouped[:, 1:] != grouped[:, :-1]], axis=1)
    first = np.zeros(totals.shape, dtype=bool)
    first[rows, by_id] = leads
    first &= np.isfinite(totals[rows, by_total])
    place = np.cumsum(first, axis=1) - 1
    width = max(1, min(count, int(first.sum(axis=1).max(initial=1))))
    found = np.full((len(totals), width), -1, dtype=np.int64)
    row, column = np.nonzero(first & (place < width))
    found[row, place[row, column]] = by_total[row, column]
    return found


def best_states(orders: Array, times: Array, allowed: Array | None = None) -> tuple[Array, Array]:
    """The states of least cost for points in given orders.

    Args:
        orders: number of the point at each place, shape (B, K).
        times: from the states of every point to those of every other one, shape (P, P, S, S) [s].
        allowed: which states of each point may be chosen, for each order, shape (B, P, S); all if None.

    Returns:
        Number of the state at each place (B, K), and the costs, shape (B,) [s].
    """
    rows = np.arange(len(orders))
    barred = None if allowed is None else np.where(allowed, 0.0, np.inf)
    cost = np.zeros((len(orders), times.shape[2]))
    there = np.asarray(np.isfinite(times).any(axis=(1, 3)))  # (P, S)
    cost[~there[orders[:, 0]]] = np.inf
    if barred is not None:
        cost = cost + barred[rows, orders[:, 0]]
    came = []
    for before, point in zip(orders.T[:-1], orders.T[1:], strict=True):
        totals = cost[:, :, None] + times[before, point]
        best = totals.argmin(axis=1)
        cost = np.take_along_axis(totals, best[:, None], axis=1)[:, 0]
        if barred is not None:
            cost = cost + barred[rows, point]
        came.append(best)
    states = np.empty(orders.shape, dtype=np.int64)
    states[:, -1] = cost.argmin(axis=1)
    for k in range(len(came) - 1, -1, -1):
        states[:, k] = came[k][rows, states[:, k + 1]]
    return states, cost.min(axis=1)
