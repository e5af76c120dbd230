"""Postures and the order of visits as variables of a problem: what they decode to, gradients, settings and mistakes."""

import copy
import itertools
import json
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.helpers import refused
from trajevo import Pose, check, load_problem, load_robot, load_task
from trajevo.formulation.cell.varied_points import VariedPoints
from trajevo.formulation.cell.visits import Visits
from trajevo.robot.kinematics import ToolKinematics

UR5 = {"name": "ur5", "tool": "tool0", "limits": {"acceleration": 14.0, "jerk": 140.0}}
POSES = [
    {"position": [0.45, -0.25, 0.12], "rpy": [np.pi, 0.0, 0.0]},
    {"position": [0.30, -0.30, 0.40], "rpy": [np.pi, 0.0, 1.5]},
    {"position": [0.15, 0.40, 0.45], "rpy": [np.pi, -0.5, 1.5]},
    {"position": [-0.20, 0.45, 0.30], "rpy": [np.pi, 0.0, 3.0]},
    {"position": [-0.45, 0.25, 0.12], "rpy": [np.pi, 0.0, 3.0]},
]
#: Two joints and nothing else, which is quick.
PLANE = {
    "name": "table",
    "joints": ["a", "b"],
    "kind": "prismatic",
    "limits": {"position": [[-1.0, 1.0]] * 2, "velocity": 1.0, "acceleration": 5.0, "jerk": 50.0},
}
PLACES = [[0.0, 0.0], [0.9, 0.1], [0.1, 0.6], [0.8, 0.7], [0.3, 0.2], [0.0, 0.9]]


def on_table(**arguments):
    given = {"robot": PLANE, "points": PLACES, "duration_bounds": (0.1, 3.0), "order": "free"}
    return load_problem("via-points", **(given | arguments))


def of_arm(**arguments):
    limits = {"constraints": ["position", "velocity", "acceleration", "jerk"]}
    return load_problem(
        "via-points", **({"robot": UR5, "points": POSES, "duration_bounds": (0.1, 3.0)} | limits | arguments)
    )


@pytest.fixture(scope="module")
def arm():
    return of_arm(order={"free": [1, 2, 3], "after": {1: [3]}}, postures="all")


def drawn(problem, count, seed=0):
    return np.random.default_rng(seed).uniform(problem.xl, problem.xu, (count, problem.n_var))


def visits_of(problem) -> Visits:
    assert isinstance(problem.interpolant, VariedPoints)
    assert isinstance(problem.interpolant.arrangement, Visits)
    return problem.interpolant.arrangement


def test_motions_pass_the_poses_in_the_order_of_their_keys(arm):
    x = drawn(arm, 20)
    found, times = arm.rollout(x), arm.via_times(x)
    orders = found.arranged.order
    assert visits_of(arm).free.keeps(orders).all()
    assert len(np.unique(orders, axis=0)) == 3  # of 6 orders, those with 3 before 1
    position, rotation = ToolKinematics.of(arm.robot).pose(found.trajectory.evaluate(times))
    wanted = np.array([pose["position"] for pose in POSES])[orders]
    np.testing.assert_allclose(position, wanted, atol=2e-6)
    np.testing.assert_allclose(rotation, np.array([Pose.of(pose).rotation for pose in POSES])[orders], atol=1e-5)


def test_columns_hold_points_to_postures_and_0_leaves_the_quickest(arm):
    visits = visits_of(arm)
    held = visits.posture_columns
    columns = np.full((8, len(visits.variables)), 0.5)
    best = visits(columns).branch
    np.testing.assert_array_equal(best, best[:1].repeat(8, axis=0))
    columns[:, held.start + 2] = np.arange(8) + 1.2  # the third point, each of its postures
    orders, found = visits.orders(columns), visits(columns).branch
    np.testing.assert_array_equal(found[orders == 2], np.arange(8))
    assert (visits.leg_times(columns).sum(axis=1) >= visits.leg_times(columns[:1] * 0 + 0.5).sum() - 1e-12).all()


def test_a_given_order_has_one_column_of_ranked_sequences():
    problem = of_arm(postures="all")
    assert [v.name for v in problem.variables[4:]] == ["postures"]
    visits = visits_of(problem)
    columns = np.arange(32)[:, None] + 0.5
    cost = visits.leg_times(columns).sum(axis=1)
    np.testing.assert_allclose(cost, visits.ranked.cost, rtol=1e-12)
    assert (np.diff(cost) >= 0.0).all()
    assert len(np.unique(visits(columns).branch, axis=0)) == 32


