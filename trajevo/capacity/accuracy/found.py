"""What a motion carries under all limits: records and their texts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown import html
from trajevo.base.shown.brief import brief
from trajevo.capacity.drives import found as of_drives
from trajevo.errors import checked_name

#: What limits a payload, and how a sentence tells of it.
CAUSES = of_drives.CAUSES | {
    "peak_power": "power of the supply",
    "deviation": "deviation of the tool",
    "slip": "slip of the payload",
    "tip_over": "tip-over",
}

#: What comes before the place at which a cause binds.
_BEFORE_PLACE = {"deviation": ", most of it by ", "slip": " ", "peak_power": " by ", "tip_over": " over the edge "}


@final
@dataclass(frozen=True)
class CauseLimit:
    """The payloads that one cause alone allows.

    Attributes:
        cause: a key of :data:`CAUSES`.
        least: the least payload, above 0 for a counterweight [kg]; inf if there is none.
        mass: the largest payload [kg]; inf if nothing limits it, -inf if there is none.
        place: what binds: a joint, an edge of the footprint, a direction; empty if nothing does.
        time: instant at which it binds [s]; NaN if there is none, as of an average.
    """

    cause: str
    least: float
    mass: float
    place: str
    time: float

    __repr__ = brief

    def __str__(self) -> str:
        before = _BEFORE_PLACE.get(self.cause, " of ")
        what = CAUSES[self.cause] + (before + self.place if self.place else "")
        return what if np.isnan(self.time) else f"{what} at {self.time:.4f} s"


@final
@dataclass(frozen=True, eq=False)
class FullCapacity:
    """The largest payload under all limits that are known.

    Attributes:
        mass: the largest payload [kg]; inf if nothing limits it, 0 if none is feasible.
        least: the least payload [kg], above 0 if the motion needs a counterweight; NaN if none is feasible.
        cause: what binds, a key of :data:`CAUSES`; empty if nothing does.
        place: the joint, edge or direction that binds; empty if there is none.
        time: instant at which it binds [s]; NaN if there is none, as of an average over the cycle.
        limits: what each cause that is known allows.
        deviation: greatest deviation of the tool that was asked for [m]; None if none was.
        robot: name of the robot.
        payload_model: how the payload acts.
        dwell: time at rest after each motion [s].
        cycles: number of cycles from cold on; None for ever.
        samples: instants per segment at which limits were looked at first.
        not_covered: what limits nothing because something is not known.
    """

    mass: float
    least: float
    cause: str
    place: str
    time: float
    limits: tuple[CauseLimit, ...]
    deviation: float | None
    robot: str
    payload_model: str
    dwell: float
    cycles: int | None
    samples: int
    not_covered: tuple[str, ...] = ()

    __repr__ = brief

    @property
    def feasible(self) -> bool:
        """Whether there is a payload, or none at all, with which every limit is kept."""
        return not np.isnan(self.least)

    def by(self, cause: str) -> float:
        """The largest payload that one cause alone allows [kg]; inf if it is not known.

        Raises:
            UnknownNameError: no key of :data:`CAUSES`.
        """
        checked_name("cause", cause, CAUSES)
        return min((limit.mass for limit in self.limits if limit.cause == cause), default=np.inf)

    def __str__(self) -> str:
        told = [self._text, f"looked at in {self.samples} instants per segment and around those that bind"]
        told[1] += ", not proven between them"
        return "; ".join([*told, *([f"not covered: {', '.join(self.not_covered)}"] if self.not_covered else [])])

    @property
    def _text(self) -> str:
        if not self.cause:
            return f"unlimited: nothing that is known limits a {self.payload_model} payload on this motion"
        what = str(next(limit for limit in self.limits if limit.cause == self.cause))
        if not self.feasible:
            return f"0 kg: no payload, and not even none, keeps every limit: {what}"
        carried = f"{self.least:.6f} to {self.mass:.6f}" if self.least > 0.0 else f"{self.mass:.6f}"
        return f"{carried} kg ({self.payload_model} payload), limited by {what}"

    def _repr_html_(self) -> str:
        rows = [
            (CAUSES[one.cause], _kilograms(one), one.place, "" if np.isnan(one.time) else f"{one.time:.4f}")
            for one in sorted(self.limits, key=lambda limit: limit.mass)
        ]
        table = html.table(("limit", "payload [kg]", "by", "at [s]"), rows)
        return html.shown("Largest payload under all limits", html.sentence(str(self)), table)


def _kilograms(limit: CauseLimit) -> str:
    if limit.mass < limit.least:
        return "none"
    if np.isinf(limit.mass):
        return "unlimited"
    return f"{limit.least:.6g} to {limit.mass:.6g}" if limit.least > 0.0 else f"{limit.mass:.6g}"


@final
@dataclass(frozen=True, eq=False)
class ToolDeviation:
    """How far the tool gives way on a motion because its joints do.

    Attributes:
        mass: of the payload [kg].
        greatest: greatest deviation of the tool's origin [m].
        time: when that is [s].
        deviation: the tool's displacement then, in the base frame, shape (3,) [m].
        by_joint: what every joint moves the tool then along the displacement; they sum up to it, shape (n_joints,) [m].
        axes: greatest magnitudes of the displacement along the axes of the base frame, shape (3,) [m].
        times: instants looked at, shape (K,) [s].
        along: deviation at them, shape (K,) [m].
        counted: which torques count, all or those of the payload alone.
        joint_names: names of the joints.
        rigid: joints whose stiffness is not known, which count as rigid.
    """

    mass: float
    greatest: float
    time: float
    deviation: Array
    by_joint: Array
    axes: Array
    times: Array
    along: Array
    counted: str
    joint_names: tuple[str, ...]
    rigid: tuple[str, ...] = ()

    __repr__ = brief

    def __str__(self) -> str:
        by = "the payload alone" if self.counted == "payload" else "all loads"
        most = self.joint_names[int(self.by_joint.argmax())]
        told = (
            f"{1e3 * self.greatest:.4g} mm with {self.mass:g} kg, by {by}, at {self.time:.4f} s, most of it by {most} "
            f"({1e3 * self.by_joint.max():.4g} mm)"
        )
        return told + (f"; not covered: {', '.join(self.rigid)} without stiffness" if self.rigid else "")

    def _repr_html_(self) -> str:
        rows = [(name, f"{1e3 * by:.4g}") for name, by in zip(self.joint_names, self.by_joint, strict=True)]
        table = html.table(("joint", "moves the tool [mm]"), rows)
        return html.shown("Deviation of the tool", html.sentence(str(self)), table)
