"""The broad phase: what it leaves out never decides, so that results are those of all pairs at all instants."""

import coal
import numpy as np
import pytest

from tests.formulation.test_clearance import BALL, LIMITS
from tests.helpers import mostly_long
from trajevo import ViaPoints, load_robot
from trajevo.base import jit
from trajevo.formulation.constraints.broad_phase.bodies import Placed
from trajevo.formulation.constraints.broad_phase.covers import Cover
from trajevo.formulation.constraints.broad_phase.near import INTERVALS, Grid
from trajevo.formulation.constraints.broad_phase.sweeps import Sweeps
from trajevo.formulation.constraints.clearance_search import ClearanceSearch, Intervals, Spans
from trajevo.formulation.constraints.collision import DISTANCE_ERROR, Collision
from trajevo.formulation.constraints.scene import Box, Capsule, Cylinder, Hull, Plane, Scene, Sphere
from trajevo.trajectory.interpolants import QuinticSpline

#: A turn, a slide along a slanted axis with a box and a cylinder, and a turn with a ball; the first link branches.
BRANCHED = """<robot name="branched">
  <link name="base"><collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision></link>
  <link name="column"><collision><origin xyz="0 0 0.3"/><geometry><cylinder radius="0.06" length="0.6"/></geometry>
    </collision></link>
  <link name="arm"><collision><origin xyz="0.3 0 0" rpy="0 1.2 0.4"/><geometry><box size="0.5 0.1 0.08"/></geometry>
    </collision></link>
  <link name="hand"><collision><origin xyz="0.1 0.1 0"/><geometry><sphere radius="0.07"/></geometry></collision></link>
  <link name="second"><collision><origin xyz="0 0.3 0" rpy="1.5 0 0"/><geometry>
    <cylinder radius="0.05" length="0.5"/></geometry></collision></link>
  <joint name="turn" type="revolute"><parent link="base"/><child link="column"/><axis xyz="0 0 1"/>
    <origin xyz="0 0 0.1"/><limit lower="-3" upper="3" velocity="2" effort="1"/></joint>
  <joint name="slide" type="prismatic"><parent link="column"/><child link="arm"/><axis xyz="0.6 0 0.8"/>
    <origin xyz="0.1 0 0.4" rpy="0.2 0.3 0.1"/><limit lower="-0.3" upper="0.6" velocity="2" effort="1"/></joint>
  <joint name="roll" type="revolute"><parent link="arm"/><child link="hand"/><axis xyz="1 2 0.5"/>
    <origin xyz="0.5 0 0"/><limit lower="-3" upper="3" velocity="2" effort="1"/></joint>
  <joint name="lift" type="revolute"><parent link="column"/><child link="second"/><axis xyz="-1 0 0"/>
    <origin xyz="0 0.1 0.6"/><limit lower="-2" upper="2" velocity="2" effort="1"/></joint>
</robot>"""
ROBOTS = ("xarm7", "panda", "ball", "branched")


@pytest.fixture(scope="module")
def robots(tmp_path_factory):
    folder, found = tmp_path_factory.mktemp("robots"), {"xarm7": load_robot("xarm7", limits=LIMITS)}
    lock = {"panda_finger_joint1": 0.02, "panda_finger_joint2": 0.0}
    found["panda"] = load_robot("panda", lock=lock, tool="panda_hand_tcp", limits=LIMITS)
    for name, text in (("ball", BALL), ("branched", BRANCHED)):
        (folder / f"{name}.urdf").write_text(text)
        found[name] = load_robot(folder / f"{name}.urdf", limits=LIMITS, tool="arm" if name == "ball" else "hand")
    return found


