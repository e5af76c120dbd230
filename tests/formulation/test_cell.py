"""The worked cell: lines, dwells, a part that is picked up and put down, a wall; every step of an engineer's way."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from trajevo import certify, dlcc, export, load_task, verify
from trajevo.exporters.events import carried

CELL = Path(__file__).parents[2] / "problems" / "tasks" / "pick_and_place_cell.toml"


@pytest.fixture(scope="module")
def solution():
    front = load_task(CELL).solve(generations=3, population=16, progress=False, polish=False, evaluations=None)
    return front.pick("0")


def test_its_quickest_motion_keeps_all_limits_and_lines(solution):
    proof = certify(solution)
    assert proof.proven, proof
    rows = {row.name: row for row in proof.rows}
    lines = [name for name in rows if name.startswith("distance from line")]
    assert lines == [f"distance from line from point {first} to {first + 1}" for first in (1, 2, 5, 6)]
    assert {
        "clearance to obstacles",
        "clearance of payload 0 to obstacles",
        "clearance of payload 1 to obstacles",
    } <= set(rows)
    assert verify(solution).passed


def test_the_gripper_has_its_time_and_the_part_is_carried_between(solution):
    start, picked, placed = carried(solution.rollout)
    assert (start.payload.mass, picked.payload.mass, placed.payload.mass) == (0.9, 3.9, 0.9)
    assert picked.t - picked.gripper == pytest.approx(0.3, abs=1e-12)
    breaks = solution.trajectory.breaks[0]
    after = int(np.flatnonzero(breaks == placed.t)[0])
    assert breaks[after + 1] - placed.t == pytest.approx(0.3, abs=1e-12)
    at = solution.trajectory.evaluate(np.array([picked.t, placed.t]))[0]
    np.testing.assert_allclose(solution.rollout.robot.tool_poses(at)[0][:, 2], 0.2, atol=1e-6)


def test_efforts_on_every_part_are_mujoco_s(solution):
    pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install 'trajevo[twin]'")
    from tests.twin import Twin

    rollout, robot = solution.rollout, solution.rollout.robot
    changes = carried(rollout)
    ends = [change.t for change in changes[1:]] + [float(solution.trajectory.duration[0])]
    for change, end in zip(changes, ends, strict=True):
        t = np.linspace(change.t, np.nextafter(end, 0.0), 200)
        q, v, a = (solution.trajectory.evaluate(t, order) for order in range(3))
        told = Twin.of(robot, change.payload, gravity=robot.model.gravity.linear).effort(q[0], v[0], a[0])
        np.testing.assert_allclose(rollout.effort_in(q, v, a, t)[0], told, rtol=0.0, atol=1e-9)


def test_more_than_the_part_can_be_carried_and_the_capacity_is_that_of_the_loaded_part(solution):
    rollout = solution.rollout
    most = dlcc(solution)
    assert most.mass > 3.0
    picked, placed = carried(rollout)[1:]
    assert picked.t <= most.time <= placed.t
    t = np.linspace(picked.t, np.nextafter(placed.t, 0.0), 20_000)
    q, v, a = (solution.trajectory.evaluate(t, order) for order in range(3))
    loaded = rollout.effort_in(q, v, a, t)[0] + (most.mass - 3.0) * rollout.dynamics.effort_per_kilogram(
        q[0], v[0], a[0], rollout.segments_at(t)[0]
    )
    used = (np.abs(loaded) / rollout.limits.effort).max()
    assert 0.999 < used <= 1.0 + 1e-9


def test_controllers_get_it(solution, tmp_path):
    for format in ("urscript", "rapid", "krl", "fanuc", "ros2", "mujoco"):
        text = export(solution, tmp_path / format, format=format).read_text()
        assert "pick up" in text
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # libyaml's, where it is there, in a tenth of the time
    assert yaml.load((tmp_path / "ros2").read_text(), loader)["points"]
