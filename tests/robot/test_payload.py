"""Payloads: what they add, that they add nothing at 0 kg, that they leave the robot alone, and what is refused."""

import json
from dataclasses import FrozenInstanceError

import numpy as np
import pytest

from tests.dynamics.test_inverse_dynamics import random_states
from trajevo import load_robot
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.errors import InvalidInputError, UnknownNameError
from trajevo.problems import HybridManipulator
from trajevo.problems.hybrid_kinematics import forward_kinematics
from trajevo.robot.payload import LOAD_MODELS, Payload, carrying, kilogram, massless, probe

HYBRID = load_robot("hybrid_manipulator")
POINTING = load_robot("pointing_mechanism")
COM = (0.02, -0.05, 0.1)
INERTIA = ((0.3, 0.01, 0.0), (0.01, 0.2, 0.02), (0.0, 0.02, 0.25))
SHAPES = {
    "rigid": Payload(4.0),
    "rigid off centre": Payload(4.0, COM),
    "rigid body": Payload(4.0, COM, INERTIA),
    "weight_only": Payload(4.0, model="weight_only"),
    "weight_only off centre": Payload(4.0, COM, model="weight_only"),
    "tool_axis": Payload(4.0, model="tool_axis"),
}
every_shape = pytest.mark.parametrize("payload", SHAPES.values(), ids=SHAPES)
every_robot = pytest.mark.parametrize("robot", [POINTING, HYBRID], ids=lambda robot: robot.name)


def everything_in(model):
    """All numbers of a Pinocchio model that a payload could change."""
    inertias = [np.concatenate([[i.mass], i.lever, i.inertia.ravel()]) for i in model.inertias]
    placements = [np.asarray(p.homogeneous) for p in model.jointPlacements]
    sizes = [model.njoints, model.nq, model.nv, model.nframes]
    return np.concatenate([np.ravel(x) for x in (*inertias, *placements, sizes, model.gravity.vector)])


@every_robot
@every_shape
def test_no_mass_changes_nothing_to_the_bit(robot, payload):
    states = random_states(robot, 40)
    bare = Dynamics(robot).effort(*states)
    assert (Dynamics(robot, payload.with_mass(0.0)).effort(*states) == bare).all()
    assert (Dynamics(robot, Payload(0, model=payload.model)).effort(*states) == bare).all()
    assert (Dynamics(robot, payload).unloaded_effort(*states) == bare).all()


@pytest.mark.parametrize("model", LOAD_MODELS)
def test_no_mass_changes_no_evaluation(model):
    h = np.random.default_rng(0).uniform(0.2, 1.2, (5, 12))
    bare = HybridManipulator(payload=0.0, convention="continuous").evaluate(h)
    loaded = HybridManipulator(payload=0.0, convention="continuous", payload_model=model).evaluate(h)
    for a, b in zip(bare, loaded, strict=True):
        np.testing.assert_array_equal(a, b)


@every_robot
@every_shape
def test_the_robot_is_never_modified(robot, payload):
    before, q = everything_in(robot.model), random_states(robot, 5)
    dynamics = Dynamics(robot, payload)
    dynamics.effort(*q)
    dynamics.unloaded_effort(*q)
    dynamics.effort_per_kilogram(*q)
    dynamics.effort(*(x + 1e-20j for x in q))
    for make in (lambda: carrying(robot, payload), lambda: kilogram(robot, payload), lambda: massless(robot)):
        make()
    probe(robot)
    np.testing.assert_array_equal(everything_in(robot.model), before)


@every_robot
@every_shape
def test_effort_is_affine_in_the_mass(robot, payload):
    states = random_states(robot, 60)
    per_kilogram = Dynamics(robot, payload).effort_per_kilogram(*states)
    bare = Dynamics(robot, payload).unloaded_effort(*states)
    for mass in (0.5, 3.0, 40.0):
        effort = Dynamics(robot, payload.with_mass(mass)).effort(*states)
        scale = np.abs(effort).max()
        np.testing.assert_allclose(effort, bare + mass * per_kilogram, rtol=0.0, atol=1e-12 * scale)


@every_robot
@pytest.mark.parametrize("com", [(0.0, 0.0, 0.0), COM])
def test_weight_only_is_the_static_load_of_the_rigid_one(robot, com):
    q, v, a = random_states(robot, 60)
    still = np.zeros_like(q)
    static = Dynamics(robot, Payload(1.0, com)).effort_per_kilogram(q, still, still)
    moving = Dynamics(robot, Payload(6.0, com, model="weight_only"))
    np.testing.assert_array_equal(moving.effort_per_kilogram(q, v, a), static)
    expected = moving.unloaded_effort(q, v, a) + 6.0 * static  # two passes; effort takes one, hence other roundings
    np.testing.assert_allclose(moving.effort(q, v, a), expected, rtol=0.0, atol=1e-13 * np.abs(expected).max())
    assert np.abs(Dynamics(robot, Payload(1.0, com)).effort_per_kilogram(q, v, a) - static).max() > 1e-3


def jacobian(q, step=1e-6):
    """d position / d q of the closed-form kinematics, (K, 3, 5), by central differences."""
    columns = []
    for joint in range(5):
        move = np.zeros(5)
        move[joint] = step
        columns.append((forward_kinematics(q + move)[0] - forward_kinematics(q - move)[0]) / (2.0 * step))
    return np.stack(columns, axis=-1)


def test_tool_axis_is_a_force_along_the_tool():
    q, v, a = random_states(HYBRID, 100)
    axis = forward_kinematics(q)[1]
    expected = -9.80665 * np.einsum("kij,ki->kj", jacobian(q), axis)
    per_kilogram = Dynamics(HYBRID, SHAPES["tool_axis"]).effort_per_kilogram(q, v, a)
    np.testing.assert_allclose(per_kilogram, expected, rtol=0.0, atol=1e-7)


