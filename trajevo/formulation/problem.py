"""Robot, interpolant, objectives and constraints as a pymoo problem."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from pymoo.core.problem import Problem

from trajevo.base.arrays import Array, keep_heap, numbers, read_only
from trajevo.base.threads import in_threads
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.formulation.constraints.constraint import Constraint, in_terms
from trajevo.formulation.evaluation import TimeLimited, evaluate_each
from trajevo.formulation.objectives import Objective
from trajevo.formulation.search import USUAL, Search
from trajevo.robot.payload import Payload
from trajevo.robot.robot import Robot
from trajevo.trajectory.batch import TrajectoryBatch
from trajevo.trajectory.interpolants import Interpolant, Variable

#: Far below rounding of any real part: the imaginary part over it is the derivative.
_COMPLEX_STEP = 1e-20

#: Numbers of one quantity that are worked on at a time, a megabyte, and individuals at the least.
_CACHED, _FEWEST, _FIRST = 2**17, 16, 128


@dataclass(frozen=True, eq=False)
class SmoothForm:
    """A problem again, with objectives and constraints that a gradient solver can differentiate.

    Attributes:
        problem: the smooth problem, its objectives the same.
        into: decision vectors of the problem -> of the smooth one, rows to rows.
        back: decision vectors of the smooth one -> of the problem, where limits hold that the smooth one only nearly
            keeps.
    """

    problem: TrajectoryProblem
    into: Callable[[Array], Array]
    back: Callable[[Array], Array]


@dataclass(frozen=True, eq=False)
class Expansion:
    """What the solutions of a problem stand for when each is a whole curve of solutions of another.

    Attributes:
        problem: the other problem.
        points: X (N, n_var) and F (N, n_obj) of the problem -> decision vectors and objectives of the other, along the
            curves' lower envelope.
        fold: decision vectors of the other -> of the problem.
    """

    problem: TrajectoryProblem
    points: Callable[[Array, Array], tuple[Array, Array]]
    fold: Callable[[Array], Array]


class TrajectoryProblem(Problem):
    """A multi-objective trajectory problem that stock pymoo can minimise.

    Variables, objectives and constraints are SI. To the bit, what an individual gets does not depend on what else is
    evaluated with it, in which order or on how many threads. An individual whose evaluation raises or gives NaN has
    infinite objectives and constraints and says why in its ``"failure"``: it loses every comparison and never enters a
    front, and the others are not touched.

    Attributes:
        registered_name: name under which the problem is registered in the entry-point group ``trajevo.problems``;
            empty for a problem that is put together by hand.
        title: one line that says what is solved.
        dynamics: the robot, what it carries, and how finely its effort is sampled.
        interpolant: decision vectors -> trajectories.
        objectives: what is minimised.
        constraints: what must not exceed 0.
        payload_range: where the payload's mass is a decision variable, the last one, its bounds [kg]; else None.
        evolution: what a search is unless told otherwise, as the problem's paper has it.
        paper_weights: weights and scales of the paper's weighted sum, where it has one.
        compares_rivals: whether reports set other interpolants through the same points beside it.
        reference_point: objective values that bound the hypervolume, shape (n_obj,), or None.
        angle: unit in which people read this problem's angles, ``"rad"`` or ``"deg"``.
        length: unit in which people read its lengths, ``"m"`` or ``"mm"``.
        smooth: the form that gradient solvers are given, or None for the problem itself.
        expansion: the problem that its solutions are curves of, or None.
        time_limited: what evaluates populations under a time limit, or None for no limit.

    Raises:
        InvalidInputError: no objectives, names that repeat, or a reference point of another length.
    """

    registered_name: ClassVar[str] = ""
    title: ClassVar[str] = "trajectory problem"
    evolution: ClassVar[Search] = USUAL
    paper_weights: ClassVar[Weights | None] = None
    compares_rivals: ClassVar[bool] = False
    smooth: SmoothForm | None = None
    expansion: Expansion | None = None
    time_limited: TimeLimited | None = None
    _chunk: int = _FIRST

    def __init__(
        self,
        *,
        dynamics: Dynamics,
        interpolant: Interpolant,
        objectives: Sequence[Objective],
        constraints: Sequence[Constraint],
        payload_range: tuple[float, float] | None = None,
        reference_point: Sequence[float] | None = None,
        angle: str = "rad",
        length: str = "m",
    ) -> None:
        keep_heap()
        self.dynamics = dynamics
        self.interpolant = interpolant
        self.payload_range = payload_range
        self.objectives = tuple(objectives)
        self.constraints = tuple(constraints)
        self.angle, self.length = angle, length
        for kind, names in (("objectives", self.objective_names), ("constraints", self.constraint_names)):
            if len(set(names)) != len(names):
                raise InvalidInputError(f"{kind}: names must differ, got {list(names)}")
        if not self.objectives:
            raise InvalidInputError("objectives: expected at least one")
        self.reference_point: Array | None = None
        if reference_point is not None:
            corner = numbers(reference_point, name="reference_point", shape=(len(self.objectives),))
            if not (corner > 0.0).all():
                raise InvalidInputError(f"reference_point: expected positive numbers, got {corner.tolist()}")
            self.reference_point = read_only(corner)
        variables = self.variables
        super().__init__(
            n_var=len(variables),
            n_obj=len(self.objectives),
            n_ieq_constr=len(self.constraint_names),
            xl=np.array([variable.lower for variable in variables]),
            xu=np.array([variable.upper for variable in variables]),
        )

    @property
    def robot(self) -> Robot:
        """The robot."""
        return self.dynamics.robot

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The decision variables: the interpolant's, then the payload's mass where it is one."""
        own = () if self.payload_range is None else (Variable("payload", "kg", *self.payload_range),)
        return self.interpolant.variables + own

    @property
    def objective_names(self) -> tuple[str, ...]:
        """Names of the columns of F."""
        return tuple(objective.name for objective in self.objectives)

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
        return self.interpolant(self._timing(x))

    def rollout(self, x: Array) -> Rollout:
        """The robot on the trajectories of decision vectors, shape (B, n_var) or one vector (n_var,)."""
        masses = None if self.payload_range is None else np.atleast_2d(x)[:, -1]
        return Rollout(self.dynamics, self.decode(x), masses)

    def via_times(self, x: Array) -> Array:
        """Instants at which the via points are passed, (B, n_var) or one vector -> (B, n_points) [s]."""
        return self.interpolant.via_times(self._timing(x))

    def evaluate_with_gradients(self, x: Array) -> tuple[Array, Array, Array, Array]:
        """Objectives, constraints and their derivatives, exact to rounding (complex step; torque by Pinocchio).

        Args:
            x: decision vectors, shape (B, n_var).

        Returns:
            F (B, n_obj), dF (B, n_obj, n_var), G (B, n_constr), dG (B, n_constr, n_var).

        Raises:
            InvalidInputError: another shape, or decision variables that are not finite.
        """
        given = numbers(x, name="x", shape=("B", self.n_var))
        steps = (given[:, None, :] + 1j * _COMPLEX_STEP * np.eye(self.n_var)).reshape(-1, self.n_var)
        values = [array.reshape(len(given), self.n_var, -1) for array in self._evaluate_rows(steps)]
        (F, dF), (G, dG) = ((v[:, 0].real, np.swapaxes(v.imag, 1, 2) / _COMPLEX_STEP) for v in values)
        return F, dF, G, dG

    def with_payload(self, payload: Payload) -> TrajectoryProblem:
        """The same problem with another payload; a registered one is made again and may refuse it."""
        if self.registered_name:
            return type(self)(**(self.settings | {"payload": payload.settings}))
        other = copy.copy(self)
        other.dynamics = replace(self.dynamics, payload=payload)
        return other

    def in_terms(self) -> TrajectoryProblem:
        """The same problem for gradient solvers: every limit in the terms that it is the greatest of."""
        middle = self.rollout(0.5 * (self.xl + self.xu))
        other = copy.copy(self)
        other.constraints = tuple(in_terms(constraint, middle) for constraint in self.constraints)
        other.n_ieq_constr = len(other.constraint_names)
        return other

    def under_time_limit(self, seconds: float) -> TrajectoryProblem:
        """The same problem, its populations evaluated in a process that is ended when one individual takes too long.

        Args:
            seconds: time that evaluating one individual may take [s].

        Raises:
            InvalidInputError: a time that is not positive, or a process that may not start another.
        """
        other = copy.copy(self)
        other.time_limited = TimeLimited(self._evaluate_rows, seconds)
        return other

    def _timing(self, x: Array) -> Array:
        columns = np.atleast_2d(np.asarray(x))
        return columns if self.payload_range is None else columns[:, :-1]

    def _evaluate(self, x: Array, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        rows = self._evaluate_in_chunks if self.time_limited is None else self.time_limited
        out["F"], out["G"], failures = evaluate_each(rows, x, self.n_obj, self.n_ieq_constr)
        if any(failures):
            out["failure"] = np.array(failures, dtype=object)

    def _evaluate_in_chunks(self, x: Array) -> tuple[Array, Array]:
        """About as many at a time as stay in the cache; what an individual gets does not depend on its neighbours."""
        chunks = np.array_split(x, max(1, round(len(x) / self._chunk)))
        parts = in_threads(self._evaluate_rows, [(chunk,) for chunk in chunks], self.dynamics.threads)
        F, G = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
        return F, G

    def _evaluate_rows(self, x: Array) -> tuple[Array, Array]:
        rollout = self.rollout(x)
        if len(x):
            # Individuals whose samples of one quantity fill the cache.
            self._chunk = max(_FEWEST, _CACHED // (rollout.t[0].size * self.robot.dof))
        F = np.stack([objective.function(rollout) for objective in self.objectives], axis=1)
        columns = [constraint.function(rollout) for constraint in self.constraints]
        return F, np.concatenate([*columns, np.empty((len(F), 0))], axis=1)


@dataclass(frozen=True)
class Weights:
    """Weights of a weighted sum; with scales, objectives are divided by them and not normalised by the front.

    Attributes:
        weights: one non-negative number per objective.
        scales: one positive number per objective, in the objective's SI unit, or None.
    """

    weights: tuple[float, ...]
    scales: tuple[float, ...] | None = None
