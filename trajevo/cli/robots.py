"""Commands that need no run: ``trajevo list``, ``init`` and ``check-robot``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from trajevo.cli.terminal import print_examination, print_list
from trajevo.errors import InvalidInputError
from trajevo.robot.examine import examine

MasslessOption = Annotated[
    bool, typer.Option("--allow-massless", help="Links without mass are meant: efforts leave them out.")
]

_EXAMPLE = Path(__file__).with_name("task.toml")


def write_example(file: str | Path) -> Path:
    """Write a commented example of a task that can be solved unchanged.

    Raises:
        InvalidInputError: the file exists, or cannot be written.
    """
    target = Path(file)
    if target.exists():
        raise InvalidInputError(f"{target}: exists already; choose another name")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(_EXAMPLE.read_text(encoding="utf-8"), encoding="utf-8")
    except OSError as error:
        raise InvalidInputError(f"{target}: cannot be written: {error.strerror}") from error
    return target


_out = Console(soft_wrap=True, highlight=False)


def list_everything() -> None:
    """List problems, their building blocks, formats and robots."""
    print_list(_out)


def init(
    file: Annotated[Path, typer.Argument(help="File to write.")] = Path("task.toml"),
) -> None:
    """Write a commented example of a task to change and solve."""
    _out.print(f"written: {write_example(file)}; next: trajevo solve {file}")


def check_robot(
    robot: Annotated[str, typer.Argument(help="Name, folder with robot.toml, or URDF.")],
    lock: Annotated[list[str] | None, typer.Option(help="Joint to hold still; may be repeated.")] = None,
    allow_massless: MasslessOption = False,
) -> None:
    """Show everything that is wrong with a robot at once; exit code 1 if it cannot be loaded."""
    examination = examine(robot, lock=lock or (), allow_massless=allow_massless or None)
    print_examination(_out, examination)
    if examination.errors:
        raise typer.Exit(1)
