"""What drives draw from the mains: own benchmarks, a simulation in fine steps, and SciPy on random arms."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad_vec
from scipy.optimize import brentq

from tests.capacity.simulated_drives import with_drives
from tests.capacity.test_drive_capacity import ARM, DOWN, UP, point_to_point
from tests.helpers import mostly_long, refused
from tests.random_robots import random_urdf
from trajevo import (
    Drive,
    Dynamics,
    Load,
    Passing,
    Payload,
    PolynomialBatch,
    QuinticSpline,
    Rollout,
    Supply,
    ViaPointProblem,
    ViaPoints,
    energy_balance,
    load_robot,
)
from trajevo.dynamics.drives.electrical import Motoring, electrical_energy

GEARS = {"shoulder": {"efficiency_driving": 0.75}, "elbow": {"efficiency_driving": 0.7}}
LINK = {"link_capacitance": "470 uF", "link_voltage": "565.685 V", "chopper_voltage": "720 V"}


def two_links(ends, recuperation="shared", **supply):
    robot = load_robot(ARM, drives=GEARS, supply={"recuperation": recuperation, **supply})
    return point_to_point(robot, ends, mass=1.5)


# --- one instant, two links: numbers known beforehand


@pytest.mark.parametrize(
    ("speed", "torque", "current", "copper", "power"),
    [(2.0, 0.660066, 4.889378, 11.953008, 145.286341), (-2.0, 0.371287, 2.750275, 3.782006, -71.217994)],
)
def test_one_motor_at_one_instant(speed, torque, current, copper, power):
    drive = {"gear_ratio": 101, "torque_constant": 0.135, "efficiency_driving": 0.75, "winding_resistance": 0.5}
    robot = load_robot("tests/data/two_link_drives", drives={"shoulder": drive})
    still = Rollout(Dynamics(robot), PolynomialBatch(np.array([[0.0, 1.0]]), np.zeros((1, 1, 2, 1))))
    motoring = Motoring.of(still)
    v, effort = np.array([speed, 0.0]), np.array([50.0, 0.0])
    found = motoring.powers(v, effort, np.zeros(2), np.sign(v))
    borne = motoring.torque(effort, np.sign(v), np.zeros(2))[0] / 101.0
    assert borne == pytest.approx(torque, abs=1e-6)
    assert borne / 0.135 == pytest.approx(current, abs=1e-6)
    assert found.copper[0] == pytest.approx(copper, abs=1e-6)
    assert motoring.drawn(v, effort, np.zeros(2), np.sign(v))[0] == pytest.approx(power, abs=1e-6)
    assert found.mechanical[0] == pytest.approx(50.0 * speed)
    assert found.gear[0] == pytest.approx(power - copper - 50.0 * speed, abs=1e-6)


@pytest.mark.parametrize(
    ("ends", "shaft", "copper", "levels", "peak", "least"),
    [
        (UP, (56.683042, 31.508829), (3.914923, 3.677598), (96.834275, 95.784392, 95.784392), 264.985, 0.0),
        (DOWN, (-31.884211, -13.729100), (1.238710, 1.090694), (2.497878, 1.229802, -43.283907), 9.598, -127.853),
    ],
)
def test_two_links_up_and_down(ends, shaft, copper, levels, peak, least):
    """The numbers were summed over samples, both ends included, which is off by up to 4e-6 J."""
    for recuperation, expected in zip(("none", "shared", "full"), levels, strict=True):
        motion = two_links(ends, recuperation)
        found = energy_balance(motion)
        assert found.energy == pytest.approx(expected, abs=6e-6)
        assert electrical_energy(motion)[0] == pytest.approx(found.energy, rel=1e-13)
        assert found.copper == pytest.approx(copper, abs=6e-6)
        assert found.mechanical + found.gear == pytest.approx(shaft, abs=2e-6)
        assert (found.peak_power, found.least_power) == (pytest.approx(peak, abs=1e-3), pytest.approx(least, abs=1e-3))


def test_what_lifts_the_arm_is_its_potential_energy():
    found = energy_balance(two_links(UP))
    assert found.mechanical == pytest.approx([42.512282, 21.252718], abs=1e-6)
    assert found.mechanical.sum() == pytest.approx(9.81 * (5 * 0.25 + 3 * 0.75 + 1.5 * 1.0 + 1.5), rel=1e-7)


def test_the_levels_are_ordered_and_what_is_drawn_goes_somewhere():
    for ends in (UP, DOWN):
        found = {way: energy_balance(two_links(ends, way)) for way in ("none", "shared", "full")}
        assert found["none"].energy >= found["shared"].energy >= found["full"].energy
        for one in found.values():
            assert one.energy == pytest.approx(one.used.sum() + one.burnt + one.stored + one.standby, rel=1e-12)
            assert one.drawn.sum() - one.given_back.sum() == pytest.approx(one.used.sum(), rel=1e-10)
            assert one.recuperated >= -1e-12
        assert found["full"].burnt == 0.0
        assert found["shared"].burnt == pytest.approx(found["full"].fed_back, rel=1e-12)
        assert found["none"].burnt == pytest.approx(found["none"].given_back.sum(), rel=1e-12)


# --- the link


def test_what_a_link_stores_before_the_resistor_burns_the_rest():
    supply = Supply(link_capacitance=470e-6, link_voltage=400.0 * 2.0**0.5, chopper_voltage=720.0)
    assert supply.storable == pytest.approx(46.624, abs=1e-6)
    assert supply.burnt_of(60.0) == pytest.approx(13.376, abs=1e-6)
    assert supply.voltage_with(30.0) == pytest.approx(669.0737, abs=1e-4)
    assert supply.burnt_of(30.0) == 0.0
    assert supply.voltage_with(60.0) == pytest.approx(720.0)


def test_capacitors_take_what_is_given_back_first_and_drive_with_it_later():
    down = energy_balance(two_links(DOWN, **LINK))
    assert down.burnt == 0.0
    assert down.stored == pytest.approx(two_links_given_back(DOWN), abs=1e-6)
    small = energy_balance(two_links(DOWN, **{**LINK, "link_capacitance": "100 uF"}))
    assert small.stored == pytest.approx(0.5 * 100e-6 * (720.0**2 - 565.685**2), rel=1e-4)  # a little drives at the end
    assert small.burnt == pytest.approx(down.stored - small.stored, rel=1e-9)
    # Down and up again: the link drives the motors with what it has, until it is empty.
    there = both_ways({})
    back = both_ways({**LINK, "link_capacitance": "2000 uF"})
    assert back.energy == pytest.approx(there.energy - there.burnt, rel=1e-9)
    assert (back.burnt, back.stored) == (0.0, pytest.approx(0.0, abs=1e-12))
    assert back.recuperated == pytest.approx(back.given_back.sum(), rel=1e-9)


def two_links_given_back(ends):
    """What comes into the link, less what it drives the motors with again [J]."""
    without, with_link = energy_balance(two_links(ends)), energy_balance(two_links(ends, **LINK))
    return without.burnt - (without.energy - with_link.energy)


def both_ways(supply):
    """Down, then up again, two segments."""
    down, up = (point_to_point(load_robot(ARM), ends).trajectory for ends in (DOWN, UP))
    batch = PolynomialBatch(np.array([[0.0, 1.0, 2.0]]), np.concatenate([down.coefficients, up.coefficients], axis=1))
    robot = load_robot(ARM, drives=GEARS, supply=supply)
    return energy_balance(Rollout(Dynamics(robot, Payload(1.5)), batch))


@pytest.mark.thinned(2)
@pytest.mark.parametrize("capacitance", ["50 uF", "300 uF", "2000 uF"])
def test_a_link_step_by_step(capacitance):
    supply = {**LINK, "link_capacitance": capacitance}
    motion = arm_with_everything(23, "shared", supply)
    found, storable = energy_balance(motion), motion.robot.supply.storable
    stored = drawn = burnt = 0.0
    for begin, end in zip(motion.trajectory.breaks[0][:-1], motion.trajectory.breaks[0][1:], strict=True):
        step = (end - begin) / 40_000
        for power in powers_at(motion, begin + step * (np.arange(40_000) + 0.5)).sum(axis=1):
            stored -= power * step
            drawn, stored = drawn + max(-stored, 0.0), max(stored, 0.0)
            burnt, stored = burnt + max(stored - storable, 0.0), min(stored, storable)
    assert found.burnt + found.stored > 1.0
    assert (found.energy, found.burnt, found.stored) == pytest.approx((drawn, burnt, stored), rel=2e-5, abs=1e-3)


# --- other opinions


def powers_at(motion, times):
    """What each motor draws, by the formulas as they are written, shape (K, n_joints)."""
    robot = motion.robot
    q, v, a = (motion.trajectory.evaluate(times[None], order) for order in range(3))
    segments = motion.segments_at(times)[0]
    effort = motion.dynamics.effort(q, v, a, segments, axis=1)[0]
    rotor, v = robot.friction.armature * a[0], v[0]
    power = np.empty_like(v)
    for k, name in enumerate(robot.joint_names):
        drive, load = robot.drives[name], effort[:, k] - rotor[:, k]
        driving, driven = drive.efficiencies
        behind = np.where(load * v[:, k] > 0.0, load / driving, load * driven)
        torque = rotor[:, k] + np.where(np.abs(v[:, k]) < 1e-12, load, behind)
        current = torque / (drive.gear_ratio * drive.torque_constant)
        lost = drive.winding_resistance * current**2 + (drive.inverter_drop or 0.0) * np.abs(current)
        power[:, k] = torque * v[:, k] + lost
    return power


def test_fine_steps_agree_to_a_millionth():
    for ends in (UP, DOWN):
        motion = two_links(ends, "none")
        times = (np.arange(400_000) + 0.5) / 400_000
        power = np.concatenate([powers_at(motion, part) for part in np.array_split(times, 8)]) / 400_000
        assert energy_balance(motion).energy == pytest.approx(np.maximum(power, 0.0).sum(), rel=1e-6)
        for way, total in (("shared", np.maximum(power.sum(axis=1), 0.0).sum()), ("full", power.sum())):
            assert energy_balance(two_links(ends, way)).energy == pytest.approx(total, rel=1e-6)


def arm_with_everything(seed, recuperation, supply=None):
    """A random arm with losses, friction, rotors and inverters on a random motion of several segments."""
    rng = np.random.default_rng(seed)
    text = random_urdf(rng, int(rng.integers(2, 6)))
    bare = with_drives(text, None)
    segments = int(rng.integers(1, 4))
    breaks = np.concatenate([[0.0], np.cumsum(rng.uniform(0.3, 1.5, segments))])[None]
    trajectory = PolynomialBatch(breaks, rng.normal(scale=0.7, size=(1, segments, bare.dof, 5)))
    drives, rotors = {}, seed % 2 == 1
    for name in bare.joint_names:
        driving = float(rng.uniform(0.6, 1.0))
        drives[name] = Drive(
            gear_ratio=100.0,
            winding_resistance=float(rng.uniform(0.2, 2.0)),
            torque_constant=float(rng.uniform(0.05, 0.2)),
            efficiency_driving=driving,
            efficiency_driven=max(2.0 - 1.0 / driving, 0.0) if seed % 3 else None,
            rotor_inertia=float(rng.uniform(0.2e-5, 2e-5)) if rotors else None,
            inverter_drop=1.5 if seed % 4 == 1 else None,
        )
    limits = {"velocity": np.inf, "acceleration": np.inf, "jerk": np.inf, "effort": np.inf}
    friction = {"viscous": 0.5, "coulomb": 0.0 if seed % 5 == 0 else 1.0}
    supply = supply or {"recuperation": recuperation}
    robot = load_robot("random", urdf=text, limits=limits, drives=drives, friction=friction, supply=supply)
    return Rollout(Dynamics(robot, Payload(float(rng.uniform(0.0, 3.0)))), trajectory)


def by_quadrature(motion):
    """Energy by per-joint clipping, at one link, and on balance, by adaptive quadrature between all bends [J]."""
    total = np.zeros(3)
    for begin, end in zip(motion.trajectory.breaks[0][:-1], motion.trajectory.breaks[0][1:], strict=True):
        inner = np.linspace(begin, end, 1501)[1:-1]

        def functions(times):
            v, a = (motion.trajectory.evaluate(np.atleast_1d(times)[None], order)[0] for order in (1, 2))
            power = powers_at(motion, np.atleast_1d(times))
            # Where torques jump, powers do; their signs are those of the load where joints move.
            return np.concatenate([v, power, power.sum(axis=1, keepdims=True), a], axis=1)

        seen = functions(inner)
        cuts = [begin, end]
        for k in range(seen.shape[1]):
            for i in np.flatnonzero(seen[:-1, k] * seen[1:, k] < 0.0):
                cuts.append(brentq(lambda t, k=k: functions(t)[0, k], inner[i], inner[i + 1], xtol=1e-15))
        cuts = np.unique(cuts)

        def levels(t):
            power = powers_at(motion, np.array([t]))[0]
            return np.array([np.maximum(power, 0.0).sum(), max(power.sum(), 0.0), power.sum()])

        for low, high in pairwise(cuts.tolist()):
            if high - low > 1e-13:
                total += quad_vec(levels, low, high, epsrel=1e-10, epsabs=1e-11)[0]
    return total


@pytest.mark.parametrize("seed", mostly_long(range(40), 21))
def test_random_arms_agree_with_quadrature(seed):
    expected = by_quadrature(arm_with_everything(seed, "full"))
    scale = expected[0]
    for way, amount in zip(("none", "shared", "full"), expected, strict=True):
        motion = arm_with_everything(seed, way)
        assert electrical_energy(motion)[0] == pytest.approx(amount, rel=1e-6, abs=1e-7 * scale)
        assert energy_balance(motion).energy == pytest.approx(amount, rel=1e-6, abs=1e-7 * scale)


# --- at rest, brakes, standby


def test_a_dwell_costs_standby_and_holding_unless_a_brake_holds():
    motion = two_links(UP, standby_power="90 W")
    found, moving = energy_balance(motion, dwell=2.0), energy_balance(motion)
    assert moving.energy == pytest.approx(energy_balance(two_links(UP)).energy + 90.0)
    end = np.array([[[0.0, np.pi / 2.0]]])
    torque = motion.dynamics.effort(end, np.zeros_like(end), np.zeros_like(end))[0, 0]
    expected = np.array([0.5, 0.8]) * (torque / (100.0 * np.array([0.15, 0.1]))) ** 2 * 2.0
    assert found.held == pytest.approx(expected, rel=1e-9)
    assert found.standby == pytest.approx(90.0 * 3.0)
    assert found.energy == pytest.approx(moving.energy + 180.0 + expected.sum(), rel=1e-9)
    drives = {name: {**GEARS[name], "brake": True} for name in GEARS}
    braked = point_to_point(load_robot(ARM, drives=drives, supply={"standby_power": 90.0}), UP, mass=1.5)
    assert energy_balance(braked, dwell=2.0).held.tolist() == [0.0, 0.0]


def test_an_arm_that_stands_still_draws_what_holding_takes():
    robot = load_robot(ARM, drives=GEARS)
    coefficients = np.zeros((1, 1, 2, 6))
    coefficients[0, 0, 0, 0] = 0.3
    still = Rollout(Dynamics(robot, Payload(1.5)), PolynomialBatch(np.array([[0.0, 2.0]]), coefficients))
    found = energy_balance(still, dwell=2.0)
    assert found.copper == pytest.approx(found.held, rel=1e-12)
    assert found.gear.tolist() == [0.0, 0.0]


def test_loads_that_are_taken_up_and_put_down_count_while_they_are_carried():
    """Held at the end is the gripper alone."""
    part, gripper = Load(Payload(3.0, (0.0, 0.0, 0.1)), from_point=1, to_point=2), Payload(1.0, (0.0, 0.0, 0.05))
    points = [*POINTS, [0.4, -1.2, 1.4, -1.7, -1.57, 0.0]]
    given = {"points": points, "passing": (Passing(1, dwell=0.3), Passing(2, dwell=0.3)), "duration_bounds": (0.4, 3.0)}
    given |= {"objectives": ("time", "electrical_energy"), "constraints": ("position", "velocity"), "robot": ur5()}
    problem, light = (ViaPointProblem(payload=payload, **given) for payload in ([gripper, part], gripper))
    x = np.where(np.arange(problem.n_var) < 3, 0.8, 0.5 * (problem.xl + problem.xu))[None]
    motion = problem.rollout(x)
    found, empty = energy_balance(motion, dwell=1.0), energy_balance(light.rollout(x), dwell=1.0)
    assert found.held == pytest.approx(empty.held, rel=1e-9)
    assert found.copper.sum() > 1.2 * empty.copper.sum()
    total = 0.0
    for begin, end in pairwise(motion.trajectory.breaks[0]):
        times = begin + (end - begin) * (np.arange(20_000) + 0.5) / 20_000
        total += np.maximum(powers_at(motion, times).sum(axis=1), 0.0).mean() * (end - begin)
    assert energy_balance(motion).energy == pytest.approx(total, rel=1e-5)


# --- as an objective


def ur5(recuperation="shared", **more):
    constants = [0.1350, 0.1361, 0.1355, 0.0957, 0.0865, 0.0893]
    given = {"limits": {"acceleration": np.inf, "jerk": np.inf}, "tool": "tool0", **more}
    names = load_robot("ur5", **given).joint_names
    drives = {
        name: Drive(gear_ratio=101.0, efficiency_driving=0.75, torque_constant=constant, winding_resistance=0.5)
        for name, constant in zip(names, constants, strict=True)
    }
    return load_robot("ur5", **given, drives=drives, supply={"recuperation": recuperation})


POINTS = [[0.0, -1.2, 1.4, -1.7, -1.57, 0.0], [1.0, -0.9, 1.2, -1.9, -1.2, 0.8], [2.0, -1.3, 1.6, -1.8, -1.57, 0.0]]


@pytest.mark.parametrize("way", ["none", "shared", "full", "link"])
def test_rows_of_a_population_do_not_depend_on_each_other_to_the_bit(way):
    robot = ur5("shared" if way == "link" else way, friction={"viscous": 1.0, "coulomb": 3.0})
    if way == "link":
        robot = load_robot(**{**robot.settings, "supply": {**LINK, "link_capacitance": "2000 uF"}})
    spline, dynamics = (
        QuinticSpline(ViaPoints(np.array(POINTS)), duration_bounds=(0.3, 5.0)),
        Dynamics(robot, Payload(3)),
    )
    x = np.random.default_rng(1).uniform(0.4, 2.0, (40, len(spline.variables)))
    together = electrical_energy(Rollout(dynamics, spline(x)))
    for rows in ([7], [3, 30], list(range(39, -1, -1))):
        assert (electrical_energy(Rollout(dynamics, spline(x[rows]))) == together[rows]).all()


@pytest.mark.parametrize("way", ["none", "shared", "full"])
def test_complex_steps_are_its_derivatives(way):
    robot = ur5(way, friction={"viscous": 1.0, "coulomb": 3.0, "armature": 1.0})
    spline, dynamics = (
        QuinticSpline(ViaPoints(np.array(POINTS)), duration_bounds=(0.3, 5.0)),
        Dynamics(robot, Payload(3)),
    )
    x = np.random.default_rng(2).uniform(0.4, 2.0, (6, len(spline.variables)))
    for k in range(x.shape[1]):
        step = np.eye(x.shape[1])[k]
        exact = electrical_energy(Rollout(dynamics, spline(x + 1e-20j * step))).imag / 1e-20
        above, below = (electrical_energy(Rollout(dynamics, spline(x + s * 1e-5 * step))) for s in (1.0, -1.0))
        assert exact == pytest.approx((above - below) / 2e-5, rel=1e-5, abs=1e-4)


def test_it_is_an_objective_of_problems_with_drives():
    given = {"objectives": ("time", "electrical_energy"), "points": POINTS, "duration_bounds": (0.3, 5.0)}
    problem = ViaPointProblem(robot=ur5(), constraints=("position", "velocity"), **given)
    x = 0.5 * (problem.xl + problem.xu)
    values = problem.evaluate(x[None], return_values_of=["F"])
    assert values[0, 1] == pytest.approx(electrical_energy(problem.rollout(x[None]))[0], rel=1e-12)
    bare = load_robot("ur5", limits={"acceleration": np.inf, "jerk": np.inf}, tool="tool0")
    refused(
        lambda: ViaPointProblem(robot=bare, constraints=("position",), **given),
        r"objectives: electrical_energy needs the drives of all joints of robot 'ur5', but shoulder_pan_joint lacks "
        r"gear_ratio, winding_resistance, torque_constant; .*load_robot\(..., drives=\{...\}\)\)",
    )


# --- texts and what it does not take


def test_the_text_says_where_the_energy_goes():
    told = str(energy_balance(two_links(DOWN, standby_power=20.0)))
    assert told.startswith(
        "21.2298 J from the mains for 1 s of motion with 1.5 kg (a link is shared): links and payload"
    )
    assert "gears 18.15 J, windings 2.329 J, standby 20 J, burnt in resistors 44.51 J; 9.598 W at 0.2135 s to" in told
    assert "friction" not in told
    shown = energy_balance(two_links(UP))._repr_html_()
    assert "windings [J]" in shown
    assert shown.count("<svg") == 2


def test_other_arguments_are_refused_with_a_sentence():
    refused(lambda: energy_balance(two_links(UP), dwell=-1.0), r"dwell: expected a time from 0 on \[s\], got -1.0")
    refused(lambda: energy_balance(5), "motion: expected a solution")
    robot = load_robot("tests/data/rods.urdf", limits={"acceleration": 1.0, "jerk": 1.0}, drives={"q1": Drive()})
    refused(
        lambda: energy_balance(point_to_point(robot)),
        "electrical energy needs the drives of all joints of robot 'rods', but q1 lacks gear_ratio, "
        "winding_resistance, torque_constant; q2 lacks",
    )
