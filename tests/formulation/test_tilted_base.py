"""A base that tilts: efforts under its gravity, what a robot loaded there says, derivatives, certificates, limits."""

import numpy as np
import pinocchio as pin
import pytest

from trajevo import Dynamics, Payload, Scene, certify, certify_all, clearance_along, load_problem, load_robot, optimise
from trajevo.base import jit
from trajevo.capacity.payload_effort import payload_effort
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import TrajevoError
from trajevo.formulation.cell.base_box import BaseBox
from trajevo.formulation.cell.moving_base import _of_cells, _of_simplices
from trajevo.formulation.cell.placement import BasePlacement
from trajevo.path.inverse_kinematics import Pose
from trajevo.robot.payload import under_gravity
from trajevo.trajectory.arranged import base_rotations
from trajevo.verification import check_proof
from trajevo.verification.newton_euler import NewtonEuler
from trajevo.verification.twin.simulate import simulate

DOWN = [np.pi, 0.0, 0.0]
POSES = [
    {"position": [0.29, -0.25, 0.12], "rpy": DOWN},
    {"position": [0.09, 0.35, 0.30], "rpy": DOWN},
    {"position": [0.39, 0.30, 0.12], "rpy": DOWN},
]
LIMITS = {"acceleration": 14.0, "jerk": 140.0}
UR5 = {"name": "ur5", "tool": "tool0", "limits": LIMITS}
BOX = {
    "x": [-0.3, 0.1],
    "y": [-0.2, 0.2],
    "z": [0.0, 0.2],
    "yaw": [-0.5, 0.5],
    "pitch": [-0.4, 0.4],
    "roll": [-0.3, 0.3],
}
USUAL = {
    "robot": UR5,
    "points": POSES,
    "duration_bounds": [0.2, 3.0],
    "interpolant": "quintic_spline",
    "objectives": ["time", "energy"],
    "constraints": ["position", "velocity", "acceleration", "jerk", "effort"],
    "payload": 2.0,
}


def problem(box=None, **more):
    return load_problem("via-points", **(USUAL | {"base": {"moving": BOX if box is None else box}} | more))


def reached(given, count=40, within=1e-12, seed=0):
    """Random decision vectors from whose base all points are reached."""
    X = np.random.default_rng(seed).uniform(given.xl, given.xu, (count, given.n_var))
    return X[given.rollout(X).arranged.missed.max(axis=(1, 2)) <= within]


@pytest.fixture(scope="module")
def tilting():
    return problem()


def at(base, **more):
    """The robot loaded at a displaced base."""
    x, y, z, yaw, pitch, roll = base.tolist()
    return load_robot(**UR5, base={"position": [x, y, z], "rpy": [roll, pitch, yaw]}, **more)


def states(dof, count=5, instants=7, seed=3):
    return np.random.default_rng(seed).uniform(-2.0, 2.0, (3, count, instants, dof))


GRAVITIES = 9.80665 * (lambda v: v / np.linalg.norm(v, axis=1)[:, None])(np.random.default_rng(1).normal(size=(5, 3)))


@pytest.mark.parametrize("kind", ["compiled", "numpy", "pinocchio"])
@pytest.mark.parametrize("model", ["rigid", "weight_only", "tool_axis"])
@pytest.mark.parametrize("name", ["ur5", "puma560"])
def test_efforts_under_the_gravity_of_every_row_are_those_of_pinocchio(name, model, kind):
    robot = load_robot("puma560", gravity=[0.0, 0.0, -9.80665]) if name == "puma560" else load_robot(**UR5)
    dynamics = Dynamics(robot, Payload(2.0, com=(0.0, 0.02, 0.05) if model != "tool_axis" else (0, 0, 0), model=model))
    q, v, a = states(robot.dof)
    with jit.uncompiled() if kind == "pinocchio" else jit.one_kind(kind):
        found = dynamics.under(GRAVITIES).effort(q, v, a)
        unloaded = dynamics.under(GRAVITIES).unloaded_effort(q, v, a)
    for row, gravity in enumerate(GRAVITIES):
        turned = robot.model.copy()
        turned.gravity.linear = gravity
        rows = zip(*(robot.transmission.motion(q[row], v[row], a[row])), strict=True)
        torque = np.array([pin.rnea(turned, turned.createData(), *state) for state in rows])
        expected = robot.transmission.effort(q[row], torque) + robot.friction.effort(v[row], a[row])
        scale = np.abs(found).max()
        np.testing.assert_allclose(unloaded[row], expected, rtol=0.0, atol=1e-9 * scale)
        there = Dynamics(under_gravity(robot, gravity), dynamics.payload)
        np.testing.assert_allclose(found[row], there.effort(q[row], v[row], a[row]), rtol=0.0, atol=1e-9 * scale)
        if kind == "compiled":
            own = NewtonEuler(there.robot, there.payload).effort(q[row], v[row], a[row])
            np.testing.assert_allclose(found[row], own, rtol=0.0, atol=1e-9 * scale)


