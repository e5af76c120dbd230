"""Lines and arcs of the tool and upright axes: kept at every instant, proven, in all files, and refused if impossible.

The second opinion is Pinocchio's forward kinematics at dense instants.
"""

import json
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from tests.helpers import mostly_long, refused, trajevo
from trajevo import Front, Robot, ToolSegment, ViaPointProblem, certify, check, load_robot, load_task, optimise, verify
from trajevo.base import polynomials
from trajevo.path.postures import find_postures
from trajevo.path.tool_ways import ToolWay
from trajevo.trajectory.interpolants.interpolant import breaks_at_points
from trajevo.trajectory.polynomial import PolynomialBatch
from trajevo.verification.constraint_proofs import constraint_proofs

UR5 = {"name": "ur5", "tool": "tool0", "limits": {"acceleration": 10.0, "jerk": 100.0}}
LIMITS = ("position", "velocity", "acceleration", "jerk", "effort")
DOWN = [np.pi, 0.0, 0.0]
#: Over a part, at it, on the way, over a place, at it.
POSES = [(0.45, -0.3, 0.35), (0.45, -0.3, 0.15), (0.5, 0.0, 0.45), (0.45, 0.3, 0.35), (0.45, 0.3, 0.15)]
LINES = [{"from": 0, "tool": "line"}, {"from": 3, "to": 4, "tool": "line", "tolerance": "0.1 mm"}]


@pytest.fixture(scope="module")
def robot():
    return load_robot(**UR5)


@pytest.fixture(scope="module")
def points(robot):
    return ViaPointProblem(robot=robot, points=poses(POSES)).interpolant.points.positions


@pytest.fixture(scope="module")
def problem(robot, points):
    def made(**given):
        usual = {"points": points, "objectives": ("time", "energy"), "constraints": LIMITS, "segments": LINES}
        return ViaPointProblem(**({"robot": robot, "payload": 1.0} | usual | given))

    return made


def poses(positions, rpy=DOWN):
    return [{"position": list(position), "rpy": list(rpy)} for position in positions]


def tool_at(robot, q):
    """Positions (N, 3) and orientations (N, 3, 3) of the tool by Pinocchio."""
    data, frame = robot.model.createData(), robot.model.getFrameId(robot.tool)
    found = []
    for row in q:
        pin.framesForwardKinematics(robot.model, data, np.asarray(row, dtype=float))
        found.append((data.oMf[frame].translation.copy(), data.oMf[frame].rotation.copy()))
    return tuple(np.array(each) for each in zip(*found, strict=True))


def moved(own, x, first, last, count=4001):
    """Joint positions at dense instants between two points of a motion."""
    trajectory, places = own.decode(np.atleast_2d(x)), breaks_at_points(own.interpolant)
    begin, end = trajectory.breaks[0, places[first]], trajectory.breaks[0, places[last]]
    return trajectory.evaluate(np.linspace(begin, end, count)[None])[0]


def from_line(p):
    """Distance of positions from the straight line between the first and the last, and shares of the way."""
    chord = p[-1] - p[0]
    share = (p - p[0]) @ chord / (chord @ chord)
    return np.linalg.norm(p - p[0] - share[:, None] * chord, axis=1), share


@pytest.mark.parametrize(
    "kind", mostly_long(["quintic_spline", "septic_spline", "cubic", "polynomial"], "quintic_spline", "cubic")
)
def test_every_motion_keeps_its_lines_by_pinocchio(problem, robot, kind):
    own = problem(interpolant=kind)
    if kind != "cubic":  # which has ratios of virtual knots too
        assert [variable.name for variable in own.variables] == ["dt_1", "dt_2", "dt_3", "dt_4"]
    for x in np.random.default_rng(0).uniform(own.xl, own.xu, (3, own.n_var)):
        for first, tolerance in ((0, 5e-4), (3, 1e-4)):
            p, R = tool_at(robot, moved(own, x, first, first + 1))
            off, share = from_line(p)
            assert off.max() <= 0.51 * tolerance
            assert np.diff(share).min() > -1e-9
            turned = np.linalg.norm(R - R[0], axis=(1, 2)) / np.sqrt(2.0)
            assert turned.max() < np.radians(0.26)


