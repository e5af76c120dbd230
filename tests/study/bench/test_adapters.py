"""Adapters against what is asked of them: short, within bounds, repeatable, told where they cannot be used."""

import importlib
import inspect

import numpy as np
import pytest

from tests.study.bench.small import small_suite
from trajevo.errors import InvalidInputError, UnknownNameError
from trajevo.study.bench import run as runs
from trajevo.study.bench.adapters.adapter import BenchRival, adapter, adapters
from trajevo.study.bench.contest import Contest
from trajevo.study.bench.run import run_rival
from trajevo.study.bench.suite import benchmark

RIVALS = adapters()
#: Those that are set on problems through points, where they are installed.
THROUGH_POINTS = [
    name for name, one in RIVALS.items() if one.installed and name not in ("copp", "drake", "pinocchio", "toppra")
]
#: Packages that solve along fixed paths, where they are installed.
ALONG_PATHS = [name for name in ("copp", "drake", "toppra") if RIVALS[name].installed]


@pytest.fixture(scope="module")
def suite(tmp_path_factory):
    return small_suite(tmp_path_factory.mktemp("suite"))


def tried(suite, rival, seed, *, problem="front", evaluations=110):
    """What a rival tries until so many rows are evaluated, without any limit of time."""
    contest = Contest(benchmark(problem, suite), seed=seed, budget=60.0, most=evaluations)
    runs._solved(adapter(rival), contest)
    return contest


def test_the_rivals_that_were_asked_for_are_there():
    wanted = {"trajevo", "pymoo-elementwise", "pymoo-batched", "pygmo", "scipy-slsqp", "casadi-ipopt", "toppra", "copp"}
    assert wanted <= set(RIVALS)
    assert next(iter(RIVALS)) == "trajevo"


@pytest.mark.parametrize("name", RIVALS)
def test_an_adapter_is_one_file_of_less_than_eighty_lines(name):
    module = importlib.import_module(type(RIVALS[name]).__module__)
    assert len(inspect.getsource(module).splitlines()) < 80
    assert len([kind for kind in vars(module).values() if inspect.isclass(kind) and issubclass(kind, BenchRival)]) == 2


@pytest.mark.parametrize("name", RIVALS)
def test_an_adapter_says_in_one_sentence_how_it_is_set_on_a_problem(name):
    one = RIVALS[name]
    assert one.name == name
    assert one.says.strip() == one.says
    assert len(one.says.splitlines()) == 1
    assert one.says[-1] not in ".:"
    assert one.distribution


@pytest.mark.parametrize("name", THROUGH_POINTS)
def test_what_is_tried_is_within_bounds_and_the_same_for_the_same_seed(suite, name):
    first, again, other = (tried(suite, name, seed) for seed in (1, 1, 2))
    rows = [np.concatenate([one.X for one in contest.tried]) for contest in (first, again, other)]
    assert len(rows[0]) > 0
    assert (rows[0] >= first.lower).all()
    assert (rows[0] <= first.upper).all()
    np.testing.assert_array_equal(rows[0], rows[1])
    assert rows[0].shape != rows[2].shape or not np.array_equal(rows[0], rows[2])


@pytest.mark.parametrize("name", THROUGH_POINTS)
def test_evaluations_and_times_grow(suite, name):
    contest = tried(suite, name, 1, problem="least")
    counts, times = ([getattr(one, key) for one in contest.tried] for key in ("evaluations", "cpu"))
    assert counts == sorted(counts)
    assert times == sorted(times)
    assert 0 < counts[-1] <= contest.evaluations


@pytest.mark.parametrize("name", ALONG_PATHS)
def test_solvers_along_paths_find_nearly_the_same_least_time(name):
    found = run_rival("puma_path_jerk_free", name, seed=1, budget=20.0)
    assert found.end == "scored"
    assert found.share == pytest.approx(1.0, abs=5e-3)
    assert found.X == ()
    assert found.values.shape == (1, 1)


@pytest.mark.parametrize("name", ["copp", "drake", "toppra"])
def test_solvers_along_paths_refuse_everything_else(suite, name):
    contest = Contest(benchmark("least", suite), seed=1, budget=1.0)
    assert RIVALS[name].refuses(contest) == "the problem is no fixed path"
    if name != "copp":
        with_jerk = Contest(benchmark("puma_path"), seed=1, budget=1.0)
        assert RIVALS[name].refuses(with_jerk) == "it limits no jerk, the problem does"


def test_a_rival_that_is_not_installed_is_a_row_that_says_how_to_install_it(suite, monkeypatch):
    monkeypatch.setattr(type(RIVALS["pygmo"]), "module", "no_such_module")
    found = run_rival("least", "pygmo", seed=1, budget=1.0, suite=str(suite))
    assert found.end == "not installed"
    assert found.said == "not installed: pip install 'trajevo[bench]'"
    assert found.F == ()


def test_a_rival_that_needs_a_plain_statement_says_why_there_is_none():
    found = run_rival("puma_path", "scipy-slsqp", seed=1, budget=1.0)
    assert found.end == "not stated"
    assert "no plain statement" in found.said


def test_unknown_rivals_and_what_is_no_rival_are_refused():
    with pytest.raises(UnknownNameError, match="unknown rival 'pygmoo'; known: casadi-ipopt, .*did you mean 'pygmo'"):
        adapter("pygmoo")
    with pytest.raises(InvalidInputError, match="rival: math:sqrt: expected a class of"):
        adapter("math:sqrt")
