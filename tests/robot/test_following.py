"""Joints that mimic others: not planned for, but carried along, with what they bear borne by the joint they follow."""

import dataclasses
import pickle
import time

import numpy as np
import pinocchio as pin
import pytest

from tests.helpers import mostly_long, refused, trajevo
from tests.robot.arms import JACO
from tests.twin import Twin
from trajevo import Dynamics, Payload, ViaPointProblem, certify, dlcc, export, load_robot, optimise, verify
from trajevo.dynamics.complex_bounds import Bounds, EffortReach
from trajevo.robot.examine import examine
from trajevo.robot.joints import Friction
from trajevo.robot.kinematics import ToolKinematics
from trajevo.robot.transmission import Mimicking
from trajevo.verification.newton_euler import NewtonEuler

GIVEN = {"acceleration": 8.0, "jerk": 80.0}
NAMES = ("shoulder", "elbow", "joint_finger_1")
#: Columns of the model's joints: each multiplier of its leader, and offsets, written down from the URDF.
LED = {
    "shoulder": ("shoulder", 1.0, 0.0),
    "elbow": ("elbow", 1.0, 0.0),
    "level": ("elbow", -1.0, 0.0),
    "joint_finger_1": ("joint_finger_1", 1.0, 0.0),
    "joint_finger_2": ("joint_finger_1", 1.0, 0.0),
    "joint_tip": ("joint_finger_1", 1.05, 0.7),
    "joint_pusher": ("joint_finger_1", -0.021, 0.0),
}
TOOL = {"tool": "tool", "limits": GIVEN}
PAYLOAD = Payload(1.5, com=(0.01, -0.02, 0.03))


@pytest.fixture
def write(tmp_path):
    def write(*changes):
        text = JACO
        for old, new in changes:
            assert old in text
            text = text.replace(old, new, 1)
        (tmp_path / "jaco.urdf").write_text(text, encoding="utf-8")
        return tmp_path / "jaco.urdf"

    return write


@pytest.fixture
def jaco(write):
    return load_robot(write(), friction="none", **TOOL)


def states(count=40):
    return np.random.default_rng(1).uniform(-2.0, 2.0, (3, count, 3))


def jacobian(robot):
    """Model coordinates per actuator, shape (n_model, 3), from the table above."""
    names = list(robot.model.names)[1:]
    return np.array([[LED[name][1] * (LED[name][0] == own) for own in robot.joint_names] for name in names])


def test_followers_are_no_joints_of_the_robot(jaco):
    assert set(jaco.joint_names) == set(NAMES)
    assert jaco.dof == 3
    assert jaco.model.nv == 7
    found = {each.name: (each.leader, each.multiplier, each.offset) for each in jaco.followers}
    expected = {name: led for name, led in LED.items() if name not in NAMES}
    assert found.keys() == expected.keys()
    for name, led in expected.items():
        assert found[name][0] == led[0]
        np.testing.assert_allclose(found[name][1:], led[1:], atol=1e-15)


def test_efforts_are_those_of_mujoco_by_virtual_work(jaco):
    q, v, a = states()
    names, J = list(jaco.model.names)[1:], jacobian(jaco)
    offsets = np.array([LED[name][2] for name in names])
    bare = dataclasses.replace(jaco, friction=Friction(*np.zeros((3, 7))))  # the twin has one number for every joint
    torque = Twin.of(bare, PAYLOAD, gravity=(0.0, 0.0, -9.80665)).effort(q @ J.T + offsets, v @ J.T, a @ J.T)
    effort = Dynamics(jaco, PAYLOAD).effort(q, v, a)
    np.testing.assert_allclose(effort, torque @ J, rtol=0.0, atol=1e-11 * np.abs(effort).max())
    np.testing.assert_allclose(NewtonEuler(jaco, PAYLOAD).effort(q, v, a), effort, rtol=0.0, atol=1e-11)


