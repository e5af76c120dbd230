"""What is free in the gaps between via points: pieces of any length, and how far joints may go."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from trajevo.base import polynomials
from trajevo.base.arrays import Array, numbers, read_only
from trajevo.errors import InvalidInputError
from trajevo.path.via_points import ViaPoints
from trajevo.trajectory.interpolants.interpolant import Variable

#: Least and greatest weight of a piece between free knots: an optimal jerk may change its sign twice within a hundredth
#: of a gap.
_WEIGHTS = (0.02, 1.0)

#: Least range of a joint over the via points as a share of the greatest range of joints with the same unit: a joint
#: that hardly moves may still have to.
_LEAST = 0.25


def half_widths(points: ViaPoints, units: Sequence[str], share: float) -> Array:
    """Half widths of what is free of every joint, as a share of its range over the points, (n_joints,) [rad or m]."""
    spans, kinds = np.ptp(points.positions, axis=0), np.array(units)
    for unit in sorted(set(units)):
        alike = kinds == unit
        spans[alike] = np.maximum(spans[alike], _LEAST * spans[alike].max())
    widths: Array = share * np.where(spans > 0.0, spans, 1.0)
    return widths


def named_joints(
    points: ViaPoints,
    joints: Sequence[str] | None,
    units: Sequence[str] | None,
    given: Any,
    share: float,
    *,
    name: str,
    or_none: bool = False,
) -> tuple[tuple[str, ...], tuple[str, ...], Array]:
    """The joints that are free between points: names, units and widths (n_joints,) [rad or m].

    Args:
        points: via points, of which only the first joints may be free.
        joints: their names; numbered if None.
        units: their units; rad if None.
        given: how far each may go; a share of its range over the points if None.
        share: this share.
        name: what is given, for messages.
        or_none: whether the width of a joint may be 0.

    Raises:
        InvalidInputError: other numbers of names, units and widths, or widths that are not positive, or not 0 where
            they may be.
    """
    count = points.n_joints
    names = tuple(f"joint {k + 1}" for k in range(count)) if joints is None else tuple(joints)
    kinds = ("rad",) * len(names) if units is None else tuple(units)
    if not len(names) == len(kinds) <= count:
        raise InvalidInputError(
            f"joints: expected as many names as units, at most {count}, got {len(names)} and {len(kinds)}"
        )
    if given is None:
        widths = half_widths(ViaPoints(points.positions[:, : len(names)]), kinds, share)
    else:
        widths = numbers(given, name=name, shape=(len(names),))
    if not (widths >= 0.0 if or_none else widths > 0.0).all():
        wanted = "numbers from 0 on" if or_none else "positive numbers"
        raise InvalidInputError(f"{name}: expected {wanted}, got {widths.tolist()}")
    return names, kinds, read_only(widths)


def weight_variables(pieces: int) -> list[Variable]:
    """Weights of pieces between free knots."""
    return [Variable(f"weight of piece_{k + 1}", "1", *_WEIGHTS, departs=True) for k in range(pieces)]


def divided(times: Array, weights: Array) -> Array:
    """Times of pieces, each as much of its gap as its weight is of their sum, (B, gaps * pieces of a gap) [s].

    Args:
        times: of gaps, shape (B, gaps) [s].
        weights: of pieces, gap by gap, shape (B, gaps * pieces of a gap).

    Raises:
        InvalidInputError: a weight that is not positive.
    """
    rows, gaps = times.shape
    shares = weights.reshape(rows, gaps, weights.shape[1] // gaps)
    if not (shares.real > 0.0).all():
        row, gap, part = (int(k) for k in np.argwhere(~(shares.real > 0.0))[0])
        raise InvalidInputError(
            f"x: expected positive weights, got {shares[row, gap, part]} for piece "
            f"{gap * shares.shape[2] + part + 1} of row {row}"
        )
    total = shares[..., 0]
    for k in range(1, shares.shape[2]):
        total = total + shares[..., k]
    return (shares * (times / total)[..., None]).reshape(weights.shape)


def on_pieces(coefficients: Array, parts: Array, each: int) -> Array:
    """Coefficients of polynomials of gaps on the pieces of these, in the time since a piece began, (B, S, n_joints, d).

    Args:
        coefficients: shape (B, gaps, n_joints, d).
        parts: times of pieces, shape (B, S) [s].
        each: number of pieces in a gap.
    """
    inside = parts.reshape(len(parts), parts.shape[1] // each, each)
    begins = np.concatenate([np.zeros_like(inside[..., :1]), np.cumsum(inside[..., :-1], axis=2)], axis=2)
    whole = np.moveaxis(np.repeat(np.asarray(coefficients), each, axis=1), -1, 0)
    shifted = polynomials.shifted(whole, begins.reshape(*parts.shape, 1))
    return np.ascontiguousarray(np.moveaxis(shifted, 0, -1))
