"""Tasks: the same as the class, mistakes with their line, and the way from an empty folder to a file."""

import copy
import json
import pickle
import shutil
from pathlib import Path

import numpy as np
import pytest

from tests.helpers import UNDRAWN, mostly_long, refused, trajevo
from trajevo import Front, Payload, ViaPoints, load_problem, load_robot, optimise
from trajevo.base.units import to_si
from trajevo.problems import HybridManipulator, ViaPointProblem
from trajevo.solvers.task import load_task

TASKS = Path(__file__).parents[2] / "problems" / "tasks"
#: Tasks for several robots, which are no problem of their own: tests/study/robots.
FOR_ROBOTS = ("which_robot",)
#: Tasks whose search and polish take seconds; `make test-long` solves them.
SLOW = ("panda_six_points", "xarm7_obstacle", "pick_and_place_cell", "ur5_pick_and_place", "ur5_order", "ur5_postures")

SMALL = """\
format = 1
angle = "deg"
points = [
  [0.0, -90.0, 90.0, -90.0, -90.0, 0.0],
  [45.0, -70.0, 80.0, -100.0, -90.0, 0.0],
  [90.0, -90.0, 90.0, -90.0, -90.0, 0.0],
]
duration_bounds = [0.3, 4.0]
objectives = ["time", "energy"]

[robot]
name = "ur5"
tool = "tool0"

[limits]
acceleration = "600 deg/s^2"
jerk = 100.0

[payload]
mass = 3.0
com = [0.0, 0.0, 0.05]

[algorithm]
population = 12
generations = 4
"""


@pytest.fixture
def write(tmp_path):
    def written(text):
        file = tmp_path / "task.toml"
        file.write_text(text)
        return file

    return written


def test_class_objects_and_task_give_the_same_front_to_the_bit(write):
    degrees = np.array([[0, -90, 90, -90, -90, 0], [45, -70, 80, -100, -90, 0], [90, -90, 90, -90, -90, 0]], float)
    points = degrees * to_si("deg")
    limits = {"acceleration": "600 deg/s^2", "jerk": 100.0}
    by_data = ViaPointProblem(
        robot={"name": "ur5", "tool": "tool0", "limits": limits},
        points=points,
        duration_bounds=(0.3, 4.0),
        objectives=("time", "energy"),
        constraints=("position", "velocity", "acceleration", "jerk", "effort"),
        payload={"mass": 3.0, "com": [0.0, 0.0, 0.05]},
    )
    by_objects = ViaPointProblem(
        robot=load_robot("ur5", tool="tool0", limits={"acceleration": 600.0 * to_si("deg"), "jerk": 100.0}),
        points=ViaPoints(points),
        duration_bounds=(0.3, 4.0),
        objectives=("time", "energy"),
        constraints=("position", "velocity", "acceleration", "jerk", "effort"),
        payload=Payload(3.0, com=(0.0, 0.0, 0.05)),
    )
    task = load_task(write(SMALL))
    fronts = [
        optimise(p, seed=1, generations=4, population=12, progress=False, polish=False) for p in (by_data, by_objects)
    ]
    fronts.append(task.solve(progress=False, polish=False))
    for name in "XFG":
        for front in fronts[1:]:
            np.testing.assert_array_equal(getattr(front, name), getattr(fronts[0], name))
    assert len(fronts[0])


def test_the_hybrid_manipulator_s_task_equals_its_class():
    task = load_task(TASKS / "hybrid_manipulator.toml")
    by_task = task.solve(generations=5, population=40, progress=False, polish=False)
    by_class = optimise(HybridManipulator(), seed=1, generations=5, population=40, progress=False, polish=False)
    np.testing.assert_array_equal(by_task.X, by_class.X)
    # Processors differ in the last digit of an arc tangent, so that one that did not write the file may compute points
    # that are an ulp away from those in it.
    points, computed = (front.problem.interpolant.points.positions for front in (by_task, by_class))
    np.testing.assert_allclose(points, computed, rtol=0.0, atol=5e-16)
    for name in "FG":
        found, expected = getattr(by_task, name), getattr(by_class, name)
        if np.array_equal(points, computed):
            np.testing.assert_array_equal(found, expected)
        np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)


