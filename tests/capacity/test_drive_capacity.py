"""What drives let an arm carry: published and own benchmarks, and a simulation step by step on random arms."""

from itertools import pairwise

import numpy as np
import pytest

from tests.capacity.simulated_drives import Simulated, last_kept, with_drives
from tests.helpers import mostly_long
from tests.random_robots import random_urdf
from trajevo import Drive, Payload, PolynomialBatch, drive_capacity, drive_load, load_robot
from trajevo.capacity.dlcc import dlcc
from trajevo.dynamics.drives.cycle import NODES, Cycle
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError

ARM = "tests/data/two_link_drives"
UP, DOWN = ([-np.pi / 2.0, 0.0], [0.0, np.pi / 2.0]), ([0.0, np.pi / 2.0], [-np.pi / 2.0, 0.0])
CONSTANT = {"shoulder": {"peak_torque": 120.0}, "elbow": {"peak_torque": "40 N*m"}}


def point_to_point(robot, ends=UP, duration=1.0, mass=1.0):
    """A motion by 10 s³ - 15 s⁴ + 6 s⁵."""
    begin, end = map(np.array, ends)
    coefficients = np.zeros((1, 1, len(begin), 6))
    coefficients[0, 0, :, 0] = begin
    for power, factor in ((3, 10.0), (4, -15.0), (5, 6.0)):
        coefficients[0, 0, :, power] = (end - begin) * factor / duration**power
    return Rollout(Dynamics(robot, Payload(mass)), PolynomialBatch(np.array([[0.0, duration]]), coefficients))


def of(found, cause):
    return next(limit for limit in found.limits if limit.cause == cause)


# --- one link


def one_link(drive):
    text = (
        '<robot name="one"><link name="base"/><link name="arm"/><link name="tip"/>'
        '<joint name="a" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 -1 0"/>'
        '<limit lower="-6" upper="6" velocity="100" effort="1000"/></joint>'
        '<joint name="t" type="fixed"><parent link="arm"/><child link="tip"/><origin xyz="0.5 0 0"/></joint></robot>'
    )
    limits = {"acceleration": np.inf, "jerk": np.inf, "effort": np.inf}
    return load_robot(
        "one", urdf=text, limits=limits, gravity=[0.0, 0.0, -9.81], allow_massless=True, drives={"a": drive}
    )


@pytest.mark.parametrize(("acceleration", "mass"), [(4.0, 80.0 / 5.905), (0.0, 80.0 / 4.905)])
def test_a_massless_arm_carries_what_is_left_of_the_torque_at_its_speed(acceleration, mass):
    robot = one_link({"torque_speed": [[0.0, 100.0], [10.0, 0.0]]})
    instant = PolynomialBatch(np.array([[0.0, 1e-10]]), np.array([[[[0.0, 2.0, acceleration / 2.0]]]]))
    found = drive_capacity(Rollout(Dynamics(robot, Payload(1.0)), instant))
    assert found.mass == pytest.approx(mass, rel=1e-8)
    assert found.mass == pytest.approx({4.0: 13.5478408, 0.0: 16.3098875}[acceleration], abs=1e-6)
    assert (found.cause, found.joint) == ("torque_at_speed", "a")


@pytest.mark.parametrize(
    ("points", "speed", "mass"),
    [
        ([[0.0, 100.0], [2.0, 100.0], [10.0, 0.0]], 2.0, 100.0 / 4.905),  # the corner
        ([[0.0, 100.0], [2.0, 100.0], [10.0, 0.0]], 6.0, 50.0 / 4.905),
        ([[0.0, 100.0], [2.0, 80.0]], 1.0, 90.0 / 4.905),
        ([[0.0, 100.0], [2.0, 80.0]], -50.0, None),  # faster than the line tells: the motor cannot turn so fast
        ([[0.0, 100.0], [10.0, 0.0]], 12.0, None),  # the load would have to drive, but it is lifted
        ([[0.0, 100.0], [10.0, 0.0]], -2.0, 100.0 / 4.905),  # the load drives: clipped at stall
    ],
)
def test_lines_between_beyond_and_against_the_motion(points, speed, mass):
    robot = one_link({"torque_speed": points})
    found = drive_capacity(
        Rollout(Dynamics(robot, Payload(1.0)), PolynomialBatch(np.array([[0.0, 1e-10]]), np.array([[[[0.0, speed]]]])))
    )
    assert found.feasible == (mass is not None)
    assert found.mass == pytest.approx(mass or 0.0, rel=1e-8)
    if mass is None:
        assert str(found).startswith("0 kg: no payload, and not even none, keeps every limit: torque at speed of a")


