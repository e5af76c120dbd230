"""Inverse dynamics: against the paper's recursion, stored states, energy, a loop of Pinocchio, and by property."""

import copy
import pickle
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from tests.guo2016 import GUO2016, TABLE_7, forces_along
from tests.helpers import forked
from trajevo import PolynomialBatch, TrajevoError, load_robot
from trajevo.base import jit
from trajevo.dynamics.integrals.nodes import lobatto
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.problems import HybridManipulator
from trajevo.robot.joints import Friction
from trajevo.robot.payload import Payload

HYBRID = load_robot("hybrid_manipulator")
POINTING = load_robot("pointing_mechanism")
PAYLOADS = {
    "none": Payload(0.0),
    "rigid": Payload(10.0),
    "rigid body": Payload(7.0, (0.02, -0.05, 0.1), ((0.3, 0.01, 0.0), (0.01, 0.2, 0.02), (0.0, 0.02, 0.25))),
    "weight_only": Payload(10.0, model="weight_only"),
    "weight_only off centre": Payload(10.0, (0.02, -0.05, 0.1), model="weight_only"),
    "tool_axis": Payload(10.0, model="tool_axis"),
}


def random_states(robot, count, seed=0):
    """Positions inside the range, speeds and accelerations up to the limits (1 where there is none)."""
    rng, limits = np.random.default_rng(seed), robot.limits
    lower, upper = np.maximum(limits.lower, -np.pi), np.minimum(limits.upper, np.pi)
    bounds = (np.where(np.isfinite(bound), bound, 1.0) for bound in (limits.velocity, limits.acceleration))
    return (
        rng.uniform(lower, upper, (count, robot.dof)),
        *(rng.uniform(-bound, bound, (count, robot.dof)) for bound in bounds),
    )


@pytest.mark.thinned(2)
@pytest.mark.parametrize(
    ("payload", "arguments"),
    [
        (Payload(0.0), {}),
        (Payload(10.0, model="weight_only"), {"payload": 10.0}),
        (Payload(10.0, model="tool_axis"), {"payload": 10.0, "along_tool_axis": True}),
    ],
)
def test_actuator_forces_equal_the_papers_recursion(payload, arguments):
    states = random_states(HYBRID, 200)
    np.testing.assert_allclose(
        Dynamics(HYBRID, payload).effort(*states), forces_along(*states, **arguments), rtol=0.0, atol=1e-9
    )


@pytest.mark.parametrize(
    ("key", "payload"),
    [
        ("U_no_payload", Payload(0.0)),
        ("U_rigid_point_payload_10kg", Payload(10.0)),
        ("U_weight_only_payload_10kg", Payload(10.0, model="weight_only")),
    ],
)
def test_actuator_forces_equal_stored_states(key, payload):
    q, v, a, expected = (np.array([state[name] for state in GUO2016["states"]]) for name in ("q", "v", "a", key))
    np.testing.assert_allclose(Dynamics(HYBRID, payload).effort(q, v, a), expected, rtol=0.0, atol=1e-8)


def swinging(t):
    """A smooth motion inside the range of the hybrid manipulator, with its first two derivatives."""
    rng = np.random.default_rng(7)
    middle = np.array([0.45, 0.5, 0.25, -0.8, 0.6])
    width = np.array([0.1, 0.1, 0.08, 0.6, 0.5])
    rate, phase = rng.uniform(0.8, 2.0, 5), rng.uniform(0.0, 6.0, 5)
    angle = np.multiply.outer(t, rate) + phase
    return (
        middle + width * np.sin(angle),
        width * rate * np.cos(angle),
        -width * rate**2 * np.sin(angle),
    )


@pytest.mark.parametrize("mass", [0.0, 10.0])
def test_power_equals_the_rate_of_energy(mass):
    model = HYBRID.model.copy()
    if mass:
        frame = model.frames[model.getFrameId(HYBRID.tool)]
        model.appendBodyToJoint(frame.parentJoint, pin.Inertia(mass, np.zeros(3), np.zeros((3, 3))), frame.placement)
    data = model.createData()

    def energy(t):
        q, v, _ = HYBRID.transmission.motion(*swinging(t))
        return pin.computeKineticEnergy(model, data, q, v) + pin.computePotentialEnergy(model, data, q)

    instants, step = np.linspace(0.0, 5.0, 40), 2e-3
    q, v, a = swinging(instants)
    power = (Dynamics(HYBRID, Payload(mass)).effort(q, v, a) * v).sum(axis=1)
    # five-point central difference, so that rounding and truncation are both far below 1e-6
    weights = {-2: 1.0, -1: -8.0, 1: 8.0, 2: -1.0}
    rate = [sum(w * energy(t + k * step) for k, w in weights.items()) / (12.0 * step) for t in instants]
    np.testing.assert_allclose(power, rate, rtol=0.0, atol=1e-6 * np.abs(power).max())


