"""Files that hold obstacles: scenes of MoveIt, and MJCF."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Any

from trajevo.base.files import MOST_DATA, read_bytes, source_of_names, why_not
from trajevo.errors import InvalidInputError
from trajevo.formulation.constraints.scenes.obstacles import Obstacle


def read_obstacles(given: Any) -> tuple[Obstacle, ...]:
    """The obstacles of a file.

    Args:
        given: path of a scene of MoveIt as text, or of an MJCF file.

    Raises:
        InvalidInputError: no such file, another format, a mistake in it, no obstacle in it, or the data of a run names
            it, which holds the obstacles themselves.
    """
    if not isinstance(given, str | PathLike) or not str(given):
        raise InvalidInputError(f"scene: file: expected the path of a scene, got {given!r}")
    source = source_of_names()
    if source:
        raise InvalidInputError(f"{source} names a file to read, {str(given)!r}; the data of a run holds its obstacles")
    file = Path(given)
    try:
        content = read_bytes(file, most=MOST_DATA)
    except OSError as error:
        raise InvalidInputError(f"scene: file: {file}: cannot be read: {why_not(error)}") from error
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InvalidInputError(f"scene: file: {file}: expected text: {why_not(error)}") from error
    found = _obstacles(content, text, file)
    if not found:
        raise InvalidInputError(f"scene: file: {file}: expected obstacles, got none")
    return found


def _obstacles(content: bytes, text: str, file: Path) -> tuple[Obstacle, ...]:
    # The reader of a format is imported when a file of it is read: most tasks have none.
    if text.lstrip().startswith("<"):
        from trajevo.formulation.constraints.scenes.mjcf_scene import mjcf_obstacles

        return mjcf_obstacles(content, file)
    from trajevo.formulation.constraints.scenes.moveit_scene import moveit_obstacles

    return moveit_obstacles(text, file)
