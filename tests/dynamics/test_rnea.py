"""Inverse dynamics by loops and by numpy: Pinocchio's on every tree, whatever it carries and however it is batched."""

import warnings

import numpy as np
import pinocchio as pin
import pytest

from tests.helpers import mostly_long
from tests.verification.test_newton_euler import PAYLOADS, ROBOTS, random_states
from trajevo import load_robot, optimise
from trajevo.base import jit
from trajevo.dynamics import rnea, rnea_loops
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rnea import HeldLoad, inverse_dynamics, kernel_of, slopes_kernel_of, stepped_dynamics
from trajevo.dynamics.straight_line import StraightLine
from trajevo.problems import HybridManipulator, PickAndPlace, ViaPointProblem
from trajevo.problems.puma_kinematics import TABLE_1_JOINTS
from trajevo.robot.payload import Payload

pytest.importorskip("numba")


@pytest.fixture
def plain(monkeypatch):
    """As where numba is not installed."""
    monkeypatch.setattr(jit, "can_compile", lambda: False)


@pytest.fixture(scope="module", params=mostly_long(ROBOTS, *[*ROBOTS][::3]))
def robot(request):
    return load_robot(request.param, **ROBOTS[request.param])


def by_pinocchio(model, states):
    data = model.createData()
    return np.array([pin.rnea(model, data, *state).copy() for state in zip(*states, strict=True)])


def of_kernel(model, states):
    torque = np.empty_like(states[0])
    kernel_of(model)(*states, torque)
    return torque


