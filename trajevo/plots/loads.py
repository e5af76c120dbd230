"""Loads with a shape in the viewer of an animation."""

from __future__ import annotations

from typing import Any

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.rollout import Rollout
from trajevo.path.loads import Load
from trajevo.plots.scenery import mesh_of, pose_matrix, triangles_of

#: Colour of loads.
_LOAD = 0x2CA02C


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
        name = f"load_{k}" if load.switched else f"{tool}/load_{k}"
        view[f"{name}/shape"].set_object(mesh_of(triangles_of(load.shape)), geometry.MeshLambertMaterial(color=_LOAD))
        view[f"{name}/shape"].set_transform(pose_matrix(load.shape.rotation, np.array(load.shape.position)))
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
    return [pose_matrix(rotation, position) for rotation, position in zip(rotations, positions, strict=True)]
