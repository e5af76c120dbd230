"""Factors of time that are proven: certificates, a second search by dense sampling, margins, loads at their limit."""

from dataclasses import replace

import numpy as np
import pytest

from tests.capacity.test_slowdown import (
    HYBRID,
    PUMA,
    STATIC_BOUND,
    only_effort,
    random_motion,
    rubbing,
    table_7,
    with_limits,
)
from tests.helpers import refused
from trajevo import Payload, ViaPointProblem, certify, load_robot, plots
from trajevo.capacity.robust import robust_slowdown
from trajevo.capacity.scaled_path import SCALED_LIMITS
from trajevo.capacity.slowdown import slowdown_curve, slowdown_for
from trajevo.errors import InvalidInputError

UR5 = load_robot("ur5", tool="tool0", limits={"acceleration": 10.0, "jerk": 100.0})
POINTS = [[0.0, -1.5, 1.5, -1.5, -1.5, 0.0], [0.5, -1.2, 1.4, -1.7, -1.5, 0.2], [0.9, -1.4, 1.5, -1.6, -1.5, 0.0]]
KINEMATIC = ("position", "velocity", "acceleration", "jerk")
DURATIONS = np.array([[1.1, 0.9]])


def ur5(**changes) -> ViaPointProblem:
    given = {
        "robot": UR5,
        "points": POINTS,
        "duration_bounds": (0.3, 4.0),
        "objectives": ["time", "energy"],
        "constraints": [*KINEMATIC, "effort"],
        "payload": Payload(1.0, (0.0, 0.0, 0.03)),
    }
    return ViaPointProblem(**(given | changes))


def motions():
    """Motions of several robots on which the effort limits bind, or the others: what makes them, when they are used."""
    for seed in range(4):
        yield lambda seed=seed: random_motion(only_effort(PUMA), seed)
        yield lambda seed=seed: random_motion(rubbing(PUMA), seed)
        yield lambda seed=seed: random_motion(only_effort(rubbing(PUMA)), seed)
    yield lambda: table_7(12.0)
    yield lambda: table_7(12.0, model="weight_only", robot=only_effort(HYBRID))
    yield lambda: heavier(14.0)
    yield lambda: ur5(effort_margin=0.2).rollout(DURATIONS)


def heavier(mass):
    """A motion planned for 1 kg, with more."""
    return replace(ur5().rollout(DURATIONS), dynamics=replace(ur5().dynamics, payload=Payload(mass, (0.0, 0.0, 0.03))))


def least_by_bisection(found, samples=1001):
    """The least factor by dense sampling, from one that is kept down to one that is not."""
    low, high = 0.98 * found.factor, 1.001 * found.factor

    def kept(factor):
        rollout = replace(found, factor=factor).rollout
        states = (rollout.trajectory.at_shares(np.linspace(0.0, 1.0, samples), order) for order in range(3))
        used = [np.abs(rollout.effort_in(*states)) / rollout.limits.effort]
        used += [rollout.trajectory.peak(k + 1) / getattr(rollout.limits, SCALED_LIMITS[k]) for k in range(3)]
        return max(float(each.max()) for each in used) <= 1.0

    assert kept(high)
    assert not kept(low)
    for _ in range(20):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if kept(middle) else (middle, high)
    return high


@pytest.mark.parametrize(
    "made", [pytest.param(one, marks=[pytest.mark.long] if k % 3 else []) for k, one in enumerate(motions())]
)
def test_the_factor_is_proven_by_a_certificate_and_the_least_by_dense_sampling(made):
    motion = made()
    found = slowdown_for(motion, motion.dynamics.payload)
    assert found.proven
    certificate = certify(found.rollout, tolerance=1e-6)
    joints = [row for row in certificate.rows if row.quantity in ("velocity", "acceleration", "jerk", "effort")]
    assert {row.quantity for row in joints} >= {"effort"}
    assert all(row.proven for row in joints)
    assert found.factor == pytest.approx(least_by_bisection(found), rel=1e-4)
    assert 0.0 <= found.gap <= 1e-4


@pytest.mark.long
def test_no_instant_of_a_thousand_motions_breaks_a_limit():
    """With friction or without, light and heavy; the sampled factor is told beside the proven one."""
    gaps, by_effort = [], 0
    for seed in range(1000):
        robot = (PUMA, only_effort(PUMA, 0.9), rubbing(PUMA), only_effort(rubbing(PUMA)))[seed % 4]
        motion = random_motion(robot, seed)
        try:
            found = slowdown_for(motion, 0.5 + 0.01 * (seed % 100))
        except InvalidInputError:  # too heavy to be held
            continue
        assert found.proven
        states = (found.rollout.trajectory.at_shares(np.linspace(0.0, 1.0, 5001), order) for order in range(3))
        assert (np.abs(found.rollout.effort_in(*states)) <= robot.limits.effort).all()
        gaps.append(found.gap)
        by_effort += found.limit == "effort"
    assert len(gaps) > 700
    assert by_effort > 300
    assert max(gaps) <= 1e-4


