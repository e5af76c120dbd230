"""Certificates: what is proven is never exceeded, what is violated is exhibited, gaps are as small as asked for."""

import dataclasses
import json

import numpy as np
import pytest

from tests.helpers import UNDRAWN, any_problem, mostly_long, refused, small_problem, trajevo
from trajevo import PolynomialBatch, ViaPoints, analyse, load_problem, load_robot, optimise
from trajevo.dynamics.complex_bounds import Bounds, EffortReach
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.exporters.export import export
from trajevo.formulation.constraints.joint_limits import effort_limits, kinematic_limits
from trajevo.formulation.constraints.tool import tool_speed_limit
from trajevo.page.report import report
from trajevo.robot.joints import Friction
from trajevo.robot.kinematics import ToolKinematics
from trajevo.robot.payload import Payload
from trajevo.trajectory.bernstein import gauss, hull, interpolation_error
from trajevo.trajectory.interpolants import CubicSpline, LinearBlends, QuinticSpline, SepticSpline
from trajevo.verification.certify import certify, certify_all
from trajevo.verification.newton_euler import NewtonEuler

FREE = {"acceleration": np.inf, "jerk": np.inf}
FINGERS = {"panda_finger_joint1": 0.0, "panda_finger_joint2": 0.0}
SPLINES = {"cubic": CubicSpline, "quintic": QuinticSpline, "septic": SepticSpline}


@pytest.fixture(scope="module")
def robots():
    return {
        "ur5": load_robot("ur5", tool="tool0", limits=FREE),
        "panda": load_robot("panda", lock=FINGERS, limits=FREE, tool="panda_hand"),
        "hybrid_manipulator": load_robot("hybrid_manipulator"),
    }


@pytest.fixture(scope="module")
def front():
    return optimise(small_problem(), seed=1, generations=10, population=20, progress=False, polish=False)


def limited(robot, **limits):
    given = {name: np.broadcast_to(value, (robot.dof,)) for name, value in limits.items()}
    return dataclasses.replace(robot, limits=dataclasses.replace(robot.limits, **given))


def moving(robot, seed, *, count=1, spline=QuinticSpline, payload=Payload(0.0), fast=0.8):  # noqa: B008 - frozen
    """Random motions through five points inside the range."""
    rng = np.random.default_rng(seed)
    lower, upper = np.maximum(robot.limits.lower, -2.5), np.minimum(robot.limits.upper, 2.5)
    points = 0.5 * (lower + upper) + rng.uniform(-0.3, 0.3, (5, robot.dof)) * (upper - lower)
    interpolant = spline(ViaPoints(points), duration_bounds=(0.2, 5.0))
    times = rng.uniform(0.7, 1.3, (count, len(interpolant.variables))) / fast
    times = np.clip(times, 0.2, 5.0)
    if spline is LinearBlends:
        times[:, -1] = 0.3
    return Rollout(Dynamics(robot, payload), interpolant(times))


def dense(rollout, count=4001):
    """Magnitudes of efforts, powers and the tool's speed at evenly spread instants, (B, 2 n_joints + 1)."""
    t = rollout.trajectory.duration[:, None] * np.linspace(0.0, 1.0, count)
    q, v, a = (rollout.trajectory.evaluate(t, order) for order in range(3))
    effort = rollout.effort_in(q, v, a)
    speed = np.linalg.norm(ToolKinematics.of(rollout.robot).twist(q, v)[..., :3], axis=-1)[..., None]
    return np.abs(np.concatenate([effort, effort * rollout.without_rounding(v), speed], axis=-1)).max(axis=1)


def bounds_of(certificate, *quantities):
    return np.array([row.bound for row in certificate.rows if row.quantity in quantities])


def assert_encloses(rollout, tolerance=0.001):
    found = certify_all(rollout, tolerance=tolerance)
    for certificate, greatest in zip(found, dense(rollout), strict=True):
        bound = bounds_of(certificate, "effort", "power", "tool speed")
        assert (greatest <= bound * (1.0 + 1e-9) + 1e-12).all()
        assert certificate.gap <= 1.01 * tolerance
    return found


