"""Capacity over planes of tool positions: cells against Pinocchio's statics, reach, reference value, bad input."""

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pinocchio as pin
import pytest

from tests.helpers import mostly_long, refused, trajevo
from tests.reference import posture_by_scipy
from tests.robot.test_kinematics import ROBOTS
from trajevo import load_robot, plots
from trajevo.capacity.workspace import ToolPlane, workspace_capacity
from trajevo.path.inverse_kinematics import Pose
from trajevo.robot.kinematics import ToolKinematics
from trajevo.robot.payload import Payload

DOWN = np.diag([1.0, -1.0, -1.0])
STATIC_BOUND = 12.510810648896424
MIDDLE = np.array([0.366209868, 0.383288194, 0.201385220, -1.206252974, 0.661853632])


def hybrid_pose():
    position, rotation = (values[0] for values in load_robot("hybrid_manipulator").tool_poses(MIDDLE[None]))
    return Pose(position, rotation)


def found_for(name, cells=4, **options):
    return computed(name, cells, **options) if options else usual(name, cells)


@cache
def usual(name, cells):
    """What several tests ask for is computed once."""
    return computed(name, cells)


def computed(name, cells, **options):
    robot = load_robot(name, **ROBOTS[name])
    if name == "hybrid_manipulator":
        plane, options = ToolPlane.around(hybrid_pose(), "xy", reach=0.1, cells=cells), {"start": MIDDLE} | options
    else:
        plane = ToolPlane.around(Pose([0.55, 0.1, 0.3], DOWN), "xz", reach=0.5, cells=cells)
    return robot, workspace_capacity(robot, plane, **options)


@pytest.fixture(params=mostly_long(["ur5", "panda", "hybrid_manipulator"], "ur5", "hybrid_manipulator"), scope="module")
def cells(request):
    return found_for(request.param)


def effort_of_pinocchio(robot, mass, q, a):
    """Effort of one configuration at rest, with a point mass that is part of the tool's body."""
    model = robot.model.copy()
    frame = model.frames[model.getFrameId(robot.tool)]
    model.appendBodyToJoint(frame.parentJoint, pin.Inertia(mass, np.zeros(3), np.zeros((3, 3))), frame.placement)
    states = robot.transmission.motion(q, np.zeros_like(q), a)
    torque = robot.transmission.effort(q, pin.rnea(model, model.createData(), *states))
    return torque + robot.friction.armature * a


def test_the_binding_joint_of_a_cell_is_at_its_limit(cells):
    robot, found = cells
    still = np.zeros(robot.dof)
    bound = np.argwhere(np.isfinite(found.mass) & (found.mass > 0.0))
    assert len(bound) >= 4
    for row, column in bound:
        used = np.abs(effort_of_pinocchio(robot, found.mass[row, column], found.q[row, column], still))
        used = used / robot.limits.effort
        assert used.max() == pytest.approx(1.0, abs=1e-9)
        assert used[found.joint[row, column]] == pytest.approx(1.0, abs=1e-9)
        assert found.per_joint[row, column].min() == found.mass[row, column]


def test_the_tool_is_where_the_cell_says(cells):
    robot, found = cells
    positions, rotations = robot.tool_poses(found.q[found.reached])
    np.testing.assert_allclose(positions, found.plane.positions[found.reached], atol=1e-6)
    np.testing.assert_allclose(rotations - found.plane.pose.rotation, 0.0, atol=2e-6)
    assert (found.q[found.reached] >= robot.limits.lower).all()
    assert (found.q[found.reached] <= robot.limits.upper).all()


@pytest.mark.parametrize("name", mostly_long(["ur5", "panda"], "ur5"))
def test_cells_out_of_reach_are_nan(name):
    _, found = found_for(name, 3)
    far = np.linalg.norm(found.plane.positions, axis=-1) > 1.3
    assert far.any()
    assert np.isnan(found.mass[far]).all()
    assert (found.joint[far] == -1).all()
    assert np.isnan(found.per_joint[far]).all()
    assert not found.reached[far].any()
    assert (found.postures[far] == 0).all()
    assert found.reached.any()
    assert f"in {found.reached.sum()} of 9 cells" in str(found)


