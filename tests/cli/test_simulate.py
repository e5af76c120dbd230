"""`trajevo simulate`: what it prints and draws of a run, and what it refuses."""

from pathlib import Path

import pytest

from tests.helpers import UNDRAWN, trajevo

pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install 'trajevo[twin]'")

SMALL = ("--generations", "2", "--population", "6", "--no-polish", "--quiet", *UNDRAWN)
BRIEF = ("--rate", "100", "--settle", "0.1")

#: Two joints without dry friction are played in few steps of integration.
TASK = f"""format = 1
robot = "{Path(__file__).parents[1] / "data" / "two_link_drives"}"
points = [[-1.5, 0.0], [-0.9, 0.6], [-0.4, 1.2]]
duration_bounds = [0.3, 2.0]
objectives = ["time", "energy"]
[payload]
mass = 2.5
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("simulated") / "p"
    folder.with_name("task.toml").write_text(TASK)
    solved = trajevo("solve", folder.with_name("task.toml"), *SMALL, "--out", folder)
    assert solved.returncode == 0, solved.stderr
    return folder


def test_a_motion_is_told_and_drawn(run):
    told = trajevo("simulate", run, "--solution", "0", "--payload-error", "0.1", *BRIEF)
    assert told.returncode == 0, told.stderr
    assert "row (row 0)" in told.stdout
    assert "computed torque at 100 Hz, payload believed +10 %" in " ".join(told.stdout.split())
    assert "greatest error" in told.stdout
    assert (run / "closed_loop.png").stat().st_size > 10_000


def test_a_front_is_told_and_drawn_and_a_new_run_takes_the_pictures_away(run):
    told = trajevo("simulate", run, "--all", "--tolerance", "0.1", *BRIEF)
    assert told.returncode == 0, told.stderr
    assert "stay undominated" in " ".join(told.stdout.split())
    assert "time achieved" in told.stdout
    assert (run / "achieved_front.png").stat().st_size > 5_000
    assert trajevo("solve", "pointing", *SMALL, "--out", run, "--overwrite").returncode == 0
    assert not list(run.glob("*.png"))


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (("--controller", "pid"), "unknown controller 'pid'; known: computed_torque, pd"),
        (("--rate", "0"), "rate: expected a rate from 1 to 100000 Hz, got 0.0"),
        (("--all", "--solution", "2"), "--all: expected no --solution with it, got '2'"),
    ],
)
def test_wrong_options_are_told_before_a_run_is_read(given, says):
    told = trajevo("simulate", "no-such-run", *given)
    assert told.returncode == 2
    assert says in " ".join(told.stderr.split())
