import copy
import csv
import json

import numpy as np
import pytest
from jsonschema import Draft202012Validator

from trajevo import PolynomialBatch, TrajevoError, optimise
from trajevo.exporters.export import export
from trajevo.exporters.samples import motion_schema
from trajevo.problems import PointingMechanism, TimeJerkReparameterisation


@pytest.fixture(scope="module")
def knee():
    return optimise(PointingMechanism(), seed=1, generations=8, population=20, progress=False, polish=False).knee()


def read(file):
    lines = file.read_text().splitlines()
    about = {line[2:].split(": ", 1)[0]: json.loads(line.split(": ", 1)[1]) for line in lines if line.startswith("#")}
    rows = list(csv.reader(line for line in lines if not line.startswith("#")))
    return about, rows[0], np.array(rows[1:], dtype=float)


@pytest.mark.parametrize(("angle", "factor"), [("rad", 1.0), ("deg", 180.0 / np.pi)])
def test_csv_reads_back_as_the_motion(knee, tmp_path, angle, factor):
    about, headers, table = read(export(knee, tmp_path / "knee.csv", format="csv", step=0.1, angle=angle))
    assert headers[:3] == ["time [s]", f"joint_1 position [{angle}]", f"joint_2 position [{angle}]"]
    assert headers[-3:] == [f"joint_2 jerk [{angle}/s^3]", "joint_1 effort [N*m]", "joint_2 effort [N*m]"]
    t = table[:, 0]
    np.testing.assert_allclose(np.diff(t)[:-1], 0.1, atol=1e-9)
    assert t[-1] == knee.F["time"]
    for order in range(4):
        expected = factor * knee.trajectory.evaluate(t, order)[0]
        np.testing.assert_array_equal(table[:, 1 + 2 * order : 3 + 2 * order], expected)
    states = (knee.trajectory.evaluate(t, order) for order in range(3))
    np.testing.assert_allclose(table[:, 9:], knee.front.problem.dynamics.effort(*states)[0], rtol=1e-12, atol=1e-12)
    assert about["run"]["seed"] == 1
    assert about["problem"]["robot_reference"].startswith("Sun et al. 2020")
    assert about["solution"]["rule"] == "knee"


def test_texts_are_those_of_the_standard_library(knee, tmp_path):
    """They are written in other ways than these, which take longer."""
    text = export(knee, tmp_path / "knee.json", format="json", step=0.05).read_text()
    assert text == json.dumps(json.loads(text), indent=1, allow_nan=False)
    lines = export(knee, tmp_path / "knee.csv", format="csv", step=0.05).read_text().splitlines()
    numbers = [line.split(",") for line in lines if not line.startswith("#")][1:]
    assert len(numbers) > 100
    assert all(cell == repr(float(cell)) for row in numbers for cell in row)


def test_json_holds_the_exact_trajectory(knee, tmp_path):
    content = json.loads(export(knee, tmp_path / "knee.json", format="json").read_text())
    trajectory = content["trajectory"]
    key = next(name for name in trajectory if name.startswith("coefficients"))
    rebuilt = PolynomialBatch(np.array([trajectory["breaks [s]"]]), np.array([trajectory[key]]))
    np.testing.assert_array_equal(rebuilt.coefficients, knee.trajectory.coefficients)
    assert trajectory["units"] == ["rad", "rad"]
    np.testing.assert_array_equal(
        content["samples"]["joint_1 velocity [rad/s]"],
        knee.trajectory.evaluate(np.array(content["samples"]["time [s]"]), 1)[0, :, 0],
    )
    assert content["solution"]["objectives"] == knee.F


def test_a_step_longer_than_the_motion_gives_its_ends(knee, tmp_path):
    _, _, table = read(export(knee, tmp_path / "ends.csv", format="csv", step=1e6))
    assert table[:, 0].tolist() == [0.0, knee.F["time"]]


@pytest.mark.parametrize("over", [0.001, 0.3, 0.499, 0.501, 0.8, 1.0])
def test_no_interval_is_shorter_than_half_a_step(knee, tmp_path, over):
    step = knee.F["time"] / (10.0 + over)
    _, _, table = read(export(knee, tmp_path / "k.csv", format="csv", step=step))
    intervals = np.diff(table[:, 0])
    assert 0.5 * step <= intervals[-1] <= 1.5 * step
    np.testing.assert_allclose(intervals[:-1], step, rtol=1e-9)
    assert table[-1, 0] == knee.F["time"]


@pytest.mark.parametrize("angle", ["rad", "deg"])
def test_json_is_as_its_schema_says(knee, tmp_path, angle):
    validator = Draft202012Validator(motion_schema())
    validator.check_schema(motion_schema())
    content = json.loads(export(knee, tmp_path / "k.json", format="json", angle=angle).read_text())
    validator.validate(content)
    for place, bad in [
        (("samples", "joint_1 position [gon]"), [0.0, 1.0]),
        (("samples", "time [s]"), [0.0]),
        (("trajectory", "breaks [s]"), "none"),
        (("solution", "constraints"), {"velocity": 1.0}),
        (("run", "seed"), None),
        (("problem", "objectives"), []),
        (("version",), 2),
    ]:
        broken = copy.deepcopy(content)
        target = broken
        for key in place[:-1]:
            target = target[key]
        target[place[-1]] = bad
        assert not validator.is_valid(broken), place
    for key in validator.schema["required"]:
        assert not validator.is_valid({name: value for name, value in content.items() if name != key})


def test_a_splined_path_is_as_the_schema_says(tmp_path):
    front = optimise(
        TimeJerkReparameterisation(path="s"), seed=1, generations=2, population=20, progress=False, polish=False
    )
    content = json.loads(export(front.knee(), tmp_path / "k.json", format="json").read_text())
    validator = Draft202012Validator(motion_schema())
    validator.validate(content)
    assert "x effort [N]" in content["samples"]
    del content["trajectory"]["u"]["knots"]
    assert not validator.is_valid(content)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (
            {"format": "xml"},
            "unknown export format 'xml'; known: csv, fanuc, feed, gcode, json, krl, moveit, mujoco, netcdf, rapid, "
            "ros2, urscript",
        ),
        ({"step": 0.0}, "step: expected a positive time"),
        ({"step": True}, "step: expected a positive time"),
        ({"step": float("nan")}, "step: expected a positive time"),
        ({"angle": "gon"}, "unknown angle unit 'gon'"),
    ],
)
def test_bad_settings_are_refused(knee, tmp_path, arguments, says):
    with pytest.raises(TrajevoError, match=says):
        export(knee, tmp_path / "x", **({"format": "csv"} | arguments))
    with pytest.raises(TrajevoError, match="cannot be written"):
        export(knee, tmp_path / "no" / "x.csv", format="csv")
    assert not (tmp_path / "x").exists()