def test_static_bound_of_the_hybrid_manipulator_everywhere():
    _, found = found_for("hybrid_manipulator")
    assert found.reached.all()
    np.testing.assert_allclose(found.mass, STATIC_BOUND, atol=1e-8)
    assert (found.joint == 2).all()
    open_orientation = ToolPlane.around(Pose(hybrid_pose().position), "xy", reach=0.05, cells=2)
    anyhow = workspace_capacity(load_robot("hybrid_manipulator"), open_orientation, start=MIDDLE)
    assert anyhow.reached.all()
    np.testing.assert_allclose(anyhow.mass, STATIC_BOUND, atol=1e-8)


def test_an_accelerated_tool(cells):
    """Joint accelerations, checked by finite differences of the tool's position, give the wanted one."""
    robot, still = cells
    wanted = np.array([1.0, -0.5, 1.5])
    start = still.q[still.reached][0]
    position, rotation = (values[0] for values in robot.tool_poses(start[None]))
    here = ToolPlane(Pose(position, rotation), "xy", position[:1], position[1:2])
    found = workspace_capacity(robot, here, acceleration=wanted, start=start)
    q = found.q[0, 0]
    gravity = workspace_capacity(robot, here, start=start)
    assert found.acceleration.tolist() == wanted.tolist()
    # The least joint accelerations that give it, from the Jacobian by central differences.
    step = 1e-6
    poses = [robot.tool_poses(q + sign * step * np.eye(robot.dof))[0] for sign in (1.0, -1.0)]
    jacobian = ((poses[0] - poses[1]) / (2.0 * step)).T
    turns = [robot.tool_poses(q + sign * step * np.eye(robot.dof))[1].reshape(robot.dof, 9) for sign in (1.0, -1.0)]
    full = np.vstack([jacobian, ((turns[0] - turns[1]) / (2.0 * step)).T])
    a = np.linalg.lstsq(full, np.concatenate([wanted, np.zeros(9)]), rcond=1e-7)[0]
    np.testing.assert_allclose(jacobian @ a, wanted, atol=1e-6)
    used = np.abs(effort_of_pinocchio(robot, found.mass[0, 0], q, a)) / robot.limits.effort
    assert used.max() == pytest.approx(1.0, abs=1e-5)
    assert found.mass[0, 0] != pytest.approx(gravity.mass[0, 0], rel=1e-6)


def test_an_acceleration_that_the_mechanism_cannot_give_is_nan():
    """A point of the pointing mechanism stays on its sphere: from rest it can go along it, and not inwards."""
    robot = load_robot("pointing_mechanism")
    q = np.array([[0.4, -0.3]])
    position = robot.tool_poses(q)[0][0]
    plane = ToolPlane(Pose(position), "xz", position[:1], position[2:])
    along = workspace_capacity(robot, plane, acceleration=ToolKinematics.of(robot).jacobian(q)[0, :3, 0])
    assert not np.isnan(along.mass[0, 0])
    inwards = workspace_capacity(robot, plane, acceleration=-position)
    assert inwards.reached.all()
    assert np.isnan(inwards.mass[0, 0])
    assert inwards.joint[0, 0] == -1
    assert inwards.postures[0, 0] > 0


def test_a_posture_that_cannot_be_accelerated_so_is_not_taken():
    """A stretched elbow cannot pull the tool back at once, another posture of the same pose can."""
    robot = load_robot("ur5", **ROBOTS["ur5"])
    q = np.array([0.0, 0.0, 0.0, -1.0, -1.4, 0.2])  # the elbow stretched
    position, rotation = (values[0] for values in robot.tool_poses(q[None]))
    plane = ToolPlane(Pose(position, rotation), "xz", position[:1], position[2:])
    found = workspace_capacity(robot, plane, start=q, acceleration=[1.0, 0.0, 0.0])
    assert found.mass[0, 0] > 0.0
    assert np.abs(found.q[0, 0, 2]) > 0.1
    assert found.postures[0, 0] > 1


@pytest.mark.parametrize("starts", mostly_long([4, 10], 4))
def test_no_posture_found_elsewhere_carries_more(starts):
    """Postures by least squares from random starts: with the cell's payload none has a joint's effort to spare."""
    robot, found = found_for("ur5")
    generator, still = np.random.default_rng(5), np.zeros(6)
    cells, others = np.argwhere(found.reached)[::3], 0
    for row, column in cells:
        for start in generator.uniform(-np.pi, np.pi, (starts, 6)):
            q = posture_by_scipy(robot, found.plane.positions[row, column], DOWN, start)
            if q is not None:
                effort = effort_of_pinocchio(robot, found.mass[row, column], q, still)
                assert (np.abs(effort) / robot.limits.effort).max() >= 1.0 - 1e-6
                others += bool(np.abs(q - found.q[row, column]).max() > 0.1)
    assert others >= 2 * len(cells) >= 4


