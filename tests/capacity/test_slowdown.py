"""Slower or faster along the same path: closed form against sampling, allowed sets, curve, sensitivities, bad input."""

from dataclasses import replace

import numpy as np
import pytest

from tests.guo2016 import TABLE_7
from tests.helpers import mostly_long, refused, trajevo
from trajevo import PolynomialBatch, ViaPoints, load_robot, optimise, plots
from trajevo.capacity.dlcc import dlcc, dlcc_sampled
from trajevo.capacity.scaled_path import SCALED_LIMITS
from trajevo.capacity.sensitivity import sensitivity
from trajevo.capacity.slowdown import slowdown_curve, slowdown_for
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.path_effort import Effort, EffortOfPath, allowed_speeds
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.problems import HybridManipulator
from trajevo.robot.joints import Friction
from trajevo.robot.payload import LOAD_MODELS, Payload
from trajevo.trajectory.interpolants import QuinticSpline

HYBRID = load_robot("hybrid_manipulator")
PUMA = load_robot("puma560")
STATIC_BOUND = 12.510810648896424
every_model = pytest.mark.parametrize("model", tuple(LOAD_MODELS))


def table_7(mass=10.0, model="rigid", robot=HYBRID):
    return Rollout(Dynamics(robot, Payload(mass, model=model)), HybridManipulator().decode(TABLE_7))


def with_limits(robot, **limits):
    return replace(robot, limits=replace(robot.limits, **{k: np.asarray(v, dtype=float) for k, v in limits.items()}))


def only_effort(robot, share=1.0):
    """No kinematic limits, so that effort binds."""
    unlimited = np.full(robot.dof, np.inf)
    return with_limits(
        robot, velocity=unlimited, acceleration=unlimited, jerk=unlimited, effort=share * robot.limits.effort
    )


def rubbing(robot):
    """The robot with friction of every kind, so much that it counts."""
    effort = robot.limits.effort
    friction = Friction(0.05 * effort, 0.03 * effort, np.full(robot.dof, 0.1), 0.05 * effort)
    return replace(robot, friction=friction)


def random_motion(robot, seed, payload=None):
    """Through random points, with times that make inertia count."""
    rng = np.random.default_rng(seed)
    points = ViaPoints(0.4 * rng.uniform(robot.limits.lower, robot.limits.upper, (4, robot.dof)))
    trajectory = QuinticSpline(points, duration_bounds=(0.1, 5.0))(rng.uniform(0.5, 1.5, (1, 3)))
    return Rollout(Dynamics(robot, payload or Payload(1.0, (0.05, 0.0, 0.1))), trajectory)


def dense_utilisation(found, samples=400):
    """Shares of every limit on the scaled motion, by sampling alone, shape (4, n_joints)."""
    scaled = found.rollout
    dense = Rollout(scaled.dynamics.sampled(samples), scaled.trajectory)
    effort = dense.effort_in(dense.q, dense.v, dense.a)
    limits = [getattr(scaled.robot.limits, name) for name in SCALED_LIMITS]
    return np.stack(
        [np.abs(x[0]).max(axis=0) / limit for x, limit in zip((dense.v, dense.a, dense.j, effort), limits, strict=True)]
    )


def assert_binding_joint_is_at_its_limit(found, tolerance=1e-6):
    """No sample exceeds a limit, and the binding one is reached where and when it is said to be."""
    used, scaled = dense_utilisation(found), found.rollout
    kind, joint = SCALED_LIMITS.index(found.limit), scaled.robot.joint_names.index(found.joint)
    assert found.proven
    assert used.max() <= 1.0 + 1e-12
    assert used[kind, joint] == pytest.approx(1.0, abs=1e-3)
    assert found.utilisation.max() == found.utilisation[kind, joint] <= 1.0 + 1e-12
    assert 0.0 <= found.gap < 1e-6
    # Effort changes at most some ten times as fast as the factor.
    assert found.utilisation[kind, joint] >= 1.0 - 1e-9 - 20.0 * found.gap
    np.testing.assert_allclose(found.utilisation, used, atol=5e-3)  # away from what binds, effort is sampled
    limit = getattr(scaled.robot.limits, found.limit)[joint]
    if found.limit == "effort":
        reached = scaled.effort_in(*(scaled.trajectory.evaluate(np.array([[found.time]]), k) for k in range(3)))[0, 0]
    else:
        reached = scaled.trajectory.peak(kind + 1)[0]
        there = scaled.trajectory.evaluate(np.array([[found.time]]), kind + 1)[0, 0, joint]
        assert abs(there) / limit == pytest.approx(1.0, abs=1e-3)
    assert abs(reached[joint]) / limit == pytest.approx(1.0, abs=tolerance)


