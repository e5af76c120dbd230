"""The price in time of a payload known to intervals: re-optimised, along a fixed path, and as a picture."""

import warnings
from dataclasses import replace

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest

from tests.capacity.test_payload_effort import COM_MODELS
from tests.helpers import mostly_long, refused, small_problem
from trajevo import Payload, optimise
from trajevo.capacity.payload_effort import payload_effort
from trajevo.capacity.payload_time import max_payload_problem
from trajevo.capacity.robust import robust_slowdown, worst_case
from trajevo.capacity.slowdown import slowdown_for
from trajevo.capacity.uncertainty import price_along_path, price_of_uncertainty, robust_problem
from trajevo.dynamics.rollout import Rollout
from trajevo.plots.payload import uncertainty_price
from trajevo.problems import HybridManipulator, ViaPointProblem

mpl.use("Agg")
POINTS = [[0.0, -1.2, 1.4, -1.7, -1.57, 0.0], [1.0, -0.9, 1.2, -1.9, -1.2, 0.8], [2.0, -1.3, 1.6, -1.8, -1.57, 0.0]]
TOLERANCES, SHARES = (0.0, 0.03, 0.06, 0.09), (0.0, 0.02, 0.05, 0.1)
NOMINAL = Payload(8.0, (0.0, 0.0, 0.1))
BOX = [[-0.03, -0.03, 0.07], [0.03, 0.03, 0.13]]


def ur5(**changes) -> ViaPointProblem:
    """Two segments that the shoulder's torque bounds once the load is not known well."""
    settings = {
        "robot": {"name": "ur5", "tool": "tool0", "limits": {"acceleration": 1e3, "jerk": 1e6}},
        "points": POINTS,
        "duration_bounds": (0.2, 5.0),
        "objectives": ["time", "energy"],
        "constraints": ["position", "velocity", "effort"],
        "payload": NOMINAL,
        "samples": 4,
    }
    return ViaPointProblem(**(settings | changes))


@pytest.fixture(scope="module")
def price():
    return price_of_uncertainty(ur5(), TOLERANCES, mass_tolerances=SHARES, seed=1, starts=2)


@pytest.fixture(scope="module")
def motion(price):
    return ur5().rollout(price.X[:1])


def worst(rollout, i, price, samples):
    return worst_case(payload_effort(rollout, samples=samples), mass=price.masses[i], com=price.com[i]).used


def test_least_time_rises_with_the_uncertainty_from_that_of_the_known_payload(price):
    nominal = price_of_uncertainty(ur5(), [], seed=1, starts=2)
    assert nominal.times.tolist() == pytest.approx(price.times[:1].tolist(), rel=1e-6)
    assert price.tolerances.tolist() == list(TOLERANCES)
    np.testing.assert_allclose(price.masses, 8.0 * (1.0 + np.outer(SHARES, [-1.0, 1.0])))
    np.testing.assert_allclose(price.com[1], BOX)
    assert (np.diff(price.times) >= 0.0).all()
    assert price.price[0] == 0.0
    assert price.price[-1] > 0.15
    assert not price.times.flags.writeable


def test_every_payload_of_the_box_keeps_every_limit_and_one_uses_it_up(price):
    problem = ur5()
    for i, x in enumerate(price.X):
        rollout = problem.rollout(x)
        used = worst(rollout, i, price, problem.dynamics.samples)
        assert used <= 1.0 + 1e-6
        assert problem.evaluate(x[None])[1].max() <= 1e-6
        assert problem.evaluate(x[None])[0][0, 0] == pytest.approx(price.times[i], rel=1e-9)
        for wider in range(i + 1, len(price.X)):
            assert worst(rollout, wider, price, problem.dynamics.samples) > used
    assert used == pytest.approx(1.0, abs=1e-6)


