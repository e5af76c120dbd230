"""What a problem says of how its points are passed: whether limits and durations allow it, and limits of instants."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.units import if_degrees, per_time, pretty
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.formulation.constraints.constraint import Constraint
from trajevo.formulation.constraints.joint_limits import kept_limits
from trajevo.formulation.objectives import NAMED_OBJECTIVES
from trajevo.path.passing import Passing
from trajevo.path.via_points import OnLimit, ViaPoints
from trajevo.robot.robot import Robot
from trajevo.trajectory.interpolants import NAMED_INTERPOLANTS, Interpolant
from trajevo.trajectory.interpolants.interpolant import breaks_at_points

#: Difference of two positions that counts as none, as poses are solved to [rad or m].
_SAME = 1e-6

#: Limited quantities that are infinite where accelerations jump.
_INFINITE = ("jerk", "effort rate")


def closed(points: ViaPoints, cyclic: bool) -> ViaPoints:
    """The points of a cyclic motion, the last exactly as the first; other points as they are.

    Raises:
        InvalidInputError: a last point that is another one than the first, or something else than true or false.
    """
    if not isinstance(cyclic, bool):
        raise InvalidInputError(f"cyclic: expected true or false, got {cyclic!r}")
    first, last = points.positions[0], points.positions[-1]
    if not cyclic:
        return points
    if np.abs(last - first).max() > _SAME:
        raise InvalidInputError(
            f"cyclic: expected the last point to be the first, {first.tolist()}, got {last.tolist()}; repeat the first "
            "one at the end"
        )
    return ViaPoints(np.vstack([points.positions[:-1], first]))


def check_seam(cyclic: bool, robot: Robot, points: ViaPoints, constraints: Sequence[Constraint]) -> None:
    """Refuse a cycle whose seam lies on a position limit, where its motion would go on beyond it.

    Raises:
        InvalidInputError: as said.
    """
    if not cyclic or not any(each.quantity == "position" for each in constraints):
        return
    for at in points.on_limits(robot):
        if at.point == 0:
            raise InvalidInputError(
                f"cyclic: point 0 lies on the {'upper' if at.upper else 'lower'} limit of "
                f"{robot.joint_names[at.joint]!r}: begin the cycle at another point, as joints rest on limits "
                "at inner points alone"
            )


def left_open(turns: Sequence[OnLimit], passing: Sequence[Passing]) -> tuple[OnLimit, ...]:
    """Those of the points on a joint's limit at which no stop and no given velocity says how the joint moves."""
    known = {one.point for one in passing if one.stop or one.velocity is not None}
    return tuple(at for at in turns if at.point not in known)


def check_velocities(
    passing: Sequence[Passing],
    robot: Robot,
    points: ViaPoints,
    turns: Sequence[OnLimit],
    constraints: Sequence[Constraint],
) -> None:
    """Refuse given velocities and accelerations that no motion within the robot's limits can have.

    Args:
        passing: how points are passed.
        robot: the robot.
        points: the points.
        turns: inner points on a joint's position limit; ends on one are found here.
        constraints: limits that the motions keep; what none of them limits is free.

    Raises:
        InvalidInputError: a value above its limit, or one that leads beyond a position limit.
    """
    limits, kept = kept_limits(robot, constraints), {each.quantity for each in constraints if each.of_joints}
    ends = [at for at in points.on_limits(robot) if at.point in (0, len(points) - 1)]
    for one in passing:
        for order, key in enumerate(("velocity", "acceleration"), start=1):
            signed = np.asarray(one.vectors.get(key, np.zeros(robot.dof)))
            values, limit = np.abs(signed), limits.sides(key).toward(signed)
            for joint in np.flatnonzero(values > limit).tolist() if key in kept else []:
                given, unit = float(values[joint]), pretty(per_time(robot.joint_units[joint], order))
                likely = if_degrees(given) if robot.joint_units[joint] == "rad" else ""
                raise InvalidInputError(
                    f"passing: point {one.point}: {key}: {given:g} {unit} of {robot.joint_names[joint]!r} exceeds its "
                    f"limit of {limit[joint]:g} {unit}{likely}"
                )
        if one.velocity is not None and "position" in kept:
            _check_at_limits(one, one.velocity, robot, [*turns, *ends], len(points) - 1)


def _check_at_limits(one: Passing, velocity: Array, robot: Robot, on_limits: Sequence[OnLimit], last: int) -> None:
    for at in on_limits:
        outwards = float(velocity[at.joint]) * (1.0 if at.upper else -1.0)
        before, after = one.point > 0 and outwards < 0.0, one.point < last and outwards > 0.0
        if at.point == one.point and (before or after):
            raise InvalidInputError(
                f"passing: point {one.point}: velocity: expected 0 for {robot.joint_names[at.joint]!r}, whose "
                f"{'upper' if at.upper else 'lower'} limit the point lies on, got {velocity[at.joint]:g}: the motion "
                "would be beyond it"
            )


