"""Rows of the table: the payload capacity of a motion, in closed form and by what else is done."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from cases import PLAIN, Case, Line
from elementwise import HybridLoop

from trajevo.capacity.dlcc import SAMPLES, dlcc, dlcc_iterative
from trajevo.dynamics.integrals.nodes import lobatto
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.problems import HybridManipulator
from trajevo.problems.hybrid_manipulator import paper_solution

STEPS, HEAVIEST = 20, 40.0  # of the bisection; the mass it begins from [kg]


def lines() -> Iterator[Line]:
    """The motion of Guo 2016, Table 7."""
    problem = HybridManipulator()
    rollout, loop = problem.rollout(paper_solution()), HybridLoop(problem)
    closed, halved, looped = dlcc(rollout).mass, bisection(rollout), looped_bisection(loop, rollout)
    if max(abs(halved - closed), abs(looped - closed)) > HEAVIEST / 2**STEPS + 1e-6:
        raise SystemExit(f"capacities differ: {closed:.6f} kg in closed form, {halved:.6f} and {looped:.6f} by halving")
    yield from Case(
        title=f"capacity of a motion, {SAMPLES * problem.n_var} instants",
        ways={
            f"{STEPS} halvings, loop of pin.rnea": lambda: looped_bisection(loop, rollout),
            f"{STEPS} halvings in batches": lambda: bisection(rollout),
            "the paper's iteration, steps of 0.05 kg": lambda: dlcc_iterative(rollout),
            PLAIN: lambda: dlcc(rollout),
        },
    ).lines()


def bisection(rollout: Rollout) -> float:
    """The largest payload [kg] by halving an interval: one batched effort per step, at the samples of `dlcc`."""
    robot, payload = rollout.robot, rollout.dynamics.payload
    q, v, a = (rollout.trajectory.at_shares(lobatto(SAMPLES)[0], order) for order in range(3))
    low, high = 0.0, HEAVIEST
    for _ in range(STEPS):
        mass = 0.5 * (low + high)
        effort = Dynamics(robot, payload.with_mass(mass)).effort(q, v, a)
        low, high = (mass, high) if (np.abs(effort) <= robot.limits.effort).all() else (low, mass)
    return low


def looped_bisection(loop: HybridLoop, rollout: Rollout) -> float:
    """The same as users write it: the payload attached anew at every step, a Python loop of `pin.rnea`."""
    q, v, a = (rollout.trajectory.at_shares(lobatto(SAMPLES)[0], order)[0] for order in range(3))
    limit, low, high = rollout.robot.limits.effort, 0.0, HEAVIEST
    for _ in range(STEPS):
        mass = 0.5 * (low + high)
        loop.attach(rollout.robot, mass)
        low, high = (mass, high) if (np.abs(loop.effort(q, v, a)) <= limit).all() else (low, mass)
    return low