def test_motions_rest_where_lines_begin_and_end_and_pass_all_points(problem, points):
    own = problem(passing=[{"point": 1, "dwell": 0.3}])
    x = np.array([[0.9, 1.1, 1.2, 0.8]])
    trajectory, times = own.decode(x), own.via_times(x)
    np.testing.assert_allclose(np.diff(times[0]), [0.9, 1.4, 1.2, 0.8])
    np.testing.assert_allclose(trajectory.evaluate(times)[0], points, atol=1e-12)
    for order in (1, 2):
        rest = trajectory.evaluate(times[:, [0, 1, 3, 4]], order)
        assert np.abs(rest).max() < 1e-9
        assert np.abs(trajectory.jump(order)).max() < 1e-8
    assert np.abs(trajectory.evaluate(times[:, 2:3], 1)).max() > 0.01


def test_an_arc_runs_round_through_its_point(problem, robot, points):
    through = [0.45, -0.05, 0.3]
    own = problem(points=points[[1, 4]], segments=[{"from": 0, "tool": "arc", "through": through}])
    p, R = tool_at(robot, moved(own, np.array([2.0]), 0, 1))
    a, b, c = p[0], np.array(through), p[-1]
    # The centre is at equal distances from all three, in their plane.
    rows = np.array([b - a, c - a, np.cross(b - a, c - a)])
    centre = np.linalg.solve(rows, [0.5 * (b @ b - a @ a), 0.5 * (c @ c - a @ a), rows[2] @ a])
    radius = np.linalg.norm(a - centre)
    assert np.abs(np.linalg.norm(p - centre, axis=1) - radius).max() < 3e-4
    assert np.abs((p - centre) @ rows[2] / np.linalg.norm(rows[2])).max() < 3e-4
    assert np.linalg.norm(p - b, axis=1).min() < 1e-3
    assert np.linalg.norm(R - R[0], axis=(1, 2)).max() < 0.01
    certificate = certify(own.rollout(np.array([2.0])))
    assert certificate.rows


def test_the_orientation_goes_by_the_shortest_turn(robot):
    ends = [*poses([POSES[0]]), *poses([POSES[1]], [np.pi - 0.3, 0.2, 0.4])]
    own = ViaPointProblem(robot=robot, points=ends, constraints=LIMITS, segments=[ToolSegment(0, tool="line")])
    p, R = tool_at(robot, moved(own, np.array([1.5]), 0, 1))
    _, share = from_line(p)
    whole = pin.log3(R[0].T @ R[-1])
    for k in range(0, len(R), 50):
        expected = R[0] @ pin.exp3(share[k] * whole)
        assert np.linalg.norm(pin.log3(expected.T @ R[k])) < np.radians(0.26)


@pytest.fixture(scope="module", params=mostly_long([False, True], False), ids=lambda polish: f"polish={polish}")
def small(request):
    """Settings of a search, polished in long runs."""
    return {"seed": 1, "population": 24, "generations": 10, "progress": False, "polish": request.param}


@pytest.fixture(scope="module")
def front(problem, small):
    return optimise(problem(), **small)


#: Passed on the way, down in a line, up in a line, passed again.
FLOWING = [(0.5, 0.0, 0.5), (0.45, -0.3, 0.3), (0.45, -0.3, 0.15), (0.45, -0.3, 0.3), (0.5, 0.1, 0.45)]
APPROACH = {"from": 1, "tool": "line", "rest": "end"}
RETREAT = {"from": 2, "tool": "line", "rest": "start"}


