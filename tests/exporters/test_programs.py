"""Programs for controllers and replays with loads, stops and dwells, read back by readers that know no writer."""

import csv
import json
import re

import numpy as np
import pytest
import yaml

from tests.helpers import refused
from trajevo import ViaPointProblem, export, optimise
from trajevo.exporters.events import carried, stretches
from trajevo.problems import HybridManipulator

ARM = {"name": "ur5", "tool": "tool0", "limits": {"acceleration": 10.0, "jerk": 100.0}, "gravity": (0.0, 0.0, -9.81)}
POINTS = [
    [0.0, -1.5, 1.5, -1.5, -1.5, 0.0],
    [0.8, -1.2, 1.4, -1.7, -1.5, 0.0],
    [0.4, -1.0, 1.0, -1.0, -1.0, 0.3],
    [0.2, -1.2, 1.4, -1.7, -1.5, 0.1],
    [0.0, -1.5, 1.5, -1.5, -1.5, 0.0],
]
INERTIA = [[0.010, 0.001, 0.0], [0.001, 0.012, 0.002], [0.0, 0.002, 0.009]]
PART = {"mass": 2.0, "com": (0.01, -0.02, 0.05), "inertia": INERTIA, "from": 1, "to": 3}
GRIPPER = {"mass": 1.0, "com": (0.0, 0.0, 0.03)}
SMALL = {"seed": 1, "generations": 3, "population": 12, "progress": False, "polish": False}


@pytest.fixture(scope="module")
def moved():
    """A part is picked up after a dwell, carried past a stop, and put down before a dwell."""
    task = ViaPointProblem(
        robot=ARM,
        points=POINTS,
        passing=[{"point": 1, "dwell": 0.3}, {"point": 2, "stop": True}, {"point": 3, "dwell": 0.2}],
        payload=[GRIPPER, PART],
    )
    return optimise(task, **SMALL).pick("0")


def breaks(solution):
    return solution.trajectory.breaks[0]


def both():
    """Mass, centre and inertia of gripper and part together, put together by the theorem of parallel axes."""
    masses, centres = np.array([1.0, 2.0]), np.array([GRIPPER["com"], PART["com"]])
    com = masses @ centres / 3.0
    arms = centres - com
    steiner = sum(m * (arm @ arm * np.eye(3) - np.outer(arm, arm)) for m, arm in zip(masses, arms, strict=True))
    return com, np.array(INERTIA) + steiner


def test_what_is_carried_changes_where_it_was_asked(moved):
    start, picked, placed = carried(moved.rollout)
    t = breaks(moved)
    assert len(t) == 7  # four segments and two dwells
    assert (start.t, start.payload.mass, start.changes) == (0.0, 1.0, "")
    assert (picked.t, picked.gripper) == (t[2], t[1]), "the gripper has the dwell for closing"
    assert (placed.t, placed.gripper) == (t[4], t[4]), "what is put down is so before the dwell"
    assert (picked.changes, placed.changes) == ("pick up payload.1", "put down payload.1")
    com, inertia = both()
    assert picked.payload.mass == 3.0
    np.testing.assert_allclose(picked.payload.com, com, atol=1e-15)
    np.testing.assert_allclose(picked.payload.inertia, inertia, atol=1e-15)
    assert placed.payload == start.payload


def test_stretches_are_cut_at_rests_and_are_the_motion(moved):
    found = stretches(moved.rollout, 0.1)
    t = breaks(moved)
    assert [one.dwells for one in found] == [False, True, False, False, True, False]
    np.testing.assert_array_equal([one.t[0] for one in found] + [found[-1].t[-1]], t)
    assert all(one.rests for one in found)
    assert max(np.diff(one.t).max() for one in found if not one.dwells) <= 0.1 + 1e-12
    for one in found:
        np.testing.assert_array_equal(one.q, moved.trajectory.evaluate(one.t)[0])


