"""A base that moves: what its motions are, what a robot loaded at that place says, and derivatives through it."""

import pickle

import numpy as np
import pytest

from trajevo import Dynamics, Scene, clearance_along, load_problem, load_robot, optimise
from trajevo.base import jit
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError, TrajevoError
from trajevo.formulation.cell.base_box import BaseBox
from trajevo.formulation.cell.moving_base import MovingBase, placed_targets
from trajevo.formulation.cell.tracking import PoseTargets, pose_errors, tracked
from trajevo.formulation.cell.varied_points import reach_excess
from trajevo.path.inverse_kinematics import Pose, inverse_kinematics
from trajevo.robot.kinematics import ToolKinematics

DOWN = [np.pi, 0.0, 0.0]
POSES = [
    {"position": [0.29, -0.25, 0.12], "rpy": DOWN},
    {"position": [0.09, 0.35, 0.30], "rpy": DOWN},
    {"position": [0.39, 0.30, 0.12], "rpy": DOWN},
]
LIMITS = {"acceleration": 14.0, "jerk": 140.0}
UR5 = {"name": "ur5", "tool": "tool0", "limits": LIMITS}
ROBOT = load_robot("ur5", tool="tool0", limits=LIMITS)
BOX = {"x": [-0.45, 0.15], "y": [-0.3, 0.3], "z": [0.0, 0.25], "yaw": ["-60 deg", "60 deg"]}
USUAL = {
    "robot": ROBOT,
    "points": POSES,
    "duration_bounds": [0.2, 3.0],
    "interpolant": "quintic_spline",
    "objectives": ["time", "energy"],
    "constraints": ["position", "velocity", "acceleration", "jerk", "effort"],
    "payload": 2.0,
}


def problem(box=None, **more):
    return load_problem("via-points", **(USUAL | {"base": {"moving": BOX if box is None else box}} | more))


def drawn(given, count, seed=0):
    return np.random.default_rng(seed).uniform(given.xl, given.xu, (count, given.n_var))


def reached(given, X, within=1e-9):
    """Those of decision vectors from whose base all points are reached, away from the end of the reach."""
    arranged = given.rollout(X).arranged
    return X[(arranged.missed.max(axis=(1, 2)) <= within)]


@pytest.fixture(scope="module")
def moving():
    return problem()


def at(bases, **more):
    """The robot loaded at a base."""
    x, y, z, yaw = bases.tolist()
    return load_robot("ur5", tool="tool0", limits=LIMITS, base={"position": [x, y, z], "rpy": [0.0, 0.0, yaw]}, **more)


def test_the_tool_is_at_the_poses_by_the_word_of_pinocchio(moving):
    rollout = moving.rollout(reached(moving, drawn(moving, 30)))
    assert len(rollout.trajectory) >= 10
    times = moving.via_times(reached(moving, drawn(moving, 30)))
    for k in range(len(times)):
        positions, rotations = at(rollout.arranged.bases[k]).tool_poses(rollout.trajectory[k].evaluate(times[k])[0])
        np.testing.assert_allclose(positions, [pose["position"] for pose in POSES], atol=1e-8)
        np.testing.assert_allclose(rotations, [Pose.of(pose).rotation for pose in POSES], atol=1e-8)


def test_a_motion_is_that_of_the_robot_loaded_at_its_base(moving):
    for x in reached(moving, drawn(moving, 12))[:3]:
        arranged = moving.rollout(x).arranged
        place = {"position": arranged.bases[0, :3].tolist(), "rpy": [0.0, 0.0, float(arranged.bases[0, 3])]}
        fixed = load_problem("via-points", **USUAL | {"robot": UR5 | {"base": place}, "points": arranged.points[0]})
        for own, other in zip(moving.evaluate(x[None]), fixed.evaluate(x[None, : fixed.n_var]), strict=True):
            np.testing.assert_allclose(own[0, : other.shape[1]], other[0], rtol=1e-6, atol=1e-9)


def test_a_row_is_the_same_to_the_bit_whichever_others_are_evaluated_with_it(moving):
    X = drawn(moving, 40)
    whole = moving.rollout(X)
    for k in (0, 17, 39):
        alone = moving.rollout(X[k : k + 1])
        np.testing.assert_array_equal(alone.arranged.points[0], whole.arranged.points[k])
        np.testing.assert_array_equal(alone.trajectory.coefficients[0], whole.trajectory.coefficients[k])