def at_the_limit(robot, model):
    for mass in (0.0, 6.0, 11.0, 12.0, 12.4):
        yield slowdown_for(table_7(model=model, robot=robot), mass)


@pytest.mark.thinned(2)
@every_model
def test_sampled_again_the_binding_joint_is_at_its_limit(model):
    limits = set()
    for found in (*at_the_limit(HYBRID, model), *at_the_limit(only_effort(HYBRID), model)):
        assert found.payload.model == model
        assert found.duration == pytest.approx(found.factor * TABLE_7.sum(), rel=1e-12)
        assert found.rollout.trajectory.duration[0] == pytest.approx(found.duration, rel=1e-12)
        assert_binding_joint_is_at_its_limit(found)
        limits.add(found.limit)
    assert limits == {"velocity", "effort"}


@pytest.mark.parametrize("robot", [only_effort(PUMA), rubbing(PUMA), only_effort(rubbing(PUMA))], ids=range(3))
@pytest.mark.parametrize("count", mostly_long([3, 12], 3))
def test_sampled_again_with_friction_of_every_kind(robot, count):
    for seed in range(count):
        motion = random_motion(robot, seed)
        found = slowdown_for(motion, 1.0)
        assert_binding_joint_is_at_its_limit(found)
        # Just inside the allowed set the motion keeps the limits, just outside it breaks one.
        inside, outside = (
            dense_utilisation(replace(found, factor=found.factor * share)).max() for share in (1.001, 0.999)
        )
        assert inside < 1.0 < outside


@pytest.mark.parametrize(("kind", "order"), [("velocity", 1), ("acceleration", 2), ("jerk", 3)])
def test_kinematic_limits_scale_with_a_power_of_the_factor(kind, order):
    motion = table_7(robot=with_limits(only_effort(HYBRID), effort=np.full(5, np.inf)))
    peak = motion.trajectory.peak(order)[0]
    robot = with_limits(motion.robot, **{kind: peak * np.array([9.0, 2.0, 9.0, 9.0, 9.0]) ** order})
    found = slowdown_for(Rollout(Dynamics(robot), motion.trajectory), 0.0)
    assert (found.limit, found.joint) == (kind, "screw_2")
    assert found.factor == pytest.approx(0.5, rel=1e-12)
    assert found.utilisation[order - 1, 1] == pytest.approx(1.0, rel=1e-12)
    assert_binding_joint_is_at_its_limit(found)


def test_a_feasible_motion_can_be_run_as_it_is():
    front = optimise(HybridManipulator(), seed=1, generations=10, population=20, progress=False, polish=False)
    for row in range(0, len(front), 4):
        solution = front.pick(str(row))
        assert slowdown_for(solution, 0.0).factor <= 1.0
        own = slowdown_for(solution, 10.0)
        # The problem looks at 6 samples per segment, this at the peaks between them.
        assert own.factor <= 1.0 + 1e-3
        assert own.allowed[0, 0] == own.sampled_factor


def test_at_the_capacity_the_motion_needs_its_own_time():
    motion = table_7()
    found = slowdown_for(motion, dlcc_sampled(motion).mass)
    assert found.sampled_factor == pytest.approx(1.0, abs=1e-9)
    assert found.factor == pytest.approx(1.0, abs=1e-7)
    assert (found.limit, found.joint) == ("effort", "screw_3")
    assert found.time == pytest.approx(0.33, abs=1e-6)
    says = "takes at least 6.1900 s, as now, limited by the effort of screw_3 at 0.3300 s; proven at every instant"
    assert says in str(found)
    assert "% more than now" in str(slowdown_for(motion, 12.0))
    assert "% less than now" in str(slowdown_for(motion, 10.0))


