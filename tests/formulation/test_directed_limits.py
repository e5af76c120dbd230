"""Limits that differ by direction: values against dense samples of both, proofs, gradients, least times, agreement."""

from dataclasses import replace

import numpy as np
import pytest

from tests.helpers import assert_exact_gradients, mostly_long, refused
from trajevo import Front, JointLimits, ViaPoints, load_robot, optimise
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.formulation.constraints.certified import certified
from trajevo.formulation.constraints.joint_limits import (
    acceleration_limits,
    effort_limits,
    kept_limits,
    velocity_limits,
)
from trajevo.formulation.constraints.motion_limits import mean_velocity_limits
from trajevo.formulation.constraints.robust import robust_effort_limits
from trajevo.formulation.feasibility.check import check
from trajevo.formulation.feasibility.least_times import SpeedLimits
from trajevo.formulation.objectives import effort_ratio
from trajevo.formulation.problem import Weights
from trajevo.path.curve import GeometricPath
from trajevo.problems import ViaPointProblem
from trajevo.robot.joints import DIRECTED, Friction, Sides
from trajevo.robot.payload import Payload
from trajevo.solvers.evolutionary.stretching import Limits, Stretching
from trajevo.solvers.gradient.weighted_sum import minimise_weighted
from trajevo.trajectory.interpolants import QuinticSpline, Reparameterisation, stop_and_go
from trajevo.verification.certify import certify
from trajevo.verification.kinematic_proofs import kinematic_proofs
from trajevo.verification.verify import verify

PUMA = load_robot("puma560")
COUNT = 12


def directed(robot=PUMA, **backward):
    """The robot with limits of the negative direction, as shares of those of the positive one."""
    given = {f"{name}_backward": np.broadcast_to(share, robot.dof) * getattr(robot.limits, name)
             for name, share in backward.items()}  # fmt: skip
    return replace(robot, limits=replace(robot.limits, **given))


def motions(robot, count=COUNT, seed=0):
    """Random motions through four points."""
    rng = np.random.default_rng(seed)
    lower, upper = np.maximum(robot.limits.lower, -2.0), np.minimum(robot.limits.upper, 2.0)
    points = ViaPoints(0.5 * (lower + upper) + 0.3 * rng.uniform(-1, 1, (4, robot.dof)) * (upper - lower))
    spline = QuinticSpline(points, duration_bounds=(0.1, 5.0))
    payload = Payload(2.0, (0.05, 0.0, 0.1))
    return Rollout(Dynamics(robot, payload), spline(rng.uniform(0.4, 1.2, (count, len(spline.variables)))))


def dense(rollout, order, samples=400):
    """Velocities, accelerations or, of order 3, efforts at many samples, shape (B, T, n_joints)."""
    states = [rollout.trajectory.at_shares(np.linspace(0.0, 1.0, samples), k) for k in range(3)]
    return rollout.effort_at_shares(*states) if order == 3 else states[order]


def greatest_shares(values, forward, backward):
    """Greatest share of both limits, written out, shape (B, n_joints)."""
    return np.maximum(values.max(axis=1) / forward, -values.min(axis=1) / backward)


ASYMMETRIC = directed(velocity=0.5, acceleration=[0.3, 2.0, 1.0, 0.5, 1.5, 0.7], effort=[0.4, 3.0, 0.6, 1.0, 0.5, 2.0])


def test_limits_that_agree_are_one_limit():
    limits = replace(PUMA.limits, velocity_backward=PUMA.limits.velocity.copy())
    assert limits.velocity_backward is None
    assert limits.sides("velocity").agree
    slower = replace(limits, velocity=0.5 * limits.velocity)  # replaced in both directions
    np.testing.assert_array_equal(slower.bounds("velocity")[0], -0.5 * limits.velocity)
    low, high = ASYMMETRIC.limits.bounds("effort")
    np.testing.assert_array_equal(high, PUMA.limits.effort)
    np.testing.assert_array_equal(low, -ASYMMETRIC.limits.effort_backward)
    np.testing.assert_array_equal(ASYMMETRIC.limits.bounds("position")[0], PUMA.limits.lower)


@pytest.mark.parametrize("wrong", [np.zeros(6), -np.ones(6), np.full(6, np.nan), np.ones(5)])
def test_limits_backward_are_positive_numbers_of_each_joint(wrong):
    for name in DIRECTED:
        refused(lambda name=name: replace(PUMA.limits, **{f"{name}_backward": wrong}), f"limits.{name}_backward: expec")


