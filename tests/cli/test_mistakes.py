"""Natural mistakes on the command line: commands, options, names, and the whole sentence that a user sees."""

import pytest

from tests.helpers import UNDRAWN, trajevo

SMALL = ("--generations", "3", "--population", "12", "--no-polish", *UNDRAWN, "--quiet")
FORMATS = "csv, fanuc, feed, gcode, json, krl, moveit, mujoco, netcdf, rapid, ros2, urscript"
HELP = "; see trajevo solve --help"

MISTAKES = {
    "a misspelt command": (
        "slove task.toml",
        "trajevo: unknown command 'slove'; did you mean 'solve'?; see trajevo --help",
    ),
    "another program's command": (
        "optimise task.toml",
        "trajevo: unknown command 'optimise'; did you mean 'solve'?; see trajevo --help",
    ),
    "a command within a command": (
        "study start hybrid_payloads",
        "trajevo study: unknown command 'start'; known: collect, run, status; did you mean 'status'?; "
        "see trajevo study --help",
    ),
    "nothing to solve": (
        "solve",
        "trajevo solve: PROBLEM is missing: name in `trajevo list` or `trajevo examples`, file task.toml, or "
        f"MODULE:NAME of a problem in Python{HELP}",
    ),
    "two problems": ("solve pointing hybrid", f"trajevo solve: expected nothing more, got 'hybrid'{HELP}"),
    "a misspelt file": ("solve tsk.toml", "tsk.toml: no such file; did you mean 'task.toml'?"),
    "the beginning of an option": (
        "solve pointing --gen 100",
        f"trajevo solve: unknown option '--gen'; did you mean '--generations'?{HELP}",
    ),
    "pymoo's name of an option": (
        "solve pointing --pop-size 100",
        f"trajevo solve: unknown option '--pop-size'; did you mean '--population'?{HELP}",
    ),
    "an option of another command": (
        "show run --solution knee",
        "trajevo show: unknown option '--solution'; see trajevo show --help",
    ),
    "a word for a number": (
        "solve pointing --seed one",
        f"trajevo solve: --seed: expected a whole number, got 'one'{HELP}",
    ),
    "a part of a generation": (
        "solve pointing --generations 10.5",
        f"trajevo solve: --generations: expected a whole number, got '10.5'{HELP}",
    ),
    "a decimal comma": (
        "payload-time run --payload 3,5",
        "trajevo payload-time: --payload: expected a number, got '3,5'; see trajevo payload-time --help",
    ),
    "a value that was forgotten": ("solve pointing --generations", "--generations: expected a value after it"),
    "a coordinate that was forgotten": (
        "workspace-capacity ur5 --position 0.4 0",
        "--position: expected 3 values after it",
    ),
    "too few workers": (
        "study run hybrid_payloads --workers 0",
        "trajevo study run: --workers: expected at least 1, got '0'; see trajevo study run --help",
    ),
    "the paper's name of an algorithm": (
        "solve pointing --algorithm NSGA-II",
        "unknown algorithm 'NSGA-II'; known: age-moea2, moea/d, nsga2, nsga3, rvea, sms-emoa, spea2, u-nsga3; "
        "did you mean 'nsga2'?",
    ),
    "a setting without its value": ("solve pointing --set angle", "--set: expected KEY=VALUE, got 'angle'"),
    "an option that a task says": (
        "solve ur5_pick_and_place --payload 3",
        "--payload: a task says this in its file, options are those of the search",
    ),
    "a run that is there": (
        "solve pointing --out run",
        "run already holds a run; choose another --out or add --overwrite, or go on with it: trajevo resume run",
    ),
    "a run that is not there": ("show rum", "rum: no such run; did you mean 'run'?"),
    "a run to go on with that is not there": ("resume rum", "rum: no such run; did you mean 'run'?"),
    "a program's name for a format": (
        "export run --format excel",
        f"unknown export format 'excel'; known: {FORMATS}; did you mean 'csv'?",
    ),
    "an objective that the run does not have": (
        "export run --solution least_jerks",
        "unknown solution 'least_jerks'; known: a row from 0 to {last}, knee, least_acceleration, least_jerk, "
        "least_time, utopia; did you mean 'least_jerk'?",
    ),
    "the best solution": (
        "export run --solution best",
        "unknown solution 'best'; known: a row from 0 to {last}, knee, least_acceleration, least_jerk, least_time, "
        "utopia; did you mean 'knee'?",
    ),
    "the long name of a unit": (
        "show run --angle degrees",
        "unknown angle unit 'degrees'; known: deg, rad; did you mean 'deg'?",
    ),
    "a robot that is not there": (
        "check-robot ur55",
        "unknown robot 'ur55'; did you mean 'ur5'?",
    ),
    "a joint without its position": (
        "workspace-capacity ur5 --position 0.4 0 0 --lock elbow_joint",
        "lock: expected JOINT=POSITION [rad or m], got 'elbow_joint'",
    ),
    "a file that is there": ("init task.toml", "task.toml: exists already; choose another name"),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("mistakes")
    assert trajevo("init", "task.toml", cwd=place).returncode == 0
    done = trajevo("solve", "pointing", *SMALL, "--out", "run", cwd=place)
    assert done.returncode == 0, done.stderr
    return place


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_costs_a_sentence(folder, mistake):
    command, sentence = MISTAKES[mistake]
    done = trajevo(*command.split(), cwd=folder)
    assert done.returncode == 2
    assert done.stdout == ""
    if "{last}" in sentence:
        last = int(done.stderr.partition("a row from 0 to ")[2].partition(",")[0])
        sentence = sentence.format(last=last)
    assert done.stderr == f"error: {sentence}\n"


def test_no_command_changes_anything_by_a_mistake(folder):
    names = {file.name for file in folder.iterdir()}
    assert names == {"task.toml", "run"}
