"""Bounds of fronts: nothing that can be found lies below them, and a killed search goes on as if it had not been."""

import dataclasses
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from tests.helpers import UNDRAWN, refused, same_bound, small_problem, trajevo
from trajevo import ViaPointProblem, bound_front, optimise, plots
from trajevo.formulation.constraints.joint_limits import kinematic_limits
from trajevo.problems import PickAndPlace, PointingMechanism
from trajevo.problems.puma_kinematics import TABLE_1_JOINTS
from trajevo.verification import bound_front as searching
from trajevo.verification.bounds.curves import Curves
from trajevo.verification.bounds.question import Question

SMALL = {"generations": 15, "population": 24, "progress": False}


@pytest.fixture(scope="module")
def front():
    return optimise(small_problem(), seed=1, **SMALL)


@pytest.fixture(scope="module")
def bound(front):
    return bound_front(front, gap=0.003)


def test_the_gap_is_as_small_as_asked_for_and_encloses_what_was_found(bound, front):
    assert bound.ended == "gap"
    assert 0.0 <= bound.missing <= bound.gap <= 0.003
    assert (bound.lower <= bound.upper).all()
    assert (bound.upper <= front.F.min(axis=0)).all()
    assert not bound.excludes(front.F).any()
    assert np.nanmax(bound.better) < 0.05


def test_a_dense_grid_of_ratios_is_nowhere_below(bound, front):
    asked = Question.of(front.problem)
    constants, least, most, _ = asked.at_points(np.linspace(-np.log(10.0), np.log(10.0), 4001)[:, None])
    curves = Curves(constants, least, most).real()
    for share in np.linspace(0.0, 1.0, 9):
        pace = curves.least + share * (curves.most - curves.least)
        assert not bound.excludes(curves.constants * pace[:, None] ** asked.powers).any()


def test_what_is_better_than_the_bound_says_is_excluded(bound, front):
    better = front.F * (1.0 - np.nanmax(bound.better)) * 0.999
    assert bound.excludes(better).all()


def test_lower_points_are_below_every_motion(bound, front):
    points = bound.points(40)
    assert (points[:, None] <= front.F).all(axis=2).any(axis=0).all()


class _KilledError(Exception):
    pass


def test_ctrl_c_ends_it_with_what_is_proven_and_it_goes_on_to_the_same_bound(front, bound, tmp_path):
    file, told = tmp_path / "a.bound.npz", []

    def interrupt(line):
        told.append(line)
        if len(told) == 3:
            signal.raise_signal(signal.SIGINT)

    found = bound_front(front, gap=0.003, file=file, tell=interrupt)
    assert (found.ended, len(told)) == ("stopped", 3)
    assert found.gap > 0.003
    assert not found.excludes(front.F).any()
    same_bound(bound_front(front, gap=0.003, file=file), bound)


def test_a_killed_search_goes_on_to_the_same_bound(front, bound, tmp_path, monkeypatch):
    monkeypatch.setattr(searching, "_WRITTEN", 0.0)
    file, told = tmp_path / "a.bound.npz", []

    def kill(line):
        told.append(line)
        if len(told) == 4:
            raise _KilledError

    with pytest.raises(_KilledError):
        bound_front(front, gap=0.003, file=file, tell=kill)
    again = bound_front(front, gap=0.003, file=file)
    same_bound(again, bound)


def test_a_search_of_another_front_or_a_damaged_file_begins_anew(front, tmp_path):
    file = tmp_path / "a.bound.npz"
    first = bound_front(front, gap=0.05, file=file)
    other = bound_front(front[:20], gap=0.9, file=file)
    assert other.front != first.front
    file.write_bytes(b"no file of arrays")
    with pytest.warns(UserWarning, match="a bound that was kept cannot be read and counts as none"):
        bound_front(front, gap=0.5, file=file)


def test_a_front_that_misses_much_is_told_at_once(front):
    found = bound_front(front[:3], gap=0.001)
    assert found.ended == "missing"
    assert found.missing > 0.001


def test_limits_that_are_not_used_are_named(front):
    position, velocity, *others = kinematic_limits(front.problem.robot)
    problem = small_problem(constraints=[position, dataclasses.replace(velocity, quantity="own"), *others])
    found = bound_front(optimise(problem, seed=1, **SMALL), gap=0.2)
    assert found.left_out == ("own",)


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (PickAndPlace, "objectives: 'energy' cannot be bounded from below; time, acceleration, jerk"),
        (
            lambda: ViaPointProblem(
                robot="pointing_mechanism", points=[[0.2, 0.1], [0.0, 0.3], [-0.2, 0.0]], duration_bounds=(1.0, 9.0)
            ),
            "interpolant: bounds from below are known of HybridQuartic, .* got BSpline",
        ),
    ],
)
def test_what_cannot_be_bounded_is_refused_with_its_name(made, said):
    refused(lambda: Question.of(made()), said)


