"""Compare interpolants through the same points and under the same limits: least time, jerk, effort, energy; as a table.

The interpolants that are compared are called rivals.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.dynamics.integrals.efforts import mechanical_energy
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError, NoSolutionError, checked_name
from trajevo.formulation.constraints.joint_limits import (
    acceleration_limits,
    effort_limits,
    jerk_limits,
    position_limits,
    velocity_limits,
)
from trajevo.formulation.constraints.motion_limits import overshoot
from trajevo.formulation.objectives import Objective, summed_rms_jerk, total_time
from trajevo.formulation.problem import TrajectoryProblem, Weights
from trajevo.path.via_points import ViaPoints
from trajevo.solvers.gradient.weighted_sum import minimise_weighted
from trajevo.trajectory.batch import DERIVATIVES, TrajectoryBatch
from trajevo.trajectory.interpolants import THROUGH_POINTS, stop_and_go
from trajevo.trajectory.peak_shares import peak_shares

#: Interpolants of ``THROUGH_POINTS`` with free times, whose least time is found by SLSQP: name -> title.
FREE = {
    "polynomial": "one polynomial",
    "cubic": "cubic, C2",
    "quartic_cubic_quartic": "4-3-4, C2",
    "quintic_spline": "quintic, C4",
    "septic_spline": "septic, C6",
    "linear_blends": "lines, blends",
}

#: Profiles that stop at every point, whose least time is known in closed form: name -> title, name of the profile.
STOPPING = {
    "rest_to_rest": ("septic, stops", "septic"),
    "trapezoid": ("trapezoid, stops", "trapezoid"),
    "double_s": ("double-S, stops", "double_s"),
    "cycloidal": ("cycloidal, stops", "cycloidal"),
    "harmonic": ("harmonic, stops", "harmonic"),
    "trigonometric": ("trigonometric, stops", "trigonometric"),
}


RIVALS = (*FREE, *STOPPING)

#: Least and greatest time between two points that the search may choose [s].
DURATION_BOUNDS = (0.02, 60.0)

#: Least and greatest time between two points in random starts [s].
_STARTS = (0.1, 5.0)

#: Explanation of the columns in a table of rivals.
RIVALS_NOTE = (
    "Peak jerk and effort: greatest value over its limit; RMS jerk: sum over joints; end jerk: step at start or end; "
    "overshoot: beyond the range of the points; SI: s with rad or m of each joint. An infinite jerk is a step of the "
    "acceleration."
)

#: Jerk below this counts as rounding [SI].
_NOTHING = 1e-9

#: Step of the acceleration, as a share of its limit, above which the jerk counts as infinite.
_STEP = 1e-6


@dataclass(frozen=True, eq=False)
class Rival:
    """One interpolant at its least time under the limits.

    Attributes:
        name: a name of ``RIVALS``.
        title: short description.
        rollout: the robot on its trajectory.
        time: least time [s].
        peak_jerk: greatest ratio of |jerk| to its limit over all joints; inf if the acceleration has a step.
        rms_jerk: sum over joints of the RMS jerk [rad/s³ or m/s³]; inf if the acceleration has a step.
        end_jerk: greatest step of the jerk at the start or the end [rad/s³ or m/s³]; inf if the acceleration has a
            step.
        overshoot: how far the worst joint leaves the range of the points [rad or m].
        via_error: greatest distance of a joint from a point when the point is passed [rad or m].
        effort: greatest ratio of effort to its limit over all joints.
        energy: ∫ Σ |effort x velocity| dt [J].
        within: whether velocity, acceleration, jerk (if it is finite) and effort keep their limits.
    """

    name: str
    title: str
    rollout: Rollout
    time: float
    peak_jerk: float
    rms_jerk: float
    end_jerk: float
    overshoot: float
    via_error: float
    effort: float
    energy: float
    within: bool

    __repr__ = brief


def compare_rivals(
    dynamics: Dynamics,
    points: ViaPoints,
    *,
    names: Iterable[str] = RIVALS,
    keep_range: bool = False,
    starts: int = 3,
    seed: int = 0,
) -> tuple[Rival, ...]:
    """The least time of every interpolant through the points under the same limits, with its jerk, effort and energy.

    Interpolants with free times keep the limits of velocity, acceleration, jerk and effort; SLSQP finds their least
    time from random starts. Profiles that stop at every point are as fast as the joint limits allow that they consider:
    a trapezoid and a harmonic profile have infinite jerk, and no profile considers effort, which may exceed its limit.

    Args:
        dynamics: robot, payload and number of samples.
        points: via points.
        names: names of ``RIVALS``.
        keep_range: also keep the joints' position limits, for interpolants with free times.
        starts: number of random starts for each interpolant.
        seed: seed of the starts.

    Raises:
        UnknownNameError: no such interpolant.
        NoSolutionError: no motion within the limits was found for an interpolant; the message names it.
    """
    found = []
    for name in names:
        checked_name("rival", name, RIVALS)
        if name in STOPPING:
            title, profile = STOPPING[name]
            trajectory = stop_and_go(points, dynamics.robot.limits, profile=profile, straight=False)
            found.append(_measured(name, title, Rollout(dynamics, trajectory), points, trajectory.breaks[0]))
        else:
            found.append(_fastest(name, dynamics, points, keep_range, starts, seed))
    return tuple(found)


def rivals_of(problem: TrajectoryProblem) -> tuple[Rival, ...]:
    """Compare all interpolants through the via points of a problem, with its robot, payload and margins.

    Position limits are not kept.

    Raises:
        InvalidInputError: the problem's interpolant has no via points.
    """
    points = getattr(problem.interpolant, "points", None)
    if not isinstance(points, ViaPoints):
        raise InvalidInputError(f"rivals: the interpolant of {problem.title!r} has no via points")
    asked = ("passing", "cyclic", "curves")
    if any(getattr(problem.interpolant, name, ()) for name in asked):
        raise InvalidInputError(
            "rivals: expected points that are passed freely, as interpolants are compared through the points alone, "
            "got a problem with stops, given velocities (passing), lines of the tool (segments) or a cycle (cyclic)"
        )
    if problem.dynamics.schedule is not None:
        raise InvalidInputError(
            f"rivals: expected one payload that is always carried, got loads: {problem.dynamics.schedule}"
        )
    kept = replace(problem.robot, limits=problem.kept_limits)
    return compare_rivals(replace(problem.dynamics, robot=kept), points)


def rivals_table(rivals: Iterable[Rival]) -> tuple[list[str], list[list[str]]]:
    """Headers and rows of a table of rivals, fastest first."""
    headers = [
        "interpolant",
        "time [s]",
        "peak jerk [1]",
        "RMS jerk [SI]",
        "end jerk [SI]",
        "overshoot [SI]",
        "via error [SI]",
        "effort [1]",
        "energy [J]",
    ]
    rows = []
    for rival in sorted(rivals, key=lambda rival: rival.time):
        jerks = (rival.peak_jerk, rival.rms_jerk, rival.end_jerk)
        rows.append(
            [
                rival.title,
                f"{rival.time:.4f}",
                *(f"{value if value > _NOTHING else 0.0:.4g}" for value in jerks),
                f"{rival.overshoot:.3f}",
                f"{rival.via_error:.3f}",
                f"{rival.effort:.3f}",
                f"{rival.energy:.1f}",
            ]
        )
    return headers, rows


def _fastest(name: str, dynamics: Dynamics, points: ViaPoints, keep_range: bool, starts: int, seed: int) -> Rival:
    """Find the least time without effort limits, which is far cheaper; if the motion breaks them, find it with them."""
    title, robot = FREE[name], dynamics.robot
    limits = [velocity_limits(robot), acceleration_limits(robot), jerk_limits(robot)]
    limits += [position_limits(robot)] if keep_range else []
    for constraints in (limits, [*limits, effort_limits(robot)]):
        problem = TrajectoryProblem(
            dynamics=dynamics,
            interpolant=THROUGH_POINTS[name](points, duration_bounds=DURATION_BOUNDS),
            objectives=(Objective("time", "s", "least time", total_time),),
            constraints=constraints,
        )
        low, high = np.maximum(problem.xl, _STARTS[0]), np.minimum(problem.xu, _STARTS[1])
        drawn = np.random.default_rng(seed).uniform(low, high, (starts, problem.n_var))
        best = minimise_weighted(problem, Weights((1.0,)), seed=seed, initial=drawn)
        if not np.isfinite(best.cost):
            break
        rival = _measured(name, title, best.rollout, points, problem.via_times(best.x[None])[0])
        if rival.within:
            return rival
    raise NoSolutionError(f"rivals: found no motion of {title!r} within the limits of {robot.name!r}")


def _measured(name: str, title: str, rollout: Rollout, points: ViaPoints, instants: Array) -> Rival:
    trajectory, limits = rollout.trajectory, rollout.robot.limits
    ends = np.abs(trajectory.at_shares(np.array([0.0, 1.0]), 2)[0, [0, -1]])
    steps = np.concatenate([np.abs(trajectory.jump(2)[0]), ends])
    least = limits.sides("acceleration").lesser
    jerky = bool((steps > _STEP * np.where(np.isfinite(least), least, 1.0)).any())
    effort = limits.sides("effort").share(rollout.effort[0]).max(axis=0)
    used = [
        float(peak_shares(trajectory, order, limits.sides(name))[0].max())
        for order, name in enumerate(DERIVATIVES[1:], start=1)
    ]
    last = np.abs(trajectory.at_shares(np.array([0.0, 1.0]), 3)[0, [0, -1]])
    return Rival(
        name=name,
        title=title,
        rollout=rollout,
        time=float(trajectory.duration[0]),
        peak_jerk=np.inf if jerky else used[2],
        rms_jerk=np.inf if jerky else float(summed_rms_jerk(rollout)[0]),
        end_jerk=np.inf if jerky else float(last.max()),
        overshoot=float(overshoot(trajectory, points).max()),
        via_error=_via_error(trajectory, points, instants),
        effort=float(effort.max()),
        energy=float(mechanical_energy(rollout)[0]),
        within=max(*used[:2], 0.0 if jerky else used[2], float(effort.max())) <= 1.0 + 1e-6,
    )


def _via_error(trajectory: TrajectoryBatch, points: ViaPoints, instants: Array) -> float:
    """Greatest distance of any joint from a via point, each measured at the nearest of the given instants."""
    reached = trajectory.evaluate(np.clip(instants, 0.0, float(trajectory.duration[0])))[0]
    distance = np.abs(reached[:, None] - points.positions).max(axis=2)
    return float(distance.min(axis=0).max())
