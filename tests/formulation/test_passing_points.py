"""Problems with stops, dwells, given velocities, windows of time and fixed durations: solved, proven, kept, refused."""

import json
import re

import numpy as np
import pytest

from tests.helpers import UNDRAWN, mostly_long, refused, trajevo
from trajevo import Front, Passing, ViaPointProblem, certify, check, dlcc, export, load_robot, optimise, polish, verify
from trajevo.capacity.slowdown import slowdown_for
from trajevo.formulation.problem import Weights
from trajevo.solvers.evolutionary.first_population import first_population
from trajevo.solvers.evolutionary.stretching import Limits, Stretching
from trajevo.solvers.gradient.weighted_sum import minimise_weighted
from trajevo.solvers.rivals import rivals_of
from trajevo.solvers.task import load_task

URDF = """<robot name="two">
<link name="base"/>
<link name="l1"><inertial><origin xyz="0.2 0 0"/><mass value="2"/>
  <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.03"/></inertial></link>
<link name="l2"><inertial><origin xyz="0.15 0 0"/><mass value="1"/>
  <inertia ixx="0.005" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
<link name="tcp"/>
<joint name="a" type="revolute"><parent link="base"/><child link="l1"/><origin xyz="0 0 0.3"/><axis xyz="0 1 0"/>
  <limit lower="-3" upper="3" velocity="2" effort="60"/></joint>
<joint name="b" type="revolute"><parent link="l1"/><child link="l2"/><origin xyz="0.4 0 0"/><axis xyz="0 1 0"/>
  <limit lower="-3" upper="3" velocity="2" effort="30"/></joint>
<joint name="t" type="fixed"><parent link="l2"/><child link="tcp"/><origin xyz="0.3 0 0"/></joint>
</robot>"""
POINTS = [[0.2, 0.5], [1.0, 0.9], [0.4, 1.4], [-0.3, 0.2]]
VELOCITY, ACCELERATION, JERK = np.array([2.0, 2.0]), np.array([8.0, 12.0]), np.array([90.0, 300.0])
STOP_AND_DWELL = [{"point": 1, "stop": True}, {"point": 2, "dwell": 0.4}]


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    file = tmp_path_factory.mktemp("two") / "two.urdf"
    file.write_text(URDF, encoding="utf-8")
    return load_robot(file, tool="tcp", limits={"acceleration": ACCELERATION.tolist(), "jerk": JERK.tolist()})


@pytest.fixture(scope="module")
def problem(robot):
    def made(**given):
        usual = {"points": POINTS, "objectives": ("time", "jerk"), "duration_bounds": (0.1, 4.0), "payload": 0.5}
        effort = {"constraints": ("position", "velocity", "acceleration", "jerk", "effort")}
        return ViaPointProblem(robot=robot, **(usual | effort | given))

    return made


@pytest.fixture(scope="module", params=mostly_long([False, True], False), ids=lambda polish: f"polish={polish}")
def small(request):
    """Settings of a search, polished in long runs."""
    return {"population": 24, "generations": 12, "progress": False, "polish": request.param}


@pytest.fixture(scope="module")
def plain(problem, small):
    """The front through the points alone."""
    return optimise(problem(), seed=1, **small)


@pytest.fixture(scope="module")
def front(problem, small):
    return optimise(problem(passing=STOP_AND_DWELL), seed=1, **small)


def rest_to_rest(points):
    """Least times of quintics from rest to rest: |v| <= 15/8 D/T, |a| <= 10/sqrt(3) D/T^2, |j| <= 60 D/T^3."""
    distance = np.abs(np.diff(points, axis=0))
    needed = (
        15.0 / 8.0 * distance / VELOCITY,
        np.sqrt(10.0 / np.sqrt(3.0) * distance / ACCELERATION),
        np.cbrt(60.0 * distance / JERK),
    )
    return np.max(needed, axis=(0, 2))


