"""``trajevo check``, and what the other commands do with a problem that has no solution: exit code 3, in one screen."""

import re

import pytest

from tests.formulation.test_feasibility import WEAK
from tests.helpers import trajevo

TASK = """format = 1
points = {points}
duration_bounds = [0.05, 4.0]
objectives = ["time", "energy"]
[robot]
name = "two_weak.urdf"
[limits]
acceleration = 10.0
jerk = 100.0
[payload]
mass = {mass}
[constraints]
{more}
[algorithm]
population = 12
generations = 3
polish = false
"""
STRETCHED, FOLDED = "[[0.0, 0.0], [0.4, 0.2], [-1.2, 0.3]]", "[[1.5, 0.0], [1.2, 0.4], [1.4, 0.8]]"


@pytest.fixture
def task(tmp_path):
    (tmp_path / "two_weak.urdf").write_text(WEAK)

    def written(points=STRETCHED, mass=0.0, more=""):
        (tmp_path / "task.toml").write_text(TASK.format(points=points, mass=mass, more=more))
        return tmp_path

    return written


def test_check_tells_what_is_impossible_in_one_screen_and_exits_with_3(task):
    told = trajevo("check", "task.toml", cwd=task())
    assert told.returncode == 3
    assert told.stderr == ""
    lines = told.stdout.splitlines()
    assert len(lines) < 24
    assert lines[0] == "two_weak, 0 kg: task"
    assert re.split("  +", lines[2].rstrip()) == ["point", "range used", "held at rest", "to the next, at least"]
    assert "116.5 % a" in lines[4]
    assert "impossible: holding point 0 takes 9.32 of 8 N·m on a; remedy: " in told.stdout
    assert lines[-1] == "no motion is possible, for this reason"


def test_check_of_a_possible_task_ends_with_0_and_searches_nothing(task):
    folder = task(FOLDED)
    told = trajevo("check", "task.toml", cwd=folder)
    assert told.returncode == 0
    assert "nothing rules a motion out at its points" in told.stdout
    assert not (folder / "runs").exists()


def test_solve_stops_before_the_search(task):
    folder = task()
    told = trajevo("solve", "task.toml", cwd=folder)
    assert told.returncode == 3
    assert "impossible: holding point 0 takes 9.32 of 8 N·m on a" in told.stderr
    assert "warning: holding point 1 takes 8.44 of 8 N·m on a" in told.stderr
    assert "generation" not in told.stderr
    assert not (folder / "runs").exists()
    quiet = trajevo("solve", "task.toml", "--quiet", cwd=folder)
    assert quiet.returncode == 3
    assert "impossible:" in quiet.stderr
    assert "warning:" not in quiet.stderr


@pytest.mark.parametrize(
    ("points", "mass", "more", "says"),
    [
        (FOLDED, 300.0, "", "N·m on a, and too much on b; remedy: a payload of at most "),
        (FOLDED, 0.0, "longest_time = 0.2", "the whole motion takes at least "),
        (
            FOLDED,
            0.0,
            "tool_height = 2.0",
            " of 2 m high at point 0; remedy: another point, or a tool_height of at most",
        ),
        (FOLDED, 0.0, "effort_margin = 0.9", " of 0.8 N·m on a (8 N·m less the margin)"),
    ],
)
def test_each_reason_is_told_with_its_remedy(task, points, mass, more, says):
    told = trajevo("check", "task.toml", cwd=task(points, mass, more))
    assert told.returncode == 3
    assert says in told.stdout


def test_a_problem_is_checked_with_the_arguments_of_solve():
    told = trajevo("check", "hybrid", "--payload", "5", "--payload-model", "rigid")
    assert told.returncode == 0
    assert told.stdout.startswith("hybrid_manipulator, 5 kg: ")
    assert trajevo("check", "pointing", "--set", "duration_bounds=[1, 1.5]").returncode == 3


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["check", "nope"], "unknown problem or task 'nope'"),
        (["check", "pointing", "--payload", "3"], "problem 'pointing' takes no 'payload'"),
        (["check", "pointing", "--set", "x"], "--set: expected KEY=VALUE, got 'x'"),
        (["check", "ur5_pick_and_place", "--payload", "3"], "--payload: a task says this in its file"),
        (["check", "missing.toml"], "missing.toml"),
    ],
)
def test_bad_input_ends_with_2(tmp_path, arguments, says):
    told = trajevo(*arguments, cwd=tmp_path)
    assert told.returncode == 2
    assert says in told.stderr
