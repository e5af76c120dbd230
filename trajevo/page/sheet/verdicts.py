"""What a sheet says of a motion with its load: at rest, moving, and over the cycles of its drives."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np

from trajevo.base.shown.brief import brief
from trajevo.capacity.drives.drive_capacity import drive_load
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.verification.certificate import Certificate

#: Words of a verdict.
WITHIN, OVERLOADED, OPEN = "within limits", "overloaded", "not decided"

#: Instants per segment at which the arm is held.
_POSTURES = 100


@final
@dataclass(frozen=True)
class Axis:
    """How far one axis is used.

    Attributes:
        joint: its name.
        value: effort, torque or temperature rise [``unit``].
        limit: its limit [``unit``]; None if it has none.
        unit: SI unit.
        share: share of the limit; None if it has none.
        instant: when [s]; None for what belongs to the whole cycle.
    """

    joint: str
    value: float
    limit: float | None
    unit: str
    share: float | None
    instant: float | None

    __repr__ = brief


@final
@dataclass(frozen=True)
class Verdict:
    """One verdict of a sheet, and what it is about.

    Attributes:
        about: what is judged, a few words.
        axes: every axis.
        proven: whether the shares hold at every instant; otherwise they are those of samples.
        word: ``"within limits"``, ``"overloaded"`` or ``"not decided"``.
        binding: the axis that uses most of its limit; None if no axis has one.
    """

    about: str
    axes: tuple[Axis, ...]
    proven: bool
    word: str
    binding: Axis | None

    __repr__ = brief

    @classmethod
    def of(cls, about: str, axes: tuple[Axis, ...], *, proven: bool = False, word: str | None = None) -> Verdict:
        """A verdict by the greatest share, unless the word is given."""
        limited = [axis for axis in axes if axis.share is not None]
        worst = max(limited, key=lambda axis: axis.share or 0.0, default=None)
        said = WITHIN if worst is None or (worst.share or 0.0) <= 1.0 else OVERLOADED
        return cls(about, axes, proven, word or said, worst)

    def __str__(self) -> str:
        if self.binding is None or self.binding.share is None:
            return f"{self.word}: no axis has a limit"
        when = "" if self.binding.instant is None else f" at {self.binding.instant:.3f} s"
        return f"{self.word}: {self.binding.joint} at {100.0 * self.binding.share:.1f} % of its limit{when}"


def held(rollout: Rollout) -> Verdict:
    """Static verdict: every axis holds arm and load at rest in the worst posture of the motion.

    Args:
        rollout: the rollout of one motion.
    """
    fine = replace(rollout, dynamics=rollout.dynamics.sampled(_POSTURES))
    still = np.zeros_like(fine.q)
    effort = fine.effort_in(fine.q, still, still, fine.t)[0]
    limits = fine.limits.sides("effort")
    share = limits.share(effort)
    axes = []
    for k, (name, unit) in enumerate(zip(fine.robot.joint_names, _units(fine), strict=True)):
        limited = bool(limits.limited[k])
        worst = int((share[:, k] if limited else np.abs(effort[:, k])).argmax())
        value = float(effort[worst, k])
        limit = float((limits.forward if value >= 0.0 else limits.backward)[k])
        used = float(share[worst, k]) if limited else None
        axes.append(Axis(name, abs(value), _finite(limit), unit, used, float(fine.t[0, worst])))
    return Verdict.of("holding arm and load at rest, in the worst posture of the motion", tuple(axes))


def moving(certificate: Certificate) -> Verdict:
    """Dynamic verdict: the effort of every axis over the motion, as its certificate has it.

    Args:
        certificate: of the motion with its load.
    """
    rows = [row for row in certificate.rows if row.quantity == "effort"]
    axes = tuple(
        Axis(
            joint=str(row.joint),
            value=row.bound,
            limit=_finite(row.limit),
            unit=row.unit,
            share=row.share if np.isfinite(row.limit) else None,
            instant=None if np.isnan(row.instant) else row.instant,
        )
        for row in rows
    )
    word = OVERLOADED if any(row.violated for row in rows) else WITHIN if all(row.proven for row in rows) else OPEN
    proven = all(row.proven for row in rows)
    return Verdict.of("effort of the motion, its greatest share at any instant", axes, proven=proven, word=word)


def driven(rollout: Rollout, dwell: float, mass: float) -> tuple[Verdict, ...]:
    """Verdicts on what the drives bear over a cycle that repeats; none for a robot without drives.

    Args:
        rollout: the rollout of one motion.
        dwell: time at rest after the motion [s].
        mass: the payload's mass [kg].
    """
    if not rollout.robot.drives:
        return ()
    try:
        load = drive_load(rollout, mass=mass, dwell=dwell)
    except InvalidInputError as error:
        return (Verdict(f"drives: {error}", (), False, OPEN, None),)
    names, units = rollout.robot.joint_names, _units(rollout)
    columns: tuple[tuple[str, Any, Any, Any], ...] = (
        ("torque of the drive at its speed", load.peak_torque, load.speed_share, load.speed_time),
        ("RMS torque of the drive over the cycle", load.rms_torque, load.rms_share, None),
        ("temperature rise of the winding over the cycle", load.peak_rise, load.rise_share, load.rise_time),
    )
    found = []
    for about, values, shares, times in columns:
        kelvin = about.startswith("temperature")
        axes = tuple(
            Axis(
                joint=name,
                value=float(values[k]),
                limit=float(values[k] / shares[k]) if shares[k] > 0.0 and "speed" not in about else None,
                unit="K" if kelvin else units[k],
                share=float(shares[k]),
                instant=None if times is None or np.isnan(times[k]) else float(times[k]),
            )
            for k, name in enumerate(names)
            if np.isfinite(shares[k])
        )
        if axes:
            found.append(Verdict.of(about, axes))
    return tuple(found)


def together(verdicts: tuple[Verdict, ...]) -> str:
    """The word of several verdicts together."""
    words = {verdict.word for verdict in verdicts}
    return OVERLOADED if OVERLOADED in words else OPEN if OPEN in words else WITHIN


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _units(rollout: Rollout) -> list[str]:
    return ["N*m" if unit == "rad" else "N" for unit in rollout.robot.joint_units]
