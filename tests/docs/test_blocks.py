"""Every block of every page runs: Python in one namespace, commands in order, in an empty folder, as it shows."""

import os
import re
import tomllib
from functools import cache

import matplotlib as mpl
import pytest

from tests.docs.blocks import DOCS, blocks, pages, run_page, runs
from tests.helpers import mostly_long
from trajevo.cli.main import COMMANDS, app

PAGES = pages()
RUN = [page for page in PAGES if runs(page)]
#: Those that `make test` runs as they stand, since they take a quarter of a second. `make test-long` runs all.
WHOLE = (
    "explanation/exact_extremes.md",
    "explanation/hypervolume.md",
    "how_to/many_points.md",
    "how_to/no_urdf.md",
    "how_to/notebooks.md",
    "how_to/robot_files.md",
)
#: Those that `make test` runs with shorter searches. Of all others it looks at names, commands and options alone.
SHORT = (
    "explanation/reproducibility.md",
    "explanation/starts.md",
    "how_to/changing_load.md",
    "how_to/drives.md",
    "how_to/goals.md",
    "how_to/identify.md",
    "how_to/infeasible.md",
    "how_to/interpolant.md",
    "how_to/lines.md",
    "how_to/obstacle.md",
    "how_to/own_objective.md",
    "how_to/own_robot.md",
    "how_to/points.md",
    "how_to/tasks.md",
)
#: Those whose Python `make test` runs as it stands, without their commands.
PYTHON = (
    "how_to/infeasible.md",
    "how_to/proof.md",
    "how_to/report.md",
    "how_to/sheet.md",
    "how_to/which_solution.md",
)

#: Why blocks are not run, page by page.
NOT_RUN = {
    "installation.md": ["installs", "changes the environment"],
    "explanation/optimum.md": ["needs a checkout, CasADi and minutes"],
    "how_to/command_line.md": ["a list to choose from, which would take an hour"],
    "how_to/proof.md": ["runs where trajevo is not installed"],
    "how_to/report.md": ["needs two terminals and a browser"],
    "how_to/robot_files.md": ["needs the files of a robot of yours"],
    "speed.md": ["installs", "compiles, or shows a variable of the environment"],
    "start.md": ["installs", "needs a browser"],
}


@pytest.fixture(autouse=True)
def _empty_folder(tmp_path, monkeypatch):
    mpl.use("Agg")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")


@pytest.mark.parametrize("page", mostly_long(RUN, *WHOLE))
def test_a_page_runs_as_it_stands_and_prints_what_it_shows(page, tmp_path):
    run_page(page, tmp_path)


@pytest.mark.parametrize("page", mostly_long(SHORT, *SHORT[::4]))
def test_a_page_runs_with_shorter_searches(page, tmp_path):
    run_page(page, tmp_path, short=True)


@pytest.mark.parametrize("page", mostly_long(PYTHON, PYTHON[0], *PYTHON[2:]))
def test_the_python_of_a_page_runs_and_prints_what_it_says(page, tmp_path):
    run_page(page, tmp_path, languages=("python",))


def test_what_is_not_run_is_listed_with_its_reason():
    found = {page: [block.no_run for block in blocks(page) if block.no_run] for page in PAGES}
    assert {page: reasons for page, reasons in found.items() if reasons} == NOT_RUN


def test_blocks_have_languages_that_are_run_or_looked_at():
    known = {"latex", "python", "sh", "text", "toml", "xml", "yaml"}
    for page in PAGES:
        for block in blocks(page):
            assert block.language in known or block.language.startswith("{"), f"{page}:{block.line}: {block.language!r}"
            if block.language == "toml":
                tomllib.loads(block.code)
            if block.language == "python":
                compile(block.code, f"{page}:{block.line}", "exec")


@cache
def options(command: str) -> set[str]:
    """Options of a command, or of one of a group."""
    name, _, inner = command.partition(" ")
    found = app.get_command(None, name)
    found = found.commands[inner] if inner else found
    return {option for one in found.params for option in (*one.opts, *one.secondary_opts)} | {"--help"}


def shown(page):
    """Every command line of trajevo that a page shows, in blocks and within the text."""
    for block in blocks(page):
        if block.language == "sh":
            yield from (words for words, _ in block.commands if words[0] == "trajevo")
    for line in re.findall(r"`(trajevo [a-z-][^`]*)`", (DOCS / page).read_text(encoding="utf-8")):
        yield line.replace("'", "").split()


@pytest.mark.parametrize("page", PAGES)
def test_commands_of_a_page_are_known_with_their_options(page):
    for words in shown(page):
        name = words[1]
        if name.startswith("-"):
            assert name in ("--help", "--version", "--install-completion"), f"{page}: {' '.join(words)}"
            continue
        assert name in COMMANDS, f"{page}: {' '.join(words)}"
        command = f"{name} {words[2]}" if name in ("bench", "study") and len(words) > 2 else name
        for word in words[2:]:
            if word.startswith("--"):
                assert word.partition("=")[0] in options(command), f"{page}: {' '.join(words)}"


@pytest.mark.parametrize("page", PAGES)
def test_files_and_pages_that_a_page_links_to_exist(page):
    made = {"auto_gallery/index", "papers/reproduced", "reference"}
    text = (DOCS / page).read_text(encoding="utf-8")
    folder = (DOCS / page).parent
    for target in re.findall(r"\]\((?!https?:|#)([^)#\s]+)", text):
        place = os.path.relpath(folder / target, DOCS)
        assert (folder / target).exists() or any(place.startswith(one) for one in made), f"{page}: {target}"
