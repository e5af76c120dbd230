"""Guaranteed payloads: enclosed from both sides on random motions of every robot, certified, told with their margin."""

from dataclasses import replace

import numpy as np
import pytest

from tests.guo2016 import GUO2016, TABLE_7
from tests.helpers import mostly_long, refused
from trajevo import (
    Payload,
    PolynomialBatch,
    ViaPoints,
    capacities,
    certify,
    dlcc,
    dlcc_iterative,
    dlcc_sampled,
    load_robot,
    load_task,
)
from trajevo.capacity.capacity import rounded
from trajevo.capacity.dlcc import effort_along
from trajevo.dynamics import mass_enclosure
from trajevo.dynamics.complex_bounds import Bounds, EffortReach
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.mass_enclosure import enclose_masses
from trajevo.dynamics.payload_masses import mass_bounds
from trajevo.dynamics.rollout import Rollout
from trajevo.problems import HybridManipulator
from trajevo.robot.payload import LOAD_MODELS
from trajevo.trajectory.interpolants import CubicSpline, QuinticSpline, SepticSpline

FREE = {"acceleration": np.inf, "jerk": np.inf}
ROBOTS = {
    "ur5": load_robot("ur5", limits=FREE, tool="tool0"),
    "panda": load_robot(
        "panda", limits=FREE, tool="panda_hand", lock={"panda_finger_joint1": 0.0, "panda_finger_joint2": 0.0}
    ),
    "hybrid_manipulator": load_robot("hybrid_manipulator"),  # two coupled screws
    "puma560": load_robot("puma560", limits=FREE),  # dry and viscous friction, armatures
}
SPLINES = (CubicSpline, QuinticSpline, SepticSpline)
MODELS = tuple(LOAD_MODELS)
every_robot = pytest.mark.parametrize("name", mostly_long(ROBOTS, "puma560", "hybrid_manipulator"))
every_model = pytest.mark.parametrize("model", MODELS)


def with_effort(robot, limits):
    return replace(robot, limits=replace(robot.limits, effort=np.broadcast_to(limits, (robot.dof,)).astype(float)))


def random_motions(name, count, seed, *, model="rigid"):
    """Splines through random points at random speeds, with a body that is off the tool's axis."""
    robot, rng = ROBOTS[name], np.random.default_rng(seed)
    low, high = (np.clip(x, -2.0, 2.0) for x in (robot.limits.lower, robot.limits.upper))
    points = 0.5 * (low + high) + rng.uniform(-0.35, 0.35, (3, robot.dof)) * (high - low)
    spline = SPLINES[seed % 3](ViaPoints(points), duration_bounds=(0.2, 6.0))
    x = np.clip(rng.uniform(0.6, 1.6, (count, len(spline.variables))) * rng.uniform(0.4, 3.0, (count, 1)), 0.2, 6.0)
    com = tuple(rng.uniform(-0.15, 0.15, 3)) if model != "tool_axis" else (0.0, 0.0, 0.0)
    inertia = ((0.02, 0.0, 0.0), (0.0, 0.03, 0.0), (0.0, 0.0, 0.04)) if model == "rigid" else None
    return Rollout(Dynamics(robot, Payload(2.0, com, inertia, model), samples=6), spline(x))


def dense(rollout, limits, instants, *, samples=100):
    """Least and greatest mass that many samples of every segment, and given instants (B, K) [s], allow.

    Where a joint comes to rest to the last digit, dry friction depends on rounding; just before and after it does not.
    """
    fine = replace(rollout, dynamics=rollout.dynamics.sampled(samples))
    around = np.concatenate([np.nan_to_num(instants) + by for by in (-1e-9, 0.0, 1e-9)], axis=1)
    around = np.clip(around, 0.0, rollout.trajectory.duration[:, None])
    states = (fine.trajectory.evaluate(around, order) for order in range(3))
    q, v, a = (np.concatenate(both, axis=1) for both in zip((fine.q, fine.v, fine.a), states, strict=True))
    efforts = fine.dynamics.unloaded_effort(q, fine.without_rounding(v), a), fine.dynamics.effort_per_kilogram(q, v, a)
    lower, upper = mass_bounds(*efforts, limits)
    return lower.max(axis=(1, 2)), upper.min(axis=(1, 2))


