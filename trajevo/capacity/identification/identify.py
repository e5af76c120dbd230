"""Identify a payload from a log of a robot's motion.

Effort is linear in a payload's ten parameters φ = (m, m c, I): what is measured, less what the arm bears without the
payload, is Y(q, q̇, q̈) φ. The arm's part is computed by its model, or measured on the same motion without payload,
which also takes friction off that does not depend on the load (the difference method).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from trajevo.base.arrays import Array, frozen, real_number
from trajevo.capacity.identification.found import IdentifiedPayload
from trajevo.capacity.identification.least_squares import Fit, fitted
from trajevo.capacity.identification.measured import measured_efforts
from trajevo.capacity.identification.smoothing import Smoothed, smoothed
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.payload_regressor.excitation import COMMON, NOT_SHOWN
from trajevo.dynamics.payload_regressor.regressor import payload_regressor
from trajevo.errors import InvalidInputError
from trajevo.robot.payload import PARAMETERS
from trajevo.robot.robot import Robot, robot_of
from trajevo.trajectory.joint_log import JointLog

#: How often the noise of the positions is drawn anew to see what it does to the result, and the seed of that.
_DRAWS, _SEED = 4, 1

#: How far apart two logs of the same motion may be, as a share of how far each joint moves.
_SAME = 0.02


def identify_payload(
    log: str | Path | dict[str, Any] | JointLog,
    robot: str | Robot,
    *,
    empty: str | Path | dict[str, Any] | JointLog | None = None,
    mass: float | None = None,
    friction: bool = False,
) -> IdentifiedPayload:
    """Mass, centre of mass and inertia of what a robot carried, with error bars, from a log of torques or currents.

    Args:
        log: a file of a motion with the payload, see
            :func:`trajevo.trajectory.joint_log.read_joint_log`, or its arrays by name: ``time``,
            ``position``, and ``effort`` or ``current``. Velocities and accelerations come from the positions.
        robot: the robot; currents need its drives.
        empty: a log of the same motion without payload, which is taken off; the robot's model if None.
        mass: the payload's mass if it is known, as from scales [kg].
        friction: whether to find an offset, viscous and dry friction of every joint too, where the robot's model has
            none that holds.

    Raises:
        InvalidInputError: a log that cannot be used, or another motion in ``empty``.
    """
    if not isinstance(friction, bool):
        raise InvalidInputError(f"friction: expected True or False, got {friction!r}")
    carrier = robot_of(robot)
    carrier.check_body("a payload")
    loaded = JointLog.of(log, carrier)
    motion = smoothed(loaded.time, loaded.position)
    efforts = measured_efforts(loaded, carrier, motion.v, motion.a)
    if empty is None:
        own = Dynamics(carrier).unloaded_effort(motion.q, _turning(motion), motion.a)
    else:
        own = _without(JointLog.of(empty, carrier, name="empty"), loaded, carrier)
    added = efforts - own
    used = np.flatnonzero(np.isfinite(added).all(axis=0))
    if not len(used):
        raise InvalidInputError("empty: expected efforts or currents of the same joints as the log with payload")
    given = None if mass is None else _known(mass)
    problem = _Problem(carrier, motion, added[:, used], used, given, friction)
    return problem.found(loaded, by_difference=empty is not None)


class _Problem(NamedTuple):
    """Least squares for a payload: the robot, its motion, what the payload adds to the efforts of the used joints."""

    robot: Robot
    motion: Smoothed
    added: Array
    used: Array
    mass: float | None
    friction: bool

    def found(self, log: JointLog, *, by_difference: bool) -> IdentifiedPayload:
        """The payload, with the doubt that the noise of the positions leaves."""
        exact = self.motion.q, self.motion.v, self.motion.a
        columns = self._columns(*exact)
        generator = np.random.default_rng(_SEED)
        draws = [self.motion.error_drawn(generator) for _ in range(_DRAWS)]
        noisy = [self._columns(*(x + dx for x, dx in zip(exact, draw, strict=True))) for draw in draws]
        fit = self._fit(columns, self.added, noisy[0] - columns)
        shifts = []
        for draw, moved in zip(draws, noisy, strict=True):
            own = 0.0 if by_difference else self._own(draw)
            shifts.append(self._fit(moved, self.added - own, noisy[0] - columns).values - fit.values)
        drift = np.mean(shifts, axis=0)
        return self._record(fit, fit.covariance + np.outer(drift, drift), log, by_difference)

    def _own(self, draw: tuple[Array, Array, Array]) -> Array:
        """What the model adds to the arm's own efforts where the motion is off by a draw of the noise."""
        dynamics, v = Dynamics(self.robot).without_dry_friction, self.motion.v
        there = dynamics.unloaded_effort(self.motion.q + draw[0], v + draw[1], self.motion.a + draw[2])
        more: Array = (there - dynamics.unloaded_effort(self.motion.q, v, self.motion.a))[:, self.used]
        return more

    def _columns(self, q: Array, v: Array, a: Array) -> Array:
        """The regressor of the used joints at all instants, shape (T, used, K), with what else is found."""
        payload = payload_regressor(self.robot, q, v, a)[:, self.used]
        if not self.friction:
            return payload
        count = len(self.used)
        still = np.zeros((len(q), count, 3 * count))
        for k, joint in enumerate(self.used):
            still[:, k, 3 * k : 3 * k + 3] = np.stack([np.ones(len(q)), v[:, joint], np.sign(v[:, joint])], axis=1)
        return np.concatenate([payload, still], axis=2)

    def _fit(self, columns: Array, added: Array, noise: Array) -> Fit:
        inner, scales = self.motion.inner, np.ones(columns.shape[2])
        scales[: len(PARAMETERS)] = COMMON
        rows, wrong, efforts = columns[inner], noise[inner], added[inner]
        if self.mass is None:
            return fitted(rows, efforts, scales, wrong)
        fit = fitted(rows[..., 1:], efforts - self.mass * rows[..., 0], scales[1:], wrong[..., 1:])
        covariance = np.pad(fit.covariance, ((1, 0), (1, 0)))
        return fit._replace(values=np.append(self.mass, fit.values), covariance=covariance)

    def _record(self, fit: Fit, covariance: Array, log: JointLog, by_difference: bool) -> IdentifiedPayload:
        count, dof = len(PARAMETERS), self.robot.dof
        left = np.full(dof, np.nan)
        left[self.used] = fit.left
        friction = None
        if self.friction:
            friction = np.full((dof, 3), np.nan)
            friction[self.used] = fit.values[count:].reshape(-1, 3)
        of_payload = fit.scaled[:, : count - (self.mass is not None)]
        singular = np.linalg.svd(of_payload, compute_uv=False)
        return IdentifiedPayload(
            parameters=frozen(fit.values[:count].copy()),
            covariance=frozen(covariance[:count, :count].copy()),
            condition=float(singular[0] / singular[-1]) if singular[-1] * NOT_SHOWN > singular[0] else np.inf,
            left=frozen(left),
            friction=None if friction is None else frozen(friction),
            joint_names=self.robot.joint_names,
            tool=self.robot.tool,
            instants=int(self.motion.inner.sum()),
            freedom=fit.freedom,
            by_difference=by_difference,
            mass_given=self.mass is not None,
            source=log.source,
        )