@pytest.mark.parametrize("compiles", [True, False])
def test_torques_are_pinocchio_s(robot, compiles, monkeypatch):
    monkeypatch.setattr(jit, "can_compile", lambda: compiles)
    states = random_states(robot, 2000)
    model = robot.model.copy()
    model.armature = np.linspace(0.1, 0.4, model.nv)
    model.gravity.linear = np.array([1.0, -2.0, 3.0])
    expected = by_pinocchio(model, states)
    np.testing.assert_allclose(of_kernel(model, states), expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("payload", PAYLOADS.values(), ids=PAYLOADS)
def test_payloads_are_carried_as_in_numpy(robot, payload, request):
    states = random_states(robot, 200)
    compiled = Dynamics(robot, payload).effort(*states)
    request.getfixturevalue("plain")
    expected = Dynamics(robot, payload).effort(*states)
    np.testing.assert_allclose(compiled, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())


def built(*joints):
    """Joints of Pinocchio with random bodies: one, and two that it carries."""
    pin.seed(7)
    model = pin.Model()
    for k, joint in enumerate(joints):
        number = model.addJoint(min(k, 1), joint, pin.SE3.Random(), f"joint {k}")
        model.appendBodyToJoint(number, pin.Inertia.Random(), pin.SE3.Random())
    return model


@pytest.mark.parametrize(
    "joints",
    [
        (pin.JointModelRX(), pin.JointModelRY(), pin.JointModelRZ()),
        (pin.JointModelPX(), pin.JointModelPY(), pin.JointModelPZ()),
        (
            pin.JointModelRevoluteUnaligned(np.array([1.0, -2.0, 2.0]) / 3.0),
            pin.JointModelPrismaticUnaligned(np.array([2.0, 3.0, -6.0]) / 7.0),
            pin.JointModelRevoluteUnaligned(np.array([0.0, 0.0, -1.0])),
        ),
    ],
    ids=["turning", "sliding", "any axis"],
)
def test_trees_and_joints_of_every_kind(joints):
    model = built(*joints)
    states = np.random.default_rng(1).uniform(-3.0, 3.0, (3, 500, 3))
    expected = by_pinocchio(model, states)
    np.testing.assert_allclose(of_kernel(model, states), expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())
    assert slopes_kernel_of(model) is not None
    compared_with_pinocchio_s_derivatives(model, stepped(states.reshape(3, 5, 100, 3)))


def grown(size, seed):
    """A random tree, numbered branch by branch as from a file, of joints that turn or slide along any axes."""
    random = np.random.default_rng(seed)
    pin.seed(seed)
    model, branch = pin.Model(), [0]
    for number in range(1, size + 1):
        axis = random.normal(size=3)
        axis /= np.linalg.norm(axis)
        kinds = [pin.JointModelRX(), pin.JointModelRY(), pin.JointModelRZ(), pin.JointModelPX(), pin.JointModelPZ()]
        kinds += [pin.JointModelRevoluteUnaligned(axis), pin.JointModelPrismaticUnaligned(axis)]
        del branch[1 + random.integers(len(branch)) :]
        place = pin.SE3.Random()
        place.translation = 0.2 * place.translation
        branch.append(model.addJoint(branch[-1], kinds[random.integers(len(kinds))], place, f"joint {number}"))
        model.appendBodyToJoint(branch[-1], pin.Inertia.Random(), pin.SE3.Random())
    model.armature = random.uniform(0.0, 1.0, size)
    return model


@pytest.mark.parametrize("size", mostly_long([2, 3, 5, 12, 24, 64], 2, 12, 64))
def test_any_tree_is_pinocchio_s(size):
    for seed in range(3):
        model = grown(size, seed)
        states = np.random.default_rng(seed).uniform(-3.0, 3.0, (3, 120, size))
        expected = by_pinocchio(model, states)
        np.testing.assert_allclose(of_kernel(model, states), expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())
        assert slopes_kernel_of(model) is not None
        compared_with_pinocchio_s_derivatives(model, stepped(states.reshape(3, 5, 24, size)))


def test_a_robot_never_used_before_compiles_nothing():
    loops = rnea_loops.torques, rnea_loops.stepped_torques
    for name in ("puma560", "hybrid_manipulator", "pointing_mechanism", "feed_drive", "kinova"):
        robot = load_robot(name, **ROBOTS[name])
        states = random_states(robot, 40)
        for x in states:
            x.setflags(write=False)
        of_kernel(robot.model, states)
        stepped_dynamics(robot.model)(*stepped(np.stack(states).reshape(3, 4, 10, -1)))
        of_kernel(robot.model, [np.asfortranarray(x) for x in states])
        assert [len(loop.compiled.signatures) for loop in loops] == [1, 1]


def held(robot, mass):
    """A load with a centre of mass off the tool's axis, and its model."""
    dynamics = Dynamics(robot, Payload(1.0, com=(0.02, -0.03, 0.1)))
    return HeldLoad(dynamics._model("kilogram"), mass)


def test_loads_add_what_holds_them_at_rest(robot, request):
    states, load = random_states(robot, 500), held(robot, 3.0)
    still = np.zeros_like(states[0])
    expected = by_pinocchio(robot.model, states) + 3.0 * by_pinocchio(load.model, [states[0], still, still])
    within = 1e-12 * np.abs(expected).max()
    torque = np.empty_like(states[0])
    inverse_dynamics(robot.model, load, threads=1)(*states, torque)
    np.testing.assert_allclose(torque, expected, rtol=0.0, atol=within)
    nothing = np.empty_like(torque)
    inverse_dynamics(robot.model, held(robot, 0.0), threads=1)(*states, nothing)
    np.testing.assert_array_equal(nothing, of_kernel(robot.model, states))
    request.getfixturevalue("plain")
    assert kernel_of(robot.model, load) is not None
    inverse_dynamics(robot.model, load, threads=1)(*states, torque)
    np.testing.assert_allclose(torque, expected, rtol=0.0, atol=within)


def test_a_load_on_several_joints_is_left_to_two_passes(plain):
    robot = load_robot("puma560")
    load, states = HeldLoad(robot.model, 0.5), random_states(robot, 100)
    assert kernel_of(robot.model, load) is None
    torque, still = np.empty_like(states[0]), np.zeros_like(states[0])
    inverse_dynamics(robot.model, load, threads=1)(*states, torque)
    expected = by_pinocchio(robot.model, states) + 0.5 * by_pinocchio(robot.model, [states[0], still, still])
    np.testing.assert_allclose(torque, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())


def test_angles_of_any_size():
    random = np.random.default_rng(6)
    quarters = np.arange(-50_000, 50_000) * (0.5 * np.pi)
    turns = [random.uniform(-reach, reach, 20_000) for reach in (1e-9, 1.0, 10.0, 1e5, 1e9)]
    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelRX(), pin.SE3.Identity(), "joint")
    model.appendBodyToJoint(joint, pin.Inertia(1.0, np.array([0.0, 1.0, 0.0]), np.zeros((3, 3))), pin.SE3.Identity())
    model.gravity.linear = np.array([0.0, 0.0, -1.0])
    q = np.concatenate([quarters, *turns, [0.0, -0.0, 5e-324, 1e300, np.nan, np.inf, -np.inf]])[:, None]
    still = np.zeros_like(q)
    with np.errstate(invalid="ignore"):
        expected = np.cos(q)
    # The weight turns about the axis with the cosine of the angle.
    np.testing.assert_allclose(of_kernel(model, [q, still, still]), expected, rtol=0.0, atol=3e-16)


