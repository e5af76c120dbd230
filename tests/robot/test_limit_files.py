"""Limits from arguments and from MoveIt's files, and locked joints."""

import json

import numpy as np
import pinocchio as pin
import pytest
import yaml

from tests.helpers import refused
from trajevo import load_robot
from trajevo.robot.examine import examine
from trajevo.robot.moveit_limits import read_joint_limits, write_joint_limits
from trajevo.robot.robot import robot_of

GIVEN = {"acceleration": 10.0, "jerk": 100.0}
PANDA = {"tool": "panda_hand_tcp", "lock": {"panda_finger_joint1": 0.02, "panda_finger_joint2": 0.01}}
NAMES = ("a", "b")
UNITS = ("rad", "rad")


@pytest.fixture
def moveit(tmp_path):
    def written(text):
        file = tmp_path / "joint_limits.yaml"
        file.write_text(text)
        return file

    return written


def test_limits_are_one_for_all_one_each_or_by_joint():
    each = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    robot = load_robot(
        "ur5",
        tool="tool0",
        limits={
            "acceleration": "180 deg/s^2",
            "jerk": each,
            "velocity": {"elbow_joint": 1.0},
            "position": {"wrist_3_joint": ["-90 deg", 1.0]},
            "effort": np.inf,
        },
    )
    np.testing.assert_allclose(robot.limits.acceleration, np.pi)
    np.testing.assert_array_equal(robot.limits.jerk, each)
    np.testing.assert_allclose(robot.limits.velocity, [3.15, 3.15, 1.0, 3.2, 3.2, 3.2])
    np.testing.assert_allclose(robot.limits.lower[[0, 5]], [-2.0 * np.pi, -0.5 * np.pi], atol=1e-6)
    assert robot.limits.upper[5] == 1.0
    assert np.isinf(robot.limits.effort).all()


def test_limits_given_go_before_those_of_a_robot_toml():
    robot = load_robot("puma560", limits={"jerk": 7.0})
    assert (robot.limits.jerk == 7.0).all()
    np.testing.assert_array_equal(robot.limits.velocity, load_robot("puma560").limits.velocity)


@pytest.mark.parametrize(
    ("limits", "says"),
    [
        (
            {},
            r"no acceleration limit for shoulder_pan_joint, .*robot.toml.*task.toml.*limits=\{\"acceleration\": 10.0\}",
        ),
        ({"acceleration": 1.0}, "no jerk limit for shoulder_pan_joint"),
        ({"acceleration": {"elbow_joint": 1.0}, "jerk": 1.0}, "no acceleration limit for shoulder_pan_joint"),
        (GIVEN | {"speed": 1.0}, "unknown limit 'speed'; known: acceleration, effort, jerk, position, velocity"),
        (GIVEN | {"velocity": [1.0, 2.0]}, "limits.velocity: expected 1 or 6 values, got 2"),
        (GIVEN | {"velocity": -1.0}, "joint 'shoulder_pan_joint': velocity: expected a positive limit, got -1"),
        (GIVEN | {"velocity": 0.0}, "velocity: expected a positive limit, got 0: give it in robot.toml"),
        (GIVEN | {"velocity": float("nan")}, "limits.velocity.shoulder_pan_joint: expected a number .rad/s. or inf"),
        (GIVEN | {"velocity": True}, "limits.velocity.shoulder_pan_joint: expected a number"),
        (GIVEN | {"velocity": "3 m/s"}, "expected a number and a unit that converts to rad/s, such as .*, got '3 m/s'"),
        (GIVEN | {"velocity": {"elbow": 1.0}}, "unknown joint in limits.velocity 'elbow'; known: elbow_joint"),
        (GIVEN | {"position": [1.0, -1.0]}, "joint 'shoulder_pan_joint': position: lower must be below upper"),
        (GIVEN | {"position": 1.0}, "limits.position.shoulder_pan_joint: expected 2 numbers, got 1.0"),
        (7, "limits: expected a mapping from limits to values or a MoveIt file, got 7"),
        ("nowhere.yaml", "nowhere.yaml: no such file"),
    ],
)
def test_limits_that_cannot_be_used_are_refused(limits, says):
    refused(lambda: load_robot("ur5", tool="tool0", limits=limits), says)


@pytest.mark.parametrize(
    ("lock", "says"),
    [
        (
            PANDA["lock"] | {"panda_finger": 0.0},
            "unknown joint to lock in .*panda.urdf 'panda_finger'; known: panda_finger_joint1",
        ),
        (
            PANDA["lock"] | {"panda_finger_joint1": float("inf")},
            "lock: expected a position of joint 'panda_finger_joint1'",
        ),
        (
            PANDA["lock"] | {"panda_finger_joint1": "open"},
            "lock: expected a position of joint 'panda_finger_joint1'.*got 'open'",
        ),
        (["panda_finger_joint1"], "lock: expected a mapping from joints to positions"),
        ({f"panda_joint{k}": 0.0 for k in range(1, 8)} | PANDA["lock"], "expected at least one joint left to move"),
    ],
)
def test_locks_that_cannot_be_used_are_refused(lock, says):
    refused(lambda: load_robot("panda", tool="panda_hand_tcp", lock=lock, limits=GIVEN), says)


