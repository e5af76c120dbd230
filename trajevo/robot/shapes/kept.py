"""What links look like, kept in the user's cache: meshes take a second to read and to simplify, and seldom change."""

from __future__ import annotations

import hashlib
import io
from dataclasses import dataclass
from pathlib import Path
from typing import final
from xml.etree import ElementTree

import numpy as np

from trajevo.base.arrays import Array, read_only
from trajevo.base.files import MOST_DATA, cache_folder, read_bytes, write_whole
from trajevo.errors import InvalidInputError
from trajevo.robot.robot import Robot
from trajevo.robot.urdf.look import files_of

#: Number of this way of simplifying; another one makes shapes anew.
_VERSION = 2


@final
@dataclass(frozen=True, eq=False)
class LinkShape:
    """What a link looks like.

    Attributes:
        link: name of the link.
        joint: number of the joint of the model that carries it, 0 for the base.
        vertices: in that joint's frame, shape (V, 3) [m].
        triangles: numbers of their vertices, shape (M, 3).
        colour: red, green and blue from 0 to 1.
    """

    link: str
    joint: int
    vertices: Array
    triangles: Array
    colour: tuple[float, float, float]


@final
@dataclass(frozen=True)
class KeptShapes:
    """The file in which the shapes of a robot's links are kept.

    Attributes:
        file: the file, whose name tells all that the shapes depend on; None where there is no place for it.
    """

    file: Path | None

    @classmethod
    def of(cls, robot: Robot, most: int) -> KeptShapes:
        """Where the shapes of a robot are kept.

        Args:
            robot: the robot.
            most: greatest number of triangles of a mesh.
        """
        try:
            folder = cache_folder("links")
        except RuntimeError:  # the user has no home
            return cls(None)
        document = robot.description()
        content = hashlib.sha256(f"{_VERSION} {most} {sorted(robot.locked.items())} ".encode())
        content.update(" ".join(robot.model.names).encode())
        content.update(ElementTree.tostring(document))
        for kind in ("visual", "collision"):
            for mesh in document.iterfind(f"link/{kind}/geometry/mesh"):
                for file in files_of(mesh.get("filename") or "", robot.packages):
                    stat = file.stat()
                    content.update(f"{file} {stat.st_mtime_ns} {stat.st_size} ".encode())
        return cls(folder / f"{content.hexdigest()}.npz")

    def read(self) -> tuple[LinkShape, ...] | None:
        """The shapes; None if they are not kept, or the file is damaged."""
        if self.file is None:
            return None
        try:
            with np.load(io.BytesIO(read_bytes(self.file, most=MOST_DATA)), allow_pickle=False) as held:
                links, joints, colours = held["links"].tolist(), held["joints"].tolist(), held["colours"].tolist()
                return tuple(
                    LinkShape(
                        link,
                        joint,
                        read_only(held[f"vertices_{k}"].astype(np.float64)),
                        held[f"triangles_{k}"].astype(np.intp),
                        (colour[0], colour[1], colour[2]),
                    )
                    for k, (link, joint, colour) in enumerate(zip(links, joints, colours, strict=True))
                )
        except (OSError, InvalidInputError, ValueError, KeyError, IndexError):
            return None

    def write(self, shapes: tuple[LinkShape, ...]) -> None:
        """Keep shapes for the next time; where that cannot be done, nothing is kept."""
        if self.file is None:
            return
        held: dict[str, Array] = {
            "links": np.array([one.link for one in shapes], dtype=str),
            "joints": np.array([one.joint for one in shapes], dtype=np.int64),
            "colours": np.array([one.colour for one in shapes], dtype=np.float64).reshape(-1, 3),
        }
        for k, one in enumerate(shapes):
            held |= {f"vertices_{k}": one.vertices, f"triangles_{k}": one.triangles}
        stream = io.BytesIO()
        np.savez_compressed(stream, **held)  # type: ignore[arg-type]
        try:
            self.file.parent.mkdir(parents=True, exist_ok=True)
            write_whole(self.file, stream.getvalue())
        except OSError:
            return
