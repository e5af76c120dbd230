"""Solids carried by joints: bounds of their motion, and derivatives of their distances."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, final

import coal
import numpy as np
import pinocchio as pin

from trajevo.base.arrays import Array, row_products
from trajevo.errors import InvalidInputError, UnknownNameError, checked_name
from trajevo.formulation.constraints.scene import Scene
from trajevo.formulation.constraints.scenes.obstacles import (
    SHAPES,
    Box,
    Capsule,
    Cornered,
    Cylinder,
    Mesh,
    Obstacle,
    Plane,
    Sphere,
)
from trajevo.robot.robot import Robot
from trajevo.robot.shapes.gantry import carriage_of
from trajevo.robot.shapes.geometry import read_geometry, said


@final
@dataclass(frozen=True, eq=False)
class _Kept:
    """A robot's geometry, what was derived from it, and time and size of the files that its meshes are from."""

    geometry: Any
    derived: dict[str, Any]
    files: tuple[tuple[int, int] | None, ...]


#: The geometry of robots that this process has used last: meshes are read and hulls are built once.
_kept: OrderedDict[Any, _Kept] = OrderedDict()
_MOST_KEPT = 8


#: Greatest number of vertices that bound no solid, and least thickness of one as a share of its length.
_CORNERS, _FLAT = 3, 1e-6


def robot_geometry(robot: Robot, *, with_own: bool = True) -> tuple[Any, dict[str, Any]]:
    """Collision geometry on the joints of the robot's model, meshes as convex hulls.

    Args:
        robot: the robot.
        with_own: whether it has to have geometry of its own.

    Returns:
        Pinocchio's geometry model, to which obstacles can be added, and what callers have derived from the geometry by
        name, to which they can add: it is kept as long as the robot and its files stay the same.

    Raises:
        InvalidInputError: the robot has no URDF, which alone holds such geometry, or it cannot be read.
    """
    robot.check_body("a clearance")
    if with_own and robot.urdf is None and "<collision" not in robot.written:
        raise InvalidInputError(
            f"robot {robot.name!r}: a clearance needs <collision> geometry, which only a URDF holds, and this robot is "
            "made from a Denavit-Hartenberg table: give its links solids by [[scene.attached]]"
        )
    text = robot.checked_text()
    locked = tuple(sorted(robot.locked.items()))
    key = robot.urdf, text, tuple(map(str, robot.packages)), locked, tuple(robot.model.names)
    kept = _kept.get(key)
    if kept is None or kept.files != _files(kept.geometry):
        geometry = _read(robot)
        kept = _Kept(geometry, {}, _files(geometry))
        _kept[key] = kept
        while len(_kept) > _MOST_KEPT:
            _kept.popitem(last=False)
    _kept.move_to_end(key)
    return kept.geometry.copy(), kept.derived


def _files(geometry: Any) -> tuple[tuple[int, int] | None, ...]:
    """Time and size of the files of meshes; None for a geometry without a file, or a file that is gone."""
    found: list[tuple[int, int] | None] = []
    for entry in geometry.geometryObjects:
        try:
            stat = Path(entry.meshPath).stat()
        except OSError:
            found.append(None)
        else:
            found.append((stat.st_mtime_ns, stat.st_size))
    return tuple(found)


def _read(robot: Robot) -> Any:
    geometry = read_geometry(robot, "collision")
    carriage = carriage_of(robot)
    for entry in geometry.geometryObjects:
        if carriage is not None and entry.parentJoint == 0:  # the base itself moves
            entry.parentJoint, entry.placement = carriage.joint, carriage.place * entry.placement
    for entry in geometry.geometryObjects:
        if isinstance(entry.geometry, coal.BVHModelBase):
            entry.geometry = _hull(entry.geometry, f"{robot.where}: mesh of {entry.name!r}")
        if isinstance(entry.geometry, coal.Sphere):
            entry.geometry = _ball(entry.geometry.radius)
    return geometry


def _hull(mesh: Any, where: str) -> Any:
    points = np.asarray(mesh.vertices())
    whole = len(points) > _CORNERS and bool(np.isfinite(points).all())
    extents = np.linalg.svd(points - points.mean(axis=0), compute_uv=False) if whole else np.zeros(1)
    if not extents[-1] > _FLAT * extents[0]:  # for which coal ends the process
        raise InvalidInputError(f"{where}: expected a solid, got {len(points)} vertices in one plane")
    try:
        mesh.buildConvexHull(True, "Qt")  # not buildConvexRepresentation, which assumes that the mesh is convex
    except (RuntimeError, ValueError) as error:
        raise InvalidInputError(f"{where}: expected a solid, its convex hull cannot be built: {said(error)}") from error
    return mesh.convex


def _ball(radius: float) -> Any:
    """A ball for coal, which finds wrong depths of its own balls in cylinders."""
    return coal.Capsule(radius, 0.0)


