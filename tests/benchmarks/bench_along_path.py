"""Least times along fixed paths: ours, COPP's and toppra's, in one run.

For two arms, paths of 10 and of 200 points, with and without limits of jerk: the least time, the CPU time, and by how
much the motion exceeds a limit anywhere, at 50,001 places: of ours nowhere. COPP and toppra keep the limits at their
stations only; COPP's two outermost intervals, where its profile is at rest, are left out. COPP's third-order programs
are linearised again about their own solution, as its documentation recommends: once and twice. What is not installed is
left out and told; `pip install 'trajevo[bench]'`.
"""

from __future__ import annotations

import importlib.util
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from trajevo import GeometricPath, Payload, Robot, load_robot, slowdown_for
from trajevo.problems import TimeJerkReparameterisation
from trajevo.problems.puma_kinematics import TABLE_1_JOINTS
from trajevo.study.bench.adapters.of_copp import second_order, third_order
from trajevo.study.bench.adapters.of_toppra import by_toppra
from trajevo.study.bench.along_path import STATIONS, PathProfile

#: Stations of linear programs, which take longer than others.
FEW = 201


def tasks() -> Iterator[tuple[str, Robot, GeometricPath]]:
    """Two arms, each with a path of 10 and of 200 points."""
    puma = load_robot("puma560")
    table = PchipInterpolator(np.arange(4), np.array(TABLE_1_JOINTS))(np.linspace(0.0, 3.0, 10))
    yield "PUMA 560, pick and place, 10 points", puma, GeometricPath.through(table)
    middle = np.array([0.3, 0.6, -0.8, -0.5, -0.8, 0.2])
    wide, deep = np.array([[0.5, 0.3, 0.35, 0.2, 0.25, 0.3], [0.2, 0.3, -0.2, 0.3, -0.2, 0.25]])
    yield "PUMA 560, ellipse, 200 points", puma, GeometricPath.through(ellipse(middle, wide, deep, 1))
    ur5 = load_robot("ur5", tool="tool0", limits={"acceleration": 8.0, "jerk": 60.0})
    steps = 0.4 * np.random.default_rng(4).normal(size=(10, 6))
    home = np.array([0.0, -1.5, 1.5, -1.0, -1.5, 0.0])
    yield "UR5, random steps, 10 points", ur5, GeometricPath.through(home + np.cumsum(steps, axis=0))
    yield "UR5, two turns, 200 points", ur5, GeometricPath.through(ellipse(home, wide, deep, 2))


def ellipse(middle: np.ndarray, wide: np.ndarray, deep: np.ndarray, turns: int) -> np.ndarray:
    """Points on ellipses of the joints that grow a little, (200, n_joints)."""
    angle = np.linspace(0.0, 2.0 * np.pi * turns, 200)[:, None]
    return middle + (1.0 + 0.02 * angle) * (np.cos(angle) * wide + np.sin(angle) * deep)


def ours(robot: Robot, path: GeometricPath, **settings: Any) -> Callable[[], PathProfile]:
    """The least time by convex programs, and u(t) of it."""

    def solve() -> PathProfile:
        problem = TimeJerkReparameterisation(path=path, robot=robot, longest_time=60.0, **settings)
        return PathProfile.of(problem.least_time().trajectory)

    return solve


def with_effort(robot: Robot, path: GeometricPath) -> str:
    """The least time with half of the effort, 20 times the jerk and 2.5 kg, and that of slowing down."""
    limits = replace(robot.limits, jerk=20.0 * robot.limits.jerk, effort=0.5 * robot.limits.effort)
    arm = replace(robot, limits=limits)
    given: dict[str, Any] = {"path": path, "robot": arm, "longest_time": 60.0, "control_points": 100}
    limited = TimeJerkReparameterisation(**given, effort=True, payload=2.5, limits="certified")
    began = time.process_time()
    found = limited.least_time()
    spent = time.process_time() - began
    free = TimeJerkReparameterisation(**given).least_time()
    slowed = slowdown_for(free.rollout, Payload(2.5)).duration
    others = f"without limits of effort {free.F['time']:.4f} s, slowed down {slowed:.4f} s"
    return f"{found.F['time']:.4f} | {spent:.3f} | proven; {others}"


def without_jerk(robot: Robot) -> Robot:
    """The same robot, its jerk free."""
    return replace(robot, limits=replace(robot.limits, jerk=np.full(robot.dof, np.inf)))


def ways(robot: Robot, path: GeometricPath, jerk: bool) -> Iterator[tuple[str, Callable[[], PathProfile] | None]]:
    """Names of all ways to solve a task; None for what is not installed."""
    freed = robot if jerk else without_jerk(robot)
    for count, order in ((100, 6), (200, 6), (400, 6), (200, 4)):
        yield f"trajevo, {count} control points of order {order}", ours(freed, path, control_points=count, order=order)
    copp, toppra = (importlib.util.find_spec(name) is not None for name in ("copp_py", "toppra"))
    if jerk:
        few = partial(third_order, robot, path, kind="lp", count=FEW, again=1)
        yield "COPP LP, 201 stations, 2 ×", few if copp else None
        for again in (0, 1, 2):
            way = partial(third_order, robot, path, again=again) if copp else None
            yield f"COPP SOCP, {STATIONS} stations, {again + 1} ×", way
    else:
        yield f"COPP reachability, {STATIONS} stations", partial(second_order, robot, path) if copp else None
        yield f"toppra, {STATIONS} stations", by_toppra(robot, path) if toppra else None


def main() -> None:
    """Print the table."""
    print("| task | way | least time [s] | CPU [s] | greatest excess over a limit |")
    print("|---|---|---|---|---|")
    for name, robot, path in tasks():
        if robot.name == "puma560":
            title = f"| {name}, half of the effort, 2.5 kg | trajevo, 100 control points of order 6 |"
            print(f"{title} {with_effort(robot, path)} |", flush=True)
        for jerk in (True, False):
            judged = robot if jerk else without_jerk(robot)
            for way, solve in ways(robot, path, jerk):
                title = f"| {name}, jerk {'limited' if jerk else 'free'} | {way} |"
                if solve is None:
                    print(f"{title} not installed | | |")
                    continue
                solve()  # whatever is loaded or made once
                began = time.process_time()
                profile = solve()
                spent = time.process_time() - began
                over = profile.excess(judged, path)
                print(f"{title} {profile.duration:.4f} | {spent:.3f} | {100.0 * over:.2g} % |", flush=True)


if __name__ == "__main__":
    main()
