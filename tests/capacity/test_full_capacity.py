"""Capacity under all limits: numbers known by hand, and bisections that simulate accuracy, grip and stand."""

import numpy as np
import pinocchio as pin
import pytest

from tests.capacity.test_drive_capacity import ARM, UP, point_to_point
from tests.helpers import mostly_long
from tests.random_robots import random_urdf
from trajevo import (
    Grip,
    Load,
    Payload,
    PolynomialBatch,
    Stand,
    ViaPointProblem,
    capacity_by_pace,
    capacity_study,
    dlcc,
    drive_capacity,
    energy_balance,
    full_capacity,
    load_robot,
    optimise,
    payload_sheet,
    plots,
    tool_deviation,
)
from trajevo.capacity.accuracy.causes import edge_moments
from trajevo.capacity.accuracy.found import CAUSES
from trajevo.dynamics.contacts.wrenches import HoldingWrenches
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError, UnknownNameError
from trajevo.robot.payload import carrying

UNLIMITED = {"velocity": np.inf, "acceleration": np.inf, "jerk": np.inf, "effort": np.inf}
STIFF = {"shoulder": {"stiffness": "8000 N*m/rad"}, "elbow": {"stiffness": 4e3}}
SLIDERS = """<robot name="sliders"><link name="base"/><link name="x"/><link name="z"/>
<joint name="x" type="prismatic"><parent link="base"/><child link="x"/><axis xyz="1 0 0"/>
<limit lower="-2" upper="2" velocity="9" effort="9"/></joint>
<joint name="z" type="prismatic"><parent link="x"/><child link="z"/><axis xyz="0 0 1"/>
<limit lower="-2" upper="2" velocity="9" effort="9"/></joint></robot>"""
SQUARE = [[0.3, -0.3, 0.0], [0.3, 0.3, 0.0], [-0.3, 0.3, 0.0], [-0.3, -0.3, 0.0]]


def limit_by(found, cause):
    return next(limit for limit in found.limits if limit.cause == cause)


def instant(robot, q, v, a, payload=None):
    """A motion that is over at once, with a state of the joints."""
    coefficients = np.stack([q, v, 0.5 * np.asarray(a)], axis=-1)[None, None].astype(float)
    return Rollout(Dynamics(robot, payload or Payload(1.0)), PolynomialBatch(np.array([[0.0, 1e-9]]), coefficients))


def sliders(**told):
    """A tool without mass that goes along x and z."""
    return load_robot("sliders", urdf=SLIDERS, limits=UNLIMITED, gravity=[0.0, 0.0, -9.81], allow_massless=True, **told)


# --- deviation


def test_two_level_links_carry_what_bends_them_by_a_millimetre():
    robot = load_robot(ARM, drives={"shoulder": {"stiffness": 1e4}, "elbow": {"stiffness": 5e3}}, limits=UNLIMITED)
    held = instant(robot, [0.0, 0.0], [0.0, 0.0], [0.0, 0.0])
    found = full_capacity(held, deviation=1e-3, counted="payload")
    assert found.by("deviation") == pytest.approx(0.6795787, abs=1e-6)
    assert found.by("deviation") == pytest.approx(1e-3 / (9.81 * 1.5e-4), rel=1e-9)
    bent = tool_deviation(held, mass=1.0, counted="payload")
    assert bent.deviation == pytest.approx([0.0, -9.81 * 1.5e-4, 0.0], abs=1e-12)  # gravity is along -y: it sags
    assert bent.by_joint == pytest.approx([9.81 * 1e-4, 9.81 * 0.5e-4], rel=1e-9)


def test_a_motion_is_limited_by_what_bends_it():
    motion = point_to_point(load_robot(ARM, drives=STIFF))
    assert full_capacity(motion, deviation=1e-3, counted="payload").by("deviation") == pytest.approx(
        0.3416364, abs=1e-6
    )
    limit = limit_by(full_capacity(motion, deviation=12e-3), "deviation")
    assert limit.mass == pytest.approx(2.3383805, abs=1e-6)
    assert limit.time == pytest.approx(0.27047, abs=1e-5)
    assert limit.place == "shoulder"
    bent = tool_deviation(motion, mass=1.0)
    assert bent.greatest == pytest.approx(8.095889e-3, abs=1e-9)
    assert bent.by_joint.sum() == pytest.approx(bent.greatest, rel=1e-12)
    assert np.linalg.norm(bent.deviation) == pytest.approx(bent.greatest, rel=1e-12)
    assert tool_deviation(motion, mass=limit.mass).greatest == pytest.approx(12e-3, rel=1e-9)
    assert tool_deviation(motion).mass == 1.0


