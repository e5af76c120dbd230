"""Dynamic load-carrying capacity (DLCC): the largest payload of a motion, its binding joint and instant.

Effort is affine in the payload's mass, τ = τ₀ + m τ₁, so the capacity is in closed form; the iteration of Guo 2016,
section 5, is beside it and agrees within its step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from trajevo.arrays import Array, frozen, numbers
from trajevo.dynamics import Dynamics, Rollout, rollout_of
from trajevo.errors import InvalidInputError
from trajevo.front import Solution
from trajevo.objectives import Objective, unused_payload
from trajevo.payload import Payload
from trajevo.problem import TrajectoryProblem
from trajevo.selection import Weights
from trajevo.sqp import FEASIBLE
from trajevo.weighted import WeightedOptimum, minimise_weighted

#: Instants per segment at which a capacity is computed, unless told otherwise; optimisation uses fewer.
SAMPLES = 50

#: Steps after which the iteration would be the wrong tool.
MOST_STEPS = 1_000_000

#: Share of the greatest effort per kilogram below which a joint does not feel the payload but rounding.
NEGLIGIBLE = 1e-12


@dataclass(frozen=True, eq=False)
class Capacity:
    """The largest payload of a motion.

    Attributes:
        mass: [kg]; inf if no effort limit is ever reached, 0 if one is reached or broken without any payload.
        joint: name of the binding joint, empty if there is none.
        time: instant at which it binds [s], NaN if there is none.
        margin: share of each joint's effort limit that is left at ``mass``, shape (n_joints,); negative where the
            motion breaks a limit without any payload.
        per_joint: largest payload by each joint alone, shape (n_joints,) [kg].
        payload_model: how the payload acts, a key of :data:`trajevo.payload.LOAD_MODELS`.
        history: for the iteration, every (mass [kg], greatest effort over limit, joint) tried, the last one infeasible.
    """

    mass: float
    joint: str
    time: float
    margin: Array
    per_joint: Array
    payload_model: str
    history: tuple[tuple[float, float, str], ...] = ()

    def __str__(self) -> str:
        if not self.joint:
            return f"unlimited: no joint has an effort limit that a {self.payload_model} payload reaches on this motion"
        if len(self.history) == 1 and self.history[0][0] > 0.0:
            tried = self.history[0][0]
            return f"the first payload tried, {tried:g} kg, already breaks the limit of {self.joint}; start lower"
        if self.margin.min() < -1e-12:
            return (
                f"0 kg: even without payload {self.joint} exceeds its effort limit by "
                f"{-100.0 * self.margin.min():.3g} %, at {self.time:.4f} s"
            )
        return f"{self.mass:.6f} kg ({self.payload_model} payload), limited by {self.joint} at {self.time:.4f} s"


def dlcc(motion: Solution | Rollout | WeightedOptimum, *, samples: int = SAMPLES) -> Capacity:
    """The largest payload of a motion in closed form: the least, over joints and instants, of (±limit - τ₀)/τ₁.

    Args:
        motion: a solution of a front, an optimum, or a rollout (of its batch the first trajectory counts). The shape
            and the model of the payload are the rollout's own; its mass plays no part.
        samples: instants per segment, both ends included.
    """
    return _closed_form(_efforts(motion, samples))


def dlcc_iterative(
    motion: Solution | Rollout | WeightedOptimum, *, start: float = 0.0, step: float = 0.05, samples: int = SAMPLES
) -> Capacity:
    """The largest payload by the paper's iteration (Guo 2016, section 5, steps 7 to 9): add until a limit breaks.

    Args:
        motion: as for :func:`dlcc`.
        start: first payload tried [kg].
        step: added each time [kg].
        samples: as for :func:`dlcc`.

    Returns:
        The last feasible payload, 0 if the first one is infeasible; ``history`` has every payload tried. Where no
        payload ever reaches a limit, what :func:`dlcc` returns.

    Raises:
        InvalidInputError: a start that is negative, a step that is not positive, or one that would take too many.
    """
    start, step = float(numbers(start, name="start", shape=())), float(numbers(step, name="step", shape=()))
    if start < 0.0:
        raise InvalidInputError(f"start: expected a mass from 0 on [kg], got {start}")
    if not step > 0.0:
        raise InvalidInputError(f"step: expected a positive mass [kg], got {step}")
    efforts = _efforts(motion, samples)
    closed = _closed_form(efforts)
    if np.isinf(closed.mass):
        return closed
    if (closed.mass - start) / step > MOST_STEPS:
        raise InvalidInputError(f"step: {step} kg takes over {MOST_STEPS} steps to {closed.mass:.6g} kg")
    history: list[tuple[float, float, str]] = []
    while not history or history[-1][1] <= 1.0:
        mass = start + len(history) * step
        used = efforts.used(mass)
        instant, joint = (int(i) for i in np.unravel_index(used.argmax(), used.shape))
        history.append((mass, float(used.max()), efforts.dynamics.robot.joint_names[joint]))
    feasible = history[-2][0] if len(history) > 1 else 0.0
    return replace(_bound(efforts, feasible, joint, instant, closed.per_joint), history=tuple(history))


@dataclass(frozen=True, eq=False)
class PayloadCurve:
    """The least time of a motion for each payload.

    Attributes:
        payloads: [kg], ascending, shape (N,).
        times: least duration, inf where no feasible motion was found, shape (N,) [s].
        X: decision vectors, shape (N, n_var); the last one tried where none is feasible.
        payload_model: how the payload acts.
    """

    payloads: Array
    times: Array
    X: Array
    payload_model: str


def capacity_front(
    problem: TrajectoryProblem, payloads: Sequence[float], *, seed: int, starts: int = 4
) -> PayloadCurve:
    """Re-optimise for least time at each payload, by SLSQP from random starts and from the neighbour's solution.

    A motion for a heavier load carries the lighter one too, so the curve is made to rise: where a heavier payload was
    found a faster motion that is feasible for the lighter one, that motion is taken.

    Args:
        problem: a problem whose first objective is the time [s].
        payloads: masses [kg]; shape and model are those of the problem's payload.
        seed: seed of the random starts.
        starts: random starts per payload.

    Raises:
        InvalidInputError: no payloads, or a problem whose first objective is not the time.
    """
    if problem.objective_names[0] != "time":
        raise InvalidInputError(f"problem: expected the time as first objective, got {problem.objective_names[0]!r}")
    masses = np.sort(numbers(payloads, name="payloads", shape=("N",)))
    if not len(masses):
        raise InvalidInputError("payloads: expected at least one mass [kg]")
    weights = Weights((1.0, *([0.0] * (problem.n_obj - 1))))
    times, X = np.full(len(masses), np.inf), np.empty((len(masses), problem.n_var))
    loaded = [problem.with_payload(problem.dynamics.payload.with_mass(float(mass))) for mass in masses]
    for i, at_mass in enumerate(loaded):
        best = minimise_weighted(at_mass, weights, seed=seed + i, starts=starts)
        if i > 0 and np.isfinite(times[i - 1]):
            warm = minimise_weighted(at_mass, weights, seed=seed, initial=X[i - 1][None])
            best = min(best, warm, key=lambda optimum: optimum.cost)
        times[i], X[i] = best.cost, best.x
    for i in range(len(masses) - 2, -1, -1):
        G = loaded[i].evaluate(X[i + 1][None], return_values_of=["F", "G"])[1]
        if times[i + 1] < times[i] and G.max(initial=-np.inf) <= FEASIBLE:
            times[i], X[i] = times[i + 1], X[i + 1]
    return PayloadCurve(frozen(masses), frozen(times), frozen(X), problem.dynamics.payload.model)


def max_payload_problem(
    problem: TrajectoryProblem, payload_range: tuple[float, float] | None = None
) -> TrajectoryProblem:
    """The same problem with the payload's mass as its last variable, and the payload left unused as an objective.

    Args:
        problem: whose payload gives shape and model.
        payload_range: least and greatest mass [kg]; if None from 0 to what the robot can hold at rest at the first and
            the last point, which no motion that rests there exceeds.

    Raises:
        InvalidInputError: a range that is not 0 <= least < greatest, or none given where nothing limits the payload.
    """
    given = (0.0, _held_at_rest(problem)) if payload_range is None else payload_range
    low, high = numbers(given, name="payload_range", shape=(2,)).tolist()
    if not 0.0 <= low < high:
        raise InvalidInputError(f"payload_range: expected 0 <= least < greatest [kg], got {low} and {high}")
    shape = problem.dynamics.payload
    unit = shape if shape.mass > 0.0 else Payload(1.0, shape.com, None, shape.model)
    corner = problem.reference_point
    return TrajectoryProblem(
        dynamics=Dynamics(problem.robot, unit, samples=problem.dynamics.samples, threads=problem.dynamics.threads),
        interpolant=problem.interpolant,
        objectives=(
            *problem.objectives,
            Objective("unused payload", "kg", f"{high:g} kg minus mass", unused_payload(high)),
        ),
        constraints=problem.constraints,
        payload_range=(low, high),
        reference_point=None if corner is None else (*corner, high - low),
        angle=problem.angle,
    )


def _held_at_rest(problem: TrajectoryProblem) -> float:
    """The greatest payload [kg] that the effort limits allow at rest at both ends of the path."""
    trajectory = problem.interpolant(0.5 * (problem.xl + problem.xu)[None, : len(problem.interpolant.variables)])
    q = trajectory.evaluate(np.array([0.0, trajectory.duration[0]]))[0]
    still = np.zeros_like(q)
    unloaded, per_kilogram = (
        effort(q, still, still) for effort in (problem.dynamics.unloaded_effort, problem.dynamics.effort_per_kilogram)
    )
    return float(greatest_masses(unloaded, per_kilogram, problem.robot.limits.effort).min())


def greatest_masses(unloaded: Array, per_kilogram: Array, limit: Array) -> Array:
    """Greatest mass per instant and joint [kg], shapes (T, n_joints); -inf where a limit is broken without payload."""
    felt = np.abs(per_kilogram)
    # (limit - τ₀)/τ₁ where the payload pushes up, (limit + τ₀)/(-τ₁) where it pushes down.
    room = limit - np.copysign(unloaded, unloaded * per_kilogram)
    felt_at_all = felt > NEGLIGIBLE * felt.max()
    masses = np.where(felt_at_all, room / np.where(felt_at_all, felt, 1.0), np.inf)
    # A limit broken without payload leaves nothing, even if a payload would bring the effort back.
    return np.where(np.abs(unloaded) > limit, -np.inf, masses)


@dataclass(frozen=True, eq=False)
class _Efforts:
    """Effort without payload and per kilogram, (T, n_joints), instants (T,) [s], and the dynamics they come from."""

    unloaded: Array
    per_kilogram: Array
    times: Array
    dynamics: Dynamics

    def used(self, mass: float) -> Array:
        """Effort over limit with a payload [kg], shape (T, n_joints)."""
        share: Array = np.abs(self.unloaded + mass * self.per_kilogram) / self.dynamics.robot.limits.effort
        return share


def _efforts(motion: Any, samples: int) -> _Efforts:
    rollout = rollout_of(motion)
    dynamics = rollout.dynamics.sampled(samples)
    fine = Rollout(dynamics, rollout.trajectory if len(rollout.trajectory) == 1 else rollout.trajectory[0])
    return _Efforts(fine.unloaded_effort[0], fine.effort_per_kilogram[0], fine.t[0], dynamics)


def _closed_form(efforts: _Efforts) -> Capacity:
    masses = greatest_masses(efforts.unloaded, efforts.per_kilogram, efforts.dynamics.robot.limits.effort)
    per_joint = masses.min(axis=0)
    if np.isneginf(per_joint).any():
        used = efforts.used(0.0)
        instant, joint = (int(i) for i in np.unravel_index(used.argmax(), used.shape))
        return _bound(efforts, 0.0, joint, instant, np.maximum(per_joint, 0.0))
    joint = int(per_joint.argmin())
    return _bound(efforts, float(per_joint[joint]), joint, int(masses[:, joint].argmin()), per_joint)


def _bound(efforts: _Efforts, mass: float, joint: int, instant: int, per_joint: Array) -> Capacity:
    """The capacity that a joint sets at an instant; where the mass is infinite, nothing does."""
    finite = bool(np.isfinite(mass))
    return Capacity(
        mass=mass,
        joint=efforts.dynamics.robot.joint_names[joint] if finite else "",
        time=float(efforts.times[instant]) if finite else float("nan"),
        margin=frozen(1.0 - efforts.used(mass if finite else 0.0).max(axis=0)),
        per_joint=frozen(per_joint),
        payload_model=efforts.dynamics.payload.model,
    )
