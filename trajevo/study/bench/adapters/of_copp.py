"""COPP on the same path with the same limits: reachability analysis, or its cone programs where jerk is limited."""

from __future__ import annotations

from collections.abc import Iterable
from importlib import import_module
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.path.curve import GeometricPath
from trajevo.robot.robot import Robot
from trajevo.study.bench.along_path import STATIONS, PathProfile, PathRival, limits_of


@final
class Copp(PathRival):
    """The least time along a fixed path, limits kept at stations; cone programs are linearised again three times."""

    name = "copp"
    says = f"{STATIONS} stations of a fixed path; with jerk limited cone programs, again about their own solutions"
    module, distribution = "copp_py", "copp-py"
    limits_jerk = True

    def profiles(self, robot: Robot, path: GeometricPath) -> Iterable[PathProfile]:
        """See :meth:`PathRival.profiles`."""
        for again in range(4) if np.isfinite(robot.limits.jerk).any() else (None,):
            yield second_order(robot, path) if again is None else third_order(robot, path, again=again)


def second_order(robot: Robot, path: GeometricPath) -> PathProfile:
    """The least time by reachability analysis, jerk free."""
    copp: Any = import_module("copp_py")
    stations = np.linspace(0.0, 1.0, STATIONS)
    squared = _limited(copp, robot, path, stations, jerk=False)[1]
    duration, _ = copp.interpolation.s_to_t_topp2(stations, squared, 0.0)
    return PathProfile.linear_square(duration, stations, squared)


def third_order(
    robot: Robot, path: GeometricPath, *, again: int, kind: str = "socp", count: int = STATIONS
) -> PathProfile:
    """The least time by programs of third order, ``"lp"`` or ``"socp"``, linearised again so many times."""
    copp: Any = import_module("copp_py")
    stations = np.linspace(0.0, 1.0, count)
    limited, squared = _limited(copp, robot, path, stations, jerk=True)
    bends: Any = None
    solver = getattr(copp.solver, f"topp3_{kind}")
    for _ in range(1 + again):
        given = {"idx_s_start": 0, "num_stationary_max": 1, "b_linearization": bends}
        profile = solver.solve(solver.Problem(limited.constraints, squared, **given))
        squared, bends = np.array(profile.a), np.array(profile.b)
        duration = copp.interpolation.s_to_t_topp3(stations, profile, 0.0)[0]
    return PathProfile.linear_bend(duration, stations, squared, bends)


def _limited(copp: Any, robot: Robot, path: GeometricPath, stations: Array, *, jerk: bool) -> tuple[Any, Array]:
    """COPP's robot with the path and the limits at its stations, and its squared speeds there with jerk free."""
    made = copp.Robot(path.n_axes, capacity=len(stations))
    made.append_s(stations)
    q = [np.ascontiguousarray(path(stations, order)) for order in range(4)]
    made.set_q(q[0], q[1], q[2], 0, dddq=q[3])
    names = ("velocity", "acceleration", "jerk") if jerk else ("velocity", "acceleration")
    for name, limit in zip(names, limits_of(robot), strict=False):
        getattr(made, f"add_{name}_limits")(limit, -limit, start_idx_s=0, length=len(stations))
    ra = copp.solver.topp2_ra
    asked = ra.Problem(made.constraints, idx_s_interval=(0, len(stations) - 1), a_boundary=(0.0, 0.0))
    return made, np.array(ra.solve(asked, ra.Options()))