def test_efforts_are_those_of_pinocchio_s_own_mimicking_joints(write):
    """Its reader follows no followers of followers."""
    chain = 'joint="joint_tip" multiplier="-0.02" offset="0.014"', 'joint="joint_finger_1" multiplier="-0.021"'
    robot = load_robot(write(chain), friction="none", **TOOL)
    model = pin.buildModelFromUrdf(str(robot.urdf), mimic=True)
    # Of the continuous joint it has cosine and sine.
    own = [name for name in list(model.names)[1:] if name in NAMES]
    columns = [robot.joint_names.index(name) for name in own]
    model.gravity.linear = np.array([0.0, 0.0, -9.80665])
    data, (q, v, a) = model.createData(), states()
    expected = np.empty_like(q)
    for k in range(len(q)):
        row = [[np.cos(q[k, j]), np.sin(q[k, j])] if robot.joint_names[j] == "shoulder" else [q[k, j]] for j in columns]
        expected[k, columns] = pin.rnea(model, data, np.concatenate(row), v[k, columns], a[k, columns])
    np.testing.assert_allclose(Dynamics(robot).effort(q, v, a), expected, rtol=0.0, atol=1e-11)


def test_power_is_the_rate_of_energy(jaco):
    """Energy is that of Pinocchio's bodies; its rate along a motion is a central difference."""
    motion = [np.array([0.3, -0.4, 0.2]), np.array([1.1, 0.7, -0.9]), np.array([0.5, -1.0, 2.0])]

    def at(t):
        q, v, a = motion[0] + motion[1] * t + 0.5 * motion[2] * t * t, motion[1] + motion[2] * t, motion[2]
        return q, v, a

    def energy(t):
        q, v, _ = (x[0] for x in jaco.transmission.motion(*(x[None] for x in at(t))))
        data = jaco.model.createData()
        kinetic = pin.computeKineticEnergy(jaco.model, data, q, v)
        return kinetic + pin.computePotentialEnergy(jaco.model, data, q)

    for t in (0.0, 0.4, 0.9):
        q, v, a = (x[None] for x in at(t))
        power = (Dynamics(jaco).effort(q, v, a) * v).sum()
        assert power == pytest.approx((energy(t + 1e-5) - energy(t - 1e-5)) / 2e-5, rel=1e-7)


def test_derivatives_by_complex_steps_are_finite_differences(jaco):
    q, v, a = states(4)
    towards = np.random.default_rng(2).uniform(-1.0, 1.0, (3, 4, 3))
    stepped = [x + 1e-20j * d for x, d in zip((q, v, a), towards, strict=True)]
    slopes = Dynamics(jaco, PAYLOAD).effort(*stepped).imag / 1e-20
    ends = [
        Dynamics(jaco, PAYLOAD).effort(*(x + h * d for x, d in zip((q, v, a), towards, strict=True)))
        for h in (1e-6, -1e-6)
    ]
    np.testing.assert_allclose(slopes, (ends[0] - ends[1]) / 2e-6, rtol=1e-6, atol=1e-6)


