"""Wrong types to public functions get a sentence of ours, never a traceback from inside."""

import numpy as np
import pytest

from tests.helpers import refused
from trajevo import Front, ViaPoints, export, load_robot, optimise, plots, read_run
from trajevo.capacity.dlcc import dlcc, dlcc_iterative
from trajevo.capacity.payload_time import capacity_front
from trajevo.front import selection
from trajevo.problems import HybridManipulator, PointingMechanism
from trajevo.problems.hybrid_manipulator import paper_solution
from trajevo.robot.joints import Friction
from trajevo.trajectory.interpolants import THROUGH_POINTS, HybridQuartic, QuinticSpline, SepticSpline, stop_and_go

POINTS = ViaPoints(np.arange(8.0).reshape(4, 2) ** 2)

CASES = {
    "interpolant as list": (lambda: PointingMechanism(interpolant=[1]), "unknown interpolant"),
    "convention as number": (lambda: HybridManipulator(convention=3), "unknown convention"),
    "payload as text": (lambda: HybridManipulator(payload="x"), "payload.mass: expected a number"),
    "decode text": (lambda: PointingMechanism().decode("a"), "x: expected segment times"),
    "decode short": (lambda: PointingMechanism().decode([1, 2]), r"x: expected segment times of shape \(B, 4\)"),
    "one configuration": (lambda: load_robot("pointing_mechanism").tool_poses([0, 0]), r"q: expected shape \(T, 2\)"),
    "no robot": (lambda: load_robot(None), "robot: expected a name or the path of a folder"),
    "no file": (lambda: Front.load(5), "expected the path of a file"),
    "number as file of a motion": (
        lambda: export(None, 3, format="csv"),
        "file: expected the path of a file, got 3",
    ),
    "number as folder": (lambda: read_run(3), "folder: expected the path of a folder, got 3"),
    "number as folder of a new run": (
        lambda: optimise(PointingMechanism(), seed=1, generations=1, population=4, polish=False, out=3),
        "out: expected the path of a folder, got 3",
    ),
    "array as points": (lambda: QuinticSpline(np.eye(3), duration_bounds=(1, 2)), "needs ViaPoints, got ndarray"),
    "text as bounds": (lambda: SepticSpline(POINTS, duration_bounds="ab"), "duration_bounds: expected numbers"),
    "no bounds": (lambda: HybridQuartic(POINTS, duration_bounds=None), "duration_bounds: expected shape"),
    "no profile": (
        lambda: stop_and_go(POINTS, None, profile=None),
        "unknown profile None: expected a name, got NoneType",
    ),
    "no joints": (lambda: ViaPoints(np.zeros((3, 0))), "at least 1 joint"),
    "text as points": (lambda: ViaPoints("abc"), "points: expected numbers"),
    "no rows": (lambda: selection.knee(np.empty((0, 3))), "at least one point"),
    "NaN rows": (lambda: selection.nearest_to_utopia(np.array([[np.nan, 1.0]])), "finite numbers"),
    "text as weights": (lambda: selection.weighted(np.eye(3), "abc"), "weights: expected numbers"),
    "number as problem": (lambda: optimise(5, seed=1, polish=False), "problem: expected a TrajectoryProblem"),
    "number as motion": (lambda: dlcc(5), "motion: expected a solution, an optimum or a rollout, got int"),
    "number as profile": (lambda: plots.profiles(5), "motion: expected a solution, an optimum or a rollout, got int"),
    "text as step": (
        lambda: dlcc_iterative(HybridManipulator().rollout(paper_solution()), step="a"),
        "step: expected numbers",
    ),
    "no payloads": (lambda: capacity_front(HybridManipulator(), [], seed=1), "payloads: expected at least one"),
    "cost as time": (
        lambda: capacity_front(HybridManipulator(objectives="cost"), [1.0], seed=1),
        "expected the time among the objectives",
    ),
    "one vector for gradients": (
        lambda: PointingMechanism().evaluate_with_gradients(np.ones(4)),
        r"x: expected shape \(B, 4\)",
    ),
    "friction of another size": (
        lambda: Friction(np.zeros(2), np.zeros(3), np.zeros(2)),
        r"friction.coulomb: expected shape \(2,\), got \(3,\)",
    ),
    "one sample": (lambda: HybridManipulator(samples=1), "samples: expected a whole number of at least 2"),
    "no thread": (lambda: HybridManipulator(threads=0), "threads: expected a whole number of at least 1"),
}


@pytest.mark.parametrize("case", CASES)
def test_wrong_types_get_a_sentence(case):
    refused(*CASES[case])


def test_an_empty_population_is_an_empty_batch():
    for interpolant in THROUGH_POINTS.values():
        made = interpolant(POINTS, duration_bounds=(1, 2))
        batch = made(np.ones((0, len(made.variables))))
        assert len(batch) == 0
        assert batch.peak(1).shape == (0, 2)
