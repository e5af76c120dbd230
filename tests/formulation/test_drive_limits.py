"""Limits of drives in problems: torque at speed, RMS torque, temperatures and power."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.helpers import mostly_long
from trajevo import (
    Payload,
    PolynomialBatch,
    Robot,
    Rollout,
    ViaPointProblem,
    certify,
    drive_load,
    load_robot,
    optimise,
)
from trajevo.dynamics.drives.duty import Duty
from trajevo.dynamics.drives.heat import greatest_rises, rms_torques
from trajevo.dynamics.drives.power import greatest_supply_power
from trajevo.dynamics.drives.torque_limits import TorqueLimits
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.errors import InvalidInputError, UnknownNameError

ARM = "tests/data/two_link_drives"
FREE = {"acceleration": np.inf, "jerk": np.inf}
LOSSY = {"efficiency_driving": 0.75, "efficiency_driven": 0.6}
POINTS = [[-1.2, 0.1], [-0.2, 0.9], [0.4, -0.4], [-0.9, 0.3]]
ALL = ("torque_at_speed", "rms_torque", "winding_temperature")


def arm(**more):
    """The arm of two links, every drive with something more."""
    return load_robot(ARM, drives=dict.fromkeys(("shoulder", "elbow"), more) if more else None)


def problem(robot=None, **arguments):
    given = {"objectives": ("time",), "constraints": ALL, "duration_bounds": (0.2, 3.0), "payload": 1.0}
    return ViaPointProblem(**{"robot": robot or arm(**LOSSY), "points": POINTS} | given | arguments)


def drawn(of, count=24):
    return np.random.default_rng(3).uniform(of.xl, of.xu, (count, of.n_var))


def upward(robot, mass, duration=1.0):
    """From hanging down to reaching out, by 10 s³ - 15 s⁴ + 6 s⁵."""
    begin, end = np.array([-np.pi / 2.0, 0.0]), np.array([0.0, np.pi / 2.0])
    coefficients = np.zeros((1, 1, 2, 6))
    coefficients[0, 0, :, 0] = begin
    for power, factor in ((3, 10.0), (4, -15.0), (5, 6.0)):
        coefficients[0, 0, :, power] = (end - begin) * factor / duration**power
    return Rollout(Dynamics(robot, Payload(mass)), PolynomialBatch(np.array([[0.0, duration]]), coefficients))


def by_hand(rollout, robot, count=40_001):
    """1 plus the excess of every motor, its torque and its velocity, at evenly spaced instants of one motion."""
    t = np.linspace(0.0, float(rollout.trajectory.duration[0]), count)[1:-1]
    q, v, a = (rollout.trajectory.evaluate(t[None], order) for order in range(3))
    effort, shares, torques = rollout.effort_in(q, v, a, t)[0], [], []
    for k, name in enumerate(robot.joint_names):
        drive, speed = robot.drives[name], v[0, :, k]
        rotor = robot.friction.armature[k] * a[0, :, k]
        load = effort[:, k] - rotor
        driving, driven = drive.efficiencies
        torque = rotor + np.where(load * speed > 0.0, load / driving, load * driven)
        torques.append(torque)
        points = np.array(drive.torque_speed)
        peak = drive.peak_torque or np.inf
        line = np.interp(np.abs(speed), *points.T)
        if points[-1, 1] == 0.0:
            slope = (points[-1, 1] - points[-2, 1]) / (points[-1, 0] - points[-2, 0])
            line = np.where(np.abs(speed) > points[-1, 0], slope * (np.abs(speed) - points[-1, 0]), line)
        most = min(peak, points[0, 1])
        forward = np.where(speed > 0.0, np.minimum(line, peak), most)
        backward = np.where(speed < 0.0, np.minimum(line, peak), most)
        excess = np.maximum(torque - forward, -torque - backward) / most
        if points[-1, 1] > 0.0:
            excess = np.maximum(excess, np.abs(speed) / points[-1, 0] - 1.0)
        shares.append(1.0 + excess.max())
    return np.array(shares), np.array(torques), v[0].T, t


# --- torque at speed


@pytest.mark.parametrize(("duration", "mass"), [(1.0, 2.1631074), (0.6, 0.0749228)])
def test_the_known_capacity_of_two_links_uses_the_whole_limit(duration, mass):
    rows = certify(upward(arm(), mass, duration), tolerance=1e-7).rows
    proof = next(row for row in rows if row.name == "torque at speed of elbow")
    assert proof.share == pytest.approx(1.0, abs=1e-6)
    assert proof.instant == pytest.approx({1.0: 0.39056, 0.6: 0.21576}[duration], abs=1e-3)


LINES = [
    {},
    {"peak_torque": 35.0, "continuous_torque": 10.0},
    {"torque_speed": [[0.0, 60.0], [1.0, 60.0], [2.5, 30.0], [6.0, 0.0]], "peak_torque": 45.0},
    {"torque_speed": [[0.0, 60.0], [1.0, 20.0], [6.0, 0.0]]},  # bends up
    {"torque_speed": [[0.0, 60.0], [2.0, 50.0]]},  # no faster than 2 rad/s
    {"torque_speed": [[0.0, 60.0], [0.4, 0.0]]},  # beyond it the load has to drive
]


#: Every line, every loss and every friction is in some of the cases that `make test` takes.
CASES = [(line, losses, dry) for line in LINES for losses in ({}, LOSSY) for dry in (False, True)]


@pytest.mark.parametrize(("line", "losses", "dry"), mostly_long(CASES, *CASES[::3], several=True))
def test_proven_torques_are_above_all_samples_and_near_them(line, losses, dry):
    friction = {"coulomb": {"shoulder": 2.0, "elbow": 1.0}} if dry else None
    drives = dict.fromkeys(("shoulder", "elbow"), line | losses)
    robot = load_robot(ARM, drives=drives, friction=friction)
    for x in drawn(problem(), 3):
        rollout = problem(robot, constraints=("torque_at_speed",)).rollout(x[None])
        rows = [row for row in certify(rollout, tolerance=1e-4).rows if row.quantity == "torque at speed"]
        shares = by_hand(rollout, robot)[0]
        bounds = np.array([row.bound for row in rows])
        assert (shares <= bounds + 1e-12).all()
        assert bounds == pytest.approx(shares, abs=2e-3 * max(1.0, shares.max()))
        assert [row.violated for row in rows] == [share > 1.0 + 1e-9 for share in [row.exhibited_share for row in rows]]


def test_certified_limits_are_at_most_zero_only_where_no_instant_exceeds_them():
    certified, sampled = problem(), problem(limits="sampled")
    x = drawn(certified, 60)
    proven, seen = (of.constraints[0].function(of.rollout(x)) for of in (certified, sampled))
    assert (proven >= seen - 1e-12).all()
    kept = (proven <= 0.0).all(axis=1)
    assert 5 < kept.sum() < 55
    for row in x[kept][:6]:
        assert (by_hand(certified.rollout(row[None]), certified.robot, 20_001)[0] <= 1.0 + 1e-12).all()


def test_what_happens_between_samples_is_found():
    """At two samples per segment the peak of the torque is between them."""
    few = {"samples": 2, "constraints": ("torque_at_speed",)}
    sampled, certified = (problem(limits=limits, **few) for limits in ("sampled", "certified"))
    x = drawn(sampled, 200)
    seen, proven = (of.constraints[0].function(of.rollout(x)).max(axis=1) for of in (sampled, certified))
    missed = (seen <= 0.0) & (proven > 0.0)
    assert missed.any()
    found = by_hand(certified.rollout(x[missed][:1]), certified.robot)[0]
    assert found.max() > 1.0


def test_a_front_keeps_the_limit_and_its_fastest_motion_uses_it():
    searched = problem(objectives=("time", "energy"), constraints=("torque_at_speed",))
    front = optimise(searched, generations=30, population=24, seed=1)
    fastest = front[int(np.argmin(front.F[:, 0]))]
    certificate = certify(fastest)
    assert certificate.proven
    assert certificate.closest.quantity == "torque at speed"
    assert 0.98 < certificate.closest.share <= 1.0 + 1e-9


def test_terms_have_the_slopes_of_finite_differences():
    of = problem(limits="certified")
    terms = of.constraints[0].terms
    x, step = drawn(of, 1), 1e-6
    for k in range(of.n_var):
        e = step * np.eye(of.n_var)[k]
        above, below = (terms(of.rollout(x + sign * e)) for sign in (1.0, -1.0))
        slope = terms(of.rollout(x + 1e-20j * e / step)).imag / 1e-20
        rough = (above - below) / (2.0 * step)
        agree = np.abs(rough - slope) <= 1e-5 * (1.0 + np.abs(slope))
        assert agree.mean() > 0.95  # at kinks between sections neither is right


# --- averages and temperatures


def between_turns(rollout, robot, joint, parts=500):
    """Instants that cut one motion finely, a joint's turns and its load's changes of sign among them, shape (N,)."""
    trajectory, armature = rollout.trajectory, robot.friction.armature[joint]

    def speed(t):
        return trajectory.evaluate(np.atleast_1d(t)[None], 1)[0, :, joint]

    def load(t):
        t = np.atleast_1d(t)
        q, v, a = (trajectory.evaluate(t[None], order) for order in range(3))
        return rollout.effort_in(q, v, a, t)[0, :, joint] - armature * a[0, :, joint]

    segments = np.concatenate([[0.0], np.cumsum(trajectory.segment_durations[0])])
    grid, turns = np.linspace(0.0, segments[-1], 4001), []
    for function in (speed, load):
        values = function(grid)
        for k in np.flatnonzero(values[:-1] * values[1:] < 0.0):
            turns.append(brentq(lambda t, of=function: of(t)[0], grid[k], grid[k + 1], xtol=1e-15))
    edges = np.unique(np.concatenate([segments, turns]))
    return np.unique(np.concatenate([np.linspace(*ends, parts + 1) for ends in pairwise(edges)]))


def finely_integrated(rollout, robot, joint, duty):
    """RMS torque and greatest rise of one joint by Gauss's rule of 8 points in each of hundreds of parts."""
    drive, armature = robot.drives[robot.joint_names[joint]], robot.friction.armature[joint]
    ends = between_turns(rollout, robot, joint)
    points, weights = np.polynomial.legendre.leggauss(8)
    steps = np.diff(ends)
    t = (ends[:-1, None] + steps[:, None] * (points + 1.0) / 2.0).ravel()
    q, v, a = (rollout.trajectory.evaluate(t[None], order) for order in range(3))
    rotor, speed = armature * a[0, :, joint], v[0, :, joint]
    load = rollout.effort_in(q, v, a, t)[0, :, joint] - rotor
    driving, driven = drive.efficiencies
    squares = (rotor + np.where(load * speed > 0.0, load / driving, load * driven)).reshape(-1, 8) ** 2
    stop = rollout.trajectory.evaluate(ends[None, -1:])
    held = rollout.effort_in(stop, 0.0 * stop, 0.0 * stop, ends[-1:])[0, 0, joint] ** 2
    whole = (squares @ weights / 2.0 * steps).sum() + duty.dwell * held
    time = drive.thermal_time_constant
    faded = np.exp(-(ends[1:, None] - t.reshape(-1, 8)) / time)
    gains, kept = (squares * faded) @ weights / 2.0 * steps / time, np.exp(-steps / time)
    peak, start = 0.0, 0.0
    for _ in range(duty.cycles or 60):
        levels = [start]
        for gain, share in zip(gains.tolist(), kept.tolist(), strict=True):
            levels.append(levels[-1] * share + gain)
        start = held + (levels[-1] - held) * np.exp(-duty.dwell / time)
        peak = max(peak, *levels, start)
    return np.sqrt(whole / (ends[-1] + duty.dwell)), peak * drive.rise_per_square


