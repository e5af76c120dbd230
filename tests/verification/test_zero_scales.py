"""Robots with nothing to measure against: quantities that are 0 or rounding everywhere, joints that rest, one joint."""

from dataclasses import replace

import numpy as np
import pytest

from tests.helpers import mostly_long
from trajevo import (
    Dynamics,
    Payload,
    Rollout,
    ViaPointProblem,
    ViaPoints,
    certify,
    dlcc,
    export,
    load_robot,
    optimise,
    slowdown_for,
    verify,
)
from trajevo.base import jit
from trajevo.capacity.payload_effort import payload_effort
from trajevo.trajectory.interpolants import SinglePolynomial
from trajevo.verification.certify import certify_all


def link(name, mass=1.0, centre="0 0 0", moments=(0.01, 0.01, 0.01)):
    x, y, z = moments
    return (
        f'<link name="{name}"><inertial><origin xyz="{centre}"/><mass value="{mass}"/>'
        f'<inertia ixx="{x}" iyy="{y}" izz="{z}" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    )


def joint(name, parent, child, kind="revolute", axis="0 0 1", xyz="0 0 0"):
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/><origin xyz="{xyz}"/>'
        f'<axis xyz="{axis}"/><limit lower="-1" upper="1" velocity="1" effort="100"/></joint>'
    )


ARM = (
    link("l1", centre="0.2 0 0"),
    link("l2", centre="0.2 0 0"),
    joint("a", "l0", "l1", axis="0 1 0"),
    joint("b", "l1", "l2", axis="0 1 0", xyz="0.3 0 0"),
)
ROW = [[0.0, 0.0], [0.2, 0.3], [0.5, 0.5]]

FIRST = "tool on the common axis of both joints"

#: Links and joints, points, and gravity if it is not the usual.
ROBOTS = {
    FIRST: (
        (link("l1"), link("l2"), joint("a", "l0", "l1", xyz="0 0 0.1"), joint("b", "l1", "l2", xyz="0 0 0.1")),
        ROW,
        None,
    ),
    "the same, turning against each other": (
        (link("l1"), link("l2"), joint("a", "l0", "l1"), joint("b", "l1", "l2", axis="0 0 -1", xyz="0 0 0.1")),
        [[0.0, 0.0], [0.3, 0.3], [0.5, 0.5]],
        None,
    ),
    "all at one place": ((link("l1"), link("l2"), joint("a", "l0", "l1"), joint("b", "l1", "l2")), ROW, None),
    "no inertia about the axes": (
        (link("l1", moments=(0, 0, 0)), link("l2", moments=(0, 0, 0)), joint("a", "l0", "l1"), joint("b", "l1", "l2")),
        ROW,
        None,
    ),
    "hardly any inertia": (
        (
            link("l1", moments=(1e-12, 1e-12, 1e-12)),
            link("l2", moments=(1e-12, 1e-12, 1e-12)),
            joint("a", "l0", "l1"),
            joint("b", "l1", "l2"),
        ),
        ROW,
        None,
    ),
    "one joint that turns": (
        (link("l1", centre="0.2 0 0"), joint("a", "l0", "l1", axis="0 1 0")),
        [[0], [0.3], [0.1]],
        None,
    ),
    "one joint that slides": ((link("l1"), joint("a", "l0", "l1", "prismatic")), [[0], [0.3], [0.1]], None),
    "a joint that rests": (ARM, [[0.0, 0.2], [0.3, 0.2], [0.1, 0.2]], None),
    "a joint that rests on its limit": (ARM, [[0.0, 1.0], [0.3, 1.0], [0.1, 1.0]], None),
    "no gravity": (ARM, [[0.0, 0.2], [0.3, 0.1], [0.1, 0.2]], [0.0, 0.0, 0.0]),
    "joints that slide": (
        (
            *(link(f"l{k}") for k in (1, 2, 3)),
            joint("a", "l0", "l1", "prismatic", "1 0 0"),
            joint("b", "l1", "l2", "prismatic", "0 1 0"),
            joint("c", "l2", "l3", "prismatic", "0 0 1"),
        ),
        [[0.0, 0.0, 0.0], [0.2, 0.3, 0.1], [0.5, 0.5, 0.2]],
        None,
    ),
    "joints that slide without gravity": (
        (
            link("l1"),
            link("l2"),
            joint("a", "l0", "l1", "prismatic", "1 0 0"),
            joint("b", "l1", "l2", "prismatic", "0 1 0"),
        ),
        ROW,
        [0.0, 0.0, 0.0],
    ),
}


