"""A whole front as one netCDF file: every motion, objective, limit and setting, for MATLAB, Python and ncview.

The file uses the classic data model, which the C library behind all three programs reads: float64, int32 and character
arrays, no groups, no user-defined types.
"""

from __future__ import annotations

import json
import math
import re
import warnings
from collections.abc import Sequence
from dataclasses import fields
from importlib.metadata import version
from itertools import chain, count
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.base.units import per_time
from trajevo.errors import InvalidInputError, NoSolutionError
from trajevo.exporters.exporter import Exporter
from trajevo.front.front import Front, Solution
from trajevo.front.records import History
from trajevo.front.thinning import told_share
from trajevo.robot.joints import JointLimits
from trajevo.robot.robot import Robot
from trajevo.trajectory.batch import DERIVATIVES
from trajevo.verification.certify import certify, certify_all

if TYPE_CHECKING:
    import xarray as xr

#: Default number of instants of each motion.
SAMPLES = 201

#: Greatest number of solutions of a front that are all written, and how many stand for a larger front: each motion is
#: certified, which takes some ms.
MOST_SOLUTIONS, FEWER = 5_000, 1_000

#: Greatest number of instants of all motions together.
MOST_INSTANTS = 10_000_000

#: First bytes of a netCDF-4 file.
MAGIC = b"\x89HDF\r\n\x1a\n"

#: Instants evaluated in one call, which needs three times the memory of its result.
_INSTANTS_AT_ONCE = 100_000

#: Share of a step by which an interval may be longer, so that rounding adds no sample to a duration of whole steps.
_ROUNDING = 1e-9

_WRITER = "trajevo"

#: Units of trajevo that UDUNITS reads too, as the CF conventions require.
_UDUNITS = re.compile(r"(?:(?:rad|kg|m|s|N|J|W|1)(?![a-zA-Z])|\^\d+|[()*/])+")

#: Dimensions, values, attributes and encoding.
_Variable = tuple[tuple[str, ...], Array, dict[str, Any], dict[str, Any]]


def dataset(source: Front | Solution, *, samples: int = SAMPLES) -> xr.Dataset:
    """A front, or one solution of it, with its motions.

    Dimensions are ``solution``, ``time`` and ``joint``, and where there are any ``constraint`` and ``generation``.
    Durations differ, so ``time`` is the share of a motion's duration and ``instant`` its time in s. Variables are SI
    and have their units and names as attributes; for a robot with revolute and prismatic joints, ``units`` lists one
    unit for each joint:

    - ``objective_<name>`` and ``decision_<name>`` (solution), ``constraint_excess`` (solution, constraint);
    - ``position``, ``velocity``, ``acceleration``, ``jerk`` and, of a robot with masses, ``effort`` (solution, time,
      joint), at ``instant`` (solution, time), over ``duration`` (solution);
    - ``limit_<name>`` (joint), inf where there is none;
    - ``evaluations``, ``hypervolume``, ``least_violation`` and ``front_size`` (generation).

    ``solution`` holds rows of the front; its attributes are the rows of knee, utopia and the other choices. Of a front
    of more than 5,000 solutions it holds 1,000 at most, spread over the front, and says so in ``comment``. The problem
    and the run are JSON in the global attributes ``problem`` and ``run``; ``certificates`` is a JSON list with one
    sentence for each motion that says what is proven.

    Args:
        source: a front or a solution.
        samples: instants of each motion, evenly spaced from start to end.

    Raises:
        NoSolutionError: the front is empty.
        InvalidInputError: neither a front nor a solution, fewer than 2 samples, or too many in all.
    """
    import xarray as xr

    front, rows = _rows(source)
    robot = front.problem.robot
    if isinstance(samples, bool) or not isinstance(samples, int | np.integer) or samples < 2:
        raise InvalidInputError(f"samples: expected a whole number of at least 2, got {samples!r}")
    if samples * len(rows) > MOST_INSTANTS:
        raise InvalidInputError(f"samples: {samples} of {len(rows)} motions are over {MOST_INSTANTS} instants")
    variables = _solutions(front, rows) | _motions(front, rows, int(samples)) | _limits(robot) | _history(front.history)
    labels = _labels(front)
    coordinates = _axes(source, int(samples)) | labels | {"instant": variables.pop("instant")}
    units = {attributes["units"] for _, _, attributes, _ in variables.values()}
    certificates = certify_all(source, rows=rows) if isinstance(source, Front) else (certify(source),)
    about = _about(front, units) | {"certificates": json.dumps([str(each) for each in certificates])}
    made = xr.Dataset(variables, coordinates, about)
    for name in labels:
        made = made.set_xindex(name)
    return made