def test_feasible_for_a_wide_box_is_feasible_for_a_narrow_one():
    problem = ur5(limits="sampled")
    wide, narrow = (
        robust_problem(problem, mass=(8.0 - w, 8.0 + w), com=[[-w / 20.0] * 3, [w / 20.0] * 3]) for w in (1.0, 0.4)
    )
    x = np.random.default_rng(2).uniform(problem.xl, problem.xu, (50, problem.n_var))
    G_wide, G_narrow, G = (one.evaluate(x)[1] for one in (wide, narrow, problem.with_payload(Payload(8.0))))
    assert (G_wide >= G_narrow).all()
    assert (G_narrow >= G - 1e-9).all()
    assert (G_wide > G).any(axis=1).all()


def test_a_robust_problem_is_the_same_but_for_its_effort_limits():
    for problem in (ur5(effort_margin=0.1, tool_speed=2.0), HybridManipulator()):
        robust = robust_problem(problem, mass=(5.0, 7.0), com=BOX)
        assert robust.registered_name == ""
        assert robust.constraint_names == problem.constraint_names
        assert robust.objective_names == problem.objective_names
        assert (robust.angle, robust.length) == (problem.angle, problem.length)
        x = np.random.default_rng(3).uniform(problem.xl, problem.xu, (8, problem.n_var))
        (F, G), (own_F, own_G) = robust.evaluate(x)[:2], problem.evaluate(x)[:2]
        effort = np.array(["effort of" in name for name in problem.constraint_names])
        np.testing.assert_array_equal(F, own_F)
        np.testing.assert_array_equal(G[:, ~effort], own_G[:, ~effort])
        assert (G[:, effort] != own_G[:, effort]).any()


def test_a_margin_of_the_effort_limits_is_kept():
    kept, whole = (robust_problem(ur5(effort_margin=m), mass=(5.0, 7.0), com=BOX) for m in (0.1, 0.0))
    x = np.random.default_rng(4).uniform(whole.xl, whole.xu, (8, whole.n_var))
    effort = [name.startswith("effort of") for name in whole.constraint_names]
    used, used_of_all = (1.0 + problem.evaluate(x)[1][:, effort] for problem in (kept, whole))
    np.testing.assert_allclose(0.9 * used, used_of_all, rtol=1e-12)


def test_an_evolutionary_algorithm_takes_a_robust_problem():
    problem = robust_problem(ur5(), mass=(7.5, 8.5), com=BOX)
    front = optimise(problem, seed=1, generations=8, population=20, progress=False, polish=False)
    assert len(front) > 3
    for x in front.X:
        effort = payload_effort(problem.rollout(x), samples=4)
        assert worst_case(effort, mass=(7.5, 8.5), com=BOX).feasible


@pytest.mark.parametrize("model", mostly_long(COM_MODELS, "rigid"))
@pytest.mark.parametrize("count", mostly_long([4, 20], 4))
def test_slowed_down_every_payload_is_carried_and_one_binds(motion, model, count):
    unhurried = replace(motion.robot.limits, velocity=np.full(6, np.inf))
    robot = replace(motion.robot, limits=unhurried)
    dynamics = replace(motion.dynamics, robot=robot, payload=replace(NOMINAL, model=model))
    path = Rollout(dynamics, motion.trajectory)
    found = robust_slowdown(path, mass=(7.2, 8.8), com=BOX)
    assert found.duration == pytest.approx(found.factor * motion.trajectory.duration[0])
    assert found.binding.payload in found.payloads
    effort = payload_effort(Rollout(dynamics, path.trajectory.slowed(found.factor)), samples=200)
    used = worst_case(effort, mass=(7.2, 8.8), com=BOX).used
    assert used == pytest.approx(1.0, abs=1e-5)
    rng = np.random.default_rng(4)
    corners = np.array(np.meshgrid((7.2, 8.8), *np.array(BOX).T)).reshape(4, -1).T
    drawn = np.column_stack([rng.uniform(7.2, 8.8, count), rng.uniform(*BOX, (count, 3))])
    factors = [
        slowdown_for(path, Payload(mass, tuple(com), model=model)).factor
        for mass, *com in np.concatenate([corners, drawn]).tolist()
    ]
    assert max(factors) <= found.factor * (1.0 + 1e-6)
    assert max(factors) == pytest.approx(found.factor, rel=1e-6)