def test_complex_steps_go_through_inverse_kinematics(moving):
    columns, arrangement = slice(2, None), moving.interpolant.arrangement
    for x in reached(moving, drawn(moving, 30), within=1e-12)[:6, columns]:
        exact = arrangement(x + 1e-20j * np.eye(len(x))).points.imag / 1e-20
        h = 1e-5
        ways = np.eye(len(x))
        sides = [arrangement(x + step * h * ways).points for step in (1, -1, 2, -2)]
        rough = (8.0 * (sides[0] - sides[1]) - (sides[2] - sides[3])) / (12.0 * h)
        np.testing.assert_allclose(exact, rough, rtol=1e-7, atol=1e-7 * np.abs(exact).max())


def test_the_slope_of_the_joints_is_that_of_the_implicit_function(moving):
    """J q' = the velocity with which the poses move, seen from a base that moves along x."""
    arrangement = moving.interpolant.arrangement
    x = reached(moving, drawn(moving, 30), within=1e-12)[0, 2:]
    step = arrangement(x[None] + 1e-20j * np.eye(4)[:1])
    slopes, q = step.points.imag[0] / 1e-20, step.points.real[0]
    twists = np.einsum("kij,kj->ki", ToolKinematics.of(moving.robot).jacobian(q), slopes)
    turn = x[3]
    seen = -np.array([np.cos(turn), -np.sin(turn), 0.0])
    np.testing.assert_allclose(twists[:, :3], np.tile(seen, (3, 1)), atol=1e-9)
    np.testing.assert_allclose(twists[:, 3:], 0.0, atol=1e-9)


def test_gradients_of_all_values_are_those_of_differences(moving):
    given = problem(objectives=["time", "energy", "footprint"], limits="sampled")
    x = reached(given, drawn(given, 30), within=1e-12)[:2]
    _F, dF, _G, dG = given.evaluate_with_gradients(x)
    h, ways = 1e-6, np.eye(given.n_var)
    for column, way in enumerate(ways):
        sides = [given.evaluate(x + step * h * way, return_values_of=["F", "G"]) for step in (1, -1)]
        for exact, k in ((dF, 0), (dG, 1)):
            rough = (sides[0][k] - sides[1][k]) / (2.0 * h)
            np.testing.assert_allclose(exact[..., column], rough, rtol=1e-5, atol=1e-5 * np.abs(exact).max())


def test_bases_out_of_reach_are_graded_by_what_is_missing():
    given = problem({"x": [-2.0, 0.1]})
    k = list(given.constraint_names).index("reach of point 2")
    X = np.column_stack([np.full((40, 2), 1.0), np.linspace(0.1, -2.0, 40)])
    excess = given.evaluate(X, return_values_of=["G"])[:, k]
    out = excess > 0.0
    assert (excess[~out] == -1.0).all()
    assert out.sum() > 20
    grown = np.diff(excess[out])
    assert (grown > 0.0).all()
    # Far away, every decimetre is a decimetre more: about 1 each.
    assert grown[-5:] == pytest.approx(10.0 * 2.1 / 39, rel=0.05)


def test_evolution_finds_its_way_from_a_box_of_which_little_reaches():
    given = problem({"x": [-1.6, 0.05], "y": [-1.6, 0.2]}, objectives=["time", "jerk"], limits="sampled")
    share = (given.rollout(drawn(given, 300)).arranged.missed.max(axis=(1, 2)) <= 1e-6).mean()
    assert share < 0.15
    front = optimise(given, seed=1, population=20, generations=15, polish=False, progress=False)
    assert len(front)


def test_the_excess_of_the_reach_has_no_step():
    errors = np.array([0.0, 1e-10, 5e-7, 1e-6 - 1e-12, 1e-6, 1e-6 + 1e-12, 1e-3, 0.1, 1.0])
    excess = reach_excess(np.stack([errors, np.zeros_like(errors)], axis=-1))
    assert excess[0] == excess[1] == -1.0
    assert excess[4] == 0.0
    assert (np.diff(excess[1:]) > 0.0).all()
    assert abs(excess[5] - excess[3]) < 1e-5
    assert excess[7] == pytest.approx(1.0, rel=1e-4)


