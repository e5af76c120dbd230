"""Polished fronts: nothing lost, nothing infeasible, the ends as far as gradients go, the gain told."""

import os
import re
import signal

import numpy as np
import pytest

from tests.helpers import UNDRAWN, impossible, mostly_long, refused, small_problem, trajevo
from trajevo import optimise
from trajevo.errors import GradientWarning, InvalidInputError
from trajevo.formulation.constraints.joint_limits import kinematic_limits
from trajevo.formulation.objectives import Objective, summed_rms_acceleration, summed_rms_jerk, total_time
from trajevo.formulation.problem import Weights
from trajevo.formulation.search import Search
from trajevo.front.front import Front
from trajevo.front.hypervolume import hypervolume
from trajevo.page.facts import run_facts
from trajevo.problems import HybridManipulator, PickAndPlace, PointingMechanism, TimeJerkReparameterisation
from trajevo.solvers.evolutionary.algorithms import ALGORITHMS
from trajevo.solvers.gradient.batch_sqp import Lockstep
from trajevo.solvers.gradient.normal_constraint import solve_nnc
from trajevo.solvers.gradient.polish import polish
from trajevo.solvers.gradient.weighted_sum import minimise_weighted
from trajevo.solvers.run.runs import resume, standing

#: Known values: docs/papers/guo2016.md, docs/papers/sun2020.md.
LEAST_COST = 2.53771208
LEAST_TIMES = {"smooth": 13.310307, "quintic": 10.585219}


def five():
    return HybridManipulator(objectives=["time", "energy", "jerk", "acceleration", "unused_payload"])


def evolved(problem, generations=25, population=40, **changes):
    settings = {"generations": generations, "population": population, "polish": False, "progress": False} | changes
    return optimise(problem, seed=1, **settings)


PROBLEMS = {
    "two": small_problem,
    "two along a path": TimeJerkReparameterisation,
    "three": PointingMechanism,
    "three with torque": PickAndPlace,
    "four": lambda: HybridManipulator(convention="printed"),
    "five": five,
}


@pytest.fixture(scope="module", params=mostly_long(PROBLEMS, "two", "three with torque"))
def polished(request):
    return polish(evolved(PROBLEMS[request.param]()), members=8)


def dominated_by(F, others):
    """Which rows of F any of the others dominates."""
    at_least, better = others[:, None] <= F[None], others[:, None] < F[None]
    return (at_least.all(axis=2) & better.any(axis=2)).any(axis=0)


def test_the_front_is_feasible_non_dominated_and_what_its_vectors_give(polished):
    front = polished.front
    assert (front.G <= 0.0).all()
    assert ((front.problem.xl <= front.X) & (front.problem.xu >= front.X)).all()
    assert not dominated_by(front.F, front.F).any()
    F, G = front.problem.evaluate(front.X, return_values_of=["F", "G"])
    np.testing.assert_allclose(F, front.F, rtol=1e-12)
    np.testing.assert_allclose(G, front.G, atol=1e-9)


def test_no_member_of_the_original_is_lost_unless_something_is_as_good(polished):
    before, after = polished.original.F, polished.front.F
    assert not dominated_by(after, before).any()
    assert (after[:, None] <= before[None]).all(axis=2).any(axis=0).all()


def test_the_hypervolume_grows_and_the_gain_is_told(polished):
    front, original = polished.front, polished.original
    assert polished.hypervolume_after > polished.hypervolume_before > 0.0
    corner = front.history.reference_point
    for told, F in ((polished.hypervolume_before, original.F), (polished.hypervolume_after, front.F)):
        assert told == pytest.approx(hypervolume(F, np.array(corner)), rel=1e-9)
    told = front.run.settings["polish"]
    assert told["hypervolume_after"] == polished.hypervolume_after
    assert told["gradients by"] == "complex step"
    assert told["seconds"] == polished.seconds > 0.0
    assert polished.refined > front.F.shape[1]
    rows = {tuple(row) for row in original.X.tolist()}
    assert polished.kept == sum(tuple(row) in rows for row in front.X.tolist())
    assert original.run.settings["polish"] is False
    history, cost = front.history, polished.evaluations + polished.gradients * front.X.shape[1]
    assert history.hypervolume == (*original.history.hypervolume, polished.hypervolume_after)
    assert history.evaluations == (*original.history.evaluations, original.run.evaluations + cost)
    assert front.run.evaluations == history.evaluations[-1]
    assert history.front_size[-1] == len(front)
    assert front.run.cpu_seconds[-1] == pytest.approx(original.run.cpu_seconds[-1] + polished.seconds)
    assert len(front.run.cpu_seconds) == len(history.evaluations) == front.run.generations + 1


