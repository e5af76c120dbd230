"""What comes of one motion in closed loop: how far it is from its reference, what it takes, and when it settles."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import final

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.base.shown import html
from trajevo.base.shown.brief import brief
from trajevo.base.units import pretty
from trajevo.robot.robot import Robot
from trajevo.verification.twin.settings import TwinSettings


@final
@dataclass(frozen=True, eq=False)
class Simulation:
    """One motion as it was played in closed loop, at the samples of the controller.

    Attributes:
        robot: the robot.
        settings: controller, sensors, delay and payload.
        duration: planned duration of the motion [s].
        t: instants of the K samples, from 0 until it was no longer watched, shape (K,) [s].
        reference: positions that were asked for, shape (K, n_joints) [rad or m].
        q: positions, the same shape [rad or m]; infinite from where the loop ran away.
        effort: efforts on the joints, averaged over the period that begins, the same shape [N·m or N].
        saturated: whether a joint was asked for more than its effort limit, the same shape.
        tool_error: distance of the tool from where it should be, shape (K,) [m].
        integration_step: step of MuJoCo's integrator [s].
    """

    robot: Robot
    settings: TwinSettings
    duration: float
    t: Array
    reference: Array
    q: Array
    effort: Array
    saturated: Array
    tool_error: Array
    integration_step: float

    __repr__ = brief

    @property
    def error(self) -> Array:
        """Reference less position, shape (K, n_joints) [rad or m]."""
        return frozen(self.reference - self.q)

    @cached_property
    def _moving(self) -> Array:
        """Samples of the motion itself, shape (K,)."""
        moving: Array = self.t <= self.duration
        return moving

    @cached_property
    def stable(self) -> bool:
        """Whether the loop did not run away."""
        return bool(np.isfinite(self.q).all())

    @cached_property
    def greatest_error(self) -> Array:
        """Greatest |error| of every joint during the motion, shape (n_joints,) [rad or m]."""
        return frozen(np.abs(self.error[self._moving]).max(axis=0))

    @cached_property
    def rms_error(self) -> Array:
        """Root of the mean square of the error of every joint during the motion, shape (n_joints,) [rad or m]."""
        return frozen(np.sqrt((self.error[self._moving] ** 2).mean(axis=0)))

    @cached_property
    def mean_error(self) -> Array:
        """Mean |error| of every joint during the motion, shape (n_joints,) [rad or m]."""
        return frozen(np.abs(self.error[self._moving]).mean(axis=0))

    @cached_property
    def greatest_tool_error(self) -> float:
        """Greatest distance of the tool from where it should be, during the motion [m]."""
        return float(self.tool_error[self._moving].max())

    @cached_property
    def rms_tool_error(self) -> float:
        """Root of the mean square of that distance during the motion [m]."""
        return float(np.sqrt((self.tool_error[self._moving] ** 2).mean()))

    @cached_property
    def rest_error(self) -> float:
        """Distance of the tool from where the motion ends, when it was last watched [m]."""
        return float(self.tool_error[-1])

    @cached_property
    def settling(self) -> float:
        """Time after the end of the motion from which on the tool stays within the tolerance [s]; inf if it does not.

        It is that of a sample of the controller, 0 if the tool is within the tolerance from the end on.
        """
        outside = np.flatnonzero((self.t >= self.duration) & ~(self.tool_error <= self.settings.tolerance))
        if not len(outside):
            return 0.0 if self.stable and self.tool_error[-1] <= self.settings.tolerance else np.inf
        last = int(outside[-1]) + 1
        return float(self.t[last] - self.duration) if last < len(self.t) and self.stable else np.inf

    @property
    def time(self) -> float:
        """Duration and settling together [s]; inf if it does not settle."""
        return self.duration + self.settling

    @cached_property
    def energy(self) -> float:
        """∫ Σ over joints of |effort x velocity| dt until it is settled, or to the end of the motion [J].

        Efforts are held over a period, so that it is |effort x way| there, unless a joint turns round within.
        """
        if not self.stable:
            return np.inf
        until = self.time if np.isfinite(self.settling) else self.duration
        count = int(np.searchsorted(self.t, until * (1.0 - 1e-12)))
        work = np.abs(self.effort[:count] * np.diff(self.q[: count + 1], axis=0))
        return float(work.sum())

    @cached_property
    def used(self) -> Array:
        """Greatest share of the effort limit in its direction that every joint takes, shape (n_joints,) [1]."""
        sides = self.robot.limits.sides("effort")
        shares = np.maximum(self.effort / sides.forward, -self.effort / sides.backward)
        return frozen(np.where(sides.limited, np.nanmax(shares, axis=0), 0.0))

    @cached_property
    def saturation(self) -> float:
        """Share of the samples of the motion at which some joint was asked for more than its effort limit [1]."""
        return float(self.saturated[self._moving].any(axis=1).mean())

    def __str__(self) -> str:
        if not self.stable:
            gone = float(self.t[~np.isfinite(self.q).all(axis=1)][0])
            return f"{self.robot.name}, {self.settings}: unstable, the loop runs away at {gone:.4g} s"
        worst, most = int(self._shares_of_travel.argmax()), int(self.used.argmax())
        unit = pretty(self.robot.joint_units[worst])
        told = [
            f"tool at most {1e3 * self.greatest_tool_error:.4g} mm off (RMS {1e3 * self.rms_tool_error:.4g} mm)",
            f"joints at most {self.greatest_error[worst]:.3g} {unit} ({self.robot.joint_names[worst]})",
        ]
        if self.used[most] > 0.0:
            told.append(f"{100.0 * self.used[most]:.4g} % of an effort limit ({self.robot.joint_names[most]})")
        if self.saturation:
            told.append(f"saturated at {100.0 * self.saturation:.3g} % of the samples")
        return f"{self.robot.name}, {self.settings}: {', '.join(told)}; {self._settled}"

    @property
    def _shares_of_travel(self) -> Array:
        """Greatest errors, as shares of the range of each joint that the motion takes where units differ."""
        if len(set(self.robot.joint_units)) == 1:
            return self.greatest_error
        travel = np.ptp(self.reference, axis=0)
        return self.greatest_error / np.where(travel > 0.0, travel, 1.0)

    @property
    def _settled(self) -> str:
        within, end = f"within {1e3 * self.settings.tolerance:g} mm", f"the end of {self.duration:.4f} s"
        if np.isfinite(self.settling):
            return f"{within} {self.settling:.4f} s after {end}" if self.settling else f"{within} from {end} on"
        return (
            f"not {within} in the {self.settings.settle:g} s after {end}, when it is {1e3 * self.rest_error:.4g} mm off"
        )

    def _repr_html_(self) -> str:
        rows = [
            (
                name,
                f"{self.greatest_error[k]:.3g} {pretty(self.robot.joint_units[k])}",
                f"{self.rms_error[k]:.3g} {pretty(self.robot.joint_units[k])}",
                f"{100.0 * self.used[k]:.4g}" if self.used[k] else "–",
                html.line(self.error[:, k], f"tracking error of {name} over time") if self.stable else html.Piece(""),
            )
            for k, name in enumerate(self.robot.joint_names)
        ]
        headers = ("joint", "greatest error", "RMS error", "effort limit used [%]", f"error over {self.t[-1]:.4g} s")
        return html.shown("Motion in closed loop", html.sentence(str(self)), html.table(headers, rows))
