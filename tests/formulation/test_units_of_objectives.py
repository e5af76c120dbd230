"""Units of objectives: of a robot whose joints all turn, all slide, or do either."""

import pytest

from trajevo import load_robot
from trajevo.base.units import pretty
from trajevo.formulation.objectives import OBJECTIVES, unit_for
from trajevo.front.records import ObjectiveRecord
from trajevo.problems import HybridManipulator

#: By objective: pointing_mechanism turns, feed_drive slides, hybrid_manipulator does both.
SHOWN = {
    "time": ("s", "s", "s"),
    "jerk": ("rad/s³", "m/s³", "(rad or m)/s³"),
    "square_acceleration": ("rad²/s³", "m²/s³", "(rad or m)²/s³"),
    "square_jerk": ("rad²/s⁵", "m²/s⁵", "(rad or m)²/s⁵"),
    "energy": ("J", "J", "J"),
    "electrical_energy": ("J", "J", "J"),
    "square_power": ("W²·s", "W²·s", "W²·s"),
    "square_effort": ("(N·m)²·s", "N²·s", "(N·m or N)²·s"),
    "square_effort_rate": ("(N·m)²/s", "N²/s", "(N·m or N)²/s"),
    "peak_effort_rate": ("N·m/s", "N/s", "(N·m or N)/s"),
    "joint_travel": ("rad", "m", "rad or m"),
}


@pytest.mark.parametrize(("place", "name"), [*enumerate(["pointing_mechanism", "feed_drive", "hybrid_manipulator"])])
def test_each_term_has_the_unit_of_its_joint(place, name):
    robot = load_robot(name)
    shown = {each: pretty(unit_for(OBJECTIVES[each].unit, robot)) for each in SHOWN}
    assert shown == {each: units[place] for each, units in SHOWN.items()}


def test_no_unit_is_just_si():
    units = [objective.unit for objective in HybridManipulator().objectives]
    assert units == ["s", "W^2*s", "(rad or m)^2/s^5", "(rad or m)^2/s^3"]
    robots = [load_robot(name) for name in ("pointing_mechanism", "feed_drive", "hybrid_manipulator")]
    assert not any("SI" in unit_for(objective.unit, robot) for objective in OBJECTIVES.values() for robot in robots)


def test_records_that_say_si_are_read_with_the_units_of_the_joints():
    old = {"name": "jerk", "unit": "SI^2/s^5", "reference": "by name"}
    assert ObjectiveRecord.model_validate(old).unit == "(rad or m)^2/s^5"
    assert ObjectiveRecord.model_validate(old | {"name": "square_effort", "unit": "SI^2*s"}).unit == "(N*m or N)^2*s"
    assert ObjectiveRecord.model_validate(old | {"unit": "rad^2/s^5"}).unit == "rad^2/s^5"
