"""A task that was read from a file, and how it is solved."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

from trajevo.base.shown import html
from trajevo.base.shown.brief import brief
from trajevo.formulation.examples import example_file
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.formulation.search import Search
from trajevo.formulation.task import task_problem
from trajevo.formulation.task_file import TaskSettings, read_task
from trajevo.front.front import Front
from trajevo.solvers.optimise import optimise


@final
@dataclass(frozen=True, eq=False)
class Task:
    """A task that was read from a file: its problem, and the settings of the search.

    Attributes:
        file: file of the task.
        settings: keys of the file.
        problem: the problem, the same as if its class were called with the same values.
        search: settings of the search, unless others are given to :meth:`solve`.
    """

    file: Path
    settings: TaskSettings
    problem: TrajectoryProblem
    search: Search

    __repr__ = brief

    def _repr_html_(self) -> str:
        given = {name: str(value) for name, value in self.search.given.items()}
        return html.shown(f"Task {self.file.name}", html.facts(given), html.Piece(self.problem._repr_html_()))

    def solve(self, **options: Any) -> Front:
        """Solve the task; arguments take precedence over the file.

        Args:
            **options: arguments of :func:`trajevo.optimise`, including settings of the search.
        """
        return optimise(self.problem, self.search, **options)


def load_task(file: str | Path) -> Task:
    """Read a task.

    Args:
        file: TOML file, see :class:`~trajevo.formulation.task_file.TaskSettings`; paths in it are relative to its
            folder. Or the name of an example, see ``trajevo examples``.

    Raises:
        UnknownNameError: neither a file nor the name of an example.
        InvalidInputError: the file cannot be read, or a key is missing or unknown or has an invalid value; the message
            names file, line and key.
    """
    path = example_file("task", file)
    settings, where = read_task(path)
    return Task(path, settings, task_problem(settings, where), settings.search)
