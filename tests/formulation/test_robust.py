"""Effort limits for payloads of intervals: against payloads one by one, against `worst_case`, and their gradients."""

import pickle
from itertools import product

import numpy as np
import pytest

from tests.capacity.test_payload_effort import ROBOTS, every_com_model, random_motion
from tests.helpers import mostly_long, refused
from trajevo import Payload, PolynomialBatch
from trajevo.base.intervals import greatest_quadratic
from trajevo.capacity.payload_effort import payload_effort
from trajevo.capacity.robust import worst_case
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.formulation.constraints.joint_limits import effort_limits
from trajevo.formulation.constraints.robust import robust_effort_limits
from trajevo.robot.payload import com_features

BOX = np.array([[-0.1, -0.05, 0.0], [0.15, 0.05, 0.2]])
MASSES = (1.0, 3.0)
INERTIA = ((0.02, 0.001, 0.0), (0.001, 0.03, 0.0), (0.0, 0.0, 0.04))


def random_rollout(name, rng, *, speed, model="rigid", motions=4) -> Rollout:
    """Several motions of a robot, 6 samples in each of 2 segments."""
    drawn = [random_motion(ROBOTS[name], rng, speed=speed) for _ in range(motions)]
    batch = PolynomialBatch(
        *(np.concatenate([getattr(one, key) for one in drawn]) for key in ("breaks", "coefficients"))
    )
    return Rollout(Dynamics(ROBOTS[name], Payload(1.0, (0.3, 0.0, 0.0), model=model)), batch)


@pytest.mark.thinned(4)
@pytest.mark.parametrize("name", ROBOTS)
@every_com_model
def test_excess_is_that_of_the_worst_of_all_payloads(name, model):
    rng = np.random.default_rng(1)
    limit = ROBOTS[name].limits.effort
    for speed in (0.1, 1.0, 5.0):
        rollout = random_rollout(name, rng, speed=speed, model=model)
        found = robust_effort_limits(rollout.dynamics, mass=MASSES, com=BOX).function(rollout)
        masses, com = rng.uniform(*MASSES, 4000), rng.uniform(*BOX, (4000, 3))
        corners = np.array(list(product(MASSES, *BOX.T)))
        masses, com = np.append(masses, corners[:, 0]), np.concatenate([com, corners[:, 1:]])
        for i in range(len(found)):
            effort = payload_effort(Rollout(rollout.dynamics, rollout.trajectory[i]), samples=6)
            slopes = effort.slopes @ com_features(com, effort.inertia).T
            every = np.abs(effort.base[..., None] + masses * slopes).max(axis=(0, 2)) / limit - 1.0
            assert (every <= found[i] + 1e-11 * (1.0 + np.abs(found[i]))).all()
            if model == "weight_only":
                np.testing.assert_allclose(every, found[i], rtol=1e-10, atol=1e-10)
            worst = worst_case(effort, mass=MASSES, com=BOX)
            assert found[i].max() == pytest.approx(worst.used - 1.0, rel=1e-10, abs=1e-10)
            assert found[i].argmax() == ROBOTS[name].joint_names.index(worst.joint)


def test_it_is_attained_by_a_robot_that_carries_the_worst_payload():
    rollout = random_rollout("ur5", np.random.default_rng(2), speed=1.0, motions=1)
    found = robust_effort_limits(rollout.dynamics, mass=MASSES, com=BOX).function(rollout)
    worst = worst_case(payload_effort(rollout, samples=6), mass=MASSES, com=BOX)
    loaded = Rollout(Dynamics(rollout.robot, Payload(worst.mass, worst.com)), rollout.trajectory)
    assert effort_limits(rollout.robot).function(loaded).max() == pytest.approx(found.max(), rel=1e-10)


def test_columns_are_the_greatest_of_their_terms():
    rollout = random_rollout("hybrid_manipulator", np.random.default_rng(3), speed=1.0)
    limits = robust_effort_limits(rollout.dynamics, mass=MASSES, com=BOX, margin=0.1)
    assert limits.names == effort_limits(rollout.robot).names
    terms = limits.terms(rollout)
    assert terms.shape == (4, 12 * 5 * 2)
    columns = limits.function(rollout)
    np.testing.assert_array_equal(terms.reshape(4, 12, 5, 2).max(axis=(1, 3)), columns)
    whole = robust_effort_limits(rollout.dynamics, mass=MASSES, com=BOX).function(rollout)
    np.testing.assert_allclose(0.9 * (columns + 1.0), whole + 1.0, rtol=1e-12)


@every_com_model
def test_intervals_without_width_are_the_ordinary_limits(model):
    at, inertia = (0.05, -0.02, 0.1), INERTIA if model == "rigid" else None
    rollout = random_rollout("ur5", np.random.default_rng(4), speed=2.0, model=model)
    carrying = Dynamics(rollout.robot, Payload(2.0, at, inertia, model))
    ordinary = effort_limits(rollout.robot).function(Rollout(carrying, rollout.trajectory))
    robust = robust_effort_limits(carrying, mass=(2.0, 2.0), com=[at, at])
    np.testing.assert_allclose(robust.function(rollout), ordinary, rtol=1e-11, atol=1e-11)
    almost = robust_effort_limits(carrying, mass=(2.0, 2.0), com=[at, np.array(at) + 1e-12])
    np.testing.assert_allclose(almost.function(rollout), ordinary, rtol=1e-9, atol=1e-9)


