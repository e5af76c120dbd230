"""The file of a robot as XML: read within bounds, with numbers as Pinocchio reads them."""

from __future__ import annotations

import os
import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from trajevo.base.files import read_bytes, why_not
from trajevo.base.plain import parsed_xml
from trajevo.errors import InvalidInputError, no_such_file

#: The numbers that Pinocchio's URDF parser reads; Python's float() takes more: nan, inf, 1_0, trailing spaces.
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


def read_urdf(file: Path) -> ElementTree.Element:
    """The top element of a URDF.

    Raises:
        InvalidInputError: there is no such file, or it is not XML.
    """
    if not os.path.isfile(file):
        raise InvalidInputError(no_such_file(file, "URDF file"))
    try:
        content = read_bytes(file)
    except OSError as error:
        raise InvalidInputError(f"{file}: cannot be read: {why_not(error)}") from error
    return parsed_xml(content, file)


def urdf_number(text: str | None) -> float | None:
    """A number as Pinocchio's parser reads it, or None if it cannot."""
    if text is None or not (_NUMBER.fullmatch(text) and np.isfinite(float(text))):
        return None
    return float(text)


def read_number(element: ElementTree.Element | None, key: str) -> float:
    """A number of an attribute, NaN if there is none or it cannot be read."""
    value = None if element is None else urdf_number(element.get(key))
    return float("nan") if value is None else value


def end_of(joint: ElementTree.Element, role: str) -> str:
    """Name of the link that is the ``"parent"`` or ``"child"`` of a joint, ``""`` if it names none."""
    element = joint.find(role)
    return "" if element is None else element.get("link", "")