def test_stops_at_all_points_take_the_least_time_of_the_closed_form(problem):
    kinematic = ("position", "velocity", "acceleration", "jerk")
    stopping = problem(
        objectives=("time",), constraints=kinematic, passing=[*STOP_AND_DWELL[:1], {"point": 2, "dwell": 0.25}]
    )
    best = minimise_weighted(stopping, Weights((1.0,)), seed=0, starts=3)
    expected = rest_to_rest(POINTS)
    np.testing.assert_allclose(best.x, expected, rtol=1e-6)
    assert best.F["time"] == pytest.approx(expected.sum() + 0.25, rel=1e-6)
    each = [part.seconds for part in check(stopping).least_times]
    taken = [expected[0], expected[1], expected[2] + 0.25, best.F["time"]]
    assert all(least <= own for least, own in zip(each, taken, strict=True))
    assert each[-1] > 0.6 * best.F["time"]


def test_a_two_objective_run_is_solved_proven_verified_exported_and_read_back(front, tmp_path):
    assert len(front) > 10, front.blocking
    assert {proof.proven for proof in map(certify, (front.pick("0"), front.pick("knee"), front.pick("1")))} == {True}
    better = polish(front, members=3, rounds=1, seed=0).front
    assert better.F.min(axis=0)[0] <= front.F.min(axis=0)[0]
    knee = front.pick("knee")
    found = verify(knee)
    assert found.derivative_mismatch < 1e-8
    assert found.via_error < 1e-12
    assert found.effort_difference < 1e-10
    front.save(tmp_path / "front.json")
    again = Front.load(tmp_path / "front.json")
    assert again.problem.settings == front.problem.settings
    np.testing.assert_array_equal(again.problem.evaluate(front.X, return_values_of=["F"]), front.F)
    trajectory, arrives = knee.trajectory, front.problem.via_times(knee.x)[0, 2]
    for kind in ("json", "csv", "ros2", "mujoco", "moveit"):
        file = tmp_path / f"motion.{kind}"
        export(knee, file, format=kind)
        assert file.stat().st_size
    content = json.loads((tmp_path / "motion.json").read_text())
    breaks = np.array(content["trajectory"]["breaks [s]"])
    assert np.diff(breaks)[2] == pytest.approx(0.4, rel=1e-12)
    still = np.array(list(content["trajectory"].values())[-1][2])
    np.testing.assert_array_equal(still[:, 1:], 0.0)
    np.testing.assert_array_equal(still[:, 0], POINTS[2])
    lines = [line for line in (tmp_path / "motion.csv").read_text().splitlines() if not line.startswith("#")]
    rows = np.array([list(map(float, line.split(","))) for line in lines[1:]])
    waiting = rows[(rows[:, 0] > arrives) & (rows[:, 0] < arrives + 0.4)]
    assert len(waiting) > 5
    np.testing.assert_array_equal(waiting[:, 1:3], np.tile(POINTS[2], (len(waiting), 1)))
    np.testing.assert_array_equal(waiting[:, 3:9], 0.0)
    assert np.ptp(waiting[:, 9:], axis=0).max() == 0.0
    assert trajectory.duration[0] == pytest.approx(rows[-1, 0])


def test_holding_costs_time_and_no_mechanical_energy(problem, front):
    stops = [{"point": 1, "stop": True}, {"point": 2, "stop": True}]
    with_dwell, without = (
        problem(passing=passing, objectives=("time", "energy")).evaluate(front.X, return_values_of=["F"])
        for passing in (STOP_AND_DWELL, stops)
    )
    np.testing.assert_allclose(with_dwell[:, 0], without[:, 0] + 0.4, rtol=1e-12)
    np.testing.assert_allclose(with_dwell[:, 1], without[:, 1], rtol=1e-12)
    squared = [
        problem(passing=[{"point": 2, "stop": True, "dwell": dwell}], objectives=("square_effort",))
        for dwell in (0.0, 2.0)
    ]
    x = np.full((1, 3), 0.9)
    first, second = (one.evaluate(x, return_values_of=["F"])[0, 0] for one in squared)
    rollout = squared[1].rollout(x)
    held = rollout.effort_in(*(np.array([[values]]) for values in (POINTS[2], [0.0, 0.0], [0.0, 0.0])))[0, 0]
    assert second - first == pytest.approx(2.0 * np.square(held).sum(), rel=1e-9), "but holding takes effort"


def test_first_populations_keep_the_limits_although_dwells_do_not_stretch(problem):
    stopping = problem(passing=STOP_AND_DWELL)
    assert Stretching.of(Limits(stopping)).possible
    X = first_population(stopping, 24, starts="fastest", seed=1).X
    G = stopping.evaluate(X, return_values_of=["F", "G"])[1]
    assert (G <= 0.0).all(axis=1).mean() == 1.0
    assert G.max(axis=1).max() > -1e-6, "on a limit"


