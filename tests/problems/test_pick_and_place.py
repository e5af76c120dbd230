"""Raji 2022: the printed motion, and the optimisation that the paper leaves as future work."""

import json

import numpy as np
import pytest

from tests.helpers import mostly_long, refused
from tests.reference import RAJI2022
from trajevo import ViaPoints, load_problem, optimise
from trajevo.capacity.dlcc import dlcc
from trajevo.dynamics.integrals.efforts import mechanical_energy
from trajevo.dynamics.rollout import Rollout
from trajevo.formulation.constraints.motion_limits import overshoot
from trajevo.problems import HybridManipulator, PickAndPlace, PointingMechanism, ViaPointProblem
from trajevo.problems.pick_and_place import paper_solution
from trajevo.problems.puma_kinematics import TABLE_1_JOINTS, forward_kinematics
from trajevo.trajectory.interpolants import LinearBlends, SinglePolynomial

SEPTIC = RAJI2022["septic"]


@pytest.fixture(scope="module")
def printed():
    problem = PickAndPlace()
    return problem, problem.decode(paper_solution())


def test_the_printed_coefficients(printed):
    """Table 2, all 48, against the reference's; the whole polynomial is the first piece's."""
    _, batch = printed
    expected = np.array(SEPTIC["coeffs_a_to_h_as_in_table2"])
    np.testing.assert_allclose(batch.coefficients[0, 0].T, expected, atol=1e-12)


def test_peaks_of_the_printed_motion(printed):
    _, batch = printed
    for order, name in enumerate(("peak_vel", "peak_acc", "peak_jerk"), start=1):
        np.testing.assert_allclose(batch.peak(order)[0], np.array(SEPTIC[name])[:, 0], rtol=1e-9, atol=1e-12)
    assert [batch.peak(order)[0, 4] for order in (1, 2, 3)] == pytest.approx(
        [1.30488959, 1.03335385, 2.79603892], rel=1e-8
    )
    np.testing.assert_allclose(np.stack(batch.extremes(0), axis=-1)[0], SEPTIC["range"], atol=1e-9)


def test_the_printed_motion_overshoots_and_its_jerk_steps(printed):
    problem, batch = printed
    beyond = overshoot(batch, problem.interpolant.points)[0]
    assert beyond[[1, 2, 4]] == pytest.approx([0.78496, 0.80503, 1.58999], abs=1e-5)
    assert beyond[0] == pytest.approx(0.20889, abs=2e-3)
    ends = np.abs(batch.evaluate([0.0, 9.0], 3)[0]).T
    np.testing.assert_allclose(ends, np.abs(SEPTIC["jerk_ends"]), atol=1e-9)


def test_the_tool_passes_above_the_printed_height(printed):
    """The unload point is printed at z = -0.3 m; the joint angles of Table 1 put the tool at +0.3 m."""
    problem, batch = printed
    at_points = forward_kinematics(batch.evaluate(problem.via_times(paper_solution())[0])[0])[:, :3, 3]
    np.testing.assert_allclose(at_points[:, 2], [-0.5, 0.3, 0.3, -0.5], atol=5e-5)
    heights = forward_kinematics(batch.sample(2001).q[0])[:, 2, 3]
    assert heights.max() == pytest.approx(0.573288, abs=1e-5)


def test_energy_and_torque_of_the_printed_motion(printed):
    problem, _ = printed
    F, G = problem.evaluate(paper_solution())
    assert F[0, 0] == 9.0
    assert F[0, 2] == pytest.approx(327.48, abs=0.1)
    worst = max(
        (1.0 + value, name) for name, value in zip(problem.constraint_names, G[0], strict=True) if "effort" in name
    )
    assert worst == (pytest.approx(0.4485, abs=2e-4), "effort of joint_2")
    unloaded = PickAndPlace(payload=0.0).evaluate(paper_solution())[0]
    assert unloaded[0, 2] == pytest.approx(271.76, abs=0.1)
    assert (G <= 0.0).all()  # the ranges are widened just enough


