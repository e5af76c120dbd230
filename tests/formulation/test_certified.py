"""Limits that are proven: what they call feasible keeps them at every instant, whatever the samples miss."""

import json
import pickle

import numpy as np
import pytest

from tests.helpers import UNDRAWN, any_problem, assert_exact_gradients, mostly_long, refused, trajevo
from trajevo import Front, TrajectoryProblem, load_problem, optimise
from trajevo.capacity.uncertainty import robust_problem
from trajevo.dynamics.rollout import Rollout
from trajevo.formulation.constraints.certified import certified, held
from trajevo.formulation.constraints.joint_limits import effort_limits, velocity_limits
from trajevo.formulation.constraints.tool import tool_speed_limit
from trajevo.formulation.problem import Weights
from trajevo.formulation.registry import list_problems
from trajevo.path.curve import GeometricPath
from trajevo.problems import HybridManipulator, TimeJerkReparameterisation, ViaPointProblem
from trajevo.problems.hybrid_kinematics import via_positions
from trajevo.robot.kinematics import ToolKinematics
from trajevo.solvers.gradient.polish import polish
from trajevo.solvers.gradient.weighted_sum import minimise_weighted
from trajevo.solvers.run.folder import FRONT_FILE
from trajevo.solvers.task import load_task
from trajevo.study.definition import Study
from trajevo.verification.certify import certify, certify_all

#: Two samples per segment, its ends, miss what is between them.
UR5 = {
    "robot": {"name": "ur5", "tool": "tool0", "limits": {"acceleration": 15.0, "jerk": 300.0}},
    "points": [
        [0.0, -1.5, 1.5, -1.5, -1.5, 0.0],
        [0.8, -1.0, 1.2, -1.5, -1.5, 0.3],
        [1.5, -1.5, 1.5, -1.5, -1.5, -0.3],
    ],
    "duration_bounds": (0.3, 3.0),
    "objectives": ["time", "energy"],
    "constraints": ["position", "velocity", "acceleration", "jerk", "effort"],
    "samples": 2,
}
THROUGH = {**UR5, "tool_speed": 0.9, "points": [*UR5["points"][:2], [0.1, -1.4, 1.6, -1.5, -1.5, 0.0]]}
MASS = {**UR5, "objectives": ["time", "unused_payload"], "effort_margin": 0.2}
FEW_POINTS = {
    "positions": via_positions()[::5],
    "objectives": ["time", "unused_payload"],
    "payload_bounds": (0.0, 100.0),
    "samples": 2,
}
PROBLEMS = {
    "hybrid": lambda limits: HybridManipulator(**FEW_POINTS, limits=limits),
    "tool speed": lambda limits: ViaPointProblem(**THROUGH, limits=limits),
    "payload": lambda limits: ViaPointProblem(**MASS, limits=limits),
}
#: Those in which motions break their limits between samples; forces of a cubic spline are greatest at its knots.
MISSED = ("tool speed", "payload")
PROVEN = ("effort", "tool speed")


def solved(problem: TrajectoryProblem, size: tuple[int, int]) -> Front:
    generations, population = size
    return optimise(problem, seed=1, generations=generations, population=population, progress=False, polish=False)


@pytest.fixture(scope="module", params=mostly_long(PROBLEMS, "tool speed"))
def name(request) -> str:
    return request.param


@pytest.fixture(scope="module", params=mostly_long([(10, 16), (20, 40)], (10, 16)), ids=str)
def fronts(name, request) -> dict[str, Front]:
    return {limits: solved(PROBLEMS[name](limits), request.param) for limits in ("sampled", "certified")}


def random_vectors(problem, count=60) -> np.ndarray:
    return np.random.default_rng(0).uniform(problem.xl, problem.xu, (count, problem.n_var))


