"""Via points that move: the motion follows them, by whatever interpolant, and derivatives are exact."""

import copy
import pickle

import numpy as np
import pytest

from tests.helpers import assert_exact_gradients, mostly_long, refused
from tests.robot.test_kinematics import ROBOTS
from trajevo import TrajectoryProblem, ViaPoints, load_robot
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.formulation.constraints.joint_limits import position_limits
from trajevo.formulation.moving_points import MovingPoints
from trajevo.formulation.objectives import Objective, summed_rms_jerk, total_time
from trajevo.path.boxes import CartesianBox, JointBox
from trajevo.trajectory.batch import TrajectoryBatch
from trajevo.trajectory.interpolants import THROUGH_POINTS, Interpolant

BOUNDS = (0.5, 4.0)
UR5 = load_robot("ur5", **ROBOTS["ur5"])
START = np.array([0.3, -1.2, 1.4, -1.0, -1.4, 0.2])
POINTS = ViaPoints(START + np.random.default_rng(2).uniform(-0.4, 0.4, (5, 6)))
BOXES = (JointBox(1, np.array([0.2, 0.0, 0.1, 0.0, 0.0, 0.3])), CartesianBox(3, np.array([0.05, 0.0, 0.1])))


def moving(kind="quintic_spline", boxes=BOXES, **options):
    return MovingPoints(kind, POINTS, boxes, robot=UR5, duration_bounds=BOUNDS, **options)


def vectors(interpolant, count=6, seed=0):
    lower, upper = ([getattr(v, name) for v in interpolant.variables] for name in ("lower", "upper"))
    return np.random.default_rng(seed).uniform(lower, upper, (count, len(lower)))


def rollout(interpolant, x):
    return Rollout(Dynamics(UR5), interpolant(x))


@pytest.fixture(params=THROUGH_POINTS)
def kind(request):
    return request.param