def test_arguments_out_of_range_are_refused(front):
    refused(lambda: bound_front("run"), "^front: expected a front, as trajevo.optimise gives it .*, got str$")
    refused(lambda: bound_front(front, gap=2), "gap: expected a number from 0.0001 to 1, got 2")
    refused(lambda: bound_front(front, cpu_time="long"), "cpu_time: expected a number from 0 to inf, got 'long'")
    refused(lambda: bound_front(front, corner=[0.0, 1.0]), r"corner: expected positive numbers, got \[0.0, 1.0\]")


def test_no_objective_need_be_the_time():
    problem = ViaPointProblem(
        robot="pointing_mechanism",
        points=[[0.2, 0.1], [0.0, 0.3], [-0.2, 0.0]],
        duration_bounds=(1.0, 10.0),
        interpolant="quintic_spline",
        objectives=("peak_acceleration", "square_jerk"),
    )
    front = optimise(problem, seed=1, **SMALL)
    found = bound_front(front, gap=0.01)
    assert found.gap <= 0.01 or found.missing > 0.01
    assert not found.excludes(front.F).any()


def test_commands_pictures_and_pages_show_it(tmp_path):
    run = tmp_path / "run"
    assert (
        trajevo(
            "solve", "pointing", "--population", "20", "--generations", "3", "--out", run, "--quiet", *UNDRAWN
        ).returncode
        == 0
    )
    done = trajevo("bound", run, "--gap", "0.4", "--quiet")
    assert done.returncode == 0, done.stderr
    assert "the front misses at most" in done.stdout
    assert (run / "front.bound.npz").exists()
    assert "bound: the front misses at most" in trajevo("show", run).stdout
    assert trajevo("report", run, "--no-pictures").returncode == 0
    assert "How good the front is at best" in (run / "report.html").read_text()
    done = trajevo("bound", run, "--gap", "0")
    assert done.returncode == 2
    assert "gap: expected a number from 0.0001 to 1, got 0" in done.stderr


def test_the_band_lies_below_the_front(front, bound):
    axes = plots.front(front, bound=bound)
    line = next(line for line in axes[0].lines if line.get_label() == "no motion is below")
    x, y = line.get_data()
    for first, second in front.F:
        assert y[np.searchsorted(x, first, side="right") - 1] <= second * (1.0 + 1e-9)


@pytest.mark.long
@pytest.mark.parametrize(("interpolant", "least"), [("smooth", 13.310307), ("quintic", 10.585219)])
def test_the_pointing_mechanism_within_a_percent_and_no_run_below(interpolant, least):
    problem = PointingMechanism(interpolant=interpolant)
    found = bound_front(optimise(problem, seed=1, progress=False), gap=0.01, cpu_time=600.0)
    assert found.gap <= 0.01
    for seed in range(200):
        run = optimise(problem, seed=seed, generations=20, population=30, progress=False, polish=False)
        assert not found.excludes(run.F).any()
    fine = bound_front(optimise(problem, seed=1, progress=False), gap=0.0005, cpu_time=150.0)
    assert fine.lower[0] <= least + 1e-6
    assert fine.upper[0] - fine.lower[0] <= 1e-3


@pytest.mark.long
def test_pick_and_place_within_a_percent():
    problem = ViaPointProblem(
        robot="puma560",
        points=TABLE_1_JOINTS,
        duration_bounds=(0.5, 6.0),
        interpolant="polynomial",
        objectives=("time", "acceleration", "jerk"),
    )
    front = optimise(problem, seed=1, progress=False)
    found = bound_front(front, gap=0.01, cpu_time=600.0)
    assert found.gap <= 0.01
    for seed in range(20):
        run = optimise(problem, seed=seed, generations=20, population=30, progress=False, polish=False)
        assert not found.excludes(run.F).any()


@pytest.mark.long
def test_a_process_that_is_killed_goes_on(tmp_path):
    run, whole = tmp_path / "run", tmp_path / "whole"
    for folder in (run, whole):
        assert trajevo("solve", "pointing", "--seed", "1", "--out", folder, "--quiet", *UNDRAWN).returncode == 0
    command = (
        "from trajevo.verification import bound_front; bound_front._WRITTEN = 0.0; "
        "from trajevo.cli.main import main; main()"
    )
    process = subprocess.Popen([sys.executable, "-c", command, "bound", str(run), "--gap", "0.1", "--quiet"])
    while not (run / "front.bound.npz").exists():
        time.sleep(0.05)
    process.send_signal(signal.SIGKILL)
    process.wait()
    said = [trajevo("bound", folder, "--gap", "0.1", "--quiet").stdout.split("it ended")[0] for folder in (run, whole)]
    assert said[0] == said[1]
