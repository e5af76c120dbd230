"""Certificates of motions: proven bounds of every limited quantity, and samples that show how near they are.

:func:`certify` makes a :class:`Certificate` with one :class:`Proof` per quantity and joint; both tell their result in
one sentence. Positions, velocities, accelerations and jerks are bounded by the trajectory's extremes, effort, power and
tool speed by :mod:`trajevo.dynamics.enclosure`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, numbers
from trajevo.base.units import per_time, pretty
from trajevo.dynamics.enclosure import Enclosure, enclose
from trajevo.dynamics.rollout import Rollout, rollout_of
from trajevo.errors import InvalidInputError, NoSolutionError
from trajevo.front.front import Front, Solution
from trajevo.robot.joints import JointLimits
from trajevo.trajectory.batch import DERIVATIVES, TrajectoryBatch

#: Share of a limit by which a proven bound may exceed it and still count as within, for rounding exactly at the limit.
WITHIN = 1e-9


@final
@dataclass(frozen=True)
class Proof:
    """What is proven about one quantity of one joint, in SI units.

    Attributes:
        quantity: ``"position"``, ``"velocity"``, ``"acceleration"``, ``"jerk"``, ``"effort"``, ``"power"`` or
            ``"tool speed"``.
        joint: the joint, or None for the tool.
        unit: SI unit of the values.
        limit: the limit, inf if there is none; for a position the end of its range that is used most.
        bound: magnitude that is not exceeded at any instant; for a position the outermost value.
        exhibited: magnitude of the sample that comes closest to the limit or exceeds it; for a position its value.
        instant: time of this sample [s].
        share: proven upper bound of the share of the limit that is used, 0 if there is no limit; for a position the
            share of half its range, measured from the middle.
        exhibited_share: share of the limit that the sample uses.
        gap: how far the bound lies above the exhibited value, as a share of the limit. If there is no limit, as a share
            of the exhibited value or of a thousandth of the greatest of all joints, whichever is more.
    """

    quantity: str
    joint: str | None
    unit: str
    limit: float
    bound: float
    exhibited: float
    instant: float
    share: float
    exhibited_share: float
    gap: float

    @property
    def proven(self) -> bool:
        """Whether the limit is kept at every instant."""
        return self.share <= 1.0 + WITHIN

    @property
    def violated(self) -> bool:
        """Whether a sample exceeds the limit."""
        return not self.exhibited_share <= 1.0 + WITHIN

    @property
    def name(self) -> str:
        """Quantity and joint."""
        return self.quantity if self.joint is None else f"{self.quantity} of {self.joint}"

    def __str__(self) -> str:
        unit = pretty(self.unit)
        told = f"{self.name} reaches {self.exhibited:.6g} {unit} at {self.instant:.4f} s"
        if np.isinf(self.limit):
            return f"{told}, never exceeds {self.bound:.6g} {unit}, and has no limit"
        share = f"{100.0 * self.exhibited_share:.3f} %"
        if self.violated:
            return f"{told}, {share} of the limit of {self.limit:g} {unit}"
        return f"{told}, {share} of the limit of {self.limit:g} {unit}, proven at most {100.0 * self.share:.3f} %"


@final
@dataclass(frozen=True)
class Certificate:
    """What is proven about one motion.

    Attributes:
        motion: name of the motion.
        tolerance: gap that was asked for between bounds and exhibited values of effort, power and tool speed, as a
            share of the limit.
        pieces: number of pieces into which the motion was cut.
        rows: a proof for every limited quantity of every joint; effort, power and tool speed even without a limit.
    """

    motion: str
    tolerance: float
    pieces: int
    rows: tuple[Proof, ...]

    @property
    def proven(self) -> bool:
        """Whether every limit is kept at every instant."""
        return all(row.proven for row in self.rows)

    @property
    def violated(self) -> tuple[Proof, ...]:
        """Limits that a sample exceeds."""
        return tuple(row for row in self.rows if row.violated)

    @property
    def gap(self) -> float:
        """The widest gap between a bound and an exhibited value, as a share of the limit."""
        return max((row.gap for row in self.rows), default=0.0)

    @cached_property
    def closest(self) -> Proof | None:
        """The limit that is used most, or None where nothing is limited."""
        limited = [row for row in self.rows if np.isfinite(row.limit)]
        return max(limited, key=lambda row: np.inf if np.isnan(row.share) else row.share, default=None)

    @cached_property
    def by_quantity(self) -> tuple[Proof, ...]:
        """For every quantity the row with the greatest share of its limit, or the greatest bound without limits."""
        worst: dict[str, Proof] = {}
        for row in self.rows:
            other = worst.get(row.quantity)
            if other is None or (row.share, row.bound) > (other.share, other.bound):
                worst[row.quantity] = row
        return tuple(worst.values())

    @property
    def summary(self) -> dict[str, Any]:
        """The certificate as plain data, with the row nearest to its limit for every quantity; None for no limit."""
        rows = [
            {
                "quantity": row.quantity,
                "joint": row.joint,
                "unit": row.unit,
                "limit": row.limit if np.isfinite(row.limit) else None,
                "bound": row.bound,
                "exhibited": row.exhibited,
                "instant": row.instant,
                "share": row.share,
            }
            for row in self.by_quantity
        ]
        about = {"verdict": str(self), "proven": self.proven, "violated": bool(self.violated)}
        return about | {"tolerance": self.tolerance, "pieces": self.pieces, "rows": rows}

    def __str__(self) -> str:
        if self.violated:
            worst = max(self.violated, key=lambda row: np.inf if np.isnan(row.share) else row.exhibited_share)
            others = len(self.violated) - 1
            more = f", and {others} more limit{'s are' if others > 1 else ' is'} broken" if others else ""
            return f"{self.motion} breaks a limit: {worst}{more}."
        open_ = [row for row in self.rows if not row.proven]
        if open_:
            excess = max(row.share for row in open_) - 1.0
            most = f"{open_[0].name} may exceed its limit by a share of {excess:.2g}"
            return f"{self.motion} is not decided: no sample breaks a limit, but {most}."
        if self.closest is None:
            return f"{self.motion} keeps every limit at every instant: nothing is limited."
        return f"{self.motion} keeps every limit at every instant, proven; closest: {self.closest}."


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
    of the greatest magnitude.
    """
    limits, trajectory = rollout.robot.limits, rollout.trajectory
    rows: list[list[Proof]] = [[] for _ in range(len(trajectory))]
    for order, quantity in enumerate(DERIVATIVES):
        share = _share_of(limits, order)
        outermost, ends = _outermost(trajectory, order, limits)
        used = share(outermost)
        instants, shown = _exhibited(trajectory, order, share)
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
                    exhibited_share=float(share(shown)[at]),
                    gap=float(used[at] - share(shown)[at]),
                )
            )
    return [tuple(each) for each in rows]