def test_a_load_that_drives_a_motor_beyond_its_speed_is_a_counterweight():
    """At 12 rad/s downwards the line asks the load for 20 N·m, which 20/4.905 kg give, and the stall torque is 100."""
    robot = one_link({"torque_speed": [[0.0, 100.0], [10.0, 0.0]]})
    motion = PolynomialBatch(np.array([[0.0, 1e-10]]), np.array([[[[0.0, -12.0]]]]))
    found = drive_capacity(Rollout(Dynamics(robot, Payload(1.0)), motion))
    assert (found.least, found.mass) == (pytest.approx(20.0 / 4.905, rel=1e-7), pytest.approx(100.0 / 4.905, rel=1e-7))


# --- two links: the published kind of limits


@pytest.mark.parametrize(
    ("cause", "ends", "duration", "mass", "time"),
    [
        ("peak_torque", UP, 1.0, 3.3607215, 0.34114),
        ("peak_torque", UP, 0.6, 0.7835941, 0.14886),
        ("peak_torque", DOWN, 1.0, 3.3607215, 0.65886),
        ("peak_torque", DOWN, 0.6, 0.7835941, 0.45114),
        ("torque_at_speed", UP, 1.0, 2.1631074, 0.39056),
        ("torque_at_speed", UP, 0.6, 0.0749228, 0.21576),
        ("torque_at_speed", DOWN, 1.0, 3.3607215, 0.65886),
        ("torque_at_speed", DOWN, 0.6, 0.7835941, 0.45114),
    ],
)
def test_two_links_under_constant_limits_and_under_a_line(cause, ends, duration, mass, time):
    found = of(drive_capacity(point_to_point(load_robot(ARM, drives=CONSTANT), ends, duration)), cause)
    assert found.mass.argmin() == 1
    assert found.mass[1] == pytest.approx(mass, abs=1e-6)
    assert found.time[1] == pytest.approx(time, abs=1e-5)


def test_constant_peak_torques_are_effort_limits():
    motion = point_to_point(load_robot(ARM, drives=CONSTANT))
    effort = point_to_point(load_robot(ARM, limits={"effort": [120.0, 40.0]}))
    found, both = drive_capacity(motion), drive_capacity(effort)
    assert of(found, "peak_torque").mass == pytest.approx(of(both, "effort").mass, rel=1e-12)
    proven = dlcc(effort, tolerance=1e-7)
    assert both.by("effort") == pytest.approx(proven.mass, rel=2e-7)
    assert of(both, "effort").time[1] == pytest.approx(proven.time, abs=1e-5)


def test_the_text_names_what_binds():
    robot = load_robot(ARM, drives=CONSTANT)
    told = str(drive_capacity(point_to_point(robot)))
    assert "kg (rigid payload), limited by RMS torque over the cycle of elbow; made for ever; looked at" in told
    told = str(drive_capacity(point_to_point(robot), dwell=30.0))
    assert "torque at speed of elbow at 0.3906 s; made for ever, 30 s at rest after each" in told
    assert "200 instants per segment" in told


# --- mean square and heat


def test_rms_torque_with_and_without_a_hold():
    motion = point_to_point(load_robot(ARM))
    with_hold, without = (drive_load(motion, mass=1.0, dwell=dwell) for dwell in (1.0, 0.0))
    assert with_hold.rms_torque == pytest.approx([29.856508, 8.915250], abs=1e-6)
    assert without.rms_torque == pytest.approx([27.682635, 12.608068], abs=1e-6)
    assert drive_load(motion, mass=0.0, dwell=1.0).rms_torque ** 2 == pytest.approx([573.678056, 25.575637], abs=1e-6)
    assert with_hold.rms_share == pytest.approx(with_hold.rms_torque / [45.0, 12.0])