DUTIES = [(losses, *duty) for duty in ((0.0, None), (0.7, None), (0.3, 5)) for losses in ({}, LOSSY)]


@pytest.mark.parametrize(
    ("losses", "dwell", "cycles"), mostly_long(DUTIES, DUTIES[1], DUTIES[2], DUTIES[5], several=True)
)
def test_cycles_against_a_fine_integration(losses, dwell, cycles):
    """The motion has joints that turn round and loads that change direction, where torques jump if gears lose."""
    robot, duty = arm(**losses, thermal_time_constant=8.0), Duty(dwell, cycles)
    of = problem(robot)
    rollout = of.rollout(drawn(of, 1))
    found = rms_torques(rollout, duty)[0], greatest_rises(rollout, duty)[0]
    for joint in range(robot.dof):
        rms, rise = finely_integrated(rollout, robot, joint, duty)
        assert found[0][joint] == pytest.approx(rms, rel=1e-7)
        assert found[1][joint] == pytest.approx(rise, rel=1e-6)


@pytest.mark.parametrize("friction", [None, {"coulomb": {"shoulder": 2.0, "elbow": 1.0}}])
def test_cycles_agree_with_what_drive_load_tells(friction):
    robot = load_robot(ARM, drives=dict.fromkeys(("shoulder", "elbow"), LOSSY), friction=friction)
    of = problem(robot)
    rollout = of.rollout(drawn(of, 4))
    for dwell, cycles in ((0.5, None), (0.0, 4)):
        rms, rises = (function(rollout, Duty(dwell, cycles)) for function in (rms_torques, greatest_rises))
        for k, x in enumerate(drawn(of, 4)):
            told = drive_load(of.rollout(x[None]), dwell=dwell, cycles=cycles)
            assert rms[k] == pytest.approx(told.rms_torque, rel=1e-6)
            assert rises[k] == pytest.approx(told.peak_rise, rel=1e-6)


