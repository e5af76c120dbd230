"""Robots of joints and limits alone: published problems that state no body, and everything that a body would be for.

The two papers were not at hand: their points and limits are second hand. The least times, known to four digits from
elsewhere, confirm them.
"""

import contextlib
import json
import pickle

import numpy as np
import pytest

from tests.helpers import UNDRAWN, refused, suited, trajevo
from trajevo import (
    Payload,
    Robot,
    ToolPlane,
    ViaPointProblem,
    animate,
    capacities,
    capacity_front,
    certify,
    dlcc,
    dlcc_iterative,
    dlcc_sampled,
    export,
    largest_payload,
    load_task,
    max_payload_problem,
    minimise_weighted,
    payload_bounds,
    payload_effort,
    plots,
    read_run,
    resume,
    robust_slowdown,
    sensitivity,
    slowdown_curve,
    slowdown_for,
    workspace_capacity,
)
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.errors import InvalidInputError, TrajevoError
from trajevo.exporters.export import NAMED_EXPORTERS
from trajevo.formulation.objectives import OBJECTIVES
from trajevo.formulation.problem import Weights
from trajevo.robot.kinematics import ToolKinematics
from trajevo.robot.robot import robot_of
from trajevo.study.definition import Study
from trajevo.study.run import run_study
from trajevo.trajectory.interpolants import THROUGH_POINTS
from trajevo.verification.newton_euler import NewtonEuler

INF = float("inf")
PLANE = ToolPlane.around({"position": [0.4, 0.0, 0.3]}, "xz", reach=0.2, cells=3)

TASK = """
robot = { name = "two", joints = ["turn", "slide"], kind = ["revolute", "prismatic"] }
points = [[0.0, 0.0], [1.0, 0.5], [0.3, 0.2], [1.5, 1.0]]
duration_bounds = [0.1, 6.0]
interpolant = "cubic"
objectives = ["time", "jerk"]

[limits]
velocity = ["100 deg/s", 1.0]
acceleration = 2.0
jerk = { turn = 8.0, slide = inf }

[constraints]
limits = ["velocity", "acceleration", "jerk"]

[algorithm]
generations = 4
population = 12
"""


def degrees(*values):
    return [f"{value} deg" for value in values]


def rates(order, *values):
    return [f"{value} deg/s{'' if order == 1 else f'^{order}'}" for value in values]


def least_time(robot, points, starts):
    problem = ViaPointProblem(
        robot=robot,
        points=np.radians(points).T,
        duration_bounds=(0.05, 6.0),
        interpolant="cubic",
        constraints=("velocity", "acceleration", "jerk"),
    )
    return minimise_weighted(problem, Weights((1.0, 0.0)), seed=1, starts=starts)


def test_the_joints_of_lin_chang_and_luh():
    """Lin, Chang, Luh: Formulation and optimization of cubic polynomial joint trajectories, IEEE TAC 28 (1983)."""
    robot = Robot.from_limits(
        velocity=rates(1, 100, 95, 100, 150, 130, 110),
        acceleration=rates(2, 45, 40, 75, 70, 90, 80),
        jerk=rates(3, 60, 60, 55, 70, 75, 70),
    )
    one, two, three = [10, 60, 75, 130, 110, 100, -10, -50], [15, 25, 30, -45, -55, -70, -10, 10], [45, 180, 200, 120]
    four, five, six = [5, 20, 60, 110, 20, 60, -100, -30], [10, 30, -40, -60, 10, 50, -40, 10], [6, 40, 80, 70]
    points = [one, two, [*three, 15, -10, 100, 50], four, five, [*six, -10, 10, 30, 20]]
    found = least_time(robot, points, starts=4)
    assert round(found.F["time"], 4) == 17.8360
    assert max(found.G.values()) <= 1e-6


