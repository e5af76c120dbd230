import numpy as np
import pytest

from trajevo import TrajevoError, ViaPoints, load_robot
from trajevo.path.csv_points import read_columns

ROBOT = load_robot("pointing_mechanism")
WANTED = {"azimuth": "rad", "pitch": "rad"}


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


def test_csv_columns_are_read_by_name_and_turned_to_si(tmp_path):
    file = tmp_path / "points.csv"
    file.write_text("# a comment\npitch [rad], note [1], azimuth [deg]\n0.5, 1, 180\n0.25, 2, -90\n")
    np.testing.assert_allclose(read_columns(file, WANTED), [[np.pi, 0.5], [-np.pi / 2, 0.25]])


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "empty; expected a header"),
        ("azimuth,pitch\n1,2\n", "expected a column header with a unit"),
        ("azimuth [deg],pitch [m]\n1,2\n", r"expected a column 'pitch \[rad\]'"),
        ("azimuth [deg]\n1\n", r"expected a column 'pitch \[rad\]'"),
        ("azimuth [deg],pitch [deg]\n1,two\n", "line 2, column 'pitch': expected a finite number, got 'two'"),
        ("azimuth [deg],pitch [deg]\n1,2\n3\n", "line 3: expected 2 numbers, .*got 1: 3"),
        ("azimuth [deg],pitch [deg]\n30,5,30,5\n", "line 2: expected 2 numbers, .*decimal points, got 4"),
        ("azimuth [deg],pitch [deg]\n1,nan\n", "line 2, column 'pitch': expected a finite number, got 'nan'"),
        ("azimuth [deg],pitch [deg]\n1,3_0\n", "expected a finite number, got '3_0'"),
        ("azimuth [deg],azimuth [deg],pitch [deg]\n1,2,3\n", "column names must differ"),
        ("azimuth [deg,pitch [deg]\n1,2\n", "expected a column header with a unit"),
    ],
)
def test_bad_csv_is_refused(tmp_path, text, says):
    file = tmp_path / "points.csv"
    file.write_text(text)
    with pytest.raises(TrajevoError, match=says):
        read_columns(file, WANTED)


def test_unreadable_csv_is_refused(tmp_path):
    with pytest.raises(TrajevoError, match="cannot be read as CSV"):
        read_columns(tmp_path / "none.csv", WANTED)
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(TrajevoError, match="cannot be read as CSV"):
        read_columns(tmp_path / "binary.csv", WANTED)


def test_csv_from_a_spreadsheet_is_read(tmp_path):
    file = tmp_path / "points.csv"
    file.write_bytes(b"\xef\xbb\xbfazimuth [deg],pitch [deg]\r\n  # note\r\n , \r\n90,180\r\n")
    np.testing.assert_allclose(read_columns(file, WANTED), [[np.pi / 2, np.pi]])
