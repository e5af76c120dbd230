"""Normal constraints, divide and conquer: on any problem of two objectives, whatever its gradients are."""

import warnings

import numpy as np
import pytest

from tests.helpers import impossible, mostly_long, small_problem
from trajevo import TrajectoryProblem, TrajevoError, load_robot, optimise
from trajevo.errors import GradientWarning
from trajevo.formulation.objectives import Objective, summed_rms_jerk, total_time
from trajevo.problems import HybridManipulator, PointingMechanism, TimeJerkReparameterisation
from trajevo.solvers.gradient import normal_constraint
from trajevo.solvers.gradient.normal_constraint import solve_nnc, weighting_factors
from trajevo.solvers.gradient.sqp import WeightedSum, random_starts


@pytest.fixture(scope="module")
def front():
    return solve_nnc(small_problem())


@pytest.fixture(scope="module")
def nine():
    return solve_nnc(small_problem(), points=9)


@pytest.fixture(scope="module")
def five():
    return solve_nnc(small_problem(), points=5)


def test_the_front_is_feasible_and_mutually_non_dominated(front):
    assert len(front) > 20
    assert (front.G <= 0.0).all()
    assert (np.diff(front.F[:, 0]) > 0.0).all()
    assert (np.diff(front.F[:, 1]) < 0.0).all()
    np.testing.assert_allclose(front.problem.evaluate(front.X)[0], front.F, rtol=1e-12)


def test_evolution_finds_nothing_better(front):
    evolved = optimise(small_problem(), seed=1, generations=60, population=60, progress=False, polish=False)
    for time, jerk in front.F:
        dominating = (evolved.F[:, 0] < time * (1.0 - 1e-5)) & (evolved.F[:, 1] < jerk * (1.0 - 1e-5))
        assert not dominating.any()


def test_neighbours_differ_significantly_or_their_gap_was_not_divided(front):
    normalised = (front.F - front.F.min(axis=0)) / np.ptp(front.F, axis=0)
    gaps = np.abs(np.diff(normalised, axis=0))
    assert (gaps.min(axis=1) < 0.01 + 1e-9).all()
    assert (gaps.max(axis=1) < 0.15).all()


@pytest.mark.parametrize("tolerance", mostly_long([0.05, 0.004], 0.05))
def test_a_smaller_tolerance_gives_more_points(front, tolerance):
    found = len(solve_nnc(small_problem(), tolerance=tolerance))
    assert found < len(front) if tolerance > 0.01 else found > len(front)


def test_weighting_factors_are_halvings(front):
    omega = weighting_factors(front)
    assert omega[0] == 0.0
    assert omega[-1] == 1.0
    assert (np.diff(omega) > 0.0).all()
    np.testing.assert_allclose(omega * 2**10, np.round(omega * 2**10), atol=2e-3)


def test_a_number_of_points_is_spread_evenly(nine):
    np.testing.assert_allclose(weighting_factors(nine), np.linspace(0.0, 1.0, 9), atol=1e-5)
    assert nine.run.settings["points"] == 9


def test_the_run_is_told(front):
    run = front.run
    assert run.algorithm == "NNC"
    assert run.settings["gradients"] == "complex step"
    assert run.settings["sub-problems"] == len(front)
    assert run.settings["failed"] == 0
    assert run.generations == len(front.history.hypervolume) > 4
    assert all(np.diff(front.history.hypervolume) >= 0.0)


def test_the_seed_decides(front, five):
    same, other = (solve_nnc(small_problem(), points=5, seed=seed) for seed in (0, 5))
    assert five.F.tolist() == same.F.tolist()
    np.testing.assert_allclose(other.F[[0, -1]], front.F[[0, -1]], rtol=1e-4)


def real_jerk(rollout):
    """An objective that forgets the imaginary parts: its complex step is wrong without a word."""
    return summed_rms_jerk(rollout).real * 1.0


def refusing_jerk(rollout):
    """An objective that complex numbers break."""
    jerk = summed_rms_jerk(rollout)
    if np.iscomplexobj(jerk):
        raise TypeError("no complex numbers, please")
    return jerk


@pytest.mark.parametrize(
    ("function", "says"),
    [
        (real_jerk, "finite differences for objective 'jerk': its complex step is wrong"),
        (
            refusing_jerk,
            r"objective 'jerk': complex numbers raise TypeError: no complex numbers, please \(line \d+ of .*py",
        ),
    ],
)
def test_wrong_gradients_are_noticed_told_and_replaced(function, says, five):
    objectives = (Objective("time", "s", "test", total_time), Objective("jerk", "rad/s^3", "test", function))
    with pytest.warns(GradientWarning, match=says):
        found = solve_nnc(small_problem(objectives=objectives), points=5)
    assert found.run.settings["gradients"] == "finite differences for objective 'jerk'"
    np.testing.assert_allclose(found.F, five.F, rtol=1e-4)


