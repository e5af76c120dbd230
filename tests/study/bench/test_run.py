"""Runs of a benchmark: what is kept, what is made again, what stands in results, and what bad input is told."""

import json
import os
import shutil
import signal

import numpy as np
import pytest

from tests.helpers import trajevo
from tests.study.bench.small import small_suite
from trajevo.errors import InvalidInputError, UnknownNameError
from trajevo.study.bench.pictures import attainment_of_rivals, convergence, course, write_pictures
from trajevo.study.bench.record import BenchResults
from trajevo.study.bench.run import run_benchmark, run_rival
from trajevo.study.bench.suite import benchmark
from trajevo.study.bench.update import update_references

FEW, FAILING, ENDLESS = (f"tests.study.bench.rivals:{name}" for name in ("Few", "Failing", "Endless"))


@pytest.fixture(scope="module")
def suite(tmp_path_factory):
    return small_suite(tmp_path_factory.mktemp("suite"))


@pytest.fixture(scope="module")
def ran(suite, tmp_path_factory):
    """A folder with runs of two rivals on two problems, two seeds each."""
    folder = tmp_path_factory.mktemp("bench")
    given = {"rivals": ["trajevo", FEW], "seeds": 2, "budget": 5.0, "suite": suite}
    return folder, given, run_benchmark(folder, **given)


def test_every_run_is_kept_and_scored(ran):
    folder, _, stands = ran
    assert (stands.made, stands.left, stands.stopped_by) == (8, 0, "")
    assert len(list((folder / "runs").glob("*.json"))) == 8
    assert stands.results == BenchResults.load(folder) == BenchResults.load(folder / "results.json")
    for run in stands.results.runs:
        assert run.end == "scored"
        assert run.share > 0.0
        assert run.cpu < 5.0
        assert run.violation <= 1e-6
        assert run.versions["trajevo"]
        assert run.machine.cores >= 1
        assert len(run.X) == len(run.F) >= 1


def test_objectives_on_record_are_those_of_the_decision_vectors(ran, suite):
    for run in ran[2].results.runs:
        problem = benchmark(run.problem, suite).problem()
        np.testing.assert_array_equal(problem.evaluate(np.array(run.X), return_values_of=["F"]), run.values)


def test_what_is_made_is_not_made_again(ran):
    folder, given, stands = ran
    again = run_benchmark(folder, **given)
    assert (again.made, again.results) == (0, stands.results)
    assert run_benchmark(folder, **given | {"rivals": [FEW], "seeds": 3}).made == 2
    assert run_benchmark(folder, **given | {"rivals": [FEW], "budget": 6.0, "seeds": 1}).made == 2


def test_a_stopped_benchmark_keeps_its_runs_and_goes_on(suite, tmp_path):
    given = {"rivals": [FEW], "seeds": 2, "budget": 5.0, "suite": suite}
    first = run_benchmark(tmp_path, **given, tell=lambda outcome: os.kill(os.getpid(), signal.SIGINT))
    assert (first.made, first.left, first.stopped_by) == (1, 3, "SIGINT")
    assert len(BenchResults.load(tmp_path).runs) == 1
    assert run_benchmark(tmp_path, **given).made == 3


def test_a_rival_that_fails_is_a_row_that_says_why(suite):
    run = run_rival("least", FAILING, seed=1, budget=1.0, suite=str(suite))
    assert run.end == "failed"
    assert run.said.startswith("failed: ZeroDivisionError: no luck at all, ")
    assert run.F == ()


def test_a_rival_that_never_ends_is_ended(suite):
    run = run_rival("least", ENDLESS, seed=1, budget=0.2, suite=str(suite))
    assert run.end == "scored"
    assert 0.2 <= run.cpu < 0.4
    assert run.history[-1].cpu <= 0.2
    assert run.evaluations > 1


def test_better_members_are_written_once(ran, suite, tmp_path):
    own = tmp_path / "suite"
    shutil.copytree(suite, own)
    file = own / "front" / "reference.json"
    told = json.loads(file.read_text())
    file.write_text(json.dumps(told | {"variables": told["variables"][:1], "values": told["values"][:1]}))
    (better,) = [one for one in update_references(ran[2].results, own) if one.problem == "front"]
    assert better.before == 1 < better.now
    assert update_references(ran[2].results, own) == ()
    assert "trajevo bench run: trajevo" in benchmark("front", own).told.found_by


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ("{", "holds no results of trajevo bench: "),
        ('{"format": "trajevo front", "version": 1, "runs": []}', "holds no results of trajevo bench: format: "),
        ('{"version": 1, "runs": [{"problem": "front"}]}', "holds no results of trajevo bench: runs.0.rival: "),
    ],
)
def test_damaged_results_are_refused_in_one_sentence(tmp_path, content, told):
    file = tmp_path / "results.json"
    file.write_text(content)
    with pytest.raises(InvalidInputError, match=told) as caught:
        BenchResults.load(file)
    assert str(caught.value).startswith(f"{file}: ")
    assert "\n" not in str(caught.value)