def test_shares_are_those_of_the_direction():
    sides = Sides(np.array([2.0, 4.0, np.inf, np.inf]), np.array([1.0, 8.0, 5.0, np.inf]))
    values = np.array([[1.0, 2.0, 9.0, 1.0], [-1.0, -2.0, -1.0, -7.0]])
    np.testing.assert_array_equal(sides.share(values), [[0.5, 0.5, 0.0, 0.0], [1.0, 0.25, 0.2, 0.0]])
    # What uses the same share of the lesser limit; a plain magnitude where nothing is limited.
    np.testing.assert_array_equal(sides.as_lesser(values), [[0.5, 2.0, 0.0, 1.0], [1.0, 1.0, 1.0, 7.0]])
    np.testing.assert_array_equal(sides.limited, [True, True, True, False])
    np.testing.assert_array_equal(sides.told(np.ones(4)), [2.0, 4.0, 5.0, np.inf])


@pytest.mark.parametrize(
    ("limit", "order", "name"), [(velocity_limits, 1, "velocity"), (acceleration_limits, 2, "acceleration")]
)
def test_kinematic_limits_are_those_of_dense_samples_in_either_direction(limit, order, name):
    rollout = motions(ASYMMETRIC)
    constraint, limits = limit(ASYMMETRIC), ASYMMETRIC.limits
    expected = greatest_shares(dense(rollout, order), *limits.sides(name).both) - 1.0
    found = constraint.function(rollout)
    assert constraint.names == limit(PUMA).names
    np.testing.assert_allclose(found, expected, atol=2e-4)
    assert (found >= expected - 1e-12).all()
    assert (found != limit(PUMA).function(motions(PUMA))).any()
    terms = constraint.terms(rollout)
    np.testing.assert_allclose(terms.reshape(COUNT, -1, 6).max(axis=1), found, atol=1e-12)
    mean = mean_velocity_limits(ASYMMETRIC).function(rollout)[:, 0]
    assert (mean <= velocity_limits(ASYMMETRIC).function(rollout).max(axis=1) + 1e-12).all()


@pytest.mark.parametrize("margin", [0.0, 0.2])
def test_effort_limits_are_those_of_dense_samples_in_either_direction(margin):
    rollout = motions(ASYMMETRIC)
    rollout = replace(rollout, dynamics=rollout.dynamics.sampled(60))
    sides = ASYMMETRIC.limits.sides("effort")
    expected = greatest_shares(rollout.effort, *(1.0 - margin) * sides.both) - 1.0
    constraint = effort_limits(ASYMMETRIC, margin=margin)
    np.testing.assert_allclose(constraint.function(rollout), expected, rtol=1e-12, atol=1e-13)
    terms = constraint.terms(rollout).reshape(COUNT, -1, 6)
    np.testing.assert_allclose(terms.max(axis=1), expected, rtol=1e-12, atol=1e-13)
    kept = kept_limits(ASYMMETRIC, [constraint])
    np.testing.assert_allclose(kept.sides("effort").both, (1.0 - margin) * sides.both, rtol=1e-15)
    # A payload that is known exactly is a box without width.
    box = robust_effort_limits(rollout.dynamics, mass=[2.0, 2.0], com=[[0.05, 0.0, 0.1]] * 2, margin=margin)
    np.testing.assert_allclose(box.function(rollout), expected, rtol=1e-9, atol=1e-11)
    ratio = greatest_shares(dense(rollout, 3), *sides.both).max(axis=1)
    np.testing.assert_allclose(effort_ratio(rollout), ratio, rtol=2e-3)


@pytest.mark.parametrize("rubbing", [False, True])
def test_proven_efforts_and_certificates_are_above_dense_samples_by_little(rubbing):
    robot = ASYMMETRIC
    if rubbing:
        effort = robot.limits.effort
        robot = replace(robot, friction=Friction(0.02 * effort, 0.02 * effort, np.zeros(6), 0.05 * effort))
    rollout = motions(robot, seed=1)
    shares = greatest_shares(dense(rollout, 3), *robot.limits.sides("effort").both)
    for k in range(4):
        one = Rollout(rollout.dynamics, rollout.trajectory[k])
        rows = [row for row in certify(one, tolerance=1e-3).rows if row.quantity == "effort"]
        found = np.array([row.share for row in rows])
        assert (found >= shares[k] * (1.0 - 1e-9)).all()
        np.testing.assert_allclose(found, shares[k], atol=4e-3)
        for row, joint in zip(rows, range(6), strict=True):
            t = np.array([row.instant])
            effort = one.effort_in(*(one.trajectory.evaluate(t[None], order) for order in range(3)))[0, 0, joint]
            assert row.exhibited == pytest.approx(abs(effort), rel=1e-6)
            assert row.limit == robot.limits.sides("effort").toward(np.full(6, effort))[joint]
            assert row.exhibited_share == pytest.approx(row.exhibited / row.limit, rel=1e-12)
    proven = certified(effort_limits(robot)).function(rollout)
    kept = (shares <= 1.0).all(axis=1) & (proven <= 0.0).all(axis=1)
    assert ((proven <= 0.0).all(axis=1) <= (shares <= 1.0).all(axis=1)).all()
    assert (proven[kept] >= shares[kept] - 1.0 - 1e-9).all()


