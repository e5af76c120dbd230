"""Guides: their Python runs and says what they say it does, their pictures exist."""

import re
from pathlib import Path

import matplotlib.pyplot as plt
import pytest

DOCS = Path(__file__).parents[1] / "docs"


LONG = pytest.param("payload_motion.md", marks=pytest.mark.long)


@pytest.mark.parametrize(
    "guide", ["check.md", "explain.md", "no_urdf.md", "payload.md", "robot_files.md", "tasks.md", LONG]
)
def test_the_python_of_a_guide_runs(guide, capsys):
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
        assert (DOCS / picture).is_file()
