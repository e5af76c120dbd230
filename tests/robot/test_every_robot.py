"""What holds for every robot in robots/."""

import itertools

import numpy as np
import pinocchio as pin
import pytest

from trajevo import load_robot
from trajevo.robot.locate import ROBOTS_FOLDER, list_robots
from trajevo.robot.transmission import Direct

STEP = 1e-4


@pytest.fixture(params=list_robots())
def robot(request):
    return load_robot(request.param)


@pytest.fixture
def motion(robot):
    """A random smooth motion t -> q, v, a of the actuators that stays within the limits of position."""
    rng = np.random.default_rng(1)
    middle, half = _middle_and_half(robot)
    amplitude = half * rng.uniform(0.3, 0.9, robot.dof)
    rate, phase = rng.uniform(0.5, 2.0, robot.dof), rng.uniform(0.0, 2.0 * np.pi, robot.dof)

    def at(t):
        angle = rate * np.asarray(t)[:, None] + phase
        return (
            middle + amplitude * np.sin(angle),
            amplitude * rate * np.cos(angle),
            -amplitude * rate**2 * np.sin(angle),
        )

    return at


def _middle_and_half(robot):
    lower, upper = np.clip(robot.limits.lower, -np.pi, None), np.clip(robot.limits.upper, None, np.pi)
    return 0.5 * (lower + upper), 0.5 * (upper - lower)


def test_folders_and_names_agree(robot):
    assert robot.source == ROBOTS_FOLDER / robot.name
    assert (robot.source / "SOURCE.md").is_file()
    assert robot.reference


def test_model_has_one_coordinate_per_joint(robot):
    assert robot.model.nq == robot.model.nv == robot.dof == len(robot.joint_units)
    assert robot.limits.velocity.shape == (robot.dof,)


def test_urdf_and_robot_toml_agree_on_positions_and_velocities(robot):
    """For the joints that both name: a transmission plans in actuators that the URDF does not know."""
    shared = np.array(
        [model == actuator for model, actuator in zip(robot.model.names[1:], robot.joint_names, strict=True)]
    )
    assert shared.all() or not isinstance(robot.transmission, Direct)
    np.testing.assert_allclose(robot.model.lowerPositionLimit[shared], robot.limits.lower[shared], atol=1e-12)
    np.testing.assert_allclose(robot.model.upperPositionLimit[shared], robot.limits.upper[shared], atol=1e-12)
    np.testing.assert_allclose(robot.model.upperVelocityLimit[shared], robot.limits.velocity[shared], atol=1e-12)


def test_velocity_limits_of_the_urdf_are_what_the_actuators_reach_in_mid_range(robot):
    corners = np.array(list(itertools.product((-1.0, 1.0), repeat=robot.dof))) * robot.limits.velocity
    middle = np.broadcast_to(_middle_and_half(robot)[0], corners.shape)
    velocity = robot.transmission.motion(middle, corners, np.zeros_like(corners))[1]
    np.testing.assert_allclose(np.abs(velocity).max(axis=0), robot.model.upperVelocityLimit, rtol=1e-12)


def test_inertias_are_physical(robot):
    masses = [inertia.mass for inertia in list(robot.model.inertias)[1:]]
    assert max(masses) > 0.0
    for inertia in list(robot.model.inertias)[1:]:
        if inertia.mass == 0.0:
            assert not inertia.inertia.any()
            continue
        moments = np.linalg.eigvalsh(inertia.inertia)
        assert inertia.mass > 0.0
        assert moments[0] > 0.0
        assert moments[2] <= moments[0] + moments[1] + 1e-12


def test_inverse_dynamics_run(robot):
    still = np.zeros(robot.dof)
    q, v, a = robot.transmission.motion(_middle_and_half(robot)[0], still, still)
    torque = pin.rnea(robot.model, robot.model.createData(), q, v, a)
    assert np.isfinite(torque).all()
    assert np.isfinite(robot.transmission.effort(q, torque)).all()


def test_transmission_differentiates_its_own_position(robot, motion):
    times = np.linspace(0.0, 5.0, 41)
    before, now, after = (robot.transmission.motion(*motion(times + shift))[0] for shift in (-STEP, 0.0, STEP))
    _, velocity, acceleration = robot.transmission.motion(*motion(times))
    np.testing.assert_allclose((after - before) / (2.0 * STEP), velocity, atol=1e-6)
    np.testing.assert_allclose((after - 2.0 * now + before) / STEP**2, acceleration, atol=2e-6)


def test_transmission_conserves_power(robot, motion):
    q, v, a = motion(np.linspace(0.0, 5.0, 41))
    torque = np.random.default_rng(2).normal(scale=100.0, size=q.shape)
    effort = robot.transmission.effort(q, torque)
    velocity = robot.transmission.motion(q, v, a)[1]
    np.testing.assert_allclose((effort * v).sum(axis=-1), (torque * velocity).sum(axis=-1), atol=1e-10)


def test_transmission_leaves_its_arguments_alone(robot, motion):
    given = motion(np.linspace(0.0, 5.0, 11))
    kept = [array.copy() for array in given]
    robot.transmission.motion(*given)
    robot.transmission.effort(given[0], given[1])
    for array, copy in zip(given, kept, strict=True):
        np.testing.assert_array_equal(array, copy)