def test_a_load_that_goes_to_the_last_point_is_put_down_there(moved):
    task = ViaPointProblem(robot=ARM, points=POINTS, payload=[GRIPPER, {"mass": 2.0, "from": 2, "to": 4}])
    solution = optimise(task, **SMALL).pick("0")
    *_, picked, placed = carried(solution.rollout)
    assert picked.t == breaks(solution)[2]
    assert (placed.t, placed.changes, placed.payload.mass) == (breaks(solution)[-1], "put down payload.1", 1.0)
    cycle = ViaPointProblem(robot=ARM, points=POINTS, cyclic=True, payload=[GRIPPER, {"mass": 2.0, "from": 3, "to": 1}])
    across = carried(optimise(cycle, **SMALL).pick("0").rollout)
    assert [one.changes for one in across] == ["", "put down payload.1", "pick up payload.1"]
    assert across[0].payload.mass == 3.0


def angles(text):
    return [float(value) for value in re.findall(r"-?\d+\.?\d*", text)]


def rapid_of(text):
    """Targets [deg] with their times and zones, waits, and loads by the instructions of a module."""
    loads = dict(re.findall(r"PERS loaddata (\w+) := (.*);", text))
    steps = []
    for line in map(str.strip, text.splitlines()):
        if line.startswith("MoveAbsJ"):
            target, time, zone = re.fullmatch(
                r"MoveAbsJ \[\[(.*)\], \[9E\+09(?:, 9E\+09){5}\]\], v\d+(?:\\T:=([\d.]+))?, (\w+), tool0;", line
            ).groups()
            steps.append(("move", angles(target), None if time is None else float(time), zone))
        elif line.startswith("WaitTime"):
            steps.append(("wait", float(re.fullmatch(r"WaitTime ([\d.]+);", line)[1])))
        elif line.startswith("GripLoad"):
            name = re.fullmatch(r"GripLoad (\w+);", line)[1]
            steps.append(("load", json.loads(f"{loads[name]}")))
    return steps


def krl_of(text):
    steps, load, speed = [], {}, None
    for line in text.splitlines():
        if line.startswith("PTP"):
            target, rounded = re.fullmatch(r"PTP \{(.*)\}( C_PTP)?", line).groups()
            steps.append(("move", [float(each.split()[1]) for each in target.split(", ")], speed, bool(rounded)))
        elif line.startswith("BAS(#VEL_PTP"):
            speed = int(re.fullmatch(r"BAS\(#VEL_PTP, (\d+)\)", line)[1])
        elif line.startswith("WAIT"):
            steps.append(("wait", float(re.fullmatch(r"WAIT SEC ([\d.]+)", line)[1])))
        elif line.startswith("$LOAD"):
            key, value = line.removeprefix("$LOAD.").split(" = ")
            load[key] = float(value) if key == "M" else [float(each.split()[1]) for each in value[1:-1].split(", ")]
            if key == "J":
                steps.append(("load", dict(load)))
    return steps


def fanuc_of(text):
    motion, places = text.split("/MN\n")[1].split("/POS\n")
    positions = {
        int(number): [float(value) for value in re.findall(r"J\d= (-?[\d.]+) deg", inside)]
        for number, inside in re.findall(r"P\[(\d+)\]\{(.*?)\};", places, re.DOTALL)
    }
    steps = []
    for k, line in enumerate(motion.splitlines(), start=1):
        number, row = re.fullmatch(r" *(\d+):  (.*) ;", line).groups()
        assert int(number) == k
        move = re.fullmatch(r"J P\[(\d+)\] (\d+)(%|msec) (FINE|CNT100)", row)
        if move:
            time = int(move[2]) / 1e3 if move[3] == "msec" else None
            steps.append(("move", positions[int(move[1])], time, move[4]))
        elif row.startswith("WAIT"):
            steps.append(("wait", float(re.fullmatch(r"WAIT ([\d.]+)\(sec\)", row)[1])))
        elif row.startswith("PAYLOAD"):
            steps.append(("load", int(re.fullmatch(r"PAYLOAD\[(\d+)\]", row)[1])))
        else:
            assert row.startswith("!")
            assert len(row) <= 33
    return steps


READERS = {"rapid": rapid_of, "krl": krl_of, "fanuc": fanuc_of}
FINE = {"rapid": "fine", "krl": False, "fanuc": "FINE"}


