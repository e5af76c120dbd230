"""The examples that `trajevo init` writes solve as they stand, and certificates prove what they promise."""

import pytest

from tests.helpers import mostly_long, trajevo
from trajevo import certify, load_task, optimise
from trajevo.cli.init import templates


@pytest.mark.parametrize("name", mostly_long(templates(), *(set(templates()) - {"obstacle", "line"})))
def test_an_example_solves_as_it_stands(name, tmp_path):
    done = trajevo("init", "mine.toml", "--example", name, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "next: trajevo solve mine.toml" in done.stdout
    task = load_task(tmp_path / "mine.toml")
    front = optimise(task.problem, task.search, generations=6, polish=False, progress=False)
    assert len(front), front.blocking
    assert certify(front.pick("0")).proven


def test_the_line_of_the_example_is_proven(tmp_path):
    assert trajevo("init", "task.toml", "--example", "line", cwd=tmp_path).returncode == 0
    task = load_task(tmp_path / "task.toml")
    assert [variable.name for variable in task.problem.variables] == ["dt_1", "dt_2", "dt_3", "dt_4"]
    limited = task.problem.constraint_names
    assert sum(name.startswith("distance from line") for name in limited) == 3
    assert "tilt from point 1 to 4" in limited


def test_an_example_that_is_not_there_is_told(tmp_path):
    done = trajevo("init", "--example", "lime", cwd=tmp_path)
    assert done.returncode == 2
    assert "unknown example 'lime'; known: " in done.stderr
    assert not list(tmp_path.iterdir())
