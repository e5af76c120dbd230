"""Values along motions at as many nodes of every segment as the polynomials through them need.

A rollout has the same few samples in every segment. That is enough for limits in a search, not for integrals of
absolute values to a ten-thousandth. Here a segment gets one more node in every cell until what the polynomial through
its values leaves out is small enough. The decision is made segment by segment and depends on nothing else in a batch.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import final

import numpy as np

from trajevo.base import jit
from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.dynamics.integrals import loops
from trajevo.dynamics.integrals.nodes import Nodes, nested
from trajevo.trajectory.batch import TrajectoryBatch

#: Values (P, T, F) in segments (P,), numbered as in :class:`Resolved`, in states q, v, a (P, T, n_joints).
Field = Callable[[Array, Array, Array, Array], Array]


@final
@dataclass(frozen=True, eq=False)
class Resolved:
    """Segments with the same nodes.

    Attributes:
        nodes: M nodes.
        segments: numbers of the segments among all S of all B trajectories, row by row, shape (P,).
        durations: shape (P,) [s].
        values: values of a field at the nodes, shape (P, M, F) [SI].
    """

    nodes: Nodes
    segments: Array
    durations: Array
    values: Array
    _states: Callable[[], Array]

    __repr__ = brief

    @cached_property
    def states(self) -> Array:
        """Positions, velocities, accelerations at the nodes, shape (3, P, M, n_joints) [rad or m, per s, per s²]."""
        return self._states()

    @property
    def last_terms(self) -> Array:
        """Size of the last terms of the values' polynomials, shape (P, F) [the values' unit]."""
        greater: Array = np.abs(combined(self.nodes.last_terms, self.values.real)).max(axis=0)
        return greater

    def _some(self, chosen: Array) -> Resolved:
        if chosen.all():
            return self
        segments, durations, values = (x[chosen] for x in (self.segments, self.durations, self.values))
        return Resolved(self.nodes, segments, durations, values, lambda: self.states[:, chosen])

    def _finer(self, nodes: Nodes, trajectory: TrajectoryBatch, field: Field) -> Resolved:
        """The same segments with one more node in every cell."""
        count = trajectory.segment_durations.shape[1]
        size = (len(trajectory) * count, len(nodes.shares) // 2, -1)
        fresh = np.stack([trajectory.at_shares(nodes.shares[1::2], k).reshape(size)[self.segments] for k in range(3)])
        between = field(self.segments, *fresh)
        values = _merged(self.values, between)
        return Resolved(nodes, self.segments, self.durations, values, lambda: _merged(self.states, fresh))


def combined(weights: Array, values: Array) -> Array:
    """Sum of values at nodes, shape (P, M, F), times weights (M,): shape (P, F); or (U, P, F) with weights (U, M).

    Node by node: a product of matrices is slow for many small ones, and for one great one the digits of a segment
    would depend on how many there are.
    """
    rows, shape = np.atleast_2d(weights), (len(values), values.shape[2])
    if jit.can_compile():
        summed = np.empty((len(rows), *shape), dtype=values.dtype)
        for row, out in zip(rows, summed, strict=True):
            loops.combined(row, values, out)
    else:
        # Real and imaginary parts side by side, all values at a node in one row: numpy goes through long rows fast.
        at_nodes = np.ascontiguousarray(np.moveaxis(values, 1, 0)).reshape(values.shape[1], -1).view(np.float64)
        total = np.multiply.outer(rows[:, 0], at_nodes[0])
        term = np.empty_like(total)
        for k in range(1, len(at_nodes)):
            total += np.multiply.outer(rows[:, k], at_nodes[k], out=term)
        summed = total.view(values.dtype).reshape(len(rows), *shape)
    return summed if weights.ndim == 2 else summed[0]


def _merged(at_nodes: Array, between: Array) -> Array:
    """Values at nodes and between them, (..., M, F) and (..., M - 1, F), in order."""
    merged = np.empty((*at_nodes.shape[:-2], 2 * at_nodes.shape[-2] - 1, at_nodes.shape[-1]), dtype=at_nodes.dtype)
    merged[..., ::2, :], merged[..., 1::2, :] = at_nodes, between
    return merged


def at_samples(
    trajectory: TrajectoryBatch, samples: int, states: tuple[Array, Array, Array], values: Array
) -> Resolved:
    """All segments with their Gauss-Lobatto nodes, from states and values (B, T, ...) at the samples of a rollout."""
    durations = trajectory.segment_durations
    size = (durations.size, samples, -1)
    return Resolved(
        nested(samples)[0],
        np.arange(durations.size),
        durations.reshape(-1),
        values.reshape(size),
        lambda: np.stack([x.reshape(size) for x in states]),
    )


def resolve(
    first: Resolved,
    trajectory: TrajectoryBatch,
    field: Field,
    *,
    left_out: Callable[[Resolved], Array],
    allowed: Array,
) -> tuple[Resolved, ...]:
    """Values of a field at as many nodes as they need.

    Args:
        first: all segments with their first nodes, see :func:`at_samples`.
        trajectory: the B trajectories.
        field: what is computed.
        left_out: estimate of what the polynomials leave out of what is integrated, shape (P,).
        allowed: how much they may leave out, shape (B x S,).

    Returns:
        Groups of segments, each segment in one of them. A segment with the most nodes may leave out more.
    """
    group, done = first, []
    for nodes in nested(len(first.nodes.shares))[1:]:
        lacking = left_out(group) > allowed[group.segments]
        done.append(group._some(~lacking))
        group = group._some(lacking)
        if not len(group.segments):
            break
        group = group._finer(nodes, trajectory, field)
    done.append(group)
    return tuple(part for part in done if len(part.segments))
