"""Effort along a motion for every payload at once, bounded at every instant by finitely many numbers.

Effort is base + mass · slopes · features, where the features are the ten parameters of one kilogram. Over a piece of a
motion, base and slopes are polynomials up to errors. The Bernstein coefficients of a sum are the sum of the Bernstein
coefficients, so that for every payload the effort over the piece does not exceed the greatest of

    base coefficient + mass · slope coefficients · features + errors.

Closed forms over instants thus hold at every instant if they are given the coefficients instead of the values at
samples, and the errors. The errors of the slopes are those of a kilogram whose centre of mass is no more than
:data:`REACH` away from the tool's origin.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import NamedTuple, final

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.dynamics.complex_bounds import EffortReach
from trajevo.dynamics.piece_bounds import Pieces, dry_range, interpolation_errors, motion_bounds
from trajevo.dynamics.rollout import Rollout
from trajevo.robot.joints import Sides
from trajevo.robot.payload import Payload, entries_of
from trajevo.trajectory.bernstein import bernstein_halves, hull

#: Greatest distance of a centre of mass from the tool's origin for which the bounds hold [m].
REACH = 2.0
#: Distance of the centres of mass for which the tolerance is kept [m].
_USUAL = 0.3
#: Number of nodes of a piece.
_NODES = 14
#: Greatest number of pieces of one motion; with more, no piece is halved any more.
_MOST_PIECES = 1000
#: Share of a limit below which an effort is not resolved further.
_FAR = 0.7


@final
@dataclass(frozen=True, eq=False)
class PayloadBounds:
    """Bernstein coefficients of efforts over the pieces of one motion, and errors.

    Attributes:
        times: instants at which the coefficients are nearest to the effort, shape (T,) [s].
        base: effort without payload and dry friction, shape (T, n_joints) [N·m or N].
        slopes: effort that each parameter adds per unit of it [N·m or N], in the order of
            :data:`trajevo.robot.payload.PARAMETERS`, shape (T, n_joints, 10).
        above: what the effort may exceed the base by: errors and dry friction, shape (T, n_joints) [N·m or N].
        below: what it may fall short of it by, the same shape [N·m or N].
        each: what either may be more by for each kilogram, the same shape [N·m/kg or N/kg].
    """

    times: Array
    base: Array
    slopes: Array
    above: Array
    below: Array
    each: Array


_FIELDS = tuple(field.name for field in fields(PayloadBounds))


def bound_payloads(
    rollout: Rollout, effort_limits: Array | Sides, *, inertia: Array, tolerance: float
) -> PayloadBounds:
    """Bound the effort along one motion for every payload.

    Args:
        rollout: one robot on one motion; its payload gives the model alone.
        effort_limits: of both directions or of each, inf for none, shape (n_joints,) [N·m or N].
        inertia: inertia about the centre of mass per kilogram along the tool's axes, shape (3, 3) [m²].
        tolerance: pieces are halved until the coefficients near a limit are no further from the effort than this share
            of the limit, for payloads whose centre of mass is within 0.3 m of the tool's origin.
    """
    sides = Sides.of(effort_limits)
    limited = sides.limited
    reach, mass = _reach(rollout, inertia), np.inf
    closed: list[PayloadBounds] = []
    pieces, count = Pieces.of(rollout, _NODES), 0
    while len(pieces.owner):
        found, loose = _over(rollout, pieces, reach, inertia)
        mass = min(mass, _reference(found, sides, inertia))
        loose = _looseness(found, loose, mass, sides.lesser, inertia)[:, limited].max(axis=1, initial=0.0)
        open_ = ~(loose <= tolerance)
        if count + 2 * open_.sum() > _MOST_PIECES:
            open_[:] = False
        closed.append(PayloadBounds(*(getattr(found, name)[~open_] for name in _FIELDS)))
        count += int((~open_).sum())
        pieces = pieces.rows(open_).halved()
    columns = [np.concatenate([getattr(each, name) for each in closed]) for name in _FIELDS]
    return PayloadBounds(*(frozen(x.reshape(-1, *x.shape[2:])) for x in columns))


def _reach(rollout: Rollout, inertia: Array) -> EffortReach:
    """Bounds for a kilogram that is as far out as any: in the direction from the joint of the tool to its origin."""
    robot, model = rollout.robot, rollout.dynamics.payload.model
    placement = robot.model.frames[robot.model.getFrameId(robot.tool)].placement
    outward = placement.rotation.T @ placement.translation
    length = float(np.linalg.norm(outward))
    com = REACH * (outward / length if length > 0.0 else np.array([1.0, 0.0, 0.0]))
    spread = tuple(map(tuple, inertia.tolist())) if model == "rigid" and inertia.any() else None
    x, y, z = com.tolist()
    return EffortReach(replace(rollout.dynamics, payload=Payload(1.0, (x, y, z), spread, model)), any_mass=True)


class _Loose(NamedTuple):
    """Errors of the base, and where dry friction is not constant (bool), over K pieces, each (K, n_joints)."""

    error: Array
    reverses: Array


def _over(rollout: Rollout, pieces: Pieces, reach: EffortReach, inertia: Array) -> tuple[PayloadBounds, _Loose]:
    """Bounds over K pieces, with arrays of shape (K, 2 N, ...)."""
    count, size = pieces.states.shape[:2]
    friction, standing = rollout.robot.friction, rollout.standing[pieces.owner]
    q, v, a = np.split(pieces.states, 3, axis=-1)
    n = q.shape[-1]
    smooth = rollout.dynamics.unloaded_effort(q, v, a, pieces.segment) - friction.dry(v)
    flat = [x.reshape(-1, n) for x in (q, v, a)]
    terms = rollout.dynamics.effort_per_parameter(flat[0], flat[1], flat[2], pieces.segment.repeat(size))
    terms = terms.reshape(count, size, n, 10)
    with np.errstate(over="ignore", invalid="ignore"):
        bounds = motion_bounds(pieces.states, rollout.trajectory.degree)
        magnitudes = reach.unloaded_and_per_kilogram(bounds, pieces.segment)
    (error, _), (each, rounding) = (interpolation_errors([magnitude], size) for magnitude in magnitudes)
    (base, slack), (slopes, slacks) = (bernstein_halves(np.moveaxis(x, 1, -1)) for x in (smooth, terms))
    each = each + slacks @ greatest_features(inertia, REACH)
    unfelt = np.abs(slopes).max(axis=(2, 3)) + each <= 2.0 * (rounding + slacks @ greatest_features(inertia, REACH))
    lowest, highest = dry_range(friction, *hull(np.moveaxis(v, 1, -1)), standing)
    shares = np.linspace(0.0, 0.5, size)
    above, below, each = (
        np.repeat(x[:, None], 2 * size, axis=1)
        for x in (error + slack + highest, error + slack - lowest, np.where(unfelt, 0.0, each))
    )
    found = PayloadBounds(
        times=pieces.start[:, None] + pieces.width[:, None] * np.concatenate([shares, 0.5 + shares]),
        base=np.moveaxis(base, -1, 1),
        slopes=np.moveaxis(slopes * ~unfelt[..., None, None], -1, 1),
        above=above,
        below=below,
        each=each,
    )
    return found, _Loose(error + slack, highest > lowest)


def _reference(found: PayloadBounds, limits: Sides, inertia: Array) -> float:
    """The mass [kg] that first uses a limit up, with its centre at the tool's origin."""
    push = found.slopes @ np.concatenate([[1.0, 0.0, 0.0, 0.0], entries_of(inertia)])
    used = np.abs(found.base) if limits.agree else found.base * np.where(push < 0.0, -1.0, 1.0)
    room = np.maximum(limits.toward(push) - used, 0.0)
    return float((room / np.maximum(np.abs(push), 1e-200)).min(initial=np.inf))


