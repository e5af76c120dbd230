"""The picture of several robots: what no robot beats stands out, and what is beaten is pale."""

from types import SimpleNamespace

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.colors import to_rgb

from tests.helpers import refused
from trajevo import plots

NAMES = ("time", "jerk", "price")


def robot(name, F, best):
    return SimpleNamespace(name=name, F=np.array(F, dtype=float).reshape(-1, 3), best=np.array(best, dtype=bool))


@pytest.fixture
def choice():
    robots = (
        robot("one", [[1.0, 3.0, 20.0], [2.0, 2.0, 20.0]], [True, False]),
        robot("two", [[3.0, 3.0, 30.0]], [False]),
        robot("none", [], []),
        robot("three", [[4.0, 0.5, 10.0]], [True]),
    )
    units = (("time", "s", 1.0), ("jerk", "deg/s^3", 180.0 / np.pi), ("price", "EUR", 1.0))
    yield SimpleNamespace(robots=robots, objective_names=NAMES, shown=lambda column: units[column])
    plt.close("all")


def test_what_is_beaten_is_pale_and_named(choice):
    ax = plots.robot_fronts(choice, objectives=("time", "jerk"))
    drawn = {line.get_label(): line for line in ax.lines}
    assert list(drawn) == ["one, beaten", "one", "two, never the best", "three"]
    np.testing.assert_allclose(drawn["one"].get_xydata(), [[1.0, 3.0 * 180.0 / np.pi]])
    assert sum(to_rgb(drawn["one, beaten"].get_color())) > sum(to_rgb(drawn["one"].get_color()))
    assert len({line.get_marker() for line in drawn.values()}) == 3
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("time [s]", "jerk [deg/s³]")


def test_three_objectives_are_drawn_in_space_and_given_axes_are_used(choice):
    space = plots.robot_fronts(choice)
    assert space.get_zlabel() == "price [EUR]"
    ax = plt.figure().add_subplot()
    assert plots.robot_fronts(choice, objectives=("price", "time"), ax=ax) is ax


def test_what_cannot_be_drawn_is_refused(choice):
    refused(lambda: plots.robot_fronts("which_robot"), "^choice: expected robots that were compared, .*, got str$")
    refused(lambda: plots.robot_fronts(choice, objectives=("time",)), "objectives: expected two or three of time, jerk")
    refused(lambda: plots.robot_fronts(choice, objectives=("time", "tme")), "unknown objective 'tme'")
    choice.robots = choice.robots[2:3]
    refused(lambda: plots.robot_fronts(choice), "choice: no robot has a motion to draw")