def test_how_near_the_anchors_are_is_told(polished):
    told, front = polished.front.run.settings["polish"]["anchors"], polished.front
    assert [one["objective"] for one in told[: front.problem.n_obj]] == list(front.objective_names)
    for k, one in enumerate(told[: front.problem.n_obj]):
        assert one["residual"] >= 0.0
        assert one["value"] >= front.F[:, k].min()  # later rounds may find less
        assert f"least {one['objective']}: residual" in dict(run_facts(front))["anchors"]
    assert "anchors" not in dict(run_facts(polished.original))


@pytest.mark.parametrize("polished", mostly_long(PROBLEMS, "two", "three"), indirect=True)
def test_every_objective_is_at_least_as_low_as_its_optimum_from_random_starts(polished):
    problem = polished.front.problem
    if isinstance(problem, TimeJerkReparameterisation):
        pytest.skip("its limits are kept in a smooth form, which minimise_weighted does not know")
    least = polished.front.F.min(axis=0)
    for k in range(problem.n_obj):
        found = minimise_weighted(problem, Weights(tuple(np.eye(problem.n_obj)[k])), seed=0, starts=2)
        assert least[k] <= found.cost * (1.0 + 1e-5) + 1e-6


def test_the_file_comes_back_equal(polished, tmp_path):
    polished.front.save(tmp_path / "polished.json")
    problem = None if polished.front.record.name else polished.front.problem
    assert Front.load(tmp_path / "polished.json", problem=problem) == polished.front


def test_the_same_seed_gives_the_same_front_and_another_is_used():
    front = evolved(small_problem())
    first, again, other = polish(front), polish(front), polish(front, seed=7)
    np.testing.assert_array_equal(first.front.X, again.front.X)
    np.testing.assert_array_equal(first.front.F, again.front.F)
    assert first.front.run.settings["polish"]["seed"] == front.run.seed == 1
    assert other.front.run.settings["polish"]["seed"] == 7
    assert other.front.F.shape != first.front.F.shape or (other.front.F != first.front.F).any()


@pytest.mark.parametrize(("members", "generations"), mostly_long([(2, 10), (3, 25), (8, 25)], (2, 10), several=True))
def test_polishing_again_loses_nothing(members, generations):
    once = polish(evolved(HybridManipulator(convention="printed"), generations), members=members)
    twice = polish(once.front, members=members)
    assert twice.hypervolume_before == pytest.approx(once.hypervolume_after, rel=1e-9)
    assert twice.hypervolume_after >= twice.hypervolume_before


@pytest.mark.long
def test_two_objectives_come_near_the_front_of_normal_constraints():
    problem = small_problem(reference_point=(20.0, 1.0))
    exact = solve_nnc(problem, tolerance=0.004)
    found = polish(evolved(problem, generations=10, population=12))
    assert found.hypervolume_after >= 0.999 * hypervolume(exact.F, problem.reference_point)
    assert found.hypervolume_after > found.hypervolume_before


def jumping(rollout):
    """An objective without gradients where the motion is slow: complex numbers raise there."""
    if np.iscomplexobj(rollout.trajectory.duration) and (rollout.trajectory.duration.real > 8.0).any():
        raise ArithmeticError("no derivative there")
    return summed_rms_jerk(rollout)


def test_members_whose_gradients_fail_stay_and_the_others_are_refined():
    objectives = (Objective("time", "s", "t", total_time), Objective("jerk", "rad/s^3", "t", jumping))
    front = evolved(small_problem(objectives=objectives), generations=8)
    with pytest.warns(GradientWarning, match="finite differences for objective 'jerk': .*no derivative there"):
        found = polish(front)
    assert front.F[:, 0].max() > 8.0
    assert found.hypervolume_after > found.hypervolume_before
    assert found.front.F[:, 0].min() < front.F[:, 0].min()


def negative(rollout):
    """An objective that is below 0 and has no logarithm."""
    return -total_time(rollout)


def test_objectives_below_zero_are_measured_in_their_own_box():
    objectives = (
        Objective("slowness", "s", "t", negative),
        Objective("time", "s", "t", total_time),
        Objective("acceleration", "rad/s^2", "t", summed_rms_acceleration),
    )
    found = polish(evolved(small_problem(objectives=objectives)))
    assert found.original.history.reference_point is None
    assert 1.0 > found.hypervolume_after >= found.hypervolume_before > 0.0


