import json
import re
import subprocess
import sys

import moocore
import numpy as np
import pytest
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.algorithms.moo.rvea import RVEA
from pymoo.algorithms.moo.sms import SMSEMOA
from pymoo.operators.crossover.sbx import SBX
from pymoo.operators.mutation.pm import PM
from pymoo.optimize import minimize
from pymoo.util.ref_dirs import get_reference_directions

from tests.helpers import failing_when_slow, impossible, nan_when_slow, refused, small_problem
from tests.reference import non_dominated
from trajevo import TrajevoError, load_robot, optimise
from trajevo.formulation.objectives import Objective, summed_rms_jerk
from trajevo.front.archive import Archive
from trajevo.problems import PointingMechanism
from trajevo.solvers.evolutionary import nsga2
from trajevo.solvers.evolutionary.nsga2 import ArrayNSGA2

SMALL = {"generations": 15, "population": 24, "progress": False}


def test_the_same_seed_gives_the_same_front_and_another_seed_another():
    first, again = (optimise(PointingMechanism(), seed=3, **SMALL, polish=False) for _ in range(2))
    for name in "XFG":
        np.testing.assert_array_equal(getattr(first, name), getattr(again, name))
    assert first.history == again.history
    assert not np.array_equal(first.X, optimise(PointingMechanism(), seed=4, **SMALL, polish=False).X)


def test_the_same_seed_gives_the_same_front_in_another_process():
    here = optimise(PointingMechanism(), seed=3, **SMALL, polish=False)
    script = (
        "import json; from trajevo.problems import PointingMechanism; from trajevo import optimise;"
        f"print(json.dumps(optimise(PointingMechanism(), seed=3, polish=False, **{SMALL!r}).X.tolist()))"
    )
    there = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    np.testing.assert_array_equal(np.array(json.loads(there.stdout)), here.X)


def test_the_front_is_feasible_mutually_non_dominated_and_sorted():
    problem = PointingMechanism()
    front = optimise(problem, seed=1, **SMALL, polish=False)
    assert (front.G <= 0.0).all()
    assert non_dominated(front.F).all()
    assert (np.diff(front.F[:, 0]) >= 0.0).all()
    F, G = problem.evaluate(front.X)
    np.testing.assert_allclose(F, front.F, rtol=1e-12)
    np.testing.assert_allclose(G, front.G, rtol=1e-9, atol=1e-12)


def test_the_archive_keeps_what_the_population_forgets():
    front = optimise(PointingMechanism(), seed=1, **SMALL, polish=False)
    assert len(front) > SMALL["population"]
    volumes = np.array(front.history.hypervolume)
    assert (np.diff(volumes) >= 0.0).all()
    box = front.F / front.history.reference_point
    assert volumes[-1] == pytest.approx(moocore.hypervolume(box, ref=np.ones(3)), rel=1e-12)


def test_archive_equals_a_comparison_of_every_pair():
    rng = np.random.default_rng(0)
    X, F, G = rng.random((300, 2)), rng.random((300, 3)), rng.normal(-1.0, 1.0, (300, 2))
    archive = Archive(2, 3, 2)
    for part in np.array_split(np.arange(300), 7):
        archive.add(X[part], F[part], G[part])
    feasible = (G <= 0.0).all(axis=1)
    expected = F[feasible][non_dominated(F[feasible])]
    np.testing.assert_array_equal(np.sort(archive.F, axis=0), np.sort(expected, axis=0))
    archive.add(X, F, G)
    assert len(archive.F) == len(expected)


def test_history_and_run_say_what_was_done():
    front = optimise(PointingMechanism(), seed=5, offsprings=10, **SMALL, polish=False)
    assert front.run.generations == 15
    starts = front.run.settings["starts_evaluations"]
    assert front.run.evaluations == front.history.evaluations[-1] == starts + 24 + 14 * 10
    assert len(front.history.hypervolume) == len(front.history.least_violation) == 15
    assert front.run.algorithm == "NSGA2"
    assert front.run.settings["offsprings"] == 10
    assert front.run.settings["crossover_probability"] == 0.85
    assert front.run.settings["mutation_probability"] == 0.15
    assert front.run.seed == 5
    assert front.run.failures == 0
    assert front.run.versions["pymoo"].startswith("0.6.")
    assert front.record.settings == PointingMechanism().settings