@pytest.mark.parametrize(
    "interpolant", mostly_long(["quintic_spline", "septic_spline", "cubic", "bspline"], "quintic_spline")
)
def test_a_motion_may_begin_and_end_in_motion(problem, interpolant, small):
    passing = [Passing(0, velocity=[0.4, -0.3], acceleration=[1.0, 0.0]), Passing(3, velocity=[-0.2, 0.0])]
    front = optimise(problem(passing=passing, interpolant=interpolant), seed=1, **small)
    assert len(front), front.blocking
    fastest = front.pick("0")
    assert certify(fastest).proven
    assert verify(fastest).derivative_mismatch < 1e-8
    ends = np.array([[0.0, float(fastest.trajectory.duration[0])]])
    np.testing.assert_allclose(fastest.trajectory.evaluate(ends, 1)[0], [[0.4, -0.3], [-0.2, 0.0]], atol=1e-10)
    np.testing.assert_allclose(fastest.trajectory.evaluate(ends, 2)[0], [[1.0, 0.0], [0.0, 0.0]], atol=1e-9)


def test_a_velocity_at_an_inner_point_holds_in_every_motion(problem, small):
    front = optimise(problem(passing=[{"point": 1, "velocity": [0.5, 0.2]}]), seed=1, **small)
    assert len(front), front.blocking
    for member in (front.pick("0"), front.pick("1")):
        at = front.problem.via_times(member.x)[:, 1:2]
        np.testing.assert_allclose(member.trajectory.evaluate(at, 1)[0, 0], [0.5, 0.2], atol=1e-10)
        assert certify(member).proven


def test_a_window_is_kept_by_every_member_and_proven(problem, plain, small):
    early = plain.problem.via_times(plain.X)[:, 2].min()
    asked = problem(passing=[{"point": 2, "window": [early + 0.3, early + 0.35]}])
    assert asked.constraint_names[-2:] == ("latest at point 2", "earliest at point 2")
    front = optimise(asked, seed=1, **small)
    assert len(front), front.blocking
    instants = asked.via_times(front.X)[:, 2]
    assert (instants >= early + 0.3 - 1e-12).all()
    assert (instants <= early + 0.35 + 1e-12).all()
    proven = certify(front.pick("0"))
    assert proven.proven
    assert {"latest at point 2", "earliest at point 2"} <= {row.quantity for row in proven.rows}
    x, h = 0.5 * (asked.xl + asked.xu)[None], 1e-6
    slopes = asked.evaluate_with_gradients(x)[3][0, -2:]
    for column in range(asked.n_var):
        step = h * np.eye(asked.n_var)[column]
        G = [asked.evaluate(x + sign * step, return_values_of=["F", "G"])[1][0, -2:] for sign in (1.0, -1.0)]
        np.testing.assert_allclose(slopes[:, column], (G[0] - G[1]) / (2.0 * h), atol=1e-6)


def test_fixed_durations_are_kept_and_are_no_variables(problem, small):
    front = optimise(problem(duration_bounds=[[0.2, 3.0], [1.1, 1.1], [0.2, 3.0]]), seed=1, **small)
    assert [variable.name for variable in front.problem.variables] == ["dt_1", "dt_3"]
    assert len(front), front.blocking
    np.testing.assert_allclose(np.diff(front.problem.via_times(front.X), axis=1)[:, 1], 1.1, rtol=1e-12)
    moving = problem(duration_bounds=[[0.9, 0.9]] * 3, moving=[{"point": 1, "joints": [0.2, 0.2]}])
    assert [variable.unit for variable in moving.variables] == ["rad", "rad"]
    refused(lambda: problem(duration_bounds=[[0.9, 0.9]] * 3), "expected a duration or a point that may vary, got all")