def test_the_payload_of_the_continuous_torque():
    found = drive_capacity(point_to_point(load_robot(ARM)), dwell=1.0)
    assert of(found, "rms_torque").mass == pytest.approx([3.389793, 1.796316], abs=1e-6)
    assert (found.cause, found.joint) == ("rms_torque", "elbow")
    assert np.isnan(found.time)
    share = drive_load(point_to_point(load_robot(ARM)), mass=found.mass, dwell=1.0).rms_share
    assert share[1] == pytest.approx(1.0, abs=1e-12)


def test_a_brake_takes_the_hold_from_the_motor():
    motion = point_to_point(load_robot(ARM, drives={"shoulder": {"brake": True}}))
    load = drive_load(motion, mass=1.0, dwell=1.0)
    assert load.rms_torque[0] == pytest.approx(27.682635 / np.sqrt(2.0), abs=1e-6)
    assert load.rms_torque[1] == pytest.approx(8.915250, abs=1e-6)


def steps(durations, losses):
    """A cycle of constant losses, as values at its nodes."""
    ends = np.concatenate([[0.0], np.cumsum(durations)])
    return ends, np.array([np.full(NODES, loss) for loss in losses])


def test_mean_square_of_constant_torques():
    ends, torque = steps([0.2, 0.6, 0.2], [10.0, 4.0, -7.0])
    assert np.sqrt(Cycle(ends, 1.0, None).mean(torque**2, np.array(9.0))) == pytest.approx(4.919350, abs=1e-6)
    assert np.sqrt(Cycle(ends, 0.0, None).mean(torque**2, np.array(9.0))) == pytest.approx(6.276942, abs=1e-6)


def test_periodic_heat_of_constant_losses():
    ends, losses = steps([120.0, 180.0], [2.0 * 100.0, 2.0 * 10.0])
    cycle = Cycle(ends, 0.0, None)
    rises = cycle.response(losses, np.array(0.0), 600.0)
    assert rises[[0, -1]] == pytest.approx([81.4323875] * 2, abs=1e-7)
    assert rises.max() == pytest.approx(102.9250493, abs=1e-7)
    assert cycle.looked_at[rises.argmax()] == pytest.approx(120.0)
    assert cycle.mean(losses, np.array(0.0)) == pytest.approx(92.0, abs=1e-10)
    held = Cycle(ends[:2], 180.0, None).response(losses[:1], np.array(20.0), 600.0)
    assert held.max() == pytest.approx(102.9250493, abs=1e-7)


def test_short_time_and_intermittent_duty():
    ends, losses = steps([200.0], [1.0])
    short = 1.0 / Cycle(ends, 0.0, 1).response(losses, np.array(0.0), 600.0).max()
    assert (short, np.sqrt(short)) == (pytest.approx(3.527726, abs=1e-6), pytest.approx(1.878224, abs=1e-6))
    ends, losses = steps([120.0], [1.0])
    periodic = 1.0 / Cycle(ends, 180.0, None).response(losses, np.array(0.0), 600.0).max()
    assert (periodic, np.sqrt(periodic)) == (pytest.approx(2.170635, abs=1e-6), pytest.approx(1.473307, abs=1e-6))
    many = 1.0 / Cycle(ends, 180.0, 200).response(losses, np.array(0.0), 600.0).max()
    assert many == pytest.approx(periodic, rel=1e-12)


@pytest.mark.parametrize("cycles", [1, 2, 7, None])
def test_temperatures_against_a_fine_integration(cycles):
    """τ dΔ/dt = ρ u - Δ in 20,000 steps of every cycle, and as many cycles as a steady state takes."""
    robot = load_robot(ARM, drives={name: {"thermal_time_constant": 3.0} for name in ("shoulder", "elbow")})
    motion = point_to_point(robot, mass=1.5)
    load = drive_load(motion, dwell=0.7, cycles=cycles)
    simulated = Simulated(robot, motion.trajectory, 20_000)
    for joint in range(2):
        rises = simulated.rises(joint, 1.5, 0.7, cycles)
        assert load.peak_rise[joint] == pytest.approx(rises.max(), rel=1e-6)
    if cycles is None:
        scale = [robot.drives[name].rise_per_square for name in robot.joint_names]
        assert load.mean_rise == pytest.approx(scale * load.rms_torque**2, rel=1e-12)
    else:
        assert np.isnan(load.mean_rise).all()


