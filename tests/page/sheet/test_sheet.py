"""The sheet of a payload: its verdicts against other computations, its files, and what is refused."""

import hashlib
import json
from functools import cache

import numpy as np
import pinocchio as pin
import pytest

from trajevo import (
    Dynamics,
    Payload,
    QuinticSpline,
    Rollout,
    TrajevoError,
    ViaPointProblem,
    ViaPoints,
    dlcc,
    load_robot,
    optimise,
    payload_sheet,
)
from trajevo.base.arrays import frozen
from trajevo.page.sheet.printed import sheet_html

BASE = {"acceleration": np.inf, "jerk": np.inf}
POINTS = [[0.0, -1.2, 1.4, -1.7, -1.57, 0.0], [1.0, -0.9, 1.2, -1.9, -1.2, 0.8], [2.0, -1.3, 1.6, -1.8, -1.57, 0.0]]


@cache
def robot(drives=False):
    plain = load_robot("ur5", limits=BASE, tool="tool0")
    if not drives:
        return plain
    given = {
        name: {"continuous_torque": 0.45 * peak, "torque_speed": [[0.0, peak], [4.0, 0.0]]}
        for name, peak in zip(plain.joint_names, plain.limits.effort.tolist(), strict=True)
    }
    return load_robot("ur5", limits=BASE, tool="tool0", drives=given)


def motion(mass=5.0, duration=1.8, *, drives=False):
    spline = QuinticSpline(ViaPoints(np.array(POINTS)), duration_bounds=(0.1, 10.0))
    x = np.zeros(len(spline.variables))
    x[:2] = 0.5 * duration
    return Rollout(Dynamics(robot(drives), Payload(mass, (0.02, 0.01, 0.08))), spline(x[None]))


@cache
def sheet():
    return payload_sheet(motion(), dwell=1.0, creator="A. Engineer")


def held_and_moving(rollout, model):
    """Shares of the effort limits at rest and moving in 2,000 instants by Pinocchio, shape (2, n_joints)."""
    data, limit = model.createData(), rollout.robot.limits.effort
    t = np.linspace(0.0, rollout.trajectory.duration[0], 2000)
    q, v, a = (rollout.trajectory.evaluate(t, order)[0] for order in range(3))
    zero = np.zeros(6)
    held = [np.abs(pin.rnea(model, data, x, zero, zero)) for x in q]
    moving = [np.abs(pin.rnea(model, data, *state)) for state in zip(q, v, a, strict=True)]
    return np.max(held, axis=0) / limit, np.max(moving, axis=0) / limit


def loaded_model(rollout, more=()):
    model = rollout.robot.model.copy()
    frame = model.frames[model.getFrameId("tool0")]
    payload = rollout.dynamics.payload
    body = pin.Inertia(payload.mass, np.array(payload.com), np.zeros((3, 3)))
    model.appendBodyToJoint(frame.parentJoint, body, frame.placement)
    for joint, mass, com in more:
        body = pin.Inertia(mass, np.array(com), np.zeros((3, 3)))
        model.appendBodyToJoint(model.getJointId(joint), body, pin.SE3.Identity())
    return model


def test_static_and_dynamic_shares_are_those_of_pinocchio():
    rollout = motion()
    held, moving = held_and_moving(rollout, loaded_model(rollout))
    np.testing.assert_allclose([axis.share for axis in sheet().static.axes], held, rtol=1e-3, atol=1e-9)
    proven = np.array([axis.share for axis in sheet().dynamic.axes])
    assert (proven >= moving - 1e-9).all()
    np.testing.assert_allclose(proven, moving, atol=2e-3)
    assert sheet().dynamic.proven
    assert sheet().verdict == "within limits"
    assert sheet().static.binding.joint == rollout.robot.joint_names[int(held.argmax())]
    assert sheet().capacity.mass == dlcc(rollout).mass
    assert sheet().margin == pytest.approx(dlcc(rollout).mass / 5.0 - 1.0)
    assert sheet().cycles_per_hour == pytest.approx(3600.0 / 2.8)


def test_a_load_that_is_too_heavy_in_motion_alone_is_overloaded_there():
    fast = payload_sheet(motion(mass=5.0, duration=0.7))
    assert fast.static.word == "within limits"
    assert fast.dynamic.word == "overloaded"
    assert fast.verdict == "overloaded"
    assert fast.dynamic.binding.joint in str(fast)
    both = payload_sheet(motion(mass=60.0))
    assert both.static.word == both.dynamic.word == "overloaded"
    assert both.margin < 0.0


def test_supplementary_loads_act_through_the_dynamics():
    rollout = motion()
    more = [("elbow_joint", 4.0, (-0.2, 0.05, 0.1)), ("shoulder_lift_joint", 2.0, (0.0, 0.0, 0.0))]
    given = {joint: {"mass": mass, "com": list(com)} for joint, mass, com in more}
    loaded = payload_sheet(rollout, supplementary=given)
    held, moving = held_and_moving(rollout, loaded_model(rollout, more))
    np.testing.assert_allclose([axis.share for axis in loaded.static.axes], held, rtol=1e-3, atol=1e-9)
    np.testing.assert_allclose([axis.share for axis in loaded.dynamic.axes], moving, atol=2e-3)
    assert loaded.capacity.mass < sheet().capacity.mass
    assert [one["joint"] for one in json.loads(loaded.to_json())["supplementary_loads"]] == [
        joint for joint, *_ in more
    ]
    assert rollout.robot.mass == pytest.approx(robot().mass)