def _known(mass: Any) -> float:
    known = real_number(mass)
    if known is None or not 0.0 < known < np.inf:
        raise InvalidInputError(f"mass: expected a positive mass [kg], or None if it is not known, got {mass!r}")
    return known


def _turning(motion: Smoothed) -> Array:
    """Velocities with those set to 0 that are no more than their noise, so that dry friction has no sign there."""
    noise = np.std(motion.error_drawn(np.random.default_rng(_SEED))[1], axis=0)
    return np.where(np.abs(motion.v) > 3.0 * noise, motion.v, 0.0)


def _without(empty: JointLog, loaded: JointLog, robot: Robot) -> Array:
    """Efforts of the motion without payload at the instants of that with it, NaN for joints that were not measured."""
    if empty.time[0] > loaded.time[0] or empty.time[-1] < loaded.time[-1]:
        raise InvalidInputError(
            f"empty: expected the same motion, from {loaded.time[0]:g} to {loaded.time[-1]:g} s, got "
            f"{empty.time[0]:g} to {empty.time[-1]:g} s"
        )
    motion = smoothed(empty.time, empty.position)
    efforts = measured_efforts(empty, robot, motion.v, motion.a)
    at = np.stack([np.interp(loaded.time, empty.time, column) for column in motion.q.T], axis=1)
    apart, far = np.abs(at - loaded.position).max(axis=0), np.ptp(loaded.position, axis=0).max()
    worst = int(apart.argmax())
    if apart[worst] > _SAME * far:
        raise InvalidInputError(
            f"empty: expected the same motion, but {robot.joint_names[worst]} is {apart[worst]:.3g} "
            f"{robot.joint_units[worst]} away from where it is with the payload"
        )
    return np.stack([np.interp(loaded.time, empty.time, column) for column in efforts.T], axis=1)
