"""Guides: their Python runs and says what they say it does, their pictures exist."""

import re
from pathlib import Path

import matplotlib.pyplot as plt
import pytest

from tests.helpers import mostly_long

DOCS = Path(__file__).parents[1] / "docs"


GUIDES = (
    "how_to/infeasible.md",
    "how_to/which_solution.md",
    "how_to/no_urdf.md",
    "how_to/notebooks.md",
    "how_to/payload.md",
    "how_to/payload_motion.md",
    "how_to/pictures.md",
    "how_to/report.md",
    "how_to/robot_files.md",
    "how_to/tasks.md",
)
#: Those that take a second; the others are run by `make test-long`.
QUICK = (
    "how_to/infeasible.md",
    "how_to/which_solution.md",
    "how_to/no_urdf.md",
    "how_to/notebooks.md",
    "how_to/report.md",
    "how_to/robot_files.md",
)


@pytest.mark.parametrize(
    "text", ["README.md", "CONTRIBUTING.md", *(f"docs/{file.relative_to(DOCS)}" for file in DOCS.rglob("*.md"))]
)
def test_files_that_a_text_names_exist(text):
    top = DOCS.parent
    named = re.findall(r"`((?:trajevo|problems|robots|tests|docs)/[\w./-]+)`", (top / text).read_text(encoding="utf-8"))
    assert [place for place in named if not (top / place).exists()] == []


@pytest.mark.parametrize("guide", mostly_long(GUIDES, *QUICK))
def test_the_python_of_a_guide_runs(guide, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text, names = (DOCS / guide).read_text(encoding="utf-8"), {}
    blocks = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    assert blocks
    for code in blocks:
        exec(code, names)
        plt.close("all")
    printed = capsys.readouterr().out
    for said in re.findall(r"print\(.*\)  # ([^.,;]*\d\.\d{3,}[^.,;]*)", text):
        assert said.strip() in printed
    for picture in re.findall(r"!\[.*?\]\((.*?)\)", text):
        assert ((DOCS / guide).parent / picture).is_file()