def netcdf(source: Front | Solution, step: float | None) -> memoryview:
    """The :func:`dataset` as a netCDF-4 file of the classic model.

    Args:
        source: a front or a solution.
        step: longest time between samples of any motion [s]; 201 samples of each if None.

    Raises:
        NoSolutionError: the front is empty.
        InvalidInputError: neither a front nor a solution, or a step that gives too many samples.
    """
    samples, (front, rows) = SAMPLES, _rows(source)
    if isinstance(source, Front) and len(rows) < len(front):
        warnings.warn(f"the file holds {told_share(np.array(rows), front)}", stacklevel=3)
    if step is not None:
        longest = float(front.problem.decode(front.X[rows]).duration.max())
        if (longest / step + 1.0) * len(rows) > MOST_INSTANTS:
            raise InvalidInputError(
                f"step: {step:g} s gives over {MOST_INSTANTS} samples of {len(rows)} motions of up to {longest:.4g} s"
            )
        samples = 1 + max(1, math.ceil(longest / step * (1.0 - _ROUNDING)))
    return dataset(source, samples=samples).to_netcdf(engine="netcdf4", format="NETCDF4_CLASSIC")


def is_netcdf(file: Path) -> bool:
    """Whether a netCDF file was made by trajevo."""
    import netCDF4

    try:
        with netCDF4.Dataset(file) as content:
            return str(getattr(content, "source", "")).startswith(f"{_WRITER} ")
    except (OSError, RuntimeError, AttributeError, LookupError, ValueError):  # whatever a damaged file makes of it
        return False


def _rows(source: Front | Solution) -> tuple[Front, list[int]]:
    if isinstance(source, Solution):
        return source.front, [source.index]
    if not isinstance(source, Front):
        raise InvalidInputError(f"source: expected a front or a solution, got {type(source).__name__}")
    if not len(source):
        raise NoSolutionError(f"the front is empty: {source.blocking}")
    return source, source.thinned(FEWER if len(source) > MOST_SOLUTIONS else len(source)).tolist()


def _axes(source: Front | Solution, samples: int) -> dict[str, _Variable]:
    """Coordinates along the dimensions, and the rows of the front's choices."""
    front, rows = _rows(source)
    choices = front.choices()
    names = _identifiers([choice.rule for choice in choices])
    about: dict[str, Any] = {name: np.int32(choice.index) for name, choice in zip(names, choices, strict=True)}
    if isinstance(source, Solution):
        about |= {"chosen_by": source.rule, "reason": source.reason}
    elif len(rows) < len(front):
        about["comment"] = told_share(np.array(rows), front)
    generations = range(1, len(front.history.evaluations) + 1)
    return {
        "solution": _counts("solution", rows, "row of the front, from 0, sorted by the first objective", **about),
        "time": _reals(
            ("time",), np.linspace(0.0, 1.0, samples), "1", "share of the duration of the motion", whole=True
        ),
        "generation": _counts("generation", generations, "generation, the initial population counted"),
    }


def _labels(front: Front) -> dict[str, _Variable]:
    robot = front.problem.robot
    labels = {
        "joint_name": ("joint", robot.joint_names, "name of the joint"),
        "joint_unit": ("joint", robot.joint_units, "unit of the joint's position"),
    }
    if front.record.constraints:
        labels["constraint_name"] = ("constraint", front.record.constraints, "name of the constraint")
    # Older versions of MATLAB and ncview cannot read strings, so the file has arrays of characters.
    return {
        name: ((along,), np.array(texts), {"long_name": long_name}, {"dtype": "S1", "char_dim_name": f"{name}_length"})
        for name, (along, texts, long_name) in labels.items()
    }


def _solutions(front: Front, rows: list[int]) -> dict[str, _Variable]:
    """Variables of the front itself: objectives, decision variables, constraints."""
    record, along = front.record, ("solution",)
    variables = {}
    names = _identifiers([objective.name for objective in record.objectives])
    for name, objective, column in zip(names, record.objectives, front.F[rows].T, strict=True):
        about: dict[str, Any] = {"objective": objective.name, "reference": objective.reference}
        variables[f"objective_{name}"] = _reals(along, column, objective.unit, f"objective {objective.name}", **about)
    names = _identifiers([variable.name for variable in record.variables])
    for name, variable, column in zip(names, record.variables, front.X[rows].T, strict=True):
        about = {"variable": variable.name, "lower_bound": variable.lower, "upper_bound": variable.upper}
        long_name = f"decision variable {variable.name}"
        variables[f"decision_{name}"] = _reals(along, column, variable.unit, long_name, **about)
    if record.constraints:
        long_name = "excess over the limit as a share of it, at most 0"
        variables["constraint_excess"] = _reals(("solution", "constraint"), front.G[rows], "1", long_name)
    return variables