@pytest.fixture(scope="module")
def through(robot):
    positions = ViaPointProblem(robot=robot, points=poses(FLOWING)).interpolant.points.positions

    def made(**given):
        usual = {"points": positions, "constraints": LIMITS, "segments": [APPROACH, RETREAT], "objectives": ("time",)}
        return ViaPointProblem(**({"robot": robot} | usual | given))

    return made


@pytest.mark.parametrize(
    "kind", mostly_long(["quintic_spline", "septic_spline", "cubic", "bspline"], "septic_spline", "cubic")
)
def test_lines_are_entered_and_left_without_a_stop(through, robot, kind):
    own = through(interpolant=kind)
    for x in np.random.default_rng(1).uniform(own.xl, own.xu, (3, own.n_var)):
        trajectory, times = own.decode(x[None]), own.via_times(x[None])
        np.testing.assert_allclose(trajectory.evaluate(times)[0], own.interpolant.points.positions, atol=1e-11)
        for order in (1, 2):
            size = np.abs(trajectory.peak(order)).max()
            assert np.abs(trajectory.jump(order)).max() < 1e-9 * size
        for first in (1, 2):
            p, _ = tool_at(robot, moved(own, x, first, first + 1))
            off, share = from_line(p)
            assert off.max() < 2.6e-4
            assert np.diff(share).min() > -1e-9
        # At the greatest speed of the line along it, and at rest at the part.
        speeds = [np.linalg.norm(p) for p in _tool_velocities(own, trajectory, times[0])]
        lasts = np.diff(times[0])
        law = 35.0 / 16.0 if kind == "septic_spline" else 15.0 / 8.0
        np.testing.assert_allclose(
            speeds[1:4], [law * 0.15 / lasts[1], 0.0, law * 0.15 / lasts[2]], rtol=1e-3, atol=1e-7
        )


def _tool_velocities(own, trajectory, instants):
    step = 1e-6
    for t in instants:
        inside = np.clip(np.array([[t - step, t + step]]), 0.0, trajectory.duration[0])
        p, _ = tool_at(own.robot, trajectory.evaluate(inside)[0])
        yield (p[1] - p[0]) / np.ptp(inside)


@pytest.mark.parametrize("polish", mostly_long([False, True], False))
def test_no_rest_saves_time_and_is_proven(through, polish):
    found = {}
    for rest in (True, False):
        more = {} if not rest else {"segments": [APPROACH | {"rest": "both"}, RETREAT | {"rest": "both"}]}
        own = through(objectives=("time", "energy"), **more)
        front = optimise(own, seed=1, population=20, generations=8, polish=polish, progress=False)
        assert certify(front.pick("0")).proven
        found[rest] = front.F[:, 0].min()
    assert found[False] < 0.97 * found[True]


def test_motions_without_rests_stretch_as_a_whole_and_have_exact_derivatives(through):
    own = through()
    x = np.array([[0.9, 0.7, 0.8, 1.1]])
    one, slower = own.decode(x), own.decode(1.7 * x)
    t = np.linspace(0.0, one.duration[0], 101)[None]
    np.testing.assert_allclose(slower.evaluate(1.7 * t), one.evaluate(t), atol=1e-11)
    own = through(objectives=("time", "jerk", "energy"), limits="sampled")
    F, dF, G, dG = own.evaluate_with_gradients(x)
    assert (F.shape, G.shape[0]) == ((1, 3), 1)
    for k, step in enumerate(1e-6 * np.eye(4)):
        ahead, behind = (own.evaluate(x + sign * step, return_values_of=["F", "G"]) for sign in (1, -1))
        np.testing.assert_allclose(dF[:, :, k], (ahead[0] - behind[0]) / 2e-6, rtol=1e-5, atol=1e-5)
        np.testing.assert_allclose(dG[:, :, k], (ahead[1] - behind[1]) / 2e-6, rtol=1e-4, atol=1e-5)