def test_drives_are_judged_over_the_cycle():
    driven = payload_sheet(motion(drives=True), dwell=1.0)
    rms = next(one for one in driven.duty if "RMS" in one.about)
    assert rms.binding.joint == "shoulder_lift_joint"
    assert rms.binding.share == pytest.approx(rms.binding.value / rms.binding.limit)
    assert "Drives" in sheet_html(driven)
    assert not sheet().duty
    slow = payload_sheet(motion(duration=6.0, drives=True), dwell=1.0)
    assert driven.cycles_per_hour > slow.cycles_per_hour


def test_a_load_too_much_for_the_drives_alone_leaves_no_margin_whatever_the_efforts_would_bear():
    driven = payload_sheet(motion(mass=5.5, drives=True), dwell=1.0)
    assert driven.verdict == "overloaded"
    assert driven.capacity.mass > 5.5 > driven.drive_capacity.mass
    assert driven.drive_capacity.cause == "rms_torque"
    assert driven.margin == pytest.approx(driven.drive_capacity.mass / 5.5 - 1.0)
    assert driven.margin < 0.0 < sheet().margin
    told = json.loads(driven.to_json())["largest_payload_by_drives"]
    assert told["mass_kg"] == driven.drive_capacity.mass
    at_limit = payload_sheet(motion(mass=driven.drive_capacity.mass, drives=True), dwell=1.0)
    assert max(one.binding.share for one in at_limit.duty) == pytest.approx(1.0, abs=1e-5)
    assert "neither heat nor RMS torque" in str(sheet())
    assert "neither heat nor RMS torque" not in str(driven)


def test_the_files_need_no_network_and_hold_the_same(tmp_path):
    page, data = sheet().save(tmp_path / "sheet.html")
    text = page.read_text()
    assert "<script" not in text
    assert "http" not in text.replace("http-equiv", "")
    for word in ("A. Engineer", "within limits", "Made by", "Approved by", sheet().certificate_hash, "ur5", "KUKA"):
        assert word in text
    told = json.loads(data.read_text())
    assert told["schema_version"] == 1
    assert told["load"]["mass_kg"] == 5.0
    assert told["verdict"] == "within limits"
    assert told["static"]["binding"] == sheet().static.binding.joint
    canonical = json.dumps(told["certificate"], sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    assert hashlib.sha256(canonical.encode()).hexdigest() == told["certificate_sha256"]
    assert "Payload sheet: within limits" in sheet()._repr_html_()


def test_another_motion_has_another_hash_and_the_same_one_the_same():
    assert payload_sheet(motion()).certificate_hash == sheet().certificate_hash
    assert payload_sheet(motion(mass=5.001)).certificate_hash != sheet().certificate_hash


def test_what_is_written_is_escaped(tmp_path):
    page, _ = payload_sheet(motion(), creator="<script>alert(1)</script>").save(tmp_path / "sheet.html")
    assert "<script" not in page.read_text()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"dwell": -1.0}, "dwell: expected a time from 0 on"),
        ({"dwell": float("nan")}, "dwell: expected a time from 0 on"),
        ({"dwell": "1 s"}, "dwell: expected a time from 0 on"),
        ({"creator": 3}, "creator: expected a name"),
        ({"supplementary": [1]}, "supplementary: expected joints with their loads"),
        ({"supplementary": {"elbow_jont": 1.0}}, "elbow_joint"),
        ({"supplementary": {"elbow_joint": -1.0}}, "supplementary: elbow_joint: payload.mass: expected"),
        ({"supplementary": {"elbow_joint": {"mass": 1.0, "model": "weight_only"}}}, "expected a rigid load"),
    ],
)
def test_what_is_refused(given, said):
    with pytest.raises(TrajevoError, match=said):
        payload_sheet(motion(), **given)


def test_several_motions_and_a_json_file_are_refused(tmp_path):
    one = motion()
    spline = QuinticSpline(ViaPoints(np.array(POINTS)), duration_bounds=(0.1, 10.0))
    two = Rollout(one.dynamics, spline(frozen(np.full((2, len(spline.variables)), 0.5))))
    with pytest.raises(TrajevoError, match="expected one motion, got 2"):
        payload_sheet(two)
    with pytest.raises(TrajevoError, match=r"sheet\.html"):
        sheet().save(tmp_path / "sheet.json")


def test_a_solution_of_a_front_has_its_sheet():
    problem = ViaPointProblem(robot=robot(), points=POINTS, payload=5.0, objectives=("time", "energy"))
    knee = optimise(problem, seed=1, generations=2, population=20, polish=False, progress=False).knee()
    own, made = knee.sheet(dwell=1.0, creator="A. Engineer"), payload_sheet(knee, dwell=1.0, creator="A. Engineer")
    assert own.certificate_hash == made.certificate_hash
    assert own.to_json() == made.to_json()
