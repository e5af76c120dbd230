"""What drives let a motion carry, and what it asks of them: records and their texts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief

#: What limits a payload, and how a sentence tells of it.
CAUSES = {
    "effort": "effort limit",
    "peak_torque": "peak torque",
    "torque_at_speed": "torque at speed",
    "rms_torque": "RMS torque over the cycle",
    "temperature": "temperature of the winding",
}


@final
@dataclass(frozen=True, eq=False)
class DriveLimit:
    """The masses that one cause leaves, by every joint alone.

    Attributes:
        cause: a key of :data:`CAUSES`.
        least: least payload, above 0 for a counterweight, shape (n_joints,) [kg]; inf if there is none.
        mass: largest payload, shape (n_joints,) [kg]; inf if nothing limits it, -inf if there is none.
        time: instants that bind, shape (n_joints,) [s]; NaN if there are none, as of an average.
        known: whether the limit of each joint is known, shape (n_joints,) [1].
    """

    cause: str
    least: Array
    mass: Array
    time: Array
    known: Array

    __repr__ = brief


@final
@dataclass(frozen=True, eq=False)
class DriveCapacity:
    """The largest payload that drives allow on a motion that repeats.

    Attributes:
        mass: the largest payload [kg]; inf if nothing limits it, 0 if none is feasible.
        least: the least payload [kg], above 0 if the motion needs a counterweight; NaN if none is feasible.
        cause: what binds, a key of :data:`CAUSES`; empty if nothing does.
        joint: name of the joint that binds; empty if none does.
        time: instant at which it binds [s]; NaN if there is none, as of an average over the cycle.
        limits: the masses that each cause leaves.
        joint_names: names of the robot's joints.
        robot: name of the robot.
        payload_model: how the payload acts.
        dwell: time at rest after each motion [s].
        cycles: number of cycles from cold on; None for ever.
        samples: instants per segment at which limits were looked at first.
        not_known: what limits nothing because something of a drive is not known.
    """

    mass: float
    least: float
    cause: str
    joint: str
    time: float
    limits: tuple[DriveLimit, ...]
    joint_names: tuple[str, ...]
    robot: str
    payload_model: str
    dwell: float
    cycles: int | None
    samples: int
    not_known: tuple[str, ...] = ()

    __repr__ = brief

    @classmethod
    def of(cls, limits: tuple[DriveLimit, ...], *, joint_names: tuple[str, ...], **told: Any) -> DriveCapacity:
        """The capacity by all causes together; the other arguments are fields."""
        most, least = (np.stack([getattr(limit, name) for limit in limits]) for name in ("mass", "least"))
        row, joint = (int(i) for i in np.unravel_index(most.argmin(), most.shape))
        possible = bool(least.max() <= most.min())
        bound = most[row, joint] < np.inf
        if not possible and np.isposinf(least).any():
            row, joint = (int(i) for i in np.unravel_index(least.argmax(), least.shape))
        return cls(
            mass=float(most.min()) if possible else 0.0,
            least=float(least.max()) if possible else np.nan,
            cause=limits[row].cause if bound else "",
            joint=joint_names[joint] if bound else "",
            time=float(limits[row].time[joint]) if bound else np.nan,
            limits=limits,
            joint_names=joint_names,
            **told,
        )

    @property
    def feasible(self) -> bool:
        """Whether there is a payload, or none at all, with which every limit is kept."""
        return not np.isnan(self.least)

    def by(self, cause: str) -> float:
        """The largest payload that one cause alone allows [kg]."""
        return float(min((limit.mass.min() for limit in self.limits if limit.cause == cause), default=np.inf))

    def __str__(self) -> str:
        return "; ".join([self._text, *(f"not covered: {what}" for what in self.not_known)])

    @property
    def _text(self) -> str:
        looked = f"looked at in {self.samples} instants per segment and around those that bind, not proven between them"
        if not self.cause:
            return f"unlimited: no drive limits a {self.payload_model} payload on this motion; {looked}"
        at = "" if np.isnan(self.time) else f" at {self.time:.4f} s"
        what = f"{CAUSES[self.cause]} of {self.joint}{at}"
        if not self.feasible:
            return f"0 kg: no payload, and not even none, keeps every limit: {what}; {looked}"
        carried = f"{self.least:.6f} to {self.mass:.6f}" if self.least > 0.0 else f"{self.mass:.6f}"
        often = "for ever" if self.cycles is None else f"{self.cycles} times from cold"
        rest = f", {self.dwell:g} s at rest after each" if self.dwell else ""
        return f"{carried} kg ({self.payload_model} payload), limited by {what}; made {often}{rest}; {looked}"


@final
@dataclass(frozen=True, eq=False)
class DriveLoad:
    """What a motion that repeats asks of every drive with one payload; NaN where the drive does not tell enough.

    Torques are those of the motors times the gear ratio. All arrays have the shape (n_joints,).

    Attributes:
        mass: of the payload [kg].
        peak_torque: greatest magnitude [N·m or N].
        peak_share: the same as a share of the peak torque of the drive.
        speed_share: greatest share of the torque at speed; inf where the motor cannot turn so fast.
        speed_time: when that is [s].
        rms_torque: root of the mean square over a cycle, the time at rest included [N·m or N].
        rms_share: the same as a share of the continuous torque.
        mean_rise: average temperature of the winding above its surroundings in a steady state [K]; NaN for a number of
            cycles.
        peak_rise: greatest temperature of the winding above its surroundings in the last cycle [K].
        rise_share: the same as a share of the greatest one allowed.
        rise_time: when that is, from the begin of the cycle on [s].
        joint_names: names of the joints.
        dwell: time at rest after each motion [s].
        cycles: number of cycles from cold on; None for ever.
    """

    mass: float
    peak_torque: Array
    peak_share: Array
    speed_share: Array
    speed_time: Array
    rms_torque: Array
    rms_share: Array
    mean_rise: Array
    peak_rise: Array
    rise_share: Array
    rise_time: Array
    joint_names: tuple[str, ...]
    dwell: float
    cycles: int | None

    __repr__ = brief
