"""Solids for coal: the collision geometry of robots, meshes as convex hulls, and obstacles."""

from __future__ import annotations

from typing import Any

import coal
import numpy as np
import pinocchio as pin

from trajevo.arrays import Array
from trajevo.errors import InvalidInputError
from trajevo.robot import Robot
from trajevo.robot_check import checked_urdf
from trajevo.robot_model import held_still
from trajevo.scene import Box, Cylinder, Obstacle, Sphere


def robot_geometry(robot: Robot) -> Any:
    """Collision geometry on the joints of the robot's model, meshes as convex hulls."""
    text = checked_urdf(robot.urdf, robot.locked)
    whole = pin.buildModelFromXML(text)
    folders = [str(folder) for folder in robot.packages]
    try:
        geometry = pin.buildGeomFromUrdfString(whole, text, pin.GeometryType.COLLISION, package_dirs=folders)
    except (ValueError, RuntimeError) as error:
        said = " ".join(str(error).split())
        raise InvalidInputError(f"{robot.urdf}: Pinocchio cannot read its collision geometry: {said}") from error
    numbers_locked, held = held_still(whole, robot.urdf, robot.locked)
    places = whole.createData()
    pin.forwardKinematics(whole, places, held)
    # pin.buildReducedModel would do the same, but not where a link and a joint share a name, as in Unitree's Z1.
    for entry in geometry.geometryObjects:
        if isinstance(entry.geometry, coal.BVHModelBase):
            entry.geometry = _hull(entry.geometry, f"{robot.urdf}: mesh of {entry.name!r}")
        carrier = entry.parentJoint
        while carrier in numbers_locked:
            carrier = whole.parents[carrier]
        entry.placement = places.oMi[carrier].actInv(places.oMi[entry.parentJoint] * entry.placement)
        entry.parentJoint = robot.model.getJointId(whole.names[carrier]) if carrier else 0
    return geometry


def _hull(mesh: Any, where: str) -> Any:
    try:
        mesh.buildConvexHull(True, "Qt")  # not buildConvexRepresentation, which takes a mesh for convex as it is
    except RuntimeError as error:
        said = " ".join(str(error).split())
        raise InvalidInputError(f"{where}: expected a solid, its convex hull cannot be built: {said}") from error
    return mesh.convex


def bounding_ball(entry: Any) -> tuple[Array, float]:
    """A ball around a geometry, in the frame of its joint."""
    solid = entry.geometry
    solid.computeLocalAABB()
    centre, radius = np.array(solid.aabb_center), float(solid.aabb_radius)
    if isinstance(solid, coal.Convex):
        radius = float(np.linalg.norm(np.asarray(solid.points()) - centre, axis=1).max())
    moved: Array = entry.placement.act(centre)
    return moved, radius


def solid_of(obstacle: Obstacle) -> Any:
    """An obstacle's shape."""
    match obstacle:
        case Box():
            return coal.Box(*obstacle.size)
        case Sphere():
            return coal.Sphere(obstacle.radius)
        case Cylinder():
            return coal.Cylinder(obstacle.radius, obstacle.length)
    raise InvalidInputError(f"obstacle {obstacle.name!r}: expected a box, a sphere or a cylinder, got {obstacle!r}")
