import numpy as np
import pytest

from tests.reference import SUN2020
from trajevo import TrajevoError, load_robot
from trajevo.problems.pointing_mechanism import (
    PointingMechanism,
    azimuth_pitch,
    forward_kinematics,
    inverse_kinematics,
    joint_angles,
)

RNG = np.random.default_rng(11)
IN_RANGE = RNG.uniform([-np.pi / 3, -np.radians(70)], [np.pi / 3, np.radians(70)], (500, 2))


def test_forward_kinematics_equal_pinocchios():
    theta = RNG.uniform(-np.pi, np.pi, (200, 2))
    positions, rotations = load_robot("pointing_mechanism").tool_poses(theta)
    poses = forward_kinematics(theta)
    np.testing.assert_allclose(poses[:, :3, 3], positions, atol=1e-12)
    np.testing.assert_allclose(poses[:, :3, :3], rotations, atol=1e-12)


def test_inverse_kinematics_undo_forward_kinematics():
    np.testing.assert_allclose(inverse_kinematics(forward_kinematics(IN_RANGE)[:, :3, 3]), IN_RANGE, atol=1e-12)


@pytest.mark.parametrize("pitch", [10.0, 60.0, 89.0, 91.0, 130.0, 179.0])
def test_azimuth_and_pitch_point_the_tools_x_axis_there(pitch):
    gamma = np.radians(np.arange(5.0, 360.0, 7.0))
    beta = np.full_like(gamma, np.radians(pitch))
    direction = np.stack([gamma, beta], axis=1)
    x_axis = forward_kinematics(joint_angles(direction))[:, :3, 0]
    wanted = np.stack([np.cos(beta), np.sin(beta) * np.sin(gamma), -np.sin(beta) * np.cos(gamma)], axis=1)
    np.testing.assert_allclose(x_axis, wanted, atol=1e-12)
    np.testing.assert_allclose(azimuth_pitch(joint_angles(direction)), direction, atol=1e-12)


def test_joint_angles_come_back_from_azimuth_and_pitch():
    np.testing.assert_allclose(joint_angles(azimuth_pitch(IN_RANGE)), IN_RANGE, atol=1e-12)
    np.testing.assert_array_equal(azimuth_pitch(np.zeros((1, 2))), np.zeros((1, 2)))
    np.testing.assert_array_equal(azimuth_pitch(np.array([[0.0, -0.0]])), np.zeros((1, 2)))


def test_path_points_are_table_4s():
    angles = np.degrees(PointingMechanism().interpolant.points.positions)
    np.testing.assert_allclose(angles, SUN2020["joint_angles"], atol=1e-9)
    printed = [[16.1021, 25.6589], [14.5108, 3.8409], [0, 0], [3.9671, -14.4775], [-16.1021, -25.6589]]
    np.testing.assert_allclose(angles, printed, atol=1e-4)


@pytest.mark.parametrize(
    ("function", "points", "says"),
    [
        (joint_angles, [[0.0, 0.5], [0.0, -0.1]], r"point 1 \(0, -5.72958\) deg cannot be reached: expected a pitch"),
        (joint_angles, [[0.0, np.pi]], "point 0 .* below 180 deg"),
        (joint_angles, [[np.pi, np.pi / 2]], "point 0 .* axis of joint 1"),
        (joint_angles, [[0.0, np.nan]], r"points: expected finite numbers, got nan at index \(0, 1\)"),
        (joint_angles, [0.0, 1.0], r"expected shape \(n_points, 2\)"),
        (inverse_kinematics, [[0.5, 0.0, 0.0], [0.4, 0.0, 0.21]], r"point 1 .* m cannot be reached: \|z\| exceeds"),
        (inverse_kinematics, [[0.6, 0.0, 0.0]], "point 0 .* distance from the axis of joint 1"),
    ],
)
def test_points_outside_the_domain_are_named(function, points, says):
    with pytest.raises(TrajevoError, match=says):
        function(points)


@pytest.mark.parametrize(
    ("points", "says"),
    [
        (np.radians([[30, 30], [75, 15]]), "at least 3 points, got 2"),
        (np.radians([[30, 30], [75, 15], [75, 15], [10, 10]]), "point 2 repeats point 1"),
        (np.radians([[30, 30], [120, 0], [200, 0], [10, 10]]), "point 2 repeats point 1"),
        (
            np.radians([[30, 30], [75, 15], [90, 61]]),
            "'joint_1' at 61 deg, outside its range -60 to 60 deg",
        ),
        (np.radians([[30, 30], [75, 15], [0, 75]]), "point 2 puts 'joint_2' at 75 deg"),
        ([[0.1, 0.1], [0.2, np.inf], [0.3, 0.1]], "finite numbers, got inf"),
    ],
)
def test_bad_paths_are_refused(points, says):
    with pytest.raises(TrajevoError, match=says):
        PointingMechanism(points=points)


def test_points_from_a_file_equal_points_from_an_array(tmp_path):
    file = tmp_path / "points.csv"
    rows = "\n".join(f"{g}, {b}" for g, b in SUN2020["directions"])
    file.write_text(f"azimuth [deg], pitch [deg]\n{rows}\n")
    x = np.full((1, 4), 5.0)
    np.testing.assert_allclose(PointingMechanism(points=file).evaluate(x)[0], PointingMechanism().evaluate(x)[0])


def test_unknown_interpolants_list_the_known():
    with pytest.raises(TrajevoError, match="'cubic'; known: printed, quintic, septic_spline, smooth"):
        PointingMechanism(interpolant="cubic")


def test_more_points_make_more_variables():
    problem = PointingMechanism(points=np.radians([[30, 30], [75, 15], [120, 5], [165, 15], [210, 30], [250, 20]]))
    assert problem.n_var == 5
    assert problem.reference_point[0] == 50.0