def test_along_a_path_a_known_payload_is_slowed_as_ever(motion):
    at = NOMINAL.com
    assert robust_slowdown(motion, mass=(8.0, 8.0), com=[at, at]).factor == slowdown_for(motion, NOMINAL).factor


def test_re_optimised_is_never_slower_than_along_the_path(price, motion):
    fixed = price_along_path(motion, TOLERANCES, mass_tolerances=SHARES, samples=4)
    assert fixed.X is None
    assert (np.diff(fixed.times) >= 0.0).all()
    assert (price.times <= fixed.times * (1.0 + 1e-6)).all()
    assert fixed.times[-1] > 1.1 * fixed.times[0]


def test_what_no_speed_carries_is_told(motion):
    found = price_along_path(motion, [0.1, 1.0])
    assert np.isfinite(found.times).tolist() == [True, True, False]
    assert np.isinf(found.price[-1])
    again = price_along_path(motion, [0.0, 0.0, 0.0], mass_tolerances=[0.0, 0.1, 0.2])
    assert (np.diff(again.times) >= 0.0).all()
    refused(lambda: robust_slowdown(motion, mass=(8.0, 80.0), com=BOX), "^payload: expected at most .* kg")


def test_the_picture_shows_times_prices_and_what_was_not_found(price, motion):
    missed = price_along_path(motion, [0.1, 1.0])
    ax = uncertainty_price({"re-optimised": price, "same path": missed})
    lines = ax.get_lines()
    np.testing.assert_allclose(lines[0].get_xydata(), np.column_stack([1e3 * price.tolerances, price.times]))
    assert [len(line.get_xdata()) for line in lines[1:]] == [2, 1, 0]
    assert lines[2].get_xdata().tolist() == [1000.0]
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # a layout that cannot be made is no more than a warning
        ax.figure.canvas.draw()
    (shares,) = ax.child_axes
    np.testing.assert_allclose(100.0 * (np.array(ax.get_ylim()) / price.times[0] - 1.0), shares.get_ylim(), rtol=1e-9)
    labels = [text.get_text() for text in ax.get_legend().get_texts()]
    assert labels == ["re-optimised, 8 kg, at the end 7.2 to 8.8 kg", "same path, 8 kg", "no motion found"]
    assert uncertainty_price(price, ax=plt.figure().gca()).get_legend().get_texts()[0].get_text().startswith("8 kg")
    plt.close("all")
    refused(lambda: uncertainty_price({}), "^prices: expected at least one")


def test_bad_input_is_refused(motion):
    problem = ur5()
    for bad in ([0.02, 0.01], [-0.01], [np.nan], 0.01, "wide"):
        refused(lambda bad=bad: price_of_uncertainty(problem, bad, seed=1), "^tolerances: expected")
        refused(lambda bad=bad: price_along_path(motion, bad), "^tolerances: expected")
    for bad in ([0.1], [0.2, 0.1], [0.0, 1.1], [-0.1, 0.0]):
        call = {"mass_tolerances": bad, "seed": 1}
        refused(lambda call=call: price_of_uncertainty(problem, [0.0, 0.01], **call), "^mass_tolerances: expected")
    refused(lambda: price_of_uncertainty(ur5(payload=0.0), [0.01], seed=1), "^payload: expected one with mass")
    timeless = ur5(objectives=["energy", "jerk"])
    refused(lambda: price_of_uncertainty(timeless, [0.01], seed=1), "expected the time among the objectives")
    heavy = ur5(payload=50.0)
    refused(lambda: price_of_uncertainty(heavy, [], seed=1, starts=1), "a motion that carries its payload, none found")
    box = {"mass": (1.0, 2.0), "com": BOX}
    refused(lambda: robust_problem(small_problem(), **box), "^problem: expected effort limits among its constraints")
    refused(lambda: robust_problem(HybridManipulator(payload_model="tool_axis"), **box), "'tool_axis' acts at")
    variable = max_payload_problem(HybridManipulator(), (0.0, 10.0))
    refused(lambda: robust_problem(variable, **box), "^problem: .* its mass is a decision variable")
    refused(lambda: robust_problem(problem, mass=(2.0, 1.0), com=BOX), "^mass: expected the least before the greatest")
