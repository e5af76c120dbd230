"""Paths, pick and place, and points of the user's own from the command line."""

import numpy as np
import pytest

from tests.helpers import UNDRAWN, mostly_long, trajevo
from trajevo import Front
from trajevo.problems.gemini_and_s import s_points

SMALL = ["--generations", "8", "--population", "20", "--no-polish", "--quiet"]


#: Sub-problems of the paper's method and a time in the table, by its tolerance: a few, and as many as without one.
SUB_PROBLEMS = {"0.1": (8, "2.785 "), "0.01": (73, "3.6268")}


@pytest.fixture(scope="module", params=mostly_long(SUB_PROBLEMS, "0.1"))
def run(tmp_path_factory, request):
    folder = tmp_path_factory.mktemp("runs") / "s"
    tolerance = [] if request.param == "0.01" else ["--tolerance", request.param]  # it is what there is without one
    options = ["--method", "nnc", "--limits", "hull", *tolerance]
    result = trajevo("solve", "reparam", "--path", "s", *options, "--pictures", "--out", folder)
    assert result.returncode == 0, result.stderr
    assert result.stderr == (
        "warning: the method nnc keeps no checkpoints: SIGINT keeps what was found, SIGKILL nothing\n"
    )
    return folder, result.stdout, SUB_PROBLEMS[request.param]


def test_the_papers_method_writes_front_pictures_and_report(run):
    folder, said, (count, time) = run
    front = Front.load(folder / "front.json")
    assert front.run.algorithm == "NNC"
    assert len(front) == count
    names = {file.stem for file in (folder / "plots").iterdir()}
    assert names == {"front", "parallel", "hypervolume", "profiles", "path", "parameter"}
    for expected in ("jerk [mm²/s⁵]", time, f"sub-problems = {count}", "levels"):
        assert expected in said
    report = (folder / "report.html").read_text()
    assert "control polygon" in report
    assert f"sub-problems = {count}" in report


def test_g_code_is_written(run):
    folder = run[0]
    result = trajevo("export", folder, "--solution", "utopia", "--format", "gcode", "--step", "0.02")
    assert result.returncode == 0, result.stderr
    assert (folder / "utopia.gcode").read_text().startswith("; trajevo: Time and jerk along a fixed path")


@pytest.mark.parametrize("seeds", mostly_long([2, 3], 2))
def test_points_limits_and_seeds_are_options(tmp_path, seeds):
    file = tmp_path / "points.csv"
    file.write_text("x [mm], y [mm]\n" + "\n".join(f"{1e3 * x}, {1e3 * y}" for x, y in s_points()))
    limits = ["velocity=80 mm/s", 'acceleration=["500 mm/s^2", 0.4]', "jerk=20", "longest_time=6 s"]
    pairs = [word for pair in limits for word in ("--set", pair)]
    options = ["--path", file, *pairs, "--encoding", "shape", "--sqp-seeds", seeds]
    result = trajevo("solve", "reparam", *options, *SMALL, *UNDRAWN, "--out", tmp_path / "run")
    assert result.returncode == 0, result.stderr
    front = Front.load(tmp_path / "run" / "front.json")
    np.testing.assert_allclose(front.record.limits["acceleration"], [0.5, 0.4])
    assert front.record.settings["longest_time"] == 6.0
    assert front.run.settings["initial"] == seeds
    assert front.objective_names == ("time", "jerk")
    assert trajevo("show", tmp_path / "run").returncode == 0


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--path", "nose"], "unknown path 'nose'; known: a CSV file of points, gemini, s"),
        (["--limits", "loose"], "unknown limits 'loose'; known: certified, hull, tight"),
        (["--method", "magic"], "unknown method 'magic'; known: evolution, nnc"),
        (["--method", "nnc", "--population", "20"], "--population: the method 'nnc' has no such setting"),
        (["--method", "nnc", "--algorithm", "spea2"], "--algorithm: the method 'nnc' has no such setting"),
        (["--tolerance", "0.1"], "--tolerance: the method 'evolution' has no such setting"),
        (["--method", "nnc", "--tolerance", "2"], "--tolerance"),
        (["--algorithm", "spea2", "--sqp-seeds", "3"], "--sqp-seeds: the method 'spea2' has no such setting"),
        (["--set", "speed"], "--set: expected KEY=VALUE, got 'speed'"),
        (["--set", "colour=red"], "problem 'reparam' takes no 'colour'"),
        (["--path", "s", "--set", "path=gemini"], "--set: 'path' is given twice"),
        (["--set", "velocity=-80 mm/s"], "velocity: expected a positive limit [m/s] or inf for axis 'x', got -0.08"),
        (["--set", "longest_time=1"], "longest_time: the path needs 1.832"),
    ],
)
def test_bad_options_get_one_sentence(tmp_path, arguments, says):
    result = trajevo("solve", "reparam", *arguments, cwd=tmp_path)
    assert result.returncode == 2
    assert says in " ".join(result.stderr.replace("│", " ").split())
    assert "Traceback" not in result.stderr
    assert not list(tmp_path.iterdir()), "a refused command left something behind"


@pytest.mark.parametrize("options", [["--method", "nnc"], ["--sqp-seeds", "3"]])
def test_normal_constraints_of_three_objectives_are_refused_before_anything_is_written(tmp_path, options):
    result = trajevo("solve", "pointing", *options, cwd=tmp_path)
    assert result.returncode == 2
    assert "the normal constraint method needs a TrajectoryProblem of two objectives" in result.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.long  # what its report tells and draws is in test_report.py too, of `trajevo report --full`
def test_pick_and_place_shows_the_septic_beside_its_rivals(tmp_path):
    folder = tmp_path / "pick"
    result = trajevo("solve", "pick-place", "--payload", "2.5", "--report", "full", *SMALL, "--out", folder)
    assert result.returncode == 0, result.stderr
    for expected in ("Least times under the same limits", "one polynomial", "4.4737", "double-S, stops", "4.7509"):
        assert expected in result.stdout
    assert (folder / "plots" / "rivals.png").is_file()
    assert "Interpolants at their least times under the same limits" in (folder / "report.html").read_text()
    assert "An infinite jerk is a step of the acceleration" in (folder / "report.html").read_text()
    shown = trajevo("animate", folder, "--solution", "least_time")
    assert shown.returncode == 0, shown.stderr
    assert "puma560, " in (folder / "least_time.html").read_text()
    carried = trajevo("capacity", folder)
    assert carried.returncode == 0, carried.stderr
    assert "limited by joint_" in carried.stdout


def test_any_robot_through_points_of_a_file(tmp_path):
    file = tmp_path / "points.csv"
    file.write_text("x [mm], y [mm]\n0, 0\n50, 20\n80, 60\n20, 90\n")
    pairs = ["robot=feed_drive", "duration_bounds=[0.2, 5]", "interpolant=cubic", 'objectives=["time", "square_jerk"]']
    settings = [word for pair in pairs for word in ("--set", pair)]
    options = ["--points", file, *settings, "--method", "nnc", "--tolerance", "0.1"]
    result = trajevo("solve", "via-points", *options, *UNDRAWN, "--out", tmp_path / "run")
    assert result.returncode == 0, result.stderr
    front = Front.load(tmp_path / "run" / "front.json")
    assert front.record.robot == "feed_drive"
    assert len(front) >= 3
    assert "square_jerk [mm²/s⁵]" in result.stdout
    assert trajevo("export", tmp_path / "run", "--format", "gcode").returncode == 0
