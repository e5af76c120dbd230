"""The notebooks run, and what runs in a notebook shows how far it is."""

from dataclasses import dataclass
from pathlib import Path

import jupytext
import nbformat
import pytest
from nbclient import NotebookClient

from tests.base.test_shown import Reader
from tests.execute_notebooks import execute

FOLDER = Path(__file__).parents[1] / "notebooks"
SOURCES = sorted(FOLDER.glob("[0-9]*.py"))

#: One that takes seconds, with the size of its runs, and a smaller one.
QUICK, SIZE = "01_first_front", '{"generations": 25, "population": 40}'
LESS = '{"generations": 3, "population": 12, "polish": False}'

#: A run, a study, and polishing with a run, alone, and without progress.
SEARCHES = (
    "import trajevo as t\n"
    "t.optimise(t.problems.PointingMechanism(), seed=1, generations=30, population=20, polish=False)",
    "import tempfile\n"
    "study = t.Study('pointing', seed=1, repeats=2, generations=2, population=12, fixed={'polish': False})\n"
    "t.run_study(study, tempfile.mkdtemp())",
    "front = t.optimise(t.problems.PointingMechanism(), seed=1, generations=3, population=12, polish=True)",
    "found = t.polish(front, members=2, rounds=1)",
    "found = t.polish(front, members=2, rounds=1, progress=False)",
)


@dataclass(frozen=True)
class Executed:
    """The cells of a notebook that ran, those that were added to it, and how often they rewrote what they showed."""

    cells: list
    added: list
    updates: int


@pytest.fixture(scope="module")
def executed(tmp_path_factory):
    """One process, which takes seconds to start, runs a short notebook and searches after it."""
    text = (FOLDER / f"{QUICK}.py").read_text(encoding="utf-8")
    assert SIZE in text
    notebook = jupytext.reads(text.replace(SIZE, LESS), fmt="py:percent")
    whole, updates = len(notebook.cells), []
    notebook.cells += [nbformat.v4.new_code_cell(cell) for cell in SEARCHES]

    class Watched(NotebookClient):
        def process_message(self, message, cell, cell_index):
            if cell_index >= whole and message["msg_type"] == "update_display_data":
                updates.append(cell_index)
            return super().process_message(message, cell, cell_index)

    place = {"metadata": {"path": str(tmp_path_factory.mktemp("notebook"))}}
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("TRAJEVO_FULL", raising=False)
        Watched(notebook, timeout=300, resources=place).execute()
    return Executed(notebook.cells[:whole], notebook.cells[whole:], len(updates))


def assert_whole(cells):
    """Assert that all code ran and drew pictures."""
    code = [cell for cell in cells if cell.cell_type == "code"]
    assert all(cell.execution_count for cell in code)
    assert sum("image/png" in output.get("data", {}) for cell in code for output in cell.outputs) >= 4


def test_a_notebook_runs_from_top_to_bottom_with_smaller_searches(executed):
    assert_whole(executed.cells)


@pytest.mark.long
@pytest.mark.parametrize("source", SOURCES, ids=lambda file: file.stem)
def test_notebook_runs_from_top_to_bottom_in_an_empty_folder(source, tmp_path, monkeypatch):
    """As it stands; `make notebooks` executes all at full size."""
    monkeypatch.delenv("TRAJEVO_FULL", raising=False)
    execute(source, tmp_path / "out.ipynb")
    assert_whole(nbformat.read(tmp_path / "out.ipynb", 4).cells)


def test_a_run_in_a_notebook_is_one_bar_that_rewrites_itself(executed):
    run, study, polished, again, silent = (cell.outputs for cell in executed.added)
    for outputs, told in ((run, "30/30 generations"), (study, "2/2 cells")):
        assert [one.output_type for one in outputs] == ["display_data", "execute_result"]
        assert outputs[0].data["text/plain"].startswith(told)
        assert told in "".join(Reader(outputs[0].data["text/html"]).texts)
    assert "text/html" in run[1].data
    for outputs, steps in ((polished, "6/6"), (again, "3/3")):
        assert [one.output_type for one in outputs] == ["display_data"]  # generations and polishing in one bar
        assert outputs[0].data["text/plain"].startswith(f"{steps} steps of polishing, hypervolume 0.")
    assert silent == []
    assert executed.updates >= 3


@pytest.mark.parametrize("source", SOURCES, ids=lambda file: file.stem)
def test_both_forms_hold_the_same_cells_and_no_outputs(source):
    pair, written = jupytext.read(source), nbformat.read(source.with_suffix(".ipynb"), 4)
    assert [(c.cell_type, c.source) for c in pair.cells] == [(c.cell_type, c.source) for c in written.cells]
    assert not any(cell.get("outputs") or cell.get("execution_count") for cell in written.cells)
