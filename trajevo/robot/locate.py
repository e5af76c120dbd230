"""Where robots are found: in robots/ or example-robot-data, in a folder, or in a URDF."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from trajevo.base.files import data_folder
from trajevo.errors import InvalidInputError, UnknownNameError
from trajevo.robot.urdf import read_urdf

ROBOTS_FOLDER = data_folder("robots")


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
    """Names of the robots of example-robot-data that have a fixed base."""
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
    if (path / "robot.toml").is_file():
        return _folder(path)
    if path.suffix == ".urdf":
        return RobotSource(path.stem, path.parent, None, path, (path.parent, path.parent.parent))
    loaders = _example_loaders()
    if str(name) not in loaders:
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
    """Warn, at the line that called this function's caller, if a name loads another robot."""
    sentence = other_robot(source)
    if sentence is not None:
        warnings.warn(sentence, UserWarning, stacklevel=3)


def _folder(folder: Path) -> RobotSource:
    return RobotSource(folder.name, folder, folder / "robot.toml", folder, (folder, folder.parent))


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
    from example_robot_data.robots_loader import ROBOTS

    return dict(ROBOTS)
