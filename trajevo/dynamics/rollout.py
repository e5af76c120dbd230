"""Rollouts: a robot's motions and efforts at the Gauss-Lobatto nodes of every segment, both ends included."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.base.shown.brief import brief
from trajevo.dynamics.integrals.nodes import lobatto
from trajevo.dynamics.integrals.resolved import Resolved, at_samples, combined, resolve
from trajevo.dynamics.inverse_dynamics import _ROUNDING, Dynamics
from trajevo.errors import InvalidInputError
from trajevo.robot.joints import JointLimits, least_share
from trajevo.robot.robot import Robot
from trajevo.trajectory.arranged import Arranged
from trajevo.trajectory.batch import TrajectoryBatch

#: Share of the work in a segment, or on average in the motion's segments, that its polynomials may leave out.
_LEFT_OUT = 5e-5
#: Share of a joint's greatest effort that the last terms may be, for peaks of efforts.
_OF_PEAK = 1e-4
#: The same for squares over a cycle that repeats, which certificates tell to a millionth.
_OF_HEAT = 1e-7
#: Share of an integral of squares, of a segment's or of the average one, that the integral of the squared last terms
#: may be: what is left out is seldom five times as much.
_OF_SQUARES = 1e-5
#: Share of a joint's greatest effort that the last terms may be, for what its drive draws: integrals are then right to
#: a millionth.
_OF_DRIVES = 3e-5
#: Share of the last terms of efforts' polynomials, times the travel, that the polynomials leave out of the work.
_OF_LAST_TERMS = 0.05


@final
@dataclass(frozen=True, eq=False)
class Rollout:
    """A batch of trajectories of a robot, sampled per segment; effort is computed once, when it is first needed.

    Attributes:
        dynamics: robot, payload, samples per segment.
        trajectory: B trajectories of its joints.
        masses: payload mass of each trajectory, shape (B,) [kg]; the payload's own if None.
        kept_limits: limits of the joints that the motions are meant to keep; the robot's own if None.
        arranged: how the cell is arranged for each trajectory; None if it is the same for all.

    Raises:
        InvalidInputError: the trajectory has another number of joints than the robot, or of segments than the schedule
            of the loads, or of motions than gravities of the dynamics.
    """

    dynamics: Dynamics
    trajectory: TrajectoryBatch
    masses: Array | None = None
    kept_limits: JointLimits | None = None
    arranged: Arranged | None = None

    __repr__ = brief

    def __post_init__(self) -> None:
        if self.trajectory.n_joints != self.robot.dof:
            raise InvalidInputError(
                f"trajectory: robot {self.robot.name!r} has {self.robot.dof} joints, "
                f"got a trajectory of {self.trajectory.n_joints}"
            )
        schedule, count = self.dynamics.schedule, self.trajectory.breaks.shape[1] - 1
        if schedule is not None and len(schedule.carried) != count:
            raise InvalidInputError(
                f"trajectory: expected {len(schedule.carried)} segments, as loads are scheduled for, got {count}"
            )
        gravity = self.dynamics.gravity
        if gravity is not None and len(gravity) != len(self.trajectory):
            raise InvalidInputError(
                f"trajectory: expected {len(gravity)} motions, which have each a gravity of its own, got "
                f"{len(self.trajectory)}"
            )

    def rows(self, chosen: slice) -> Rollout:
        """Some of the motions; of one alone, the robot has the gravity of its base."""
        return replace(
            self,
            dynamics=self.dynamics.of_rows(chosen).of_one_base,
            trajectory=self.trajectory[chosen],
            masses=None if self.masses is None else self.masses[chosen],
            arranged=None if self.arranged is None else self.arranged.rows(chosen),
        )

    @property
    def robot(self) -> Robot:
        """The robot that moves."""
        return self.dynamics.robot

    @property
    def limits(self) -> JointLimits:
        """Limits that the motions are measured against: a problem's margin is already taken off."""
        return self.robot.limits if self.kept_limits is None else self.kept_limits

    @property
    def effort_margin(self) -> float:
        """Greatest share of a joint's effort limit that is kept free, 0 for none."""
        return 1.0 - self.effort_kept

    @property
    def effort_kept(self) -> float:
        """Least share of the robot's effort limits that the motions are measured against, 1 without a margin."""
        return least_share(*(each.sides("effort").lesser for each in (self.limits, self.robot.limits)))

    @property
    def keeps_margins(self) -> bool:
        """Whether some limit that the motions are measured against is not the robot's own."""
        return any(
            not np.array_equal(getattr(self.limits, field.name), getattr(self.robot.limits, field.name))
            for field in fields(JointLimits)
        )

    @cached_property
    def t(self) -> Array:
        """Instants of the samples, shape (B, T) [s]: Gauss-Lobatto nodes of every segment, T = segments x samples."""
        nodes = lobatto(self.dynamics.samples)[0]
        t = self.trajectory.breaks[:, :-1, None] + self.trajectory.segment_durations[:, :, None] * nodes
        return frozen(t.reshape(len(self.trajectory), -1))

    @cached_property
    def q(self) -> Array:
        """Positions at the samples, shape (B, T, n_joints) [rad or m]."""
        return self._sampled(0)

    @cached_property
    def v(self) -> Array:
        """Velocities at the samples, shape (B, T, n_joints) [rad/s or m/s]."""
        return self._sampled(1)

    @cached_property
    def a(self) -> Array:
        """Accelerations at the samples, shape (B, T, n_joints) [rad/s² or m/s²]."""
        return self._sampled(2)

    @cached_property
    def j(self) -> Array:
        """Jerks at the samples, shape (B, T, n_joints) [rad/s³ or m/s³]."""
        return self._sampled(3)

    def _sampled(self, derivative: int) -> Array:
        return self.trajectory.at_shares(lobatto(self.dynamics.samples)[0], derivative)

    @cached_property
    def quadrature(self) -> Array:
        """Weights that turn the samples' values into ∫ dt, shape (B, T) [s]."""
        weights = lobatto(self.dynamics.samples)[1]
        return frozen((self.trajectory.segment_durations[:, :, None] * weights).reshape(len(self.trajectory), -1))

    @cached_property
    def unloaded_effort(self) -> Array:
        """Effort without payload at the samples, shape (B, T, n_joints) [N·m or N]."""
        return frozen(self.dynamics.unloaded_effort(self.q, self._moving, self.a, self.segments, axis=1))

    @cached_property
    def effort_per_kilogram(self) -> Array:
        """Effort that one kilogram of payload adds at the samples, shape (B, T, n_joints) [N·m/kg or N/kg]."""
        return frozen(self.dynamics.effort_per_kilogram(self.q, self.v, self.a, self.segments, axis=1))

    @cached_property
    def effort(self) -> Array:
        """Effort with the payload at the samples, shape (B, T, n_joints) [N·m or N]."""
        if self.masses is not None:
            return frozen(self.unloaded_effort + self.masses[:, None, None] * self.effort_per_kilogram)
        return frozen(self.dynamics.effort(self.q, self._moving, self.a, self.segments, axis=1))

    @cached_property
    def segments(self) -> Array:
        """Number of the segment of every sample, shape (T,)."""
        return frozen(np.arange(self.trajectory.breaks.shape[1] - 1).repeat(self.dynamics.samples))

    def segments_at(self, t: Array) -> Array:
        """Numbers of the segments at instants (T,) or (B, T) [s], shape (B, T); at a break that of the one after it."""
        inner = self.trajectory.breaks.real[:, None, 1:-1]
        found: Array = (np.broadcast_to(t, (len(inner), np.shape(t)[-1]))[:, :, None] >= inner).sum(axis=2)
        return found

    @cached_property
    def _moving(self) -> Array:
        """Velocities at the samples, with mere rounding set to 0, which dry friction would take for a motion."""
        return self.v if self.robot.friction.none else self.without_rounding(self.v)

    def effort_in(self, q: Array, v: Array, a: Array, t: Array | None = None) -> Array:
        """Effort with the payload in given states, shapes (B, T, n_joints) [N·m or N].

        A joint whose velocity is mere rounding counts as at rest, see :meth:`without_rounding`.

        Args:
            q: positions, shape (B, T, n_joints) [rad or m].
            v: velocities, the same shape [rad/s or m/s].
            a: accelerations, the same shape [rad/s² or m/s²].
            t: their instants, shape (T,) or (B, T) [s]; needed only where loads change on the way. Where they do, what
                is carried afterwards counts.

        Raises:
            InvalidInputError: no instants, although loads change on the way.
        """
        v = self.without_rounding(v)
        if self.dynamics.schedule is not None and t is None:
            raise InvalidInputError(
                f"t: expected the instants of the states, as loads change: {self.dynamics.schedule}"
            )
        if t is None or self.dynamics.schedule is None:
            return frozen(self._loaded_effort(None, q, v, a))
        owner = np.arange(len(q)).repeat(q.shape[1])
        flat = [x.reshape(-1, x.shape[-1]) for x in (q, v, a)]
        effort = self._loaded_effort(owner, flat[0], flat[1], flat[2], self.segments_at(t).reshape(-1))
        return frozen(effort.reshape(q.shape))

    def effort_at_shares(self, q: Array, v: Array, a: Array) -> Array:
        """The same in states at the same shares of every segment, shapes (B, S x U, n_joints) [N·m or N]."""
        count = self.trajectory.breaks.shape[1] - 1
        segments = np.arange(count).repeat(q.shape[1] // count)
        return frozen(self._loaded_effort(None, q, self.without_rounding(v), a, segments, axis=1))

    def _loaded_effort(
        self, rows: Array | None, q: Array, v: Array, a: Array, segments: Array | None = None, *, axis: int = 0
    ) -> Array:
        """Effort with the payload in states (P, ..., n_joints) of the motions in some rows, (P,), or of all for None.

        The segments are those along an axis of the states.
        """
        masses, dynamics = self.masses, self.dynamics
        if rows is not None:
            masses, dynamics = None if masses is None else masses[rows], dynamics.of_rows(rows)
        if masses is None:
            return dynamics.effort(q, v, a, segments, axis=axis)
        each = dynamics.effort_per_kilogram(q, v, a, segments, axis=axis)
        of_payload = masses.reshape(-1, *[1] * (q.ndim - 1)) * each
        loaded: Array = dynamics.unloaded_effort(q, v, a, segments, axis=axis) + of_payload
        return loaded

    def without_rounding(self, v: Array) -> Array:
        """Velocities, shape (B, T, n_joints) [rad/s or m/s], with mere rounding set to 0.

        Otherwise the sign of dry friction would be random at the ends of a motion and for joints that do not move.
        """
        return np.where(np.abs(v.real) <= self.standing[:, None], 0.0, v)

    @cached_property
    def standing(self) -> Array:
        """Greatest speed at which every joint counts as at rest, shape (B, n_joints) [rad/s or m/s]."""
        peaks = self.trajectory.peak(1) + self.trajectory.peak(0) / self.trajectory.duration[:, None]
        return frozen(_ROUNDING * peaks.real)

    @cached_property
    def resolved(self) -> tuple[Resolved, ...]:
        """Effort without dry friction at as many nodes of every segment as its work needs, see :func:`resolve`."""
        per_joint = combined(lobatto(self.dynamics.samples)[1], np.abs(self._by_segment(self.power).real))
        work = per_joint.sum(axis=1) * self.trajectory.segment_durations.real.reshape(-1)
        allowed = _LEFT_OUT * self._own_or_average(work)
        return resolve(self._first_nodes, self.trajectory, self._smooth_effort, left_out=work_left_out, allowed=allowed)

    @cached_property
    def resolved_for_peaks(self) -> tuple[Resolved, ...]:
        """The same at as many nodes as the efforts themselves need, also where a joint hardly moves."""
        return self._resolved_to(_OF_PEAK)

    @cached_property
    def resolved_for_heat(self) -> tuple[Resolved, ...]:
        """The same at as many nodes as squares of motors' torques need over a cycle."""
        return self._resolved_to(_OF_HEAT)

    @cached_property
    def resolved_for_drives(self) -> tuple[Resolved, ...]:
        """The same at as many nodes as the power of drives needs."""
        return self._resolved_to(_OF_DRIVES)

    @cached_property
    def resolved_for_square_power(self) -> tuple[Resolved, ...]:
        """The same at as many nodes as the integral of squared powers needs."""
        return self._resolved_for_squares(of_power=True)

    @cached_property
    def resolved_for_square_effort(self) -> tuple[Resolved, ...]:
        """The same at as many nodes as the integral of squared efforts needs."""
        return self._resolved_for_squares(of_power=False)

    def _resolved_for_squares(self, *, of_power: bool) -> tuple[Resolved, ...]:
        if self.robot.friction.is_dry:  # it jumps where joints turn, which the efforts themselves must tell
            return self.resolved_for_peaks
        factors = np.square(self._by_segment(self.v).real) if of_power else np.ones((1, self.dynamics.samples, 1))
        squares = np.square(self._by_segment(self.effort).real) * factors
        weights, durations = lobatto(self.dynamics.samples)[1], self.trajectory.segment_durations.real.reshape(-1)
        of_factors = combined(weights, factors)

        def left_out(group: Resolved) -> Array:
            squared = np.square(group.last_terms) * (of_factors[group.segments] if of_power else of_factors)
            estimate: Array = squared.sum(axis=1) * group.durations.real
            return estimate

        allowed = _OF_SQUARES * self._own_or_average(combined(weights, squares).sum(axis=1) * durations)
        return resolve(self._first_nodes, self.trajectory, self._smooth_effort, left_out=left_out, allowed=allowed)

    def _by_segment(self, values: Array) -> Array:
        """Values at the samples (B, T, n_joints) as those of all segments, (B x S, samples, n_joints)."""
        return values.reshape(-1, self.dynamics.samples, self.robot.dof)

    def _own_or_average(self, of_segments: Array) -> Array:
        """Amounts of segments (B x S,), or the average of a trajectory's segments where that is greater."""
        own = of_segments.reshape(len(self.trajectory), -1)
        greater: Array = np.maximum(own, own.mean(axis=1, keepdims=True)).reshape(-1)
        return greater

    def _resolved_to(self, share: float) -> tuple[Resolved, ...]:
        first, count = self._first_nodes, self.trajectory.segment_durations.shape[1]
        greatest = np.abs(self.effort.real).max(axis=1) + np.finfo(np.float64).tiny

        def left_out(group: Resolved) -> Array:
            shares: Array = (group.last_terms / greatest[group.segments // count]).max(axis=1)
            return shares

        allowed = np.full(len(first.segments), share)
        return resolve(first, self.trajectory, self._smooth_effort, left_out=left_out, allowed=allowed)

    @cached_property
    def _first_nodes(self) -> Resolved:
        smooth = self.effort - self.robot.friction.dry(self._moving) if self.robot.friction.is_dry else self.effort
        return at_samples(self.trajectory, self.dynamics.samples, (self.q, self.v, self.a), smooth)

    def _smooth_effort(self, segments: Array, q: Array, v: Array, a: Array) -> Array:
        """Effort without dry friction in states (P, T, n_joints) in segments (P,) of all trajectories [N·m or N]."""
        rows, within = np.divmod(segments, self.trajectory.segment_durations.shape[1])
        if not self.robot.friction.none:
            v = np.where(np.abs(v.real) <= self.standing[rows, None], 0.0, v)
        effort = self._loaded_effort(rows, q, v, a, within)
        smooth: Array = effort - self.robot.friction.dry(v) if self.robot.friction.is_dry else effort
        return smooth

    @property
    def power(self) -> Array:
        """Mechanical power of every actuator at the samples, shape (B, T, n_joints) [W]."""
        return frozen(self.effort * self.v)


def work_left_out(group: Resolved) -> Array:
    """Estimate of what polynomials of efforts leave out of ∫ Σ |effort x velocity| dt, shape (P,) [J]."""
    travel = np.abs(np.diff(group.states[0].real, axis=1)).sum(axis=1)
    estimate: Array = _OF_LAST_TERMS * (group.last_terms * travel).sum(axis=1)
    return estimate


def rollout_of(motion: Any) -> Rollout:
    """The rollout of a motion: itself, or that of a solution or an optimum.

    Raises:
        InvalidInputError: it is none of these.
    """
    found = motion if isinstance(motion, Rollout) else getattr(motion, "rollout", None)
    if not isinstance(found, Rollout):
        raise InvalidInputError(f"motion: expected a solution, an optimum or a rollout, got {type(motion).__name__}")
    return found