@pytest.mark.parametrize("generations", mostly_long([50, None], 50))
def test_the_front_of_time_jerk_and_energy(printed, generations):
    """Population 100, 100 generations, seed 0: hypervolume of F / (20, 20, 800) at least 0.4395."""
    problem, _ = printed
    given = {} if generations is None else {"generations": generations}
    front = optimise(problem, seed=0, starts="random", progress=False, polish=False, **given)
    assert front.run.evaluations == 100 * (generations or 100)
    assert front.history.reference_point == (20.0, 20.0, 800.0)
    assert front.history.hypervolume[-1] >= 0.4395
    time, _, energy = front.F.T
    assert time.min() == pytest.approx(4.5334, rel=0.02)
    assert energy.min() == pytest.approx(283.75, rel=2e-3)
    dominating = (problem.evaluate(paper_solution())[0] >= front.F).all(axis=1)
    assert dominating.any()  # the paper's own times are not a trade-off
    found = dlcc(front.knee())
    assert 2.5 < found.mass < 30.0
    assert found.joint in problem.robot.joint_names


@pytest.mark.parametrize(
    "arguments",
    [
        {"interpolant": "quintic_spline", "payload": {"mass": 1.0, "com": [0.0, 0.05, 0.1]}},
        {"overshoot": 0.5, "position_limits": False, "duration_bounds": [1.0, 4.0]},
    ],
)
def test_settings_make_an_equal_problem(arguments):
    problem = PickAndPlace(**arguments)
    again = load_problem("pick-place", **json.loads(json.dumps(problem.settings)))
    np.testing.assert_array_equal(again.evaluate(paper_solution())[0], problem.evaluate(paper_solution())[0])
    assert again.settings == problem.settings


def test_overshoot_is_limited_by_argument():
    problem = PickAndPlace(overshoot=0.5)
    assert problem.constraint_names[-1] == "overshoot"
    assert problem.evaluate(paper_solution())[1][0, -1] == pytest.approx(1.58999 / 0.5 - 1.0, abs=1e-4)
    # The least possible for the septic, whatever its times, is 0.4086 rad at T1/T2 = T3/T2 = 1.2410.
    least = PickAndPlace().decode(np.array([[1.2410, 1.0, 1.2410]]))
    assert overshoot(least, problem.interpolant.points).max() == pytest.approx(0.4086, abs=1e-4)


def test_a_bare_mass_is_held_in_front_of_the_flange():
    assert PickAndPlace(payload=2.0).dynamics.payload.com == (0.0, 0.0, 0.1)
    assert PickAndPlace(payload={"mass": 2.0}).dynamics.payload.com == (0.0, 0.0, 0.0)


# --- interpolants -----------------------------------------------------------------------------------------------------

POINTS = ViaPoints(np.random.default_rng(2).normal(size=(5, 3)))


@pytest.mark.parametrize("count", [2, 3, 4, 5])
def test_the_single_polynomial_passes_all_points_at_rest(count):
    points = ViaPoints(POINTS.positions[:count])
    interpolant = SinglePolynomial(points, duration_bounds=(0.1, 5.0))
    x = np.random.default_rng(0).uniform(0.3, 3.0, (10, count - 1))
    batch = interpolant(x)
    assert batch.degree == count + 3
    reached = batch.evaluate(interpolant.via_times(x))
    np.testing.assert_allclose(reached, np.broadcast_to(points.positions, reached.shape), atol=1e-9)
    ends = np.stack([np.zeros(10), batch.duration], axis=1)
    for order in (1, 2):
        reach = batch.peak(order).max()
        assert np.abs(batch.evaluate(ends, order)).max() <= 1e-9 * reach
    for order in range(count + 4):
        scale = np.abs(batch.at_shares(np.array([0.0, 0.5]), order)).max()
        assert np.abs(batch.jump(order)).max(initial=0.0) <= 1e-7 * max(scale, 1.0)  # one polynomial, cut


def test_the_single_polynomial_is_numpys():
    x = np.array([[2.0, 4.0, 3.0]])
    points = ViaPoints(POINTS.positions[:4])
    t = np.array([0.0, 2.0, 6.0, 9.0])
    rows = [[ti**k for k in range(8)] for ti in t]
    for ti in (0.0, 9.0):
        rows.append([k * ti ** max(k - 1, 0) for k in range(8)])
        rows.append([k * (k - 1) * ti ** max(k - 2, 0) for k in range(8)])
    known = np.concatenate([points.positions, np.zeros((4, 3))])
    slow = np.linalg.solve(np.array(rows), known)
    found = SinglePolynomial(points, duration_bounds=(0.1, 9.0))(x).coefficients[0, 0].T
    np.testing.assert_allclose(found, slow, atol=1e-6)


