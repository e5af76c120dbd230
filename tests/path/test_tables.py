"""Files of points as spreadsheets, robots and people write them: every column is read, or refused by its name."""

import numpy as np
import pytest

from tests.helpers import refused
from trajevo import load_robot
from trajevo.path.inverse_kinematics import Pose
from trajevo.path.point_files import read_points
from trajevo.path.tables import read_table
from trajevo.path.via_points import joint_points

WANTED = {"azimuth": "rad", "pitch": "rad"}
ROWS = [[np.pi, 0.5], [-np.pi / 2, 0.25]]


@pytest.mark.parametrize(
    "text",
    [
        "azimuth [deg], pitch [rad]\n180, 0.5\n-90, 0.25\n",
        "pitch [rad],azimuth [deg]\n0.5,180\n0.25,-90\n",
        "azimuth [deg];pitch [rad]\n180;0.5\n-90;0.25\n",
        "azimuth [deg];pitch [rad]\n180;0,5\n-90;0,25\n",
        "azimuth [deg]\tpitch [rad]\n180\t0,5\n-9,0e1\t2,5E-1\n",
        "azimuth [deg] pitch [rad]\n  180   0.5\n  -90  .25\n",
        "azimuth (deg), pitch (rad)\n180., 0.5\n-90, +0.25\n",
        "azimuth [°], pitch [radians]\n180, 0.5\n-90, 0.25\n",
        "azimuth [deg], pitch [rad],\n180, 0.5,\n-90, 0.25, ,\n",
        "# of a robot\n\nazimuth [deg], pitch [rad]  # names\n\n180, 0.5 # take\n  # place\n-90, 0.25\n , \n",
        '"azimuth [deg]","pitch [rad]"\r\n"180","0.5"\r\n"-90","0.25"\r\n',
        "\ufeffazimuth [deg],pitch [rad]\n180,0.5\n-90,0.25\n",
    ],
)
def test_tables_are_read_whatever_separates_their_columns(tmp_path, text):
    file = tmp_path / "points.csv"
    for encoding in ("utf-8", "utf-16"):
        file.write_bytes(text.encode(encoding))
        np.testing.assert_allclose(read_table(file).si(WANTED), ROWS, rtol=1e-15)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "empty; expected a header such as 'azimuth .deg., pitch .deg.'"),
        ("# only\n,,\n", "empty; expected a header"),
        ("1, 2\n3, 4\n", "line 1: expected a header with the name and unit of every column, .*got 1, 2"),
        ("azimuth,pitch\n1,2\n", "line 1: expected a column header with a unit such as 'azimuth .rad.' or 'azimuth .d"),
        ("azimuth [deg],pitch [m]\n1,2\n", "a unit such as 'pitch .rad.' or 'pitch .deg.', got 'pitch .m.'"),
        ("azimuth [deg]\n1\n", r"expected a column 'pitch \[rad\]' too, got only 'azimuth \[deg\]'"),
        ("azimuth [deg],pich [deg]\n1,2\n", "unknown column 'pich .deg.'; known: azimuth, pitch; did you mean 'pitch'"),
        ("azimuth [deg],pitch [deg],note [1]\n1,2,3\n", "line 1: unknown column 'note .1.'; known: azimuth, pitch"),
        ("azimuth [deg],pitch [deg]\n1,two\n", "line 2, column 'pitch': expected a finite number, got 'two'"),
        ("azimuth [deg],pitch [deg]\n1,\n", "line 2, column 'pitch': expected a finite number, got an empty cell"),
        ("azimuth [deg],pitch [deg]\n1,nan\n", "line 2, column 'pitch': expected a finite number, got 'nan'"),
        ("azimuth [deg],pitch [deg]\n1,1e999\n", "line 2, column 'pitch': expected a finite number, got '1e999'"),
        ("azimuth [deg],pitch [deg]\n1,3_0\n", "expected a finite number, got '3_0'"),
        ("azimuth [deg];pitch [deg]\n1;1.234,5\n", "expected a finite number, got '1.234,5'"),
        (
            "azimuth [deg];pitch [deg]\n1;0,5\n0.5;1\n",
            "or decimal commas, got commas in line 2 and points in line 3",
        ),
        ("azimuth [deg],pitch [deg]\n\n1,2\n3\n", "line 4: expected 2 numbers, separated by commas .*got 1: 3"),
        ("azimuth [deg],pitch [deg]\n1,2,3\n", "line 2: expected 2 numbers, .*decimal points, got 3: 1, 2, 3"),
        ("azimuth [deg],pitch [deg]\n0,5,0,5\n", "got 4: 0, 5, 0, 5; with decimal commas, .*semicolons, also in the"),
        (
            "azimuth [deg];pitch [deg]\n1,2\n",
            "2 numbers, separated by semicolons as in the header, got 1: 1,2",
        ),
        ("azimuth [deg],Azimuth [deg],pitch [deg]\n1,2,3\n", "column names must differ"),
        ("azimuth [deg],,pitch [deg]\n1,2,3\n", "expected a name above every column, got none above column 2"),
        ("azimuth [deg,pitch [deg]\n1,2\n", "expected a column header with a unit"),
        ("azimuth [dge],pitch [deg]\n1,2\n", "got 'azimuth .dge.'; unknown unit 'dge'; did you mean 'deg'"),
        ('azimuth [deg],pitch [deg]\n"1,2\n', "line 2: expected 2 numbers"),
    ],
)
def test_bad_tables_are_refused(tmp_path, text, says):
    file = tmp_path / "points.csv"
    file.write_text(text)
    refused(lambda: read_table(file).si(WANTED), rf"points\.csv: .*{says}")


