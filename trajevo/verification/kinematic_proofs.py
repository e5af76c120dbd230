"""Proofs that positions, velocities, accelerations and jerks keep their limits, by the exact extremes of the motion."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.units import per_time
from trajevo.dynamics.rollout import Rollout
from trajevo.robot.joints import JointLimits
from trajevo.trajectory.batch import DERIVATIVES, TrajectoryBatch
from trajevo.verification.certificate import Proof
from trajevo.verification.jumps import infinite

#: Share of the greatest magnitude by which extremes are widened for rounding. Polynomials of the degrees and pieces in
#: use lose two or three digits of sixteen.
_ROUNDING = 1e-12

#: Samples per segment among which a peak is sought, how often the search then zooms in, and by which factor.
_SAMPLES, _ZOOMS, _ZOOM = 65, 3, 16


#: Values (..., n_joints) -> share of the limit that they use.
_Share = Callable[[Array], Array]


def kinematic_proofs(rollout: Rollout) -> list[tuple[Proof, ...]]:
    """Proofs for every limited position, velocity, acceleration and jerk, for each motion of a rollout.

    The bounds are the trajectory's extremes, which are exact up to rounding, or guaranteed. They are widened by 1e-12
    of the greatest magnitude. Where a derivative jumps between two segments, the next one is infinite.
    """
    limits, own, trajectory = rollout.limits, rollout.robot.limits, rollout.trajectory
    rows: list[list[Proof]] = [[] for _ in range(len(trajectory))]
    for order, quantity in enumerate(DERIVATIVES):
        share = _share_of(limits, order)
        instants, signed = _exhibited(trajectory, order, share)
        shown_share, shown = share(signed), signed if order == 0 else np.abs(signed)
        outermost, ends, used = _outermost(trajectory, order, limits, signed)
        if order:
            endless, when = infinite(trajectory, order)
            limited = np.where(np.isfinite(ends), np.inf, 0.0)  # the share of a limit, where there is one
            shown_share, used = (np.where(endless, limited, each) for each in (shown_share, used))
            shown, outermost = (np.where(endless, np.inf, each) for each in (shown, outermost))
            instants = np.where(endless, when, instants)
        full = ends
        if order:
            full = np.broadcast_to(own.sides(quantity).told(signed), ends.shape)
            if not limits.sides(quantity).agree:
                own_share = np.where(np.isfinite(ends), shown_share * np.where(np.isfinite(ends), ends, 0.0), shown)
                shown = np.where(endless, np.inf, own_share)
        for motion, joint in zip(*np.nonzero(np.isfinite(used) & (used > 0.0) | np.isfinite(ends)), strict=True):
            at = motion, joint
            rows[motion].append(
                Proof(
                    quantity=quantity,
                    joint=rollout.robot.joint_names[joint],
                    unit=per_time(rollout.robot.joint_units[joint], order),
                    limit=float(ends[at]),
                    bound=float(outermost[at]),
                    exhibited=float(shown[at]),
                    instant=float(instants[at]),
                    share=float(used[at]),
                    exhibited_share=float(shown_share[at]),
                    gap=float(used[at] - shown_share[at]) if np.isfinite(used[at]) else 0.0,
                    full_limit=float(full[at]),
                )
            )
    return [tuple(each) for each in rows]


def _share_of(limits: JointLimits, order: int) -> _Share:
    if order == 0:
        return limits.range_used
    return limits.sides(DERIVATIVES[order]).share


def _outermost(
    trajectory: TrajectoryBatch, order: int, limits: JointLimits, shown: Array
) -> tuple[Array, Array, Array]:
    """The proven extreme that uses most of the limit, that limit, and the share of it, each (B, n_joints).

    If a limit differs by direction, it is that in the direction of the value shown, and the extreme is what uses the
    share of it that no instant exceeds in either direction.
    """
    peak = trajectory.peak(order)
    slack = _ROUNDING * peak
    if order:
        sides = limits.sides(DERIVATIVES[order])
        limit = np.broadcast_to(sides.told(shown), peak.shape)
        if sides.agree:
            return peak + slack, limit, sides.share(peak + slack)
        least, greatest = trajectory.extremes(order)
        used = sides.share_between(least - slack, greatest + slack)
        return np.where(sides.limited, used * np.where(sides.limited, limit, 0.0), peak + slack), limit, used
    least, greatest = trajectory.extremes(0)
    least, greatest = least - slack, greatest + slack
    high = limits.range_used(greatest) >= limits.range_used(least)
    high = np.where(np.isfinite(limits.upper) & np.isfinite(limits.lower), high, np.isfinite(limits.upper))
    outermost = np.where(high, greatest, least)
    return outermost, np.where(high, limits.upper, limits.lower), limits.range_used(outermost)


def _exhibited(trajectory: TrajectoryBatch, order: int, share: _Share) -> tuple[Array, Array]:
    """Instants [s] and values of samples that use nearly as much of a limit as any instant does, each (B, n_joints).

    Values have their signs.
    """
    shares = np.linspace(0.0, 1.0, _SAMPLES)
    values, count = trajectory.at_shares(shares, order), trajectory.n_joints
    best = _crests(_score(share(values)), _SAMPLES).argmax(axis=1)[:, None]
    shown = np.take_along_axis(values, best, axis=1)[:, 0]
    segment = best[:, 0] // _SAMPLES
    begin, end = (
        np.take_along_axis(ends, segment, axis=1) for ends in (trajectory.breaks[:, :-1], trajectory.breaks[:, 1:])
    )
    instants = begin + (end - begin) * shares[best[:, 0] % _SAMPLES]
    cell = (end - begin) / (_SAMPLES - 1)
    own = np.arange(count)
    for _ in range(_ZOOMS):
        offsets = np.linspace(-1.0, 1.0, 2 * _ZOOM + 1)
        at = np.clip(instants[..., None] + cell[..., None] * offsets, begin[..., None], end[..., None])
        around = trajectory.evaluate(at.reshape(len(at), -1), order).reshape(*at.shape, count)[:, own, :, own]
        around = np.swapaxes(around, 0, 1)  # (B, n_joints, instants)
        better = _score(share(np.swapaxes(around, 1, 2))).argmax(axis=1)[..., None]
        candidate, when = (np.take_along_axis(x, better, axis=2)[..., 0] for x in (around, at))
        gained = _score(share(candidate)) > _score(share(shown))
        shown, instants = np.where(gained, candidate, shown), np.where(gained, when, instants)
        cell = cell / _ZOOM
    return instants, shown


def _crests(used: Array, samples: int) -> Array:
    """Samples (B, segments x samples, n_joints) raised to the peaks of the parabolas through them and their neighbours.

    The highest sample need not lie at the highest peak.
    """
    parts = used.reshape(len(used), -1, samples, used.shape[2])
    before, at, after = parts[:, :, :-2], parts[:, :, 1:-1], parts[:, :, 2:]
    with np.errstate(invalid="ignore", divide="ignore"):
        bend, slope = 2.0 * at - before - after, after - before
        gain = np.where(np.abs(slope) < 2.0 * bend, slope**2 / (8.0 * bend), 0.0)
    raised = parts.copy()
    raised[:, :, 1:-1] += gain
    return raised.reshape(used.shape)


def _score(used: Array) -> Array:
    """Shares with NaN replaced by -inf, so that NaN is not chosen as the greatest."""
    return np.where(np.isnan(used), -np.inf, used)
