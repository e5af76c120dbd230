"""Drives on the command line: their limits in a task, the certificate, and capacity over a shift."""

import numpy as np
import pytest

from tests.formulation.test_feasibility import WEAK
from tests.helpers import UNDRAWN, trajevo
from trajevo import Front, full_capacity, tool_deviation
from trajevo.capacity.accuracy.found import CAUSES

TASK = """format = 1
points = [[0.2, 0.0], [0.6, 0.3], [0.9, 0.4]]
duration_bounds = [0.2, 4.0]
objectives = ["time", "rms_torque_share"]
[robot]
name = "two_weak.urdf"
[robot.drives.a]
source = "made up"
peak_torque = "39 N*m"
continuous_torque = "36 N*m"
efficiency_driving = 0.9
[robot.drives.b]
source = "made up"
torque_speed = [["0 rad/s", "19 N*m"], ["3 rad/s", "12 N*m"], ["9 rad/s", "0 N*m"]]
stiffness = "9000 N*m/rad"
[robot.grip]
source = "made up"
total_force = "60 N"
friction = 0.4
[robot.stand]
source = "made up"
mass = "90 kg"
com = [0.0, 0.0, -0.4]
footprint = [[0.4, 0.4, -0.8], [-0.4, 0.4, -0.8], [-0.4, -0.4, -0.8], [0.4, -0.4, -0.8]]
[limits]
acceleration = 30.0
jerk = 600.0
effort = 60.0
[constraints]
limits = ["position", "velocity", "acceleration", "jerk", "effort", "torque_at_speed", "rms_torque"]
dwell = {dwell}
[algorithm]
population = 16
generations = 6
polish = false
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("drives")
    (folder / "two_weak.urdf").write_text(WEAK)
    (folder / "task.toml").write_text(TASK.format(dwell=2.0))
    told = trajevo("solve", "task.toml", *UNDRAWN, "--out", "run", cwd=folder)
    assert told.returncode == 0, told.stderr
    return folder / "run"


def test_a_certificate_has_rows_of_drives_and_names_integrals(run):
    told = trajevo("certify", run)
    assert told.returncode in (0, 1), told.stderr
    assert "torque at speed" in told.stdout
    flat = " ".join(told.stdout.split())
    assert "rms torque of a (an integral over cycles, resolved to 1e-06, not proven; " in flat


def test_capacity_over_a_shift_depends_on_the_rest_and_the_cycles(run):
    told = {}
    for options in ((), ("--dwell", "5"), ("--dwell", "5", "--cycles", "3")):
        done = trajevo("capacity", run, *options)
        assert done.returncode == 0, done.stderr
        told[options] = " ".join(done.stdout.split())
    assert "made for ever; looked at" in told[()]
    assert "made for ever, 5 s at rest after each" in told["--dwell", "5"]
    assert "made 3 times" in told["--dwell", "5", "--cycles", "3"]


def test_capacity_under_all_limits_is_that_of_the_same_motion_in_python(run):
    done = trajevo("capacity", run, "--dwell", "5", "--deviation", "2.5")
    assert done.returncode == 0, done.stderr
    flat = " ".join(done.stdout.split())
    motion = Front.load(run / "front.json").pick("knee")
    found = full_capacity(motion, deviation=2.5e-3, dwell=5.0)
    assert {"deviation", "slip", "tip_over", "torque_at_speed"} <= {limit.cause for limit in found.limits}
    assert f"under all limits: {found}" in flat
    assert f"the tool gives way by {tool_deviation(motion)}" in flat
    for limit in found.limits:
        assert CAUSES[limit.cause] in flat
        assert np.isinf(limit.mass) or f"{max(limit.mass, 0.0):.6g}" in flat


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("--deviation", "-2"), "--deviation: expected a length above 0, up to 1000 mm, got -2"),
        (("--deviation", "nan"), "--deviation: expected a length above 0, up to 1000 mm, got nan"),
        (("--dwell", "-1"), "dwell: expected a time from 0 on [s], got -1.0"),
        (("--cycles", "0"), "cycles: expected a whole number from 1 on, or None for ever, got 0"),
    ],
)
def test_what_no_shift_is_is_refused(run, options, says):
    done = trajevo("capacity", run, *options)
    assert done.returncode == 2
    assert says in " ".join(done.stderr.split())
    assert "under all limits" not in done.stdout


def test_the_run_keeps_the_time_at_rest(run):
    assert Front.load(run / "front.json").record.settings["dwell"] == 2.0
