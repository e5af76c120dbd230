"""Constraints of the user's own: functions of a rollout, and constraints that are made by hand, as kinds of limits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.complex_step import unstepped
from trajevo.base.plugins import first_line, plain_name
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.formulation.constraints.constraint import Constraint, Limited, LimitKind


def own_kind(place: str, thing: Any) -> LimitKind:
    """The kind of limit that a user's function or constraint is.

    A function takes a rollout of B motions and gives one number for each, shape (B,) or (B, 1), at most 0 where the
    motion is allowed. It is known at the samples only, and certificates say so.

    Raises:
        InvalidInputError: something else, a function without a name, or a constraint without columns.
    """
    if isinstance(thing, Constraint):
        if not thing.names:
            raise InvalidInputError(f"constraints: {place!r}: expected at least one column, got none")
        return LimitKind(thing.names[0], thing.reference, _As(thing))
    name = plain_name("constraint", place, thing, "Constraint(('my_name',), 'source', function)")
    made = Constraint((name,), place, _Column(thing))
    return LimitKind(name, first_line(thing), _As(made))


@final
@dataclass(frozen=True)
class _As:
    constraint: Constraint

    def __call__(self, limited: Limited) -> Constraint:
        return self.constraint


@final
@dataclass(frozen=True)
class _Column:
    """A function that gives one number for each motion, as one column."""

    function: Callable[[Rollout], Array]

    def __call__(self, rollout: Rollout) -> Array:
        found: Array = np.asarray(unstepped(self.function(rollout)))
        return found[:, None] if found.ndim == 1 else found