def test_joints_at_rest_on_their_limits_and_moving_points_go_with_lines_that_flow(robot):
    rows = ViaPointProblem(robot=robot, points=poses(FLOWING)).interpolant.points.positions
    between = 0.5 * (rows[0] + rows[1]) + np.array([0.05, 0.0, 0.1, 0.0, 0.0, 0.0])
    elbow = float(between[2])
    limits = UR5["limits"] | {"position": {"elbow_joint": [-3.0, max(elbow, float(rows[:, 2].max()) + 0.2)]}}
    narrow = load_robot(**UR5 | {"limits": limits})
    more = np.vstack([rows[0], between, rows[1:]])
    more[1, 2] = limits["position"]["elbow_joint"][1]
    segments = [{"from": 2, "tool": "line", "rest": "end"}, {"from": 3, "tool": "line", "rest": "start"}]
    usual = {"robot": narrow, "points": more, "constraints": LIMITS, "segments": segments}
    x = np.full((1, 5), 1.0)
    own = ViaPointProblem(**usual)
    at_rest = own.decode(x).evaluate(np.array([[1.0]]), 1)[0, 0]
    assert abs(at_rest[2]) < 1e-9
    assert np.abs(at_rest[[0, 1]]).min() > 1e-3
    boxed = ViaPointProblem(**usual, moving=[{"point": 1, "joints": [0.1, 0.1, 0.0, 0.1, 0.1, 0.1]}])
    same = np.append(x, np.zeros((1, 5)), axis=1)
    t = np.linspace(0.0, 5.0, 60)[None]
    np.testing.assert_allclose(boxed.decode(same).evaluate(t), own.decode(x).evaluate(t), atol=1e-10)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"segments": [APPROACH | {"rest": "none"}, RETREAT]}, "rest: expected a rest at point 2, where another line"),
        (
            {"segments": [{"from": 0, "tool": "line", "rest": "end"}]},
            "rest: expected a rest at point 0, where the whole",
        ),
        ({"segments": [APPROACH | {"rest": "never"}]}, "unknown rest of a segment .* 'never'; known: both, end, none"),
        ({"segments": [{"from": 1, "upright": 0.3, "rest": "end"}]}, "rest: expected it with tool"),
        ({"passing": [{"point": 1, "dwell": 0.2}]}, "passing: point 1: dwell: expected none.*without a rest"),
        ({"passing": [{"point": 3, "velocity": [0.1] * 6}]}, "point 3: velocity: expected none.*a velocity of its own"),
        ({"interpolant": "polynomial"}, "rest: 'polynomial' begins and ends at rest, so that lines must too"),
    ],
)
def test_lines_without_rests_that_cannot_be_are_refused(through, given, says):
    refused(lambda: through(**given), says)


def test_a_line_does_not_pass_a_joint_s_limit_without_a_rest(through, robot):
    rows = through().interpolant.points.positions
    np.testing.assert_allclose(rows[1:4, 0], rows[:, 0].min(), atol=1e-8)
    limits = UR5["limits"] | {"position": {"shoulder_pan_joint": [float(rows[:, 0].min()), 3.0]}}
    narrow = load_robot(**UR5 | {"limits": limits})
    refused(
        lambda: through(robot=narrow, segments=[APPROACH]),
        "rest: expected a rest at point 1, which lies on the lower limit of 'shoulder_pan_joint', got 'end'",
    )


def test_certificates_prove_lines_close_to_what_they_are(front, robot):
    assert len(front), front.blocking
    for pick in ("0", "knee"):
        solution = front.pick(pick)
        certificate = certify(solution)
        assert certificate.proven, str(certificate)
        rows = {row.name: row for row in certificate.rows}
        for first, tool in ((0, "distance"), (3, "distance")):
            row = rows[f"{tool} from line from point {first} to {first + 1}"]
            p, _ = tool_at(robot, moved(front.problem, solution.x, first, first + 1))
            off = from_line(p)[0].max()
            assert off <= row.bound <= row.limit
            assert off == pytest.approx(row.bound, abs=0.06 * row.limit)
            turned = rows[f"turn from line from point {first} to {first + 1}"]
            assert turned.bound < 0.1 * turned.limit
        assert verify(solution).passed
        shares = {row.limit: row.share for row in verify(solution).rows}
        row = rows["distance from line from point 0 to 1"]
        assert shares[row.name] == pytest.approx(row.exhibited / row.limit, rel=0.02)