def used(problem, x, count=2001) -> np.ndarray:
    """The greatest share of what limits of effort and the tool's speed leave, of dense samples, shape (B,)."""
    rollout = problem.rollout(x)
    t = rollout.trajectory.duration[:, None] * np.linspace(0.0, 1.0, count)
    q, v, a = (rollout.trajectory.evaluate(t, order) for order in range(3))
    (share,) = [c.share for c in problem.constraints if c.quantity == "effort"]
    shares = np.abs(rollout.effort_in(q, v, a)).max(axis=1) / (share * problem.robot.limits.effort)
    most = problem.settings.get("tool_speed")
    if most is not None:
        speed = np.linalg.norm(ToolKinematics.of(problem.robot).twist(q, v)[..., :3], axis=-1).max(axis=1)
        shares = np.column_stack([shares, speed / most])
    return shares.max(axis=1)


def held_columns(problem) -> np.ndarray:
    return np.array([name.split(" of ")[0] in PROVEN for name in problem.constraint_names])


def test_every_member_of_a_front_is_proven_where_samples_let_others_pass(name, fronts):
    assert all(found.proven for found in certify_all(fronts["sampled"])) == (name not in MISSED)
    assert len(fronts["certified"]) > 5
    assert all(found.proven for found in certify_all(fronts["certified"]))


def test_what_is_feasible_keeps_its_limits_and_the_rest_is_told(name):
    problem, sampled = PROBLEMS[name]("certified"), PROBLEMS[name]("sampled")
    assert problem.constraint_names == sampled.constraint_names
    x = random_vectors(problem)
    G, before, share = problem.evaluate(x)[1], sampled.evaluate(x)[1], used(problem, x)
    columns = held_columns(problem)
    np.testing.assert_array_equal(G[:, ~columns], before[:, ~columns])
    feasible, missed = (G[:, columns] <= 0.0).all(axis=1), (before[:, columns] <= 0.0).all(axis=1) & (share > 1.0)
    np.testing.assert_array_equal(feasible, share <= 1.0)  # none of them is within rounding of its limit
    assert feasible.any()
    assert missed.any() == (name in MISSED)
    assert (before - 1e-9 <= G).all()
    assert np.isfinite(G).all()


def test_excesses_are_those_of_the_greatest_value_found(name):
    """Of a motion that breaks a limit between its samples, the excess is exhibited and not invented."""
    problem, sampled = PROBLEMS[name]("certified"), PROBLEMS[name]("sampled")
    x = random_vectors(problem)
    columns, share = held_columns(problem), used(problem, x)
    G, before = problem.evaluate(x)[1][:, columns].max(axis=1), sampled.evaluate(x)[1][:, columns].max(axis=1)
    missed = (before <= 0.0) & (share > 1.0)
    assert (G[missed] > 0.0).all()
    assert (G[missed] <= share[missed] - 1.0 + 1e-4).all()


def test_terms_are_the_peaks_and_gradient_solvers_can_take_them(name):
    problem = PROBLEMS[name]("certified")
    x, terms = random_vectors(problem, 20), problem.in_terms()
    columns = np.array([problem_name.startswith("term") for problem_name in terms.constraint_names])
    by_dense = used(problem, x) - 1.0
    worst = np.concatenate(
        [c.terms(problem.rollout(x)) for c in problem.constraints if c.sampled is not None], axis=1
    ).max(axis=1)
    near = by_dense < 0.1
    assert near.any()
    np.testing.assert_allclose(worst[near], by_dense[near], atol=2e-3)
    assert columns.sum() >= held_columns(problem).sum()
    assert_exact_gradients(terms, x[:3])


