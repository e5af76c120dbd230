"""What it costs in time that a payload is known to intervals only: robust problems, and their least times."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from trajevo.base.arrays import Array, frozen, numbers
from trajevo.capacity.dlcc import SAMPLES
from trajevo.capacity.payload_time import least_times
from trajevo.capacity.robust import robust_slowdown
from trajevo.dynamics.rollout import Rollout, rollout_of
from trajevo.errors import InvalidInputError
from trajevo.formulation.constraints.robust import robust_effort_limits
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.front.front import Solution
from trajevo.robot.payload import Payload
from trajevo.solvers.gradient.weighted_sum import WeightedOptimum


@final
@dataclass(frozen=True, eq=False)
class UncertaintyPrice:
    """The least time of a motion for payloads that are known less and less well.

    Attributes:
        tolerances: of every coordinate of the centre of mass, to either side, ascending from 0, shape (N,) [m].
        masses: least and greatest mass, shape (N, 2) [kg].
        com: least and greatest coordinates of the centre of mass in the tool frame, shape (N, 2, 3) [m].
        times: least duration, inf where no feasible motion was found, shape (N,) [s].
        X: decision vectors, shape (N, n_var), the last one tried where none is feasible; None along a fixed path.
        payload_model: how the payload acts.
    """

    tolerances: Array
    masses: Array
    com: Array
    times: Array
    X: Array | None
    payload_model: str

    @property
    def price(self) -> Array:
        """Share by which each motion takes longer than that of the known payload, shape (N,)."""
        return frozen(self.times / self.times[0] - 1.0)


def robust_problem(
    problem: TrajectoryProblem, *, mass: Sequence[float], com: Sequence[Sequence[float]]
) -> TrajectoryProblem:
    """The same problem with effort limits that every payload of intervals keeps.

    How the payload acts and its inertia per kilogram are those of the problem's payload, and objectives that depend on
    a payload take that one. The problem made is not a registered one, and its efforts are held at samples, also where
    those of the given one are proven between them.

    Args:
        problem: with effort limits among its constraints.
        mass: least and greatest mass, shape (2,) [kg].
        com: least and greatest coordinates of the centre of mass in the tool frame, shape (2, 3) [m].

    Raises:
        InvalidInputError: a problem that does not limit effort, whose payload's mass is a decision variable or whose
            payload knows no centre of mass, intervals that are not from a least to a greatest, or a negative mass.
    """
    if problem.payload_range is not None:
        raise InvalidInputError("problem: expected a payload that is given, its mass is a decision variable")
    shares = [c.share if c.quantity == "effort" else None for c in problem.constraints]
    if not any(share is not None and c.names for share, c in zip(shares, problem.constraints, strict=True)):
        raise InvalidInputError(
            f"problem: expected effort limits among its constraints, got {list(problem.constraint_names)}"
        )
    constraints = tuple(
        constraint if share is None else robust_effort_limits(problem.dynamics, mass=mass, com=com, margin=1.0 - share)
        for share, constraint in zip(shares, problem.constraints, strict=True)
    )
    corner = problem.reference_point
    return TrajectoryProblem(
        dynamics=problem.dynamics,
        interpolant=problem.interpolant,
        objectives=problem.objectives,
        constraints=constraints,
        reference_point=None if corner is None else corner.tolist(),
        angle=problem.angle,
        length=problem.length,
    )


def price_of_uncertainty(
    problem: TrajectoryProblem,
    tolerances: Sequence[float],
    *,
    mass_tolerances: Sequence[float] | None = None,
    seed: int,
    starts: int = 4,
) -> UncertaintyPrice:
    """Re-optimise for least time as boxes round the problem's own payload grow, by SLSQP.

    A motion for a box is one for every box inside it, so the curve is made to rise: where a wider box was found a
    faster motion, that one is where the narrower begins again.

    Args:
        problem: with the time [s] among its objectives and effort limits among its constraints; its payload is the
            nominal one.
        tolerances: of every coordinate of the centre of mass, to either side, ascending [m]. The known payload itself
            always comes first and need not be among them.
        mass_tolerances: of the mass, as shares of it, one for each of ``tolerances``, not descending; 0 if None.
        seed: of the random starts.
        starts: random starts for each.

    Raises:
        InvalidInputError: tolerances that are negative, descend or are of different numbers, a mass that is more
            uncertain than it is great, or a problem that carries nothing, lacks the time as objective, does not limit
            effort, or for whose payload no feasible motion is found.
    """
    payload = problem.dynamics.payload
    widths, masses, com = _boxes(payload, tolerances, mass_tolerances)
    robust = [robust_problem(problem, mass=m, com=c) for m, c in zip(masses, com, strict=True)]
    times, X = least_times(robust, seed=seed, starts=starts)
    if not np.isfinite(times[0]):
        raise InvalidInputError(f"problem: expected a motion that carries its payload, none found from {starts} starts")
    return UncertaintyPrice(widths, masses, com, times, X, payload.model)


def price_along_path(
    motion: Solution | Rollout | WeightedOptimum,
    tolerances: Sequence[float],
    *,
    mass_tolerances: Sequence[float] | None = None,
    samples: int = SAMPLES,
) -> UncertaintyPrice:
    """The same for one motion that keeps its path and is scaled in time uniformly.

    Args:
        motion: a solution of a front, an optimum, or a rollout (of its batch the first trajectory counts); its payload
            is the nominal one.
        tolerances: as for :func:`price_of_uncertainty`.
        mass_tolerances: as for :func:`price_of_uncertainty`.
        samples: instants per segment, both ends included.

    Returns:
        Times that are inf where some payload of the box cannot be carried along this path at any speed.

    Raises:
        InvalidInputError: tolerances as for :func:`price_of_uncertainty`, or a nominal payload that is none or cannot
            be carried along this path.
    """
    payload = rollout_of(motion).dynamics.payload
    widths, masses, com = _boxes(payload, tolerances, mass_tolerances)
    times = np.full(len(widths), np.inf)
    times[0] = robust_slowdown(motion, mass=masses[0], com=com[0], samples=samples).duration
    for i in range(1, len(widths)):
        try:
            times[i] = robust_slowdown(motion, mass=masses[i], com=com[i], samples=samples).duration
        except InvalidInputError:
            break  # nor a wider box
    return UncertaintyPrice(widths, masses, com, frozen(times), None, payload.model)


def _boxes(
    payload: Payload, tolerances: Sequence[float], mass_tolerances: Sequence[float] | None
) -> tuple[Array, Array, Array]:
    """Tolerances (N,), masses (N, 2) and centres of mass (N, 2, 3) round a payload, itself first."""
    if not payload.mass > 0.0:
        raise InvalidInputError("payload: expected one with mass, as the tolerances are about it, got 0 kg")
    widths = _ascending(tolerances, "tolerances")
    shares = np.zeros_like(widths) if mass_tolerances is None else _ascending(mass_tolerances, "mass_tolerances")
    if len(shares) != len(widths) or shares.max(initial=0.0) > 1.0:
        raise InvalidInputError(
            f"mass_tolerances: expected {len(widths)} shares up to 1, one for each tolerance, got {shares.tolist()}"
        )
    if not (len(widths) and widths[0] == 0.0 and shares[0] == 0.0):
        widths, shares = np.append(0.0, widths), np.append(0.0, shares)
    sides = np.array([-1.0, 1.0])
    masses = payload.mass * (1.0 + shares[:, None] * sides)
    com = np.array(payload.com) + widths[:, None, None] * sides[:, None]
    return frozen(widths.copy()), frozen(masses), frozen(com)


def _ascending(given: Sequence[float], name: str) -> Array:
    values = numbers(given, name=name, shape=("N",))
    if (values < 0.0).any() or (np.diff(values) < 0.0).any():
        raise InvalidInputError(f"{name}: expected ascending numbers from 0 on, got {values.tolist()}")
    return values
