"""Robots with the traits of published ones go all the way, and MuJoCo has their efforts and places."""

import json
from pathlib import Path

import numpy as np
import pytest

from tests.helpers import mostly_long, refused
from tests.robot.mjcf_files import Mujoco
from tests.robot.published import ROBOTS
from tests.twin import without_shapes
from trajevo import Dynamics, Robot, ViaPointProblem, certify, export, load_robot, optimise, verify
from trajevo.robot.examine import examine
from trajevo.robot.robot import robot_of

GIVEN = {"acceleration": 5.0, "jerk": 60.0}

#: Links without mass: efforts are refused, and what is left is planned for.
MASSLESS = ("fanuc_m10ia", "abb_irb2400")
#: Effort limits of 0, which mean "not known" and have to be given.
NOT_KNOWN = (*MASSLESS, "staubli_rx160")


def loaded(name, folder):
    given = ROBOTS[name](folder)
    if isinstance(given, Robot):
        return given, {}
    if not (Path(given["name"]) / "robot.toml").is_file():
        given = {**given, "limits": GIVEN | given.get("limits", {})}
    return load_robot(**given), given


def middle(robot):
    """A point in the middle of the ranges, and a quarter of them, of ±1 where there is none."""
    limits = robot.limits
    finite = np.isfinite(limits.lower) & np.isfinite(limits.upper)
    low, high = np.where(finite, limits.lower, -1.0), np.where(finite, limits.upper, 1.0)
    return 0.5 * (low + high), 0.1 * np.minimum(high - low, 2.0)


@pytest.mark.parametrize("name", mostly_long(ROBOTS, *[*ROBOTS][::16], *NOT_KNOWN))
def test_it_goes_all_the_way(name, tmp_path):
    robot, given = loaded(name, tmp_path)
    if given:
        found = examine(given["name"], xacro=given.get("xacro"), lock=tuple(given.get("lock", ())))
        assert all("effort: expected a positive number, got 0" in error for error in found.errors)
        assert bool(found.errors) == (name in NOT_KNOWN)
        assert found.dof == robot.dof
    again = robot_of(json.loads(json.dumps(robot.settings)))
    centre, step = middle(robot)
    np.testing.assert_array_equal(again.tool_poses(centre[None])[0], robot.tool_poses(centre[None])[0])
    held = ["position", "velocity", "acceleration", "jerk", *(["effort"] if robot.gives_effort else [])]
    problem = ViaPointProblem(
        robot=robot,
        points=[centre - step, centre, centre + step],
        objectives=("time", "energy" if robot.gives_effort else "jerk"),
        constraints=held,
        duration_bounds=(0.05, 6.0),
    )
    front = optimise(problem, seed=1, population=12, generations=3, progress=False)
    knee = front.pick("0")
    assert verify(knee).passed
    assert certify(knee).proven
    for form, file in (("csv", "motion.csv"), ("ros2", "motion.yaml"), ("mujoco", "replay.csv")):
        export(knee, tmp_path / file, format=form)
        assert (tmp_path / file).stat().st_size > 100


@pytest.mark.parametrize("name", [name for name in ROBOTS if name not in MASSLESS])
def test_efforts_are_those_of_mujoco(name, tmp_path):
    robot, given = loaded(name, tmp_path)
    text = Path(given["name"]).read_text(encoding="utf-8") if robot.file_kind == "MJCF" else None
    if text is None:  # what xacro and tables give has no other text
        twin = Mujoco(without_shapes(robot.description()), robot.model.gravity.linear)
        columns = [twin.model.joint(each).dofadr[0] for each in robot.joint_names]
        twin.model.dof_armature[columns] = robot.friction.armature
    else:
        twin = Mujoco(text)
    q, v, a = np.random.default_rng(5).uniform(-1.2, 1.2, (3, 30, robot.dof))
    expected = twin.effort(robot, q, v, a)
    found = Dynamics(robot).effort(q[None], v[None], a[None])[0] - robot.friction.dry(v)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("name", MASSLESS)
def test_efforts_of_links_without_mass_are_refused(name, tmp_path):
    robot, given = loaded(name, tmp_path)
    refused(
        lambda: robot.check_masses("energy"), "energy needs masses, but these links have none in the model: .*link_1"
    )
    refused(
        lambda: load_robot(given["name"], tool=given["tool"], limits=GIVEN), "effort: expected a positive limit, got 0"
    )