def test_what_is_locked_still_weighs():
    robot = load_robot("panda", **PANDA, limits=GIVEN)
    assert robot.dof == 7
    whole = pin.buildModelFromUrdf(str(robot.urdf))
    q = np.random.default_rng(0).uniform(robot.limits.lower, robot.limits.upper)
    held = np.concatenate([q, [0.02, 0.01]])
    expected = pin.computeGeneralizedGravity(whole, whole.createData(), held)[:7] / 9.81 * 9.80665
    gravity = pin.computeGeneralizedGravity(robot.model, robot.model.createData(), q)
    np.testing.assert_allclose(gravity, expected, rtol=1e-9, atol=1e-9)


def test_continuous_joints_may_be_locked():
    continuous = {f"j2s6s200_joint_{k}": 0.5 for k in (1, 4, 6)}
    robot = load_robot("kinova", lock=continuous, tool="j2s6s200_end_effector", limits=GIVEN)
    assert robot.joint_names == ("j2s6s200_joint_2", "j2s6s200_joint_3", "j2s6s200_joint_5")


def test_settings_load_an_equal_robot():
    robot = load_robot("panda", **PANDA, limits=GIVEN)
    again = robot_of(robot.settings)
    assert again.settings == robot.settings
    np.testing.assert_array_equal(again.limits.jerk, robot.limits.jerk)
    assert load_robot("puma560").settings == "puma560"
    by_path = load_robot(robot.urdf, **PANDA, limits=GIVEN)
    assert by_path.settings["name"] == str(robot.urdf)
    refused(lambda: robot_of({"nam": "ur5"}), "robot: expected name and, if wanted, lock, tool")


def test_settings_hold_infinite_limits_and_those_of_files(moveit):
    text = "joint_limits:\n  joint_1: {has_velocity_limits: false, max_jerk: 9.0}\n"
    for limits in ({"effort": np.inf, "position": np.array([-np.inf, 3.0])}, moveit(text), str(moveit(text))):
        robot = load_robot("puma560", limits=limits)
        again = robot_of(json.loads(json.dumps(robot.settings, allow_nan=False)))
        for name in ("lower", "upper", "velocity", "jerk", "effort"):
            np.testing.assert_array_equal(getattr(again.limits, name), getattr(robot.limits, name))
    assert np.isinf(again.limits.velocity[0])


def test_free_flyers_are_refused():
    refused(lambda: load_robot("talos"), "robot 'talos': stands on a free-flyer.*ur5")


def test_several_tips_want_a_tool():
    refused(lambda: load_robot("ur5", limits=GIVEN), "tool: expected a frame, as the URDF has several tips: .*tool0")


def test_moveit_files_round_trip(moveit):
    limits = load_robot("puma560", limits={"effort": np.inf, "position": {"joint_1": [-np.inf, np.inf]}}).limits
    names = load_robot("puma560").joint_names
    text = write_joint_limits(limits, names)
    content = yaml.safe_load(text)["joint_limits"]
    assert content["joint_2"]["max_velocity"] == limits.velocity[1]
    assert content["joint_1"]["has_effort_limits"] is False
    again = load_robot("puma560", limits=moveit(text)).limits
    for name in ("lower", "upper", "velocity", "acceleration", "jerk", "effort"):
        np.testing.assert_array_equal(getattr(again, name), getattr(limits, name))


def test_moveit_s_scaling_factors_count(moveit):
    text = "default_velocity_scaling_factor: 0.1\njoint_limits:\n  a: {has_velocity_limits: true, max_velocity: 3.0}\n"
    assert read_joint_limits(moveit(text), ("a",), ("rad",)) == {"velocity": {"a": pytest.approx(0.3)}}
    refused(
        lambda: read_joint_limits(moveit(text), NAMES, UNITS),
        "default_velocity_scaling_factor: expected the velocity limit of 'b' too",
    )


def test_what_the_setup_assistant_leaves_open_is_not_given(moveit):
    text = "joint_limits:\n  elbow_joint: {has_acceleration_limits: false, max_acceleration: 0, max_jerk: 5.0}\n"
    refused(
        lambda: load_robot("ur5", tool="tool0", limits=moveit(text)), "no acceleration limit for shoulder_pan_joint, "
    )


