"""Payload against time: curves by optimisation against the reference, fronts, the largest payload of any motion."""

import numpy as np
import pytest

from problems import HybridManipulator, PointingMechanism
from tests.guo2016 import GUO2016, TABLE_7
from tests.test_capacity import every_model
from tests.test_hybrid_manipulator import assert_gradients_equal_central_differences
from trajevo import optimise
from trajevo.capacity import dlcc
from trajevo.errors import InvalidInputError
from trajevo.payload import Payload
from trajevo.payload_time import capacity_front, max_payload_problem
from trajevo.selection import Weights
from trajevo.weighted import minimise_weighted


def assert_rising(problem, curve, masses):
    assert curve.payloads.tolist() == masses
    assert curve.payload_model == problem.dynamics.payload.model
    assert np.isfinite(curve.times).all()
    assert (np.diff(curve.times) >= 0.0).all()
    for mass, time, x in zip(curve.payloads, curve.times, curve.X, strict=True):
        F, G = problem.with_payload(problem.dynamics.payload.with_mass(float(mass))).evaluate(x[None])[:2]
        assert F[0, 0] == pytest.approx(time, rel=1e-9)
        assert G.max() <= 1e-6


def test_least_time_grows_with_the_payload():
    """With forces at the ends of the intervals alone, to be quick; a little faster than with those between."""
    problem = HybridManipulator(samples=2)
    curve = capacity_front(problem, [10.0, 0.0, 5.0], seed=1, starts=1)
    assert_rising(problem, curve, [0.0, 5.0, 10.0])
    assert curve.times[-1] == pytest.approx(GUO2016["least_time"]["rigid"], rel=0.01)
    assert curve.times[0] == pytest.approx(GUO2016["least_time"]["none"], rel=0.01)


def test_capacity_front_keeps_the_model():
    problem = HybridManipulator(payload_model="weight_only", samples=2)
    curve = capacity_front(problem, [10.0], seed=1, starts=1)
    assert_rising(problem, curve, [10.0])
    assert curve.times[0] == pytest.approx(GUO2016["least_time"]["weight_only"], rel=0.01)


@pytest.mark.parametrize("bad", [[], [float("nan")], "ten", [[1.0, 2.0]], [-1.0], [50.0]], ids=str)
def test_bad_payloads_of_a_curve_are_refused(bad):
    with pytest.raises(InvalidInputError, match="payload"):
        capacity_front(HybridManipulator(), bad, seed=1)


@pytest.mark.long
@pytest.mark.parametrize("model", ["rigid", "weight_only"])
def test_payload_time_curve(model):
    problem = HybridManipulator(payload_model=model)
    curve = capacity_front(problem, [0.0, 5.0, 10.0], seed=3)
    assert_rising(problem, curve, [0.0, 5.0, 10.0])
    assert curve.times[0] == pytest.approx(GUO2016["least_time"]["none"], rel=1e-3)
    assert curve.times[-1] == pytest.approx(GUO2016["least_time"][model], rel=1e-3)


def test_payload_as_a_variable_and_an_objective():
    base = HybridManipulator()
    problem = max_payload_problem(base, (0.0, 12.5))
    assert problem.n_var == base.n_var + 1
    assert problem.objective_names == (*base.objective_names, "unused_payload")
    assert (problem.variables[-1].name, problem.variables[-1].unit) == ("payload", "kg")
    assert problem.reference_point.tolist() == [*base.reference_point, 12.5]
    h = np.stack([TABLE_7, TABLE_7, TABLE_7])
    F, G = problem.evaluate(np.column_stack([h, [0.0, 4.0, 10.0]]))[:2]
    assert F[:, -1].tolist() == [12.5, 8.5, 2.5]
    for i, mass in enumerate((0.0, 4.0, 10.0)):
        own_F, own_G = HybridManipulator(payload=mass).evaluate(TABLE_7[None])[:2]
        np.testing.assert_allclose(F[i, :-1], own_F[0], rtol=1e-10)
        np.testing.assert_allclose(G[i], own_G[0], rtol=1e-9, atol=1e-12)


def test_front_of_the_greatest_payload():
    problem = max_payload_problem(HybridManipulator(), (0.0, 12.5))
    front = optimise(problem, seed=1, generations=60, population=40, progress=False)
    assert len(front) > 5
    assert front.G.max() <= 0.0
    assert np.ptp(front.X[:, -1]) > 1.0
    for i in range(0, len(front), 5):
        assert dlcc(problem.rollout(front.X[i]), samples=6).mass >= front.X[i, -1] - 1e-9
        np.testing.assert_allclose(front.F[i, -1], 12.5 - front.X[i, -1])


@every_model
def test_gradients_with_the_payload_as_a_variable(model):
    problem = max_payload_problem(HybridManipulator(payload_model=model), (0.0, 12.0))
    rng = np.random.default_rng(6)
    x = np.column_stack([rng.uniform(0.3, 1.2, (3, 12)), rng.uniform(1.0, 11.0, 3)])
    assert_gradients_equal_central_differences(problem, x)


def test_greatest_payload_within_a_time():
    """Section 5 of the reference: the payload alone as the cost reaches its static bound as the motion slows down."""
    problem = max_payload_problem(HybridManipulator(), (0.0, 12.6))
    weights = Weights((0.0, 0.0, 0.0, 0.0, 1.0))
    best = minimise_weighted(problem, weights, seed=1, starts=2)
    assert 12.4 < 12.6 - best.cost <= 12.5109


def test_a_payload_without_mass_gives_its_shape():
    problem = max_payload_problem(HybridManipulator(payload=0.0, payload_model="weight_only"), (0.0, 12.0))
    assert problem.dynamics.payload == Payload(1.0, model="weight_only")


def test_the_range_of_a_payload_that_is_not_given_ends_at_what_is_held_at_rest():
    low, high = max_payload_problem(HybridManipulator(payload_model="weight_only")).payload_range
    assert low == 0.0
    assert high == pytest.approx(12.510810648896424, rel=1e-9)  # (500 N - weight of links 2 to 4) / g
    with pytest.raises(InvalidInputError, match="payload_range: expected finite numbers, got inf"):
        max_payload_problem(PointingMechanism())


@pytest.mark.parametrize("bounds", [(-1.0, 5.0), (5.0, 5.0), (6.0, 5.0), (0.0, np.inf), (0.0, np.nan), (np.nan, 1.0)])
def test_bad_payload_ranges_are_refused(bounds):
    with pytest.raises(InvalidInputError, match="payload_range"):
        max_payload_problem(HybridManipulator(), bounds)
