"""``trajevo check-robot ROBOT --limits FILE``: the robot with the limits of a file, and everything wrong with them."""

import pytest

from tests.helpers import trajevo
from trajevo.robot.examine import examine
from trajevo.robot.robot import load_robot

ALL = """joint_limits:
  shoulder_pan_joint: {max_velocity: 2.0, max_acceleration: 5.0, max_jerk: 50.0, max_effort: 90.0}
  shoulder_lift_joint: {max_velocity: 2.0, max_acceleration: 5.0, max_jerk: 50.0, min_position: -1.0, max_position: 1.0}
  elbow_joint: {max_velocity: 2.0, max_acceleration: !degrees 800.0, max_deceleration: !degrees -400.0, max_jerk: 50.0}
  wrist_1_joint: {max_velocity: 3.0, max_acceleration: 5.0, max_jerk: 50.0}
  wrist_2_joint: {max_velocity: 3.0, max_acceleration: 5.0, has_jerk_limits: false}
  wrist_3_joint: {max_velocity: 3.0, max_acceleration: 5.0, max_jerk: 50.0}
"""
WRONG = """joint_limits:
  shoulder_pan_joint: {max_velocity: 0.0, has_jerk_limits: true}
  shoulder_pam_joint: {max_velocity: 2.0}
  elbow_joint: {min_position: 2.0, max_position: -2.0, max_velocitty: 3.0, max_effort: much}
  wrist_1_joint: 3.0
"""


@pytest.fixture
def limits(tmp_path):
    def written(text):
        (tmp_path / "joint_limits.yaml").write_text(text)
        return tmp_path / "joint_limits.yaml"

    return written


def test_the_robot_is_shown_with_the_limits_of_the_file(limits):
    file = limits(ALL)
    told = trajevo("check-robot", "ur5", "--limits", file)
    assert told.returncode == 0, told.stdout
    rows = {line.split()[0]: line.split()[1:] for line in told.stdout.splitlines() if "_joint " in line}
    assert rows["shoulder_pan_joint"] == ["-6.28319", "6.28319", "2", "5", "50", "90"]
    assert rows["shoulder_lift_joint"] == ["-1", "1", "2", "5", "50", "150"]
    assert rows["elbow_joint"] == ["-3.14159", "3.14159", "2", "6.98132", "50", "150"]
    assert rows["wrist_2_joint"] == ["-6.28319", "6.28319", "3", "5", "inf", "28"]
    assert "limits are not in a URDF" not in told.stdout
    assert "0 errors" in told.stdout


def test_the_limits_shown_are_those_that_are_loaded(limits):
    file = limits(ALL)
    robot, shown = load_robot("ur5", tool="tool0", limits=file), examine("ur5", limits=file)
    for key in ("lower", "upper", "velocity", "acceleration", "jerk", "effort"):
        assert [getattr(row, key) for row in shown.joints] == getattr(robot.limits, key).tolist()


def test_everything_that_is_wrong_with_the_file_is_told_at_once(limits):
    file = limits(WRONG)
    told = trajevo("check-robot", "ur5", "--limits", file)
    assert told.returncode == 1
    errors = [line.removeprefix(f"error: {file}: ") for line in told.stdout.splitlines() if line.startswith("error: ")]
    for begins, ends in (
        ("line 2: shoulder_pan_joint: has_jerk_limits is true, but max_jerk is missing", ""),
        ("line 3: unknown joint 'shoulder_pam_joint'; ", "did you mean 'shoulder_pan_joint'?"),
        ("line 4: elbow_joint: unknown key 'max_velocitty'; ", "did you mean 'max_velocity'?"),
        ("line 4: elbow_joint: max_effort: expected a finite number, got 'much'", ""),
        ("line 5: wrist_1_joint: expected a mapping of limits, got 3.0", ""),
        ("joint 'shoulder_pan_joint': velocity: expected a positive number, got 0", ""),
        ("joint 'elbow_joint': position: lower must be below upper, got 2 and -2 rad", ""),
    ):
        assert [line for line in errors if line.startswith(begins) and line.endswith(ends)], begins
    assert len(errors) == 7
    assert "7 errors" in told.stdout
    assert "acceleration and jerk limits are not in a URDF" in told.stdout


@pytest.mark.parametrize(
    ("text", "says"), [("a: 1", "expected a mapping 'joint_limits'"), ("a: [", "cannot be read as YAML")]
)
def test_a_file_of_another_kind_is_an_error_beside_the_robots_own(limits, text, says):
    told = trajevo("check-robot", "ur5", "--limits", limits(text))
    assert told.returncode == 1
    assert says in told.stdout
    assert "shoulder_pan_joint" in told.stdout
    assert "1 error, " in told.stdout
    assert trajevo("check-robot", "ur5", "--limits", limits(text).with_name("none.yaml")).returncode == 1