def scene(seed, *, itself=True) -> Scene:
    """Up to 25 obstacles in all places, some inside each other or the robot; from seed 100 on of all shapes."""
    rng, obstacles = np.random.default_rng(seed), []
    for number in range(rng.integers(1, 26)):
        size = rng.uniform(0.02, 0.3, 3)
        where = {"position": rng.uniform(-1.0, 1.0, 3), "rpy": rng.uniform(-3.0, 3.0, 3), "name": f"obstacle {number}"}
        kind = rng.integers(3 if seed < 100 else 6)
        if kind == 0:
            obstacles.append(Box(size=size, **where))
        elif kind == 1:
            obstacles.append(Cylinder(radius=size[0], length=2.0 * size[1], **where))
        elif kind == 2:
            obstacles.append(Sphere(radius=size[0], **where))
        elif kind == 3:
            obstacles.append(Capsule(radius=size[0], length=2.0 * size[1], **where))
        elif kind == 4:
            obstacles.append(Hull(points=rng.normal(size=(12, 3)) * size, **where))
        else:
            obstacles.append(Plane(**where | {"position": 1.5 * where["position"]}))
    return Scene(tuple(obstacles), rng.choice([0.0, 0.02, 0.1]), 0.01 if itself else None)


def motions(robot, seed, count=4):
    """Slow and fast motions; of some only the first joint moves at first."""
    rng = np.random.default_rng(seed)
    lower, upper = np.maximum(robot.limits.lower, -1.5), np.minimum(robot.limits.upper, 1.5)
    points = rng.uniform(0.7, 1.0) * rng.uniform(lower, upper, (4, robot.dof))
    points[1, 1:] = points[0, 1:] if rng.random() < 0.3 else points[1, 1:]
    durations = 10.0 ** rng.uniform(-1.0, 1.0, (count, 3))
    return QuinticSpline(ViaPoints(points), duration_bounds=(0.1, 10.0))(durations)


class Everything(ClearanceSearch):
    """The same search, with the distances of all pairs at all instants."""

    def start(self) -> Intervals:
        q = self.grid.q
        B, size, n = q.shape
        d = self.collision.distances(q.reshape(-1, n)).reshape(B, size, -1) - DISTANCE_ERROR
        row, step, pair = (index.ravel() for index in np.indices(d.shape))
        t = self.grid.instants(row * size + step)
        self.sampled.take(row, self.kind[pair], pair, d.ravel(), np.stack([t, t]))
        interval, pair = (index.ravel() for index in np.indices((B * (size - 1), d.shape[2])))
        every = np.arange(B * (size - 1))
        spans = Spans(*self.grid.ends(every), self.grid.travel)
        row, step = np.divmod(interval, size - 1)
        ends = np.stack([d[row, step, pair], d[row, step + 1, pair]])
        return self._open(Intervals(spans, interval, pair, ends, np.full(len(pair), -np.inf), spans.t[:, interval]))


def decided(search: ClearanceSearch, *, to_the_end: bool) -> list[np.ndarray]:
    """What is decided by samples or by bounds, the pairs that decide it, and when."""
    work = search.start()
    while len(work.pair):
        work = search.halve(work)
    sampled, proven = search.sampled, search.proven
    if to_the_end:
        return [sampled.d, sampled.pair, sampled.t, np.minimum(proven.d, sampled.d)]
    low = sampled.d < search.wanted
    return [
        np.where(low, sampled.d, proven.d),
        np.where(low, sampled.pair, proven.pair),
        np.where(low, sampled.t, proven.t),
    ]


