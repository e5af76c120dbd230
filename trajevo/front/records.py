"""What is known of a run, as plain frozen data that goes into files and comes back equal."""

from __future__ import annotations

import math
import platform
from collections.abc import Iterable
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from typing import Any, Literal

import pydantic

from trajevo.formulation.problem import TrajectoryProblem
from trajevo.front.hypervolume import Volumes

#: Packages whose versions decide what a run computes.
_PACKAGES = ("trajevo", "pymoo", "pin", "numpy", "scipy", "moocore", "ruckig")

#: Fields of a history with one entry per generation, and per polishing.
_BY_GENERATION = ("evaluations", "hypervolume", "least_violation", "front_size")


class Record(pydantic.BaseModel):
    """Frozen data that goes into JSON and comes back equal; no unknown keys, no NaN."""

    model_config = pydantic.ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class VariableRecord(Record):
    """A decision variable: name, SI unit and bounds."""

    name: str
    unit: str
    lower: float
    upper: float


class ObjectiveRecord(Record):
    """An objective: name, SI unit and where its formula stands."""

    name: str
    unit: str
    reference: str


class ProblemRecord(Record):
    """What was solved; a registered problem can be made again from ``name`` and ``settings``.

    Joint limits are SI, None where there is none; the payload's ``model`` says how it acts.
    """

    name: str
    title: str
    settings: dict[str, Any]
    robot: str
    robot_reference: str
    angle: str
    length: str = "m"
    payload: dict[str, Any]
    limits: dict[str, tuple[float | None, ...]]
    variables: tuple[VariableRecord, ...]
    objectives: tuple[ObjectiveRecord, ...]
    constraints: tuple[str, ...]

    @classmethod
    def of(cls, problem: TrajectoryProblem) -> ProblemRecord:
        """Record of a problem."""
        return cls(
            name=problem.registered_name,
            title=problem.title,
            settings=problem.settings,
            robot=problem.robot.name,
            robot_reference=problem.robot.reference,
            angle=problem.angle,
            length=problem.length,
            payload=problem.dynamics.payload.settings,
            limits={name: _finite(values) for name, values in vars(problem.robot.limits).items()},
            variables=tuple(
                VariableRecord(name=v.name, unit=v.unit, lower=v.lower, upper=v.upper) for v in problem.variables
            ),
            objectives=tuple(
                ObjectiveRecord(name=o.name, unit=o.unit, reference=o.reference) for o in problem.objectives
            ),
            constraints=problem.constraint_names,
        )


class FailedIndividual(Record):
    """An individual whose evaluation gave no numbers: its decision vector and what happened."""

    x: tuple[float, ...]
    said: str


class Run(Record):
    """How a front was made.

    Attributes:
        algorithm: class name of the pymoo algorithm.
        settings: its settings, every one that can be named.
        seed: seed of all randomness.
        generations: generations done.
        evaluations: individuals evaluated; a gradient, where the front was polished, counts as one for each variable.
        failures: individuals whose evaluation raised or gave a number that is not finite.
        first_failure: what the first of them said.
        failed: the first hundred of them.
        interrupted: whether the run was stopped before its end.
        stopped_by: name of the signal that stopped it, ``"SIGINT"`` or ``"SIGTERM"``, else empty.
        resumed: generations after which it went on from its checkpoint.
        seconds: wall time [s].
        cpu_seconds: CPU time of the process by the end of every generation, and of polishing where the front was [s].
        versions: versions of the packages that computed it, and of Python.
    """

    algorithm: str
    settings: dict[str, Any]
    seed: int
    generations: int
    evaluations: int
    failures: int
    first_failure: str
    failed: tuple[FailedIndividual, ...] = ()
    interrupted: bool
    stopped_by: str = ""
    resumed: tuple[int, ...] = ()
    seconds: float
    cpu_seconds: tuple[float, ...] = ()
    versions: dict[str, str]


class History(Record):
    """One entry per generation, and one for what polishing found where the front was polished at the end.

    The hypervolume is the share of the box from 0 to ``reference_point``.

    Attributes:
        reference_point: far corner of the box, objectives in SI; the problem's, else taken from the first feasible
            points, else None.
        evaluations: individuals evaluated so far; a gradient counts as one for each variable.
        hypervolume: of all feasible points so far; of a run in this process measured when it is looked at.
        least_violation: least Σ max(G, 0) so far, 0 once feasible, None before any number.
        front_size: non-dominated feasible points so far.
    """

    reference_point: tuple[float, ...] | None
    evaluations: tuple[int, ...]
    hypervolume: Volumes
    least_violation: tuple[float | None, ...]
    front_size: tuple[int, ...]


class Blocking(Record):
    """Why a front is empty: the individual that came nearest to being feasible.

    Attributes:
        x: its decision vector.
        violations: constraint -> excess as a share of the limit, the worst first; empty if no individual gave numbers.
    """

    x: tuple[float, ...]
    violations: dict[str, float]

    def __str__(self) -> str:
        if not self.violations:
            return "no individual could be evaluated"
        worst = ", ".join(f"{name} exceeds its limit by {100.0 * by:.3g} %" for name, by in self.violations.items())
        return f"nothing feasible was found; in the nearest miss {worst}"


class FrontFile(Record):
    """The whole content of a front's file."""

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


def installed_versions() -> dict[str, str]:
    """Versions of the packages that decide what a run computes, and of Python."""
    return dict(_versions())


@cache
def _versions() -> dict[str, str]:
    found = {"python": platform.python_version()} | {package: version(package) for package in _PACKAGES}
    with suppress(PackageNotFoundError):
        found["numba"] = version("numba")
    return found


def _finite(values: Iterable[float]) -> tuple[float | None, ...]:
    return tuple(float(value) if math.isfinite(value) else None for value in values)
