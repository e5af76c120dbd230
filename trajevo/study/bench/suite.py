"""The problems of the suite: a folder each, with a task, or the name of a registered problem, and its reference.

To add a problem, add a folder with ``task.toml`` and ``reference.json``, and what the task names beside them; see
:class:`~trajevo.study.bench.reference.ReferenceFile`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, final

from trajevo.base.files import data_folder
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError, checked_name, no_such_file
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.formulation.registry import load_problem
from trajevo.formulation.search import Search
from trajevo.solvers.task import load_task
from trajevo.study.bench.reference import Published, Reference, ReferenceFile

if TYPE_CHECKING:
    from trajevo.study.bench.statement import Statement

#: Files of a problem.
TASK, REFERENCE = "task.toml", "reference.json"


@final
@dataclass(frozen=True, eq=False)
class BenchmarkProblem:
    """A problem of the suite.

    Attributes:
        name: name of its folder.
        folder: its folder.
        told: what its reference file says, not yet checked.
    """

    name: str
    folder: Path
    told: ReferenceFile

    __repr__ = brief

    @property
    def title(self) -> str:
        """What it is, in one line."""
        return self.told.title

    @property
    def source(self) -> str:
        """Where it is from."""
        return self.told.source

    @property
    def published(self) -> tuple[Published, ...]:
        """What others have printed of it."""
        return self.told.published

    def problem(self) -> TrajectoryProblem:
        """The problem itself, made anew."""
        if self.told.registered is not None:
            return load_problem(self.told.registered.name, **self.told.registered.arguments)
        return load_task(self.folder / TASK).problem

    @property
    def search(self) -> Search:
        """The settings of a search that the task, or the registered problem, comes with."""
        if self.told.registered is not None:
            return self._problem.evolution
        return load_task(self.folder / TASK).search

    @cached_property
    def reference(self) -> Reference:
        """The best known set, evaluated again and checked when it is first read."""
        return Reference.of(self.told, self._problem, str(self.folder / REFERENCE))

    def statement(self, *, instants: int | None = None) -> Statement:
        """The same problem, one decision vector at a time, in SciPy and Pinocchio alone, for other tools.

        Args:
            instants: instants of a motion at which its limits are looked at; those of the problem if None.
        """
        from trajevo.study.bench.statement import Statement

        return Statement.of(self._problem, instants=instants)

    @cached_property
    def _problem(self) -> TrajectoryProblem:
        return self.problem()


def bench_folder() -> Path:
    """The folder with the problems of the suite."""
    return data_folder("problems") / "bench"


def benchmarks(folder: Path | None = None) -> tuple[str, ...]:
    """Names of the problems of the suite, in alphabetical order.

    Args:
        folder: folder with other problems; that of the suite if None.
    """
    return tuple(sorted(file.parent.name for file in (folder or bench_folder()).glob(f"*/{REFERENCE}")))


def benchmark(name: str, folder: Path | None = None) -> BenchmarkProblem:
    """A problem of the suite.

    Args:
        name: a name of :func:`benchmarks`.
        folder: folder with other problems; that of the suite if None.

    Raises:
        UnknownNameError: no such problem.
        InvalidInputError: its files cannot be used, or it has both a task and a registered problem, or neither.
    """
    own = (folder or bench_folder()) / checked_name("benchmark", name, benchmarks(folder))
    told = ReferenceFile.read(own / REFERENCE)
    has_task = (own / TASK).is_file()
    if has_task and told.registered is not None:
        raise InvalidInputError(f"{own / REFERENCE}: registered: expected none beside {TASK}")
    if not has_task and told.registered is None:
        raise InvalidInputError(no_such_file(own / TASK))
    return BenchmarkProblem(name, own, told)