@pytest.mark.parametrize("free", [None, "z"])
def test_a_redundant_arm_and_a_free_axis_follow_the_base_without_jumps(free):
    panda = load_robot("panda", lock={"panda_finger_joint1": 0.0}, tool="panda_hand_tcp", limits=LIMITS)
    turned = {} if free is None else {"free": free}
    poses = [Pose.of({"position": at, "rpy": DOWN} | turned) for at in ([0.45, -0.2, 0.3], [0.5, 0.25, 0.4])]
    q = inverse_kinematics(panda, poses)
    box = BaseBox.of({"x": [-0.25, 0.1], "yaw": [-0.4, 0.4]})
    arrangement = MovingBase(ToolKinematics.of(panda), poses, box, np.zeros(4), q[:, None], np.zeros(3))
    way = np.linspace([-0.2, -0.3], [0.05, 0.35], 400)
    arranged = arrangement(way)
    assert arranged.missed.max() <= 1e-9
    assert np.abs(np.diff(arranged.points, axis=0)).max() <= 0.02
    np.testing.assert_array_equal(arrangement(way[123:124]).points[0], arranged.points[123])
    x = way[150]
    exact = arrangement(x + 1e-20j * np.eye(2)).points.imag / 1e-20
    sides = [arrangement(x + step * 1e-6 * np.eye(2)).points for step in (1, -1)]
    np.testing.assert_allclose(exact, (sides[0] - sides[1]) / 2e-6, atol=1e-6 * np.abs(exact).max())


def test_tracking_ends_at_the_nearest_posture_where_a_pose_is_not_reached():
    kinematics = ToolKinematics.of(load_robot("ur5", tool="tool0", limits=LIMITS))
    q = np.random.default_rng(2).uniform(-1.5, 1.5, (20, 6))
    position, rotation = kinematics.pose(q)
    far = PoseTargets(2.0 * position, rotation, np.zeros((20, 3)), np.zeros(20))
    found, missed = tracked(kinematics, q, far, steps=100)
    left = pose_errors(kinematics, found, far)[:, 0]
    np.testing.assert_allclose(missed[:, 0], left, atol=1e-12)
    shoulder = np.array([0.0, 0.0, 0.089159])
    # No arm is longer than the distance at which all its links are in line.
    assert (left >= np.linalg.norm(2.0 * position - shoulder, axis=1) - 1.1).all()
    near = found + np.random.default_rng(3).normal(0.0, 0.02, (50, *found.shape))
    others = np.linalg.norm(kinematics.pose(near)[0] - far.position, axis=-1)
    assert (others >= left - 1e-4).mean() > 0.97


def test_yaw_changes_what_the_shoulder_does_and_not_the_time():
    given = problem({"yaw": [-1.0, 1.0]})
    X = np.column_stack([np.full((5, 2), 1.2), np.linspace(-1.0, 1.0, 5)])
    F, _G = given.evaluate(X, return_values_of=["F", "G"])
    np.testing.assert_allclose(F, np.tile(F[2], (5, 1)), rtol=1e-6)
    shoulder = given.rollout(X).arranged.points[:, :, 0]
    np.testing.assert_allclose(shoulder - shoulder[2], np.repeat(-X[:, 2:], 3, axis=1), atol=1e-9)


def test_obstacles_stay_in_the_cell():
    scene = {
        "clearance": 0.02,
        "obstacles": [
            {
                "shape": "box",
                "name": "post",
                "size": [0.1, 0.1, 0.6],
                "position": [0.45, 0.02, 0.2],
                "rpy": [0, 0, 0.3],
            },
            {"shape": "plane", "name": "floor", "position": [0.0, 0.0, 0.0]},
        ],
    }
    given = problem({"x": [-0.45, 0.15], "y": [-0.3, 0.3], "yaw": [-1.0, 1.0]}, scene=scene)
    X = reached(given, drawn(given, 30), within=1e-9)[:8]
    k = list(given.constraint_names).index("clearance to obstacles")
    rollout = given.rollout(X)
    distance = scene["clearance"] * (1.0 - given.constraints[-2].function(rollout)[:, 0])
    own = clearance_along(rollout, Scene.of(scene), density=60)
    for row in range(len(X)):
        robot = at(rollout.arranged.bases[row])
        there = clearance_along(Rollout(Dynamics(robot), rollout.trajectory[row]), Scene.of(scene), density=60)
        known = {(pair.first, pair.second): column for column, pair in enumerate(own.pairs)}
        for column, pair in enumerate(there.pairs):
            same = own.distances[row][:, known[pair.first, pair.second]]
            np.testing.assert_allclose(there.distances[0][:, column], same, atol=1e-5)
        # What the limit says of the moving links is no more than a dense look at them, and the base may be nearer yet.
        assert distance[row] <= there.distances[0].min() + 1e-3 or distance[row] < scene["clearance"]
    assert given.constraint_names[k] == "clearance to obstacles"
    assert (distance >= scene["clearance"]).any()
    assert (distance < scene["clearance"]).any()


