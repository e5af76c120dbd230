"""Arrays of complex steps under numpy's functions of real numbers, against central differences."""

import numpy as np
import pytest

from trajevo.base.complex_step import Stepped, stepped, unstepped

X = np.random.default_rng(0).normal(size=(4, 5, 3))
D = np.random.default_rng(1).normal(size=X.shape)


def in_place(v):
    w = v.copy()
    w *= 2.0
    w[w < 0.0] *= -1.0
    return w.sum(axis=(1, 2))


FUNCTIONS = {
    "peak": lambda v: np.abs(v).max(axis=(1, 2)),
    "built-in abs": lambda v: abs(v).sum(axis=(1, 2)),
    "fabs": lambda v: np.fabs(v).sum(axis=(1, 2)),
    "norm": lambda v: np.linalg.norm(v, axis=2).max(axis=1),
    "norm of order 1": lambda v: np.linalg.norm(v, 1, axis=2).sum(axis=1),
    "norm of order inf": lambda v: np.linalg.norm(v, np.inf, axis=2).sum(axis=1),
    "Frobenius norm": lambda v: np.linalg.norm(v, axis=(1, 2)),
    "deviation": lambda v: np.std(v, axis=1, ddof=1).max(axis=1),
    "method var": lambda v: v.var(axis=(1, 2)),
    "where": lambda v: np.where(v > 0.0, v, -2.0 * v).sum(axis=(1, 2)),
    "clip": lambda v: np.clip(v, -0.5, 0.5).sum(axis=(1, 2)),
    "maximum": lambda v: np.maximum(v, 0.1).sum(axis=(1, 2)),
    "hypot": lambda v: np.hypot(v[..., 0], v[..., 1]).sum(axis=1),
    "arctan2": lambda v: np.arctan2(v[..., 0], v[..., 1]).sum(axis=1),
    "copysign": lambda v: np.copysign(v, v[..., :1]).sum(axis=(1, 2)),
    "mod": lambda v: np.mod(v, 0.3).sum(axis=(1, 2)),
    "cube root": lambda v: np.cbrt(v).sum(axis=(1, 2)),
    "ptp": lambda v: np.ptp(v, axis=1).sum(axis=1),
    "median": lambda v: np.median(v, axis=(1, 2)),
    "sort": lambda v: np.sort(np.abs(v), axis=1)[:, -2].sum(axis=1),
    "stack": lambda v: np.abs(np.stack([v, v * v])).sum(axis=(0, 2, 3)),
    "einsum": lambda v: np.abs(np.einsum("btn,btn->bt", v, v[..., ::-1])).max(axis=1),
    "in place": in_place,
    "out": lambda v: np.abs(v, out=np.empty_like(v)).sum(axis=(1, 2)),
    "loop": lambda v: np.array([max(abs(one) for one in row.ravel()) for row in v]),
}


@pytest.mark.parametrize("function", FUNCTIONS.values(), ids=FUNCTIONS)
def test_values_are_those_of_real_numbers_and_steps_are_derivatives(function):
    found = np.asarray(unstepped(function(stepped(X + 1e-20j * D))))
    np.testing.assert_allclose(found.real, function(X), rtol=1e-13)
    np.testing.assert_allclose(found.imag / 1e-20, (function(X + 1e-6 * D) - function(X - 1e-6 * D)) / 2e-6, atol=1e-7)


def test_numpy_alone_drops_the_derivative():
    assert not np.iscomplexobj(np.abs(X + 1e-20j * D))
    assert isinstance(np.abs(stepped(X + 1e-20j * D)), Stepped)


def test_a_matrix_norm_without_a_derivative_is_refused():
    with pytest.raises(TypeError, match="no derivative of the matrix norm 2"):
        np.linalg.norm(stepped(X[0] + 1e-20j * D[0]), 2)


def test_real_arrays_and_other_things_stay_as_they_are():
    for thing in (X, "text", 3, None):
        assert stepped(thing) is thing
        assert unstepped(thing) is thing