def test_a_rotor_does_not_bend_the_gear_behind_it():
    rotor = {"gear_ratio": 100.0, "rotor_inertia": 1e-3}
    light, heavy = (
        load_robot(ARM, drives={name: STIFF[name] | (rotor if extra else {}) for name in STIFF}) for extra in (0, 1)
    )
    assert heavy.friction.armature[0] == 10.0
    light, heavy = (tool_deviation(point_to_point(robot)).greatest for robot in (light, heavy))
    assert heavy == pytest.approx(light, rel=1e-12)


def test_static_deviation_agrees_with_springs_in_mujoco():
    mujoco = pytest.importorskip("mujoco")
    xml = """<mujoco><compiler angle="radian"/><option gravity="0 -9.81 0" timestep="0.001" integrator="implicit"/>
    <worldbody><body name="upper"><joint name="a" axis="0 0 1" stiffness="8000" damping="60" armature="1"/>
    <inertial pos="0.25 0 0" mass="5" diaginertia="1e-6 0.1041667 0.1041667"/>
    <body name="lower" pos="0.5 0 0"><joint name="b" axis="0 0 1" stiffness="4000" damping="30" armature="1"/>
    <inertial pos="0.25 0 0" mass="3" diaginertia="1e-6 0.0625 0.0625"/>
    <body name="load" pos="0.5 0 0"><inertial pos="0 0 0" mass="1" diaginertia="1e-9 1e-9 1e-9"/></body>
    </body></body></worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    for _ in range(6000):
        mujoco.mj_step(model, data)
    assert np.abs(data.qvel).max() < 1e-9
    moved = data.body("load").xpos - [1.0, 0.0, 0.0]
    held = instant(load_robot(ARM, drives=STIFF), [0.0, 0.0], [0.0, 0.0], [0.0, 0.0])
    bent = tool_deviation(held, mass=1.0)
    # Springs bend the arm, which changes the levers: the deviation is linear only up to its square.
    assert bent.deviation == pytest.approx(moved, abs=2.0 * bent.greatest**2)
    assert bent.greatest > 5e-3


# --- grip


def test_a_grip_holds_what_friction_does():
    upward = sliders(grip={"force_per_finger": "100 N", "friction": 0.3})
    motion = instant(upward, [0.0, 0.0], [0.0, 0.0], [0.0, 3.0])
    found = full_capacity(motion)
    assert found.mass == pytest.approx(4.6838407, abs=1e-6)
    assert (found.cause, found.place) == ("slip", "across the closing axis")
    safe = sliders(grip=Grip(total_force=200.0, friction=0.3, safety=2.0))
    assert full_capacity(instant(safe, [0.0, 0.0], [0.0, 0.0], [0.0, 3.0])).mass == pytest.approx(2.3419204, abs=1e-6)
    just = sliders(grip=Grip(total_force=170.8, friction=0.3, safety=2.0))
    assert full_capacity(instant(just, [0.0, 0.0], [0.0, 0.0], [0.0, 3.0])).mass == pytest.approx(2.0, rel=1e-9)


def test_fingers_are_pushed_open_along_the_closing_axis():
    robot = sliders(grip=Grip(force_per_finger=100.0, friction=0.3, closing_axis=(0.0, 0.0, 5.0)))
    found = full_capacity(instant(robot, [0.0, 0.0], [0.0, 0.0], [0.0, 3.0]))
    assert found.mass == pytest.approx(200.0 / 12.81, rel=1e-9)
    assert found.place == "along the closing axis"


def test_a_load_off_the_grip_turns_in_it():
    robot = sliders(grip=Grip(force_per_finger=100.0, friction=0.3, torsion=0.005))
    off = Payload(1.0, (0.1, 0.0, 0.0))  # its weight turns it about the closing axis y
    for payload, square in ((Payload(1.0), 0.3**-2), (off, 0.3**-2 + (0.1 / 0.005) ** 2)):
        found = full_capacity(instant(robot, [0.0, 0.0], [0.0, 0.0], [0.0, 0.0], payload))
        assert found.mass == pytest.approx(200.0 / (9.81 * np.sqrt(square)), rel=1e-9)
    there = sliders(grip=Grip(force_per_finger=100.0, friction=0.3, torsion=0.005, point=(0.1, 0.0, 0.0)))
    assert full_capacity(instant(there, [0, 0], [0, 0], [0, 0], off)).mass == pytest.approx(60.0 / 9.81, rel=1e-9)


# --- stand


@pytest.mark.parametrize(("acceleration", "mass"), [(0.0, 30.0), (-3.0, 176.58 / 8.886)])
@pytest.mark.parametrize("way", [1, -1])
def test_a_stand_tips_where_the_moment_about_an_edge_is_used_up(acceleration, mass, way):
    stand = {"mass": "60 kg", "com": [0.0, 0.0, 0.2], "footprint": SQUARE[::way]}
    found = full_capacity(instant(sliders(stand=stand), [0.9, 1.0], [0.0, 0.0], [acceleration, 0.0]))
    assert found.mass == pytest.approx(mass, rel=1e-9)
    assert found.mass == pytest.approx({0.0: 30.0, -3.0: 19.8717083}[acceleration], abs=1e-6)
    assert found.cause == "tip_over"
    assert found.place.count("(0.3,") == 2


def test_without_a_payload_a_stand_may_already_tip():
    stand = Stand(mass=1.0, com=(0.6, 0.0, 0.2), footprint=SQUARE)
    found = full_capacity(instant(sliders(stand=stand), [0.9, 1.0], [0.0, 0.0], [0.0, 0.0]))
    assert not found.feasible
    assert found.mass == 0.0
    assert str(found).startswith("0 kg: no payload, and not even none, keeps every limit: tip-over over the edge")
    back = full_capacity(instant(sliders(stand=stand), [-0.9, 1.0], [0.0, 0.0], [0.0, 0.0]))
    assert back.least == pytest.approx(0.3 / 1.2, rel=1e-9)  # a counterweight
    assert back.mass == pytest.approx(0.9 / 0.6, rel=1e-9)


def random_arm(seed, **told):
    rng = np.random.default_rng(seed)
    gravity = rng.normal(size=3) + np.array([0.0, 0.0, -9.0])
    text = random_urdf(rng, int(rng.integers(2, 7)))
    robot = load_robot("random", urdf=text, limits=UNLIMITED, gravity=gravity, **told)
    tensor = np.diag(rng.uniform(0.01, 0.015, 3))
    return rng, text, gravity, robot, Payload(2.0, tuple(rng.uniform(-0.1, 0.1, 3)), tuple(map(tuple, tensor)))


def wrench_of_pinocchio(robot, payload, q, v, a):
    """Force and moment about its origin that the base gives to an arm with its payload."""
    model = carrying(robot, payload) if payload.mass else robot.model
    data = model.createData()
    pin.forwardKinematics(model, data, q)
    pin.rnea(model, data, q, v, a)
    found = pin.Force.Zero()
    for joint in range(1, model.njoints):
        if model.parents[joint] == 0:
            found += data.oMi[joint].act(data.f[joint])
    return np.concatenate([found.linear, found.angular])


@pytest.mark.parametrize("seed", range(6))
def test_the_wrench_of_the_base_is_that_of_pinocchio(seed):
    rng, _, _, robot, payload = random_arm(seed)
    q, v, a = rng.normal(size=(3, 9, robot.dof))
    held = HoldingWrenches.of(Dynamics(robot, payload)).at(q, v, a, np.zeros(9, dtype=int))
    for k in range(9):
        for mass in (0.0, 2.0):
            expected = wrench_of_pinocchio(robot, payload.with_mass(mass), q[k], v[k], a[k])
            own, each = (np.concatenate([x.force[:, k], x.moment[:, k]]) for x in (held.base, held.base_each))
            np.testing.assert_allclose(own + mass * each, expected, atol=1e-10 * np.abs(expected).max())


@pytest.mark.parametrize("seed", range(3))
def test_the_wrench_of_the_base_is_that_of_a_free_base_in_mujoco(seed):
    """The base of a free body is held by applied forces: those of the inverse dynamics of its six coordinates."""
    mujoco = pytest.importorskip("mujoco")
    rng, text, gravity, robot, _ = random_arm(seed)
    spec = mujoco.MjSpec.from_string(text.replace("<robot", "<robot", 1))
    spec.option.gravity = gravity
    model = spec.compile()
    # MuJoCo welds the base of a URDF to the world: its reaction is that of all bodies' momenta.
    data = mujoco.MjData(model)
    q, v, a = rng.normal(size=(3, robot.dof))
    held = HoldingWrenches.of(Dynamics(robot)).at(q[None], v[None], a[None], np.zeros(1, dtype=int))
    momentum = []
    step = 1e-6
    for way in (-1.0, 1.0):
        data.qpos[:], data.qvel[:] = q + way * step * v + 0.5 * step**2 * a, v + way * step * a
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_comVel(model, data)
        mujoco.mj_subtreeVel(model, data)
        linear, about, com = data.subtree_linvel[0], data.subtree_angmom[0], data.subtree_com[0]
        mass = model.body_subtreemass[0]
        momentum.append(np.concatenate([mass * linear, about + np.cross(com, mass * linear)]))
    rate = (momentum[1] - momentum[0]) / (2.0 * step)
    data.qpos[:] = q
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    weight = model.body_subtreemass[0] * gravity
    expected = rate - np.concatenate([weight, np.cross(data.subtree_com[0], weight)])
    found = np.concatenate([held.base.force[:, 0], held.base.moment[:, 0]])
    np.testing.assert_allclose(found, expected, atol=1e-6 * np.abs(expected).max())


# --- all of them together


def test_all_causes_are_told_and_the_least_binds():
    robot = load_robot(
        ARM,
        drives=STIFF,
        limits={"effort": [120.0, 40.0]},
        grip=Grip(force_per_finger=200.0, friction=0.3, closing_axis=(0.0, 0.0, 1.0)),
        stand=Stand(mass=60.0, com=(0, 0, 0), footprint=[[x, y, z] for (x, z, y) in SQUARE]),
    )
    motion = point_to_point(robot)
    found, drives = full_capacity(motion, deviation=12e-3, dwell=1.0), drive_capacity(motion, dwell=1.0)
    assert found.mass == min(limit.mass for limit in found.limits)
    for cause in ("effort", "torque_at_speed", "rms_torque", "temperature"):
        assert found.by(cause) == drives.by(cause)
    assert found.by("effort") == pytest.approx(dlcc(motion, tolerance=1e-7).mass, rel=2e-7)
    assert found.by("peak_torque") == np.inf
    assert found.not_covered == ("peak torque", "power of the supply")
    assert (found.cause, found.place) == ("rms_torque", "elbow")
    assert "1.796316 kg (rigid payload), limited by RMS torque over the cycle of elbow" in str(found)
    table = found._repr_html_()
    for told in ("deviation of the tool", "slip of the payload", "tip-over", "1.79632", "2.33838"):
        assert told in table
    with pytest.raises(UnknownNameError, match="unknown cause 'heat'"):
        found.by("heat")


def test_a_robot_of_which_little_is_known_says_so():
    motion = instant(sliders(), [0.0, 0.0], [0.0, 0.0], [0.0, 0.0])
    assert str(full_capacity(motion)).startswith("unlimited: nothing that is known limits a rigid payload")
    assert full_capacity(motion).not_covered == ("drives", "deviation of the tool", "slip of the payload", "tip-over")
    robot = load_robot(ARM, drives={"elbow": {"stiffness": 4e3}})
    assert "what shoulder give way, for want of stiffness" in str(full_capacity(point_to_point(robot), deviation=0.01))
    assert str(tool_deviation(point_to_point(robot))).endswith("not covered: shoulder without stiffness")


def changing(loads):
    """Two links that go up and back, and rest at the top, where loads may change."""
    robot = load_robot(
        ARM,
        drives=STIFF,
        limits={"acceleration": 50.0, "jerk": 1e4},
        grip=Grip(total_force=100.0, friction=0.5, closing_axis=(0.0, 0.0, 1.0)),
        stand=Stand(mass=60.0, com=(0, 0, 0), footprint=[[x, y, z] for (x, z, y) in SQUARE]),
    )
    points, passing = [[-1.5, 0.0], [0.0, 1.5], [-1.5, 0.0]], [{"point": 1, "dwell": 0.1}]
    given = {"passing": passing, "payload": loads, "duration_bounds": (0.4, 2.0)}
    problem = ViaPointProblem(robot=robot.settings, points=points, **given)
    return problem.rollout(0.5 * (problem.xl + problem.xu))


def test_loads_that_change_on_the_way_count_where_they_are_carried():
    alone = changing([Load(Payload(2.0), from_point=1)])
    found = full_capacity(alone, deviation=0.02)
    # By hand: 50 N of friction against what a tip of two links of 0.5 m takes on the way back, after the rest.
    times = np.linspace(alone.trajectory.breaks[0, -2], alone.trajectory.duration[0], 100_001)[None]
    q, v, a = (alone.trajectory.evaluate(times, order)[0] for order in range(3))
    taken = np.array([0.0, 9.81])[:, None] * np.ones(times.shape)
    for k in range(2):
        angle, rate, change = (x[:, : k + 1].sum(axis=1) for x in (q, v, a))
        outward = np.array([np.cos(angle), np.sin(angle)])
        taken = taken + 0.5 * (change * np.array([-outward[1], outward[0]]) - rate**2 * outward)
    assert found.by("slip") == pytest.approx(50.0 / np.linalg.norm(taken, axis=0).max(), rel=1e-7)
    assert limit_by(found, "slip").time > times[0, 0]
    # A kilogram that is carried all the time takes its share of what bends the arm and tips the stand, not of the grip.
    both = full_capacity(changing([Load(Payload(1.0)), Load(Payload(2.0), from_point=1)]), deviation=0.02)
    for cause, less in (("deviation", 1.0), ("torque_at_speed", 1.0), ("slip", 0.0)):
        assert both.by(cause) == pytest.approx(found.by(cause) - less, rel=1e-9)


def test_it_is_not_guessed_which_of_several_loads_is_meant():
    motion = changing([Load(Payload(1.0), to_point=1), Load(Payload(2.0), from_point=1)])
    for call in (full_capacity, drive_capacity, tool_deviation, capacity_by_pace):
        with pytest.raises(InvalidInputError, match="payload: a capacity asks about one load, and there are 2"):
            call(motion)
    with pytest.raises(InvalidInputError, match="payload: a sheet asks about one load, and there are 2"):
        payload_sheet(motion)
    assert "of motion with loads that change" in str(energy_balance(motion))


def simulated(robot, payload, trajectory, steps):
    """Levels of deviation, slip and tip-over with a mass, at equal steps, with no closed form at all."""
    times = np.linspace(0.0, float(trajectory.duration[0]), steps + 1)[None]
    q, v, a = (trajectory.evaluate(times, order)[0] for order in range(3))
    stiffness = np.array([robot.drives[name].stiffness for name in robot.joint_names])
    small, columns = 1e-6, []
    for unit in np.eye(robot.dof):
        there = [robot.tool_poses(q + way * small * unit)[0] for way in (-1.0, 1.0)]
        columns.append((there[1] - there[0]) / (2.0 * small))

    def deviation(mass):
        bent = Dynamics(robot, payload.with_mass(mass)).effort(q, v, a) / stiffness
        moved = sum(column * bent[:, k, None] for k, column in enumerate(columns))
        return np.linalg.norm(moved, axis=1).max()

    step = 1e-4
    centres = []
    for shift in (-step, 0.0, step):
        positions, rotations = robot.tool_poses(q + shift * v + 0.5 * shift**2 * a)
        centres.append(positions + rotations @ np.array(payload.com))
    force = (centres[0] - 2.0 * centres[1] + centres[2]) / step**2 - robot.model.gravity.linear
    rotations = robot.tool_poses(q)[1]

    def slip(mass):
        grip = robot.grip
        axis = rotations @ (np.array(grip.closing_axis) / np.linalg.norm(grip.closing_axis))
        along = (force * axis).sum(axis=1)
        across = np.linalg.norm(force - along[:, None] * axis, axis=1)
        return grip.safety * mass * max(across.max() / grip.friction, np.abs(along).max()) / grip.pressing

    return deviation, slip, (q, v, a)


def tipping_of(robot, payload, states):
    """How far inside the footprint the zero moment point is at all states, by Pinocchio's wrenches [m]."""
    stand, down = robot.stand, np.array(robot.model.gravity.linear)
    corners = np.array(stand.footprint)
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    normal *= -np.sign(normal @ down) / np.linalg.norm(normal)
    if np.cross(corners[1] - corners[0], corners[2] - corners[1]) @ normal < 0.0:
        corners = corners[::-1]
    wrenches = [
        np.array([wrench_of_pinocchio(robot, payload.with_mass(mass), *state) for state in zip(*states, strict=True)])
        for mass in (0.0, 1.0)
    ]
    weight = -stand.mass * down
    of_stand = np.concatenate([weight, np.cross(stand.com, weight)])

    def margin(mass):
        total = wrenches[0] + mass * (wrenches[1] - wrenches[0]) + of_stand
        force, moment = total[:, :3], total[:, 3:] - np.cross(corners[0], total[:, :3])
        press = force @ normal
        if (press <= 0.0).any():
            return -1.0
        point = corners[0] + np.cross(normal, moment) / press[:, None]
        sides = np.roll(corners, -1, axis=0) - corners
        inward = np.cross(normal, sides / np.linalg.norm(sides, axis=1, keepdims=True))
        return min(((point - corner) @ way).min() for corner, way in zip(corners, inward, strict=True))

    return margin


