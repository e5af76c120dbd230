"""No solution of a front lies below its bound along a path, and what is told of it."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

from tests.helpers import trajevo
from trajevo import optimise, path_front_bound, plots
from trajevo.errors import InvalidInputError
from trajevo.problems import PointingMechanism, TimeJerkReparameterisation


@pytest.fixture(scope="module")
def front():
    return optimise(TimeJerkReparameterisation(), generations=5, population=24, polish=False, seed=1)


@pytest.fixture(scope="module")
def bound(front):
    return path_front_bound(front, weights=3, stations=20)


def test_no_solution_is_below(front, bound):
    sums = front.F[:, :1] + front.F[:, 1:] * bound.weights
    assert (sums > bound.values).all()
    assert ((bound.better > 0.0) & (bound.better < 1.0)).all()
    assert (bound.jerk_at(front.F[:, 0]) < front.F[:, 1]).all()


def test_gap_is_the_area_between(front, bound):
    """Against a grid of places in the box, all those above the bound that no solution dominates."""
    low, high = bound.lower, bound.corner
    at = np.linspace(low[0], high[0], 601)
    middle = 0.5 * (at[1:] + at[:-1])
    inside = front.F[(high > front.F).all(axis=1)]
    best = np.array([np.min(inside[inside[:, 0] <= t, 1], initial=high[1]) for t in middle])
    area = (best - np.minimum(bound.jerk_at(middle), high[1])).sum() * (at[1] - at[0])
    assert bound.gap == pytest.approx(area / np.prod(high - low), abs=5e-3)


def test_points_are_a_convex_line_below_the_front(front, bound):
    points = bound.points()
    assert (np.diff(points[:, 0]) > 0.0).all()
    assert (np.diff(points[:, 1]) <= 0.0).all()  # 0 where no weight reaches the end of the box
    slopes = np.diff(points[:, 1]) / np.diff(points[:, 0])
    assert (np.diff(slopes) > 0.0).all()
    np.testing.assert_allclose(bound.jerk_at(points[:, 0]), points[:, 1], rtol=1e-9, atol=1e-12)
    assert bound.jerk_at([0.99 * bound.values[0]]) == np.inf


def test_command_and_picture(front, bound, tmp_path):
    front.save(tmp_path / "front.json")
    done = trajevo("path-bound", tmp_path / "front.json", "--stations", 15, "--weights", 2)
    assert done.returncode == 0, done.stderr
    assert "no time law along the path is better" in " ".join(done.stdout.split())
    assert (tmp_path / "path_bound.png").is_file()
    ax = plots.path_bound(bound, {"front": front})
    assert ax.get_yscale() == "log"
    assert len(ax.lines) == 1
    plt.close(ax.figure)
    with pytest.raises(InvalidInputError, match="fronts: expected one front at least"):
        plots.path_bound(bound, {})


def test_bad_input(front):
    with pytest.raises(InvalidInputError, match="^front: expected a front, as trajevo.optimise gives it .*, got str$"):
        path_front_bound("run")
    with pytest.raises(InvalidInputError, match="weights: expected a whole number from 1 to 200, got 0"):
        path_front_bound(front, weights=0)
    other = optimise(PointingMechanism(), generations=2, population=12, polish=False, seed=1)
    with pytest.raises(InvalidInputError, match="problem: expected one along a fixed path"):
        path_front_bound(other)
