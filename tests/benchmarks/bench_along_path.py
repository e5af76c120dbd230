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
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from trajevo import GeometricPath, Payload, Robot, load_robot, slowdown_for
from trajevo.problems import TimeJerkReparameterisation
from trajevo.problems.puma_kinematics import TABLE_1_JOINTS

#: Places at which motions are looked at, and stations of the others.
PLACES, FEW, MANY = 50_001, 201, 1_001

#: A path's time, and speed along it: places u (N,), and u', u'', u''' there [1/s, 1/s², 1/s³].
Profile = tuple[float, np.ndarray, tuple[np.ndarray, ...]]


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


def limits_of(robot: Robot) -> tuple[np.ndarray, ...]:
    """Velocity, acceleration, jerk."""
    return robot.limits.velocity, robot.limits.acceleration, robot.limits.jerk


def ours(robot: Robot, path: GeometricPath, **settings: Any) -> Callable[[], Profile]:
    """The least time by convex programs, and u(t) of it."""

    def solve() -> Profile:
        problem = TimeJerkReparameterisation(path=path, robot=robot, longest_time=60.0, **settings)
        motion = problem.least_time().trajectory
        t = np.linspace(0.0, 1.0, PLACES)[None]
        states = [motion.course.parameter(t, order)[0] for order in range(4)]
        duration = float(motion.duration[0])
        return duration, states[0], tuple(states[order] / duration**order for order in (1, 2, 3))

    return solve


def copp_robot(copp: Any, robot: Robot, path: GeometricPath, stations: np.ndarray, jerk: bool) -> Any:
    """COPP's robot with the path and the limits at its stations."""
    constrained = copp.Robot(path.n_axes, capacity=len(stations))
    constrained.append_s(stations)
    q = [np.ascontiguousarray(path(stations, order)) for order in range(4)]
    constrained.set_q(q[0], q[1], q[2], 0, dddq=q[3])
    velocity, acceleration, most_jerk = limits_of(robot)
    constrained.add_velocity_limits(velocity, -velocity, start_idx_s=0, length=len(stations))
    constrained.add_acceleration_limits(acceleration, -acceleration, start_idx_s=0, length=len(stations))
    if jerk:
        constrained.add_jerk_limits(most_jerk, -most_jerk, start_idx_s=0, length=len(stations))
    return constrained


def reachability(copp: Any, constrained: Any, count: int) -> np.ndarray:
    """COPP's squared speeds at the stations, jerk free."""
    problem = copp.solver.topp2_ra.Problem(
        constrained.constraints, idx_s_interval=(0, count - 1), a_boundary=(0.0, 0.0)
    )
    return np.array(copp.solver.topp2_ra.solve(problem, copp.solver.topp2_ra.Options()))


def copp_third(robot: Robot, path: GeometricPath, kind: str, count: int, again: int) -> Callable[[], Profile]:
    """COPP's third-order program, linearised again so many times."""
    import copp_py as copp

    def solve() -> Profile:
        stations = np.linspace(0.0, 1.0, count)
        constrained = copp_robot(copp, robot, path, stations, jerk=True)
        squared, bends, profile = reachability(copp, constrained, count), None, None
        solver = getattr(copp.solver, f"topp3_{kind}")
        for _ in range(1 + again):
            problem = solver.Problem(
                constrained.constraints, squared, idx_s_start=0, num_stationary_max=1, b_linearization=bends
            )
            profile = solver.solve(problem)
            squared, bends = np.array(profile.a), np.array(profile.b)
        duration, _ = copp.interpolation.s_to_t_topp3(stations, profile, 0.0)
        return third_between(duration, stations, squared, bends)

    return solve


def third_between(duration: float, stations: np.ndarray, squared: np.ndarray, bends: np.ndarray) -> Profile:
    """Between stations u'' is linear in u, and u'² quadratic."""
    u = np.linspace(stations[1], stations[-2], PLACES)
    at = np.clip(np.searchsorted(stations, u, side="right") - 1, 1, len(stations) - 3)
    rate = np.diff(bends)[at] / np.diff(stations)[at]
    past = u - stations[at]
    speed = np.sqrt(np.maximum(squared[at] + 2.0 * bends[at] * past + rate * past**2, 0.0))
    return duration, u, (speed, bends[at] + rate * past, rate * speed)


