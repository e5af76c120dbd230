"""The files of a robot, opened: what describes it, its ``robot.toml``, its tool and its place in the cell."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from trajevo.errors import InvalidInputError
from trajevo.robot.description import Description
from trajevo.robot.files.cell import mounted, placed
from trajevo.robot.files.formats import checked_description
from trajevo.robot.files.xacro_files import ENDING
from trajevo.robot.locate import RobotSource, robot_source, warn_of_other_robot

if TYPE_CHECKING:
    from trajevo.robot.robot_toml import RobotFile


@dataclass(frozen=True, eq=False)
class Opened:
    """What the files of a robot hold.

    Attributes:
        name: name by which it was requested.
        folder: folder of its files; None if there is none.
        settings: its ``robot.toml``, if it has one.
        path: the file that describes it; None if a table or a text does.
        where: what messages about it begin with.
        found: its description, in the cell and with its tool.
        text: the URDF before that, where no run may open the file that gave it; None of others.
        tool: its tool frame, None if nobody names one.
        packages: folders in which packages of meshes are looked up.
    """

    name: str
    folder: Path | None
    settings: RobotFile | None
    path: Path | None
    where: Path
    found: Description
    text: str | None
    tool: str | None
    packages: tuple[Path, ...]

    @property
    def called(self) -> str:
        """Its file for people: the name of it, or of the robot where that is all that a run knows."""
        return self.where.name if self.text is None else self.name

    @property
    def needed(self) -> tuple[Path, ...]:
        """The folders of packages, if its text names any package."""
        return self.packages if self.text is not None and "package://" in self.text else ()


def _settings_of(source: RobotSource) -> RobotFile | None:
    """A robot's ``robot.toml``, whose model is imported when there is one."""
    if source.settings is None:
        return None
    from trajevo.robot.robot_toml import RobotFile

    return RobotFile(source.settings)


def opened(
    name: str | Path,
    lock: Collection[str],
    *,
    folders: Sequence[Path],
    urdf: str | None,
    xacro: Mapping[str, Any] | None,
    base: Any,
    tool: str | None,
    tools: Any,
) -> Opened:
    """Open the files of a robot; the arguments are those of :func:`~trajevo.robot.robot.load_robot`."""
    source = robot_source(name) if urdf is None else _text_source(name, urdf)
    warn_of_other_robot(source)
    file = _settings_of(source)
    path = source.urdf if file is None else file.urdf
    where = path or source.settings or source.urdf
    packages = (*folders, *source.packages)
    if file is not None and path is not None and path.suffix.lower() == ENDING:
        raise InvalidInputError(
            f"{file.path}: urdf: expected a URDF or MJCF file, got xacro, which runs may not open: make a URDF of it, "
            f"`xacrodoc {path.name} -o {path.name.removesuffix(ENDING).removesuffix('.urdf')}.urdf`, and name that"
        )
    if path is None and file is not None:
        if xacro is not None:
            raise InvalidInputError(f"{where}: xacro: expected a file .xacro, got a table [dh]")
        found = Description(file.written(), as_written=False)
    else:
        found = checked_description(where, lock, xacro=xacro, packages=packages, urdf=urdf)
    text = found.text if urdf is not None or found.kind == "xacro" else None
    if tools is None and file is not None:
        found, frame = mounted(found, file.tools, tool or file.settings.tool, where)
    else:
        found, frame = mounted(found, tools, tool, where)
    return Opened(
        name=source.name,
        folder=None if urdf is not None else source.folder,
        settings=file,
        path=None if urdf is not None else path,
        where=where,
        found=placed(found, base if base is not None or file is None else file.base, where),
        text=text,
        tool=frame,
        packages=packages,
    )


def _text_source(name: Any, urdf: Any) -> RobotSource:
    if not isinstance(name, str) or not name or not name.isprintable():
        raise InvalidInputError(f"robot: expected a name of printable characters with urdf, got {name!r}")
    if not isinstance(urdf, str):
        raise InvalidInputError(f"robot: urdf: expected the text of a URDF, got {urdf!r}")
    return RobotSource(name, Path(), None, Path(name))
