"""Records of a problem, a run and a front: frozen data that is equal after it is written to a file and read again."""

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

#: Packages whose versions affect the results of a run.
_PACKAGES = ("trajevo", "pymoo", "pin", "numpy", "scipy", "moocore", "daqp", "ruckig")

#: Fields of a history with one entry per generation, and one more for each polishing.
_BY_GENERATION = ("evaluations", "hypervolume", "least_violation", "front_size")


class Record(pydantic.BaseModel):
    """Frozen data that is equal after a round trip through JSON; unknown keys, NaN and infinity are refused."""

    model_config = pydantic.ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class VariableRecord(Record):
    """A decision variable: name, SI unit and bounds."""

    name: str
    unit: str
    lower: float
    upper: float


class ObjectiveRecord(Record):
    """An objective: name, SI unit and the source of its formula."""

    name: str
    unit: str
    reference: str


class ProblemRecord(Record):
    """What was solved. A registered problem can be made again from ``name`` and ``settings``.

    Joint limits are in SI units, None where a joint has no limit. ``payload["model"]`` says how the payload acts.
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
    """An individual whose evaluation failed: its decision vector and the error message."""

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
    evaluations: tuple[int, ...]
    hypervolume: Volumes
    least_violation: tuple[float | None, ...]
    front_size: tuple[int, ...]


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
    """Versions of Python and of the packages that affect the results of a run."""
    return dict(_versions())


@cache
def _versions() -> dict[str, str]:
    found = {"python": platform.python_version()} | {package: version(package) for package in _PACKAGES}
    with suppress(PackageNotFoundError):
        found["numba"] = version("numba")
    return found


def _finite(values: Iterable[float]) -> tuple[float | None, ...]:
    return tuple(float(value) if math.isfinite(value) else None for value in values)
