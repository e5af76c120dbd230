"""Torque at speed is certified: a second engine's efforts at 100,000 instants never ask more than is proven."""

import numpy as np
import pytest

from tests.helpers import mostly_long
from trajevo import Payload, ViaPointProblem, certify, load_robot

pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install 'trajevo[twin]'")

from tests.twin import Twin

INSTANTS = 100_000
LINES = (
    lambda peak: {"torque_speed": [[0.0, peak], [1.2, peak], [4.0, 0.0]], "efficiency_driving": 0.75},
    lambda peak: {"torque_speed": [[0.0, peak], [1.0, 0.8 * peak], [3.0, 0.7 * peak], [9.0, 0.0]]},
    lambda peak: {"peak_torque": 0.9 * peak, "efficiency_driving": 0.8, "efficiency_driven": 0.5},
)


def moved(line, seed):
    """A random motion of a UR5 with drives and a payload off the axis of its tool."""
    limits, gravity = {"acceleration": np.inf, "jerk": np.inf, "velocity": np.inf}, [0.0, 0.0, -9.81]
    bare = load_robot("ur5", limits=limits, tool="tool0")
    drives = {name: line(peak) for name, peak in zip(bare.joint_names, bare.limits.effort, strict=True)}
    robot = load_robot("ur5", limits=limits, tool="tool0", drives=drives, gravity=gravity)
    draw = np.random.default_rng(seed)
    points = np.array([0.3, -1.2, 1.3, -1.6, -1.5, 0.1]) + draw.uniform(-0.6, 0.6, (4, 6))
    payload = Payload(4.0, com=(0.05, 0.0, 0.1))
    problem = ViaPointProblem(
        robot=robot, points=points, objectives=("time",), constraints=("torque_at_speed",), payload=payload
    )
    x = problem.xl + draw.uniform(0.1, 0.3) * (problem.xu - problem.xl)
    return robot, payload, problem.rollout(x[None])


@pytest.mark.thinned(2)
@pytest.mark.parametrize("line", LINES)
@pytest.mark.parametrize("seed", mostly_long(range(8), 0))
def test_no_instant_asks_more_than_is_proven(line, seed):
    robot, payload, rollout = moved(line, seed)
    rows = [row for row in certify(rollout, tolerance=1e-3).rows if row.quantity == "torque at speed"]
    t = np.linspace(0.0, float(rollout.trajectory.duration[0]), INSTANTS)
    q, v, a = (rollout.trajectory.evaluate(t[None], order)[0] for order in range(3))
    effort = Twin.of(robot, payload).effort(q, v, a)
    assert len(rows) == 6
    for k, row in enumerate(rows):
        drive, speed = robot.drives[row.joint], v[:, k]
        driving, driven = drive.efficiencies
        moving = np.abs(speed) > 1e-9  # at rest the gear may bear what it loses
        torque = np.where(effort[:, k] * speed > 0.0, effort[:, k] / driving, driven * effort[:, k])[moving]
        speed = speed[moving]
        points = np.array(drive.torque_speed or [(0.0, drive.peak_torque), (1e9, drive.peak_torque)])
        slope = (points[-1, 1] - points[-2, 1]) / (points[-1, 0] - points[-2, 0])
        line_at = np.interp(np.abs(speed), *points.T) + slope * np.maximum(np.abs(speed) - points[-1, 0], 0.0)
        most = points[0, 1]
        forward, backward = np.where(speed > 0.0, line_at, most), np.where(speed < 0.0, line_at, most)
        asked = 1.0 + (np.maximum(torque - forward, -torque - backward) / most).max()
        assert asked <= row.bound + 1e-9
        assert row.bound <= asked + 1.1e-3 * max(1.0, asked)
