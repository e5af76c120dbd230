"""First populations: feasible by stretching times, on limits or bounds, repeatable; fronts as seeds across payloads."""

from pathlib import Path

import numpy as np
import pytest
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.algorithms.moo.rvea import RVEA
from pymoo.util.ref_dirs import get_reference_directions

from tests.helpers import UNDRAWN, any_problem, impossible, mostly_long, refused, small_problem, trajevo
from trajevo import Front, TrajectoryProblem, load_problem, load_task, optimise
from trajevo.dynamics.path_effort import allowed_speeds, greatest_allowed
from trajevo.formulation.constraints.joint_limits import kinematic_limits
from trajevo.formulation.constraints.motion_limits import time_limit
from trajevo.formulation.registry import list_problems
from trajevo.formulation.search import Search
from trajevo.problems import HybridManipulator, PickAndPlace, PointingMechanism
from trajevo.robot.payload import Payload
from trajevo.solvers.evolutionary.algorithms import ALGORITHMS, algorithm_for
from trajevo.solvers.evolutionary.first_population import STARTS, first_population, warm_start
from trajevo.solvers.evolutionary.stretching import Limits, Stretching, in_seconds
from trajevo.solvers.run.folder import RunFolder
from trajevo.solvers.run.runs import resume
from trajevo.study.definition import Study

TASKS = ("ur5_pick_and_place", "panda_six_points", "xarm7_obstacle")
PROBLEMS = {name: lambda name=name: any_problem(name) for name in list_problems()} | {
    name: lambda name=name: load_task(f"problems/tasks/{name}.toml").problem for name in TASKS
}
PROBLEMS["payload as a variable"] = lambda: HybridManipulator(objectives=["time", "unused_payload"])
SMALL = {"generations": 6, "population": 16, "progress": False, "polish": False}


def limits_of(problem: TrajectoryProblem, X: np.ndarray) -> np.ndarray:
    return problem.evaluate(X, return_values_of=["F", "G"])[1]


def feasible(problem: TrajectoryProblem, X: np.ndarray) -> np.ndarray:
    return (limits_of(problem, X) <= 0.0).all(axis=1)


def touching(problem: TrajectoryProblem, X: np.ndarray) -> np.ndarray:
    """Whether a limit is used to the full, or a time is at a bound."""
    at_bound = (problem.xl * (1.0 + 1e-9) >= X) | (problem.xu * (1.0 - 1e-9) <= X)
    return (limits_of(problem, X).max(axis=1) >= -1e-6) | (at_bound & in_seconds(problem)).any(axis=1)


@pytest.fixture(params=mostly_long(PROBLEMS, "hybrid", "reparam", "via-points", "panda_six_points"), scope="module")
def problem(request) -> TrajectoryProblem:
    return PROBLEMS[request.param]()


@pytest.mark.thinned(5)
@pytest.mark.parametrize("starts", ["stretched", "fastest", "spread"])
def test_every_individual_keeps_the_limits(problem, starts):
    found = first_population(problem, 16, starts=starts, seed=1)
    assert found.X.shape == (16, problem.n_var)
    assert ((problem.xl <= found.X) & (problem.xu >= found.X)).all()
    assert feasible(problem, found.X).all()
    assert len(np.unique(found.X, axis=0)) == 16
    assert found.evaluations >= 16


@pytest.mark.thinned(2)
def test_what_is_stretched_touches_a_limit_or_a_bound(problem):
    stretching = Stretching.of(Limits(problem))
    X = np.random.default_rng(0).uniform(problem.xl, problem.xu, (32, problem.n_var))
    Y, G = stretching.mended(X)
    np.testing.assert_array_equal(G, limits_of(problem, Y))
    before, changed = feasible(problem, X), (X != Y).any(axis=1)
    assert not (before & changed).any()
    good = changed & feasible(problem, Y)
    assert touching(problem, Y[good]).all()
    assert (Y[good] >= X[good]).all()
    np.testing.assert_array_equal(Y[:, ~in_seconds(problem)], X[:, ~in_seconds(problem)])


@pytest.mark.thinned(2)
def test_the_fastest_touch_a_limit_or_a_bound(problem):
    X = first_population(problem, 16, starts="fastest", seed=2).X
    if Stretching.of(Limits(problem)).possible:
        assert touching(problem, X).all()


