"""The command ``trajevo examples``: the worked tasks, studies and notebooks, and a copy of one."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from trajevo.cli import completion
from trajevo.cli.console import Terminal
from trajevo.cli.screen.tables import Listing
from trajevo.formulation.examples import copy_example, list_examples

#: The next command for a copy, by the kind of the example.
_NEXT = {"task": "trajevo solve {}", "study": "trajevo study run {}", "notebook": "jupyter lab {}"}
_out = Terminal()


def examples(
    name: Annotated[
        str | None,
        typer.Argument(help="Example to copy; all are listed if not given.", autocompletion=completion.examples),
    ] = None,
    folder: Annotated[Path, typer.Argument(help="Folder to copy it to.")] = Path(),
) -> None:
    """List the worked tasks, studies and notebooks, or copy one to a folder."""
    known = list_examples()
    if name is None:
        table = Listing("example", "kind", "what it shows")
        for example in known.values():
            table.add(example.name, example.kind, example.summary)
        _out.print(table)
        _out.print("next: trajevo solve TASK, trajevo study run STUDY; a copy to change: trajevo examples NAME FOLDER")
        return
    copies = copy_example(name, folder)
    then = _NEXT[known[name].kind].format(copies[0])
    _out.print(f"written: {', '.join(map(str, copies))}; next: {then}")