def test_the_payload_of_the_temperature_reaches_it():
    robot = load_robot(ARM, drives={name: {"thermal_time_constant": 0.4} for name in ("shoulder", "elbow")})
    for cycles in (1, 3, None):
        motion = point_to_point(robot)
        found = of(drive_capacity(motion, dwell=0.2, cycles=cycles), "temperature")
        for joint, (mass, time) in enumerate(zip(found.mass, found.time, strict=True)):
            simulated = Simulated(robot, motion.trajectory, 20_000)
            rises = simulated.rises(joint, mass, 0.2, cycles)
            assert rises.max() == pytest.approx(80.0, rel=1e-6)
            assert time == pytest.approx(rises.argmax() / 20_000, abs=1e-3)


# --- losses of the gear


def there_and_back(robot, mass=1.0):
    """A motion on which both joints turn round, each at another instant."""
    coefficients = np.zeros((1, 1, 2, 5))
    coefficients[0, 0] = [[-1.0, 3.0, -2.0, -1.0, 0.0], [0.5, -2.0, 1.0, 4.0, -3.0]]
    return Rollout(Dynamics(robot, Payload(mass)), PolynomialBatch(np.array([[0.0, 1.0]]), coefficients))


def lossy(**more):
    each = {"efficiency_driving": 0.75, "rotor_inertia": "0.6 kg*cm^2", **more}
    return load_robot(ARM, drives={"shoulder": each, "elbow": {**each, "efficiency_driven": 0.4}})


def test_losses_and_rotors_count_on_the_side_on_which_they_are():
    """Mean squares by 60 nodes of Gauss between all the jumps and bends, of torques by hand."""
    robot, mass = lossy(), 1.3
    motion = there_and_back(robot)
    load = drive_load(motion, mass=mass, dwell=0.5)
    assert robot.friction.armature == pytest.approx([0.6, 0.6])
    bare = Dynamics(load_robot(ARM), Payload(mass))
    for joint, driven in enumerate([0.75, 0.4]):

        def behind(t, joint=joint):
            q, v, a = (motion.trajectory.evaluate(np.atleast_1d(t), order) for order in range(3))
            return np.stack([bare.effort(q, v, a)[0, :, joint], v[0, :, joint], a[0, :, joint]])

        grid = np.linspace(0.0, 1.0, 4001)
        ways = np.sign(behind(grid)[:2])
        found = [root_of(behind, which, grid[k : k + 2]) for which, k in np.argwhere(ways[:, :-1] * ways[:, 1:] < 0.0)]
        points = np.unique([0.0, *found, 1.0])
        assert len(points) > 3
        nodes, weights = np.polynomial.legendre.leggauss(60)
        moving = 0.0
        for begin, end in pairwise(points):
            torque, v, a = behind(0.5 * (begin + end) + 0.5 * (end - begin) * nodes)
            motor = 0.6 * a + np.where(torque * v > 0.0, torque / 0.75, torque * driven)
            moving += 0.5 * (end - begin) * (weights * motor**2).sum()
        end = motion.trajectory.evaluate(np.ones(1))
        held = bare.effort(end, 0.0 * end, 0.0 * end)[0, 0, joint]
        assert load.rms_torque[joint] == pytest.approx(np.sqrt((moving + 0.5 * held**2) / 1.5), rel=1e-9)


def root_of(behind, which, ends):
    low, high = ends
    sign = np.sign(behind(low)[which, 0])
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if sign * behind(middle)[which, 0] > 0.0 else (low, middle)
    return low


@pytest.mark.parametrize("dwell", [0.0, 0.5])
def test_capacities_with_losses_are_where_the_motion_reaches_the_limit(dwell):
    robot = lossy(continuous_torque=39.0, peak_torque=120.0, thermal_time_constant=1.0)
    motion = there_and_back(robot)
    found = drive_capacity(motion, dwell=dwell)
    # Shares of torques are those at evenly spaced instants, between which a torque may be a little greater.
    shares = {
        "rms_torque": ("rms_share", 1e-9),
        "temperature": ("rise_share", 1e-9),
        "peak_torque": ("peak_share", 1e-4),
    }
    for joint in range(2):
        for cause, (share, near) in shares.items():
            mass = of(found, cause).mass[joint]
            assert np.isfinite(mass)
            reached = getattr(drive_load(motion, mass=mass, dwell=dwell), share)[joint]
            assert reached == pytest.approx(1.0, abs=near), cause


