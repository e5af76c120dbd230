"""Individuals that raise, give NaN, hang or bring the process down, and disks that do not take a run."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
import warnings

import numpy as np
import pytest

from tests.helpers import UNDRAWN, refused, small_problem, trajevo, without_files
from tests.killed import begin
from trajevo import Front, optimise
from trajevo.errors import InvalidInputError
from trajevo.formulation.objectives import Objective, summed_rms_jerk, total_time
from trajevo.front.archive import MOST_LISTED
from trajevo.page.report import report
from trajevo.problems import PointingMechanism
from trajevo.solvers.run.folder import RunFolder
from trajevo.solvers.run.runs import read_run, resume

SMALL = {"generations": 6, "population": 20, "progress": False}
#: Trajectories that take longer than this misbehave [s].
SLOW = 15.0


def when_slow(misbehave):
    """A small problem with an objective that misbehaves for slow trajectories; it evaluates whole batches."""

    def objective(rollout):
        if (rollout.trajectory.duration > SLOW).any():
            misbehave()
        return total_time(rollout)

    return small_problem(
        objectives=(Objective("time", "s", "t", objective), Objective("jerk", "rad/s^3", "t", summed_rms_jerk))
    )


def hang():
    time.sleep(60.0)


def die():
    os.kill(os.getpid(), signal.SIGKILL)


def leave():
    os._exit(3)


def complain():
    raise LookupError("no such torque")


@pytest.mark.parametrize(
    ("misbehave", "said"),
    [
        (hang, "took longer than 0.6 s"),
        (die, "the process that evaluated it died: signal SIGKILL"),
        pytest.param(leave, "the process that evaluated it died: exit code 3", marks=pytest.mark.long),
        (complain, "LookupError: no such torque"),
    ],
)
def test_individuals_that_misbehave_are_listed_with_their_x_and_touch_no_other(misbehave, said, tmp_path):
    began = time.perf_counter()
    front = optimise(
        when_slow(misbehave),
        seed=1,
        generations=2,
        population=8,
        time_limit=0.6,
        out=tmp_path / "run",
        progress=False,
        polish=False,
    )
    assert time.perf_counter() - began < 45.0
    assert 0 < front.run.failures < front.run.evaluations
    assert len(front.run.failed) == front.run.failures
    assert {one.said for one in front.run.failed} == {said}
    assert front.run.first_failure == said
    failed = np.array([one.x for one in front.run.failed])
    assert (small_problem().decode(failed).duration > SLOW).all()
    assert len(front) > 0
    assert (front.F[:, 0] <= SLOW).all()
    (block,) = (b for b in RunFolder(tmp_path / "run").blocks(2) if (b.said != "").any())
    np.testing.assert_array_equal(block.said != "", np.isinf(block.F[:, 0]))
    np.testing.assert_array_equal(block.X[block.said != ""], failed[: (block.said != "").sum()])
    again = Front.load(tmp_path / "run" / "front.json", problem=small_problem())
    assert again.run.failed == front.run.failed
    assert not multiprocessing.active_children()


def test_a_time_limit_changes_nothing_of_a_run_that_keeps_it():
    limited = optimise(PointingMechanism(), seed=2, time_limit=30.0, **SMALL, polish=False)
    free = optimise(PointingMechanism(), seed=2, **SMALL, polish=False)
    for name in "XFG":
        np.testing.assert_array_equal(getattr(limited, name), getattr(free, name))
    assert limited.run.failures == 0


def test_only_the_first_failures_are_listed_all_are_counted():
    served = []

    def expires(rollout):
        served.append(len(rollout.trajectory))
        if len(served) > 1:
            raise RuntimeError("no licence")
        return total_time(rollout)

    front = optimise(small_problem(objectives=(Objective("time", "s", "t", expires),)), seed=1, **SMALL, polish=False)
    assert front.run.failures == 120
    assert len(front.run.failed) == MOST_LISTED


def test_failures_are_in_the_report(tmp_path, monkeypatch):
    without_files(monkeypatch)
    front = optimise(when_slow(complain), seed=1, **SMALL, polish=False)
    front.save(tmp_path / "front.json")
    text = report(front, tmp_path / "report.html", pictures=()).read_text()
    x = front.run.failed[0].x
    assert "LookupError: no such torque" in text
    assert ", ".join(f"{value:.6g}" for value in x) in text


@pytest.mark.parametrize("seconds", [0.0, -1.0, float("inf"), float("nan"), True, "1"])
def test_a_time_limit_is_a_positive_time(seconds):
    refused(
        lambda: optimise(small_problem(), seed=1, time_limit=seconds, **SMALL, polish=False),
        "time_limit: expected a positive",
    )


def _in_a_daemon(pipe):
    try:
        optimise(PointingMechanism(), seed=1, time_limit=1.0, **SMALL, polish=False)
    except InvalidInputError as error:
        pipe.send(str(error))


def test_a_worker_that_may_not_start_processes_says_what_to_change():
    here, there = multiprocessing.get_context("fork").Pipe()
    worker = multiprocessing.get_context("fork").Process(target=_in_a_daemon, args=(there,), daemon=True)
    worker.start()
    assert here.poll(30.0)
    assert "distributed.worker.daemon" in here.recv()
    worker.join()


def test_a_process_whose_run_was_killed_while_it_hangs_ends_by_itself():
    context = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe(duplex=False)

    def hangs():
        theirs.send(os.getpid())
        hang()

    def run():
        optimise(when_slow(hangs), seed=1, generations=2, population=8, time_limit=0.5, progress=False)

    running = context.Process(target=run)
    running.start()
    hanging = ours.recv()
    running.kill()
    running.join()
    deadline = time.perf_counter() + 10.0
    while time.perf_counter() < deadline:
        try:
            os.kill(hanging, 0)
        except ProcessLookupError:
            return
        time.sleep(0.05)
    pytest.fail("it still hangs")


def test_a_full_disk_is_told_while_the_run_goes_on_and_its_front_is_kept_elsewhere(tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    script = (
        "import resource, tempfile\n"
        "from trajevo.problems import PointingMechanism\n"
        "from trajevo import optimise\n"
        f"out = {str(tmp_path / 'run')!r}\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (6000, resource.RLIM_INFINITY))\n"
        "rescue = tempfile.NamedTemporaryFile\n"
        "def freed(**arguments):\n"
        "    resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))\n"
        "    return rescue(**arguments)\n"
        "tempfile.NamedTemporaryFile = freed\n"
        f"optimise(PointingMechanism(), seed=2, out=out, polish=False, **{SMALL!r})\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "no checkpoint can be written: File too large; the run goes on in memory" in done.stderr
    (elsewhere,) = tmp_path.glob("trajevo-*.json")
    assert f"front.json: cannot be written: File too large; the front is in {elsewhere}" in done.stderr
    assert not (tmp_path / "run" / "front.json").exists()
    expected = optimise(PointingMechanism(), seed=2, **SMALL, polish=False)
    np.testing.assert_array_equal(Front.load(elsewhere).X, expected.X)
    np.testing.assert_array_equal(resume(tmp_path / "run", progress=False).X, expected.X)


@pytest.mark.parametrize("name", ["NSGA2", "NSGA3"])
def test_a_checkpoint_that_failed_is_written_as_soon_as_there_is_room(name, tmp_path, monkeypatch):
    write, calls = RunFolder.write, []

    def full_for_a_while(self, *arguments):
        calls.append(1)
        if 1 < len(calls) < 4:
            raise OSError(28, "No space left on device")
        write(self, *arguments)

    monkeypatch.setattr(RunFolder, "write", full_for_a_while)
    monkeypatch.setattr("trajevo.solvers.run.evolution._FIRST_DUE", 0.0)
    monkeypatch.setattr("trajevo.solvers.run.evolution._TRY_AGAIN", 0.0)
    monkeypatch.setattr("trajevo.solvers.run.evolution._SHARE", 1e9)
    with pytest.warns(UserWarning, match="no checkpoint can be written: No space left on device") as told:
        front = begin("pointing", name, 6, 2, tmp_path / "run")
    assert len(told) == 1
    (tmp_path / "run" / "front.json").unlink()
    np.testing.assert_array_equal(read_run(tmp_path / "run").X, front.X)


def test_what_pymoo_says_of_its_own_is_not_repeated_and_ours_is_heard(tmp_path):
    before = list(warnings.filters)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for name in ("RVEA", "NSGA3"):
            begin("pointing", name, 12, 1, tmp_path / name)
    assert warnings.filters == before


def test_too_little_space_is_told_before_anything_is_computed(tmp_path, monkeypatch):
    monkeypatch.setattr(RunFolder, "free", lambda self: 10**6)
    says = r"run: the run needs about 17 MB, 1 MB are free"
    refused(lambda: optimise(PointingMechanism(), seed=2, out=tmp_path / "run", **SMALL, polish=False), says)


def test_a_folder_that_cannot_be_made_is_told_before_anything_is_computed(tmp_path):
    (tmp_path / "file").write_text("mine")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        refused(
            lambda: optimise(PointingMechanism(), seed=2, out=tmp_path / "file" / "run", **SMALL, polish=False),
            "file/run: the run cannot be written there: Not a directory",
        )
    done = trajevo("solve", "pointing", "--out", tmp_path / "file" / "run")
    assert done.returncode == 2
    assert "cannot be written: Not a directory" in done.stderr


def test_the_command_line_takes_a_time_limit(tmp_path):
    small = ["--generations", "2", "--population", "8", *UNDRAWN, "--quiet", "--out", tmp_path / "run"]
    done = trajevo("solve", "pointing", *small, "--time-limit", "20")
    assert done.returncode == 0, done.stderr
    assert RunFolder(tmp_path / "run").manifest().time_limit == 20.0
    refused_one = trajevo("solve", "pointing", *small, "--overwrite", "--time-limit", "-3")
    assert refused_one.returncode == 2
    assert "--time-limit: expected a positive time [s], got -3.0" in refused_one.stderr
