"""MoveIt's scenes as text, as RViz saves them (``.scene``).

A scene is its name, then objects, then a line with a full stop. An object is a line ``* name``, its pose, the number of
its shapes, each with its pose in the object and a colour, and the number of its subframes, each with a name and a pose.
The older format has neither poses of objects nor subframes. A pose is x y z and the quaternion x y z w.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError
from trajevo.formulation.constraints.scenes.hulls import hull_points
from trajevo.formulation.constraints.scenes.obstacles import Obstacle, obstacle_of

#: Shapes -> the keys of their sizes.
_SIZES = {"box": ("x", "y", "z"), "sphere": ("radius",), "cylinder": ("radius", "length"), "plane": tuple("abcd")}

#: Greatest number of shapes of an object, and of corners and triangles of a mesh.
_MOST = 1_000_000

#: Distance of the base from a plane below which the plane's own normal tells the free side [m].
_ON_IT = 1e-9


def moveit_obstacles(text: str, file: Path) -> tuple[Obstacle, ...]:
    """The obstacles of a scene of MoveIt.

    Args:
        text: content of the file.
        file: the file, for messages.

    Raises:
        InvalidInputError: something else stands where the format wants a number or a shape; the message names the line.
    """
    return _Scene(text, file).obstacles()


@final
class _Scene:
    def __init__(self, text: str, file: Path) -> None:
        self._lines = text.splitlines()
        self._file, self._line = file, 1  # number of the next line, from 0; the first is the scene's name
        self._words: list[str] = []
        self._posed = self._has_poses()
        self._names: set[str] = set()

    def obstacles(self) -> tuple[Obstacle, ...]:
        found: list[Obstacle] = []
        while True:
            marker = self._word("an object, * and its name, or the full stop at the end")
            if marker == ".":
                return tuple(found)
            if marker != "*":
                raise self._wrong("an object, * and its name, or the full stop at the end", marker)
            name, self._words = " ".join(self._words), []
            outer = self._pose() if self._posed else (np.eye(3), np.zeros(3))
            count = self._count("the number of shapes")
            for number in range(1, count + 1):
                found.append(self._shape(name if count == 1 else f"{name} {number}", outer))
            for _ in range(self._count("the number of subframes") if self._posed else 0):
                self._word("the name of a subframe")
                self._words = []
                self._pose()

    def _has_poses(self) -> bool:
        """Whether objects have poses: then a line of several numbers follows the name of the first."""
        for number, line in enumerate(self._lines[1:-1], start=1):
            if line.startswith("*"):
                return len(self._lines[number + 1].split()) > 1
        return True

    def _shape(self, name: str, outer: tuple[Array, Array]) -> Obstacle:
        kind = self._word("a shape")
        line = self._line
        if kind not in (*_SIZES, "mesh"):
            raise self._wrong(f"a shape, one of {', '.join((*_SIZES, 'mesh'))}", kind)
        sizes = self._mesh() if kind == "mesh" else np.array(self._numbers(len(_SIZES[kind]), " ".join(_SIZES[kind])))
        inner, at = self._pose()
        self._numbers(4, "a colour")
        rotation, position = outer[0] @ inner, outer[1] + outer[0] @ at
        given: dict[str, Any] = {"name": self._new(name), "shape": kind, "position": position, "rotation": rotation}
        if kind == "mesh":
            given |= {"shape": "hull", "points": sizes}
        elif kind == "box":
            given |= {"size": sizes}
        elif kind == "plane":
            given = {**given, **self._plane(sizes, rotation, position)}
            del given["rotation"]
        else:
            given |= dict(zip(_SIZES[kind], sizes.tolist(), strict=True))
        try:
            return obstacle_of(given, 1)
        except InvalidInputError as error:
            raise InvalidInputError(f"{self._file}: line {line}: {error}") from error

    def _plane(self, sizes: Array, rotation: Array, position: Array) -> dict[str, Any]:
        """A plane a x + b y + c z + d = 0, behind which nothing is free, seen from the base."""
        length = float(np.linalg.norm(sizes[:3]))
        if not length > 0.0:
            raise self._wrong("a plane a b c d with a normal", " ".join(f"{x:g}" for x in sizes))
        normal = rotation @ (sizes[:3] / length)
        point = position - normal * (sizes[3] / length)
        if normal @ point > _ON_IT:  # the base would be behind it
            normal = -normal
        return {"position": point, "normal": normal}

    def _mesh(self) -> Array:
        corners, triangles = (self._count(f"the number of {what} of a mesh") for what in ("corners", "triangles"))
        points = np.array([self._numbers(3, "a corner of a mesh") for _ in range(corners)]).reshape(-1, 3)
        for _ in range(triangles):
            self._numbers(3, "a triangle of a mesh")
        return hull_points(points, f"{self._file}: line {self._line}: mesh")

    def _pose(self) -> tuple[Array, Array]:
        position = np.array(self._numbers(3, "a position x y z"))
        x, y, z, w = quaternion = np.array(self._numbers(4, "a quaternion x y z w"))
        if not abs(float(np.linalg.norm(quaternion)) - 1.0) < 1e-3:
            raise self._wrong("a quaternion x y z w of length 1", " ".join(f"{part:g}" for part in quaternion))
        x, y, z, w = quaternion / np.linalg.norm(quaternion)
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        return np.eye(3) + 2.0 * w * cross + 2.0 * (cross @ cross), position

    def _new(self, name: str) -> str:
        """A name that no other obstacle of the file has."""
        new, number = name or "object", 2
        while new in self._names:
            new, number = f"{name} ({number})", number + 1
        self._names.add(new)
        return new

    def _numbers(self, count: int, what: str) -> list[float]:
        found = []
        for _ in range(count):
            word = self._word(what)
            try:
                found.append(float(word))
            except ValueError:
                raise self._wrong(what, word) from None
            if not np.isfinite(found[-1]):
                raise self._wrong(f"finite numbers as {what}", word)
        return found

    def _count(self, what: str) -> int:
        word = self._word(what)
        if not word.isdecimal() or len(word) > 7 or int(word) > _MOST:
            raise self._wrong(f"{what}, at most {_MOST}", word)
        return int(word)

    def _word(self, what: str) -> str:
        while not self._words:
            if self._line >= len(self._lines):
                at = f"{self._file}: line {len(self._lines)}"
                raise InvalidInputError(f"{at}: expected {what}, got the end of the file")
            self._words = self._lines[self._line].split()
            self._line += 1
        return self._words.pop(0)

    def _wrong(self, what: str, got: str) -> InvalidInputError:
        shown = got if len(got) <= 40 else f"{got[:40]}..."
        return InvalidInputError(f"{self._file}: line {self._line}: expected {what}, got {shown!r}")
