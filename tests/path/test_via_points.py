import numpy as np
import pytest

from trajevo import TrajevoError, ViaPoints, load_robot

ROBOT = load_robot("pointing_mechanism")


@pytest.mark.parametrize(
    ("points", "says"),
    [
        ([[0.0, 0.0]], "at least 2 points, got 1"),
        ([0.0, 1.0], r"expected shape \(n_points, n_joints\), got \(2,\)"),
        ([[0.0, 0.0], [np.nan, 1.0]], r"finite numbers, got nan at index \(1, 0\)"),
        ([[0.0, 0.0], [np.inf, 1.0]], "finite numbers, got inf"),
        ([[0.0, 0.0], [1.0, 1.0], [1.0, 1.0]], "point 2 repeats point 1"),
        ([["a", "b"], ["c", "d"]], "expected numbers"),
    ],
)
def test_bad_points_are_refused(points, says):
    with pytest.raises(TrajevoError, match=says):
        ViaPoints(points)


def test_a_point_may_come_again_later():
    assert len(ViaPoints([[0.0], [1.0], [0.0]])) == 3


def test_points_outside_a_joints_range_are_named():
    with pytest.raises(TrajevoError, match=r"point 1 puts 'joint_2' at 71 deg, outside its range -70 to 70 deg"):
        ViaPoints.for_robot(ROBOT, np.radians([[0.0, 0.0], [0.0, 71.0]]), angle="deg")
    with pytest.raises(TrajevoError, match="2 joints, got points of 3"):
        ViaPoints.for_robot(ROBOT, np.eye(3))


def test_points_are_copied_and_read_only():
    given = np.eye(2)
    points = ViaPoints(given)
    given[0, 0] = 9.0
    assert points.positions[0, 0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        points.positions[0, 0] = 2.0