@pytest.mark.thinned(3)
@pytest.mark.parametrize("to_the_end", [False, True])
@pytest.mark.parametrize("seed", mostly_long([*range(6), 100, 101], 100))
@pytest.mark.parametrize("name", mostly_long(ROBOTS, *[*ROBOTS][::2]))
def test_results_are_those_of_all_pairs_to_the_bit(robots, name, seed, to_the_end):
    robot, around = robots[name], scene(seed, itself=name != "ball")
    trajectory, collision = motions(robot, seed), Collision(robot, around)
    given = trajectory, np.array([around.clearance, 0.01]), 1e-3, to_the_end
    some = decided(ClearanceSearch(collision, *given), to_the_end=to_the_end)
    for one, other in zip(some, decided(Everything(collision, *given), to_the_end=to_the_end), strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.thinned(3)
@pytest.mark.parametrize("to_the_end", [False, True])
@pytest.mark.parametrize("seed", mostly_long([4, 104], 104))
@pytest.mark.parametrize("name", mostly_long(ROBOTS, *[*ROBOTS][1::2]))
def test_loops_and_numpy_leave_out_what_never_decides(robots, name, seed, to_the_end):
    """Both kinds of kernel agree with all pairs to the bit, and with each other to rounding."""
    pytest.importorskip("numba")
    robot, around, found = robots[name], scene(seed, itself=name != "ball"), []
    collision = Collision(robot, around)
    for kernels in (lambda: jit.one_kind("compiled"), jit.uncompiled):
        with kernels():
            given = collision, motions(robot, 4, 3), np.array([around.clearance, 0.01]), 1e-3, to_the_end
            found.append(decided(ClearanceSearch(*given), to_the_end=to_the_end))
            for one, other in zip(found[-1], decided(Everything(*given), to_the_end=to_the_end), strict=True):
                np.testing.assert_array_equal(one, other)
    for one, other in zip(*found, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("kernels", ["compiled", "numpy"])
def test_a_robot_without_obstacles_is_checked_against_itself(robots, kernels):
    if kernels == "compiled":
        pytest.importorskip("numba")
    robot, around = robots["branched"], Scene((), 0.02, 0.01)
    with jit.one_kind(kernels):
        given = Collision(robot, around), motions(robot, 5), np.array([0.02, 0.01]), 1e-3, True
        some, every = (decided(kind(*given), to_the_end=True) for kind in (ClearanceSearch, Everything))
    assert np.isinf(some[0][:, 0]).all()
    assert np.isfinite(some[0][:, 1]).all()
    for one, other in zip(some, every, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("seed", [2, 102])
@pytest.mark.parametrize("name", ROBOTS)
def test_loops_place_and_bound_as_numpy(robots, name, seed):
    pytest.importorskip("numba")
    robot = robots[name]
    collision, found = Collision(robot, scene(seed, itself=name != "ball")), []
    q = np.random.default_rng(2).uniform(-2.0, 2.0, (150, robot.dof))
    q[0] = 1e6 * np.arange(1, robot.dof + 1) if collision.bodies.turning.all() else q[0]
    state, pair = (index.ravel() for index in np.indices((len(q), len(collision.pairs))))
    for kernels in (lambda: jit.one_kind("compiled"), jit.uncompiled):
        with kernels():
            placed = collision.bodies.placed(q)
            bounds = collision.lower_bounds.of(placed, state, pair)
            found.append((placed.whole, placed.axes, collision.bodies.moved(placed), bounds))
    assert type(placed) is Placed
    for one, other in zip(*found, strict=True):
        np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-11)


def test_many_distances_are_left_out(robots, monkeypatch):
    asked, compute = [], Collision.distances_of
    monkeypatch.setattr(Collision, "distances_of", lambda *given: asked.append(len(given[2])) or compute(*given))
    robot = robots["xarm7"]
    collision = Collision(robot, scene(3, itself=False))
    search = ClearanceSearch(collision, motions(robot, 3, 20), np.array([0.02, 0.0]), 1e-3)
    search.start()
    assert sum(asked) < 0.05 * search.grid.t.size * len(collision.pairs)


@pytest.mark.thinned(2)
@pytest.mark.parametrize("seed", mostly_long([*range(4), 100, 101, 103], 100))
@pytest.mark.parametrize("name", ROBOTS)
def test_lower_bounds_are_never_above_distances(robots, name, seed):
    robot = robots[name]
    collision = Collision(robot, scene(seed, itself=name != "ball"))
    q = np.random.default_rng(seed).uniform(-2.0, 2.0, (150, robot.dof))
    distances, placed, bounds = collision.distances(q), collision.bodies.placed(q), collision.lower_bounds
    assert (distances < 0.0).any()
    state, pair = (index.ravel() for index in np.indices(distances.shape))
    around, closer = bounds.everywhere(placed.whole).T, bounds.of(placed, state, pair).reshape(distances.shape)
    assert (around <= distances + 2.0 * DISTANCE_ERROR).all()
    assert (closer <= distances + 2.0 * DISTANCE_ERROR).all()
    assert (closer >= around).all()
    hulls = {obstacle.name for obstacle in collision.scene.obstacles if isinstance(obstacle, Hull)}
    near = [k for k, pair in enumerate(collision.pairs) if pair.second not in hulls]  # one ball stands for a hull
    assert np.median((distances - closer)[:, near]) < 0.03


@pytest.mark.thinned(2)
@pytest.mark.parametrize("seed", mostly_long([*range(3), 100], 100))
@pytest.mark.parametrize("name", ROBOTS)
def test_distances_within_an_interval_are_not_below_its_bound(robots, name, seed):
    """At instants between, of slow and fast motions, for obstacles and for the robot itself."""
    robot, trajectory = robots[name], motions(robots[name], seed)
    collision = Collision(robot, scene(seed, itself=name != "ball"))
    sweeps = Sweeps(collision, trajectory)
    travel = Grid(trajectory, sweeps).travel[:, sweeps.column].reshape(len(trajectory), 3, INTERVALS, -1)
    finer = 4
    q = trajectory.at_shares(np.linspace(0.0, 1.0, finer * INTERVALS + 1), 0)
    distances = collision.distances(q.reshape(-1, robot.dof)).reshape(len(trajectory), 3, finer * INTERVALS + 1, -1)
    bound = 0.5 * (distances[:, :, :-1:finer] + distances[:, :, finer::finer] - travel)
    for between in range(finer + 1):
        end = between - finer or None
        assert (distances[:, :, between:end:finer] >= bound - DISTANCE_ERROR).all()


def test_solids_and_the_balls_around_them(robots):
    """Points of every kind of solid are in the ball around it, and in one of those that cover it."""
    rng = np.random.default_rng(0)
    for robot in robots.values():
        collision = Collision(robot, scene(1, itself=False))
        for entry in list(collision._made().geometry.geometryObjects):
            cover, solid = Cover.of(entry), entry.geometry
            match solid:
                case coal.Convex():
                    points = rng.dirichlet(np.full(solid.num_points, 0.05), 500) @ solid.points()
                case coal.Box():
                    points = rng.uniform(-1.0, 1.0, (500, 3)).round() * solid.halfSide
                case coal.Cylinder():
                    turn = rng.uniform(0.0, 2.0 * np.pi, 500)
                    around = [np.cos(turn) * solid.radius, np.sin(turn) * solid.radius]
                    points = np.column_stack([*around, rng.uniform(-1.0, 1.0, 500) * solid.halfLength])
                case _:
                    points = rng.normal(size=(500, 3))
                    points *= solid.radius / np.linalg.norm(points, axis=1, keepdims=True)
            placed = points @ entry.placement.rotation.T + entry.placement.translation
            away = np.linalg.norm(placed[:, None] - cover.centres, axis=2) - cover.radii
            assert (away[:, 0] < 1e-9).all()
            assert (away[:, 1:].min(axis=1) < 1e-9).all()


def test_states_are_placed_as_by_pinocchio_whatever_the_batch(robots):
    for robot in robots.values():
        collision = Collision(robot, scene(1, itself=False))
        q = np.random.default_rng(1).uniform(-1.0, 1.0, (100, robot.dof))
        placed = collision.bodies.placed(q)
        alone = collision.bodies.placed(q[70:71])
        np.testing.assert_array_equal(alone.whole[..., 0], placed.whole[..., 70])
        np.testing.assert_array_equal(alone.axes[..., 0], placed.axes[..., 70])
        some = collision.bodies.placed(q[50:75])
        moved = collision.bodies.moved(placed)
        np.testing.assert_array_equal(collision.bodies.moved(some), moved[50:74])
        assert collision.bodies.moved(alone).shape == (0, moved.shape[1])