def test_wrong_gradients_are_replaced_with_a_warning():
    real = Objective("jerk", "rad/s^3", "t", lambda rollout: summed_rms_jerk(rollout).real * 1.0)
    front = evolved(small_problem(objectives=(Objective("time", "s", "t", total_time), real)), generations=5)
    with pytest.warns(UserWarning, match="gradients by finite differences"):
        found = polish(front, members=4, rounds=1)
    assert found.front.run.settings["polish"]["gradients by"] == "finite differences for objective 'jerk'"
    assert found.hypervolume_after > found.hypervolume_before


def without_gradients(rollout):
    """An objective of the user's that refuses complex numbers."""
    if np.iscomplexobj(rollout.trajectory.duration):
        raise InvalidInputError("a table has no derivative")
    return summed_rms_jerk(rollout)


def test_what_cannot_be_polished_is_refused_with_a_sentence():
    front = evolved(small_problem(), generations=3)
    refused(lambda: polish("runs/x"), "front: expected a Front, got str")
    refused(lambda: polish(front, members=0), "members: expected a whole number of at least 1, got 0")
    refused(lambda: polish(front, rounds=1.5), "rounds: expected a whole number")
    refused(lambda: polish(front, seed=-1), "seed: expected a whole number of at least 0")
    robot = front.problem.robot
    empty = evolved(small_problem(constraints=(*kinematic_limits(robot), impossible(robot, 0.1))), generations=2)
    refused(lambda: polish(empty), "the front is empty")
    none = (Objective("time", "s", "t", total_time), Objective("jerk", "1", "t", without_gradients))
    blind = small_problem(objectives=none)
    refused(lambda: polish(evolved(blind, generations=2)), "polish: needs gradients.*a table has no derivative")
    refused(lambda: optimise(blind, seed=1, polish=True, progress=False), "polish: needs gradients")
    refused(
        lambda: optimise(small_problem(), seed=1, polish="yes", progress=False), "polish: expected True, False or None"
    )


def test_optimise_polishes_unless_told_and_keeps_both_fronts(tmp_path):
    settings = {"seed": 1, "generations": 5, "population": 20, "progress": False}
    problem = PointingMechanism()
    plain = optimise(problem, polish=False, **settings)
    found = optimise(problem, out=tmp_path, **settings)
    assert Front.load(tmp_path / "front.json") == found
    np.testing.assert_array_equal(Front.load(tmp_path / "evolved.json").F, plain.F)
    np.testing.assert_array_equal(found.F, polish(plain).front.F)
    assert found.run.settings["polish"]["hypervolume_after"] == found.history.hypervolume[-1]
    assert plain.run.settings["polish"] is False
    again = resume(tmp_path, progress=False)
    np.testing.assert_array_equal(again.F, found.F)
    assert again.history == found.history
    optimise(problem, polish=False, out=tmp_path, overwrite=True, **settings)
    assert not (tmp_path / "evolved.json").exists()
    assert len(Front.load(tmp_path / "front.json")) == len(plain)


def test_what_cannot_be_polished_is_left_as_it_is_unless_it_was_asked_for():
    limited = optimise(small_problem(), seed=1, generations=2, population=8, time_limit=60.0, progress=False)
    assert limited.run.settings["polish"] is False
    for given in ({"polish": True}, {"polish_every": 2}):
        refused(
            lambda given=given: optimise(small_problem(), seed=1, time_limit=60.0, progress=False, **given),
            "polish: gradients cannot be evaluated in a separate process",
        )


@pytest.mark.parametrize(
    "name",
    [name if name in ("nsga2", "rvea") else pytest.param(name, marks=pytest.mark.long) for name in ALGORITHMS],
)
def test_refined_members_go_on_in_the_evolution_of_any_algorithm(name):
    problem = HybridManipulator(convention="printed")
    search = Search(seed=1, algorithm=name, population=35, generations=9, polish=False)
    plain, helped = (optimise(problem, search, progress=False, **more) for more in ({}, {"polish_every": 4}))
    own, theirs = np.array(plain.history.hypervolume), np.array(helped.history.hypervolume)
    np.testing.assert_array_equal(own[:4], theirs[:4])
    assert theirs[4] > own[4]
    assert theirs[-1] > own[-1]
    spent = np.diff(helped.history.evaluations) - np.diff(plain.history.evaluations)
    assert (np.flatnonzero(spent) == [3, 7]).all()
    assert helped.run.evaluations == helped.history.evaluations[-1]
    assert helped.run.settings["polish_every"] == 4


