"""Every constraint of a problem has a row in its certificate, or is named as not covered, against the kept limits."""

import json

import numpy as np
import pinocchio as pin
import pytest

from trajevo import (
    Constraint,
    Payload,
    Scene,
    TrajectoryProblem,
    ViaPointProblem,
    certify,
    export,
    load_robot,
    optimise,
    plots,
)
from trajevo.capacity.dlcc import effort_along
from trajevo.formulation.constraints.clearance import clearance_along
from trajevo.verification.certify import certify_all
from trajevo.verification.shares import shares_of_rows, shares_used
from trajevo.verification.verify import verify

UR5_POINTS = [
    [0.0, -1.5, 1.5, -1.5, -1.5, 0.0],
    [0.5, -1.2, 1.4, -1.7, -1.5, 0.2],
    [0.9, -1.4, 1.5, -1.6, -1.5, 0.0],
]
SMALL = {"population": 24, "generations": 12, "seed": 1, "progress": False, "polish": False}


@pytest.fixture(scope="module")
def ur5():
    return load_robot("ur5", tool="tool0", limits={"acceleration": 10.0, "jerk": 100.0})


def reaching(robot, **given):
    """A UR5 that carries a kilogram through three points."""
    arguments = {
        "robot": robot,
        "points": UR5_POINTS,
        "duration_bounds": (0.3, 4.0),
        "objectives": ["time", "energy"],
        "constraints": ["position", "velocity", "acceleration", "jerk", "effort"],
        "payload": Payload(1.0, com=(0.0, 0.0, 0.03)),
    }
    return ViaPointProblem(**(arguments | given))


@pytest.fixture(scope="module")
def with_margin(ur5):
    return optimise(reaching(ur5, effort_margin=0.2), **SMALL)


def row_of(certificate, name):
    return next(row for row in certificate.rows if row.name == name)


def test_certificates_stand_on_the_limits_that_the_problem_keeps_and_tell_both(with_margin, ur5):
    best = with_margin.least("time")
    certificate = certify(best)
    row = max((row for row in certificate.rows if row.quantity == "effort"), key=lambda row: row.share)
    own = ur5.limits.effort[ur5.joint_names.index(row.joint)]
    assert row.limit == pytest.approx(0.8 * own)
    assert row.full_limit == own
    assert row.share == pytest.approx(row.bound / (0.8 * own))
    assert f"of the limit of {0.8 * own:g} N·m that the problem keeps" in str(row)
    assert f"of the robot's {own:g} N·m" in str(row)
    assert row_of(certificate, "jerk of elbow_joint").full_limit == 100.0


def test_verification_stands_on_the_same_limits(with_margin):
    best = with_margin.least("time")
    row = next(row for row in verify(best).rows if row.limit == "effort")
    assert row.full_share == pytest.approx(0.8 * row.share)
    proven = row_of(certify(best), f"effort of {row.joint}")
    assert proven.exhibited_share == pytest.approx(row.share, rel=2e-3)


def test_a_motion_beyond_the_margin_breaks_a_limit_although_the_robot_could(ur5):
    front = optimise(reaching(ur5), **SMALL)
    tight = reaching(ur5, effort_margin=0.72)
    heavy = max(
        (row for row in certify(front.least("time")).rows if row.quantity == "effort"), key=lambda row: row.share
    )
    assert 0.28 < heavy.share < 1.0
    certificate = certify(tight.rollout(front.least("time").x))
    assert not certificate.proven
    assert certificate.violated[0].quantity == "effort"


def test_shown_shares_are_those_of_the_certificate_not_of_the_first_proof(with_margin):
    rows = [with_margin.least("energy").index, with_margin.knee().index]
    shown = shares_of_rows(with_margin, rows)
    for row, shares in zip(rows, shown, strict=True):
        solution = with_margin.pick(str(row))
        certificate = certify(solution)
        for joint in solution.rollout.robot.joint_names:
            assert shares[f"effort of {joint}"] == pytest.approx(
                row_of(certificate, f"effort of {joint}").share, abs=2e-3
            )
    assert shares_used(with_margin.pick(str(rows[0]))) == shown[0]
    solution = with_margin.pick(str(rows[0]))
    coarse = max(value - (shown[0][name] - 1.0) for name, value in solution.G.items() if name.startswith("effort"))
    assert coarse > 0.01  # otherwise this test would show nothing


