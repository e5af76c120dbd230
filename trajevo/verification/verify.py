"""Verify a solution: sample its motion densely, compute its effort by a second recursion, and check every limit.

Only the resulting motion is checked, not how it was found. The limits are those that the problem keeps, less its
margins, and the robot's own where the problem keeps none. The recorded objectives must be those of the decision
variables.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown import html
from trajevo.base.shown.brief import brief
from trajevo.base.units import pretty
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError, NoSolutionError
from trajevo.formulation.constraints.motion_limits import via_errors
from trajevo.front.front import Front, Solution
from trajevo.path.loads import Schedule
from trajevo.robot.joints import position_unit
from trajevo.robot.payload import Payload
from trajevo.trajectory.batch import DERIVATIVES, Motion, TrajectoryBatch
from trajevo.verification.jumps import infinite
from trajevo.verification.newton_euler import NewtonEuler

#: Share of a limit by which a motion may exceed it, and share by which numbers that should agree may differ.
TOLERANCE = 0.001

#: Greatest density of samples: more take long and show nothing new.
MOST_DENSE = 200

#: Step of the finite differences, as a share of a segment: truncation and rounding are both far below the tolerance.
_STEP = 1e-3

#: Rounding of a derivative, as a share of the greatest position over a power of the shortest segment's duration.
_ROUNDING = 1e-7

#: Position that counts at least in this [rad or m]: inverse kinematics leaves a joint 1e-12 from where it was, which is
#: no motion.
_STILL = 1e-2

#: Five-point central difference: shift in steps -> weight.
_STENCIL = {-2: 1.0 / 12.0, -1: -8.0 / 12.0, 1: 8.0 / 12.0, 2: -1.0 / 12.0}


@final
@dataclass(frozen=True)
class Utilisation:
    """The greatest share of a limit that a motion uses.

    Attributes:
        limit: ``"position"``, ``"velocity"``, ``"acceleration"``, ``"jerk"``, ``"effort"``, or a constraint's name.
        joint: the joint, or None for one of the problem's own constraints.
        share: share of the limit, 1 if it is reached; for a position the share of half its range, measured from the
            middle.
        instant: time at which it is used [s], or None for one of the problem's own constraints.
        full_share: share of the robot's own limit where the problem keeps less of it, otherwise None.
    """

    limit: str
    joint: str | None
    share: float
    instant: float | None
    full_share: float | None = None

    def __str__(self) -> str:
        name = self.limit if self.joint is None else f"{self.limit} of {self.joint}"
        when = "" if self.instant is None else f" at {self.instant:.3f} s"
        if np.isinf(self.share) and self.joint is not None:
            return f"{name}: infinite{when}, where the derivative below it jumps"
        full = 0.0 if self.full_share is None else 100.0 * self.full_share
        own = f" that the problem keeps, {full:.2f} % of the robot's" if full else ""
        return f"{name}: {100.0 * self.share:.2f} % of the limit{own}{when}"


@final
@dataclass(frozen=True)
class Known:
    """An objective of a motion, and how far it is known.

    Attributes:
        name: the objective.
        value: its value on record, SI.
        unit: SI unit.
        known_to: how much it changes when segments have twice as many samples, SI.
    """

    name: str
    value: float
    unit: str
    known_to: float

    def __str__(self) -> str:
        if not self.known_to:
            return f"{self.name} exactly"
        share = f" ({100.0 * self.known_to / abs(self.value):.2g} %)" if self.value else ""
        return f"{self.name} to {self.known_to:.2g} {pretty(self.unit)}{share}"


@final
@dataclass(frozen=True)
class Verification:
    """The result of checking one motion at dense samples.

    Attributes:
        solution: row of the solution and the rule that chose it.
        instants: number of samples.
        rows: greatest utilisation of every finite limit of every joint, then of the problem's other constraints.
        objectives: the objectives, and how far each is known.
        derivative_mismatch: greatest difference of velocity, acceleration and jerk from finite differences of position,
            velocity and acceleration, or jump of position and velocity at a break, as a share of the peak.
        effort_difference: greatest difference between our effort and Pinocchio's [N·m or N]; NaN if there is no effort.
        effort_mismatch: the same as a share of the joint's greatest effort.
        record_mismatch: greatest difference of the recorded objectives from those of the decision variables, as a share
            of the greatest value on the front.
        via_error: greatest distance of any joint from an inner point when it is passed [rad or m], 0 if all are met.
        via_unit: unit of this distance, rad or m, or both where joints differ.
    """

    solution: str
    instants: int
    rows: tuple[Utilisation, ...]
    objectives: tuple[Known, ...]
    derivative_mismatch: float
    effort_difference: float
    effort_mismatch: float
    record_mismatch: float
    via_error: float
    via_unit: str

    __repr__ = brief

    def _repr_html_(self) -> str:
        at = ("" if row.instant is None else f"{row.instant:.3f} s" for row in self.by_limit)
        used = [(row.limit, row.joint or "", f"{100.0 * row.share:.2f} %") for row in self.by_limit]
        rows = [(*row, when) for row, when in zip(used, at, strict=True)]
        told = {one.name: f"known to {one.known_to:.2g} {pretty(one.unit)}" for one in self.objectives if one.known_to}
        table = html.table(("limit", "joint that uses most", "used", "at"), rows)
        title = f"Verification: {'passed' if self.passed else 'failed'}"
        return html.shown(title, html.sentence(self.verdict), table, html.facts(told))

    @property
    def exceeded(self) -> tuple[Utilisation, ...]:
        """Limits that are exceeded by more than 0.1 %, or whose use is NaN."""
        return tuple(row for row in self.rows if not row.share <= 1.0 + TOLERANCE)

    @property
    def worst(self) -> Utilisation | None:
        """The limit that is used most, or None where nothing is limited."""
        return max(self.rows, key=lambda row: np.inf if np.isnan(row.share) else row.share, default=None)

    @cached_property
    def by_limit(self) -> tuple[Utilisation, ...]:
        """The worst row of every limit."""
        worst: dict[str, Utilisation] = {}
        for row in self.rows:
            if row.limit not in worst or not row.share <= worst[row.limit].share:
                worst[row.limit] = row
        return tuple(worst.values())

    @property
    def doubts(self) -> tuple[str, ...]:
        """Values that do not agree although they should, one clause each."""
        checks = (
            (self.derivative_mismatch, "position, velocity, acceleration and jerk are not derivatives of each other"),
            (self.effort_mismatch, "the effort is not what Pinocchio says"),
            (self.record_mismatch, "the objectives on record are not those of the decision variables"),
        )
        return tuple(f"{what} ({100.0 * value:.3g} % apart)" for value, what in checks if not value <= TOLERANCE)

    @property
    def passed(self) -> bool:
        """Whether no limit is exceeded by more than 0.1 % and all values agree that should."""
        return not self.exceeded and not self.doubts

    @property
    def verdict(self) -> str:
        """The result in one sentence."""
        if self.exceeded:
            more = f" and {len(self.exceeded) - 1} more" if len(self.exceeded) > 1 else ""
            return f"{self.solution} FAILS: {self.worst}{more}."
        if self.doubts:
            return f"{self.solution} FAILS: {'; '.join(self.doubts)}."
        closest = "nothing is limited" if self.worst is None else f"closest is {self.worst}"
        missed = f"; a joint passes an inner point at {self.via_error:.4g} {self.via_unit}" if self.via_error else ""
        return f"{self.solution} keeps every limit at {self.instants} instants: {closest}{missed}."


def verify(solution: Solution, *, density: int = 20) -> Verification:
    """Check the motion of a solution at denser samples than those of its problem.

    The effort is computed by :class:`~trajevo.verification.newton_euler.NewtonEuler`.

    Args:
        solution: what to check.
        density: factor of the problem's number of samples per segment, 2 to 200. Samples are evenly spaced and include
            both ends of every segment, so that jumps are seen from both sides.

    Returns:
        Utilisation of every limit, and values that do not agree.

    Raises:
        InvalidInputError: not a solution, or an invalid density.
    """
    if not isinstance(solution, Solution):
        raise InvalidInputError(f"solution: expected a solution of a front, got {type(solution).__name__}")
    whole = isinstance(density, int | np.integer) and not isinstance(density, bool)
    if not (whole and 2 <= density <= MOST_DENSE):
        raise InvalidInputError(f"density: expected a whole number from 2 to {MOST_DENSE}, got {density!r}")
    rollout = solution.rollout
    dense = replace(rollout, dynamics=rollout.dynamics.sampled(rollout.dynamics.samples * int(density)))
    shares = np.linspace(0.0, 1.0, dense.dynamics.samples)
    motion = _motion(rollout.trajectory, shares)
    effort, pinocchio = _efforts(rollout, motion)
    apart = np.abs(effort - pinocchio).max(axis=0)
    return Verification(
        solution=f"row {solution.index}" + ("" if solution.rule == "row" else f" ({solution.rule})"),
        instants=len(motion.t),
        rows=(*_robot_rows(rollout, motion, effort), *_problem_rows(solution, dense)),
        objectives=tuple(
            Known(one.name, solution.F[one.name], one.unit, solution.known_to[one.name])
            for one in solution.front.record.objectives
        ),
        derivative_mismatch=_derivative_mismatch(rollout.trajectory, motion, shares),
        effort_difference=float(apart.max()) if rollout.robot.gives_effort else float("nan"),
        effort_mismatch=float((apart / np.maximum(np.abs(effort).max(axis=0), 1e-6)).max()),
        record_mismatch=_record_mismatch(solution, rollout),
        via_error=float(via_errors(solution.front.problem.interpolant, rollout.trajectory).max(initial=0.0)),
        via_unit=position_unit(rollout.robot),
    )


def verify_all(front: Front, *, density: int = 20) -> tuple[Verification, ...]:
    """:func:`verify` for every solution of a front.

    Raises:
        NoSolutionError: the front is empty.
        InvalidInputError: as :func:`verify`.
    """
    if not len(front):
        raise NoSolutionError(f"the front is empty: {front.blocking}")
    return tuple(verify(front.pick(str(row)), density=density) for row in range(len(front)))


def _motion(trajectory: TrajectoryBatch, shares: Array) -> Motion:
    """Samples of one trajectory at the given shares of every segment: t (T,), the others (T, n_joints)."""
    t = trajectory.breaks[0, :-1, None] + trajectory.segment_durations[0, :, None] * shares
    return Motion(t.reshape(-1), *(trajectory.at_shares(shares, order)[0] for order in range(len(DERIVATIVES))))


def _efforts(rollout: Rollout, motion: Motion) -> tuple[Array, Array]:
    """Effort by our own recursion and by Pinocchio, each (T, n_joints); none without masses."""
    if not rollout.robot.gives_effort:
        return np.zeros_like(motion.q), np.zeros_like(motion.q)
    payload = rollout.dynamics.payload
    if rollout.masses is not None:
        payload = payload.with_mass(float(rollout.masses[0]))
    states, count = (motion.q, motion.v, motion.a), rollout.trajectory.breaks.shape[1] - 1
    segments = np.arange(count).repeat(len(motion.q) // count)
    ours = np.empty_like(motion.q)
    for carried, places in _carried(rollout.dynamics.schedule, payload, segments):
        ours[places] = NewtonEuler(rollout.robot, carried).effort(*(x[places] for x in states))
    return ours, replace(rollout.dynamics, payload=payload).effort(*states, segments)


def _carried(schedule: Schedule | None, payload: Payload, segments: Array) -> Iterator[tuple[Payload, Array]]:
    """What is carried together, with the places at which it is, of states in given segments (T,)."""
    if schedule is None:
        yield payload, np.arange(len(segments))
        return
    of_states = np.array(schedule.phase_of_segment)[segments]
    for k, phase in enumerate(schedule.phases):
        yield schedule.everything(phase, payload), np.flatnonzero(of_states == k)


def _robot_rows(rollout: Rollout, motion: Motion, effort: Array) -> Iterator[Utilisation]:
    limits, robot = rollout.limits, rollout.robot
    used = {"position": limits.range_used(motion.q)}
    when = dict.fromkeys((*DERIVATIVES, "effort"), np.broadcast_to(motion.t[:, None], motion.q.shape))
    for order, (name, values) in enumerate(zip(DERIVATIVES[1:], (motion.v, motion.a, motion.j), strict=True), start=1):
        endless, at = infinite(rollout.trajectory, order)
        sides = limits.sides(name)
        used[name] = np.where(sides.limited, np.where(endless, np.inf, sides.share(values)), -np.inf)
        when[name] = np.where(endless, at, when[name])
    if robot.gives_effort:
        sides = limits.sides("effort")
        used["effort"] = np.where(sides.limited, sides.share(effort), -np.inf)
    for name, share in used.items():
        for joint in np.flatnonzero(~np.isneginf(share).all(axis=0)):
            worst = int(np.argmax(share[:, joint]))  # the first NaN, if there is one
            greatest = float(share[worst, joint])
            own = greatest if name == "position" else greatest * _share_kept(rollout, name, int(joint))
            full = None if own == greatest else own
            yield Utilisation(name, robot.joint_names[joint], greatest, float(when[name][worst, joint]), full)


def _share_kept(rollout: Rollout, name: str, joint: int) -> float:
    kept, own = (float(limits.sides(name).lesser[joint]) for limits in (rollout.limits, rollout.robot.limits))
    return kept / own


def _problem_rows(solution: Solution, dense: Rollout) -> Iterator[Utilisation]:
    """Utilisation of the problem's constraints that are no limits of the joints, by their own functions."""
    for constraint in solution.front.problem.constraints:
        if not constraint.of_joints:
            for name, value in zip(constraint.names, constraint.at_samples.function(dense)[0].tolist(), strict=True):
                yield Utilisation(name, None, 1.0 + value, None)


