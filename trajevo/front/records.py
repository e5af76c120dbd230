"""Records of a problem, a run and a front: frozen data that is equal after it is written to a file and read again."""

from __future__ import annotations

import math
import platform
import re
from collections import Counter
from collections.abc import Iterable, Mapping
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Annotated, Any, Literal

import pydantic

from trajevo.base.files import MOST_DATA, opening_robots_only, read_text, why_not
from trajevo.base.jit import Kind
from trajevo.base.plain import plain_data
from trajevo.base.shown.brief import brief
from trajevo.base.toml import problem_of
from trajevo.errors import InvalidInputError, NotRegisteredError, one_line
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.formulation.registry import list_problems, load_problem
from trajevo.front.hypervolume import Volumes
from trajevo.robot.joints import JointLimits
from trajevo.robot.payload import LOAD_MODELS

#: Packages whose versions affect the results of a run.
_PACKAGES = ("trajevo", "pymoo", "pin", "numpy", "scipy", "moocore", "daqp", "ruckig")

#: Revision of the formulas of objectives and constraints, recorded with the versions. It is raised whenever numbers
#: change by more than rounding, so that a front on record is told from a damaged one.
FORMULAS = ("trajevo formulas", "5")

#: Fields of a history with one entry per generation, and one more for each polishing.
_BY_GENERATION = ("evaluations", "hypervolume", "least_violation", "front_size")


#: Number of characters of a value that messages show.
_LONGEST_TEXT = 120


class Record(pydantic.BaseModel):
    """Frozen data that is equal after a round trip through JSON; unknown keys, NaN and infinity are refused."""

    model_config = pydantic.ConfigDict(extra="forbid", frozen=True, defer_build=True, allow_inf_nan=False)

    __repr__ = brief


def told(error: pydantic.ValidationError) -> str:
    """The first of the errors that pydantic found in a record, as its place and what is wrong there."""
    first = error.errors()[0]
    place = ".".join(str(part) for part in first["loc"]) or "content"
    return f"{place}: {problem_of(first)}"


def _settings(given: Any) -> Any:
    return plain_data("settings", given) if isinstance(given, Mapping) else given  # pydantic refuses the rest


#: Settings by name, as they are when they are read from JSON: lists, not tuples or arrays.
Settings = Annotated[dict[str, Any], pydantic.BeforeValidator(_settings)]

#: Text that is printed and exported: on one line, and without characters that steer a terminal.
Line = Annotated[str, pydantic.AfterValidator(one_line)]

#: A number of things that were counted; the files that are exported hold them in 32 bits.
Count = Annotated[int, pydantic.Field(ge=0, lt=2**31)]

#: The same, of things of which there is at least one.
AtLeastOne = Annotated[int, pydantic.Field(ge=1, lt=2**31)]

#: A share, or a time [s].
FromZero = Annotated[float, pydantic.Field(ge=0.0)]


#: Name of the signal that stopped a run, or empty.
Stop = Annotated[str, pydantic.Field(pattern=r"^(SIGINT|SIGTERM)?$")]


def _payload(given: dict[str, Any]) -> dict[str, Any]:
    if isinstance(given.get("mass"), bool) or not isinstance(given.get("mass"), int | float):
        raise ValueError("expected the mass of the payload, a number [kg]")
    if not isinstance(given.get("model"), str) or given["model"] not in LOAD_MODELS:
        raise ValueError(f"expected one of {', '.join(LOAD_MODELS)} as the payload's model, got {given.get('model')!r}")
    return given


class VariableRecord(Record):
    """A decision variable: name, SI unit and bounds.

    Attributes:
        name: its name.
        unit: its SI unit.
        lower: least value [its unit].
        upper: greatest value [its unit].
    """

    name: Line
    unit: Line
    lower: float
    upper: float