def test_right_gradients_are_kept_without_a_warning():
    for problem in (HybridManipulator(), PointingMechanism(), TimeJerkReparameterisation()):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            assert problem.gradients_by(random_starts(problem, 0, 2)) == "complex step"


def test_finite_differences_stay_inside_the_bounds():
    problem = small_problem(
        objectives=(Objective("time", "s", "t", total_time), Objective("jerk", "1", "t", real_jerk))
    )
    with pytest.warns(GradientWarning, match="finite differences"):
        problem.gradients_by(random_starts(problem, 0, 2))
    for corner in (problem.xl, problem.xu):
        dF = problem.evaluate_with_gradients(corner[None])[1][0]
        np.testing.assert_allclose(dF, small_problem().evaluate_with_gradients(corner[None])[1][0], rtol=1e-3)


@pytest.mark.parametrize("points", mostly_long([9, None], 9))
def test_a_search_that_fails_is_tried_again_from_its_neighbours(monkeypatch, front, nine, points):
    run, broken = WeightedSum.run, []

    def unlucky(self, start, tolerance):
        if self.half_space is not None and len(broken) < 3 and self not in broken:
            broken.append(self)
            return np.array(self.problem.xu)
        return run(self, start, tolerance)

    monkeypatch.setattr(WeightedSum, "run", unlucky)
    found = solve_nnc(small_problem(), points=points)
    assert found.run.settings["tried again"] >= 1
    assert found.run.settings["failed"] == 0
    np.testing.assert_allclose(found.F, (nine if points else front).F, rtol=1e-4)


def test_sub_problems_that_fail_for_good_are_counted_and_the_others_kept(monkeypatch):
    run = WeightedSum.run

    def hopeless(self, start, tolerance):
        return np.array(self.problem.xu) if self.half_space is not None else run(self, start, tolerance)

    monkeypatch.setattr(WeightedSum, "run", hopeless)
    found = solve_nnc(small_problem())
    assert len(found) == 2
    assert found.run.settings["failed"] == 1


@pytest.fixture(scope="module", params=mostly_long([1, None], 1))
def empty(request):
    """The front of a problem without feasible motions; each start that finds none takes its time."""
    with pytest.MonkeyPatch.context() as patch:
        if request.param is not None:
            patch.setattr(normal_constraint, "_STARTS", request.param)
        return solve_nnc(small_problem(constraints=(impossible(load_robot("pointing_mechanism"), 0.25),)))


def test_nothing_feasible_is_an_empty_front_that_says_why(empty):
    assert len(empty) == 0
    assert empty.run.settings["failed"] == 2
    assert empty.run.settings["sub-problems"] == 0


def test_objectives_that_do_not_conflict_have_a_front_of_one_point():
    twice = (Objective("time", "s", "t", total_time), Objective("again", "s", "t", total_time))
    front = solve_nnc(small_problem(objectives=twice))
    assert len(front) == 1


def test_ties_of_the_first_objective_are_broken_by_the_second():
    """The least duration of the first segment leaves the second one free where there are no limits."""
    objectives = (
        Objective("first", "s", "t", lambda rollout: rollout.trajectory.segment_durations[:, 0]),
        Objective("jerk", "rad/s^3", "t", summed_rms_jerk),
    )
    problem = small_problem(objectives=objectives, constraints=())
    front = solve_nnc(problem, points=3)
    free = problem.evaluate(np.array([[1.0, second] for second in np.linspace(1.0, 10.0, 2000)]))
    assert front.F[0, 0] == pytest.approx(1.0, rel=1e-6)
    assert front.F[0, 1] == pytest.approx(free[:, 1].min(), rel=1e-4)


class _NoProblem:
    n_obj = 2


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"problem": PointingMechanism()}, "needs a TrajectoryProblem of two objectives"),
        ({"problem": _NoProblem()}, "needs a TrajectoryProblem of two objectives"),
        ({"tolerance": 0.0}, "tolerance: expected a number between 0 and 1, got 0.0"),
        ({"tolerance": "a"}, "tolerance: expected a number between 0 and 1, got 'a'"),
        ({"seed": -1}, "seed: expected a whole number of at least 0, got -1"),
        ({"points": 1}, "points: expected a whole number of at least 2, got 1"),
    ],
)
def test_bad_arguments_get_a_sentence(arguments, says):
    with pytest.raises(TrajevoError, match=says):
        solve_nnc(**({"problem": small_problem()} | arguments))


def test_weighting_factors_need_two_points(front, empty):
    with pytest.raises(TrajevoError, match="at least two points of two objectives"):
        weighting_factors(empty)
    assert isinstance(front.problem, TrajectoryProblem)
