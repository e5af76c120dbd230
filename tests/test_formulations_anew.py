"""Least times against CasADi: trajevo's problems agree with the same written anew, and CasADi may be missing."""

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline, CubicSpline

from tests.helpers import mostly_long
from trajevo import ViaPointProblem

#: Greatest difference between both formulations, as a share.
AGREE = 1e-9

WRITTEN_ANEW = (0, 1, 3, 5, 6)


@pytest.fixture(autouse=True)
def benchmarks(monkeypatch):
    monkeypatch.syspath_prepend(str(Path(__file__).parent / "benchmarks"))


@pytest.mark.parametrize("number", mostly_long(WRITTEN_ANEW, 0, 5))
def test_both_formulations_have_the_same_times_and_shares_of_every_limit(number):
    from cases_of_optima import cases, disagreement

    assert disagreement(cases()[number], seed=number) < AGREE


def test_a_formulation_of_another_problem_is_told():
    from cases_of_optima import Compared, anew_rods_cubic, disagreement, rods

    def wrong(x, xp):
        took, shares = anew_rods_cubic(x, xp, count=5)
        return took, [share * (1.0, 1.0 + 1e-8)[k % 2] for k, share in enumerate(shares)]

    heavier = ViaPointProblem(**dict(rods("cubic", 5).settings) | {"payload": 1.001})
    right = rods("cubic", 5)
    assert disagreement(Compared("heavier", heavier, lambda x, xp: anew_rods_cubic(x, xp, count=5))) > 1e-5
    assert disagreement(Compared("another limit of the second joint", right, wrong)) > AGREE
    with pytest.raises(ValueError, match="not written anew"):
        disagreement(Compared("nothing", right))


def test_torques_by_lagrange_are_those_of_the_robot_at_every_sample():
    import splines_anew as anew
    from cases_of_optima import PAYLOAD, RODS, random_vectors, rods

    problem = rods("hermite", 5)
    rollout = problem.rollout(random_vectors(problem, 30, 3))
    states = [(rollout.q[..., j], rollout.v[..., j], rollout.a[..., j]) for j in range(2)]
    torques = np.stack(anew.TwoLinks.of(RODS, PAYLOAD).torques(states, np), axis=-1)
    np.testing.assert_allclose(torques, rollout.effort, rtol=1e-11, atol=1e-11 * np.abs(torques).max())


def test_splines_anew_are_those_of_scipy():
    import splines_anew as anew

    rng = np.random.default_rng(4)
    points, h = rng.uniform(-1.0, 1.0, (5, 2)), rng.uniform(0.2, 1.0, 6)
    pieces = anew.cubic(points.tolist(), h.tolist())
    times = np.concatenate([[0.0], np.cumsum(h)])
    knots = np.array([[state[0] for state in piece.start] for piece in pieces] + [points[-1]])
    np.testing.assert_allclose(knots[[0, 2, 3, 4, 6]], points, atol=1e-13)
    scipy = CubicSpline(times, knots, bc_type="clamped")
    for piece, t in zip(pieces, times, strict=False):
        for s in np.linspace(0.0, piece.h, 5):
            found = np.array(piece.at(s)).T
            np.testing.assert_allclose(found, [scipy(t + s, k) for k in range(3)], atol=1e-10)
    assert np.abs(scipy(times[[0, -1]], 2)).max() < 1e-10  # what the virtual knots are for

    travel = rng.uniform(-0.5, 0.5, (2, 3))
    instants = np.concatenate([[0.0], np.cumsum(h[:4])])
    velocities = CubicSpline(instants, points, bc_type="clamped")(instants, 1)
    velocities[1:-1] += 2.0 * travel.T / (h[:3] + h[1:4])[:, None]
    scipy = CubicHermiteSpline(instants, points, velocities)
    for piece, t in zip(anew.hermite(points.tolist(), h[:4].tolist(), travel.tolist()), instants, strict=False):
        found = np.array(piece.at(0.3 * piece.h)).T
        np.testing.assert_allclose(found, [scipy(t + 0.3 * piece.h, k) for k in range(3)], atol=1e-11)


def test_peaks_are_those_of_a_dense_sample():
    import splines_anew as anew

    rng = np.random.default_rng(5)
    points, h = rng.uniform(-1.0, 1.0, (4, 3)), rng.uniform(0.2, 1.0, 5)
    pieces, ones = anew.cubic(points.tolist(), h.tolist()), [1.0] * 3
    dense = np.array([piece.at(u * piece.h) for piece in pieces for u in np.linspace(0.0, 1.0, 4001)])
    for shares, derivative in zip(anew.shares_of_derivatives(pieces, ones, ones, ones, np), (1, 2), strict=False):
        peaks = np.abs(np.reshape(shares, (-1, 3))).max(axis=0)
        np.testing.assert_allclose(peaks, np.abs(dense[..., derivative]).max(axis=0), rtol=1e-6)


def test_without_casadi_the_comparison_is_refused_in_one_sentence(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "casadi", None)
    monkeypatch.setattr(sys, "argv", ["bench_casadi.py"])
    import bench_casadi

    bench_casadi.main()
    assert capsys.readouterr().out == f"{bench_casadi.MISSING}\n"
    assert "trajevo[bench]" in bench_casadi.MISSING