def test_certificates_do_not_believe_a_motion_that_leaves_the_line(front, problem):
    """The same durations through the points alone, judged by the problem with lines."""
    own, x = problem(), front.pick("0").x
    free = problem(
        segments=[{"from": 0, "to": 4, "upright": 1.0}], passing=[{"point": k, "stop": True} for k in (1, 3)]
    )
    places = breaks_at_points(own.interpolant)
    curve = own.decode(x[None])
    assert places[1] == own.constraints[-1].function.ways[0].end
    wrong = free.rollout(x)
    # The free motion has one segment where the line has several: cut it at the same instants.
    cut = _cut(wrong.trajectory, curve.breaks[0])
    rows, _ = constraint_proofs(own, replace(own.rollout(x), trajectory=cut))
    row = next(row for row in rows[0] if row.name == "distance from line from point 0 to 1")
    assert row.violated
    assert row.exhibited > 20.0 * row.limit
    by_samples = next(one for one in own.constraints if one.quantity == "distance from the way")
    excess = by_samples.function(replace(own.rollout(x), trajectory=cut))
    assert excess[0, 0] == pytest.approx(row.share - 1.0, rel=0.1)


def _cut(trajectory, breaks):
    """The same motion with breaks at other instants too."""
    inner = trajectory.breaks[0]
    pieces = []
    for begin in breaks[:-1]:
        segment = min(int(np.searchsorted(inner, begin + 1e-12)) - 1, len(inner) - 2)
        own = np.moveaxis(trajectory.coefficients[0, segment], -1, 0)
        pieces.append(np.moveaxis(polynomials.shifted(own, np.full(own.shape[1], begin - inner[segment])), 0, -1))
    return PolynomialBatch(breaks[None], np.array(pieces)[None])


@pytest.mark.long
def test_upright_axes_stay_in_their_cone(robot):
    """From one posture to another with the elbow on the way: a cone of 40 deg is used up, one of 10 deg costs time."""
    rows = [
        [0.0, -1.6, 1.9, -1.87, -1.57, 0.0],
        [0.6, -0.9, 1.1, -1.77, -1.57, 0.3],
        [1.2, -1.5, 1.6, -1.67, -1.2, 0.0],
    ]
    times = []
    for angle in (40.0, 25.0):
        own = ViaPointProblem(
            robot=robot,
            points=rows,
            objectives=("time", "energy"),
            constraints=LIMITS,
            moving=[{"point": 1, "joints": [0.3] * 6}],
            segments=[{"from": 0, "to": 2, "upright": f"{angle} deg"}],
        )
        found = optimise(own, seed=1, population=40, generations=20, progress=False)
        assert len(found), found.blocking
        solution = found.pick("0")
        certificate = certify(solution)
        assert certificate.proven, str(certificate)
        (row,) = (row for row in certificate.rows if row.name == "tilt from point 0 to 2")
        _, R = tool_at(robot, moved(own, solution.x, 0, 2))
        dense = np.arccos(np.clip(np.abs(R[:, 2, 2]), 0.0, 1.0)).max()
        assert dense <= row.bound <= np.radians(angle) * (1.0 + 1e-9)
        assert row.bound == pytest.approx(dense, rel=1e-2)
        times.append(solution.F["time"])
    assert times[1] >= times[0] * (1.0 - 1e-3)