def test_without_offsets_the_motion_is_the_interpolants(kind):
    interpolant, plain = moving(kind), THROUGH_POINTS[kind](POINTS, duration_bounds=BOUNDS)
    x = vectors(interpolant)
    own = len(plain.variables)
    x[:, own:] = 0.0
    ours, theirs = interpolant(x), plain(x[:, :own])
    np.testing.assert_array_equal(ours.breaks, theirs.breaks)
    np.testing.assert_allclose(ours.coefficients, theirs.coefficients, rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(interpolant.via_times(x), plain.via_times(x[:, :own]))


def test_the_motion_is_that_through_the_moved_points(kind):
    interpolant = moving(kind)
    x = vectors(interpolant)
    own, motion = len(interpolant.variables) - 5, interpolant(x)
    points = interpolant.points_of(motion)
    for b in range(len(x)):
        plain = THROUGH_POINTS[kind](ViaPoints(points[b]), duration_bounds=BOUNDS)
        theirs = plain(x[b : b + 1, :own]).coefficients[0]
        np.testing.assert_allclose(motion.coefficients[b], theirs, rtol=1e-9, atol=1e-9)
    if kind != "linear_blends":
        np.testing.assert_allclose(motion.evaluate(interpolant.via_times(x)), points, rtol=0.0, atol=1e-9)


def test_points_move_by_the_variables_of_their_box():
    interpolant = moving()
    names = [variable.name for variable in interpolant.variables[4:]]
    joints = UR5.joint_names
    assert names == [*(f"q_1 of {joints[k]}" for k in (0, 2, 5)), "dx of point 3", "dz of point 3"]
    assert [variable.unit for variable in interpolant.variables] == ["s"] * 4 + ["rad"] * 3 + ["m"] * 2
    x = vectors(interpolant)
    points = interpolant.points_of(interpolant(x))
    moves = points - POINTS.positions
    np.testing.assert_allclose(moves[:, 1][:, [0, 2, 5]], x[:, 4:7], rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(moves[:, [0, 2, 4]], 0.0, atol=1e-12)
    np.testing.assert_allclose(moves[:, 1][:, [1, 3, 4]], 0.0, atol=1e-12)
    position, rotation = UR5.tool_poses(points[:, 3])
    nominal, kept = UR5.tool_poses(POINTS.positions[3:4])
    offset = np.stack([x[:, 7], np.zeros(len(x)), x[:, 8]], axis=1)
    np.testing.assert_allclose(position, nominal + offset, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(rotation, np.broadcast_to(kept, rotation.shape), rtol=0.0, atol=1e-9)


def test_joint_boxes_end_at_the_joint_limits():
    robot = load_robot("pointing_mechanism")
    upper = robot.limits.upper
    points = ViaPoints(np.array([[0.0, 0.0], upper - [0.1, 0.0], [0.2, 0.1]]))
    interpolant = MovingPoints("cubic", points, (JointBox(1, [0.5, 0.5]),), robot=robot, duration_bounds=BOUNDS)
    bounds = [(variable.lower, variable.upper) for variable in interpolant.variables[-2:]]
    np.testing.assert_allclose(bounds, [(-0.5, 0.1), (-0.5, 0.0)], atol=1e-12)


def test_ends_move_when_asked(kind):
    boxes = (JointBox(0, np.full(6, 0.1)), CartesianBox(4, np.full(3, 0.02)))
    interpolant = moving(kind, boxes, ends=True)
    x = vectors(interpolant)
    motion = interpolant(x)
    points = interpolant.points_of(motion)
    np.testing.assert_allclose(motion.evaluate(np.zeros(1))[:, 0], points[:, 0], rtol=0.0, atol=1e-12)
    assert np.abs(points[:, 0] - POINTS.positions[0]).max() > 0.01


@pytest.mark.thinned(2)
@pytest.mark.parametrize("kind", mostly_long(THROUGH_POINTS, "cubic", "hybrid", "linear_blends", "quintic_spline"))
def test_complex_steps_are_the_derivatives(kind):
    interpolant = moving(kind)
    x, h = vectors(interpolant, 2), 1e-5
    for column in range(x.shape[1]):
        unit = np.eye(x.shape[1])[column]
        ahead, behind = (interpolant(x + sign * h * unit).coefficients for sign in (1.0, -1.0))
        finite = (ahead - behind) / (2.0 * h)
        exact = interpolant(x + 1e-20j * unit).coefficients.imag / 1e-20
        np.testing.assert_allclose(exact, finite, rtol=1e-5, atol=1e-5 * np.abs(exact).max())


def test_redundant_arms_have_exact_derivatives_too():
    robot = load_robot("xarm7", **ROBOTS["xarm7"])
    points = ViaPoints(np.random.default_rng(4).uniform(0.3, 0.9, (3, 7)))
    box = CartesianBox(1, np.full(3, 0.1))
    interpolant = MovingPoints("quintic_spline", points, (box,), robot=robot, duration_bounds=BOUNDS)
    x, h = vectors(interpolant), 1e-5
    for column in (2, 3, 4):
        unit = np.eye(5)[column]
        ahead, behind = (interpolant.points_of(interpolant(x + sign * h * unit)) for sign in (1.0, -1.0))
        exact = interpolant.points_of(interpolant(x + 1e-20j * unit)).imag / 1e-20
        np.testing.assert_allclose(exact, (ahead - behind) / (2.0 * h), rtol=0.0, atol=1e-6)


def test_moved_poses_within_reach_are_reached(kind):
    interpolant = moving(kind)
    constraint = interpolant.reach_constraint
    assert constraint.names == ("reach of point 3",)
    excess = constraint.function(rollout(interpolant, vectors(interpolant, 50)))
    assert excess.shape == (50, 1)
    assert (excess < -0.9).all()


def test_what_is_out_of_reach_is_told(kind):
    interpolant = moving(kind, (CartesianBox(2, np.array([3.0, 0.0, 0.0])),))
    x = vectors(interpolant, 3)
    x[:, -1] = [0.0, 2.5, -2.5]  # the arm is 0.95 m long
    excess = interpolant.reach_constraint.function(rollout(interpolant, x))[:, 0]
    assert excess[0] < -0.9
    assert (excess[1:] > 1e3).all()


def test_the_orientation_may_be_left_open():
    robot = load_robot("hybrid_manipulator")
    points = ViaPoints(np.array([[0.3, 0.4, 0.2, 0.0, 0.1], [0.5, 0.5, 0.3, 0.4, 0.3], [0.6, 0.4, 0.1, 0.2, 0.0]]))
    box = CartesianBox(1, np.full(3, 0.05), keep_orientation=False)
    interpolant = MovingPoints("cubic", points, (box,), robot=robot, duration_bounds=BOUNDS)
    x = vectors(interpolant)
    moved = interpolant.points_of(interpolant(x))[:, 1]
    reached = robot.tool_poses(moved)[0] - robot.tool_poses(points.positions[1:2])[0]
    np.testing.assert_allclose(reached, x[:, -3:], rtol=0.0, atol=1e-9)


def test_a_box_in_joint_space_needs_no_reach_constraint():
    interpolant = moving(boxes=BOXES[:1])
    assert interpolant.reach_constraint.names == ()
    assert interpolant.reach_constraint.function(rollout(interpolant, vectors(interpolant))).shape == (6, 0)


def test_a_problem_takes_it_and_can_be_copied():
    interpolant = moving()
    problem = TrajectoryProblem(
        dynamics=Dynamics(UR5),
        interpolant=interpolant,
        objectives=(Objective("time", "s", "test", total_time), Objective("jerk", "rad/s^3", "test", summed_rms_jerk)),
        constraints=(position_limits(UR5), interpolant.reach_constraint),
    )
    x = vectors(interpolant)
    there = pickle.loads(pickle.dumps(problem)).evaluate(x, return_values_of=["F", "G"])
    for ours, theirs in zip(problem.evaluate(x, return_values_of=["F", "G"]), there, strict=True):
        np.testing.assert_array_equal(ours, theirs)
    np.testing.assert_array_equal(copy.deepcopy(interpolant)(x).coefficients, interpolant(x).coefficients)


def test_gradients_of_a_problem_are_finite_differences():
    interpolant, h = moving(), 1e-6
    problem = TrajectoryProblem(
        dynamics=Dynamics(UR5),
        interpolant=interpolant,
        objectives=(Objective("jerk", "rad/s^3", "test", summed_rms_jerk),),
        constraints=(position_limits(UR5), interpolant.reach_constraint),
    )
    x = vectors(interpolant, 2)
    assert_exact_gradients(problem, x)
    _, dF, _, dG = problem.evaluate_with_gradients(x)
    for column in range(x.shape[1]):
        moves = h * np.eye(x.shape[1])[column]
        ahead, behind = (problem.evaluate(x + sign * moves, return_values_of=["F", "G"]) for sign in (1.0, -1.0))
        np.testing.assert_allclose(dF[..., column], (ahead[0] - behind[0]) / (2.0 * h), rtol=1e-5, atol=1e-6)
        np.testing.assert_allclose(dG[..., column], (ahead[1] - behind[1]) / (2.0 * h), rtol=1e-5, atol=1e-7)


def test_an_empty_population_is_an_empty_batch(kind):
    interpolant = moving(kind)
    none = np.empty((0, len(interpolant.variables)))
    assert len(interpolant(none)) == 0
    assert interpolant.points_of(interpolant(none)).shape == (0, 5, 6)


class _Bent(Interpolant):
    """Not linear in its points: the cubes of them are passed."""

    def __init__(self, points, *, duration_bounds):
        self.inner = THROUGH_POINTS["cubic"](ViaPoints(points.positions**3), duration_bounds=duration_bounds)

    @property
    def variables(self):
        return self.inner.variables

    def __call__(self, x) -> TrajectoryBatch:
        return self.inner(x)

    def via_times(self, x):
        return self.inner.via_times(x)


def test_interpolants_that_are_not_linear_in_the_points_are_refused(monkeypatch):
    monkeypatch.setitem(THROUGH_POINTS, "bent", _Bent)
    refused(lambda: moving("bent"), "expected one that is linear in its points, as points move, got 'bent'")


@pytest.mark.parametrize(
    ("boxes", "says"),
    [
        ((), "boxes: expected at least 1 box"),
        ((3,), "expected JointBox or CartesianBox, got int"),
        ((JointBox(0, np.ones(6)),), "expected a point from 1 to 3, got 0; the ends move only with ends=True"),
        ((JointBox(5, np.ones(6)),), "expected a point from 1 to 3, got 5"),
        ((JointBox(2, np.ones(6)), CartesianBox(2, np.ones(3))), "one box per point, got two for point 2"),
        ((JointBox(2, np.ones(5)),), "robot 'ur5.*' has 6 joints, got 5 numbers"),
    ],
)
def test_bad_boxes_are_refused(boxes, says):
    refused(lambda: moving(boxes=boxes), says)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: JointBox(-1, np.ones(6)), "expected the index of a point, a whole number from 0 on, got -1"),
        (lambda: JointBox(1.0, np.ones(6)), "expected the index of a point"),
        (lambda: JointBox(1, np.zeros(6)), "half_width at point 1: expected numbers from 0 on, one of them above 0"),
        (lambda: CartesianBox(1, [-0.1, 0.1, 0.1]), "half_width at point 1: expected numbers from 0 on"),
        (lambda: CartesianBox(1, [0.1, 0.1]), r"half_width at point 1: expected shape \(3\)"),
        (lambda: CartesianBox(1, [np.inf, 0.1, 0.1]), "expected finite numbers"),
    ],
)
def test_bad_widths_are_refused(make, says):
    refused(make, says)


def test_other_bad_arguments_are_refused():
    refused(lambda: moving("splines"), "unknown interpolant 'splines'; known: bspline, cubic")
    refused(lambda: MovingPoints("cubic", POINTS.positions, BOXES, robot=UR5, duration_bounds=BOUNDS), "ViaPoints")
    far = ViaPoints(POINTS.positions + 10.0)
    refused(lambda: MovingPoints("cubic", far, BOXES, robot=UR5, duration_bounds=BOUNDS), "outside its range")
    refused(lambda: moving()(np.ones((2, 4))), r"expected decision vectors of shape \(B, 9\), got \(2, 4\)")
    refused(lambda: moving()(np.full((2, 9), np.nan)), "expected finite numbers, got nan in row 0")
