"""The command line as a user meets it: real processes, real files, exit codes."""

import importlib
import json
import re
import shutil
import subprocess
import sys
import time
from html.parser import HTMLParser
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
import typer

from tests.helpers import UNDRAWN, mostly_long, trajevo, trajevo_process
from trajevo import Front
from trajevo.capacity.dlcc import dlcc
from trajevo.cli.main import COMMANDS
from trajevo.exporters.export import EXPORTERS
from trajevo.formulation.constraints.kinds import KINDS, parameters_of
from trajevo.formulation.objectives import OBJECTIVES
from trajevo.plots.pictures import FIGURES, PAYLOAD_FIGURES, VIEWS
from trajevo.trajectory.interpolants import THROUGH_POINTS

SMALL = ["--generations", "8", "--population", "20", "--no-polish"]

#: The command line in the process of the tests, and in one of its own, as users run it.
COMMAND_LINES = [trajevo, trajevo_process]


@pytest.fixture(scope="module", params=mostly_long(COMMAND_LINES, trajevo), ids=lambda each: each.__name__)
def run(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "pointing"
    result = request.param("solve", "pointing", "--seed", "1", *SMALL, "--pictures", "--out", folder)
    assert result.returncode == 0, result.stderr
    return folder


def test_solve_writes_front_pictures_and_report(run):
    assert len(Front.load(run / "front.json")) > 0
    names = {file.stem for file in (run / "plots").iterdir()}
    assert names == {"front", "parallel", "hypervolume", "profiles"}
    assert names == set(FIGURES) - {*PAYLOAD_FIGURES, *VIEWS, "path", "parameter", "rivals", "front_bound", "base_map"}
    for file in (run / "plots").iterdir():
        picture = matplotlib.image.imread(file)[..., :3]
        assert min(picture.shape[:2]) > 300
        assert 0.02 < (picture.std(axis=2) + (picture.mean(axis=2) < 0.9) > 0.0).mean() < 0.9, f"{file} looks empty"


def test_the_report_needs_nothing_else(run):
    links = []

    class Links(HTMLParser):
        def handle_starttag(self, tag, attributes):
            links.extend(value for name, value in attributes if name in ("src", "href"))

    text = (run / "report.html").read_text()
    Links().feed(text)
    assert len(links) == 4
    assert all(link.startswith("data:image/png;base64,") for link in links)
    for expected in ("least_time", "velocity of joint_1", "NSGA2", "crossover_probability = 0.85", "deg/s²"):
        assert expected in text
    assert "$" not in re.sub("<script.*?</script>", "", text.split("</style>")[1], flags=re.DOTALL)


def test_report_and_show_print_the_numbers_of_the_front(run):
    knee, text = Front.load(run / "front.json").knee(), (run / "report.html").read_text()
    shown = trajevo("show", run).stdout
    time, acceleration, jerk = knee.F.values()
    for value in (time, np.degrees(acceleration), np.degrees(jerk)):
        assert f'<td class="number">{value:.5g}</td>' in text
        assert f"{value:.5g}" in shown
    for name, excess in knee.G.items():
        assert f'<td>{name}</td><td class="number">{100 * (1 + excess):.2f} %</td>' in text
    closest = max(knee.G, key=knee.G.get)
    assert f"{100 * (1 + knee.G[closest]):.1f} % {closest}" in shown


def test_overwriting_leaves_nothing_of_the_old_run(run, tmp_path):
    folder = tmp_path / "run"
    shutil.copytree(run, folder)
    for format in ("csv", "ros2", "mujoco"):
        assert trajevo("export", folder, "--format", format).returncode == 0
    mine = {"notes.txt", "2024.csv", "settings.json", "photo.png", "moves.yaml", "pick.script"}
    for name in mine:
        (folder / name).write_text("mine")
    (folder / "plots" / "mine.png").write_text("mine")
    # Too tight for any motion, so that the new run has no pictures and no solutions.
    again = [
        "solve",
        "pointing",
        *SMALL,
        "--set",
        "duration_bounds=[1, 2.9]",
        "--out",
        folder,
        "--overwrite",
        "--quiet",
    ]
    began = time.time() - 0.01
    assert trajevo(*again).returncode == 3
    assert all(file.stat().st_mtime >= began for file in (folder / "blocks").iterdir())
    assert {file.name for file in folder.rglob("*") if file.is_file() and file.parent.name != "blocks"} == {
        "front.json",
        "manifest.json",
        "checkpoint.npz",
        ".lock",
        "report.html",
        "mine.png",
        *mine,
    }


def test_capacity_names_mass_actuator_and_instant(tmp_path):
    folder = tmp_path / "hybrid"
    options = ["--payload", "8", "--convention", "printed", "--payload-model", "rigid"]
    solved = trajevo("solve", "hybrid", *SMALL, *options, "--pictures", "--out", folder, "--quiet")
    assert solved.returncode == 0, solved.stderr
    front = Front.load(folder / "front.json")
    assert front.record.payload["mass"] == 8.0
    assert front.record.payload["model"] == "rigid"
    assert "8 kg, a rigid body fixed to the tool" in " ".join(solved.stdout.split())
    closed = trajevo("capacity", folder, "--solution", "weighted")
    assert closed.returncode == 0, closed.stderr
    expected = dlcc(front.pick("weighted"))
    assert f"capacity: {expected}" in closed.stdout
    iterated = trajevo("capacity", folder, "--solution", "weighted", "--iterative", "--step", "0.5").stdout
    mass = float(iterated.split("capacity: ")[1].split()[0])
    assert expected.mass - 0.5 <= mass <= expected.mass
    assert (folder / "plots" / "effort.png").is_file()


def test_capacity_of_a_robot_without_effort_limits_is_unlimited(run):
    assert "unlimited: no joint has an effort limit" in trajevo("capacity", run).stdout


def test_list_names_problems_parts_and_robots():
    result = trajevo("list")
    assert result.returncode == 0
    for expected in ("pointing", "Sun 2020", "pointing_mechanism", "jerk", "effort"):
        assert expected in result.stdout
    names = (*OBJECTIVES, *KINDS, *parameters_of(KINDS), *THROUGH_POINTS, *EXPORTERS)
    assert [name for name in names if name not in result.stdout] == []


def test_show_prints_the_choices_with_units(run):
    result = trajevo("show", run)
    assert result.returncode == 0
    for expected in ("knee", "utopia", "least_jerk", "[deg/s²]", "time [s]", "seed", "hypervolume"):
        assert expected in result.stdout
    assert "[rad/s²]" in trajevo("show", run / "front.json", "--angle", "rad").stdout


def test_report_and_export_write_where_told(run, tmp_path):
    assert trajevo("report", run, "--out", tmp_path / "r.html").returncode == 0
    assert trajevo("report", run).returncode == 0
    assert (tmp_path / "r.html").read_text() == (run / "report.html").read_text()
    assert trajevo("export", run, "--solution", "least_time", "--format", "json").returncode == 0
    content = json.loads((run / "least_time.json").read_text())
    assert content["samples"]["time [s]"][-1] == Front.load(run / "front.json").least("time").F["time"]


def test_the_same_seed_writes_the_same_points(run, tmp_path):
    assert trajevo("solve", "pointing", "--seed", "1", *SMALL, *UNDRAWN, "--out", tmp_path / "again").returncode == 0
    np.testing.assert_array_equal(Front.load(run / "front.json").X, Front.load(tmp_path / "again/front.json").X)


def test_an_existing_run_is_kept_unless_told(run):
    before = (run / "front.json").read_bytes()
    result = trajevo("solve", "pointing", *SMALL, "--seed", "2", "--out", run)
    assert result.returncode == 2
    assert "already holds a run; choose another --out or add --overwrite" in result.stderr
    assert (run / "front.json").read_bytes() == before


def test_algorithm_interpolant_and_points_are_options(tmp_path):
    points = tmp_path / "points.csv"
    points.write_text("azimuth [deg], pitch [deg]\n30, 30\n75, 15\n165, 15\n")
    options = ["--algorithm", "sms-emoa", "--interpolant", "quintic", "--points", points, "--quiet"]
    result = trajevo("solve", "pointing", *SMALL, *options, *UNDRAWN, "--out", tmp_path / "run")
    assert result.returncode == 0, result.stderr
    assert result.stderr == ""
    front = Front.load(tmp_path / "run" / "front.json")
    assert front.run.algorithm == "SMSEMOA"
    assert front.record.settings["interpolant"] == "quintic"
    assert front.X.shape[1] == 2
    assert front.knee().trajectory.duration > 0.0


def test_a_run_without_a_feasible_point_says_why(tmp_path):
    # Segments of 2.9 s are longer than the least times of 2.62 s, but too short for velocities that rise and fall.
    too_tight = ["--set", "duration_bounds=[1, 2.9]", "--out", tmp_path / "run"]
    result = trajevo("solve", "pointing", *SMALL, *too_tight, "--quiet")
    assert result.returncode == 3, result.stderr
    assert (
        "The front is empty: nothing feasible was found; in the nearest miss velocity of joint_2 exceeds"
        in result.stdout
    )
    assert "The front is empty" in (tmp_path / "run" / "report.html").read_text()
    for command in ("export", "verify", "certify", "polish"):
        refused = trajevo(command, tmp_path / "run")
        assert "the front is empty" in refused.stderr
        assert refused.returncode == 3
    assert trajevo("resume", tmp_path / "run", "--quiet").returncode == 3
    assert trajevo("show", tmp_path / "run").returncode == 0


CSV = "azimuth [deg], pitch [deg]\n"


@pytest.mark.parametrize("solution", ["a/b", "²", "best"])
def test_odd_names_of_solutions_are_refused(run, solution):
    result = trajevo("export", run, "--solution", solution)
    assert result.returncode == 2
    assert "unknown solution" in result.stderr
    assert trajevo("export", run, "--format", "a/b").returncode == 2
    assert "10000000 samples" in trajevo("export", run, "--step", "1e-9").stderr


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (
            ["solve", "nope"],
            "unknown problem or task 'nope'; known: hybrid, hybrid_manipulator, panda_six_points, pick-place",
        ),
        (["solve", "pointing", "--interpolant", "cubic"], "unknown interpolant 'cubic'; known: printed, quintic"),
        (
            ["solve", "pointing", "--algorithm", "magic"],
            "unknown algorithm 'magic'; known: age-moea2, moea/d, nsga2, nsga3, rvea, sms-emoa, spea2, u-nsga3",
        ),
        (["solve", "pointing", "--population", "-5"], "--population"),
        (["solve", "pointing", "--generations", "0"], "--generations"),
        (["solve", "pointing", "--points", "none.csv"], "none.csv: no such file"),
        (["solve", "pointing", "--points", "two.csv"], "at least 3 points, got 2"),
        (["solve", "pointing", "--points", "twice.csv"], "point 2 repeats point 1"),
        (["solve", "pointing", "--points", "far.csv"], "point 1 puts 'joint_1' at 80 deg, outside its range"),
        (["solve", "pointing", "--points", "nan.csv"], "line 3, column 'pitch': expected a finite number, got 'nan'"),
        (["solve", "pointing", "--points", "text.csv"], "line 3, column 'pitch': expected a finite number, got 'x'"),
        (["solve", "pointing", "--out", "file/run"], "the output folder cannot be written: Not a directory"),
        (["show", "none"], "error: none: no such run"),
        (["report", "file"], "file: is no front of trajevo"),
        (["export", "none"], "error: none: no such run"),
        (["fly"], "error: trajevo: unknown command 'fly'; known: animate, base-map, bench, bound, capacity"),
        (["solve", "pointing", "--payload", "3"], "problem 'pointing' takes no 'payload'; it takes: interpolant"),
        (["solve", "hybrid", "--payload", "11"], "payload: expected 0 to 10 kg, eq. (123), got 11 kg"),
        (["solve", "hybrid", "--payload", "-1"], "payload.mass: expected a number from 0 on [kg], got -1.0"),
        (["solve", "hybrid", "--payload", "nan"], "payload.mass: expected a number from 0 on [kg], got nan"),
        (["solve", "hybrid", "--payload-model", "rope"], "unknown payload model 'rope'; known: rigid, tool_axis"),
        (
            ["solve", "hybrid", "--convention", "guess"],
            "unknown convention 'guess'; known: as_run, continuous, printed",
        ),
    ],
)
def test_bad_input_gets_one_sentence_and_an_exit_code(tmp_path, arguments, says):
    (tmp_path / "file").write_text("not a folder")
    (tmp_path / "two.csv").write_text(CSV + "30, 30\n75, 15\n")
    (tmp_path / "twice.csv").write_text(CSV + "30, 30\n75, 15\n75, 15\n")
    (tmp_path / "far.csv").write_text(CSV + "30, 30\n90, 80\n75, 15\n")
    (tmp_path / "nan.csv").write_text(CSV + "30, 30\n90, nan\n75, 15\n")
    (tmp_path / "text.csv").write_text(CSV + "30, 30\n90, x\n75, 15\n")
    result = trajevo(*arguments, cwd=tmp_path)
    assert result.returncode == 2
    assert says in " ".join(result.stderr.replace("│", " ").split())
    assert "Traceback" not in result.stderr
    assert not (tmp_path / "runs").exists(), "a refused command left a folder behind"