def bounding_ball(entry: Any) -> tuple[Array, float]:
    """Centre (3,) and radius [m] of a ball around a geometry, in the frame of its joint."""
    solid = entry.geometry
    solid.computeLocalAABB()
    centre, radius = np.array(solid.aabb_center), float(solid.aabb_radius)
    if isinstance(solid, coal.Capsule):
        radius = float(solid.halfLength + solid.radius)
    if isinstance(solid, coal.Convex):
        radius = float(np.linalg.norm(np.asarray(solid.points()) - centre, axis=1).max())
    moved: Array = entry.placement.act(centre)
    return moved, radius


def solid_of(obstacle: Obstacle) -> Any:
    """An obstacle's shape for coal."""
    match obstacle:
        case Box():
            return coal.Box(*obstacle.size)
        case Sphere():
            return _ball(obstacle.radius)
        case Cylinder():
            return coal.Cylinder(obstacle.radius, obstacle.length)
        case Capsule():
            return coal.Capsule(obstacle.radius, obstacle.length)
        case Plane():
            return coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0)
        case Cornered():
            mesh = coal.BVHModelOBBRSS()
            mesh.beginModel(1, len(obstacle.corners))
            mesh.addVertices(obstacle.corners)
            mesh.endModel()
            source = obstacle.file if isinstance(obstacle, Mesh) else "points"
            return _hull(mesh, f"obstacle {obstacle.name!r}: {source}")
    raise InvalidInputError(f"obstacle {obstacle.name!r}: expected one of {', '.join(SHAPES)}, got {obstacle!r}")


@final
@dataclass(frozen=True, eq=False)
class Assembly:
    """The solids of a robot, what is attached to it and carried, and the obstacles around it.

    Attributes:
        geometry: Pinocchio's geometry model of all of them, in this order; of the obstacles, those that move come
            first, placed in the frames that move.
        derived: see :func:`robot_geometry`; of its own where something is attached or carried.
        names: a name of each for messages.
        count: number of those that belong to the robot, what is attached and carried included.
        labels: what ``touches`` calls each: the link, the body or the obstacle.
        touches: names of those from which each need not stay away.
    """

    geometry: Any
    derived: dict[str, Any]
    names: list[str]
    count: int
    labels: list[str]
    touches: list[tuple[str, ...]]

    def may_touch(self, first: int, second: int) -> bool:
        """Whether two of them need not stay away from each other."""
        return self.labels[first] in self.touches[second] or self.labels[second] in self.touches[first]


def assembled(robot: Robot, scene: Scene, carried: tuple[Obstacle, tuple[str, ...]] | None = None) -> Assembly:
    """The solids of a robot in a scene.

    Args:
        robot: the robot.
        scene: what is around it and attached to it.
        carried: a solid in the tool frame and the names of what it may touch; None for none.

    Raises:
        InvalidInputError: the robot has no geometry, or a mesh cannot be read.
        UnknownNameError: something is attached to, or may touch, what does not exist.
    """
    geometry, derived = robot_geometry(robot, with_own=not scene.attached)
    names = [entry.name for entry in geometry.geometryObjects]
    labels = [name.rpartition("_")[0] for name in names]
    fixed = [one.solid for one in scene.attached]
    for one in scene.attached:
        geometry.addGeometryObject(_on_frame(robot, one.solid, one.on, "attached"))
    added = [(solid.name, solid.touches) for solid in fixed]
    if carried is not None:
        geometry.addGeometryObject(_on_frame(robot, carried[0], robot.tool, "carried"))
        added.append((carried[0].name, carried[1]))
    count = len(geometry.geometryObjects)
    around = (*scene.moving, *scene.still)
    for obstacle in around:
        placement = pin.SE3(obstacle.rotation, np.array(obstacle.position))
        # Obstacles may have the names of links, but Pinocchio needs unique names.
        entry = pin.GeometryObject(f"obstacle {obstacle.name}", 0, placement, solid_of(obstacle))
        geometry.addGeometryObject(entry)
    for entry in geometry.geometryObjects:
        entry.geometry.computeLocalAABB()
    _check_touches(robot, scene)
    rest = [*added, *((obstacle.name, obstacle.touches) for obstacle in around)]
    own: list[tuple[str, ...]] = [()] * len(labels)
    return Assembly(
        geometry,
        # What is kept with the robot's geometry is that of the robot alone.
        {} if added or scene.moving else derived,
        [*names, *(name for name, _ in rest)],
        count,
        [*labels, *(name for name, _ in rest)],
        [*own, *(named for _, named in rest)],
    )


def _on_frame(robot: Robot, solid: Obstacle, on: str, what: str) -> Any:
    """A solid on the joint that carries a frame, for Pinocchio."""
    model, kind = robot.model, pin.FrameType.BODY
    if not model.existFrame(on):
        raise UnknownNameError(f"link that carries {what} {solid.name!r}", on, _links(robot))
    # A link and a joint may share a name.
    frame = model.frames[model.getFrameId(on, kind) if model.existFrame(on, kind) else model.getFrameId(on)]
    placement = frame.placement * pin.SE3(solid.rotation, np.array(solid.position))
    return pin.GeometryObject(f"{what} {solid.name}", frame.parentJoint, placement, solid_of(solid))