def test_gradients_of_a_clearance_go_through_the_base():
    scene = {"clearance": 0.02, "obstacles": [{"shape": "sphere", "radius": 0.1, "position": [0.45, 0.02, 0.35]}]}
    given = problem({"x": [-0.4, 0.1], "y": [-0.2, 0.2]}, scene=scene, limits="sampled")
    x = reached(given, drawn(given, 20), within=1e-12)[:2]
    k = list(given.constraint_names).index("clearance to obstacles")
    exact = given.evaluate_with_gradients(x)[3][:, k]
    for column, way in enumerate(np.eye(given.n_var)):
        sides = [given.evaluate(x + step * 1e-6 * way, return_values_of=["G"])[:, k] for step in (1, -1)]
        rough = (sides[0] - sides[1]) / 2e-6
        np.testing.assert_allclose(exact[:, column], rough, rtol=1e-4, atol=1e-4 * np.abs(exact).max())


def test_the_base_may_touch_what_it_stands_on_and_nothing_else():
    scene = {
        "clearance": 0.01,
        "obstacles": [
            {"shape": "plane", "name": "floor", "position": [0.0, 0.0, 0.0]},
            {"shape": "box", "name": "pallet", "size": [0.2, 0.2, 0.1], "position": [-0.4, 0.0, 0.05]},
        ],
    }
    given = problem({"x": [-0.45, 0.15]}, scene=scene)
    k = list(given.constraint_names).index("clearance to obstacles")
    X = np.column_stack([np.full((2, 2), 1.5), [0.0, -0.4]])
    free, inside = given.evaluate(X, return_values_of=["G"])[:, k]
    assert free <= 0.0 < inside


def test_the_footprint_is_the_rectangle_around_all_joints_by_the_word_of_pinocchio():
    given = problem(objectives=["time", "footprint"])
    X = reached(given, drawn(given, 12))[:4]
    rollout = given.rollout(X)
    found = given.evaluate(X, return_values_of=["F"])[:, 1]
    for row in range(len(X)):
        robot = at(rollout.arranged.bases[row])
        origins = robot.joint_poses(rollout.q[row])[0][..., :2].reshape(-1, 2)
        base = rollout.arranged.bases[row, :2]
        seen = np.vstack([origins, base])
        assert found[row] == pytest.approx(np.ptp(origins, axis=0).prod(), rel=1e-9)
        assert found[row] <= np.ptp(seen, axis=0).prod() + 1e-12


def test_a_footprint_without_a_moving_base_is_that_of_the_robot_where_it_stands():
    fixed = load_problem("via-points", **USUAL | {"objectives": ["time", "footprint"]})
    both = problem({"x": [-0.1, 0.1]}, objectives=["time", "footprint"])
    x = np.array([[1.0, 1.2]])
    there = both.evaluate(np.column_stack([x, [[0.0]]]), return_values_of=["F"])
    np.testing.assert_allclose(fixed.evaluate(x, return_values_of=["F"]), there, rtol=1e-9)


def test_payloads_are_bounded_by_what_some_base_can_hold():
    fixed = load_problem("via-points", **USUAL | {"objectives": ["time", "unused_payload"], "payload": 0.0})
    given = problem({"x": [-0.45, 0.15], "y": [-0.3, 0.3]}, objectives=["time", "unused_payload"], payload=0.0)
    assert given.payload_range[1] > fixed.payload_range[1]
    front = optimise(given, seed=1, population=24, generations=25, polish=False, progress=False)
    heaviest = given.payload_range[1] - front.F[:, 1].min()
    assert fixed.payload_range[1] < heaviest < given.payload_range[1]