def test_derivatives_of_tilts_are_exact(robot):
    rows = [
        [0.0, -1.6, 1.9, -1.87, -1.57, 0.0],
        [0.6, -0.9, 1.1, -1.97, -1.37, 0.3],
        [1.2, -1.5, 1.6, -1.67, -1.2, 0.0],
    ]
    own = ViaPointProblem(
        robot=robot, points=rows, constraints=(), segments=[{"from": 0, "to": 2, "upright": 0.8}], limits="sampled"
    )
    x = np.array([[1.0, 1.7], [2.0, 0.6]])
    dG = own.evaluate_with_gradients(x)[3]
    assert own.gradients_by(x) == "complex step"
    for k, step in enumerate(1e-6 * np.eye(2)):
        ahead, behind = (own.evaluate(x + sign * step, return_values_of=["G"]) for sign in (1, -1))
        np.testing.assert_allclose(dG[:, :, k], (ahead - behind) / 2e-6, rtol=1e-5, atol=1e-7)


def test_one_motion_has_the_same_digits_alone_and_among_others(problem):
    own = problem(segments=[*LINES, {"from": 1, "to": 3, "upright": 0.5}])
    x = np.random.default_rng(3).uniform(0.8, 2.0, (5, own.n_var))
    F, G = own.evaluate(x, return_values_of=["F", "G"])
    for k in range(5):
        alone = own.evaluate(x[k : k + 1], return_values_of=["F", "G"])
        np.testing.assert_array_equal(alone[0][0], F[k])
        np.testing.assert_array_equal(alone[1][0], G[k])


def test_checks_know_the_least_time_of_a_line(problem):
    own = problem()
    times = {(part.first, part.last): part.seconds for part in check(own).least_times}
    curve = own.interpolant.curves[0]
    unit = [np.abs(curve(np.ones((1, 1))).at_shares(np.linspace(0, 1, 999), order)).max() for order in (1, 2, 3)]
    limits = own.robot.limits
    assert times[0, 1] >= max((unit[2] / limits.jerk.max()) ** (1 / 3), (unit[1] / limits.acceleration.max()) ** 0.5)
    fast = own.rollout(np.array([times[0, 1], 4.0, 4.0, 4.0])).trajectory
    for order, name in ((1, "velocity"), (2, "acceleration"), (3, "jerk")):
        assert (fast.peak(order)[0] <= getattr(limits, name) * (1.0 + 1e-6)).all()
    faster = own.rollout(np.array([0.99 * times[0, 1], 4.0, 4.0, 4.0])).trajectory
    assert any((faster.peak(k)[0] > getattr(limits, n)).any() for k, n in ((1, "velocity"), (3, "jerk")))


def test_settings_survive_json_and_runs_are_read_back(front, tmp_path):
    front.save(tmp_path / "front.json")
    again = Front.load(tmp_path / "front.json")
    assert again.problem.settings == front.problem.settings
    np.testing.assert_array_equal(again.problem.evaluate(front.X, return_values_of=["F"]), front.F)
    made = ViaPointProblem(**json.loads(json.dumps(front.problem.settings)))
    np.testing.assert_array_equal(made.evaluate(front.X, return_values_of=["G"]), front.G)


def test_points_beside_lines_may_move_and_ends_of_lines_not(problem):
    own = problem(moving=[{"point": 2, "tool": [0.02, 0.02, 0.02]}])
    x = np.array([[1.0, 1.0, 1.0, 1.0, 0.01, 0.0, -0.01]])
    fixed = problem().decode(x[:, :4])
    moving = own.decode(x)
    t = np.linspace(0.0, 1.0, 50)[None]
    np.testing.assert_allclose(moving.evaluate(t), fixed.evaluate(t), atol=1e-12)
    assert np.abs(moving.evaluate(t + 1.5) - fixed.evaluate(t + 1.5)).max() > 1e-3
    refused(
        lambda: problem(moving=[{"point": 3, "joints": [0.1] * 6}]),
        "moving: point 3: expected a point that no line of the tool begins or ends at",
    )