def test_a_row_has_the_bits_of_a_robot_with_that_gravity():
    robot = load_robot(**UR5)
    q, v, a = states(robot.dof)
    found = Dynamics(robot, Payload(2.0)).under(GRAVITIES).effort(q, v, a)
    for row, gravity in enumerate(GRAVITIES):
        there = Dynamics(under_gravity(robot, gravity), Payload(2.0))
        np.testing.assert_array_equal(found[row], there.effort(q[row], v[row], a[row]))
    level = Dynamics(robot, Payload(2.0))
    same = level.under(np.tile(robot.model.gravity.linear, (5, 1))).effort(q, v, a)
    np.testing.assert_array_equal(same, level.effort(q, v, a))


@pytest.mark.parametrize("kind", ["compiled", "numpy"])
def test_complex_gravities_give_the_slopes_of_efforts(kind):
    robot = load_robot(**UR5)
    dynamics, (q, v, a) = Dynamics(robot, Payload(2.0)), states(robot.dof)
    step = np.random.default_rng(5).normal(size=GRAVITIES.shape)
    with jit.one_kind(kind):
        exact = dynamics.under(GRAVITIES + 1e-20j * step).effort(q + 1e-20j * v, v + 0j, a + 0j).imag / 1e-20
        h = 1e-6
        sides = [dynamics.under(GRAVITIES + s * h * step).effort(q + s * h * v, v, a) for s in (1.0, -1.0)]
    np.testing.assert_allclose(exact, (sides[0] - sides[1]) / (2.0 * h), rtol=0.0, atol=1e-7 * np.abs(exact).max())


def test_loads_that_change_are_felt_under_the_gravity_of_each_base():
    given = problem(payload=[{"mass": 1.0}, {"mass": 2.0, "to": 1}], passing=[{"point": 1, "stop": True}])
    X = reached(given)[:4]
    rollout = given.rollout(X)
    times = rollout.t[:, ::5]
    q, v, a = (np.concatenate([rollout.trajectory.evaluate(times, k)]) for k in range(3))
    found = rollout.effort_in(q, v, a, times)
    for row in range(len(X)):
        alone = given.rollout(X[row])
        assert alone.dynamics.gravity is None
        own = alone.effort_in(q[row][None], v[row][None], a[row][None], times[row][None])[0]
        np.testing.assert_allclose(found[row], own, rtol=0.0, atol=1e-12 * np.abs(own).max())
    np.testing.assert_allclose(rollout.effort[0], given.rollout(X[0]).effort[0], rtol=0.0, atol=1e-11)


