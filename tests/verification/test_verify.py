"""Verification: what is feasible passes; tightened limits, tampered records and wrong dynamics do not."""

import copy
import dataclasses
import json

import numpy as np
import pytest

from tests.helpers import POINTS, any_problem, mostly_long, refused, small_problem, trajevo
from trajevo import PolynomialBatch, TrajectoryProblem, ViaPointProblem, load_problem, load_robot, optimise
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.formulation.constraints.constraint import Constraint
from trajevo.formulation.constraints.joint_limits import effort_limits, kinematic_limits
from trajevo.formulation.constraints.path_limits import hull_limits
from trajevo.formulation.objectives import Objective, summed_rms_jerk, total_time, unused_payload
from trajevo.front.records import ProblemRecord
from trajevo.robot.payload import Payload
from trajevo.trajectory.interpolants import QuinticSpline, SinglePolynomial
from trajevo.verification.verify import TOLERANCE, verify, verify_all

TIME, JERK = Objective("time", "s", "test", total_time), Objective("jerk", "rad/s^3", "test", summed_rms_jerk)


def solved(problem, generations=10):
    return optimise(problem, seed=1, generations=generations, population=20, progress=False, polish=False)


@pytest.fixture(scope="module")
def front():
    return solved(small_problem())


def with_robot(solution, **limits):
    """The same motion of a robot with other limits."""
    problem = copy.copy(solution.front.problem)
    robot = dataclasses.replace(problem.robot, limits=dataclasses.replace(problem.robot.limits, **limits))
    problem.dynamics = dataclasses.replace(problem.dynamics, robot=robot)
    return of_problem(solution, problem)


def of_problem(solution, problem):
    record, G = ProblemRecord.of(problem), np.zeros((len(solution.front), len(problem.constraint_names)))
    front = dataclasses.replace(solution.front, G=G, record=record, _problem=problem)
    return dataclasses.replace(solution, front=front)


@pytest.mark.parametrize(
    ("name", "arguments", "generations"),
    [
        ("pointing", {}, 5),
        ("reparam", {}, 10),
        pytest.param("reparam", {"encoding": "shape"}, 5, marks=pytest.mark.long),
        ("via-points", {"interpolant": "linear_blends"}, 10),
        pytest.param("via-points", {"interpolant": "hybrid"}, 20, marks=pytest.mark.long),
    ],
)
@pytest.mark.parametrize("every", mostly_long([1, 6], 6))
def test_feasible_solutions_pass(name, arguments, generations, every):
    front = solved(any_problem(name, **arguments), generations)
    some = dataclasses.replace(front, **{values: getattr(front, values)[::every] for values in "XFG"})
    found = verify_all(some)
    assert len(found) == len(some) > 2
    for verification in found:
        assert verification.passed, verification.verdict
        assert verification.verdict.count("keeps every limit") == 1
        assert verification.worst.share <= 1.0 + TOLERANCE
        assert max(verification.derivative_mismatch, verification.record_mismatch) < 1e-5
        assert verification.effort_difference < 1e-9


def test_utilisation_is_that_of_the_exact_peaks(front):
    solution = front.knee()
    trajectory, limits = solution.trajectory, solution.front.problem.robot.limits
    rows = verify(solution, density=200).rows
    for order, limit in enumerate(("velocity", "acceleration", "jerk"), start=1):
        found = [row.share for row in rows if row.limit == limit]
        np.testing.assert_allclose(found, trajectory.peak(order)[0] / getattr(limits, limit), rtol=1e-5)
    least, greatest = (bound[0] for bound in trajectory.extremes(0))
    middle, half = 0.5 * (limits.lower + limits.upper), 0.5 * (limits.upper - limits.lower)
    found = [row.share for row in rows if row.limit == "position"]
    np.testing.assert_allclose(found, np.maximum(greatest - middle, middle - least) / half, rtol=1e-5)


def test_instants_and_joints_are_those_of_the_peaks(front):
    solution = front.knee()
    robot, trajectory = solution.front.problem.robot, solution.trajectory
    for row in verify(solution).rows:
        if row.limit in ("velocity", "acceleration"):
            joint = robot.joint_names.index(row.joint)
            value = trajectory.evaluate(np.array([row.instant]), 1 + (row.limit == "acceleration"))[0, 0, joint]
            assert abs(value) / getattr(robot.limits, row.limit)[joint] == pytest.approx(row.share, rel=1e-9)


