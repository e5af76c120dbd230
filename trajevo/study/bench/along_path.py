"""Motions along a fixed path as solvers of other kinds find them: speeds at stations of the path, and between them."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.path.curve import GeometricPath
from trajevo.robot.robot import Robot
from trajevo.study.bench.adapters.adapter import BenchRival
from trajevo.study.bench.contest import Contest

#: Places at which profiles are looked at, both ends included.
PLACES = 50_001

#: Stations at which other solvers keep the limits.
STATIONS = 1_001


@dataclass(frozen=True, eq=False)
class PathProfile:
    """A motion along a path u in [0, 1]: its time, and the speed along the path at many places.

    Attributes:
        duration: time of the motion [s].
        u: places, shape (N,).
        rates: u', u'' and u''' there, each shape (N,) [1/s, 1/s², 1/s³].
    """

    duration: float
    u: Array
    rates: tuple[Array, Array, Array]

    __repr__ = brief

    @classmethod
    def of(cls, trajectory: Any) -> PathProfile:
        """That of a trajectory of one of trajevo's problems along a path, by its own course u(t)."""
        t, duration = np.linspace(0.0, 1.0, PLACES)[None], float(trajectory.duration[0])
        u, speed, bend, turn = (trajectory.course.parameter(t, order)[0] / duration**order for order in range(4))
        return cls(duration, u, (speed, bend, turn))

    @classmethod
    def linear_square(cls, duration: float, stations: Array, squared: Array) -> PathProfile:
        """Between stations u'² is linear in u, as solvers of second order have it."""
        u = np.linspace(0.0, 1.0, PLACES)
        at = np.clip(np.searchsorted(stations, u, side="right") - 1, 0, len(stations) - 2)
        rate = np.diff(squared)[at] / np.diff(stations)[at]
        speed = np.sqrt(np.maximum(squared[at] + rate * (u - stations[at]), 0.0))
        return cls(duration, u, (speed, 0.5 * rate, np.zeros(PLACES)))

    @classmethod
    def linear_bend(cls, duration: float, stations: Array, squared: Array, bends: Array) -> PathProfile:
        """Between stations u'' is linear in u, and u'² quadratic; the outermost intervals, at rest, are left out."""
        u = np.linspace(stations[1], stations[-2], PLACES)
        at = np.clip(np.searchsorted(stations, u, side="right") - 1, 1, len(stations) - 3)
        rate = np.diff(bends)[at] / np.diff(stations)[at]
        past = u - stations[at]
        speed = np.sqrt(np.maximum(squared[at] + 2.0 * bends[at] * past + rate * past**2, 0.0))
        return cls(duration, u, (speed, bends[at] + rate * past, rate * speed))

    def excess(self, robot: Robot, path: GeometricPath) -> float:
        """Greatest excess over a limit of velocity, acceleration or jerk, as a share; negative if all are kept."""
        v, a, j = (part[:, None] for part in self.rates)
        s1, s2, s3 = (path(np.clip(self.u, 0.0, 1.0), order) for order in (1, 2, 3))
        values = (s1 * v, s2 * v**2 + s1 * a, s3 * v**3 + 3.0 * s2 * v * a + s1 * j)
        limited = [(value, limit) for value, limit in zip(values, limits_of(robot), strict=True)]
        shares = [np.abs(value[:, np.isfinite(limit)]) / limit[np.isfinite(limit)] for value, limit in limited]
        return max(float(share.max(initial=0.0)) for share in shares) - 1.0


def limits_of(robot: Robot) -> tuple[Array, Array, Array]:
    """Greatest velocity, acceleration and jerk of every joint, each shape (n_joints,), infinite where there is none."""
    return robot.limits.velocity, robot.limits.acceleration, robot.limits.jerk


class PathRival(BenchRival):
    """A solver of least times along fixed paths, whose motions no decision vectors stand for.

    Attributes:
        limits_jerk: whether it limits jerk.
    """

    limits_jerk: ClassVar[bool] = False

    @abstractmethod
    def profiles(self, robot: Robot, path: GeometricPath) -> Iterable[PathProfile]:
        """Motions along a path, better and better ones if it finds several."""

    def refuses(self, contest: Contest) -> str:
        """See :meth:`BenchRival.refuses`."""
        return on_a_path(contest, jerk=self.limits_jerk)

    def solve(self, contest: Contest) -> None:
        """See :meth:`BenchRival.solve`."""
        robot, path = contest.problem.robot, contest.problem.path
        for profile in self.profiles(robot, path):
            contest.found(profile.duration, lambda found=profile: found.excess(robot, path))  # type: ignore[misc]


def on_a_path(contest: Contest, *, jerk: bool) -> str:
    """Why a solver of least times along fixed paths cannot be set on a problem, one clause; empty if it can.

    Args:
        contest: the run.
        jerk: whether the solver limits jerk.
    """
    problem: Any = contest.problem
    if not isinstance(getattr(problem, "path", None), GeometricPath):
        return "the problem is no fixed path"
    if contest.benchmark.reference.kind != "least" or contest.problem.objective_names[0] != "time":
        return "it finds a least time, the problem asks for a front"
    if not jerk and np.isfinite(problem.robot.limits.jerk).any():
        return "it limits no jerk, the problem does"
    if problem.settings.get("effort"):
        return "its limits of effort need a model of the robot, which is not stated"
    return ""
