"""Payloads under effort limits that differ by direction: bisection with dense samples, proofs, regions, slowdown."""

from dataclasses import replace

import numpy as np
import pytest

from tests.helpers import mostly_long
from trajevo import Pose, ViaPoints, load_robot
from trajevo.capacity.capacity import Capacity
from trajevo.capacity.dlcc import capacities, dlcc, dlcc_sampled, effort_along
from trajevo.capacity.payload_effort import payload_bounds, payload_effort
from trajevo.capacity.robust import worst_case
from trajevo.capacity.sensitivity import sensitivity
from trajevo.capacity.slowdown import slowdown_for
from trajevo.capacity.workspace import ToolPlane, workspace_capacity
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.payload_masses import mass_bounds
from trajevo.dynamics.rollout import Rollout
from trajevo.robot.joints import Sides
from trajevo.robot.payload import Payload
from trajevo.trajectory.interpolants import QuinticSpline
from trajevo.verification.certify import certify

PUMA = load_robot("puma560")
SHARES = np.array([0.5, 3.0, 0.6, 1.0, 0.5, 2.0])
ROBOT = replace(PUMA, limits=replace(PUMA.limits, effort_backward=SHARES * PUMA.limits.effort))
SIDES = ROBOT.limits.sides("effort")


def motion(seed, count=1, robot=ROBOT):
    rng = np.random.default_rng(seed)
    points = ViaPoints(0.3 * rng.uniform(robot.limits.lower, robot.limits.upper, (4, robot.dof)))
    spline = QuinticSpline(points, duration_bounds=(0.1, 5.0))
    return Rollout(Dynamics(robot, Payload(1.0, (0.05, 0.0, 0.1))), spline(rng.uniform(0.7, 1.5, (count, 3))))


def dense(rollout, samples=100):
    """Efforts without payload and per kilogram at many samples, (T, n_joints) each."""
    fine = replace(rollout, dynamics=rollout.dynamics.sampled(samples))
    return fine.unloaded_effort[0], fine.effort_per_kilogram[0]


def kept(efforts, mass, forward=SIDES.forward, backward=SIDES.backward):
    effort = efforts[0] + mass * efforts[1]
    return bool((effort <= forward).all() and (effort >= -backward).all())


def bisected(efforts, high=1e3):
    """The greatest mass with which no sample breaks a limit of either direction, without a closed form."""
    low = 0.0
    assert kept(efforts, low)
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if kept(efforts, middle) else (low, middle)
    return low


def feasible(count, robot=ROBOT):
    found = [motion(seed, robot=robot) for seed in range(40)]
    return [one for one in found if kept(dense(one), 0.0)][:count]


def test_masses_of_each_limit_are_where_its_effort_reaches_it():
    rng = np.random.default_rng(0)
    unloaded, each = rng.normal(0.0, 1.0, (2, 500, 3))
    sides = Sides(np.array([1.0, 0.5, np.inf]), np.array([0.4, 2.0, 0.7]))
    lower, upper = mass_bounds(unloaded, each, sides)
    held = lower <= upper
    for mass in (lower, upper):
        at = held & np.isfinite(mass) & (mass > 0.0)
        used = sides.share(unloaded + np.where(at, mass, 0.0) * each)
        np.testing.assert_allclose(used[at], 1.0, rtol=1e-9)
    tried = np.linspace(0.0, 20.0, 2001)[:, None, None]
    some = (sides.share(unloaded + tried * each) <= 1.0).any(axis=0)
    assert (some <= held).all()
    assert (held & ~some).mean() < 0.02  # intervals narrower than the grid, or beyond it


@pytest.mark.parametrize("count", mostly_long([2, 5], 2))
def test_the_capacity_is_that_of_bisection_with_dense_samples(count):
    found = feasible(count)
    assert len(found) == count
    of_both = [dlcc_sampled(replace(one, dynamics=replace(one.dynamics, robot=PUMA))).mass for one in found]
    assert any(dlcc_sampled(one).mass < 0.9 * mass for one, mass in zip(found, of_both, strict=True))
    for one in found:
        expected = bisected(dense(one))
        capacity = dlcc(one)
        assert capacity.mass <= expected * (1.0 + 1e-9)
        assert capacity.mass == pytest.approx(expected, rel=5e-3)
        assert dlcc_sampled(one, samples=100).mass == pytest.approx(expected, rel=1e-9)
        assert capacity.margin.min() >= -1e-9
        loaded = replace(one, dynamics=replace(one.dynamics, payload=one.dynamics.payload.with_mass(capacity.mass)))
        assert all(row.proven for row in certify(loaded).rows if row.quantity == "effort")
        assert_binding(one, capacity)
        # Every payload at once: the same mass with the same centre, and never more by the bounds.
        com = np.array([[0.05, 0.0, 0.1]])
        assert payload_effort(one, samples=100).mass_range(com).upper[0] == pytest.approx(expected, rel=1e-9)
        bound = payload_bounds(one, tolerance=1e-3).mass_range(com).upper[0]
        assert 0.98 * expected <= bound <= expected * (1.0 + 1e-9)


