"""What a kind of limit is: its name, its parameters, and how it becomes a constraint on a robot's motions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, final

import numpy as np

from trajevo.errors import InvalidInputError
from trajevo.formulation.constraints.constraint import Constraint
from trajevo.path.via_points import ViaPoints
from trajevo.robot.robot import Robot
from trajevo.trajectory.interpolants import Interpolant


@final
@dataclass(frozen=True, eq=False)
class Limited:
    """What a limit is made for.

    Attributes:
        robot: the robot.
        points: what it visits.
        interpolant: how it moves through them.
    """

    robot: Robot
    points: ViaPoints
    interpolant: Interpolant


def positive(name: str, value: Any, unit: str) -> float:
    """A positive number.

    Raises:
        InvalidInputError: something else.
    """
    if not _is_number(value) or not value > 0.0:
        raise InvalidInputError(f"{name}: expected a positive number [{unit}], got {value!r}")
    return float(value)


def finite(name: str, value: Any, unit: str) -> float:
    """A finite number.

    Raises:
        InvalidInputError: something else.
    """
    if not _is_number(value):
        raise InvalidInputError(f"{name}: expected a finite number [{unit}], got {value!r}")
    return float(value)


def share_kept_free(name: str, value: Any, unit: str) -> float:
    """A share of a limit that is kept free, from 0 to below 1.

    Raises:
        InvalidInputError: something else.
    """
    if not _is_number(value) or not 0.0 <= value < 1.0:
        raise InvalidInputError(f"{name}: expected a share from 0 to below 1, got {value!r}")
    return float(value)


def _is_number(value: Any) -> bool:
    real = isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)
    return real and bool(np.isfinite(value))


@final
@dataclass(frozen=True)
class Parameter:
    """A parameter of a limit.

    It is a keyword argument of :class:`~trajevo.formulation.via_points.ViaPointProblem`, a key of ``[constraints]`` in
    a task, and ``--set NAME=VALUE`` on the command line.

    Attributes:
        name: of argument and key.
        unit: SI unit of the value, ``"1"`` for a share, ``""`` for no number.
        help: one line that says what it is.
        check: name, what was given and unit -> the value that is used; raises InvalidInputError.
        default: the value where none is given; None of a parameter that makes the limit hold by being given.
        type: of the key in a task's file: ``float``, ``int``, ``bool``, ``str``, ``list[float]``, ``dict[str, Any]``.
        table: whether in a task it is a table of its own instead of a key of ``[constraints]``.
        plain: the value -> plain data that gives an equal one; what was given is plain data if None.
    """

    name: str
    unit: str
    help: str
    check: Callable[[str, Any, str], Any] = positive
    default: Any = field(default=None, kw_only=True)
    type: Any = field(default=float, kw_only=True)
    table: bool = field(default=False, kw_only=True)
    plain: Callable[[Any], Any] | None = field(default=None, kw_only=True)

    def value(self, given: Any) -> Any:
        """What was given, checked; None stays None where that is the default."""
        return None if given is None and self.default is None else self.check(self.name, given, self.unit)

    def setting(self, given: Any) -> Any:
        """What was given as plain data."""
        return given if self.plain is None or given is None else self.plain(self.value(given))


@final
@dataclass(frozen=True)
class LimitKind:
    """A kind of limit.

    A kind whose parameters all have defaults, or that has none, holds where it is named among the constraints; another
    where its parameters are given.

    Attributes:
        name: of the kind.
        help: one line that says what must not exceed what.
        make: what is limited, and the values of the parameters by name -> the constraint.
        parameters: what it takes.
    """

    name: str
    help: str
    make: Callable[..., Constraint]
    parameters: tuple[Parameter, ...] = ()

    @property
    def by_name(self) -> bool:
        """Whether it is asked for by its name."""
        return all(parameter.default is not None for parameter in self.parameters)

    def asked_for(self, given: dict[str, Any]) -> bool:
        """Whether parameters that were given ask for it.

        Raises:
            InvalidInputError: some of those that do are there and others are missing.
        """
        needed = [parameter.name for parameter in self.parameters if parameter.default is None]
        missing = [name for name in needed if given.get(name) is None]
        if missing and any(given.get(parameter.name) is not None for parameter in self.parameters):
            there = next(p.name for p in self.parameters if given.get(p.name) is not None)
            raise InvalidInputError(f"{there}: expected {missing[0]} with it, which the limit {self.name!r} needs too")
        return bool(needed) and not missing

    def constraint(self, limited: Limited, given: dict[str, Any]) -> Constraint:
        """The constraint, of the parameters among those that were given."""
        values = {p.name: p.value(given.get(p.name, p.default)) for p in self.parameters}
        return self.make(limited, **values)