def test_the_joints_of_gasparetto_and_zanotto():
    """Gasparetto, Zanotto: A new method for smooth trajectory planning of robot manipulators, MMT 42 (2007)."""
    robot = Robot.from_limits(
        velocity=rates(1, 100, 95, 100, 150, 130, 110),
        acceleration=rates(2, 60, 60, 75, 70, 90, 80),
        jerk=rates(3, 60, 66, 85, 70, 75, 70),
    )
    one, two, three = [-10, 60, 20, 55], [20, 50, 120, 35], [15, 100, -10, 30]
    four, five, six = [150, 100, 40, 10], [30, 110, 90, 70], [120, 60, 100, 25]
    found = least_time(robot, [one, two, three, four, five, six], starts=4)
    assert round(found.F["time"], 4) == 8.5310
    assert max(found.G.values()) <= 1e-6


def two(**others):
    return Robot.from_limits(
        **{"velocity": ["100 deg/s", 1.0], "acceleration": 2.0, "jerk": [8.0, INF], "name": "two"} | others
    )


def test_limits_are_what_was_given():
    robot = two(position=[[-1.0, 2.0], ["-30 mm", "50 mm"]], kind=["revolute", "prismatic"], names=["turn", "slide"])
    assert robot.joint_names == ("turn", "slide")
    assert robot.joint_units == ("rad", "m")
    np.testing.assert_allclose(robot.limits.lower, [-1.0, -0.03], rtol=1e-15)
    np.testing.assert_allclose(robot.limits.upper, [2.0, 0.05], rtol=1e-15)
    np.testing.assert_allclose(robot.limits.velocity, [np.radians(100.0), 1.0], rtol=1e-15)
    np.testing.assert_array_equal(robot.limits.acceleration, [2.0, 2.0])
    np.testing.assert_array_equal(robot.limits.jerk, [8.0, INF])
    np.testing.assert_array_equal(robot.limits.effort, [INF, INF])
    assert str(robot) == "two: limits alone, 2 joints"
    assert not robot.gives_effort


SLIDES = {"position": [-3.0, 3.0], "velocity": "2 m/s", "kind": "prismatic", "names": ["u", "w"]}


@pytest.mark.parametrize("given", [{}, SLIDES])
def test_it_is_made_again_from_its_settings(given):
    robot = two(**given)
    for again in (
        robot_of(json.loads(json.dumps(robot.settings))),
        pickle.loads(pickle.dumps(robot)),
        robot_of(robot.settings),
    ):
        assert again.settings == robot.settings
        assert again.joint_names == robot.joint_names
        for name, values in vars(robot.limits).items():
            np.testing.assert_array_equal(getattr(again.limits, name), values)


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"velocity": 1.0, "jerk": 1.0}, "names: expected the names of the joints"),
        ({"jerk": [1.0, 2.0, 3.0]}, "limits.jerk: expected 1 or 2 values, got 3"),
        ({"names": ["a"], "jerk": 1.0}, "limits.velocity: expected 1 or 1 values, got 2"),
        ({"names": ["a", "a"]}, "robot 'two': joint 'a': expected a unique name, got 2 joints"),
        ({"names": "ab"}, "names: expected 2 names of joints, one for each, got 'ab'"),
        ({"kind": "turning"}, "unknown kind of joint 'turning'"),
        ({"kind": ["revolute"]}, "kind: expected one or 2, one for each joint, got ['revolute']"),
        ({"jerk": {"joint_1": 1.0}}, "jerk: expected a limit for joint_2, got none; inf is no limit"),
        ({"velocity": [180.0, 1.0]}, "looks like deg/s"),
        ({"velocity": [0.0, 1.0]}, "robot 'two': joint 'joint_1': velocity: expected a positive limit, got 0"),
        ({"position": [2.0, 1.0]}, "position: lower must be below upper"),
        ({"name": ""}, "name: expected printable characters"),
    ],
)
def test_a_wrong_limit_is_refused(given, told):
    whole = {"velocity": [1.0, 1.0], "acceleration": 2.0, "jerk": [8.0, INF], "name": "two"} | given
    with pytest.raises(TrajevoError) as error:
        Robot.from_limits(**whole)
    assert told in str(error.value)