def test_a_damaged_run_is_named(ran, tmp_path):
    shutil.copytree(ran[0], tmp_path, dirs_exist_ok=True)
    torn = next((tmp_path / "runs").glob("*.json"))
    torn.write_bytes(torn.read_bytes()[:100])
    with pytest.raises(InvalidInputError, match="holds no results of trajevo bench") as caught:
        run_benchmark(tmp_path, **ran[1])
    assert str(torn) in str(caught.value)


@pytest.mark.parametrize(
    ("given", "error", "told"),
    [
        ({"problems": ["lin1938"]}, UnknownNameError, "unknown benchmark 'lin1938'; .*did you mean 'lin1983'"),
        ({"rivals": ["toppa"]}, UnknownNameError, "unknown rival 'toppa'; known: .*did you mean 'toppra'"),
        ({"seeds": 0}, InvalidInputError, "seeds: expected a whole number of at least 1, got 0"),
        ({"seeds": True}, InvalidInputError, "seeds: expected a whole number of at least 1, got True"),
        ({"budget": float("inf")}, InvalidInputError, "budget: expected a positive CPU time \\[s\\], got inf"),
        ({"suite": "/nowhere"}, InvalidInputError, "suite: /nowhere: expected a folder with problems"),
    ],
)
def test_what_cannot_be_run_is_refused(tmp_path, given, error, told):
    with pytest.raises(error, match=told):
        run_benchmark(tmp_path, **given)
    assert list(tmp_path.iterdir()) == []


def test_pictures_are_of_the_runs(ran, tmp_path):
    results = ran[2].results
    axes = convergence(results, "front")
    assert [line.get_label() for line in axes.get_lines() if not line.get_label().startswith("_")] == ["trajevo", FEW]
    last = next(run for run in results.runs if run.problem == "front")
    assert course(last, np.array([0.0, 1e9])).tolist() == [0.0, last.history[-1].share]
    assert attainment_of_rivals(results, "front").get_xlabel() == "time [s]"
    with pytest.raises(InvalidInputError, match="attainment: least has one objective"):
        attainment_of_rivals(results, "least")
    with pytest.raises(UnknownNameError, match="unknown problem 'fronts'; known: front, least"):
        convergence(results, "fronts")
    files, notes = write_pictures(results, tmp_path)
    assert {file.name for file in files} == {"convergence_front.png", "attainment_front.png", "convergence_least.png"}
    assert notes == ()


def test_the_commands_say_what_they_did_and_what_to_do_next(suite, tmp_path):
    given = ("--suite", suite, "--problem", "least", "--rival", FEW, "--seeds", 1, "--budget", 5)
    made = trajevo("bench", "run", *given, "--out", tmp_path / "one", "--update")
    assert made.returncode == 0
    assert f"least,{FEW.replace(':', '-')},seed=1: " in made.stderr
    assert "next: trajevo bench table" in made.stdout
    shown = trajevo("bench", "table", tmp_path / "one", "--out", tmp_path / "table")
    assert {"table.csv", "table.md", "pictures"} == {file.name for file in (tmp_path / "table").iterdir()}
    assert "1 seeds, 5 s of CPU time a run" in shown.stdout
    same = trajevo("bench", "compare", tmp_path / "one", tmp_path / "one" / "results.json")
    assert same.stdout.strip() == "3 measures: 3 within the quartiles"


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ("run --size huge", "unknown size 'huge'; known: full, small"),
        ("run --problem nope", "unknown benchmark 'nope'; known: "),
        ("run --seeds 0", "seeds: expected a whole number of at least 1, got 0"),
        ("table nowhere.json", "nowhere.json: no such file"),
        ("compare here there", "here: no such file"),
        ("start", "unknown command 'start'; known: compare, run, table"),
    ],
)
def test_mistakes_get_one_sentence(arguments, told, tmp_path):
    done = trajevo("bench", *arguments.split(), cwd=tmp_path)
    assert done.returncode == 2
    assert told in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []
