import csv
import json

import numpy as np
import pytest

from problems import PointingMechanism
from trajevo import PolynomialBatch, TrajevoError, optimise
from trajevo.export import export


@pytest.fixture(scope="module")
def knee():
    return optimise(PointingMechanism(), seed=1, generations=8, population=20, progress=False).knee()


def read(file):
    lines = file.read_text().splitlines()
    about = {line[2:].split(": ", 1)[0]: json.loads(line.split(": ", 1)[1]) for line in lines if line.startswith("#")}
    rows = list(csv.reader(line for line in lines if not line.startswith("#")))
    return about, rows[0], np.array(rows[1:], dtype=float)


@pytest.mark.parametrize(("angle", "factor"), [("rad", 1.0), ("deg", 180.0 / np.pi)])
def test_csv_reads_back_as_the_motion(knee, tmp_path, angle, factor):
    about, headers, table = read(export(knee, tmp_path / "knee.csv", format="csv", step=0.1, angle=angle))
    assert headers[:3] == ["time [s]", f"joint_1 position [{angle}]", f"joint_2 position [{angle}]"]
    assert headers[-1] == f"joint_2 jerk [{angle}/s^3]"
    t = table[:, 0]
    np.testing.assert_allclose(np.diff(t)[:-1], 0.1, atol=1e-9)
    assert t[-1] == knee.F["time"]
    for order in range(4):
        expected = factor * knee.trajectory.evaluate(t, order)[0]
        np.testing.assert_array_equal(table[:, 1 + 2 * order : 3 + 2 * order], expected)
    assert about["run"]["seed"] == 1
    assert about["problem"]["robot_reference"].startswith("Sun et al. 2020")
    assert about["solution"]["rule"] == "knee"


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


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"format": "xml"}, "unknown export format 'xml'; known: csv, feed, gcode, json"),
        ({"step": 0.0}, "step: expected a positive time"),
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