def last_true(kept, outside, halvings=26):
    """The greatest mass up to which something is kept, from one that is."""
    if kept(outside):
        return outside
    low, high = 0.0, outside
    for _ in range(halvings):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if kept(middle) else (low, middle)
    return low


def bisected_case(seed):
    rng, text, gravity, bare, payload = random_arm(seed)
    breaks = np.array([[0.0, rng.uniform(0.4, 1.5)]])
    trajectory = PolynomialBatch(breaks, rng.normal(scale=0.5, size=(1, 1, bare.dof, 5)))
    stiffness = {name: {"stiffness": float(rng.uniform(2e5, 2e6))} for name in bare.joint_names}
    angles = np.sort(rng.uniform(0.0, 2.0 * np.pi, 3)) + np.array([0.0, 0.1, 0.2])
    corners = [[2.0 * np.cos(x), 2.0 * np.sin(x), -0.4] for x in np.arange(5) * 2.0 * np.pi / 5.0 + angles[0]]
    robot = load_robot(
        "random",
        urdf=text,
        limits=UNLIMITED,
        gravity=gravity,
        drives=stiffness,
        grip=Grip(total_force=rng.uniform(50, 200), friction=rng.uniform(0.1, 0.6), closing_axis=rng.normal(size=3)),
        stand=Stand(mass=rng.uniform(300.0, 900.0), com=tuple(rng.uniform(-0.2, 0.2, 3)), footprint=corners),
    )
    motion = Rollout(Dynamics(robot, payload), trajectory)
    most = tool_deviation(motion, mass=0.0).greatest * rng.uniform(1.1, 2.0) + 1e-4
    return robot, payload, trajectory, motion, most


