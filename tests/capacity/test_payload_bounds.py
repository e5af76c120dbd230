"""Payloads off centre, guaranteed at every instant: never above the guaranteed capacity of each, and close to it."""

from dataclasses import replace

import numpy as np
import pytest

from tests.capacity.test_guaranteed import ROBOTS, random_motions
from tests.helpers import mostly_long, refused
from trajevo import (
    Payload,
    allowed_centres,
    allowed_regions,
    dlcc,
    payload_bounds,
    payload_diagram,
    payload_effort,
    robust_capacity,
    worst_case,
)
from trajevo.dynamics.payload_bounds import REACH

every_robot = pytest.mark.parametrize("name", mostly_long(ROBOTS, "puma560", "hybrid_manipulator"))
BOX = np.array([[-0.05, -0.1, 0.0], [0.1, 0.05, 0.2]])


def carrying(rollout, com, mass=1.0):
    payload = rollout.dynamics.payload
    return replace(
        rollout, dynamics=replace(rollout.dynamics, payload=replace(payload.with_mass(mass), com=tuple(com)))
    )


@every_robot
@pytest.mark.parametrize("model", mostly_long(["rigid", "weight_only"], "rigid"))
def test_masses_are_guaranteed_and_close_to_the_capacity_wherever_the_centre_is(name, model):
    rng, compared = np.random.default_rng(1), 0
    for seed in range(4):
        rollout = random_motions(name, 1, seed, model=model)
        bounds = payload_bounds(rollout)
        com = rng.uniform(-0.17, 0.17, (4, 3))
        found = bounds.mass_range(com)
        for k, at in enumerate(com):
            exact = dlcc(carrying(rollout, at), tolerance=1e-6)
            if not exact.feasible:
                assert np.isnan(found.upper[k])
                continue
            compared += 1
            assert found.upper[k] <= exact.upper * (1.0 + 1e-12)
            assert found.lower[k] >= exact.lower * (1.0 - 1e-12)
            assert found.upper[k] >= 0.995 * exact.mass
    assert compared >= 4


@every_robot
def test_even_far_away_nothing_is_claimed_that_does_not_hold(name):
    rollout = random_motions(name, 1, 5)
    bounds, rng = payload_bounds(rollout, tolerance=0.1), np.random.default_rng(2)
    com = rng.normal(size=(20, 3))
    com *= REACH * rng.uniform(0.2, 1.0, (20, 1)) / np.linalg.norm(com, axis=1)[:, None]
    for at, upper in zip(com, bounds.mass_range(com).upper, strict=True):
        assert np.isnan(upper) or upper <= dlcc(carrying(rollout, at)).upper * (1.0 + 1e-12)


@every_robot
def test_diagram_box_and_worst_case_hold_at_many_samples(name):
    rollout = random_motions(name, 1, 2)
    bounds, sampled = payload_bounds(rollout), payload_effort(rollout, samples=200)
    offsets, heights = np.linspace(0.0, 0.3, 4), np.linspace(0.0, 0.3, 3)
    guaranteed, dense = (payload_diagram(effort, offsets, heights) for effort in (bounds, sampled))
    assert (guaranteed.mass <= dense.mass).all()
    assert (guaranteed.mass >= 0.99 * dense.mass).all()
    assert (guaranteed.samples, dense.samples) == (None, 200)
    box, dense_box = (robust_capacity(effort, com=BOX) for effort in (bounds, sampled))
    assert 0.99 * dense_box.upper <= box.upper <= dense_box.upper
    assert str(box).endswith("; guaranteed at every instant")
    assert str(dense_box).endswith("; at 200 instants per segment, not between them")
    most, seen = (worst_case(effort, mass=(0.5, 2.0), com=BOX) for effort in (bounds, sampled))
    assert seen.used <= most.used <= seen.used + 0.01
    assert (bounds.used(2.0, BOX) >= sampled.used(2.0, BOX)).all()
    assert (bounds.used(2.0, BOX) <= sampled.used(2.0, BOX) + 0.01).all()


@pytest.mark.parametrize("name", mostly_long(ROBOTS, "hybrid_manipulator"))
def test_regions_for_a_known_inertia_are_inside_those_of_many_samples(name):
    rollout = random_motions(name, 1, 2)
    inertia = np.diag([0.05, 0.04, 0.03])
    efforts = payload_bounds(rollout), payload_effort(rollout, samples=200)
    bounds, sampled = (effort.with_inertia_about_tool(inertia) for effort in efforts)
    mass = 0.5 * float(sampled.mass_range(np.zeros((1, 3))).upper[0])
    centres, dense = allowed_centres(bounds, mass), allowed_centres(sampled, mass)
    points = np.random.default_rng(3).uniform(-0.6, 0.6, (4000, 3))
    inside, outer = centres.contains(points), dense.contains(points)
    assert not (inside & ~outer).any()
    assert inside.sum() >= 0.97 * outer.sum() > 0
    assert not centres.contains([[0.0, 0.0, 1.01 * REACH]])[0]
    assert allowed_regions(bounds, [mass], within=0.5).samples is None
    refused(lambda: centres.section("z", within=2.0), "^within: expected corners up to 2 m from the tool's origin")


def test_what_bounds_do_not_hold_for_is_refused():
    bounds = payload_bounds(random_motions("ur5", 1, 1))
    refused(lambda: bounds.mass_range([[0.0, 0.0, 2.1]]), "^com: expected centres of mass within 2 m of the tool's")
    refused(lambda: robust_capacity(bounds, com=[[-2.0] * 3, [2.0] * 3]), "^com: expected centres of mass within 2 m")
    refused(lambda: payload_diagram(bounds, [0.0, 3.0], [0.0]), "^com: expected centres of mass within 2 m")
    refused(lambda: bounds.effort(Payload(1.0)), "^effort: expected efforts at samples")
    refused(lambda: payload_bounds(random_motions("ur5", 1, 1), tolerance=0.5), "^tolerance: expected a share from")


def test_bounds_stand_on_the_limits_that_are_kept_and_tell_the_full_ones():
    rollout = random_motions("ur5", 1, 2)
    limits = rollout.robot.limits
    kept = replace(rollout, kept_limits=replace(limits, effort=0.8 * limits.effort))
    for function in (payload_bounds, payload_effort):
        less, full = function(kept), function(rollout)
        assert (less.kept, full.kept) == (pytest.approx(0.8), 1.0)
        found, at_full = robust_capacity(less, com=BOX), robust_capacity(full, com=BOX)
        assert found.upper < at_full.upper
        assert found.at_full_limit == pytest.approx(at_full.upper, rel=5e-3)
        assert at_full.at_full_limit is None
        assert str(found).startswith("with your margin of 20 %: ")
        assert "; at the robot's full limits: " in str(found)
        assert "less 20 %" in str(worst_case(less, mass=(0.5, 1.0), com=BOX))
        assert payload_diagram(less, [0.0, 0.1], [0.0]).kept == pytest.approx(0.8)
