"""Check a path, limits of its axes and the longest time as a user gives them, and convert them to SI units."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from trajevo.base.arrays import Array, numbers
from trajevo.base.units import display, per_time, quantity
from trajevo.errors import InvalidInputError, UnknownNameError
from trajevo.path.curve import GeometricPath
from trajevo.path.point_files import joint_columns
from trajevo.path.tables import read_table
from trajevo.robot.joints import DIRECTED, length_unit
from trajevo.robot.robot import Robot, robot_of

from .gemini_and_s import EXAMPLE_PATHS, ExamplePath

#: Order of the derivative that each limit applies to.
_DERIVATIVES = {"velocity": 1, "acceleration": 2, "jerk": 3}


def prepared(
    path: Any, control_points: int | None, robot: Any, asked: Mapping[str, Any], longest: Any
) -> tuple[GeometricPath, Robot, float]:
    """The path, the robot with the limits that apply, and the longest time [s].

    Args:
        path: name of an example path, points, a file of points, a path, or the settings of a path.
        control_points: number of control points of a path near the points; None for a path through them.
        robot: a robot, its name or folder, or the arguments of ``load_robot`` as a mapping; the biaxial feed drive if
            None.
        asked: limits of velocity, acceleration and jerk, None where they are not given.
        longest: longest time, or None.

    Raises:
        UnknownNameError: no such path or robot.
        InvalidInputError: an invalid argument; the message names it.
    """
    example = EXAMPLE_PATHS.get(path) if isinstance(path, str) else None
    axes = robot_of("feed_drive" if robot is None else robot)
    found = _path(path, control_points, axes)
    return found, _limited(axes, example, asked, own=robot is not None), _longest(longest, example)


def at_rest(path: GeometricPath) -> GeometricPath:
    """A new path through or near the positions of a path, with first and second derivatives of 0 at both ends."""
    u = np.asarray(path.parameters)
    options: dict[str, Any] = {"order": path.order, "parameters": u, "knots": "quantiles", "at_rest": True}
    if len(u) > len(path.control_points):
        return GeometricPath.near(path(u), control_points=len(path.control_points) + 4, **options)
    return GeometricPath.through(path(u), **options)


def _path(path: Any, control_points: int | None, robot: Robot) -> GeometricPath:
    """The path that an argument describes; checks that its axes match those of a robot and stay in their ranges."""
    if isinstance(path, str) and path in EXAMPLE_PATHS:
        found, source = EXAMPLE_PATHS[path].make(), f"path {path!r}"
    elif isinstance(path, GeometricPath):
        found, source = path, "path"
    elif isinstance(path, Mapping):
        found, source = _from_settings(path), "path"
    elif isinstance(path, str | Path):
        found, source = _from_file(path, control_points, robot), str(path)
    else:
        found, source = _fitted(numbers(path, name="path", shape=("n_points", "n_axes")), control_points), "path"
    if found.n_axes != robot.dof:
        raise InvalidInputError(
            f"{source}: {found.n_axes} axes, but robot {robot.name!r} has {robot.dof}: {', '.join(robot.joint_names)}"
        )
    least, greatest = found.extremes(0)
    for axis, name in enumerate(robot.joint_names):
        low, high = robot.limits.lower[axis], robot.limits.upper[axis]
        if least[axis] < low or greatest[axis] > high:
            unit = robot.joint_units[axis]
            raise InvalidInputError(
                f"{source}: runs from {least[axis]:.6g} to {greatest[axis]:.6g} {unit} along {name!r}, "
                f"outside its range {low:.6g} to {high:.6g} {unit}"
            )
    return found


def _limited(robot: Robot, example: ExamplePath | None, given: Mapping[str, Any], *, own: bool) -> Robot:
    """A robot with the limits that apply: given ones, else its own if it was named, else those of the example path."""
    found = {}
    for name, value in given.items():
        if value is not None:
            found[name] = _limit(value, name, robot)
        elif example is not None and not own:
            found[name] = np.full(robot.dof, getattr(example, name))
        elif own:
            continue  # in both directions as the robot has it
        else:
            si = per_time(robot.joint_units[0], _DERIVATIVES[name])
            unit, _ = display(si, angle="deg", length=length_unit(robot))
            raise InvalidInputError(
                f"{name}: a path of your own needs a limit for every axis: {name}='100 {unit}', "
                f"or name a robot whose limits apply"
            )
    directed: dict[str, Any] = {f"{name}_backward": None for name in found if name in DIRECTED}
    return replace(robot, limits=replace(robot.limits, **found, **directed))


def _longest(longest: Any, example: ExamplePath | None) -> float:
    if longest is None and example is not None:
        return example.longest_time
    if longest is None:
        raise InvalidInputError("longest_time: a path of your own needs the longest time that is allowed [s]")
    value = quantity(longest, "s", name="longest_time") if isinstance(longest, str) else longest
    if isinstance(value, bool) or not isinstance(value, int | float | np.number) or not 0.0 < value < np.inf:
        raise InvalidInputError(f"longest_time: expected a positive time [s], got {longest!r}")
    return float(value)


def _from_settings(settings: Mapping[str, Any]) -> GeometricPath:
    try:
        return GeometricPath(**settings)
    except TypeError:
        raise InvalidInputError(
            f"path: expected knots, control_points and parameters, got {', '.join(map(str, settings))}"
        ) from None


def _from_file(file: str | Path, control_points: int | None, robot: Robot) -> GeometricPath:
    if not os.path.isfile(file):
        raise UnknownNameError("path", file, [*EXAMPLE_PATHS, "a CSV file of points"])
    columns = joint_columns(robot)
    points = read_table(file, example=", ".join(f"{name} [{unit}]" for name, unit in columns.items())).si(columns)
    try:
        return _fitted(points, control_points)
    except InvalidInputError as error:
        raise InvalidInputError(f"{file}: {error}") from error


def _fitted(points: Array, control_points: int | None) -> GeometricPath:
    if control_points is None:
        return GeometricPath.through(points)
    return GeometricPath.near(points, control_points=control_points)


def _limit(value: Any, name: str, robot: Robot) -> Array:
    """One limit for all axes or one for each, numbers in SI or texts with their units; ``inf`` must be explicit."""
    single = isinstance(value, str) or np.ndim(value) == 0
    entries = [value] * robot.dof if single else list(value)
    if len(entries) != robot.dof:
        raise InvalidInputError(f"{name}: expected one limit or {robot.dof}, one for each axis, got {len(entries)}")
    limits = np.empty(robot.dof)
    for axis, entry in enumerate(entries):
        unit = per_time(robot.joint_units[axis], _DERIVATIVES[name])
        if isinstance(entry, str):
            entry = float("inf") if entry.strip() == "inf" else quantity(entry, unit, name=name)
        if isinstance(entry, bool) or not isinstance(entry, int | float | np.number) or not entry > 0.0:
            raise InvalidInputError(
                f"{name}: expected a positive limit [{unit}] or inf for axis {robot.joint_names[axis]!r}, got {entry!r}"
            )
        limits[axis] = entry
    return limits
