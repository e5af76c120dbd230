"""Studies run: one front for every engine, and none of them lost whatever dies."""

import hashlib
import json
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from importlib.util import find_spec

import dask
import pytest
from distributed import LocalCluster
from typer.testing import CliRunner

from tests.helpers import mostly_long, refused, trajevo
from trajevo import Front, TrajevoError, load_problem, optimise
from trajevo.base import jit
from trajevo.cli.study import app
from trajevo.study.cell import run_cell
from trajevo.study.cluster import DaskCluster
from trajevo.study.definition import Study
from trajevo.study.engines import InProcess, Processes
from trajevo.study.folder import StudyFolder
from trajevo.study.run import run_study, study_standing

#: Cells that take long enough for a process to be killed in the midst of them.
LONG = {"generations": 60, "population": 24}


def small(**changes):
    factors = {"interpolant": ["smooth", "quintic"]}
    given = {"seed": 5, "repeats": 2, "generations": 6, "population": 12, "factors": factors}
    fixed = {"polish": False} | changes.pop("fixed", {})
    return Study("pointing", fixed=fixed, **(given | changes))


def run(study, folder, engine=None):
    return run_study(study, folder, engine=engine, progress=False)


def fronts(study, folder):
    return [Front.load(StudyFolder(folder).cell(cell.name) / "front.json") for cell in study.cells]


def hash_of(study, folder):
    found = hashlib.sha256()
    for front in fronts(study, folder):
        found.update(front.X.tobytes() + front.F.tobytes() + front.G.tobytes())
    return found.hexdigest()


@contextmanager
def meanwhile(action):
    """Run an action in a thread beside what is in the context; what it raises is raised at the end."""
    with ThreadPoolExecutor(1) as pool:
        done = pool.submit(action)
        yield
        done.result(timeout=30.0)


def until(condition, seconds=30.0):
    """Wait until a condition holds, and give back what it gave."""
    end = time.monotonic() + seconds
    while not (found := condition()):
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.03)
    return found


def half_way(folder, finished):
    """Whether some cells are finished and another has begun."""
    if not (folder / "study.json").exists():
        return False
    place, stands = StudyFolder(folder), study_standing(folder)
    begun = [one for one in stands.cells if one.state == "running" and (place.cell(one.cell.name) / "blocks").exists()]
    return stands.count("finished") >= finished and bool(begun)


@pytest.fixture(scope="module")
def expected(tmp_path_factory):
    folder = tmp_path_factory.mktemp("expected") / "study"
    assert run(small(), folder).finished
    return hash_of(small(), folder)


@pytest.fixture(scope="module")
def expected_long(tmp_path_factory):
    study, folder = small(**LONG), tmp_path_factory.mktemp("expected") / "study"
    assert run(study, folder).finished
    return hash_of(study, folder)


@pytest.fixture(scope="module", params=[1, 2])
def cluster(request):
    """Workers that do not look every 10 ms at what they do."""
    with (
        dask.config.set({"distributed.worker.profile.enabled": False}),
        LocalCluster(n_workers=request.param, threads_per_worker=1, dashboard_address=":0", silence_logs=50) as found,
    ):
        yield found


def test_a_cell_is_the_run_that_its_settings_and_seed_make(tmp_path):
    study = small(repeats=1)
    run(study, tmp_path / "study")
    for cell, front in zip(study.cells, fronts(study, tmp_path / "study"), strict=True):
        problem = load_problem("pointing", interpolant=cell.labels["interpolant"])
        alone = optimise(problem, seed=cell.seed, generations=6, population=12, progress=False, polish=False)
        assert (front.X.tobytes(), front.F.tobytes()) == (alone.X.tobytes(), alone.F.tobytes())


@pytest.mark.parametrize("start_method", mostly_long(["spawn", "fork", "forkserver"], "fork"))
@pytest.mark.parametrize("workers", mostly_long([1, 2], 1))
def test_processes_give_the_fronts_of_one_process(tmp_path, expected, start_method, workers):
    assert run(small(), tmp_path / "study", Processes(workers, start_method=start_method)).finished
    assert hash_of(small(), tmp_path / "study") == expected