class Carrier(NamedTuple):
    """Where an attached solid is.

    Attributes:
        joint: number of the joint of the model that carries it, 0 for the base.
        rotation: from its axes to those of the joint, shape (3, 3).
        position: of its own frame in that of the joint, shape (3,) [m].
    """

    joint: int
    rotation: Array
    position: Array


def attached_to(robot: Robot, scene: Scene) -> list[Carrier]:
    """Where each of the solids is that a scene attaches to a robot."""
    entries = (_on_frame(robot, one.solid, one.on, "attached") for one in scene.attached)
    return [
        Carrier(int(entry.parentJoint), entry.placement.rotation.copy(), entry.placement.translation.copy())
        for entry in entries
    ]


def _links(robot: Robot) -> list[str]:
    return [frame.name for frame in robot.model.frames if frame.type == pin.FrameType.BODY]


def _check_touches(robot: Robot, scene: Scene) -> None:
    fixed, links = [one.solid for one in scene.attached], _links(robot)
    for solids, known in (
        (scene.obstacles, [*links, *(solid.name for solid in fixed)]),
        (fixed, [*links, *(solid.name for solid in (*fixed, *scene.obstacles))]),
    ):
        for solid in solids:
            for name in solid.touches:
                checked_name(f"link or body that touches {solid.name!r}", name, known)


@final
@dataclass(frozen=True, eq=False)
class Witnesses:
    """Nearest points of K pairs of solids, in the base frame.

    Attributes:
        carriers: joints of the model that carry the solids, 0 for a fixed solid, shape (K, 2).
        points: one point of each solid, shape (K, 2, 3) [m].
        normals: unit vectors from the first solid to the second, shape (K, 3).
    """

    carriers: Array
    points: Array
    normals: Array


def solid_reach(robot: Robot, entry: Any, lower: Array, upper: Array) -> Array:
    """Bound of the speed of any point of a solid per unit of joint speed, in every configuration.

    A ball around the solid is followed towards the base: a revolute joint sweeps the ball around its axis, a prismatic
    joint along its axis, and the next ball contains the swept region. A point's speed is at most its distance from a
    joint's axis times the joint's speed.

    Args:
        robot: the robot.
        entry: the solid, one of Pinocchio's geometry objects.
        lower: least positions of the model's joints, shape (B, n_model) [rad or m]; only those of prismatic joints
            matter. Complex steps are kept.
        upper: greatest positions, the same shape [rad or m].

    Returns:
        Shape (B, n_model) [m/rad or 1].
    """
    model = robot.model
    axes, turns = robot.joint_axes
    centre, radius = bounding_ball(entry)
    centres, radii = np.tile(centre, (len(lower), 1)), np.full(len(lower), radius)
    found, joint = np.zeros(lower.shape, dtype=lower.dtype), entry.parentJoint
    while joint > 0:
        column, axis = model.joints[joint].idx_v, axes[joint - 1]
        if turns[joint - 1]:
            on_axis = np.outer(np.sum(centres * axis, axis=1), axis)
            radii = radii + np.sqrt(np.square(centres - on_axis).sum(axis=1))
            # A solid on the axis of its joint still counts as carried by it.
            found[:, column], centres = np.maximum(radii, np.finfo(float).tiny), on_axis
        else:
            found[:, column] = 1.0
            centres = centres + np.outer(0.5 * (lower[:, column] + upper[:, column]), axis)
            radii = radii + 0.5 * (upper[:, column] - lower[:, column])
        placement = model.jointPlacements[joint]
        centres = row_products(centres, placement.rotation.T) + placement.translation
        joint = model.parents[joint]
    return found


def parting(robot: Robot, frames: Array, witnesses: Witnesses) -> Array:
    """Rate at which the points of pairs move apart along their normals, per unit of joint speed.

    Args:
        robot: the robot.
        frames: axes and origins of its joints in the state of each pair, shape (K, 2, n_joints, 3), see
            :meth:`trajevo.formulation.constraints.broad_phase.bodies.Bodies.joint_frames`.
        witnesses: nearest points of K pairs.

    Returns:
        Shape (K, n_joints) [m/rad or 1], columns in the order of the model's velocities.
    """
    model, turns = robot.model, robot.joint_axes[1]
    axes, origins, normals = frames[:, 0], frames[:, 1], witnesses.normals[:, None]
    along, around = np.sum(normals * axes, axis=2), np.cross(normals, axes)
    sides = []
    for side in (0, 1):
        arms = witnesses.points[:, side, None] - origins
        rates = np.where(turns, np.sum(around * arms, axis=2), along)
        sides.append(np.where(_carries(robot)[witnesses.carriers[:, side]], rates, 0.0))
    slopes: Array = np.empty_like(along)
    slopes[:, [joint.idx_v for joint in model.joints[1:]]] = sides[1] - sides[0]
    return slopes


def _carries(robot: Robot) -> Array:
    """Whether a joint (column) moves solids on a joint (row), (n_joints + 1, n_joints); the first row is the base."""
    model = robot.model
    carries = np.zeros((model.njoints, model.njoints - 1), dtype=bool)
    for carrier in range(1, model.njoints):
        carries[carrier] = carries[model.parents[carrier]]
        carries[carrier, carrier - 1] = True
    return carries