@pytest.mark.parametrize("limit", ["velocity", "acceleration", "jerk", "effort"])
@pytest.mark.parametrize("joint", [0, 1])
def test_limits_that_are_tightened_by_5_percent_fail_and_name_the_joint(front, limit, joint):
    solution = front.knee()
    name = solution.front.problem.robot.joint_names[joint]
    wide = with_robot(solution, **{limit: np.array([1e3, 1e3])})
    used = next(row.share for row in verify(wide).rows if (row.limit, row.joint) == (limit, name))
    exact = np.where(np.arange(2) == joint, used * 1e3, 1e3)
    assert verify(with_robot(solution, **{limit: exact})).passed
    assert verify(with_robot(solution, **{limit: exact / (1.0 + 0.5 * TOLERANCE)})).passed
    found = verify(with_robot(solution, **{limit: exact / 1.05}))
    assert not found.passed
    assert [(row.limit, row.joint) for row in found.exceeded] == [(limit, name)]
    assert found.worst.share == pytest.approx(1.05)
    assert f"FAILS: {limit} of {name}: 105.00 % of the limit at" in found.verdict


def test_positions_out_of_range_fail(front):
    solution, limits = front.knee(), front.problem.robot.limits
    low = POINTS.positions.min(axis=0)
    found = verify(with_robot(solution, lower=low + 0.05, upper=np.array([np.inf, limits.upper[1]])))
    assert {(row.limit, row.joint) for row in found.exceeded} >= {("position", "joint_1"), ("position", "joint_2")}
    free = verify(with_robot(solution, lower=np.full(2, -np.inf), upper=np.full(2, np.inf)))
    assert free.passed
    assert "position" not in {row.limit for row in free.rows}


def test_faster_fails_by_its_limits_and_slower_by_its_record(front):
    faster, slower = (dataclasses.replace(front, X=factor * front.X) for factor in (0.2, 1.5))
    found = verify(faster.pick("0"))
    assert {row.limit for row in found.exceeded} >= {"velocity"}
    assert not found.passed
    found = verify(slower.pick("0"))
    assert not found.exceeded
    assert not found.passed
    assert "FAILS: the objectives on record are not those of the decision variables" in found.verdict
    assert [one.passed for one in verify_all(slower)] == [False] * len(front)


def test_payload_counts(front):
    effort = {}
    for mass in (0.0, 2.0):
        problem = copy.copy(front.problem)
        problem.dynamics = Dynamics(problem.robot, Payload(mass))
        solution = of_problem(front.knee(), problem)
        found = verify(with_robot(solution, effort=np.array([1e3, 1e3])))
        effort[mass] = max(row.share for row in found.rows if row.limit == "effort")
        assert found.effort_difference < 1e-9
    assert effort[2.0] > 1.1 * effort[0.0]


def test_mass_as_a_decision_variable_counts():
    robot = load_robot("pointing_mechanism")
    robot = dataclasses.replace(robot, limits=dataclasses.replace(robot.limits, effort=np.array([1e3, 1e3])))
    problem = TrajectoryProblem(
        dynamics=Dynamics(robot),
        interpolant=QuinticSpline(POINTS, duration_bounds=(1.0, 10.0)),
        objectives=(TIME, Objective("unused", "kg", "test", unused_payload(5.0))),
        constraints=kinematic_limits(robot),
        payload_range=(0.0, 5.0),
    )
    front = solved(problem)
    shares = {}
    for x in (0.0, 5.0):
        tampered = dataclasses.replace(front, X=np.column_stack([front.X[:, :-1], np.full(len(front), x)]))
        found = verify(tampered.pick("0"))
        shares[x] = max(row.share for row in found.rows if row.limit == "effort")
        assert found.effort_difference < 1e-9
    assert shares[5.0] > 1.1 * shares[0.0]