def test_the_best_postures_are_never_slower_than_the_nearest():
    best, nearest = of_arm(postures="best"), of_arm()
    assert best.n_var == nearest.n_var == 4
    travel = visits_of(best).travel
    points = visits_of(best).nominal, nearest.interpolant.points.positions
    quick, usual = (sum(travel.costs(a, b) for a, b in itertools.pairwise(each)) for each in points)
    assert quick <= usual + 1e-12


@given(seed=st.integers(0, 10_000))
@settings(max_examples=25, deadline=None)
def test_precedence_is_kept_by_every_decision_vector(seed):
    problem = on_table(order={"free": [1, 2, 3, 4], "after": {4: [2], 2: [3]}})
    x = drawn(problem, 30, seed)
    orders = problem.rollout(x).arranged.order
    places = np.argsort(orders, axis=1)
    assert (places[:, 3] < places[:, 2]).all()
    assert (places[:, 2] < places[:, 4]).all()
    assert (orders[:, [0, 5]] == [0, 5]).all()


def test_derivatives_are_exact_and_0_for_columns_that_choose(arm):
    x = drawn(arm, 3)
    _F, dF, G, dG = arm.evaluate_with_gradients(x)
    columns = arm.interpolant.variables.index(next(v for v in arm.variables if v.unit == "1"))
    assert not dF[:, :, columns:].any()
    assert not dG[:, :, columns:].any()
    step = 1e-6 * np.eye(arm.n_var)[:columns]
    there, back = (arm.evaluate(x[0] + sign * step, return_values_of=["F"]) for sign in (1.0, -1.0))
    np.testing.assert_allclose(dF[0, :, :columns], (there - back).T / 2e-6, rtol=1e-5, atol=1e-5)
    assert np.isfinite(G).all()


def test_a_row_does_not_know_others(arm):
    x = drawn(arm, 8)
    F, G = arm.evaluate(x)
    np.testing.assert_array_equal(arm.evaluate(x[3:4])[0], F[3:4])
    again = load_problem("via-points", **json.loads(json.dumps(arm.settings)))
    for other in (copy.deepcopy(arm), pickle.loads(pickle.dumps(arm)), again):
        np.testing.assert_array_equal(other.evaluate(x)[0], F)
        np.testing.assert_array_equal(other.evaluate(x)[1], G)
    assert again.settings == arm.settings


def test_whole_turns_are_states_of_joint_positions():
    points = [[0.0, -1.0, 1.0, 0.0, 1.0, 5.7], [0.5, -1.2, 1.0, 0.0, 1.0, -0.6], [1.0, -1.0, 1.0, 0.0, 1.0, 5.7]]
    shortest = of_arm(points=points, postures="best", turns="shortest")
    written = of_arm(points=points, postures="best")
    assert visits_of(shortest).tour.cost < visits_of(written).tour.cost
    np.testing.assert_allclose(shortest.interpolant.points.positions[1, 5], -0.6 + 2.0 * np.pi)


def test_moving_bases_postures_and_orders_go_together():
    base = {"moving": {"x": [-0.1, 0.1], "y": [-0.1, 0.1]}}
    problem = of_arm(base=base, order={"free": [1, 2, 3]}, postures="all")
    x = drawn(problem, 6)
    found = problem.rollout(x)
    assert found.arranged.bases.shape == (6, 4)
    assert found.arranged.order.shape == (6, 5)
    kept = (found.arranged.missed < 1e-6).all(axis=(1, 2))
    assert kept.any()
    position, _ = ToolKinematics.of(problem.robot).pose(found.arranged.points[kept])
    wanted = np.array([pose["position"] for pose in POSES])[found.arranged.order[kept]]
    np.testing.assert_allclose(position, wanted - found.arranged.bases[kept, None, :3], atol=2e-6)


def test_what_is_known_of_points_does_not_depend_on_chance():
    """Two free points have two orders, which a few motions may share."""
    problem = on_table(points=[PLACES[0], PLACES[1], PLACES[2], PLACES[5]])
    found = check(problem)
    assert not found.impossible
    fastest = min(found.least_times, key=lambda each: each.first - each.last)
    assert fastest.seconds > 0.0


