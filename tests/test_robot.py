import re
import shutil

import numpy as np
import pytest

from trajevo import JointLimits, TrajevoError, load_robot
from trajevo.robot import ROBOTS_FOLDER

SOURCE = ROBOTS_FOLDER / "pointing_mechanism"


@pytest.fixture
def folder(tmp_path):
    """A copy of the pointing mechanism that a test may break."""
    return shutil.copytree(SOURCE, tmp_path / "mine")


def edit(file, old, new):
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))


def test_limits_are_table_2_in_si():
    limits = load_robot("pointing_mechanism").limits
    np.testing.assert_allclose(limits.upper, np.radians([60, 70]))
    np.testing.assert_allclose(limits.lower, -np.radians([60, 70]))
    np.testing.assert_allclose(limits.velocity, np.radians([10, 10]))
    np.testing.assert_allclose(limits.acceleration, np.radians([15, 15]))
    np.testing.assert_allclose(limits.jerk, np.radians([80, 80]))
    assert np.isinf(limits.effort).all()


def test_a_folder_loads_like_a_name(folder):
    by_folder, by_name = load_robot(folder), load_robot("pointing_mechanism")
    np.testing.assert_array_equal(by_folder.limits.velocity, by_name.limits.velocity)
    assert by_folder.joint_names == by_name.joint_names == ("joint_1", "joint_2")


def test_unknown_robots_list_the_known():
    with pytest.raises(TrajevoError, match="unknown robot 'pointing'; known: pointing_mechanism"):
        load_robot("pointing")


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (
            "velocity = { limit = 10.0,",
            "velocity = { limit = -10.0,",
            "joints.joint_1.velocity.limit: .*greater than 0, got -10",
        ),
        ("velocity = { limit = 10.0,", "velocity = { limit = 0.0,", "joints.joint_1.velocity.limit: .*greater than 0"),
        ("velocity = { limit = 10.0,", "velocity = { limit = nan,", "joints.joint_1.velocity.limit"),
        ("velocity = { limit = 10.0,", 'velocity = { limit = "fast",', "joints.joint_1.velocity.limit: .*got 'fast'"),
        ('unit = "deg/s" }', 'unit = "m/s" }', "joint 'joint_1': unit 'm/s', expected one that converts to 'rad/s'"),
        ('unit = "deg/s" }', 'unit = "knots" }', "unknown unit 'knots'"),
        ('unit = "N*m" }', 'unit = "N" }', "joint 'joint_1': unit 'N', expected one that converts to 'N\\*m'"),
        ("lower = -60.0, upper = 60.0", "lower = 60.0, upper = -60.0", "lower must be below upper"),
        ('jerk = { limit = 80.0, unit = "deg/s^3" }\n', "", "joints.joint_1.jerk: Field required"),
        ("jerk = {", "jrek = {", "joints.joint_1"),
        ("[joints.joint_1]", "[joints.joint_9]", r"limits given for joints \['joint_2', 'joint_9'\]"),
        ('tool = "tool"', 'tool = "gripper"', "unknown tool frame in .*'gripper'; known: .*platform"),
        ('urdf = "pointing_mechanism.urdf"', 'urdf = "none.urdf"', "no such URDF file"),
        ("format = 1", "format = 2", "format: "),
        ("format = 1", "format = ", "cannot be read as TOML"),
    ],
)
def test_a_broken_robot_toml_is_refused_with_file_and_place(folder, old, new, says):
    edit(folder / "robot.toml", old, new)
    with pytest.raises(TrajevoError, match=says) as caught:
        load_robot(folder)
    assert "\n" not in str(caught.value) or "TOML" in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('type="revolute"', 'type="continuous"', "joint 'joint_1' is a .*; expected revolute or prismatic"),
        ('type="revolute"', 'type="floating"', "joint 'joint_1' is a .*; expected revolute or prismatic"),
        ("</robot>", "", "Pinocchio cannot read it"),
    ],
)
def test_a_urdf_that_cannot_be_planned_for_is_refused(folder, old, new, says):
    edit(folder / "pointing_mechanism.urdf", old, new)
    with pytest.raises(TrajevoError, match=says):
        load_robot(folder)


def test_a_prismatic_joint_is_in_metres(folder):
    edit(folder / "pointing_mechanism.urdf", 'name="joint_1" type="revolute"', 'name="joint_1" type="prismatic"')
    text = (folder / "robot.toml").read_text()
    first, second = text.split("[joints.joint_2]")
    first = re.sub(r'unit = "deg', 'unit = "mm', first).replace('unit = "N*m"', 'unit = "N"')
    (folder / "robot.toml").write_text(first + "[joints.joint_2]" + second)
    robot = load_robot(folder)
    assert robot.joint_units == ("m", "rad")
    np.testing.assert_allclose(robot.limits.velocity, [0.01, np.radians(10)])


def test_limits_are_checked_and_read_only():
    good = {name: np.ones(2) for name in ("upper", "velocity", "acceleration", "jerk", "effort")} | {
        "lower": -np.ones(2)
    }
    limits = JointLimits(**good)
    with pytest.raises(ValueError, match="read-only"):
        limits.velocity[0] = 3.0
    for change, says in (
        ({"velocity": np.ones(3)}, r"limits.velocity: expected shape \(2,\), got \(3,\)"),
        ({"jerk": np.array([1.0, np.nan])}, "limits.jerk: .*NaN"),
        ({"effort": np.array([1.0, 0.0])}, "limits.effort: expected positive"),
        ({"lower": np.array([0.0, 1.0])}, "lower must be below upper"),
    ):
        with pytest.raises(TrajevoError, match=says):
            JointLimits(**(good | change))