def test_effort_between_the_samples_is_caught():
    """With two samples per segment the problem sees rest at both ends and nothing of the motion between them."""
    robot = load_robot("pointing_mechanism")
    points = type(POINTS)(np.array([[0.2, 0.1], [-0.2, 0.3]]))
    limits = dataclasses.replace(robot.limits, effort=np.array([np.inf, np.inf]))
    robot = dataclasses.replace(robot, limits=limits)
    interpolant = SinglePolynomial(points, duration_bounds=(0.5, 0.6))

    def problem_of(robot):
        return TrajectoryProblem(
            dynamics=Dynamics(robot, Payload(2.0), samples=2),
            interpolant=interpolant,
            objectives=(TIME, JERK),
            constraints=(effort_limits(robot),),
        )

    at_ends = np.abs(problem_of(robot).rollout(np.array([0.5])).effort[0]).max(axis=0)
    tight = dataclasses.replace(robot, limits=dataclasses.replace(limits, effort=1.05 * at_ends + 1e-3))
    found = [
        one
        for one in verify_all(solved(problem_of(tight), 3))
        if {row.limit for row in one.exceeded} >= {"effort"} and not one.doubts
    ]
    assert found
    assert all(row.instant > 0.0 for one in found for row in one.exceeded if row.limit == "effort")


def patience(rollout):
    """The duration over 1 s, minus 1, and how many samples it was told about."""
    duration = rollout.trajectory.duration
    return np.stack([duration - 1.0, np.full_like(duration, 0.001 * rollout.t.shape[1] - 1.0)], axis=1)


def test_other_constraints_are_evaluated_at_denser_samples(front):
    problem = small_problem()
    extra = Constraint(("patience", "samples"), "test", patience)
    strict = small_problem(constraints=(*problem.constraints, extra))
    solution = of_problem(front.knee(), strict)
    found = {row.limit: row for row in verify(solution, density=7).rows if row.joint is None}
    assert found["patience"].share == pytest.approx(front.knee().F["time"])
    assert found["samples"].share == pytest.approx(0.001 * 2 * 7 * problem.dynamics.samples)
    assert found["patience"].instant is None
    assert [row.limit for row in verify(solution, density=7).exceeded] == ["patience"]


def test_limits_of_the_robot_are_told_from_other_constraints():
    robot = load_robot("pointing_mechanism")
    assert all(c.share == 1.0 for c in (*kinematic_limits(robot), effort_limits(robot), *hull_limits(robot)))
    assert Constraint(("velocity of joint_1",), "test", patience).share is None


def test_velocities_that_are_no_derivatives_fail(front, monkeypatch):
    honest = PolynomialBatch.at_shares

    def one_percent_off(self, u, derivative):
        return honest(self, u, derivative) * (1.01 if derivative == 1 else 1.0)

    monkeypatch.setattr(PolynomialBatch, "at_shares", one_percent_off)
    found = verify(front.least("jerk"))
    assert found.derivative_mismatch == pytest.approx(0.01, rel=0.05)
    assert "are not derivatives of each other" in found.verdict