def test_settings_make_an_equal_problem_also_of_poses_that_were_objects():
    poses = [Pose.of(pose) for pose in POSES]
    given = problem(points=poses, base={"moving": {"x": ["-450 mm", 0.15], "yaw": ["-60 deg", "60 deg"]}})
    again = load_problem("via-points", **given.settings)
    assert again.settings == given.settings
    assert given.settings["base"]["moving"]["yaw"] == pytest.approx([-np.pi / 3, np.pi / 3])
    X = drawn(given, 20)
    for one, other in zip(given.evaluate(X), again.evaluate(X), strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_home_is_found_where_the_given_place_reaches_nothing():
    given = problem(
        {"x": [0.8, 2.5]},
        points=[{**pose, "position": [pose["position"][0] + 2.0, *pose["position"][1:]]} for pose in POSES],
    )
    home = given.interpolant.arrangement.home
    assert 1.2 < home[0] < 2.4
    targets = placed_targets(PoseTargets.of(given.interpolant.arrangement.poses), np.tile(home, (3, 1)), np.zeros(3))
    q = given.interpolant.arrangement.nominal
    assert pose_errors(ToolKinematics.of(given.robot), q, targets).max() <= 1e-6


def test_a_base_turns_about_its_own_origin():
    place = {"position": [0.3, -0.2, 0.1], "rpy": [0.0, 0.0, 0.5]}
    shifted = [
        {**pose, "position": [a + b for a, b in zip(pose["position"], place["position"], strict=True)]}
        for pose in POSES
    ]
    given = problem({"yaw": [-1.0, 1.0]}, robot=UR5 | {"base": place}, points=shifted)
    x = np.array([[1.0, 1.0, 0.4]])
    arranged = given.rollout(x).arranged
    np.testing.assert_allclose(arranged.origin, place["position"], atol=1e-12)
    robot = load_robot("ur5", tool="tool0", limits=LIMITS, base=place | {"rpy": [0.0, 0.0, 0.9]})
    np.testing.assert_allclose(robot.tool_poses(arranged.points[0])[0], [p["position"] for p in shifted], atol=1e-9)


def test_stops_and_dwells_are_kept_from_every_base(moving):
    given = problem(passing=[{"point": 1, "dwell": 0.2}])
    X = reached(given, drawn(given, 20))[:3]
    at_point = given.via_times(X)[:, 1]
    for later in (0.0, 0.1, 0.19):
        speeds = given.rollout(X).trajectory.evaluate(at_point[:, None] + later, 1)
        assert np.abs(speeds).max() <= 1e-9


@pytest.mark.parametrize("name", ["linear_blends", "cubic", "septic_spline"])
def test_other_interpolants_pass_the_points_of_every_base(name):
    given = problem(interpolant=name, objectives=["time"], constraints=["position", "velocity"])
    X = reached(given, drawn(given, 20))[:4]
    rollout = given.rollout(X)
    points = given.interpolant.points_of(rollout.trajectory)
    np.testing.assert_allclose(points, rollout.arranged.points, atol=1e-8)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"base": {"moving": {}}}, "base.moving: expected a range for at least one of x, y, z, yaw"),
        ({"base": {}}, "base: expected a mapping with moving"),
        ({"base": {"mowing": {"x": [0, 1]}}}, "unknown key of base 'mowing'"),
        ({"base": {"moving": {"w": [0, 1]}}}, "base.moving: no coordinate 'w'"),
        (
            {"base": {"moving": {"x": [0.3, -0.3]}}},
            "base.moving.x: expected the least and the greatest [m], got 0.3 and",
        ),
        ({"base": {"moving": {1: [0, 1]}}}, "base.moving: no coordinate 1; known: pitch, roll, x, y, yaw, z"),
        (
            {"base": {"moving": {"x": [0.0, 0.0]}}},
            "base.moving: expected a range that is wider than a point for at least one of x, y, z, yaw, pitch, roll",
        ),
        ({"base": {"moving": {"x": [0.1, 0.1], "y": [0.0, 0.0]}}}, "roll, got x = 0.1 m alone"),
        ({"base": {"moving": {"x": {-0.3, 0.3}}}}, "base.moving.x: expected the least and the greatest [m], got {"),
        ({"base": {"moving": {"x": 0.3}}}, "base.moving.x: expected the least and the greatest [m], got 0.3"),
        ({"base": {"moving": {"x": [-300, 300]}}}, "base.moving.x: 300 m looks like mm"),
        ({"base": {"moving": {"yaw": [-90, 90]}}}, "base.moving.yaw: expected at most a whole turn"),
        ({"base": {"moving": {"yaw": ["-90 mm", 1.0]}}}, "base.moving.yaw: expected a number and a unit"),
        ({"base": {"moving": {"tilt": [-0.1, 0.1]}}}, "base.moving.tilt: expected roll and pitch"),
        ({"base": {"moving": {"roll": [-30, 30]}}}, "base.moving.roll: expected at most a whole turn"),
        ({"points": [[0.0] * 6, [0.5] * 6]}, "points: point 0: expected a pose of the tool"),
        ({"points": [POSES[0], [0.5] * 6]}, "points: point 1: expected a pose of the tool"),
        ({"points": [POSES[0], POSES[0]]}, "points: point 1 repeats point 0"),
        ({"points": [POSES[0], {"position": [0.2, 0.1]}]}, "points: point 1: position"),
        ({"points": POSES[:1]}, "expected at least 2 poses"),
        ({"cyclic": True}, "cyclic: expected none where the base moves"),
        ({"moving": [{"point": 1, "tool": [0.1, 0, 0]}]}, "moving: expected none where the base moves"),
        ({"segments": [{"from": 0, "tool": "line"}]}, "segments: expected none where the base moves"),
        ({"pace": 8}, "pace: expected none where the base moves"),
        ({"extra_points": 1}, "extra_points: expected none where the base moves"),
        ({"turns": "shortest"}, "turns: expected none where the base moves"),
        ({"interpolant": "bspline"}, "expected one whose variables are times"),
        ({"interpolant": "hermite"}, "expected one whose variables are times"),
        ({"passing": [{"point": 1, "velocity": [0.1] * 6}]}, "passing: point 1: velocity: expected none"),
        ({"overshoot": 0.1}, "overshoot: expected none where the base moves"),
        ({"tool_height": 0.1}, "tool_height: expected a base that does not move along z"),
        (
            {"tool_height": 0.1, "base": {"moving": {"pitch": [0, 0.1]}}},
            "tool_height: expected a base that does not tilt",
        ),
        (
            {"base": {"moving": {"x": [3.0, 4.0]}}},
            "got none among 150 in the box; the nearest misses point 1 by",
        ),
    ],
)
def test_what_cannot_be_is_refused_in_one_sentence(change, said):
    with pytest.raises(TrajevoError) as error:
        load_problem("via-points", **(USUAL | {"base": {"moving": BOX}} | change))
    told = str(error.value)
    assert said in told, told
    assert "\n" not in told