@pytest.mark.parametrize("compiles", [True, False])
def test_a_batch_equals_a_loop_of_pinocchio(compiles, monkeypatch):
    if not compiles:
        monkeypatch.setattr(jit, "can_compile", lambda: False)
    q, v, a = random_states(POINTING, 120)
    data = POINTING.model.createData()
    loop = np.array([pin.rnea(POINTING.model, data, *row).copy() for row in zip(q, v, a, strict=True)])
    together = Dynamics(POINTING).effort(q, v, a)
    np.testing.assert_allclose(together, loop, rtol=0.0, atol=1e-13 * np.abs(loop).max())
    shaped = Dynamics(POINTING).effort(*(x.reshape(4, 30, 2) for x in (q, v, a)))
    assert (shaped.reshape(-1, 2) == together).all()


@pytest.mark.parametrize("payload", PAYLOADS.values(), ids=PAYLOADS)
@pytest.mark.parametrize("robot", [POINTING, HYBRID], ids=lambda robot: robot.name)
def test_results_are_the_same_for_any_number_of_threads(robot, payload):
    states = random_states(robot, 37)
    one, two, three = (Dynamics(robot, payload, threads=threads).effort(*states) for threads in (1, 2, 3))
    assert (one == two).all()
    assert (one == three).all()


@pytest.mark.parametrize("payload", PAYLOADS.values(), ids=PAYLOADS)
def test_results_do_not_depend_on_the_batch(payload):
    q, v, a = random_states(HYBRID, 30)
    dynamics = Dynamics(HYBRID, payload)
    together = dynamics.effort(q, v, a)
    assert (np.array([dynamics.effort(*row) for row in zip(q, v, a, strict=True)]) == together).all()
    reversed_memory = [np.asfortranarray(x) for x in (q, v, a)]
    assert (dynamics.effort(*reversed_memory) == together).all()


@pytest.mark.parametrize("payload", PAYLOADS.values(), ids=PAYLOADS)
@pytest.mark.parametrize("robot", [POINTING, HYBRID], ids=lambda robot: robot.name)
def test_friction_and_armature_are_added(robot, payload):
    rng = np.random.default_rng(1)
    viscous, coulomb, armature = rng.uniform(0.1, 3.0, (3, robot.dof))
    rough = replace(robot, friction=Friction(viscous, coulomb, armature))
    q, v, a = random_states(robot, 50)
    v[0] = 0.0
    plain, with_friction = (Dynamics(r, payload).effort(q, v, a) for r in (robot, rough))
    added = viscous * v + coulomb * np.sign(v) + armature * a
    np.testing.assert_allclose(with_friction - plain, added, rtol=1e-9, atol=1e-10)
    np.testing.assert_array_equal(
        Dynamics(rough, payload).effort_per_kilogram(q, v, a), Dynamics(robot, payload).effort_per_kilogram(q, v, a)
    )


def test_friction_alone_is_exact():
    model = POINTING.model.copy()
    for joint in range(model.njoints):
        model.inertias[joint] = pin.Inertia.Zero()
    viscous, coulomb, armature = np.array([[0.5, 0.25], [1.0, 2.0], [0.125, 0.0]])
    robot = replace(POINTING, model=model, friction=Friction(viscous, coulomb, armature), allow_massless=True)
    q, v, a = random_states(POINTING, 20)
    np.testing.assert_array_equal(Dynamics(robot).effort(q, v, a), viscous * v + coulomb * np.sign(v) + armature * a)


