"""Constraints, pure functions of a rollout that are at most 0 where feasible, and kinds of limits.

A value of 0.05 means that the limit is exceeded by 5 %. Limits that are ``inf`` have no column.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.path.via_points import ViaPoints
from trajevo.robot.robot import Robot
from trajevo.trajectory.interpolants import Interpolant
from trajevo.trajectory.interpolants.interpolant import ArrangesPoints

#: How a limit is known to hold between samples: by the exact extremes of the motion, by a guaranteed bound, by
#: a proof that cuts the motion into pieces, or not at all, because only samples are checked.
Guarantee = Literal["extremes", "bound", "pieces", "samples"]

#: Quantities of constraints that are limits of a robot's joints.
JOINT_QUANTITIES = ("position", "velocity", "acceleration", "jerk", "effort")


@dataclass(frozen=True)
class Constraint:
    """Something that must not exceed 0.

    Attributes:
        names: one name per column.
        reference: source of the limits.
        function: rollout of B trajectories -> (B, len(names)).
        terms: rollout -> the smooth values whose maxima are the columns, (B, K); None if the columns are smooth
            themselves. Gradient solvers need the terms, since a maximum has a kink where it passes from one term to
            another. They are in the order of the segments if there are terms for each.
        terms_of: columns of the first terms, in the order of the terms, which is that of all further terms as well; if
            empty, the terms go through the columns one after another.
        sampled: the same limit at the samples alone, if this one is proven between them; otherwise None.
        quantity: the limited quantity, as certificates name it: ``"position"``, ``"velocity"``, ``"acceleration"``,
            ``"jerk"``, ``"effort"``, ``"tool speed"``, ``"clearance"`` and the like; ``""`` for a problem's own
            constraint on an unknown quantity.
        limit: limit of the quantity [SI], the same for all columns or one for each; None if a column is not measured
            against a fixed limit.
        unit: SI unit of the limit; ``"1"`` if the columns say only which share of it is used.
        share: share of the robot's joint limit that the motion may use, 1 for all of it; None if the constraint is not
            a limit of the robot's joints.
        proof: how the limit is known to hold between samples.
        provable: this constraint -> the same limit, proven at every instant, for kinds that bring their own proof.
    """

    names: tuple[str, ...]
    reference: str
    function: Callable[[Rollout], Array]
    terms: Callable[[Rollout], Array] | None = None
    sampled: Constraint | None = None
    quantity: str = ""
    limit: float | tuple[float, ...] | None = None
    unit: str = "1"
    share: float | None = None
    proof: Guarantee = "samples"
    terms_of: tuple[int, ...] = ()
    provable: Callable[[Constraint], Constraint] | None = None

    __repr__ = brief

    @property
    def term_period(self) -> int:
        """Number of terms after which their columns repeat."""
        return len(self.terms_of or self.names)

    def column_of_term(self, term: int) -> int:
        """Number of the column to whose maximum a term belongs."""
        place = term % self.term_period
        return self.terms_of[place] if self.terms_of else place

    @property
    def of_joints(self) -> bool:
        """Whether it is a limit of the robot's joints, or a share of one."""
        return self.share is not None and self.quantity in JOINT_QUANTITIES

    @property
    def at_samples(self) -> Constraint:
        """The limit at the samples alone; the constraint itself if it proves nothing between them."""
        return self if self.sampled is None else self.sampled


def in_terms(constraint: Constraint, example: Rollout) -> Constraint:
    """A constraint with a column for each of its terms; the same constraint if it has none.

    Args:
        constraint: any constraint.
        example: a rollout like those to be evaluated, from which the number of terms is taken.
    """
    if constraint.terms is None:
        return constraint
    count = constraint.terms(example).shape[1]
    names = tuple(f"term {k} of {constraint.names[0]} and the like" for k in range(count))
    return Constraint(names, constraint.reference, constraint.terms)


@final
@dataclass(frozen=True, eq=False)
class Limited:
    """What a limit applies to.

    Attributes:
        robot: the robot.
        points: the points that it visits.
        interpolant: the interpolant of its motion through them.
    """

    robot: Robot
    points: ViaPoints
    interpolant: Interpolant

    @property
    def moved_from(self) -> Array | None:
        """Origin of the robot's base at its given place, shape (3,) [m], if the base moves; else None."""
        return self.interpolant.base_origin if isinstance(self.interpolant, ArrangesPoints) else None

    @property
    def tilts(self) -> bool:
        """Whether the base may be tilted."""
        return isinstance(self.interpolant, ArrangesPoints) and self.interpolant.base_tilts