def test_gradients_of_excesses_are_those_of_the_peaks(name):
    problem = PROBLEMS[name]("certified")
    columns, x = held_columns(problem), random_vectors(problem)
    x = x[(problem.evaluate(x)[1][:, columns] <= 0.0).all(axis=1)][:4]
    F, dF, G, dG = problem.evaluate_with_gradients(x)
    np.testing.assert_allclose(G, problem.evaluate(x)[1], rtol=1e-9, atol=1e-12)
    step = 1e-5 * (problem.xu - problem.xl)
    for k in range(problem.n_var):
        ahead, behind = (used_by_column(problem, x + sign * step * (np.arange(len(step)) == k)) for sign in (1, -1))
        slopes = (ahead - behind) / (2.0 * step[k])
        np.testing.assert_allclose(dG[:, columns, k], slopes, rtol=0.02, atol=2e-3 * np.abs(slopes).max())
    assert np.isfinite(dF).all()
    assert np.isfinite(F).all()


def used_by_column(problem, x) -> np.ndarray:
    """Terms of the proven limits, the greatest of every column."""
    found = []
    for constraint in problem.constraints:
        if constraint.sampled is not None:
            terms = constraint.terms(problem.rollout(x))
            found.append(terms.reshape(len(x), -1, len(constraint.names)).max(axis=1))
    return np.concatenate(found, axis=1)


@pytest.mark.parametrize("members", mostly_long([2, 6], 2))
def test_polished_members_are_proven_and_polish_still_gains(fronts, members):
    gained = {limits: polish(front, members=members, rounds=1) for limits, front in fronts.items()}
    assert all(found.proven for found in certify_all(gained["certified"].front))
    assert gained["certified"].hypervolume_after > gained["certified"].hypervolume_before
    assert gained["certified"].refined > 0


def test_a_weighted_optimum_is_proven():
    payload = {"mass": 5.0, "com": [0.0, 0.0, 0.05]}
    problem = ViaPointProblem(**UR5, payload=payload, effort_margin=0.2, limits="certified")
    found = minimise_weighted(problem, Weights((1.0, 0.0)), seed=1, starts=2)
    assert max(found.G.values()) <= 1e-6
    efforts = [row for row in certify(found, tolerance=1e-6).rows if row.quantity == "effort"]
    assert max(row.share for row in efforts) == pytest.approx(1.0, abs=1e-3)  # of the 80 % that the problem keeps
    assert max(row.share for row in efforts) <= 1.0 + 1e-6


def test_a_path_is_limited_as_tightly_and_its_effort_proven():
    tight, proven = (TimeJerkReparameterisation(limits=limits) for limits in ("tight", "certified"))
    x = random_vectors(tight, 10)
    for of_tight, of_proven in zip(tight.evaluate(x), proven.evaluate(x), strict=True):
        np.testing.assert_array_equal(of_proven, of_tight)


@pytest.mark.long
def test_forces_along_a_path_are_proven_before_and_after_polish():
    path = GeometricPath.through(HybridManipulator().interpolant.points.positions)
    options = {"path": path, "robot": "hybrid_manipulator", "longest_time": 10.0, "effort": True, "payload": 11.0}
    problem = TimeJerkReparameterisation(**options, limits="certified", samples=2, control_points=9)
    front = optimise(problem, seed=1, generations=10, population=20, progress=False)
    found = polish(front, members=2, rounds=1)
    assert found.hypervolume_after > found.hypervolume_before
    for each in (front, found.front):
        assert all(certificate.proven for certificate in certify_all(each))
    form = problem.smooth
    assert_exact_gradients(form.problem, form.into(front.X[:2]))


@pytest.mark.parametrize("problem", list_problems())
def test_every_problem_takes_the_option_and_keeps_it(problem):
    made = any_problem(problem, limits="certified")
    assert made.settings["limits"] == "certified"
    again = load_problem(problem, **json.loads(json.dumps(made.settings)))
    x = random_vectors(made, 10)
    for copy in (again, pickle.loads(pickle.dumps(made))):
        np.testing.assert_array_equal(copy.evaluate(x)[1], made.evaluate(x)[1])
    assert made.constraint_names == any_problem(problem).constraint_names
    values = "certified, hull, tight" if problem == "reparam" else "certified, sampled"
    refused(lambda: any_problem(problem, limits="proven"), f"limits 'proven'; known: {values}")