def second_between(duration: float, stations: np.ndarray, squared: np.ndarray) -> Profile:
    """Between stations u'² is linear in u."""
    u = np.linspace(0.0, 1.0, PLACES)
    at = np.clip(np.searchsorted(stations, u, side="right") - 1, 0, len(stations) - 2)
    rate = np.diff(squared)[at] / np.diff(stations)[at]
    speed = np.sqrt(np.maximum(squared[at] + rate * (u - stations[at]), 0.0))
    return duration, u, (speed, 0.5 * rate, np.zeros(PLACES))


def copp_second(robot: Robot, path: GeometricPath) -> Callable[[], Profile]:
    """COPP's reachability analysis."""
    import copp_py as copp

    def solve() -> Profile:
        stations = np.linspace(0.0, 1.0, MANY)
        squared = reachability(copp, copp_robot(copp, robot, path, stations, jerk=False), MANY)
        duration, _ = copp.interpolation.s_to_t_topp2(stations, squared, 0.0)
        return second_between(duration, stations, squared)

    return solve


def toppra_second(robot: Robot, path: GeometricPath) -> Callable[[], Profile]:
    """The reachability analysis of toppra."""
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

    def solve() -> Profile:
        stations = np.linspace(0.0, 1.0, MANY)
        solver = toppra.algorithm.TOPPRA(constraints, Path(), gridpoints=stations)
        speeds = np.asarray(solver.compute_parameterization(0.0, 0.0)[1])
        duration = float((2.0 * np.diff(stations) / (speeds[:-1] + speeds[1:])).sum())
        return second_between(duration, stations, speeds**2)

    return solve


def excess(robot: Robot, path: GeometricPath, profile: Profile, orders: int) -> float:
    """By how much a limit is exceeded at most, as a share; negative if none is."""
    _, u, (v, a, j) = profile
    v, a, j = (part[:, None] for part in (v, a, j))
    s1, s2, s3 = (path(np.clip(u, 0.0, 1.0), order) for order in (1, 2, 3))
    values = (s1 * v, s2 * v**2 + s1 * a, s3 * v**3 + 3.0 * s2 * v * a + s1 * j)
    shares = [np.abs(value) / limit for value, limit in zip(values, limits_of(robot), strict=True)]
    return max(float(share.max()) for share in shares[:orders]) - 1.0


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


def ways(robot: Robot, path: GeometricPath, jerk: bool) -> Iterator[tuple[str, Callable[[], Profile] | None]]:
    """Names of all ways to solve a task; None for what is not installed."""
    freed = robot if jerk else replace(robot, limits=replace(robot.limits, jerk=np.full(robot.dof, np.inf)))
    for count, order in ((100, 6), (200, 6), (400, 6), (200, 4)):
        yield f"trajevo, {count} control points of order {order}", ours(freed, path, control_points=count, order=order)
    copp, toppra = (importlib.util.find_spec(name) is not None for name in ("copp_py", "toppra"))
    if jerk:
        yield "COPP LP, 201 stations, 2 ×", copp_third(robot, path, "lp", FEW, 1) if copp else None
        for again in (0, 1, 2):
            way = copp_third(robot, path, "socp", MANY, again) if copp else None
            yield f"COPP SOCP, 1001 stations, {again + 1} ×", way
    else:
        yield "COPP reachability, 1001 stations", copp_second(robot, path) if copp else None
        yield "toppra, 1001 stations", toppra_second(robot, path) if toppra else None


def main() -> None:
    """Print the table."""
    print("| task | way | least time [s] | CPU [s] | greatest excess over a limit |")
    print("|---|---|---|---|---|")
    for name, robot, path in tasks():
        if robot.name == "puma560":
            title = f"| {name}, half of the effort, 2.5 kg | trajevo, 100 control points of order 6 |"
            print(f"{title} {with_effort(robot, path)} |", flush=True)
        for jerk in (True, False):
            for way, solve in ways(robot, path, jerk):
                title = f"| {name}, jerk {'limited' if jerk else 'free'} | {way} |"
                if solve is None:
                    print(f"{title} not installed | | |")
                    continue
                solve()  # whatever is loaded or made once
                began = time.process_time()
                profile = solve()
                spent = time.process_time() - began
                over = excess(robot, path, profile, 3 if jerk else 2)
                print(f"{title} {profile[0]:.4f} | {spent:.3f} | {100.0 * over:.2g} % |", flush=True)


if __name__ == "__main__":
    main()
