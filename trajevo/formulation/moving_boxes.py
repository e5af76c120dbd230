"""Boxes in which points may move, as problems are given them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from trajevo.base.units import if_degrees
from trajevo.errors import InvalidInputError
from trajevo.path.boxes import CartesianBox, JointBox
from trajevo.path.via_points import ViaPoints
from trajevo.robot.robot import Robot

#: Half width of a box of the tool above which numbers are not believed [m].
_MOST_WIDTH = 20.0


def boxes_of(moving: Sequence[Any]) -> list[JointBox | CartesianBox]:
    """The boxes of a list of boxes or of mappings with ``point``, and ``joints`` or ``tool``."""
    if isinstance(moving, Mapping | str) or not isinstance(moving, Sequence):
        raise InvalidInputError(f"moving: expected a list of boxes, got {moving!r}")
    return [_box(k, given) for k, given in enumerate(moving)]


def check_widths(boxes: Sequence[JointBox | CartesianBox], via: ViaPoints, robot: Robot) -> None:
    """Refuse half widths that must be in degrees or millimetres."""
    for box in boxes:
        widths = np.asarray(box.half_width)
        if isinstance(box, CartesianBox):
            if widths.max() > _MOST_WIDTH:
                raise InvalidInputError(
                    f"moving: tool: a half width of {widths.max():g} m at point {box.point} looks like mm: expected at "
                    f"most {_MOST_WIDTH:g} m, {1e-3 * widths.max():g} if it is mm"
                )
        elif len(widths) == robot.dof and box.point < len(via):  # is told elsewhere if not
            q, limits = via.positions[box.point], robot.limits
            turns = (np.array(robot.joint_units) == "rad") & (widths > 2.0 * np.pi)
            for j in np.flatnonzero(turns & (q - widths <= limits.lower) & (q + widths >= limits.upper)).tolist():
                raise InvalidInputError(
                    f"moving: joints: a half width of {widths[j]:g} rad at point {box.point} covers the whole range of "
                    f"{robot.joint_names[j]!r}{if_degrees(float(widths[j]))}"
                )


def _box(place: int, given: Any) -> JointBox | CartesianBox:
    if isinstance(given, JointBox | CartesianBox):
        return given
    keys = set(given) if isinstance(given, Mapping) else set()
    if keys - {"keep_orientation"} == {"point", "tool"}:
        return CartesianBox(given["point"], given["tool"], keep_orientation=given.get("keep_orientation", True))
    if keys != {"point", "joints"}:
        raise InvalidInputError(
            f"moving.{place}: expected point, and joints or tool (with keep_orientation if wanted), got {given!r}"
        )
    return JointBox(given["point"], given["joints"])


def box_settings(box: JointBox | CartesianBox) -> dict[str, Any]:
    """Plain data that makes an equal box."""
    half_width = np.asarray(box.half_width).tolist()
    if isinstance(box, JointBox):
        return {"point": box.point, "joints": half_width}
    return {"point": box.point, "tool": half_width, "keep_orientation": box.keep_orientation}
