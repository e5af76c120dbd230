"""Payloads known to intervals: the worst case against random payloads of the box, and the greatest mass against it."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from tests.capacity.test_payload_effort import ROBOTS, every_com_model, random_effort
from tests.helpers import refused
from trajevo import Payload, PolynomialBatch
from trajevo.capacity.payload_effort import payload_effort
from trajevo.capacity.robust import greatest_in_box, robust_capacity, worst_case
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.robot.payload import com_features

BOX = np.array([[-0.1, -0.05, 0.0], [0.15, 0.05, 0.2]])


def used_by(effort, masses, com):
    """Greatest effort over limit of payloads (P,), directly."""
    slopes = effort.slopes @ com_features(com, effort.inertia).T
    used = np.abs(effort.base[..., None] + masses * slopes) / effort.robot.limits.effort[:, None]
    return used.max(axis=(0, 1))


@pytest.mark.parametrize("name", ROBOTS)
@every_com_model
def test_no_payload_of_the_box_is_worse_than_the_worst(name, model):
    rng = np.random.default_rng(1)
    for speed in (0.1, 1.0, 5.0):
        effort = random_effort(name, rng, speed=speed, model=model)[1]
        found = worst_case(effort, mass=(1.0, 3.0), com=BOX)
        masses, com = rng.uniform(1.0, 3.0, 20_000), rng.uniform(*BOX, (20_000, 3))
        assert used_by(effort, masses, com).max() <= found.used * (1.0 + 1e-12)
        assert used_by(effort, np.array([found.mass]), np.array([found.com]))[0] == pytest.approx(found.used, rel=1e-12)
        at = effort.effort(Payload(found.mass, found.com, model=model))
        joint = ROBOTS[name].joint_names.index(found.joint)
        instants = effort.times == found.time
        assert (np.abs(at[instants, joint]) / ROBOTS[name].limits.effort[joint]).max() == pytest.approx(found.used)
        assert found.feasible == (found.used <= 1.0)
        if model == "weight_only":
            assert found.mass in (1.0, 3.0)
            assert all(x in ends for x, ends in zip(found.com, BOX.T, strict=True))


def test_where_effort_is_affine_the_vertices_are_enough():
    """Inertia about the tool's origin known: the 16 vertices of (mass, com) hold the worst case."""
    rng = np.random.default_rng(2)
    effort = random_effort("ur5", rng, speed=2.0)[1].with_inertia_about_tool(0.05 * np.eye(3))
    vertices = np.array(list(product((0.5, 3.0), *BOX.T)))
    worst = used_by(effort, vertices[:, 0], vertices[:, 1:]).max()
    assert worst_case(effort, mass=(0.5, 3.0), com=BOX).used == pytest.approx(worst, rel=1e-12)


def test_where_effort_is_quadratic_the_vertices_are_not_enough():
    """A load that is spun up relieves a wrist that works the other way, least with its centre of mass near the axis."""
    coefficients = np.zeros((1, 1, 6, 3))
    coefficients[0, 0, 5, 2] = 100.0
    wrist = replace(ROBOTS["ur5"].limits, effort=np.array([np.inf] * 5 + [28.0]))
    robot = replace(ROBOTS["ur5"], limits=wrist)
    spun = Rollout(Dynamics(robot, Payload(1.0)), PolynomialBatch(np.array([[0.0, 0.1]]), coefficients))
    effort = payload_effort(spun, samples=2)
    effort = replace(effort, base=np.full_like(effort.base, -200.0))
    box = np.array([[-0.4] * 3, [0.4] * 3])
    at_vertices = used_by(effort, np.full(8, 2.0), np.array(list(product(*box.T)))).max()
    found = worst_case(effort, mass=(2.0, 2.0), com=box)
    assert found.used > 1.1 * at_vertices
    assert found.used >= used_by(effort, np.full(5000, 2.0), np.random.default_rng(3).uniform(*box, (5000, 3))).max()
    assert np.hypot(*found.com[:2]) < 0.1


def test_greatest_in_box_of_random_rows():
    rng = np.random.default_rng(4)
    rows, inertia = rng.normal(size=(200, 10)), np.diag([0.1, 0.2, 0.15])
    low, high = np.array([-1.0, -2.0, 0.5]), np.array([1.0, 0.5, 0.5])
    best, where = greatest_in_box(rows, low, high, inertia)
    grid = np.array(list(product(np.linspace(-1.0, 1.0, 81), np.linspace(-2.0, 0.5, 101), [0.5])))
    sampled = (com_features(grid, inertia) @ rows.T).max(axis=0)
    assert (best >= sampled - 1e-12).all()
    assert (best - sampled).max() < 1e-2
    assert ((where >= low) & (where <= high)).all()
    own = (com_features(where, inertia) * rows).sum(axis=1)
    np.testing.assert_allclose(own, best, rtol=1e-12, atol=1e-12)


@pytest.mark.thinned(4)
@pytest.mark.parametrize("name", ROBOTS)
@every_com_model
def test_robust_capacity_is_where_the_worst_case_uses_a_limit_up(name, model):
    rng, positive = np.random.default_rng(5), 0
    for _ in range(10):
        effort = random_effort(name, rng, speed=0.3, model=model)[1]
        found = robust_capacity(effort, com=BOX)
        if np.isnan(found.upper):
            continue
        positive += 1
        worst = worst_case(effort, mass=(found.lower, found.upper), com=BOX)
        assert worst.used == pytest.approx(1.0, abs=1e-12)
        assert worst.joint == found.joint
        assert not worst_case(effort, mass=(0.0, 1.001 * found.upper), com=BOX).feasible
        each = effort.mass_range(np.array([found.com]))
        assert each.upper[0] == pytest.approx(found.upper, rel=1e-12)
        sampled = effort.mass_range(rng.uniform(*BOX, (500, 3)))
        assert sampled.upper.min() >= found.upper * (1.0 - 1e-12)
        assert sampled.lower.max() <= found.lower + 1e-12
    assert positive > 3


def test_a_box_of_one_point_is_that_point():
    effort = random_effort("ur5", np.random.default_rng(6), speed=0.5)[1]
    at = np.array([0.05, -0.03, 0.1])
    found, exact = robust_capacity(effort, com=[at, at]), effort.mass_range(at[None])
    assert found.upper == pytest.approx(exact.upper[0], rel=1e-12)
    assert found.joint == ROBOTS["ur5"].joint_names[exact.joint[0]]
    assert found.time == exact.time[0]
    assert found.com == tuple(at)


def test_a_wider_box_never_carries_more():
    effort = random_effort("ur5", np.random.default_rng(7), speed=0.5)[1]
    masses = [robust_capacity(effort, com=[[-w] * 3, [w] * 3]).upper for w in np.linspace(0.0, 0.3, 7)]
    assert (np.diff(masses) < 0.0).all()


def test_bad_input_is_refused():
    effort = random_effort("ur5", np.random.default_rng(8))[1]
    refused(lambda: robust_capacity(effort, com=BOX[::-1]), "^com: expected the least before the greatest")
    refused(lambda: robust_capacity(effort, com=BOX[0]), r"^com: expected shape \(2, 3\)")
    refused(lambda: worst_case(effort, mass=(3.0, 1.0), com=BOX), "^mass: expected the least before the greatest")
    refused(lambda: worst_case(effort, mass=(-1.0, 1.0), com=BOX), "^mass: expected masses from 0 on")
    refused(lambda: worst_case(effort, mass=1.0, com=BOX), r"^mass: expected shape \(2\)")
    refused(lambda: worst_case(effort, mass=(1.0, np.nan), com=BOX), "^mass: expected finite")