@pytest.mark.parametrize("seed", mostly_long([1, 2], 1))
def test_the_seed_makes_no_difference_without_redundancy(seed):
    _, first = found_for("ur5")
    _, other = found_for("ur5", seed=seed)
    np.testing.assert_array_equal(other.reached, first.reached)
    np.testing.assert_array_equal(other.postures, first.postures)
    np.testing.assert_allclose(other.mass, first.mass, rtol=1e-8)
    np.testing.assert_allclose(other.q, first.q, rtol=0.0, atol=1e-6)
    assert set(first.postures[first.reached].tolist()) <= {2, 4, 6, 8}
    assert first.postures.max() == 8
    assert (first.postures[~first.reached] == 0).all()


@pytest.mark.long
def test_a_redundant_arm_carries_nearly_the_same_from_any_seed():
    _, first = found_for("panda")
    _, other = found_for("panda", seed=1)
    np.testing.assert_array_equal(other.reached, first.reached)
    np.testing.assert_allclose(other.mass, first.mass, rtol=1e-2)
    assert first.postures.max() > 16


def test_equal_postures_are_taken_near_the_start():
    """A whole turn away carries the same."""
    robot, found = found_for("ur5", 2)
    row, column = np.argwhere(found.reached)[0]
    wound = found.q[row, column].copy()
    wound[0] -= 2.0 * np.pi * np.sign(wound[0])
    again = workspace_capacity(robot, found.plane, start=wound)
    np.testing.assert_allclose(again.mass, found.mass, rtol=1e-8)
    np.testing.assert_allclose(again.q[row, column], wound, rtol=0.0, atol=1e-6)


@pytest.mark.parametrize("cells", mostly_long([1, 2], 1))
def test_centre_of_mass_and_a_heavy_robot(cells):
    _, point = found_for("ur5", 2)
    _, far = found_for("ur5", 2, payload=Payload(1.0, (0.0, 0.0, 0.3)))
    known = point.reached
    assert (far.reached == known).all()
    assert (far.postures == point.postures).all()
    assert (far.mass[known] != point.mass[known]).any()
    plane = point.plane if cells == 2 else reached_cell(point)
    weak = load_robot("ur5", **{**ROBOTS["ur5"], "limits": {**ROBOTS["ur5"]["limits"], "effort": 1e-3}})
    found = workspace_capacity(weak, plane)
    assert found.reached.any()
    assert (found.mass[found.reached] == 0.0).all()
    free = load_robot("ur5", **{**ROBOTS["ur5"], "limits": {**ROBOTS["ur5"]["limits"], "effort": np.inf}})
    unlimited = workspace_capacity(free, plane)
    assert np.isinf(unlimited.mass[unlimited.reached]).all()
    assert (unlimited.joint == -1).all()


def reached_cell(found):
    """The plane of one of the cells that are reached."""
    row, column = np.argwhere(found.reached)[0]
    return replace(found.plane, columns=found.plane.columns[[column]], rows=found.plane.rows[[row]])


@pytest.mark.parametrize("cells", mostly_long([1, 2], 1))
def test_a_margin_is_kept_and_the_full_limits_are_told(tmp_path, cells):
    robot, whole = found_for("ur5", 2)
    _, found = found_for("ur5", 2, effort_margin=0.2)
    limits = ROBOTS["ur5"]["limits"] | {"effort": (0.8 * robot.limits.effort).tolist()}
    plane = found.plane if cells == 2 else reached_cell(found)
    weaker = workspace_capacity(load_robot("ur5", **(ROBOTS["ur5"] | {"limits": limits})), plane)
    mass = found.mass if cells == 2 else found.mass[found.reached][:1, None]
    np.testing.assert_allclose(mass, weaker.mass, rtol=1e-9)
    np.testing.assert_array_equal(found.at_full_limits.mass, whole.mass)
    assert (found.mass[found.reached] < whole.mass[found.reached]).all()
    assert whole.at_full_limits is None
    assert str(found).startswith("with your margin of 20 %: ")
    assert f"; at the robot's full limits: {whole}" in str(found)
    assert plots.workspace_capacity(found).get_title().endswith(", your margin of 20 % kept")
    options = [
        "--position",
        0.5,
        0.0,
        0.4,
        "--cells",
        2,
        "--reach",
        0.1,
        "--tool",
        "tool0",
        "--out",
        tmp_path / "m.png",
    ]
    told = trajevo("workspace-capacity", "ur5", *options, "--effort-margin", 0.2)
    assert told.returncode == 0, told.stderr
    assert "ur5: with your margin of 20 %:" in told.stdout
    refused(lambda: found_for("ur5", 2, effort_margin=1.0), "effort_margin: expected a share from 0 to below 1")