def test_a_motion_is_that_of_the_robot_loaded_at_its_base(tilting):
    X = reached(tilting)[:3]
    assert len(X) == 3
    F, G = tilting.evaluate(X, return_values_of=["F", "G"])
    for row, x in enumerate(X):
        arranged = tilting.rollout(x).arranged
        x0, y, z, yaw, pitch, roll = arranged.bases[0].tolist()
        place = {"position": [x0, y, z], "rpy": [roll, pitch, yaw]}
        fixed = load_problem("via-points", **USUAL | {"robot": UR5 | {"base": place}, "points": arranged.points[0]})
        robot, times = fixed.robot, tilting.via_times(x[None])
        positions, rotations = robot.tool_poses(tilting.rollout(x).trajectory.evaluate(times)[0])
        np.testing.assert_allclose(positions, [pose["position"] for pose in POSES], atol=1e-9)
        np.testing.assert_allclose(rotations, [Pose.of(pose).rotation for pose in POSES], atol=1e-9)
        own = fixed.evaluate(x[None, : fixed.n_var], return_values_of=["F", "G"])
        np.testing.assert_allclose(F[row], own[0][0], rtol=1e-9)
        np.testing.assert_allclose(G[row, : own[1].shape[1]], own[1][0], rtol=1e-6, atol=1e-9)


def test_an_individual_is_the_same_to_the_bit_alone_and_among_others(tilting):
    X = reached(tilting)[:6]
    F, G = tilting.evaluate(X, return_values_of=["F", "G"])
    for row in (0, 3, 5):
        own = tilting.evaluate(X[row : row + 1], return_values_of=["F", "G"])
        np.testing.assert_array_equal(own[0][0], F[row])
        np.testing.assert_array_equal(own[1][0], G[row])
    np.testing.assert_array_equal(tilting.rollout(X[2]).effort[0], tilting.rollout(X).effort[2])


def test_a_box_without_tilt_makes_no_other_model_and_has_the_bits_it_had():
    level, given = problem({"x": [-0.3, 0.1], "yaw": [-0.5, 0.5]}), problem({"x": [-0.3, 0.1], "yaw": [-0.5, 0.5]})
    X = np.random.default_rng(0).uniform(level.xl, level.xu, (20, level.n_var))
    rollout = level.rollout(X)
    assert rollout.arranged.bases.shape == (20, 4)
    assert rollout.dynamics is level.dynamics
    zero = problem({"x": [-0.3, 0.1], "yaw": [-0.5, 0.5], "roll": [0.0, 0.0]})
    for one, other in zip(given.evaluate(X), zero.evaluate(X), strict=True):
        np.testing.assert_array_equal(one, other)


def test_slopes_through_inverse_kinematics_and_gravity_are_those_of_differences(tilting):
    """At samples: the derivative of positions and of efforts along every variable, by differences of order 6."""
    x = reached(tilting)[0]
    h, ways = 2e-3, np.eye(tilting.n_var)
    complex_ = tilting._rollout(x + 1e-20j * ways)
    shares = ((1, 0.75), (2, -0.15), (3, 1.0 / 60.0))
    for name in ("q", "effort"):
        exact = getattr(complex_, name).imag / 1e-20
        rough = sum(
            weight
            * (getattr(tilting._rollout(x + k * h * ways), name) - getattr(tilting._rollout(x - k * h * ways), name))
            for k, weight in shares
        )
        np.testing.assert_allclose(exact, rough / h, rtol=0.0, atol=1e-7 * np.abs(exact).max())


def test_gradients_of_all_values_are_those_of_differences():
    scene = {"clearance": 0.02, "obstacles": [{"shape": "sphere", "radius": 0.1, "position": [0.45, 0.02, 0.35]}]}
    given = problem(
        objectives=["time", "energy", "square_effort", "footprint", "unused_payload"], limits="sampled", scene=scene
    )
    x = reached(given)[:2]
    _F, dF, _G, dG = given.evaluate_with_gradients(x)
    h = 1e-6
    for column, way in enumerate(np.eye(given.n_var)):
        sides = [given.evaluate(x + step * h * way, return_values_of=["F", "G"]) for step in (1, -1)]
        for exact, k in ((dF, 0), (dG, 1)):
            rough = (sides[0][k] - sides[1][k]) / (2.0 * h)
            np.testing.assert_allclose(exact[..., column], rough, rtol=2e-5, atol=2e-5 * np.abs(exact).max())