@every_model
def test_capacity_of_the_slowed_motion_is_the_payload(model):
    """The inverse of the payload at a factor."""
    motion = table_7(model=model, robot=only_effort(HYBRID))
    for mass in (11.0, 11.8, 12.3):
        found = slowdown_for(motion, mass)
        assert dlcc(found).mass == pytest.approx(mass, abs=1e-4)
        assert dlcc(found.rollout, samples=400).mass == pytest.approx(mass, abs=1e-6)


def test_more_payload_takes_longer_where_gravity_and_inertia_load_alike():
    curve = slowdown_curve(table_7(), np.linspace(0.0, 12.5, 60))
    assert (np.diff(curve.factors) >= 0.0).all()
    assert curve.factors[0] < 1.0 < curve.factors[-1]
    assert curve.static_bound == pytest.approx(STATIC_BOUND, abs=1e-9)
    assert curve.durations == pytest.approx(curve.factors * 6.19, rel=1e-9)
    assert set(curve.limits) == {"velocity", "effort"}
    for k in range(0, 60, 12):
        one = slowdown_for(table_7(), float(curve.payloads[k]))
        assert one.sampled_factor == pytest.approx(curve.factors[k], rel=1e-9)
        assert (one.limit, one.joint) == (curve.limits[k], curve.joints[k])


def test_default_payloads_end_below_what_is_held_at_rest_and_heavier_ones_are_nan():
    curve = slowdown_curve(table_7())
    assert len(curve.payloads) == 40
    assert np.isfinite(curve.factors).all()
    assert curve.payloads[-1] < STATIC_BOUND
    heavy = slowdown_curve(table_7(), [13.0, 1.0])
    assert heavy.payloads.tolist() == [1.0, 13.0]
    assert np.isnan(heavy.factors).tolist() == np.isnan(heavy.durations).tolist() == [False, True]
    assert (heavy.limits[1], heavy.joints[1]) == ("", "")


def test_shape_of_the_payload_counts():
    motion = random_motion(only_effort(PUMA), 3)
    own = slowdown_for(motion, 2.0)
    assert own.payload.com == (0.05, 0.0, 0.1)
    far = slowdown_for(motion, Payload(2.0, (0.0, 0.0, 0.4)))
    assert far.payload.com == (0.0, 0.0, 0.4)
    assert far.factor != pytest.approx(own.factor, rel=1e-3)
    assert_binding_joint_is_at_its_limit(far)
    cube = Payload(2.0, inertia=np.diag([0.2, 0.2, 0.2]))
    assert_binding_joint_is_at_its_limit(slowdown_for(motion, cube))


@pytest.mark.parametrize("motions", mostly_long([2, 8], 2))
def test_allowed_factors_are_those_at_which_samples_keep_the_limits(motions):
    """Slow motions may be excluded where dry friction and gravity exceed what inertia takes off."""
    checked = 0
    for seed in range(motions):
        found = slowdown_for(random_motion(only_effort(PUMA, 0.9), seed), 1.5)
        for factor in found.allowed[0, 0] * np.geomspace(0.3, 30.0, 41):
            nearest = np.abs(found.allowed / factor - 1.0)
            if nearest.min() < 1e-3:
                continue
            inside = ((found.allowed[:, 0] < factor) & (factor < found.allowed[:, 1])).any()
            assert (dense_utilisation(replace(found, factor=float(factor)), 100).max() <= 1.0) == inside
            checked += 1
    assert checked > 32 * motions