def _motions(front: Front, rows: list[int], samples: int) -> dict[str, _Variable]:
    """Every motion at its own instants, evaluated in groups of solutions to limit the memory needed."""
    problem = front.problem
    robot = problem.robot
    names = (*DERIVATIVES, "effort") if robot.gives_effort else DERIVATIVES
    instant = np.empty((len(rows), samples))
    values = {name: np.empty((len(rows), samples, robot.dof)) for name in names}
    group = max(1, _INSTANTS_AT_ONCE // samples)
    for start in range(0, len(rows), group):
        part = slice(start, start + group)
        rollout = problem.rollout(front.X[rows[part]])
        motion = rollout.trajectory.sample(samples)
        instant[part] = motion.t
        for name, state in zip(DERIVATIVES, (motion.q, motion.v, motion.a, motion.j), strict=True):
            values[name][part] = state
        if "effort" in values:
            values["effort"][part] = rollout.effort_in(motion.q, motion.v, motion.a, motion.t)
    along, units = ("solution", "time", "joint"), _units(robot)
    return {
        "instant": _reals(along[:2], instant, "s", "time from the start", whole=True),
        "duration": _reals(along[:1], instant[:, -1].copy(), "s", "duration of the motion"),
        **{name: _reals(along, values[name], units[name], f"{name} of the joint") for name in names},
    }


def _limits(robot: Robot) -> dict[str, _Variable]:
    units = _units(robot)
    named = {"lower": ("position_lower", "least position"), "upper": ("position_upper", "greatest position")}
    variables = {}
    for field in fields(JointLimits):
        quantity = field.name.removesuffix("_backward")
        direction = "" if quantity == field.name else "negative "
        name, long_name = named.get(field.name, (field.name, f"greatest magnitude of {direction}{quantity}"))
        unit = units["position" if field.name in named else quantity]
        about: dict[str, Any] = {"comment": "infinite where there is none", "reference": robot.reference}
        values = getattr(robot.limits, field.name)
        if values is None:  # as the positive direction
            continue
        variables[f"limit_{name}"] = _reals(("joint",), values, unit, f"{long_name} of the joint", **about)
    return variables


def _history(history: History) -> dict[str, _Variable]:
    along = ("generation",)
    corner = history.reference_point
    about: dict[str, Any] = {} if corner is None else {"reference_point": np.array(corner)}
    share = "share of the box from 0 to the reference point that all feasible points so far dominate"
    least = [math.nan if value is None else value for value in history.least_violation]
    return {
        "evaluations": _counts("generation", history.evaluations, "individuals evaluated so far"),
        "hypervolume": _reals(along, np.array(history.hypervolume), "1", share, **about),
        "least_violation": _reals(along, np.array(least), "1", "least sum of violations so far, 0 once feasible"),
        "front_size": _counts("generation", history.front_size, "non-dominated feasible points so far"),
    }


def _about(front: Front, units: set[str]) -> dict[str, Any]:
    record, run, written = front.record, front.run, f"{_WRITER} {version('trajevo')}"
    made = f"{run.algorithm}, seed {run.seed}, {run.generations} generations"
    conventions = {"Conventions": "CF-1.11"} if all(map(_UDUNITS.fullmatch, units)) else {}
    return conventions | {
        "title": record.title,
        "source": written,
        "references": record.robot_reference,
        "history": f"{made}; written by {written}",
        "comment": "SI throughout; each motion is sampled at the same shares of its own duration",
        "robot": record.robot,
        "algorithm": run.algorithm,
        "seed": str(run.seed),
        "problem": json.dumps(record.model_dump(mode="json")),
        "run": json.dumps(run.model_dump(mode="json")),
    }


def _units(robot: Robot) -> dict[str, str]:
    """Unit of each quantity of the joints; one for each joint where they differ."""
    each = {name: [per_time(unit, order) for unit in robot.joint_units] for order, name in enumerate(DERIVATIVES)} | {
        "effort": ["N*m" if unit == "rad" else "N" for unit in robot.joint_units]
    }
    return {name: units[0] if len(set(units)) == 1 else ", ".join(units) for name, units in each.items()}


def _reals(
    along: tuple[str, ...], values: Array, unit: str, long_name: str, *, whole: bool = False, **about: Any
) -> _Variable:
    """float64; ``whole`` for coordinates, where no value may be missing."""
    attributes = {"units": unit, "long_name": long_name, **about}
    return along, frozen(values), attributes, {"_FillValue": None if whole else math.nan}


def _counts(along: str, values: Sequence[int], long_name: str, **about: Any) -> _Variable:
    """int32, the widest integer of the classic model and the only one that ncview reads along a dimension."""
    return (along,), np.array(values, dtype=np.int32), {"units": "1", "long_name": long_name, **about}, {}


def _identifiers(names: Sequence[str]) -> list[str]:
    """Names made of letters, digits and underscores, all different: ``"dx of point 2"`` -> ``"dx_of_point_2"``."""
    made: dict[str, str] = {}
    for name in names:
        plain = re.sub(r"[^0-9A-Za-z]+", "_", name).strip("_") or "unnamed"
        numbered = chain([plain], (f"{plain}_{k}" for k in count(2)))
        free = next(candidate for candidate in numbered if candidate.lower() not in made)
        made[free.lower()] = free
    return list(made.values())


def _netcdf(source: Front | Solution, step: float | None, angle: str) -> memoryview:
    return netcdf(source, step)


NETCDF = Exporter(
    "netcdf",
    "nc",
    "everything that a front, or one solution of it, holds, for MATLAB, Python and ncview",
    _netcdf,
    holds="front",
    step=None,
    si=True,
    beginning=MAGIC,
    recognises=is_netcdf,
)
