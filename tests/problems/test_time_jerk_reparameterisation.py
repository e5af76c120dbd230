"""The problem of running along a path in time: what may be passed, what comes out, what is refused."""

import json

import numpy as np
import pytest

from tests.helpers import mostly_long, refused
from trajevo import Front, GeometricPath, TrajevoError, load_problem, optimise
from trajevo.capacity.dlcc import dlcc, dlcc_sampled
from trajevo.problems import HybridManipulator, TimeJerkReparameterisation
from trajevo.problems.gemini_and_s import gemini_points, s_points
from trajevo.solvers.gradient.normal_constraint import solve_nnc
from trajevo.trajectory.interpolants import LinearReparameterisation, Reparameterisation

OWN = {"velocity": "80 mm/s", "acceleration": 0.5, "jerk": [20.0, "20000 mm/s^3"], "longest_time": "6 s"}


def random_x(problem, count=20, seed=0):
    return np.random.default_rng(seed).uniform(problem.xl, problem.xu, (count, problem.n_var))


@pytest.fixture(scope="module")
def csv(tmp_path_factory):
    file = tmp_path_factory.mktemp("points") / "s.csv"
    rows = "\n".join(f"{1e3 * x:.17g}, {1e3 * y:.17g}" for x, y in s_points())
    file.write_text(f"# an S\nx [mm], y [mm]\n{rows}\n")
    return file


def test_the_same_path_by_name_by_points_by_file_and_as_object(csv):
    named = TimeJerkReparameterisation(path="s")
    x = random_x(named)
    for path in (s_points(), s_points().tolist(), csv, str(csv), GeometricPath.through(s_points())):
        own = TimeJerkReparameterisation(path=path, **OWN)
        for mine, theirs in zip(own.evaluate(x), named.evaluate(x), strict=True):
            np.testing.assert_allclose(mine, theirs, rtol=1e-9)


def test_points_may_be_approximated():
    problem = TimeJerkReparameterisation(path=gemini_points(), path_control_points=12, **OWN)
    assert len(problem.path.control_points) == 12
    assert len(problem.path.parameters) == 79


def test_a_named_robot_brings_its_limits():
    problem = TimeJerkReparameterisation(path=s_points(), robot="feed_drive", longest_time=6.0)
    np.testing.assert_array_equal(problem.robot.limits.velocity, [0.08, 0.08])
    # The airfoil comes with limits of its own, but a robot that is asked for by name wins.
    assert TimeJerkReparameterisation(robot="feed_drive").robot.limits.velocity[0] == 0.08
    assert TimeJerkReparameterisation().robot.limits.velocity[0] == 0.15


@pytest.mark.parametrize(
    "arguments",
    [
        {"path": s_points(), **OWN},
        {"limits": "hull", "quadrature": "trapezoid", "control_points": 20, "order": 5},
        {"path": "s", "interpolant": "linear"},
        {"path": "s", "encoding": "shape", "jerk": "inf"},
        {"robot": "feed_drive", "velocity": ["inf", 0.1], "tolerance": 1e-4},
    ],
)
def test_settings_are_plain_data_that_make_an_equal_problem(arguments):
    problem = TimeJerkReparameterisation(**arguments)
    again = load_problem("reparam", **json.loads(json.dumps(problem.settings, allow_nan=False)))
    x = random_x(problem)
    np.testing.assert_array_equal(again.evaluate(x)[0], problem.evaluate(x)[0])
    assert again.settings == problem.settings


@pytest.mark.parametrize("limits", ["tight", "hull"])
def test_every_individual_keeps_its_limits_unless_the_longest_time_is_too_short(limits):
    problem = TimeJerkReparameterisation(limits=limits)
    x = random_x(problem, 100)
    time, G = problem.evaluate(x)[0][:, 0], problem.evaluate(x)[1]
    assert problem.constraint_names[-1] == "longest time"
    assert (G[:, :-1] <= 0.0).all()
    assert ((G[:, -1] <= 0.0) == (time <= problem.longest_time)).all()
    assert (G[:, -1] <= 0.0).any()