def _looseness(found: PayloadBounds, loose: _Loose, mass: float, effort_limits: Array, inertia: Array) -> Array:
    """How far coefficients may be from the effort, as a share of the limit; 0 far from it, shape (K, n_joints).

    With a mass [kg], and its centre within the usual distance.
    """
    if not np.isfinite(mass):
        return np.zeros(loose.error.shape)
    features, size = greatest_features(inertia, _USUAL), found.times.shape[1] // 2
    near = (np.abs(found.base) + mass * (np.abs(found.slopes) @ features)).max(axis=1) > _FAR * effort_limits
    away = []
    for x in (found.base, found.slopes):
        halves = x[:, :size], x[:, size:]
        bend = np.maximum(*(np.abs(np.diff(half, 2, axis=1)).max(axis=1) for half in halves))
        turning = loose.reverses if x is found.base else loose.reverses[..., None]
        away.append(0.125 * size * bend + np.where(turning, np.ptp(x, axis=1), 0.0))
    total = away[0] + loose.error + mass * (away[1] @ features + found.each[:, 0])
    share: Array = np.where(near, total / effort_limits, 0.0)
    return share


def greatest_features(inertia: Array, distance: float) -> Array:
    """Bounds of the ten parameters of a kilogram whose centre of mass is within a distance [m] of the tool's origin.

    Args:
        inertia: inertia about the centre of mass per kilogram along the tool's axes, shape (3, 3) [m²].
        distance: the distance [m].
    """
    about = np.abs(entries_of(inertia)) + distance**2 * np.array([1.0, 0.5, 1.0, 0.5, 0.5, 1.0])
    return np.concatenate([[1.0], np.full(3, distance), about])
