"""Effort for every payload at once: against Pinocchio with the payload attached, masses against bisection."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from tests.guo2016 import TABLE_7
from tests.helpers import mostly_long, refused
from trajevo import Payload, PolynomialBatch, load_robot, optimise
from trajevo.capacity.dlcc import dlcc_sampled
from trajevo.capacity.payload_effort import payload_effort
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.problems import HybridManipulator
from trajevo.robot.payload import PARAMETERS, com_features, entries_of, quadratic_forms, tensor_of, tool_regressor

FREE = {"acceleration": np.inf, "jerk": np.inf}
ROBOTS = {
    "ur5": load_robot("ur5", limits=FREE, tool="tool0"),
    "panda": load_robot(
        "panda", limits=FREE, tool="panda_hand", lock={"panda_finger_joint1": 0.0, "panda_finger_joint2": 0.0}
    ),
    "hybrid_manipulator": load_robot("hybrid_manipulator"),
}
every_robot = pytest.mark.parametrize("name", mostly_long(ROBOTS, *[*ROBOTS][::2]))
COM_MODELS = ("rigid", "weight_only")
every_com_model = pytest.mark.parametrize("model", COM_MODELS)


def random_motion(robot, rng, *, speed=1.0, segments=2) -> PolynomialBatch:
    """One motion of cubics that need not meet: what is asked here holds at every instant by itself."""
    low, high = (np.clip(x, -1.5, 1.5) for x in (robot.limits.lower, robot.limits.upper))
    coefficients = rng.normal(scale=0.5 * speed, size=(1, segments, robot.dof, 4))
    coefficients[..., 0] = rng.uniform(low, high, (segments, robot.dof))
    return PolynomialBatch(np.arange(segments + 1.0)[None], coefficients)


def random_effort(name, rng, *, speed=1.0, model="rigid", samples=6, inertia=None):
    robot = ROBOTS[name]
    dynamics = Dynamics(robot, Payload(1.0, inertia=inertia, model=model))
    rollout = Rollout(dynamics, random_motion(robot, rng, speed=speed))
    return rollout, payload_effort(rollout, samples=samples)


@every_robot
@every_com_model
def test_effort_is_that_of_the_payload_attached(name, model):
    rng = np.random.default_rng(1)
    for _ in range(20):
        mass, com = rng.uniform(0.1, 8.0), tuple(rng.uniform(-0.4, 0.4, 3))
        half = rng.normal(size=(3, 3)) * 0.1
        spread = half @ half.T * mass  # Σ m r rᵀ of a body: its inertia obeys the triangle inequality
        inertia = np.trace(spread) * np.eye(3) - spread if model == "rigid" else None
        payload = Payload(mass, com, inertia, model)
        rollout, effort = random_effort(name, rng, model=model)
        attached = Rollout(Dynamics(ROBOTS[name], payload), rollout.trajectory).effort[0]
        np.testing.assert_allclose(effort.effort(payload), attached, rtol=1e-9, atol=1e-9)


@every_robot
def test_no_payload_changes_nothing_to_the_bit(name):
    rollout, effort = random_effort(name, np.random.default_rng(2))
    for com in ((0.0, 0.0, 0.0), (0.3, -0.2, 0.1)):
        unloaded = Rollout(Dynamics(ROBOTS[name], Payload(0.0, com)), rollout.trajectory).effort[0]
        assert (effort.effort(Payload(0.0, com)) == unloaded).all()
        assert (effort.base == unloaded).all()


@every_robot
def test_regressor_is_that_of_unit_bodies(name):
    """The mass and the moments of inertia by a body of that alone on a robot without mass."""
    robot, rng = ROBOTS[name], np.random.default_rng(3)
    q, v, a = rng.normal(size=(3, 5, robot.dof))
    found = tool_regressor(robot, q, v, a)
    assert found.shape == (5, robot.dof, len(PARAMETERS))
    bodies = {0: pin.Inertia(1.0, np.zeros(3), np.zeros((3, 3)))}
    bodies |= {k: pin.Inertia(0.0, np.zeros(3), tensor_of(np.eye(6)[k - 4])) for k in range(4, 10)}
    for k, body in bodies.items():
        model = robot.model.copy()
        for joint in range(model.njoints):
            model.inertias[joint] = pin.Inertia.Zero()
        frame = model.frames[model.getFrameId(robot.tool)]
        model.appendBodyToJoint(frame.parentJoint, body, frame.placement)
        data = model.createData()
        expected = [pin.rnea(model, data, *state) for state in zip(q, v, a, strict=True)]
        np.testing.assert_allclose(found[..., k], expected, rtol=1e-9, atol=1e-11)


@every_robot
@every_com_model
def test_capacity_where_nothing_is_broken_without_payload(name, model):
    rng, positive = np.random.default_rng(4), 0
    for _ in range(20):
        rollout, effort = random_effort(name, rng, speed=0.5, model=model, samples=6)
        found, expected = effort.mass_range(np.zeros((1, 3))), dlcc_sampled(rollout, samples=6)
        if expected.mass > 0.0:
            positive += 1
            assert found.lower[0] == 0.0
            assert found.upper[0] == pytest.approx(expected.mass, rel=1e-12)
            assert ROBOTS[name].joint_names[found.joint[0]] == expected.joint
            assert found.time[0] == expected.time
    assert positive > 0


def still(robot, q) -> PolynomialBatch:
    coefficients = np.zeros((1, 1, robot.dof, 2))
    coefficients[0, 0, :, 0] = q
    return PolynomialBatch(np.array([[0.0, 1.0]]), coefficients)


def test_a_counterweight_is_an_interval_and_not_only_its_top():
    """A limit below what the arm itself weighs at one joint: only a payload behind it brings the effort back."""
    robot = ROBOTS["ur5"]
    rollout = Rollout(Dynamics(robot, Payload(1.0)), still(robot, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
    base = payload_effort(rollout).base[0]
    limits = np.full(6, np.inf)
    limits[1] = 0.8 * abs(base[1])
    held = replace(robot, limits=replace(robot.limits, effort=limits))
    rollout = Rollout(Dynamics(held, Payload(1.0)), rollout.trajectory)
    effort = payload_effort(rollout, samples=2)
    slope = effort.slopes[0, 1]
    direction = -np.sign(base[1]) * slope[1:4]
    com = 1.9 * direction / np.linalg.norm(direction)
    found = effort.mass_range(com[None])
    per_kilogram = float((slope @ com_features(com[None], np.zeros((3, 3)))[0]) * np.sign(base[1]))
    assert per_kilogram < 0.0
    assert found.lower[0] == pytest.approx(0.2 * abs(base[1]) / -per_kilogram, rel=1e-9)
    assert found.upper[0] == pytest.approx(1.8 * abs(base[1]) / -per_kilogram, rel=1e-9)
    for mass, keeps in (
        (0.0, False),
        (0.999 * found.lower[0], False),
        (1.001 * found.lower[0], True),
        (0.999 * found.upper[0], True),
        (1.001 * found.upper[0], False),
    ):
        used = np.abs(effort.effort(Payload(mass, tuple(com)))) / limits
        assert (used.max() <= 1.0) == keeps
    assert dlcc_sampled(rollout).mass == 0.0
    in_front = effort.mass_range(-com[None])
    assert np.isnan(in_front.lower[0])
    assert np.isnan(in_front.upper[0])
    assert in_front.joint[0] == -1


def test_a_joint_at_its_limit_without_payload_leaves_nothing_that_loads_it():
    robot = ROBOTS["ur5"]
    trajectory = still(robot, np.zeros(6))
    base = payload_effort(Rollout(Dynamics(robot, Payload(1.0)), trajectory)).base[0]
    limits = np.full(6, np.inf)
    limits[1] = abs(base[1])
    held = replace(robot, limits=replace(robot.limits, effort=limits))
    effort = payload_effort(Rollout(Dynamics(held, Payload(1.0)), trajectory), samples=2)
    found = effort.mass_range(np.zeros((1, 3)))
    assert (found.lower[0], found.joint[0]) == (0.0, 1)
    assert found.upper[0] < 1e-100


@every_robot
@every_com_model
def test_used_is_the_effort_over_its_limit(name, model):
    rng = np.random.default_rng(11)
    for _ in range(5):
        effort = random_effort(name, rng, speed=0.5, model=model)[1]
        com = rng.uniform(-0.3, 0.3, (7, 3))
        found, masses = effort.used(1.5, com), effort.mass_range(com)
        limit = effort.robot.limits.effort
        for at, used in zip(com, found, strict=True):
            expected = np.abs(effort.effort(Payload(1.5, tuple(at), model=model)) / limit).max()
            assert used == pytest.approx(expected, rel=1e-9)
        assert ((found <= 1.0) == ((masses.lower <= 1.5) & (masses.upper >= 1.5))).all()


def test_what_no_joint_feels_is_unlimited():
    limits = np.array([150.0, *[np.inf] * 5])
    held = replace(ROBOTS["ur5"], limits=replace(ROBOTS["ur5"].limits, effort=limits))
    effort = payload_effort(Rollout(Dynamics(held, Payload(1.0)), still(held, np.full(6, 0.3))))
    found = effort.mass_range([[0.1, 0.2, 0.3]])
    assert (found.lower[0], found.upper[0], found.joint[0]) == (0.0, np.inf, -1)
    assert np.isnan(found.time[0])


def test_quadratic_forms_are_the_features():
    rng = np.random.default_rng(5)
    rows, com, half = rng.normal(size=(7, 10)), rng.normal(size=(11, 3)), rng.normal(size=(3, 3))
    inertia = half @ half.T
    a, b, Q = quadratic_forms(rows, inertia)
    expected = com_features(com, inertia) @ rows.T
    found = a + com @ b.T + np.einsum("pi,rij,pj->pr", com, Q, com)
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(tensor_of(entries_of(inertia)), inertia, rtol=1e-15)


def test_inertia_about_the_tool_makes_effort_affine():
    rng = np.random.default_rng(6)
    rollout, effort = random_effort("ur5", rng)
    about_tool = np.diag([0.03, 0.04, 0.05])
    fixed = effort.with_inertia_about_tool(about_tool)
    assert fixed.affine
    assert not effort.affine
    com, mass = np.array([0.05, 0.02, -0.03]), 2.0
    own = about_tool - mass * (com @ com * np.eye(3) - np.outer(com, com))
    attached = Rollout(Dynamics(ROBOTS["ur5"], Payload(mass, tuple(com), own)), rollout.trajectory).effort[0]
    found = fixed.base + fixed.slopes @ (mass * com_features(com[None], np.zeros((3, 3)))[0])
    np.testing.assert_allclose(found, attached, rtol=1e-9, atol=1e-9)


def test_motions_of_every_kind():
    problem = HybridManipulator()
    both = problem.rollout(np.stack([TABLE_7, 0.7 * TABLE_7]))
    assert (payload_effort(both).base == payload_effort(problem.rollout(TABLE_7)).base).all()
    front = optimise(problem, seed=1, generations=5, population=12, progress=False, polish=False)
    if len(front):
        assert payload_effort(front.knee(), samples=4).slopes.shape[1:] == (5, 10)


def test_results_are_read_only():
    effort = random_effort("ur5", np.random.default_rng(7))[1]
    found = effort.mass_range([[0.0, 0.0, 0.0]])
    for array in (effort.base, effort.slopes, effort.times, found.lower, found.upper, found.joint, found.time):
        assert not array.flags.writeable


def test_bad_input_is_refused():
    rng = np.random.default_rng(8)
    rollout, effort = random_effort("ur5", rng)
    refused(lambda: payload_effort("motion"), "^motion: expected")
    refused(lambda: payload_effort(rollout, samples=1), "^samples: expected")
    refused(lambda: effort.mass_range([0.0, 0.0, 0.0]), r"^com: expected shape \(P, 3\), got \(3,\)")
    refused(lambda: effort.mass_range([[0.0, np.nan, 0.0]]), "^com: expected finite")
    refused(lambda: effort.effort(Payload(1.0, model="weight_only")), "^payload.model: expected 'rigid'")
    refused(lambda: effort.with_inertia_about_tool(-np.eye(3)), "^inertia: expected a symmetric tensor")
    weight = random_effort("ur5", rng, model="weight_only")[1]
    refused(lambda: weight.with_inertia_about_tool(np.eye(3)), "^inertia: the model 'weight_only' has no inertia")
    axial = Rollout(Dynamics(ROBOTS["ur5"], Payload(1.0, model="tool_axis")), rollout.trajectory)
    refused(lambda: payload_effort(axial), "^payload.model: 'tool_axis' acts at the tool's origin")
    unlimited = replace(ROBOTS["ur5"], limits=replace(ROBOTS["ur5"].limits, effort=np.full(6, np.inf)))
    boundless = payload_effort(Rollout(Dynamics(unlimited, Payload(1.0)), rollout.trajectory))
    refused(lambda: boundless.mass_range([[0.0, 0.0, 0.0]]), "has no effort limits, so nothing bounds its payload")