def test_exported_constraints_are_those_shares(with_margin, tmp_path):
    best = with_margin.knee()
    told = json.loads(export(best, tmp_path / "knee.json", format="json").read_text())
    certificate = certify(best)
    assert set(told["solution"]["constraints"]) == set(best.G)
    for name, value in told["solution"]["constraints"].items():
        assert value == pytest.approx(row_of(certificate, name).share - 1.0, abs=1e-12)
        assert value <= best.G[name] + 1e-12


@pytest.fixture(scope="module")
def beside_a_ball(ur5):
    ball = {"shape": "sphere", "name": "ball", "position": [0.6, 0.6, 0.2], "radius": 0.1}
    scene = {"obstacles": [ball], "clearance": 0.02}
    return optimise(reaching(ur5, scene=scene), **SMALL), Scene.of(scene)


def test_clearance_has_a_row_with_place_and_bodies(beside_a_ball):
    front, scene = beside_a_ball
    best = front.knee()
    certificate = certify(best)
    row = row_of(certificate, "clearance to obstacles")
    dense = clearance_along(best, scene, density=400)
    least = float(dense.least(itself=False).min())
    assert row.limit == 0.02
    assert row.bound <= least + 1e-9
    assert least - 2e-3 <= row.bound
    assert row.exhibited == pytest.approx(least, abs=1e-3)
    assert row.between[1] == "ball"
    pair = next(k for k, pair in enumerate(dense.pairs) if (pair.first, pair.second) == row.between)
    at_instant = np.abs(dense.t[0] - row.instant).argmin()
    assert dense.distances[0, at_instant, pair] == pytest.approx(least, abs=2e-3)
    assert " mm at " in str(row)
    assert "20 mm wanted" in str(row)
    assert certificate.proven


def own_constraint(limit):
    """A user's own limit on all joints' speeds, at the samples."""
    return Constraint(
        ("patience",), "mine", lambda r: np.sqrt((r.v * r.v).sum(axis=2)).max(axis=1)[:, None] / limit - 1.0
    )


def test_an_unknown_constraint_is_named_as_not_covered_and_exhibited_if_it_is_broken_between_samples(ur5):
    base = reaching(ur5)
    x = 0.5 * (base.xl + base.xu)
    peak = float(np.sqrt((base.rollout(x).v ** 2).sum(axis=2)).max())

    def front(limit):
        problem = TrajectoryProblem(
            dynamics=base.dynamics.sampled(2),  # both ends of the segments only
            interpolant=base.interpolant,
            objectives=base.objectives,
            constraints=(*base.constraints, own_constraint(limit)),
        )
        return optimise(problem, initial=x[None], **SMALL)

    loose = certify(front(10.0 * peak).knee())
    assert [one.name for one in loose.uncovered] == ["patience"]
    assert not loose.proven
    assert not loose.violated
    assert "keeps every limit but those not covered" in str(loose)
    assert "not covered: patience (checked at samples only" in str(loose)

    tight = front(0.7 * peak)
    broken = next(k for k in range(len(tight)) if np.isclose(tight.X[k], x).all() or certify(tight.pick(k)).violated)
    certificate = certify(tight.pick(broken))
    assert certificate.violated[-1].name == "patience"
    assert "breaks a limit" in str(certificate)
    verified = verify(tight.pick(broken))
    assert "patience" in [row.limit for row in verified.exceeded]
    assert certificate.summary["uncovered"][0]["name"] == "patience"


def test_a_constraint_that_proves_itself_has_a_row(ur5):
    short = Constraint(
        ("brevity",),
        "mine",
        lambda r: r.trajectory.duration[:, None] / 6.0 - 1.0,
        quantity="brevity",
        limit=6.0,
        unit="s",
        proof="extremes",
    )
    base = reaching(ur5)
    problem = TrajectoryProblem(
        dynamics=base.dynamics,
        interpolant=base.interpolant,
        objectives=base.objectives,
        constraints=(*base.constraints, short),
    )
    best = optimise(problem, **SMALL).knee()
    certificate = certify(best)
    row = row_of(certificate, "brevity")
    assert certificate.proven
    assert (row.bound, row.limit, row.unit) == (pytest.approx(best.F["time"]), 6.0, "s")


