"""Meshes of collision geometry, checked before a library reads them: for some damaged files it ends the process.

The readers of meshes that Pinocchio uses take numbers that are not finite, and indices beyond the vertices, without a
word. So every mesh that a URDF names is read here first, and refused unless it is whole.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.files import MOST_DATA, read_bytes, why_not
from trajevo.base.plain import parsed_xml
from trajevo.base.plugins import deferred
from trajevo.errors import InvalidInputError
from trajevo.robot.urdf.file import urdf_number
from trajevo.robot.urdf.look import files_of

if TYPE_CHECKING:
    import coal
else:  # which takes a tenth of the time of importing trajevo
    coal = deferred("coal")

#: Greatest coordinate of a vertex in the units of its file, often mm.
_FARTHEST = 1e7

_WHOLE_NUMBERS = re.compile(r"\s*(?:-?\d{1,9}(?:\s+|$))*+")

_STL_HEADER, _STL_FACET = 84, 50
_STL_VERTEX = re.compile(rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)")
_SHAPES = {"box": ("size", 3), "cylinder": ("radius length", 1), "sphere": ("radius", 1)}


def check_solids(
    robot: ElementTree.Element, urdf: Path | str, packages: Sequence[Path], *, kind: str = "collision"
) -> None:
    """Refuse geometry that cannot be used: sizes that are no positive numbers, and damaged meshes.

    Args:
        robot: top element of the URDF.
        urdf: the URDF, for messages.
        packages: folders in which ``package://`` paths are looked up.
        kind: ``"collision"`` or ``"visual"``.

    Raises:
        InvalidInputError: the message names link or mesh, and what is wrong.
    """
    checked: set[Path] = set()
    for link in robot.iterfind("link"):
        for geometry in link.iterfind(f"{kind}/geometry"):
            where = f"{urdf}: link {link.get('name')!r}: {kind}"
            for shape, (keys, count) in _SHAPES.items():
                for element in geometry.iterfind(shape):
                    for key in keys.split():
                        _check_lengths(element, key, count, where)
            for mesh in geometry.iterfind("mesh"):
                if "scale" in mesh.attrib:
                    _check_lengths(mesh, "scale", 3, where, signed=True)
                for file in files_of(mesh.get("filename") or "", packages):
                    if file not in checked:
                        check_mesh(file)
                        checked.add(file)


def check_mesh(file: Path) -> None:
    """Refuse a mesh that is not whole.

    Args:
        file: a mesh as STL, OBJ or DAE, by its ending.

    Raises:
        InvalidInputError: another format, a file that cannot be read, or one with no triangles, a number that is not
            finite, coordinates beyond any robot, or an index without a vertex.
    """
    check = _FORMATS.get(file.suffix.lower())
    if check is None:
        raise InvalidInputError(f"{file}: expected a mesh as {', '.join(_FORMATS)}, got the ending {file.suffix!r}")
    try:
        check(file, read_bytes(file, most=MOST_DATA))
    except OSError as error:
        raise InvalidInputError(f"{file}: cannot be read: {why_not(error)}") from error


def mesh_points(file: Path, scale: float) -> Array:
    """Vertices of a mesh, shape (N, 3) [m].

    Args:
        file: a mesh as STL, OBJ or DAE, by its ending.
        scale: factor from its lengths to metres.

    Raises:
        InvalidInputError: as for :func:`check_mesh`.
    """
    check_mesh(file)
    try:
        mesh = coal.MeshLoader().load(str(file), np.full(3, scale))
    except (ValueError, RuntimeError) as error:
        raise InvalidInputError(f"{file}: cannot be read as a mesh: {' '.join(str(error).split())}") from error
    return np.array(mesh.vertices(), dtype=np.float64)


def _check_lengths(element: ElementTree.Element, key: str, count: int, where: str, *, signed: bool = False) -> None:
    values = [urdf_number(part) for part in (element.get(key) or "").split()]
    if len(values) != count or not all(
        value is not None and (value != 0.0 if signed else value > 0.0) and abs(value) < _FARTHEST for value in values
    ):
        kind = "numbers other than 0" if signed else "positive numbers [m]"
        raise InvalidInputError(
            f"{where}: <{element.tag}>: expected {count} {kind} below {_FARTHEST:g} as {key}, got {element.get(key)!r}"
        )


def _check_points(file: Path, points: Array, *, what: str = "vertices") -> None:
    """Refuse points, shape (N, 3), of which there are none, or which are not finite, or are far out."""
    if not len(points):
        raise InvalidInputError(f"{file}: expected {what} of a mesh, got none")
    wrong = ~(np.abs(points) <= _FARTHEST).all(axis=1)  # also true for NaN
    if wrong.any():
        row = int(np.argmax(wrong))
        raise InvalidInputError(
            f"{file}: {what}, row {row}: expected finite coordinates below {_FARTHEST:g}, got {points[row].tolist()}"
        )


def _numbers(file: Path, texts: Sequence[Any], what: str) -> Array:
    try:
        found: Array = np.array(texts, dtype=np.float64)
    except ValueError as error:
        raise InvalidInputError(f"{file}: expected numbers as {what}: {why_not(error)}") from error
    return found


def _check_stl(file: Path, content: bytes) -> None:
    facets = int.from_bytes(content[80:_STL_HEADER], "little")
    if len(content) == _STL_HEADER + _STL_FACET * facets:
        rows = np.frombuffer(content, np.uint8, offset=_STL_HEADER).reshape(facets, _STL_FACET)
        corners = np.ascontiguousarray(rows[:, 12:48]).view("<f4").reshape(-1, 3)
        _check_points(file, corners.astype(np.float64))
        return
    found = _STL_VERTEX.findall(content)
    counts = {content.count(word) * 3 for word in (b"facet normal", b"outer loop", b"endloop", b"endfacet")}
    if not content.lstrip().startswith(b"solid") or counts != {len(found)} or len(found) != content.count(b"vertex"):
        raise InvalidInputError(f"{file}: expected an STL of whole triangles, got {len(content)} bytes")
    _check_points(file, _numbers(file, found, "vertices").reshape(-1, 3))


def _check_obj(file: Path, content: bytes) -> None:
    counts = {b"v": 0, b"vt": 0, b"vn": 0}
    points: list[list[bytes]] = []
    faces: list[tuple[int, list[bytes]]] = []
    for number, line in enumerate(content.splitlines(), start=1):
        key, *parts = line.split() or [b""]
        if key in counts:
            counts[key] += 1
            _numbers(file, parts, f"{key.decode()} in line {number}")
            points += [parts[:3]] if key == b"v" else []
        elif key == b"f":
            faces.append((number, parts))
        elif key == b"mtllib":
            _check_named(file, line)
    if any(len(point) != 3 for point in points):
        raise InvalidInputError(f"{file}: expected three coordinates of every vertex")
    _check_points(file, _numbers(file, points, "vertices").reshape(-1, 3))
    if not faces:
        raise InvalidInputError(f"{file}: expected faces of a mesh, got none")
    for number, corners in faces:
        if len(corners) < 3 or not all(_is_corner(corner, tuple(counts.values())) for corner in corners):
            said = b" ".join(corners[:8]).decode(errors="replace")
            raise InvalidInputError(f"{file}: line {number}: expected a face of known vertices, got {said!r}")


def _is_corner(corner: bytes, counts: tuple[int, ...]) -> bool:
    """Whether a corner of a face, such as ``3/1/2``, names vertices that the file has, from 1, or from the end."""
    parts = corner.split(b"/")
    if not parts[0] or len(parts) > len(counts):
        return False
    for part, count in zip(parts, counts, strict=False):
        if part and not (re.fullmatch(rb"-?\d{1,9}", part) and 1 <= abs(int(part)) <= count):
            return False
    return True


def _check_named(file: Path, line: bytes) -> None:
    """Check a file of colours, which the reader of a mesh opens too."""
    place = file.parent / line.split(maxsplit=1)[-1].decode(errors="replace").strip()
    if os.path.exists(place):
        read_bytes(place, most=MOST_DATA)


def _check_dae(file: Path, content: bytes) -> None:
    top = parsed_xml(content, file)
    space = top.tag.partition("}")[0] + "}" if top.tag.startswith("{") else ""
    points = [_numbers(file, (each.text or "").split(), "float_array") for each in top.iter(f"{space}float_array")]
    for key in ("matrix", "translate", "rotate", "scale", "lookat", "skew"):
        points += [_numbers(file, (each.text or "").split(), key) for each in top.iter(f"{space}{key}")]
    _check_points(file, np.concatenate([np.empty(0), *points]).reshape(-1, 1), what="numbers")
    for key in ("p", "v", "vcount"):
        for each in top.iter(f"{space}{key}"):
            if not _WHOLE_NUMBERS.fullmatch(each.text or ""):
                raise InvalidInputError(f"{file}: <{key}>: expected whole numbers")


_FORMATS: dict[str, Callable[[Path, bytes], None]] = {".stl": _check_stl, ".obj": _check_obj, ".dae": _check_dae}
