"""The command ``trajevo init``, which imports nothing that computes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from trajevo.base.files import why_not, write_whole
from trajevo.cli.console import Terminal
from trajevo.errors import InvalidInputError

_EXAMPLE = Path(__file__).with_name("task.toml")


def write_example(file: str | Path) -> Path:
    """Write a commented example of a task that can be solved unchanged.

    Raises:
        InvalidInputError: the file exists, or cannot be written.
    """
    target = Path(file)
    if target.exists() or target.is_symlink():
        raise InvalidInputError(f"{target}: exists already; choose another name")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        write_whole(target, _EXAMPLE.read_bytes())
    except OSError as error:
        raise InvalidInputError(f"{target}: cannot be written: {why_not(error)}") from error
    return target


_out = Terminal()


def init(
    file: Annotated[Path, typer.Argument(help="File to write.")] = Path("task.toml"),
) -> None:
    """Write a commented example of a task to change and solve."""
    _out.print(f"written: {write_example(file)}; next: trajevo solve {file}")