def test_a_front_of_a_task_is_read_back_anywhere(write, tmp_path):
    front = load_task(write(SMALL)).solve(progress=False)
    front.save(tmp_path / "front.json")
    again = Front.load(tmp_path / "front.json")
    assert again == front
    np.testing.assert_array_equal(again.problem.evaluate(front.X)[0], front.F)


def test_paths_count_from_the_folder_of_the_task(write, tmp_path, monkeypatch):
    shutil.copytree(load_robot("puma560").source, tmp_path / "mine")
    (tmp_path / "via.csv").write_text(
        ", ".join(f"joint_{k} [deg]" for k in range(1, 7))
        + "\n0, 0, 0, 0, 0, 0\n"
        + "10, 20, -30, 10, 20, 5\n0, 10, 0, 0, 0, 0\n"
    )
    file = write('robot = "mine"\npoints = "via.csv"\nduration_bounds = [0.5, 3.0]\n')
    monkeypatch.chdir("/")
    task = load_task(file)
    assert task.problem.robot.source == tmp_path / "mine"
    assert task.problem.settings["robot"] == str(tmp_path / "mine")
    np.testing.assert_allclose(task.problem.interpolant.points.positions[1, 1], np.radians(20.0))


def test_points_may_be_poses_in_a_csv_file(write, tmp_path):
    (tmp_path / "via.csv").write_text(
        "x [mm], y [mm], z [mm], roll [deg], pitch [deg], yaw [deg]\n"
        + "".join(f"450, {y}, 200, 180, 0, 0\n" for y in (-250, 0, 250))
    )
    text = SMALL[: SMALL.index("points")] + 'points = "via.csv"\n' + SMALL[SMALL.index("duration") :]
    problem = load_task(write(text)).problem
    positions, rotations = problem.robot.tool_poses(problem.interpolant.points.positions)
    np.testing.assert_allclose(positions, [[0.45, -0.25, 0.2], [0.45, 0.0, 0.2], [0.45, 0.25, 0.2]], atol=1e-5)
    np.testing.assert_allclose(rotations[0], np.diag([1.0, -1.0, -1.0]), atol=1e-5)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (
            "mass = 3.0",
            'mass = "3"',
            "task.toml: line 20: payload.mass: expected a number and a unit .* kg",
        ),
        ("mass = 3.0", "mass = -3.0", "line (19|20): payload.*: expected a number from 0 on"),
        ("mass = 3.0", "", "line 19: payload.mass: this key is missing"),
        (
            "com =",
            "cog =",
            "line 21: payload.cog: unknown key; known: com, from, inertia, .*, vary; did you mean 'com'",
        ),
        ("duration_bounds = [0.3, 4.0]", "", "task.toml: duration_bounds: this key is missing"),
        ("[0.3, 4.0]", "[4.0, 0.3]", "line 8: duration_bounds: expected 0 < lower < upper .*got 4.0 and 0.3"),
        ("[0.3, 4.0]", "[0.3]", "line 8: duration_bounds"),
        ('"energy"]', '"speed"]', "unknown objective 'speed'; known: "),
        ('name = "ur5"', 'name = "ur6"', "line 11: robot: unknown robot 'ur6'; did you mean 'ur5'"),
        ('tool = "tool0"', 'tool = "tool9"', "line 11: robot: unknown tool frame"),
        ("jerk = 100.0", "", "line 11: robot: .*no jerk limit for shoulder_pan_joint.*task.toml"),
        ("jerk = 100.0", 'jerk = "100 m/s^3"', "limits.jerk.*expected a number and a unit that converts to rad/s\\^3"),
        ("jerk = 100.0", "jerk = { elbow = 1.0 }", "unknown joint in limits.jerk 'elbow'; known: elbow_joint"),
        (
            "population = 12",
            "population = 2",
            "line 24: algorithm.population: expected a whole .* at least 4, got 2",
        ),
        (
            "population = 12",
            'name = "ga"',
            "unknown algorithm 'ga'; known: age-moea2, moea/d, nsga2, nsga3, rvea, sms-emoa, spea2, u-nsga3",
        ),
        ("format = 1", "format = 2", "line 1: format: "),
        (
            "format = 1",
            "sead = 3",
            "line 1: sead: unknown key; did you mean 'seed'",
        ),
        (
            "[payload]",
            "[constraints]\ntool_sped = 1.0\n[payload]",
            "line 20: constraints.tool_sped: unknown key; known: .*; did you mean 'tool_speed'",
        ),
        (
            "[payload]",
            '[constraints]\ntool_speed = "1"\n[payload]',
            "line 20: .*tool_speed: expected a number",
        ),
        (
            "[payload]",
            "[constraints]\ntool_speed = -1.0\n[payload]",
            "line 20: constraints.tool_speed: .*positive number",
        ),
        (
            "[payload]",
            "[constraints]\ntool_height = nan\n[payload]",
            "line 20: constraints.tool_height: .*finite number",
        ),
        ("[payload]", 'scene = "post"\n[payload]', "limits.scene: unknown key; known: acceleration, "),
        ("format = 1", 'scene = "post"', "line 1: scene: expected a table, got 'post'"),
        (
            "[payload]",
            '[constraints]\nlimits = ["tool_speed"]\n[payload]',
            "line 19: constraints: 'tool_speed' is switched on by giving 'tool_speed', not by its name here",
        ),
        ('angle = "deg"', 'angle = "grad"', "line 2: angle: .*got 'grad'"),
        ("[45.0, -70.0, 80.0, -100.0, -90.0, 0.0],", "[45.0, -70.0, 80.0],", "line 3: points"),
        ("[45.0, -70.0,", "[45.0, -700.0,", "line 3: points: point 1 puts 'shoulder_lift_joint' at"),
        ("[45.0, -70.0,", "[45.0, nan,", "line 3: points: .*finite"),
        (
            "[45.0, -70.0, 80.0, -100.0, -90.0, 0.0]",
            "{ position = [5.0, 0.0, 0.5] }",
            "line 3: points: .*point 1.*",
        ),
        (
            "[45.0, -70.0, 80.0, -100.0, -90.0, 0.0]",
            "{ rpy = [5.0, 0.0, 0.5] }",
            "line 3: points.1: expected either joints, or position",
        ),
        ("[payload]", "[scene]\nclearance = -1.0\n[payload]", "line 19: scene"),
        ("[payload]", "[[moving]]\npoint = 1\n[payload]", "line 19: moving.0: expected either joints or tool"),
        (
            "[payload]",
            "[[moving]]\npoint = 7\njoints = 5.0\n[payload]",
            "line 19: moving: expected a point from 1 to 1, got 7",
        ),
        ("[payload]", "[payload", "cannot be read as TOML"),
    ],
)
def test_mistakes_are_told_with_their_line(write, old, new, says):
    assert old in SMALL
    file = write(SMALL.replace(old, new, 1))
    refused(lambda: load_task(file).solve(progress=False), says)