@pytest.mark.parametrize("name", READERS)
def test_a_program_of_points_reads_back_as_the_motion(moved, tmp_path, name):
    steps = READERS[name](export(moved, tmp_path / "motion", format=name, step=0.05).read_text())
    t, q = breaks(moved), moved.trajectory
    parts = stretches(moved.rollout, 0.05)
    expected = np.degrees(np.concatenate([q.evaluate(np.zeros(1))[0], *(one.q[1:] for one in parts if not one.dwells)]))
    targets = [step for step in steps if step[0] == "move"]
    np.testing.assert_allclose([step[1] for step in targets], expected, atol=1e-5)
    stops = np.cumsum([len(one.t) - 1 for one in parts if not one.dwells])
    assert np.flatnonzero([step[3] == FINE[name] for step in targets]).tolist() == [0, *stops.tolist()]
    waits = [step[1] for step in steps if step[0] == "wait"]
    np.testing.assert_allclose(waits, [0.3, 0.2], atol=1e-9)
    if name != "krl":  # which has no times of moves
        took = sum(step[2] for step in targets[1:]) + sum(waits)
        assert abs(took - t[-1]) < 5e-4 * len(targets)
    kinds = [step[0] for step in steps if step[0] != "move"]
    assert kinds == ["load", "wait", "load", "load", "wait"], "closing takes the dwell, opening comes before it"


def test_loads_of_rapid_and_krl_are_the_bodies_that_are_carried(moved, tmp_path):
    com, inertia = both()
    text = export(moved, tmp_path / "motion.mod", format="rapid").read_text()
    mass, centre, (w, x, y, z), *moments = [step[1] for step in rapid_of(text) if step[0] == "load"][1]
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    assert mass == 3.0
    np.testing.assert_allclose(centre, 1e3 * com, atol=1e-6)
    np.testing.assert_allclose(rotation @ np.diag(moments) @ rotation.T, inertia, atol=1e-8)
    text = export(moved, tmp_path / "motion.src", format="krl").read_text()
    load = [step[1] for step in krl_of(text) if step[0] == "load"][1]
    a, b, c = np.radians(load["CM"][3:])
    turn = (
        np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
        @ np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
        @ np.array([[1, 0, 0], [0, np.cos(c), -np.sin(c)], [0, np.sin(c), np.cos(c)]])
    )
    assert load["M"] == 3.0
    np.testing.assert_allclose(load["CM"][:3], 1e3 * com, atol=1e-6)
    np.testing.assert_allclose(turn @ np.diag(load["J"]) @ turn.T, inertia, atol=1e-8)


def test_speeds_of_krl_are_mean_speeds_as_shares(moved, tmp_path):
    steps = [
        step
        for step in krl_of(export(moved, tmp_path / "m.src", format="krl", step=0.1).read_text())
        if step[0] == "move"
    ]
    limit = moved.front.problem.robot.limits.velocity
    parts = [one for one in stretches(moved.rollout, 0.1) if not one.dwells]
    shares = np.concatenate([(np.abs(np.diff(p.q, axis=0)) / np.diff(p.t)[:, None] / limit).max(axis=1) for p in parts])
    percents = np.array([step[2] for step in steps[1:]])
    assert ((percents >= 100.0 * shares - 1e-9) & (percents <= np.maximum(100.0 * shares + 1.0, 1.0))).all()


def test_urscript_tells_the_controller_what_is_carried(moved, tmp_path):
    text = export(moved, tmp_path / "m.script", format="urscript", step=0.002).read_text()
    lines = [line.strip() for line in text.splitlines()]
    calls = [re.fullmatch(r"set_payload\((.*)\)", line) for line in lines]
    told = [json.loads(f"[{call[1]}]") for call in calls if call]
    com, inertia = both()
    assert [one[0] for one in told] == [1.0, 3.0, 1.0]
    np.testing.assert_allclose(told[1][1], com, atol=1e-12)
    xx, yy, zz, xy, xz, yz = told[1][2]
    np.testing.assert_allclose([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], inertia, atol=1e-15)
    cycles = np.cumsum([line.startswith("servoj") for line in lines])
    at = [0.002 * cycles[k] for k, call in enumerate(calls) if call]
    t = breaks(moved)
    assert at[0] == 0.0
    for instant, change in zip(at[1:], (t[2], t[4]), strict=True):
        assert -1e-9 <= instant + 0.002 - change < 0.002 + 1e-9, (
            "set before the first cycle that is not before the change"
        )
    closing = 0.002 * cycles[lines.index("# gripper: pick up payload.1")]
    assert abs(closing - t[1]) <= 0.002 + 1e-9
    assert "set_tcp(p[0.0, 0.0, 0.0, 0.0, 0.0, 0.0])" in lines


