"""Allowed centres of mass: the polyhedron against direct evaluation, its sections against its members."""

import numpy as np
import pytest

from tests.capacity.test_payload_effort import ROBOTS, random_effort
from tests.helpers import refused
from trajevo import Payload
from trajevo.capacity.payload_diagram import allowed_centres
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import UnknownNameError

BALL = np.diag([0.02, 0.03, 0.025])


def affine_effort(name, seed, *, speed=0.4):
    return random_effort(name, np.random.default_rng(seed), speed=speed)[1].with_inertia_about_tool(BALL)


@pytest.mark.parametrize("name", ROBOTS)
def test_members_keep_every_limit_and_others_break_one(name):
    limit, outcomes = ROBOTS[name].limits.effort, set()
    for seed in range(6):
        effort, mass = affine_effort(name, seed, speed=0.2), 3.0
        com = np.random.default_rng(seed).uniform(-2.0, 2.0, (300, 3))
        inside = allowed_centres(effort, mass).contains(com)
        slopes = effort.slopes[..., 0, None] + effort.slopes[..., 1:4] @ com.T
        used = np.abs(effort.base[..., None] + mass * slopes).max(axis=0) / limit[:, None]
        np.testing.assert_array_equal(inside, used.max(axis=0) <= 1.0)
        outcomes |= set(inside.tolist())
    assert outcomes == {True, False}


def test_members_keep_the_limits_of_pinocchio_with_the_payload_attached():
    rng, mass, seen = np.random.default_rng(1), 6.0, set()
    rollout, effort = random_effort("ur5", rng, speed=0.4)
    about_tool = mass * 0.5 * np.eye(3)
    polyhedron = allowed_centres(effort.with_inertia_about_tool(about_tool), mass)
    com = rng.uniform(-0.28, 0.28, (100, 3))
    for at, inside in zip(com, polyhedron.contains(com), strict=True):
        own = about_tool - mass * (at @ at * np.eye(3) - np.outer(at, at))
        attached = Rollout(Dynamics(ROBOTS["ur5"], Payload(mass, tuple(at), own)), rollout.trajectory)
        assert inside == (np.abs(attached.effort[0]) <= ROBOTS["ur5"].limits.effort).all()
        seen.add(bool(inside))
    assert seen == {True, False}


@pytest.mark.parametrize("axis", "xyz")
def test_a_section_holds_what_the_polyhedron_does(axis):
    polyhedron, rng = allowed_centres(affine_effort("ur5", 3), 4.0), np.random.default_rng(3)
    corners = polyhedron.section(axis, 0.05, within=1.0)
    assert len(corners) >= 3
    edges = np.roll(corners, -1, axis=0) - corners
    turns = edges[:, 0] * np.roll(edges, -1, axis=0)[:, 1] - edges[:, 1] * np.roll(edges, -1, axis=0)[:, 0]
    assert (turns > -1e-9).all()
    points = rng.uniform(-1.0, 1.0, (2000, 2))
    side = edges[:, 0] * (points[:, None, 1] - corners[:, 1]) - edges[:, 1] * (points[:, None, 0] - corners[:, 0])
    inside = polyhedron.contains(np.insert(points, "xyz".index(axis), 0.05, axis=1))
    clear = np.abs(side).min(axis=1) > 1e-9
    np.testing.assert_array_equal((side > 0.0).all(axis=1)[clear], inside[clear])
    assert set(inside.tolist()) == {True, False}


def test_corners_of_a_section_use_a_limit_up():
    effort = affine_effort("ur5", 3)
    polyhedron, limit = allowed_centres(effort, 4.0), ROBOTS["ur5"].limits.effort
    corners = polyhedron.section(within=5.0)
    own = corners[(np.abs(corners) < 4.999).all(axis=1)]
    com = np.insert(own, 2, 0.0, axis=1)
    used = np.abs(effort.base[..., None] + 4.0 * (effort.slopes[..., 0, None] + effort.slopes[..., 1:4] @ com.T))
    assert len(own) >= 3
    np.testing.assert_allclose((used / limit[:, None]).max(axis=(0, 1)), 1.0, atol=1e-9)


def test_what_limits_a_bare_weight_needs_no_inertia():
    weight = random_effort("ur5", np.random.default_rng(4), model="weight_only")[1]
    assert allowed_centres(weight, 1.0).normals.shape == (2 * weight.base.size, 3)


def test_a_mass_that_is_too_great_leaves_nothing():
    polyhedron = allowed_centres(affine_effort("ur5", 5), 1000.0)
    assert polyhedron.section("x", 2.0, within=0.5).shape == (0, 2)
    assert not polyhedron.contains([[2.0, 0.0, 0.0]]).any()


def test_bad_input_is_refused():
    quadratic = random_effort("ur5", np.random.default_rng(6))[1]
    refused(
        lambda: allowed_centres(quadratic, 1.0), "^effort: quadratic in the centre of mass.*with_inertia_about_tool"
    )
    effort = affine_effort("ur5", 6)
    for mass in (0.0, -1.0, np.nan, np.inf):
        refused(lambda mass=mass: allowed_centres(effort, mass), "^mass: expected")
    polyhedron = allowed_centres(effort, 1.0)
    refused(lambda: polyhedron.contains([0.0, 0.0, 0.0]), r"^com: expected shape \(P, 3\)")
    refused(lambda: polyhedron.section("z", np.nan, within=1.0), "^at: expected")
    refused(lambda: polyhedron.section(within=0.0), "^within: expected a positive length")
    with pytest.raises(UnknownNameError, match="unknown axis 'w'; known: x, y, z"):
        polyhedron.section("w", within=1.0)
