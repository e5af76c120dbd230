"""What holds for every robot in robots/."""

import numpy as np
import pinocchio as pin
import pytest

from trajevo import load_robot
from trajevo.robot import ROBOTS_FOLDER, list_robots


@pytest.fixture(params=list_robots())
def robot(request):
    return load_robot(request.param)


def test_folders_and_names_agree(robot):
    assert robot.source == ROBOTS_FOLDER / robot.name
    assert (robot.source / "SOURCE.md").is_file()
    assert robot.reference


def test_model_has_one_coordinate_per_joint(robot):
    assert robot.model.nq == robot.model.nv == robot.dof == len(robot.joint_units)
    assert robot.limits.velocity.shape == (robot.dof,)


def test_urdf_and_robot_toml_agree_on_positions_and_velocities(robot):
    np.testing.assert_allclose(robot.model.lowerPositionLimit, robot.limits.lower, atol=1e-12)
    np.testing.assert_allclose(robot.model.upperPositionLimit, robot.limits.upper, atol=1e-12)
    np.testing.assert_allclose(robot.model.upperVelocityLimit, robot.limits.velocity, atol=1e-12)


def test_inertias_are_physical(robot):
    for inertia in list(robot.model.inertias)[1:]:
        moments = np.linalg.eigvalsh(inertia.inertia)
        assert inertia.mass > 0.0
        assert moments[0] > 0.0
        assert moments[2] <= moments[0] + moments[1] + 1e-12


def test_inverse_dynamics_run(robot):
    q = 0.5 * (robot.limits.lower + robot.limits.upper)
    torque = pin.rnea(robot.model, robot.model.createData(), q, np.zeros(robot.dof), np.zeros(robot.dof))
    assert np.isfinite(torque).all()