def bisected(seed):
    """How many masses of a case are those of a bisection that simulates; in finer steps where they are not at first."""
    robot, payload, trajectory, motion, most = bisected_case(seed)
    found, left = full_capacity(motion, deviation=most), ("deviation", "slip", "tip_over")
    for steps in (300, 4000):
        deviation, slip, states = simulated(robot, payload, trajectory, steps)
        margin = tipping_of(robot, payload, states)
        kept = {
            "deviation": lambda mass, deviation=deviation: deviation(mass) <= most,
            "slip": lambda mass, slip=slip: slip(mass) <= 1.0,
            "tip_over": lambda mass, margin=margin: margin(mass) >= 0.0,
        }
        left = [cause for cause in left if disagreement(limit_by(found, cause), kept[cause])]
        if not left:
            return 3
    raise AssertionError((seed, [disagreement(limit_by(found, cause), kept[cause]) for cause in left]))


def disagreement(limit, kept):
    """Why the mass of a cause is not that of a bisection; empty if it is."""
    if limit.mass < limit.least or limit.least > 0.0:
        return "carried without payload" if kept(0.0) else ""
    outside = min(2.0 * limit.mass + 1.0, 1e4)
    far = last_true(kept, outside)
    return "" if far == pytest.approx(min(limit.mass, outside), rel=2e-4) else f"{far} instead of {limit.mass} kg"