def test_lines_with_blends():
    interpolant = LinearBlends(POINTS, duration_bounds=(0.1, 5.0))
    x = np.random.default_rng(0).uniform(0.5, 3.0, (10, 5))
    x[:, -1] = np.linspace(0.05, 0.95, 10)
    batch = interpolant(x)
    for order in range(3):
        assert np.abs(batch.jump(order)).max() < 1e-8 * max(batch.peak(order).max(), 1.0)
    times = interpolant.via_times(x)
    np.testing.assert_allclose(times[:, -1], batch.duration, rtol=1e-12)
    reached = batch.evaluate(times)
    np.testing.assert_allclose(reached[:, [0, -1]], np.broadcast_to(POINTS.positions[[0, -1]], (10, 2, 3)), atol=1e-9)
    for order in (1, 2):
        assert np.abs(batch.evaluate(times[:, [0, -1]], order)).max() < 1e-9 * batch.peak(order).max()
    miss = np.abs(reached[:, 1:-1] - POINTS.positions[1:-1]).max(axis=(1, 2))
    assert miss[0] < 0.1 * miss[-1]
    # Along the middle of a line the velocity is that of its chord.
    chord = np.diff(POINTS.positions, axis=0)[1] / x[0, 1]
    middle = batch[0].evaluate([0.5 * (times[0, 1] + times[0, 2])], 1)[0, 0]
    np.testing.assert_allclose(middle, chord, rtol=1e-9)


@pytest.mark.parametrize("make", [SinglePolynomial, LinearBlends])
def test_complex_steps_are_derivatives(make):
    interpolant = make(POINTS, duration_bounds=(0.1, 5.0))
    x = np.full((1, len(interpolant.variables)), 0.7) + 0.05 * np.arange(len(interpolant.variables))
    for k in range(x.shape[1]):
        step = np.zeros_like(x)
        step[0, k] = 1.0
        exact = interpolant(x + 1e-20j * step).peak(2).imag / 1e-20
        numerical = (interpolant(x + 1e-6 * step).peak(2) - interpolant(x - 1e-6 * step).peak(2)) / 2e-6
        np.testing.assert_allclose(exact, numerical, rtol=1e-5, atol=1e-6 * np.abs(numerical).max())


# --- any robot --------------------------------------------------------------------------------------------------------


def test_pick_and_place_is_an_instance_of_the_general_problem():
    names = {"objectives": ["time", "jerk", "energy"], "constraints": ["position", "velocity", "acceleration", "jerk"]}
    payload = {"mass": 2.5, "com": [0.0, 0.0, 0.1]}
    names |= {"robot": "puma560", "points": TABLE_1_JOINTS, "interpolant": "polynomial"}
    general = ViaPointProblem(payload=payload, samples=40, **names)
    special = PickAndPlace()
    shared = [special.constraint_names.index(name) for name in general.constraint_names]
    (F, G), (same_F, all_G) = (problem.evaluate(paper_solution()) for problem in (general, special))
    np.testing.assert_array_equal(F, same_F)
    np.testing.assert_array_equal(G, all_G[:, shared])


def test_the_other_papers_point_to_point_cases_are_instances_too():
    pointing = PointingMechanism(interpolant="quintic")
    general = ViaPointProblem(
        robot="pointing_mechanism",
        points=pointing.interpolant.points.positions,
        duration_bounds=(1.0, 10.0),
        interpolant="quintic_spline",
        objectives=("time", "acceleration", "jerk"),
    )
    x = np.random.default_rng(0).uniform(1.0, 10.0, (5, 4))
    for mine, theirs in zip(general.evaluate(x), pointing.evaluate(x), strict=True):
        np.testing.assert_array_equal(mine, theirs)
    hybrid = HybridManipulator()
    general = ViaPointProblem(
        robot="hybrid_manipulator",
        points=hybrid.interpolant.points.positions,
        duration_bounds=(0.005, 1.5),
        interpolant="cubic",
        objectives=("time", "square_jerk"),
        constraints=("position", "velocity", "acceleration", "jerk", "effort"),
        payload=10.0,
        limits="sampled",
    )
    x = np.random.default_rng(0).uniform(0.2, 1.5, (5, 12))
    (F, G), (all_F, all_G) = general.evaluate(x), hybrid.evaluate(x)
    np.testing.assert_array_equal(F, all_F[:, [0, 2]])
    np.testing.assert_array_equal(G, all_G[:, :-1])


