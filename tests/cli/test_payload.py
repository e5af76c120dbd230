"""Pictures that commands about payloads leave in a run's folder, and what a new run does with them."""

import pytest

from tests.helpers import UNDRAWN, trajevo
from trajevo.cli.results import PICTURES

SMALL = ("--generations", "25", "--population", "20", "--no-polish", "--quiet")


@pytest.mark.long
def test_pictures_of_commands_go_with_the_run_they_are_of(tmp_path):
    run = tmp_path / "h"
    assert trajevo("solve", "hybrid", *SMALL, "--out", run).returncode == 0
    assert trajevo("slowdown", run).returncode == 0
    assert trajevo("payload-diagram", run, "--grid", "5").returncode == 0
    told = trajevo("payload-time", run, "--payload", "5", "--payload", "9", "--starts", "1", "--tolerance", "0.02")
    assert told.returncode == 0, told.stderr
    assert "largest payload of any motion found: 12.4" in told.stdout
    assert "held at rest at both ends: 12.510811 kg" in told.stdout
    assert "2.4240" in told.stdout
    assert "+0.01 " in told.stdout
    assert {file.name for file in run.glob("*.png")} == {*PICTURES}
    assert trajevo("solve", "pointing", *SMALL, "--out", run, "--overwrite").returncode == 0
    assert not list(run.glob("*.png"))


def test_payload_time_says_what_it_cannot_do(tmp_path):
    run = tmp_path / "p"
    assert trajevo("solve", "pointing", *SMALL, *UNDRAWN, "--out", run).returncode == 0
    for options, says in (
        (("--tolerance", "0"), "--tolerance: expected a positive length"),
        ((), "no effort limit bounds what 'pointing_mechanism' can hold"),
    ):
        told = trajevo("payload-time", run, *options)
        assert told.returncode == 2
        assert says in told.stderr


def test_tables_and_help_show_their_units():
    assert "Payload [kg]" in trajevo("solve", "--help").stdout
    assert "mass [kg]" in trajevo("check-robot", "puma560").stdout
