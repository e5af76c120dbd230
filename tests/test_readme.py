import re
from pathlib import Path

import matplotlib as mpl
import pytest

from tests.helpers import mostly_long

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()


def shorter(code):
    """The same lines with few generations, points of a front along a simpler path, and points of a diagram."""
    code = re.sub(r"generations=\d+", "generations=4, polish=False", code).replace("0.3, 61", "0.3, 11")
    code = code.replace("optimise(problem, seed=1)", "optimise(problem, seed=1, generations=4, polish=False)")
    code = code.replace("within=3.0, seed=1)", "within=3.0, seed=1, starts=1)").replace("=10.0)", "=10.0, samples=2)")
    return code.replace("solve_nnc(problem)", "solve_nnc(problem, points=4)").replace('path="gemini"', 'path="s"')


def run(text, whole):
    """All blocks of a text in one namespace, as they stand, or with shorter searches, which find less."""
    mpl.use("Agg")
    names = {}
    for code in re.findall(r"```python\n(.*?)```", text, re.DOTALL):
        exec(code if whole else shorter(code), names)
    return names


@pytest.mark.parametrize("whole", mostly_long([False, True], False))
def test_the_lines_of_the_readme_run_and_make_their_pictures(tmp_path, monkeypatch, whole):
    monkeypatch.chdir(tmp_path)
    names = run(README, whole)
    assert {file.name for file in tmp_path.iterdir()} == {"front.png", "profiles.png"}
    assert len(names["front"]) > (1000 if whole else 3)
    assert max(names["best"].G.values()) <= 0.0


def test_the_lines_of_the_tour_run_and_make_their_pictures(tmp_path, monkeypatch, capsys):
    """With shorter searches; as they stand they are run with all pages."""
    monkeypatch.chdir(tmp_path)
    names = run((ROOT / "docs/tour.md").read_text(), whole=False)
    pictures = {"front.png", "profiles.png", "effort.png", "diagram.png", "path.png"}
    assert {file.name for file in tmp_path.iterdir()} == pictures
    assert len(names["front"]) > 3
    assert names["front"].run.settings["failed"] == 0
    printed = capsys.readouterr().out
    assert "limited by screw_3" in printed
    assert "held at rest at both ends: 12.510811 kg" in printed


def test_everything_the_readme_links_to_exists():
    for target in re.findall(r"\]\((?!http)([^)#]+)\)", README):
        assert (ROOT / target).is_file(), target


def test_first_screen_shows_how_to_run():
    first = "\n".join(README.splitlines()[:40])
    assert len(README.splitlines()) <= 90
    assert "make demo" in first
    assert "make test" in first
    assert "docs/images/report.png" in first
    assert README.index("docs/images/report.png") < README.index("docs/images/front.png")