def feasible_motions(spline, count, seed):
    """Random motions of three joints that a problem would take: exactly at a limit of theirs after stretching time."""
    rng = np.random.default_rng(seed)
    robot = limited(load_robot("hybrid_manipulator"), lower=-1.0, upper=1.0)
    while count > 0:
        points = rng.uniform(-0.8, 0.8, (4, robot.dof))
        interpolant = spline(ViaPoints(points), duration_bounds=(0.2, 5.0))
        trajectory = interpolant(rng.uniform(0.2, 5.0, (2000, len(interpolant.variables))))
        used = [
            (trajectory.peak(order) / getattr(robot.limits, name)).max(axis=1) ** (1.0 / order)
            for order, name in ((1, "velocity"), (2, "acceleration"), (3, "jerk"))
        ]
        stretch = np.max(used, axis=0) * (1.0 + 1e-13)
        powers = stretch[:, None] ** np.arange(trajectory.degree + 1)
        at_limit = PolynomialBatch(
            trajectory.breaks * stretch[:, None], trajectory.coefficients / powers[:, None, None]
        )
        rollout = Rollout(Dynamics(robot), at_limit)
        excess = np.concatenate([limit.function(rollout) for limit in kinematic_limits(robot)], axis=1)
        kept = np.flatnonzero((excess <= 0.0).all(axis=1))[:count]
        if not len(kept):
            continue  # the points leave no room to overshoot
        count -= len(kept)
        yield robot, PolynomialBatch(at_limit.breaks[kept], at_limit.coefficients[kept])


def greatest_excess(spline, count, seed):
    worst, seen, shares = -np.inf, 0, np.linspace(0.0, 1.0, 101)
    for robot, trajectory in feasible_motions(spline, count, seed):
        seen += len(trajectory)
        q, v, a, j = (trajectory.at_shares(shares, order) for order in range(4))
        used = [robot.limits.range_used(q)]
        used += [np.abs(x) / getattr(robot.limits, n) for x, n in ((v, "velocity"), (a, "acceleration"), (j, "jerk"))]
        worst = max(worst, *(float(share.max()) - 1.0 for share in used))
    return worst, seen


