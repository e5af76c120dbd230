"""The example of drives, a grip and a stand is the arm of example-robot-data, and says what is assumed."""

import re
from pathlib import Path

import numpy as np
import pytest

from trajevo import Dynamics, Payload, load_robot

FOLDER = Path("robots/ur5_drives")


@pytest.mark.parametrize("payload", [Payload(0.0), Payload(3.0, com=(0.02, 0.03, 0.1))], ids=["empty", "loaded"])
def test_it_has_the_efforts_of_the_urdf(payload):
    ours = load_robot("ur5_drives")
    theirs = load_robot("ur5", limits={"acceleration": np.inf, "jerk": np.inf}, tool="tool0")
    q, v, a = np.random.default_rng(0).uniform(-2.0, 2.0, (3, 200, 6))
    found, expected = (Dynamics(robot, payload).effort(q, v, a) for robot in (ours, theirs))
    assert np.abs(found - expected).max() < 2e-8
    assert ours.tool_poses(q)[0][:, 2] == pytest.approx(theirs.tool_poses(q)[0][:, 2], abs=1e-10)
    assert ours.limits.effort == pytest.approx(theirs.limits.effort)
    assert ours.limits.velocity == pytest.approx(theirs.limits.velocity)


def test_every_drive_has_the_published_constants_and_says_what_is_not_published():
    robot = load_robot("ur5_drives")
    constants = [drive.torque_constant for drive in robot.drives.values()]
    assert constants == [0.1350, 0.1361, 0.1355, 0.0957, 0.0865, 0.0893]
    assert {drive.gear_ratio for drive in robot.drives.values()} == {101.0}
    for told in (*robot.drives.values(), robot.grip, robot.stand):
        assert "assumed" in told.source
    source = (FOLDER / "SOURCE.md").read_text(encoding="utf-8")
    assert len(re.findall(r"\| assumed", source)) >= 6
    assert "second hand" in source
