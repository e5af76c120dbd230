"""Runs in folders: killed, resumed, read, damaged."""

import json
import re
import signal
import subprocess
import sys
import time
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.operators.crossover.ux import UX
from pymoo.operators.survival.rank_and_crowding import RankAndCrowding

from tests.helpers import mostly_long, refused, small_problem, trajevo
from tests.killed import ALGORITHMS, OBJECTIVES, begin, killed_and_resumed
from trajevo import Front, load_problem, load_task, optimise
from trajevo.base import jit
from trajevo.problems import PointingMechanism
from trajevo.solvers.run import evolution
from trajevo.solvers.run.folder import RunFolder
from trajevo.solvers.run.runs import read_run, resume, standing

SMALL = {"generations": 12, "population": 20, "progress": False}


def same(one: Front, other: Front) -> bool:
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in "XFG")


@pytest.mark.parametrize("number", mostly_long(range(20), 0, 3))
def test_a_run_killed_at_random_instants_ends_as_if_it_had_not_been(number, tmp_path):
    problem = list(OBJECTIVES)[number % len(OBJECTIVES)]
    chance = np.random.default_rng(number)
    assert killed_and_resumed(problem, ALGORITHMS[number % len(ALGORITHMS)], 12, tmp_path / "run", chance) >= 1


