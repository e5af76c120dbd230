"""Grips and stands: from robot.toml and arguments, in which units, and what is refused."""

import shutil

import numpy as np
import pytest

from tests.helpers import refused
from trajevo import Grip, Stand, load_robot

ARM = "tests/data/two_link_drives"
GRIP = {"total_force": 100.0, "friction": 0.3}
STAND = {"mass": 10.0, "com": [0.0, 0.0, 0.0], "footprint": [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]}


def test_records_and_mappings_with_units_are_the_same():
    told = {"force_per_finger": "50 N", "friction": 0.3, "point": [0, 0, "20 mm"], "torsion": "5 mm"}
    grip = Grip(force_per_finger=50.0, friction=0.3, point=(0.0, 0.0, 0.02), torsion=0.005)
    assert load_robot(ARM, grip=told).grip == load_robot(ARM, grip=grip).grip == grip
    assert grip.pressing == Grip(total_force=100.0, friction=0.3).pressing == 100.0
    assert Grip(force_per_finger=50.0, friction=0.3, fingers=3).pressing == 150.0
    stand = Stand(mass=10.0, com=(0.0, 0.0, -0.4), footprint=STAND["footprint"])
    assert load_robot(ARM, stand=STAND | {"mass": "10000 g", "com": [0, 0, "-400 mm"]}).stand == stand
    robot = load_robot(ARM, grip=grip, stand=stand)
    again = load_robot(**robot.settings)
    assert (again.grip, again.stand) == (grip, stand)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (5, "grip: expected a mapping from force_per_finger, total_force, friction, .*, got 5"),
        ({**GRIP, "frictoin": 0.3}, "unknown key of grip 'frictoin'; known: .*did you mean 'friction'"),
        ({"total_force": 100.0}, "grip.friction: this key is missing"),
        ({"friction": 0.3}, r"grip.force_per_finger: expected either it or total_force \[N\], got neither"),
        (
            {**GRIP, "force_per_finger": 9.0},
            r"grip.force_per_finger: expected either it or total_force .*, got both",
        ),
        ({**GRIP, "total_force": "100 kg"}, "grip.total_force: expected a number and a unit that converts to N, such"),
        ({**GRIP, "total_force": 0.0}, "grip.total_force: expected a positive number, got 0.0"),
        ({**GRIP, "friction": np.nan}, "grip.friction: expected a positive number, got nan"),
        ({**GRIP, "friction": True}, "grip.friction: expected a positive number, got True"),
        ({**GRIP, "friction": 10**400}, "grip.friction: expected a positive number, got 1000"),
        ({**GRIP, "safety": 0.5}, "grip.safety: expected a factor of at least 1, got 0.5"),
        ({**GRIP, "fingers": 1}, "grip.fingers: expected a whole number from 2 to 1000, got 1"),
        ({**GRIP, "fingers": 2.0}, "grip.fingers: expected a whole number from 2 to 1000, got 2.0"),
        ({**GRIP, "fingers": 10**400}, "grip.fingers: expected a whole number from 2 to 1000, got 1000"),
        ({**GRIP, "closing_axis": [0, 0, 0]}, r"grip.closing_axis: expected a direction, got \(0, 0, 0\)"),
        ({**GRIP, "closing_axis": [0, 1]}, r"grip.closing_axis: expected shape \(3\), got \(2,\)"),
        ({**GRIP, "point": [0, np.inf, 0]}, r"grip.point: expected finite numbers, got inf at index \(1,\)"),
        ({**GRIP, "point": np.array([0, 1j, 0])}, r"grip.point: expected numbers of shape \(3\), got "),
        ({**GRIP, "torsion": -0.01}, "grip.torsion: expected a positive number, got -0.01"),
        ({**GRIP, "source": 3}, "grip.source: expected text, got 3"),
    ],
)
def test_other_grips_are_refused_with_a_sentence(given, says):
    refused(lambda: load_robot(ARM, grip=given), says)


def corners(*places):
    return {**STAND, "footprint": [list(place) for place in places]}


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ("table", "stand: expected a mapping from mass, com, footprint, source, got 'table'"),
        ({**STAND, "masss": 3.0}, "unknown key of stand 'masss'; known: .*did you mean 'mass'"),
        ({"mass": 3.0, "com": [0, 0, 0]}, "stand.footprint: this key is missing"),
        ({**STAND, "mass": -1.0}, r"stand.mass: expected a number from 0 on \[kg\], got -1.0"),
        ({**STAND, "mass": "10 N"}, "stand.mass: expected a number and a unit that converts to kg, such as"),
        ({**STAND, "com": [0, 0]}, r"stand.com: expected shape \(3\), got \(2,\)"),
        ({**STAND, "com": [0, 0, np.nan]}, r"stand.com: expected finite numbers, got nan at index \(2,\)"),
        (corners((0, 0, 0), (1, 0, 0)), "stand.footprint: expected at least 3 corners, got 2"),
        (corners((0, 0), (1, 0), (0, 1)), r"stand.footprint: expected shape \(corners, 3\), got \(3, 2\)"),
        (corners((0, 0, 0), (1, 0, 0), (2, 0, 0)), "stand.footprint: expected corners of a polygon with an area"),
        (corners((0, 0, 0), (0, 0, 0), (0, 0, 0)), "stand.footprint: expected corners of a polygon with an area"),
        (corners((0, 0, 0), (1, 0, 0), (1, 1, 0.1), (0, 1, 0)), "stand.footprint: expected corners in one plane, got"),
        (corners((0, 0, 0), (1, 0, 0), (0.2, 0.2, 0), (0, 1, 0)), "stand.footprint: expected corners of a convex"),
        (corners((0, 0, 0), (1, 1, 0), (1, 0, 0), (0, 2, 0)), "stand.footprint: expected corners of a convex polygon"),
        ({**STAND, "source": None, "footprint": "x"}, "stand.footprint: expected a number and a unit that converts"),
    ],
)
def test_other_stands_are_refused_with_a_sentence(given, says):
    refused(lambda: load_robot(ARM, stand=given), says)


@pytest.mark.parametrize(
    ("added", "says"),
    [
        ("[grip]\ntotal_force = 100.0\nfriction = 0.3\n", "grip.source: this key is missing"),
        ('[grip]\nsource = "x"\ntotal_force = 100.0\n', "grip.friction: this key is missing"),
        ('[grip]\nsource = "x"\nfriction = 0.3\n', r"grip.force_per_finger: expected either it or total_force \[N\]"),
        ('[grip]\nsource = "x"\nfriction = 0.3\ntotal_force = 1.0\npad = 3\n', "grip.pad: unknown key"),
        ('[stand]\nsource = "x"\nmass = 3.0\ncom = [0.0, 0.0, 0.0]\n', "stand.footprint: this key is missing"),
    ],
)
def test_mistakes_in_robot_toml_are_told(tmp_path, added, says):
    folder = tmp_path / "two_link_drives"
    shutil.copytree(ARM, folder)
    with (folder / "robot.toml").open("a", encoding="utf-8") as file:
        file.write(f"\n{added}")
    refused(lambda: load_robot(folder), says)