def test_entries_of_locked_joints_are_passed_over(moveit):
    limits = "has_acceleration_limits: true, max_acceleration: 2.0, has_jerk_limits: false"
    names = [*(f"panda_joint{k}" for k in range(1, 8)), "panda_finger_joint1", "panda_finger_joint2"]
    text = "joint_limits:\n" + "".join(f"  {name}: {{{limits}}}\n" for name in names)
    robot = load_robot("panda", **PANDA, limits=moveit(text))
    assert (robot.limits.acceleration == 2.0).all()
    assert np.isinf(robot.limits.jerk).all()


def test_joints_of_a_robot_with_a_robot_toml_can_be_locked():
    whole, robot = load_robot("puma560"), load_robot("puma560", lock={"joint_4": 0.5})
    assert not examine("puma560", lock=["joint_4"]).errors
    assert robot.joint_names == ("joint_1", "joint_2", "joint_3", "joint_5", "joint_6")
    np.testing.assert_array_equal(robot.limits.jerk, np.delete(whole.limits.jerk, 3))
    q = np.array([0.1, -0.2, 0.3, 0.5, 0.4, -0.6])
    held = pin.computeGeneralizedGravity(whole.model, whole.model.createData(), q)
    gravity = pin.computeGeneralizedGravity(robot.model, robot.model.createData(), np.delete(q, 3))
    np.testing.assert_allclose(gravity, np.delete(held, 3), atol=1e-12)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("joint_limits: [", "cannot be read as YAML"),
        ("limits: 1", "expected a mapping 'joint_limits'"),
        ("joint_limits: {c: {}}", "joint_limits.yaml: line 1: unknown joint 'c'; known: a, b"),
        ("joint_limits: {a: 3}", "joint_limits.yaml: line 1: a: expected a mapping of limits, got 3"),
        ("joint_limits: {a: {max_speed: 3}}", "line 1: a: unknown key 'max_speed'; known: .*max_velocity"),
        (
            "joint_limits: {a: {has_velocity_limits: true}}",
            "has_velocity_limits is true, but max_velocity is missing",
        ),
        ("joint_limits: {a: {has_velocity_limits: 1, max_velocity: 3.0}}", "expected true or false, got 1"),
        ("joint_limits: {a: {max_velocity: fast}}", "a: max_velocity: expected a finite number, got 'fast'"),
        ("joint_limits: {a: {min_position: 0.0}}", "a: has_position_limits is true, but max_position is missing"),
        ("speed: 1\njoint_limits: {}", "line 1: unknown key 'speed'"),
        ("default_velocity_scaling_factor: 0\njoint_limits: {}", "expected a finite number above 0, got 0"),
    ],
)
def test_broken_moveit_files_are_refused(moveit, text, says):
    refused(lambda: read_joint_limits(moveit(text), NAMES, UNITS), says)


ONE = {"velocity": {"a": 1.5}, "acceleration": {"a": 5.0}, "jerk": {"a": 5000.0}}


@pytest.mark.parametrize(
    "text",
    [
        "joint_limits:\n  a: {max_velocity: 1.5, max_acceleration: 5.0, max_jerk: 5000.0}\n",
        "\ufeffjoint_limits: {a: {max_velocity: 15e-1, max_acceleration: 5, max_jerk: 5e3}}\n",
        "joint_limits:\n  a: {has_velocity_limits: yes, max_velocity: +1.5, max_acceleration: 5., max_jerk: 5E3}\n",
        "/**:\n  ros__parameters:\n    robot_description_planning:\n      joint_limits:\n"
        "        a: {max_velocity: 1.5, max_acceleration: 5.0, max_jerk: 5e+3}\n",
        "move_group:\n  ros__parameters:\n    planner: {name: pilz}\n    robot_description_planning:\n"
        "      joint_limits: {a: {max_velocity: 1.5, max_acceleration: 5.0, max_jerk: 5e3}}\n",
        "robot_description_planning:\n  default_velocity_scaling_factor: 0.5\n"
        "  joint_limits: {a: {max_velocity: 3, max_acceleration: 5, max_jerk: 5e3}}\n",
        "joint_limits:\n  a:\n    has_acceleration_limits: true\n    max_acceleration: 8.0\n"
        "    has_deceleration_limits: true\n    max_deceleration: -5.0\n    max_velocity: 1.5\n    max_jerk: 5e3\n",
        "usual: &usual {max_velocity: 9.0, max_acceleration: 5.0}\n"
        "planning: {joint_limits: {a: {<<: *usual, max_velocity: 1.5, max_jerk: 5e3}}}\n",
    ],
)
def test_every_dialect_of_moveit_files_is_read(moveit, text):
    assert read_joint_limits(moveit(text), ("a",), ("rad",)) == ONE


