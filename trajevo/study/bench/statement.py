"""A problem as anyone would write it: one decision vector at a time, without trajevo's maths.

Motions come from SciPy, efforts and the tool from Pinocchio, distances from coal; of the problem only its data are
used: points, limits, the robot's model. So it is a second opinion on the problem, and what another tool is set on.

Velocities, accelerations and jerks are limited at their exact extremes. What is sampled by the problem is sampled at
the same instants here. What the problem proves at every instant is checked at 25 instants of every piece. Functions
of the problem's own, such as other equations of motion, are called with positions, velocities and accelerations.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from types import SimpleNamespace
from typing import Any, NamedTuple, final

import numpy as np
from scipy.interpolate import PPoly

from trajevo.base.arrays import Array, frozen, numbers
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError
from trajevo.formulation.constraints.constraint import Constraint
from trajevo.formulation.objectives import OBJECTIVES, UNUSED_PAYLOAD, Objective
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.robot.robot import Robot
from trajevo.study.bench.plain.arm import Arm
from trajevo.study.bench.plain.curves import (
    Timed,
    curve_of,
    extremes,
    lobatto_shares,
    square_integral,
    states,
)
from trajevo.study.bench.plain.paths import AlongPath
from trajevo.trajectory.interpolants import THROUGH_POINTS, Reparameterisation

#: Instants in every piece at which is checked what the problem proves.
DENSE = 25

#: Gauss-Legendre nodes of a panel, and panels of a piece, for integrals of efforts: absolute values have kinks.
_NODES, PANELS = 8, 6

#: Parts of a problem that no plain statement has, by their settings.
_UNSTATED = ("passing", "segments", "cyclic", "extra_points", "pace")

_DERIVATIVES = {"position": 0, "velocity": 1, "acceleration": 2, "jerk": 3}


class Decoded(NamedTuple):
    """What becomes of a decision vector.

    Attributes:
        curve: the motion.
        missed: how far the tool misses points that were moved [m or rad].
        arm: the robot with what it carries.
    """

    curve: PPoly
    missed: Array
    arm: Arm


@final
@dataclass(frozen=True, eq=False)
class Statement:
    """A problem for tools that call it with one decision vector at a time.

    Attributes:
        lower: least decision variables, shape (n_var,) [SI].
        upper: greatest decision variables, shape (n_var,) [SI].
        objectives: names of the objectives.
        units: their SI units.
        constraints: names of the constraints, which must not exceed 0.
    """

    lower: Array
    upper: Array
    objectives: tuple[str, ...]
    units: tuple[str, ...]
    constraints: tuple[str, ...]
    _evaluate: Callable[[Array], tuple[Array, Array]] = field(repr=False)

    __repr__ = brief

    @classmethod
    def of(cls, problem: TrajectoryProblem, *, panels: int = PANELS, instants: int | None = None) -> Statement:
        """The plain statement of a problem.

        Args:
            problem: the problem.
            panels: parts of every piece with 8 nodes each, for integrals of efforts.
            instants: number of instants of a motion, evenly spaced within its pieces, at which everything that is
                sampled is looked at; those of the problem if None.

        Raises:
            InvalidInputError: something in the problem has no plain statement.
        """
        for key in _UNSTATED:
            if problem.settings.get(key):
                raise InvalidInputError(f"{key}: no plain statement of it")
        if problem.dynamics.schedule is not None:
            raise InvalidInputError("payload: no plain statement of loads that are picked up")
        return cls(
            lower=frozen(np.array(problem.xl)),
            upper=frozen(np.array(problem.xu)),
            objectives=problem.objective_names,
            units=tuple(objective.unit for objective in problem.objectives),
            constraints=problem.constraint_names,
            _evaluate=_along_path(problem, instants)
            if isinstance(problem.interpolant, Reparameterisation)
            else _through(problem, panels, instants),
        )

    def evaluate(self, x: Any) -> tuple[Array, Array]:
        """Objectives (n_obj,) and constraints (n_constr,) of one decision vector, shape (n_var,) [SI]."""
        return self._evaluate(numbers(x, name="x", shape=(len(self.lower),)))


def _along_path(problem: TrajectoryProblem, instants: int | None) -> Callable[[Array], tuple[Array, Array]]:
    own = AlongPath.of(problem)
    return own.evaluate if instants is None else partial(own.sampled, instants=instants)


def _through(problem: TrajectoryProblem, panels: int, instants: int | None) -> Callable[[Array], tuple[Array, Array]]:
    """Decision vector -> objectives and constraints of a motion through points."""
    arm = Arm.of(problem.robot, problem.dynamics.payload)
    decode = _motion_of(problem, arm)
    values = [_objective(objective, problem, panels) for objective in problem.objectives]
    excesses = [_excess(limit, problem, instants) for limit in problem.constraints]

    def evaluate(x: Array) -> tuple[Array, Array]:
        motion = decode(x)
        F = np.array([value(motion) for value in values])
        return F, np.concatenate([np.empty(0), *(excess(motion) for excess in excesses)])

    if any(_is_own(limit) for limit in problem.constraints):
        evaluate(0.5 * (problem.xl + problem.xu))  # tells at once what else an own function asks for
    return evaluate


def _is_own(limit: Constraint) -> bool:
    """Whether a limit is a function of the problem's own, known at samples."""
    return not limit.quantity and limit.proof == "samples"