def test_a_tool_before_the_flange_is_told_to_the_controller(tmp_path):
    tip = {"name": "tip", "parent": "tool0", "position": [0.0, 0.0, 0.1], "rpy": [0.0, 0.0, np.pi / 2]}
    robot = {**ARM, "tools": [tip], "tool": "tip"}
    task = ViaPointProblem(robot=robot, points=POINTS, payload={"mass": 2.0, "com": (0.01, 0.0, 0.05)})
    text = export(optimise(task, **SMALL).pick("0"), tmp_path / "m.script", format="urscript").read_text()
    (tcp,) = re.findall(r"set_tcp\(p(\[.*\])\)", text)
    np.testing.assert_allclose(json.loads(tcp), [0, 0, 0.1, 0, 0, np.pi / 2], atol=1e-12)
    (payload,) = re.findall(r"set_payload\((.*)\)", text)
    np.testing.assert_allclose(json.loads(f"[{payload}]")[1], [0.0, 0.01, 0.15], atol=1e-11)


def test_a_ros_trajectory_has_the_gripper_s_events_as_comments(moved, tmp_path):
    text = export(moved, tmp_path / "m.yaml", format="ros2").read_text()
    told = [
        json.loads(line.removeprefix("# carried: ")) for line in text.splitlines() if line.startswith("# carried: ")
    ]
    assert told == [one.plain for one in carried(moved.rollout)]
    assert [one["pick up"] for one in told] == [[], [1], []]
    assert list(yaml.safe_load(text)) == ["header", "joint_names", "points"]


def test_a_replay_with_a_payload_body_needs_the_forces_of_the_table(moved, tmp_path):
    pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install 'trajevo[twin]'")
    from tests.twin import Twin
    from trajevo.robot.payload import Payload

    text = export(moved, tmp_path / "m.mujoco.csv", format="mujoco", step=0.01).read_text()
    comments = [line[2:].split(": ", 1) for line in text.splitlines() if line.startswith("# ")]
    gravity = json.loads(dict(comments)["gravity"])
    robot = moved.front.problem.robot
    assert json.loads(dict(comments)["tool"]) == robot.tool
    rows = list(csv.reader(line for line in text.splitlines() if not line.startswith("#")))
    table = dict(zip(rows[0], np.array(rows[1:], dtype=float).T, strict=True))
    q, v, a, force = (
        np.stack([table[f"{joint}_{kind}"] for joint in robot.joint_names], axis=1)
        for kind in ("qpos", "qvel", "qacc", "force")
    )
    changes = [json.loads(value) for key, value in comments if key == "carried"]
    ends = [change["time"] for change in changes[1:]] + [np.inf]
    checked = 0
    for change, end in zip(changes, ends, strict=True):
        on = (table["time"] >= change["time"]) & (table["time"] < end)
        told = Twin.of(robot, Payload(**change["payload"]), gravity=gravity).effort(q[on], v[on], a[on])
        np.testing.assert_allclose(force[on], told, rtol=0.0, atol=1e-9)
        checked += on.sum()
    assert checked == len(q)


def test_robots_and_steps_that_these_languages_cannot_hold_are_refused(moved, tmp_path):
    solution = optimise(HybridManipulator(), **SMALL).pick("0")
    for name in READERS:
        refused(
            lambda name=name: export(solution, tmp_path / "x", format=name),
            f"{name}: expected a robot of at most 6 joints that its actuators drive directly, got 'hybrid_manipulator'",
        )
        refused(
            lambda name=name: export(moved, tmp_path / "x", format=name, step=1e-4),
            "and controllers take at most about 9000: take at least",
        )
        refused(lambda name=name: export(moved, tmp_path / "x", format=name, angle="deg"), "is in rad")
    free = ViaPointProblem(robot={**ARM, "limits": {**ARM["limits"], "velocity": np.inf}}, points=POINTS)
    refused(
        lambda: export(optimise(free, **SMALL).pick("0"), tmp_path / "x", format="krl"),
        "krl: speeds are shares of the axes' greatest ones, and joint 'shoulder_pan_joint' of 'ur5' has no limit of "
        "velocity",
    )