def test_a_gear_that_locks_itself_rests_while_the_load_drives():
    robot = one_link({"efficiency_driving": 0.5, "efficiency_driven": 0.0, "peak_torque": 50.0})
    down = PolynomialBatch(np.array([[0.0, 1e-10]]), np.array([[[[0.0, -2.0]]]]))
    found = drive_capacity(Rollout(Dynamics(robot, Payload(1.0)), down))
    assert np.isinf(found.mass)
    assert str(found).startswith("unlimited: no drive limits a rigid payload")
    up = PolynomialBatch(np.array([[0.0, 1e-10]]), np.array([[[[0.0, 2.0]]]]))
    assert drive_capacity(Rollout(Dynamics(robot, Payload(1.0)), up)).mass == pytest.approx(25.0 / 4.905, rel=1e-8)


# --- random arms against a simulation


def random_case(seed):
    """A random arm with drives that a random payload nearly, or just, or not at all, lets pass, on a random motion."""
    rng = np.random.default_rng(seed)
    text = random_urdf(rng, int(rng.integers(2, 7)))
    bare = with_drives(text, None)
    segments = int(rng.integers(1, 4))
    breaks = np.concatenate([[0.0], np.cumsum(rng.uniform(0.3, 1.5, segments))])[None]
    coefficients = rng.normal(scale=0.7, size=(1, segments, bare.dof, 5))
    trajectory = PolynomialBatch(breaks, coefficients)
    gears = seed % 3 == 2
    drives = {}
    for name in bare.joint_names:
        drives[name] = {
            "peak_torque": 1e6,
            "torque_speed": [[0.0, 1e6], [float(rng.uniform(2.0, 6.0)) * trajectory.peak(1).max(), 0.0]],
            "gear_ratio": 100.0,
            "winding_resistance": 0.5,
            "torque_constant": 0.1,
            "thermal_resistance": 2.0,
            "thermal_time_constant": float(trajectory.duration[0] * rng.uniform(0.3, 5.0)),
            "brake": bool(rng.random() < 0.3),
        }
        if gears:
            drives[name] |= {"efficiency_driving": float(rng.uniform(0.5, 1.0)), "rotor_inertia": 1e-5}
    dwell = float(rng.choice([0.0, rng.uniform(0.1, 2.0)]))
    cycles = [None, 1, int(rng.integers(2, 6))][int(rng.integers(3))]
    sized = Simulated(with_drives(text, drives), trajectory, 50)
    mass = float(rng.uniform(0.3, 6.0))
    for joint, name in enumerate(bare.joint_names):
        room = rng.uniform(0.8, 1.5, 4)
        drive = drives[name]
        torque = np.abs(sized.torque(joint, mass)).max() + 1e-3
        drive["peak_torque"] = torque * room[0]
        drive["torque_speed"][0][1] = 1.3 * torque * room[1]
        drive["continuous_torque"] = min(
            (sized.rms(joint, mass, dwell) + 1e-3) * room[2], drive["peak_torque"], drive["torque_speed"][0][1]
        )
        drive["greatest_rise"] = (sized.rises(joint, mass, dwell, cycles).max() + 1e-6) * room[3]
    return with_drives(text, drives), trajectory, dwell, cycles, gears


RANDOM_CAUSES = ("peak_torque", "torque_at_speed", "rms_torque", "temperature")


def levels(simulated, joint, dwell, cycles):
    """What each cause takes of its limit, by the mass of the payload."""
    drive = simulated.robot.drives[simulated.robot.joint_names[joint]]
    return {
        "peak_torque": lambda mass: simulated.peak(joint, mass),
        "torque_at_speed": lambda mass: simulated.speed(joint, mass),
        "rms_torque": lambda mass: simulated.rms(joint, mass, dwell) / drive.continuous_torque,
        "temperature": lambda mass: simulated.rises(joint, mass, dwell, cycles).max() / drive.greatest_rise,
    }


