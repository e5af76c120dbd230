"""Solids: boxes, balls, cylinders, capsules, hulls of points and meshes, and planes."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, frozen, numbers
from trajevo.base.files import source_of_names
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError, checked_name
from trajevo.formulation.constraints.scenes.hulls import hull_points
from trajevo.formulation.constraints.scenes.motions import ObstacleMotion
from trajevo.formulation.constraints.scenes.rotations import Triple, matrix_of, rpy_of
from trajevo.robot.shapes.meshes import mesh_points

#: Distance of an obstacle from the base, and size of a mesh, above which numbers are not believed [m].
FARTHEST = 100.0

#: Greatest number of points of a hull.
_MOST_POINTS = 100_000

#: Length below which a vector has no direction.
_SHORT = 1e-9


@dataclass(frozen=True, kw_only=True)
class Obstacle:
    """A solid that stands still in the base frame of the robot, or in a frame that moves.

    Attributes:
        position: position of its centre; with a motion in the frame that moves [m].
        rpy: roll, pitch and yaw about the fixed axes x, y and z, as in a URDF; with a motion in the frame that moves
            [rad].
        name: its name in messages and pictures; a scene numbers obstacles that have none.
        touches: names of links, or of bodies attached to them, that need not stay away from it.
        motion: poses over time of the frame that carries it, or what :meth:`ObstacleMotion.of` takes; None for the base
            frame.

    Raises:
        InvalidInputError: a number that is missing, not finite or, for a size, not positive.
    """

    position: Triple
    rpy: Triple = (0.0, 0.0, 0.0)
    name: str = ""
    touches: tuple[str, ...] = ()
    motion: ObstacleMotion | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.name, str):
            raise InvalidInputError(f"obstacle: expected text as name, got {self.name!r}")
        if not self.name.isprintable():
            raise InvalidInputError(f"obstacle: expected printable text on one line as name, got {self.name!r}")
        for key in ("position", "rpy"):
            object.__setattr__(self, key, self._triple(key))
        if not (isinstance(self.touches, list | tuple) and all(isinstance(name, str) for name in self.touches)):
            raise InvalidInputError(
                f"{self._where('touches')}: expected a list of names of links, got {self.touches!r}"
            )
        object.__setattr__(self, "touches", tuple(self.touches))
        if max(map(abs, self.rpy)) > 2.0 * math.pi:
            raise InvalidInputError(
                f"{self._where('rpy')}: expected angles within ±2π rad, got {list(self.rpy)}, which looks like "
                "degrees: angles of obstacles are in rad, whatever the unit of the points"
            )
        if self.motion is not None:
            try:
                object.__setattr__(self, "motion", ObstacleMotion.of(self.motion))
            except InvalidInputError as error:
                where = f"obstacle {self.name!r}" if self.name else "obstacle"
                raise InvalidInputError(f"{where}: {error}") from error

    @property
    def radius_around(self) -> float:
        """Radius of the ball around its position that holds it [m]."""
        raise NotImplementedError

    @property
    def away(self) -> float:
        """Distance of the base's origin from it, at least; with a motion at its farthest [m]."""
        if self.motion is None:
            return math.hypot(*self.position) - self.radius_around
        farthest = max(math.hypot(*position) for position in self.motion.positions)
        return farthest - math.hypot(*self.position) - self.radius_around

    @property
    def rotation(self) -> Array:
        """Rotation matrix from its axes to those of the base, or of the frame that moves, (3, 3)."""
        return matrix_of(self.rpy)

    @property
    def settings(self) -> dict[str, Any]:
        """Plain data that makes an equal obstacle."""
        values = {key.name: getattr(self, key.name) for key in fields(self)}
        left_out = {key.name for key in fields(self) if key.name not in _ALWAYS and values[key.name] == key.default}
        plain = {key: _plain(value) for key, value in values.items() if key not in left_out}
        shape = next(shape for shape, kind in SHAPES.items() if type(self) is kind)
        return {"name": plain.pop("name"), "shape": shape} | plain

    def _triple(self, key: str, *, positive: bool = False) -> Triple:
        x, y, z = numbers(getattr(self, key), name=self._where(key), shape=(3,)).tolist()
        if positive and not min(x, y, z) > 0.0:
            raise InvalidInputError(f"{self._where(key)}: expected positive lengths [m], got {[x, y, z]}")
        return x, y, z

    def _check_lengths(self, *keys: str) -> None:
        for key in keys:
            object.__setattr__(self, key, length_of(getattr(self, key), self._where(key), least="above 0"))

    def _where(self, key: str) -> str:
        return f"obstacle {self.name!r}: {key}" if self.name else f"obstacle: {key}"


@final
@dataclass(frozen=True, kw_only=True)
class Box(Obstacle):
    """A box.

    Attributes:
        size: lengths of its edges along its own x, y and z axes [m].
    """

    size: Triple

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "size", self._triple("size", positive=True))

    @property
    def radius_around(self) -> float:
        """Radius of the ball around its position that holds it [m]."""
        return 0.5 * math.hypot(*self.size)


