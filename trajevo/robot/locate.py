"""Where robots are found: in robots/ or example-robot-data, in a folder, or in a URDF."""

from __future__ import annotations

import os
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from trajevo.base.files import data_folder
from trajevo.errors import InvalidInputError, UnknownNameError, no_such_file
from trajevo.robot.urdf.file import read_urdf

ROBOTS_FOLDER = data_folder("robots")

#: Top element or ending of a file that is no URDF -> what it is, and the way out.
_CONVERTED = {
    "sdf": ", SDF of Gazebo: give the URDF from which it was made, or export one",
    ".srdf": ", which holds groups and poses but no links: give the URDF beside it",
    ".stl": ", a mesh: give the URDF that refers to it",
    ".dae": ", a mesh: give the URDF that refers to it",
    ".obj": ", a mesh: give the URDF that refers to it",
    ".step": ", a CAD model: export a URDF from CAD",
    ".stp": ", a CAD model: export a URDF from CAD",
    ".usd": ", USD: export a URDF or MJCF",
    ".usda": ", USD: export a URDF or MJCF",
    ".usdc": ", USD: export a URDF or MJCF",
    ".usdz": ", USD: export a URDF or MJCF",
    ".3ds": ", a mesh: give the URDF that refers to it",
    ".ply": ", a mesh: give the URDF that refers to it",
    ".gltf": ", a mesh: give the URDF that refers to it",
    ".glb": ", a mesh: give the URDF that refers to it",
    ".iges": ", a CAD model: export a URDF from CAD",
    ".igs": ", a CAD model: export a URDF from CAD",
    ".mjb": ", a compiled model of MuJoCo: save it as XML (mj_saveLastXML)",
}


#: Top elements of the formats that are read: URDF and MJCF.
_READ = ("robot", "mujoco")


@dataclass(frozen=True)
class RobotSource:
    """Files of a robot.

    Attributes:
        name: name by which the robot was requested.
        folder: folder of its files.
        settings: its ``robot.toml``, or None.
        urdf: its URDF; if there is a ``robot.toml``, the URDF named there is used instead.
        packages: folders in which ``package://`` paths are looked up.
    """

    name: str
    folder: Path
    settings: Path | None
    urdf: Path
    packages: tuple[Path, ...] = ()


def list_robots() -> list[str]:
    """Names of the robots that come with trajevo."""
    return sorted(folder.name for folder in ROBOTS_FOLDER.iterdir() if (folder / "robot.toml").is_file())


def list_example_robots() -> list[str]:
    """Names of the robots of example-robot-data that have a fixed base; none if it is not installed."""
    return sorted(name for name, loader in _example_loaders().items() if not loader.free_flyer)


def robot_source(name: str | Path) -> RobotSource:
    """The files of a robot, from its name, its folder or its URDF.

    Raises:
        UnknownNameError: no such robot.
        InvalidInputError: neither text nor a path, or a robot of example-robot-data without a fixed base.
    """
    if not isinstance(name, str | Path):
        raise InvalidInputError(f"robot: expected a name or the path of a folder, got {name!r}")
    if str(name) in list_robots():
        return _folder(ROBOTS_FOLDER / str(name))
    path = Path(name)
    if os.path.isfile(path / "robot.toml"):
        return _folder(path)
    if is_described(path):
        return RobotSource(path.stem.removesuffix(".urdf"), path.parent, None, path, _around(path))
    loaders = _example_loaders()
    if str(name) not in loaders:
        _refuse_path(path)
        raise UnknownNameError("robot", name, [*list_robots(), *list_example_robots()])
    return _example(str(name), loaders[str(name)])


def other_robot(source: RobotSource) -> str | None:
    """A warning if a name of example-robot-data loads another robot, as ``ur3`` loads a UR5, otherwise None.

    Only the first word of the name counts: ``panda`` in ``panda_collision``. The warning is given if neither the file
    name of the URDF nor the robot's name inside it contains that word, and both contain the name of another robot.
    """
    known = list_example_robots()
    if source.settings is not None or source.name not in known or not source.urdf.is_file():
        return None
    try:
        inside = read_urdf(source.urdf).get("name", "")
    except InvalidInputError:
        return None  # reported when the URDF is read next
    found = (source.urdf.stem.lower(), inside.lower())
    others = [name for name in known if name != source.name and all(name in text for text in found)]
    if not others or any(source.name.split("_")[0] in text for text in found):
        return None
    return (
        f"robot {source.name!r}: example-robot-data has another robot under this name, {inside!r} in "
        f"{source.urdf.name}; load {others[0]!r} if you want that one, or give the path of a URDF of {source.name!r}"
    )