def disagreement(found, simulated, joint, cause, near):
    """Why the masses of a joint by one cause are not those of a bisection that simulates; empty if they are."""
    least, mass = of(found, cause).least[joint], of(found, cause).mass[joint]
    level = levels(simulated, joint, found.dwell, found.cycles)[cause]
    if mass < least:
        return "" if min(level(m) for m in (0.0, 0.5, 2.0, 8.0)) > 1.0 - near else "some payload is carried"
    if mass > 1e3:
        return "" if level(1e3) <= 1.0 else "1000 kg are not carried"
    far = last_kept(level, 0.5 * (least + mass), 2.0 * mass + 1.0, halvings=24)
    return "" if far == pytest.approx(mass, rel=near, abs=near) else f"{far} instead of {mass} kg"


@pytest.mark.parametrize(("first", "end"), mostly_long([(0, 9), (9, 40), (40, 460), (460, 1000)], (0, 9), several=True))
def test_capacities_agree_with_a_bisection_that_simulates(first, end):
    """Every cause of every joint; where steps are too coarse for a motion, or for its jumps, in finer ones."""
    compared = 0
    for seed in range(first, end):
        robot, trajectory, dwell, cycles, gears = random_case(seed)
        found = drive_capacity(Rollout(Dynamics(robot, Payload(1.0)), trajectory), dwell=dwell, cycles=cycles)
        left = [(joint, cause) for joint in range(robot.dof) for cause in RANDOM_CAUSES]
        compared += len(left)
        for steps in (2000, 16_000, 128_000):
            simulated = Simulated(robot, trajectory, steps)
            said = [disagreement(found, simulated, *each, 1e-3 if gears else 5e-5) for each in left]
            left = [each for each, why in zip(left, said, strict=True) if why]
            if not left:
                break
        assert not left, (seed, left, said)
    assert compared > 10 * (end - first)


# --- what it does not take


def test_other_arguments_are_refused_with_a_sentence():
    motion = point_to_point(load_robot(ARM))
    bare = load_robot("tests/data/rods.urdf", limits={"acceleration": 1.0, "jerk": 1.0})
    with pytest.raises(
        InvalidInputError, match=r"robot 'rods' has no drives: give them in robot.toml \(\[drives.q1\]\)"
    ):
        drive_capacity(point_to_point(bare))
    for dwell in (-1.0, np.nan, "5", True, None, 10**400):
        with pytest.raises(InvalidInputError, match="dwell: expected a time from 0 on"):
            drive_capacity(motion, dwell=dwell)
    with pytest.raises(InvalidInputError, match=r"dwell: expected at most 1e\+09 s, got 1e\+308"):
        drive_capacity(motion, dwell=1e308)
    for cycles in (0, 1.5, True):
        with pytest.raises(InvalidInputError, match="cycles: expected a whole number from 1 on, or None for ever"):
            drive_capacity(motion, cycles=cycles)
    with pytest.raises(InvalidInputError, match="cycles: expected at most 1000000000, or None for ever, got 1000"):
        drive_capacity(motion, cycles=10**400)
    with pytest.raises(InvalidInputError, match="samples: expected a whole number of at most 1000000, got 1000"):
        drive_capacity(motion, samples=10**400)
    with pytest.raises(InvalidInputError, match="mass: expected a payload from 0 on"):
        drive_load(motion, mass=-1.0)
    with pytest.raises(InvalidInputError, match="motion: expected a solution"):
        drive_load(5)
    quick = load_robot(ARM, drives={"elbow": {"thermal_time_constant": 1e-5}})
    with pytest.raises(InvalidInputError, match="thermal_time_constant: 1e-05 s is too short for a motion of 1 s"):
        drive_capacity(point_to_point(quick))


def test_what_is_not_known_is_told():
    limits = {"acceleration": 1.0, "jerk": 1.0}
    robot = load_robot("tests/data/rods.urdf", limits=limits, drives={"q1": Drive(greatest_rise=80.0)})
    found = drive_capacity(point_to_point(robot))
    assert str(found).endswith(
        "not covered: temperature of q1, for want of gear_ratio, winding_resistance, torque_constant, "
        "thermal_resistance, thermal_time_constant"
    )
    assert not of(found, "temperature").known.any()
    assert np.isnan(drive_load(point_to_point(robot)).peak_rise).all()