def test_kinematic_proofs_tell_the_direction_that_uses_most():
    rollout = motions(ASYMMETRIC, seed=2)
    for k in range(4):
        one = Rollout(rollout.dynamics, rollout.trajectory[k])
        rows = kinematic_proofs(one)[0]
        for order, name in ((1, "velocity"), (2, "acceleration")):
            sides = ASYMMETRIC.limits.sides(name)
            values = dense(one, order, 2000)
            shares = greatest_shares(values, *sides.both)[0]
            for joint, row in enumerate(row for row in rows if row.quantity == name):
                back = -values[0, :, joint].min() / sides.backward[joint] > shares[joint] * (1.0 - 1e-12)
                assert row.limit == (sides.backward if back else sides.forward)[joint]
                assert row.share == pytest.approx(shares[joint], rel=1e-4)
                assert row.share >= shares[joint] * (1.0 - 1e-12)
                assert row.bound == pytest.approx(row.share * row.limit)
                assert row.exhibited <= row.bound * (1.0 + 1e-12)


def test_a_direction_without_limit_is_not_limited():
    limits = replace(PUMA.limits, velocity=np.full(6, np.inf), velocity_backward=PUMA.limits.velocity)
    robot = replace(PUMA, limits=limits)
    rollout = motions(robot)
    expected = -dense(rollout, 1).min(axis=1) / PUMA.limits.velocity - 1.0
    found = velocity_limits(robot).function(rollout)
    assert velocity_limits(robot).names == velocity_limits(PUMA).names
    np.testing.assert_allclose(found, np.maximum(expected, -1.0), atol=2e-4)
    rows = [row for row in kinematic_proofs(rollout)[0] if row.quantity == "velocity"]
    assert all(np.isfinite([row.limit, row.bound, row.share]).all() for row in rows)
    assert [row.share for row in rows] == pytest.approx((1.0 + found[0]).tolist(), rel=1e-9)


def problem(robot=ASYMMETRIC, **changed):
    points = [[0.0, -0.5, 0.3, 0.0, 0.4, 0.0], [0.6, -0.7, 0.7, 0.4, 0.9, 0.5], [-0.2, -0.4, 0.2, -0.3, 0.2, 0.1]]
    given = {"objectives": ["time", "effort_ratio"], "duration_bounds": (0.2, 4.0), "payload": 2.0, "samples": 6}
    return ViaPointProblem(robot=robot, points=points, **given | changed)


@pytest.mark.parametrize("limits", ["sampled", "certified"])
def test_gradients_are_finite_differences(limits):
    made = problem(limits=limits)
    x = np.random.default_rng(3).uniform(np.maximum(made.xl, 0.4), 1.2, (4, made.n_var))
    assert_exact_gradients(made, x)


def test_solutions_keep_both_directions_and_survive_a_file(tmp_path):
    limits = {"velocity": {"backward": "80 deg/s", "forward": "20 deg/s"}, "effort": {"joint_2": {"backward": 60.0,
              "forward": 97.6}}}  # fmt: skip
    every = ["position", "velocity", "acceleration", "jerk", "effort"]
    made = problem(load_robot("puma560", limits=limits), effort_margin=0.1, constraints=every)
    front = optimise(made, seed=1, generations=8, population=16, progress=False, polish=False)
    front.save(tmp_path / "front.json")
    again = Front.load(tmp_path / "front.json").problem.robot.limits
    np.testing.assert_array_equal(again.velocity_backward, np.full(6, np.radians(80.0)))
    np.testing.assert_array_equal(again.effort_backward[1], 60.0)
    rollout = front.rollouts
    velocity = dense(rollout, 1)
    assert velocity.max() <= np.radians(20.0) * (1.0 + 1e-9)
    assert velocity.min() < -np.radians(20.0)
    verified = verify(front.pick("0"))
    row = next(row for row in verified.rows if (row.limit, row.joint) == ("velocity", "joint_1"))
    one = velocity[0, :, 0]
    assert row.share == pytest.approx(max(one.max() / np.radians(20.0), -one.min() / np.radians(80.0)), rel=1e-3)