def test_no_less_stretch_would_do(problem):
    stretching = Stretching.of(Limits(problem))
    X = np.random.default_rng(1).uniform(problem.xl, problem.xu, (32, problem.n_var))
    G = limits_of(problem, X)
    factors = stretching.least_factors(X, G, quicker=False)
    assert (factors >= 1.0).all()
    asked = factors > 1.001
    times = stretching.times
    just, less = (np.where(times, X * (share * factors)[:, None], X)[asked] for share in (1.0, 0.9999))
    # Beyond the bounds of the variables on purpose: the factor is that of the limits alone.
    assert feasible(problem, just)[(limits_of(problem, just)[:, np.isnan(stretching.powers)] <= 0.0).all(axis=1)].all()
    assert not feasible(problem, less).any()
    np.testing.assert_array_equal(factors[feasible(problem, X)], 1.0)


def test_powers_are_those_of_the_limits():
    powers = Stretching.of(Limits(HybridManipulator())).powers
    expected = {"position": 0, "velocity": -1, "acceleration": -2, "jerk": -3}
    for name, power in zip(HybridManipulator().constraint_names, powers, strict=True):
        kind = name.split(" of ")[0]
        assert power == expected[kind] if kind in expected else kind == "effort" or power == -1
    certified = load_task("problems/tasks/panda_six_points.toml").problem
    task = load_problem("via-points", **(certified.settings | {"limits": "sampled"}))
    assert dict(zip(task.constraint_names, Stretching.of(Limits(task)).powers, strict=True))["tool speed"] == -1


def test_a_longest_time_bounds_the_stretch():
    robot = small_problem().robot
    problem = small_problem(constraints=(*kinematic_limits(robot), time_limit(8.0)))
    for starts in ("stretched", "fastest", "spread"):
        X = first_population(problem, 64, starts=starts, seed=1).X
        assert feasible(problem, X).all()
        assert X.sum(axis=1).max() <= 8.0
    assert X.sum(axis=1).max() > 7.5


def test_spread_reaches_from_the_limits_to_the_bounds():
    problem = PointingMechanism()
    fast, spread = (first_population(problem, 100, starts=name, seed=1).X.sum(axis=1) for name in ("fastest", "spread"))
    assert spread.min() < 1.2 * fast.min()
    assert spread.max() > 1.5 * np.median(fast)


@pytest.mark.parametrize("starts", mostly_long(list(STARTS), *[*STARTS][::2]))
def test_a_seed_repeats_and_another_does_not(starts):
    problem = PickAndPlace()
    one, again, other = (first_population(problem, 20, starts=starts, seed=seed).X for seed in (3, 3, 4))
    np.testing.assert_array_equal(one, again)
    assert not np.array_equal(one, other)
    assert not one.flags.writeable


@pytest.mark.parametrize("starts", ["sobol", "latin_hypercube"])
def test_times_are_even_in_their_logarithms(starts):
    problem = HybridManipulator()
    X = np.log(first_population(problem, 128, starts=starts, seed=1).X)
    low, high = np.log(problem.xl), np.log(problem.xu)
    counts = [np.histogram((X[:, k] - low[k]) / (high[k] - low[k]), 8, (0.0, 1.0))[0] for k in range(problem.n_var)]
    assert (np.array(counts) == 16).all()


def test_half_of_the_individuals_are_near_the_plain_motion():
    free = load_problem("via-points", robot="feed_drive", points=[[0.0, 0.0], [0.05, 0.02], [0.1, 0.1]])
    assert free.settings["interpolant"] == "bspline"
    departs = np.array([variable.departs for variable in free.variables])
    assert departs.tolist() == [not variable.name.startswith("dt_") for variable in free.variables]
    low, high = free.xl[departs], free.xu[departs]
    how_far = {}
    for starts in ("random", "fastest"):
        X = first_population(free, 128, starts=starts, seed=1).X[:, departs]
        how_far[starts] = np.abs(2.0 * (X - low) / (high - low) - 1.0).max(axis=1)
    assert (how_far["random"] > 0.9).mean() > 0.6
    assert 0.3 <= (how_far["fastest"] > 0.9).mean() <= 0.5
    assert how_far["random"].min() > 0.3
    assert how_far["fastest"].min() < 0.1


def test_where_nothing_is_feasible_those_are_taken_that_break_least():
    robot = small_problem().robot
    problem = small_problem(constraints=(impossible(robot, 0.5),))
    assert first_population(problem, 10, starts="spread", seed=1).X.shape == (10, 2)


