"""Postures of points, times of travel between them, best sequences and orders: against enumeration and Ruckig."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.helpers import refused
from trajevo import Pose, ViaPoints, load_robot
from trajevo.path.choices.branches import branches_of, reached
from trajevo.path.choices.orders import FreeOrder
from trajevo.path.choices.sequences import best_sequences, best_states
from trajevo.path.choices.tours import _local, best_tour
from trajevo.path.choices.travel_times import TravelTimes, rest_to_rest
from trajevo.robot.kinematics import ToolKinematics
from trajevo.trajectory.interpolants.stop_and_go import stop_and_go

LIMITS = {"acceleration": 14.0, "jerk": 140.0}
POSES = [
    {"position": [0.45, -0.25, 0.12], "rpy": [np.pi, 0.0, 0.0]},
    {"position": [0.30, -0.30, 0.40], "rpy": [np.pi, 0.0, 1.5]},
    {"position": [0.15, 0.40, 0.45], "rpy": [np.pi, -0.5, 1.5]},
    {"position": [-0.20, 0.45, 0.30], "rpy": [np.pi, 0.0, 3.0]},
    {"position": [-0.45, 0.25, 0.12], "rpy": [np.pi, 0.0, 3.0]},
]


@pytest.fixture(scope="module")
def ur5():
    return load_robot("ur5", tool="tool0", limits=LIMITS)


@pytest.fixture(scope="module")
def states(ur5):
    poses = [Pose.of(pose) for pose in POSES]
    return branches_of(ur5, poses, reached(ur5, poses))


def one_each(branches):
    """The first state of every posture of every point."""
    return [each.q[np.unique(each.posture, return_index=True)[1]] for each in branches]


@given(
    distance=st.floats(1e-6, 10.0),
    velocity=st.floats(0.1, 10.0),
    acceleration=st.floats(0.1, 100.0),
    jerk=st.floats(0.1, 1e4),
)
@settings(max_examples=60, deadline=None)
def test_a_joint_takes_the_time_that_ruckig_finds(distance, velocity, acceleration, jerk):
    import ruckig

    inputs, found = ruckig.InputParameter(1), ruckig.Trajectory(1)
    inputs.current_position, inputs.target_position = [0.0], [distance]
    inputs.max_velocity, inputs.max_acceleration, inputs.max_jerk = [velocity], [acceleration], [jerk]
    assert ruckig.Ruckig(1).calculate(inputs, found) in (ruckig.Result.Working, ruckig.Result.Finished)
    least = rest_to_rest(np.array(distance), velocity, acceleration, jerk)
    np.testing.assert_allclose(least, found.duration, rtol=1e-6)


def test_limits_may_be_missing():
    distance = np.array([0.0, 2.0])
    np.testing.assert_allclose(rest_to_rest(distance, 4.0, np.inf, np.inf), distance / 4.0, rtol=1e-9)
    np.testing.assert_allclose(rest_to_rest(distance, np.inf, 8.0, np.inf), 2.0 * np.sqrt(distance / 8.0), rtol=1e-9)
    np.testing.assert_allclose(rest_to_rest(distance, np.inf, np.inf, 4.0), np.cbrt(32.0 * distance / 4.0), rtol=1e-9)


def test_travel_takes_as_long_as_the_stop_and_go_motion(ur5, states):
    start, end = states[0].q[0], states[1].q[3]
    motion = stop_and_go(ViaPoints(np.array([start, end])), ur5.limits, profile="double_s", straight=False)
    np.testing.assert_allclose(TravelTimes.of(ur5)(start, end), motion.duration[0], rtol=1e-9)


def test_a_joint_without_limits_is_refused():
    robot = load_robot("ur5", tool="tool0", limits=dict.fromkeys(("velocity", "acceleration", "jerk"), np.inf))
    refused(lambda: TravelTimes.of(robot), "limits: 'shoulder_pan_joint' has no limit of velocity")


def test_every_state_reaches_its_pose_within_the_ranges(ur5, states):
    tool = ToolKinematics.of(ur5)
    for pose, each in zip(POSES, states, strict=True):
        position, rotation = tool.pose(each.q)
        assert np.abs(position - pose["position"]).max() < 1e-6
        assert np.abs(rotation - Pose.of(pose).rotation).max() < 1e-5
        assert (each.q >= ur5.limits.lower).all()
        assert (each.q <= ur5.limits.upper).all()
        assert len(each.names) == 8


def test_postures_have_names_of_their_own_and_turns_none(states):
    for each in states:
        assert len(set(each.names)) == 8
        for part in ("shoulder left", "shoulder right", "elbow up", "elbow down", "wrist flip", "wrist no flip"):
            assert sum(part in name for name in each.names) == 4
        for number in range(8):
            turns = np.diff(each.q[each.posture == number], axis=0) / (2.0 * np.pi)
            np.testing.assert_allclose(turns, np.rint(turns), atol=1e-9)
            assert (np.abs(turns).max(axis=1) > 0.5).all()


def test_the_elbow_is_up_where_it_is_above_the_line_to_the_wrist(ur5, states):
    origins, _ = ToolKinematics.of(ur5).joint_lines(states[0].q)
    for q, number in zip(origins, states[0].posture, strict=True):
        shoulder, elbow, wrist = q[1], q[2], q[3]
        share = (elbow - shoulder)[:2] @ (wrist - shoulder)[:2] / np.sum((wrist - shoulder)[:2] ** 2)
        above = elbow[2] > shoulder[2] + share * (wrist - shoulder)[2]
        assert above == ("elbow up" in states[0].names[number])


def test_other_arms_are_named_by_signs_of_joints():
    robot = load_robot("panda", tool="panda_hand_tcp", lock={"panda_finger_joint1": 0.0}, limits=LIMITS)
    pose = Pose.of({"position": [0.4, 0.1, 0.5], "rpy": [np.pi, 0.0, 0.0]})
    (found,) = branches_of(robot, [pose], reached(robot, [pose]), most=8)
    assert len(set(found.names)) == len(found.names) > 1
    assert any("panda_joint" in name for name in found.names)


def test_joint_positions_are_reached_in_one_way_or_after_whole_turns(ur5):
    points = np.array([[0.1, -1.0, 1.0, 0.0, 1.0, 5.7], [0.2, -1.2, 1.0, 0.0, 1.0, -0.6]])
    assert [len(each.q) for each in branches_of(ur5, list(points), points)] == [1, 1]
    turned = branches_of(ur5, list(points), points, turns=True)
    assert min(np.abs(turned[1].q - points[0]).max(axis=1)) < 0.3


def test_sequences_are_those_of_enumeration_to_the_bit(ur5, states):
    """32,768 sequences of 8 postures at 5 points: none is better, and the best 32 have exactly their costs."""
    q, travel = one_each(states), TravelTimes.of(ur5)
    costs = [travel.costs(one[:, None], other[None]) for one, other in itertools.pairwise(q)]
    found = best_sequences(costs, [np.arange(8)] * 5, 32)
    total = np.zeros((8,) * 5)
    for k, cost in enumerate(costs):
        total = total + cost.reshape([8 if axis in (k, k + 1) else 1 for axis in range(5)])
    assert total.size == 32768
    np.testing.assert_array_equal(found.cost, np.sort(total, axis=None)[:32])
    np.testing.assert_array_equal(total[tuple(found.states.T)], found.cost)


@given(seed=st.integers(0, 10_000))
@settings(max_examples=25, deadline=None)
def test_sequences_of_labels_are_listed_once_each_with_its_best_states(seed):
    random = np.random.default_rng(seed)
    sizes = random.integers(1, 5, 4)
    labels = [random.integers(0, 3, size) for size in sizes]
    costs = [random.integers(1, 6, pair).astype(float) for pair in itertools.pairwise(sizes)]
    every = {}
    for states in itertools.product(*map(range, sizes)):
        cost = sum(step[pair] for step, pair in zip(costs, itertools.pairwise(states), strict=True))
        key = tuple(int(label[k]) for label, k in zip(labels, states, strict=True))
        every[key] = min(every.get(key, np.inf), cost)
    found = best_sequences(costs, labels, 10)
    told = [tuple(int(label[k]) for label, k in zip(labels, row, strict=True)) for row in found.states]
    assert len(set(told)) == len(told) == min(10, len(every))
    np.testing.assert_array_equal(found.cost, sorted(every.values())[: len(told)])
    np.testing.assert_array_equal([every[key] for key in told], found.cost)


def test_states_may_be_held():
    random = np.random.default_rng(0)
    times = random.uniform(0.1, 1.0, (4, 4, 3, 3))
    orders = np.array([[0, 2, 1, 3], [0, 1, 2, 3]])
    allowed = np.ones((2, 4, 3), dtype=bool)
    allowed[0, 2] = [False, False, True]
    states, cost = best_states(orders, times, allowed)
    assert states[0, 1] == 2
    for row, order in enumerate(orders):
        ways = [w for w in itertools.product(range(3), repeat=4) if row or w[1] == 2]
        steps = [sum(times[order[k], order[k + 1], w[k], w[k + 1]] for k in range(3)) for w in ways]
        np.testing.assert_allclose(cost[row], min(steps), rtol=1e-12)


def some_order(random, count):
    """A random order of groups with precedence that can be kept."""
    inner = random.permutation(np.arange(1, count - 1))
    cut = int(random.integers(2, len(inner) + 1))
    groups = [sorted(inner[:cut].tolist())] + ([sorted(inner[cut:].tolist())] if len(inner) - cut >= 2 else [])
    after = {}
    for group in groups:
        chain = random.permutation(group)
        for first, then in itertools.pairwise(chain.tolist()):
            if random.random() < 0.3:
                after.setdefault(then, []).append(first)
    return FreeOrder.of({"free": groups, "after": after}, count)


@given(seed=st.integers(0, 10_000))
@settings(max_examples=40, deadline=None)
def test_precedence_is_never_broken_whatever_the_keys(seed):
    random = np.random.default_rng(seed)
    free = some_order(random, int(random.integers(4, 12)))
    keys = random.choice([random.random((50, len(free.free))), np.zeros((50, len(free.free)))])
    orders = free.decoded(keys)
    assert free.keeps(orders).all()
    np.testing.assert_array_equal(free.decoded(free.keys(orders)), orders)
    wrong = orders[:, ::-1]
    assert not free.keeps(wrong)[(wrong != orders).any(axis=1)].any() or len(free.after) == 0


@pytest.mark.parametrize("seed", range(6))
def test_the_best_order_is_that_of_enumeration(seed):
    random = np.random.default_rng(seed)
    free = some_order(random, 8)
    times = random.uniform(0.1, 1.0, (8, 8, 3, 3))
    times[:, 2, :, 2] = times[2, :, 2, :] = np.inf  # a point with two states
    inner = list(itertools.permutations(range(1, 7)))
    orders = np.array([[0, *way, 7] for way in inner])
    orders = orders[free.keeps(orders)]
    least = best_states(orders, times)[1].min()
    tour = best_tour(free, times)
    assert tour.exact
    assert free.keeps(tour.order[None])[0]
    np.testing.assert_allclose(tour.cost, least, rtol=1e-12)
    local = best_states(_local(free, times, random)[None], times)[1][0]
    assert local >= least * (1.0 - 1e-12)


def test_many_points_are_ordered_by_local_search():
    """On a circle the best order is known: once round."""
    angle = np.sort(np.random.default_rng(1).uniform(0.0, 2.0 * np.pi, 26))
    place = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    shuffled = np.concatenate([[0], np.random.default_rng(2).permutation(np.arange(1, 25)), [25]])
    times = np.linalg.norm(place[shuffled][:, None] - place[shuffled][None], axis=2)[..., None, None]
    tour = best_tour(FreeOrder.of("free", 26), times)
    around = np.linalg.norm(np.diff(place, axis=0), axis=1).sum()
    assert not tour.exact
    np.testing.assert_allclose(tour.cost, around, rtol=1e-9)


@pytest.mark.parametrize(
    ("order", "count", "said"),
    [
        ({"free": [1, 2], "after": {1: [2], 2: [1]}}, 4, "order: after: .* got 1 after 2 after 1$"),
        ({"free": [1, 2, 3], "after": {1: 3, 2: 1, 3: 2}}, 5, "got 1 after 3 after 2 after 1$"),
        ({"free": [1, 4]}, 4, "order: free: expected numbers of points from 0 to 3, got 4"),
        ({"free": [1, 2], "after": {7: [1]}}, 4, "order: after: expected numbers of points from 0 to 3, got 7"),
        ({"free": [1, 1, 2]}, 4, "point 1 twice"),
        ({"free": [[1, 2], [2, 3]]}, 5, "got point 2 in two"),
        ({"free": [1]}, 4, "at least 2 points in a group, got \\[1\\]"),
        ({"free": [1, 2], "after": {1: [3]}}, 4, "point 1 cannot always come after point 3"),
        ({"free": [1, 2], "after": {0: [1]}}, 4, "point 0 cannot always come after point 1"),
        ({"free": "some"}, 4, "unknown order: free 'some'; known: all"),
        ({"fre": [1, 2]}, 4, "unknown key of order 'fre'.*'free'"),
        ("fee", 4, "unknown order 'fee'; known: free"),
        ({"after": {1: [2]}}, 4, "order: expected free"),
        ("free", 3, "at least 2 points between the ends, got 1"),
        ([1, 2], 4, "order: expected 'free', or a table"),
        ({"free": [[1, 2], 3]}, 5, "got both"),
        (
            {"free": [1, 2, 3], "after": {1: [2], "1": [3]}},
            5,
            "order: after: expected every point once, got point 1 twice",
        ),
        ({"free": [1, 2, 3], "after": {"1": [2], "01": [3]}}, 5, "expected every point once, got point 1 twice"),
        ({"free": [1, 2], "after": [1]}, 4, "order: after: expected a table"),
    ],
)
def test_orders_that_cannot_be_are_refused(order, count, said):
    refused(lambda: FreeOrder.of(order, count), said)
