"""What cannot be asked of a problem whose cell varies, as it means joint positions or places that are not known."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from trajevo.errors import InvalidInputError
from trajevo.formulation.cell.base_box import BaseBox
from trajevo.formulation.constraints.scene import Scene

#: Why an argument cannot be used where the base moves.
_BASE = {
    "moving": "as points are poses that stay where they are",
    "segments": "as lines, arcs and upright axes are laid through points of one base",
    "cyclic": "as the seam is closed at points of one base; repeat the first pose at the end, where the motion rests",
    "pace": "as it goes along points of one base",
    "extra_points": "as free points lie between points of one base",
    "bspline": "as its control points lie between points of one base",
    "turns": "as points are poses, each reached by the posture nearest to the one before",
}

#: The same where postures or the order of visits are chosen.
_VISITS = {
    "moving": "as boxes lie around joint positions of one posture",
    "segments": "as lines and arcs of the tool are laid through joint positions of one posture; upright can be asked",
    "cyclic": "as the seam is closed at one posture; repeat the first point at the end, where the motion rests",
    "pace": "as it goes along points of one order",
    "extra_points": "as free points lie between points of one order",
    "bspline": "as its control points lie between points of one order",
}


def check_beside(given: Mapping[str, Any], box: BaseBox | None) -> None:
    """Refuse arguments that mean joint positions, which differ from motion to motion, or fixed places in the cell.

    Args:
        given: values by the names of the arguments; what is empty is not given.
        box: where the base may stand; None if it stays, and postures or the order of visits are chosen.

    Raises:
        InvalidInputError: one is given.
    """
    why, where = (_VISITS, "postures or the order are chosen") if box is None else (_BASE, "the base moves")
    for name, value in given.items():
        empty = value is None or value is False or value == 0 or value == () or value == []
        if not empty and name in why and not (box is None and name == "segments" and _of_no_way(value)):
            raise InvalidInputError(f"{name}: expected none where {where}, {why[name]}")


def _of_no_way(segments: Any) -> bool:
    """Whether no segment asks for a line or an arc of the tool."""
    asked = [one.get("tool") if isinstance(one, Mapping) else getattr(one, "tool", None) for one in segments]
    return not any(asked)


def check_limits(parameters: Mapping[str, Any], box: BaseBox | None) -> None:
    """Refuse limits in the robot's frame that a moving base would move, or that need points that do not vary.

    Args:
        parameters: values of the parameters of limits by name.
        box: where the base may stand; None if it stays.

    Raises:
        InvalidInputError: one is given.
    """
    if parameters.get("overshoot") is not None:
        what, which = ("postures or the order are chosen", "motion") if box is None else ("the base moves", "base")
        raise InvalidInputError(
            f"overshoot: expected none where {what}, as it is measured from the range of the points' joint positions, "
            f"which differ from {which} to {which}"
        )
    if box is None:
        return
    scene = parameters.get("scene")
    moving = [] if scene is None else [one.name for one in Scene.of(scene).moving]
    if moving:
        raise InvalidInputError(
            f"scene: obstacle {moving[0]!r}: motion: expected obstacles that stand still where the base moves"
        )
    if parameters.get("tool_height") is not None and 2 in box.free:
        raise InvalidInputError(
            "tool_height: expected a base that does not move along z, as the height is measured in the base frame; "
            "keep the tool above a plane of the scene instead"
        )
    if parameters.get("tool_height") is not None and box.tilts:
        raise InvalidInputError(
            "tool_height: expected a base that does not tilt, as the height is measured along z of the base frame; "
            "keep the tool above a plane of the scene instead"
        )
