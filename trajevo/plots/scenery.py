"""What stands around an arm and what is attached to its links, as triangles for pictures and animations."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError
from trajevo.formulation.constraints.clearance import scene_of
from trajevo.formulation.constraints.scene import Box, Capsule, Cylinder, Obstacle, Plane, Sphere
from trajevo.formulation.constraints.scenes.motions import ObstacleMotion
from trajevo.formulation.constraints.scenes.obstacles import Cornered
from trajevo.formulation.constraints.solids import attached_to
from trajevo.trajectory.arranged import base_rotations

#: Number of sides of what is round, and thickness of the slab that stands for a plane as a share of its width.
_SIDES, _THIN = 32, 0.004


class Surface(NamedTuple):
    """A solid for pictures.

    Attributes:
        triangles: corners, in the frame that carries it, counter-clockwise from outside, (M, 3, 3) [m].
        joint: number of the joint that carries it, 0 for the base.
        endless: whether it is part of a plane.
        attached: whether it is attached to a link.
        motion: how the frame that carries it moves by itself; None for a joint's frame or the base.
    """

    triangles: Array
    joint: int
    endless: bool = False
    attached: bool = False
    motion: ObstacleMotion | None = None


def scenery(motion: Any, middle: Array, width: float) -> list[Surface]:
    """The obstacles of a solution's problem, and what is attached to its robot.

    Args:
        motion: a solution; a rollout knows of no scene.
        middle: around which point planes are drawn, shape (3,) [m].
        width: how wide planes are drawn [m].
    """
    front = getattr(motion, "front", None)
    scene = None if front is None else scene_of(front.problem.constraints)
    if scene is None:
        return []
    arranged = motion.rollout.arranged
    back = _seen_from(None if arranged is None else arranged.bases, None if arranged is None else arranged.origin)
    drawn = [
        Surface(
            _placed(solid, *back(solid.rotation, np.array(solid.position)), middle, width),
            0,
            endless=isinstance(solid, Plane),
            motion=solid.motion,
        )
        for solid in scene.obstacles
    ]
    for solid, place in zip(
        (one.solid for one in scene.attached), attached_to(motion.rollout.robot, scene), strict=True
    ):
        drawn.append(Surface(_placed(solid, place.rotation, place.position, middle, width), place.joint, attached=True))
    return drawn


def _seen_from(bases: Array | None, origin: Array | None) -> Callable[[Array, Array], tuple[Array, Array]]:
    """What turns places in the cell into those in the frame in which the robot's base has not moved."""
    if bases is None or origin is None:
        return lambda rotation, position: (rotation, position)
    away, given = np.array(bases[0, :3].real), np.asarray(origin)
    turned = np.ascontiguousarray(base_rotations(np.asarray(bases[:1].real))[0].T)
    return lambda rotation, position: (turned @ rotation, given + turned @ (position - given - away))


def _placed(solid: Obstacle, rotation: Array, position: Array, middle: Array, width: float) -> Array:
    if isinstance(solid, Plane):
        position = middle + rotation[:, 2] * (rotation[:, 2] @ (position - middle))
    placed: Array = triangles_of(solid, width) @ rotation.T + position
    return placed


def triangles_of(solid: Obstacle, width: float = 1.0) -> Array:
    """Triangles of a solid in its own frame, counter-clockwise from outside, shape (M, 3, 3) [m].

    Args:
        solid: the solid.
        width: how wide a plane is drawn [m].

    Raises:
        InvalidInputError: no solid that can be drawn.
    """
    from scipy.spatial import ConvexHull  # imported where a solid is drawn, since that takes long

    points = _points(solid, width)
    hull = ConvexHull(points)
    corners: Array = points[hull.simplices]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = np.sum(across * hull.equations[:, :3], axis=1) < 0.0
    corners[inward] = corners[inward][:, ::-1]
    return corners


def _points(solid: Obstacle, width: float) -> Array:
    """Points whose convex hull a solid is, or nearly so, in its own frame, shape (N, 3) [m]."""
    turns = 2.0 * np.pi / _SIDES * np.arange(_SIDES)
    ring = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    match solid:
        case Box():
            return _prism(0.5 * np.array(solid.size[:2]) * [[-1, -1], [1, -1], [1, 1], [-1, 1]], 0.5 * solid.size[2])
        case Plane():
            square = 0.5 * width * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
            return _prism(square, 0.5 * _THIN * width) - [0.0, 0.0, 0.5 * _THIN * width]
        case Cylinder():
            return _prism(solid.radius * ring, 0.5 * solid.length)
        case Sphere():
            return _ball(ring, solid.radius)
        case Capsule():
            ball, along = _ball(ring, solid.radius), np.array([0.0, 0.0, 0.5 * solid.length])
            return np.concatenate([ball - along, ball + along])
        case Cornered():
            return solid.corners
    raise InvalidInputError(f"obstacle {solid.name!r}: expected a solid that can be drawn, got {solid!r}")


def _prism(base: Array, height: float) -> Array:
    return np.concatenate([np.column_stack([base, np.full(len(base), side * height)]) for side in (-1.0, 1.0)])


def _ball(ring: Array, radius: float) -> Array:
    heights = np.linspace(-0.5 * np.pi, 0.5 * np.pi, _SIDES // 2 + 1)
    inner = [np.column_stack([np.cos(at) * ring, np.full(len(ring), np.sin(at))]) for at in heights[1:-1]]
    return radius * np.concatenate([[[0.0, 0.0, -1.0]], *inner, [[0.0, 0.0, 1.0]]])