def test_what_holds_between_samples_already_stays_as_it_is():
    robot = HybridManipulator().robot
    velocity, effort = velocity_limits(robot), effort_limits(robot, margin=0.1)
    assert held((velocity, effort), "sampled") == (velocity, effort)
    kept, proven = held((velocity, effort), "certified")
    assert kept is velocity
    assert proven.at_samples is effort
    assert certified(proven) is proven
    assert proven.share == pytest.approx(0.9)
    assert proven.proof == "pieces"
    assert certified(tool_speed_limit(robot, 1.0)).share is None


def test_payloads_of_their_own_are_decided_together():
    problem = ViaPointProblem(**MASS, limits="certified")
    x = random_vectors(problem, 12)
    rollout = problem.rollout(x)
    (limit,) = [constraint for constraint in problem.constraints if constraint.sampled is not None]
    for k, mass in enumerate(rollout.masses):
        alone = problem.dynamics.payload.with_mass(float(mass))
        dynamics = type(problem.dynamics)(problem.robot, alone, samples=2)
        found = limit.function(Rollout(dynamics, rollout.trajectory[k]))
        np.testing.assert_array_equal(found > 0.0, limit.function(rollout)[k : k + 1] > 0.0)


def test_robust_limits_stay_at_samples_and_the_others_proven():
    problem = ViaPointProblem(**UR5, payload={"mass": 2.0}, tool_speed=1.0)
    robust = robust_problem(problem, mass=(1.0, 3.0), com=[[0.0] * 3, [0.1] * 3])
    assert [bool(limit.sampled) for limit in problem.constraints if "effort" in limit.names[0]] == [True]
    assert not any(limit.sampled for limit in robust.constraints if "effort" in limit.names[0])
    assert [bool(limit.sampled) for limit in robust.constraints if "tool speed" in limit.names[0]] == [True]


TASK = """
robot = "puma560"
points = [[0.0, 0.0, 0.0, 0.0, 0.0, 0.0], [0.3, 0.2, 0.1, 0.0, 0.0, 0.0], [0.5, 0.3, 0.2, 0.1, 0.0, 0.0]]
duration_bounds = [0.5, 3.0]
[constraints]
tool_speed = 1.0
held = "certified"
"""


def test_a_task_says_it_in_its_file(tmp_path):
    file = tmp_path / "task.toml"
    file.write_text(TASK)
    problem = load_task(file).problem
    assert problem.settings["limits"] == "certified"
    assert [c.names[0] for c in problem.constraints if c.sampled] == ["effort of joint_1", "tool speed"]
    file.write_text(TASK.replace('"certified"', '"proven"'))
    refused(lambda: load_task(file), r"task.toml: line 7: constraints.held: .*'sampled' or 'certified', got 'proven'")


def test_the_command_line_and_run_folders_know_it(tmp_path):
    sizes = ("--generations", 2, "--population", 8, *UNDRAWN)
    run = trajevo("solve", "pointing", "--limits", "certified", *sizes, "--out", tmp_path / "run")
    assert run.returncode == 0, run.stderr
    assert Front.load(tmp_path / "run" / FRONT_FILE).problem.settings["limits"] == "certified"


@pytest.mark.parametrize("asked", [("--limits", "proven"), ("--set", "limits=proven")])
def test_a_wrong_value_ends_the_command_with_one_sentence(tmp_path, asked):
    run = trajevo("solve", "hybrid", *asked, "--out", tmp_path / "run")
    assert run.returncode == 2
    assert "limits 'proven'; known: certified, sampled" in run.stderr
    assert "Traceback" not in run.stderr


def test_a_study_compares_both():
    study = Study("hybrid", seed=1, factors={"limits": ["sampled", "certified"]}, repeats=1, generations=2)
    assert [job["arguments"]["limits"] for job in study.jobs] == ["sampled", "certified"]