def test_a_robot_of_joints_alone_has_no_base_to_move():
    bare = {
        "name": "axes",
        "joints": ["a", "b"],
        "limits": {"position": [-1, 1], "velocity": 1, "acceleration": 1, "jerk": 9},
    }
    with pytest.raises(InvalidInputError, match="a moving base needs a body"):
        load_problem("via-points", robot=bare, points=POSES, base={"moving": {"x": [0, 1]}})


def test_the_nearest_miss_is_told_in_millimetres():
    with pytest.raises(TrajevoError) as error:
        problem({"x": [1.2, 1.3]})
    words = str(error.value).split()
    miss = float(words[words.index("mm,") - 1])
    # The last point is 0.39 m from the given base: beyond 1.2 - 0.39 = 0.81 m, less what the arm reaches.
    assert 10.0 < miss < 1200.0


@pytest.mark.parametrize("free", [None, "x"])
def test_compiled_loops_and_numpy_track_poses_alike(free):
    kinematics = ToolKinematics.of(load_robot("ur5", tool="tool0", limits=LIMITS))
    random = np.random.default_rng(5)
    q = random.uniform(-1.5, 1.5, (60, 6))
    position, rotation = kinematics.pose(q)
    axis = np.tile(np.eye(3)[0] if free else np.zeros(3), (60, 1))
    for turned in (np.ones(60), np.zeros(60)):
        targets = PoseTargets(position, rotation, axis, turned)
        starts = q + random.normal(0.0, 0.05, q.shape)
        compiled = tracked(kinematics, starts, targets)
        with jit.uncompiled():
            plain = tracked(kinematics, starts, targets)
        settled = plain[1].max(axis=1) <= 1e-9
        assert settled.mean() > 0.9
        for one, other in zip(compiled, plain, strict=True):
            np.testing.assert_allclose(one[settled], other[settled], atol=1e-7)


def test_a_problem_goes_to_other_processes_whole():
    scene = {"clearance": 0.02, "obstacles": [{"shape": "sphere", "radius": 0.1, "position": [0.45, 0.02, 0.35]}]}
    given = problem({"x": [-0.4, 0.1]}, scene=scene)
    X = drawn(given, 5)
    there = pickle.loads(pickle.dumps(given))
    for one, other in zip(given.evaluate(X), there.evaluate(X), strict=True):
        np.testing.assert_array_equal(one, other)
