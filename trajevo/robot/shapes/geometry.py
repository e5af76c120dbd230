"""Geometry of a robot's links on the joints of its model, and the links as few triangles for pictures."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal
from xml.etree import ElementTree

import numpy as np

from trajevo.base.arrays import Array, read_only
from trajevo.base.plugins import deferred
from trajevo.errors import InvalidInputError
from trajevo.robot.robot import Robot
from trajevo.robot.shapes.kept import KeptShapes, LinkShape
from trajevo.robot.shapes.meshes import check_solids
from trajevo.robot.urdf.look import leave_found
from trajevo.robot.urdf.model import held_still, read_model

if TYPE_CHECKING:
    import coal
    import pinocchio as pin
else:  # which takes a tenth of the time of importing trajevo
    coal = deferred("coal")
    pin = deferred("pinocchio")

#: Cells along the longest side of a link's box within which vertices become one.
_FINEST, _COARSEST = 64, 4

#: Sides of what is round.
_SIDES = 24


def read_geometry(robot: Robot, kind: Literal["collision", "visual"]) -> Any:
    """Pinocchio's geometry model of a robot on the joints of its model, meshes as they are.

    Args:
        robot: a robot with a URDF.
        kind: which of its geometries.

    Raises:
        InvalidInputError: it cannot be read, or a mesh is damaged.
    """
    text, where = robot.checked_text(), robot.where
    document = robot.description() if kind == "visual" else ElementTree.fromstring(text)
    if kind == "visual" and robot.written:  # text has no folder, and its meshes may be elsewhere
        leave_found(document, robot.packages)
    check_solids(document, where, robot.packages, kind=kind)
    shown = ElementTree.tostring(document, encoding="unicode") if kind == "visual" else text
    whole = read_model(text, where)
    asked = pin.GeometryType.VISUAL if kind == "visual" else pin.GeometryType.COLLISION
    folders = [str(folder) for folder in robot.packages]
    try:
        geometry = pin.buildGeomFromUrdfString(whole, shown, asked, package_dirs=folders)
    except (ValueError, RuntimeError) as error:
        raise InvalidInputError(f"{where}: {_unread(robot, error, kind)}") from error
    numbers_locked, held = held_still(whole, where, robot.locked)
    places = whole.createData()
    pin.forwardKinematics(whole, places, held)
    # pin.buildReducedModel would do the same, but not where a link and a joint share a name, as in Unitree's Z1.
    for entry in geometry.geometryObjects:
        carrier = entry.parentJoint
        while carrier in numbers_locked:
            carrier = whole.parents[carrier]
        entry.placement = places.oMi[carrier].actInv(places.oMi[entry.parentJoint] * entry.placement)
        entry.parentJoint = robot.model.getJointId(whole.names[carrier]) if carrier else 0
    return geometry


def link_shapes(robot: Robot, *, most: int = 2000) -> tuple[LinkShape, ...]:
    """The links of a robot as they look, by their visual geometry or, where they have none, by that of collisions.

    Vertices that are close become one, so that a mesh of a hundred thousand triangles has a thousand.

    Args:
        robot: the robot.
        most: greatest number of triangles of a mesh.

    Returns:
        Shapes in the order of the description; none for a robot without geometry.

    Raises:
        InvalidInputError: the geometry cannot be read.
    """
    if robot.urdf is None and "<collision" not in robot.written and "<visual" not in robot.written:
        return ()
    kept = KeptShapes.of(robot, most)
    found = kept.read()
    if found is None:
        found = ()
        for kind in ("visual", "collision"):
            entries = list(read_geometry(robot, kind).geometryObjects)
            if entries:
                found = tuple(_shape(entry, most) for entry in entries)
                break
        kept.write(found)
    return found


def said(error: Exception) -> str:
    """What an error of a library in C++ says, without its place there."""
    return re.sub(r"^From file: .*? message: ", "", " ".join(str(error).split()))


def _unread(robot: Robot, error: Exception, kind: str) -> str:
    """Why geometry cannot be read, from the error of its reader."""
    told = said(error)
    missing = re.fullmatch(r"Mesh (.*) could not be found\.?", told)
    if not missing:
        return f"cannot read its {kind} geometry: {told}"
    if not missing[1].startswith("package://"):
        return f"mesh {missing[1]!r}: no such file"
    folders = ", ".join(map(str, robot.packages))
    return f"mesh {missing[1]!r}: no such file in {folders}, or ROS_PACKAGE_PATH; name other folders by packages="


def _shape(entry: Any, most: int) -> LinkShape:
    vertices, triangles = _triangles(entry.geometry, most)
    placed = vertices @ np.asarray(entry.placement.rotation).T + np.asarray(entry.placement.translation)
    colour: tuple[float, float, float] | None = None
    if not entry.overrideMaterial and entry.meshPath.lower().endswith(".dae"):
        from trajevo.robot.shapes.collada import diffuse_colour  # imported when such a mesh is read

        colour = diffuse_colour(Path(entry.meshPath))
    if colour is None:
        red, green, blue = (float(value) for value in entry.meshColor[:3])
        colour = red, green, blue
    link = re.sub(r"_\d+$", "", entry.name)
    return LinkShape(link, int(entry.parentJoint), read_only(placed), triangles, colour)


def _triangles(solid: Any, most: int) -> tuple[Array, Array]:
    """Vertices (V, 3) [m] and triangles (M, 3) of a geometry of coal in its own frame."""
    match solid:
        case coal.BVHModelBase():
            corners = np.array(solid.vertices(), dtype=np.float64)
            faces = [(one[0], one[1], one[2]) for one in map(solid.tri_indices, range(solid.num_tris))]
            return simplified(corners, np.array(faces, dtype=np.intp), most)
        case coal.Box():
            half = np.asarray(solid.halfSide)
            return _hull(half * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float))
        case coal.Sphere():
            return _round(solid.radius, 0.0)
        case coal.Capsule():
            return _round(solid.radius, solid.halfLength)
        case coal.Cylinder():
            return _hull(np.concatenate([_ring(solid.radius, side * solid.halfLength) for side in (-1.0, 1.0)]))
    return np.empty((0, 3)), np.empty((0, 3), dtype=np.intp)


def simplified(vertices: Array, triangles: Array, most: int) -> tuple[Array, Array]:
    """A mesh with at most so many triangles: vertices in one cell of a grid become one, in the middle of them.

    Args:
        vertices: shape (V, 3) [m].
        triangles: numbers of their vertices, shape (M, 3).
        most: greatest number of triangles, unless the coarsest grid has more.

    Returns:
        Vertices and triangles, the finest of the grids that are tried which has few enough; those of a mesh with few
        enough as they are.
    """
    if len(triangles) <= most:
        return vertices, triangles
    cells = _FINEST
    while True:
        found = _clustered(vertices, triangles, cells)
        if len(found[1]) <= most or cells <= _COARSEST:
            return found
        cells = max(int(cells * min(0.9, (most / len(found[1])) ** 0.5)), _COARSEST)


def _clustered(vertices: Array, triangles: Array, cells: int) -> tuple[Array, Array]:
    low = vertices.min(axis=0)
    size = max(float(np.ptp(vertices, axis=0).max()), 1e-12) / cells
    places = np.floor((vertices - low) / size).astype(np.int64)
    keys = (places[:, 0] * (cells + 2) + places[:, 1]) * (cells + 2) + places[:, 2]
    _, inverse, counts = np.unique(keys, return_inverse=True, return_counts=True)
    middles = np.stack([np.bincount(inverse, column) / counts for column in vertices.T], axis=1)
    faces = inverse[triangles]
    whole = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    faces = faces[whole]
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    used, numbers = np.unique(faces[np.sort(first)], return_inverse=True)
    return middles[used], numbers.reshape(-1, 3)


def _ring(radius: float, height: float) -> Array:
    turns = 2.0 * np.pi / _SIDES * np.arange(_SIDES)
    return np.column_stack([radius * np.cos(turns), radius * np.sin(turns), np.full(_SIDES, height)])


def _round(radius: float, half: float) -> tuple[Array, Array]:
    """A ball, or a capsule whose cylinder has so much of its length to either side of the middle."""
    angles = np.linspace(0.0, 0.5 * np.pi, _SIDES // 4 + 1)
    rings = [_ring(radius * np.cos(at), side * (half + radius * np.sin(at))) for side in (-1.0, 1.0) for at in angles]
    return _hull(np.concatenate(rings))


def _hull(points: Array) -> tuple[Array, Array]:
    """Triangles of a convex hull, counter-clockwise from outside."""
    from scipy.spatial import ConvexHull  # takes as long to import as all else here

    hull = ConvexHull(points)
    faces = np.array(hull.simplices)
    corners = points[faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = np.sum(across * hull.equations[:, :3], axis=1) < 0.0
    faces[inward] = faces[inward][:, ::-1]
    return points, faces