def test_unreadable_tables_are_refused(tmp_path):
    (tmp_path / "points.csv").write_text("")
    refused(lambda: read_table(tmp_path / "piont.csv"), "piont.csv: no such file; did you mean '.*/points.csv'")
    refused(lambda: read_table(tmp_path / "no" / "points.csv"), "points.csv: no such file, nor the folder")
    for content in (b"\xff\xfe\x00", "azimuth [°]\n1\n".encode("cp1252")):
        (tmp_path / "binary.csv").write_bytes(content)
        refused(lambda: read_table(tmp_path / "binary.csv"), "binary.csv: cannot be read as a table: is not UTF-8 text")
    refused(lambda: read_table(tmp_path), "expected a regular file, got a folder")


@pytest.fixture(scope="module")
def ur5():
    return load_robot("ur5", tool="tool0", limits={"acceleration": 10.0, "jerk": 100.0})


DOWN = [
    "x [m], y [m], z [m], roll [deg], pitch [deg], yaw [deg]\n0.45, {y}, 0.3, 180, 0, 0\n",
    "x [mm], y [m], z [cm], Roll [deg], PITCH [rad], Yaw [deg]\n450, {y}, 30, 180, 0, 0\n",
    "x [m], y [m], z [m], qx [1], qy [1], qz [1], qw [1]\n0.45, {y}, 0.3, 1, 0, 0, 0\n",
    "qw, qx, qy, qz, x [m], y [m], z [m]\n0, -0.9999, 0, 0, 0.45, {y}, 0.3\n",
    "X [m]; Y [m]; Z [m]; RX [rad]; RY [rad]; RZ [rad]\n0,45; {y}; 0,3; 3,1415926535897931; 0; 0\n",
    "x [m], y [m], z [m], rx [deg], ry [deg], rz [deg]\n0.45, {y}, 0.3, -180, 0, 0\n",
]


@pytest.mark.parametrize("text", DOWN)
def test_orientations_are_read_in_every_form(tmp_path, ur5, text):
    file = tmp_path / "poses.csv"
    header, row = text.splitlines()
    file.write_text(
        "\n".join([header, *(row.format(y=y.replace(".", "," if ";" in header else ".")) for y in ("-0.25", "0.25"))])
    )
    points = joint_points(file, ur5)
    positions, rotations = ur5.tool_poses(points.positions)
    np.testing.assert_allclose(positions, [[0.45, -0.25, 0.3], [0.45, 0.25, 0.3]], atol=1e-5)
    np.testing.assert_allclose(rotations, np.tile(np.diag([1.0, -1.0, -1.0]), (2, 1, 1)), atol=1e-5)