@pytest.mark.parametrize("limits", ["tight", "hull"])
def test_least_time_is_the_least_and_slowness_stretches_to_the_longest(limits):
    problem = TimeJerkReparameterisation(path="s", limits=limits)
    x = random_x(problem)
    x[:, -1] = 0.0
    fastest, G = problem.evaluate(x)[0], problem.evaluate(x)[1]
    np.testing.assert_allclose(G[:, :-1].max(axis=1), 0.0, atol=1e-12)
    x[:, -1] = 1.0
    slowest = problem.evaluate(x)[0]
    reachable = fastest[:, 0] <= problem.longest_time
    assert reachable.any()
    np.testing.assert_array_equal(slowest[reachable, 0], problem.longest_time)
    np.testing.assert_array_equal(slowest[~reachable, 0], fastest[~reachable, 0])
    constant = fastest[:, 1] * fastest[:, 0] ** 5
    np.testing.assert_allclose(slowest[:, 1] * slowest[:, 0] ** 5, constant, rtol=1e-12)


def test_the_shape_never_moves():
    problem = TimeJerkReparameterisation()
    x = random_x(problem, 5)
    batch = problem.decode(x)
    share = np.linspace(0.0, 1.0, 50)
    u = batch.course.parameter(np.tile(share, (5, 1)))
    reached = batch.evaluate(batch.duration[:, None] * share)
    for row in range(5):
        np.testing.assert_allclose(reached[row], problem.path(np.clip(u[row], 0.0, 1.0)), atol=1e-12)
    assert (np.diff(u, axis=1) > 0.0).all()


def test_only_the_ratios_of_rises_count():
    problem = TimeJerkReparameterisation()
    x = random_x(problem)
    scaled = x.copy()
    scaled[:, :-1] *= 0.37
    np.testing.assert_allclose(problem.evaluate(scaled)[0], problem.evaluate(x)[0], rtol=1e-8)


def test_all_rises_zero_is_the_even_run():
    problem = TimeJerkReparameterisation()
    x = np.zeros((2, 12))
    x[1, :-1] = 0.5
    F = problem.evaluate(x)[0]
    np.testing.assert_allclose(F[0], F[1], rtol=1e-9)


@pytest.mark.parametrize("limits", ["tight", "hull"])
def test_the_smooth_form_goes_there_and_back(limits):
    problem = TimeJerkReparameterisation(limits=limits)
    x = random_x(problem, 50)
    x = x[problem.evaluate(x)[0][:, 0] <= problem.longest_time]
    there = problem.smooth.into(x)
    np.testing.assert_allclose(problem.smooth.back(there), x, atol=1e-9)
    F, G = problem.smooth.problem.evaluate(there)
    np.testing.assert_allclose(F, problem.evaluate(x)[0], rtol=1e-9)
    assert (G <= 1e-9).all()
    fastest = there.copy()
    fastest[:, -1] *= 0.5  # faster than allowed: the way back ends at the least time, whose limits hold
    back = problem.smooth.back(fastest)
    assert (problem.evaluate(back)[1] <= 0.0).all()


def test_the_shape_encoding_ends_in_a_front_of_time_and_jerk():
    problem = TimeJerkReparameterisation(path="s", encoding="shape")
    assert problem.objective_names == ("time", "jerk_constant")
    front = optimise(problem, seed=1, generations=15, population=40, progress=False, polish=False)
    assert front.objective_names == ("time", "jerk")
    assert front.record.settings["encoding"] == "plain"
    assert front.run.settings["encoding"] == "shape"
    assert front.F[-1, 0] == pytest.approx(6.0, rel=1e-12)
    np.testing.assert_allclose(front.problem.evaluate(front.X)[0], front.F, rtol=1e-12)
    time, jerk = front.F.T
    assert (np.diff(time) > 0.0).all()
    assert (np.diff(jerk) < 0.0).all()
    # Every shape's own curve lies nowhere below the envelope.
    constant = jerk * time**5
    for t, c in zip(time[::20], constant[::20], strict=True):
        later = time >= t
        assert (jerk[later] <= c / time[later] ** 5 * (1.0 + 1e-9)).all()
    assert all(np.diff(front.history.hypervolume) >= -1e-3)


@pytest.mark.parametrize("encoding", mostly_long(["plain", "shape"], "shape"))
def test_seeds_are_taken_from_fronts_and_arrays(encoding):
    problem = TimeJerkReparameterisation(path="s", limits="hull", encoding=encoding)
    seeds = solve_nnc(problem, points=3)
    assert len(seeds) == 3
    front = optimise(problem, seed=1, generations=1, population=20, initial=seeds, progress=False, polish=False)
    assert front.run.settings["initial"] == 3
    assert front.F[:, 0].min() == pytest.approx(seeds.F[0, 0], rel=1e-9)
    assert front.F[:, 1].min() == pytest.approx(seeds.F[-1, 1], rel=1e-6)