def test_every_constraint_of_a_problem_is_in_its_certificate(ur5):
    problem = reaching(
        ur5,
        constraints=["position", "velocity", "acceleration", "jerk", "effort", "mean_velocity"],
        overshoot=1.0,
        tool_speed=2.0,
        tool_height=-0.5,
        longest_time=6.0,
        via_error=0.01,
    )
    front = optimise(problem, **SMALL)
    for certificate in certify_all(front)[:3]:
        names = {row.name for row in certificate.rows} | {one.name for one in certificate.uncovered}
        assert set(problem.constraint_names) <= names
        assert certificate.proven


def test_the_proven_height_of_the_tool_is_below_that_of_pinocchio_everywhere(ur5):
    front = optimise(reaching(ur5, tool_height=-0.5), **SMALL)
    best = front.least("time")
    row = row_of(certify(best), "tool height")
    model, data = ur5.model, ur5.model.createData()
    frame = model.getFrameId("tool0")
    q = best.trajectory.sample(4001).q[0]
    heights = []
    for position in q:
        pin.framesForwardKinematics(model, data, position)
        heights.append(data.oMf[frame].translation[2])
    assert row.bound <= min(heights) + 1e-12
    assert min(heights) - row.bound < 2e-3
    assert row.least
    assert "-0.5 m wanted" in str(row)


def blended(**given):
    arguments = {
        "interpolant": "linear_blends",
        "objectives": ["time", "jerk"],
        "constraints": ["position", "velocity"],
    }
    robot = load_robot("puma560")
    points = np.zeros((3, robot.dof))
    points[1, :2], points[2, 0] = (0.8, 0.6), 0.2
    return ViaPointProblem(robot=robot, points=points, duration_bounds=(0.5, 4.0), **(arguments | given))


def test_how_far_points_are_missed_is_told_and_can_be_limited():
    problem = blended()
    best = optimise(problem, **SMALL).least("jerk")
    middle = best.trajectory.evaluate(problem.via_times(best.x)[0])[0, 1]
    missed = np.abs(middle - problem.interpolant.points.positions[1]).max()
    assert missed > 0.02
    row = row_of(certify(best), "via error")
    assert row.bound == pytest.approx(missed, abs=1e-12)
    assert np.isinf(row.limit)
    assert verify(best).via_error == pytest.approx(missed, abs=1e-12)
    assert "passes an inner point at" in verify(best).verdict

    limited = optimise(blended(via_error=0.01), **SMALL).least("jerk")
    row = row_of(certify(limited), "via error")
    assert row.limit == 0.01
    assert row.share <= 1.0
    assert verify(limited).via_error <= 0.01


def test_interpolants_that_meet_their_points_have_no_via_error(with_margin):
    assert "via error" not in {row.name for row in certify(with_margin.knee()).rows}
    assert verify(with_margin.knee()).via_error == 0.0
    assert reaching(with_margin.problem.robot, via_error=0.01).constraint_names[-1] == "via error"


def test_the_picture_of_efforts_shows_the_kept_limits_and_the_robots_own(with_margin):
    best = with_margin.least("time")
    axes = plots.effort_utilisation(best)
    found = effort_along(best)
    drawn = {line.get_label(): line.get_ydata() for line in axes.lines}
    np.testing.assert_allclose(found.limit, 0.8 * best.rollout.robot.limits.effort, rtol=1e-15)
    joint = found.joint_names[1]
    np.testing.assert_allclose(drawn[joint], (found.unloaded + found.mass * found.per_kilogram)[:, 1] / found.limit[1])
    assert abs(drawn["robot's full limit"][0]) == pytest.approx(1.25)  # on the side that is near
    assert axes.get_ylabel() == "effort / 80 % of the limit, with 1 kg"