def test_defaults_are_the_papers():
    front = optimise(PointingMechanism(), seed=1, generations=1, progress=False, polish=False)
    assert front.run.evaluations == front.run.settings["starts_evaluations"] + 150
    assert front.run.settings == {
        "population": 150,
        "offsprings": 150,
        "crossover_probability": 0.85,
        "crossover_index": 15.0,
        "mutation_probability": 0.15,
        "mutation_index": 20.0,
        "starts": "spread",
        "starts_evaluations": front.run.settings["starts_evaluations"],
        "generations": 1,
        "polish": False,
    }


def test_the_operators_get_the_settings(monkeypatch):
    made = []

    class Spy(ArrayNSGA2):
        def __init__(self, **settings):
            made.append(settings)
            super().__init__(**settings)

    monkeypatch.setattr(nsga2, "ArrayNSGA2", Spy)
    optimise(PointingMechanism(), seed=1, generations=1, progress=False, polish=False)
    own = {"crossover_probability": 0.7, "crossover_index": 9.0, "mutation_probability": 0.2, "mutation_index": 33.0}
    optimise(
        PointingMechanism(), seed=1, generations=1, population=20, offsprings=7, progress=False, **own, polish=False
    )
    for settings, expected in zip(
        made, ((150, 150, 0.85, 15.0, 0.15, 20.0), (20, 7, 0.7, 9.0, 0.2, 33.0)), strict=True
    ):
        crossover, mutation = settings["crossover"], settings["mutation"]
        assert mutation.prob.value == 1.0
        assert (
            settings["pop_size"],
            settings["n_offsprings"],
            crossover.prob.value,
            crossover.eta.value,
            mutation.prob_var.value,
            mutation.eta.value,
        ) == expected


def test_operators_of_a_passed_algorithm_are_recorded():
    algorithm = NSGA2(pop_size=20, crossover=SBX(prob=0.6, eta=3), mutation=PM(prob=0.5, eta=7))
    front = optimise(PointingMechanism(), algorithm=algorithm, seed=1, generations=2, progress=False, polish=False)
    assert "SBX(prob=0.6" in front.run.settings["crossover"]
    assert "eta=7" in front.run.settings["mutation"]


@pytest.mark.parametrize("algorithm", [NSGA2, 5])
def test_something_that_is_no_algorithm_is_refused(algorithm):
    with pytest.raises(TrajevoError, match="algorithm: expected a name or a pymoo algorithm that has not run yet"):
        optimise(PointingMechanism(), algorithm=algorithm, seed=1, generations=2, progress=False, polish=False)


def test_an_algorithm_that_ran_already_is_refused():
    used = NSGA2(pop_size=20)
    minimize(PointingMechanism(), used, ("n_gen", 2), copy_algorithm=False, seed=1)
    with pytest.raises(TrajevoError, match="has not run yet"):
        optimise(PointingMechanism(), algorithm=used, seed=1, generations=3, progress=False, polish=False)


def test_numpy_integers_are_settings_too(tmp_path):
    front = optimise(
        PointingMechanism(),
        seed=np.int64(1),
        population=np.int64(12),
        generations=np.int64(2),
        progress=False,
        polish=False,
    )
    front.save(tmp_path / "front.json")


@pytest.mark.parametrize(
    "algorithm",
    [
        NSGA2(pop_size=20),
        SMSEMOA(pop_size=20),
        RVEA(get_reference_directions("das-dennis", 3, n_partitions=5)),
    ],
    ids=lambda algorithm: type(algorithm).__name__,
)
def test_any_pymoo_algorithm_by_argument(algorithm):
    front = optimise(PointingMechanism(), algorithm=algorithm, seed=2, generations=10, progress=False, polish=False)
    assert front.run.algorithm == type(algorithm).__name__
    assert len(front) > 0
    assert algorithm.problem is None, "the algorithm that was passed was changed"


def test_nothing_feasible_says_what_blocks_and_by_how_much():
    robot = load_robot("pointing_mechanism")
    front = optimise(small_problem(constraints=(impossible(robot, 0.25),)), seed=1, **SMALL, polish=False)
    assert len(front) == 0
    assert front.blocking.violations == {"patience": 0.25}
    assert str(front.blocking) == "nothing feasible was found; in the nearest miss patience exceeds its limit by 25 %"
    assert front.history.least_violation[-1] == 0.25
    with pytest.raises(TrajevoError, match="the front is empty: .*patience exceeds its limit by 25 %"):
        front.knee()


def test_limits_too_tight_name_the_worst_first():
    problem = PointingMechanism(duration_bounds=(1.0, 2.9))
    front = optimise(problem, seed=1, **SMALL, polish=False)
    assert len(front) == 0
    violations = list(front.blocking.violations.values())
    assert violations == sorted(violations, reverse=True)
    _, G = problem.evaluate(np.array([front.blocking.x]))
    assert max(violations) == pytest.approx(G.max(), rel=1e-9)