@pytest.mark.parametrize(
    "make",
    [
        PointingMechanism,
        pytest.param(HybridManipulator, marks=pytest.mark.long),
        pytest.param(lambda: TimeJerkReparameterisation(encoding="shape"), marks=pytest.mark.long, id="shape"),
    ],
)
def test_a_run_with_refined_members_goes_on_to_the_bit(make, tmp_path, stopped_after):
    settings = {"seed": 3, "generations": 9, "population": 16, "polish_every": 2, "progress": False}
    expected = optimise(make(), **settings)
    stopped_after(4)
    first = optimise(make(), out=tmp_path / "run", **settings)
    assert (first.run.interrupted, first.run.settings["polish"]) == (True, True)
    stopped_after(None)
    last = resume(tmp_path / "run", progress=False)
    np.testing.assert_array_equal(last.F, expected.F)
    assert last.history == expected.history
    assert not last.run.interrupted


@pytest.mark.parametrize("polished", [True, False])
def test_however_short_its_cpu_time_a_run_has_a_first_generation(polished):
    front = optimise(PointingMechanism(), seed=1, cpu_time=1e-9, polish=polished, progress=False)
    assert front.run.generations == 1
    assert len(front.history.hypervolume) == len(front.run.cpu_seconds) == 1 + polished
    assert len(front) > 0


def test_a_run_ends_when_its_cpu_time_is_used_up(tmp_path):
    problem, settings = HybridManipulator(), {"seed": 1, "generations": 10**6, "population": 20, "progress": False}
    for polished in (True, False):
        out = tmp_path / str(polished)
        front = optimise(problem, cpu_time=0.5, polish=polished, out=out, **settings)
        share = 0.5 if polished else 1.0
        assert 1 < front.run.generations < 10**6
        # A checkpoint is written between what the books say of the last generation and the next look at the clock.
        assert share * 0.5 - 0.1 < front.run.cpu_seconds[front.run.generations - 1] < share * 0.5 + 0.3
        assert front.run.cpu_seconds[-1] < 1.5
        assert not front.run.interrupted
        assert (standing(out).finished, standing(out).generation) == (True, front.run.generations)
        again = resume(out, progress=False)
        assert again.run.generations == front.run.generations
    for wrong in (0.0, -1.0, "1 s", True, np.inf):
        refused(lambda wrong=wrong: optimise(problem, seed=1, cpu_time=wrong), "cpu_time: expected a positive time")


BUDGETS = [(PointingMechanism, 2000), (PointingMechanism, 4000), (HybridManipulator, 4000)]


@pytest.mark.parametrize(("make", "most"), mostly_long(BUDGETS, BUDGETS[0], several=True))
def test_a_run_evaluates_as_many_individuals_as_it_may(make, most):
    settings = {"seed": 1, "generations": 10**6, "population": 40, "starts": "random", "progress": False}
    plain = optimise(make(), evaluations=most, polish=False, **settings)
    assert plain.run.evaluations == most
    polished = optimise(make(), evaluations=most, **settings)
    assert polished.run.generations == most // 80
    # The stage at which they are used up is gone through: a filling, or a gradient of every member.
    assert 0.5 * most < polished.run.evaluations < 1.5 * most
    assert polished.history.hypervolume[-1] > plain.history.hypervolume[-1]
    again = optimise(make(), evaluations=most, **settings)
    np.testing.assert_array_equal(again.F, polished.F)
    for wrong in (0, 1.5, True):
        refused(lambda wrong=wrong: optimise(make(), seed=1, evaluations=wrong), "evaluations: expected a whole number")


@pytest.mark.parametrize("members", mostly_long([6, None], 6))
def test_polishing_ends_in_time_and_when_it_is_told_to(members, monkeypatch, tmp_path):
    front, size = evolved(HybridManipulator()), {} if members is None else {"members": members, "rounds": 1}
    whole, short = polish(front, **size), polish(front, cpu_time=0.02, **size)
    assert short.seconds < whole.seconds
    assert short.gradients < whole.gradients
    assert short.hypervolume_after >= short.hypervolume_before
    step = Lockstep.run

    def interrupted(self, *arguments):
        monkeypatch.setattr(Lockstep, "run", step)
        os.kill(os.getpid(), signal.SIGINT)
        step(self, *arguments)

    monkeypatch.setattr(Lockstep, "run", interrupted)
    settings = {"seed": 1, "generations": 3, "population": 16, "progress": False, "out": tmp_path / "run"}
    found = optimise(PointingMechanism(), **settings)
    assert (found.run.interrupted, found.run.stopped_by) == (True, "SIGINT")
    assert not standing(tmp_path / "run").finished
    last = resume(tmp_path / "run", progress=False)
    assert not last.run.interrupted
    assert last.run.settings["polish"]["gradients"] > found.run.settings["polish"]["gradients"]