@pytest.mark.long
def test_two_hundred_runs_killed_at_random_instants_end_as_if_they_had_not_been(tmp_path):
    chance = np.random.default_rng(200)
    for number in range(200):
        problem = list(OBJECTIVES)[number % len(OBJECTIVES)]
        name = ALGORITHMS[(number // len(OBJECTIVES)) % len(ALGORITHMS)]
        assert killed_and_resumed(problem, name, 20, tmp_path / str(number), chance) >= 1


@pytest.mark.long
def test_five_hundred_generations_of_five_hundred_stay_below_400_mb(tmp_path):
    script = (
        "from pathlib import Path\n"
        "from trajevo.problems import HybridManipulator\n"
        "from trajevo import optimise\n"
        f"out = {str(tmp_path / 'run')!r}\n"
        "optimise(HybridManipulator(), seed=1, generations=500, population=500, progress=False, out=out)\n"
        # Not getrusage's, which starts with what the test's own process has.
        "print(Path('/proc/self/status').read_text().split('VmHWM:')[1].split()[0])\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert int(done.stdout) < 400 * 1024
    assert sum(len(block.X) for block in RunFolder(tmp_path / "run").blocks(500)) == 250_000


@pytest.mark.parametrize("name", mostly_long(ALGORITHMS, *ALGORITHMS[::3]))
@pytest.mark.parametrize("generation", mostly_long([1, 2, 7], 2))
def test_every_adapter_goes_on_to_the_bit_from_any_generation(name, generation, tmp_path, stopped_after):
    expected = begin("hybrid", name, 10, 5, None)
    stopped_after(generation)
    first = begin("hybrid", name, 10, 5, tmp_path / "run")
    assert (first.run.interrupted, first.run.generations) == (True, generation)
    assert standing(tmp_path / "run").generation == generation
    stopped_after(None)
    last = resume(tmp_path / "run", progress=False)
    assert same(last, expected)
    assert last.history == expected.history
    assert last.run.resumed == (generation,)
    assert not last.run.interrupted


@pytest.mark.skipif(find_spec("numba") is None, reason="only one kind of kernel without numba")
@pytest.mark.parametrize("kind", ["compiled", "numpy"])
def test_a_run_keeps_the_kind_of_kernel_with_which_it_was_begun(kind, tmp_path, stopped_after, monkeypatch):
    expected = {}
    for one in ("compiled", "numpy"):
        monkeypatch.setenv(jit.CHOICE, one)
        expected[one] = begin("hybrid", "NSGA2", 10, 5, None)
        assert expected[one].run.kernels == one
    assert not same(expected["compiled"], expected["numpy"])
    monkeypatch.setenv(jit.CHOICE, kind)
    stopped_after(4)
    begin("hybrid", "NSGA2", 10, 5, tmp_path / "run")
    assert RunFolder(tmp_path / "run").manifest().kernels == read_run(tmp_path / "run").run.kernels == kind
    stopped_after(None)
    monkeypatch.setenv(jit.CHOICE, "numpy" if kind == "compiled" else "compiled")
    last = resume(tmp_path / "run", progress=False)
    assert same(last, expected[kind])
    assert last.run.kernels == Front.load(tmp_path / "run" / "front.json").run.kernels == kind


def test_a_run_begun_with_compiled_loops_needs_them(tmp_path, stopped_after, monkeypatch):
    stopped_after(2)
    begin("pointing", "NSGA2", 4, 5, tmp_path / "run")
    stopped_after(None)
    file = tmp_path / "run" / "manifest.json"
    manifest = json.loads(file.read_text())
    file.write_text(json.dumps(manifest | {"kernels": "compiled"}))
    monkeypatch.setattr(jit, "_installed", lambda: False)
    refused(lambda: resume(tmp_path / "run", progress=False), "kernels: expected 'numpy', got 'compiled'")
    del manifest["kernels"]  # as older versions wrote it
    file.write_text(json.dumps(manifest))
    assert resume(tmp_path / "run", progress=False).run.kernels is None


def test_a_resumed_run_leaves_nothing_behind_in_the_process(tmp_path):
    expected = begin("pointing", "SPEA2", 4, 2, None)
    begin("hybrid", "SPEA2", 4, 1, tmp_path / "run")
    resume(tmp_path / "run", generations=6, progress=False)
    assert same(begin("pointing", "SPEA2", 4, 2, None), expected)


def test_a_folder_changes_nothing_of_a_run_and_keeps_every_individual(tmp_path):
    problem = PointingMechanism()
    assert same(
        optimise(problem, seed=2, out=tmp_path / "run", **SMALL, polish=False),
        optimise(PointingMechanism(), seed=2, **SMALL, polish=False),
    )
    blocks = list(RunFolder(tmp_path / "run").blocks(12))
    assert sum(len(block.X) for block in blocks) == 12 * 20
    generation = np.concatenate([block.generation for block in blocks])
    np.testing.assert_array_equal(generation, np.repeat(np.arange(1, 13), 20))
    F, G = problem.evaluate(np.concatenate([block.X for block in blocks]), return_values_of=["F", "G"])
    np.testing.assert_array_equal(F, np.concatenate([block.F for block in blocks]))
    np.testing.assert_array_equal(G, np.concatenate([block.G for block in blocks]))


def test_a_finished_run_can_be_made_longer(tmp_path):
    optimise(PointingMechanism(), seed=2, out=tmp_path / "run", **SMALL, polish=False)
    longer = resume(tmp_path / "run", generations=20, progress=False)
    assert same(longer, optimise(PointingMechanism(), seed=2, **SMALL | {"generations": 20}, polish=False))
    assert longer.run.settings["generations"] == 20
    refused(lambda: resume(tmp_path / "run", generations=19), "generations: expected at least the 20 that were planned")
    begin("pointing", "RVEA", 6, 1, tmp_path / "rvea")
    refused(lambda: resume(tmp_path / "rvea", generations=7), "RVEA adapts to the planned number, 6, from the first")


def test_a_finished_run_is_resumed_without_a_generation_more(tmp_path):
    front = optimise(PointingMechanism(), seed=2, out=tmp_path / "run", **SMALL, polish=False)
    (tmp_path / "run" / "front.json").unlink()
    again = resume(tmp_path / "run", progress=False)
    assert same(again, front)
    assert again.run.resumed == ()
    assert standing(tmp_path / "run").finished


@pytest.mark.parametrize(
    "make",
    [
        lambda: load_problem("reparam", path="s", encoding="shape"),
        lambda: load_task("problems/tasks/xarm7_obstacle.toml").problem,
    ],
)
def test_curves_of_solutions_and_tasks_are_resumed_too(make, tmp_path, stopped_after):
    size = {"seed": 1, "generations": 6, "population": 16, "progress": False}
    expected = optimise(make(), **size, polish=False)
    stopped_after(3)
    optimise(make(), out=tmp_path / "run", **size, polish=False)
    stopped_after(None)
    last = resume(tmp_path / "run", progress=False)
    assert same(last, expected)
    assert last.record == expected.record


def test_points_to_begin_with_are_kept(tmp_path, stopped_after):
    first = optimise(PointingMechanism(), seed=1, **SMALL, polish=False)
    expected = optimise(PointingMechanism(), seed=2, initial=first.X[:10], **SMALL, polish=False)
    stopped_after(1)
    optimise(PointingMechanism(), seed=2, initial=first.X[:10], out=tmp_path / "run", **SMALL, polish=False)
    stopped_after(None)
    assert same(resume(tmp_path / "run", progress=False), expected)


def test_a_problem_by_hand_is_passed_again_and_must_be_the_same(tmp_path, stopped_after):
    stopped_after(3)
    optimise(small_problem(), seed=1, out=tmp_path / "run", **SMALL, polish=False)
    stopped_after(None)
    refused(
        lambda: resume(tmp_path / "run"),
        "its problem 'trajectory problem' is not a registered one; pass it as problem=",
    )
    other = small_problem(constraints=())
    refused(lambda: resume(tmp_path / "run", problem=other), "the problem at hand differs")
    last = resume(tmp_path / "run", problem=small_problem(), progress=False)
    assert same(last, optimise(small_problem(), seed=1, **SMALL, polish=False))


def test_an_algorithm_without_an_adapter_says_so_and_its_individuals_are_kept(tmp_path, monkeypatch):
    monkeypatch.setattr(evolution, "_FIRST_DUE", 0.0)
    monkeypatch.setattr(evolution, "_SHARE", 1e9)
    with pytest.warns(UserWarning, match="this run cannot be resumed: UX is an operator that a run folder cannot"):
        front = optimise(
            PointingMechanism(),
            seed=1,
            generations=4,
            algorithm=NSGA2(20, crossover=UX()),
            out=tmp_path / "run",
            progress=False,
            polish=False,
        )
    refused(lambda: resume(tmp_path / "run"), "the run cannot be resumed: UX is an operator")
    (tmp_path / "run" / "front.json").unlink()
    assert same(read_run(tmp_path / "run"), front)
    own = NSGA2(20, survival=RankAndCrowding(crowding_func="ce"))
    with pytest.warns(UserWarning, match="NSGA2.survival.* is set to something that a run folder cannot store"):
        optimise(
            PointingMechanism(),
            seed=1,
            generations=2,
            algorithm=own,
            out=tmp_path / "own",
            progress=False,
            polish=False,
        )


def test_other_versions_are_told(tmp_path):
    optimise(PointingMechanism(), seed=2, out=tmp_path / "run", **SMALL, polish=False)
    file = tmp_path / "run" / "manifest.json"
    manifest = json.loads(file.read_text())
    manifest["versions"]["numpy"] = "1.0"
    manifest["versions"].pop("numba", None)
    manifest["versions"]["gone"] = "2.0"
    file.write_text(json.dumps(manifest))
    numba = f", numba none -> {version('numba')}" if find_spec("numba") else ""
    says = f"other versions (numpy 1.0 -> {np.__version__}, gone 2.0 -> none{numba})"
    with pytest.warns(UserWarning, match=re.escape(says)):
        resume(tmp_path / "run", progress=False)


def _popen(*arguments):
    command = [sys.executable, "-c", "from trajevo.cli.main import main; main()", *map(str, arguments)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def _wait_for(condition, process):
    while not condition():
        assert process.poll() is None
        time.sleep(0.01)


@pytest.mark.parametrize("number", mostly_long([signal.SIGKILL, signal.SIGTERM, signal.SIGINT], signal.SIGINT))
def test_the_command_line_resumes_what_was_stopped(number, tmp_path):
    run = tmp_path / "run"
    # One of the three is polished too.
    polish = number == signal.SIGKILL
    population = 40 if polish else 24
    size = ["--generations", "150", "--population", str(population), "--seed", "3", "--quiet"]
    size += [] if polish else ["--no-polish"]
    problem = "hybrid" if polish else "pointing"
    solving = _popen("solve", problem, *size, "--out", run)
    _wait_for(lambda: (run / "checkpoint.npz").exists(), solving)
    solving.send_signal(number)
    said, complained = solving.communicate()
    assert solving.returncode == (-number if number == signal.SIGKILL else 128 + number), complained
    if number != signal.SIGKILL:
        assert f"interrupted by {signal.Signals(number).name}; next: trajevo resume {run}" in said
    else:
        shown = trajevo("show", run)
        assert shown.returncode == 0, shown.stderr
        assert "(interrupted" in shown.stdout
        again = trajevo("solve", problem, "--out", run)
        assert again.returncode == 2
        assert f"or go on with it: trajevo resume {run}" in again.stderr
    assert not (run / "report.html").exists()
    resumed = trajevo("resume", run, "--quiet", "--no-pictures")
    assert resumed.returncode == 0, resumed.stderr
    assert (run / "report.html").exists()
    settings = {"seed": 3, "generations": 150, "population": population, "polish": polish, "progress": False}
    whole = optimise(read_run(run).problem, **settings)
    assert same(Front.load(run / "front.json"), whole)


@pytest.mark.long
def test_what_the_docs_show_runs(tmp_path):
    docs = (Path(__file__).parents[2] / "docs/how_to/runs.md").read_text()
    script = "\n".join(re.findall(r"```python\n(.*?)```", docs, re.DOTALL))
    result = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    assert result.stdout.splitlines()[0].endswith("(40,)")
    assert "keeps every limit at every instant" in result.stdout
    assert (tmp_path / "report.html").stat().st_size > 1e5