@pytest.mark.parametrize("drawn", mostly_long([(), UNDRAWN], UNDRAWN), ids=["drawn", "undrawn"])
def test_the_way_from_an_empty_folder_to_a_file(tmp_path, drawn):
    for command in (
        ("init",),
        ("solve", "task.toml", "--generations", "12", "--population", "24", "--no-polish", "--quiet", *drawn),
        ("report", "runs/task", *(("--no-pictures",) if drawn else ())),
        ("export", "runs/task", "--format", "csv"),
    ):
        done = trajevo(*command, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        assert "written" in done.stdout
    assert len(Front.load(tmp_path / "runs/task/front.json"))
    assert (tmp_path / "runs/task/knee.csv").is_file()
    again = trajevo("init", cwd=tmp_path)
    assert again.returncode == 2
    assert "task.toml: exists already" in again.stderr


def test_solve_refuses_what_the_task_decides(write, tmp_path):
    file = write(SMALL)
    for option, value in (("--payload", "2"), ("--method", "nnc"), ("--set", "samples=3")):
        done = trajevo("solve", file, option, value, cwd=tmp_path)
        assert done.returncode == 2
        assert f"{option}: a task says this in its file" in done.stderr
    own = ("--algorithm", "sms-emoa", "--generations", "2", "--offsprings", "5", "--out", tmp_path / "own", "--quiet")
    assert trajevo("solve", file, *own, *UNDRAWN, cwd=tmp_path).returncode == 0
    run = Front.load(tmp_path / "own" / "front.json").run
    assert (run.algorithm, run.settings["offsprings"], run.settings["population"]) == ("SMSEMOA", 5, 12)


def test_the_seed_of_a_task_stands_at_its_top(write):
    refused(
        lambda: load_task(write(SMALL.replace("[algorithm]", "[algorithm]\nseed = 3"))),
        "expected the seed at the top level",
    )


@pytest.mark.parametrize(
    "file",
    [
        pytest.param(file, marks=pytest.mark.long if file.stem in SLOW else (), id=file.stem)
        for file in sorted(TASKS.glob("*.toml"))
        if file.stem not in FOR_ROBOTS
    ],
)
def test_worked_tasks_are_solved_and_verified(file):
    from trajevo.verification.verify import verify

    front = load_task(file).solve(generations=10, population=40, progress=False)
    assert len(front), front.blocking
    assert json.dumps(front.problem.settings)
    for row in np.linspace(0, len(front) - 1, 5).astype(int):
        found = verify(front.pick(int(row)), density=20)
        assert found.passed, found.doubts or found.worst


@pytest.mark.thinned(2)
@pytest.mark.parametrize(
    "file",
    [
        pytest.param(file, marks=pytest.mark.long if file.stem == "pick_and_place_cell" else (), id=file.stem)
        for file in sorted(TASKS.glob("*.toml"))
        if file.stem not in FOR_ROBOTS
    ],
)
def test_problems_of_tasks_are_copied_pickled_and_made_again(file):
    problem = load_task(file).problem
    x = np.random.default_rng(0).uniform(problem.xl, problem.xu, (8, problem.n_var))
    F, G = problem.evaluate(x)
    again = load_problem(problem.registered_name, **json.loads(json.dumps(problem.settings, allow_nan=False)))
    for other in (copy.deepcopy(problem), pickle.loads(pickle.dumps(problem)), again):
        np.testing.assert_array_equal(other.evaluate(x)[0], F)
        np.testing.assert_allclose(other.evaluate(x)[1], G, atol=1e-6)
    np.testing.assert_allclose(problem.evaluate(x[3:4])[1], G[3:4], rtol=1e-9, atol=1e-5)  # a row does not know others


def test_two_points_are_a_motion(write, tmp_path):
    """From one point to another, with the default interpolant, by every command."""
    file = write(SMALL.replace("  [45.0, -70.0, 80.0, -100.0, -90.0, 0.0],\n", ""))
    assert len(load_task(file).problem.interpolant.points) == 2
    run = tmp_path / "run"
    options = ("--generations", "6", "--population", "12", *UNDRAWN, "--out", run, "--quiet")
    assert trajevo("solve", file, *options).returncode == 0
    for command in (["show"], ["certify"], ["verify"], ["capacity"], ["export", "--format", "csv"]):
        done = trajevo(command[0], run, *command[1:])
        assert done.returncode == 0, done.stderr
