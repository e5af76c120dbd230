"""One step of a minimax problem: the conditions of optimality, and SciPy's SLSQP on the same program."""

import numpy as np
import pytest
from scipy.optimize import minimize

from trajevo.solvers.gradient.batch_sqp import _PROXIMAL, Model


def random_model(seed, *, feasible=True):
    rng = np.random.default_rng(seed)
    n, k, m = 5, int(rng.integers(1, 5)), 30
    root = rng.normal(size=(n, n))
    terms = rng.uniform(-0.5, 0.0, k)
    limits = rng.uniform(-1.0, -0.01 if feasible else 0.5, m)
    return Model(
        curvature=root @ root.T + 0.1 * np.eye(n),
        slope=0.1 * rng.normal(size=n),
        terms=terms - terms.max(),
        term_slopes=rng.normal(size=(k, n)),
        limits=limits,
        limit_slopes=rng.normal(size=(m, n)),
        box=np.array([-0.4 * np.ones(n), 0.3 * np.ones(n)]),
        penalty=10.0,
    )


def value(model, d):
    """The program's value where t and s are as low as d allows; the square of the excess is in it."""
    t = (model.terms + model.term_slopes @ d).max()
    s = max((model.limits + model.limit_slopes @ d).max(), 0.0)
    return t + model.slope @ d + 0.5 * d @ model.curvature @ d + model.penalty * s + 0.5 * _PROXIMAL * (t**2 + s**2)


@pytest.mark.thinned(5)
@pytest.mark.parametrize("feasible", [True, False])
@pytest.mark.parametrize("seed", range(12))
def test_no_other_step_is_better(seed, feasible):
    model = random_model(seed, feasible=feasible)
    step = model.solve()
    assert (model.box[0] <= step.d).all()
    assert (step.d <= model.box[1]).all()
    best = value(model, step.d)
    assert best <= value(model, np.zeros(5))
    rng = np.random.default_rng(seed)
    for size in (1e-4, 1e-2, 1.0):
        for other in np.clip(step.d + size * rng.normal(size=(300, 5)), *model.box):
            assert value(model, other) >= best - 1e-9


@pytest.mark.parametrize("seed", range(6))
def test_slsqp_finds_the_same(seed):
    model = random_model(seed)
    found = minimize(
        lambda z: z[5] + model.slope @ z[:5] + 0.5 * z[:5] @ model.curvature @ z[:5] + 0.5 * _PROXIMAL * z[5] ** 2,
        np.zeros(6),
        method="SLSQP",
        bounds=[*zip(*model.box, strict=True), (None, None)],
        constraints=[
            {"type": "ineq", "fun": lambda z: z[5] - model.terms - model.term_slopes @ z[:5]},
            {"type": "ineq", "fun": lambda z: -model.limits - model.limit_slopes @ z[:5]},
        ],
        options={"ftol": 1e-14, "maxiter": 500},
    )
    np.testing.assert_allclose(model.solve().d, found.x[:5], atol=2e-5)


@pytest.mark.parametrize("seed", range(6))
def test_multipliers_balance_the_slopes_inside_the_box(seed):
    model = random_model(seed)
    wide = Model(**(vars(model) | {"box": 100.0 * model.box}))
    step = wide.solve()
    assert (step.terms >= 0.0).all()
    assert (step.limits >= 0.0).all()
    rest = wide.slope + wide.curvature @ step.d + step.terms @ wide.term_slopes + step.limits @ wide.limit_slopes
    np.testing.assert_allclose(rest, 0.0, atol=1e-8)
    assert step.limits @ (wide.limits + wide.limit_slopes @ step.d) == pytest.approx(0.0, abs=1e-8)


def test_the_promised_decrease_is_that_of_the_linear_model():
    model = random_model(3, feasible=False)
    d = model.solve().d
    before = model.penalty * max(model.limits.max(), 0.0)
    after = (model.terms + model.term_slopes @ d).max() + model.slope @ d
    after += model.penalty * max((model.limits + model.limit_slopes @ d).max(), 0.0)
    assert model.decrease(d) == pytest.approx(before - after)


@pytest.mark.parametrize("curvature", [-np.eye(5), np.diag([1.0, 1.0, np.inf, 1.0, 1.0])], ids=["negative", "infinite"])
def test_a_curvature_that_is_not_positive_and_finite_has_no_step(curvature):
    model = random_model(0)
    assert Model(**(vars(model) | {"curvature": curvature})).solve() is None
