"""The command ``trajevo init``, which imports nothing that computes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from trajevo.errors import InvalidInputError

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


def init(
    file: Annotated[Path, typer.Argument(help="File to write.")] = Path("task.toml"),
) -> None:
    """Write a commented example of a task to change and solve."""
    _out.print(f"written: {write_example(file)}; next: trajevo solve {file}")
