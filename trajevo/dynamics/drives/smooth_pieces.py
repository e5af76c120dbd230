"""Motions in pieces in which torques of all motors are smooth, with values at Gauss nodes.

Efforts and velocities of a segment are polynomials, but what its motors bear jumps or bends where a joint turns round
(losses of gears and dry friction change their direction), where the load of a gear changes its sign, and where the
motor's torque does. The segment's cells, between neighbouring nodes of the effort's polynomial, are split there, for
all joints at once: the sum of their powers is smooth in every piece.

Where cells are split comes from real parts alone; the imaginary parts of complex steps move the splits, so that
derivatives are exact where something jumps.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import final

import numpy as np

from trajevo.base import polynomials
from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.dynamics.drives.motors import Motors
from trajevo.dynamics.integrals.efforts import may_change_sign
from trajevo.dynamics.integrals.nodes import Nodes, lobatto
from trajevo.dynamics.integrals.resolved import Resolved
from trajevo.dynamics.rollout import Rollout

#: Gauss-Legendre nodes of every piece.
NODES = 5

_PLACES, _WEIGHTS = np.polynomial.legendre.leggauss(NODES)

#: Nodes of a piece as shares of it, and weights of sum 1.
SHARES, WEIGHTS = 0.5 * (1.0 + _PLACES), 0.5 * _WEIGHTS

#: Share of the greatest value in a segment that has no sign, and steps by which splits are polished.
_ROUNDING, _POLISHED = 1e-12, 2


@final
@dataclass(frozen=True, eq=False)
class SmoothPieces:
    """L pieces of segments, with values at their Gauss nodes.

    Attributes:
        segments: numbers of their segments among all S of all B trajectories, shape (L,).
        begins: where they begin in their segments, shares of shape (L,).
        widths: how wide they are there.
        durations: shape (L,) [s].
        velocity: velocities of the joints, shape (L, N, n_joints) [rad/s or m/s].
        effort: efforts without dry friction, the same shape [N·m or N].
        acceleration: the same shape [rad/s² or m/s²]; 0 where no rotor asks for it.
    """

    segments: Array
    begins: Array
    widths: Array
    durations: Array
    velocity: Array
    effort: Array
    acceleration: Array

    __repr__ = brief

    def ways(self, standing: Array) -> Array:
        """Signs of the ways in which joints move, 0 at rest, shape (L, 1, n_joints): they are the same in a piece.

        Args:
            standing: greatest speeds at which joints count as at rest, shape (L, n_joints) [rad/s or m/s].
        """
        v = self.velocity.real
        fastest = np.take_along_axis(v, np.abs(v).argmax(axis=1)[:, None], axis=1)
        return np.where(np.abs(fastest) <= standing[:, None], 0.0, np.sign(fastest))

    def integrated(self, values: Array) -> Array:
        """∫ values dt over every piece, shapes (L, N, F) -> (L, F)."""
        total = WEIGHTS[0] * values[:, 0]
        for weight, value in zip(WEIGHTS[1:], values.swapaxes(0, 1)[1:], strict=True):
            total += weight * value
        integral: Array = self.durations[:, None] * total
        return integral


def smooth_pieces(rollout: Rollout, motors: Motors) -> Iterator[SmoothPieces]:
    """All segments of all trajectories in smooth pieces, some at a time."""
    for group in rollout.resolved_for_drives:
        yield from _Segments.of(rollout, motors, group).pieces()


@final
@dataclass(frozen=True, eq=False)
class _Curve:
    """Polynomials of P segments by values at their nodes, shape (P, M, n_joints)."""

    nodes: Nodes
    values: Array

    __repr__ = brief

    def at_cells(self, shares: Array) -> Array:
        """Values at the same shares (U,) of all segments, shape (P, U, n_joints)."""
        values: Array = np.matmul(self.nodes.onto(shares), self.values)
        return values

    def at(self, segments: Array, shares: Array) -> Array:
        """Values at shares (L, N) of segments (L,), shape (L, N, n_joints)."""
        terms = np.polynomial.legendre.legvander(2.0 * shares - 1.0, len(self.nodes.shares) - 1)
        values: Array = np.matmul(terms, self.coefficients(segments))
        return values

    def coefficients(self, segments: Array) -> Array:
        """Coefficients in Legendre polynomials on segments (L,), shape (L, M, n_joints)."""
        used, which = np.unique(segments, return_inverse=True)
        found: Array = np.matmul(self.nodes.coefficients, self.values[used])[which]
        return found


@final
@dataclass(frozen=True, eq=False)
class _Segments:
    """P segments with the same nodes, and what splits their cells."""

    rollout: Rollout
    motors: Motors
    group: Resolved
    effort: _Curve
    velocity: _Curve
    acceleration: _Curve | None

    __repr__ = brief

    @classmethod
    def of(cls, rollout: Rollout, motors: Motors, group: Resolved) -> _Segments:
        nodes = Nodes(lobatto(max(rollout.trajectory.degree, 2))[0])  # exact for velocities
        states = (
            rollout.trajectory.at_shares(nodes.shares, order).reshape(
                rollout.trajectory.segment_durations.size, len(nodes.shares), -1
            )[group.segments]
            for order in (1, 2)
        )
        v, a = (_Curve(nodes, one) for one in states)
        turning = bool(rollout.robot.friction.armature.any())
        return cls(rollout, motors, group, _Curve(group.nodes, group.values), v, a if turning else None)

    def pieces(self) -> Iterator[SmoothPieces]:
        """The cells that nothing splits, and the parts of all others."""
        functions = list(self._functions())
        split = np.zeros((len(self.group.segments), len(self.group.nodes.widths)), dtype=bool)
        for _, changes in functions:
            split |= changes.any(axis=2)
        if not split.all():
            yield self._whole(~split)
        if split.any():
            yield self._parts(split, functions)

    def _functions(self) -> Iterator[tuple[Array, Array]]:
        """Functions whose zeros split cells: values at nodes (P, M, n_joints), and where they may change their sign."""
        nodes, (_, v, a) = self.group.nodes, self.group.states
        durations = self.group.durations[:, None, None]
        rows = self.group.segments // self.rollout.trajectory.segment_durations.shape[1]
        moving = np.where(np.abs(v.real) <= self.rollout.standing[rows, None], 0.0, v.real)
        lossy, dry = self.motors.lossy, self.rollout.robot.friction.is_dry
        if lossy or dry:
            rates = (a * durations).real
            yield v, may_change_sign(nodes, moving[:, :-1], moving[:, 1:], rates, 0.0)
        for bent in self._bent(a if lossy or self._drops else None):
            real = bent.real
            rates = np.matmul(nodes.slopes, real)
            yield bent, may_change_sign(nodes, real[:, :-1], real[:, 1:], rates, _ROUNDING)

    @property
    def _drops(self) -> bool:
        """Whether any inverter loses by the magnitude of its current."""
        return any(drive.inverter_drop for drive in self.motors.drives)

    def _bent(self, a: Array | None) -> Iterator[Array]:
        """Loads of gears, and torques of motors whose sign counts, at nodes, with dry friction of either direction."""
        if a is None:
            return
        friction = self.rollout.robot.friction
        ways = (friction.coulomb, -np.asarray(friction.coulomb_backward)) if friction.is_dry else (0.0,)
        rotor = friction.armature * a
        for dry in ways:
            load = self.group.values + dry - rotor
            yield load
            if self._drops and friction.armature.any():
                for factor in {1.0, *(1.0 / self.motors.driving).tolist(), *self.motors.driven.tolist()}:
                    yield rotor + factor * load

    def _whole(self, chosen: Array) -> SmoothPieces:
        nodes, (segment, cell) = self.group.nodes, np.nonzero(chosen)
        shares = (nodes.shares[:-1, None] + nodes.widths[:, None] * SHARES).reshape(-1)

        def at(curve: _Curve) -> Array:
            values = curve.at_cells(shares)
            of_cells: Array = values.reshape(len(values), -1, NODES, values.shape[2])[segment, cell]
            return of_cells

        return self._made(
            (segment, nodes.shares[cell], nodes.widths[cell]),
            at(self.effort),
            at(self.velocity),
            None if self.acceleration is None else at(self.acceleration),
        )

    def _made(self, place: tuple[Array, Array, Array], effort: Array, v: Array, a: Array | None) -> SmoothPieces:
        segment, begins, widths = place
        return SmoothPieces(
            self.group.segments[segment],
            begins,
            widths,
            self.group.durations[segment] * widths,
            v,
            effort,
            np.zeros((1, 1, effort.shape[2])) if a is None else a,
        )

    def _parts(self, chosen: Array, functions: list[tuple[Array, Array]]) -> SmoothPieces:
        nodes, (segment, cell) = self.group.nodes, np.nonzero(chosen)
        numbers = np.full(chosen.shape, -1)
        numbers[segment, cell] = every = np.arange(len(segment))
        cells, places = [every, every], [np.zeros(len(every)), np.ones(len(every))]
        for values, changes in functions:
            where, at = _zeros(nodes, values, changes)
            cells.append(numbers[where])
            places.append(at)
        owner, place = np.concatenate(cells), np.concatenate(places)
        order = np.lexsort((place.real, owner))
        owner, place = owner[order], place[order]
        within = owner[1:] == owner[:-1]
        owner, lower, upper = owner[1:][within], place[:-1][within], place[1:][within]
        segment, cell = segment[owner], cell[owner]
        begins, widths = nodes.shares[cell] + nodes.widths[cell] * lower, nodes.widths[cell] * (upper - lower)
        shares = begins[:, None] + widths[:, None] * SHARES
        effort, v = (curve.at(segment, shares) for curve in (self.effort, self.velocity))
        a = None if self.acceleration is None else self.acceleration.at(segment, shares)
        return self._made((segment, begins, widths), effort, v, a)


def _zeros(nodes: Nodes, values: Array, chosen: Array) -> tuple[tuple[Array, Array], Array]:
    """Zeros inside cells of functions by their values at nodes (P, M, n_joints).

    Args:
        nodes: M nodes.
        values: the functions.
        chosen: cells and joints in which a function changes its sign at most twice, shape (P, M - 1, n_joints).

    Returns:
        Segments and cells (L,) each, and shares of the cells (L,).
    """
    segment, cell, joint = np.nonzero(chosen)
    curve, width = values[segment, :, joint].T, nodes.widths[cell]
    ends = [
        (
            values[segment, node, joint],
            _sum(nodes.slopes[node].T, curve) * width,
            _sum(nodes.bends[node].T, curve) * width**2,
        )
        for node in (cell, cell + 1)
    ]
    local = polynomials.quintic(*ends)
    start, end = np.zeros(len(cell)), np.ones(len(cell))
    turn = polynomials.crossing(polynomials.derivative(local.real), start, end)
    first, last = polynomials.crossing(local.real, start, turn), polynomials.crossing(local.real, turn, end)
    number = np.concatenate([np.flatnonzero(first < turn), np.flatnonzero((last < end) & (turn < end))])
    place = np.concatenate([first[first < turn], last[(last < end) & (turn < end)]])
    segment, cell, joint = segment[number], cell[number], joint[number]
    coefficients = np.matmul(nodes.coefficients, values[segment, :, joint][:, :, None])[:, :, 0]
    slope = polynomials.values(polynomials.derivative(local.real)[:, number], place)
    for _ in range(_POLISHED):
        at = 2.0 * (nodes.shares[cell] + nodes.widths[cell] * place) - 1.0
        terms = np.polynomial.legendre.legvander(at, len(nodes.shares) - 1)
        value = _sum(coefficients.T, terms.T)
        place = place - np.divide(value, slope, out=np.zeros_like(value), where=slope != 0.0)
    inside = (place.real > 0.0) & (place.real < 1.0)
    return (segment[inside], cell[inside]), place[inside]


def _sum(weights: Array, values: Array) -> Array:
    """Sum over the first axis of products of values (U, K), with the same digits whatever K is."""
    total: Array = weights[0] * values[0]
    for weight, value in zip(weights[1:], values[1:], strict=True):
        total = total + weight * value
    return total
