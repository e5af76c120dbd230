"""How a motion is played: the controller, what it measures, how late it acts, and what it believes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, numbers, real_number
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError, checked_name

#: Controllers by name, and how a sentence tells of them.
CONTROLLERS = {
    "computed_torque": "computed torque",
    "pd": "PD with gravity and viscous friction compensated",
}

#: Greatest integration step that is chosen, with dry friction and without [s].
LONGEST_DRY, LONGEST = 2.5e-4, 1e-3

#: Least and greatest sampling rate [Hz], and greatest number of integration steps in a period.
_RATES, _MOST_STEPS = (1.0, 1e5), 10_000

#: Share of a step by which a delay may differ from whole steps.
_WHOLE = 1e-6


@final
@dataclass(frozen=True, kw_only=True)
class TwinSettings:
    """How motions are played; numbers of joints are one for all joints, or one for each.

    Attributes:
        controller: a key of :data:`CONTROLLERS`.
        rate: how often the controller measures and acts [Hz]; in between, efforts are held.
        natural_frequency: of the error's decay, of every joint [rad/s]; its square is the gain of position errors.
        damping_ratio: of that decay [1]; twice this times the natural frequency is the gain of velocity errors [1/s].
        resolution: step of the encoders [rad or m], 0 for none.
        noise: standard deviation of the measured positions [rad or m].
        delay: from measuring to acting [s], in whole integration steps.
        payload_error: how much more payload the controller believes in than is carried, as a share of its mass [1].
        seed: seed of the noise, which is the same for every motion.
        tolerance: distance of the tool from where the motion ends within which it is settled [m].
        settle: how long it is watched after the end of the motion [s].
        step: integration step [s]; the longest that is not above 1 ms, or 0.25 ms with dry friction, if None. It is
            made shorter so that whole steps fill a period.

    Raises:
        UnknownNameError: no such controller.
        InvalidInputError: a number that is not in its range.
    """

    controller: str = "computed_torque"
    rate: float = 1000.0
    natural_frequency: Any = 50.0
    damping_ratio: Any = 1.0
    resolution: Any = 0.0
    noise: Any = 0.0
    delay: float = 0.0
    payload_error: float = 0.0
    seed: int = 1
    tolerance: float = 1e-3
    settle: float = 1.0
    step: float | None = None

    __repr__ = brief

    def __post_init__(self) -> None:
        checked_name("controller", self.controller, CONTROLLERS)
        for name, least, most, what in (
            ("rate", *_RATES, f"a rate from {_RATES[0]:g} to {_RATES[1]:g} Hz"),
            ("delay", 0.0, 10.0, "a time from 0 to 10 s"),
            ("payload_error", -1.0, 10.0, "a share from -1 to 10"),
            ("tolerance", 1e-12, 1e3, "a distance from 1e-12 to 1000 m"),
            ("settle", 0.0, 1e3, "a time from 0 to 1000 s"),
        ):
            object.__setattr__(self, name, _between(name, getattr(self, name), least, most, what))
        for name, zero in (
            ("natural_frequency", False),
            ("damping_ratio", True),
            ("resolution", True),
            ("noise", True),
        ):
            object.__setattr__(self, name, _amounts(name, getattr(self, name), zero=zero))
        if isinstance(self.seed, bool) or not isinstance(self.seed, int | np.integer) or self.seed < 0:
            raise InvalidInputError(f"seed: expected a whole number from 0 on, got {self.seed!r}")
        if self.step is not None:
            period = 1.0 / self.rate
            what = f"a time above {period / _MOST_STEPS:.3g} s, up to a period of {period:.3g} s"
            object.__setattr__(self, "step", _between("step", self.step, period / _MOST_STEPS, period, what))

    @property
    def period(self) -> float:
        """Time from one sample of the controller to the next [s]."""
        return 1.0 / self.rate

    def steps(self, *, dry: bool) -> int:
        """Number of integration steps in a period, with dry friction or without."""
        longest = self.step if self.step is not None else LONGEST_DRY if dry else LONGEST
        return max(math.ceil(self.period / longest * (1.0 - _WHOLE)), 1)

    def delay_steps(self, *, dry: bool) -> int:
        """The delay in whole integration steps.

        Raises:
            InvalidInputError: it is no whole number of them.
        """
        step = self.period / self.steps(dry=dry)
        found = round(self.delay / step)
        if abs(self.delay - found * step) > _WHOLE * step:
            raise InvalidInputError(
                f"delay: expected whole integration steps of {step:.6g} s, got {self.delay:g} s; give a shorter step"
            )
        return found

    def of_joints(self, name: str, count: int) -> Array:
        """A number of every joint, shape (n_joints,) [SI].

        Raises:
            InvalidInputError: there are numbers for another number of joints.
        """
        given = getattr(self, name)
        if isinstance(given, tuple) and len(given) != count:
            raise InvalidInputError(f"{name}: expected one number or {count}, one for each joint, got {len(given)}")
        return np.broadcast_to(np.asarray(given, dtype=np.float64), (count,))

    def __str__(self) -> str:
        told = [f"{CONTROLLERS[self.controller]} at {self.rate:g} Hz"]
        told += [f"delay {1e3 * self.delay:g} ms"] if self.delay else []
        told += [f"payload believed {100.0 * self.payload_error:+g} %"] if self.payload_error else []
        told += ["measured with noise"] if np.any(self.noise) else []
        told += ["encoders with steps"] if np.any(self.resolution) else []
        return ", ".join(told)


def _between(name: str, given: Any, least: float, most: float, what: str) -> float:
    number = real_number(given)
    if number is None or not least <= number <= most:
        raise InvalidInputError(f"{name}: expected {what}, got {given!r}")
    return number


def _amounts(name: str, given: Any, *, zero: bool) -> float | tuple[float, ...]:
    """One number, or one for each joint, that is positive or may be 0."""
    kind = "from 0 on" if zero else "above 0"
    array = numbers(given, name=name, shape=() if np.ndim(given) == 0 else ("n_joints",))
    if not ((array >= 0.0) if zero else (array > 0.0)).all():
        raise InvalidInputError(f"{name}: expected numbers {kind}, got {array.tolist()}")
    return float(array) if array.ndim == 0 else tuple(array.tolist())
