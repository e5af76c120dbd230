"""Rows of the table: torques of a batch of states, and splines through points."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator
from typing import Any

import numpy as np
import pinocchio as pin
from cases import FAST, PLAIN, Case, Line
from compare import Action
from elementwise import virtual_knots
from scipy.interpolate import CubicSpline
from subjects import candidates, ours, ur5, without_numba

from trajevo import load_robot
from trajevo.base import jit
from trajevo.base.arrays import Array
from trajevo.dynamics.rnea import inverse_dynamics

STATES, TRAJECTORIES = 7200, 100
ROBOTS: dict[str, dict[str, Any]] = {
    "puma560": {},
    "hybrid_manipulator": {},
    "ur5": {"tool": "tool0", "limits": {"acceleration": 10.0, "jerk": 100.0}},
}


def lines() -> Iterator[Line]:
    """Torques of every robot, then splines."""
    for name, arguments in ROBOTS.items():
        yield from torques(name, load_robot(name, **arguments).model).lines()
    yield from splines().lines()


def torques(name: str, model: Any) -> Case:
    """Inverse dynamics of the same random states, one thread."""
    pool, data = pin.ModelPool(model, 1), model.createData()
    states = np.random.default_rng(0).uniform(-2.0, 2.0, (3, STATES, model.nv))
    batch = np.empty_like(states[0])
    with without_numba():
        plain = inverse_dynamics(model, threads=1)
    ways: dict[str, Action] = {
        "loop of pin.rnea": lambda: [pin.rnea(model, data, *state) for state in zip(*states, strict=True)],
        "pin.rneaInParallel": lambda: pin.rneaInParallel(1, pool, *(x.T for x in states), batch.T),
        PLAIN: lambda: plain(*states, batch),
    }
    if jit.can_compile():
        quick = inverse_dynamics(model, threads=1)
        ways[FAST] = lambda: quick(*states, batch)
    peer, missing = roboticstoolbox(states) if name == "puma560" else ({}, ())
    return Case(
        title=f"inverse dynamics of a state, {name}, {model.nv} joints",
        ways=peer | ways,
        per=STATES,
        missing=missing,
    )


def roboticstoolbox(states: Array) -> tuple[dict[str, Action], tuple[str, ...]]:
    """The PUMA 560 of roboticstoolbox, whose `rne` is written in C and called in a loop of its own."""
    if importlib.util.find_spec("roboticstoolbox") is None:
        return {}, ("roboticstoolbox rne",)
    import roboticstoolbox as rtb

    arm = rtb.models.DH.Puma560()
    return {"roboticstoolbox rne": lambda: arm.rne(*states)}, ()


def splines() -> Case:
    """Coefficients of cubic splines of six joints from the times between their knots."""
    problem = ur5()
    h = candidates(problem, TRAJECTORIES)
    points = problem.interpolant.points.positions
    # Where the two virtual knots are is found beforehand for SciPy, and by us on the way.
    known = [(np.concatenate([[0.0], np.cumsum(row)]), virtual_knots(points, row)) for row in h]
    return Case(
        title="spline of 6 joints, 13 knots",
        ways={
            "SciPy, a CubicSpline for each joint": lambda: [
                CubicSpline(t, column, bc_type="natural") for t, knots in known for column in knots.T
            ],
            "SciPy, one CubicSpline": lambda: [CubicSpline(t, knots, bc_type="natural") for t, knots in known],
        }
        | ours(ur5, lambda problem: problem.interpolant(h)),
        per=TRAJECTORIES,
    )
