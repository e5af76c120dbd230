"""toppra's reachability analysis on the same path with the same limits of velocity and acceleration."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, final

import numpy as np

from trajevo.path.curve import GeometricPath
from trajevo.robot.robot import Robot
from trajevo.study.bench.along_path import STATIONS, PathProfile, PathRival, limits_of


@final
class Toppra(PathRival):
    """The least time along a fixed path, limits kept at stations."""

    name = "toppra"
    says = f"reachability analysis at {STATIONS} stations of a fixed path, jerk not limited"
    module, distribution = "toppra", "toppra"

    def profiles(self, robot: Robot, path: GeometricPath) -> Iterable[PathProfile]:
        """See :meth:`PathRival.profiles`."""
        yield by_toppra(robot, path)()


def by_toppra(robot: Robot, path: GeometricPath) -> Callable[[], PathProfile]:
    """What finds the least time along a path."""
    import toppra

    toppra.setup_logging("ERROR")
    velocity, acceleration, _ = limits_of(robot)
    constraints = [
        toppra.constraint.JointVelocityConstraint(np.stack([-velocity, velocity], axis=1)),
        toppra.constraint.JointAccelerationConstraint(np.stack([-acceleration, acceleration], axis=1)),
    ]

    class Path(toppra.interpolator.AbstractGeometricPath):  # type: ignore[misc]
        def __call__(self, positions: Any, order: int = 0) -> Any:
            return path(np.clip(positions, 0.0, 1.0), order)

        dof, path_interval, waypoints = path.n_axes, np.array([0.0, 1.0]), None

    def solve() -> PathProfile:
        stations = np.linspace(0.0, 1.0, STATIONS)
        solver = toppra.algorithm.TOPPRA(constraints, Path(), gridpoints=stations)
        speeds = np.asarray(solver.compute_parameterization(0.0, 0.0)[1])
        duration = float((2.0 * np.diff(stations) / (speeds[:-1] + speeds[1:])).sum())
        return PathProfile.linear_square(duration, stations, speeds**2)

    return solve