class ObjectiveRecord(Record):
    """An objective: name, SI unit and the source of its formula.

    Attributes:
        name: its name.
        unit: its SI unit.
        reference: source of its formula.
    """

    name: Line
    unit: Line
    reference: Line

    @pydantic.model_validator(mode="after")
    def _with_units_of_joints(self) -> ObjectiveRecord:
        """Records once had ``SI`` where some joints turn and others slide."""
        joint = "(N*m or N)" if "effort" in self.name else "(rad or m)"
        unit = re.sub(r"\bSI\b", joint, self.unit)
        return self if unit == self.unit else self.model_copy(update={"unit": unit})


class ProblemRecord(Record):
    """What was solved. A registered problem can be made again from ``name`` and ``settings``.

    Attributes:
        name: name under which the problem is registered; empty if it is not.
        title: title of tables, reports and pictures.
        settings: its keyword arguments as plain data.
        robot: name of the robot.
        robot_reference: source of the robot's numbers.
        angle: unit in which angles are shown.
        length: unit in which lengths are shown.
        payload: mass [kg], centre of mass [m] and ``model``, which says how it acts.
        limits: quantity -> limit of each joint [SI], None where it has none; those of the negative direction, which end
            in ``_backward``, are there only if they differ.
        variables: decision variables, columns of ``X``.
        objectives: objectives, columns of ``F``.
        constraints: names of the constraints, columns of ``G``.
    """

    name: str
    title: Line
    settings: Settings
    robot: Line
    robot_reference: Line
    angle: Literal["rad", "deg"]
    length: Literal["m", "mm"] = "m"
    payload: Annotated[Settings, pydantic.AfterValidator(_payload)]
    limits: dict[str, tuple[float | None, ...]]
    variables: tuple[VariableRecord, ...]
    objectives: tuple[ObjectiveRecord, ...]
    constraints: tuple[Line, ...]

    @pydantic.model_validator(mode="after")
    def _names_differ(self) -> ProblemRecord:
        variables, objectives = ([each.name for each in named] for named in (self.variables, self.objectives))
        for kind, names in (("variables", variables), ("objectives", objectives), ("constraints", self.constraints)):
            twice = next((name for name, count in Counter(names).items() if count > 1), None)
            if twice is not None:
                raise ValueError(f"expected names of {kind} that differ, got {twice!r} twice")
        return self

    @classmethod
    def of(cls, problem: TrajectoryProblem) -> ProblemRecord:
        """Record of a problem.

        Raises:
            InvalidInputError: a setting of the problem is no plain data, or a number that is not finite.
        """
        given: dict[str, Any] = {
            "name": problem.registered_name,
            "title": problem.title,
            "settings": plain_data("settings", problem.settings),
            "robot": problem.robot.name,
            "robot_reference": problem.robot.reference,
            "angle": problem.angle,
            "length": problem.length,
            "payload": problem.dynamics.payload.settings,
            "limits": _limits(problem.robot.limits),
            "variables": tuple(
                VariableRecord(name=v.name, unit=v.unit, lower=v.lower, upper=v.upper) for v in problem.variables
            ),
            "objectives": tuple(
                ObjectiveRecord(name=o.name, unit=o.unit, reference=o.reference) for o in problem.objectives
            ),
            "constraints": problem.constraint_names,
        }
        try:
            return cls(**given)
        except pydantic.ValidationError as error:
            raise InvalidInputError(f"problem: {told(error)}") from error

    def check_registered(self) -> None:
        """Refuse the record of a problem that cannot be made again.

        Raises:
            NotRegisteredError: the problem is not registered.
        """
        if self.name not in list_problems():
            raise NotRegisteredError(self.title)

    def make(self) -> TrajectoryProblem:
        """The registered problem, made again from its settings.

        Raises:
            NotRegisteredError: the problem is not registered, or not any more.
            TrajevoError: it refuses the settings, or they name a file to read other than that of a robot.
        """
        self.check_registered()
        with opening_robots_only(f"the record of the problem {self.name!r}"):
            return load_problem(self.name, **self.settings)

    def difference(self, problem: TrajectoryProblem) -> str:
        """The first entry in which a problem differs from this record, with both values; empty if there is none.

        A setting that came with a later version of trajevo is not on record; it must have its default. Titles may
        differ, since they change no number.
        """
        found = ProblemRecord.of(problem).untitled
        later = set(found.settings) - set(self.settings)
        known = ProblemRecord.of(self.make()).settings if later and self.name in list_problems() else {}
        own = self.untitled
        settings = own.settings | {name: known[name] for name in later if name in known}
        return _difference({**dict(own), "settings": settings}, dict(found))

    @property
    def untitled(self) -> ProblemRecord:
        """The record without its title."""
        settings = {name: value for name, value in self.settings.items() if (name, value) != ("title", self.title)}
        return self.model_copy(update={"title": "", "settings": settings})