def _motion_of(problem: TrajectoryProblem, arm: Arm) -> Callable[[Array], Decoded]:
    """Decision vector -> motion, points moved."""
    interpolant: Any = problem.interpolant
    points, names = np.array(interpolant.points.positions), problem.robot.joint_names
    kind = getattr(interpolant, "kind", None) or next(
        (name for name, made in THROUGH_POINTS.items() if made is type(interpolant)), type(interpolant).__name__
    )
    if getattr(interpolant, "form", "smooth") != "smooth" or getattr(interpolant, "at_rest", ()):
        raise InvalidInputError(f"interpolant: no plain statement of {kind!r} as printed or with joints at rest")
    controlled = [
        k for k, name in enumerate(names) if any(v.name == f"{name} of control point_1" for v in problem.variables)
    ]
    timed = curve_of(kind, len(points), problem.settings, controlled)
    boxes, varies = problem.settings.get("moving", ()), problem.payload_range is not None
    return partial(_moved, timed=timed, points=points, boxes=boxes, arm=arm, varies=varies)


def _moved(x: Array, *, timed: Timed, points: Array, boxes: Any, arm: Arm, varies: bool) -> Decoded:
    arm = arm.carrying(float(x[-1])) if varies else arm
    q, missed, first = points.copy(), [], timed.variables
    for box in boxes:
        widths = np.array(box.get("joints", box.get("tool")))
        free = np.flatnonzero(widths)
        offset = np.zeros(len(widths))
        offset[free] = x[first : first + len(free)]
        first += len(free)
        if "joints" in box:
            q[box["point"]] += offset
        else:
            q[box["point"]], error = arm.moved(points[box["point"]], offset)
            missed.append(error)
    return Decoded(timed.curve(x[: timed.variables], q), np.array(missed), arm)


def _objective(objective: Objective, problem: TrajectoryProblem, panels: int) -> Callable[[Decoded], float]:
    """An objective by what it computes.

    Raises:
        InvalidInputError: it has no plain statement.
    """
    known: dict[str, Callable[[Decoded], float]] = {
        "time": lambda motion: float(motion.curve.x[-1]),
        "acceleration": lambda motion: _summed_rms(motion, 2),
        "jerk": lambda motion: _summed_rms(motion, 3),
        "square_acceleration": lambda motion: float(square_integral(motion.curve, 2).sum()),
        "square_jerk": lambda motion: float(square_integral(motion.curve, 3).sum()),
        "peak_acceleration": lambda motion: float(np.abs(extremes(motion.curve, 2)).max()),
        "peak_jerk": lambda motion: float(np.abs(extremes(motion.curve, 3)).max()),
        "energy": lambda motion: _integral(motion, panels, lambda tau, v: np.abs(tau * v)),
        "square_power": lambda motion: _integral(motion, panels, lambda tau, v: np.square(tau * v)),
        "square_effort": lambda motion: _integral(motion, panels, lambda tau, v: np.square(tau)),
    }
    name = next((key for key, own in OBJECTIVES.items() if own.function is objective.function), objective.name)
    if name in known:
        return known[name]
    if name == UNUSED_PAYLOAD and problem.payload_range is not None:
        most = problem.payload_range[1]
        return lambda motion: most - motion.arm.payload.mass
    parts, weights = getattr(objective.function, "objectives", None), problem.paper_weights
    if parts is None or weights is None or weights.scales is None:
        raise InvalidInputError(f"objectives: no plain statement of {name!r}")
    each = [_objective(part, problem, panels) for part in parts]
    factors = [weight / scale for weight, scale in zip(weights.weights, weights.scales, strict=True)]
    return lambda motion: sum(factor * part(motion) for factor, part in zip(factors, each, strict=True))