def test_coordinates_of_a_plane():
    plane = ToolPlane({"position": [9.0, 0.2, 0.3]}, "zx", [0.1, 0.4, 0.5], [1.0, 2.0])
    assert plane.positions.shape == (2, 3, 3)
    assert plane.positions[1, 2].tolist() == [2.0, 0.2, 0.5]
    around = ToolPlane.around(Pose([1.0, 2.0, 3.0]), "yz", reach=0.5, cells=3)
    assert around.columns.tolist() == [1.5, 2.0, 2.5]
    assert around.rows.tolist() == [2.5, 3.0, 3.5]


CASES = {
    "another plane": (lambda: ToolPlane.around(Pose([0.0] * 3), "xx"), "unknown plane 'xx'; known: xy"),
    "falling": (lambda: ToolPlane(Pose([0.0] * 3), "xy", [1.0, 0.0], [0.0]), "columns: expected increasing"),
    "none": (lambda: ToolPlane(Pose([0.0] * 3), "xy", [1.0], []), "rows: expected increasing"),
    "no pose": (lambda: ToolPlane(5, "xy", [1.0], [1.0]), "pose: expected a Pose"),
    "reach": (lambda: ToolPlane.around(Pose([0.0] * 3), "xy", reach=0.0), "reach: expected a positive length"),
    "cells": (lambda: ToolPlane.around(Pose([0.0] * 3), "xy", cells=1), "cells: expected a whole number"),
    "no plane": (lambda: workspace_capacity(load_robot("puma560"), 5), "plane: expected a ToolPlane, got int"),
    "acceleration": (lambda: found_for("ur5", 2, acceleration=[1.0]), r"acceleration: expected shape \(3\)"),
    "start": (lambda: found_for("ur5", 2, start=[1.0]), r"start: expected shape \(6\)"),
    "starts": (lambda: found_for("ur5", 2, starts=-1), "starts: expected a whole number"),
}


@pytest.mark.parametrize("case", CASES)
def test_bad_input_is_refused(case):
    refused(*CASES[case])


def test_pictures(cells):
    robot, found = cells
    ax = plots.workspace_capacity(found)
    assert ax.get_xlabel() == f"tool {found.plane.axes[0]} [m]"
    joints = plots.workspace_capacity(found, show="joint")
    labels = [text.get_text() for text in joints.get_legend().get_texts()]
    bound = np.unique(found.joint[found.joint >= 0])
    assert labels == [*(robot.joint_names[k] for k in bound), "not reached"]
    refused(lambda: plots.workspace_capacity(found, show="torque"), "unknown thing to show 'torque'")


def test_command_line(tmp_path):
    options = ["--position", 0.5, 0.0, 0.4, "--rpy", 3.14159265, 0, 0, "--cells", 2, "--reach", 0.1]
    fingers = ["--lock", "panda_finger_joint1=0", "--lock", "panda_finger_joint2=0", "--tool", "panda_hand_tcp"]
    done = trajevo("workspace-capacity", "panda", *options, *fingers, "--out", tmp_path / "map.png")
    assert done.returncode == 0, done.stderr
    assert "held at rest in 4 of 4 cells" in done.stdout
    assert re.search(r"postures found per cell: [1-9]\d* to \d+, of which the best was taken", done.stdout)
    assert "panda_joint" in done.stdout
    assert (tmp_path / "map.png").is_file()
    bad = trajevo("workspace-capacity", "panda", *options, "--lock", "panda_finger_joint1")
    assert bad.returncode == 2
    assert bad.stderr == "error: lock: expected JOINT=POSITION [rad or m], got 'panda_finger_joint1'\n"
    unwritable = trajevo("workspace-capacity", "ur5", *options, "--tool", "tool0", "--out", tmp_path / "no" / "map.png")
    assert unwritable.returncode == 2
    assert "cannot be written" in unwritable.stderr