@pytest.mark.parametrize("count", mostly_long([150, 600], 150))
def test_intervals_against_a_scan(count):
    """Random quadratics of every kind, straight and flat ones too."""
    rng = np.random.default_rng(5)
    speeds = np.linspace(0.0, 6.0, 1201)[1:]
    kinds = set()
    for _ in range(count):
        constant, linear, quadratic = rng.normal(size=3) * rng.integers(0, 2, 3)
        effort = Effort(*(np.full((1, 1), value) for value in (constant, linear, quadratic)))
        limit = np.array([abs(rng.normal()) + 0.05])
        lower, upper = (ends.ravel() for ends in effort.excluded(limit))
        used = np.abs(constant + speeds * (linear + speeds * quadratic)) - limit[0]
        excluded = ((speeds[:, None] > lower) & (speeds[:, None] < upper)).any(axis=1)
        clear = np.abs(used) > 1e-9
        np.testing.assert_array_equal(excluded[clear], used[clear] > 0.0)
        allowed, bound = allowed_speeds(lower, upper)
        left = ((speeds[:, None] >= allowed[:, 0]) & (speeds[:, None] <= allowed[:, 1])).any(axis=1)
        np.testing.assert_array_equal(left[clear], used[clear] < 0.0)
        if bound >= 0:
            assert lower[bound] == allowed[-1, 1]
            assert abs(effort.at(float(lower[bound]))[0, 0]) == pytest.approx(limit[0], rel=1e-9)
        kinds.add((len(allowed), bound >= 0))
    assert kinds >= {(0, False), (1, False), (1, True), (2, True)}


def test_effort_at_a_speed_is_that_of_the_scaled_motion():
    for motion in (table_7(7.0), random_motion(rubbing(PUMA), 1, Payload(2.0, (0.0, 0.1, 0.1)))):
        terms = EffortOfPath.of(motion, motion.q[0], motion.without_rounding(motion.v)[0], motion.a[0])
        for factor in (0.6, 1.0, 3.0):
            slow = Rollout(motion.dynamics, motion.trajectory.slowed(factor))
            expected = slow.effort_in(slow.q, slow.v, slow.a)[0]
            found = terms.carrying(motion.dynamics.payload.mass).at(1.0 / factor)
            np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())


def test_what_cannot_be_held_at_rest_is_refused_with_the_bound():
    says = r"expected at most 12\.510811 kg, which screw_3 can hold at rest .*, got 12\.6 kg: no slower motion"
    refused(lambda: slowdown_for(table_7(), 12.6), says)
    weak = with_limits(HYBRID, effort=[500.0, 500.0, 300.0, 17.0, 17.0])
    refused(
        lambda: slowdown_for(table_7(robot=weak), 0.0),
        "along which the robot can hold itself, but no mass is what screw_3 can hold",
    )
    refused(lambda: slowdown_curve(table_7(robot=weak)), "payloads: expected masses .* can hold 0 kg at rest")


def test_what_dry_friction_alone_forbids_is_refused():
    stuck = replace(only_effort(PUMA), friction=Friction(np.zeros(6), 2.0 * PUMA.limits.effort, np.zeros(6)))
    refused(
        lambda: slowdown_for(random_motion(stuck, 0), 0.0), "holds it at rest, but moving it breaks an effort limit"
    )


def test_a_motion_that_nothing_limits_is_refused():
    free = with_limits(only_effort(HYBRID), effort=np.full(5, np.inf))
    refused(lambda: slowdown_for(table_7(robot=free), 1.0), "'hybrid_manipulator' has none that this motion")
    refused(lambda: slowdown_curve(table_7(robot=free)), "payloads: expected masses")


@pytest.mark.parametrize("bad", [-1.0, float("nan"), "heavy", None, [1.0]], ids=str)
def test_bad_payloads_are_refused(bad):
    refused(lambda: slowdown_for(table_7(), bad), "payload")


@pytest.mark.parametrize("bad", [[], [-1.0], [float("nan")], "ten"], ids=str)
def test_bad_payloads_of_a_curve_are_refused(bad):
    refused(lambda: slowdown_curve(table_7(), bad), "payloads")


def test_other_bad_arguments_are_refused():
    refused(lambda: slowdown_for(5, 1.0), "motion: expected a solution")
    refused(lambda: slowdown_for(table_7(), 1.0, samples=1), "samples")
    refused(lambda: table_7().trajectory.slowed(0.0), "factor: expected a positive number")


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_slowed_trajectories_are_the_same_path_in_another_time(factor):
    trajectory = table_7().trajectory
    slow = trajectory.slowed(factor)
    assert isinstance(slow, PolynomialBatch)
    t = np.linspace(0.0, float(trajectory.duration[0]), 40)
    for order in range(4):
        np.testing.assert_allclose(
            slow.evaluate(t * factor, order), trajectory.evaluate(t, order) / factor**order, rtol=1e-9, atol=1e-9
        )