def test_published_rms_torques_of_two_links():
    rollout = upward(arm(), 1.0)
    assert rms_torques(rollout, Duty(1.0))[0] == pytest.approx([29.856508, 8.915250], abs=1e-6)
    assert rms_torques(rollout, Duty())[0] == pytest.approx([27.682635, 12.608068], abs=1e-6)


def test_a_brake_takes_the_hold_from_the_motor():
    rollout = upward(arm(brake=True), 1.0)
    moving = np.array([27.682635, 12.608068])
    assert rms_torques(rollout, Duty(1.0))[0] == pytest.approx(moving / np.sqrt(2.0), abs=1e-6)


def test_power_against_dense_samples():
    robot = arm(**LOSSY)
    of = problem(robot)
    for x in drawn(of, 3):
        rollout = of.rollout(x[None])
        _, torques, speeds, _ = by_hand(rollout, robot)
        power = 0.0
        for k, name in enumerate(robot.joint_names):
            drive = robot.drives[name]
            current = torques[k] / (drive.gear_ratio * drive.torque_constant)
            power = power + torques[k] * speeds[k] + drive.winding_resistance * current**2
        assert greatest_supply_power(rollout)[0] == pytest.approx(power.max(), rel=1e-3)


@pytest.mark.parametrize(("function", "tolerance"), [("rms", 1e-4), ("rise", 1e-4), ("power", 1e-4)])
def test_slopes_agree_with_finite_differences(function, tolerance):
    of = problem()
    called = {
        "rms": lambda rollout: rms_torques(rollout, Duty(0.5)),
        "rise": lambda rollout: greatest_rises(rollout, Duty(0.5)),
        "power": greatest_supply_power,
    }[function]
    x, step = drawn(of, 1), 1e-5
    for k in range(of.n_var):
        e = step * np.eye(of.n_var)[k]
        rough = (called(of.rollout(x + e)) - called(of.rollout(x - e))) / (2.0 * step)
        slope = called(of.rollout(x + 1e-20j * e / step)).imag / 1e-20
        assert slope == pytest.approx(rough, rel=tolerance, abs=tolerance * np.abs(rough).max())


