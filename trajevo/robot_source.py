"""Where a robot is found: robots/, example-robot-data, a folder, a URDF."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from trajevo.errors import InvalidInputError, UnknownNameError

ROBOTS_FOLDER = Path(__file__).resolve().parents[1] / "robots"


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