def test_angles_of_moveit_files_may_be_in_degrees(moveit):
    text = (
        "joint_limits:\n  a: {min_position: !degrees -90.0, max_position: deg(45), max_velocity: !degrees 180.0}\n"
        "  b: {max_velocity: !radians 2, max_acceleration: rad(3.0)}\n"
    )
    found = read_joint_limits(moveit(text), NAMES, UNITS)
    assert found["position"]["a"] == pytest.approx((-np.pi / 2, np.pi / 4), rel=1e-15)
    assert found["velocity"] == {"a": pytest.approx(np.pi, rel=1e-15), "b": 2.0}
    assert found["acceleration"] == {"b": 3.0}


def test_fast_joints_of_moveit_files_say_that_it_is_meant(moveit):
    fast = "joint_limits:\n  joint_1: {max_velocity: SPEED}\n"
    refused(
        lambda: load_robot("puma560", limits=moveit(fast.replace("SPEED", "180.0"))),
        "line 2: joint_1: max_velocity: 180 rad/s looks like degrees: write !degrees 180, or !radians 180 if it is",
    )
    robot = load_robot("puma560", limits=moveit(fast.replace("SPEED", "!radians 180.0")))
    again = robot_of(json.loads(json.dumps(robot.settings)))
    assert robot.limits.velocity[0] == again.limits.velocity[0] == 180.0


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("joint_limits: {a: {max_velocity: 1.0}, a: {}}", "line 1: 'a' is given twice, first in line 1"),
        (
            "joint_limits:\n  a:\n    max_jerk: 1\n    max_jerk: 2\n",
            "line 4: 'max_jerk' is given twice, first",
        ),
        (
            "joint_limits:\n  a: {max_velocity: 1:30}\n",
            "line 2: expected a decimal number, got '1:30', which diff",
        ),
        ("joint_limits: {a: {max_velocity: 010}}", "expected a decimal number, got '010'"),
        ("joint_limits: {a: {max_velocity: 0x10}}", "expected a decimal number, got '0x10'"),
        ("joint_limits: {a: {max_velocity: 1_000}}", "expected a decimal number, got '1_000'"),
        ("joint_limits: {a: {max_velocity: .inf}}", "max_velocity: expected a finite number, got '.inf'"),
        ("joint_limits: {a: {max_velocity: 1e999}}", "max_velocity: expected a finite number, got inf"),
        ("joint_limits: {a: {max_velocity: '1.0'}}", "max_velocity: expected a finite number, got '1.0'"),
        ("joint_limits: {a: {max_velocity: !degree 9}}", "unknown tag '!degree'; known: .*; did you mean '!degrees'"),
        ("joint_limits: {a: {max_velocity: !!python/object:os.x 9}}", "unknown tag .*python/object"),
        ("joint_limits: {a: {max_velocity: deg(pi)}}", "expected an angle as a number of deg, got 'pi'"),
        ("joint_limits: {a: {max_effort: !degrees 9}}", "max_effort: expected a number, got an angle"),
        ("joint_limits: {a: {max_deceleration: -5.0}}", "expected max_acceleration beside max_deceleration"),
        ("joint_limits: {a: {max_velocity: 1, max_veloctiy: 2}}", "unknown key 'max_veloctiy'; .*mean 'max_velocity'"),
        ("joint_limits: {a: [1, 2]}", "line 1: a: expected a mapping of limits, got "),
        ("x: {joint_limits: {a: {}}}\ny: {joint_limits: {a: {}}}", "a mapping 'joint_limits' .*, got 2 of them"),
        ("joint_limts: {a: {}}", "expected a mapping 'joint_limits' from joints to limits, got the keys 'joint_limts'"),
        ("joint_limits: {? [a] : 1}", "line 1: expected a name as key, got a sequence"),
        ("joint_limits:\n\t a: 1", "line 2, column 1: cannot be read as YAML: "),
        (
            "a: &a [1, 1, 1, 1]\n"
            + "".join(
                f"{new}: &{new} [{', '.join(['*' + old] * 9)}]\n" for old, new in zip("abcde", "bcdef", strict=True)
            ),
            "expected at most 20000 entries with all references written out",
        ),
        ("[" * 3000, "cannot be read as YAML"),
        ("{a: " * 20 + "1" + "}" * 20, "expected mappings at most 12 deep"),
        ("", "expected a mapping 'joint_limits' from joints to limits, got the keys none"),
    ],
)
def test_moveit_files_that_mean_different_things_are_refused(moveit, text, says):
    refused(lambda: read_joint_limits(moveit(text), NAMES, UNITS), f"joint_limits.yaml: .*{says}")


def test_lengths_are_no_angles(moveit):
    for text, says in (("!degrees 9", "expected a number .m/s., got an angle"), ("250.0", "looks like millimetres")):
        file = moveit(f"joint_limits: {{a: {{max_velocity: {text}}}}}")
        refused(lambda: read_joint_limits(file, ("a",), ("m",)), f"line 1: a: max_velocity: .*{says}")  # noqa: B023
