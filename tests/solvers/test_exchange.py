"""Limits that are proven between samples do not keep gradient solvers from an end."""

import numpy as np
import pytest

from tests.helpers import refused
from trajevo import ViaPointProblem, largest_payload, load_task, max_payload_problem, optimise
from trajevo.formulation.problem import Weights
from trajevo.solvers.gradient import weighted_sum
from trajevo.solvers.gradient.exchange import exchanged, proves, slower, stretching_times
from trajevo.solvers.gradient.sqp import OutOfEvaluations, WeightedSum, greatest_excess
from trajevo.solvers.gradient.weighted_sum import minimise_weighted


@pytest.fixture(scope="module")
def panda():
    """A problem whose largest payload SLSQP alone does not find: efforts peak between the samples of long segments."""
    return load_task("panda_six_points").problem


@pytest.fixture(scope="module")
def largest(panda):
    """The largest payload under proven limits, and how many individuals each request for gradients had."""
    asked, kind = [], type(max_payload_problem(panda, objectives=()))
    evaluate = kind.evaluate_with_gradients
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(kind, "evaluate_with_gradients", lambda self, x: (asked.append(len(x)), evaluate(self, x))[1])
        return largest_payload(panda, seed=1, starts=1), asked


def sampled(problem):
    return ViaPointProblem(**problem.settings | {"limits": "sampled"})


def test_the_largest_payload_under_proven_limits_is_near_that_at_samples(panda, largest):
    proven, at_samples = max_payload_problem(panda, objectives=()), max_payload_problem(sampled(panda), objectives=())
    assert (proves(proven), proves(at_samples)) == (True, False)
    weights = Weights((1.0,))
    upper = minimise_weighted(at_samples, weights, seed=1, starts=1)
    assert greatest_excess(proven, upper.x) > 0.0  # else this task has nothing to show
    found = np.append(largest[0].x, largest[0].mass)
    assert greatest_excess(proven, found) <= 0.0
    assert 0.98 * upper.x[-1] <= found[-1] <= upper.x[-1] + 1e-6
    direct = exchanged(proven, np.ones(1), found, 1e-9)
    assert direct is not None
    assert greatest_excess(proven, direct) <= 0.0


def test_few_evaluations_are_enough(largest):
    found, asked = largest
    assert found.mass > 6.5
    assert 0 < len(asked) < 3000


def test_where_slsqp_comes_to_an_end_nothing_changes(panda, monkeypatch):
    def never(*_):
        raise AssertionError("limits were exchanged")

    time = Weights(tuple(float(name == "time") for name in panda.objective_names))
    monkeypatch.setattr(weighted_sum, "exchanged", never)
    found = minimise_weighted(panda, time, seed=1, starts=1)
    assert np.isfinite(found.cost)
    assert np.isfinite(minimise_weighted(sampled(panda), time, seed=1, starts=1).cost)


@pytest.mark.long
@pytest.mark.parametrize("mass", [12.0, 7.5])
def test_a_payload_that_nothing_carries_is_told(panda, mass):
    heavy = panda.with_payload(panda.dynamics.payload.with_mass(mass))
    time = Weights(tuple(float(name == "time") for name in panda.objective_names))
    assert minimise_weighted(heavy, time, seed=1, starts=1).cost == np.inf
    refused(lambda: largest_payload(panda, within=2.0, seed=1, starts=1), "problem: expected a feasible motion, none")


def test_a_run_evaluates_no_more_than_it_may(panda):
    search = WeightedSum(panda.in_terms(), np.eye(3)[0], most=4)
    start = 0.5 * (panda.xl + panda.xu)
    for _ in range(2):  # each run anew
        before = search.evaluations
        with pytest.raises(OutOfEvaluations):
            search.run(start, 1e-9)
        assert search.evaluations - before == 4


@pytest.fixture(scope="module")
def a_little_too_fast(panda):
    """A problem, and a motion that breaks its limits and keeps them when its times are 5 % longer."""
    front = optimise(panda, seed=1, population=20, generations=3, polish=False, progress=False)
    kept = front.X[front.F[:, 0].argmin()]
    while greatest_excess(panda, faster(panda, kept, 1.05)) <= 0.0:
        kept = faster(panda, kept, 1.05)
    return faster(panda, kept, 1.05)


def faster(problem, x, factor):
    return np.where(stretching_times(problem), x / factor, x)


def test_slowing_down_stretches_all_times_by_as_little_as_it_takes(panda, a_little_too_fast):
    kept = slower(panda, a_little_too_fast)
    assert greatest_excess(panda, kept) <= 0.0
    assert slower(panda, kept) is kept
    factors = (kept / a_little_too_fast)[stretching_times(panda)]
    np.testing.assert_allclose(factors, factors[0], rtol=1e-12)
    np.testing.assert_array_equal(kept[~stretching_times(panda)], a_little_too_fast[~stretching_times(panda)])
    assert 1.0 < factors[0] <= 1.05 * 1.01
    assert greatest_excess(panda, faster(panda, kept, 1.01)) > 0.0


def test_a_search_that_is_stopped_keeps_what_slowing_down_has_found(panda, a_little_too_fast):
    found = exchanged(panda, np.eye(panda.n_obj)[0], a_little_too_fast, 1e-6, stop=lambda _: True)
    np.testing.assert_array_equal(found, slower(panda, a_little_too_fast))