@pytest.mark.parametrize("workers", mostly_long([1, 2], 1))
def test_a_cluster_of_its_own_gives_the_fronts_of_one_process_and_listens_to_this_machine_alone(tmp_path, workers):
    """Listening sockets of this process and of all that it starts, while a study runs."""
    psutil = pytest.importorskip("psutil")  # which distributed needs
    seen = set()

    def watch():
        while not done:
            for process in (psutil.Process(), *psutil.Process().children(recursive=True)):
                try:
                    found = process.net_connections("inet")
                except psutil.Error:  # it has ended meanwhile
                    continue
                own = {c.laddr.port for c in before}
                seen.update(c.laddr.ip for c in found if c.status == "LISTEN" and c.laddr.port not in own)
            time.sleep(0.2)

    before, done = [c for c in psutil.Process().net_connections("inet") if c.status == "LISTEN"], []
    # With a time limit each worker needs a process for its evaluations, and each cell one of its own.
    study = small(fixed={"time_limit": 30.0}, repeats=workers)
    with meanwhile(watch):
        try:
            assert run(study, tmp_path / "study", DaskCluster(workers)).finished
        finally:
            done.append(True)
    assert seen == {"127.0.0.1"}
    assert run(small(repeats=workers), tmp_path / "expected").finished
    assert hash_of(study, tmp_path / "study") == hash_of(study, tmp_path / "expected")


def test_finished_cells_are_skipped_and_new_ones_are_run(tmp_path):
    folder = tmp_path / "study"
    run(small(), folder)
    before = {file: file.stat().st_mtime_ns for file in folder.glob("cells/*/front.json")}
    larger = small(repeats=3, factors={"interpolant": ["quintic", "printed", "smooth"]})
    assert str(run(larger, folder)) == "9 cells: 9 finished"
    assert all(file.stat().st_mtime_ns == time for file, time in before.items())
    assert len(before) == 4


def test_a_failed_cell_is_recorded_stops_no_other_and_is_tried_again(tmp_path, monkeypatch, capsys):
    study, folder = small(), tmp_path / "study"
    broken = study.cells[1]

    def fails(problem, search, **options):
        if search.seed == broken.seed:
            raise KeyError("no such table")
        return optimise(problem, search, **options)

    monkeypatch.setattr("trajevo.study.cell.optimise", fails)
    stands = run_study(study, folder)
    assert str(stands) == "4 cells: 3 finished, 1 failed"
    assert f"failed: {broken.name}: KeyError: 'no such table'" in capsys.readouterr().err
    failure = json.loads((StudyFolder(folder).cell(broken.name) / "failure.json").read_text())
    assert failure["sentence"] == "KeyError: 'no such table'"
    assert 'raise KeyError("no such table")' in failure["traceback"]
    monkeypatch.undo()
    result = trajevo("study", "status", folder)
    assert f"failed: {broken.name}: KeyError: 'no such table'" in result.stdout
    assert trajevo("study", "run", folder, "--quiet").returncode == 0
    assert study_standing(folder).finished
    assert not (StudyFolder(folder).cell(broken.name) / "failure.json").exists()


def test_a_cell_that_holds_another_run_fails_with_a_sentence(tmp_path):
    study, folder = small(repeats=1), tmp_path / "study"
    place = StudyFolder(folder).cell(study.cells[0].name)
    optimise(load_problem("pointing"), seed=1, generations=2, population=12, progress=False, out=place, polish=False)
    (place / "front.json").unlink()
    stands = run(study, folder)
    assert str(stands) == "2 cells: 1 finished, 1 failed"
    assert "holds another run than this cell's; remove it" in stands.cells[0].failure.sentence


def test_a_killed_process_of_a_pool_loses_no_cell(tmp_path, expected_long):
    study, folder = small(**LONG), tmp_path / "study"

    def kill():
        until(lambda: half_way(folder, 1))
        os.kill(multiprocessing.active_children()[0].pid, signal.SIGKILL)

    with meanwhile(kill):
        assert run(study, folder, Processes(2, start_method="fork")).finished
    assert hash_of(study, folder) == expected_long


def test_the_cell_that_kills_its_process_is_found(tmp_path, monkeypatch):
    study, folder = small(), tmp_path / "study"
    deadly = study.cells[0]

    def dies(problem, search, **options):
        if search.seed == deadly.seed:
            os.kill(os.getpid(), signal.SIGKILL)
        return optimise(problem, search, **options)

    monkeypatch.setattr("trajevo.study.cell.optimise", dies)
    stands = run(study, folder, Processes(2, start_method="fork"))
    assert str(stands) == "4 cells: 3 finished, 1 failed"
    assert stands.cells[0].failure.sentence == "its process died 3 times, for example because memory ran out"


@pytest.mark.long
def test_a_killed_worker_of_a_cluster_loses_no_cell(tmp_path, cluster, expected_long):
    study, folder = small(**LONG), tmp_path / "study"

    def kill():
        until(lambda: half_way(folder, 1))
        os.kill(next(iter(cluster.workers.values())).process.pid, signal.SIGKILL)

    with meanwhile(kill):
        assert run(study, folder, DaskCluster(scheduler=cluster.scheduler_address)).finished
    assert hash_of(study, folder) == expected_long