def test_the_slower_direction_takes_as_much_longer_as_its_limit_is_less():
    # Two joints, one quintic from rest to rest: its peak is 15/8 of the mean velocity, so that T = 15/8 D / V.
    free = np.full(2, np.inf)
    limits = JointLimits(-free, free, np.array([1.0, 3.0]), free, free, free, velocity_backward=np.array([0.4, 3.0]))
    robot = replace(load_robot("asr_twodof", limits={"acceleration": np.inf, "jerk": np.inf}), limits=limits)
    times = {}
    for name, ends in {"forward": [[0.0, 0.0], [1.0, 0.5]], "backward": [[1.0, 0.5], [0.0, 0.0]]}.items():
        made = ViaPointProblem(
            robot=robot, points=ends, interpolant="quintic_spline", objectives=["time"], constraints=["velocity"],
            duration_bounds=(0.05, 20.0),
        )  # fmt: skip
        times[name] = float(minimise_weighted(made, Weights((1.0,)), seed=0).rollout.trajectory.duration[0])
        assert check(made).least_times[-1].seconds <= times[name]
    assert times["forward"] == pytest.approx(15.0 / 8.0, rel=1e-5)
    assert times["backward"] == pytest.approx(15.0 / 8.0 / 0.4, rel=1e-5)


def test_stop_and_go_speeds_up_with_one_limit_and_slows_down_with_the_other():
    ends = [[0.0, 0.0], [1.0, -2.0]]
    for velocity in (9.0, 0.6):
        # Joint 1 moves forward and joint 2 backward, whose limits are those of the other direction.
        one = JointLimits(
            np.full(2, -np.inf), np.full(2, np.inf), np.array([velocity, 90.0]), np.array([2.0, 100.0]),
            np.full(2, 1e4), np.full(2, np.inf), acceleration_backward=np.array([5.0, 100.0]),
            velocity_backward=np.array([0.1, 90.0]),
        )  # fmt: skip
        up, down = 2.0, 5.0
        top = min(velocity, np.sqrt(2.0 * up * down / (up + down)))
        expected = 1.0 / top + 0.5 * top * (1.0 / up + 1.0 / down)
        motion = stop_and_go(ViaPoints(np.array(ends)), one, profile="trapezoid")
        assert motion.duration[0] == pytest.approx(expected, rel=1e-12)
        least, greatest = motion.extremes(2)
        assert (greatest[0, 0], least[0, 0]) == pytest.approx((up, -down))
        assert motion.extremes(0)[1][0, 0] == pytest.approx(1.0)
        smooth = stop_and_go(ViaPoints(np.array(ends)), one, profile="double_s")
        least, greatest = smooth.extremes(2)
        assert greatest[0, 0] <= up * (1.0 + 1e-9)
        assert least[0, 0] >= -down * (1.0 + 1e-9)
        assert expected < smooth.duration[0] < expected + 1e-2
        septic = stop_and_go(ViaPoints(np.array(ends)), one, profile="septic")
        assert septic.peak(2)[0, 0] <= up * (1.0 + 1e-9)


def test_a_velocity_that_is_given_is_checked_by_its_direction():
    robot = load_robot("puma560", limits={"velocity": {"joint_1": {"backward": 0.5, "forward": 1.5}}})
    ends = [[0.0, -0.5, 0.3, 0.0, 0.4, 0.0], [0.6, -0.7, 0.7, 0.4, 0.9, 0.5]]

    def made(velocity, points):
        passing = [{"point": 0, "velocity": [velocity, 0.0, 0.0, 0.0, 0.0, 0.0]}]
        return ViaPointProblem(
            robot=robot, points=points, passing=passing, objectives=["time"], duration_bounds=(0.3, 4.0)
        )

    assert made(1.0, ends).n_var
    refused(lambda: made(-1.0, ends[::-1]), "1 rad/s of 'joint_1' exceeds its limit of 0.5")