@pytest.mark.parametrize("spline", SPLINES)
@pytest.mark.parametrize("count", mostly_long([3_000, 20_000], 3_000))
def test_motions_declared_feasible_keep_every_kinematic_limit(spline, count):
    worst, seen = greatest_excess(SPLINES[spline], count // 3 + 1, 1)
    assert seen > count / 3
    assert -0.01 < worst <= 1e-9


@pytest.mark.long
@pytest.mark.parametrize("spline", SPLINES)
def test_a_third_of_a_million_motions_keep_every_kinematic_limit(spline):
    seen = 0
    for seed in range(10):
        worst, more = greatest_excess(SPLINES[spline], 33_334, 100 + seed)
        assert worst <= 1e-9
        seen += more
    assert seen >= 333_334


def recheck(rollout):
    """Certificates against 50 times the density by the independent dynamics; how many are proven."""
    shares = np.linspace(0.0, 1.0, 50 * rollout.dynamics.samples)
    q, v, a = (rollout.trajectory.at_shares(shares, order) for order in range(3))
    ours = NewtonEuler(rollout.robot, rollout.dynamics.payload)
    proven = 0
    for k, certificate in enumerate(certify_all(rollout)):
        effort = np.abs(ours.effort(q[k], v[k], a[k])).max(axis=0)
        rows = [row for row in certificate.rows if row.quantity == "effort"]
        scale = np.array([row.limit for row in rows])
        assert ((effort - [row.bound for row in rows]) / scale).max() <= 1e-9
        assert certificate.gap <= 0.00101
        keeps = all(row.proven for row in rows)
        assert keeps == (effort <= scale).all() or abs((effort / scale).max() - 1.0) < 1e-3
        proven += keeps
    return proven


@pytest.mark.thinned(2)
@pytest.mark.parametrize("name", ["ur5", "panda", "hybrid_manipulator"])
def test_certified_efforts_hold_at_50_times_the_density(robots, name):
    proven = [
        recheck(moving(robots[name], seed, count=10, payload=Payload(2.0, (0.02, 0.0, 0.05)), fast=0.6 + 0.3 * seed))
        for seed in range(2)
    ]
    assert sum(proven) >= 5


@pytest.mark.long
@pytest.mark.parametrize("name", ["ur5", "panda", "hybrid_manipulator"])
def test_thousands_of_certified_efforts_hold_at_50_times_the_density(robots, name):
    splines, proven, seed = list(SPLINES.values()), 0, 0
    while proven < 3_334:
        payload, fast = Payload(2.0, (0.02, 0.0, 0.05)), 0.3 + 0.1 * (seed % 7)
        proven += recheck(
            moving(robots[name], 1000 + seed, count=50, spline=splines[seed % 3], payload=payload, fast=fast)
        )
        seed += 1


@pytest.mark.thinned(5)
@pytest.mark.parametrize("spline", [*SPLINES.values(), LinearBlends])
@pytest.mark.parametrize("name", ["ur5", "panda", "hybrid_manipulator"])
def test_bounds_enclose_dense_samples_within_the_tolerance(robots, name, spline):
    assert_encloses(moving(robots[name], 3, spline=spline, count=3))


@pytest.mark.parametrize("tolerance", [0.05, 1e-3, 1e-5])
def test_the_gap_follows_the_tolerance_at_few_more_pieces(robots, tolerance):
    found = assert_encloses(moving(robots["ur5"], 4, count=3), tolerance)
    assert all(4 <= certificate.pieces < 300 for certificate in found)


@pytest.mark.parametrize("name", ["reparam", "pick-place", "pointing", "via-points", "hybrid"])
def test_every_problem_can_be_certified(name):
    problem = any_problem(name)
    rng = np.random.default_rng(0)
    x = problem.xl + (problem.xu - problem.xl) * rng.uniform(size=(2, problem.n_var))
    assert_encloses(problem.rollout(x))


def test_a_peak_between_the_samples_is_caught_where_the_sampled_limit_passes(robots):
    rollout = next(
        found
        for found in (moving(robots["ur5"], seed, spline=CubicSpline) for seed in range(20))
        if (dense(found)[:, :6] > 1.005 * np.abs(found.effort).max(axis=1)).any()
    )
    sampled, exact = np.abs(rollout.effort).max(axis=1)[0], dense(rollout)[0, :6]
    joint = int((exact / sampled).argmax())
    limit = np.where(np.arange(6) == joint, 1.001 * sampled, 10.0 * exact)
    robot = limited(robots["ur5"], effort=limit, velocity=np.inf, lower=-np.inf, upper=np.inf)
    tight = Rollout(Dynamics(robot), rollout.trajectory)
    assert (effort_limits(robot).function(tight) <= 0.0).all()
    found = certify(tight)
    (row,) = found.violated
    assert not found.proven
    assert (row.quantity, row.joint) == ("effort", robot.joint_names[joint])
    assert row.exhibited > row.limit == limit[joint]
    state = (tight.trajectory.evaluate(np.array([row.instant]), order) for order in range(3))
    assert abs(tight.effort_in(*state)[0, 0, joint]) == pytest.approx(row.exhibited, rel=1e-9)
    assert str(found).startswith(f"the motion breaks a limit: effort of {row.joint} reaches")


def test_a_limit_just_above_the_peak_is_proven_and_just_below_it_violated(robots):
    rollout = moving(robots["panda"], 5)
    fine = certify(rollout, tolerance=1e-7)
    peak = np.array([row.exhibited for row in fine.rows if row.quantity == "effort"])
    free = {"velocity": np.inf, "lower": -np.inf, "upper": np.inf}
    for factor, proven in ((1.0 + 1e-5, True), (1.0 - 1e-5, False)):
        robot = limited(robots["panda"], effort=factor * peak, **free)
        found = certify(Rollout(Dynamics(robot), rollout.trajectory))
        assert found.proven is proven
        assert bool(found.violated) is not proven
    assert "keeps every limit at every instant, proven" in str(
        certify(Rollout(Dynamics(limited(robots["panda"], effort=2.0 * peak, **free)), rollout.trajectory))
    )


@pytest.mark.parametrize("seed", mostly_long(range(4), 0, 1))
@pytest.mark.parametrize("name", ["ur5", "hybrid_manipulator"])
def test_dry_friction_that_jumps_where_a_joint_turns_back(robots, name, seed):
    n = robots[name].dof
    friction = Friction(np.full(n, 0.5), np.full(n, 6.0), np.full(n, 0.1), np.full(n, 3.0))
    rough = dataclasses.replace(robots[name], friction=friction)
    rollout = moving(rough, seed)
    (found,) = assert_encloses(rollout)
    # On either side of the instant where a joint turns back its dry friction is at full strength.
    t = rollout.trajectory.duration[0] * np.linspace(0.0, 1.0, 2001)
    q, v, a = (rollout.trajectory.evaluate(t, order) for order in range(3))
    smooth = dataclasses.replace(
        rollout.dynamics,
        robot=dataclasses.replace(rough, friction=Friction(*[friction.viscous, np.zeros(n), friction.armature])),
    )
    turning = v[0, 1:] * v[0, :-1] < 0.0
    both = np.abs(smooth.effort(q, v, a)[0, 1:, None] + np.array([6.0, -3.0])[:, None]).max(axis=1)
    assert (turning.sum(axis=0) > 0).any()
    assert (np.where(turning, both, 0.0).max(axis=0) <= bounds_of(found, "effort") * 1.01).all()


@pytest.mark.thinned(4)
@pytest.mark.parametrize("model", ["rigid", "weight_only", "tool_axis"])
@pytest.mark.parametrize("name", ["ur5", "panda", "hybrid_manipulator"])
def test_every_payload_model(robots, name, model):
    com = (0.0, 0.0, 0.0) if model == "tool_axis" else (0.1, 0.02, 0.05)
    assert_encloses(moving(robots[name], 6, payload=Payload(3.0, com, model=model)))


def test_a_joint_that_stands_does_no_work_and_takes_no_dry_friction(robots):
    n = 6
    friction = Friction(np.zeros(n), np.full(n, 5.0), np.zeros(n))
    rough = dataclasses.replace(robots["ur5"], friction=friction)
    points = np.array([[0.3] * 6, [0.6, *[0.3] * 5], [0.1, *[0.3] * 5]])
    trajectory = QuinticSpline(ViaPoints(points), duration_bounds=(0.2, 5.0))(np.full((1, 2), 1.0))
    (found,) = assert_encloses(Rollout(Dynamics(rough), trajectory))
    (smooth,) = assert_encloses(Rollout(Dynamics(robots["ur5"]), trajectory))
    np.testing.assert_array_equal(bounds_of(found, "power")[1:], 0.0)
    np.testing.assert_allclose(bounds_of(found, "effort")[1:], bounds_of(smooth, "effort")[1:], rtol=0.005, atol=0.2)


def test_payload_masses_of_a_variable(robots):
    rollout = moving(robots["ur5"], 7, count=3, payload=Payload(1.0, (0.0, 0.05, 0.1)))
    masses = np.array([0.0, 2.0, 5.0])
    found = assert_encloses(Rollout(rollout.dynamics, rollout.trajectory, masses))
    assert (np.diff([bounds_of(each, "effort")[1] for each in found]) != 0.0).all()


def test_a_batch_is_certified_as_its_motions_are_alone(robots):
    rollout = moving(robots["panda"], 8, count=4)
    for k, together in enumerate(certify_all(rollout)):
        alone = certify(Rollout(rollout.dynamics, rollout.trajectory[k]))
        assert together.pieces == alone.pieces
        for one, other in zip(together.rows, alone.rows, strict=True):
            assert one.bound == pytest.approx(other.bound, rel=1e-9)
            assert one.instant == pytest.approx(other.instant, abs=1e-6)


def test_kinematic_rows_are_the_exact_extremes_and_exhibited_there(front):
    solution = front.knee()
    trajectory, robot = solution.trajectory, solution.rollout.robot
    found = certify(solution)
    for order, quantity in enumerate(("velocity", "acceleration", "jerk"), start=1):
        rows = [row for row in found.rows if row.quantity == quantity]
        np.testing.assert_allclose([row.bound for row in rows], trajectory.peak(order)[0], rtol=1e-11)
        for joint, row in enumerate(rows):
            value = trajectory.evaluate(np.array([row.instant]), order)[0, 0, joint]
            assert abs(value) == pytest.approx(row.exhibited, rel=1e-12)
            assert row.share == pytest.approx(row.exhibited_share, rel=1e-8)
    positions = [row for row in found.rows if row.quantity == "position"]
    assert [row.joint for row in positions] == list(robot.joint_names)
    assert all(row.limit in (robot.limits.lower[k], robot.limits.upper[k]) for k, row in enumerate(positions))
    assert found.proven
    assert found.closest.share == max(row.share for row in found.rows if np.isfinite(row.limit))


def test_ranges_with_one_end_or_none(front):
    solution = front.knee()
    robot = limited(solution.rollout.robot, lower=np.array([-np.inf, -np.inf]), upper=np.array([0.5, np.inf]))
    found = certify(Rollout(Dynamics(robot), solution.trajectory))
    (row,) = [row for row in found.rows if row.quantity == "position"]
    assert (row.joint, row.limit) == ("joint_1", 0.5)
    assert row.share == pytest.approx(1.0 + (solution.trajectory.extremes(0)[1][0, 0] - 0.5) / 0.5, rel=1e-9)


def test_tool_speed_and_power_are_held_to_limits_where_there_are_any(robots):
    rollout = moving(robots["ur5"], 9)
    free = certify(rollout)
    row = free.rows[-1]
    assert (row.quantity, row.limit, row.share) == ("tool speed", np.inf, 0.0)
    assert "has no limit" in str(row)
    broken = certify(rollout, tool_speed=0.9 * row.exhibited, power=np.full(6, 1.0))
    named = {found.quantity for found in broken.violated}
    assert {"tool speed", "power"} <= named
    problem = small_problem(constraints=(tool_speed_limit(small_problem().robot, 12.3),))
    solution = optimise(problem, seed=1, generations=3, population=10, progress=False, polish=False).knee()
    assert certify(solution).rows[-1].limit == 12.3


@pytest.mark.parametrize("name", ["ur5", "panda", "hybrid_manipulator"])
def test_reaches_exceed_what_complex_instants_give(robots, name):
    robot = robots[name]
    rng = np.random.default_rng(1)
    q, v, a = rng.uniform(-0.5, 0.5, (3, 200, robot.dof)) + 1j * rng.uniform(-0.2, 0.2, (3, 200, robot.dof))
    reach = EffortReach(Dynamics(robot))
    bounds = Bounds(np.abs(q.imag), *map(np.abs, (q, v, a)))
    velocity = ToolKinematics.of(robot).twist(q, v)[:, :3]
    assert (np.abs((velocity * velocity).sum(axis=1)) <= reach.squared_tool_speed(bounds)).all()
    real = Bounds(np.zeros_like(q.real), *(np.abs(x.real) for x in (q, v, a)))
    torque = np.abs(Dynamics(robot).effort(q.real, v.real, a.real))
    assert (torque <= reach.effort(real)).all()
    assert (reach.effort(real) <= reach.effort(bounds)).all()
    assert (reach.effort(real) < 1e3 * (1.0 + torque.max())).all()  # coarse, but not useless


def test_the_error_of_interpolation_is_bounded_on_an_ellipse():
    u = np.linspace(0.0, 1.0, 1001)
    ellipse = np.array([1.5, 2.0, 3.0])
    for size in (6, 10, 14):
        for pole in (1.5, 2.5):  # of 1/(pole - z), z from -1 to 1; its ellipse has this sum of semi-axes
            exact = 1.0 / (pole - (2.0 * u - 1.0))
            nodes, values = gauss(size)[0], 1.0 / (pole - (2.0 * gauss(size)[0] - 1.0))
            fitted = np.polynomial.Polynomial.fit(nodes, values, size - 1, domain=[0.0, 1.0])
            half = 0.5 * (ellipse + 1.0 / ellipse)
            inside = half < pole
            allowed = interpolation_error(size, ellipse[inside]) / (pole - half[inside])
            assert np.abs(exact - fitted(u)).max() <= allowed.min() + 1e-12
            lower, upper = hull(values)
            assert lower <= fitted(u).min()
            assert fitted(u).max() <= upper


def test_bad_input_is_refused_in_a_sentence(robots, front):
    rollout = moving(robots["ur5"], 1, count=2)
    one = Rollout(rollout.dynamics, rollout.trajectory[0])
    refused(lambda: certify(rollout), "motion: expected one motion, got 2; use certify_all for more")
    refused(lambda: certify("knee"), "motion: expected a solution, an optimum or a rollout, got str")
    refused(lambda: certify_all(3), "motion: expected a solution, an optimum or a rollout, got int")
    for tolerance in (0.0, 1.0, -1.0, True, "fine", np.nan):
        refused(lambda tolerance=tolerance: certify(one, tolerance=tolerance), "tolerance: expected a share from 1e-07")
    refused(lambda: certify(one, tool_speed=-1.0), "tool_speed: expected positive numbers, got -1.0")
    refused(lambda: certify(one, power=[1.0, 2.0]), r"power: expected shape \(6\), got \(2,\)")
    refused(lambda: certify(one, power="much"), "power: expected numbers of shape")
    empty = dataclasses.replace(front, X=front.X[:0], F=front.F[:0], G=front.G[:0])
    refused(lambda: certify_all(empty), "the front is empty")


def test_the_command_line_prints_the_certificate_and_fails_where_a_limit_is_broken(tmp_path):
    small = ("--generations", 5, "--population", 20, "--no-polish", *UNDRAWN)
    assert trajevo("solve", "pointing", *small, "--out", tmp_path / "p").returncode == 0
    done = trajevo("certify", tmp_path / "p")
    assert done.returncode == 0, done.stderr
    assert "(knee) keeps every limit at every instant, proven" in done.stdout
    assert "tool speed" in done.stdout
    broken = trajevo("certify", tmp_path / "p", "--solution", "0", "--tool-speed", 1e-6)
    assert broken.returncode == 1
    assert "row 0 breaks a limit: tool speed reaches" in broken.stdout
    every = trajevo("certify", tmp_path / "p", "--all")
    assert every.returncode == 0
    assert "solutions are proven to keep every limit at every instant." in every.stdout
    bad = trajevo("certify", tmp_path / "p", "--tolerance", 2)
    assert (bad.returncode, bad.stdout) == (2, "")
    assert "error: tolerance: expected a share" in bad.stderr


@pytest.fixture(scope="module")
def knee():
    problem = load_problem("pointing")
    return optimise(problem, seed=1, generations=4, population=20, progress=False, polish=False).knee()


@pytest.mark.parametrize("format", mostly_long(["csv", "ros2", "mujoco", "moveit"], "csv"))
def test_exports_carry_the_certificate_above_their_rows(knee, tmp_path, format):
    text = export(knee, tmp_path / f"k.{format}", format=format).read_text()
    assert "\n# certificate: {" in text
    assert json.dumps(str(certify(knee))) in text


def test_exports_and_reports_carry_the_certificate(knee, tmp_path):
    sentence = str(certify(knee))
    content = json.loads(export(knee, tmp_path / "k.json", format="json").read_text())
    assert content["certificate"]["verdict"] == sentence
    assert content["certificate"]["proven"] is True
    assert {row["quantity"] for row in content["certificate"]["rows"]} >= {"position", "effort", "tool speed"}
    import xarray as xr

    export(knee.front, tmp_path / "f.nc", format="netcdf")
    with xr.open_dataset(tmp_path / "f.nc") as made:
        assert len(json.loads(made.attrs["certificates"])) == len(knee.front)
    page = report(knee.front, tmp_path / "r.html", analyses=analyse(knee.front, "short"), pictures=[]).read_text()
    assert "<h2>Certificate of the knee</h2>" in page
    assert "keeps every limit at every instant, proven" in page


def test_screws_far_apart_are_enclosed_too(robots):
    """On wide ellipses nothing bounds the swivel, an arc tangent: pieces are halved until something does."""
    robot = limited(robots["hybrid_manipulator"], lower=-np.inf, upper=np.inf)
    rng = np.random.default_rng(3)
    points = ViaPoints(rng.uniform(-1.0, 1.0, (3, robot.dof)) * np.where(np.arange(robot.dof) < 2, 3.0, 1.0))
    interpolant = SepticSpline(points, duration_bounds=(0.2, 9.0))
    assert_encloses(Rollout(Dynamics(robot), interpolant(np.array([[1.0, 3.0], [2.0, 2.0]]))))
    # Screws that overshoot by 300 m are cut as often as is allowed; the gap is told, the bound holds all the same.
    wild = Rollout(Dynamics(robot), interpolant(np.array([[0.4, 8.0]])))
    found = certify(wild)
    assert found.gap > 0.001
    assert (dense(wild)[0] <= bounds_of(found, "effort", "power", "tool speed")).all()
    assert not found.proven