#: Greatest number of a parameter of a limit, by its unit.
_NO_MORE = {"m": 100.0, "m/s": 50.0}


def positive(name: str, value: Any, unit: str) -> float:
    """A positive number.

    Raises:
        InvalidInputError: something else.
    """
    if not _is_number(value) or not value > 0.0:
        raise InvalidInputError(f"{name}: expected a positive number [{unit}], got {value!r}")
    return _in_si(name, float(value), unit)


def finite(name: str, value: Any, unit: str) -> float:
    """A finite number.

    Raises:
        InvalidInputError: something else.
    """
    if not _is_number(value):
        raise InvalidInputError(f"{name}: expected a finite number [{unit}], got {value!r}")
    return _in_si(name, float(value), unit)


def _in_si(name: str, value: float, unit: str) -> float:
    """A number that can be in SI: no tool is as fast, and no floor as far away, as a mistaken unit makes it."""
    if unit in ("m", "m/s") and abs(value) > _NO_MORE[unit]:
        likely = f"m{unit}"
        raise InvalidInputError(
            f"{name}: {value:g} {unit} looks like {likely}: expected at most {_NO_MORE[unit]:g} {unit}, "
            f"{1e-3 * value:g} if it is {likely}"
        )
    return value


def share_kept_free(name: str, value: Any, unit: str) -> float:
    """A share of a limit that is kept free, from 0 to below 1.

    Raises:
        InvalidInputError: something else.
    """
    if not _is_number(value) or not 0.0 <= value < 1.0:
        share = f", which looks like percent: {0.01 * value:g}" if _is_number(value) and 1.0 <= value < 100.0 else ""
        raise InvalidInputError(f"{name}: expected a share from 0 to below 1, got {value!r}{share}")
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
        unit: SI unit of the value, ``"1"`` for a share, ``""`` if it is not a number.
        help: description in one line.
        check: name, given value and unit -> the value to use; raises InvalidInputError.
        default: value if none is given; None for a parameter whose presence switches the limit on.
        type: type of the key in a task's file: ``float``, ``int``, ``bool``, ``str``, ``list[float]``,
            ``dict[str, Any]``.
        table: whether it is a table of its own in a task, not a key of ``[constraints]``.
        plain: value -> plain data from which an equal value can be made; None if given values are plain data.
    """

    name: str
    unit: str
    help: str
    check: Callable[[str, Any, str], Any] = positive
    default: Any = field(default=None, kw_only=True)
    type: Any = field(default=float, kw_only=True)
    table: bool = field(default=False, kw_only=True)
    plain: Callable[[Any], Any] | None = field(default=None, kw_only=True)

    __repr__ = brief

    def value(self, given: Any) -> Any:
        """The given value, checked; None stays None if that is the default."""
        return None if given is None and self.default is None else self.check(self.name, given, self.unit)

    def setting(self, given: Any) -> Any:
        """The given value as plain data."""
        if self.plain is None or given is None:
            return given.item() if isinstance(given, np.generic) else given
        return self.plain(self.value(given))


@final
@dataclass(frozen=True)
class LimitKind:
    """A kind of limit.

    A kind without parameters, or whose parameters all have defaults, is switched on by its name among the constraints;
    any other kind by giving its parameters.

    Attributes:
        name: name of the kind.
        help: what is limited, in one line.
        make: what the limit applies to, and the values of the parameters by name -> the constraint.
        parameters: its parameters.
    """

    name: str
    help: str
    make: Callable[..., Constraint]
    parameters: tuple[LimitParameter, ...] = ()

    __repr__ = brief

    @property
    def by_name(self) -> bool:
        """Whether the kind is switched on by its name."""
        return all(parameter.default is not None for parameter in self.parameters)

    def asked_for(self, given: dict[str, Any]) -> bool:
        """Whether the given parameters switch the limit on.

        Raises:
            InvalidInputError: some of the parameters that the limit needs are given and others are missing.
        """
        needed = [parameter.name for parameter in self.parameters if parameter.default is None]
        missing = [name for name in needed if given.get(name) is None]
        told = [p for p in self.parameters if given.get(p.name) is not None]
        there = [p.name for p in told if p.default is None or given[p.name] != p.default]
        if missing and there:
            raise InvalidInputError(
                f"{there[0]}: expected {missing[0]} with it, which the limit {self.name!r} needs too"
            )
        return bool(needed) and not missing

    def constraint(self, limited: Limited, given: dict[str, Any]) -> Constraint:
        """The constraint with its own parameters from all those given."""
        values = {p.name: p.value(given.get(p.name, p.default)) for p in self.parameters}
        return self.make(limited, **values)