def test_what_must_be_held_is_told_in_its_direction():
    # Gravity pulls joint 2 of the stretched arm down: the effort that holds it has one sign.
    points = [[0.0, 0.0, 0.3, 0.0, 0.4, 0.0], [0.3, 0.2, 0.4, 0.1, 0.5, 0.1]]
    still = np.zeros((1, 6))
    held = Dynamics(PUMA, Payload(2.0)).effort(np.array(points[:1]), still, still)[0, 1]
    sides = {"backward": 1.0, "forward": 150.0} if held < 0.0 else {"backward": 150.0, "forward": 1.0}
    for weak in (sides, {key: sides[other] for key, other in (("backward", "forward"), ("forward", "backward"))}):
        robot = load_robot("puma560", limits={"effort": {"joint_2": weak}})
        made = ViaPointProblem(
            robot=robot, points=points, payload=2.0, objectives=["time"], duration_bounds=(0.3, 4.0),
            constraints=["effort"],
        )  # fmt: skip
        found = [one for one in check(made).findings if one.kind == "effort" and one.joint == "joint_2"]
        if weak is sides:
            assert found[0].impossible
            assert found[0].needed == pytest.approx(abs(held), rel=1e-9)
            assert found[0].available == 1.0
            assert f"{abs(held):.4g}"[:3] in found[0].sentence
        else:
            assert not any(one.impossible for one in found)


@pytest.mark.parametrize("starts", mostly_long([3, 20], 3))
def test_no_motion_beats_the_least_times_of_both_directions(starts):
    points = [[0.0, -0.5, 0.3, 0.0, 0.4, 0.0], [0.6, -0.7, 0.7, 0.4, 0.9, 0.5], [-0.2, -0.4, 0.2, -0.3, 0.2, 0.1]]
    robot = directed(velocity=0.4, acceleration=0.3)
    made = ViaPointProblem(
        robot=robot, points=points, objectives=["time"], constraints=["velocity", "acceleration", "jerk"],
        duration_bounds=(0.2, 6.0),
    )  # fmt: skip
    best = minimise_weighted(made, Weights((1.0,)), seed=0, starts=starts)
    times = check(made).least_times
    assert times[-1].seconds <= best.rollout.trajectory.duration[0]
    plain = replace(robot, limits=replace(robot.limits, velocity_backward=None, acceleration_backward=None))
    other = ViaPointProblem(
        robot=plain, points=points, objectives=["time"], constraints=["velocity", "acceleration", "jerk"],
        duration_bounds=(0.2, 6.0),
    )  # fmt: skip
    assert times[-1].seconds > check(other).least_times[-1].seconds


def test_the_least_time_between_rests_with_two_accelerations_is_that_of_a_trapezoid():
    rng = np.random.default_rng(4)
    none = np.array([np.inf])
    for _ in range(50):
        D, V, up, down = 10.0 ** rng.uniform(-1, 1, 4)
        limits = SpeedLimits(
            Sides(np.array([V]), np.array([3.0 * V])), Sides(np.array([up]), np.array([down])), Sides.of(none), np.inf
        )
        top = min(V, np.sqrt(2.0 * D * up * down / (up + down)))
        expected = D / top + 0.5 * top * (1.0 / up + 1.0 / down)
        assert limits.least(np.array([D]), rests=2)[0] == pytest.approx(expected, rel=1e-9)
        assert limits.least(np.array([-D]), rests=0)[0] == pytest.approx(D / (3.0 * V))


def test_first_populations_are_stretched_to_the_limit_of_the_direction():
    made = problem(constraints=["velocity", "acceleration", "jerk", "effort"], limits="sampled")
    x = np.random.default_rng(5).uniform(made.xl, np.minimum(made.xu, 2.0), (20, made.n_var))
    G = Stretching.of(Limits(made)).mended(x, quicker=True)[1]
    assert (G <= 1e-9).all(axis=1).mean() > 0.8
    used = G.max(axis=1)
    assert (used > -0.02).mean() > 0.5  # they end on a limit


def test_motions_along_a_path_refuse_two_limits_by_name():
    robot = load_robot("puma560", limits={"velocity": {"backward": 1.0, "forward": 2.0}})
    knots = np.concatenate([np.zeros(4), [1.0 / 3.0, 2.0 / 3.0], np.ones(4)])
    path = GeometricPath(knots, np.random.default_rng(6).uniform(-0.4, 0.4, (6, 6)))
    refused(
        lambda: Reparameterisation(path, robot.limits, longest_time=9.0),
        "limits: expected one limit of velocity for both directions, as .* give the lesser as velocity",
    )