def _share_of(limits: JointLimits, order: int) -> _Share:
    if order == 0:
        return limits.range_used
    limit = getattr(limits, DERIVATIVES[order])
    return lambda values: np.abs(values) / limit


def _outermost(trajectory: TrajectoryBatch, order: int, limits: JointLimits) -> tuple[Array, Array]:
    """The proven extreme that uses most of the limit, and that limit, each (B, n_joints)."""
    peak = trajectory.peak(order)
    slack = _ROUNDING * peak
    if order:
        return peak + slack, np.broadcast_to(getattr(limits, DERIVATIVES[order]), peak.shape)
    least, greatest = trajectory.extremes(0)
    least, greatest = least - slack, greatest + slack
    high = limits.range_used(greatest) >= limits.range_used(least)
    high = np.where(np.isfinite(limits.upper) & np.isfinite(limits.lower), high, np.isfinite(limits.upper))
    return np.where(high, greatest, least), np.where(high, limits.upper, limits.lower)


def _exhibited(trajectory: TrajectoryBatch, order: int, share: _Share) -> tuple[Array, Array]:
    """Instants [s] and values of samples that use nearly as much of a limit as any instant does, each (B, n_joints)."""
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
    return instants, shown if order == 0 else np.abs(shown)


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


#: Least and greatest tolerance of a certificate.
TOLERANCES = (1e-7, 0.1)


def certify(
    motion: Solution | Rollout | Any, *, tolerance: float = 0.001, tool_speed: float | None = None, power: Any = None
) -> Certificate:
    """Prove bounds that a motion does not exceed at any instant, or show where it breaks a limit.

    The robot's limits are checked whether or not the problem includes them.

    Args:
        motion: a solution, an optimum, or the rollout of one motion.
        tolerance: share of the limit, or of the greatest value if there is no limit, by which proven bounds of effort,
            power and tool speed may lie above the exhibited values, 1e-7 to 0.1.
        tool_speed: limit of the speed of the tool's origin [m/s]; if None, that of the problem, if it has one.
        power: limit of the mechanical power of every joint [W], one number or one per joint; no limit if None.

    Returns:
        The certificate.

    Raises:
        InvalidInputError: not a motion, several motions, or an invalid tolerance or limit.
    """
    rollout = rollout_of(motion)
    if len(rollout.trajectory) != 1:
        raise InvalidInputError(f"motion: expected one motion, got {len(rollout.trajectory)}; use certify_all for more")
    return _certified(rollout, [_named(motion)], _limits(rollout, motion, tolerance, tool_speed, power), tolerance)[0]