def assert_binding(one, capacity: Capacity):
    """Where and when it binds, the effort is at the limit of its direction; raising that one is what helps."""
    t, joint = np.array([capacity.time]), PUMA.joint_names.index(capacity.joint)
    loaded = replace(one, dynamics=replace(one.dynamics, payload=one.dynamics.payload.with_mass(capacity.mass)))
    effort = loaded.effort_in(*(one.trajectory.evaluate(t[None], order) for order in range(3)))[0, 0]
    assert SIDES.share(effort)[joint] == pytest.approx(1.0, abs=2e-3)
    name = "effort" if effort[joint] > 0.0 else "effort_backward"
    limits = getattr(ROBOT.limits, name).copy()
    limits[joint] *= 1.0 + 1e-6
    stronger = replace(ROBOT, limits=replace(ROBOT.limits, **{name: limits}))
    more = dlcc_sampled(replace(one, dynamics=replace(one.dynamics, robot=stronger)), samples=50)
    before = dlcc_sampled(one, samples=50)
    slope = sensitivity(one, samples=50).per_percent_of_effort
    assert 1e-4 * slope == pytest.approx(more.mass - before.mass, rel=1e-3)


def test_capacities_of_a_batch_and_with_a_margin():
    batch = motion(3, count=6)
    found = capacities(batch)
    for k in range(6):
        one = Rollout(batch.dynamics, batch.trajectory[k])
        assert found.mass[k] == pytest.approx(dlcc(one).mass, rel=1e-9)
    margin = replace(batch, kept_limits=ROBOT.limits.scaled({"effort": 0.8}))
    less = capacities(margin)
    assert less.kept == pytest.approx(0.8)
    np.testing.assert_array_equal(less.at_full_limit, found.mass)
    np.testing.assert_allclose(margin.limits.effort_backward, 0.8 * SIDES.backward)


def test_efforts_along_a_motion_know_both_limits():
    one = feasible(1)[0]
    along = effort_along(one)
    np.testing.assert_array_equal(along.sides.both, SIDES.both)
    assert effort_along(replace(one, dynamics=replace(one.dynamics, robot=PUMA))).limit_backward is None


def test_the_worst_payload_is_judged_by_the_direction():
    one = feasible(1)[0]
    effort = payload_effort(one, samples=60)
    com = np.array([[0.0, -0.05, 0.05], [0.1, 0.05, 0.15]])
    found = worst_case(effort, mass=[1.0, 2.0], com=com)
    corners = np.array(np.meshgrid(*com.T)).reshape(3, -1).T
    shares = [
        SIDES.share(effort.effort(Payload(mass, tuple(corner)))).max() for mass in (1.0, 2.0) for corner in corners
    ]
    assert max(shares) <= found.used * (1.0 + 1e-9)
    assert found.used == pytest.approx(max(shares), rel=0.05)


def test_a_slower_motion_keeps_both_limits_and_the_binding_one_is_reached():
    for one in feasible(3):
        found = slowdown_for(one, 4.0)
        scaled = replace(found.rollout, dynamics=found.rollout.dynamics.sampled(100))
        shares = [
            scaled.robot.limits.sides(name).share(values).max()
            for name, values in (("velocity", scaled.v), ("acceleration", scaled.a), ("effort", scaled.effort))
        ]
        assert max(shares) <= 1.0 + 1e-9
        if found.limit == "effort":
            assert shares[2] == pytest.approx(1.0, abs=1e-4)


def test_a_slowdown_is_bound_by_the_velocity_of_the_slower_direction():
    ends = np.stack([np.zeros(6), np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])])
    free = np.full(6, np.inf)
    limits = replace(PUMA.limits, velocity=np.full(6, 2.0), acceleration=free, jerk=free, effort=free)
    robot = replace(PUMA, limits=replace(limits, velocity_backward=np.full(6, 0.5)))
    for points, speed in ((ends, 2.0), (ends[::-1], 0.5)):
        spline = QuinticSpline(ViaPoints(points.copy()), duration_bounds=(0.1, 50.0))
        found = slowdown_for(Rollout(Dynamics(robot, Payload(0.0)), spline(np.array([[1.0]]))), 0.0)
        assert (found.limit, found.joint) == ("velocity", "joint_1")
        assert found.factor == pytest.approx(15.0 / 8.0 / speed, rel=1e-9)  # the quintic's peak over its mean


def test_what_can_be_held_in_a_plane_is_bound_by_the_direction():
    plane = ToolPlane.around(Pose([0.45, 0.15, 0.1]), "xz", reach=0.1, cells=2)
    found = workspace_capacity(ROBOT, plane, seed=0, starts=2)
    q = found.q[found.reached]
    dynamics, still = Dynamics(ROBOT, Payload(1.0)), np.zeros_like(q)
    efforts = dynamics.unloaded_effort(q, still, still), dynamics.effort_per_kilogram(q, still, still)
    assert len(q)
    for k, mass in enumerate(found.mass[found.reached]):
        one = tuple(x[k : k + 1] for x in efforts)
        assert mass == pytest.approx(bisected(one), rel=1e-9)