@pytest.mark.parametrize("first", mostly_long([0, *range(3, 403, 40)], 0))
def test_capacities_agree_with_a_bisection_that_simulates_what_holds_the_payload(first):
    """Three causes of 3 random arms here, of 403 with those that take longer."""
    count = 3 if first == 0 else 40
    assert sum(bisected(seed) for seed in range(first, first + count)) == 3 * count


# --- paces


def test_payload_by_pace():
    robot = load_robot(ARM, drives=STIFF, limits={"effort": [120.0, 40.0], "velocity": 3.0})
    motion = point_to_point(robot)
    paces = capacity_by_pace(motion, factors=[2.0, 0.8, 1.0, 4.0], deviation=12e-3, dwell=0.5)
    assert paces.factors.tolist() == [0.8, 1.0, 2.0, 4.0]
    assert paces.cycle_times == pytest.approx([1.3, 1.5, 2.5, 4.5])
    for k, factor in enumerate(paces.factors):
        own = full_capacity(point_to_point(robot, UP, float(factor)), deviation=12e-3, dwell=0.5)
        assert paces.mass[k] == pytest.approx(own.mass, rel=1e-9)
        assert paces.binding[k] == own.cause
        assert paces.by("deviation")[k] == pytest.approx(own.by("deviation"), rel=1e-9)
    assert paces.mass == pytest.approx(np.min([paces.by(cause) for cause in paces.causes], axis=0))
    assert paces.least_duration == pytest.approx(1.875 * np.pi / 2.0 / 3.0)
    assert paces.spans[0][1] == paces.cycle_times[-1]
    assert "as the cycle shortens" in str(paces)
    assert "cycle time [s]" in paces._repr_html_()