def killed_as_it_starts(monkeypatch, times):
    """Let the first processes of pools die before they take a cell, as if memory had run out."""
    from trajevo.study import engines

    begin, left = engines._begin_worker, multiprocessing.get_context("fork").Value("i", times)

    def dies(begun):
        with left.get_lock():
            left.value -= 1
            dying = left.value >= 0
        if dying:
            os.kill(os.getpid(), signal.SIGKILL)
        begin(begun)

    monkeypatch.setattr(engines, "_begin_worker", dies)
    return left


def test_a_worker_that_is_killed_as_it_starts_gets_one_more_try(tmp_path, monkeypatch):
    killed_as_it_starts(monkeypatch, 1)
    assert run(small(), tmp_path / "study", Processes(1, start_method="fork")).finished


def test_workers_that_die_as_they_start_end_a_study_that_has_not_begun(tmp_path, monkeypatch):
    killed_as_it_starts(monkeypatch, 2)
    refused(
        lambda: run(small(), tmp_path / "study", Processes(1, start_method="fork")), "workers: the processes die as"
    )


def test_a_cell_whose_worker_dies_as_it_starts_fails_and_the_others_go_on(tmp_path, monkeypatch):
    study, folder = small(), tmp_path / "study"
    left = killed_as_it_starts(monkeypatch, 0)
    deadly = study.cells[1]

    def dies(problem, search, **options):
        if search.seed == deadly.seed:
            left.value = 2  # the process that is started for this cell dies, and the one after it
            os.kill(os.getpid(), signal.SIGKILL)
        return optimise(problem, search, **options)

    monkeypatch.setattr("trajevo.study.cell.optimise", dies)
    stands = run(study, folder, Processes(1, start_method="fork"))
    assert str(stands) == "4 cells: 3 finished, 1 failed"
    (failed,) = (cell for cell in stands.cells if cell.state == "failed")
    assert failed.cell.name == deadly.name
    assert failed.failure.sentence == "the process that was to run it died 2 times as it started"


def test_a_cluster_that_does_not_see_the_folder_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr("trajevo.study.cluster.STUDY_FILE", "study.other")
    folder = tmp_path / "study"
    folder.mkdir()
    (folder / "study.other").write_text("seen here")
    monkeypatch.setattr("trajevo.study.cluster._seen", _blind)
    with LocalCluster(
        n_workers=1, processes=False, protocol="tcp://", dashboard_address=":0", silence_logs=50
    ) as cluster:
        engine = DaskCluster(scheduler=cluster.scheduler_address)
        refused(lambda: run(small(), folder, engine), f"worker tcp.*: does not see the study's folder {folder}")


def _blind(folder):
    import trajevo.study.cluster

    return trajevo.study.cluster.version("trajevo"), None


def test_a_worker_that_does_not_see_the_study_says_so(tmp_path):
    refused(lambda: run_cell(small().jobs[0], str(tmp_path)), "does not see the study there; put it where all workers")


#: How a study is stopped, and the options that it runs with.
STOPS = {
    signal.SIGINT: (),
    signal.SIGTERM: ("--workers", "2", "--start-method", "fork"),
    signal.SIGKILL: ("--workers", "2"),
}


@pytest.mark.parametrize(
    "stops",
    [
        pytest.param([signal.SIGINT], id="once"),
        pytest.param([signal.SIGINT, signal.SIGKILL], marks=pytest.mark.long, id="twice"),
        pytest.param([*STOPS], marks=pytest.mark.long, id="in every way"),
    ],
)
def test_an_interrupted_study_goes_on_to_the_same_fronts(tmp_path, expected_long, stops):
    file, folder = tmp_path / "study.toml", tmp_path / "study"
    sizes = "".join(f"{name} = {size}\n" for name, size in LONG.items())
    file.write_text(
        f'problem = "pointing"\nseed = 5\nrepeats = 2\n{sizes}[fixed]\npolish = false\n'
        '[factors]\ninterpolant = ["smooth", "quintic"]\n'
    )
    script = "from trajevo.cli.main import main; main()"
    for finished, number in enumerate(stops):
        command = [sys.executable, "-c", script, "study", "run", file, "--out", folder, *STOPS[number]]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
            until(lambda finished=finished: half_way(folder, finished))
            process.send_signal(number)
            out, _ = process.communicate(timeout=60)
        if number == signal.SIGKILL:
            # Its workers end with it, so that nothing holds the cells.
            until(lambda: not study_standing(folder).count("running"))
            continue
        assert process.returncode == 128 + number
        assert f"stopped by {number.name}; next: trajevo study run {folder}" in out
        assert not study_standing(folder).count("running")
        assert not study_standing(folder).finished
    # A cell whose last generation it was when the signal came is finished, and no other one is half-way then.
    half = [one for one in study_standing(folder).cells if one.state == "stopped"]
    assert ("generation" in trajevo("study", "status", folder).stdout) == bool(half)
    assert trajevo("study", "run", folder, "--quiet").returncode == 0
    assert hash_of(small(**LONG), folder) == expected_long