def test_files_say_the_same(tmp_path):
    file = tmp_path / "task.toml"
    file.write_text(
        'format = 1\nrobot = { name = "t", joints = ["a", "b"], kind = "prismatic" }\nduration_bounds = [0.1, 3.0]\n'
        f"points = {PLACES}\nobjectives = ['time', 'jerk']\n[order]\nfree = 'all'\nafter = {{ 4 = 2, 2 = [3] }}\n"
        "[limits]\nposition = [[-1.0, 1.0], [-1.0, 1.0]]\nvelocity = 1.0\nacceleration = 5.0\njerk = 50.0\n"
    )
    problem = load_task(file).problem
    assert problem.settings["order"] == {"free": [1, 2, 3, 4], "after": {"2": [3], "4": [2]}}
    file.write_text(file.read_text().replace("4 = 2,", "3 = 2,"))
    refused(
        lambda: load_task(file), "task.toml: line 6: order: after: expected points that can come one after another, got"
    )


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"order": {"free": [1, 2], "after": {1: [2], 2: [1]}}}, "got 1 after 2 after 1"),
        ({"order": {"free": [1, 9]}}, "order: free: expected numbers of points from 0 to 5, got 9"),
        ({"passing": [{"point": 1, "stop": True}]}, "passing: point 1: expected stop at all points of its free group"),
        ({"passing": [{"point": 2, "dwell": 0.5}]}, "passing: point 2: expected dwell = 0.5 at all points"),
        ({"passing": [{"point": 2, "window": [1.0, 2.0]}]}, "passing: point 2: window: the point is free"),
        ({"duration_bounds": [[0.1, 3.0]] * 4 + [[0.2, 3.0]]}, "duration_bounds: expected the same for all segments"),
        ({"cyclic": True, "points": [*PLACES, PLACES[0]]}, "cyclic: expected none where postures or the order"),
        ({"moving": [{"point": 1, "joints": [0.1, 0.1]}]}, "moving: expected none where postures or the order"),
        ({"extra_points": 1}, "extra_points: expected none where postures or the order"),
        ({"interpolant": "bspline"}, "interpolant: expected one whose variables are times"),
        ({"postures": "some"}, "unknown postures 'some'; known: all, best, nearest"),
        ({"points": [[2.0, 0.0], *PLACES[1:]]}, "points: point 0 puts 'a' at 2 m, outside its range -1 to 1 m"),
        ({"points": [*PLACES[:4], PLACES[3], PLACES[5]]}, "points: points [34] and [34] are the same"),
        ({"points": [PLACES[0]]}, "at least 2 points"),
        ({"points": [[0.0], *PLACES[1:]]}, "points: point 0: expected shape"),
    ],
)
def test_mistakes_are_told_in_a_sentence(arguments, said):
    refused(lambda: on_table(**arguments), said)


def test_loads_and_segments_at_free_points_are_refused():
    load = {"mass": 1.0, "com": [0.0, 0.0, 0.05]}
    free = {"order": {"free": [1, 2, 3]}, "postures": "nearest"}
    refused(
        lambda: of_arm(payload=[load | {"from": 2, "to": 4}], **free), "payload.0: from: point 2 is free in its order"
    )
    refused(lambda: of_arm(payload=[load | {"to": 3}], **free), "payload.0: to: point 3 is free in its order")
    assert of_arm(payload=[load | {"from": 0, "to": 4}], **free).n_var == 7
    line = {"from": 0, "tool": "line"}
    refused(lambda: of_arm(segments=[line], **free), "segments: expected none where postures or the order are chosen")
    refused(lambda: of_arm(postures=["all"]), r"unknown postures \['all'\]: expected a name, got list")
    upright = {"from": 0, "to": 2, "upright": 0.5}
    refused(lambda: of_arm(segments=[upright], **free), "segments: from 0 to 2: to: point 2 is free in its order")
    assert of_arm(segments=[upright | {"to": 4}], **free).n_ieq_constr > of_arm(**free).n_ieq_constr
    far = [*POSES[:2], {"position": [3.0, 0.0, 0.0]}, *POSES[3:]]
    refused(lambda: of_arm(points=far, **free), "point 2: expected a pose that 'ur5' reaches")


def test_points_of_a_group_may_all_stop():
    problem = on_table(passing=[{"point": k, "dwell": 0.25} for k in (1, 2, 3, 4)])
    found = problem.rollout(drawn(problem, 5))
    v = found.trajectory.evaluate(problem.via_times(drawn(problem, 5))[:, 1:5], 1)
    assert np.abs(v).max() < 1e-9


def test_a_robot_without_limits_cannot_be_compared():
    robot = load_robot("ur5", tool="tool0", limits=dict.fromkeys(("velocity", "acceleration", "jerk"), np.inf))
    refused(lambda: of_arm(robot=robot, postures="best"), "has no limit of velocity, acceleration or jerk")
