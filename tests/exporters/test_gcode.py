"""Feed tables and G-code, read back as a control would."""

import csv
import re

import numpy as np
import pytest

from tests.helpers import mostly_long
from trajevo import GeometricPath, TrajevoError, ViaPointProblem, optimise
from trajevo.exporters.export import export, is_exported
from trajevo.exporters.gcode import blocks
from trajevo.problems import TimeJerkReparameterisation
from trajevo.solvers.gradient.normal_constraint import solve_nnc


def evolved(problem):
    return optimise(problem, seed=1, population=12, generations=3, polish=False, progress=False)


def solved(problem):
    return solve_nnc(problem, points=3)


@pytest.fixture(scope="module", params=mostly_long([evolved, solved], evolved), ids=lambda each: each.__name__)
def knee(request):
    return request.param(TimeJerkReparameterisation(path="s")).knee()


def read_g_code(text):
    """Positions [mm] and feeds [mm/min] of the G0 and G1 lines."""
    positions, feeds = [], []
    for line in text.splitlines():
        words = dict(re.findall(r"([A-Z])([-+0-9.]+)", line.split(";")[0]))
        if "X" in words:
            positions.append([float(words["X"]), float(words["Y"])])
            feeds.append(float(words["F"]) if words["G"] == "1" else None)
    return np.array(positions), feeds


@pytest.mark.parametrize("step", [0.1, 0.01, 0.001])
def test_g_code_takes_as_long_as_the_motion_and_follows_its_path(knee, tmp_path, step):
    file = export(knee, tmp_path / "knee.gcode", format="gcode", step=step)
    positions, feeds = read_g_code(file.read_text())
    assert feeds[0] is None
    assert all(feed > 0.0 for feed in feeds[1:])
    minutes = np.linalg.norm(np.diff(positions, axis=0), axis=1) / np.array(feeds[1:])
    duration = float(knee.trajectory.duration[0])
    assert 60.0 * minutes.sum() == pytest.approx(duration, rel=1e-5)
    path = knee.front.problem.path
    np.testing.assert_allclose(positions[[0, -1]], 1e3 * path([0.0, 1.0]), atol=1e-6)
    reached = np.concatenate([[0.0], 60.0 * np.cumsum(minutes)])
    expected = 1e3 * knee.trajectory.evaluate(np.minimum(reached, duration))[0]
    np.testing.assert_allclose(positions, expected, atol=2e-5)


def test_g_code_waits_and_says_how_it_starts_and_ends(knee, tmp_path):
    problem = ViaPointProblem(
        robot=knee.front.problem.robot,
        points=[[0.0, 0.0], [0.1, 0.05], [0.2, 0.0]],
        passing=[{"point": 0, "velocity": [0.01, 0.0]}, {"point": 1, "dwell": 0.5}],
    )
    knee = optimise(problem, seed=1, population=12, generations=3, progress=False, polish=False).knee()
    text = export(knee, tmp_path / "knee.gcode", format="gcode", step=0.01).read_text()
    assert "; starts in motion and ends at rest; feeds" in text
    positions, feeds = read_g_code(text)
    minutes = np.linalg.norm(np.diff(positions, axis=0), axis=1) / np.array(feeds[1:])
    assert 60.0 * minutes.sum() + 0.5 == pytest.approx(float(knee.trajectory.duration[0]), rel=1e-5)
    lines = [line for line in text.splitlines() if line.startswith("G")]
    (waiting,) = [k for k, line in enumerate(lines) if line.startswith("G4")]
    assert lines[waiting] == "G4 P0.500000"
    assert lines[waiting - 1].startswith("G1 X100.000000 Y50.000000 F")
    found = blocks(knee, 0.01)
    assert np.diff(found.time)[found.feed == 0.0] == pytest.approx([0.5])
    # No block that moves is slowed by the dwell: their times are those of the steps, but for what hardly moves.
    steps = np.diff(found.time)[found.feed > 0.0]
    assert np.median(steps) == pytest.approx(0.01, rel=0.02)
    assert found.time[-1] == float(knee.trajectory.duration[0])