def test_points_that_move_and_stop_are_where_the_interpolant_takes_them(problem):
    passing = [{"point": 0, "velocity": [0.1, 0.0]}, {"point": 1, "dwell": 0.3}, {"point": 2, "velocity": [0.2, 0.1]}]
    boxes = [{"point": 1, "joints": [0.2, 0.2]}, {"point": 2, "joints": [0.0, 0.1]}]
    moving = problem(passing=passing, moving=boxes)
    x = np.array([[0.8, 0.9, 1.1, 0.05, -0.1, 0.03]])
    points = np.array(POINTS)
    points[1:3] += [[0.05, -0.1], [0.0, 0.03]]
    fixed = problem(points=points, passing=passing).decode(x[:, :3])
    np.testing.assert_allclose(moving.decode(x).coefficients, fixed.coefficients, atol=1e-11)
    np.testing.assert_allclose(moving.interpolant.points_of(moving.decode(x))[0], points, atol=1e-12)


def test_a_stop_on_a_limit_needs_no_note_and_a_velocity_there_is_refused(problem):
    points = [[0.2, 0.5], [3.0, 0.9], [0.4, 1.4]]
    assert len(problem(points=points).notes) > len(problem(points=points, passing=[{"point": 1, "stop": True}]).notes)
    refused(
        lambda: problem(points=points, passing=[{"point": 1, "velocity": [0.1, 0.0]}]),
        "point 1: velocity: expected 0 for 'a', whose upper limit the point lies on, got 0.1",
    )
    assert problem(points=points, passing=[{"point": 1, "velocity": [0.0, 0.4]}])
    ends = [points[1], points[0], points[1]]
    assert problem(points=ends, passing=[{"point": 0, "velocity": [-0.1, 0]}, {"point": 2, "velocity": [0.1, 0]}])
    for end, speed in ((0, 0.1), (2, -0.1)):
        refused(
            lambda end=end, speed=speed: problem(points=ends, passing=[{"point": end, "velocity": [speed, 0]}]), "upper"
        )


@pytest.mark.parametrize(
    ("passing", "says"),
    [
        ([{"point": 1, "velocity": [2.5, 0.0]}], "point 1: velocity: 2.5 rad/s of 'a' exceeds its limit of 2 rad/s"),
        ([{"point": 0, "acceleration": [0, -13.0]}], "point 0: acceleration: 13 rad/s² of 'b' exceeds .* of 12 rad/s²"),
        ([{"point": 2, "window": [9.0, 10.0]}], "point 2: window: 9 to 10 s is never reached: .* allow 0.2 to 8 s"),
        ([{"point": 3, "window": [0.1, 0.2]}], "window: 0.1 to 0.2 s is never reached: .* allow 0.3 to 12 s"),
        (
            [{"point": 1, "dwell": 2.0}, {"point": 2, "window": [1.0, 2.0]}],
            "point 2: window: 1 to 2 s is never reached: .* allow 2.2 to 10 s",
        ),
        (
            [{"point": 1, "window": [3.0, 4.0]}, {"point": 2, "window": [1.0, 2.0]}],
            "point 2: window: 1 to 2 s is never reached: .*earlier windows allow 3.1 to 8 s",
        ),
    ],
)
def test_contradictions_with_limits_and_durations_are_refused(problem, passing, says):
    refused(lambda: problem(passing=passing), says)


def test_lines_that_stop_are_told_by_how_much_they_miss_other_points(problem, small):
    front = optimise(
        problem(interpolant="linear_blends", passing=[{"point": 1, "dwell": 0.2}], via_error=0.2), **small, seed=1
    )
    assert len(front), front.blocking
    knee = front.pick("knee")
    proven = certify(knee)
    assert proven.proven
    (told,) = [row for row in proven.rows if row.quantity == "via error"]
    at = front.problem.via_times(knee.x)
    missed = np.abs(knee.trajectory.evaluate(at)[0] - POINTS)
    assert missed[1].max() < 1e-12
    assert told.bound == pytest.approx(missed[2].max(), rel=1e-9)


def test_windows_need_points_at_breaks(problem):
    window = [{"point": 1, "window": [0.5, 1.0]}]
    refused(
        lambda: problem(interpolant="linear_blends", passing=window), "point 1: window: expected an interpolant that"
    )


