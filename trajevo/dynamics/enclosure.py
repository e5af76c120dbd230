"""Bounds of effort, mechanical power and tool speed at every instant of a motion.

Each piece of a motion is enclosed from a few samples (:mod:`trajevo.dynamics.piece_bounds`). Pieces whose bound exceeds
the greatest sample are halved until it does so by no more than a tolerance or, where only a limit matters, until it is
known whether the limit is kept.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import final

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.dynamics.complex_bounds import Bounds
from trajevo.dynamics.piece_bounds import LEAST_WIDTH, Over, PieceBounds, Pieces
from trajevo.dynamics.rollout import Rollout
from trajevo.trajectory.bernstein import gauss

#: Number of nodes of a piece.
_NODES = 14
#: Greatest average number of pieces per motion to halve at a time; with more, no piece is halved any more.
_MOST_PIECES = 2000
#: Greatest number of pieces of one motion to halve at a time; with more, the motion is left undecided.
_MOST_UNDECIDED = 256
#: A piece is halved only if its bound exceeds the samples by more than this many slacks for rounding. They count only
#: up to this share of the tolerance: while the bound of the magnitude is still useless, so is the slack from it.
_SLACKS, _SLACK_SHARE = 4.0, 0.01
#: Share of the greatest value of all joints below which values without a limit are not resolved.
_NEGLIGIBLE = 1e-3
#: Share of their coarse bound below which samples are nothing but rounding, such as the speed of a tool on the axis
#: about which it turns. The square root of a tool's squared speed loses half the digits.
_NOTHING = 1e-6
#: Excess of a bound over a limit that samples keep, as a share of the limit, below which no piece is halved.
_FINEST = 1e-9


@final
@dataclass(frozen=True, eq=False)
class Enclosure:
    """Magnitudes over whole motions, in columns: efforts of the joints, their mechanical powers, the tool's speed.

    The effort of a joint whose limit differs by direction is what uses as much of the lesser limit as the effort does
    of its own, see :meth:`~trajevo.robot.joints.Sides.as_lesser`.

    Attributes:
        bound: upper bound at all instants, shape (B, 2 n_joints + 1) [N·m or N, W, m/s].
        exhibited: the greatest value of any sample, the same shape.
        instants: instants of these samples, the same shape [s].
        pieces: number of pieces that each motion was cut into, shape (B,).
        scale: what the tolerance is a share of, shape (B, 2 n_joints + 1): the limit or, without one, the greatest
            exhibited value, but no less than a thousandth of the greatest of all joints. If that is nothing but
            rounding, a coarse bound from the sizes of the robot and its motion.
    """

    bound: Array
    exhibited: Array
    instants: Array
    pieces: Array
    scale: Array


def enclose(rollout: Rollout, limits: Array, *, tolerance: float) -> Enclosure:
    """Bound efforts, powers and tool speed at every instant by adaptive subdivision.

    Args:
        rollout: one robot on B motions.
        limits: limits of the columns, inf for none, shape (2 n_joints + 1,); where directions differ, the lesser.
        tolerance: how far a bound may lie above the samples, as a share of :attr:`Enclosure.scale`. Where the samples
            keep a limit that the bound still exceeds, pieces are halved further.

    Returns:
        Bounds and exhibited values.
    """
    return _everything(rollout, limits, tolerance, None)


def enclose_pieces(rollout: Rollout, limits: Array, *, tolerance: float) -> tuple[Pieces, Array]:
    """The pieces into which :func:`enclose` cuts motions, and its bounds over each of the K pieces.

    Args:
        rollout: one robot on B motions.
        limits: as for :func:`enclose`.
        tolerance: as for :func:`enclose`.

    Returns:
        The pieces in no order, and bounds of shape (K, 2 n_joints + 1) [N·m or N, W, m/s].
    """
    kept: list[tuple[Pieces, Array]] = []
    _everything(rollout, limits, tolerance, kept)
    parts, bounds = zip(*kept, strict=True)
    return Pieces(*(np.concatenate(columns) for columns in zip(*parts, strict=True))), np.concatenate(bounds)


def _everything(
    rollout: Rollout, limits: Array, tolerance: float, kept: list[tuple[Pieces, Array]] | None
) -> Enclosure:
    """As :func:`enclose`; pieces that are not cut any more are added to a list, with their bounds."""
    bounds, pieces = PieceBounds.of(rollout), Pieces.of(rollout, _NODES)
    coarse = np.zeros((len(rollout.trajectory), len(limits)))
    np.maximum.at(coarse, pieces.owner, bounds.magnitudes(pieces))
    scale = partial(_scale, coarse=coarse)
    return _enclosed(bounds.everything, pieces, rollout, limits, scale, tolerance, kept)


def enclose_height(rollout: Rollout, least: float, *, tolerance: float) -> tuple[Array, Array, Array]:
    """Bound the height of the tool at every instant from below.

    Args:
        rollout: one robot on B motions.
        least: height that is to be kept [m].
        tolerance: how far the bound may lie below the samples [m].

    Returns:
        Lower bound, least sample, shapes (B,) [m], and its instant, shape (B,) [s].
    """
    bounds = PieceBounds.of(rollout)
    peaks = rollout.trajectory.peak(0).real.max(axis=0)
    none = np.zeros_like(peaks)
    # No position is further from the base: the magnitudes that are enclosed below are never negative.
    height = float(bounds.reach.tool_distance(Bounds(none, peaks, none, none))) + abs(least)

    def below(pieces: Pieces) -> Over:
        return bounds.tool_below(pieces, height)

    limit = np.array([height - least])
    found = _enclosed(
        below, Pieces.of(rollout, _NODES), rollout, limit, lambda best, limits: np.ones_like(best), tolerance
    )
    return height - found.bound[:, 0], height - found.exhibited[:, 0], found.instants[:, 0]


def enclose_part(
    rollout: Rollout, over: Callable[[PieceBounds, Pieces], Over], segments: Array, limits: Array, *, tolerance: float
) -> tuple[Array, Array, Array]:
    """Bound quantities at every instant of some segments.

    Args:
        rollout: one robot on B motions.
        over: bounds of Q quantities over pieces.
        segments: numbers of the segments.
        limits: limits of the quantities, shape (Q,).
        tolerance: how far bounds may lie above the samples, as a share of the limits.

    Returns:
        Upper bounds, greatest samples, and their instants [s], shape (B, Q) each.
    """
    bounds, pieces = PieceBounds.of(rollout), Pieces.of(rollout, _NODES)
    chosen = pieces.rows(np.isin(pieces.segment, segments))

    def scale(best: Array, limits: Array) -> Array:
        return np.broadcast_to(limits, best.shape)

    found = _enclosed(lambda some: over(bounds, some), chosen, rollout, limits, scale, tolerance)
    return found.bound, found.exhibited, found.instants


def _enclosed(
    over: Callable[[Pieces], Over],
    pieces: Pieces,
    rollout: Rollout,
    limits: Array,
    scale: Callable[[Array, Array], Array],
    tolerance: float,
    kept: list[tuple[Pieces, Array]] | None = None,
) -> Enclosure:
    count = len(rollout.trajectory)
    bound, best, instants = (np.zeros((count, len(limits))) for _ in range(3))
    used = np.zeros(count, dtype=np.intp)
    shortest = LEAST_WIDTH * rollout.trajectory.duration
    while len(pieces.owner):
        above, slack, found = over(pieces)
        _remember(pieces, found, best, instants)
        allowed = tolerance * scale(best, limits)[pieces.owner]
        known = best[pieces.owner] + np.minimum(_SLACKS * slack, _SLACK_SHARE * allowed)
        most = known + allowed
        undecided = (best[pieces.owner] <= limits) & (most > limits)
        most = np.where(undecided, np.maximum(limits, known) + _FINEST * limits, most)
        open_ = ~(above <= most).all(axis=1) & (pieces.width > shortest[pieces.owner])
        if open_.sum() > _MOST_PIECES * count:
            open_[:] = False
        np.maximum.at(bound, pieces.owner[~open_], above[~open_])
        np.add.at(used, pieces.owner[~open_], 1)
        if kept is not None:
            kept.append((pieces.rows(~open_), above[~open_]))
        pieces = pieces.rows(open_).halved()
    return Enclosure(frozen(bound), frozen(best), frozen(instants), used, frozen(scale(best, limits)))


def _scale(best: Array, limits: Array, coarse: Array) -> Array:
    """As :attr:`Enclosure.scale`."""
    n = len(limits) // 2
    joints = [best[:, part].max(axis=1, keepdims=True) for part in (slice(0, n), slice(n, 2 * n))]
    least = np.concatenate([np.repeat(_NEGLIGIBLE * most, n, axis=1) for most in joints], axis=1)
    shown = np.maximum(best, np.concatenate([least, np.zeros((len(best), 1))], axis=1))
    shown = np.where(np.isfinite(coarse) & (shown <= _NOTHING * coarse), coarse, shown)
    return np.where(np.isfinite(limits), limits, shown)


def decide(over: Callable[[Pieces], Over], pieces: Pieces, limits: Array, *, motions: int) -> Array:
    """Decide whether motions keep limits at every instant, with pieces cut only as far as that needs.

    Args:
        over: a method of :class:`~trajevo.dynamics.piece_bounds.PieceBounds` with Q columns.
        pieces: the motions' segments.
        limits: limits of the columns, inf for none, shape (Q,).
        motions: number of motions, B.

    Returns:
        Shape (B, Q). For a motion that keeps every limit, proven bounds of its columns. For one that breaks a limit,
        the greatest values found so far. If neither could be shown, bounds, at least one of them above its limit.
    """
    bound, best, broken = np.zeros((motions, len(limits))), np.zeros((motions, len(limits))), np.zeros(motions, bool)
    shortest = LEAST_WIDTH * np.bincount(pieces.owner, pieces.width, motions)
    while len(pieces.owner):
        above, slack, found = over(pieces)
        np.maximum.at(best, pieces.owner, found.max(axis=1))
        broken = np.asarray((best > limits).any(axis=1))
        near = np.maximum(best[pieces.owner] + _SLACKS * slack, limits) + _FINEST * limits
        open_ = ~(above <= limits).all(axis=1) & ~broken[pieces.owner]
        open_ &= ~(above <= near).all(axis=1) & (pieces.width > shortest[pieces.owner])
        open_ &= (np.bincount(pieces.owner[open_], minlength=motions) <= _MOST_UNDECIDED)[pieces.owner]
        np.maximum.at(bound, pieces.owner[~open_], above[~open_])
        pieces = pieces.rows(open_).halved()
    return np.where(broken[:, None], best, bound)


def _remember(pieces: Pieces, found: Array, best: Array, instants: Array) -> None:
    """Update the greatest exhibited values (B, Q) and their instants with those at the nodes, (K, N, Q)."""
    node = found.argmax(axis=1)
    value = np.take_along_axis(found, node[:, None], axis=1)[:, 0]
    when = pieces.start[:, None] + pieces.width[:, None] * gauss(found.shape[1])[0][node]
    before = best.copy()
    np.maximum.at(best, pieces.owner, value)
    piece, column = np.nonzero((value == best[pieces.owner]) & (value > before[pieces.owner]))
    instants[pieces.owner[piece], column] = when[piece, column]