@pytest.mark.parametrize("remake", [copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))], ids=["copy", "pickle"])
@pytest.mark.parametrize("used_before", [False, True])
def test_dynamics_is_copied_and_pickled(remake, used_before):
    dynamics, states = Dynamics(HYBRID, PAYLOADS["rigid body"], samples=4, threads=2), random_states(HYBRID, 9)
    expected = Dynamics(HYBRID, PAYLOADS["rigid body"]).effort(*states)
    if used_before:
        dynamics.effort(*states)
    again = remake(dynamics)
    assert (again.samples, again.threads, again.payload) == (4, 2, PAYLOADS["rigid body"])
    assert (again.effort(*states) == expected).all()
    assert (dynamics.effort(*states) == expected).all()


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *(("samples", value) for value in (1, 0, 2.5, "6", float("nan"))),
        *(("threads", value) for value in (0, -1, 1.5)),
    ],
)
def test_bad_samples_and_threads_are_refused(name, value):
    with pytest.raises(InvalidInputError, match=name):
        Dynamics(HYBRID, **{name: value})


@pytest.mark.parametrize("count", range(2, 13))
def test_lobatto_is_exact_up_to_its_degree(count):
    nodes, weights = lobatto(count)
    assert len(nodes) == len(weights) == count
    assert (nodes[0], nodes[-1]) == (0.0, 1.0)
    assert (np.diff(nodes) > 0.0).all()
    assert (weights > 0.0).all()
    for degree in range(2 * count - 2):
        assert weights @ nodes**degree == pytest.approx(1.0 / (degree + 1), rel=1e-13), degree
    beyond = 2 * count - 2
    if count < 6:  # one degree more is not exact; for many nodes the error drowns in rounding
        assert weights @ nodes**beyond > (1.0 + 1e-8) / (beyond + 1)


@pytest.mark.parametrize("payload", PAYLOADS.values(), ids=PAYLOADS)
@pytest.mark.parametrize("robot", [POINTING, HYBRID], ids=lambda robot: robot.name)
def test_complex_step_derivatives_equal_finite_differences(robot, payload):
    if robot is POINTING and not payload.mass:
        robot = replace(robot, friction=Friction(*np.full((3, 2), 0.3)))
    dynamics = Dynamics(robot, payload)
    states = random_states(robot, 6, seed=3)
    rng = np.random.default_rng(4)
    directions = [rng.uniform(-1.0, 1.0, x.shape) for x in states]
    along = dynamics.effort(*(x + 1e-20j * d for x, d in zip(states, directions, strict=True)))
    step = 1e-6
    ahead, behind = (
        dynamics.effort(*(x + s * d for x, d in zip(states, directions, strict=True))) for s in (step, -step)
    )
    slope = (ahead - behind) / (2.0 * step)
    np.testing.assert_allclose(along.real, dynamics.effort(*states), rtol=1e-12, atol=1e-11)
    np.testing.assert_allclose(along.imag / 1e-20, slope, rtol=1e-6, atol=1e-6 * np.abs(slope).max())


def test_complex_steps_in_position_velocity_and_acceleration_alone():
    dynamics = Dynamics(HYBRID, PAYLOADS["rigid body"])
    states = random_states(HYBRID, 4, seed=5)
    for which in range(3):
        complex_states = [x.astype(complex) for x in states]
        shifted = [[x.copy() for x in states] for _ in range(2)]
        for joint in range(5):
            moved = [x.copy() for x in complex_states]
            moved[which][:, joint] += 1e-20j
            slope = dynamics.effort(*moved).imag / 1e-20
            ends = []
            for sign, copies in zip((1.0, -1.0), shifted, strict=True):
                near = [x.copy() for x in copies]
                near[which][:, joint] += sign * 1e-6
                ends.append(dynamics.effort(*near))
            expected = (ends[0] - ends[1]) / 2e-6
            np.testing.assert_allclose(slope, expected, rtol=1e-6, atol=1e-6 * max(1.0, np.abs(expected).max()))


def integers_and_singles():
    dynamics = Dynamics(load_robot("pointing_mechanism"))
    q = np.array([[1, 0], [2, 1]])
    expected = dynamics.effort(*(x.astype(np.float64) for x in (q, q, q)))
    assert np.allclose(dynamics.effort(q, q, q), expected)
    assert np.allclose(dynamics.effort(*(x.astype(np.float32) for x in (q, q, q))), expected)


def test_integers_and_single_precision_are_taken():
    """In a copy of this process: Pinocchio ends the process where it cannot convert an array."""
    assert forked(integers_and_singles) == 0