@final
@dataclass(frozen=True, kw_only=True)
class Sphere(Obstacle):
    """A ball.

    Attributes:
        radius: [m].
    """

    radius: float

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check_lengths("radius")

    @property
    def radius_around(self) -> float:
        """Radius of the ball around its position that holds it [m]."""
        return self.radius


@final
@dataclass(frozen=True, kw_only=True)
class Cylinder(Obstacle):
    """A cylinder along its own z axis.

    Attributes:
        radius: [m].
        length: [m].
    """

    radius: float
    length: float

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check_lengths("radius", "length")

    @property
    def radius_around(self) -> float:
        """Radius of the ball around its position that holds it [m]."""
        return math.hypot(self.radius, 0.5 * self.length)


@final
@dataclass(frozen=True, kw_only=True)
class Capsule(Obstacle):
    """All that is within a radius of a line along its own z axis.

    Attributes:
        radius: [m].
        length: length of the line, without the caps at its ends [m].
    """

    radius: float
    length: float

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check_lengths("radius", "length")

    @property
    def radius_around(self) -> float:
        """Radius of the ball around its position that holds it [m]."""
        return self.radius + 0.5 * self.length


@final
@dataclass(frozen=True, kw_only=True)
class Plane(Obstacle):
    """All that is behind a plane, such as the floor and what is below it.

    Attributes:
        position: any point of the plane [m].
        normal: direction from the plane into free space, of any length; None for its own z axis, as ``rpy`` turns it.
    """

    normal: Triple | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.motion is not None:
            raise InvalidInputError(
                f"{self._where('motion')}: expected a solid that moves, such as a box, got a plane, which has no end"
            )
        if self.normal is None:
            return
        if any(self.rpy):
            raise InvalidInputError(f"{self._where('normal')}: expected either normal or rpy, got both")
        object.__setattr__(self, "normal", self._triple("normal"))
        if not math.hypot(*self.normal) > _SHORT:
            raise InvalidInputError(f"{self._where('normal')}: expected a direction, got {list(self.normal)}")

    @property
    def radius_around(self) -> float:
        """It has no end [m]."""
        return math.inf

    @property
    def away(self) -> float:
        """Distance of the base's origin from the plane [m]."""
        return abs(float(self.rotation[:, 2] @ self.position))

    @property
    def rotation(self) -> Array:
        """Rotation matrix whose z axis is the normal, (3, 3)."""
        if self.normal is None:
            return super().rotation
        z = np.array(self.normal) / math.hypot(*self.normal)
        x = np.cross(np.eye(3)[np.abs(z).argmin()], z)
        x /= np.linalg.norm(x)
        return np.column_stack([x, np.cross(z, x), z])


class Cornered(Obstacle):
    """The convex hull of points, whose origin is at the position."""

    @property
    @abstractmethod
    def corners(self) -> Array:
        """The points in its own frame, shape (N, 3) [m]."""

    @property
    def middle(self) -> Array:
        """Centre of the box around its points, in its own frame, shape (3,) [m]."""
        middle: Array = 0.5 * (self.corners.min(axis=0) + self.corners.max(axis=0))
        return middle

    @property
    def radius_around(self) -> float:
        """Radius of the ball around its position that holds it [m]."""
        return float(np.linalg.norm(self.corners, axis=1).max())


@final
@dataclass(frozen=True, kw_only=True)
class Hull(Cornered):
    """The convex hull of points.

    Attributes:
        points: four points or more, not all in one plane, in its own frame [m].
    """

    points: tuple[Triple, ...]

    __repr__ = brief

    def __post_init__(self) -> None:
        super().__post_init__()
        where = self._where("points")
        given = numbers(self.points, name=where, shape=("N", 3))
        if not 4 <= len(given) <= _MOST_POINTS:
            raise InvalidInputError(f"{where}: expected 4 to {_MOST_POINTS} points, got {len(given)}")
        object.__setattr__(self, "points", tuple(map(tuple, given.tolist())))
        _check_extent(self.corners, where)

    @cached_property
    def corners(self) -> Array:
        """The points in its own frame, shape (N, 3) [m]."""
        return frozen(np.array(self.points))


