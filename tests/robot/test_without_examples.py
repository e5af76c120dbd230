"""Robots of others may be left out of an installation for their size."""

import sys

import pytest

from trajevo import load_robot
from trajevo.errors import UnknownNameError
from trajevo.robot.locate import list_example_robots


def test_without_the_robots_of_others_one_s_own_are_found(monkeypatch):
    assert "ur5" in list_example_robots()
    for name in [name for name in sys.modules if name.partition(".")[0] == "example_robot_data"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "example_robot_data", None)
    assert list_example_robots() == []
    assert load_robot("puma560").dof == 6
    with pytest.raises(UnknownNameError, match="'ur5'; known: .*puma560"):
        load_robot("ur5")
