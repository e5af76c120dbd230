"""Obstacles, and loads with a shape, in the viewer of an animation."""

from __future__ import annotations

from typing import Any

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.rollout import Rollout
from trajevo.formulation.constraints.clearance import scene_of
from trajevo.formulation.constraints.scene import Box, Cylinder, Obstacle, Plane, Sphere
from trajevo.front.front import Solution
from trajevo.path.loads import Load
from trajevo.plots.scenery import triangles_of

#: Colours of obstacles and of loads, and how far one sees through obstacles.
_OBSTACLE, _LOAD, _OPACITY = 0xB0A090, 0x2CA02C, 0.6

#: From meshcat's y axis, along which its cylinders lie, to z.
_FROM_Y_TO_Z = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


def obstacles_of(motion: Solution | Rollout) -> tuple[Obstacle, ...]:
    """Obstacles that the problem of a solution keeps a clearance to; none for a rollout, which knows no problem."""
    if not isinstance(motion, Solution):
        return ()
    scene = scene_of(motion.front.problem.constraints)
    return () if scene is None else scene.obstacles


def add_obstacles(view: Any, obstacles: tuple[Obstacle, ...]) -> None:
    """Draw obstacles where they stand; planes, which have no end, are left to others."""
    from meshcat import geometry

    material = geometry.MeshLambertMaterial(color=_OBSTACLE, opacity=_OPACITY, transparent=True)
    for k, obstacle in enumerate(obstacles):
        if isinstance(obstacle, Plane):
            continue
        shape, within = _shape(obstacle)
        view[f"obstacle_{k}"].set_object(shape, material)
        view[f"obstacle_{k}"].set_transform(_pose(obstacle) @ within)


def add_loads(view: Any, rollout: Rollout, tool: str) -> list[tuple[str, Load]]:
    """Draw loads with a shape: those that are always carried in the tool's frame, others by themselves.

    Args:
        view: where to draw.
        rollout: a single motion.
        tool: name of the tool's frame in the view.

    Returns:
        Names and loads of those that are picked up or put down, which have to be moved.
    """
    from meshcat import geometry

    schedule = rollout.dynamics.schedule
    moved: list[tuple[str, Load]] = []
    for k, load in enumerate(() if schedule is None else schedule.loads):
        if load.shape is None:
            continue
        shape, within = _shape(load.shape)
        name = f"load_{k}" if load.switched else f"{tool}/load_{k}"
        view[f"{name}/shape"].set_object(shape, geometry.MeshLambertMaterial(color=_LOAD))
        view[f"{name}/shape"].set_transform(_pose(load.shape) @ within)
        if load.switched:
            moved.append((name, load))
    return moved


def poses_of(rollout: Rollout, load: Load, times: Array) -> list[Array]:
    """Poses of the frame in which a load is drawn, (4, 4) each: the tool's while it is carried.

    Before it stands where it is picked up, and afterwards where it is put down. In a cycle in which it is carried
    across the seam it stands between.

    Args:
        rollout: a single motion.
        load: a load that is picked up or put down.
        times: instants, shape (T,) [s].
    """
    schedule, trajectory = rollout.dynamics.schedule, rollout.trajectory[0]
    if schedule is None:
        return []
    on = schedule.segments_of(schedule.loads.index(load))
    breaks = trajectory.breaks[0]
    first, last = (0, len(breaks) - 1) if on is None else (on[0], on[-1] + 1)
    picked, placed = float(breaks[first]), float(breaks[last])
    if picked < placed:
        held = np.clip(times, picked, placed)
    else:
        held = np.where((times > placed) & (times < picked), placed, times)
    positions, rotations = rollout.robot.tool_poses(trajectory.evaluate(held)[0])
    return [_matrix(rotation, position) for rotation, position in zip(rotations, positions, strict=True)]


def _shape(solid: Obstacle) -> tuple[Any, Array]:
    """Geometry of a solid for meshcat, and its pose in the solid's frame (4, 4)."""
    from meshcat import geometry

    match solid:
        case Box():
            return geometry.Box(list(solid.size)), np.eye(4)
        case Sphere():
            return geometry.Sphere(solid.radius), np.eye(4)
        case Cylinder():
            return geometry.Cylinder(solid.length, solid.radius), _matrix(_FROM_Y_TO_Z, np.zeros(3))
    corners = triangles_of(solid).reshape(-1, 3)
    return geometry.TriangularMeshGeometry(corners, np.arange(len(corners)).reshape(-1, 3)), np.eye(4)


def _pose(solid: Obstacle) -> Array:
    return _matrix(solid.rotation, np.array(solid.position))


def _matrix(rotation: Array, position: Array) -> Array:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation, position
    return matrix