def test_evolution_and_polish_use_the_tilt_and_its_solutions_are_certified():
    level, tilted = {"x": [-0.1, 0.1]}, {"x": [-0.1, 0.1], "pitch": [-0.6, 0.6]}
    options = {"seed": 1, "population": 12, "generations": 6, "progress": False}
    other, front = (optimise(problem(box, payload=3.0), **options) for box in (level, tilted))
    assert (front.F.min(axis=0) < 0.96 * other.F.min(axis=0)).all()
    knee = front.knee()
    certificate = certify(knee)
    assert certificate.proven
    fine = knee.rollout
    t = np.linspace(0.0, float(fine.trajectory.duration[0]), 4001)[None]
    dense = NewtonEuler(at(fine.arranged.bases[0]), Payload(3.0))
    q, v, a = (fine.trajectory.evaluate(t, k)[0] for k in range(3))
    peaks = np.abs(dense.effort(q, fine.without_rounding(v[None])[0], a)).max(axis=0)
    bounds = {row.joint: row.bound for row in certificate.rows if row.quantity == "effort"}
    for name, peak in zip(fine.robot.joint_names, peaks, strict=True):
        assert peak <= bounds[name] * (1.0 + 1e-9)
        assert bounds[name] <= peak * 1.01 + 1e-3 * peaks.max()
    assert all(one.proven for one in certify_all(front, rows=[0, len(front) // 2, len(front) - 1]))
    base = knee.base
    robot = load_robot(**UR5, base=base.settings)
    np.testing.assert_allclose(robot.tool_poses(fine.q[0])[0][0], POSES[0]["position"], atol=1e-8)
    assert "pitch" in str(base)


def test_a_wall_mounted_arm_tilts_from_its_wall():
    place = {"position": [0.2, 0.0, 0.3], "rpy": [0.3, np.pi / 2, -0.2]}
    robot = load_robot(**UR5, base=place)
    q = np.array([[0.3, -1.2, 1.4, -1.0, 0.5, 0.1], [0.8, -1.0, 1.2, -0.7, 0.4, 0.3]])
    positions, rotations = robot.tool_poses(q)
    poses = [Pose(where, turn) for where, turn in zip(positions, rotations, strict=True)]
    given = problem(
        {"x": [-0.05, 0.05], "pitch": [-0.3, 0.3], "yaw": [-0.2, 0.2]}, robot=UR5 | {"base": place}, points=poses
    )
    X = reached(given)[:3]
    assert len(X)
    for x in X:
        rollout = given.rollout(x)
        base = BasePlacement.of(rollout)
        there = load_robot(**UR5, base=base.settings)
        found, _ = there.tool_poses(rollout.arranged.points[0])
        np.testing.assert_allclose(found, positions, atol=1e-9)
        own = Dynamics(there, Payload(2.0)).effort(rollout.q, rollout.v, rollout.a)
        np.testing.assert_allclose(own, rollout.effort, rtol=0.0, atol=1e-9 * np.abs(own).max())


def test_a_yaw_turns_gravity_that_is_not_vertical():
    given = problem({"yaw": [-0.5, 0.5]}, robot=UR5 | {"gravity": [0.0, -9.81, 0.0]})
    x = np.array([[1.0, 1.2, 0.4], [1.0, 1.2, -0.3]])
    for gravity, yaw in zip(given.rollout(x).dynamics.gravity, x[:, 2], strict=True):
        np.testing.assert_allclose(gravity, [-9.81 * np.sin(yaw), -9.81 * np.cos(yaw), 0.0], atol=1e-12)


def test_obstacles_stay_in_the_cell_and_the_footprint_is_that_of_the_tilted_arm():
    scene = {"clearance": 0.02, "obstacles": [{"shape": "sphere", "radius": 0.1, "position": [0.45, 0.02, 0.35]}]}
    given = problem(scene=scene, objectives=["time", "footprint"])
    X = reached(given)[:3]
    rollout = given.rollout(X)
    floor = given.evaluate(X, return_values_of=["F"])[:, 1]
    own = clearance_along(rollout, Scene.of(scene), density=40)
    for row in range(len(X)):
        robot = at(rollout.arranged.bases[row])
        there = clearance_along(Rollout(Dynamics(robot), rollout.trajectory[row]), Scene.of(scene), density=40)
        known = {(pair.first, pair.second): column for column, pair in enumerate(own.pairs)}
        for column, pair in enumerate(there.pairs):
            same = own.distances[row][:, known[pair.first, pair.second]]
            np.testing.assert_allclose(there.distances[0][:, column], same, atol=1e-5)
        origins = robot.joint_poses(rollout.q[row])[0][..., :2].reshape(-1, 2)
        whole = np.vstack([origins, rollout.arranged.bases[row, :2]])
        assert np.ptp(origins, axis=0).prod() <= floor[row] * (1.0 + 1e-9)
        assert floor[row] <= np.ptp(whole, axis=0).prod() * (1.0 + 1e-9)


def test_nodes_of_simplices_reproduce_what_is_linear_and_have_no_steps():
    random = np.random.default_rng(2)
    share, slope = random.uniform(size=(50, 5)), random.normal(size=5)
    for corners, weights in (_of_simplices(share), _of_cells(share)):
        assert (weights >= 0.0).all()
        np.testing.assert_allclose(weights.sum(axis=1), 1.0, rtol=1e-14)
        np.testing.assert_allclose((weights * (corners @ slope)).sum(axis=1), share @ slope, rtol=1e-12)
    corner = random.normal(size=(2,) * 5)

    def value(share):
        nodes, weights = _of_simplices(share)
        return (weights * corner[tuple(np.moveaxis(nodes, -1, 0))]).sum(axis=1)

    way = np.linspace(random.uniform(size=5), random.uniform(size=5), 2001)
    assert np.abs(np.diff(value(way))).max() <= 1e-3 * 5.0 * np.ptp(corner)


def test_rotations_are_those_of_roll_pitch_and_yaw():
    bases = np.random.default_rng(4).uniform(-3.0, 3.0, (20, 6))
    for base, turned in zip(bases, base_rotations(bases), strict=True):
        np.testing.assert_allclose(turned, pin.rpy.rpyToMatrix(base[5], base[4], base[3]), atol=1e-14)
    np.testing.assert_array_equal(base_rotations(np.pad(bases[:, :4], ((0, 0), (0, 2)))), base_rotations(bases[:, :4]))


def test_what_is_of_one_motion_refuses_several_that_have_each_a_gravity(tilting):
    rollout = tilting.rollout(reached(tilting)[:3])
    for asked in (
        lambda: payload_effort(rollout),
        lambda: rollout.dynamics.effort(rollout.q[:2], rollout.v[:2], rollout.a[:2]),
        lambda: Rollout(rollout.dynamics, rollout.trajectory[0]),
    ):
        with pytest.raises(TrajevoError) as error:
            asked()
        assert "3 motions" in str(error.value)


def test_a_box_tells_whether_it_tilts():
    assert BaseBox.of({"x": [0.0, 0.1], "roll": [0.2, 0.2]}).tilts
    assert not BaseBox.of({"yaw": [0.0, 0.1]}).tilts
    assert BaseBox.of({"pitch": ["-10 deg", 0.0]}).settings == {"pitch": pytest.approx([-np.radians(10.0), 0.0])}


@pytest.mark.long
def test_proof_files_and_closed_loops_are_of_the_gravity_of_the_base(tmp_path, capsys):
    pytest.importorskip("mujoco")
    given = problem({"x": [-0.1, 0.1], "pitch": [-0.6, 0.6], "roll": [-0.3, 0.3]})
    front = optimise(given, seed=1, population=12, generations=6, progress=False, polish=False)
    file = certify(front.knee()).write_proof(tmp_path / "motion.proof.json")
    assert check_proof.main([str(file)]) == 0
    assert "PROVEN" in capsys.readouterr().out
    rows = [0, len(front) - 1]
    whole = simulate(front, rows=rows)
    for place, row in enumerate(rows):
        alone = simulate(front.pick(str(row)))
        assert whole.greatest_tool_error[place] == alone.greatest_tool_error
        assert alone.greatest_tool_error < 1e-4
    wrong = simulate(Rollout(given.dynamics, front.knee().trajectory))
    assert wrong.used.max() != pytest.approx(simulate(front.knee()).used.max(), rel=1e-3)
