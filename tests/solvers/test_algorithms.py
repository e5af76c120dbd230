"""Algorithms by name: all run on a problem of ours, repeat themselves, and refuse what they do not have."""

import importlib
import math

import numpy as np
import pytest

from tests.helpers import UNDRAWN, refused, small_problem, trajevo
from trajevo import load_problem, load_task, optimise
from trajevo.formulation.search import Search
from trajevo.front.front import Front
from trajevo.solvers.evolutionary.algorithms import ALGORITHMS, algorithm_for, reference_directions
from trajevo.solvers.evolutionary.kinds import class_of

DIRECTED = ("nsga3", "rvea", "u-nsga3")


@pytest.fixture(scope="module")
def hybrid():
    return load_problem("hybrid")


def solved(problem, name) -> Front:
    search = Search(seed=1, algorithm=name, generations=4, population=40, offsprings=40, starts="random", polish=False)
    return optimise(problem, search, progress=False)


@pytest.mark.thinned(3)
@pytest.mark.parametrize("name", ALGORITHMS)
def test_every_algorithm_solves_and_repeats_itself(hybrid, name):
    front, again = solved(hybrid, name), solved(hybrid, name)
    assert len(front) > 0
    assert front.run.evaluations == 4 * (35 if name == "moea/d" else 40)
    assert front.X.tobytes() == again.X.tobytes()
    assert front.F.tobytes() == again.F.tobytes()
    F, G = hybrid.evaluate(front.X)
    assert F.tobytes() == front.F.tobytes()
    assert (G <= 0.0).all()


def test_what_numba_compiles_for_age_moea_2_is_kept():
    """Else every process would compile it anew, for several seconds."""
    pytest.importorskip("numba")
    survival = class_of("AGEMOEA2")(pop_size=4).survival
    module = importlib.import_module("pymoo.algorithms.moo.age")
    for loop in (module.find_corner_solutions, module.point_2_line_distance, survival.pairwise_distances):
        assert loop.stats.cache_path


@pytest.mark.parametrize(
    ("objectives", "most", "expected"), [(2, 100, 100), (3, 100, 91), (4, 100, 84), (3, 150, 136), (3, 3, 3), (4, 9, 4)]
)
def test_as_many_directions_as_the_population_allows(objectives, most, expected):
    directions = reference_directions(objectives, most)
    assert directions.shape == (expected, objectives)
    np.testing.assert_allclose(directions.sum(axis=1), 1.0)
    assert (directions >= 0.0).all()
    assert len(np.unique(directions.round(9), axis=0)) == expected
    finer = next(p for p in range(1, 500) if math.comb(p + objectives - 1, objectives - 1) > expected)
    assert math.comb(finer + objectives - 1, objectives - 1) > most


@pytest.mark.parametrize("name", DIRECTED)
def test_the_population_stays_what_was_asked_for(hybrid, name):
    solver = algorithm_for(Search(algorithm=name, population=100), hybrid).solver
    assert (solver.pop_size, solver.n_offsprings, len(solver.ref_dirs)) == (100, 100, 84)
    usual = algorithm_for(Search(algorithm=name, offsprings=7), hybrid).solver
    assert (usual.pop_size, usual.n_offsprings) == (hybrid.evolution.population, 7)


def test_what_an_algorithm_does_not_have_is_refused(hybrid):
    cost = load_problem("hybrid", objectives="cost")
    for name in DIRECTED:
        own = Search(algorithm=name)
        refused(lambda own=own: algorithm_for(own, cost), f"algorithm: '{name}' .* at least two objectives, got one")
        wide = own.updated(crossover_index=3.0)
        refused(lambda wide=wide: algorithm_for(wide, hybrid), f"crossover_index: .*'{name}'")
    refused(lambda: reference_directions(4, 3), "population: expected at least 4, one per objective, got 3")
    refused(
        lambda: algorithm_for(Search(algorithm="moead"), hybrid),
        "unknown algorithm 'moead'; known: age-moea2, moea/d, nsga2, nsga3, rvea",
    )


def test_two_objectives_have_a_direction_for_every_individual():
    solver = algorithm_for(Search(algorithm="rvea", population=12), small_problem()).solver
    assert solver.ref_dirs.shape == (12, 2)


def test_a_task_names_its_algorithm(tmp_path):
    trajevo("init", tmp_path / "task.toml")
    text = (tmp_path / "task.toml").read_text(encoding="utf-8")
    assert 'name = "nsga2"' in text
    assert all(name in text for name in ALGORITHMS)
    (tmp_path / "task.toml").write_text(text.replace('name = "nsga2"', 'name = "u-nsga3"'), encoding="utf-8")
    front = load_task(tmp_path / "task.toml").solve(generations=2, population=12, polish=False, progress=False)
    assert front.run.algorithm == "UNSGA3"


def test_the_command_line_names_its_algorithm(tmp_path):
    options = ["--algorithm", "rvea", "--generations", "2", "--population", "20", "--no-polish", "--quiet"]
    options += ["--out", tmp_path / "run"]
    done = trajevo("solve", "hybrid", *options, *UNDRAWN)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    front = Front.load(tmp_path / "run" / "front.json")
    assert front.run.algorithm == "RVEA"
    assert front.run.settings["population"] == 20
    help_text = trajevo("solve", "--help").stdout
    assert all(name in help_text for name in ALGORITHMS)
    alone = trajevo("solve", "hybrid", "--set", "objectives=cost", *options[:2], "--out", tmp_path / "cost")
    assert alone.returncode == 2
    assert "algorithm: 'rvea' uses reference directions between at least two objectives, got one" in alone.stderr