def test_the_picture_of_what_binds():
    motion = point_to_point(load_robot(ARM, drives=STIFF))
    paces = capacity_by_pace(motion, factors=np.geomspace(0.5, 8.0, 7), deviation=12e-3)
    ax = plots.what_binds(paces)
    labels = [text.get_text() for text in ax.get_legend().get_texts()]
    assert labels == [CAUSES[cause] for cause in ("torque_at_speed", "rms_torque", "temperature", "deviation")]
    assert ax.get_xlabel() == "cycle time, at rest included [s]"
    assert ax.get_ylabel() == "largest payload [kg] (rigid)"
    thick = [line for line in ax.get_lines() if line.get_linewidth() > 2.0]
    assert len(thick) == len(set(paces.binding))
    tops = np.concatenate([line.get_ydata() for line in thick])
    assert np.nanmax(tops) == pytest.approx(paces.mass.max())


# --- as a limit of a problem


def problem(**arguments):
    robot = {"name": ARM, "drives": STIFF, "limits": {"acceleration": 50.0, "jerk": 1e4}}
    points = [[-1.5, 0.2], [-0.7, 1.0], [0.0, 1.5]]
    given = {"payload": Payload(1.0), "duration_bounds": (0.3, 2.0), "constraints": (), "samples": 25}
    return ViaPointProblem(**{"robot": robot, "points": points} | given | arguments)


