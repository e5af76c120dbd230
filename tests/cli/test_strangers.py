"""Runs, robots and tasks from strangers on the command line: no link, name or output makes them do harm."""

import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import time

import pytest

from tests.fuzz.kinds import PLAIN, URDF
from tests.helpers import forked, mostly_long, refused, trajevo
from trajevo import Front, TrajevoError, ViaPointProblem, load_robot, optimise, read_run, resume
from trajevo.base.files import SCRATCH

LIMITS = {"acceleration": 10.0, "jerk": 100.0}
SMALL = {"population": 12, "generations": 4, "seed": 1, "progress": False, "polish": False}
POINTS = [[0.0, 0.0], [0.4, 0.2], [0.2, 0.1]]


def problem_of(urdf):
    return ViaPointProblem(robot=load_robot(urdf, limits=LIMITS), points=POINTS, duration_bounds=(0.3, 4.0))


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("made")
    (folder / "two.urdf").write_bytes(PLAIN)
    optimise(problem_of(folder / "two.urdf"), out=folder / "run", **SMALL)
    return folder / "run"


@pytest.fixture
def run(made, tmp_path):
    return shutil.copytree(made, tmp_path / "run")


@pytest.mark.parametrize(
    ("name", "command"),
    [
        (f"knee.csv{SCRATCH}", ("export", "--format", "csv")),
        ("knee.csv", ("export", "--format", "csv")),
        ("knee.html", ("animate",)),
        ("report.html", ("report", "--no-pictures")),
        ("front.analyses.npz", ("report", "--no-pictures")),
        ("front.json", ("resume", "--quiet", "--no-pictures", "--report", "none")),
        (f"manifest.json{SCRATCH}", ("resume", "--quiet", "--generations", "5", "--no-pictures", "--report", "none")),
        ("manifest.json", ("resume", "--quiet", "--generations", "5", "--no-pictures", "--report", "none")),
        ("checkpoint.npz", ("resume", "--quiet", "--generations", "5", "--no-pictures", "--report", "none")),
        ("evolved.json", ("polish", "--rounds", "1", "--no-pictures", "--report", "none")),
    ],
)
def test_no_command_writes_through_a_link_in_a_run_s_folder(name, command, run, tmp_path):
    other = tmp_path / "other"
    content = (run / name).read_bytes() if (run / name).exists() else b"keep me"
    other.write_bytes(content)
    (run / name).unlink(missing_ok=True)
    (run / name).symlink_to(other)
    verb, *options = command
    result = trajevo(verb, run, *options)
    assert "Traceback" not in result.stderr
    assert other.read_bytes() == content


@pytest.mark.parametrize("name", ["plots", "blocks"])
def test_a_folder_of_a_run_that_is_a_link_is_refused(name, run, tmp_path):
    if (run / name).exists():
        shutil.copytree(run / name, tmp_path / "other")
        shutil.rmtree(run / name)
    else:
        (tmp_path / "other").mkdir()
    (tmp_path / "other" / "front.png").write_text("keep me")
    before = sorted(file.name for file in (tmp_path / "other").iterdir())
    (run / name).symlink_to(tmp_path / "other")
    result = trajevo("resume", run, "--quiet", "--generations", "5")
    assert result.returncode == 2
    assert f"{name}: expected a folder, got a link to {tmp_path / 'other'}" in result.stderr.replace("\n", "")
    assert sorted(file.name for file in (tmp_path / "other").iterdir()) == before
    assert (tmp_path / "other" / "front.png").read_text() == "keep me"


def test_a_lock_that_is_a_link_makes_no_file(run, tmp_path):
    (run / ".lock").unlink()
    (run / ".lock").symlink_to(tmp_path / "made")
    refused(lambda: resume(run, progress=False), "run: the run cannot be written there")
    assert not (tmp_path / "made").exists()