def test_an_output_folder_without_write_permission_is_refused(tmp_path):
    locked = Path("/proc/trajevo")
    result = trajevo("solve", "pointing", *SMALL, "--out", locked)
    assert result.returncode == 2
    assert "the output folder cannot be written" in result.stderr
    assert "Traceback" not in result.stderr


def test_commands_are_listed_at_once_and_as_they_are():
    for name, home in COMMANDS.items():
        found = getattr(importlib.import_module(f"trajevo.cli.{home.module}"), home.name)
        said = found.info.help if isinstance(found, typer.Typer) else found.__doc__.splitlines()[0]
        assert home.help == said
        told = trajevo(name, "--help").stdout
        assert f"trajevo {name} [OPTIONS]" in told
    listed = trajevo("--help").stdout
    assert all(f" {name} " in listed for name in COMMANDS)


def test_help_imports_nothing_that_computes():
    script = "import sys; sys.argv = ['trajevo', '--help']; from trajevo.cli.main import main\ntry: main()\nfinally:\n"
    script += " print(sorted({name.split('.')[0] for name in sys.modules} & {'numpy', 'scipy', 'matplotlib', 'pymoo'}))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.stdout.endswith("[]\n")
    assert "payload-diagram" in done.stdout


def test_a_misspelt_command_is_told_with_what_was_meant():
    result = trajevo_process("solv", "pointing")
    assert result.returncode == 2
    assert "; did you mean 'solve'?" in result.stderr