@pytest.mark.parametrize("counted", ["all", "payload"])
def test_deviation_is_a_limit_of_problems(counted):
    limited = problem(deviation=0.01, deviation_of=counted)
    x = np.linspace(0.2, 0.9, 7)[:, None] * (limited.xu - limited.xl) + limited.xl
    excess = limited.evaluate(x, return_values_of=["G"])[:, -1]
    for row, found in zip(x, excess, strict=True):
        motion = limited.rollout(row)
        greatest = tool_deviation(motion, counted=counted).greatest
        assert 0.01 * (found + 1.0) <= greatest * (1.0 + 1e-12)
        assert 0.01 * (found + 1.0) == pytest.approx(greatest, rel=5e-3)  # between few samples it is a little greater
    alone = limited.evaluate(x[3:4], return_values_of=["G"])[0, -1]
    assert alone == excess[3]
    constraint = next(one for one in limited.constraints if one.quantity.startswith("tool deviation"))
    terms = constraint.terms(limited.rollout(x))
    assert terms.max(axis=1) == pytest.approx(excess, rel=1e-15)


def test_the_capacity_of_a_solution_keeps_the_deviation_of_its_problem():
    asked = {"objectives": ["time", "square_jerk"], "constraints": ["velocity"]}
    limited = problem(deviation=0.012, deviation_of="payload", **asked)
    solution = optimise(limited, generations=5, population=20, seed=1, polish=False).knee()
    found = full_capacity(solution)
    assert found.deviation == 0.012
    assert found.by("deviation") == full_capacity(solution.rollout, deviation=0.012, counted="payload").by("deviation")
    assert found.by("deviation") >= 1.0 - 0.02


