"""What `solve`, `report` and `show` compute, draw and keep: as much as was asked for, and once."""

import re

import pytest

from tests.helpers import UNDRAWN, mostly_long, trajevo
from trajevo import Front
from trajevo.plots.analyses_file import read_analyses
from trajevo.solvers.gradient import polish as polishing

TINY = ["--generations", "8", "--population", "20", "--no-polish", "--quiet"]
FRONT_PICTURES = {"front", "parallel", "hypervolume", "profiles"}
VIEWS = {"front_3d", "tool_path"}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A short run of an arm that carries something and has rivals."""
    folder = tmp_path_factory.mktemp("runs") / "arm"
    solved = trajevo("solve", "pick-place", "--payload", "2.5", *TINY, "--out", folder)
    assert solved.returncode == 0, solved.stderr
    return folder, solved.stdout


@pytest.fixture
def no_solver(monkeypatch):
    def never(*_, **__):
        raise AssertionError("something was optimised")

    monkeypatch.setattr("scipy.optimize.minimize", never)
    monkeypatch.setattr(polishing, "polish", never)


def pictures(folder):
    return {file.stem for file in (folder / "plots").glob("*")}


def test_solve_writes_what_takes_no_time_and_says_what_there_is_more(run):
    folder, said = run
    assert not (folder / "plots").exists()
    text = (folder / "report.html").read_text()
    sections = "<h2>Solutions</h2>", "<h2>Certificate of the knee</h2>", "largest payload", "<summary>Run</summary>"
    for expected in sections:
        assert expected in text
    assert "Interpolants at their least times" not in text
    assert "Least times under the same limits" not in said
    drawn = f"trajevo pictures {folder} for pictures of a paper's size"
    more = f"trajevo report {folder} --full for 9 analyses that take longer"
    assert f"next: trajevo certify {folder}; {drawn}; {more}" in said


def test_show_prints_and_never_optimises(run, no_solver):
    folder, _ = run
    before = {file: file.stat().st_mtime_ns for file in folder.rglob("*")}
    shown = trajevo("show", folder)
    assert shown.returncode == 0, shown.stderr
    assert f"not compared with other interpolants yet; trajevo report {folder} --full does that" in shown.stdout
    assert {file: file.stat().st_mtime_ns for file in folder.rglob("*")} == before


@pytest.fixture(scope="module")
def light(tmp_path_factory):
    """A short run of a mechanism of two joints, which carries nothing and has no rivals."""
    folder = tmp_path_factory.mktemp("runs") / "light"
    assert trajevo("solve", "pointing", *TINY, *UNDRAWN, "--out", folder).returncode == 0
    return folder


@pytest.mark.parametrize("carries", mostly_long([False, True], False), ids=["light", "arm"])
def test_a_full_report_computes_once_and_show_and_later_reports_read_it(run, light, tmp_path, monkeypatch, carries):
    folder, _ = run if carries else (light, "")
    again = tmp_path / "again"
    again.mkdir()
    (again / "front.json").write_bytes((folder / "front.json").read_bytes())
    short = trajevo("report", again, "--no-pictures", "--out", again / "tables.html")
    assert short.returncode == 0, short.stderr
    tables = (again / "tables.html").read_text()
    assert "data:image" not in tables
    assert ("<h2>Payload</h2>" in tables) is carries
    assert "Interpolants at their least times" not in tables
    told = trajevo("report", again, "--full")
    assert told.returncode == 0, told.stderr
    assert ("computing: rivals\ncomputing: capacities\ncomputing: slowdown\n" in told.stderr) is carries
    assert pictures(again) >= FRONT_PICTURES | VIEWS
    assert ({"effort", "margins", "rivals", "slowdown", "workspace"} <= pictures(again)) is carries
    text = (again / "report.html").read_text()
    assert ("Interpolants at their least times under the same limits" in text) is carries
    for expected in ("Least times under the same limits", "one polynomial", "4.4737", "double-S, stops", "4.7509"):
        assert (expected in told.stdout) is carries
    assert ("An infinite jerk is a step of the acceleration" in text) is carries
    moving = trajevo("animate", again, "--solution", "least_time")
    assert moving.returncode == 0, moving.stderr
    assert ("puma560, " in (again / "least_time.html").read_text()) is carries
    carried = trajevo("capacity", again)
    assert carried.returncode == 0, carried.stderr
    assert ("limited by joint_" in carried.stdout) is carries

    def never(*_, **__):
        raise AssertionError("something was optimised")

    monkeypatch.setattr("scipy.optimize.minimize", never)
    repeated = trajevo("report", again, "--full")
    assert (repeated.returncode, repeated.stderr) == (0, "")
    assert trajevo("report", again).returncode == 0
    assert (again / "report.html").read_text() == text
    shown = trajevo("show", again)
    assert ("Least times under the same limits" in shown.stdout) is carries
    assert ("one polynomial" in shown.stdout) is carries
    (again / "front.analyses.npz").write_bytes(b"damaged")
    damaged = trajevo("show", again)
    assert damaged.returncode == 0
    assert "warning: " in damaged.stderr
    assert "front.analyses.npz: analyses that were kept cannot be read and count as none" in damaged.stderr
    assert ("not compared with other interpolants yet" in damaged.stdout) is carries


@pytest.mark.parametrize(
    ("options", "report", "drawn"),
    [
        (["--report", "none"], False, True),
        ([], True, False),
        pytest.param(["--pictures"], True, True, marks=pytest.mark.long),
        pytest.param(["--report", "none", "--no-pictures"], False, False, marks=pytest.mark.long),
    ],
)
def test_report_and_pictures_can_be_left_out(tmp_path, options, report, drawn):
    folder = tmp_path / "run"
    solved = trajevo("solve", "pointing", *TINY, *options, "--out", folder)
    assert solved.returncode == 0, solved.stderr
    assert len(Front.load(folder / "front.json")) > 0
    assert (folder / "report.html").exists() is report
    assert pictures(folder) == (FRONT_PICTURES if drawn else set())
    assert ("--full for views in space" in solved.stdout) is drawn
    assert (f"trajevo pictures {folder} for" in solved.stdout) is not drawn
    assert (folder / "front.analyses.npz").exists() is report
    assert "written: " in solved.stdout
    if report:
        page = (folder / "report.html").read_text()
        assert ("data:image" in page) is drawn
        without_scripts = re.findall("<noscript>(.*?)</noscript>", page, re.DOTALL)
        assert any("<svg" in one and "joint" in one for one in without_scripts) is not drawn


@pytest.mark.long
def test_solve_makes_a_full_report_where_it_is_asked_for(tmp_path):
    folder = tmp_path / "run"
    solved = trajevo("solve", "pointing", *TINY, "--report", "full", "--out", folder)
    assert solved.returncode == 0, solved.stderr
    assert pictures(folder) >= FRONT_PICTURES | VIEWS
    assert "--full" not in solved.stdout


def test_polished_and_resumed_fronts_are_analysed_again(tmp_path):
    folder = tmp_path / "run"
    assert trajevo("solve", "hybrid", "--payload", "8", *TINY, "--no-pictures", "--out", folder).returncode == 0
    (folder / "plots").mkdir(exist_ok=True)
    (folder / "plots" / "front.png").write_bytes(b"of the evolved front")
    before, kept = Front.load(folder / "front.json"), folder / "front.analyses.npz"
    evolved = read_analyses(kept, before)["certificate"]
    polished = trajevo("polish", folder, "--members", "2", "--rounds", "1", "--no-pictures")
    assert polished.returncode == 0, polished.stderr
    after = Front.load(folder / "front.json")
    assert after.digest != before.digest
    assert read_analyses(kept, before) == {}
    assert read_analyses(kept, after)["certificate"].rows != evolved.rows
    assert pictures(folder) == set()
    assert trajevo("resume", folder, "--quiet", "--report", "none", "--no-pictures").returncode == 0
    assert not kept.exists()
    assert not (folder / "report.html").exists()


@pytest.mark.parametrize("command", [["solve", "pointing"], ["resume", "run"], ["polish", "run"]])
def test_another_kind_of_report_is_refused_before_anything_is_done(tmp_path, command):
    refused = trajevo(*command, "--report", "long", cwd=tmp_path)
    assert refused.returncode == 2
    assert refused.stderr == "error: unknown report 'long'; known: full, none, short\n"
    assert not list(tmp_path.iterdir())