@final
@dataclass(frozen=True, kw_only=True)
class Mesh(Cornered):
    """The convex hull of a mesh, whose settings are those of a :class:`Hull`.

    Attributes:
        file: a file as STL, OBJ or DAE.
        scale: factor from its lengths to metres, 0.001 for mm.
    """

    file: str
    scale: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.file, str | PathLike):
            raise InvalidInputError(f"{self._where('file')}: expected the path of a mesh, got {self.file!r}")
        source = source_of_names()
        if source:
            raise InvalidInputError(
                f"{self._where('file')}: {source} names a file to read, {str(self.file)!r}; "
                "the data of a run holds hulls"
            )
        object.__setattr__(self, "file", str(self.file))
        self._check_lengths("scale")
        try:
            extent = float(np.ptp(self.corners, axis=0).max())
        except InvalidInputError as error:
            raise InvalidInputError(f"{self._where('file')}: {error}") from error
        if extent > FARTHEST:
            raise InvalidInputError(
                f"{self._where('scale')}: a mesh of {extent:.4g} m looks as if its file were in mm: expected a scale "
                "such as 0.001"
            )

    @cached_property
    def corners(self) -> Array:
        """Corners of the convex hull in its own frame, shape (N, 3) [m]."""
        return frozen(hull_points(mesh_points(Path(self.file), self.scale), self.file))

    @property
    def settings(self) -> dict[str, Any]:
        """Plain data of an equal hull, so that runs need no file, which may change or be anywhere."""
        values = {key.name: getattr(self, key.name) for key in fields(Obstacle)}
        return Hull(**values, points=tuple(map(tuple, self.corners.tolist()))).settings


#: Name of a shape in plain data -> class.
SHAPES: dict[str, type[Obstacle]] = {
    "box": Box,
    "sphere": Sphere,
    "cylinder": Cylinder,
    "capsule": Capsule,
    "mesh": Mesh,
    "hull": Hull,
    "plane": Plane,
}

#: Attributes that settings have even where they are as if not given.
_ALWAYS = ("name", "position", "rpy", "scale")


def _plain(value: Any) -> Any:
    if isinstance(value, ObstacleMotion):
        return value.settings
    return [_plain(entry) for entry in value] if isinstance(value, tuple) else value


def _check_extent(points: Array, where: str) -> None:
    extent = float(np.ptp(points, axis=0).max())
    if extent > FARTHEST:
        raise InvalidInputError(f"{where}: a solid of {extent:.4g} m looks like mm: lengths are in m")


def obstacle_of(given: Any, place: int) -> Obstacle:
    """An obstacle from plain data; an obstacle is returned unchanged.

    Args:
        given: a mapping with ``shape`` (a key of :data:`SHAPES`), ``position``, ``rpy`` or ``rotation`` (3 x 3),
            ``name``, ``touches`` and the sizes of the shape.
        place: its number, counted from 1, for messages.

    Raises:
        UnknownNameError: no such shape.
        InvalidInputError: a key that is unknown or missing, or a value that cannot be used.
    """
    if isinstance(given, Obstacle):
        return given
    if not isinstance(given, Mapping):
        raise InvalidInputError(f"obstacle {place}: expected a mapping with shape and position, got {given!r}")
    where = f"obstacle {given.get('name') or place!r}"
    if "shape" not in given:
        raise InvalidInputError(f"{where}: shape: expected one of {', '.join(sorted(SHAPES))}, got none")
    kind = SHAPES[checked_name(f"shape of {where}", given["shape"], SHAPES)]
    known = {key.name for key in fields(kind)}
    sizes = {key.name for key in fields(kind) if key.default is MISSING} - {key.name for key in fields(Obstacle)}
    if given.get("motion") is not None:
        given = {"position": (0.0, 0.0, 0.0)} | dict(given)
    check_keys(given, known | {"shape", "rotation"}, sizes | {"position"}, where)
    if "rotation" in given and "rpy" in given:
        raise InvalidInputError(f"{where}: rotation: expected either rpy or rotation, got both")
    values = {key: value for key, value in given.items() if key not in ("shape", "rotation")}
    if "rotation" in given:
        values["rpy"] = rpy_of(given["rotation"], f"{where}: rotation")
    return kind(**({"name": str(place)} | values))


def check_keys(given: Mapping[str, Any], known: set[str], needed: set[str], where: str) -> None:
    """Refuse unknown keys, and a mapping that lacks one.

    Raises:
        InvalidInputError: the message names the key.
    """
    unknown = sorted(str(key) for key in set(given) - known)
    if unknown:
        raise InvalidInputError(f"{where}: {unknown[0]}: unknown key; known: {', '.join(sorted(known))}")
    missing = sorted(needed - set(given))
    if missing:
        expected = {"file": "the path of a mesh", "on": "the name of a link"}.get(missing[0], "a value [m]")
        raise InvalidInputError(f"{where}: {missing[0]}: expected {expected}, got none")


def length_of(value: Any, where: str, *, least: str) -> float:
    """A length [m], ``least`` "above 0" or "from 0 on".

    Raises:
        InvalidInputError: it is no such number.
    """
    real = isinstance(value, int | float | np.number) and not isinstance(value, bool | np.complexfloating)
    if not (real and math.isfinite(value) and (value > 0.0 or (value == 0.0 and least == "from 0 on"))):
        raise InvalidInputError(f"{where}: expected a number {least} [m], got {value!r}")
    return float(value)