def test_the_command_polishes_a_run_and_keeps_its_own_front(tmp_path):
    run, other = tmp_path / "run", tmp_path / "other.json"
    small = ("--generations", "4", "--population", "12", "--quiet", "--out", run)
    assert trajevo("solve", "pointing", "--no-polish", *UNDRAWN, *small).returncode == 0
    before = (run / "front.json").read_bytes()
    done = trajevo("polish", run, "--members", "5", "--rounds", "1", "--out", other)
    assert done.returncode == 0, done.stderr
    assert (run / "front.json").read_bytes() == before
    done = trajevo("polish", run, "--members", "5", "--rounds", "1", "--no-pictures")
    assert done.returncode == 0, done.stderr
    told = re.search(r"hypervolume (\d\.\d+) -> (\d\.\d+)", done.stdout)
    assert float(told[2]) > float(told[1])
    assert (run / "evolved.json").read_bytes() == before
    np.testing.assert_array_equal(Front.load(run / "front.json").F, Front.load(other).F)
    assert "polish" in (run / "report.html").read_text(encoding="utf-8")
    for arguments, says in (
        ((tmp_path / "nothing",), "no such run"),
        ((other,), "is a front's file, not a run's folder"),
        ((run, "--members", "0"), "members: expected"),
        ((run, "--out", run / "front.json"), "is kept"),
    ):
        failed = trajevo("polish", *arguments)
        assert failed.returncode == 2
        assert says in failed.stderr
        assert "Traceback" not in failed.stderr


def test_the_command_line_solves_with_what_it_is_told(tmp_path):
    run = tmp_path / "run"
    small = ("--generations", "6", "--population", "12", "--quiet", "--out", run)
    given = ("--polish-every", "3", "--cpu-time", "60", *UNDRAWN)
    assert trajevo("solve", "pointing", *given, *small).returncode == 0
    front = Front.load(run / "front.json")
    assert (front.run.settings["polish_every"], front.run.settings["cpu_time"]) == (3, 60.0)
    assert front.run.settings["polish"]["kept"] >= 0


def test_a_single_objective_is_polished_to_the_optimum_of_its_valley():
    problem = HybridManipulator(objectives="cost", convention="printed")
    plain = evolved(problem, generations=30)
    found = polish(plain)
    assert len(found.front) == 1
    assert found.front.F[0, 0] < plain.F[0, 0]
    assert found.anchors[0].residual < 1e-3
    other = minimise_weighted(problem, Weights((1.0,)), seed=1, initial=plain.X)
    assert found.front.F[0, 0] <= other.cost * (1.0 + 1e-6)
    told = optimise(problem, seed=1, generations=2, population=8, progress=False)
    assert told.run.settings["polish"]["anchors"][0]["objective"] == "cost"


@pytest.mark.long
@pytest.mark.parametrize("starts", ["random", "spread"])
def test_the_hybrid_manipulators_front_is_that_of_a_gradient_solver(starts):
    problem = HybridManipulator(convention="printed")
    alone = evolved(problem, generations=200, population=100, starts="random")
    found = polish(alone if starts == "random" else evolved(problem, generations=200, population=100))
    assert alone.history.hypervolume[-1] < 0.42
    assert found.hypervolume_after > 0.49
    weights = problem.paper_weights
    cost = found.front.F @ (np.array(weights.weights) / np.array(weights.scales))
    assert cost.min() == pytest.approx(LEAST_COST, abs=1e-6)


@pytest.mark.long
@pytest.mark.parametrize("interpolant", LEAST_TIMES)
def test_the_pointing_mechanisms_least_time_is_known(interpolant):
    found = polish(optimise(PointingMechanism(interpolant=interpolant), seed=1, polish=False, progress=False))
    assert found.front.F[:, 0].min() == pytest.approx(LEAST_TIMES[interpolant], rel=1e-4)


@pytest.mark.long
def test_a_path_gets_the_hypervolume_of_a_dense_front():
    problem = TimeJerkReparameterisation()
    exact = solve_nnc(problem, points=60)
    found = polish(optimise(problem, seed=1, polish=False, progress=False))
    assert found.hypervolume_after >= 0.998 * hypervolume(exact.F, problem.reference_point)