def test_bad_seeds_are_refused():
    problem = TimeJerkReparameterisation(path="s")
    for initial, says in (
        (np.ones((3, 5)), r"initial: expected shape \(N, 12\)"),
        (np.ones((30, 12)), "initial: expected at most the population of 20 individuals, got 30"),
        (2.0 * np.ones((3, 12)), "initial: an individual lies outside the bounds"),
        (
            optimise(HybridManipulator(), seed=1, generations=1, population=10, progress=False, polish=False),
            "of the same problem",
        ),
    ):
        with pytest.raises(TrajevoError, match=says):
            optimise(problem, seed=1, generations=1, population=20, initial=initial, progress=False, polish=False)


def test_fronts_are_saved_and_made_again(tmp_path, csv):
    problem = TimeJerkReparameterisation(path=csv, **OWN)
    front = optimise(problem, seed=1, generations=5, population=20, progress=False, polish=False)
    front.save(tmp_path / "front.json")
    csv.write_text("")  # the front does not need the file of points any more
    again = Front.load(tmp_path / "front.json")
    assert again == front
    np.testing.assert_array_equal(
        again.knee().trajectory.evaluate([0.5], 1), front.knee().trajectory.evaluate([0.5], 1)
    )


def test_a_joint_space_path_of_a_robot_with_force_limits():
    points = HybridManipulator().interpolant.points.positions
    path = GeometricPath.through(points)
    options = {"path": path, "robot": "hybrid_manipulator", "longest_time": 10.0}
    free = TimeJerkReparameterisation(**options)
    bound = TimeJerkReparameterisation(**options, effort=True, payload=11.0)
    assert not any(name.startswith("effort") for name in free.constraint_names)
    assert [name for name in bound.constraint_names if name.startswith("effort")] == [
        f"effort of {name}" for name in bound.robot.joint_names
    ]
    assert [objective.unit for objective in bound.objectives] == ["s", "(rad or m)^2/s^5"]
    times = []
    for problem in (free, bound):
        front = optimise(problem, seed=1, generations=40, population=40, progress=False, polish=False)
        times.append(front.F[0, 0])
        fastest = front.least("time")
        if problem is bound:
            # The guaranteed capacity holds between the samples of the limits too, where 0.1 % less is left.
            assert dlcc(fastest).mass == pytest.approx(11.0, abs=0.02)
            assert dlcc_sampled(fastest).mass == pytest.approx(11.0, abs=0.01)
            effort = np.abs(fastest.rollout.effort[0]).max(axis=0) / problem.robot.limits.effort
            assert 0.9 < effort.max() <= 1.0
    assert times[1] > times[0]


def test_the_needed_time_is_named():
    with pytest.raises(TrajevoError, match=r"longest_time: the path needs 1\.832\d* s under the limits .*, got 1\.5 s"):
        TimeJerkReparameterisation(longest_time=1.5)
    # Evenly rising control points need 2.33 s; the path can be run in less.
    assert TimeJerkReparameterisation(longest_time=2.0).longest_time == 2.0
    with pytest.raises(TrajevoError, match=r"longest_time: the path needs 3\.128\d* s"):
        TimeJerkReparameterisation(path="s", interpolant="linear", longest_time=3.0)


def _text(tmp_path, text):
    file = tmp_path / "points.csv"
    file.write_text(text)
    return file


BAD_FILES = {
    "text": ("x [mm], y [mm]\n1, 2\n3, four\n", "points.csv: line 3, column 'y': expected a finite number, got 'four'"),
    "no unit": ("x, y\n1, 2\n", "points.csv: line 1: expected a column header with a unit"),
    "angle": ("x [deg], y [deg]\n1, 2\n", "line 1: expected .* such as 'x .m.' or 'x .cm.' or 'x .mm.', got 'x .deg.'"),
    "few": ("x [mm], y [mm]\n1, 2\n3, 4\n", "points.csv: points: a curve of order 6 needs at least 6, got 2"),
    "repeated": ("x [mm], y [mm]\n1, 2\n1, 2\n", "points.csv: points: point 1 repeats point 0"),
    "short row": ("x [mm], y [mm]\n1\n", "points.csv: line 2: expected 2 numbers"),
    "empty": ("", "points.csv: empty"),
    "three": (
        "x [mm], y [mm], z [mm]\n" + "\n".join(f"{k}, {k * k}, {k}" for k in range(9)),
        "points.csv: line 1: unknown column 'z .mm.'; known: x, y",
    ),
    "far": (
        "x [mm], y [mm]\n" + "\n".join(f"{100 * k}, 0" for k in range(9)),
        "runs from 0 to 0.8 m along 'x', outside its range -0.5 to 0.5 m",
    ),
}


