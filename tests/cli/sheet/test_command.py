"""The command payload-sheet: files, exit codes, loads on the arm, and mistakes in one sentence."""

import json

import pytest

from tests.helpers import UNDRAWN, trajevo
from trajevo.cli.sheet.command import _mounted
from trajevo.errors import TrajevoError

SMALL = ("--generations", "10", "--population", "20", "--no-polish", "--quiet", *UNDRAWN)


def test_a_run_gets_its_sheet_which_goes_with_it(tmp_path):
    run = tmp_path / "h"
    assert trajevo("solve", "hybrid", "--payload", "5", *SMALL, "--out", run).returncode == 0
    told = trajevo("payload-sheet", run, "--member", "least_time", "--dwell", "2")
    data = json.loads((run / "payload_sheet.json").read_text())
    assert told.returncode == (0 if data["verdict"] == "within limits" else 1), told.stderr
    assert data["verdict"] in told.stdout
    assert data["duty"]["dwell_s"] == 2.0
    assert data["load"]["mass_kg"] == 5.0
    joint = data["static"]["axes"][-1]["joint"]
    page = tmp_path / "other.html"
    heavy = trajevo("payload-sheet", run, "--supplementary", f"{data['robot']}=1 kg", "--out", page)
    assert heavy.returncode == 2
    assert "joint with a supplementary load" in heavy.stderr
    assert joint
    assert not page.exists()
    for options, says in (
        (("--dwell", "-1"), "dwell: expected a time from 0 on"),
        (("--supplementary", "nothing"), "JOINT=MASS@X,Y,Z"),
        (("--member", "9999"), "9999"),
        (("--out", "sheet.json"), "sheet.html"),
    ):
        wrong = trajevo("payload-sheet", run, *options)
        assert wrong.returncode == 2
        assert says in wrong.stderr
    assert trajevo("solve", "hybrid", *SMALL, "--out", run, "--overwrite").returncode == 0
    assert not (run / "payload_sheet.html").exists()
    assert not (run / "payload_sheet.json").exists()


def test_loads_on_the_arm_are_written_with_or_without_units():
    assert _mounted("elbow=10 kg@0.1, -20 mm,0.3") == ("elbow", {"mass": "10 kg", "com": [0.1, -0.02, 0.3]})
    assert _mounted("elbow = 2.5") == ("elbow", {"mass": 2.5, "com": [0.0, 0.0, 0.0]})
    for wrong in ("elbow", "=2", "elbow=", "elbow=x@0,0,z", "elbow=2@0,0,1e"):
        with pytest.raises(TrajevoError, match="--supplementary"):
            _mounted(wrong)
