"""What is told before a search: statics against Pinocchio, collisions, least times that no motion beats."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
import ruckig

from tests.helpers import POINTS, any_problem, mostly_long, refused, small_problem, suited
from trajevo import (
    TrajevoError,
    ViaPointProblem,
    ViaPoints,
    check,
    load_robot,
    load_task,
    optimise,
    read_run,
    report,
    resume,
    robust_problem,
    stop_and_go,
)
from trajevo.formulation.constraints.scene import Box, Scene
from trajevo.formulation.feasibility.findings import at_least, at_most, of
from trajevo.formulation.feasibility.known_points import known_points
from trajevo.formulation.feasibility.least_times import SpeedLimits, from_rest, least_times
from trajevo.robot.joints import Sides
from trajevo.robot.payload import Payload, carrying
from trajevo.solvers.run.runs import standing
from trajevo.trajectory.interpolants import THROUGH_POINTS

#: Two links in a vertical plane; the first motor is too weak to hold both stretched out.
WEAK = """<?xml version="1.0"?>
<robot name="two_weak">
  <link name="base"/>
  <link name="l1"><inertial><origin xyz="0.2 0 0"/><mass value="2"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.03"/></inertial></link>
  <link name="l2"><inertial><origin xyz="0.15 0 0"/><mass value="1"/>
    <inertia ixx="0.005" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
  <link name="tcp"/>
  <joint name="a" type="revolute"><parent link="base"/><child link="l1"/><origin xyz="0 0 0.3"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" velocity="2" effort="8"/></joint>
  <joint name="b" type="revolute"><parent link="l1"/><child link="l2"/><origin xyz="0.4 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" velocity="2" effort="4"/></joint>
  <joint name="t" type="fixed"><parent link="l2"/><child link="tcp"/><origin xyz="0.3 0 0"/></joint>