class FailedIndividual(Record):
    """An individual whose evaluation failed: its decision vector and the error message.

    Attributes:
        x: decision vector, shape (n_var,) [units of the variables].
        said: the error message.
    """

    x: tuple[float, ...]
    said: str


class Run(Record):
    """How a front was made.

    Attributes:
        algorithm: class name of the pymoo algorithm.
        settings: settings of the algorithm.
        seed: seed of all randomness.
        generations: number of finished generations.
        evaluations: individuals evaluated; a gradient of polishing counts as one evaluation per variable.
        failures: number of individuals whose evaluation raised an error or gave a number that is not finite.
        first_failure: error message of the first failure, or empty.
        failed: the first failures, at most a hundred.
        interrupted: whether the run was stopped before its end.
        stopped_by: name of the signal that stopped it, ``"SIGINT"`` or ``"SIGTERM"``, else empty.
        resumed: generations after which the run was resumed from a checkpoint.
        seconds: wall time [s].
        cpu_seconds: CPU time of the process at the end of every generation, and of polishing if there was any [s].
        versions: versions of Python and of the packages that computed the front.
        kernels: what computed the whole run, compiled loops or numpy; None for a run of an older version. Both give the
            same numbers to rounding, and each the same to the bit.
    """

    algorithm: Line
    settings: Settings
    seed: Annotated[int, pydantic.Field(ge=0)]
    generations: Count
    evaluations: Count
    failures: Count
    first_failure: str
    failed: tuple[FailedIndividual, ...] = ()
    interrupted: bool
    stopped_by: Stop = ""
    resumed: tuple[Count, ...] = ()
    seconds: FromZero
    cpu_seconds: tuple[FromZero, ...] = ()
    versions: dict[Line, Line]
    kernels: Kind | None = None


class History(Record):
    """The course of a run: one entry per generation, and one more for each polishing.

    The hypervolume is the dominated share of the box from 0 to ``reference_point``.

    Attributes:
        reference_point: far corner of the box, in SI units: that of the problem, or one derived from the first feasible
            points, or None.
        evaluations: individuals evaluated so far; a gradient counts as one evaluation per variable.
        hypervolume: hypervolume of all feasible points so far, computed when it is read.
        least_violation: least Σ max(G, 0) so far: 0 once an individual is feasible, None before the first successful
            evaluation.
        front_size: number of non-dominated feasible points so far.
    """

    reference_point: tuple[float, ...] | None
    evaluations: tuple[Count, ...]
    hypervolume: Volumes
    least_violation: tuple[FromZero | None, ...]
    front_size: tuple[Count, ...]


class Blocking(Record):
    """Why a front is empty: the individual that came nearest to being feasible.

    Attributes:
        x: its decision vector.
        violations: constraint -> excess as a share of the limit, the greatest first; empty if all evaluations failed.
        impossible: what rules out every motion, so that nothing was searched, see :func:`trajevo.check`.
    """

    x: tuple[float, ...]
    violations: dict[str, float]
    impossible: tuple[str, ...] = ()

    def __str__(self) -> str:
        if self.impossible:
            return f"nothing was searched, since no motion is possible: {'; '.join(self.impossible)}"
        if not self.violations:
            return "no individual could be evaluated"
        worst = ", ".join(f"{name} exceeds its limit by {100.0 * by:.3g} %" for name, by in self.violations.items())
        return f"nothing feasible was found; in the nearest miss {worst}"


