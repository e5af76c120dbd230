"""Crossover, mutation, crowding and copies on arrays against pymoo's own, to the bit, whatever the numbers are."""

from types import SimpleNamespace

import numpy as np
import pytest
from pymoo.operators.crossover.sbx import SBX
from pymoo.operators.crossover.ux import UX
from pymoo.operators.mutation.pm import PM
from pymoo.operators.survival.rank_and_crowding.metrics import calc_crowding_distance
from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting
from scipy.spatial.distance import cdist

from trajevo.solvers.evolutionary.nsga2_ranking import copies, crowding_distances, fronts
from trajevo.solvers.evolutionary.operators import crossed, mutated


def bits(one, other):
    """Equal values, and signs of zeros too."""
    assert one.shape == other.shape
    assert one.dtype == other.dtype
    assert np.ascontiguousarray(one).tobytes() == np.ascontiguousarray(other).tobytes()


def parents_of(problem, matings, random, kind):
    """Parents that share values, lie on bounds or outside of them."""
    n_var = problem.n_var
    parents = problem.xl + (problem.xu - problem.xl) * random.random((2, matings, n_var))
    shared = random.random((matings, n_var)) < 0.4
    parents[1][shared] = parents[0][shared] + random.choice([0.0, 1e-15, 1e-13])
    if kind == "outside":
        return parents + random.normal(0.0, 0.2, parents.shape)
    parents += np.where(random.random(parents.shape) < 0.1, problem.xu - problem.xl, 0.0)
    return np.minimum(parents, problem.xu)


def problem_of(random):
    n_var = int(random.integers(1, 15))
    low = np.where(random.random(n_var) < 0.2, 0.0, random.normal(size=n_var))
    return SimpleNamespace(xl=low, xu=low + random.random(n_var) * (random.random(n_var) < 0.9), n_var=n_var)


OPERATORS = {
    "pymoo's settings": (SBX(), PM()),
    "paper": (SBX(prob=0.9, eta=10), PM(prob=1.0, prob_var=0.1, eta=100)),
    "squares and roots": (SBX(prob=1.0, eta=1, prob_var=1.0), PM(eta=1, prob_var=0.9)),
    "fractions": (SBX(prob=0.5, eta=2.5, prob_exch=0.5, prob_bin=0.3), PM(prob=0.3, eta=3.7)),
    "nothing": (SBX(prob=0.0), PM(prob=0.0)),
    "other operators": (UX(), PM(at_least_once=True)),
}


@pytest.mark.thinned(5)
@pytest.mark.filterwarnings("ignore::RuntimeWarning:pymoo")
@pytest.mark.parametrize("name", OPERATORS)
@pytest.mark.parametrize("kind", ["inside", "outside"])
def test_children_are_pymoo_s(name, kind):
    crossover, mutation = OPERATORS[name]
    random = np.random.default_rng(7)
    for seed in range(150):
        problem = problem_of(random)
        parents = parents_of(problem, int(random.integers(1, 60)), random, kind)
        theirs, ours = np.random.default_rng(seed), np.random.default_rng(seed)
        expected = parents.copy()
        chosen = theirs.random(parents.shape[1]) < crossover.prob.value
        if chosen.any():
            expected[:, chosen] = crossover._do(problem, parents, random_state=theirs)[:, chosen]
        before = parents.copy()
        found = crossed(crossover, problem, parents, ours)
        bits(found, expected)
        bits(parents, before)
        X = expected.reshape(-1, problem.n_var)
        changed = mutation._do(problem, X, random_state=theirs)
        chosen = theirs.random(len(X)) <= mutation.prob.value
        bits(mutated(mutation, problem, X, ours), np.where(chosen[:, None], changed, X))
        assert theirs.bit_generator.state == ours.bit_generator.state


@pytest.mark.filterwarnings("ignore::RuntimeWarning:pymoo")
def test_crowding_is_pymoo_s():
    random = np.random.default_rng(3)
    for case in range(400):
        F = random.normal(size=(int(random.integers(3, 150)), int(random.integers(1, 14))))
        if case % 3 == 0:
            F = np.round(F, 1)
        if case % 4 == 0:
            F[:, 0] = 1.0
        if case % 5 == 0:
            F[random.random(F.shape) < 0.05] = random.choice([np.inf, -np.inf, np.nan])
        bits(crowding_distances(F), calc_crowding_distance(F))


def test_fronts_are_pymoo_s():
    random = np.random.default_rng(4)
    for most in (1, 20, 50, 1000):
        F = np.round(random.random((60, 3)), 1)
        expected = NonDominatedSorting().do(F, n_stop_if_ranked=most)
        for one, other in zip(fronts(F, most), expected, strict=True):
            np.testing.assert_array_equal(one, other)
    assert not list(fronts(np.empty((0, 3)), 0))


@pytest.mark.parametrize("scale", [1e-17, 1e-8, 1.0, 1e6])
@pytest.mark.parametrize("count", [0, 1, 3, 80])
def test_copies_are_those_that_a_comparison_of_every_pair_finds(scale, count):
    random = np.random.default_rng(count)
    for n_var in (1, 2, 12, 60):
        X, others = scale * random.random((count, n_var)), scale * random.random((90, n_var))
        some = random.random(count) < 0.3
        X[some] = others[: some.sum()]
        again = random.random(count) < 0.3
        X[again] = X[random.integers(0, max(1, count), again.sum())]
        X[random.random(count) < 0.2] += random.choice([1e-17, 3e-17, 1e-15])
        if n_var > 1:  # Equal products with the direction of the search, and yet others.
            X[-1:] = others[-1]
            X[-1:, :2] += scale * np.array([n_var + 1.0, -n_var])
        repeated = np.tril(cdist(X, X) <= 1e-16, -1).any(axis=1)
        expected = repeated | (cdist(X, others) <= 1e-16).any(axis=1)
        for parts in ([others], [others[:50], others[50:]], [others, np.empty((0, n_var))]):
            np.testing.assert_array_equal(copies(X, *parts), expected)