def test_an_angle_of_many_turns_does_not_touch_its_neighbours():
    model = load_robot("puma560").model
    states = np.random.default_rng(7).uniform(-3.0, 3.0, (3, 64, 6))
    expected = of_kernel(model, states)
    states[0, 17] = 1e7, np.nan, np.inf, -1e12, 0.0, 1e5
    others = np.arange(64) != 17
    np.testing.assert_array_equal(of_kernel(model, states)[others], expected[others])


def stepped(states):
    """States (3, R, T, n) with steps in random directions, the first two rows with the same real parts."""
    states = states.copy()
    states[:, 1] = states[:, 0]
    return states + 1j * np.random.default_rng(4).uniform(-1e-20, 1e-20, states.shape)


def compared_with_pinocchio_s_derivatives(model, motions):
    data = model.createData()
    torque = stepped_dynamics(model)(*motions)
    slopes = np.empty(torque.shape)
    for place in np.ndindex(torque.shape[:2]):
        rows = [x[place] for x in motions]
        parts = pin.computeRNEADerivatives(model, data, *(x.real.copy() for x in rows))
        slopes[place] = sum(part @ x.imag for part, x in zip(parts, rows, strict=True))
        np.testing.assert_allclose(torque[place].real, data.tau, rtol=0.0, atol=1e-11 * np.abs(torque.real).max())
    np.testing.assert_allclose(torque.imag, slopes, rtol=0.0, atol=1e-11 * np.abs(slopes).max())


@pytest.mark.thinned(2)
def test_slopes_are_pinocchio_s(robot):
    states = random_states(robot, 5 * 300)
    model = robot.model.copy()
    model.armature = np.linspace(0.1, 0.4, model.nv)
    model.gravity.linear = np.array([1.0, -2.0, 3.0])
    assert slopes_kernel_of(model) is not None
    compared_with_pinocchio_s_derivatives(model, stepped(np.stack(states).reshape(3, 5, 300, -1)))


def test_slopes_of_loads_are_those_of_two_passes(request):
    robot = load_robot("pointing_mechanism")
    motions, load = stepped(np.stack(random_states(robot, 4 * 50)).reshape(3, 4, 50, -1)), held(robot, 3.0)
    together = stepped_dynamics(robot.model, load)(*motions)
    rest = np.zeros_like(motions[0])
    apart = stepped_dynamics(robot.model)(*motions) + 3.0 * stepped_dynamics(load.model)(motions[0], rest, rest)
    request.getfixturevalue("plain")
    plain = stepped_dynamics(robot.model, load)(*motions)
    for part in (np.real, np.imag):
        within = 1e-12 * np.abs(part(apart)).max()
        np.testing.assert_allclose(part(together), part(apart), rtol=0.0, atol=within)
        np.testing.assert_allclose(part(plain), part(apart), rtol=0.0, atol=within)


@pytest.mark.parametrize("shape", [(0, 7), (1, 1), (3, 257)])
def test_slopes_of_batches_of_any_size(shape, request):
    model = load_robot("pointing_mechanism").model
    motions = np.random.default_rng(5).uniform(-3.0, 3.0, (3, *shape, 2)) * (1.0 + 0.5j)
    compiled = stepped_dynamics(model)(*motions)
    assert compiled.shape == (*shape, 2)
    request.getfixturevalue("plain")
    expected = stepped_dynamics(model)(*motions)
    np.testing.assert_allclose(compiled, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max(initial=0.0))


def test_slopes_do_not_depend_on_neighbours():
    model = load_robot("puma560").model
    motions = stepped(np.random.default_rng(5).uniform(-3.0, 3.0, (3, 7, 150, 6)))
    together = stepped_dynamics(model)(*motions)
    for row in (0, 1, 6):
        np.testing.assert_array_equal(stepped_dynamics(model)(*motions[:, row : row + 1])[0], together[row])
    for instant in (0, 63, 64, 149):
        alone = stepped_dynamics(model)(*motions[:, :, instant : instant + 1])
        np.testing.assert_array_equal(alone[:, 0], together[:, instant])


