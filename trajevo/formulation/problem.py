"""A pymoo problem made of a robot, an interpolant, objectives and constraints."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from pymoo.core.problem import Problem

from trajevo.base.arrays import Array, keep_heap, numbers, read_only
from trajevo.base.shown import html
from trajevo.base.shown.brief import MOST, brief, cut
from trajevo.base.threads import in_threads
from trajevo.base.units import display, pretty
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError, TrajevoError
from trajevo.formulation.constraints.constraint import Constraint, in_terms
from trajevo.formulation.constraints.joint_limits import kept_limits
from trajevo.formulation.evaluation import FailedFunctionError, Part, TimeLimited, evaluate_each, refuse_if_broken
from trajevo.formulation.gradients import Differentiation, Ways
from trajevo.formulation.objectives import Objective
from trajevo.formulation.search import USUAL, Search
from trajevo.robot.joints import JointLimits
from trajevo.robot.payload import Payload
from trajevo.robot.robot import Robot
from trajevo.trajectory.batch import TrajectoryBatch
from trajevo.trajectory.interpolants import Interpolant, Variable
from trajevo.trajectory.interpolants.interpolant import ArrangesPoints

#: Greatest number of instants per segment at which a problem samples effort and tool.
MOST_SAMPLES = 10_000

#: Numbers of one quantity that are evaluated at a time (1 MB, which fits into the cache), least number of individuals
#: in such a chunk, and their number in the first chunk.
_CACHED, _FEWEST, _FIRST = 2**17, 16, 128


@dataclass(frozen=True, eq=False)
class SmoothForm:
    """The same problem with differentiable objectives and constraints, for gradient solvers.

    Attributes:
        problem: the smooth problem; it has the same objectives.
        into: decision vectors (B, n_var) of the original problem -> decision vectors of the smooth problem.
        back: decision vectors of the smooth problem -> decision vectors (B, n_var) of the original problem. They keep
            the limits exactly, while those of the smooth problem may exceed them slightly.
    """

    problem: TrajectoryProblem
    into: Callable[[Array], Array]
    back: Callable[[Array], Array]

    __repr__ = brief


@dataclass(frozen=True, eq=False)
class Expansion:
    """The relation of a problem to another one, when each of its solutions stands for a curve of the other's solutions.

    Attributes:
        problem: the other problem.
        points: X (N, n_var) and F (N, n_obj) of this problem -> decision vectors and objectives of the other problem,
            on the lower envelope of the curves.
        fold: decision vectors of the other problem -> decision vectors of this problem.
    """

    problem: TrajectoryProblem
    points: Callable[[Array, Array], tuple[Array, Array]]
    fold: Callable[[Array], Array]

    __repr__ = brief


class TrajectoryProblem(Problem):
    """A multi-objective trajectory optimisation problem, which any algorithm of pymoo can solve.

    Variables, objectives and constraints are in SI units. The results of an individual are the same to the bit,
    whichever individuals are evaluated with it, in whatever order and on however many threads. If the evaluation of an
    individual raises an error or gives NaN, its objectives and constraints are infinite and ``"failure"`` holds the
    reason. It loses every comparison, never enters a front, and does not affect other individuals.

    Attributes:
        registered_name: name under which the problem is registered in the entry-point group ``trajevo.problems``;
            empty for a problem that is put together by hand.
        title: one line that says what is solved.
        dynamics: the robot, its payload, and how finely effort is sampled.
        interpolant: decision vectors -> trajectories.
        objectives: what is minimised.
        constraints: what must not exceed 0.
        payload_range: bounds of the payload's mass [kg] if it is a decision variable, the last one; else None.
        evolution: settings of a search in the problem's paper, used unless others are given.
        paper_weights: weights and scales of the paper's weighted sum, or None.
        compares_rivals: whether reports compare the motion with other interpolants through the same points.
        reference_point: reference point of the hypervolume, SI, shape (n_obj,), or None.
        angle: unit in which angles are shown, ``"rad"`` or ``"deg"``.
        length: unit in which lengths are shown, ``"m"`` or ``"mm"``.
        smooth: smooth form for gradient solvers; None if they solve the problem itself.
        expansion: relation to another problem whose curves of solutions this problem's solutions stand for, or None.
        time_limited: evaluates populations under a time limit; None for no limit.

    Raises:
        InvalidInputError: no objectives, repeated names, or a reference point of the wrong length or not positive.
    """

    registered_name: ClassVar[str] = ""
    title: str = "trajectory problem"
    evolution: Search = USUAL
    paper_weights: ClassVar[Weights | None] = None
    compares_rivals: ClassVar[bool] = False
    smooth: SmoothForm | None = None
    expansion: Expansion | None = None
    time_limited: TimeLimited | None = None
    _chunk: int = _FIRST
    _works: bool = False

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
        if dynamics.samples > MOST_SAMPLES:
            raise InvalidInputError(f"samples: expected at most {MOST_SAMPLES} per segment, got {dynamics.samples}")
        self.dynamics = dynamics
        self.interpolant = interpolant
        self.payload_range = payload_range
        self.objectives = tuple(objectives)
        self.constraints = tuple(constraints)
        self.angle, self.length = angle, length
        self._ways = Ways()
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

    def __repr__(self) -> str:
        sizes = f"{self.n_var} variables, {self.n_obj} objectives, {self.n_ieq_constr} constraints"
        return f"{type(self).__name__}({cut(self.title, MOST - len(sizes) - len(type(self).__name__) - 4)}: {sizes})"

    def _repr_html_(self) -> str:
        return problem_html(self)

    @property
    def robot(self) -> Robot:
        """The robot."""
        return self.dynamics.robot

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The decision variables: those of the interpolant, then the payload's mass if it is a variable."""
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
        """Keyword arguments that make an equal problem, as plain data; registered problems override this."""
        return {}

    @property
    def notes(self) -> tuple[str, ...]:
        """What to know before the problem is solved, a sentence each; problems that have any override this."""
        return ()

    def decode(self, x: Array) -> TrajectoryBatch:
        """Trajectories of decision vectors, shape (B, n_var) or one vector (n_var,)."""
        return self.interpolant(self._timing(x))

    def rollout(self, x: Array) -> Rollout:
        """The robot on the trajectories of decision vectors, shape (B, n_var) or one vector (n_var,).

        Of one motion from a base that tilts, the robot is one with the gravity of that base.
        """
        found = self._rollout(x)
        return found if found.dynamics.gravity is None else replace(found, dynamics=found.dynamics.of_one_base)

    def _rollout(self, x: Array) -> Rollout:
        """The same with the robot as it is, by which single motions have the same bits as those of many."""
        masses = None if self.payload_range is None else np.atleast_2d(x)[:, -1]
        if isinstance(self.interpolant, ArrangesPoints):
            trajectory, arranged = self.interpolant.motions(self._timing(x))
            dynamics = self.dynamics.under(arranged.gravity(np.array(self.robot.model.gravity.linear)))
            return Rollout(dynamics, trajectory, masses, self.kept_limits, arranged)
        return Rollout(self.dynamics, self.decode(x), masses, self.kept_limits)

    @property
    def kept_limits(self) -> JointLimits:
        """Limits that motions of this problem keep: the robot's, less the margins of the problem's constraints."""
        return kept_limits(self.robot, self.constraints)

    def via_times(self, x: Array) -> Array:
        """Instants at which the via points are passed, (B, n_var) or one vector -> (B, n_points) [s]."""
        return self.interpolant.via_times(self._timing(x))

    def known_good(self, size: int, *, in_time: Callable[[], bool] | None = None) -> Array:
        """Decision vectors of at most so many motions that are known to be good, with which a search begins.

        Problems that find such motions by other means override this; there are none here.

        Args:
            size: number of individuals of the population.
            in_time: whether there is time to look for better ones, where CPU time is limited; None where it is not.

        Returns:
            Shape (N, n_var).
        """
        del size, in_time
        return np.empty((0, self.n_var))

    def evaluate_with_gradients(self, x: Array) -> tuple[Array, Array, Array, Array]:
        """Objectives, constraints and their derivatives, exact to rounding (complex step; torque by Pinocchio).

        Functions of the user's are compared with finite differences once. Where complex steps are wrong even with
        numpy's functions as those of real parts, finite differences replace them, with a warning.

        Args:
            x: decision vectors, shape (B, n_var).

        Returns:
            F (B, n_obj), dF (B, n_obj, n_var), G (B, n_constr), dG (B, n_constr, n_var), SI.

        Raises:
            InvalidInputError: a wrong shape, decision variables that are not finite, or an objective or a constraint
                that fails at every point or returns a wrong shape.
        """
        values, slopes = self._differentiation(numbers(x, name="x", shape=("B", self.n_var)))
        k = self.n_obj
        return values[:, :k], slopes[:, :k], values[:, k:], slopes[:, k:]

    def gradients_by(self, x: Array) -> str:
        """How derivatives are computed: ``"complex step"``, or for which functions by finite differences.

        Args:
            x: decision vectors near which unknown functions are looked at, shape (B, n_var).
        """
        ways = self._differentiation.of(numbers(x, name="x", shape=("B", self.n_var)))
        rough = [part.what for part, way in zip(self._parts, ways, strict=True) if way == "finite differences"]
        return f"finite differences for {', '.join(rough)}" if rough else "complex step"

    @property
    def _differentiation(self) -> Differentiation:
        makers = (self.interpolant, type(self))
        return Differentiation(self.title, self._rollout, self._parts, (self.xl, self.xu), makers, self._ways)

    @property
    def _parts(self) -> tuple[Part, ...]:
        objectives = (Part(f"objective {each.name!r}", each.function, each.columns) for each in self.objectives)
        limits = (Part(f"constraint {_told(each)}", each.function, len(each.names)) for each in self.constraints)
        return (*objectives, *limits)

    def with_payload(self, payload: Payload) -> TrajectoryProblem:
        """The same problem with another payload; a registered problem is made again and may refuse the payload."""
        if self.dynamics.schedule is not None:
            self.dynamics.schedule.check_varied("another payload")
        if self.registered_name:
            return type(self)(**(self.settings | {"payload": replace(self.dynamics, payload=payload).carried}))
        other = copy.copy(self)
        other.dynamics = replace(self.dynamics, payload=payload)
        return other

    def in_terms(self, *, objectives: bool = False) -> TrajectoryProblem:
        """The same problem for gradient solvers: a limit on a maximum becomes a limit on every term of the maximum.

        Args:
            objectives: an objective that is a maximum becomes a column of F for every term of it, too.

        Raises:
            InvalidInputError: terms of an objective have a wrong shape.
        """
        middle = self.rollout(0.5 * (self.xl + self.xu))
        other = copy.copy(self)
        if objectives:
            other.objectives = tuple(_in_terms(each, middle) for each in self.objectives)
            other.n_obj = sum(each.columns or 1 for each in other.objectives)
        other.constraints = tuple(in_terms(constraint, middle) for constraint in self.constraints)
        other.n_ieq_constr = len(other.constraint_names)
        return other

    def under_time_limit(self, seconds: float) -> TrajectoryProblem:
        """The same problem, evaluated in a separate process that is killed when one individual takes too long.

        Args:
            seconds: greatest time for the evaluation of one individual [s].

        Raises:
            InvalidInputError: a time that is not positive, or this process may not start child processes.
        """
        other = copy.copy(self)
        other.time_limited = TimeLimited(self._evaluate_rows, seconds)
        return other

    def _timing(self, x: Array) -> Array:
        columns = np.atleast_2d(np.asarray(x))
        return columns if self.payload_range is None else columns[:, :-1]

    def _evaluate(self, x: Array, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        rows = self._evaluate_in_chunks if self.time_limited is None else self.time_limited
        out["F"], out["G"], failures, failed = evaluate_each(rows, x, self.n_obj, self.n_ieq_constr)
        if failed is not None and not self._works:
            refuse_if_broken(rows, failed, (self.xl, self.xu))
        self._works |= len(x) > 0
        if any(failures):
            out["failure"] = np.array(failures, dtype=object)

    def _evaluate_in_chunks(self, x: Array) -> tuple[Array, Array]:
        """Evaluate in chunks that fit into the cache; the results of an individual do not depend on the chunks."""
        chunks = np.array_split(x, max(1, round(len(x) / self._chunk)))
        parts = in_threads(self._evaluate_rows, [(chunk,) for chunk in chunks], self.dynamics.threads)
        F, G = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
        return F, G

    def _evaluate_rows(self, x: Array) -> tuple[Array, Array]:
        try:
            rollout = self._rollout(x)
        except TrajevoError:
            raise
        except Exception as error:
            raise FailedFunctionError.of("the interpolant", error) from error
        if len(x):
            # Number of individuals whose samples of one quantity fill the cache.
            self._chunk = max(_FEWEST, _CACHED // (rollout.t[0].size * self.robot.dof))
        columns = [part.real(rollout) for part in self._parts]
        values = np.concatenate(columns, axis=1)
        return values[:, : self.n_obj], values[:, self.n_obj :]


def _in_terms(objective: Objective, example: Rollout) -> Objective:
    """An objective with a column for each of its terms, counted in a rollout like those to be evaluated."""
    if objective.terms is None:
        return objective
    found = np.shape(objective.terms(example))
    if len(found) != 2 or found[0] != len(example.trajectory):
        raise InvalidInputError(
            f"objective {objective.name!r}: terms: expected shape (B, K) for B trajectories, here B = "
            f"{len(example.trajectory)}, got {found}"
        )
    return replace(objective, function=objective.terms, terms=None, columns=found[1])


def _told(constraint: Constraint) -> str:
    """The name of a constraint, for messages."""
    first, *others = constraint.names or ("without columns",)
    return f"{first!r}" + (f" and {len(others)} more" if others else "")


@dataclass(frozen=True)
class Weights:
    """Weights of a weighted sum. Objectives are divided by the scales if there are any, instead of being normalised.

    Attributes:
        weights: one non-negative number per objective.
        scales: one positive number per objective, in the objective's SI unit, or None.
    """

    weights: tuple[float, ...]
    scales: tuple[float, ...] | None = None


def problem_html(problem: TrajectoryProblem) -> str:
    """A problem as a notebook shows it: robot and payload, variables, objectives and constraints with their units."""
    told = {
        "robot": problem.robot.name,
        "interpolant": type(problem.interpolant).__name__,
        "payload": f"{problem.dynamics.payload.mass:g} kg" if problem.dynamics.payload.mass else "",
        "effort": f"at {problem.dynamics.samples} instants per segment",
    }
    units = {"angle": problem.angle, "length": problem.length}
    variables = [
        (one.name, *(f"{bound * factor:.5g} {pretty(unit)}".removesuffix(" 1") for bound in (one.lower, one.upper)))
        for one in problem.variables
        for unit, factor in (display(one.unit, **units),)
    ]
    objectives = [(one.name, pretty(display(one.unit, **units)[0]), one.reference) for one in problem.objectives]
    limits = [(_of_all(one), one.proof, one.reference) for one in problem.constraints if one.names]
    return html.shown(
        f"{type(problem).__name__}: {problem.title}",
        html.facts(told),
        html.table(("variable", "from", "to"), variables),
        html.table(("objective", "unit", "source"), objectives),
        html.table(("constraint", "known by", "source"), limits),
        *map(html.sentence, problem.notes),
    )


def _of_all(constraint: Constraint) -> str:
    """Names of a constraint, of many that limit the same quantity only this and their number."""
    quantity, *others = dict.fromkeys(name.partition(" of ")[0] for name in constraint.names)
    many = len(constraint.names) > 1 and not others
    return f"{quantity} ({len(constraint.names)})" if many else ", ".join(constraint.names)