# --- what it does not take


def test_wrong_arguments_are_refused_with_a_sentence():
    motion = point_to_point(load_robot(ARM, drives=STIFF))
    for wrong in (0.0, -1.0, np.nan, "1 mm", True):
        with pytest.raises(InvalidInputError, match=r"deviation: expected a positive length \[m\], got"):
            full_capacity(motion, deviation=wrong)
    with pytest.raises(InvalidInputError, match="deviation: 5 m looks like mm: expected at most 1 m, 0.005 if so"):
        full_capacity(motion, deviation=5)
    with pytest.raises(UnknownNameError, match="unknown counted 'some'; known: all, payload"):
        full_capacity(motion, counted="some")
    with pytest.raises(InvalidInputError, match="mass: expected a payload from 0 on"):
        tool_deviation(motion, mass=-1.0)
    without = instant(sliders(grip=Grip(total_force=9.0, friction=0.3)), [0, 0], [0, 0], [0, 0])
    for given in (motion, without):  # with drives and without any
        for dwell in (-1.0, "5", None):
            for call in (full_capacity, capacity_by_pace):
                with pytest.raises(InvalidInputError, match=r"dwell: expected a time from 0 on \[s\], got"):
                    call(given, dwell=dwell)
        with pytest.raises(InvalidInputError, match="cycles: expected a whole number from 1 on, or None for ever"):
            full_capacity(given, cycles=0)
    with pytest.raises(InvalidInputError, match="factors: expected positive numbers, at least one"):
        capacity_by_pace(motion, factors=[1.0, 0.0])
    for pace in (1e-300, 1e300):
        for call in (lambda f: capacity_by_pace(motion, factors=[f]), lambda f: capacity_study(motion, speeds=[f])):
            with pytest.raises(InvalidInputError, match=r"(factors|speeds): expected numbers from 1e-06 to 1e\+06"):
                call(pace)
    soft = point_to_point(load_robot(ARM))
    for call in (lambda: full_capacity(soft, deviation=1e-3), lambda: tool_deviation(soft)):
        with pytest.raises(
            InvalidInputError, match=r"robot 'two_link_drives' has no stiffness of any joint, .* give it"
        ):
            call()
    with pytest.raises(InvalidInputError, match="has no stiffness of any joint"):
        problem(deviation=0.01, robot=ARM)
    with pytest.raises(InvalidInputError, match=r"^grip\.friction: this key is missing$"):
        load_robot(ARM, grip={"total_force": 100.0})
    with pytest.raises(InvalidInputError, match=r"^stand\.com: this key is missing$"):
        load_robot(ARM, stand={"mass": "90 kg"})


def test_the_text_of_a_limit_is_a_sentence():
    found = full_capacity(point_to_point(load_robot(ARM, drives=STIFF)), deviation=1e-3)
    assert not found.feasible  # the arm itself gives way by more
    told = {limit.cause: str(limit) for limit in found.limits}
    assert told["deviation"].startswith("deviation of the tool, most of it by shoulder at ")
    assert told["torque_at_speed"].startswith("torque at speed of ")


def test_edge_moments_do_not_depend_on_other_states_to_the_bit():
    rng, _, gravity, robot, payload = random_arm(5)
    stand = Stand(mass=60.0, com=(0.0, 0.0, 0.1), footprint=SQUARE)
    holding = HoldingWrenches.of(Dynamics(robot, payload))
    q, v, a = rng.normal(size=(3, 50, robot.dof))
    own, each = edge_moments(stand, gravity, holding.at(q, v, a, np.zeros(50, dtype=int)))
    for k in (0, 17, 49):
        one = [x[k : k + 1] for x in (q, v, a)]
        alone = edge_moments(stand, gravity, holding.at(*one, np.zeros(1, dtype=int)))
        assert np.array_equal(alone[0][0], own[k])
        assert np.array_equal(alone[1][0], each[k])
    stepped = holding.at(q + 1e-30j * v, v.astype(complex), a.astype(complex), np.zeros(50, dtype=int))
    near = [holding.at(q + way * 1e-6 * v, v, a, np.zeros(50, dtype=int)).base.moment for way in (-1.0, 1.0)]
    slope = (near[1] - near[0]) / 2e-6
    assert stepped.base.moment.imag / 1e-30 == pytest.approx(slope, abs=1e-6 * np.abs(slope).max())
