"""What a terminal shows: results first, then what was written, then the next command; bars only where one watches."""

import json
import os
import re
import select
import struct
import subprocess
import sys

import numpy as np
import pytest

from tests.helpers import mostly_long, small_problem, trajevo
from trajevo import Front, optimise
from trajevo.cli.screen.printed import _alike, _closest
from trajevo.cli.screen.waiting import Waiting
from trajevo.front.quantities import Quantities

TASK = """format = 1
name = "Feeding press 3"
robot = "puma560"
points = [[0.0, 0.1, -0.2, 0.0, 0.0, 0.0], [0.3, 0.2, -0.4, 0.1, 0.2, 0.0], [0.6, 0.1, -0.2, 0.0, 0.0, 0.1]]
duration_bounds = [0.3, 4.0]
[payload]
mass = 1.0
com = [0.0, 0.0, 0.05]
[algorithm]
population = 12
generations = 3
polish = false
"""


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    """A run of a task with a name, and what was printed."""
    folder = tmp_path_factory.mktemp("cell")
    (folder / "cell.toml").write_text(TASK)
    done = trajevo("solve", "cell.toml", cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder, done


def test_results_come_first_then_files_then_the_next_command(cell):
    folder, done = cell
    said = done.stdout
    assert said.startswith("Feeding press 3: ")
    places = [said.index(text) for text in ("knee ", "hypervolume", "written: runs/cell/front.json", "next: trajevo ")]
    assert places == sorted(places)
    assert said.splitlines()[-1].startswith("next: trajevo certify runs/cell; trajevo pictures runs/cell for pictures")
    for command in (
        ("report", "runs/cell"),
        ("export", "runs/cell"),
        ("slowdown", "runs/cell"),
        ("payload-diagram", "runs/cell", "--grid", "4"),
        ("polish", "runs/cell", "--members", "2", "--rounds", "1", "--out", "p.json"),
    ):
        told = trajevo(*command, cwd=folder)
        assert told.returncode == 0, told.stderr
        *_, written, then = told.stdout.splitlines()
        assert written.startswith("written: "), command
        assert then.startswith("next: "), command


def test_tables_and_points_are_told_only_if_asked(cell):
    folder, done = cell
    brief, whole = (trajevo("show", "runs/cell", *more, cwd=folder).stdout for more in ((), ("--verbose",)))
    for text in (done.stdout, brief):
        assert "points = " not in text
        assert "'mass'" not in text
        assert "duration_bounds = (0.3, 4)" in text
    assert "points = ((0, 0.1, -0.2" in " ".join(whole.split())
    assert "payload = {'mass': 1.0" in " ".join(whole.split())
    assert "versions" in whole
    assert "all settings: trajevo show runs/cell --verbose" in brief


def test_the_name_of_a_task_is_everywhere(cell):
    folder, _ = cell
    report = (folder / "runs/cell/report.html").read_text()
    assert "<title>Feeding press 3</title>" in report
    assert "<h1>Feeding press 3</h1>" in report
    front = Front.load(folder / "runs/cell/front.json")
    assert front.record.title == front.problem.title == "Feeding press 3"
    assert repr(front).startswith(f"Front(Feeding press 3, {len(front)} solutions: time ")
    assert trajevo("check", "cell.toml", cwd=folder).stdout.splitlines()[0] == "puma560, 1 kg: Feeding press 3"
    assert "Feeding press 3" in trajevo("resume", "runs/cell", "--quiet", "--no-pictures", cwd=folder).stdout


def test_a_task_without_a_name_is_called_like_its_file(tmp_path):
    (tmp_path / "left_arm.toml").write_text(TASK.replace('name = "Feeding press 3"\n', ""))
    assert "1 kg: left_arm\n" in trajevo("check", "left_arm.toml", cwd=tmp_path).stdout
    for wrong in ('""', '"two\\nlines"', f'"{"x" * 121}"'):
        (tmp_path / "left_arm.toml").write_text(TASK.replace('"Feeding press 3"', wrong))
        told = trajevo("check", "left_arm.toml", cwd=tmp_path)
        assert told.returncode == 2
        assert "left_arm.toml: line 2: name: expected one line of 1 to 120 characters" in told.stderr


def test_a_name_changes_no_number_and_a_run_goes_on_under_another(cell):
    folder, _ = cell
    (folder / "renamed.toml").write_text(TASK.replace("press 3", "press 4"))
    from trajevo import load_task

    problem = load_task(folder / "renamed.toml").problem
    front = Front.load(folder / "runs/cell/front.json", problem=problem)
    np.testing.assert_array_equal(problem.evaluate(front.X[:2], return_values_of=["F"]), front.F[:2])
    assert front.problem is problem


def test_a_limit_that_all_solutions_use_alike_is_told_once():
    fixed, free = {"position of a": 1.0, "velocity of a": 0.4}, {"position of a": 1.0, "velocity of a": 0.7}
    assert _alike([fixed, free]) == {"position of a": 1.0}
    assert _alike([fixed]) == {}
    assert _alike([{"position of a": 0.3, "velocity of a": 0.4}, {"position of a": 0.3, "velocity of a": 0.7}]) == {}
    header, cells = _closest([{"velocity of a": 0.4, "jerk of b": 0.1}, {"velocity of a": 0.2, "jerk of b": 0.9}])
    assert header.format("closest limit") == "closest limit"
    assert cells == ["40.0 % velocity of a", "90.0 % jerk of b"]
    header, cells = _closest([{"velocity of a": 0.4}, {"velocity of a": 0.7}])
    assert header.format("closest limit") == "closest limit, velocity of a [%]"
    assert cells == ["40.0", "70.0"]
    assert _closest([{}, {}]) == ("", ["", ""])


def test_values_name_their_units_in_python_as_in_the_table(cell):
    folder, _ = cell
    best = Front.load(folder / "runs/cell/front.json").knee()
    shown = trajevo("show", "runs/cell", "--angle", "rad", cwd=folder).stdout
    for name, unit in best.F.units.items():
        assert re.search(rf"{name}\s+(\w+\s+)*\[{unit}\]|{name}\b[\s\S]*?\[{unit}\]", shown)
        assert f"{name} {best.F[name]:.5g} {unit}" in str(best.F)
    assert repr(best) == f"Solution(knee, row {best.index}: {best.F})"
    assert dict(best.F) == best.F
    assert (
        str(Quantities({"ratio": 0.25, "jerk": 2.0}, {"ratio": "1", "jerk": "rad/s^3"})) == "ratio 0.25, jerk 2 rad/s³"
    )


def test_fronts_are_told_in_one_line():
    front = optimise(small_problem(), generations=3, population=12, seed=1, polish=False, progress=False)
    time, jerk = front.F.min(axis=0), front.F.max(axis=0)
    assert repr(front) == (
        f"Front(trajectory problem, {len(front)} solutions: time {time[0]:.5g} to {jerk[0]:.5g} s, "
        f"jerk {time[1]:.5g} to {jerk[1]:.5g} rad/s³)"
    )


#: Several commands in one process, for whoever pays for its start; a line of equal signs ends each.
COMMANDS = """
import json, sys
from trajevo.cli.main import main
for arguments in json.loads(sys.argv[1]):
    sys.argv[1:] = arguments
    try:
        main()
    except SystemExit as ended:
        assert not ended.code, ended.code
    print(20 * "=", flush=True)
"""


def on_a_terminal(*commands, cwd, columns=80):
    """What commands show on a terminal of some columns, each line by line, without its control sequences."""
    pty = pytest.importorskip("pty")
    import fcntl
    import termios

    ours, its = pty.openpty()
    fcntl.ioctl(its, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
    environment = {name: value for name, value in os.environ.items() if name not in ("COLUMNS", "NO_COLOR")}
    command = [sys.executable, "-c", COMMANDS, json.dumps([list(map(str, one)) for one in commands])]
    environment |= {"TERM": "xterm"}
    process = subprocess.Popen(command, cwd=cwd, stdin=its, stdout=its, stderr=its, env=environment, close_fds=True)
    os.close(its)
    shown = b""
    while select.select([ours], [], [], 60.0)[0]:
        try:
            got = os.read(ours, 65536)
        except OSError:  # Linux says so at the end
            break
        if not got:
            break
        shown += got
    os.close(ours)
    assert process.wait() == 0, shown
    *each, rest = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", shown.decode()).split(20 * "=")
    assert not rest.strip()
    return [[line for line in re.split(r"[\r\n]+", one) if line.strip()] for one in each]


SMALL = ("pointing", "--generations", "3", "--population", "12", "--no-polish")


@pytest.mark.parametrize("solved", mostly_long([SMALL, ("cell.toml",)], SMALL), ids=" ".join)
def test_bars_fill_a_terminal_and_nothing_else(cell, tmp_path, solved):
    folder, done = cell
    shown, quiet = on_a_terminal(
        ("solve", *solved, "--pictures", "--out", tmp_path / "seen"),
        ("solve", *solved, "--pictures", "--out", tmp_path / "unseen", "--quiet"),
        cwd=folder,
    )
    for begun in ("computing: certificate ━", "drawing: front ━"):
        (bar, *_) = [line for line in shown if line.startswith(begun)]
        assert len(bar) == 80
        assert bar.count("━") > 40
    searched = [line for line in shown if re.match(r"3/3 ━+ .* left, \d+ points, hypervolume 0\.\d{4}", line)]
    assert searched
    assert searched[0].count("━") >= 25
    assert len(quiet) > 5
    assert not [line for line in quiet if "━" in line]
    assert "━" not in done.stdout + done.stderr
    assert "drawing" not in done.stdout + done.stderr


def test_lines_stand_for_a_bar_only_where_they_are_asked_for(capsys):
    for lines, quiet, told in ((False, False, ""), (True, True, ""), (True, False, "computing: two words\n")):
        with Waiting("computing", ["two_words"], lines=lines, quiet=quiet) as shown:
            shown.begin("two_words")
        assert capsys.readouterr().err == told
