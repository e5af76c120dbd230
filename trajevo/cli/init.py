"""The commands ``trajevo init`` and ``trajevo examples``: files to begin with. Neither imports what computes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from trajevo.base.files import why_not, write_whole
from trajevo.cli import completion
from trajevo.cli.console import Terminal
from trajevo.cli.screen.tables import Listing
from trajevo.errors import InvalidInputError, checked_name

#: The usual example, and the folder of those with a name.
_USUAL = Path(__file__).with_name("task.toml")
_TEMPLATES = Path(__file__).with_name("templates")

#: The next command for a copy, by the kind of the example.
_NEXT = {"task": "trajevo solve {}", "study": "trajevo study run {}", "notebook": "jupyter lab {}"}
_CHOOSE = "trajevo choose-robot {}"


def templates() -> dict[str, Path]:
    """The examples with a name."""
    return {file.stem: file for file in sorted(_TEMPLATES.glob("*.toml"))}


def write_example(file: str | Path, example: str | None = None) -> Path:
    """Write a commented example of a task that can be solved unchanged.

    Args:
        file: the file to write.
        example: name of one of :func:`templates`; the usual one if None.

    Raises:
        UnknownNameError: no example of that name.
        InvalidInputError: the file exists, or cannot be written.
    """
    known = templates()
    source = _USUAL if example is None else known[checked_name("example", example, known)]
    target = Path(file)
    if target.exists() or target.is_symlink():
        raise InvalidInputError(f"{target}: exists already; choose another name")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        write_whole(target, source.read_bytes())
    except OSError as error:
        raise InvalidInputError(f"{target}: cannot be written: {why_not(error)}") from error
    return target


_out = Terminal()


def init(
    file: Annotated[Path, typer.Argument(help="File to write.")] = Path("task.toml"),
    example: Annotated[
        str | None,
        typer.Option(
            help=f"What it shows: {', '.join(templates())}; the usual first task if not given.",
            autocompletion=lambda: list(templates()),
        ),
    ] = None,
) -> None:
    """Write a commented example of a task to change and solve."""
    _out.print(f"written: {write_example(file, example)}; next: trajevo solve {file}")


def examples(
    name: Annotated[
        str | None,
        typer.Argument(help="Example to copy; all are listed if not given.", autocompletion=completion.examples),
    ] = None,
    folder: Annotated[Path, typer.Argument(help="Folder to copy it to.")] = Path(),
) -> None:
    """List the worked tasks, studies and notebooks, or copy one to a folder."""
    from trajevo.formulation.examples import copy_example, list_examples  # imported where examples are wanted

    known = list_examples()
    if name is None:
        table = Listing("example", "kind", "what it shows")
        for example in known.values():
            table.add(example.name, example.kind, example.summary)
        _out.print(table)
        _out.print("next: trajevo solve TASK, trajevo study run STUDY; a copy to change: trajevo examples NAME FOLDER")
        return
    copies = copy_example(name, folder)
    chosen = known[name]
    then = (_CHOOSE if chosen.compares_robots else _NEXT[chosen.kind]).format(copies[0])
    _out.print(f"written: {', '.join(map(str, copies))}; next: {then}")
