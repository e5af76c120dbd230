"""Exact extremes of random motions of the curves with many variables, at dense instants."""

import numpy as np
import pytest

from tests.formulation.test_b_spline import drawn, exceeded
from tests.formulation.test_free_points import ARM, ROWS
from trajevo import ViaPointProblem

ANGLES = np.linspace(0.0, 5.5, 60)
MANY = np.stack([0.6 * np.cos(ANGLES + k) for k in range(len(ROWS[0]))], axis=1)
LIMITED = {"objectives": ["time", "acceleration"], "constraints": ["velocity", "acceleration"]}
CURVES = {
    "pace": {"interpolant": "cubic", "points": MANY, "duration_bounds": (0.002, 2.0)},
    "cubic, two extra points": {"interpolant": "cubic", "extra_points": 2},
    "quintic, one extra point": {"interpolant": "quintic_spline", "extra_points": 1},
    "hermite, one extra point": {"interpolant": "hermite", "extra_points": 1, **LIMITED},
}


def problem(kind):
    return ViaPointProblem(**{"robot": ARM, "points": ROWS, "duration_bounds": (0.05, 4.0)} | CURVES[kind])


@pytest.mark.parametrize("kind", CURVES)
def test_exact_extremes_are_exceeded_nowhere(kind):
    made = problem(kind)
    assert exceeded(made, drawn(made, 5), 2001) < 1e-12


@pytest.mark.long
@pytest.mark.parametrize("kind", CURVES)
def test_exact_extremes_are_exceeded_at_none_of_many_instants(kind):
    made = problem(kind)
    assert exceeded(made, drawn(made, 250, seed=2), 50_001) < 1e-12