def test_planar_arms_follow_lines_by_position():
    arm = Robot.planar([0.5, 0.4], [1.0, 1.0], [0.25, 0.2], [0.01, 0.01])
    own = ViaPointProblem(
        robot=arm, points=[[0.3, 1.2], [0.9, 0.8]], constraints=(), segments=[{"from": 0, "tool": "line"}]
    )
    p, _ = tool_at(arm, moved(own, np.array([1.0]), 0, 1))
    assert from_line(p)[0].max() < 3e-4
    assert [name.partition(" from")[0] for name in own.constraint_names] == ["distance"]


TASK = """
robot = {{ name = "ur5", tool = "tool0" }}
angle = "deg"
points = [
    {{ position = [0.45, -0.3, 0.35], rpy = [180.0, 0.0, 0.0] }},
    {{ position = [0.45, -0.3, 0.15], rpy = [180.0, 0.0, 0.0] }},
    {{ position = [0.45, 0.0, 0.35], rpy = [180.0, 0.0, 0.0] }},
]
duration_bounds = [0.2, 4.0]
limits = {{ acceleration = 10.0, jerk = 100.0 }}
[[segment]]
from = 0
to = 1
tool = "line"
turning = 0.2
{more}
[[segment]]
from = 0
to = 2
upright = {upright}
[algorithm]
generations = 4
population = 16
polish = false
"""


def test_tasks_state_lines_and_cones_in_their_unit_of_angles(tmp_path):
    (tmp_path / "task.toml").write_text(TASK.format(more='tolerance = "0.2 mm"', upright="5.0"))
    settings = load_task(tmp_path / "task.toml").problem.settings["segments"]
    assert settings[0]["turning"] == pytest.approx(np.radians(0.2))
    assert settings[0]["tolerance"] == pytest.approx(2e-4)
    assert settings[1]["upright"] == pytest.approx(np.radians(5.0))
    (tmp_path / "task.toml").write_text(TASK.format(more="", upright='"5 deg"'))
    assert load_task(tmp_path / "task.toml").problem.settings["segments"][1]["upright"] == pytest.approx(np.radians(5))
    done = trajevo("solve", "task.toml", "--seed", "1", "--quiet", "--report", "none", "--no-pictures", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    done = trajevo("certify", "runs/task", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "distance from line from point 0 to 1" in " ".join(done.stdout.split())


@pytest.mark.parametrize(
    ("more", "upright", "says"),
    [
        ("tolerance = 0.5", "5.0", "line 11.*from 0 to 1: tolerance: expected .* got 0.5 m; 0.0005 if it is mm"),
        ("throuh = [0, 0, 0]", "5.0", "line 16: .*throuh.*did you mean 'through'"),
        ("", '"5 degs"', "upright: expected a number and a unit that converts to rad"),
        ("", "95.0", "upright: expected an angle from .* to below π/2 rad"),
    ],
)
def test_mistakes_in_tasks_name_file_and_segment(tmp_path, more, upright, says):
    (tmp_path / "task.toml").write_text(TASK.format(more=more, upright=upright))
    refused(lambda: load_task(tmp_path / "task.toml"), f"task.toml: .*({says})")


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"segments": [{"to": 1, "tool": "line"}]}, "segments.0: expected from and to"),
        ({"segments": [{"from": 0}]}, "from 0 to 1: expected tool = 'line' or 'arc', or upright, got neither"),
        ({"segments": [{"from": 0, "to": 2, "tool": "line"}]}, "expected neighbouring points"),
        ({"segments": [{"from": 2, "to": 1, "upright": 0.1}]}, "to: expected a point after 2"),
        ({"segments": [{"from": 4, "tool": "line"}]}, "from 4 to 5: to: expected at most 4, the last point"),
        ({"segments": [LINES[0], LINES[0]]}, "from 0 to 1: expected one entry with tool"),
        ({"segments": [{"from": 0, "tool": "lin"}]}, "unknown tool of a segment .* 'lin'.*did you mean 'line'"),
        ({"segments": [{"from": 0, "tool": "arc"}]}, "through: expected the position of the tool on the way"),
        ({"segments": [{"from": 0, "tool": "line", "through": [1, 0, 0]}]}, "through: expected .* with tool = 'arc'"),
        (
            {"segments": [{"from": 0, "tool": "arc", "through": [0.45, -0.3, 0.2]}]},
            "through: expected a position beside the line of the two points",
        ),
        ({"segments": [{"from": 0, "tool": "line", "speed": 1.0}]}, "unknown key 'speed'; known: axis"),
        ({"segments": [{"from": 0, "upright": 30.0}]}, 'write "30 deg" if it is in degrees'),
        ({"segments": [{"from": 0, "upright": 0.1, "axis": "x"}]}, "upright: at point 0 the tool's axis .* is 90 deg"),
        ({"segments": [{"from": 0, "upright": 0.1, "axis": "w"}]}, "unknown axis of the tool.*known: -x, -y, -z"),
        (
            {"passing": [{"point": 1, "velocity": [0.1] * 6}]},
            "passing: point 1: velocity: expected none, as a line of the tool ends there at rest",
        ),
        (
            {"interpolant": "linear_blends", "passing": [{"point": 2, "window": [0, 9]}]},
            "point 2: window|segments meet",
        ),
        ({"segments": [{"from": 0, "to": 2, "upright": 0.1}], "interpolant": "linear_blends"}, "where segments meet"),
    ],
)
def test_what_contradicts_itself_is_refused_in_a_sentence(problem, given, says):
    refused(lambda: problem(**given), says)


