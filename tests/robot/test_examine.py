"""What trajevo tells of whole robots, good and bad, and the command that prints it."""

import dataclasses
import warnings

import numpy as np
import pytest

from tests.helpers import refused, trajevo
from trajevo import load_robot
from trajevo.robot.examine import JointRow, examine
from trajevo.robot.locate import list_example_robots, list_robots

LIMITS = {"acceleration": 10.0, "jerk": 100.0}


def told(sentences, *parts):
    return [sentence for sentence in sentences if all(part in sentence for part in parts)]


@pytest.mark.parametrize("name", list_robots())
def test_the_robots_that_come_with_trajevo_have_no_errors(name):
    robot, examination = load_robot(name), examine(name)
    assert examination.errors == ()
    assert [row.name for row in examination.joints] == list(robot.joint_names)
    for key in ("lower", "upper", "velocity", "effort"):
        np.testing.assert_array_equal([getattr(row, key) for row in examination.joints], getattr(robot.limits, key))
    assert [row.unit for row in examination.joints] == list(robot.joint_units)
    assert not told(examination.warnings, "acceleration and jerk")


@pytest.mark.thinned(4)
@pytest.mark.parametrize("name", list_example_robots())
def test_no_errors_means_that_the_robot_loads(name):
    examination = examine(name)
    assert examination.dof == len(examination.joints)
    assert (
        len(told(examination.warnings, "acceleration and jerk limits are not in a URDF: give them in robot.toml")) == 1
    )
    tool, load = examination.links[-1].name, lambda: load_robot(name, limits=LIMITS, tool=examination.links[-1].name)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        if examination.errors:
            refused(load, r"\.urdf|limits")
            return
        robot = load()
    assert robot.tool == tool
    assert {row.name for row in examination.joints} == set(robot.joint_names)
    assert 0.0 < robot.mass <= examination.mass * (1.0 + 1e-12)


@pytest.mark.parametrize(
    ("name", "errors", "says"),
    [
        ("ur3", 0, "robot 'ur3': example-robot-data has another robot under this name, 'ur5' in ur5_robot.urdf"),
        ("ur5", 0, "several tips, so the tool must be named: tool= one of ee_link, base, tool0"),
        ("alex_psyonic_hands", 12, "joint 'Left_ring_q2': mimic: expected a joint of the file, got 'ring_q1'; did you"),
        ("kinova", 0, "joint 'j2s6s200_joint_6' is continuous, so the range of its <limit>, -6.28318530718 to"),
        ("talos_arm", 0, "link 'wrist_left_ft_link' is a point mass: 0.1 kg without inertia"),
        ("z1", 0, "acceleration and jerk limits"),
        ("xarm7", 0, "acceleration and jerk limits"),
        ("double_pendulum", 6, "joint 'joint2': limit: velocity: expected a positive number, got 0 rad/s"),
        ("double_pendulum", 6, "joint 'joint1': limit: lower must be below upper, got 0 and 0 rad"),
        ("double_pendulum", 6, "joint 'joint1': limit: effort: expected a positive number, got 0 N·m"),
        ("finger_edu", 1, "effort limits look like placeholders: 1000 or more on every joint"),
        ("allegro_left_hand", 4, "limits look like placeholders: effort 15 and velocity 7 on every one of 16 joints"),
        ("bravo7_gripper", 0, "joint 'bravo_finger1_joint' moves a body without mass: bravo_finger1_link"),
    ],
)
def test_what_is_known_to_be_wrong_is_told(name, errors, says):
    examination = examine(name)
    assert len(examination.errors) == errors
    assert told((*examination.errors, *examination.warnings), says)


def test_what_is_locked_is_no_fault():
    joints = ["panda_finger_joint1", "panda_finger_joint2"]
    examination = examine("panda", lock=joints)
    assert examination.errors == ()
    assert examination.dof == 7
    unknown = examine("panda", lock=[*joints, "panda_finger_joint3"]).errors
    assert len(unknown) == 1
    assert told(unknown, "lock: expected a joint that moves, got 'panda_finger_joint3'")
    everything = [row.name for row in examine("double_pendulum").joints]
    assert told(examine("double_pendulum", lock=everything).errors, "at least one joint that is not locked, got all 2")


def test_only_the_name_that_loads_another_robot_is_warned_of():
    for name in ("ur5", "xarm7", "talos_arm", "puma560"):
        assert not told(examine(name).warnings, "another robot")
    with pytest.warns(UserWarning, match="robot 'ur3': .*another robot .*'ur5'") as caught:
        load_robot("ur3", tool="tool0", limits=LIMITS)
    assert caught[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        load_robot("ur5", tool="tool0", limits=LIMITS)


def test_what_cannot_be_found_or_read_is_refused(tmp_path):
    refused(lambda: examine("ur6"), "unknown robot 'ur6'; did you mean 'ur5'")
    refused(lambda: examine(tmp_path / "none.urdf"), "none.urdf: no such URDF file")
    (tmp_path / "half.urdf").write_text("<robot>")
    refused(lambda: examine(tmp_path / "half.urdf"), "half.urdf: cannot be read as XML")
    (tmp_path / "robot.toml").write_text('urdf = "none.urdf"')
    refused(lambda: examine(tmp_path), "none.urdf: no such URDF file")


def test_a_folder_without_a_urdf_tells_of_its_settings(tmp_path):
    (tmp_path / "robot.toml").write_text("format = 1")
    examination = examine(tmp_path)
    assert examination.file == tmp_path / "robot.toml"
    assert told(examination.errors, "urdf: this key is missing")
    assert (examination.dof, examination.mass, examination.joints, examination.links) == (0, 0.0, (), ())


def test_an_empty_robot_is_told_not_raised(tmp_path):
    (tmp_path / "empty.urdf").write_text("<robot/>")
    examination = examine(tmp_path / "empty.urdf")
    assert told(examination.errors, "expected at least one movable joint")
    assert examination.robot_name == ""


def test_an_examination_is_frozen():
    examination = examine("double_pendulum")
    assert examination.joints[0] == JointRow("joint1", "revolute", "rad", 0.0, 0.0, 0.0, np.nan, np.nan, 0.0)
    with pytest.raises(dataclasses.FrozenInstanceError):
        examination.errors = ()


def test_the_command_exits_with_1_where_there_are_errors():
    good, bad = trajevo("check-robot", "xarm7"), trajevo("check-robot", "double_pendulum")
    assert (good.returncode, bad.returncode) == (0, 1)
    assert good.stdout.splitlines()[-1] == "0 errors, 1 warning"  # what a URDF lacks
    assert "note: friction of <dynamics> used: friction 1 N·m and damping 10 N·m·s/rad of 'joint1'," in good.stdout
    assert bad.stdout.splitlines()[-1] == "6 errors, 1 warning"
    assert len(told(bad.stdout.splitlines(), "error: ")) == 6
    for name in [row.name for row in examine("xarm7").joints] + [row.name for row in examine("xarm7").links]:
        assert name in good.stdout
    unknown = trajevo("check-robot", "ur6")
    assert unknown.returncode == 2
    assert unknown.stderr.startswith("error: unknown robot 'ur6'")


def test_the_command_locks_joints():
    lock = ("--lock", "panda_finger_joint1", "--lock", "panda_finger_joint2")
    locked, free = trajevo("check-robot", "panda", *lock), trajevo("check-robot", "panda")
    assert (locked.returncode, free.returncode) == (0, 0)
    assert (locked.stdout.count(", 7 revolute joints,"), free.stdout.count(", 8 joints,")) == (
        1,
        1,
    )  # one finger follows
