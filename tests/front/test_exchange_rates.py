"""Exchange rates along a front: closed forms, new optima with relaxed limits, and what is refused."""

import dataclasses
import re

import matplotlib.pyplot as plt
import numpy as np
import pytest
from scipy.optimize import minimize

from tests.helpers import refused, trajevo
from trajevo import Robot, ViaPointProblem, optimise, plots

ONE = {"velocity": 2.0, "acceleration": 10.0, "jerk": 100.0}


def problem_of(limits, points=((0.0,), (1.0,)), **given):
    robot = Robot.from_limits(**limits, names=tuple(f"axis {k}" for k in range(len(points[0]))))
    usual = {"objectives": ("time", "jerk"), "constraints": ("velocity", "acceleration", "jerk")}
    usual["interpolant"] = "quintic_spline"
    return ViaPointProblem(robot=robot, points=points, **(usual | {"duration_bounds": (0.05, 5.0)} | given))


def least(limits, **given):
    front = optimise(problem_of(limits, **given), seed=1, population=20, generations=20, progress=False)
    return front, front.least("time")


@pytest.mark.parametrize(
    ("key", "limit", "power"), [("velocity", 0.5, 1.0), ("acceleration", 0.5, 1.0 / 2.0), ("jerk", 2.0, 1.0 / 3.0)]
)
def test_the_limit_that_holds_one_axis_buys_its_power_of_time(key, limit, power):
    """A quintic from rest to rest: T is c d / v, or (c d / a)^1/2, or (c d / j)^1/3, whichever is greatest."""
    _, fastest = least(ONE | {key: limit})
    found = fastest.sensitivity()
    (held,) = found.exchanges
    assert (held.name, held.kind, held.segments) == (f"{key} of axis 0", "limit", (0,))
    np.testing.assert_allclose(held.gain, power * found.value, rtol=1e-3)
    assert found.imbalance < 1e-6
    np.testing.assert_allclose(found.buys(0.1)[held.name], 0.1 * power * found.value, rtol=1e-3)


def test_between_the_ends_of_a_front_the_other_objective_is_what_holds():
    """Far from its limits one axis has jerk^2 proportional to T^-6: T falls by a third of the share."""
    front, _ = least(ONE)
    slow = next(row for row in range(len(front)) if 3.0 < front.F[row, 0] < 4.0)
    found = front.pick(str(slow)).sensitivity("time")
    (held,) = found.exchanges
    assert (held.name, held.kind) == ("jerk", "objective")
    np.testing.assert_allclose(held.gain, found.value / 3.0, rtol=1e-3)
    back = front.pick(str(slow)).sensitivity("jerk")
    np.testing.assert_allclose(back.exchanges[0].gain, 3.0 * back.value, rtol=1e-3)
    longest = front.least("jerk").sensitivity("jerk")
    assert [each.kind for each in longest.exchanges] == ["variable"], "only the longest duration holds the least jerk"


def test_gains_are_those_of_new_optima_by_scipy():
    """Three axes through four points: every limit that holds, relaxed by 1 %, with the new least time by SLSQP."""
    points = ((0.0, 0.5, -0.3), (0.8, -0.4, 0.6), (0.2, 0.9, 0.1), (1.0, 0.0, 0.5))
    limits = {"velocity": [1.6, 1.9, 1.9], "acceleration": [6.0, 7.0, 6.0], "jerk": [60.0, 80.0, 60.0]}
    _, fastest = least(limits, points=points, interpolant="cubic")
    found = fastest.sensitivity()
    assert found.imbalance < 0.001

    def optimum(limits):
        terms = problem_of(limits, points=points, interpolant="cubic").in_terms()

        width = terms.xu - terms.xl

        def values(u):
            (F,), (dF,), (G,), (dG,) = terms.evaluate_with_gradients((terms.xl + u * width)[None])
            return F[0], dF[0] * width, -G, -dG * width

        start = (fastest.x - terms.xl) / width
        solved = minimize(
            lambda u: values(u)[0],
            start,
            jac=lambda u: values(u)[1],
            method="SLSQP",
            bounds=[(0.0, 1.0)] * len(start),
            constraints=[{"type": "ineq", "fun": lambda u: values(u)[2], "jac": lambda u: values(u)[3]}],
            options={"ftol": 1e-11, "maxiter": 300},
        )
        assert solved.success
        return solved.fun

    before, buys = optimum(limits), found.buys(0.01)
    assert len(buys) == 3
    for key, values in limits.items():
        for axis in range(3):
            raised = limits | {key: [1.01 * v if k == axis else v for k, v in enumerate(values)]}
            told = buys.get(f"{key} of axis {axis}", 0.0)
            assert abs(before - optimum(raised) - told) < 0.03 * max(told, 0.01 * max(buys.values()))


def test_a_solution_that_is_no_optimum_says_so():
    front = optimise(problem_of(ONE), seed=1, population=20, generations=2, progress=False, polish=False)
    points = ((0.0, 0.5), (0.8, -0.4), (0.2, 0.9), (1.0, 0.0))
    rough = optimise(
        problem_of({key: [v, v] for key, v in ONE.items()}, points=points),
        seed=1,
        population=12,
        generations=2,
        progress=False,
        polish=False,
    )
    assert rough.least("time").sensitivity().imbalance > 0.05
    assert "optimal to first order but for" in str(front.knee().sensitivity())
    rates = front.knee().sensitivity()
    assert dataclasses.replace(rates, imbalance=0.3).short.endswith(", but for 30 % of its slope")
    assert "slope" not in dataclasses.replace(rates, imbalance=0.05).short


def test_mistakes_are_told():
    _, fastest = least(ONE)
    refused(lambda: fastest.sensitivity("speed"), "objective 'speed'; known: .*time")
    refused(lambda: fastest.sensitivity(within=2.0), "within: expected a share from 0 to 1, got 2.0")
    refused(
        lambda: fastest.sensitivity().buys(5), "share: expected a number above 0 and at most 1, got 5; 0.05 if it is"
    )
    refused(lambda: fastest.sensitivity().buys("5 %"), "share: expected")


def test_rates_along_a_front_are_those_of_its_solutions_and_drawn():
    front, fastest = least(ONE)
    along = front.sensitivities("time", most=10)
    assert [each.value for each in along] == sorted(each.value for each in along)
    assert along[0] == fastest.sensitivity("time")
    ax = plots.exchange_rates(along)
    names = [label.get_text() for label in ax.get_yticklabels()]
    assert set(names) == {"jerk", along[0].exchanges[0].name}
    plt.close(ax.figure)
    refused(lambda: plots.exchange_rates([]), "rates: expected those of one objective, got none")
    refused(lambda: plots.exchange_rates([along[0], fastest.sensitivity("jerk")]), "got .'jerk', 'time'.")


def test_the_command_tells_and_draws(tmp_path):
    problem = problem_of(ONE)
    optimise(problem, seed=1, population=12, generations=5, progress=False, out=tmp_path / "run")
    done = trajevo("explain", str(tmp_path / "run"), "--solution", "least_time")
    assert done.returncode == 0
    assert re.search(r"velocity of axis 0 +0 +-0.0469 s", done.stdout)
    assert (tmp_path / "run" / "exchange_rates.png").is_file()
    assert trajevo("explain", str(tmp_path / "run"), "--relaxed", "5", "--no-pictures").returncode == 2