def check(name, count, seed):
    """Number of motions with a proven mass, a counterweight and none at all; all claims hold."""
    rollout = random_motions(name, count, seed, model=MODELS[seed // 3 % 3])
    limits, rng = rollout.robot.limits.effort.copy(), np.random.default_rng(seed)
    if seed % 2:  # a joint that is too weak on some of the motions
        joint, greatest = rng.integers(rollout.robot.dof), np.abs(rollout.unloaded_effort).max(axis=1)
        limits[joint] = np.median(greatest[:, joint])
    found = enclose_masses(rollout, limits, tolerance=1e-4)
    lower, upper = dense(rollout, limits, found.instants)
    proven, none = found.proven, found.lower > found.upper
    assert (proven | none).all()
    assert (lower > upper)[none].all()
    assert (found.most <= upper * (1.0 + 1e-12))[proven].all()
    assert (found.least >= lower * (1.0 - 1e-12))[proven].all()
    finite = proven & np.isfinite(found.upper)
    assert np.isinf(upper[proven & ~finite]).all()
    felt = np.abs(rollout.effort_per_kilogram[finite]).max(axis=1)
    finest = 1e-8 * (limits / np.maximum(felt, 1e-200)).min(axis=1)
    assert (upper[finite] <= found.upper[finite] * (1.0 + 1e-9) + finest).all()
    assert (lower[finite] >= found.lower[finite] * (1.0 - 1e-9) - finest).all()
    for outer, inner in ((found.upper[finite], found.most[finite]), (found.lower[finite], found.least[finite])):
        assert (np.abs(outer - inner) <= np.maximum(1e-4 * outer, finest) * (1.0 + 1e-9)).all()
    return np.array([proven.sum(), (found.least > 0.0)[proven].sum(), none.sum()])


@every_robot
def test_guaranteed_masses_are_below_and_bounds_above_those_of_dense_samples(name):
    assert sum(check(name, 12, seed) for seed in range(18))[0] > 50


@pytest.mark.long
def test_ten_thousand_motions():
    kinds = sum(check(name, 140, 100 + seed) for name in ROBOTS for seed in range(18))
    assert kinds[0] + kinds[2] == 10_080
    assert (kinds > 20).all(), kinds


@pytest.mark.thinned(4)
@every_robot
@every_model
def test_the_certificate_agrees_at_the_guaranteed_mass_and_a_limit_is_broken_above_the_bound(name, model):
    for seed in range(3):
        rollout = replace(random_motions(name, 1, 30 + seed, model=model), masses=None)
        found = dlcc(rollout)
        if not found.feasible:
            continue
        assert found.upper * (1.0 - 1e-4) <= found.mass <= found.upper
        dynamics = replace(rollout.dynamics, payload=rollout.dynamics.payload.with_mass(found.mass))
        certificate = certify(replace(rollout, dynamics=dynamics))
        assert all(row.proven for row in certificate.rows if row.quantity == "effort"), str(certificate)
        assert found.margin.min() >= 0.0
        instants = np.array([[found.time]])
        q, v, a = (rollout.trajectory.evaluate(instants, order) for order in range(3))
        unloaded = rollout.dynamics.unloaded_effort(q, rollout.without_rounding(v), a)
        effort = unloaded + 1.0002 * found.upper * rollout.dynamics.effort_per_kilogram(q, v, a)
        joint = found.joint_names.index(found.joint)
        assert np.abs(effort[0, 0, joint]) > rollout.limits.effort[joint]


def table_7(model="rigid", robot=ROBOTS["hybrid_manipulator"]):
    return Rollout(Dynamics(robot, Payload(10.0, model=model)), HybridManipulator().decode(TABLE_7))


@every_model
def test_table_7_binds_at_a_point_so_that_the_guaranteed_mass_is_the_published_one(model):
    found, sampled = dlcc(table_7(model)), dlcc_sampled(table_7(model))
    assert found.mass <= sampled.mass == found.upper
    assert found.mass == pytest.approx(GUO2016["dlcc_table7"][model], abs=1e-6)
    assert (found.joint, found.time) == (sampled.joint, sampled.time)
    assert str(found) == (
        f"{rounded(found.mass, np.floor)} kg ({model} payload), limited by screw_3 at {found.time:.4f} s; guaranteed "
        f"at every instant; more than {rounded(found.upper, np.ceil)} kg is too much"
    )


def test_a_peak_between_the_samples_is_seen():
    rollout = random_motions("ur5", 1, 1)
    sampled, found = dlcc_sampled(rollout, samples=2), dlcc(rollout, samples=2)
    assert sampled.mass > 1.01 * found.upper
    assert found.time in found.times  # an instant of its own
    assert found.margin.min() < 1e-3
    joint = found.joint_names.index(found.joint)
    assert found.margins[found.times == found.time, joint] == found.margin.min()
    assert effort_along(rollout, samples=2).capacity.time in effort_along(rollout, samples=2).times


def test_masses_are_printed_to_the_safe_side():
    assert [rounded(11.88218016, side) for side in (np.floor, np.ceil)] == ["11.8821", "11.8822"]
    assert [rounded(0.00123456789, side) for side in (np.floor, np.ceil)] == ["0.00123456", "0.00123457"]
    assert [rounded(x, np.floor) for x in (0.0, np.inf, 1234567.0)] == ["0", "inf", "1234560"]


def test_capacities_are_those_of_each_motion():
    rollout = random_motions("panda", 8, 2)
    found = capacities(rollout, samples=6)
    each = [dlcc(replace(rollout, trajectory=rollout.trajectory[k]), samples=6) for k in range(8)]
    assert found.mass.tolist() == [one.mass for one in each]
    assert found.upper.tolist() == [one.upper for one in each]
    assert found.least.tolist() == [one.least for one in each]


@every_model
def test_where_nothing_is_limited_no_mass_is_too_much(model):
    found = dlcc(table_7(model, with_effort(ROBOTS["hybrid_manipulator"], np.inf)))
    assert (found.mass, found.upper, found.joint) == (np.inf, np.inf, "")
    assert str(found) == f"unlimited: no joint has an effort limit that a {model} payload reaches on this motion"


def test_a_weight_does_not_load_vertical_axes_however_closely_one_looks():
    limits = np.array([500.0, 500.0, np.inf, 17.0, np.inf])  # upper screws, and a joint about the vertical
    found = dlcc(table_7("weight_only", with_effort(ROBOTS["hybrid_manipulator"], limits)))
    assert found.mass == np.inf


def test_a_limit_that_the_links_alone_use_up_leaves_nothing():
    rollout = random_motions("ur5", 1, 4)
    peak = max(
        row.bound
        for row in certify(replace(rollout, masses=np.zeros(1)), tolerance=1e-7).rows
        if row.name == "effort of shoulder_lift_joint"
    )
    limits = np.full(6, np.inf)
    limits[1] = peak
    found = dlcc(replace(rollout, dynamics=replace(rollout.dynamics, robot=with_effort(rollout.robot, limits))))
    assert found.least == 0.0
    assert 0.0 <= found.mass <= found.upper < 1e-4
    limits[1] = 0.9999 * peak
    broken = dlcc(replace(rollout, dynamics=replace(rollout.dynamics, robot=with_effort(rollout.robot, limits))))
    assert (broken.mass, broken.upper, broken.feasible, broken.joint) == (0.0, 0.0, False, "shoulder_lift_joint")
    assert str(broken).startswith("0 kg: even without payload shoulder_lift_joint exceeds its effort limit by 0.0")


def counterweighted():
    for seed in range(30, 60):
        rollout = random_motions("hybrid_manipulator", 40, seed)
        greatest = np.abs(rollout.unloaded_effort).max(axis=1)
        for joint in range(5):
            limits = np.full(5, np.inf)
            limits[joint] = 0.97 * np.median(greatest[:, joint])
            weak = replace(rollout, dynamics=replace(rollout.dynamics, robot=with_effort(rollout.robot, limits)))
            helped = np.flatnonzero(capacities(weak).least > 0.0)
            if len(helped):
                return replace(weak, trajectory=rollout.trajectory[helped[0]])
    return pytest.fail("no motion on which a payload is a counterweight")


def test_a_counterweight_is_guaranteed_from_above():
    weak = counterweighted()
    found = dlcc(weak)
    assert 0.0 < found.lower <= found.least <= found.lower * (1.0 + 1e-4) < found.mass <= found.upper
    assert str(found).startswith(
        f"{rounded(found.least, np.ceil)} to {rounded(found.mass, np.floor)} kg (rigid payload)"
    )
    for mass, kept in (
        (0.999 * found.lower, False),
        (found.least, True),
        (found.mass, True),
        (1.001 * found.upper, False),
    ):
        carried = replace(weak, dynamics=replace(weak.dynamics, payload=weak.dynamics.payload.with_mass(mass)))
        efforts = [row for row in certify(carried).rows if row.quantity == "effort"]
        assert all(row.proven for row in efforts) is kept


def test_what_cannot_be_decided_is_not_claimed(monkeypatch):
    rollout = random_motions("ur5", 1, 1)
    exact = dlcc(rollout)
    monkeypatch.setattr(mass_enclosure, "_MOST_PIECES", 0)
    coarse = dlcc(rollout, samples=2)
    assert coarse.mass < exact.mass < exact.upper < coarse.upper  # the gap is told as wide as it is
    long = replace(rollout, trajectory=PolynomialBatch(np.array([[0.0, 40.0]]), _swinging(40.0)))
    lost = dlcc(long)
    assert (lost.mass, lost.feasible) == (0.0, False)
    assert np.isnan(lost.least)
    assert lost.upper > 0.0
    assert str(lost) == (
        "0 kg: no payload is proven to keep the limits at every instant, although 0 to "
        f"{rounded(lost.upper, np.floor)} kg (rigid payload) keeps them at the samples"
    )
    assert (capacities(long).mass, capacities(long).joint) == (0.0, -1)


def _swinging(duration):
    """Coefficients of a polynomial of degree 15 that swings over [0, duration], (1, 1, 6, 16)."""
    swing = np.polynomial.Chebyshev.basis(15, domain=[0.0, duration]).convert(kind=np.polynomial.Polynomial)
    coefficients = np.zeros((1, 1, 6, 16))
    coefficients[..., :] = 0.3 * swing.coef
    return coefficients


def test_bad_tolerances_are_refused():
    for bad in (0.0, 1e-8, 0.2, np.nan):
        refused(lambda bad=bad: dlcc(table_7(), tolerance=bad), "^tolerance: expected")
    refused(lambda: capacities(table_7(), tolerance=1.0), "^tolerance: expected a share from 1e-07 to 0.1, got 1")


@every_model
def test_bounds_without_payload_and_per_kilogram_are_the_parts_of_the_bound_of_effort(model):
    rollout, masses = random_motions("hybrid_manipulator", 1, 5, model=model), np.array([[3.0]])
    reach = EffortReach(rollout.dynamics, any_mass=True)
    bounds = Bounds(np.full((4, 5), 0.1), *np.random.default_rng(1).uniform(0.0, 2.0, (3, 4, 5)))
    unloaded, each = reach.unloaded_and_per_kilogram(bounds)
    np.testing.assert_allclose(unloaded + 3.0 * each, reach.effort(bounds, masses), rtol=1e-12)
    q, v, a = (np.abs(x[0]) for x in (rollout.q, rollout.v, rollout.a))
    real = Bounds(np.zeros_like(q), q, v, a)
    assert (np.abs(rollout.effort_per_kilogram[0]) <= reach.unloaded_and_per_kilogram(real)[1] * (1.0 + 1e-12)).all()


TASK = """
format = 1
angle = "rad"
points = [[0.0, -1.5, 1.5, -1.5, -1.5, 0.0], [0.5, -1.2, 1.4, -1.7, -1.5, 0.2], [0.9, -1.4, 1.5, -1.6, -1.5, 0.0]]
duration_bounds = [0.3, 4.0]
objectives = ["time", "energy"]
seed = 1
[robot]
name = "ur5"
tool = "tool0"
[limits]
acceleration = 10.0
jerk = 100.0
[payload]
mass = 1.0
com = [0.0, 0.0, 0.03]
[constraints]
limits = ["position", "velocity", "acceleration", "jerk", "effort"]
effort_margin = 0.2
"""


@pytest.fixture(scope="module")
def task(tmp_path_factory):
    file = tmp_path_factory.mktemp("task") / "task.toml"
    file.write_text(TASK)
    return file


def test_capacities_stand_on_the_margin_and_tell_that_of_the_full_limits_too(task):
    problem = load_task(task).problem
    rollout = problem.rollout(np.array([1.0, 1.0, *np.zeros(problem.n_var - 2)]))
    full = replace(rollout, kept_limits=None)
    for function in (dlcc, dlcc_sampled, dlcc_iterative):
        found, at_full = function(rollout), function(full)
        assert found.kept == pytest.approx(0.8)
        assert found.mass < at_full.mass == found.at_full_limit
        assert str(found).startswith(f"with your margin of 20 %: {str(found).split(': ')[1]}")
        assert str(found).endswith(f"; at the robot's full limits: {str(at_full).split()[0]} kg")
        assert (at_full.kept, at_full.at_full_limit) == (1.0, None)
    weaker = replace(rollout.dynamics, robot=with_effort(rollout.robot, 0.8 * rollout.robot.limits.effort))
    assert dlcc(rollout).mass == pytest.approx(dlcc(replace(full, dynamics=weaker)).mass, rel=1e-12)
    both = capacities(rollout)
    assert (both.mass, both.at_full_limit) == (capacities(rollout).mass, capacities(full).mass)
    assert capacities(full).at_full_limit is None
    effort = effort_along(rollout)
    np.testing.assert_allclose(effort.limit, 0.8 * rollout.robot.limits.effort)
    assert effort.capacity.at_full_limit == dlcc(full).mass
