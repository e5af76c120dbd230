"""The robot arm of COPS: its equations by hand, its least time against that of any motion."""

import numpy as np
import pytest

from tests.helpers import assert_exact_gradients
from trajevo.errors import InvalidInputError
from trajevo.problems.cops_robot_arm import DRIVES, controls
from trajevo.study.bench.statement import Statement
from trajevo.study.bench.suite import benchmark

#: Ipopt, controls constant in each of 400 intervals, Runge-Kutta steps of order 4.
ANY_MOTION = 9.140928


def test_controls_are_those_of_the_equations_by_hand():
    """rho'' = u / L, theta'' = u / I_theta, phi'' = u / I_phi with L = 5, rho = 4, phi = pi/6: I = (1 + 64)/3."""
    u = controls(np.array([4.0, 1.0, np.pi / 6.0]), np.array([0.1, 0.3, -0.02]))
    np.testing.assert_allclose(u, [0.5, 65.0 / 3.0 * 0.25 * 0.3, -65.0 / 3.0 * 0.02], rtol=1e-14)


def test_its_motion_keeps_the_drives_and_is_near_the_least_of_any_motion():
    of = benchmark("cops_robot_arm")
    reference = of.reference
    assert not reference.proven
    (time,) = reference.values[0]
    assert ANY_MOTION < time < 1.01 * ANY_MOTION
    curve = of.problem().decode(reference.variables)
    t = np.linspace(0.0, time, 20_001)[None]
    q, v, a = (curve.evaluate(t, order)[0] for order in range(3))
    np.testing.assert_allclose(q[[0, -1]], [[4.5, 0.0, np.pi / 4.0], [4.5, 2.0 * np.pi / 3.0, np.pi / 4.0]], atol=1e-12)
    np.testing.assert_allclose(v[[0, -1]], 0.0, atol=1e-9)
    assert (q[:, 0] > 0.0).all()
    assert (q[:, 0] < 5.0).all()
    assert np.abs(controls(q, a)).max() < 1.001, "limited at samples"


def test_derivatives_of_the_drives_are_exact():
    of = benchmark("cops_robot_arm")
    assert_exact_gradients(of.problem().in_terms(), of.reference.variables)


def test_a_plain_statement_calls_the_same_equations_with_scipys_motion():
    of = benchmark("cops_robot_arm")
    problem, statement = of.problem(), of.statement()
    X = np.random.default_rng(0).uniform(problem.xl, problem.xu, (3, problem.n_var))
    F, G = problem.evaluate(X, return_values_of=["F", "G"])
    for x, f, g in zip(X, F, G, strict=True):
        own_f, own_g = statement.evaluate(x)
        np.testing.assert_allclose(own_f, f, rtol=1e-12)
        np.testing.assert_allclose(own_g, g, rtol=1e-8, atol=1e-9)
    assert statement.constraints == DRIVES.names


def test_an_own_function_that_asks_for_efforts_has_no_plain_statement():
    from tests.study.bench.test_statement import two

    def power(rollout):
        """Power of the joints [W]."""
        return np.abs(rollout.power).max(axis=(1, 2)) - 1.0

    with pytest.raises(InvalidInputError, match="no plain statement of 'power', which asks for 'power'"):
        Statement.of(two(interpolant="cubic", objectives=["time"], constraints=["velocity", power]))
