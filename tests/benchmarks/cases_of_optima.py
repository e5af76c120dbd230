"""Problems of least time for ``bench_casadi.py``, most of them also as they are written anew without trajevo."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import splines_anew as anew

from trajevo import Robot, ViaPointProblem, load_robot, load_task

#: Decision vector, as a list of its elements, and module -> least time [s], and shares of limits with signs.
Formulation = Callable[[list[Any], Any], tuple[Any, list[Any]]]

VELOCITY, ACCELERATION, JERK = [3.14] * 3 + [6.28] * 3, [15.0] * 6, [200.0] * 6
THREE = [
    [-0.8, -1.9, 1.4, -1.2, -1.5, 0.3],
    [0.4, -1.0, 0.9, -1.6, -1.2, -0.8],
    [1.3, -1.6, 1.7, -0.9, -1.8, 1.0],
]
RODS = Path(__file__).parents[1] / "data" / "rods.urdf"
PAYLOAD, SAMPLES = 1.0, 8

#: How many of the cases are compared if no numbers are given; the further ones are known to have many valleys.
USUAL = 6


@dataclass(frozen=True)
class Compared:
    """A problem, and how it is written anew.

    Attributes:
        title: what it is.
        problem: trajevo's problem.
        formulation: the same, written anew; None if gradients come from trajevo.
    """

    title: str
    problem: ViaPointProblem
    formulation: Formulation | None = None


def cases() -> list[Compared]:
    """The six that are compared, and one with more points that move."""
    task = dict(load_task("ur5_pick_and_place").problem.settings)
    return [
        Compared("six joints, cubic", six_joints(), partial(anew_six_joints, count=0)),
        Compared("six joints, cubic, extra_points = 2", six_joints(extra_points=2), partial(anew_six_joints, count=2)),
        Compared("six joints, bspline", six_joints(interpolant="bspline")),
        Compared("rods, cubic, points that move", rods("cubic", 5), partial(anew_rods_cubic, count=5)),
        Compared("UR5, pick and place, sampled", ViaPointProblem(**task | {"limits": "sampled"})),
        Compared("rods, hermite, points that move", rods("hermite", 5), anew_rods_hermite),
        Compared("rods, cubic, eight points", rods("cubic", 8), partial(anew_rods_cubic, count=8)),
    ]


def six_joints(**given: Any) -> ViaPointProblem:
    """Six joints through three points, under limits of velocity, acceleration and jerk."""
    robot = Robot.from_limits(velocity=VELOCITY, acceleration=ACCELERATION, jerk=JERK, names=list("abcdef"))
    return ViaPointProblem(robot=robot, points=THREE, duration_bounds=(0.02, 3.0), **{"interpolant": "cubic"} | given)


def rods(interpolant: str, count: int) -> ViaPointProblem:
    """Two rods with 1 N·m at each joint, through points of which the inner ones may move."""
    return ViaPointProblem(
        robot=load_robot(RODS, limits={"acceleration": np.inf, "jerk": np.inf}),
        points=in_a_row(count),
        interpolant=interpolant,
        duration_bounds=(0.02, 4.0),
        moving=[{"point": k, "joints": [1.0, 1.5]} for k in range(1, count - 1)],
        objectives=["time", "energy"],
        constraints=["effort"],
        limits="sampled",
        payload=PAYLOAD,
        samples=SAMPLES,
    )


def anew_six_joints(x: list[Any], xp: Any, *, count: int) -> tuple[Any, list[Any]]:
    """The first two problems, without trajevo."""
    pieces = anew.cubic_with_free_points(THREE, x, count) if count else anew.cubic(THREE, x)
    shares = anew.shares_of_derivatives(pieces, VELOCITY, ACCELERATION, JERK, xp)
    return sum(x[: len(THREE) + 1]), [share for kind in shares for share in kind]


def anew_rods_cubic(x: list[Any], xp: Any, *, count: int) -> tuple[Any, list[Any]]:
    """The fourth problem, and the one of eight points, without trajevo."""
    pieces = anew.cubic(_moved(count, x[count + 1 :]), x[: count + 1])
    return sum(x[: count + 1]), anew.TwoLinks.of(RODS, PAYLOAD).shares(pieces, SAMPLES, xp)


def anew_rods_hermite(x: list[Any], xp: Any) -> tuple[Any, list[Any]]:
    """The sixth problem, without trajevo."""
    pieces = anew.hermite(_moved(5, x[10:]), x[:4], [x[4:7], x[7:10]])
    return sum(x[:4]), anew.TwoLinks.of(RODS, PAYLOAD).shares(pieces, SAMPLES, xp)


def in_a_row(count: int) -> list[list[float]]:
    """The points of the rods, (count, 2) [rad]."""
    return [[0.522 * k / (count - 1), 0.5] for k in range(count)]


def _moved(count: int, offsets: list[Any]) -> list[list[Any]]:
    """These points, the inner ones moved."""
    first, *inner, last = in_a_row(count)
    moved = [[point[j] + offsets[2 * k + j] for j in range(2)] for k, point in enumerate(inner)]
    return [first, *moved, last]


def random_vectors(problem: ViaPointProblem, count: int, seed: int) -> np.ndarray:
    """Decision vectors uniform between the bounds, shape (count, n_var)."""
    return np.random.default_rng(seed).uniform(problem.xl, problem.xu, (count, problem.n_var))


def disagreement(case: Compared, count: int = 20, seed: int = 7) -> float:
    """Greatest difference, as a share, of least times and of the share of every limit between both formulations.

    Raises:
        ValueError: the problem is not written anew.
    """
    if case.formulation is None:
        raise ValueError(f"{case.title} is not written anew")
    problem = case.problem
    X = random_vectors(problem, count, seed)
    F, G = problem.evaluate(X, return_values_of=["F", "G"])
    took, shares = case.formulation(list(X.T), np)
    # Of one limit all joints of a piece or a sample come one after another, as the columns of G do.
    of_limits = np.abs(np.stack([np.broadcast_to(share, count) for share in shares]))
    greatest = of_limits.reshape(G.shape[1] // problem.robot.dof, -1, problem.robot.dof, count).max(axis=1)
    time = F[:, problem.objective_names.index("time")]
    off = np.abs(greatest.reshape(G.shape[1], count).T / (1.0 + G) - 1.0)
    return float(max(np.abs(took / time - 1.0).max(), off.max()))
