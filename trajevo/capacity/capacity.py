"""The largest payload of a motion, or of several, and what it is known from: records and their texts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil, floor, isfinite, log10
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.capacity.notebook import capacities_html, capacity_html
from trajevo.robot.joints import Sides

#: How a capacity was found.
GUARANTEED, SAMPLED, ITERATED = "guaranteed", "sampled", "iterated"

#: Excess over a limit, as a share of it, that counts as rounding.
_ROUNDING = 1e-12

#: Digits of masses that are printed rounded to the safe side.
_DIGITS = 6


@final
@dataclass(frozen=True, eq=False)
class Capacity:
    """The largest payload of a motion.

    Effort limits are those that the motion's problem keeps: with a margin of 20 %, 80 % of the robot's.

    Attributes:
        mass: the largest payload [kg]; inf if no effort limit is ever reached, 0 if one is reached without any payload
            or no payload is feasible. If guaranteed, the motion is proven to keep every limit at every instant.
        joint: name of the binding joint, empty if there is none.
        time: instant at which it binds [s], NaN if there is none.
        margin: unused share of each joint's effort limit at ``mass``, at ``times``, shape (n_joints,); negative for
            joints over their limit if no payload is feasible.
        per_joint: largest payload that each joint alone allows at ``times``, shape (n_joints,) [kg].
        payload_model: how the payload acts, a key of :data:`trajevo.robot.payload.LOAD_MODELS`.
        least: the least payload [kg]; above 0 if the motion keeps the limits only with a payload as counterweight, NaN
            if no payload, not even 0, is feasible. If guaranteed, no limit is broken from ``least`` to ``mass``.
        lower: any lighter payload breaks a limit [kg].
        upper: any heavier payload breaks a limit [kg]; if guaranteed, the gap from ``mass`` is within the tolerance.
        times: instants at which effort was computed, shape (T,) [s].
        margins: unused share of each joint's effort limit over time, shape (T, n_joints), at ``mass`` or, if nothing
            limits the mass, at ``least``.
        joint_names: names of the robot's joints.
        method: ``"guaranteed"``, or ``"sampled"`` or ``"iterated"``, which look at ``samples`` instants alone.
        samples: instants per segment, both ends included.
        kept: share of the robot's effort limits that the motion's problem keeps.
        at_full_limit: ``mass`` at the robot's full effort limits [kg]; None if ``kept`` is 1.
        history: for the iteration, every (mass [kg], greatest effort over limit, joint) tried; the last is infeasible.
    """

    mass: float
    joint: str
    time: float
    margin: Array
    per_joint: Array
    payload_model: str
    least: float
    lower: float
    upper: float
    times: Array
    margins: Array
    joint_names: tuple[str, ...]
    method: str
    samples: int
    kept: float = 1.0
    at_full_limit: float | None = None
    history: tuple[tuple[float, float, str], ...] = ()

    __repr__ = brief

    def _repr_html_(self) -> str:
        return capacity_html(self)

    @property
    def feasible(self) -> bool:
        """Whether the motion keeps every effort limit at ``mass``: proven, or at the samples, see ``method``."""
        return bool(self.margin.min() >= -_ROUNDING) and not np.isnan(self.least)

    def __str__(self) -> str:
        if self.at_full_limit is None:
            return self._text
        return told_both(self._text, f"{self._down(self.at_full_limit)} kg", 1.0 - self.kept)

    @property
    def _text(self) -> str:
        model, counterweight = self.payload_model, self.least > 0.0
        if not self.joint:
            return f"unlimited: no joint has an effort limit that a {model} payload reaches on this motion" + (
                f"; at least {self._up(self.least)} kg, without which one is broken" if counterweight else ""
            )
        if len(self.history) == 1 and (self.history[0][0] > 0.0 or counterweight):
            tried = self.history[0][0]
            advice = f"start at {self.least:.6g} kg" if tried < self.least else "start lower"
            return f"the first payload tried, {tried:g} kg, already breaks the limit of {self.joint}; {advice}"
        if not self.feasible:
            return self._infeasible
        carried = f"{self._up(self.least)} to {self._down(self.mass)}" if counterweight else self._down(self.mass)
        told = f"{carried} kg ({model} payload), limited by {self.joint} at {self.time:.4f} s"
        if self.method == GUARANTEED:
            return f"{told}; {known(None)}; more than {self._up(self.upper)} kg is too much"
        return f"{told}; {known(self.samples)}"

    @property
    def _infeasible(self) -> str:
        if self.lower <= self.upper:
            return (
                f"0 kg: no payload is proven to keep the limits at every instant, although {self._up(self.lower)} to "
                f"{self._down(self.upper)} kg ({self.payload_model} payload) keeps them at the samples"
            )
        limit = "its effort limit" if self.at_full_limit is None else f"its effort limit less {margin_of(self.kept)}"
        return (
            f"0 kg: even without payload {self.joint} exceeds {limit} by "
            f"{-100.0 * self.margin.min():.3g} %, at {self.time:.4f} s"
        )

    def _down(self, mass: float) -> str:
        return rounded(mass, floor) if self.method == GUARANTEED else f"{mass:.6f}"

    def _up(self, mass: float) -> str:
        return rounded(mass, ceil) if self.method == GUARANTEED else f"{mass:.6f}"


def known(samples: int | None) -> str:
    """Text that says at which instants something holds: at samples, or None for every instant."""
    return "guaranteed at every instant" if samples is None else f"at {samples} instants per segment, not between them"


def margin_of(kept: float) -> str:
    """Text for the share of the limits that a problem does not use, such as "20 %"."""
    return f"{100.0 * (1.0 - kept):.4g} %"


def told_both(kept: str, full: str, margin: float) -> str:
    """A result within the limits that a problem keeps, and that at the robot's full limits, in one sentence.

    Args:
        kept: the former.
        full: the latter.
        margin: share of the effort limits that is kept free; 0 if the margins are of other limits.
    """
    return f"with {your_margin(margin)}: {kept}; at the robot's full limits: {full}"


def your_margin(margin: float) -> str:
    """Text for the share of the effort limits that a problem keeps free; 0 if its margins are of other limits."""
    return f"your margin of {100.0 * margin:.4g} %" if margin else "your margins"


def rounded(mass: float, side: Callable[[float], int]) -> str:
    """A mass [kg] with six digits that ``floor`` or ``ceil`` rounds to one side, so that a bound stays one."""
    if not (isfinite(mass) and mass > 0.0):
        return f"{mass:g}"
    places = _DIGITS - 1 - floor(log10(mass))
    return f"{side(mass * 10.0**places) / 10.0**places:.{max(places, 0)}f}"


@final
@dataclass(frozen=True, eq=False)
class Capacities:
    """The largest payloads of B motions, guaranteed at every instant as those of :func:`dlcc`.

    Attributes:
        mass: as :attr:`Capacity.mass`, shape (B,) [kg].
        least: as :attr:`Capacity.least`, shape (B,) [kg].
        upper: as :attr:`Capacity.upper`, shape (B,) [kg].
        duration: durations of the motions, shape (B,) [s].
        joint: index of the binding joint, -1 if there is none, shape (B,).
        joint_names: names of the robot's joints.
        payload_model: how the payload acts.
        kept: as :attr:`Capacity.kept`.
        at_full_limit: as :attr:`Capacity.at_full_limit`, shape (B,) [kg]; None if ``kept`` is 1.
    """

    mass: Array
    least: Array
    upper: Array
    duration: Array
    joint: Array
    joint_names: tuple[str, ...]
    payload_model: str
    kept: float = 1.0
    at_full_limit: Array | None = None

    __repr__ = brief

    def _repr_html_(self) -> str:
        return capacities_html(self)


@final
@dataclass(frozen=True, eq=False)
class EffortAlong:
    """Effort along one motion as an affine function of the payload's mass, and the motion's guaranteed capacity.

    Attributes:
        times: instants, shape (T,) [s].
        unloaded: effort without payload, shape (T, n_joints) [N·m or N].
        per_kilogram: effort that every kilogram of the payload adds, shape (T, n_joints) [N·m/kg or N/kg].
        limit: effort limits that the motion's problem keeps, shape (n_joints,) [N·m or N]; inf for none.
        limit_backward: those of negative efforts, the same shape [N·m or N]; None if they are the same.
        mass: mass of the payload that is carried [kg].
        capacity: the largest payload; its ``times`` are those above.
        joint_names: names of the robot's joints.
        robot: name of the robot.
    """

    times: Array
    unloaded: Array
    per_kilogram: Array
    limit: Array
    mass: float
    capacity: Capacity
    joint_names: tuple[str, ...]
    robot: str
    limit_backward: Array | None = None

    __repr__ = brief

    @property
    def sides(self) -> Sides:
        """The limits in both directions."""
        return Sides(self.limit, self.limit if self.limit_backward is None else self.limit_backward)