STRANGE = [None, True, 0, -1, 10**400, float("nan"), INF, "", "1 m", [], {}, [[]], [None], {"a": 1}, b"x", object(), 1j]


@pytest.mark.parametrize("strange", STRANGE, ids=lambda value: repr(value)[:12])
def test_a_strange_argument_costs_a_sentence(strange):
    for key in ("velocity", "acceleration", "jerk", "position", "names", "kind", "name"):
        for value in (strange, [strange, strange]):
            given = {"velocity": [1, 1], "acceleration": 1, "jerk": [1, 1]} | {key: value}
            with contextlib.suppress(TrajevoError):  # some of them can be used
                assert Robot.from_limits(**given).dof in (1, 2)
    limits = {"velocity": 1, "acceleration": 1, "jerk": 1}
    for given in ({"joints": strange}, {"joints": ["a"], "kind": strange}, {"joints": ["a"], "limits": strange}):
        with contextlib.suppress(TrajevoError):
            assert robot_of({"limits": limits} | given).dof == 1


SCENE = {"clearance": 0.01, "obstacles": [{"name": "s", "shape": "sphere", "radius": 0.1, "position": [1.0, 0.0, 0.0]}]}
POINTS = [[0.0, 0.0], [1.0, 0.5], [0.3, 0.2], [1.5, 1.0]]


@pytest.mark.parametrize(
    ("given", "named"),
    [
        ({"objectives": ("time", "energy")}, "energy"),
        ({"objectives": ("time", "square_effort_rate")}, "square_effort_rate"),
        ({"objectives": ("time", "effort_ratio")}, "effort_ratio"),
        ({"objectives": ("time", "tool_path")}, "tool_path"),
        ({"objectives": ("time", "unused_payload"), "constraints": ("velocity", "effort")}, "a limit of effort"),
        ({"constraints": ("velocity", "effort")}, "a limit of effort"),
        ({"payload": 2.0}, "a payload"),
        ({"payload": Payload(1.0)}, "a payload"),
        ({"tool_speed": 1.0}, "a limit of tool speed"),
        ({"tool_height": 0.1}, "a limit of tool height"),
        ({"scene": SCENE}, "a clearance"),
        ({"moving": [{"point": 1, "tool": (0.1, 0.1, 0.0)}]}, "a box of the tool"),
        ({"points": [[0.0, 0.0], {"position": [0.1, 0.2, 0.3]}, [1.0, 1.0]]}, "the place of the tool"),
    ],
)
def test_what_needs_a_body_is_refused_by_name(given, named):
    with pytest.raises(InvalidInputError) as error:
        ViaPointProblem(**{"robot": two(), "points": POINTS, "constraints": ("velocity",)} | given)
    said = str(error.value)
    assert said.startswith(f"robot 'two': {named}")
    assert "needs a body, and this robot is joints and limits alone" in said
    assert "\n" not in said


def test_points_move_in_a_box_of_joints():
    moving = [{"point": 1, "joints": [0.1, 0.1]}]
    problem = ViaPointProblem(
        robot=two(), points=POINTS, moving=moving, interpolant="cubic", constraints=("velocity", "acceleration")
    )
    assert [variable.name for variable in problem.interpolant.variables][-2:] == ["q_1 of joint_1", "q_1 of joint_2"]
    moved = problem.decode(np.array([[1.0, 1.0, 1.0, 1.0, 1.0, 0.05, -0.05]]))
    assert np.abs(moved.evaluate(np.array([[2.0]]))[0, 0] - [1.05, 0.45]).max() < 1e-12


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("alone")
    (folder / "task.toml").write_text(TASK)
    solved = trajevo("solve", "task.toml", *UNDRAWN, cwd=folder)
    assert solved.returncode == 0, solved.stderr
    return folder