class FrontFile(Record):
    """The whole content of a front's file.

    Attributes:
        format: what the file is.
        version: version of this format.
        problem: what was solved.
        run: how the front was made.
        history: the course of the run.
        blocking: why the front is empty, or None.
        X: decision vectors, a row per solution [units of the variables].
        F: objectives, a row per solution [units of the objectives].
        G: constraints, a row per solution, at most 0: excess as a share of the limit [1].
    """

    format: Literal["trajevo front"] = "trajevo front"
    version: Literal[1] = 1
    problem: ProblemRecord
    run: Run
    history: History
    blocking: Blocking | None
    X: tuple[tuple[float, ...], ...]
    F: tuple[tuple[float, ...], ...]
    G: tuple[tuple[float, ...], ...]

    @pydantic.model_validator(mode="after")
    def _rectangular(self) -> FrontFile:
        widths = len(self.problem.variables), len(self.problem.objectives), len(self.problem.constraints)
        if not self.problem.objectives:
            raise ValueError("expected at least one objective")
        if any(value > 0.0 for row in self.G for value in row):
            raise ValueError("expected feasible points, G of at most 0")
        lengths = {len(getattr(self.history, name)) for name in _BY_GENERATION}
        whole = len(lengths) == 1 and min(lengths) >= self.run.generations
        if not whole or (self.F and not self.run.generations):
            raise ValueError(f"expected a history of at least {self.run.generations} generations")
        for name, rows, width in zip("XFG", (self.X, self.F, self.G), widths, strict=True):
            if len(rows) != len(self.F) or any(len(row) != width for row in rows):
                raise ValueError(f"expected {len(self.F)} rows of {width} numbers in {name}")
        return self


def read_front(file: Path) -> FrontFile:
    """Read the content of a front's file.

    Raises:
        InvalidInputError: the file is missing or is not a front; the message names the entry.
    """
    try:
        return FrontFile.model_validate_json(read_text(file, most=MOST_DATA))
    except OSError as error:
        raise InvalidInputError(f"{file}: cannot be read: {why_not(error)}") from error
    except UnicodeDecodeError as error:
        raise InvalidInputError(f"{file}: is no front of trajevo: not UTF-8 text") from error
    except pydantic.ValidationError as error:
        raise InvalidInputError(f"{file}: is no front of trajevo: {told(error)}") from error


def _difference(recorded: Any, found: Any, place: str = "") -> str:
    """The first place at which two records differ, and both values."""
    if recorded == found:
        return ""
    if isinstance(recorded, dict) and isinstance(found, dict) and set(recorded) == set(found):
        key = next(key for key in recorded if recorded[key] != found[key])
        return _difference(recorded[key], found[key], f"{place}.{key}" if place else str(key))
    return f"{place}: {_shortened(recorded)} on record, {_shortened(found)} at hand"


def _shortened(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= _LONGEST_TEXT else f"{text[:_LONGEST_TEXT]}..."


def versions_since(begun: Mapping[str, str]) -> dict[str, str]:
    """Versions of a run that goes on here: those installed, with the formulas with which it was begun."""
    name = FORMULAS[0]
    return installed_versions() | {name: begun.get(name, "1")}


def installed_versions() -> dict[str, str]:
    """Versions of Python and of the packages that affect the results of a run."""
    return dict(_versions())


@cache
def _versions() -> dict[str, str]:
    found = {"python": platform.python_version()} | {package: version(package) for package in _PACKAGES}
    found[FORMULAS[0]] = FORMULAS[1]
    with suppress(PackageNotFoundError):
        found["numba"] = version("numba")
    return found


def _limits(limits: JointLimits) -> dict[str, tuple[float | None, ...]]:
    """Limits by name; those of the negative direction only where they differ."""
    return {name: _finite(values) for name, values in vars(limits).items() if values is not None}


def _finite(values: Iterable[float]) -> tuple[float | None, ...]:
    return tuple(float(value) if math.isfinite(value) else None for value in values)