def test_a_jump_of_position_fails(front, monkeypatch):
    honest = PolynomialBatch.at_shares

    def torn(self, u, derivative):
        values = honest(self, u, derivative).copy()
        if derivative == 0:
            values[:, values.shape[1] // 2 :] += 0.01
        return values

    monkeypatch.setattr(PolynomialBatch, "at_shares", torn)
    assert verify(front.pick("0")).derivative_mismatch > 0.01
    assert not verify(front.pick("0")).passed


def test_a_joint_that_inverse_kinematics_moves_by_rounding_is_at_rest():
    down = {"rpy": [np.pi, 0.0, 0.0], "free": "z"}
    places = [[0.45, -0.30, 0.40], [0.45, -0.30, 0.20], [0.45, -0.30, 0.40], [0.45, 0.0, 0.62]]
    home = np.radians([0.0, -100.0, 100.0, -90.0, -90.0, 0.0]).tolist()
    problem = ViaPointProblem(
        robot={"name": "ur5", "tool": "tool0", "limits": {"acceleration": 14.0, "jerk": 140.0}},
        points=[home, *({"position": place, **down} for place in places)],
        segments=[{"from": 1, "tool": "line", "rest": "end"}, {"from": 2, "tool": "line", "rest": "start"}],
        passing=[{"point": 2, "dwell": 0.3}],
        duration_bounds=(0.1, 3.0),
    )
    found = optimise(problem, seed=1, population=12, generations=3, polish=False, progress=False)
    travel = np.ptp(found.pick("0").trajectory.sample(100).q[0], axis=0)
    assert travel.min() < 1e-10, "the last joint was meant to stand"
    assert all(verify(found.pick(str(row))).passed for row in range(len(found)))


def test_a_model_that_is_not_the_urdfs_fails(front):
    problem = copy.copy(front.problem)
    model = problem.robot.model.copy()
    model.inertias[2] = model.inertias[2] + model.inertias[2]
    problem.dynamics = Dynamics(dataclasses.replace(problem.robot, model=model))
    found = verify(of_problem(front.knee(), problem))
    assert "the effort is not what Pinocchio says" in found.verdict
    assert found.effort_difference > 0.01


@pytest.mark.parametrize("density", [1, 0, -3, 2.5, "20", True, None, float("nan"), 201])
def test_bad_density_is_refused(front, density):
    refused(lambda: verify(front.knee(), density=density), "^density: expected a whole number from 2 to 200, got ")


def test_what_is_no_solution_is_refused(front):
    refused(lambda: verify(front), "^solution: expected a solution of a front, got Front")
    empty = dataclasses.replace(front, X=front.X[:0], F=front.F[:0], G=front.G[:0])
    refused(lambda: verify_all(empty), "^the front is empty")


def test_the_command_line_exits_with_1_where_a_limit_is_exceeded_between_samples(tmp_path):
    problem = ViaPointProblem(
        robot={"name": "ur5", "tool": "tool0", "limits": {"acceleration": np.inf, "jerk": np.inf}},
        points=[
            [0.0, -1.5, 1.5, -1.5, -1.5, 0.0],
            [0.5, -1.2, 1.4, -1.7, -1.5, 0.2],
            [0.9, -1.4, 1.5, -1.6, -1.5, 0.0],
        ],
        duration_bounds=(0.3, 4.0),
        objectives=["time", "energy"],
        constraints=["velocity", "effort"],
        limits="sampled",
        samples=2,  # both ends of the segments
        payload=10.0,
    )
    front = optimise(problem, seed=1, generations=40, population=20, progress=False, polish=False)
    front = dataclasses.replace(front, X=front.X[::16], F=front.F[::16], G=front.G[::16])
    front.save(tmp_path / "front.json")
    failed = trajevo("verify", tmp_path / "front.json", "--solution", "0")
    assert failed.returncode == 1, failed.stderr
    assert "row 0 FAILS: effort of " in failed.stdout
    every = trajevo("verify", tmp_path / "front.json", "--all")
    assert every.returncode == 1
    assert f" of {len(front)} solutions keep every limit." in every.stdout


def test_command_line(tmp_path):
    front = solved(load_problem("pointing"), 5)
    front.save(tmp_path / "front.json")
    one, every = trajevo("verify", tmp_path), trajevo("verify", tmp_path, "--all", "--density", "3")
    assert (one.returncode, every.returncode) == (0, 0), one.stderr + every.stderr
    for limit in ("position", "velocity", "acceleration", "jerk"):
        assert limit in one.stdout
    assert f"row {front.knee().index} (knee) keeps every limit at" in one.stdout
    assert f"{len(front)} of {len(front)} solutions keep every limit." in every.stdout
    content = json.loads((tmp_path / "front.json").read_text())
    content["X"] = [[0.4 * x for x in row] for row in content["X"]]
    (tmp_path / "faster.json").write_text(json.dumps(content))
    failed = trajevo("verify", tmp_path / "faster.json", "--solution", "0")
    assert failed.returncode == 2
    assert "the file is damaged or was changed" in failed.stderr
    refusal = trajevo("verify", tmp_path, "--density", "1")
    assert (refusal.returncode, refusal.stderr.count("\n")) == (2, 1)
    assert "density: expected a whole number from 2 to 200, got 1" in refusal.stderr
