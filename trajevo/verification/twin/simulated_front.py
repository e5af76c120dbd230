"""What comes of a whole front in closed loop, and which of its solutions are still worth taking."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, final

import moocore
import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.base.shown import html
from trajevo.base.shown.brief import brief
from trajevo.errors import NoSolutionError, UnknownNameError
from trajevo.formulation.objectives import OBJECTIVES, total_time
from trajevo.front import selection
from trajevo.front.front import Front, Solution
from trajevo.verification.twin.settings import TwinSettings


@final
@dataclass(frozen=True, eq=False)
class SimulatedFront:
    """A front as it was played in closed loop; arrays have one row for each of the N solutions that were played.

    Attributes:
        front: the front.
        rows: rows of the front that were played, ascending, shape (N,).
        settings: controller, sensors, delay and payload.
        settling: time after the end of the motion from which on the tool stays within the tolerance, shape (N,) [s];
            inf if it does not.
        energy: ∫ Σ |effort x velocity| dt until it is settled, shape (N,) [J].
        greatest_tool_error: greatest distance of the tool from where it should be, shape (N,) [m].
        rms_tool_error: root of its mean square, shape (N,) [m].
        greatest_error: greatest |error| of every joint, shape (N, n_joints) [rad or m].
        rms_error: root of the mean square of the error of every joint, shape (N, n_joints) [rad or m].
        used: greatest share of its effort limit that every joint takes, shape (N, n_joints) [1].
        saturation: share of the samples at which some joint was asked for more than its limit, shape (N,) [1].
        integration_step: step of MuJoCo's integrator [s].
    """

    front: Front
    rows: Array
    settings: TwinSettings
    settling: Array
    energy: Array
    greatest_tool_error: Array
    rms_tool_error: Array
    greatest_error: Array
    rms_error: Array
    used: Array
    saturation: Array
    integration_step: float

    __repr__ = brief

    def __len__(self) -> int:
        return len(self.settling)

    @cached_property
    def F(self) -> Array:
        """Objectives as they are achieved, shape (N, n_obj), SI, units of the front's; inf where nothing settles.

        Time is that until the tool is settled, and energy what was spent until then; others are as planned.
        """
        achieved = self.front.F[self.rows]
        for k, objective in enumerate(self.front.problem.objectives):
            if objective.function is total_time:
                achieved[:, k] += self.settling
            elif objective.function is OBJECTIVES["energy"].function:
                achieved[:, k] = self.energy
        achieved[~np.isfinite(self.settling)] = np.inf
        return frozen(achieved)

    @property
    def replaced(self) -> tuple[str, ...]:
        """Objectives that are those of the twin; the others are as planned."""
        own = (total_time, OBJECTIVES["energy"].function)
        return tuple(one.name for one in self.front.problem.objectives if one.function in own)

    @cached_property
    def stands(self) -> Array:
        """Which solutions settle and are dominated by no other in what is achieved, shape (N,)."""
        stands = np.isfinite(self.settling)
        if stands.any():
            stands[stands] = moocore.is_nondominated(self.F[stands])
        return frozen(stands)

    def pick(self, rule: str | int) -> Solution:
        """A solution of the front by what is achieved: ``knee``, ``utopia``, ``least_<objective>``, or a row.

        Rules choose among the solutions that stand, see :attr:`stands`.

        Raises:
            UnknownNameError: no such rule.
            NoSolutionError: no solution settles.
        """
        if str(rule).isdecimal():
            return self.front.pick(rule)
        stand, names = np.flatnonzero(self.stands), self.front.objective_names
        if not len(stand):
            raise NoSolutionError(f"no solution is within {1e3 * self.settings.tolerance:g} mm of its end in time")
        rules: dict[str, Callable[[Any], selection.Choice]] = {
            "knee": selection.knee,
            "utopia": selection.nearest_to_utopia,
        }
        for k, name in enumerate(names):
            rules[f"least_{name}"] = partial(selection.least, objective=k, name=name)
        if rule not in rules:
            raise UnknownNameError("solution", rule, [*rules, f"a row from 0 to {len(self.front) - 1}"])
        choice = rules[str(rule)](self.F[stand])
        picked = self.front.pick(int(self.rows[stand[choice.index]]))
        return Solution(self.front, picked.index, choice.rule, f"{choice.reason}, of what is achieved in closed loop")

    def __str__(self) -> str:
        settled = np.isfinite(self.settling)
        told = f"{len(self)} solutions, {self.settings}: {int(settled.sum())} settle within "
        told += f"{1e3 * self.settings.tolerance:g} mm"
        if not settled.any():
            return (
                f"{told}; the tool is at most {1e3 * np.min(self.greatest_tool_error):.4g} mm off in the best of them"
            )
        times = self.settling[settled]
        told += (
            f" in {times.min():.4g} to {times.max():.4g} s after their ends; {int(self.stands.sum())} stay undominated"
        )
        planned = int(self.rows[selection.knee(self.front.F[self.rows]).index])
        knees = planned, self.pick("knee").index
        moved = f"the knee moves from row {knees[0]} to row {knees[1]}"
        return f"{told}; {moved if knees[0] != knees[1] else f'the knee stays row {knees[0]}'}"

    def _repr_html_(self) -> str:
        stand = np.flatnonzero(self.stands)
        rows = [
            (
                str(self.rows[row]),
                *(f"{value:.5g}" for value in self.F[row]),
                f"{self.settling[row]:.4g}",
                f"{1e3 * self.greatest_tool_error[row]:.4g}",
                f"{100.0 * self.used[row].max():.4g}",
            )
            for row in stand
        ]
        objectives = (f"{one.name} [{one.unit}]" for one in self.front.record.objectives)
        headers = ("row", *objectives, "settling [s]", "tool off [mm]", "effort limit used [%]")
        return html.shown("Front in closed loop", html.sentence(str(self)), html.table(headers, rows))
