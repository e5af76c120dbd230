from pathlib import Path

import jupytext
import nbformat
import pytest

from tests.execute_notebooks import execute

FOLDER = Path(__file__).parents[1] / "notebooks"
SOURCES = sorted(FOLDER.glob("[0-9]*.py"))


#: One that takes seconds, with the size of its runs, and a smaller one; ``make test-long`` executes all as they stand,
#: and ``make notebooks`` at full size.
QUICK, SIZE, LESS = "01_first_front", '{"generations": 25, "population": 40}', '{"generations": 3, "population": 12}'


@pytest.mark.parametrize("source", [QUICK, *(pytest.param(file, marks=pytest.mark.long, id=file.stem) for file in SOURCES)])
def test_notebook_runs_from_top_to_bottom_in_an_empty_folder(source, tmp_path, monkeypatch):
    monkeypatch.delenv("TRAJEVO_FULL", raising=False)
    if source == QUICK:
        text = (FOLDER / f"{QUICK}.py").read_text(encoding="utf-8")
        assert SIZE in text
        source = tmp_path / "in.py"
        source.write_text(text.replace(SIZE, LESS), encoding="utf-8")
    execute(source, tmp_path / "out.ipynb")
    cells = [cell for cell in nbformat.read(tmp_path / "out.ipynb", 4).cells if cell.cell_type == "code"]
    assert all(cell.execution_count for cell in cells)
    assert sum("image/png" in output.get("data", {}) for cell in cells for output in cell.outputs) >= 4


@pytest.mark.parametrize("source", SOURCES, ids=lambda file: file.stem)
def test_both_forms_hold_the_same_cells_and_no_outputs(source):
    pair, written = jupytext.read(source), nbformat.read(source.with_suffix(".ipynb"), 4)
    assert [(c.cell_type, c.source) for c in pair.cells] == [(c.cell_type, c.source) for c in written.cells]
    assert not any(cell.get("outputs") or cell.get("execution_count") for cell in written.cells)