# --- all of them


def test_a_motion_has_the_same_values_whatever_is_evaluated_with_it():
    of = problem(peak_power=300.0, objectives=("time", "rms_torque_share", "winding_rise", "peak_power"))
    x = drawn(of, 12)
    values = of.evaluate(x, return_as_dictionary=True)
    for k in range(0, 12, 3):
        alone = of.evaluate(x[k : k + 1], return_as_dictionary=True)
        assert np.array_equal(alone["F"][0], values["F"][k])
        assert np.array_equal(alone["G"][0], values["G"][k])


def test_objectives_are_the_greatest_of_all_joints_with_the_time_at_rest():
    of = problem(objectives=("time", "rms_torque_share", "winding_rise"), constraints=(), dwell=0.4, cycles=9)
    x = drawn(of, 2)
    for row, found in zip(x, of.evaluate(x), strict=True):
        told = drive_load(of.rollout(row[None]), dwell=0.4, cycles=9)
        assert found[1:] == pytest.approx([told.rms_share.max(), told.peak_rise.max()], rel=1e-6)


def test_a_slope_is_right_where_rounding_turns_a_joint_round_at_its_rest():
    """Velocities touch 0 at the end; a change of their sign there, of rounding, must not move with the variables."""
    robot = load_robot("ur5_drives")
    points = [[0.0, -1.2, 1.4, -1.7, -1.57, 0.0], [1.0, -0.9, 1.2, -1.9, -1.2, 0.8], [2.0, -1.3, 1.6, -1.8, -1.57, 0.0]]
    given = {"objectives": ("time",), "interpolant": "quintic_spline", "payload": 1.0}
    of = ViaPointProblem(robot=robot, points=points, **given)
    for share in np.random.default_rng(0).random((24, of.n_var)):
        x, e = of.xl + (0.7 + 0.01 * share) * (of.xu - of.xl), np.eye(of.n_var)[0]
        steps = x + np.outer([1e-4, -1e-4], e)
        rough = np.subtract(*rms_torques(of.rollout(steps), Duty(0.5))) / 2e-4
        slope = rms_torques(of.rollout((x + 1e-20j * e)[None]), Duty(0.5))[0].imag / 1e-20
        assert slope == pytest.approx(rough, abs=1e-3 * np.abs(rough).max())