def test_capacity_is_that_of_the_motion_and_a_slowdown_says_what_it_scales(front, problem, plain, small):
    knee = front.pick("knee")
    able = dlcc(knee)
    assert able.mass > 0.5
    slower = slowdown_for(knee, 0.9 * able.mass)
    assert slower.scaled_too == ("dwells",)
    assert "; scaled with the motion: dwells" in str(slower)
    given = problem(passing=[{"point": 0, "velocity": [0.1, 0]}], duration_bounds=[[0.5, 2], [0.9, 0.9], [0.5, 2]])
    other = optimise(given, seed=1, **small).pick("knee")
    assert slowdown_for(other, 0.1).scaled_too == ("given velocities", "fixed durations")
    assert slowdown_for(plain.pick("knee"), 0.1).scaled_too == ()


def test_a_cycle_goes_on_without_a_seam(problem, small):
    points = [*POINTS, POINTS[0]]
    given = {"points": points, "cyclic": True, "duration_bounds": [[0.1, 4.0]] * 3 + [[1.0, 1.0]]}
    front = optimise(problem(**given, moving=[{"point": 2, "joints": [0.1, 0.1]}]), seed=1, **small)
    assert len(front) > 5, front.blocking
    fastest = front.pick("0")
    assert certify(fastest).proven
    assert verify(fastest).derivative_mismatch < 1e-8
    ends = np.array([[0.0, float(fastest.trajectory.duration[0])]])
    for order in range(5):
        start, end = fastest.trajectory.evaluate(ends, order)[0]
        size = np.abs(fastest.trajectory.at_shares(np.linspace(0.0, 1.0, 9), order)).max()
        np.testing.assert_allclose(start, end, atol=1e-8 * size)
    assert np.abs(fastest.trajectory.evaluate(ends, 1)).max() > 0.01, "it does not rest"
    again = ViaPointProblem(**json.loads(json.dumps(front.problem.settings)))
    np.testing.assert_array_equal(again.evaluate(front.X, return_values_of=["F"]), front.F)
    resting = optimise(problem(**given | {"cyclic": False}), seed=1, **small)
    assert front.F[:, 0].min() < resting.F[:, 0].min()


def test_what_is_no_cycle_is_refused(problem):
    points = [*POINTS, POINTS[0]]
    refused(
        lambda: problem(cyclic=True), "cyclic: expected the last point to be the first, .*; repeat the first one at"
    )
    refused(lambda: problem(points=points, cyclic="yes"), "cyclic: expected true or false, got 'yes'")
    refused(lambda: problem(points=points, cyclic=True, interpolant="cubic"), "cyclic: 'cubic' makes no cyclic motions")
    stop = [{"point": 2, "stop": True}]
    refused(lambda: problem(points=points, cyclic=True, passing=stop), "cyclic: expected no stops, got one at point 2")
    moving = [{"point": 0, "velocity": [0.1, 0.0]}]
    refused(lambda: problem(points=points, cyclic=True, passing=moving), "cyclic: expected no start_velocity")
    on_limit = [[3.0, 0.5], [1.0, 0.9], [3.0, 0.5]]
    refused(lambda: problem(points=on_limit, cyclic=True), "cyclic: point 0 lies on the upper limit of 'a'")


def test_rivals_are_not_compared_where_the_motion_stops(front):
    refused(lambda: rivals_of(front.problem), "rivals: expected points that are passed freely")


TASK = """\
angle = "deg"
points = [[10.0, 30.0], [60.0, 50.0], [20.0, 80.0], [-20.0, 10.0]]
duration_bounds = [[0.1, 4.0], [0.1, 4.0], [1.5, 1.5]]
objectives = ["time", "energy"]
seed = 1

[[passing]]
point = 0
velocity = [10.0, -5.0]
acceleration = [20.0, 0.0]

[[passing]]
point = 1
stop = true
dwell = 0.4

[[passing]]
point = 2
window = [1.0, 6.0]

[robot]
name = "two.urdf"
tool = "tcp"

[limits]
acceleration = [8.0, 12.0]
jerk = [90.0, 300.0]

[algorithm]
population = 16
generations = 6
"""


