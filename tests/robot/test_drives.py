"""Drives of joints: from robot.toml, from arguments, in which units, and what is refused."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from trajevo import Drive, load_robot, load_task
from trajevo.errors import InvalidInputError, UnknownNameError

ARM = "tests/data/two_link_drives"
LIMITS = {"acceleration": 1.0, "jerk": 1.0}


def rods(**given):
    return load_robot("tests/data/rods.urdf", limits=LIMITS, **given)


def test_drives_of_a_file_are_in_si_and_keep_their_source():
    robot = load_robot(ARM)
    assert list(robot.drives) == ["shoulder", "elbow"]
    assert robot.drives["shoulder"].torque_speed == ((0.0, 120.0), (10.0, 0.0))
    assert robot.drives["elbow"].winding_resistance == 0.8
    assert robot.drives["elbow"].source == "made up for tests"
    assert rods().drives == {}


def test_arguments_complete_and_replace_what_the_file_says():
    robot = load_robot(
        ARM, drives={"elbow": {"continuous_torque": 9.0, "torque_speed": [["0 rpm", 50], ["60 rpm", 20.0]]}}
    )
    assert robot.drives["elbow"].continuous_torque == 9.0
    assert robot.drives["elbow"].torque_speed == ((0.0, 50.0), (pytest.approx(2.0 * np.pi), 20.0))
    assert robot.drives["elbow"].torque_constant == 0.1
    assert robot.drives["shoulder"] == load_robot(ARM).drives["shoulder"]


def test_a_record_is_as_good_as_a_mapping_and_can_be_loaded_again():
    drive = Drive(peak_torque=20.0, efficiency_driving=0.8, efficiency_driven=0.0, brake=True, source="sheet")
    robot = rods(drives={"q2": drive})
    assert robot.drives == {"q2": drive}
    again = load_robot(**robot.settings)
    assert again.drives == robot.drives
    assert again.settings == robot.settings


def test_units_of_joints_that_slide():
    line = [["0 m/s", 900], ["500 mm/s", 0]]
    robot = load_robot("feed_drive", drives={"x": {"peak_torque": "900 N", "torque_speed": line}})
    assert robot.drives["x"].torque_speed[1] == (0.5, 0.0)
    with pytest.raises(
        InvalidInputError, match=r"drives.x.peak_torque: expected .* a unit that converts to N, such as"
    ):
        load_robot("feed_drive", drives={"x": {"peak_torque": "900 N*m"}})


def test_rotors_are_armatures_that_are_declared_once():
    rotor = {"rotor_inertia": "50 g*cm^2", "gear_ratio": 100}
    assert rods(drives={"q1": rotor}).friction.armature == pytest.approx([0.05, 0.0])
    with pytest.raises(InvalidInputError, match=r"drives.q1.rotor_inertia: expected it once, but the joint"):
        rods(drives={"q1": rotor}, friction={"armature": {"q1": 0.05}})
    assert rods(drives={"q1": rotor}, friction={"armature": {"q2": 0.3}}).friction.armature == pytest.approx(
        [0.05, 0.3]
    )


def test_drives_of_locked_joints_count_for_nothing():
    robot = load_robot(ARM, lock={"elbow": 0.3}, drives={"elbow": {"peak_torque": 3.0}})
    assert list(robot.drives) == ["shoulder"]


def test_what_is_not_told_of_a_gear():
    assert Drive().efficiencies == (1.0, 1.0)
    assert Drive(efficiency_driving=0.75).efficiencies == (0.75, 0.75)
    assert Drive(efficiency_driving=0.75, efficiency_driven=2.0 - 1.0 / 0.75).efficiencies[1] == pytest.approx(
        2.0 / 3.0
    )


def test_heat_per_square_of_the_torque():
    """50 N·m through 101 turns at 0.135 N·m/A and 75 % are 4.889378 A, and 11.953008 W in 0.5 ohm."""
    drive = Drive(
        gear_ratio=101.0,
        torque_constant=0.135,
        winding_resistance=0.5,
        thermal_resistance=1.0,
        thermal_time_constant=1.0,
        efficiency_driving=0.75,
    )
    assert drive.rise_per_square * (50.0 / 0.75) ** 2 == pytest.approx(11.953008, abs=1e-6)
    assert drive.rise_per_square * (50.0 * 0.75) ** 2 == pytest.approx(3.782006, abs=1e-6)
    with pytest.raises(InvalidInputError, match=r"drive: expected torque_constant for a temperature, got none"):
        Drive(gear_ratio=1, winding_resistance=1, thermal_resistance=1, thermal_time_constant=1).rise_per_square  # noqa: B018


REFUSED = {
    "no mapping": (5, "drives: expected a mapping from joints to their drives, got 5"),
    "joint": ({"q3": {}}, "unknown joint in drives 'q3'; known: q1, q2"),
    "key": ({"q1": {"peak_torq": 1.0}}, "unknown key of drives.q1 'peak_torq'; known: .*did you mean 'peak_torque'"),
    "no drive": ({"q1": 5.0}, "drives.q1: expected a mapping from peak_torque, .*, got 5.0"),
    "unit": (
        {"q1": {"thermal_resistance": "2 K"}},
        "drives.q1.thermal_resistance: expected .* converts to K/W,",
    ),
    "negative": ({"q1": {"peak_torque": -1.0}}, "drives.q1.peak_torque: expected a positive number, got -1.0"),
    "text": ({"q1": {"gear_ratio": True}}, "drives.q1.gear_ratio: expected a positive number, got True"),
    "infinite": ({"q1": {"peak_torque": np.inf}}, "drives.q1.peak_torque: expected a positive number, got inf"),
    "share": (
        {"q1": {"efficiency_driving": 75.0}},
        "efficiency_driving: expected a share of at most 1, got 75",
    ),
    "only driven": (
        {"q1": {"efficiency_driven": 0.5}},
        "efficiency_driven: expected efficiency_driving with it",
    ),
    "rotor": ({"q1": {"rotor_inertia": 1e-4}}, "drives.q1.rotor_inertia: expected gear_ratio with it, got none"),
    "one point": ({"q1": {"torque_speed": [[0, 5]]}}, "drives.q1.torque_speed: expected points .* at least two, got"),
    "no points": (
        {"q1": {"torque_speed": "5 N*m"}},
        "torque_speed: expected points .* at least two, got '5 N",
    ),
    "triple": ({"q1": {"torque_speed": [[0, 5], [1, 2, 3]]}}, r"torque_speed: expected points .*, got \[1, 2, 3\]"),
    "start": ({"q1": {"torque_speed": [[1, 5], [2, 0]]}}, r"expected speeds that rise from 0, got \[1.0, 2.0\]"),
    "rising": ({"q1": {"torque_speed": [[0, 5], [2, 6]]}}, "expected torques that do not rise with the speed"),
    "continuous": (
        {"q1": {"continuous_torque": 9.0, "torque_speed": [[0, 5], [2, 0]]}},
        "drives.q1.continuous_torque: expected at most the greatest torque, 5, got 9",
    ),
    "brake": ({"q1": {"brake": 1}}, "drives.q1.brake: expected True or False, got 1"),
    "source": ({"q1": {"source": 1}}, "drives.q1.source: expected text, got 1"),
}


@pytest.mark.parametrize(("given", "message"), REFUSED.values(), ids=REFUSED)
def test_other_drives_are_refused_with_a_sentence(given, message):
    with pytest.raises((InvalidInputError, UnknownNameError), match=message):
        rods(drives=given)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[drives.elbow]", "[drives.elbo]", r"line \d+: \[drives.elbo\]: unknown joint 'elbo'; known: elbow, shoulder"),
        ('"2 K/W"', '"2 K"', r"line \d+: drives.shoulder.thermal_resistance: expected a number and a unit"),
        ('source = "made up for tests"\ntorque', "torque", r"drives.shoulder.source: this key is missing"),
        (
            '"45 N*m"',
            '"145 N*m"',
            "shoulder.continuous_torque: expected at most the greatest torque, 120, got 145",
        ),
        ("gear_ratio = 100\nwinding", 'gear_ratio = "100"\nwinding', "drives.shoulder.gear_ratio: "),
        ("thermal_resistance", "thermal_resistence", "thermal_resistence: unknown key"),
    ],
)
def test_mistakes_in_robot_toml_are_told_with_their_place(tmp_path, old, new, message):
    folder = tmp_path / "two_link_drives"
    shutil.copytree(ARM, folder)
    file = folder / "robot.toml"
    text = file.read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises((InvalidInputError, UnknownNameError), match=message):
        load_robot(folder)


def test_drives_in_a_task_complete_those_of_the_file(tmp_path):
    file = tmp_path / "task.toml"
    file.write_text(
        f"""
duration_bounds = [0.2, 5.0]
robot = {{ name = "{Path(ARM).resolve()}", drives = {{ elbow = {{ peak_torque = "50 N*m" }} }} }}
limits = {{ velocity = 5.0, acceleration = 20.0 }}
points = [{{ joints = [-1.5, 0.0] }}, {{ joints = [-0.5, 0.7] }}, {{ joints = [0.0, 1.5] }}]
""",
        encoding="utf-8",
    )
    drive = load_task(file).problem.robot.drives["elbow"]
    assert (drive.peak_torque, drive.torque_constant) == (50.0, 0.1)