@every_com_model
def test_no_mass_is_no_payload_to_the_bit(model):
    rollout = random_rollout("ur5", np.random.default_rng(5), speed=2.0, model=model)
    nothing = effort_limits(rollout.robot).function(Rollout(Dynamics(rollout.robot), rollout.trajectory))
    for payload in (Payload(0.0, model=model), Payload(3.0, model=model)):
        limits = robust_effort_limits(Dynamics(rollout.robot, payload), mass=(0.0, 0.0), com=BOX)
        np.testing.assert_array_equal(limits.function(rollout), nothing)


def test_the_payload_gives_its_inertia_per_kilogram():
    rollout = random_rollout("panda", np.random.default_rng(6), speed=3.0)
    inertia = tuple(tuple(2.0 * entry for entry in row) for row in INERTIA)
    twice, once = (Dynamics(rollout.robot, Payload(m, (1.0, 0.0, 0.0), i)) for m, i in ((2.0, inertia), (1.0, INERTIA)))
    by_both = [robust_effort_limits(own, mass=MASSES, com=BOX).function(rollout) for own in (twice, once)]
    np.testing.assert_array_equal(*by_both)
    point = robust_effort_limits(rollout.dynamics, mass=MASSES, com=BOX).function(rollout)
    assert np.abs(by_both[0] - point).max() > 1e-3


@pytest.mark.parametrize("name", mostly_long(ROBOTS, "ur5"))
@every_com_model
def test_no_bit_depends_on_the_batch(name, model):
    rollout = random_rollout(name, np.random.default_rng(7), speed=3.0, model=model, motions=9)
    for width in (0.1, 1.0):  # few and many turning points inside
        limits = robust_effort_limits(rollout.dynamics, mass=MASSES, com=[[-width] * 3, [width] * 3])
        whole, terms = limits.function(rollout), limits.terms(rollout)
        for size in (1, 2, 4):
            parts = [Rollout(rollout.dynamics, rollout.trajectory[k : k + size]) for k in range(0, 9, size)]
            np.testing.assert_array_equal(np.concatenate([limits.function(part) for part in parts]), whole)
            np.testing.assert_array_equal(np.concatenate([limits.terms(part) for part in parts]), terms)
        copied = pickle.loads(pickle.dumps(limits))
        np.testing.assert_array_equal(copied.function(rollout), whole)


@pytest.mark.thinned(3)
@pytest.mark.parametrize("count", mostly_long([60, 300], 60))
@pytest.mark.parametrize("axes", [0, 1, 2, 3])
def test_greatest_quadratic_of_random_forms(axes, count):
    """Against a grid; the value of a complex form is that of the real one, its imaginary part the derivative."""
    rng = np.random.default_rng(9)
    a, b, Q = rng.normal(size=count), rng.normal(size=(count, axes)), rng.normal(size=(count, axes, axes))
    Q = (Q + np.swapaxes(Q, 1, 2)) * rng.choice([0.05, 1.0], (count, 1, 1))
    low, high = np.array([-1.0, 0.5, -2.0])[:axes], np.array([1.0, 0.5, 0.5])[:axes]
    best, where = greatest_quadratic(a, b, Q, low, high)
    grid = np.array(list(product(*(np.linspace(*ends, 41) for ends in zip(low, high, strict=True))))).reshape(
        -1 if axes else 1, axes
    )
    every = a[:, None] + b @ grid.T + np.einsum("gi,rij,gj->rg", grid, Q, grid)
    assert (best >= every.max(axis=1) - 1e-12).all()
    assert (best - every.max(axis=1)).max() < 0.02
    assert ((where >= low) & (where <= high)).all()
    da, db = rng.normal(size=count), rng.normal(size=(count, axes))
    stepped = greatest_quadratic(a + 1e-20j * da, b + 1e-20j * db, Q, low, high)[0]
    np.testing.assert_array_equal(stepped.real, best)
    ahead, behind = (greatest_quadratic(a + s * da, b + s * db, Q, low, high)[0] for s in (1e-7, -1e-7))
    np.testing.assert_allclose(stepped.imag / 1e-20, (ahead - behind) / 2e-7, rtol=1e-4, atol=1e-4)


def test_bad_input_is_refused():
    dynamics = random_rollout("ur5", np.random.default_rng(10), speed=1.0).dynamics
    for mass, says in (((3.0, 1.0), "least before the greatest"), ((-1.0, 1.0), "from 0 on"), (1.0, r"shape \(2\)")):
        refused(lambda mass=mass: robust_effort_limits(dynamics, mass=mass, com=BOX), f"^mass: expected .*{says}")
    refused(lambda: robust_effort_limits(dynamics, mass=MASSES, com=BOX[::-1]), "^com: expected the least before")
    refused(lambda: robust_effort_limits(dynamics, mass=MASSES, com=[BOX]), r"^com: expected shape \(2, 3\)")
    refused(lambda: robust_effort_limits(dynamics, mass=MASSES, com=BOX, margin=1.0), "^effort_margin: expected")
    axial = Dynamics(dynamics.robot, Payload(1.0, model="tool_axis"))
    refused(lambda: robust_effort_limits(axial, mass=MASSES, com=BOX), "'tool_axis' acts at the tool's origin")