def _derivative_mismatch(trajectory: TrajectoryBatch, motion: Motion, shares: Array) -> float:
    """See :attr:`Verification.derivative_mismatch`."""
    inner = np.clip(shares, 2.0 * _STEP, 1.0 - 2.0 * _STEP)
    durations = np.repeat(trajectory.segment_durations[0], len(shares))[:, None]
    # The derivatives of a joint at rest are only rounding, as are those of one whose points differ by rounding.
    rounding = (
        _ROUNDING
        * (np.abs(motion.q).max(axis=0) + _STILL)
        / durations.min() ** np.arange(len(DERIVATIVES)).reshape(-1, 1)
    )
    peaks = np.abs([motion.q, motion.v, motion.a, motion.j]).max(axis=1) + rounding
    apart = np.zeros_like(peaks)
    for order in range(1, len(DERIVATIVES)):
        moved = [weight * trajectory.at_shares(inner + k * _STEP, order - 1)[0] for k, weight in _STENCIL.items()]
        differences = np.sum(moved, axis=0) / (_STEP * durations)
        apart[order] = np.abs(trajectory.at_shares(inner, order)[0] - differences).max(axis=0)
    for order, values in enumerate((motion.q, motion.v)):
        segments = values.reshape(-1, len(shares), trajectory.n_joints)
        gaps = np.abs(segments[1:, 0] - segments[:-1, -1]).max(axis=0, initial=0.0)
        apart[order] = np.maximum(apart[order], gaps)
    return float((apart / peaks).max())


def _record_mismatch(solution: Solution, rollout: Rollout) -> float:
    """See :attr:`Verification.record_mismatch`."""
    front = solution.front
    found = np.array([objective.function(rollout)[0] for objective in front.problem.objectives])
    scale = np.maximum(np.abs(front.F).max(axis=0), np.finfo(np.float64).tiny)
    return float((np.abs(found - front.F[solution.index]) / scale).max())