@pytest.mark.parametrize("robot", ["pointing_mechanism", "feed_drive"])
def test_any_robot_goes_through_its_points(robot, tmp_path):
    names = {"pointing_mechanism": ("joint_1", "joint_2"), "feed_drive": ("x", "y")}[robot]
    unit, factor = {"pointing_mechanism": ("deg", np.pi / 180.0), "feed_drive": ("mm", 1e-3)}[robot]
    file = tmp_path / "points.csv"
    file.write_text(f"{names[1]} [{unit}], {names[0]} [{unit}]\n0, 10\n20, 30\n-10, 5\n")
    problem = ViaPointProblem(robot=robot, points=file, duration_bounds=(0.5, 20.0), interpolant="cubic")
    np.testing.assert_allclose(
        problem.interpolant.points.positions, factor * np.array([[10, 0], [30, 20], [5, -10]]), atol=1e-15
    )
    front = optimise(problem, seed=1, generations=20, population=20, progress=False, polish=False)
    assert len(front) > 3
    units = ["s", "rad/s^3" if robot == "pointing_mechanism" else "m/s^3"]
    assert [objective.unit for objective in problem.objectives] == units
    again = load_problem("via-points", **json.loads(json.dumps(problem.settings)))
    np.testing.assert_array_equal(again.evaluate(front.X)[0], front.F)


def test_energy_is_the_integral_of_magnitudes():
    problem = PickAndPlace(samples=200)
    rollout = Rollout(problem.dynamics, problem.decode(paper_solution()))
    motion = rollout.trajectory.sample(40_001)
    power = problem.dynamics.effort(motion.q, motion.v, motion.a)[0] * motion.v[0]
    slow = np.trapezoid(np.abs(power).sum(axis=1), motion.t[0])
    assert mechanical_energy(rollout)[0] == pytest.approx(slow, rel=1e-4)


T1 = np.array(TABLE_1_JOINTS)
BAD = {
    "interpolant": (lambda: PickAndPlace(interpolant="spline"), "unknown interpolant 'spline'; known: bspline, cubic"),
    "points": (lambda: PickAndPlace(points=T1[:, :5]), "robot 'puma560' has 6 joints, got points of 5"),
    "range": (lambda: PickAndPlace(points=T1 + 4.0), "point 0 puts 'joint_1' at 6.57 rad, outside its range"),
    "payload": (lambda: PickAndPlace(payload=-1.0), "payload.mass: expected a number from 0 on"),
    "bounds": (lambda: PickAndPlace(duration_bounds=(3.0, 1.0)), "duration_bounds: expected 0 < lower < upper"),
    "overshoot": (lambda: PickAndPlace(overshoot=-0.1), "overshoot: expected a positive number"),
    "too many": (
        lambda: SinglePolynomial(ViaPoints(np.arange(18.0).reshape(9, 2)), duration_bounds=(1, 2)),
        "points: the single polynomial takes at most 8 points, got 9",
    ),
    "no points": (
        lambda: ViaPointProblem(robot="feed_drive"),
        r"points: robot 'feed_drive' needs via points, shape \(n_points, 2\)",
    ),
    "objective": (
        lambda: ViaPointProblem(points=TABLE_1_JOINTS, objectives=["speed"]),
        "unknown objective 'speed'; known: acceleration",
    ),
    "constraint": (
        lambda: ViaPointProblem(points=TABLE_1_JOINTS, constraints=["snap"]),
        "unknown constraint 'snap'; known: acceleration",
    ),
    "robot": (lambda: ViaPointProblem(robot="ur6"), "unknown robot 'ur6'"),
    "file": (lambda: ViaPointProblem(points="none.csv"), "none.csv: no such file"),
    "blend": (
        lambda: LinearBlends(POINTS, duration_bounds=(1, 2))(np.array([[1.0, 1.0, 1.0, 1.0, 1.0]])),
        "expected positive times .* and a blend below 1, got 1.0 for blend in row 0",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_gets_a_sentence(case):
    refused(*BAD[case])