@pytest.mark.parametrize("bad", [failing_when_slow, nan_when_slow])
@pytest.mark.parametrize("algorithm", [None, SMSEMOA(pop_size=20)], ids=["NSGA2", "SMSEMOA"])
def test_failing_individuals_are_counted_and_never_in_the_front(bad, algorithm):
    objectives = (Objective("time", "s", "t", bad), Objective("jerk", "rad/s^3", "t", summed_rms_jerk))
    front = optimise(
        small_problem(objectives=objectives),
        seed=1,
        generations=10,
        population=20 if algorithm is None else None,
        algorithm=algorithm,
        progress=False,
        polish=False,
    )
    assert front.run.failures > 0
    assert front.run.first_failure in (
        "KeyError: 'too slow for this table'",
        "an objective or a constraint is not a finite number",
    )
    assert len(front) > 0
    assert np.isfinite(front.F).all()
    assert (front.F[:, 0] <= 15.0).all()


def test_all_individuals_failing_is_said():
    def never(rollout):
        raise RuntimeError("no licence")

    problem = small_problem(objectives=(Objective("time", "s", "t", never),))
    refused(
        lambda: optimise(problem, seed=1, starts="random", **SMALL, polish=False),
        r"objective 'time': fails for every individual, first with RuntimeError: no licence \(line \d+ of ",
    )


def test_a_problem_without_a_reference_point_gets_one_from_its_first_feasible_points():
    front = optimise(small_problem(), seed=1, **SMALL, polish=False)
    assert (np.array(front.history.reference_point) > 0.0).all()
    assert 0.0 < front.history.hypervolume[-1] < 1.0


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"population": -5}, "population: expected a whole number of at least 4, got -5"),
        ({"population": 10.5}, "population: expected a whole number"),
        ({"generations": 0}, "generations: expected a whole number of at least 1, got 0"),
        ({"seed": -1}, "seed: expected a whole number of at least 0, got -1"),
        ({"seed": None}, "seed: expected a whole number"),
        ({"offsprings": 0}, "offsprings: expected a whole number of at least 1, got 0"),
        ({"crossover_probability": 1.5}, "crossover_probability: expected a number from 0 to 1, got 1.5"),
        ({"mutation_probability": "often"}, "mutation_probability: expected a number from 0 to 1"),
        ({"algorithm": NSGA2(), "population": 10}, "population: set it on the algorithm that is passed, NSGA2"),
    ],
)
def test_bad_settings_are_refused(arguments, says):
    with pytest.raises(TrajevoError, match=says):
        optimise(PointingMechanism(), **({"seed": 1, "progress": False} | arguments), polish=False)


def test_unknown_settings_and_foreign_problems_are_refused():
    with pytest.raises(TrajevoError, match="unknown setting of a search 'sead'; known: .*seed"):
        optimise(PointingMechanism(), seed=1, sead=99, polish=False)
    with pytest.raises(TrajevoError, match="search: expected a Search, got 1; settings are passed by name, as seed=1"):
        optimise(PointingMechanism(), 1)
    with pytest.raises(TrajevoError, match="problem: expected a TrajectoryProblem, got str"):
        optimise("pointing", seed=1, polish=False)


def test_progress_goes_to_standard_error_in_plain_lines(capfd):
    optimise(PointingMechanism(), seed=1, generations=10, population=20, polish=False)
    captured = capfd.readouterr()
    assert captured.out == ""
    lines = captured.err.splitlines()
    assert len(lines) == 10
    assert lines[-1].startswith("generation 10/10  hypervolume 0.")
    assert "least violation" in lines[0]
    left = [int(line.split()[-3]) for line in lines]
    assert left == sorted(left, reverse=True)
    assert left[-1] == 0


def test_the_bar_shows_time_left_on_a_narrow_terminal():
    script = (
        "import trajevo.solvers.run.progress as p; from rich.console import Console; import time\n"
        "bar = p._Bar(100, Console(stderr=True, force_terminal=True, width=80))\n"
        "with bar:\n"
        "    for i in range(1, 4):\n"
        "        time.sleep(0.3); bar.update(p.Generation(i, 0.4718271, 0.0, 3856))\n"
    )
    shown = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stderr
    assert "3/100" in shown
    *_, last = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", shown).splitlines()
    assert re.fullmatch(r"3/100 ╸━+ 00:\d\d left, 3856 points, hypervolume 0\.4718", last)
    assert len(last) == 80
    assert last.count("━") > 25