def test_a_task_of_limits_alone_is_checked_solved_and_shown(run):
    checked = trajevo("check", "task.toml", cwd=run)
    assert checked.returncode == 0
    assert "point  range used  to the next, at least" in checked.stdout
    shown = trajevo("show", "runs/task", cwd=run)
    assert shown.returncode == 0
    assert "of turn" in trajevo("certify", "runs/task", cwd=run).stdout
    verified = trajevo("verify", "runs/task", cwd=run)
    assert "keeps every limit" in verified.stdout
    assert "Pinocchio" not in verified.stdout
    assert trajevo("report", "runs/task", "--full", cwd=run).returncode == 0
    drawn = {file.stem for file in (run / "runs/task/plots").iterdir()}
    assert "front" in drawn
    assert "tool_path" not in drawn


def test_a_run_of_limits_alone_is_read_and_goes_on(run):
    front = read_run(run / "runs/task")
    robot = front.problem.robot
    assert robot.settings["joints"] == ["turn", "slide"]
    assert robot.joint_units == ("rad", "m")
    np.testing.assert_array_equal(robot.limits.jerk, [8.0, INF])
    again = load_task(run / "task.toml").problem
    assert json.dumps(again.settings) == json.dumps(front.problem.settings)
    longer = resume(run / "runs/task", generations=6, progress=False)
    assert longer.problem.settings == front.problem.settings


@pytest.mark.parametrize("name", ["csv", "json", "ros2", "moveit", "mujoco", "netcdf"])
def test_what_needs_no_body_is_exported(run, name):
    done = trajevo("export", "runs/task", "--format", name, "--out", f"{name}.out", cwd=run)
    assert done.returncode == 0, done.stderr
    if name not in ("netcdf", "json"):
        lines = (run / f"{name}.out").read_text().splitlines()
        written = [line for line in lines if not line.startswith("#")]
        assert any("turn" in line for line in written)
        told = [line for line in written if ("effort" in line or "force" in line) and "[]" not in line]
        assert all("false" in line for line in told)


WITH_BODY = {
    "energy",
    "electrical_energy",
    "rms_torque_share",
    "winding_rise",
    "peak_power",
    "payload_condition",
    "square_power",
    "square_effort",
    "square_effort_rate",
    "peak_effort_rate",
    "effort_ratio",
    "unused_payload",
    "tool_path",
    "footprint",
}


@pytest.mark.parametrize("name", OBJECTIVES)
def test_every_objective_is_computed_or_refused(name):
    limits = ("velocity", "effort") if name == "unused_payload" else ("velocity",)
    given = {"robot": two(), "points": POINTS, "objectives": (name,), "constraints": limits, "interpolant": "cubic"}
    if name in WITH_BODY:
        refused(lambda: ViaPointProblem(**given), "^robot 'two': .* needs a body, and this robot is joints and limits")
    else:
        assert np.isfinite(ViaPointProblem(**given).evaluate(np.ones((1, 5)))[0]).all()


@pytest.mark.parametrize("name", THROUGH_POINTS)
def test_every_interpolant_moves_it(name):
    given = {"robot": two(), "points": POINTS, "duration_bounds": (0.5, 4.0)}
    problem = ViaPointProblem(**suited(name, given))
    x = 0.5 * (problem.xl + problem.xu)
    F, G = problem.evaluate(x[None])
    assert np.isfinite(F).all()
    assert np.isfinite(G).all()
    assert problem.evaluate_with_gradients(x[None])[1].shape == (1, 2, len(x))


def test_every_format_is_written_or_says_why_not(run):
    front = read_run(run / "runs/task")
    for name, exporter in NAMED_EXPORTERS.all().items():
        file = run / f"every.{exporter.ending}"
        if name in ("feed", "gcode", "urscript"):
            refused(lambda name=name, file=file: export(front.knee(), file, format=name), "^(feed|urscript): .*'two'")
        else:
            export(front.knee(), file, format=name)
            assert file.stat().st_size > 100