@pytest.mark.parametrize("joint", [pin.JointModelFreeFlyer(), pin.JointModelRUBX(), pin.JointModelSpherical()])
def test_other_joints_are_left_to_pinocchio(joint):
    assert kernel_of(built(joint)) is None
    assert slopes_kernel_of(built(joint)) is None


@pytest.mark.parametrize("compiles", [True, False])
@pytest.mark.parametrize("threads", [1, 3])
def test_a_torque_does_not_depend_on_its_neighbours_nor_on_threads(threads, compiles, monkeypatch):
    if not compiles:
        monkeypatch.setattr(jit, "can_compile", lambda: False)
    monkeypatch.setattr(rnea, "_WORTH_A_THREAD", 4096)
    model = load_robot("puma560").model
    states = np.random.default_rng(2).uniform(-3.0, 3.0, (3, 20_000, 6))
    together, order = np.empty_like(states[0]), np.random.default_rng(3).permutation(20_000)
    compute = inverse_dynamics(model, threads=threads)
    compute(*states, together)
    shuffled = np.empty_like(together)
    compute(*(np.ascontiguousarray(x[order]) for x in states), shuffled)
    np.testing.assert_array_equal(shuffled, together[order])
    for i in (0, 1, 255, 256, 12_345):
        alone = np.empty((1, 6))
        compute(*(x[i : i + 1] for x in states), alone)
        np.testing.assert_array_equal(alone[0], together[i])
    nothing = np.empty((0, 6))
    compute(nothing, nothing, nothing, nothing)


@pytest.mark.parametrize("wrong", ["torques", "stepped_torques"])
def test_a_kernel_that_is_wrong_is_told_and_not_used(wrong, monkeypatch):
    model, states = load_robot("puma560").model, np.random.default_rng(2).uniform(-1.0, 1.0, (3, 4, 50, 6))
    model.name = "lopsided"
    monkeypatch.setattr(rnea, "_known", {})
    honest = getattr(rnea_loops, wrong)

    def lopsided(*arguments):
        honest(*arguments)
        arguments[-1][..., 1] *= 1.000001

    monkeypatch.setattr(rnea_loops, wrong, lopsided)
    motions, torque = stepped(states), np.empty((200, 6))
    states = motions.real
    said = r"robot 'lopsided': the .*inverse dynamics differ from Pinocchio's by .* and are not used"
    with pytest.warns(UserWarning, match=said) as told:
        compute, slope = inverse_dynamics(model, threads=1), stepped_dynamics(model)
    compute(*np.ascontiguousarray(states).reshape(3, -1, 6), torque)
    slopes = slope(*motions)
    assert len(told) == 1
    expected = by_pinocchio(model, [x.reshape(-1, 6) for x in states])
    np.testing.assert_allclose(torque, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())
    np.testing.assert_allclose(slopes.real.reshape(-1, 6), expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        inverse_dynamics(model, threads=1)
        stepped_dynamics(model)


@pytest.mark.parametrize(
    "make",
    [
        HybridManipulator,
        pytest.param(PickAndPlace, marks=pytest.mark.long),
        pytest.param(
            lambda: ViaPointProblem(points=TABLE_1_JOINTS, objectives=("time", "energy"), payload=2.0),
            marks=pytest.mark.long,
        ),
    ],
    ids=["hybrid", "pick-place", "certified"],
)
def test_fronts_are_those_without_it(make, request):
    settings = {"seed": 1, "generations": 15, "population": 40, "polish": False, "progress": False}
    fast = optimise(make(), **settings)
    request.getfixturevalue("plain")
    slow = optimise(make(), **settings)
    np.testing.assert_allclose(fast.F, slow.F, rtol=1e-9)
    np.testing.assert_allclose(fast.X, slow.X, rtol=1e-9)


def test_expressions_are_worked_out_and_written_once():
    line = StraightLine()
    assert line.add(line.multiply(2.0, 3.0), 1.0) == 7.0
    assert line.multiply(0.0, "x") == 0.0
    assert line.multiply("x", 1.0) == line.add("x", 0.0) == line.subtract("x", 0.0) == "x"
    twice = line.add(line.multiply("x", "y"), line.multiply("x", "y"))
    unused = line.multiply("x", "x")
    minus = line.multiply(-1.0, "y")
    values = {"x": 3.0, "y": -2.0}
    written = line.assignments([twice, minus])
    assert len(written) == 3
    for name, operation, one, other in written:
        exec(f"{name} = {one} {operation} ({other})", values)
    assert (values[twice], values[minus]) == (-12.0, 2.0)
    assert unused not in values