def test_a_run_names_no_file_of_points_to_read(run, tmp_path):
    (tmp_path / "secret.csv").write_text("password [rad],b [m]\n0,0\n")
    for file in ("front.json", "manifest.json"):
        content = json.loads((run / file).read_text())
        content["problem"]["settings"]["points"] = str(tmp_path / "secret.csv")
        (run / file).write_text(json.dumps(content))
    for call in (lambda: Front.load(run / "front.json").problem, lambda: resume(run, progress=False)):
        with pytest.raises(
            TrajevoError, match="the record of the problem 'via-points' names a file .*secret"
        ) as caught:
            call()
        assert "password" not in str(caught.value)
    robot = json.loads((run / "front.json").read_text())
    robot["problem"]["settings"] |= {"points": POINTS, "robot": {"name": "ur5", "limits": str(tmp_path / "secret.csv")}}
    (run / "front.json").write_text(json.dumps(robot))
    refused(lambda: Front.load(run / "front.json").problem, "names a file to read")


def test_points_are_read_from_regular_files_only(tmp_path):
    result = trajevo("check", "pointing", "--points", "/dev/zero")
    assert (result.returncode, result.stderr) == (2, "error: /dev/zero: expected a regular file, got a device\n")


@pytest.mark.parametrize(
    ("setting", "says"),
    [
        (("--population", "200000000"), "--population: expected a whole number of at most 200000, got 200000000"),
        (("--generations", "9999999999"), "--generations: expected a whole number of at most 2147483647"),
        (("--offsprings", "200001"), "--offsprings: expected a whole number of at most 200000"),
    ],
)
def test_sizes_that_no_machine_holds_are_refused(setting, says, tmp_path):
    result = trajevo("solve", "pointing", "--out", tmp_path / "run", *setting)
    assert result.returncode == 2
    assert says in result.stderr
    assert not (tmp_path / "run").exists()


def test_samples_and_repeats_are_bounded(tmp_path):
    result = trajevo("solve", "pick-place", "--set", "samples=1000000", "--out", tmp_path / "run")
    assert result.returncode == 2
    assert "samples: expected at most 10000 per segment, got 1000000" in result.stderr
    result = trajevo("solve", "pick-place", "--set", "samples=1000000000", "--out", tmp_path / "run")
    assert result.returncode == 2
    assert "samples: expected a whole number of at most 1000000, got 1000000000" in result.stderr
    (tmp_path / "study.toml").write_text('problem = "pointing"\nseed = 1\nrepeats = 9223372036854775807\n')
    result = trajevo("study", "run", tmp_path / "study.toml")
    assert result.returncode == 2
    assert "line 3: repeats: expected a number up to 100000, got 9223372036854775807" in result.stderr


NASTY = ("\x1b[31mred", "\x9bred", "two\nlines", "a\rb", "\u202eright", "\u2067a", "tab\there", "\x7f", "a\u2028b")


@pytest.mark.parametrize("name", NASTY)
def test_names_that_steer_a_terminal_are_refused_in_robots(name, tmp_path):
    written = name.translate({ord(each): f"&#{ord(each)};" for each in "\n\r\t"})
    for old, tag in (("l1", "link"), ("a", "joint")):
        if "\x1b" in name or "\x7f" in name:  # which XML 1.0 does not allow, or only raw
            continue
        (tmp_path / "two.urdf").write_text((URDF % "").replace(f'"{old}"', f'"{written}"'), encoding="utf-8")
        with pytest.raises(TrajevoError, match="printable characters on one line") as caught:
            load_robot(tmp_path / "two.urdf", limits=LIMITS)
        assert f"{tag} {name!r}" in str(caught.value)
        shown = trajevo("check-robot", tmp_path / "two.urdf").stdout
        assert not set(shown) & set("\x1b\x9b\r\u202e\u2067\u2028")


@pytest.mark.parametrize("name", NASTY)
def test_names_that_steer_a_terminal_are_replaced_in_runs(name, run):
    content = json.loads((run / "front.json").read_text())
    content["run"]["algorithm"] = content["run"]["first_failure"] = name
    content["run"]["failures"] = 1
    content["run"]["versions"][name] = content["run"]["settings"][name] = name
    (run / "front.json").write_text(json.dumps(content))
    result = trajevo("show", run / "front.json")
    assert result.returncode == 0, result.stderr
    assert not set(result.stdout) & set("\x1b\x9b\r\u202e\u2067\x7f\u2028")
    for place in ("title", "robot", "robot_reference"):
        other = content | {"problem": content["problem"] | {place: name, "name": ""}}
        (run / "front.json").write_text(json.dumps(other))
        result = trajevo("show", run / "front.json")
        assert result.returncode == 2
        assert not set(result.stdout + result.stderr) & set("\x1b\x9b\r\u202e\u2067\x7f\u2028")
        assert getattr(Front.load(run / "front.json").record, place).isprintable()