def _summed_rms(motion: Decoded, order: int) -> float:
    return float(np.sqrt(square_integral(motion.curve, order) / motion.curve.x[-1]).sum())


def _integral(motion: Decoded, panels: int, of: Callable[[Array, Array], Array]) -> float:
    """∫ Σ over joints of a function of effort and velocity dt, by Gauss-Legendre quadrature [SI]."""
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    shares = ((np.arange(panels)[:, None] + 0.5 * (1.0 + nodes)) / panels).reshape(-1)
    q, v, a = states(motion.curve, shares)
    values = of(motion.arm.efforts(q, v, a), v).sum(axis=1).reshape(-1, len(shares))
    return float((values @ np.tile(0.5 * weights / panels, panels) * np.diff(motion.curve.x)).sum())


def _excess(limit: Constraint, problem: TrajectoryProblem, instants: int | None) -> Callable[[Decoded], Array]:
    """A constraint by its quantity.

    Raises:
        InvalidInputError: it has no plain statement.
    """
    robot, quantity = problem.robot, limit.quantity
    # What is proven is no longer sampled, so that the problem's few samples would not do.
    shares = lobatto_shares(problem.dynamics.samples if limit.proof == "samples" else DENSE)
    if instants is not None:
        points: Any = problem.interpolant
        # A curve has at least one piece between two points.
        shares = np.linspace(0.0, 1.0, -(-instants // (len(points.points.positions) - 1)) + 1)
    if _is_own(limit):
        return partial(_own_excess, limit=limit, shares=shares)
    if quantity == "position":
        return partial(_position_excess, robot=robot)
    if quantity in _DERIVATIVES:
        return partial(_peak_excess, most=_most(robot, quantity), order=_DERIVATIVES[quantity])
    if quantity == "effort":
        return partial(_effort_excess, most=_most(robot, quantity) * (limit.share or 1.0), shares=shares)
    if quantity == "torque at speed":
        return partial(_torque_excess, lines=_lines(robot), shares=shares)
    if quantity == "mean velocity":
        return partial(_mean_velocity_excess, most=_most(robot, "velocity"))
    if quantity == "duration":
        return lambda motion: np.array([motion.curve.x[-1] / limit.limit - 1.0])
    if quantity == "reach":
        return lambda motion: np.maximum(motion.missed - 1e-9, 0.0) / 1e-6 - 1.0
    if quantity == "tool speed":
        return lambda motion: _tool_speed(motion, shares) / limit.limit - 1.0
    if quantity == "tool height":
        return lambda motion: (limit.limit - _tool_height(motion, shares)) / 0.1
    if quantity == "clearance":
        return partial(_clearance_excess, collision=limit.function.collision, shares=shares)  # type: ignore[attr-defined]
    raise InvalidInputError(f"constraints: no plain statement of {quantity!r}")


def _most(robot: Robot, quantity: str) -> Array:
    """Greatest magnitudes of a quantity of every joint, shape (n_joints,) [SI]."""
    sides = robot.limits.sides(quantity)
    if not sides.agree:
        raise InvalidInputError(f"limits: no plain statement of {quantity} that differs by direction")
    most: Array = np.array(sides.forward)
    return most


def _position_excess(motion: Decoded, *, robot: Robot) -> Array:
    least, greatest = extremes(motion.curve, 0)
    lower, upper = robot.limits.lower, robot.limits.upper
    found = []
    for low, high, down, up in zip(lower, upper, least, greatest, strict=True):
        if np.isfinite(low) or np.isfinite(high):
            one = abs(low if np.isfinite(low) else high) or 1.0
            scale = 0.5 * (high - low) if np.isfinite(low) and np.isfinite(high) else one
            found.append(max(low - down, up - high) / scale)
    return np.array(found)


def _peak_excess(motion: Decoded, *, most: Array, order: int) -> Array:
    peaks = np.abs(extremes(motion.curve, order)).max(axis=0)
    kept = np.isfinite(most)
    found: Array = peaks[kept] / most[kept] - 1.0
    return found


def _own_excess(motion: Decoded, *, limit: Constraint, shares: Array) -> Array:
    """A function of the problem's own at a motion as SciPy makes it.

    Raises:
        InvalidInputError: the function asks for more than positions, velocities and accelerations.
    """
    q, v, a = (values[None] for values in states(motion.curve, shares))
    seen: Any = SimpleNamespace(q=q, v=v, a=a)
    try:
        found: Array = np.asarray(limit.function(seen))[0]
    except AttributeError as error:
        raise InvalidInputError(
            f"constraints: no plain statement of {limit.names[0]!r}, which asks for {error.name!r}"
        ) from error
    return np.atleast_1d(found)


def _effort_excess(motion: Decoded, *, most: Array, shares: Array) -> Array:
    kept = np.isfinite(most)
    efforts = np.abs(motion.arm.efforts(*states(motion.curve, shares))).max(axis=0)
    found: Array = efforts[kept] / most[kept] - 1.0
    return found


def _lines(robot: Robot) -> dict[int, Array]:
    """Torque-speed lines of joints, points (speed, torque) of shape (K, 2) [SI].

    Raises:
        InvalidInputError: a drive with losses, a rotor or a peak torque beside its line.
    """
    found = {}
    for k, name in enumerate(robot.joint_names):
        drive = robot.drives.get(name)
        if drive is None or drive.torque_speed is None:
            continue
        if drive.efficiencies != (1.0, 1.0) or drive.rotor_inertia or drive.peak_torque is not None:
            raise InvalidInputError(f"drives: no plain statement of that of {name!r} but its torque-speed line")
        found[k] = np.array(drive.torque_speed)
    return found


def _torque_excess(motion: Decoded, *, lines: dict[int, Array], shares: Array) -> Array:
    """What a joint is asked for beyond its line, or beyond the line's first torque if the load drives it."""
    q, v, a = states(motion.curve, shares)
    efforts, found = motion.arm.efforts(q, v, a), []
    for k, line in lines.items():
        speed, torque = np.abs(v[:, k]), np.abs(efforts[:, k])
        end = (line[-1] - line[-2]) / (line[-1, 0] - line[-2, 0])
        beyond = line[-1, 1] + end[1] * (speed - line[-1, 0])
        can = np.where(speed > line[-1, 0], beyond, np.interp(speed, line[:, 0], line[:, 1]))
        driven = efforts[:, k] * v[:, k] < 0.0
        found.append(((torque - np.where(driven, line[0, 1], can)) / line[0, 1]).max())
    return np.array(found)


def _mean_velocity_excess(motion: Decoded, *, most: Array) -> Array:
    mean = np.diff(motion.curve(motion.curve.x), axis=0) / np.diff(motion.curve.x)[:, None]
    return np.array([np.abs(mean / most).max() - 1.0])


def _tool_speed(motion: Decoded, shares: Array) -> Array:
    q, v, _ = states(motion.curve, shares)
    return np.array([motion.arm.speeds(q, v).max()])


def _tool_height(motion: Decoded, shares: Array) -> Array:
    return np.array([motion.arm.heights(states(motion.curve, shares)[0]).min()])


def _clearance_excess(motion: Decoded, *, collision: Any, shares: Array) -> Array:
    distances = collision.distances(states(motion.curve, shares)[0])
    found = []
    for itself, wanted in enumerate((collision.scene.clearance, collision.scene.self_clearance or 0.0)):
        pairs = [k for k, pair in enumerate(collision.pairs) if int(pair.itself) == itself]
        if pairs:
            found.append((wanted - distances[:, pairs].min()) / max(wanted, 0.01))
    return np.array(found)
