"""Problems by name: trajevo's own and those of other packages, found through their entry points."""

from __future__ import annotations

import inspect
from importlib.metadata import EntryPoint
from typing import Any

from trajevo.base.plugins import loaded, registered
from trajevo.errors import InvalidInputError, UnknownNameError
from trajevo.formulation.problem import TrajectoryProblem

ENTRY_POINT_GROUP = "trajevo.problems"


def list_problems() -> dict[str, EntryPoint]:
    """Registered problems by name: trajevo's own and those of other installed packages."""
    return registered(ENTRY_POINT_GROUP)


def problem_class(name: str) -> type[TrajectoryProblem]:
    """Class of a registered problem.

    Raises:
        UnknownNameError: no such problem.
        InvalidInputError: the registered object is not a TrajectoryProblem.
    """
    problems = list_problems()
    if name not in problems:
        raise UnknownNameError("problem", name, problems)
    found: type[TrajectoryProblem] = loaded(problems[name], "problem", "a TrajectoryProblem", _is_problem)
    return found


def load_problem(name: str, /, **arguments: Any) -> TrajectoryProblem:
    """Make a registered problem.

    Args:
        name: a key of :func:`list_problems`.
        **arguments: the problem's own keyword arguments.

    Raises:
        UnknownNameError: no such problem.
        InvalidInputError: the problem takes no such argument, or refuses its value.
    """
    found = problem_class(name)
    accepted = list(inspect.signature(found).parameters)
    for key in arguments:
        if key not in accepted:
            raise InvalidInputError(f"problem {name!r} takes no {key!r}; it takes: {', '.join(accepted)}")
    return found(**arguments)


def _is_problem(found: Any) -> bool:
    return isinstance(found, type) and issubclass(found, TrajectoryProblem)