def window_limits(passing: Sequence[Passing], interpolant: Interpolant) -> tuple[Constraint, ...]:
    """Limits of the instants at which points are passed: t / latest - 1, and earliest / t - 1; none without a window.

    Raises:
        InvalidInputError: windows that the bounds of the durations do not reach, or an interpolant that does not pass
            its points where its segments meet.
    """
    asked = {one.point: one.window for one in passing if one.window is not None}
    if not asked:
        return ()
    places = breaks_at_points(interpolant)
    if places is None:
        raise InvalidInputError(
            f"passing: point {min(asked)}: window: expected an interpolant that passes its points where segments meet, "
            "such as quintic_spline"
        )
    _check_reachable(asked, interpolant)
    found = []
    for key, end in (("latest", 1), ("earliest", 0)):
        limits = {point: window[end] for point, window in asked.items() if window[end] > 0.0}
        if limits:
            function = partial(
                _late if end else _early,
                breaks=[places[point] for point in limits],
                limits=np.array(list(limits.values())),
            )
            found.append(
                Constraint(
                    tuple(f"{key} at point {point}" for point in limits),
                    "time windows of the points",
                    function,
                    quantity=f"{key} instant",
                    limit=tuple(limits.values()) if end else None,
                    unit="s" if end else "1",
                    proof="extremes",
                )
            )
    return tuple(found)


def _late(rollout: Rollout, *, breaks: list[int], limits: Array) -> Array:
    excess: Array = rollout.trajectory.breaks[:, breaks] / limits - 1.0
    return excess


def _early(rollout: Rollout, *, breaks: list[int], limits: Array) -> Array:
    excess: Array = limits / rollout.trajectory.breaks[:, breaks] - 1.0
    return excess


def _check_reachable(asked: dict[int, tuple[float, float]], interpolant: Interpolant) -> None:
    """Refuse windows that no sum of durations reaches, each on its own or after the windows of earlier points."""
    ends = np.array([[getattr(variable, end) for variable in interpolant.variables] for end in ("lower", "upper")])
    low, high = np.diff(interpolant.via_times(ends), axis=1)
    earliest = latest = 0.0
    for point, (least, greatest) in enumerate(zip(low.tolist(), high.tolist(), strict=True), start=1):
        earliest, latest = earliest + least, latest + greatest
        begin, end = asked.get(point, (0.0, np.inf))
        if earliest > end or latest < begin:
            raise InvalidInputError(
                f"passing: point {point}: window: {begin:g} to {end:g} s is never reached: duration_bounds, dwells and "
                f"earlier windows allow {earliest:g} to {latest:g} s"
            )
        earliest, latest = max(earliest, begin), min(latest, end)


def check_free(interpolant: Interpolant) -> None:
    """Refuse an interpolant without anything to choose.

    Raises:
        InvalidInputError: it has no variables.
    """
    if not interpolant.variables:
        raise InvalidInputError("duration_bounds: expected a duration or a point that may vary, got all of them fixed")


def check_jumps(kind: str, objectives: Sequence[str], held: Sequence[Constraint]) -> None:
    """Refuse what is infinite, or a finite limit of it, where the accelerations of an interpolant jump.

    Raises:
        InvalidInputError: an objective or a limit of jerk or of the rate of efforts.
    """
    if getattr(NAMED_INTERPOLANTS.find(kind), "continuous", 2) > 1:
        return
    instead = "expected others, or the interpolant 'cubic', 'bspline', 'quintic_spline' or 'septic_spline'"
    for name in objectives:
        if "continuous accelerations" in NAMED_OBJECTIVES.find(name).needs:
            raise InvalidInputError(f"objectives: {name!r} is infinite where accelerations of {kind!r} jump; {instead}")
    for limit in held:
        if limit.names and limit.quantity in _INFINITE:
            raise InvalidInputError(
                f"constraints: {limit.names[0]!r} cannot be kept, as accelerations of {kind!r} jump; {instead}"
            )


def notes_on_jumps(kind: str, robot: Robot) -> tuple[str, ...]:
    """One sentence where accelerations of an interpolant jump although the robot has limits of jerk."""
    if getattr(NAMED_INTERPOLANTS.find(kind), "continuous", 2) > 1 or not robot.limits.sides("jerk").limited.any():
        return ()
    return (
        f"accelerations of {kind!r} jump, which breaks the robot's limits of jerk, so that no motion is certified; if "
        "it may jerk, set jerk = inf in [limits]",
    )
