"""What every constraint is, a pure function of a rollout, at most 0 where feasible, and what every kind of limit is.

A value of 0.05 means that the limit is exceeded by 5 %. Limits that are ``inf`` have no column.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.path.via_points import ViaPoints
from trajevo.robot.robot import Robot
from trajevo.trajectory.interpolants import Interpolant

#: How a limit is known to hold between samples: by the exact extremes of the motion, by a guaranteed bound, by
#: a proof that cuts the motion into pieces, or not at all, since samples alone are looked at.
Guarantee = Literal["extremes", "bound", "pieces", "samples"]


@dataclass(frozen=True)
class Constraint:
    """Something that must not exceed 0.

    Attributes:
        names: one name per column.
        reference: where the limits stand.
        function: rollout of B trajectories -> (B, len(names)).
        terms: what the columns are the greatest of, in as many columns as that takes, (B, K); None where the columns
            are smooth themselves. A gradient solver goes astray where a greatest passes from one term to another.
        sampled: the same limit at the samples alone, of one that is proven between them.
        quantity: what is limited, as certificates name it: ``"position"``, ``"velocity"``, ``"acceleration"``,
            ``"jerk"``, ``"effort"``, ``"tool speed"``, ``"clearance"`` and the like; ``""`` for something of the
            problem's own of which nothing more is known.
        limit: what the quantity is held to [SI], the same for all columns or one for each; None where a column is
            measured against something else.
        share: which share of the robot's own limit is left to the motion, 1 for all of it; None of what is no limit
            of a robot's joints.
        proof: how it is known to hold between samples.
    """

    names: tuple[str, ...]
    reference: str
    function: Callable[[Rollout], Array]
    terms: Callable[[Rollout], Array] | None = None
    sampled: Constraint | None = None
    quantity: str = ""
    limit: float | tuple[float, ...] | None = None
    share: float | None = None
    proof: Guarantee = "samples"

    @property
    def at_samples(self) -> Constraint:
        """The limit at the samples alone; itself where nothing more is proven."""
        return self if self.sampled is None else self.sampled


def in_terms(constraint: Constraint, example: Rollout) -> Constraint:
    """A constraint with a column for each of its terms; the same where it has none.

    Args:
        constraint: any.
        example: a rollout like those that it will be asked about, which tells how many terms there are.
    """
    if constraint.terms is None:
        return constraint
    count = constraint.terms(example).shape[1]
    names = tuple(f"term {k} of {constraint.names[0]} and the like" for k in range(count))
    return Constraint(names, constraint.reference, constraint.terms)


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
class LimitParameter:
    """A parameter of a kind of limit.

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
        if self.plain is None or given is None:
            return given.item() if isinstance(given, np.generic) else given
        return self.plain(self.value(given))


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
    parameters: tuple[LimitParameter, ...] = ()

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
