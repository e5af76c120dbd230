"""Arguments with which robots are loaded: checked, and as plain data from which they can be loaded again."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from trajevo.base.arrays import Array, numbers
from trajevo.base.units import to_si
from trajevo.errors import InvalidInputError, no_such_file
from trajevo.robot.locate import list_robots, robot_path

#: Gravity of a robot without ``robot.toml``, z up in its base frame [m/s²].
STANDARD_GRAVITY = (0.0, 0.0, -9.80665)

#: Gravity above which numbers are not believed; on Jupiter it is 24.8 [m/s²].
_MOST_GRAVITY = 100.0

#: Positions that may be in degrees or millimetres if they are outside a joint's range [rad or m].
_LOCKED_FAR = {"rad": 2.0 * np.pi, "m": 1.0}


def package_folders(packages: Any, *, exist: bool = True) -> tuple[Path, ...]:
    """The given folders of packages, absolute.

    Args:
        packages: the path of a folder, a list of them, or None.
        exist: whether they have to be there; those of a robot that a run holds as text may be on another machine.

    Raises:
        InvalidInputError: neither the path of a folder nor a list of them, or no such folder.
    """
    listed = [packages] if isinstance(packages, str | Path) else () if packages is None else packages
    if not isinstance(listed, list | tuple) or not all(isinstance(folder, str | Path) for folder in listed):
        raise InvalidInputError(f"packages: expected the path of a folder or a list of them, got {packages!r}")
    for folder in listed:
        if exist and not Path(folder).is_dir():
            raise InvalidInputError(f"packages: {no_such_file(folder, 'folder')}")
    return tuple(Path(folder).resolve() for folder in listed)


def checked_gravity(given: Any) -> Array:
    """Gravity in the base frame, shape (3,) [m/s²].

    Raises:
        InvalidInputError: not three finite numbers, or more than anything is built for.
    """
    gravity = numbers(given, name="gravity", shape=(3,))
    strength = float(np.linalg.norm(gravity))
    if strength > _MOST_GRAVITY:
        raise InvalidInputError(
            f"gravity: {strength:g} m/s² looks like mm/s²: expected at most {_MOST_GRAVITY:g} m/s², "
            f"got {gravity.tolist()}"
        )
    return gravity


def check_locked(model: Any, file: Path | str, name: str, joint: Any, position: float) -> None:
    """Refuse a position that must be in degrees or millimetres: beyond the joint's range, and inside it in those."""
    low, high = float(model.lowerPositionLimit[joint.idx_q]), float(model.upperPositionLimit[joint.idx_q])
    unit, likely = ("m", "mm") if "JointModelP" in joint.shortname() else ("rad", "deg")
    inside = position * to_si(likely)
    if not low <= position <= high and abs(position) > _LOCKED_FAR[unit] and low <= inside <= high:
        raise InvalidInputError(
            f"{file}: lock: {name!r}: {position:g} {unit} is outside its range {low:g} to {high:g} {unit} and looks "
            f"like {likely}: positions of locked joints are in {unit}, here {inside:.6g}"
        )


def load_settings(name: str | Path, **given: Any) -> Any:
    """Plain data from which the robot can be loaded again in any working directory: paths are made absolute.

    A robot of a xacro file is told by the text of the URDF that it gave, so that no run names such a file.
    """
    path = None if given.get("urdf") is not None or str(name) in list_robots() else robot_path(name)
    asked = str(name) if path is None else str(path.resolve())
    chosen = plain_settings(given)
    return {"name": asked, **chosen} if chosen else asked


def plain_settings(given: Mapping[str, Any]) -> dict[str, Any]:
    """The arguments that are not None, as data that JSON can hold."""
    return {key: _plain(value) for key, value in given.items() if value is not None}


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if isinstance(value, np.ndarray | np.number):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    return str(value) if isinstance(value, float) and np.isinf(value) else value
