"""The page of all commands, from what the command line itself knows of them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from trajevo.cli.main import COMMANDS, app

INTRODUCTION = """# Commands

What follows is what `trajevo --help` and `trajevo COMMAND --help` say. Numbers are in SI units where a text names
no other. Bad input ends with one sentence and exit code 2, a front without a solution with 3, and what stopped a run
with 130 (SIGINT) or 143 (SIGTERM); other exit codes stand with their commands.

`trajevo --version` shows the version; `trajevo --install-completion` lets your shell complete commands, options, runs
and names.
"""


def page() -> str:
    """The page in Markdown: a section for each command, with its arguments and options."""
    rows = [f"| [`trajevo {name}`](#{anchor(name)}) | {_cell(command.help)} |" for name, command, _ in commands()]
    parts = [INTRODUCTION, "| command | what it does |\n|---|---|\n" + "\n".join(rows), *map(_section, commands())]
    return "\n\n".join(parts) + "\n"


def commands() -> Iterator[tuple[str, Any, Any]]:
    """Each command by its name, such as ``solve`` and ``study run``, with the context that its help needs."""
    top = app.context_class(app, info_name="trajevo")
    for name in COMMANDS:
        command = app.get_command(top, name)
        context = command.context_class(command, info_name=name, parent=top)
        inner = getattr(command, "commands", {})
        for part, one in inner.items():
            yield f"{name} {part}", one, one.context_class(one, info_name=part, parent=context)
        if not inner:
            yield name, command, context


def anchor(name: str) -> str:
    """The anchor of a command's section."""
    return f"trajevo-{name.replace(' ', '-')}"


def _section(entry: tuple[str, Any, Any]) -> str:
    name, command, context = entry
    parts = [f"({anchor(name)})=\n## trajevo {name}", _prose(command.help)]
    usage = command.get_usage(context).removeprefix("Usage: ")
    parts.append(f"```text\n{' '.join(usage.split())}\n```")
    for title, kind in (("argument", "argument"), ("option", "option")):
        rows = [one.get_help_record(context) for one in command.params if one.param_type_name == kind]
        rows = [row for row in rows if row is not None]
        if rows:
            table = [f"| {title} | meaning |", "|---|---|", *(f"| `{row[0]}` | {_cell(row[1])} |" for row in rows)]
            parts.append("\n".join(table))
    return "\n\n".join(parts)


def _prose(help_text: str) -> str:
    """The help of a command as paragraphs."""
    return "\n\n".join(" ".join(part.split()) for part in help_text.split("\n\n"))


def _cell(text: str) -> str:
    """Help in a cell of a table: on one line, with nothing that Markdown would read."""
    line = " ".join(text.split())
    return re.sub(r"([|<>*_\[\]])", r"\\\1", line)
