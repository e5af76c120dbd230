"""Robot, interpolant, objectives and constraints as a pymoo problem."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from importlib.metadata import EntryPoint, entry_points
from typing import Any, ClassVar

import numpy as np
from pymoo.core.problem import Problem

from trajevo.arrays import Array, read_only
from trajevo.constraints import Constraint
from trajevo.dynamics import Rollout
from trajevo.errors import InvalidInputError, UnknownNameError
from trajevo.interpolants import Interpolant
from trajevo.objectives import Objective
from trajevo.robot import Robot
from trajevo.trajectory import TrajectoryBatch

ENTRY_POINT_GROUP = "trajevo.problems"


class TrajectoryProblem(Problem):
    """A multi-objective trajectory problem that stock pymoo can minimise.

    Variables, objectives and constraints are SI. An individual whose evaluation raises or gives NaN has infinite
    objectives and constraints and says why in its ``"failure"``: it loses every comparison and never enters a front,
    and the others are not touched.

    Attributes:
        registered_name: name under which the problem is registered in the entry-point group ``trajevo.problems``;
            empty for a problem that is put together by hand.
        title: one line that says what is solved.
        robot: the robot.
        interpolant: decision vectors -> trajectories.
        objectives: what is minimised.
        constraints: what must not exceed 0.
        reference_point: objective values that bound the hypervolume, shape (n_obj,), or None.
        angle: unit in which people read this problem's angles, ``"rad"`` or ``"deg"``.

    Raises:
        InvalidInputError: no objectives, names that repeat, or a reference point of another length.
    """

    registered_name: ClassVar[str] = ""
    title: ClassVar[str] = "trajectory problem"

    def __init__(
        self,
        *,
        robot: Robot,
        interpolant: Interpolant,
        objectives: Sequence[Objective],
        constraints: Sequence[Constraint],
        reference_point: Sequence[float] | None = None,
        angle: str = "rad",
    ) -> None:
        self.robot = robot
        self.interpolant = interpolant
        self.objectives = tuple(objectives)
        self.constraints = tuple(constraints)
        self.reference_point = None if reference_point is None else read_only(reference_point)
        self.angle = angle
        for kind, names in (("objectives", self.objective_names), ("constraints", self.constraint_names)):
            if len(set(names)) != len(names):
                raise InvalidInputError(f"{kind}: names must differ, got {list(names)}")
        if not self.objectives:
            raise InvalidInputError("objectives: expected at least one")
        if self.reference_point is not None and self.reference_point.shape != (len(self.objectives),):
            raise InvalidInputError(
                f"reference_point: expected {len(self.objectives)} numbers, got shape {self.reference_point.shape}"
            )
        variables = interpolant.variables
        super().__init__(
            n_var=len(variables),
            n_obj=len(self.objectives),
            n_ieq_constr=len(self.constraint_names),
            xl=np.array([variable.lower for variable in variables]),
            xu=np.array([variable.upper for variable in variables]),
        )

    @property
    def objective_names(self) -> tuple[str, ...]:
        """Names of the columns of F."""
        return tuple(objective.name for objective in self.objectives)

    @property
    def objective_units(self) -> tuple[str, ...]:
        """SI units of the columns of F."""
        return tuple(objective.unit for objective in self.objectives)

    @property
    def constraint_names(self) -> tuple[str, ...]:
        """Names of the columns of G."""
        return tuple(name for constraint in self.constraints for name in constraint.names)

    @property
    def settings(self) -> dict[str, Any]:
        """Keyword arguments that make an equal problem, as plain data; a registered problem says which."""
        return {}

    def decode(self, x: Array) -> TrajectoryBatch:
        """Trajectories of decision vectors, shape (B, n_var) or one vector (n_var,)."""
        return self.interpolant(np.atleast_2d(np.asarray(x, dtype=np.float64)))

    def rollout(self, x: Array) -> Rollout:
        """The robot on the trajectories of decision vectors, shape (B, n_var) or one vector (n_var,)."""
        return Rollout(self.robot, self.decode(x))

    def _evaluate(self, x: Array, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        failures = [""] * len(x)
        try:
            F, G = self._evaluate_rows(x)
        except Exception:  # noqa: BLE001 - whatever one individual raises must not end the run of the others
            F, G, failures = self._evaluate_one_by_one(x)
        for i in np.flatnonzero(~np.isfinite(F).all(axis=1) | np.isnan(G).any(axis=1)):
            failures[i] = failures[i] or "an objective or a constraint is not a number"
            F[i], G[i] = np.inf, np.inf
        out["F"], out["G"] = F, G
        if any(failures):
            out["failure"] = np.array(failures, dtype=object)

    def _evaluate_rows(self, x: Array) -> tuple[Array, Array]:
        rollout = self.rollout(x)
        F = np.stack([objective.function(rollout) for objective in self.objectives], axis=1)
        columns = [constraint.function(rollout) for constraint in self.constraints]
        return F, np.concatenate([*columns, np.empty((len(F), 0))], axis=1)

    def _evaluate_one_by_one(self, x: Array) -> tuple[Array, Array, list[str]]:
        """Only after the batch raised: find the individuals that do, and keep what they say."""
        F, G = np.full((len(x), self.n_obj), np.nan), np.full((len(x), self.n_ieq_constr), np.nan)
        failures = [""] * len(x)
        for i in range(len(x)):
            try:
                F[i : i + 1], G[i : i + 1] = self._evaluate_rows(x[i : i + 1])
            except Exception as error:  # noqa: BLE001 - as above; the message is kept and reported
                failures[i] = f"{type(error).__name__}: {error}"
        return F, G, failures


def list_problems() -> dict[str, EntryPoint]:
    """Registered problems by name: trajevo's own and those of other installed packages."""
    return {point.name: point for point in sorted(entry_points(group=ENTRY_POINT_GROUP), key=lambda point: point.name)}


def problem_class(name: str) -> type[TrajectoryProblem]:
    """Class of a registered problem.

    Raises:
        UnknownNameError: no such problem.
        InvalidInputError: what is registered is not a TrajectoryProblem.
    """
    registered = list_problems()
    if name not in registered:
        raise UnknownNameError("problem", name, registered)
    found = registered[name].load()
    if not (isinstance(found, type) and issubclass(found, TrajectoryProblem)):
        raise InvalidInputError(f"problem {name!r}: {registered[name].value} is not a TrajectoryProblem")
    return found


def load_problem(name: str, **arguments: Any) -> TrajectoryProblem:
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