def test_the_certificate_tells_what_is_proven_and_what_is_an_integral():
    of = problem(objectives=("time", "rms_torque_share"), peak_power=400.0)
    front = optimise(of, generations=4, population=12, seed=0, polish=False, progress=False)
    certificate = certify(front[0])
    assert {row.joint for row in certificate.rows if row.quantity == "torque at speed"} == {"shoulder", "elbow"}
    told = "; ".join(map(str, certificate.uncovered))
    assert "rms torque of elbow (an integral over cycles, resolved to 1e-06, not proven; " in told
    assert "winding temperature of shoulder (an integral over cycles" in told
    assert "peak power (checked at samples only; " in told
    assert "torque at speed" not in told
    assert not certificate.proven
    assert "not covered: rms torque of shoulder" in str(certificate)


def test_settings_make_an_equal_problem():
    of = problem(dwell=0.5, cycles=3, peak_power=200.0)
    again = ViaPointProblem(**of.settings)
    assert np.array_equal(again.evaluate(drawn(of, 3))[1], of.evaluate(drawn(of, 3))[1])


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"dwell": -1.0}, r"dwell: expected a time from 0 on \[s\], got -1.0"),
        ({"dwell": "1 s"}, r"dwell: expected a time from 0 on \[s\], got '1 s'"),
        ({"cycles": 10**10}, "cycles: expected at most 1000000000, or 0 for ever, got 10000000000"),
        ({"cycles": 1.5}, "cycles: expected a whole number from 1 on, or 0 for ever, got 1.5"),
        ({"peak_power": 0.0}, r"peak_power: expected a positive number \[W\], got 0.0"),
        (
            {"constraints": (), "dwell": 1.0},
            "dwell: expected 'rms_torque' or 'winding_temperature' among",
        ),
        ({"constraints": ("rms_torque",), "cycles": 2}, "cycles: expected 'winding_temperature' among the constraints"),
        (
            {"robot": load_robot("ur5", tool="tool0", limits=FREE)},
            "'torque_at_speed' needs peak_torque or .* 'ur5' has no drives",
        ),
    ],
)
def test_what_cannot_be_limited_is_refused(arguments, says):
    points = {"points": np.zeros((3, 6)) + np.arange(3)[:, None] * 0.1} if "robot" in arguments else {}
    with pytest.raises(InvalidInputError, match=says):
        problem(**arguments | points)


