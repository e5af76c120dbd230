"""The closed loop: controllers sample motions of MuJoCo at their rate, and hold efforts in between."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import final

import numpy as np

from trajevo.base import jit
from trajevo.base.arrays import Array
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.robot.payload import Payload, carrying
from trajevo.robot.robot import Robot
from trajevo.verification.twin.controllers import Belief, ComputedTorque, Controller, ProportionalDerivative
from trajevo.verification.twin.plant import Plant
from trajevo.verification.twin.settings import TwinSettings

#: Speed above which a loop counts as unstable, and is not followed any further [rad/s or m/s].
_RUNAWAY = 1e5

#: Greatest number of samples of the controller in one motion.
_MOST_SAMPLES = 2_000_000


@final
@dataclass(frozen=True, eq=False)
class Played:
    """B motions as they were played, at K samples of the controller.

    Attributes:
        t: instants, shape (K,) [s].
        counts: samples of each motion until it is no longer watched, shape (B,); what follows is NaN.
        reference: positions that were asked for, shape (B, K, n_joints) [rad or m].
        q: positions, the same shape [rad or m]; infinite from where a loop ran away.
        effort: efforts on the joints, averaged over the period that begins, the same shape [N·m or N].
        saturated: whether a joint was asked for more than its effort limit, the same shape.
    """

    t: Array
    counts: Array
    reference: Array
    q: Array
    effort: Array
    saturated: Array


def played(rollout: Rollout, settings: TwinSettings) -> Played:
    """Play all motions of a rollout, each as if it were alone.

    Raises:
        InvalidInputError: a robot or loads that are not simulated, or too many samples.
    """
    _check(rollout, settings)
    with jit.uncompiled():  # few states at a time: Pinocchio takes a fiftieth of the time
        return _Loop(rollout, settings).play()


class _Loop:
    """Everything that stays the same while motions are played."""

    def __init__(self, rollout: Rollout, settings: TwinSettings) -> None:
        robot, friction = rollout.robot, rollout.robot.friction
        self.settings, self.rollout, self.period = settings, rollout, settings.period
        self.steps = settings.steps(dry=friction.is_dry)
        self.late = settings.delay_steps(dry=friction.is_dry)
        self.plant = Plant(robot, _carrying(rollout), self.period / self.steps)
        durations = rollout.trajectory.duration
        self.counts = np.floor((durations + settings.settle) * settings.rate * (1.0 + 1e-12)).astype(int) + 1
        self.t = np.arange(self.counts.max()) * self.period
        #: Positions, velocities and accelerations by samples, shapes (K, B, n_joints).
        self.reference = _reference(rollout, self.t)
        self.controller = _controller(rollout, settings, self.reference[0][0])
        self.most = robot.limits.sides("effort")
        self.resolution, self.noise = (settings.of_joints(name, robot.dof) for name in ("resolution", "noise"))

    def play(self) -> Played:
        """The motions, sample by sample; a motion that ends sooner is left out of the rest."""
        q, v, a = self.reference
        found, effort = np.full_like(q, np.nan), np.full_like(q, np.nan)
        saturated = np.zeros(q.shape, dtype=bool)
        rows = np.arange(q.shape[1])
        states, last = self.plant.at(q[0], v[0]), np.zeros_like(q[0])
        held = np.repeat(self._first()[None], self.late // self.steps + 2, axis=0)
        noises = self._noises()
        for k in range(len(self.t)):
            found[k, rows] = position = self.plant.positions(states)
            going = (k < self.counts[rows]) & self._followed(states)
            if not going.all():
                found[k:, rows[~going & (k < self.counts[rows])]] = np.inf
                rows, states, last, held = rows[going], states[going], last[going], held[:, going]
                position = position[going]
                if not len(rows):
                    break
            asked_for = q[k, rows], v[k, rows], a[k, rows]
            error = asked_for[0] - self._measured(position, noises)
            rate = (error - last) / self.period if k else np.zeros_like(error)
            asked = self.controller.effort(asked_for, error, rate, rows)
            clamped = np.minimum(np.maximum(asked, -self.most.backward), self.most.forward)
            saturated[k, rows] = clamped != asked
            held, last = np.concatenate([held[1:], clamped[None]]), error
            efforts = self._acting(held)
            effort[k, rows] = efforts[:, 0] if self.steps == 1 else efforts.mean(axis=1)
            states = self.plant.moved(states, efforts, rows)
        past = np.arange(len(self.t))[:, None] >= self.counts
        found[past] = effort[past] = np.nan
        return Played(self.t, self.counts, *(np.moveaxis(x, 0, 1) for x in (q, found, effort, saturated)))

    def _first(self) -> Array:
        """Efforts of the start without errors, which act until the first one that was computed arrives."""
        q, v, a = self.reference
        none = np.zeros_like(q[0])
        first = self.controller.effort((q[0], v[0], a[0]), none, none, np.arange(len(none)))
        return np.clip(first, -self.most.backward, self.most.forward)

    def _followed(self, states: Array) -> Array:
        """Whether motions are still those of a loop that did not run away, shape (B,); NaN is none."""
        followed: Array = np.asarray((np.abs(self.plant.velocities(states)) < _RUNAWAY).all(axis=1))
        return followed

    def _noises(self) -> Iterator[Array]:
        """Noise of all positions at one sample after the other, shape (n_joints,) [rad or m]; none without noise."""
        if self.noise.any():
            random = np.random.default_rng(self.settings.seed)
            for _ in self.t:
                yield self.noise * random.standard_normal(len(self.noise))

    def _measured(self, q: Array, noises: Iterator[Array]) -> Array:
        """Positions as encoders tell them."""
        noise = next(noises, None)
        told = q if noise is None else q + noise
        if self.resolution.any():
            step = np.where(self.resolution > 0.0, self.resolution, 1.0)
            told = np.where(self.resolution > 0.0, step * np.round(told / step), told)
        return told

    def _acting(self, held: Array) -> Array:
        """Efforts of every integration step of a period, (B, steps, n_joints), of the last ones that were computed."""
        if not self.late:
            return np.repeat(held[-1][:, None], self.steps, axis=1)
        late, part = divmod(self.late, self.steps)
        which = len(held) - 1 - late - (np.arange(self.steps) < part)
        acting: Array = np.moveaxis(held[which], 0, 1)
        return acting


def _check(rollout: Rollout, settings: TwinSettings) -> None:
    robot, payload = rollout.robot, rollout.dynamics.payload
    robot.check_masses("a simulation")
    if rollout.dynamics.schedule is not None:
        raise InvalidInputError(
            "motion: expected one load that is always carried, which alone is simulated, got "
            f"{rollout.dynamics.schedule}"
        )
    if payload.mass > 0.0 and payload.model != "rigid":
        raise InvalidInputError(f"payload.model: expected 'rigid', which alone is simulated, got {payload.model!r}")
    longest = float(rollout.trajectory.duration.max())
    samples = (longest + settings.settle) * settings.rate
    if samples > _MOST_SAMPLES:
        raise InvalidInputError(
            f"rate: expected at most {_MOST_SAMPLES} samples of a motion, got {settings.rate:g} Hz for {longest:g} s "
            f"and {settings.settle:g} s after it"
        )


def _reference(rollout: Rollout, t: Array) -> tuple[Array, Array, Array]:
    """Positions, velocities and accelerations at instants (K,), shapes (K, B, n_joints): at rest after the end."""
    trajectory = rollout.trajectory
    ends = trajectory.duration[:, None]
    within = np.minimum(t, ends)
    q, v, a = (trajectory.evaluate(within, order) for order in range(3))
    moving = (t < ends)[..., None]
    q, v, a = (
        np.ascontiguousarray(np.moveaxis(x, 0, 1)) for x in (q, rollout.without_rounding(v) * moving, a * moving)
    )
    return q, v, a


def _carrying(rollout: Rollout) -> list[object]:
    """Pinocchio models of the robot with what is carried, one for all motions or one for each."""
    robot, payload = rollout.robot, rollout.dynamics.payload
    if rollout.masses is None:
        return [_with(robot, payload)]
    return [_with(robot, payload.with_mass(mass)) for mass in rollout.masses.tolist()]


def _with(robot: Robot, payload: Payload) -> object:
    return carrying(robot, payload) if payload.mass > 0.0 else robot.model


def _controller(rollout: Rollout, settings: TwinSettings, start: Array) -> Controller:
    """The controller of motions that start at positions (B, n_joints)."""
    dynamics, share = rollout.dynamics, 1.0 + settings.payload_error
    believed = replace(dynamics.without_dry_friction, payload=dynamics.payload.with_mass(share * dynamics.payload.mass))
    masses = None if rollout.masses is None else share * rollout.masses
    frequency, damping = (
        settings.of_joints(name, rollout.robot.dof) for name in ("natural_frequency", "damping_ratio")
    )
    gains = Belief(believed, rollout.robot.friction, masses), frequency**2, 2.0 * damping * frequency
    if settings.controller == "computed_torque":
        return ComputedTorque(*gains)
    return ProportionalDerivative(*gains, gains[0].inertia(start))