def test_the_tool_moves_as_mujoco_has_it(jaco):
    q, v, a = states()
    psi = jaco.transmission.motion(q, v, a)
    bare = dataclasses.replace(jaco, friction=Friction(*np.zeros((3, 7))))
    twin, kinematics = Twin.of(bare), ToolKinematics.of(jaco)
    for found, expected in zip(kinematics.pose(q), twin.tool_poses(psi[0]), strict=True):
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12)
    speed = np.linalg.norm(kinematics.twist(q, v)[:, :3], axis=1)
    np.testing.assert_allclose(speed, twin.tool_speed(psi[0], psi[1]), rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(
        (kinematics.jacobian(q) @ v[..., None])[..., 0], kinematics.twist(q, v), rtol=0.0, atol=1e-12
    )
    level = kinematics.pose(np.array([[0.0, 0.8, 0.0]]))[1][0]
    np.testing.assert_allclose(level, kinematics.pose(np.zeros((1, 3)))[1][0], atol=1e-12)  # the bar keeps it level


def test_limits_of_followers_limit_their_leaders(jaco, write):
    at = {name: k for k, name in enumerate(jaco.joint_names)}
    limits, finger = jaco.limits, at["joint_finger_1"]
    # The elbow may go to -2, the level bar to -2.5 and 2, at minus the elbow's position.
    assert (limits.lower[at["elbow"]], limits.upper[at["elbow"]]) == (-2.0, 2.5)
    # 0 <= finger_2, 1.05 q + 0.7 <= 2, and -0.021 q + 0 from -0.02 to 0.05.
    assert limits.lower[finger] == 0.0
    assert limits.upper[finger] == pytest.approx(0.02 / 0.021)
    assert limits.velocity[finger] == pytest.approx(0.04 / 0.021)
    assert limits.effort[finger] == 2.0
    told = load_robot(write(), tool="tool", limits=GIVEN | {"velocity": {"joint_pusher": "10 mm/s", "elbow": 1.0}})
    assert told.limits.velocity[finger] == pytest.approx(0.01 / 0.021)
    assert told.limits.velocity[at["elbow"]] == 1.0
    told = load_robot(write(), tool="tool", limits=GIVEN | {"position": {"joint_finger_2": [0.1, 0.4]}})
    assert (told.limits.lower[finger], told.limits.upper[finger]) == (0.1, 0.4)
    refused(
        lambda: load_robot(write(), tool="tool", limits=GIVEN | {"effort": {"joint_tip": 1.0}}),
        "limits.effort.joint_tip: .*'joint_tip' follows 'joint_finger_1' × 1.05 . 0.7.*limit that of 'joint_finger_1'",
    )
    refused(
        lambda: load_robot(write(('lower="-0.02" upper="0.05"', 'lower="0.04" upper="0.05"')), **TOOL),
        "joint 'joint_finger_1': position: no range is left, as 'joint_pusher' follows 'joint_finger_1' × -0.021",
    )


def test_a_moveit_file_may_name_followers(write, tmp_path):
    (tmp_path / "limits.yaml").write_text(
        "joint_limits:\n"
        + "".join(
            f"  {name}:\n    has_acceleration_limits: true\n    max_acceleration: {limit}\n"
            f"    has_jerk_limits: true\n    max_jerk: 50.0\n"
            for name, limit in {"shoulder": 5.0, "elbow": 6.0, "joint_finger_1": 9.0, "joint_tip": 2.1}.items()
        )
    )
    robot = load_robot(write(), tool="tool", limits=tmp_path / "limits.yaml")
    found = dict(zip(robot.joint_names, robot.limits.acceleration.tolist(), strict=True))
    assert found == {"shoulder": 5.0, "elbow": 6.0, "joint_finger_1": pytest.approx(2.0)}
    examined = examine(robot.urdf, limits=tmp_path / "limits.yaml")
    assert not examined.errors
    assert {row.name: row.acceleration for row in examined.joints} == found


def test_friction_of_followers_is_borne_by_their_leaders(write):
    robot = load_robot(write(), **TOOL)
    at = {name: k for k, name in enumerate(robot.joint_names)}
    finger, elbow = at["joint_finger_1"], at["elbow"]
    assert robot.friction.viscous[finger] == pytest.approx(1.05**2 * 0.02 + 0.021**2 * 3.0)
    assert robot.friction.coulomb[finger] == pytest.approx(1.05 * 0.04 + 0.021 * 2.0)
    assert (robot.friction.viscous[elbow], robot.friction.coulomb[elbow]) == (0.5, 0.3)
    # The power lost is that of all joints of the model.
    v = np.random.default_rng(0).uniform(-1.0, 1.0, (20, 3))
    lost = (robot.friction.effort(v, np.zeros_like(v)) * v).sum(axis=1)
    tip, slide = 1.05 * v[:, finger], -0.021 * v[:, finger]
    expected = 0.02 * tip**2 + 0.04 * np.abs(tip) + 3.0 * slide**2 + 2.0 * np.abs(slide)
    np.testing.assert_allclose(lost, expected + 0.5 * v[:, elbow] ** 2 + 0.3 * np.abs(v[:, elbow]), rtol=1e-12)


def test_what_follows_a_locked_joint_is_held_where_that_holds_it(write):
    robot = load_robot(write(), lock={"joint_finger_1": 0.2}, **TOOL)
    expected = {"joint_finger_1": 0.2, "joint_finger_2": 0.2, "joint_tip": 0.91, "joint_pusher": -0.0042}
    assert robot.locked == pytest.approx(expected)
    assert set(robot.joint_names) == {"shoulder", "elbow"}
    assert load_robot(**robot.settings).locked == robot.locked
    free = load_robot(write(), lock={"level": 0.5}, **TOOL)  # a locked joint follows no other
    assert free.locked == {"level": 0.5}
    assert "level" not in {each.name for each in free.followers}
    still = load_robot(write(('multiplier="-1"', 'multiplier="0" offset="0.3"')), **TOOL)
    assert still.locked == {"level": 0.3}


@pytest.mark.parametrize("model", ["rigid", "weight_only", "tool_axis"])
def test_bounds_at_complex_instants_hold(jaco, model):
    random, J = np.random.default_rng(3), jacobian(jaco)
    offsets = np.array([LED[name][2] for name in list(jaco.model.names)[1:]])
    q, v, a = random.uniform(-2.0, 2.0, (3, 300, 3)) + 1j * random.uniform(-0.2, 0.2, (3, 300, 3))
    motion = Bounds(np.abs(q.imag), np.abs(q), np.abs(v), np.abs(a))
    expected = np.abs((q @ J.T).imag), np.abs(q @ J.T + offsets), np.abs(v @ J.T), np.abs(a @ J.T)
    for found, least in zip(jaco.transmission.reach(*motion), expected, strict=True):
        assert (least <= found * (1.0 + 1e-12)).all()
    torque = random.uniform(-2.0, 2.0, (300, 7)) + 1j * random.uniform(-2.0, 2.0, (300, 7))
    most = jaco.transmission.effort_reach(motion.imaginary, np.abs(torque))
    assert (np.abs(torque @ J) <= most * (1.0 + 1e-12)).all()
    dynamics = Dynamics(
        jaco, Payload(1.5, model=model) if model == "tool_axis" else dataclasses.replace(PAYLOAD, model=model)
    )
    effort = dynamics.effort(q.real, v.real, a.real)
    assert (np.abs(effort) <= EffortReach(dynamics).effort(motion) * (1.0 + 1e-12)).all()


@pytest.mark.parametrize("polish", mostly_long([False, True], False))
@pytest.mark.parametrize("interpolant", mostly_long(["quintic_spline", "cubic", "septic_spline"], "cubic"))
def test_a_motion_is_solved_proven_carries_and_is_exported(write, interpolant, tmp_path, polish):
    robot = load_robot(write(), **TOOL)
    at = {name: k for k, name in enumerate(robot.joint_names)}
    points = np.zeros((3, 3))
    points[:, at["shoulder"]], points[:, at["elbow"]] = (0.0, 1.5, 4.0), (0.5, 1.5, 1.0)
    points[:, at["joint_finger_1"]] = (0.1, 0.8, 0.2)
    problem = ViaPointProblem(
        robot=robot,
        points=points,
        interpolant=interpolant,
        payload=PAYLOAD,
        objectives=("time", "energy"),
        constraints=("position", "velocity", "acceleration", "jerk", "effort"),
        tool_speed=3.0,
        duration_bounds=(0.8, 9.0),
    )
    assert any(note.startswith("friction of <dynamics> used: ") for note in problem.notes)
    front = optimise(problem, generations=6, population=20, seed=1, polish=polish, progress=False)
    solution = front.knee()
    assert certify(solution).proven
    assert verify(solution).passed
    assert verify(solution).effort_difference < 1e-9
    assert dlcc(solution).mass > 1.5
    for name in ("csv", "ros2", "json", "mujoco", "moveit", "netcdf"):
        assert export(solution, tmp_path / f"file_{name}", format=name).stat().st_size
    lines = (tmp_path / "file_mujoco").read_text().splitlines()
    header = next(line for line in lines if not line.startswith("#"))
    assert "level_qpos" in header
    assert "elbow_force" in header
    assert "level_force" not in header
    assert "level" not in (tmp_path / "file_ros2").read_text()
    assert isinstance(pickle.loads(pickle.dumps(robot.transmission)), Mimicking)


def test_clearance_takes_followers_along_or_held(write):
    scene = {"clearance": 0.01, "obstacles": [{"shape": "sphere", "radius": 0.1, "position": [2.0, 0.0, 0.0]}]}
    box = '<collision><geometry><sphere radius="0.05"/></geometry></collision></link><link name="tool"/>'
    file = write(('</link>\n<link name="tool"/>', box))

    def made(lock):
        robot = load_robot(file, lock=lock, **TOOL)
        points = [[0.1] * robot.dof, [0.5] * robot.dof]
        return ViaPointProblem(robot=robot, points=points, scene=scene).evaluate(np.array([[2.0]]))

    assert made({})[1].shape[0] == 1
    assert made({"elbow": 1.0, "joint_finger_1": 0.2})[1].shape[0] == 1


def test_what_follows_is_told(write):
    found = examine(write())
    assert not found.errors
    assert found.dof == 3
    assert {row.name for row in found.joints} == set(NAMES)
    assert "'joint_tip' follows 'joint_finger_1' × 1.05 + 0.7" in found.notes
    shown = trajevo("check-robot", write()).stdout
    assert "note: 'level' follows 'elbow' × -1\n" in shown


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (
            'joint="elbow"',
            'joint="elbo"',
            "joint 'level': mimic: expected a joint of the file, got 'elbo'; did",
        ),
        ('joint="elbow" ', "", "joint 'level': mimic: expected a joint of the file, got None"),
        ('joint="elbow"', 'joint="level"', "expected joints that follow one that moves by itself.*level -> level"),
        (
            'multiplier="1.05"',
            'multiplier="one"',
            "mimic: expected a finite number as multiplier, got 'one'",
        ),
        ('offset="0.7"', 'offset="nan"', "joint 'joint_tip': mimic: expected a finite number as offset, got 'nan'"),
        (
            'joint="joint_finger_1" multiplier="1.05"',
            'joint="joint_pusher" multiplier="1.05"',
            "got a circle: joint_tip -> joint_pusher -> joint_tip",
        ),
    ],
)
def test_what_follows_nothing_is_refused(write, old, new, says):
    file = write((old, new))
    refused(lambda: load_robot(file, **TOOL), says)
    assert examine(file).errors


