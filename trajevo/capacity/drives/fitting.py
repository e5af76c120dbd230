"""Parameters of drives and their supply from a log of a moving arm, with error bars, by least squares.

Currents tell the torque per current of each joint and its friction, the power of the mains tells standby, what windings
lose, and how much more than the mechanical power is drawn. All are linear in what is fitted, up to a division.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, final

import numpy as np

from trajevo.base.arrays import Array, real_number
from trajevo.base.shown import html
from trajevo.base.shown.brief import brief
from trajevo.base.units import pretty
from trajevo.dynamics.drives.motors import UNKNOWN, Motors
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.errors import InvalidInputError
from trajevo.robot.payload import Payload
from trajevo.robot.robot import Robot, robot_of
from trajevo.trajectory.joint_log import JointLog

#: Degree of the polynomials through neighbouring positions, and the fewest samples that they are fitted to.
_DEGREE, _FEWEST = 4, 9

#: Share of a joint's greatest speed below which the direction of its friction is not certain.
_SLOW = 0.05

#: Share of the greatest power from which motors certainly draw.
_CLEAR = 0.05

#: Greatest speed of a joint that does not move [rad/s or m/s].
_STILL = 1e-3

#: Least singular value of the scaled columns that tells parameters apart, as a share of the greatest one, and the part
#: in such a direction from which a parameter belongs to it.
_APART, _BELONGS = 0.01, 0.2

#: Standard deviations on either side of 95 % of a normal distribution, and how often signs of torques are settled.
_SIGMAS, _ROUNDS = 1.96, 6


@final
@dataclass(frozen=True)
class FittedParameter:
    """One parameter by a log.

    Attributes:
        name: what it is.
        joint: its joint; empty of the supply.
        value: by least squares [``unit``].
        deviation: its standard deviation [``unit``].
        unit: SI unit.
    """

    name: str
    joint: str
    value: float
    deviation: float
    unit: str

    @property
    def interval(self) -> tuple[float, float]:
        """Between which it lies with 95 % [``unit``]."""
        return self.value - _SIGMAS * self.deviation, self.value + _SIGMAS * self.deviation

    def __str__(self) -> str:
        of = f" of {self.joint}" if self.joint else ""
        unit = "" if self.unit == "1" else f" {pretty(self.unit)}"
        return f"{self.name}{of} {self.with_error}{unit}"

    @property
    def with_error(self) -> str:
        """Value and half the interval, of which two digits are told."""
        off = _SIGMAS * self.deviation
        places = max(1 - int(np.floor(np.log10(off))), 0) if off > 0.0 else 6
        return f"{self.value:.{places}f} ± {off:.{places}f}"


@final
@dataclass(frozen=True, eq=False)
class DriveFit:
    """Parameters of drives by a log.

    Attributes:
        parameters: what the log tells, with error bars.
        unknown: what it does not tell, and why, one sentence each.
        residual: root of the mean square of what is left, of all currents [A], or of the power [W].
        samples: number of instants that were used.
        robot: the robot.
        source: the log.
    """

    parameters: tuple[FittedParameter, ...]
    unknown: tuple[str, ...]
    residual: float
    samples: int
    robot: Robot
    source: str

    __repr__ = brief

    def of(self, name: str, joint: str = "") -> FittedParameter:
        """One parameter, by its name and joint.

        Raises:
            InvalidInputError: the log does not tell it.
        """
        for one in self.parameters:
            if (one.name, one.joint) == (name, joint):
                return one
        known = ", ".join(f"{one.name} {one.joint}".strip() for one in self.parameters)
        raise InvalidInputError(f"name: expected one of {known}, got {f'{name} {joint}'.strip()!r}")

    @property
    def settings(self) -> dict[str, Any]:
        """What is told as arguments of :func:`~trajevo.robot.robot.load_robot`: drives, friction and supply.

        The torque constant follows from the torque per current of a joint whose drive tells its gear ratio, and the
        resistance from what its winding loses if it tells the torque constant too. Friction and standby below 0 are 0,
        and a loss below 0 tells nothing.
        """
        drives: dict[str, dict[str, float]] = {}
        friction: dict[str, dict[str, float]] = {}
        supply: dict[str, float] = {}
        for one in self.parameters:
            drive = self.robot.drives.get(one.joint, UNKNOWN)
            if one.name == "torque_per_current" and drive.gear_ratio is not None:
                drives.setdefault(one.joint, {})["torque_constant"] = one.value / drive.gear_ratio
            elif one.name == "winding_loss" and drive.gear_ratio is not None and drive.torque_constant is not None:
                ohm = one.value * (drive.gear_ratio * drive.torque_constant) ** 2
                if ohm > 0.0:
                    drives.setdefault(one.joint, {})["winding_resistance"] = ohm
            elif one.name in ("viscous", "coulomb"):
                friction.setdefault(one.name, {})[one.joint] = max(one.value, 0.0)
            elif one.name == "standby_power":
                supply[one.name] = max(one.value, 0.0)
        found = {"drives": drives, "friction": friction, "supply": supply}
        return {name: told for name, told in found.items() if told}

    def __str__(self) -> str:
        told = "; ".join(map(str, self.parameters)) or "nothing"
        return "; ".join([f"{Path(self.source).name}, {self.samples} samples: {told} (95 %)", *self.unknown])

    def _repr_html_(self) -> str:
        rows = [(one.joint, one.name, f"{one.with_error} {pretty(one.unit)}") for one in self.parameters]
        table = html.table(("joint", "parameter", "value, 95 %"), rows, most=len(rows))
        return html.shown(f"Fit to {Path(self.source).name}", table, *map(html.sentence, self.unknown))


def fit_drives(
    log: str | Path | dict[str, Any] | JointLog,
    robot: Robot,
    *,
    payload: Payload | None = None,
    smoothing: float = 0.1,
) -> DriveFit:
    """Parameters of drives by a log of one motion.

    With currents these are, for each joint, ``torque_per_current`` (torque constant times gear ratio), ``viscous`` and
    ``coulomb`` friction. With the power of the mains they are ``standby_power``, ``winding_loss`` of each joint (power
    per square of the motor's torque times the gear ratio), and ``mechanical_share``, what is drawn per mechanical power
    of all motors, which is 1 if the efficiencies of the gears are right.

    Args:
        log: a file, see :func:`trajevo.trajectory.joint_log.read_joint_log`, or its arrays by name: ``time``,
            ``position``, and either ``current`` or ``power`` of all motors, shape (T,) [W]. Of joints without a
            current nothing is told.
        robot: the robot. Masses, rotors and, if they are told, efficiencies are believed; its friction is so with
            powers only.
        payload: what it carries; nothing if None.
        smoothing: time over which positions are smoothed by polynomials of degree 4 to differentiate them [s].

    Raises:
        InvalidInputError: a log that cannot be read or has other columns, times that do not rise, too few samples, or
            currents against the torques; the message names the file.
    """
    span = real_number(smoothing)
    if span is None or not 0.0 < span < np.inf:
        raise InvalidInputError(f"smoothing: expected a positive time [s], got {smoothing!r}")
    if payload is not None and not isinstance(payload, Payload):
        raise InvalidInputError(f"payload: expected a trajevo.Payload, or None for none, got {payload!r}")
    robot = robot_of(robot)
    measured = JointLog.of(log, robot, further={"power": "W"})
    recorded = _Log.of(measured, robot, span)
    arm = _Moved.of(robot, payload or Payload(0.0), recorded)
    found = list(_of_power(recorded, arm) if recorded.power is not None else _of_currents(recorded, arm))
    squares = np.concatenate([one.left**2 for one in found]) if found else np.zeros(1)
    return DriveFit(
        parameters=tuple(parameter for one in found for parameter in one.parameters),
        unknown=tuple(sentence for one in found for sentence in one.unknown),
        residual=float(np.sqrt(squares.mean())),
        samples=len(recorded.q),
        robot=robot,
        source=measured.source,
    )


class _Log(NamedTuple):
    """What a log says at K instants: positions and their derivatives (K, n_joints), currents by joint, or the power."""

    q: Array
    v: Array
    a: Array
    currents: Mapping[int, Array]
    power: Array | None
    where: str

    @classmethod
    def of(cls, log: JointLog, robot: Robot, smoothing: float) -> _Log:
        currents = [joint for joint in range(robot.dof) if not np.isnan(log.current[:, joint]).any()]
        powered = "power" in log.further
        if powered == bool(currents):
            got = "both" if powered else "neither"
            raise InvalidInputError(
                f"{log.source}: expected either '{robot.joint_names[0]} current [A]' and so on, or 'power [W]' of all "
                f"motors, got {got}"
            )
        t = log.time
        half = max(int(np.ceil(0.5 * smoothing / float(np.median(np.diff(t))))), _FEWEST // 2)
        if len(t) < 4 * half + 2:
            raise InvalidInputError(
                f"{log.source}: expected at least {4 * half + 2} instants for a smoothing of {smoothing:g} s, got "
                f"{len(t)}"
            )
        q, v, a = _smoothed(t, log.position, half)
        kept = slice(half, len(t) - half)
        by_joint = {joint: log.current[kept, joint] for joint in currents}
        return cls(q, v, a, by_joint, log.further["power"][kept] if powered else None, log.source)


def _smoothed(t: Array, q: Array, half: int) -> tuple[Array, Array, Array]:
    """Positions, velocities and accelerations by polynomials through 2 half + 1 samples, at all but the first and last.

    Args:
        t: instants, shape (K,) [s]; they need not be evenly spaced.
        q: positions, shape (K, n_joints).
        half: number of neighbours on either side.
    """
    windows = np.lib.stride_tricks.sliding_window_view(t, 2 * half + 1)
    scale = float(t[2 * half] - t[0])
    powers = ((windows - t[half:-half, None]) / scale)[:, :, None] ** np.arange(_DEGREE + 1)
    weights = np.linalg.pinv(powers)[:, :3]  # of values in the first three coefficients, (K - 2 half, 3, 2 half + 1)
    near = np.lib.stride_tricks.sliding_window_view(q, 2 * half + 1, axis=0)
    position, slope, bend = np.matmul(weights, near.swapaxes(1, 2)).swapaxes(0, 1)
    return position, slope / scale, 2.0 * bend / scale**2


class _Moved(NamedTuple):
    """What an arm bears at the instants of a log by its masses, arrays (K, n_joints), and its motors."""

    robot: Robot
    motors: Motors
    rotor: Array
    load: Array

    @classmethod
    def of(cls, robot: Robot, payload: Payload, log: _Log) -> _Moved:
        """The load is that of links and payload, without friction."""
        effort = Dynamics(robot, payload).effort(log.q[None], log.v[None], log.a[None])[0]
        rotor = robot.friction.armature * log.a
        rubbing = robot.friction.effort(log.v, np.zeros_like(log.a))
        drives = tuple(robot.drives.get(name, UNKNOWN) for name in robot.joint_names)
        return cls(robot, Motors(drives), rotor, effort - rubbing - rotor)


class _Found(NamedTuple):
    """What one fit tells and does not tell, and what is left, (K,)."""

    parameters: tuple[FittedParameter, ...]
    unknown: tuple[str, ...]
    left: Array


def _of_currents(log: _Log, arm: _Moved) -> Iterator[_Found]:
    for joint, current in log.currents.items():
        name = arm.robot.joint_names[joint]
        speed = np.abs(log.v[:, joint])
        if speed.max() < _STILL:
            yield _Found((), (f"nothing is told of {name}, which does not move",), np.zeros(0))
            continue
        fast = speed > _SLOW * speed.max()
        yield _of_current(arm, joint, log.v[fast, joint], current[fast], fast, log.where)


def _of_current(arm: _Moved, joint: int, v: Array, current: Array, fast: Array, where: str) -> _Found:
    """Torque per current and friction of one joint, from instants at which it moves."""
    name, unit = arm.robot.joint_names[joint], arm.robot.joint_units[joint]
    effort = "N" if unit == "m" else "N*m"
    rotor, load = arm.rotor[fast, joint], arm.load[fast, joint]
    one = Motors((arm.motors.drives[joint],))
    friction = np.zeros_like(load)
    for _ in range(_ROUNDS if one.lossy else 1):
        factor = one.through((load + friction)[:, None], v[:, None])[:, 0]
        columns = np.stack([rotor + factor * load, factor * v, factor * np.sign(v)], axis=1)
        fit = _least_squares(columns, current, ("torque per current", "viscous friction", "dry friction"))
        per_torque, viscous, dry = fit.values
        friction = (viscous * v + dry * np.sign(v)) / per_torque if per_torque > 0.0 and fit.known.all() else friction
    unknown = tuple(f"{name}: {sentence}" for sentence in fit.unknown)
    if not fit.known[0]:
        return _Found((), unknown, fit.left)
    if per_torque <= 0.0:
        raise InvalidInputError(
            f"{where}: current of {name}: expected a current in the direction of the torque, got the opposite one"
        )
    slopes = np.array([[-1.0, 0.0, 0.0], [-viscous, per_torque, 0.0], [-dry, 0.0, per_torque]]) / per_torque**2
    values = np.array([1.0, viscous, dry]) / per_torque
    spread = np.sqrt(np.diag(slopes @ fit.covariance @ slopes.T))
    told = (("torque_per_current", f"{effort}/A"), ("viscous", f"{effort}*s/{unit}"), ("coulomb", effort))
    parameters = tuple(
        FittedParameter(what, name, float(values[k]), float(spread[k]), of)
        for k, (what, of) in enumerate(told)
        if fit.known[k]
    )
    return _Found(parameters, unknown, fit.left)


def _of_power(log: _Log, arm: _Moved) -> Iterator[_Found]:
    """Standby, losses of windings and the share of the mechanical power, from the power of the mains."""
    if log.power is None:
        return
    names = arm.robot.joint_names
    moving = np.where(np.abs(log.v) > _STILL, log.v, 0.0)
    load = arm.load + arm.robot.friction.effort(moving, np.zeros_like(moving))
    torque = arm.rotor + arm.motors.through(load, moving) * load
    columns = np.concatenate([np.ones((len(log.q), 1)), (torque * log.v).sum(axis=1, keepdims=True), torque**2], axis=1)
    called = ("standby", "the share of the mechanical power", *(f"the loss in the winding of {name}" for name in names))
    speed = np.abs(log.v)
    # Torques of joints that turn round jump, so that what is drawn there is not certain.
    sure = ((speed > _SLOW * speed.max(axis=0)) | (speed.max(axis=0) < _STILL)).all(axis=1)
    fit = _least_squares(columns[sure], log.power[sure], called)
    for _ in range(_ROUNDS if arm.robot.supply.recuperation != "full" else 0):
        # The mains see nothing of what is given back.
        drawn = columns[:, 1:] @ fit.values[1:]
        used = sure & (drawn > _CLEAR * drawn.max())
        if used.sum() <= 2 * columns.shape[1]:
            raise InvalidInputError(f"{log.where}: expected instants at which motors draw power, got {used.sum()}")
        fit = _least_squares(columns[used], log.power[used], called)
    units = ("W", "1", *(("W/N^2" if unit == "m" else "W/(N*m)^2") for unit in arm.robot.joint_units))
    told = (("standby_power", ""), ("mechanical_share", ""), *(("winding_loss", name) for name in names))
    spread = np.sqrt(np.diag(fit.covariance))
    parameters = tuple(
        FittedParameter(what, joint, float(fit.values[k]), float(spread[k]), units[k])
        for k, (what, joint) in enumerate(told)
        if fit.known[k]
    )
    yield _Found(parameters, fit.unknown, fit.left)


class _Fit(NamedTuple):
    """Coefficients (P,), covariance (P, P), which are known (P,), clauses about the others, and what is left (K,)."""

    values: Array
    covariance: Array
    known: Array
    unknown: tuple[str, ...]
    left: Array


def _least_squares(columns: Array, wanted: Array, names: Sequence[str]) -> _Fit:
    """Coefficients of columns (K, P) whose sum is nearest to what is wanted (K,), where they can be told apart."""
    sizes = np.linalg.norm(columns, axis=0)
    there = sizes > 1e-9 * sizes.max()
    known, scaled = there.copy(), columns[:, there] / sizes[there]
    unknown = [f"{names[k]} is not told, as nothing in this log depends on it" for k in np.flatnonzero(~there).tolist()]
    _, singular, directions = np.linalg.svd(scaled, full_matrices=False)
    for direction in directions[singular < _APART * singular.max()]:
        some = np.flatnonzero(there)[np.abs(direction) > _BELONGS]
        known[some] = False
        unknown.append(f"{' and '.join(names[k] for k in some)} cannot be told apart in this log")
    inverse = np.linalg.pinv(scaled, rcond=_APART)
    values = np.zeros(len(names))
    values[there] = inverse @ wanted / sizes[there]
    left = wanted - columns @ values
    freedom = max(len(wanted) - int(there.sum()), 1)
    variance = float(left @ left) / freedom * _widened(left)
    covariance = np.zeros((len(names), len(names)))
    covariance[np.ix_(there, there)] = variance * (inverse @ inverse.T) / np.outer(sizes[there], sizes[there])
    return _Fit(values, covariance, known, tuple(unknown), left)


def _widened(left: Array) -> float:
    """By how much the variance of coefficients is greater as what is left is alike at neighbouring instants, from 1."""
    centred = left - left.mean()
    total, power = 1.0, float(centred @ centred)
    for lag in range(1, len(left) // 10):
        share = float(centred[lag:] @ centred[:-lag]) / power if power > 0.0 else 0.0
        if share < _SIGMAS / len(left) ** 0.5:
            break
        total += 2.0 * share
    return total