def test_orientations_that_are_no_half_turn_agree(tmp_path):
    """A general rotation, given in each form, with SciPy's conversions as the reference."""
    from scipy.spatial.transform import Rotation

    turned = Rotation.from_euler("xyz", [0.3, -0.7, 1.9])
    forms = {
        "rpy": [0.3, -0.7, 1.9],
        "quaternion": (-turned.as_quat()).tolist(),
        "rotation_vector": turned.as_rotvec().tolist(),
    }
    for key, given in forms.items():
        pose = Pose.of({"position": [0, 0, 0], key: given})
        np.testing.assert_allclose(pose.rotation, turned.as_matrix(), atol=1e-14, err_msg=key)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (
            "x [m], y [m], z [m], a [deg], b [deg], c [deg]\n1, 2, 3, 4, 5, 6\n",
            "unknown column 'a .deg.'; known: pi",
        ),
        ("x [m], y [m], z [m], qx, qy, qz\n1, 2, 3, 1, 0, 0\n", "expected a column 'qw .1.' too"),
        ("x [m], y [m]\n1, 2\n", "expected a column 'z .m.' too, got only 'x .m.', 'y .m.'"),
        (
            "x [m], y [m], z [m], yaw [deg], qw\n1, 2, 3, 1, 0\n",
            "one orientation, got roll, pitch, yaw and qx",
        ),
        ("x [m], y [m], z [m], rol [deg], pitch [deg], yaw [deg]\n1, 2, 3, 0, 0, 0\n", "did you mean 'roll'"),
        ("x, y [m], z [m]\n1, 2, 3\n", "a unit such as 'x .m.' or 'x .cm.' or 'x .mm.', got 'x'"),
        ("x [m], y [m], z [m], t [s]\n1, 2, 3, 0\n", "unknown column 't .s.'"),
    ],
)
def test_columns_of_poses_that_are_not_understood_are_refused(tmp_path, ur5, text, says):
    file = tmp_path / "poses.csv"
    file.write_text(text)
    refused(lambda: read_points(file, ur5), rf"poses\.csv: line 1: .*{says}")


def test_values_of_poses_are_checked(tmp_path, ur5):
    file = tmp_path / "poses.csv"
    for row, says in (
        ("qx, qy, qz, qw\n0.45, 0.2, 0.3, 0.9, 0, 0, 0", "point 0: quaternion: .* of norm 1, got .* of norm 0.9$"),
        ("rx [rad], ry [rad], rz [rad]\n0.45, 0.2, 0.3, 180, 0, 0", "point 0: rotation_vector: .*looks like degrees"),
        ("roll [rad], pitch [rad], yaw [rad]\n0.45, 0.2, 0.3, 180, 0, 0", "point 0: rpy: .*looks like degrees"),
        (
            "roll [rad], pitch [rad], yaw [rad]\n450, 200, 300, 3.14, 0, 0",
            "csv: point 0: .*; in mm it is reached",
        ),
    ):
        file.write_text(f"x [m], y [m], z [m], {row}\n")
        refused(lambda: joint_points(file, ur5), says)


def test_joints_beyond_their_range_that_fit_in_another_unit_are_told(tmp_path):
    arm, drive = load_robot("pointing_mechanism"), load_robot("feed_drive")
    assert (arm.joint_units[0], drive.joint_units[0]) == ("rad", "m")
    refused(
        lambda: joint_points([[0.0, 0.0], [40.0, 0.0]], arm),
        'at 40 rad, outside its range .* rad, which looks like degrees: say so by angle = "deg"',
    )
    refused(lambda: joint_points([[0.0, 0.0], [3.0, 0.0]], arm), "at 3 rad, outside its range -1.0472 to 1.0472 rad$")
    refused(lambda: joint_points([[0.0, 0.0], [50.0, 0.0]], drive), "at 50 m, outside .*, which looks like mm")
    file = tmp_path / "points.csv"
    file.write_text("joint_1 [deg], joint_2 [deg]\n0, 0\n700, 0\n")
    refused(lambda: joint_points(file, arm), "point 1 puts 'joint_1' at 700 deg, outside its range -60 to 60 deg$")