def test_weight_only_is_a_vertical_force_at_the_tool():
    q, v, a = random_states(HYBRID, 100)
    expected = -9.80665 * jacobian(q)[:, 2]  # z₀ points down
    per_kilogram = Dynamics(HYBRID, SHAPES["weight_only"]).effort_per_kilogram(q, v, a)
    np.testing.assert_allclose(per_kilogram, expected, rtol=0.0, atol=1e-7)


def test_inertia_alone_acts_on_rotation():
    q, v, a = random_states(HYBRID, 30)
    point, body = (Dynamics(HYBRID, Payload(1.0, COM, inertia)).effort(q, v, a) for inertia in (None, INERTIA))
    difference = body - point
    np.testing.assert_allclose(difference[:, 2], 0.0, atol=1e-9)  # the third screw does not turn it
    assert np.abs(difference[:, 4]).max() > 0.1


@pytest.mark.parametrize(
    "mass", [-1.0, -1e-300, float("nan"), float("inf"), -float("inf"), "10", None, [1.0], 1 + 1j], ids=str
)
@pytest.mark.parametrize("model", LOAD_MODELS)
def test_bad_masses_are_refused(mass, model):
    with pytest.raises(InvalidInputError, match=r"payload\.mass"):
        Payload(mass, model=model)


@pytest.mark.parametrize(
    "com", [(0.0, 0.0), (0.0, 0.0, float("nan")), "xyz", 0.1, ((0.0, 0.0, 0.0),), (0.0, 0.0, None)]
)
def test_bad_centres_of_mass_are_refused(com):
    with pytest.raises(InvalidInputError, match=r"payload\.com"):
        Payload(1.0, com)


@pytest.mark.parametrize(
    "inertia",
    [
        ((1.0, 0.5, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),  # asymmetric
        ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 2.5)),  # triangle inequality
        ((-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
        ((1.0, 0.0), (0.0, 1.0)),
        (1.0, 1.0, 1.0),
        ((float("nan"), 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
        "round",
    ],
)
def test_bad_inertias_are_refused(inertia):
    with pytest.raises(InvalidInputError, match=r"payload\.inertia"):
        Payload(1.0, inertia=inertia)


@pytest.mark.parametrize("moments", [(1.0, 1.0, 2.0), (0.0, 1.0, 1.0), (1.0, 1.0, 1.0), (1e-6, 1e-6, 1e-6)])
def test_bodies_at_the_edge_of_the_triangle_inequality_are_taken(moments):
    assert Payload(1.0, inertia=np.diag(moments)).inertia == tuple(map(tuple, np.diag(moments).tolist()))


def test_inertia_without_mass_is_refused():
    with pytest.raises(InvalidInputError, match="without mass"):
        Payload(0.0, inertia=INERTIA)


@pytest.mark.parametrize("model", ["weight_only", "tool_axis"])
def test_inertia_is_refused_for_forces(model):
    with pytest.raises(InvalidInputError, match=rf"payload\.inertia.*{model}"):
        Payload(1.0, inertia=INERTIA, model=model)


def test_centre_of_mass_is_refused_for_the_tool_axis():
    with pytest.raises(InvalidInputError, match=r"payload\.com.*tool_axis"):
        Payload(1.0, COM, model="tool_axis")


def test_unknown_model_lists_the_known_ones():
    with pytest.raises(UnknownNameError, match="'magnet'.*rigid, tool_axis, weight_only"):
        Payload(1.0, model="magnet")


def test_with_mass_scales_the_inertia():
    heavier = SHAPES["rigid body"].with_mass(10.0)
    assert (heavier.mass, heavier.com, heavier.model) == (10.0, COM, "rigid")
    np.testing.assert_allclose(heavier.inertia, 2.5 * np.array(INERTIA), rtol=1e-15)
    np.testing.assert_allclose(heavier.with_mass(4.0).inertia, INERTIA, rtol=1e-15)
    assert SHAPES["rigid body"].with_mass(0.0).inertia is None
    assert SHAPES["rigid off centre"].with_mass(1.0) == Payload(1.0, COM)
    for shape in SHAPES.values():
        assert shape.with_mass(9.0).model == shape.model
        with pytest.raises(InvalidInputError, match=r"payload\.(mass|inertia)"):
            shape.with_mass(-1.0)
        with pytest.raises(InvalidInputError, match=r"payload\.(mass|inertia)"):
            shape.with_mass(float("nan"))


@every_shape
def test_settings_make_an_equal_payload_through_json(payload):
    again = Payload(**json.loads(json.dumps(payload.settings)))
    assert again == payload
    assert hash(again) == hash(payload)
    assert Payload.of(json.loads(json.dumps(payload.settings)), model=None) == payload


def test_payload_from_what_a_caller_passes():
    assert Payload.of(3, model="weight_only") == Payload(3.0, model="weight_only")
    assert Payload.of(3, model=None, usual="tool_axis") == Payload(3.0, model="tool_axis")
    assert Payload.of(SHAPES["rigid body"], model=None) is SHAPES["rigid body"]
    assert Payload.of(Payload(3.0), model="weight_only") == Payload(3.0, model="weight_only")
    with pytest.raises(InvalidInputError, match="payload: expected mass, com, inertia and model"):
        Payload.of({"mas": 3}, model=None)
    with pytest.raises(InvalidInputError, match=r"payload\.mass"):
        Payload.of("ten", model="rigid")


def test_payload_is_frozen():
    with pytest.raises(FrozenInstanceError):
        SHAPES["rigid"].mass = 2.0
