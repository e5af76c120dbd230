"""The price in time of a payload known only as intervals: robust problems and their least times."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import final

import numpy as np

from trajevo.base.arrays import Array, frozen, numbers
from trajevo.base.shown.brief import brief
from trajevo.capacity.dlcc import SAMPLES
from trajevo.capacity.notebook import curve_html
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
    """The least time of a motion for payloads of increasing uncertainty.

    Attributes:
        tolerances: tolerances of every coordinate of the centre of mass, to either side, ascending from 0, shape (N,)
            [m].
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

    __repr__ = brief

    def _repr_html_(self) -> str:
        headers = ("tolerance of the centre of mass [mm]", "least duration [s]", "price [%]")
        return curve_html("Price of uncertainty", headers, (1e3 * self.tolerances, self.times, 100.0 * self.price))

    @property
    def price(self) -> Array:
        """Share by which each motion takes longer than that for the exactly known payload, shape (N,)."""
        return frozen(self.times / self.times[0] - 1.0)


def robust_problem(
    problem: TrajectoryProblem,
    *,
    mass: Sequence[float],
    com: Sequence[Sequence[float]],
    payload: Payload | None = None,
) -> TrajectoryProblem:
    """The same problem with effort limits that hold for every payload in given intervals.

    The payload gives the model and the inertia per kilogram, and objectives that depend on a payload use it. Intervals
    of a payload that was identified come with it: ``robust_problem(problem, **found.intervals())``. The new problem is
    not a registered one, and its effort limits hold at samples, even if those of the given problem are proven between
    them.

    Args:
        problem: a problem with effort limits among its constraints.
        mass: least and greatest mass, shape (2,) [kg].
        com: least and greatest coordinates of the centre of mass in the tool frame, shape (2, 3) [m].
        payload: the nominal payload; that of the problem if None.

    Raises:
        InvalidInputError: a problem without effort limits, with the payload's mass as a variable or with a payload
            model without centre of mass; an interval whose ends are not in ascending order, or a negative mass.
    """
    if problem.payload_range is not None:
        raise InvalidInputError("problem: expected a payload that is given, its mass is a decision variable")
    shares = [c.share if c.quantity == "effort" else None for c in problem.constraints]
    if not any(share is not None and c.names for share, c in zip(shares, problem.constraints, strict=True)):
        raise InvalidInputError(
            f"problem: expected effort limits among its constraints, got {list(problem.constraint_names)}"
        )
    dynamics = problem.dynamics if payload is None else replace(problem.dynamics, payload=payload)
    constraints = tuple(
        constraint if share is None else robust_effort_limits(dynamics, mass=mass, com=com, margin=1.0 - share)
        for share, constraint in zip(shares, problem.constraints, strict=True)
    )
    corner = problem.reference_point
    return TrajectoryProblem(
        dynamics=dynamics,
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
    """Re-optimise for least time with boxes of increasing size around the problem's own payload, by SLSQP.

    A motion for a box is feasible for every box inside it, so that the least time does not decrease. If a faster motion
    was found for a wider box, the problem of the narrower box is solved again from there.

    Args:
        problem: a problem with the time [s] among its objectives and effort limits among its constraints; its payload
            is the nominal one.
        tolerances: tolerances of every coordinate of the centre of mass, to either side, ascending [m]. The exactly
            known payload always comes first and need not be among them.
        mass_tolerances: tolerances of the mass, as shares of it, one for each of ``tolerances``, not descending; 0 if
            None.
        seed: seed of the random starts.
        starts: random starts for each box.

    Raises:
        InvalidInputError: tolerances that are negative, descend or differ in number, a mass tolerance above 1, or a
            problem without payload, without the time as objective, without effort limits, or without a feasible motion
            that carries the payload.
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
    """The price of uncertainty for one motion whose path is fixed and whose time is scaled uniformly.

    Args:
        motion: a solution of a front, an optimum, or the first trajectory of a rollout; its payload is the nominal one.
        tolerances: as for :func:`price_of_uncertainty`.
        mass_tolerances: as for :func:`price_of_uncertainty`.
        samples: instants per segment, both ends included.

    Returns:
        Least times, inf where some payload in the box cannot be carried along this path at any speed.

    Raises:
        InvalidInputError: tolerances as for :func:`price_of_uncertainty`, or a nominal payload that has no mass or
            cannot be carried along this path.
    """
    payload = rollout_of(motion).dynamics.payload
    widths, masses, com = _boxes(payload, tolerances, mass_tolerances)
    times = np.full(len(widths), np.inf)
    times[0] = robust_slowdown(motion, mass=masses[0], com=com[0], samples=samples).duration
    for i in range(1, len(widths)):
        try:
            times[i] = robust_slowdown(motion, mass=masses[i], com=com[i], samples=samples).duration
        except InvalidInputError:
            break  # wider boxes cannot be carried either
    return UncertaintyPrice(widths, masses, com, frozen(times), None, payload.model)


def _boxes(
    payload: Payload, tolerances: Sequence[float], mass_tolerances: Sequence[float] | None
) -> tuple[Array, Array, Array]:
    """Tolerances (N,), masses (N, 2) and centres of mass (N, 2, 3) around a payload, the exact payload first."""
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
