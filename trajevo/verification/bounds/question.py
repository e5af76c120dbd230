"""What a problem asks of its motions, as far as it can be bounded from below: objectives and limits of its joints.

With no limit on the duration, a motion and its slower copies make a curve: an objective is a constant of the motion's
shape times a power of the duration T, and each limit of a joint gives a least duration.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.formulation import objectives as own
from trajevo.formulation.constraints.constraint import Constraint
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.trajectory.batch import DERIVATIVES
from trajevo.verification.bounds.pieces import EnclosedShape
from trajevo.verification.bounds.shapes import shape_of

#: Share by which bounds of constants are lowered: far more than nodes and weights of quadratures can be off.
MARGIN = 1e-9


@final
@dataclass(frozen=True)
class PowerOfTime:
    """An objective that is a constant of the shape times a power of the duration.

    Attributes:
        form: ``"time"``, ``"rms"`` (Σ over joints of the root mean square), ``"integral"`` (of the square) or
            ``"peak"``.
        derivative: order of the derivative of which it is taken; 0 for the time.
        power: power of the duration.
    """

    form: str
    derivative: int
    power: int


#: Objectives that can be bounded, by their functions.
SCALED: dict[Callable[[Rollout], Array], PowerOfTime] = {
    own.total_time: PowerOfTime("time", 0, 1),
    own.summed_rms_acceleration: PowerOfTime("rms", 2, -2),
    own.summed_rms_jerk: PowerOfTime("rms", 3, -3),
    own.integrated_square_acceleration: PowerOfTime("integral", 2, -3),
    own.integrated_square_jerk: PowerOfTime("integral", 3, -5),
    own.peak_acceleration: PowerOfTime("peak", 2, -2),
    own.peak_jerk: PowerOfTime("peak", 3, -3),
}


@final
@dataclass(frozen=True, eq=False)
class Question:
    """What can be bounded of a problem.

    Attributes:
        problem: the problem.
        shape: its interpolant's pieces over boxes.
        positions: of the points, shape (K, n_joints) [rad or m].
        objectives: one for each of the problem's.
        durations: least and greatest time of a segment [s].
        limits: by the order of the derivative, 1 to 3, what each joint may have backward and forward, (2, n_joints);
            inf for no limit.
        range: least and greatest position of each joint, (2, n_joints) [rad or m]; infinite for none.
        joined: whether velocities are continuous and accelerations 0 at both ends for all decision vectors.
        left_out: names of limits that are not used, which can only raise what is missing.
    """

    problem: TrajectoryProblem
    shape: EnclosedShape
    positions: Array
    objectives: tuple[PowerOfTime, ...]
    durations: tuple[float, float]
    limits: dict[int, Array]
    range: Array
    joined: bool
    left_out: tuple[str, ...]

    __repr__ = brief

    @classmethod
    def of(cls, problem: TrajectoryProblem) -> Question:
        """What can be bounded of a problem.

        Raises:
            InvalidInputError: an objective, an interpolant or a variable of which no bounds are known.
        """
        for objective in problem.objectives:
            if objective.function not in SCALED:
                known = ", ".join(name for name, one in own.OBJECTIVES.items() if one.function in SCALED)
                raise InvalidInputError(f"objectives: {objective.name!r} cannot be bounded from below; {known} can")
        if problem.payload_range is not None or problem.expansion is not None:
            raise InvalidInputError("problem: bounds from below are known where segment times alone are variables")
        interpolant: Any = problem.interpolant
        shape = shape_of(interpolant)
        limits, range_, left_out = _limits(problem)
        return cls(
            problem,
            shape,
            interpolant.points.positions,
            tuple(SCALED[one.function] for one in problem.objectives),
            interpolant.duration_bounds,
            limits,
            range_,
            getattr(interpolant, "form", "smooth") != "printed",
            left_out,
        )

    @property
    def powers(self) -> Array:
        """Powers of the duration in the objectives, shape (n_obj,)."""
        return np.array([one.power for one in self.objectives], dtype=np.float64)

    @property
    def time_at(self) -> int | None:
        """Which objective is the duration, or None."""
        return next((k for k, one in enumerate(self.objectives) if one.form == "time"), None)

    def at_points(self, ratios: Array) -> tuple[Array, Array, Array, Array]:
        """Motions of logarithms of ratios of segment times, as the problem itself computes them.

        Args:
            ratios: shape (B, n_segments - 1).

        Returns:
            Constants of the objectives (B, n_obj), least and greatest duration (B,) [s], the latter below the former
            where a motion breaks a limit at every pace, and segment times as shares of the duration (B, n_segments).
        """
        times = np.exp(np.concatenate([np.zeros((len(ratios), 1)), np.cumsum(ratios, axis=1)], axis=1))
        shares = times / times.sum(axis=1, keepdims=True)
        rollout = self.problem.rollout(shares)  # the shape in one second
        constants = np.stack([objective.function(rollout) for objective in self.problem.objectives], axis=1)
        if self.time_at is not None:
            constants[:, self.time_at] = 1.0
        low, high = (self.durations[0] / shares).max(axis=1), (self.durations[1] / shares).min(axis=1)
        for order, (backward, forward) in self.limits.items():
            least, greatest = rollout.trajectory.extremes(order)
            used = np.maximum(greatest / forward, -least / backward).max(axis=1)
            low = np.maximum(low, used ** (1.0 / order) * (1.0 + 1e-13))
        least, greatest = rollout.trajectory.extremes(0)
        out = (least < self.range[0] - 1e-12).any(axis=1) | (greatest > self.range[1] + 1e-12).any(axis=1)
        return constants, low, np.where(out, -np.inf, high), shares


def _limits(problem: TrajectoryProblem) -> tuple[dict[int, Array], Array, tuple[str, ...]]:
    """Limits of velocity, acceleration and jerk, the range, and names of limits that are left out."""
    kept, left_out = problem.kept_limits, []
    limits: dict[int, Array] = {}
    range_ = np.array([np.full(problem.robot.dof, -np.inf), np.full(problem.robot.dof, np.inf)])
    for constraint in problem.constraints:
        if not _by_extremes(constraint):
            left_out.append(constraint.quantity or ", ".join(constraint.names))
        elif constraint.quantity == "position":
            range_ = np.stack([kept.lower, kept.upper])
        else:
            sides = kept.sides(constraint.quantity)
            limits[DERIVATIVES.index(constraint.quantity)] = np.stack([sides.backward, sides.forward])
    return limits, range_, tuple(left_out)


def _by_extremes(constraint: Constraint) -> bool:
    """Whether a constraint is a limit of the joints' positions or their derivatives, by their extremes."""
    return constraint.of_joints and constraint.proof == "extremes" and constraint.quantity in DERIVATIVES