def test_a_task_says_it_in_a_file_and_commands_keep_it(tmp_path):
    (tmp_path / "two.urdf").write_text(URDF, encoding="utf-8")
    (tmp_path / "task.toml").write_text(TASK, encoding="utf-8")
    problem = load_task(tmp_path / "task.toml").problem
    assert problem.settings["passing"] == [
        {"point": 0, "velocity": np.radians([10.0, -5.0]).tolist(), "acceleration": np.radians([20.0, 0.0]).tolist()},
        {"point": 1, "stop": True, "dwell": 0.4},
        {"point": 2, "window": [1.0, 6.0]},
    ]
    assert problem.settings["duration_bounds"] == [[0.1, 4.0], [0.1, 4.0], [1.5, 1.5]]
    run = ("solve", "task.toml", "--out", "run", "--quiet", "--report", "none", "--no-pictures")
    for command in (
        ("check", "task.toml"),
        run,
        ("verify", "run"),
        ("export", "run", "--format", "ros2"),
        ("resume", "run", "--generations", "8", "--quiet", *UNDRAWN),
    ):
        done = trajevo(*command, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
    front = Front.load(tmp_path / "run" / "front.json")
    assert front.problem.settings["passing"] == problem.settings["passing"]
    assert len(front) > 0


def test_a_problem_by_name_is_told_on_the_command_line(tmp_path):
    (tmp_path / "two.urdf").write_text(URDF, encoding="utf-8")
    (tmp_path / "points.csv").write_text("a [deg], b [deg]\n10, 30\n60, 50\n20, 80\n", encoding="utf-8")
    settings = (
        "robot={name='two.urdf', tool='tcp', limits={acceleration=10.0, jerk=200.0}}",
        "passing=[{point=1, dwell=0.4}]",
        "duration_bounds=[[0.1, 4.0], [0.9, 0.9]]",
    )
    given = [word for setting in settings for word in ("--set", setting)]
    done = trajevo("check", "via-points", "--points", "points.csv", *given, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    done = trajevo(
        "check", "via-points", "--points", "points.csv", *given[:3], "passing=[{point=2, dwell=1}]", cwd=tmp_path
    )
    assert done.returncode != 0
    assert (
        "passing: point 2: dwell: expected an inner point, 1 to 1, got the last, where the motion ends at"
        in done.stderr
    )


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("dwell = 0.4", "dwell = -0.4", "line 7: passing: point 1: dwell: expected 0 to 1000 s, got -0.4 s"),
        ("dwell = 0.4", "velocity = [1.0, 0.0]", "line 7: passing: point 1: expected stop or velocity, got both"),
        ("dwell = 0.4", "dwel = 0.4", "line 15: passing.1.dwel: unknown key; .*did you mean 'dwell'"),
        ("stop = true", "stop = 1", "line 14: passing.1.stop: expected true or false, got 1"),
        ("point = 1", "point = 0", "line 7: passing: expected one entry for each point, got two for point 0"),
        ("window = [1.0, 6.0]", "window = [1.0]", "line 19: passing.2.window.1: this value is missing"),
        ("[1.5, 1.5]]", "[1.5, 1.0]]", "line 3: duration_bounds: segment 2, from point 2 to 3: expected 0 < lower <="),
        (", [1.5, 1.5]]", "]", r"line 3: duration_bounds: expected shape \(3, 2\), got \(2, 2\); one pair"),
        (
            "velocity = [10.0, -5.0]",
            "velocity = [200.0, -5.0]",
            "velocity: 3.49066 rad/s of 'a' exceeds its limit of 2",
        ),
    ],
)
def test_mistakes_in_a_task_are_told_with_their_line(tmp_path, old, new, says):
    assert TASK.count(old) == 1
    (tmp_path / "two.urdf").write_text(URDF, encoding="utf-8")
    (tmp_path / "task.toml").write_text(TASK.replace(old, new), encoding="utf-8")
    refused(lambda: load_task(tmp_path / "task.toml").problem, says)


def test_settings_are_plain_and_make_an_equal_problem(problem):
    given = [
        Passing(0, velocity=np.array([0.1, 0.2]), acceleration=(0.0, 1.0)),
        Passing(np.int64(1), dwell=np.float32(0.5)),
        {"point": 2, "window": (1.0, 9.0)},
    ]
    first = problem(passing=given)
    again = ViaPointProblem(**json.loads(json.dumps(first.settings)))
    assert again.settings == first.settings
    x = 0.5 * (first.xl + first.xu)[None]
    np.testing.assert_array_equal(first.decode(x).coefficients, again.decode(x).coefficients)
    assert not re.search("stop", json.dumps(problem(passing=[{"point": 1, "stop": False}]).settings["passing"]))