def rollout_of(count, samples, payload=PAYLOADS["rigid"]):
    problem = HybridManipulator(payload=payload, samples=samples)
    h = np.random.default_rng(2).uniform(0.3, 1.2, (count, 12))
    return problem.rollout(h), h


@pytest.mark.parametrize(("count", "samples"), [(1, 2), (3, 5), (7, 6)])
def test_rollout_shapes(count, samples):
    rollout, h = rollout_of(count, samples)
    wide = (count, 12 * samples, 5)
    assert rollout.robot is rollout.dynamics.robot
    assert rollout.t.shape == rollout.quadrature.shape == wide[:2]
    for name in ("effort", "unloaded_effort", "effort_per_kilogram", "power"):
        values = getattr(rollout, name)
        assert values.shape == wide
        assert not values.flags.writeable
    np.testing.assert_array_equal(rollout.power, rollout.effort * rollout.v)
    np.testing.assert_allclose(rollout.quadrature.sum(axis=1), h.sum(axis=1), rtol=1e-13)
    np.testing.assert_allclose(rollout.quadrature.sum(axis=1), rollout.trajectory.duration, rtol=1e-13)
    assert rollout.effort is rollout.effort  # computed once


def test_rollout_quadrature_integrates_the_acceleration_to_the_velocity():
    rollout, _ = rollout_of(4, 6)
    exact = rollout.trajectory.integral_of_square(2)
    np.testing.assert_allclose((rollout.a**2 * rollout.quadrature[..., None]).sum(axis=1), exact, rtol=1e-10)


def test_rollout_samples_lie_on_the_trajectory():
    rollout, _ = rollout_of(3, 4)
    inner = [i for i in range(rollout.t.shape[1]) if i % 4 != 3]  # a break belongs to the segment after it
    for order, values in enumerate((rollout.q, rollout.v, rollout.a, rollout.j)):
        expected = rollout.trajectory.evaluate(rollout.t[:, inner], order)
        np.testing.assert_allclose(values[:, inner], expected, rtol=1e-7, atol=1e-8)


def test_masses_of_a_rollout_count_one_by_one():
    rollout, _ = rollout_of(3, 4)
    masses = np.array([0.0, 2.5, 9.0])
    mixed = Rollout(rollout.dynamics, rollout.trajectory, masses).effort
    for i, mass in enumerate(masses):
        alone = Rollout(Dynamics(HYBRID, Payload(mass), samples=4), rollout.trajectory[i]).effort[0]
        np.testing.assert_allclose(mixed[i], alone, rtol=1e-10, atol=1e-9)


def test_a_trajectory_of_another_robot_is_refused():
    trajectory = PolynomialBatch(np.array([[0.0, 1.0]]), np.ones((1, 1, 2, 4)))
    with pytest.raises(InvalidInputError, match=r"hybrid_manipulator.*5 joints.*2"):
        Rollout(Dynamics(HYBRID), trajectory)


def test_table_7_uses_96_percent_of_screw_3():
    rollout = HybridManipulator(convention="printed").rollout(TABLE_7)
    assert np.abs(rollout.effort[0, :, 2]).max() == pytest.approx(480.08, abs=0.01)
    assert np.abs(rollout.effort[0, :, 4]).max() / 17.0 == pytest.approx(0.65, abs=0.01)


def test_dry_friction_may_differ_by_direction():
    forward, backward = np.array([1.0, 2.0]), np.array([3.0, 0.5])
    friction = Friction(np.zeros(2), forward, np.zeros(2), coulomb_backward=backward)
    v = np.array([[0.1, -0.1], [-0.2, 0.2], [0.0, 0.0]])
    expected = np.array([[1.0, -0.5], [-3.0, 2.0], [0.0, 0.0]])
    np.testing.assert_array_equal(friction.effort(v, np.zeros_like(v)), expected)
    assert not Friction(np.zeros(2), np.zeros(2), np.zeros(2), coulomb_backward=backward).none
    same = Friction(np.zeros(2), forward, np.zeros(2))
    np.testing.assert_array_equal(same.effort(v, np.zeros_like(v)), forward * np.sign(v))
    with pytest.raises(TrajevoError, match="friction.coulomb_backward: expected numbers from 0 on"):
        Friction(np.zeros(2), forward, np.zeros(2), coulomb_backward=-backward)