CASES = [*((name, 0.0) for name in ROBOTS), (FIRST, 0.5), ("one joint that turns", 0.5)]


@pytest.fixture(scope="module", params=mostly_long(CASES, *CASES[::6]), ids=str)
def front(request, tmp_path_factory):
    """A small front of one of the robots, without compiling, which takes longer than all the rest."""
    name, payload = request.param
    parts, points, gravity = ROBOTS[name]
    file = tmp_path_factory.mktemp("robot") / "robot.urdf"
    file.write_text(f'<robot name="r"><link name="l0"/>{"".join(parts)}</robot>', encoding="utf-8")
    robot = {"name": str(file), "limits": {"acceleration": 10.0, "jerk": 100.0}, "gravity": gravity}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(jit, "can_compile", lambda: False)
        problem = ViaPointProblem(
            robot={key: value for key, value in robot.items() if value is not None},
            points=points,
            payload=payload,
            objectives=("time", "energy"),
            constraints=("position", "velocity", "acceleration", "jerk", "effort"),
        )
        yield optimise(problem, seed=1, population=12, generations=5, progress=False, polish=False)


@pytest.mark.thinned(2)
@pytest.mark.parametrize("every", mostly_long([1, 10], 10))
def test_motions_are_certified_and_the_gaps_are_numbers(front, every):
    some = replace(front, **{name: getattr(front, name)[::every] for name in "XFG"})
    for certificate in (*certify_all(some), certify(front.knee())):
        assert certificate.proven, str(certificate)
        assert certificate.gap < 0.01
        assert certificate.pieces < 100
        for row in certificate.rows:
            assert np.isfinite([row.bound, row.exhibited, row.share, row.gap]).all()
            assert row.bound >= row.exhibited * (1.0 - 1e-12)
            if row.exhibited < 1e-12:
                assert row.bound < 1e-4, f"{row.name} is only rounding"


def test_verified_and_carried_and_slowed(front):
    best = front.knee()
    found = verify(best)
    assert found.passed, found.verdict
    assert not np.isnan(dlcc(best).mass)
    effort = payload_effort(best)
    assert not [x for x in vars(effort).values() if isinstance(x, np.ndarray) and np.isnan(x).any()]
    scaled = slowdown_for(best, best.rollout.dynamics.payload.mass + 0.1)
    assert 0.0 < scaled.factor < np.inf


@pytest.mark.thinned(5)
@pytest.mark.parametrize("format", ["csv", "json", "netcdf", "ros2", "mujoco", "moveit"])
def test_exported(front, format, tmp_path):
    written = export(front.knee(), tmp_path / "motion", format=format)
    assert b"nan" not in written.read_bytes().lower().replace(b"nanosec", b"") or format == "netcdf"


def test_quantities_without_a_limit_are_bounded_to_the_tolerance_however_far_a_motion_goes():
    """A bound from the sizes of robot and motion must not hide behind ellipses that are larger than the motion."""
    robot, rng = load_robot("puma560"), np.random.default_rng(7)
    least, most = np.maximum(robot.limits.lower, -2.5), np.minimum(robot.limits.upper, 2.5)
    for _ in range(10):
        points = ViaPoints(0.5 * (least + most) + 0.5 * (most - least) * rng.uniform(-0.8, 0.8, (5, robot.dof)))
        times = 0.1 * 50.0 ** rng.uniform(0.3, 0.9, (1, 4))
        motion = SinglePolynomial(points, duration_bounds=(0.1, 5.0))(times)
        certificate = certify(Rollout(Dynamics(robot, Payload(2.0)), motion))
        rows = [row for row in certificate.rows if row.quantity == "power"]
        greatest = max(row.exhibited for row in rows)
        assert max(row.bound - row.exhibited for row in rows) <= 1.1e-3 * greatest
