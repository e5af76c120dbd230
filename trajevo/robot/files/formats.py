"""The file of a robot read by what it holds: URDF, MJCF, or xacro."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from trajevo.base.plain import parsed_xml
from trajevo.errors import InvalidInputError
from trajevo.robot.description import Description
from trajevo.robot.files.xacro_files import ENDING, expanded
from trajevo.robot.urdf.file import read_urdf
from trajevo.robot.urdf.problems import checked_text


def described(
    file: Path,
    lock: Collection[str],
    *,
    xacro: Mapping[str, Any] | None = None,
    packages: Sequence[Path] = (),
    urdf: str | None = None,
) -> Description:
    """What a file says of a robot, in whatever format; not checked yet.

    Args:
        file: a URDF, MJCF or xacro file.
        lock: joints that will be locked.
        xacro: arguments of the xacro file.
        packages: folders in which the xacro file finds packages.
        urdf: text of the URDF in place of the file's.

    Raises:
        InvalidInputError: the file is missing or not XML, MJCF that cannot be planned for, or arguments for a file that
            is no xacro.
    """
    if urdf is not None:
        root = parsed_xml(urdf.encode(errors="replace"), file)
        return Description(ElementTree.tostring(root, encoding="unicode"), as_written=False)
    if file.suffix.lower() == ENDING:
        root = expanded(file, xacro or {}, packages)
        return Description(ElementTree.tostring(root, encoding="unicode"), kind="xacro", as_written=False)
    if xacro is not None:
        raise InvalidInputError(f"{file}: xacro: expected arguments for a file {ENDING} alone, got {dict(xacro)}")
    root = read_urdf(file)
    if root.tag == "mujoco":
        from trajevo.robot.mjcf.reader import read_mjcf  # imported when such a file is read: most robots have none

        return read_mjcf(root, file, lock)
    return Description(ElementTree.tostring(root, encoding="unicode"))


def checked_description(file: Path, lock: Collection[str], **given: Any) -> Description:
    """As :func:`described`, checked by :func:`~trajevo.robot.urdf.problems.checked_text`, with what links look like."""
    found = described(file, lock, **given)
    return replace(found, text=_checked(found.text, str(file), frozenset(lock)))


@lru_cache(maxsize=8)
def _checked(text: str, file: str, lock: frozenset[str]) -> str:
    """Text that was checked, once for the same text: studies and scripts load one robot again and again."""
    return checked_text(ElementTree.fromstring(text), file, lock, look=True)