def certify_all(
    motions: Front | Rollout, *, tolerance: float = 0.001, tool_speed: float | None = None, power: Any = None
) -> tuple[Certificate, ...]:
    """:func:`certify` for every solution of a front, or every motion of a rollout, in one batch.

    Raises:
        NoSolutionError: the front is empty.
        InvalidInputError: as :func:`certify`.
    """
    owner: Any = motions
    if isinstance(motions, Front):
        if not len(motions):
            raise NoSolutionError(f"the front is empty: {motions.blocking}")
        rollout, owner = motions.rollouts, motions.pick("0")
    else:
        rollout = rollout_of(motions)
    limits = _limits(rollout, owner, tolerance, tool_speed, power)
    names = [f"row {k}" for k in range(len(rollout.trajectory))]
    return tuple(_certified(rollout, names, limits, tolerance))


def _certified(rollout: Rollout, names: list[str], limits: Array, tolerance: float) -> list[Certificate]:
    found: list[Certificate] = []
    enclosure = enclose(rollout, limits, tolerance=float(tolerance))
    for k, (name, kinematic) in enumerate(zip(names, kinematic_proofs(rollout), strict=True)):
        rows = (*kinematic, *_dynamic_proofs(rollout, enclosure, k, limits))
        found.append(Certificate(name, float(tolerance), int(enclosure.pieces[k]), rows))
    return found


def _named(motion: Any) -> str:
    if isinstance(motion, Solution):
        return f"row {motion.index}" + ("" if motion.rule == "row" else f" ({motion.rule})")
    return "the motion"


def _dynamic_proofs(rollout: Rollout, enclosure: Enclosure, motion: int, limits: Array) -> Iterator[Proof]:
    """Proofs for effort and power of every joint, unless nothing has mass or friction, and for the tool speed."""
    robot = rollout.robot
    joints = list(zip(robot.joint_names, robot.joint_units, strict=True))
    columns: list[tuple[str, str | None, str]] = [
        *(("effort", name, "N*m" if unit == "rad" else "N") for name, unit in joints),
        *(("power", name, "W") for name, _ in joints),
        ("tool speed", None, "m/s"),
    ]
    carried = rollout.dynamics.payload.mass if rollout.masses is None else float(rollout.masses[motion])
    massless = robot.mass == 0.0 and carried == 0.0 and robot.friction.none
    for k, (quantity, joint, unit) in enumerate(columns):
        if massless and joint is not None:
            continue
        bound, shown = float(enclosure.bound[motion, k]), float(enclosure.exhibited[motion, k])
        limit = float(limits[k])
        scale = float(enclosure.scale[motion, k])
        yield Proof(
            quantity=quantity,
            joint=joint,
            unit=unit,
            limit=limit,
            bound=bound,
            exhibited=shown,
            instant=float(enclosure.instants[motion, k]),
            share=bound / limit,
            exhibited_share=shown / limit,
            gap=(bound - shown) / scale if bound > shown else 0.0,
        )


def _limits(rollout: Rollout, motion: Any, tolerance: float, tool_speed: float | None, power: Any) -> Array:
    """Limits of the efforts, the powers and the tool's speed, shape (2 n_joints + 1,)."""
    robot = rollout.robot
    number = isinstance(tolerance, int | float | np.number) and not isinstance(tolerance, bool)
    if not (number and TOLERANCES[0] <= tolerance <= TOLERANCES[1]):
        raise InvalidInputError(
            f"tolerance: expected a share from {TOLERANCES[0]:g} to {TOLERANCES[1]:g}, got {tolerance!r}"
        )
    powers = np.full(robot.dof, np.inf) if power is None else _positive(power, "power", robot.dof)
    if tool_speed is None:
        problem = motion.front.problem if isinstance(motion, Solution) else getattr(motion, "problem", None)
        limited = [float(c.limit) for c in getattr(problem, "constraints", ()) if c.quantity == "tool speed"]
        speed = np.array([min(limited, default=np.inf)])
    else:
        speed = _positive(tool_speed, "tool_speed", 1)
    return np.concatenate([robot.limits.effort, powers, speed])


def _positive(given: Any, name: str, count: int) -> Array:
    """A limit, one number or ``count`` of them, as an array of shape (count,)."""
    limit = numbers(given, name=name, shape=() if np.ndim(given) == 0 else (count,))
    if not (limit > 0.0).all():
        raise InvalidInputError(f"{name}: expected positive numbers, got {limit.tolist()}")
    return np.broadcast_to(limit, (count,))
