"""An individual's objectives and constraints are its own: to the bit, whatever it is evaluated with and on."""

import inspect
import tracemalloc

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from tests.helpers import any_problem, mostly_long, suited
from trajevo import TrajectoryProblem, load_robot
from trajevo.base.arrays import row_products
from trajevo.formulation.constraints.collision import Collision
from trajevo.formulation.constraints.scene import Scene
from trajevo.formulation.registry import list_problems
from trajevo.problems import ViaPointProblem
from trajevo.robot.payload import LOAD_MODELS
from trajevo.trajectory.interpolants import THROUGH_POINTS

ROWS = 21

UR5 = {
    "robot": {
        "name": "ur5",
        "tool": "tool0",
        "limits": {"acceleration": 10.0, "jerk": 100.0},
        "drives": {name: {"stiffness": 2e4} for name in ("shoulder_lift_joint", "elbow_joint", "wrist_1_joint")},
    },
    "points": [
        [0.0, -1.5, 1.5, -1.5, -1.5, 0.0],
        [0.5, -1.2, 1.2, -1.5, -1.5, 0.3],
        [1.0, -1.0, 1.3, -1.6, -1.5, 0.0],
        [1.5, -1.5, 1.5, -1.5, -1.5, -0.3],
    ],
    "duration_bounds": (0.4, 3.0),
}
EVERYTHING = {
    "objectives": [
        *("time", "acceleration", "jerk", "square_acceleration", "square_jerk", "energy", "square_power"),
        *("square_effort", "square_effort_rate", "joint_travel", "tool_path", "payload_condition"),
        *("peak_acceleration", "peak_jerk", "peak_effort_rate"),
    ],
    "constraints": ["position", "velocity", "acceleration", "jerk", "effort", "mean_velocity"],
    "payload": {"mass": 1.0, "com": [0.0, 0.0, 0.1]},
    **{"tool_speed": 1.0, "tool_height": 0.1, "longest_time": 6.0, "overshoot": 0.3},
    **{"deviation": 2e-3, "deviation_of": "payload"},
    **{"effort_rate": 400.0, "manipulability": 0.02, "least_singular_value": 0.05},
}
PANDA = {
    "robot": {
        "name": "panda",
        "tool": "panda_hand_tcp",
        "lock": {"panda_finger_joint1": 0.0, "panda_finger_joint2": 0.0},
        "limits": {"acceleration": 10.0, "jerk": 1000.0},
    },
    "points": [
        [0.0, -0.5, 0.0, -2.0, 0.0, 1.6, 0.8],
        [0.4, -0.2, 0.1, -1.8, 0.2, 1.5, 0.6],
        [0.8, -0.4, 0.0, -2.2, 0.0, 1.8, 0.8],
    ],
    "objectives": ["time", "acceleration", "energy"],
    "constraints": ["velocity", "effort"],
}
XARM = {
    "robot": {"name": "xarm7", "limits": {"acceleration": 14.0, "jerk": 140.0}},
    "points": [
        [-0.9, 0.35, 0.0, 1.05, 0.0, 0.7, 0.0],
        [0.0, 0.0, 0.0, 1.2, 0.0, 1.2, 0.0],
        [0.9, 0.35, 0.0, 1.05, 0.0, 0.7, 0.0],
    ],
    "moving": [{"point": 1, "joints": [0.5, 0.7, 0.0, 0.9, 0.0, 0.7, 0.0]}],
}
SCENE = {
    "clearance": 0.02,
    "self_clearance": 0.01,
    "obstacles": [
        {"shape": "box", "size": [0.1, 0.1, 0.6], "position": [0.3, 0.5, 0.3]},
        {"shape": "cylinder", "radius": 0.04, "length": 0.5, "position": [0.5, 0.0, 0.25]},
    ],
}
BOXES = [{"point": 1, "tool": [0.05, 0.05, 0.02]}, {"point": 2, "joints": [0.1, 0.1, 0.0, 0.1, 0.0, 0.0]}]
PASSING = [
    {"point": 0, "velocity": [0.1, 0.0, 0.0, -0.1, 0.0, 0.2]},
    {"point": 1, "dwell": 0.4},
    {"point": 2, "window": [0.1, 30.0]},
]