def between(robot, *ends):
    return ViaPointProblem(robot=robot, points=list(ends), constraints=(), segments=[{"from": 0, "tool": "line"}])


def test_a_line_that_no_posture_joins_names_segment_and_place(robot, points):
    # Through the column of the robot, where the wrist cannot be.
    across = [*poses([(0.3, -0.2, 0.3), (-0.3, 0.2, 0.3)])]
    refused(
        lambda: between(robot, *across),
        r"segments: from 0 to 1: at \d+ % of the line, \[.*\] m, .*(does not reach|would jump)",
    )
    # The same pose with the elbow down: the posture would have to jump.
    positions, rotations = robot.tool_poses(points[1][None])
    found = find_postures(robot, positions, rotations[0], seed=0).q
    other = found[np.abs(found - points[1]).max(axis=1).argmax()]
    refused(
        lambda: between(robot, points[0], other),
        "no posture joins the points 0 and 1: .* would jump from .* in one posture",
    )


def test_a_line_that_leaves_the_range_of_a_joint_names_joint_and_place(robot, points):
    ends = points[[1, 4]]
    wide = between(robot, *ends)
    elbow = moved(wide, np.array([1.0]), 0, 1)[:, 2]
    assert elbow.max() > ends[:, 2].max() + 0.05
    limits = {"position": {"elbow_joint": [-3.0, float(ends[:, 2].max()) + 0.02]}}
    narrow = load_robot(**UR5 | {"limits": UR5["limits"] | limits})
    refused(
        lambda: between(narrow, *ends),
        r"at \d+ % of the line, .* 'elbow_joint' leaves its range",
    )


def test_robots_without_a_body_and_turns_by_half_a_turn_are_refused(robot):
    bare = Robot.from_limits(velocity=[1.0, 1.0], acceleration=[2.0, 2.0], jerk=[9.0, 9.0])
    refused(
        lambda: ViaPointProblem(robot=bare, points=[[0, 0], [1, 1]], segments=[{"from": 0, "tool": "line"}]),
        "a line of the tool needs a body",
    )
    ends = np.array([[0.0, -1.5, 1.5, -1.5, -1.5, 0.0], [0.2, -1.5, 1.5, -1.5, -1.5, np.pi + 0.2]])
    way = ToolSegment(0, tool="line")
    refused(lambda: ToolWay.of(way, robot, *ends), "would turn by 179.* deg, half a turn.*put a point between")
    refused(lambda: ToolWay.of(way, robot, ends[0], ends[0]), "expected two positions of the tool")