@every_model
def test_sensitivity_equals_finite_differences(model):
    motion = table_7(model=model)
    found = sensitivity(motion)
    assert (found.mass, found.joint) == (dlcc_sampled(motion).mass, dlcc_sampled(motion).joint)

    def raised(percent):
        return dlcc_sampled(
            table_7(model=model, robot=with_limits(HYBRID, effort=(1 + 0.01 * percent) * HYBRID.limits.effort))
        )

    def slower(seconds):
        longer = motion.trajectory.slowed(1.0 + seconds / 6.19)
        return dlcc_sampled(Rollout(motion.dynamics, longer))

    step = 1e-4
    by_effort = (raised(step).mass - raised(-step).mass) / (2 * step)
    by_time = (slower(step).mass - slower(-step).mass) / (2 * step)
    assert found.per_percent_of_effort == pytest.approx(by_effort, rel=1e-7)
    assert found.per_second == pytest.approx(by_time, rel=1e-6, abs=1e-9)
    assert found.per_percent_slower == pytest.approx(0.0619 * by_time, rel=1e-6, abs=1e-9)
    assert "screw_3" in str(found)


def test_sensitivity_with_friction_equals_finite_differences():
    robot = rubbing(PUMA)
    compared = 0
    for seed in range(10):
        motion = random_motion(robot, seed)
        if dlcc_sampled(motion).margin.min() < -1e-9:
            continue
        duration = float(motion.trajectory.duration[0])
        ends = [
            dlcc_sampled(Rollout(motion.dynamics, motion.trajectory.slowed(1.0 + seconds / duration))).mass
            for seconds in (-1e-5, 1e-5)
        ]
        assert sensitivity(motion).per_second == pytest.approx((ends[1] - ends[0]) / 2e-5, rel=1e-5)
        compared += 1
    assert compared >= 3


def test_a_motion_without_a_capacity_has_no_sensitivity():
    unlimited = with_limits(HYBRID, effort=np.full(5, np.inf))
    refused(lambda: sensitivity(table_7(robot=unlimited)), "whose capacity a joint sets, got unlimited")
    weak = with_limits(HYBRID, effort=[500.0, 500.0, 300.0, 17.0, 17.0])
    refused(lambda: sensitivity(table_7(robot=weak)), "got 0 kg: even without payload screw_3")


def test_records_are_frozen():
    found = slowdown_for(table_7(), 5.0)
    for array in (found.utilisation, found.allowed, slowdown_curve(table_7(), [1.0]).factors):
        assert not array.flags.writeable
    with pytest.raises(AttributeError):
        found.factor = 1.0
    with pytest.raises(InvalidInputError):
        slowdown_for(table_7(), Payload(99.0))


def test_picture_of_a_curve_names_what_binds():
    ax = plots.slowdown_curve(slowdown_curve(table_7()))
    labels = [text.get_text() for text in ax.get_legend().get_texts()]
    assert labels[:2] == ["velocity of screw_2", "effort of screw_3"]
    assert "held at rest: 12.511 kg" in labels


def test_command_line(tmp_path):
    front = optimise(HybridManipulator(payload=8.0), seed=1, generations=8, population=20, progress=False, polish=False)
    front.save(tmp_path / "front.json")
    done = trajevo("slowdown", tmp_path / "front.json", "--payload", 9, "--solution", "weighted")
    assert done.returncode == 0, done.stderr
    assert f"slowdown: {slowdown_for(front.pick('weighted'), 9.0)}" in done.stdout
    assert f"sensitivity: {sensitivity(front.pick('weighted'))}" in done.stdout
    assert "12.51" in done.stdout
    assert (tmp_path / "slowdown.png").is_file()
    heavy = trajevo("slowdown", tmp_path / "front.json", "--payload", 20)
    assert heavy.returncode == 2
    assert heavy.stderr.startswith("error: payload: expected at most 12.510811 kg")