def test_followers_of_followers_may_be_many_and_must_stay_finite(tmp_path):
    """A chain of 1,900 followers, as a stranger may send it; each doubles what the one before does."""
    links = "".join(
        f'<link name="l{k}"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'
        f'</inertial></link><joint name="j{k}" type="continuous"><parent link="base"/><child link="l{k}"/>'
        f'<axis xyz="0 0 1"/>{f"""<mimic joint="j{k + 1}" multiplier="2"/>""" if k < 1900 else ""}</joint>'
        for k in range(1901)
    )
    file = tmp_path / "many.urdf"
    file.write_text(f'<robot name="many"><link name="base"/>{links}</robot>')
    started = time.process_time()
    refused(
        lambda: load_robot(file, tool="l0", limits=GIVEN), "expected finite numbers for joints that follow followers"
    )
    assert time.process_time() - started < 20.0


def test_a_transmission_of_robot_toml_and_followers_do_not_mix(write, tmp_path):
    write()
    (tmp_path / "robot.toml").write_text(
        'format = 1\nname = "jaco"\nurdf = "jaco.urdf"\ntool = "tool"\nreference = "made"\n'
        'gravity = { vector = [0.0, 0.0, -9.80665], unit = "m/s^2" }\n'
        + "".join(
            f'[joints.{name}]\nposition = {{ lower = -1.0, upper = 1.0, unit = "rad" }}\n'
            'velocity = { limit = 2.0, unit = "rad/s" }\nacceleration = { limit = 8.0, unit = "rad/s^2" }\n'
            'jerk = { limit = 80.0, unit = "rad/s^3" }\neffort = { limit = 50.0, unit = "N*m" }\n'
            for name in NAMES
        )
    )
    robot = load_robot(tmp_path)
    np.testing.assert_array_equal(robot.limits.velocity, np.full(3, 2.0))  # robot.toml says what leaders may do
    assert len(robot.followers) == 4
    file = tmp_path / "robot.toml"
    file.write_text(
        file.read_text().replace(
            "[joints.shoulder]",
            '[transmission]\nkind = "coupled_screws"\nscrews = ["a", "b"]\nslide = "x"\nswivel = "shoulder"\n'
            'span = { value = 1.0, unit = "m" }\n[joints.shoulder]',
        )
    )
    refused(lambda: load_robot(tmp_path), "transmission")