@pytest.mark.parametrize("seed", range(4))
def test_two_samples_a_segment_give_the_same_proven_factor(seed):
    """Where a proof finds an effort beyond its limit between the samples, its instant joins them."""
    motion = random_motion(only_effort(PUMA), seed)
    coarse, fine = slowdown_for(motion, 1.0, samples=2), slowdown_for(motion, 1.0)
    assert coarse.proven
    assert coarse.factor == pytest.approx(fine.factor, rel=1e-7)


def test_a_load_at_the_very_limit_is_not_called_proven():
    """Near what can be held at rest slower motions gain ever less; right there no proof can close."""
    nearly = slowdown_for(table_7(), (1.0 - 1e-5) * STATIC_BOUND)
    assert nearly.proven
    assert 1e-6 < nearly.gap < 1e-4
    above = f"; {100.0 * nearly.gap:.2g} % above what {nearly.instants} instants allow, proven at every instant"
    assert str(nearly).endswith(above)
    found = slowdown_for(table_7(), STATIC_BOUND * (1.0 - 1e-10))
    assert not found.proven
    assert found.factor == found.sampled_factor
    assert str(found).endswith(f"; not proven, only checked at {found.instants} instants")


def test_a_margin_is_kept_and_the_full_limits_are_told():
    problem, whole = ur5(effort_margin=0.2), ur5()
    motion = problem.rollout(DURATIONS)
    weaker = with_limits(UR5, effort=0.8 * UR5.limits.effort)
    for mass in (8.0, 12.0):
        found, full = slowdown_for(motion, mass), slowdown_for(whole.rollout(DURATIONS), mass)
        by_robot = slowdown_for(
            replace(motion, dynamics=replace(motion.dynamics, robot=weaker), kept_limits=None), mass
        )
        assert found.factor == pytest.approx(by_robot.factor, rel=1e-9)
        assert (found.limit, found.joint) == ("effort", "shoulder_lift_joint")
        assert found.utilisation[3].max() == pytest.approx(1.0, abs=1e-6)
        assert found.at_full_limits.factor == pytest.approx(full.factor, rel=1e-9)
        assert found.at_full_limits.factor < found.factor
        assert full.at_full_limits is None
        assert str(found).startswith(f"with your margin of 20 %: {mass:g} kg (rigid payload) takes at least")
        assert f"; at the robot's full limits: {mass:g} kg" in str(found)
        efforts = [row for row in certify(found.rollout, tolerance=1e-7).rows if row.quantity == "effort"]
        used = max(row.bound / limit for row, limit in zip(efforts, UR5.limits.effort, strict=True))
        assert 0.8 * (1.0 - 1e-6) < used < 0.8 + 2e-7
    light = slowdown_for(motion, 1.0)
    assert light.at_full_limits.factor == light.factor
    assert "margin" not in str(light)
    says = "can hold at rest at .* with your margin of 20 %, got 17 kg"
    refused(lambda: slowdown_for(motion, 17.0), says)
    assert slowdown_for(whole.rollout(DURATIONS), 17.0).proven


def test_a_curve_with_a_margin_has_that_at_the_full_limits():
    curve = slowdown_curve(ur5(effort_margin=0.2).rollout(DURATIONS), [1.0, 12.0, 17.0], samples=10)
    full = slowdown_curve(ur5().rollout(DURATIONS), [1.0, 12.0, 17.0], samples=10)
    np.testing.assert_array_equal(curve.at_full_limits.factors, full.factors)
    assert curve.effort_margin == pytest.approx(0.2)
    assert curve.static_bound < full.static_bound
    assert curve.factors[0] == full.factors[0]
    assert curve.factors[1] > full.factors[1]
    assert np.isnan(curve.factors[2])
    assert np.isfinite(full.factors[2])
    ax = plots.slowdown_curve(curve)
    assert ax.get_title().replace("\n", " ") == f"your margin of 20 % kept; effort sampled at {curve.instants} instants"
    assert "at the robot's full limits" in [text.get_text() for text in ax.get_legend().get_texts()]


def test_a_robust_slowdown_keeps_the_margin_too():
    box = {"mass": (7.0, 9.0), "com": [[-0.02, -0.02, 0.01], [0.02, 0.02, 0.05]]}
    found = robust_slowdown(ur5(effort_margin=0.2).rollout(DURATIONS), **box)
    full = robust_slowdown(ur5().rollout(DURATIONS), **box)
    weaker = ur5(robot=with_limits(UR5, effort=0.8 * UR5.limits.effort))
    by_robot = robust_slowdown(weaker.rollout(DURATIONS), **box)
    assert found.factor == pytest.approx(by_robot.factor, rel=1e-9)
    assert found.at_full_limits.factor == pytest.approx(full.factor, rel=1e-9)
    assert found.factor > full.factor
    assert found.proven
    assert 0.0 <= found.factor / found.sampled_factor - 1.0 <= 1e-4
    assert str(found).startswith("with your margin of 20 %: takes at least")
    assert "with the worst" in str(full)
    for payload in found.payloads:
        alone = slowdown_for(ur5(effort_margin=0.2).rollout(DURATIONS), payload)
        assert alone.factor <= found.factor * (1.0 + 1e-9)
