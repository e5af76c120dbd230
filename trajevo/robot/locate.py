"""Where a robot is found: robots/, example-robot-data, a folder, a URDF."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from trajevo.base.files import data_folder
from trajevo.errors import InvalidInputError, UnknownNameError

ROBOTS_FOLDER = data_folder("robots")


@dataclass(frozen=True)
class RobotSource:
    """Files of a robot.

    Attributes:
        name: name it was asked for by.
        folder: where it lies.
        settings: its ``robot.toml``, or None.
        urdf: its URDF; with a ``robot.toml`` the one that names counts.
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
    """Names of example-robot-data that stand on a fixed base."""
    return sorted(name for name, loader in _example_loaders().items() if not loader.free_flyer)


def robot_source(name: str | Path) -> RobotSource:
    """The files of a robot by name, folder or URDF."""
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
    """One sentence if a name of example-robot-data loads another robot than it says, or None: ``ur3`` loads a UR5.

    A name is known by its first word, as in ``panda_collision``. It is doubted only if neither the URDF's file name nor
    the robot's name in it holds that word and both hold the name of another robot.
    """
    known = list_example_robots()
    if source.settings is not None or source.name not in known or not source.urdf.is_file():
        return None
    try:
        inside = ElementTree.parse(source.urdf).getroot().get("name", "")
    except (OSError, LookupError, ValueError, ElementTree.ParseError):
        return None  # whoever reads the URDF next says so
    found = (source.urdf.stem.lower(), inside.lower())
    others = [name for name in known if name != source.name and all(name in text for text in found)]
    if not others or any(source.name.split("_")[0] in text for text in found):
        return None
    return (
        f"robot {source.name!r}: example-robot-data answers this name with another robot, {inside!r} of "
        f"{source.urdf.name}; load {others[0]!r} if that is meant, or give the path of a URDF of {source.name!r}"
    )


def warn_of_other_robot(source: RobotSource) -> None:
    """Warn whoever called the caller, if a name loads another robot than it says."""
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