def test_two_runs_of_a_study_share_its_cells(tmp_path):
    study, folder = small(**LONG), tmp_path / "study"
    context = multiprocessing.get_context("fork")
    other = context.Process(target=run, args=(study, folder))
    other.start()
    until(lambda: half_way(folder, 0))
    assert run(study, folder).finished
    other.join(30.0)
    assert other.exitcode == 0
    for cell in study.cells:
        assert json.loads((StudyFolder(folder).cell(cell.name) / "front.json").read_text())["run"]["resumed"] == []


def test_progress_tells_finished_running_waiting_and_time_left(tmp_path, capsys):
    run_study(small(), tmp_path / "study")
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 4
    assert lines[0].startswith("1/4 cells  1 running, 2 waiting, 0:0")
    assert lines[-1] == "4/4 cells  0 running, 0 waiting"


def test_bad_engines_are_refused(tmp_path, monkeypatch):
    refused(lambda: Processes(0), "workers: expected a whole number of at least 1, got 0")
    refused(
        lambda: Processes(2, start_method="thread"), "unknown start method 'thread'; known: fork, forkserver, spawn"
    )
    refused(lambda: DaskCluster(2, scheduler="tcp://127.0.0.1:1"), "the cluster behind a scheduler has workers")
    refused(lambda: DaskCluster(scheduler=8786), "scheduler: expected an address such as 'tcp://host:8786', got 8786")
    refused(lambda: run("hybrid", tmp_path), "study: expected a Study, got str")
    refused(lambda: run(small(), tmp_path, 2), "engine: expected InProcess, Processes or DaskCluster, got 2")
    monkeypatch.setattr("trajevo.study.cluster._PATIENCE", 0.2)
    nowhere = DaskCluster(scheduler="tcp://127.0.0.1:1")
    refused(lambda: run(small(), tmp_path / "study", nowhere), "scheduler: no answer from 'tcp://127.0.0.1:1'")
    monkeypatch.setitem(sys.modules, "distributed", None)
    refused(lambda: DaskCluster(2), r"needs the package distributed: pip install 'trajevo\[cluster\]'")
    assert InProcess().workers == 1


@pytest.mark.long
@pytest.mark.parametrize("engine", ["Processes(1)", "DaskCluster(1)"])
def test_a_script_that_lacks_its_guard_is_told(tmp_path, engine):
    script = tmp_path / "script.py"
    script.write_text(
        "from trajevo.study.definition import Study\nfrom trajevo.study.cluster import DaskCluster\n"
        "from trajevo.study.engines import Processes\n"
        "from trajevo.study.run import run_study\n"
        f"run_study(Study('pointing', seed=1, repeats=1), 'study', engine={engine}, progress=False)\n"
    )
    result = subprocess.run([sys.executable, script], cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert "a script that starts a study needs if __name__ == '__main__':" in result.stderr


def test_commands_refuse_what_does_not_go_together(tmp_path):
    run(small(repeats=1), tmp_path / "study")
    for arguments, says in (
        (("run", tmp_path / "study", "--out", tmp_path), "--out: a study that is gone on with stays in its folder"),
        (("run", tmp_path, "--quiet"), "holds no study: it has no study.json"),
        (("run", tmp_path / "study", "--dask", "--start-method", "fork"), "--start-method: Dask starts its workers"),
        (("run", tmp_path / "study", "--dask", "--scheduler", "tcp://a:1"), "--dask: makes a cluster of its own"),
        (("status", tmp_path), "holds no study"),
        (("collect", tmp_path), "holds no study"),
    ):
        result = CliRunner().invoke(app, [str(argument) for argument in arguments])
        assert isinstance(result.exception, TrajevoError)
        assert says in str(result.exception)


def test_algorithms_are_levels(tmp_path):
    study = small(repeats=1, factors={"algorithm": ["nsga2", "sms-emoa", "rvea", "u-nsga3"]})
    assert run(study, tmp_path / "study").finished
    found = [front.run.algorithm for front in fronts(study, tmp_path / "study")]
    assert found == ["NSGA2", "SMSEMOA", "RVEA", "UNSGA3"]


@pytest.mark.skipif(find_spec("numba") is None, reason="only one kind of kernel without numba")
@pytest.mark.parametrize("start_method", mostly_long(["fork", "spawn"], "fork"))
def test_all_cells_use_one_kind_of_kernel_whatever_gets_ready(tmp_path, monkeypatch, start_method):
    monkeypatch.setenv(jit.CHOICE, "numpy")
    study = small(repeats=1)
    run(study, tmp_path)
    monkeypatch.setenv(jit.CHOICE, "compiled")
    longer = small(repeats=2)
    run(longer, tmp_path, Processes(1, start_method=start_method))
    assert [front.run.kernels for front in fronts(longer, tmp_path)] == ["numpy"] * 4