def warn_of_other_robot(source: RobotSource) -> None:
    """Warn, at the line that called ``load_robot``, if a name loads another robot."""
    sentence = other_robot(source)
    if sentence is not None:
        warnings.warn(sentence, UserWarning, stacklevel=4)


def is_described(path: Path) -> bool:
    """Whether a path is that of a robot: a URDF by its ending, or a file that exists: xacro, or one that holds a robot.

    The content decides, but for xacro, which has the same top element as a URDF.
    """
    ending = path.suffix.lower()
    if ending == ".urdf" or not ending or not os.path.isfile(path):
        return ending == ".urdf"
    return ending == ".xacro" or _top_of(path) in _READ


def robot_path(name: str | Path, *, folder: Path = Path()) -> Path | None:
    """The path that a robot's name is, from a folder on; None if it is the name of a robot.

    Args:
        name: as :func:`robot_source` takes it.
        folder: folder from which a relative path starts.
    """
    path = folder / name
    return path if is_described(path) or os.path.isfile(path / "robot.toml") else None


def _top_of(path: Path) -> str:
    """Tag of the top element of an XML file, ``""`` if there is none."""
    try:
        return str(read_urdf(path).tag)
    except InvalidInputError:
        return ""


def _refuse_path(path: Path) -> None:
    """Refuse what is meant as a path but leads to no robot, and say the way out; a bare name is let through."""
    ending = path.suffix.lower()
    if os.path.isdir(path):
        raise InvalidInputError(f"robot: {path}: {_no_robot_in(path)}")
    if not os.path.isfile(path):
        if ending or len(path.parts) > 1:
            raise InvalidInputError(f"robot: {no_such_file(path, 'file' if ending else 'file or folder')}")
        return
    top = _top_of(path)
    found = f"<{top}>" if top else f"a file {ending or path.name}"
    way = _CONVERTED.get(top) or _CONVERTED.get(ending, "")
    raise InvalidInputError(
        f"robot: {path}: expected a URDF, xacro or MJCF file, XML with <robot> or <mujoco> at its top, got {found}{way}"
    )


def _no_robot_in(folder: Path) -> str:
    files = sorted(entry for entry in folder.iterdir() if entry.suffix.lower() in (".urdf", ".xacro"))
    if len(files) == 1:
        return f"a folder without robot.toml; give the path of its file, {str(files[0])!r}"
    there = f", such as {str(files[0])!r}" if files else ""
    return f"a folder without robot.toml; expected one, or the path of a URDF{there}"


def _around(file: Path) -> tuple[Path, ...]:
    """Folders in which packages are looked up: that of a file and those above, as in ``NAME/urdf/robot.urdf``."""
    return tuple(file.resolve().parents[:4])


def _folder(folder: Path) -> RobotSource:
    return RobotSource(folder.name, folder, folder / "robot.toml", folder, _around(folder / "robot.toml"))


def _example(name: str, loader: Any) -> RobotSource:
    from example_robot_data.robots_loader import getModelPath

    if loader.free_flyer:
        raise InvalidInputError(
            f"robot {name!r}: stands on a free-flyer, which cannot be planned for; expected a robot on a fixed base: "
            f"{', '.join(list_example_robots())}"
        )
    share = Path(getModelPath(loader.path)).resolve()
    urdf = share / loader.path / loader.urdf_subpath / loader.urdf_filename
    return RobotSource(name, urdf.parent, None, urdf, (share, share.parent, share.parent.parent))


def _example_loaders() -> dict[str, Any]:
    """Robots of example-robot-data by name; none where that was left out of the installation for its size."""
    try:
        from example_robot_data.robots_loader import ROBOTS
    except ModuleNotFoundError:
        return {}
    return dict(ROBOTS)