@pytest.mark.parametrize(
    ("name", "drive", "says"),
    [
        (
            "rms_torque",
            {"torque_speed": [[0.0, 9.0], [1.0, 0.0]]},
            "needs continuous_torque of a drive, .* has none",
        ),
        (
            "winding_temperature",
            {"greatest_rise": 80.0},
            "needs gear_ratio, winding_resistance, torque_constant",
        ),
        (
            "torque_at_speed",
            {"gear_ratio": 100.0},
            "needs peak_torque or torque_speed of a drive, .* none",
        ),
    ],
)
def test_drives_that_do_not_tell_enough_are_refused(name, drive, says):
    robot = load_robot("ur5", tool="tool0", limits=FREE, drives={"elbow_joint": drive})
    points = np.zeros((3, 6)) + np.arange(3)[:, None] * 0.1
    with pytest.raises(InvalidInputError, match=says):
        ViaPointProblem(robot=robot, points=points, objectives=("time",), constraints=(name,))


def test_lines_have_the_sections_that_they_are_drawn_with():
    drive = {"peak_torque": 45.0, "torque_speed": [[0.0, 60.0], [1.0, 60.0], [2.5, 30.0], [6.0, 0.0]]}
    limits = TorqueLimits.of(load_robot(ARM, drives={"shoulder": drive}))
    speeds = np.array([-3.0, 0.0, 1.0, 1.75, 2.0, 2.5, 4.25, 6.0, 8.0])
    given = limits.given(np.stack([speeds, speeds], axis=1))[:, 0]
    assert given == pytest.approx([45.0, 45.0, 45.0, 45.0, 40.0, 30.0, 15.0, 0.0, -2.0 * 30.0 / 3.5])
    assert limits.bends_down.tolist() == [False, True]


def test_robots_of_tables_have_drives_too():
    drives = {"joint_1": {"peak_torque": "40 N*m", "rotor_inertia": 1e-4, "gear_ratio": 50.0}}
    made = Robot.planar([0.5], [3.0], [0.25], [0.06], drives=drives, limits={"position": [[-3.0, 3.0]]})
    assert made.drives["joint_1"].peak_torque == 40.0
    assert made.friction.armature == pytest.approx([0.25])
    again = ViaPointProblem(robot=made, points=[[0.0], [1.0]], constraints=("torque_at_speed",), objectives=("time",))
    assert ViaPointProblem(**again.settings).robot.drives == made.drives
    with pytest.raises(UnknownNameError, match="joint in drives"):
        Robot.planar([0.5], [3.0], [0.25], [0.06], drives={"elbow": {}})