def test_intervals_of_many_motions_are_those_of_each():
    generator = np.random.default_rng(0)
    lower = generator.uniform(0.0, 1.0, (200, 12)).round(1)
    upper = lower + generator.uniform(-0.2, 0.4, lower.shape).round(1)
    upper[::2, 3] = np.inf
    for found, low, high in zip(greatest_allowed(lower, upper), lower, upper, strict=True):
        speeds, _ = allowed_speeds(low, high)
        assert found == (speeds[-1, 1] if len(speeds) else 0.0)


@pytest.mark.parametrize("algorithm", ["nsga2", "rvea"])
def test_a_resumed_run_is_that_which_was_not_interrupted(algorithm, tmp_path, stopped_after):
    directions = get_reference_directions("das-dennis", 3, n_partitions=4)
    given = {"algorithm": RVEA(directions, pop_size=16), "generations": 6, "progress": False, "polish": False}
    settings = {"seed": 2, "starts": "spread"} | (SMALL if algorithm == "nsga2" else given)
    expected = optimise(PointingMechanism(), **settings)
    assert expected.run.settings["starts"] == "spread"
    assert expected.run.settings["starts_evaluations"] > 16
    assert expected.history.least_violation[0] == 0.0
    stopped_after(2)
    optimise(PointingMechanism(), out=tmp_path / "run", **settings)
    stopped_after(None)
    last = resume(tmp_path / "run", progress=False)
    assert all(np.array_equal(getattr(last, name), getattr(expected, name)) for name in "XFG")
    assert last.run.settings == expected.run.settings


@pytest.mark.parametrize("name", ALGORITHMS)
def test_every_algorithm_by_name_begins_with_them(name, tmp_path):
    problem = PointingMechanism()
    search = Search(seed=1, algorithm=name, population=16, generations=1, polish=False)
    assert algorithm_for(search, problem).starts == "spread"
    optimise(problem, search, out=tmp_path, progress=False)
    X = next(iter(RunFolder(tmp_path).blocks(1))).X
    np.testing.assert_array_equal(X, first_population(problem, len(X), starts="spread", seed=1).X)


def test_an_algorithm_that_is_passed_is_not_changed_and_random_starts_are_its_own():
    algorithm = NSGA2(pop_size=16)
    sampling = algorithm.initialization.sampling
    optimise(PointingMechanism(), seed=1, generations=1, algorithm=algorithm, starts="spread", progress=False)
    assert algorithm.initialization.sampling is sampling
    own = first_population(PointingMechanism(), 16, starts="sobol", seed=5).X
    front = optimise(
        PointingMechanism(), seed=1, generations=1, algorithm=NSGA2(pop_size=16, sampling=own), progress=False
    )
    assert "starts" not in front.run.settings


def test_given_individuals_come_first_and_starts_fill_the_rest(tmp_path):
    given = first_population(PointingMechanism(), 5, starts="fastest", seed=9).X
    for settings in (SMALL, {"algorithm": NSGA2(pop_size=16), "progress": False, "polish": False, "generations": 6}):
        front = optimise(PointingMechanism(), seed=1, initial=given, starts="spread", out=tmp_path / "run", **settings)
        assert (front.run.settings["initial"], front.run.settings["starts"]) == (5, "spread")
        block = next(iter(RunFolder(tmp_path / "run").blocks(6)))
        np.testing.assert_array_equal(block.X[:5], given)
        tmp_path /= "other"


@pytest.fixture(scope="module")
def unloaded() -> Front:
    return optimise(HybridManipulator(payload=0.0), seed=1, generations=60, population=40, polish=False, progress=False)


def test_a_front_of_another_payload_is_stretched(unloaded):
    loaded = HybridManipulator(payload=12.0, payload_bounds=(0.0, 12.5))
    chosen = warm_start(loaded, unloaded, len(unloaded)).X
    broken = ~feasible(loaded, unloaded.X)
    assert broken.any()
    np.testing.assert_array_equal(chosen[~broken], unloaded.X[~broken])
    assert (chosen[broken] > unloaded.X[broken]).any(axis=1).all()
    assert feasible(loaded, chosen).mean() > 0.95
    front = optimise(loaded, seed=1, initial=unloaded, generations=1, population=40, polish=False, progress=False)
    cold = optimise(loaded, seed=1, generations=1, population=40, polish=False, progress=False)
    assert front.run.settings["initial"] <= 40
    assert front.history.hypervolume[0] > cold.history.hypervolume[0]


