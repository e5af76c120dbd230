"""Help pages on a terminal of 80 columns: every unit, every name of an option, nothing cut."""

import ast
import importlib
import re
from pathlib import Path

import pytest
import typer

from tests.helpers import trajevo
from trajevo import cli
from trajevo.cli.main import COMMANDS, app
from trajevo.cli.study import app as study_app
from trajevo.formulation.search import Search

CLI = Path(cli.__file__).parent
UNIT = re.compile(r"\[[^\[\]]+\]")
PAGES = [(), *((name,) for name in COMMANDS), *(("study", name) for name in ("run", "status", "collect"))]
PAGES += [("bench", name) for name in ("run", "table", "compare")]


def close(text):
    """Text without white space, since pages break lines at spaces and hyphens."""
    return "".join(text.split())


@pytest.fixture(scope="module")
def pages():
    for home in COMMANDS.values():  # whose consoles keep the width that they are made with
        importlib.import_module(f"trajevo.cli.{home.module}")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("COLUMNS", "80")
        return {page: trajevo(*page, "--help").stdout for page in PAGES}


def told_in_source():
    """Help of all options and arguments, and the descriptions of commands, as they are written in the source."""
    for file in sorted(CLI.rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.keyword) and node.arg == "help" and isinstance(node.value, ast.Constant):
                yield str(node.value.value)
    yield from (home.help for home in COMMANDS.values())
    yield from (str(field.description) for field in Search.model_fields.values())


def test_every_unit_of_the_source_is_in_a_help_page(pages):
    with_units = [text for text in told_in_source() if UNIT.search(text)]
    units = {unit for text in with_units for unit in UNIT.findall(text)}
    assert {"[kg]", "[s]", "[rad]", "[m]", "[m/s²]", "[rad or m]", "[deg]", "[W]", "[m/s]"} <= units
    assert len(with_units) >= 20
    everything = close("\n".join(pages.values()))
    assert [text for text in with_units if close(text) not in everything] == []


def test_every_option_is_told_by_its_whole_name(pages):
    context = typer.Context(app)
    for name in COMMANDS:
        command = app.get_command(context, name)
        for inner in getattr(command, "commands", {"": command}).values():
            page = pages[(name,) if inner is command else (name, inner.name)]
            options = [one for parameter in inner.params for one in (*parameter.opts, *parameter.secondary_opts)]
            assert [one for one in options if one.startswith("--") and not re.search(rf"{one}\b", page)] == []
            assert all(close(parameter.help) in close(page) for parameter in inner.params if parameter.help)


def test_nothing_is_cut_and_no_line_is_longer_than_the_terminal(pages):
    for page, text in pages.items():
        assert max(map(len, text.splitlines())) <= 80, page
        assert "…" not in text, page
    assert all(close(home.help) in close(pages[()]) for home in COMMANDS.values())
    assert all(close(command.callback.__doc__) in close(pages["study",]) for command in study_app.registered_commands)
