"""Integrals over motions of absolute values, squares and rates of efforts, split where signs change.

A joint's effort is a smooth part, which a polynomial through its values at nodes describes, and dry friction, which
jumps where the joint turns. Between two neighbouring nodes, in a cell, the polynomial is integrated exactly, with the
dry friction of the cell's direction. What changes if the velocity or the effort changes its sign within a cell comes
from cubics with the right values and slopes at both ends; it grows from 0 as the change moves into the cell, so that
integrals have no steps there.

Signs and where they change come from real parts alone. The integrands vanish there, so that imaginary parts of complex
steps are exact derivatives.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from trajevo.base import jit, polynomials
from trajevo.base.arrays import Array
from trajevo.dynamics.integrals import loops
from trajevo.dynamics.integrals.nodes import Nodes, for_squares
from trajevo.dynamics.integrals.resolved import Resolved, combined
from trajevo.dynamics.rollout import Rollout
from trajevo.robot.joints import Sides

#: Gauss-Legendre nodes on [-1, 1] and weights, exact for a product of two cubics, and for its square.
_PRODUCT, _SQUARE = np.polynomial.legendre.leggauss(4), np.polynomial.legendre.leggauss(7)


#: Share of a joint's greatest effort in a segment that has no sign.
_ROUNDING = 1e-9
#: Share of it from which the effort does not reach zero and return within a cell.
_FAR = 0.3

#: What the effort is multiplied by, from velocities of any shape.
Factor = Callable[[Array], Array]


class _Cells(NamedTuple):
    """What happens in the cells of all joints, each array (P, M - 1, n_joints).

    Attributes:
        dry: dry friction in the direction in which the joint moves on the whole, 0 at rest [N·m or N].
        turns: whether the joint may turn.
        reverses: whether its effort may change its sign.
    """

    dry: Array
    turns: Array
    reverses: Array


class _Pieces(NamedTuple):
    """Pieces of K cells in which neither velocity nor effort changes its sign.

    Attributes:
        cells: numbers of their cells, shape (L,); every cell has at least one piece.
        spans: half their durations (L,) [s].
        effort: effort with dry friction at Gauss nodes, shape (U, L) [N·m or N].
        v: velocities there [rad/s or m/s].
    """

    cells: Array
    spans: Array
    effort: Array
    v: Array

    def summed(self, values: Array) -> Array:
        """Sum of values (L,) over the pieces of every cell, shape (K,)."""
        total = np.zeros(self.cells.max() + 1, dtype=values.dtype)
        np.add.at(total, self.cells, values)
        return total


def mechanical_energy(rollout: Rollout) -> Array:
    """∫ Σ over joints of |effort x velocity| dt, shape (B,) [J]: braking costs too."""

    def of(group: Resolved) -> Array:
        q, v, _ = group.states
        cells = _cells(rollout, group)
        work = np.matmul(group.nodes.integrals, group.values * v) * group.durations[:, None, None]
        if rollout.robot.friction.is_dry:
            work += cells.dry * np.diff(q, axis=1)
        split = cells.turns | cells.reverses
        absolute = work * np.sign(work.real)
        if split.any():
            absolute[split] = _split_work(rollout, group, cells, split, work[split])
        total: Array = absolute.sum(axis=(1, 2))
        return total

    return _summed(rollout, rollout.resolved, of)


def integrated_square_power(rollout: Rollout) -> Array:
    """∫ Σ over joints of (effort x velocity)² dt, shape (B,) [W²·s]."""
    return _summed(rollout, rollout.resolved_for_square_power, lambda group: _squares(rollout, group, np.asarray))


def integrated_square_effort(rollout: Rollout) -> Array:
    """∫ Σ over joints of effort² dt, shape (B,) [(N·m)²·s or N²·s]: what heats motors."""
    return _summed(rollout, rollout.resolved_for_square_effort, lambda group: _squares(rollout, group, np.ones_like))


def integrated_square_effort_rate(rollout: Rollout) -> Array:
    """∫ Σ over joints of (d effort / dt)² dt, shape (B,) [(N·m)²/s or N²/s].

    Steps do not count: those between segments, and those of dry friction where a joint turns.
    """

    def of(group: Resolved) -> Array:
        rates = np.matmul(group.nodes.slopes, group.values)
        total: Array = np.matmul(group.nodes.integrals, rates * rates).sum(axis=(1, 2)) / group.durations
        return total

    return _summed(rollout, rollout.resolved_for_peaks, of)


def greatest_efforts(rollout: Rollout) -> Array:
    """Greatest |effort| of every joint over the whole motion, not only at samples, shape (B, n_joints) [N·m or N].

    Of a joint whose limit differs by direction, it is what uses as much of the lesser limit as the effort does of its
    own, see :meth:`~trajevo.robot.joints.Sides.as_lesser`.
    """
    limits = rollout.robot.limits.sides("effort")
    per_segment = np.empty((rollout.trajectory.segment_durations.size, rollout.robot.dof), dtype=rollout.effort.dtype)
    for group in rollout.resolved_for_peaks:
        cells, values = _cells(rollout, group), group.values
        ends = np.stack([values[:, :-1] + cells.dry, values[:, 1:] + cells.dry])
        peaks = (ends * _signs(ends, limits)).max(axis=0)
        rates = np.matmul(group.nodes.slopes, values).real
        inside = cells.turns | (rates[:, :-1] * rates[:, 1:] < 0.0)
        if inside.any():
            peaks[inside] = _peaks(rollout, group, cells, inside)
        per_segment[group.segments] = peaks.max(axis=1)
    found: Array = per_segment.reshape(len(rollout.trajectory), -1, rollout.robot.dof).max(axis=1)
    return found


def greatest_effort_rates(rollout: Rollout) -> Array:
    """Greatest |d effort / dt| of every joint over the whole motion, shape (B, n_joints) [N·m/s or N/s].

    It is that of cubics between neighbouring nodes of the efforts' polynomials, not of samples alone. Steps do not
    count: those between segments, and those of dry friction where a joint turns.
    """
    per_segment = np.empty((rollout.trajectory.segment_durations.size, rollout.robot.dof), dtype=rollout.effort.dtype)
    for group in rollout.resolved_for_peaks:
        rates = np.matmul(group.nodes.slopes, group.values)
        bends = np.matmul(group.nodes.slopes, rates)
        width = group.nodes.widths[:, None]
        cells = polynomials.cubic(rates[:, :-1], bends[:, :-1] * width, rates[:, 1:], bends[:, 1:] * width)
        extremes = np.concatenate(polynomials.extremes(cells.reshape(4, -1), 1))
        peaks = (extremes * np.sign(extremes.real)).max(axis=0).reshape(cells.shape[1:]).max(axis=1)
        per_segment[group.segments] = peaks / group.durations[:, None]
    found: Array = per_segment.reshape(len(rollout.trajectory), -1, rollout.robot.dof).max(axis=1)
    return found


def _summed(rollout: Rollout, groups: tuple[Resolved, ...], of: Callable[[Resolved], Array]) -> Array:
    """Sum over the segments of every trajectory, shape (B,)."""
    per_segment = np.empty(rollout.trajectory.segment_durations.shape, dtype=rollout.effort.dtype)
    for group in groups:
        per_segment.reshape(-1)[group.segments] = of(group)
    total: Array = per_segment.sum(axis=1)
    return total


def _split_work(rollout: Rollout, group: Resolved, cells: _Cells, split: Array, work: Array) -> Array:
    """∫ |effort x velocity| dt over the cells that are split, shape (K,), from the integral without their split."""
    cubics = _cubics(group, split)
    pieces = _pieces(cubics, _parts(rollout, cubics, cells, split), _PRODUCT[0])
    part = pieces.spans * _sum(_PRODUCT[1], pieces.effort * pieces.v)
    absolute = pieces.summed(part * np.sign(part.real))
    effort, v = cubics.at(_PRODUCT[0])
    signed = (
        0.5 * cubics.spans * _sum(_PRODUCT[1], effort * v) + cells.dry[split] * np.diff(group.states[0], axis=1)[split]
    )
    share = np.divide(signed, absolute, out=np.zeros_like(signed), where=absolute.real > 0.0)
    found: Array = absolute + share * (work - signed)
    return found


def _squares(rollout: Rollout, group: Resolved, factor: Factor) -> Array:
    """∫ Σ over joints of (effort x factor)² dt over every segment, shape (P,)."""
    smooth, integrals = group.values, group.nodes.integrals
    if not rollout.robot.friction.is_dry:
        return _smooth_squares(rollout, group, factor)
    weight = np.square(factor(group.states[1]))
    powers = [np.matmul(integrals, smooth * smooth * weight)]
    powers += [np.matmul(integrals, smooth * weight), np.matmul(integrals, weight)]
    powers = [power * group.durations[:, None, None] for power in powers]
    cells = _cells(rollout, group)
    found = powers[0] + cells.dry * (2.0 * powers[1] + cells.dry * powers[2])
    if cells.turns.any():
        found[cells.turns] = _split_squares(rollout, group, cells, factor, [power[cells.turns] for power in powers])
    total: Array = found.sum(axis=(1, 2))
    return total


def _smooth_squares(rollout: Rollout, group: Resolved, factor: Factor) -> Array:
    """As :func:`_squares`, without dry friction: a polynomial times the exact velocity, squared."""
    trajectory, values = rollout.trajectory, group.values
    shares, weights, onto = for_squares(group.nodes, trajectory.degree - 1)
    v = trajectory.at_shares(shares, 1).reshape(trajectory.segment_durations.size, len(shares), -1)
    factors = factor(v[group.segments])
    if jit.can_compile():
        square = np.empty(len(values), dtype=values.dtype)
        loops.squares(onto, weights, values, factors, square)
    else:
        # Nodes of the quadrature first, then segments: what numpy goes through at a time lies in one piece.
        effort = combined(onto, values) * np.moveaxis(factors, 1, 0)
        square = _sum(weights, np.square(effort)).sum(axis=1)
    total: Array = square * group.durations
    return total


def _split_squares(rollout: Rollout, group: Resolved, cells: _Cells, factor: Factor, powers: list[Array]) -> Array:
    """∫ (effort x factor)² dt over the cells in which a joint turns, shape (K,).

    ``powers`` are the integrals of factor² times the effort without dry friction to the power 2, 1 and 0.
    """
    cubics = _cubics(group, cells.turns)
    parts = _parts(rollout, cubics, cells, cells.turns)
    pieces = _pieces(cubics, parts, _SQUARE[0])
    split = pieces.summed(pieces.spans * _sum(_SQUARE[1], np.square(pieces.effort * factor(pieces.v))))
    effort, v = cubics.at(_SQUARE[0])
    weight = np.square(factor(v))
    by_cubics = [0.5 * cubics.spans * _sum(_SQUARE[1], effort**power * weight) for power in (2, 1, 0)]
    second, first, zeroth = (exact - cubic for exact, cubic in zip(powers, by_cubics, strict=True))
    dry = np.zeros_like(split)
    np.add.at(dry, parts.cells, (parts.upper - parts.lower) * parts.dry)
    found: Array = split + second + dry * (2.0 * first + dry * zeroth)
    return found


def _sum(weights: Array, values: Array) -> Array:
    """Sum over the first axis of values (U, K) times weights (U,) or (U, K), with the same digits whatever K is."""
    total: Array = weights[0] * values[0]
    for weight, value in zip(weights[1:], values[1:], strict=True):
        total += weight * value
    return total


def _cells(rollout: Rollout, group: Resolved) -> _Cells:
    q, v, a = group.states.real
    standing = rollout.standing[group.segments // rollout.trajectory.segment_durations.shape[1], None]
    v = np.where(np.abs(v) <= standing, 0.0, v)
    effort = group.values.real
    rates = np.matmul(group.nodes.slopes, effort)
    first, last = effort[:, :-1], effort[:, 1:]
    if rollout.robot.friction.is_dry:
        moved = np.diff(q, axis=1)
        rest = np.abs(moved) <= standing * (group.durations.real[:, None, None] * group.nodes.widths[:, None])
        dry = rollout.robot.friction.dry(np.where(rest, 0.0, moved))
        first, last = first + dry, last + dry
    else:
        dry = np.zeros(first.shape)
    return _Cells(
        dry,
        may_change_sign(group.nodes, v[:, :-1], v[:, 1:], a * group.durations.real[:, None, None], 0.0),
        may_change_sign(group.nodes, first, last, rates, _ROUNDING),
    )


def may_change_sign(nodes: Nodes, first: Array, last: Array, rates: Array, rounding: float) -> Array:
    """Whether what has given values at both ends of cells may change its sign there, once or twice.

    Args:
        nodes: M nodes.
        first: values at the beginning of the cells, shape (P, M - 1, n_joints).
        last: values at their end.
        rates: slopes at the nodes, per share of the segment, shape (P, M, n_joints).
        rounding: share of the greatest value up to which values have no sign.
    """
    near = np.minimum(np.abs(first), np.abs(last))
    greatest, changes = near.max(axis=1, keepdims=True), first * last < 0.0
    # Places in flat arrays: numpy takes them several times as fast as by three indices.
    places, cells, joints = np.flatnonzero((near < _FAR * greatest) & ~changes), *near.shape[1:]
    width, least = nodes.widths[places // joints % cells], near.take(places)
    before = places + places // (cells * joints) * joints  # of rates there is one more in every segment
    slope, last_slope = rates.take(before) * width, rates.take(before + joints) * width
    sign = np.sign(first.take(places))
    # A cubic leaves the range of its values at the ends by at most 4/27 of its slopes there.
    back = (
        (sign * slope < 0.0) & (sign * last_slope > 0.0) & (27.0 * least < 4.0 * (np.abs(slope) + np.abs(last_slope)))
    )
    changes.put(places, back)
    found: Array = changes & (near > rounding * greatest)
    return found


class _Cubics(NamedTuple):
    """Effort and velocity in K cells.

    Attributes:
        effort: coefficients of the effort without dry friction on [0, 1], shape (4, K) [N·m or N].
        v: coefficients of the velocity [rad/s or m/s].
        spans: durations of the cells, shape (K,) [s].
        joints: numbers of their joints.
    """

    effort: Array
    v: Array
    spans: Array
    joints: Array

    def at(self, nodes: Array) -> tuple[Array, Array]:
        """Effort without dry friction and velocity at nodes on [-1, 1], each (U, K)."""
        shares = 0.5 * (1.0 + nodes[:, None])
        return polynomials.values(self.effort[:, None], shares), polynomials.values(self.v[:, None], shares)


def _cubics(group: Resolved, chosen: Array) -> _Cubics:
    """Cubics with the values and slopes at both ends of the chosen cells, a mask (P, M - 1, n_joints)."""
    segment, cell, joint = np.nonzero(chosen)
    width, (_, v, a) = group.nodes.widths[cell], group.states
    span, effort = group.durations[segment] * width, group.values[segment, :, joint]
    efforts, speeds = [], []
    for node in (cell, cell + 1):
        efforts += [group.values[segment, node, joint], _sum(group.nodes.slopes[node].T, effort.T) * width]
        speeds += [v[segment, node, joint], a[segment, node, joint] * span]
    return _Cubics(polynomials.cubic(*efforts), polynomials.cubic(*speeds), span, joint)


class _Parts(NamedTuple):
    """Parts of K cells in which the velocity keeps its sign.

    Attributes:
        cells: numbers of their cells, shape (L,); every cell has at least one part.
        lower: where they begin in their cells, shares of shape (L,).
        upper: where they end.
        dry: their dry friction [N·m or N].
    """

    cells: Array
    lower: Array
    upper: Array
    dry: Array


def _parts(rollout: Rollout, cubics: _Cubics, cells: _Cells, chosen: Array) -> _Parts:
    which, lower, upper = polynomials.of_one_sign(cubics.v, np.zeros(len(cubics.spans)), np.ones(len(cubics.spans)))
    middle = polynomials.values(cubics.v[:, which].real, 0.5 * (lower + upper).real)
    friction, joints = rollout.robot.friction, cubics.joints[which]
    directed = np.where(middle > 0.0, friction.coulomb[joints], -np.asarray(friction.coulomb_backward)[joints])
    return _Parts(which, lower, upper, np.where(cells.turns[chosen][which], directed, cells.dry[chosen][which]))


def _pieces(cubics: _Cubics, parts: _Parts, nodes: Array) -> _Pieces:
    """The cells of the parts in pieces, with their values at nodes on [-1, 1]."""
    effort = cubics.effort[:, parts.cells]
    effort[0] += parts.dry
    part, lower, upper = polynomials.of_one_sign(effort, parts.lower, parts.upper)
    half, which = 0.5 * (upper - lower), parts.cells[part]
    at = lower + half * (1.0 + nodes[:, None])
    return _Pieces(
        which,
        half * cubics.spans[which],
        polynomials.values(effort[:, None, part], at),
        polynomials.values(cubics.v[:, None, which], at),
    )


def _peaks(rollout: Rollout, group: Resolved, cells: _Cells, chosen: Array) -> Array:
    """Greatest |effort| in the chosen cells, shape (K,): of quintics, as cubics miss peaks by up to a thousandth."""
    cubics, quintics = _cubics(group, chosen), _quintics(group, chosen)
    which, lower, upper, dry = _parts(rollout, cubics, cells, chosen)
    within, nearby = (
        polynomials.shifted(curve[:, which], lower) * (upper - lower) ** np.arange(len(curve))[:, None]
        for curve in (quintics, cubics.effort)
    )
    effort = polynomials.extremes_near_cubics(within, nearby) + dry
    found = np.zeros(len(cubics.spans), dtype=effort.dtype)
    signs = _signs(effort, rollout.robot.limits.sides("effort")[cubics.joints[which]])
    np.maximum.at(found, which, (effort * signs).max(axis=0))
    return found


def _quintics(group: Resolved, chosen: Array) -> Array:
    """Coefficients (6, K) of the effort without dry friction in the chosen cells, right to second derivatives."""
    segment, cell, joint = np.nonzero(chosen)
    width, effort = group.nodes.widths[cell], group.values[segment, :, joint].T
    start, end = (
        (
            group.values[segment, node, joint],
            _sum(group.nodes.slopes[node].T, effort) * width,
            _sum(group.nodes.bends[node].T, effort) * width**2,
        )
        for node in (cell, cell + 1)
    )
    return polynomials.quintic(start, end)


def _signs(effort: Array, limits: Sides) -> Array:
    """What efforts (..., K) are multiplied by to count in either direction, with limits (K,)."""
    signs: Array = np.sign(effort.real)
    return signs if limits.agree else signs * limits.weights(effort)