CASES = (
    *((name, {}) for name in list_problems()),
    *(("hybrid", {"convention": name}) for name in ("printed", "as_run")),
    *(("hybrid", {"payload_model": name}) for name in ("weight_only", "tool_axis")),
    *(("hybrid", {"objectives": "cost", "samples": 5}), ("hybrid", {"payload": 0.0})),
    *(
        ("hybrid", {"objectives": ["time", "energy", "unused_payload"], "payload_model": model})
        for model in LOAD_MODELS
    ),
    *(("pointing", {"interpolant": name}) for name in ("printed", "quintic", "septic_spline")),
    *(("pick-place", {"interpolant": name, "overshoot": 0.5}) for name in THROUGH_POINTS if name != "hermite"),
    *(("reparam", {"path": path, "limits": "hull"}) for path in ("gemini", "s")),
    *(("reparam", {"limits": limits, "encoding": "shape"}) for limits in ("tight", "hull")),
    *(("reparam", {"quadrature": "trapezoid"}), ("reparam", {"interpolant": "linear"}), ("reparam", {"effort": True})),
    *(("via-points", suited(name, UR5 | EVERYTHING)) for name in THROUGH_POINTS),
    *(("via-points", suited(name, UR5 | {"moving": BOXES})) for name in THROUGH_POINTS),
    ("via-points", UR5 | EVERYTHING | {"limits": "certified", "tool_speed": 4.0}),
    *(("via-points", UR5 | {"moving": BOXES[1:], "passing": passing}) for passing in (PASSING[:2], PASSING[1:])),
    ("via-points", UR5 | {"points": [*UR5["points"], UR5["points"][0]], "cyclic": True}),
    *(("hybrid", {"limits": "certified", "objectives": names}) for names in ("all", ["time", "unused_payload"])),
    *(("via-points", PANDA), ("via-points", UR5 | {"scene": SCENE}), ("via-points", XARM | {"scene": SCENE})),
)


def ids() -> list[str]:
    """Short names, told apart by what differs."""
    known = ("interpolant", "convention", "payload_model", "objectives", "path", "limits", "encoding", "quadrature")
    shown = []
    for number, (name, arguments) in enumerate(CASES):
        words = [str(arguments[key]) for key in known if isinstance(arguments.get(key), str)]
        words += [key for key in ("effort", "moving", "passing", "cyclic", "scene") if key in arguments]
        shown.append("-".join([str(number), name, *words]))
    return shown


#: Every fifth case is tried by `make test`, and those with proven limits and scenes; all others by `make test-long`.
OFTEN = {*range(0, len(CASES), 9), *range(len(CASES) - 6, len(CASES))}


@pytest.fixture(
    params=[
        pytest.param(case, id=name, marks=() if number in OFTEN else pytest.mark.long)
        for number, (case, name) in enumerate(zip(CASES, ids(), strict=True))
    ]
)
def problem(request) -> TrajectoryProblem:
    name, arguments = request.param
    return any_problem(name, **arguments)


@pytest.fixture
def x(problem) -> np.ndarray:
    return np.random.default_rng(0).uniform(problem.xl, problem.xu, (ROWS, problem.n_var))


def bits(problem, x) -> np.ndarray:
    """Objectives and constraints, as whole numbers that are equal where every bit is."""
    return np.concatenate(problem.evaluate(x), axis=1).view(np.int64)


def in_batches(problem, x, size) -> np.ndarray:
    return np.concatenate([bits(problem, x[start : start + size]) for start in range(0, len(x), size)])


@pytest.mark.thinned(2)
@pytest.mark.parametrize("sizes", mostly_long([(1, 7), (2, 3)], (1, 7)))
def test_no_bit_depends_on_the_batch(problem, x, sizes):
    whole = bits(problem, x)
    for size in sizes:
        np.testing.assert_array_equal(in_batches(problem, x, size), whole, err_msg=f"batches of {size}")
    np.testing.assert_array_equal(bits(problem, x[::-1])[::-1], whole, err_msg="reversed")
    np.testing.assert_array_equal(bits(problem, np.asfortranarray(x)), whole, err_msg="columns in memory")


