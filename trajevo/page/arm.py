"""The robot in space as the page draws it: a chain of joints, shapes on them, and what stands around."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.front.front import Solution
from trajevo.page.packing import Packed
from trajevo.plots.scenery import Surface, scenery, triangles_of
from trajevo.robot.robot import Robot
from trajevo.robot.shapes.geometry import link_shapes
from trajevo.robot.shapes.kept import LinkShape
from trajevo.robot.transmission import Mimicking

#: Numbers of motions, and of their instants, that bound what is shown, and of the poses of obstacles that move.
_MOTIONS, _INSTANTS, _POSES = 3, 30, 120

#: Width of what is drawn of a plane, in extents of the motions.
_WIDE = 1.6

_SOLID, _ATTACHED, _LOAD = (0.69, 0.63, 0.56), (0.12, 0.47, 0.71), (0.17, 0.63, 0.17)


def arm(motion: Solution | Rollout, rollout: Rollout, pack: Packed) -> dict[str, Any]:
    """What the page needs to draw a robot at any instant of its motions.

    Args:
        motion: one of them; what stands around is known of a solution.
        rollout: the robot, which has a body, on all motions, some of which tell how far it reaches.
        pack: where the arrays go.
    """
    robot = rollout.robot
    rows = np.linspace(0, len(rollout.trajectory) - 1, _MOTIONS).astype(np.intp)
    few = rollout.trajectory.real_rows(rows)
    q = few.evaluate(few.duration[:, None] * np.linspace(0.0, 1.0, _INSTANTS)).reshape(-1, robot.dof)
    origins = robot.joint_poses(q)[0].reshape(_MOTIONS, -1, 3)
    seen = np.concatenate([np.zeros((_MOTIONS, 1, 3)), origins], axis=1)
    placed = None if rollout.arranged is None else rollout.arranged.placements
    if placed is not None:
        seen = seen @ placed[0][rows].real.swapaxes(1, 2) + placed[1][rows, None].real
    seen = seen.reshape(-1, 3)
    low, high = seen.min(axis=0), seen.max(axis=0)
    middle, extent = 0.5 * (low + high), max(float(np.linalg.norm(high - low)), 1e-9)
    shapes, why = _shapes(robot)
    around = scenery(motion, middle, _WIDE * extent)
    return {
        **_chain(robot),
        "middle": middle.tolist(),
        "extent": extent,
        "gravity": np.asarray(robot.model.gravity.linear).tolist(),
        "sticks": not shapes,
        "why": why,
        "surfaces": [
            *(_link(shape, pack) for shape in shapes),
            *(_surface(one, rollout, pack) for one in around),
        ],
        "loads": _loads(rollout, pack),
    }


def _chain(robot: Robot) -> dict[str, Any]:
    """Joints of the model, each in the frame of the joint before, and how actuators move them."""
    model, transmission = robot.model, robot.transmission
    axes, turns = robot.joint_axes
    frame = model.frames[model.getFrameId(robot.tool)]
    leads: Any = None
    if isinstance(transmission, Mimicking):
        leads = np.zeros((len(axes), robot.dof + 1))
        leads[list(transmission.own), range(robot.dof)] = 1.0
        for one in transmission.mimics:
            leads[one.column, [one.leader, -1]] = one.multiplier, one.offset
        leads = leads.tolist()
    return {
        "parents": [int(model.parents[k]) for k in range(1, model.njoints)],
        "places": [_matrix(model.jointPlacements[k]) for k in range(1, model.njoints)],
        "columns": [int(joint.idx_q) for joint in list(model.joints)[1:]],
        "axes": axes.tolist(),
        "turns": [bool(turn) for turn in turns],
        "leads": leads,
        "tool": {"joint": int(frame.parentJoint), "place": _matrix(frame.placement)},
    }


def _shapes(robot: Robot) -> tuple[tuple[LinkShape, ...], str]:
    """The links as they look; none, and a sentence that is a warning too, where their geometry cannot be read."""
    try:
        return link_shapes(robot), ""
    except InvalidInputError as error:
        why = f"{error}; the arm is drawn as sticks"
        warnings.warn(why, stacklevel=2)
        return (), why


def _link(shape: LinkShape, pack: Packed) -> dict[str, Any]:
    return {
        "joint": shape.joint,
        "kind": "link",
        "colour": list(shape.colour),
        "vertices": pack.add(shape.vertices, "f4"),
        "triangles": pack.add(shape.triangles, "u2" if len(shape.vertices) < 2**16 else "u4"),
    }


def _surface(surface: Surface, rollout: Rollout, pack: Packed) -> dict[str, Any]:
    corners = surface.triangles.reshape(-1, 3)
    found = {
        "joint": surface.joint,
        "kind": "plane" if surface.endless else "attached" if surface.attached else "obstacle",
        "colour": list(_ATTACHED if surface.attached else _SOLID),
        "vertices": pack.add(corners, "f4"),
        "triangles": None,
    }
    if surface.motion is not None:
        times = np.linspace(0.0, float(rollout.trajectory.duration.max()), _POSES)
        rotations, positions = surface.motion.poses(times)
        poses = np.tile(np.eye(4), (_POSES, 1, 1))
        poses[:, :3, :3], poses[:, :3, 3] = rotations, positions
        found |= {"times": pack.add(times, "f4"), "poses": pack.add(poses, "f4")}
    return found


def _loads(rollout: Rollout, pack: Packed) -> list[dict[str, Any]]:
    """Loads with a shape, in the tool's frame, and the first and the last break between which they are carried."""
    schedule, found = rollout.dynamics.schedule, []
    for k, load in enumerate(() if schedule is None else schedule.loads):
        if schedule is None or load.shape is None:
            continue
        placed = triangles_of(load.shape) @ load.shape.rotation.T + np.array(load.shape.position)
        on = schedule.segments_of(k)
        found.append(
            {
                "vertices": pack.add(placed.reshape(-1, 3), "f4"),
                "colour": list(_LOAD),
                "from": None if on is None else on[0],
                "to": None if on is None else on[-1] + 1,
            }
        )
    return found


def _matrix(place: Any) -> list[float]:
    """A placement as a matrix of homogeneous coordinates, column by column as WebGL has them."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = place.rotation, place.translation
    listed: list[float] = matrix.T.ravel().tolist()
    return listed