def test_a_study_varies_limits_and_runs(run, tmp_path):
    study = Study(task=run / "task.toml", seed=1, repeats=1, factors={"limits.jerk": [8.0, 20.0]}, generations=2)
    slides = study.jobs[0]["arguments"]["robot"]
    assert slides["joints"] == ["turn", "slide"]
    assert Study.of(study.record).record == study.record
    standing = run_study(study, tmp_path / "study", progress=False)
    assert standing.finished


def test_a_task_limits_effort_only_where_it_says_so(tmp_path):
    (tmp_path / "task.toml").write_text(TASK[: TASK.index("[constraints]")])
    named = load_task(tmp_path / "task.toml").problem.settings["constraints"]
    assert named == ["position", "velocity", "acceleration", "jerk"]
    (tmp_path / "task.toml").write_text(TASK.replace('"acceleration", "jerk"]', '"effort"]'))
    refused(lambda: load_task(tmp_path / "task.toml"), "a limit of effort needs a body")


@pytest.mark.parametrize(
    ("computed", "named"),
    [
        (lambda front: animate(front.knee(), "never.html"), "an animation"),
        (lambda front: plots.stick_figure(front.knee()), "a picture of the arm"),
        (lambda front: plots.tool_path(front.knee()), "a picture of the tool's path"),
        (lambda front: dlcc(front.knee()), "effort"),
        (lambda front: dlcc_sampled(front.knee()), "effort"),
        (lambda front: dlcc_iterative(front.knee()), "effort"),
        (capacities, "effort"),
        (lambda front: sensitivity(front.knee()), "effort"),
        (lambda front: slowdown_curve(front.knee()), "effort"),
        (lambda front: robust_slowdown(front.knee(), mass=(1.0, 2.0), com=np.zeros((2, 3))), "a payload"),
        (lambda front: capacity_front(front.problem, [1.0], seed=1), "a payload"),
        (lambda front: max_payload_problem(front.problem, (0.0, 1.0)), "a payload"),
        (lambda front: workspace_capacity(front.problem.robot, PLANE), "a payload"),
        (lambda front: payload_bounds(front.knee()), "a payload"),
        (lambda front: payload_effort(front.knee()), "effort"),
        (lambda front: slowdown_for(front.knee(), payload=Payload(1.0)), "a payload"),
        (lambda front: largest_payload(front.problem, seed=1), "a payload"),
        (lambda front: certify(front.knee(), power=1.0), "a limit of power"),
        (lambda front: certify(front.knee(), tool_speed=1.0), "a limit of tool speed"),
        (lambda front: front.problem.robot.tool_poses(np.zeros((1, 2))), "the place of the tool"),
        (lambda front: ToolKinematics.of(front.problem.robot), "the place of the tool"),
        (lambda front: Dynamics(front.problem.robot).effort(*np.zeros((3, 1, 2))), "effort"),
        (lambda front: NewtonEuler(front.problem.robot), "effort"),
    ],
)
def test_what_needs_a_body_is_refused_after_the_search(run, computed, named):
    front = read_run(run / "runs/task")
    with pytest.raises(InvalidInputError) as error:
        computed(front)
    assert str(error.value).startswith(f"robot 'two': {named} needs a body")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("before", "after", "told"),
    [
        ("velocity = ", "effort = ", "limits: effort: a robot of joints and limits alone has none"),
        ("acceleration = 2.0", "", "limits: expected acceleration, got none"),
        ('"slide"]', '"turn"]', "expected a unique name"),
        ('kind = ["revolute", ', 'kind = ["ball", ', "unknown kind of joint 'ball'"),
        ('name = "two", ', 'name = "two", tool = "t", ', "got 'tool'"),
        ('joints = ["turn", "slide"], ', "", "robot: kind: "),
    ],
)
def test_a_mistake_in_a_task_is_told_with_its_line(tmp_path, before, after, told):
    (tmp_path / "task.toml").write_text(TASK.replace(before, after))
    done = trajevo("check", "task.toml", cwd=tmp_path)
    assert done.returncode not in (0, None)
    assert told in " ".join(done.stderr.split())
    assert "task.toml" in done.stderr
    assert "Traceback" not in done.stderr
