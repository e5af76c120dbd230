"""Obstacles around a robot and how far it has to stay away from them and from itself."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields, replace
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, frozen, numbers
from trajevo.errors import InvalidInputError, checked_name
from trajevo.robot.meshes import mesh_points

Triple = tuple[float, float, float]

#: Distance of an obstacle from the base, and clearance, above which numbers are not believed [m].
_FARTHEST, _MOST_CLEARANCE = 100.0, 5.0


@dataclass(frozen=True, kw_only=True)
class Obstacle:
    """A solid that stands still in the base frame of the robot.

    Attributes:
        position: position of its centre [m].
        rpy: roll, pitch and yaw about the fixed axes x, y and z, as in a URDF [rad].
        name: its name in messages and pictures; a scene numbers obstacles that have none.

    Raises:
        InvalidInputError: a number that is missing, not finite or, for a size, not positive.
    """

    position: Triple
    rpy: Triple = (0.0, 0.0, 0.0)
    name: str = ""

    def __post_init__(self) -> None:
        if not isinstance(self.name, str):
            raise InvalidInputError(f"obstacle: expected text as name, got {self.name!r}")
        if not self.name.isprintable():
            raise InvalidInputError(f"obstacle: expected printable text on one line as name, got {self.name!r}")
        for key in ("position", "rpy"):
            object.__setattr__(self, key, self._triple(key))
        if max(map(abs, self.rpy)) > 2.0 * math.pi:
            raise InvalidInputError(
                f"{self._where('rpy')}: expected angles within ±2π rad, got {list(self.rpy)}, which looks like "
                "degrees: angles of obstacles are in rad, whatever the unit of the points"
            )

    @property
    def radius_around(self) -> float:
        """Radius of the ball around its position that holds it [m]."""
        raise NotImplementedError

    @property
    def rotation(self) -> Array:
        """Rotation matrix from its axes to those of the base, (3, 3)."""
        (sr, sp, sy), (cr, cp, cy) = np.sin(self.rpy), np.cos(self.rpy)
        return np.array(
            [
                [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
                [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
                [-sp, cp * sr, cp * cr],
            ]
        )

    @property
    def settings(self) -> dict[str, Any]:
        """Plain data that makes an equal obstacle."""
        values = {key.name: getattr(self, key.name) for key in fields(self)}
        plain = {key: list(value) if isinstance(value, tuple) else value for key, value in values.items()}
        shape = next(shape for shape, kind in SHAPES.items() if type(self) is kind)
        return {"name": plain.pop("name"), "shape": shape} | plain

    def _triple(self, key: str, *, positive: bool = False) -> Triple:
        x, y, z = numbers(getattr(self, key), name=self._where(key), shape=(3,)).tolist()
        if positive and not min(x, y, z) > 0.0:
            raise InvalidInputError(f"{self._where(key)}: expected positive lengths [m], got {[x, y, z]}")
        return x, y, z

    def _check_lengths(self, *keys: str) -> None:
        for key in keys:
            object.__setattr__(self, key, _length(getattr(self, key), self._where(key), least="above 0"))

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
class Mesh(Obstacle):
    """The convex hull of a mesh, whose origin is at the position.

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
        object.__setattr__(self, "file", str(self.file))
        self._check_lengths("scale")
        try:
            extent = float(np.ptp(self.points, axis=0).max())
        except InvalidInputError as error:
            raise InvalidInputError(f"{self._where('file')}: {error}") from error
        if extent > _FARTHEST:
            raise InvalidInputError(
                f"{self._where('scale')}: a mesh of {extent:.4g} m looks as if its file were in mm: expected a scale "
                "such as 0.001"
            )

    @cached_property
    def points(self) -> Array:
        """Vertices of the mesh in its own frame, shape (N, 3) [m]."""
        return frozen(mesh_points(Path(self.file), self.scale))

    @property
    def middle(self) -> Array:
        """Centre of the box around its vertices, in its own frame, shape (3,) [m]."""
        middle: Array = 0.5 * (self.points.min(axis=0) + self.points.max(axis=0))
        return middle

    @property
    def radius_around(self) -> float:
        """Radius of the ball around its position that holds it [m]."""
        return float(np.linalg.norm(self.points, axis=1).max())


#: Name of a shape in plain data -> class.
SHAPES: dict[str, type[Obstacle]] = {"box": Box, "sphere": Sphere, "cylinder": Cylinder, "mesh": Mesh}