</robot>
"""
ALL = ("position", "velocity", "acceleration", "jerk", "effort")
LIMITS = {"acceleration": 10.0, "jerk": 100.0}
STRETCHED = [[0.0, 0.0], [0.4, 0.2], [-1.2, 0.3]]
UR5 = [
    [0.0, -1.5, 1.5, -1.5, -1.5, 0.0],
    [0.5, -1.2, 1.4, -1.7, -1.5, 0.2],
    [0.9, -1.4, 1.5, -1.6, -1.5, 0.0],
]


@pytest.fixture(scope="module")
def weak(tmp_path_factory):
    file = tmp_path_factory.mktemp("robots") / "two_weak.urdf"
    file.write_text(WEAK)
    return load_robot(file, limits=LIMITS)


def weak_problem(robot, points=STRETCHED, **arguments):
    return ViaPointProblem(**({"robot": robot, "points": points, "constraints": ALL} | arguments))


def ur5_problem(**arguments):
    robot = load_robot("ur5", tool="tool0", limits=LIMITS)
    given = {"robot": robot, "points": UR5, "constraints": ALL, "duration_bounds": (0.3, 4.0)}
    return ViaPointProblem(**(given | arguments))


def test_gravity_beyond_a_motor_is_told_with_point_joint_and_need(weak):
    found = check(weak_problem(weak))
    (finding,) = found.impossible
    assert finding.sentence == "holding point 0 takes 9.32 of 8 N·m on a"
    assert (finding.kind, finding.point, finding.joint, finding.unit) == ("effort", 0, "a", "N·m")
    assert finding.needed == pytest.approx(9.80665 * (2.0 * 0.2 + 1.0 * 0.55), rel=1e-12)
    assert finding.available == 8.0
    assert "a limit of at least 9.32 N·m" in finding.remedy
    assert str(found).count("\n") < 10


def test_an_inner_point_that_cannot_be_held_is_a_warning_since_a_motion_may_swing_through_it(weak):
    found = check(weak_problem(weak, [[1.5, 0.0], [0.0, 0.0], [-1.5, 0.0]]))
    assert found.impossible == ()
    (warned,) = found.findings
    assert (warned.severity, warned.point) == ("warning", 1)
    assert "only a motion that does not rest there may pass it" in warned.sentence


def test_efforts_at_rest_are_those_of_pinocchio():
    payload = Payload(3.0, com=(0.05, -0.02, 0.1))
    problem = ur5_problem(payload=payload, effort_margin=0.25)
    model = carrying(problem.robot, payload)
    held = [np.abs(pin.computeGeneralizedGravity(model, model.createData(), np.array(q))) for q in UR5]
    expected = held / (0.75 * problem.robot.limits.effort)
    np.testing.assert_allclose(check(problem).effort_used, expected, rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize(("mass", "severity"), [(1.0, None), (300.0, "impossible")])
def test_a_payload_of_300_kg_is_refused_with_the_mass_that_can_be_held(mass, severity):
    problem = ur5_problem(payload=mass)
    found = check(problem)
    assert {finding.severity for finding in found.findings if finding.kind == "effort" and finding.point == 0} == (
        {severity} - {None}
    )
    if severity is None:
        assert found.findings == ()
        return
    (finding,) = [finding for finding in found.impossible if finding.point == 0]
    assert finding.joint == "shoulder_lift_joint"
    held = float(finding.remedy.split("at most ")[1].split(" kg")[0])
    assert not check(ur5_problem(payload=held, points=[UR5[0], UR5[1], UR5[0]])).impossible
    assert check(ur5_problem(payload=1.006 * held, points=[UR5[0], UR5[1], UR5[0]])).impossible


def test_the_margin_counts_and_giving_it_up_is_a_remedy():
    free = check(ur5_problem(payload=20.0)).effort_used.max(axis=1)
    margin = 1.0 - 0.97 * free[0]
    found = check(ur5_problem(payload=20.0, effort_margin=margin))
    (finding,) = [finding for finding in found.impossible if finding.point == 0]
    assert "(150 N·m less the margin)" in finding.sentence
    allowed = float(finding.remedy.split("an effort_margin of at most ")[1].split(",")[0])
    assert not [f for f in check(ur5_problem(payload=20.0, effort_margin=allowed)).impossible if f.point == 0]
    assert allowed == pytest.approx(1.0 - free[0], abs=1e-3)


def test_nearly_all_of_a_limit_is_a_warning():
    used = check(ur5_problem(payload=1.0)).effort_used.max()
    found = check(ur5_problem(payload=1.0, effort_margin=1.0 - used / 0.97))
    assert not found.impossible
    (warned,) = found.findings
    assert warned.severity == "warning"
    assert warned.needed / warned.available == pytest.approx(0.97)


def test_without_effort_limits_nothing_is_said_about_efforts(weak):
    found = check(weak_problem(weak, constraints=("position", "velocity")))
    assert found.effort_used is None
    assert found.findings == ()


def test_a_variable_payload_is_judged_by_its_best_mass(weak):
    points = [[1.2, 0.1], [1.4, 0.2], [1.3, 0.3]]
    variable = {"objectives": ("time", "unused_payload"), "points": points}
    usual = check(weak_problem(weak, **variable))
    assert not usual.impossible
    alone = check(weak_problem(weak, points)).effort_used
    assert (usual.effort_used <= alone + 1e-12).all()
    (finding,) = check(weak_problem(weak, **variable, payload_range=(50.0, 60.0))).impossible[:1]
    held = float(finding.remedy.split("at most ")[1].split(" kg")[0])
    assert not [f for f in check(weak_problem(weak, points, payload=held)).impossible if f.point == finding.point]


def test_no_common_mass_of_a_variable_payload_is_impossible(tmp_path):
    """The tool sits behind the elbow: stretched out, a payload is a counterweight, folded back it is a load."""
    (tmp_path / "two.urdf").write_text(WEAK.replace('xyz="0.3 0 0"', 'xyz="-0.8 0 0"'))
    robot = load_robot(tmp_path / "two.urdf", limits=LIMITS)
    stretched, folded = [0.0, 0.0], [2.95, -2.95]
    objectives = {"objectives": ("time", "unused_payload"), "payload_range": (0.0, 5.0)}
    for end in (stretched, folded):
        assert not check(weak_problem(robot, [end, [1.5, -1.5], end], **objectives)).impossible
    (finding,) = check(weak_problem(robot, [stretched, [1.5, -1.5], folded], **objectives)).impossible
    assert (finding.kind, finding.unit) == ("payload", "kg")
    assert finding.sentence == "no payload of 0 to 5 kg can be held at rest at both ends"
    assert finding.needed == pytest.approx((9.80665 * 0.95 - 8.0) / (9.80665 * 0.4))
    assert finding.available < finding.needed


def test_a_box_of_payloads_is_judged_by_its_worst():
    problem = ur5_problem(payload=5.0)
    box = robust_problem(problem, mass=[0.0, 30.0], com=[[-0.05] * 3, [0.05] * 3])
    corners = [
        check(ur5_problem(payload=Payload(30.0, com=(x, y, z)))).effort_used
        for x in (-0.05, 0.05)
        for y in (-0.05, 0.05)
        for z in (-0.05, 0.05)
    ]
    found = check(box)
    np.testing.assert_allclose(found.effort_used, np.max(corners, axis=0), rtol=1e-6, atol=1e-15)
    assert {finding.point for finding in found.impossible} == {0, 2}


def test_a_collision_at_a_point_names_point_and_bodies():
    tool = ur5_problem().robot.tool_poses(np.array(UR5[1:2]))[0][0]
    scene = Scene((Box(position=tuple(tool.tolist()), size=(0.1, 0.1, 0.1), name="post"),), clearance=0.02)
    found = check(ur5_problem(scene=scene))
    (finding,) = found.impossible
    assert (finding.kind, finding.point) == ("clearance", 1)
    assert finding.sentence.startswith("point 1 is in collision: wrist_3_link and post overlap")
    assert found.clearance[1] < 0.0 < found.clearance[0]
    moved = check(ur5_problem(scene=scene, moving=[{"point": 1, "joints": [0.5] * 6}]))
    assert moved.impossible == ()
    (note,) = moved.findings
    assert (note.severity, note.sentence.split(", ")[-1]) == ("note", "where it is given")


def test_a_clearance_that_is_too_small_gives_the_one_there_is():
    tool = ur5_problem().robot.tool_poses(np.array(UR5[:1]))[0][0]
    post = Box(position=(*tool[:2].tolist(), float(tool[2]) - 0.3), size=(0.1, 0.1, 0.1), name="post")
    found = check(ur5_problem(scene=Scene((post,), clearance=0.5)))
    (finding,) = [finding for finding in found.impossible if finding.point == 0]
    assert " of 500 mm between wrist_" in finding.sentence
    allowed = float(finding.remedy.split("a clearance of at most ")[1].split(" m")[0])
    assert finding.available - 1e-3 < allowed <= finding.available


def test_a_tool_below_its_least_height_is_impossible():
    height = ur5_problem().robot.tool_poses(np.array(UR5))[0][:, 2]
    least = float(np.sort(height)[:2].mean())
    found = check(ur5_problem(tool_height=least))
    (finding,) = found.impossible
    assert finding.point == int(height.argmin())
    assert finding.available == pytest.approx(height.min())
    assert not check(ur5_problem(tool_height=float(finding.remedy.split("at most ")[1].split(" m")[0]))).impossible


def test_an_inner_point_on_a_limit_is_a_note(weak):
    found = check(weak_problem(weak, [[1.5, 3.0], [1.2, 3.0], [1.4, 0.0]], constraints=ALL[:4]))
    (note,) = found.notes
    assert note.startswith("point 1 lies on the upper limit of 'b', 3 rad: the joint is at rest there")
    assert f"note: {note}" in str(found)
    assert not found.findings


def test_a_longest_time_below_the_least_times_is_impossible(weak):
    points = [[1.5, 0.0], [1.2, 0.4], [-1.5, 0.0]]
    problem = weak_problem(weak, points, duration_bounds=(0.05, 4.0), longest_time=1.0)
    (finding,) = check(problem).impossible
    assert finding.sentence.startswith("the whole motion takes at least ")
    least = float(finding.remedy.split("at least ")[1].split(" s")[0])
    assert finding.needed <= least <= 1.01 * finding.needed
    assert not check(weak_problem(weak, points, duration_bounds=(0.05, 4.0), longest_time=least)).impossible
    bounds = weak_problem(weak, points, duration_bounds=(2.0, 4.0), longest_time=3.9)
    assert [f.needed for f in check(bounds).impossible] == [4.0]


def test_a_greatest_duration_below_a_least_time_is_impossible(weak):
    points = [[1.5, 0.0], [1.2, 0.4], [-1.5, 0.0]]
    found = check(weak_problem(weak, points, duration_bounds=(0.05, 1.2)))
    (finding,) = found.impossible
    assert (finding.point, finding.joint, finding.available) == (1, "a", pytest.approx(1.2))
    assert finding.needed >= 2.7 / 2.0
    greatest = float(finding.remedy.split("at least ")[1].split(" s")[0])
    assert not check(weak_problem(weak, points, duration_bounds=(0.05, greatest))).impossible


def test_the_time_from_rest_is_that_of_the_integral_of_the_greatest_speed():
    rng = np.random.default_rng(1)
    for _ in range(200):
        D, V, A, J = 10.0 ** rng.uniform(-2, 2, 4)
        T = float(from_rest(D, V, A, J))
        t = np.linspace(0.0, T, 200001)
        u = np.where(t <= A / J, 0.5 * J * t**2, A * (t - 0.5 * A / J))
        assert np.trapezoid(np.minimum(V, u), t) == pytest.approx(D, rel=1e-5)


def test_limits_that_are_not_there_take_no_time():
    inf = np.inf
    assert from_rest(2.0, 4.0, inf, inf) == pytest.approx(0.5)
    assert from_rest(2.0, inf, 4.0, inf) == pytest.approx(1.0)
    assert from_rest(4.0, inf, inf, 3.0) == pytest.approx(2.0)
    assert from_rest(2.0, inf, inf, inf) < 1e-9
    assert from_rest(0.0, 1.0, 1.0, 1.0) == 0.0


def test_no_motion_from_rest_to_rest_is_faster_than_the_least_time():
    rng = np.random.default_rng(2)
    for _ in range(100):
        D, V, A, J = 10.0 ** rng.uniform(-2, 2, 4)
        free = SpeedLimits(*(Sides.of(np.array([x])) for x in (V, A, np.inf)), np.inf)
        trapezoid = D / V + V / A if D > V**2 / A else 2.0 * np.sqrt(D / A)
        assert free.least(np.array([D]), rests=2)[0] == pytest.approx(trapezoid, rel=1e-9)
        inputs, found = ruckig.InputParameter(1), ruckig.Trajectory(1)
        inputs.current_position, inputs.target_position = [0.0], [D]
        inputs.max_velocity, inputs.max_acceleration, inputs.max_jerk = [V], [A], [J]
        ruckig.Ruckig(1).calculate(inputs, found)
        bound = replace(free, jerk=Sides.of(np.array([J]))).least(np.array([D]), rests=2)[0]
        assert trapezoid * (1.0 - 1e-9) <= bound <= found.duration * (1.0 + 1e-9)


@pytest.mark.thinned(3)
@pytest.mark.parametrize("interpolant", THROUGH_POINTS)
def test_no_feasible_motion_of_any_interpolant_beats_the_least_times(weak, interpolant):
    points = [[1.5, 0.0], [1.2, 0.9], [1.0, 0.2], [1.4, -0.6]]
    given = {"constraints": ALL[:4], "objectives": ["time"], "duration_bounds": (0.02, 5.0), "limits": "sampled"}
    problem = weak_problem(weak, points, **suited(interpolant, given))
    given = known_points(problem)
    times = least_times(problem, given)
    drawn = 16_000 if interpolant == "bspline" else 4000  # most of its motions leave the ranges of the joints
    x = np.random.default_rng(3).uniform(0.02, 1.5, (drawn, problem.n_var))
    x = np.clip(x, problem.xl, problem.xu)
    G = problem.evaluate(x, return_values_of=["G"])
    feasible = x[(G <= 0.0).all(axis=1)]
    assert len(feasible) > 5
    instants = problem.via_times(feasible)
    for time in times:
        assert ((instants[:, time.last] - instants[:, time.first]) >= time.seconds * (1.0 - 1e-9)).all()
    assert times[-1].seconds > 0.5
    assert (given.shortest >= 0.0199).all()


@pytest.mark.parametrize("seed", mostly_long(range(24), *range(8)))
def test_limits_that_a_motion_just_keeps_are_never_called_impossible(weak, seed):
    """Any motion, and a robot whose limits are what that motion uses: it is feasible, so nothing may rule it out."""
    rng = np.random.default_rng(seed)
    points = np.cumsum(rng.uniform(-0.5, 0.5, (int(rng.integers(4, 7)), 2)), axis=0)
    interpolant = list(THROUGH_POINTS)[seed % len(THROUGH_POINTS)]
    moving = [{"point": 1, "joints": [0.2, 0.1]}] if seed % 4 == 3 and interpolant != "polynomial" else []
    given = {"moving": moving, "constraints": ALL, "objectives": ["time"], "limits": "sampled", "payload": 0.4}
    given = suited(interpolant, given)
    wide = ViaPointProblem(robot=weak, points=points, duration_bounds=(0.05, 3.0), **given)
    x = rng.uniform(wide.xl, wide.xu)
    rollout = wide.rollout(x[None])
    motion = rollout.trajectory
    peaks = {name: motion.peak(k)[0] for k, name in ((1, "velocity"), (2, "acceleration"), (3, "jerk"))}
    peaks["effort"] = np.abs(rollout.effort).max(axis=(0, 1))
    limits = {name: (peak * (1.0 + 1e-9)).tolist() for name, peak in peaks.items()}
    # With their units, as overshooting polynomials and cubics go farther and faster than is believed without.
    limits["velocity"] = [f"{peak!r} rad/s" for peak in limits["velocity"]]
    limits["position"] = ["-1e4 rad", "1e4 rad"]
    robot = load_robot(weak.urdf, limits=limits)
    durations = x[: wide.n_var if not moving else -2]
    longest = float(durations.max()) * (1.0 + 1e-9)
    tight = ViaPointProblem(
        robot=robot,
        points=points,
        duration_bounds=(0.04, longest),
        longest_time=float(motion.duration[0]) * (1.0 + 1e-9),
        **given,
    )
    assert (tight.evaluate(x[None], return_values_of=["G"]) <= 0.0).all()
    assert check(tight).impossible == ()


@pytest.mark.parametrize("profile", ["trapezoid", "double_s", "septic"])
def test_stopping_motions_do_not_beat_the_least_times_either(weak, profile):
    points = [[1.5, 0.0], [1.2, 0.9], [1.0, 0.2], [1.4, -0.6]]
    constraints = ALL[:3] if profile == "trapezoid" else ALL[:4]
    problem = weak_problem(weak, points, constraints=constraints, duration_bounds=(0.01, 9.0))
    motion = stop_and_go(ViaPoints(np.array(points)), weak.limits, profile=profile, straight=False)
    assert check(problem).least_times[-1].seconds <= motion.duration[0]


@pytest.mark.parametrize("name", ["pointing", "hybrid", "pick-place", "reparam"])
def test_every_problem_can_be_checked_and_none_of_the_papers_is_impossible(name):
    found = check(any_problem(name))
    assert found.impossible == ()
    assert len(str(found).splitlines()) < 40
    assert found.verdict.startswith("nothing rules a motion out")


@pytest.mark.parametrize("path", ["s", "gemini"])
def test_the_least_time_along_a_path_counts_its_whole_length(path):
    problem = any_problem("reparam", path=path)
    whole = check(problem).least_times[-1].seconds
    u = np.linspace(0.0, 1.0, 5001)
    ways = np.abs(np.diff(problem.interpolant.path(u), axis=0)).sum(axis=0)
    assert whole > (ways / problem.robot.limits.velocity).max()
    x = np.random.default_rng(5).uniform(problem.xl, problem.xu, (50, problem.n_var))
    assert whole < problem.decode(x).duration.min()


def test_motions_without_points_in_common_have_nothing_said_about_them(monkeypatch):
    problem = small_problem()

    def never(x):
        raise RuntimeError("no licence")

    monkeypatch.setattr(problem, "decode", never)
    found = check(problem)
    assert (found.findings, found.least_times, len(found.points)) == ((), (), 0)
    assert "nothing can be said before the search" in str(found)
    refused(lambda: check(POINTS), "problem: expected a TrajectoryProblem, got ViaPoints")


def test_many_points_and_findings_still_fit_a_screen(weak):
    angles = np.linspace(-0.5, 0.5, 60)
    points = np.column_stack([angles, 0.3 * np.sin(9.0 * angles)])
    printed = str(check(weak_problem(weak, points)))
    assert len(printed.splitlines()) < 40
    assert "and 44 more points, with more room" in printed
    assert "more findings" in printed


def test_a_search_that_cannot_succeed_is_not_begun(weak, tmp_path):
    problem = weak_problem(weak, objectives=("time", "energy"))
    front = optimise(problem, seed=1, generations=1000, out=tmp_path / "run", progress=False)
    assert len(front) == 0
    assert front.run.evaluations == 0
    assert "nothing was searched" in str(front.blocking)
    assert "holding point 0 takes 9.32 of 8 N·m on a" in str(front.blocking)
    with pytest.raises(TrajevoError, match="the front is empty: nothing was searched.*9.32 of 8"):
        front.knee()
    assert read_run(tmp_path / "run") == front
    assert standing(tmp_path / "run").finished
    again = resume(tmp_path / "run", progress=False)
    assert again.blocking == front.blocking
    report(front, tmp_path / "report.html")
    assert "9.32 of 8" in (tmp_path / "report.html").read_text()


def test_a_possible_search_is_the_same_as_before(weak):
    front = optimise(
        weak_problem(weak, [[1.5, 0.0], [1.2, 0.4], [1.4, 0.8]]), seed=1, generations=3, population=12, progress=False
    )
    assert front.blocking is None or not front.blocking.impossible
    assert front.run.evaluations > 0


def test_worked_tasks_are_possible():
    for name in ("ur5_pick_and_place", "panda_six_points", "xarm7_obstacle", "hybrid_manipulator"):
        assert check(load_task(name).problem).impossible == ()


def test_numbers_are_written_so_that_they_suffice():
    assert (at_least(9.31632), at_most(9.31632), at_least(8.0), at_most(0.0)) == ("9.32", "9.31", "8", "0")
    assert (at_least(1234.2), at_most(-0.12345)) == ("1240", "-0.124")
    assert (of(9.31632, 8.0, "N·m"), of(8.0001, 8.0, "N·m"), of(1876.4, 120.0, "N")) == (
        "9.32 of 8 N·m",
        "8.0001 of 8 N·m",
        "1876 of 120 N",
    )
