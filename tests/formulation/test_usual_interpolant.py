"""Which interpolant a problem has unless one is asked for, and what its default front reaches."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.helpers import mostly_long
from trajevo import Robot, ViaPointProblem, certify, load_task, optimise
from trajevo.errors import UnknownNameError
from trajevo.path.via_points import ViaPoints
from trajevo.trajectory.interpolants import NAMED_INTERPOLANTS, usual_interpolant
from trajevo.trajectory.interpolants.usual import MOST_VARIABLES

THREE = [
    (-0.8, -1.9, 1.4, -1.2, -1.5, 0.3),
    (0.4, -1.0, 0.9, -1.6, -1.2, -0.8),
    (1.3, -1.6, 1.7, -0.9, -1.8, 1.0),
]


def six_joints(jerk: float = 200.0) -> Robot:
    return Robot.from_limits(
        velocity=[3.14] * 3 + [6.28] * 3, acceleration=[15.0] * 6, jerk=[jerk] * 6, names=list("abcdef")
    )


def problem(**given: Any) -> ViaPointProblem:
    return ViaPointProblem(**{"robot": six_joints(), "points": THREE, "duration_bounds": (0.02, 3.0)} | given)


def kind(**given: Any) -> str:
    return str(problem(**given).settings["interpolant"])


@pytest.mark.parametrize(
    "given",
    [
        {},
        {"objectives": ["time", "acceleration", "square_jerk"]},
        {"objectives": ["time", "peak_jerk", "joint_travel"]},
        {"constraints": ["velocity", "mean_velocity"]},
        {"overshoot": 0.1, "longest_time": 3.0},
        {"bspline": {"degree": 5, "control_points": 2}, "cyclic": False},
    ],
)
def test_motions_of_joints_alone_have_free_control_points(given: dict[str, Any]) -> None:
    assert kind(**given) == "bspline"


def energy_of_my_own(rollout: Any) -> np.ndarray[Any, Any]:
    return np.asarray(rollout.trajectory.duration)


@pytest.mark.parametrize(
    "given",
    [
        {"objectives": ["time", energy_of_my_own]},
        {"cyclic": True, "points": [*THREE, THREE[0]]},
        {"extra_points": 1},
        {"passing": [{"point": 1, "stop": True}]},
        {"moving": [{"point": 1, "joints": [0.1] * 6}]},
        {"points": [*THREE, *THREE[:1], THREE[1]]},
        {"points": [np.full(6, 0.1 * k * (-1) ** k) for k in range(50)]},
    ],
)
def test_whatever_else_is_asked_for_leaves_the_times_alone_free(given: dict[str, Any]) -> None:
    assert kind(**given) == "quintic_spline"


@pytest.mark.parametrize("name", ["ur5_pick_and_place", "xarm7_obstacle"])
def test_efforts_and_obstacles_leave_the_times_alone_free(name: str) -> None:
    settings = dict(load_task(name).problem.settings)
    del settings["interpolant"]
    assert ViaPointProblem(**settings).settings["interpolant"] == "quintic_spline"


@pytest.mark.parametrize(
    "given", [{"tool_speed": 1.0}, {"objectives": ["time", "energy"]}, {"constraints": ["effort"]}]
)
def test_what_needs_a_body_leaves_the_times_alone_free(given: dict[str, Any]) -> None:
    points = [[0.0, -1.5, 1.5, -1.5, -1.5, 0.0], [0.8, -1.2, 1.4, -1.7, -1.5, 0.0]]
    assert (
        kind(
            robot={"name": "ur5", "tool": "tool0", "limits": {"acceleration": 10.0, "jerk": 100.0}},
            points=points,
            **given,
        )
        == "quintic_spline"
    )


@pytest.mark.parametrize(("points", "joints"), [(2, 1), (3, 6), (4, 6), (5, 3), (2, 30), (7, 2)])
def test_the_number_of_variables_is_that_of_the_b_spline(points: int, joints: int) -> None:
    drawn = np.random.default_rng(points).uniform(-1.0, 1.0, (points, joints))
    robot = Robot.from_limits(velocity=[1.0] * joints, acceleration=[5.0] * joints, jerk=[50.0] * joints)
    via = ViaPoints(drawn)
    few = ViaPointProblem(robot=robot, points=drawn, interpolant="bspline").n_var <= MOST_VARIABLES
    assert usual_interpolant(via, of_joints_alone=True) == ("bspline" if few else "quintic_spline")
    assert usual_interpolant(via, of_joints_alone=False) == "quintic_spline"


def test_every_usual_interpolant_has_its_name() -> None:
    for alone in (False, True):
        assert usual_interpolant(ViaPoints(np.array(THREE)), of_joints_alone=alone) in NAMED_INTERPOLANTS.all()


def test_a_joint_that_is_where_it_was_at_all_points_stands() -> None:
    points = np.array(THREE)
    points[:, 4] = 0.5
    standing = problem(points=points)
    assert standing.settings["interpolant"] == "bspline"
    assert not any(variable.name.startswith("e of ") for variable in standing.variables)
    X = np.random.default_rng(0).uniform(standing.xl, standing.xu, (20, standing.n_var))
    motion = standing.decode(X)
    np.testing.assert_allclose(motion.peak(1)[:, 4], 0.0, atol=1e-12)
    again = ViaPointProblem(**standing.settings)
    np.testing.assert_array_equal(again.evaluate(X)[0], standing.evaluate(X)[0])


def test_a_point_on_a_limit_leaves_the_times_alone_free() -> None:
    low = [-3.0, -1.9, -3.0, -3.0, -3.0, -3.0]
    robot = Robot.from_limits(
        velocity=[3.14] * 6, acceleration=[15.0] * 6, jerk=[200.0] * 6, position=np.stack([low, [3.0] * 6], axis=1)
    )
    near = [(*THREE[0][:1], -1.8, *THREE[0][2:]), *THREE[1:]]
    assert kind(robot=robot, points=near) == "bspline"
    assert kind(robot=robot, points=[THREE[1], THREE[0], THREE[2]]) == "quintic_spline"


def test_a_problem_made_again_from_its_settings_keeps_its_interpolant() -> None:
    usual = problem()
    again = ViaPointProblem(**usual.settings)
    assert again.settings == usual.settings
    asked = problem(interpolant="quintic_spline")
    assert ViaPointProblem(**asked.settings).settings["interpolant"] == "quintic_spline"


# A B-spline of degree 5 with 24 even control points, optimised by another package, needs 1.346 and 1.278 s.
FEW = {"population": 24, "generations": 6}


@pytest.mark.parametrize(
    ("jerk", "most", "search"),
    mostly_long([(200.0, 1.346, FEW), (200.0, 1.346, {}), (2000.0, 1.278, {})], (200.0, 1.346, FEW), several=True),
)
def test_the_default_front_ends_before_an_even_b_spline_of_24_points(
    jerk: float, most: float, search: dict[str, Any]
) -> None:
    front = optimise(problem(robot=six_joints(jerk)), seed=1, progress=False, **search)
    fastest = front.least("time")
    assert fastest.F["time"] <= most
    assert certify(fastest).proven


@pytest.mark.parametrize("given", ["", "splines", "None"])
def test_a_name_that_is_none_is_no_usual_one(given: str) -> None:
    with pytest.raises(UnknownNameError, match="interpolant"):
        problem(interpolant=given)