@final
@dataclass(frozen=True)
class Scene:
    """Obstacles, and the clearances of a robot to them and to itself.

    Attributes:
        obstacles: in the base frame of the robot; those without a name are numbered.
        clearance: least distance from the robot to any of them, from 0 on [m].
        self_clearance: least distance between links of the robot, from 0 on [m]; not checked if None.

    Raises:
        InvalidInputError: no obstacle and no ``self_clearance``, two obstacles of one name, or a distance that is
            negative or not finite.
    """

    obstacles: tuple[Obstacle, ...] = ()
    clearance: float = 0.0
    self_clearance: float | None = None

    def __post_init__(self) -> None:
        given = self.obstacles if isinstance(self.obstacles, list | tuple) else None
        if given is None or not all(isinstance(entry, Obstacle) for entry in given):
            raise InvalidInputError(
                f"scene: obstacles: expected boxes, spheres, cylinders and meshes, got {self.obstacles!r}"
            )
        named = tuple(entry if entry.name else replace(entry, name=f"obstacle {k}") for k, entry in enumerate(given, 1))
        for entry in named:
            away = math.hypot(*entry.position) - entry.radius_around
            if away > _FARTHEST:
                raise InvalidInputError(
                    f"scene: obstacle {entry.name!r}: expected an obstacle within {_FARTHEST:g} m of the base, got one "
                    f"that is {away:.4g} m away and looks like mm: lengths are in m; leave it out if it is so far away"
                )
        names = [entry.name for entry in named]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise InvalidInputError(f"scene: obstacles: expected names that differ, got {twice[0]!r} twice")
        object.__setattr__(self, "obstacles", named)
        object.__setattr__(self, "clearance", _length(self.clearance, "scene: clearance", least="from 0 on"))
        if self.self_clearance is not None:
            checked = _length(self.self_clearance, "scene: self_clearance", least="from 0 on")
            object.__setattr__(self, "self_clearance", checked)
        if not named and self.self_clearance is None:
            raise InvalidInputError("scene: expected obstacles or a self_clearance, got neither")
        for key in ("clearance", "self_clearance"):
            length = getattr(self, key) or 0.0
            if length > _MOST_CLEARANCE:
                raise InvalidInputError(
                    f"scene: {key}: {length:g} m looks like mm: expected at most {_MOST_CLEARANCE:g} m, "
                    f"{1e-3 * length:g} if it is mm"
                )

    @classmethod
    def of(cls, given: Scene | Mapping[str, Any]) -> Scene:
        """A scene from plain data; a scene is returned unchanged.

        Args:
            given: ``obstacles``, a list of mappings with ``shape`` (a key of :data:`SHAPES`), ``position``, ``rpy`` or
                ``rotation`` (3 x 3), ``name`` and the sizes of the shape; ``clearance`` and ``self_clearance``.

        Raises:
            UnknownNameError: no such shape.
            InvalidInputError: a key that is unknown or missing, or a value that cannot be used; the message names
                obstacle and key.
        """
        if isinstance(given, Scene):
            return given
        if not isinstance(given, Mapping):
            raise InvalidInputError(f"scene: expected a mapping with obstacles and clearance, got {given!r}")
        _check_keys(given, {key.name for key in fields(cls)}, set(), "scene")
        listed = given.get("obstacles", ())
        if not isinstance(listed, list | tuple):
            raise InvalidInputError(f"scene: obstacles: expected a list of obstacles, got {listed!r}")
        return cls(**{**given, "obstacles": tuple(_obstacle(entry, k) for k, entry in enumerate(listed, 1))})

    @property
    def settings(self) -> dict[str, Any]:
        """Plain data that makes an equal scene."""
        return {
            "clearance": self.clearance,
            "self_clearance": self.self_clearance,
            "obstacles": [obstacle.settings for obstacle in self.obstacles],
        }


def _obstacle(given: Any, place: int) -> Obstacle:
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
    _check_keys(given, known | {"shape", "rotation"}, sizes | {"position"}, where)
    if "rotation" in given and "rpy" in given:
        raise InvalidInputError(f"{where}: rotation: expected either rpy or rotation, got both")
    values = {key: value for key, value in given.items() if key not in ("shape", "rotation")}
    if "rotation" in given:
        values["rpy"] = _rpy(given["rotation"], f"{where}: rotation")
    return kind(**({"name": str(place)} | values))


def _check_keys(given: Mapping[str, Any], known: set[str], needed: set[str], where: str) -> None:
    unknown = sorted(str(key) for key in set(given) - known)
    if unknown:
        raise InvalidInputError(f"{where}: {unknown[0]}: unknown key; known: {', '.join(sorted(known))}")
    missing = sorted(needed - set(given))
    if missing:
        expected = "the path of a mesh" if missing[0] == "file" else "a value [m]"
        raise InvalidInputError(f"{where}: {missing[0]}: expected {expected}, got none")


def _rpy(rotation: Any, where: str) -> Triple:
    matrix = numbers(rotation, name=where, shape=(3, 3))
    if not (np.allclose(matrix @ matrix.T, np.eye(3), atol=1e-6) and np.linalg.det(matrix) > 0.0):
        raise InvalidInputError(f"{where}: expected a rotation matrix, got {matrix.tolist()}")
    pitch = math.atan2(-matrix[2, 0], math.hypot(matrix[0, 0], matrix[1, 0]))
    if math.hypot(matrix[0, 0], matrix[1, 0]) < 1e-9:  # x points up or down: only roll and yaw together are defined
        return math.atan2(-matrix[1, 2], matrix[1, 1]), pitch, 0.0
    return math.atan2(matrix[2, 1], matrix[2, 2]), pitch, math.atan2(matrix[1, 0], matrix[0, 0])


def _length(value: Any, where: str, *, least: str) -> float:
    real = isinstance(value, int | float | np.number) and not isinstance(value, bool | np.complexfloating)
    if not (real and math.isfinite(value) and (value > 0.0 or (value == 0.0 and least == "from 0 on"))):
        raise InvalidInputError(f"{where}: expected a number {least} [m], got {value!r}")
    return float(value)