@pytest.mark.parametrize("case", BAD_FILES)
def test_bad_files_are_refused_with_file_line_and_column(case, tmp_path):
    text, says = BAD_FILES[case]
    refused(lambda: TimeJerkReparameterisation(path=_text(tmp_path, text), **OWN), says)


S = GeometricPath.through(s_points())
BAD = {
    "no limits": ({"path": S}, "velocity: a path of your own needs a limit for every axis: velocity='100 mm/s'"),
    "no time": ({"path": S} | OWN | {"longest_time": None}, "longest_time: a path of your own needs the longest time"),
    "zero": ({"velocity": 0.0}, r"velocity: expected a positive limit \[m/s\] or inf for axis 'x', got 0.0"),
    "NaN": ({"jerk": [1.0, np.nan]}, r"jerk: expected a positive limit \[m/s\^3\] or inf for axis 'y', got nan"),
    "count": ({"acceleration": [1.0] * 3}, "acceleration: expected one limit or 2, one for each axis, got 3"),
    "unit": ({"velocity": "3 N"}, "velocity: expected a number and a unit that converts to m/s, such as .*, got '3 N'"),
    "truth": ({"velocity": True}, "velocity: expected a positive limit"),
    "time": ({"longest_time": -1.0}, r"longest_time: expected a positive time \[s\], got -1.0"),
    "endless": ({"longest_time": float("inf")}, "longest_time: expected a positive time"),
    "no limit at all": (
        {"velocity": "inf", "acceleration": "inf", "jerk": "inf"},
        "limits: expected a finite velocity",
    ),
    "path": ({"path": "gemini2"}, "unknown path 'gemini2'; known: a CSV file of points, gemini, s"),
    "number": ({"path": 3}, r"path: expected shape \(n_points, n_axes\)"),
    "dictionary": ({"path": {"knots": [0, 1]}}, "path: expected knots, control_points and parameters, got knots"),
    "robot": ({"robot": "ur6"}, "unknown robot 'ur6'"),
    "axes": ({"robot": "hybrid_manipulator"}, "path 'gemini': 2 axes, but robot 'hybrid_manipulator' has 5"),
    "limits": ({"limits": "loose"}, "unknown limits 'loose'; known: certified, hull, tight"),
    "encoding": ({"encoding": "raw"}, "unknown encoding 'raw'; known: plain, shape"),
    "interpolant": ({"interpolant": "cubic"}, "unknown interpolant 'cubic'; known: bspline, linear"),
    "quadrature": ({"quadrature": "simpson"}, "unknown quadrature 'simpson'"),
    "both": ({"interpolant": "linear", "encoding": "shape"}, "encoding: 'shape' needs the interpolant 'bspline'"),
    "effort of shapes": ({"encoding": "shape", "effort": True}, "encoding: 'shape' has no effort limits"),
    "control points": ({"control_points": 6}, "control_points: expected a whole number of at least 7, got 6"),
    "order": ({"order": 3}, "order: expected a whole number of at least 4, got 3"),
    "tolerance": ({"tolerance": 1e-12}, "tolerance: expected a number from 1e-08 to 0.1"),
    "smooth": (
        {"path": GeometricPath.through(s_points(), order=3)} | OWN,
        "path: expected order 4 at least, so that it has a jerk, got 3",
    ),
    "payload": ({"payload": -1.0}, "payload.mass: expected a number from 0 on"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_arguments_get_a_sentence(case):
    arguments, says = BAD[case]
    refused(lambda: TimeJerkReparameterisation(**arguments), says)


def test_interpolants_refuse_what_they_cannot_decode():
    problem = TimeJerkReparameterisation()
    for x, says in (
        (np.ones(12), r"x: expected decision vectors of shape \(B, 12\), got \(12,\)"),
        ("abc", "x: expected decision vectors"),
        (-np.ones((1, 12)), "x: expected rises from 0 on"),
        (np.full((1, 12), np.nan), "x: expected rises from 0 on"),
    ):
        with pytest.raises(TrajevoError, match=says):
            problem.interpolant(x)
    for make, says in (
        (lambda: LinearReparameterisation(S, problem.robot.limits, longest_time=1.0), "at rest at both ends"),
        (lambda: Reparameterisation("s", problem.robot.limits, longest_time=1.0), "path: expected a GeometricPath"),
        (lambda: Reparameterisation(S, problem.robot.limits, longest_time=1.0, timing="late"), "unknown timing"),
    ):
        with pytest.raises(TrajevoError, match=says):
            make()