def test_no_cell_of_a_table_is_a_formula_and_no_name_a_line_of_a_program(tmp_path):
    formula = "=HYPERLINK(&quot;http://x&quot;)"
    (tmp_path / "two.urdf").write_text((URDF % "").replace('"a"', f'"{formula}"'), encoding="utf-8")
    optimise(problem_of(tmp_path / "two.urdf"), out=tmp_path / "run", **SMALL)
    for kind, ending in (("csv", "csv"), ("mujoco", "mujoco.csv")):
        assert trajevo("export", tmp_path / "run", "--format", kind).returncode == 0
        text = (tmp_path / "run" / f"knee.{ending}").read_text()
        header = next(line for line in text.splitlines() if "HYPERLINK" in line and not line.startswith("#"))
        assert ",\"'=HYPERLINK" in header
        assert ',"=' not in header


def test_python_s_folder_cut_short_goes_on_on_the_command_line(made, tmp_path):
    problem = problem_of(made.parent / "two.urdf")

    def end():
        while not (tmp_path / "run" / "checkpoint.npz").exists():
            time.sleep(0.02)
        time.sleep(0.2)
        os.kill(os.getpid(), signal.SIGKILL)

    def cut_short():
        threading.Thread(target=end).start()
        optimise(problem, out=tmp_path / "run", **SMALL | {"generations": 100_000})

    assert forked(cut_short) == -signal.SIGKILL
    file = tmp_path / "run" / "manifest.json"
    done = len(read_run(tmp_path / "run").run.cpu_seconds)
    content = json.loads(file.read_text())
    content["generations"] = content["settings"]["generations"] = done + 2
    file.write_text(json.dumps(content))
    assert not (tmp_path / "run" / "plots").exists()
    result = trajevo("resume", tmp_path / "run", "--quiet", "--report", "none")
    assert result.returncode == 0, result.stderr
    assert (tmp_path / "run" / "plots" / "front.png").is_file()
    assert read_run(tmp_path / "run").run.generations == done + 2


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs a device that is always full")
@pytest.mark.parametrize(
    "arguments",
    mostly_long([("show", "RUN"), ("--help",), ("--version",), ("study", "--help")], ("--help",)),
)
def test_a_full_device_costs_a_sentence(arguments, made):
    command = [sys.executable, "-m", "trajevo", *(str(made) if each == "RUN" else each for each in arguments)]
    with open("/dev/full", "w") as full:
        result = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True)
    assert result.returncode == 2
    assert result.stderr == "error: standard output: cannot be written: No space left on device\n"


def test_a_reader_that_has_seen_enough_is_no_error(made):
    with subprocess.Popen(
        [sys.executable, "-m", "trajevo", "list"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        process.stdout.close()
        assert process.stderr.read() == ""


@pytest.mark.parametrize("polished", mostly_long([False, True], False))
def test_the_package_raises_no_warnings_of_its_own(tmp_path, polished):
    script = (
        "import trajevo\n"
        "problem = trajevo.load_problem('hybrid')\n"
        f"front = trajevo.optimise(problem, population=12, generations=3, seed=1, progress=False, polish={polished})\n"
        "front.choices()\n"
        f"front.save({str(tmp_path / 'front.json')!r})\n"
        f"trajevo.Front.load({str(tmp_path / 'front.json')!r}).knee().rollout\n"
    )
    result = subprocess.run([sys.executable, "-W", "error", "-c", script], capture_output=True, text=True)
    assert (result.returncode, result.stderr) == (0, "")


def test_the_command_s_errors_are_one_line_whatever_they_quote(tmp_path):
    result = trajevo("show", tmp_path / "\x1b[31mred\u202e")
    assert result.returncode == 2
    assert not set(result.stderr) & set("\x1b\u202e")
