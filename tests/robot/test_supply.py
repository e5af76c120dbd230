"""Supplies of drives: from robot.toml, from tasks and arguments, in which units, and what is refused."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from tests.helpers import refused
from trajevo import Supply, load_robot, load_task
from trajevo.errors import InvalidInputError

ARM = "tests/data/two_link_drives"
LINK = {"link_capacitance": "470 µF", "link_voltage": "566 V", "chopper_voltage": 720.0}


def with_supply(given):
    return load_robot(ARM, supply=given)


def test_a_robot_without_a_supply_shares_a_link_and_stands_by_for_nothing():
    supply = load_robot(ARM).supply
    assert supply == Supply()
    assert (supply.recuperation, supply.standby, supply.storable) == ("shared", 0.0, 0.0)


def test_numbers_are_si_or_text_with_a_unit():
    supply = with_supply({"standby_power": "0.09 kW", **LINK}).supply
    assert supply.standby == pytest.approx(90.0)
    assert supply.link_capacitance == pytest.approx(470e-6)
    assert supply.storable == pytest.approx(0.5 * 470e-6 * (720.0**2 - 566.0**2))
    assert supply.voltage_with(0.0) == pytest.approx(566.0)


def test_arguments_complete_what_the_file_says_and_can_be_loaded_again(tmp_path):
    folder = tmp_path / "two_link_drives"
    shutil.copytree(ARM, folder)
    with (folder / "robot.toml").open("a", encoding="utf-8") as file:
        file.write('\n[supply]\nsource = "made up"\nstandby_power = "90 W"\nrecuperation = "none"\n')
    assert load_robot(folder).supply == Supply(standby_power=90.0, recuperation="none", source="made up")
    robot = load_robot(folder, supply={"recuperation": "full"})
    assert robot.supply == Supply(standby_power=90.0, recuperation="full", source="made up")
    assert load_robot(**robot.settings).supply == robot.supply
    record = Supply(standby_power=50.0)
    assert load_robot(**load_robot(ARM, supply=record).settings).supply == record


def test_a_supply_in_a_task(tmp_path):
    file = tmp_path / "task.toml"
    file.write_text(
        f"""
duration_bounds = [0.2, 5.0]
robot = {{ name = "{Path(ARM).resolve()}", supply = {{ standby_power = "80 W" }} }}
limits = {{ velocity = 5.0, acceleration = 20.0 }}
points = [{{ joints = [-1.5, 0.0] }}, {{ joints = [-0.5, 0.7] }}, {{ joints = [0.0, 1.5] }}]
objectives = ["time", "electrical_energy"]
""",
        encoding="utf-8",
    )
    problem = load_task(file).problem
    assert problem.robot.supply.standby == 80.0
    assert np.isfinite(problem.evaluate(0.5 * (problem.xl + problem.xu)[None])[0]).all()


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (5, "supply: expected a mapping from standby_power, peak_power, recuperation, .*, got 5"),
        ({"standby": 5.0}, "unknown key of supply 'standby'; known: .*did you mean 'standby_power'"),
        ({"standby_power": -1.0}, "supply.standby_power: expected a number from 0 on, got -1.0"),
        ({"standby_power": "90 V"}, r"supply.standby_power: expected a number and a unit that converts to W, such as"),
        ({"standby_power": np.nan}, "supply.standby_power: expected a number from 0 on, got nan"),
        ({"standby_power": True}, "supply.standby_power: expected a number from 0 on, got True"),
        ({"recuperation": np.zeros(2)}, "supply.recuperation: expected 'none', 'shared' or 'full', got array"),
        ({"recuperation": "all"}, "supply.recuperation: expected 'none', 'shared' or 'full', got 'all'"),
        (
            {"link_voltage": 566.0},
            "supply.link_voltage: expected link_capacitance and chopper_voltage with it, got none",
        ),
        ({**LINK, "link_capacitance": 0.0}, "supply.link_capacitance: expected a positive number, got 0.0"),
        (
            {**LINK, "chopper_voltage": 566.0},
            "supply.chopper_voltage: expected more than link_voltage, 566 V, got 566 V",
        ),
        ({**LINK, "recuperation": "full"}, "supply.link_capacitance: expected recuperation 'shared' with it, .*'full'"),
        ({"source": 3}, "supply.source: expected text, got 3"),
    ],
)
def test_other_supplies_are_refused_with_a_sentence(given, says):
    refused(lambda: with_supply(given), says)


def test_what_a_link_is_asked():
    with pytest.raises(InvalidInputError, match="supply: expected link_capacitance, link_voltage and chopper_voltage"):
        Supply().voltage_with(1.0)
    with pytest.raises(InvalidInputError, match=r"stored: expected an energy from 0 on \[J\], got -1.0"):
        with_supply(LINK).supply.voltage_with(-1.0)


@pytest.mark.parametrize(
    ("added", "says"),
    [
        ('[supply]\nstandby_power = "90 W"\n', r"supply.source: this key is missing"),
        ('[supply]\nsource = "x"\nrecuperation = "half"\n', r"supply.recuperation: expected"),
        ('[supply]\nsource = "x"\nlink = 3\n', r"supply.link: unknown key"),
        ('[supply]\nsource = "x"\nstandby_power = "90 K"\n', r"supply.standby_power: expected a number and a unit"),
    ],
)
def test_mistakes_in_robot_toml_are_told(tmp_path, added, says):
    folder = tmp_path / "two_link_drives"
    shutil.copytree(ARM, folder)
    with (folder / "robot.toml").open("a", encoding="utf-8") as file:
        file.write(f"\n{added}")
    refused(lambda: load_robot(folder), says)