@pytest.mark.thinned(2)
def test_no_bit_depends_on_threads(problem, x):
    whole = bits(problem, x)
    for threads in (1, 2):
        with threadpool_limits(limits=threads, user_api="blas"):
            np.testing.assert_array_equal(bits(problem, x), whole, err_msg=f"{threads} threads of BLAS")
    if "threads" in inspect.signature(type(problem)).parameters:
        again = type(problem)(**(problem.settings | {"threads": 2}))
        assert again.dynamics.threads == 2
        np.testing.assert_array_equal(bits(again, x), whole, err_msg="2 threads of Pinocchio")
        np.testing.assert_array_equal(in_batches(again, x, 7), whole, err_msg="2 threads of Pinocchio, batches of 7")


@pytest.mark.parametrize("kind", [np.float64, np.complex128])
@pytest.mark.parametrize(("size", "columns"), [(4, 1), (16, 66), (25, 50), (25, 100)])
def test_row_products_are_those_of_the_row_alone(kind, size, columns):
    rng = np.random.default_rng(size)
    rows, matrix = rng.normal(size=(101, size)).astype(kind), rng.normal(size=(size, columns))
    rows += rows.dtype.type(1j if kind is np.complex128 else 0) * rng.normal(size=rows.shape)
    whole = row_products(rows, matrix)
    np.testing.assert_allclose(whole, rows @ matrix, rtol=1e-12, atol=1e-12)
    for first, last in ((0, 1), (3, 4), (47, 49), (100, 101), (5, 90)):
        np.testing.assert_array_equal(row_products(rows[first:last], matrix), whole[first:last])
    np.testing.assert_array_equal(row_products(rows[::-1], matrix)[::-1], whole)
    assert row_products(rows[:0], matrix).shape == (0, columns)


def test_distances_do_not_depend_on_other_motions():
    collision = Collision(load_robot("xarm7", limits={"acceleration": 14.0, "jerk": 140.0}), Scene.of(SCENE))
    limits = collision.robot.limits
    lower, upper = np.maximum(limits.lower, -np.pi), np.minimum(limits.upper, np.pi)
    q = np.random.default_rng(1).uniform(lower, upper, (24, 7))
    together = collision.distances(q)
    pairs = together.shape[1]
    np.testing.assert_array_equal(collision.distances_of(q, *every_pair(24, pairs)).reshape(24, pairs), together)
    for rows in (slice(0, 1), slice(5, 8), slice(None, None, -1)):
        np.testing.assert_array_equal(collision.distances(q[rows]), together[rows])
    state, pair = (chosen[np.random.default_rng(2).permutation(24 * pairs)] for chosen in every_pair(24, pairs))
    np.testing.assert_array_equal(collision.distances_of(q, state, pair), together[state, pair])


def every_pair(states, pairs) -> tuple[np.ndarray, np.ndarray]:
    """Rows of states and indices of pairs, state by state."""
    return np.repeat(np.arange(states), pairs), np.tile(np.arange(pairs), states)


def test_a_thousand_motions_of_two_hundred_samples_take_less_than_64_mb():
    points = np.cumsum(np.random.default_rng(0).uniform(-0.2, 0.2, (13, 6)), axis=0)
    problem = ViaPointProblem(
        points=points,
        interpolant="cubic",
        objectives=("time", "energy", "jerk"),
        constraints=("velocity", "acceleration", "jerk", "effort"),
        limits="sampled",
        samples=17,
        duration_bounds=(0.2, 2.0),
    )
    x = np.random.default_rng(0).uniform(problem.xl, problem.xu, (1000, problem.n_var))
    assert problem.rollout(x[:1]).t.shape[1] > 200
    tracemalloc.start()
    F, G = problem.evaluate(x)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 64e6
    for rows in (slice(0, 1), slice(300, 307)):
        np.testing.assert_array_equal(problem.evaluate(x[rows])[0], F[rows])
        np.testing.assert_array_equal(problem.evaluate(x[rows])[1], G[rows])
