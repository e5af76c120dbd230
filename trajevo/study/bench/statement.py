"""A problem as anyone would write it: one decision vector at a time, without trajevo's maths."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.formulation.problem import TrajectoryProblem


@final
@dataclass(frozen=True, eq=False)
class Statement:
    """A problem for tools that call it with one decision vector at a time.

    Attributes:
        lower: least decision variables, shape (n_var,) [SI].
        upper: greatest decision variables, shape (n_var,) [SI].
        objectives: names of the objectives.
        units: their units.
        constraints: names of the constraints, which must not exceed 0.
    """

    lower: Array
    upper: Array
    objectives: tuple[str, ...]
    units: tuple[str, ...]
    constraints: tuple[str, ...]

    __repr__ = brief

    @classmethod
    def of(cls, problem: TrajectoryProblem) -> Statement:
        """The plain statement of a problem."""
        raise NotImplementedError(problem.title)

    def evaluate(self, x: Array) -> tuple[Array, Array]:
        """Objectives (n_obj,) and constraints (n_constr,) of one decision vector, shape (n_var,) [SI]."""
        raise NotImplementedError
