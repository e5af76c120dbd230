"""The file of a robot read by what it holds: URDF, or MJCF."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

from trajevo.robot.loading.description import Description
from trajevo.robot.mjcf.reader import read_mjcf
from trajevo.robot.urdf.file import read_urdf
from trajevo.robot.urdf.problems import checked_text


def described(file: Path, lock: Collection[str]) -> Description:
    """What a file says of a robot, in whatever format; not checked yet.

    Args:
        file: a URDF or MJCF file.
        lock: joints that will be locked.

    Raises:
        InvalidInputError: the file is missing or not XML, or MJCF that cannot be planned for.
    """
    root = read_urdf(file)
    if root.tag == "mujoco":
        return read_mjcf(root, file, lock)
    return Description(ElementTree.tostring(root, encoding="unicode"))


def checked_description(file: Path, lock: Collection[str]) -> Description:
    """As :func:`described`, checked by :func:`~trajevo.robot.urdf.problems.checked_urdf`."""
    found = described(file, lock)
    return replace(found, text=checked_text(ElementTree.fromstring(found.text), file, lock))
