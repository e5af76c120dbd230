"""No solution of a front lies below its bound along a path, and what is told of it."""

import signal

import matplotlib.pyplot as plt
import numpy as np
import pytest

from tests.helpers import refused, same_bound, trajevo
from trajevo import bound_front, optimise, plots
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.formulation.objectives import objectives_of
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.problems import TimeJerkReparameterisation
from trajevo.verification import bound_front as searching
from trajevo.verification.path_bounds import weight_search

SMALL = {"generations": 5, "population": 24, "polish": False, "seed": 1, "progress": False}

#: A gap to which so small a front is bounded in a second.
GAP = 0.1136


@pytest.fixture(scope="module")
def front():
    return optimise(TimeJerkReparameterisation(), **SMALL)


@pytest.fixture(scope="module")
def bound(front):
    return bound_front(front, gap=GAP)


def test_no_solution_is_below(front, bound):
    assert bound.ended == "gap"
    sums = front.F[:, :1] + front.F[:, 1:] * bound.below.weights
    assert (sums > bound.below.values).all()
    assert ((bound.better > 0.0) & (bound.better < 1.0)).all()
    assert (bound.below.least_at(front.F[:, 0]) < front.F[:, 1]).all()
    assert not bound.excludes(front.F).any()
    assert bound.excludes(front.F * (1.0 - bound.better.max()) * 0.999).all()


def test_gap_is_the_area_between(front, bound):
    """Against a grid of places in the box, all those above the bound that no solution dominates."""
    at = np.linspace(0.0, bound.corner[0], 2001)
    middle = 0.5 * (at[1:] + at[:-1])
    best = np.array([np.min(front.F[front.F[:, 0] <= t, 1], initial=bound.corner[1]) for t in middle])
    area = (best - np.minimum(bound.below.least_at(middle), bound.corner[1])).sum() * (at[1] - at[0])
    assert bound.gap == pytest.approx(area / np.prod(bound.corner), abs=1e-3)


def test_the_envelope_is_a_convex_line_and_points_are_below_it(front, bound):
    line = bound.below.envelope(bound.corner)
    assert (np.diff(line[:, 0]) > 0.0).all()
    assert (np.diff(line[:, 1]) <= 0.0).all()  # 0 where no weight reaches the end of the box
    assert (np.diff(np.diff(line[:, 1]) / np.diff(line[:, 0])) > 0.0).all()
    np.testing.assert_allclose(bound.below.least_at(line[:, 0]), line[:, 1], rtol=1e-9, atol=1e-12)
    assert bound.below.least_at([0.99 * bound.below.values[0]]) == np.inf
    points = bound.points(40)
    assert (points[:, None] <= front.F).all(axis=2).any(axis=0).all()


def test_a_killed_and_an_interrupted_search_go_on_to_the_same_bound(front, bound, tmp_path, monkeypatch):
    monkeypatch.setattr(searching, "_WRITTEN", 0.0)
    file, told = tmp_path / "a.bound.npz", []

    def stop(line):
        told.append(line)
        if len(told) == 1:
            signal.raise_signal(signal.SIGINT)
        if len(told) == 2:
            raise ZeroDivisionError

    first = bound_front(front, gap=GAP, file=file, tell=stop)
    assert first.ended == "stopped"
    assert first.gap > GAP
    assert not first.excludes(front.F).any()
    with pytest.raises(ZeroDivisionError):
        bound_front(front, gap=GAP, file=file, tell=stop)
    same_bound(bound_front(front, gap=GAP, file=file), bound)


def test_no_cpu_time_is_no_bound_but_what_every_motion_keeps(front):
    found = bound_front(front, cpu_time=0.0)
    assert found.ended == "cpu-time"
    assert found.cells == 0
    assert 0.0 < found.gap < 1.0
    assert not found.excludes(front.F).any()


def test_it_ends_where_more_weights_and_stations_bring_nothing(front, monkeypatch):
    monkeypatch.setattr(weight_search, "_STATIONS", 10)
    monkeypatch.setattr(weight_search, "_MOST_STATIONS", 10)
    assert bound_front(front, gap=1e-4).ended == "nothing left"


def test_command_and_picture(front, bound, tmp_path):
    front.save(tmp_path / "front.json")
    done = trajevo("bound", tmp_path / "front.json", "--gap", GAP)
    assert done.returncode == 0, done.stderr
    assert "cells  gap at most" in done.stderr
    assert "no motion of this kind is better" in " ".join(done.stdout.split())
    assert "all time laws" in done.stdout
    ax = plots.fronts({"front": front}, bound=bound)
    assert ax.get_yscale() == "log"
    (area,) = ax.collections
    assert not any(area.get_paths()[0].contains_points(front.F * [1.0, 1.0]))
    plt.close(ax.figure)


def test_time_and_squared_effort(front):
    """The same path and limits with the squared effort of the drives: the motions of the other front are not below."""
    given = front.problem
    problem = TrajectoryProblem(
        dynamics=Dynamics(given.robot, samples=6),
        interpolant=given.interpolant,
        objectives=objectives_of(["square_effort", "time"], given.robot),
        constraints=given.constraints,
    )
    own = optimise(problem, **SMALL)
    found = bound_front(own, gap=0.22)
    assert found.names == ("square_effort", "time")
    assert found.units == ("N^2*s", "s")
    assert found.ended == "gap"
    assert found.lower[1] == pytest.approx(1.6, rel=0.1)
    others = problem.evaluate(front.X, return_values_of=["F"])
    assert not found.excludes(own.F).any()
    assert not found.excludes(others).any()


def test_what_cannot_be_bounded_is_refused():
    trapezoid = optimise(TimeJerkReparameterisation(quadrature="trapezoid"), **SMALL | {"generations": 1})
    refused(
        lambda: bound_front(trapezoid),
        r"front: expected the time and the exact integral of the squared jerk \(quadrature='gauss'\) or of the squared "
        "effort as objectives, got time, jerk",
    )
    linear = optimise(TimeJerkReparameterisation(interpolant="linear"), **SMALL | {"generations": 1})
    refused(lambda: bound_front(linear), "problem: expected a time law that is free, .* got u = t / T")