def test_blocks_stay_near_the_path(knee):
    coarse, fine = blocks(knee, 0.05), blocks(knee, 0.01)
    assert fine.deviation < coarse.deviation / 10.0
    t = np.linspace(0.0, float(knee.trajectory.duration[0]), 20_001)
    motion = 1e3 * knee.trajectory.evaluate(t)[0]
    block = np.clip(np.searchsorted(coarse.time, t, side="right") - 1, 0, len(coarse.feed) - 1)
    start, end = coarse.position[block], coarse.position[block + 1]
    across = np.stack([-(end - start)[:, 1], (end - start)[:, 0]], axis=1)
    distance = np.abs(((motion - start) * across).sum(axis=1)) / np.linalg.norm(across, axis=1)
    assert distance.max() == pytest.approx(coarse.deviation, rel=0.2)


def test_the_feed_table_holds_the_blocks(knee, tmp_path):
    file = export(knee, tmp_path / "knee.feed", format="feed", step=0.02)
    lines = [line for line in file.read_text().splitlines() if not line.startswith("#")]
    rows = list(csv.reader(lines))
    assert rows[0] == ["time [s]", "X [mm]", "Y [mm]", "feed [mm/min]"]
    table, found = np.array(rows[1:], dtype=float), blocks(knee, 0.02)
    np.testing.assert_array_equal(table[:, 0], found.time)
    np.testing.assert_array_equal(table[:, 1:3], found.position)
    np.testing.assert_array_equal(table[1:, 3], found.feed)
    t = np.linspace(0.0, float(knee.trajectory.duration[0]), 20_001)
    speed = 60e3 * np.linalg.norm(knee.trajectory.evaluate(t, 1)[0], axis=1)
    assert found.feed.max() <= speed.max() * (1.0 + 1e-9)


def test_what_was_exported_is_known_again(knee, tmp_path):
    for kind in ("csv", "json", "feed", "gcode"):
        assert is_exported(export(knee, tmp_path / f"knee.{kind}", format=kind))
    (tmp_path / "other.gcode").write_text("G1 X0\n")
    assert not is_exported(tmp_path / "other.gcode")


def test_json_holds_both_splines(knee, tmp_path):
    import json

    from scipy.interpolate import BSpline

    content = json.loads(export(knee, tmp_path / "k.json", format="json").read_text())["trajectory"]
    s, u = (
        BSpline(np.array(content[key]["knots"]), np.array(content[key]["control_points"]), content[key]["order"] - 1)
        for key in ("path", "u")
    )
    t = np.linspace(0.0, content["duration [s]"], 50)
    rebuilt = s(u(t / content["duration [s]"]))
    np.testing.assert_allclose(rebuilt, knee.trajectory.evaluate(t)[0], atol=1e-12)


def test_a_step_as_long_as_the_motion_is_refused(knee, tmp_path):
    with pytest.raises(TrajevoError, match="step: expected less than the duration of the motion, .* s, got 100 s"):
        export(knee, tmp_path / "x", format="gcode", step=100.0)


def test_a_closed_path_has_blocks_at_any_step(tmp_path):
    angle = np.linspace(0.0, 2.0 * np.pi, 13)
    circle = 0.03 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    circle[-1] = circle[0]
    limits = {"velocity": 0.1, "acceleration": 1.0, "jerk": 30.0, "longest_time": 9.0}
    problem = TimeJerkReparameterisation(path=circle, **limits)
    knee = optimise(problem, seed=1, generations=2, population=20, progress=False, polish=False).knee()
    for share in (0.99, 0.5, 0.1):
        found = blocks(knee, share * float(knee.trajectory.duration[0]))
        np.testing.assert_array_equal(found.position[0], found.position[-1])
        assert len(found.feed) >= 2


def test_joints_that_turn_have_no_feed(tmp_path):
    points = np.array([[0.0, 0.1], [0.1, 0.3], [0.3, 0.2], [0.4, -0.2], [0.2, -0.3], [0.0, -0.1]])
    problem = TimeJerkReparameterisation(
        path=GeometricPath.through(points), robot="pointing_mechanism", longest_time=60.0
    )
    front = optimise(problem, seed=1, generations=2, population=20, progress=False, polish=False)
    for kind in ("feed", "gcode"):
        with pytest.raises(
            TrajevoError, match=r"feed: joint 'joint_1' \[rad\] of robot 'pointing_mechanism' is no lin"
        ):
            export(front.knee(), tmp_path / "x", format=kind)
        assert not (tmp_path / "x").exists()