def test_a_front_of_one_payload_seeds_one_whose_payload_is_a_variable(unloaded):
    problem = HybridManipulator(objectives=["time", "unused_payload"])
    X = warm_start(problem, unloaded, 20).X
    assert len(X) == 20
    np.testing.assert_array_equal(X[:, -1], 0.0)
    narrow = HybridManipulator(payload=2.0, objectives=["time", "unused_payload"], payload_bounds=(1.0, 5.0))
    refused(lambda: warm_start(narrow, unloaded, 20), "initial: expected a front with a payload of 1 to 5 kg, got 0 kg")


def test_a_front_from_a_file_does_too(unloaded, tmp_path):
    unloaded.save(tmp_path / "front.json")
    again = Front.load(tmp_path / "front.json")
    loaded = HybridManipulator(payload=2.0)
    np.testing.assert_array_equal(warm_start(loaded, again, 30).X, warm_start(loaded, unloaded, 30).X)


def test_fronts_of_other_problems_are_refused(unloaded):
    refused(lambda: warm_start(PointingMechanism(), unloaded, 20), "initial: .*got one with other variables")
    backwards = HybridManipulator(positions=HybridManipulator().positions[::-1])
    refused(lambda: warm_start(backwards, unloaded, 20), "initial: .*got one whose decision vectors are other")
    robot = small_problem().robot
    empty = optimise(small_problem(constraints=(impossible(robot, 0.5),)), seed=1, **SMALL)
    refused(lambda: warm_start(small_problem(), empty, 20), "initial: expected a front with members")


def test_bad_input_is_refused(tmp_path):
    problem = PointingMechanism()
    for call, says in (
        (lambda: first_population(problem, 20, starts="magic", seed=1), "unknown starts 'magic'; known: fastest"),
        (lambda: first_population(problem, 0, starts="spread", seed=1), "size: .*at least 1, got 0"),
        (lambda: first_population(problem, 20, starts="spread", seed=-1), "seed: .*at least 0, got -1"),
        (lambda: optimise(problem, seed=1, starts="magic", **SMALL), "unknown starts 'magic'"),
        (lambda: optimise(problem, seed=1, starts=3, **SMALL), "unknown starts 3: expected a name, got int"),
    ):
        refused(call, says)
    own = NSGA2(pop_size=16, sampling=np.full((16, 4), 2.0))
    says = "starts: expected an algorithm that draws its first population, got NSGA2"
    refused(lambda: optimise(problem, seed=1, algorithm=own, starts="spread", progress=False), says)
    said = trajevo("solve", "pointing", "--starts", "magic", "--out", tmp_path / "run")
    assert said.returncode == 2
    assert "unknown starts 'magic'" in said.stderr
    assert not (tmp_path / "run").exists()


def test_time_limits_hold_for_starts_too():
    front = optimise(small_problem(), seed=1, starts="spread", time_limit=20.0, **SMALL)
    np.testing.assert_array_equal(front.F, optimise(small_problem(), seed=1, starts="spread", **SMALL).F)


def test_command_line_and_tasks(tmp_path):
    options = ["--starts", "spread", "--generations", 3, "--population", 8, "--no-polish", "--quiet"]
    options += ["--algorithm", "sms-emoa", *UNDRAWN]
    assert trajevo("solve", "pointing", *options, "--out", tmp_path / "run").returncode == 0
    assert Front.load(tmp_path / "run" / "front.json").run.settings["starts"] == "spread"
    text = Path("problems/tasks/panda_six_points.toml").read_text(encoding="utf-8")
    (tmp_path / "task.toml").write_text(text + 'starts = "spread"\n')
    front = load_task(tmp_path / "task.toml").solve(generations=2, population=8, polish=False, progress=False)
    assert front.run.settings["starts"] == "spread"


def test_starts_are_a_factor_of_a_study():
    factors = {"starts": ["spread", "sobol"]}
    study = Study("pointing", seed=1, factors=factors, repeats=1, generations=2, algorithm="sms-emoa", population=8)
    assert [job["search"]["starts"] for job in study.jobs] == ["spread", "sobol"]
    search = Search.of(**study.jobs[0]["search"], seed=1)
    assert optimise(PointingMechanism(), search, progress=False).run.algorithm == "SMSEMOA"
    refused(lambda: Study("pointing", seed=1, starts="magic"), "fixed.starts: .*unknown starts 'magic'")


def test_payloads_of_other_shapes_are_stretched_for():
    problem = PickAndPlace(payload=Payload(4.0, (0.05, 0.0, 0.1), model="weight_only"))
    assert feasible(problem, first_population(problem, 20, starts="fastest", seed=1).X).all()
