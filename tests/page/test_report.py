"""The page of a run: numbers, motions, efforts, files and robot as Python has them, in a file that asks for nothing."""

import re

import numpy as np
import pytest

from tests.helpers import mostly_long, refused
from tests.page.reading import Page
from trajevo import Front, Robot, ViaPointProblem, export, load_problem, optimise, report
from trajevo.cli.main import COMMANDS
from trajevo.page import parts
from trajevo.page.members import as_polynomials
from trajevo.trajectory.batch import DERIVATIVES

pytest.importorskip("meshcat", reason="meshcat is not installed: pip install 'trajevo[animation]'")

FEW = {"population": 16, "generations": 4, "polish": False, "progress": False, "seed": 1}
UR5 = {"name": "ur5", "tool": "tool0", "limits": {"acceleration": 10.0, "jerk": 100.0}}
POINTS = [[0.0, -1.5, 1.5, -1.5, -1.5, 0.0], [0.8, -1.2, 1.4, -1.7, -1.5, 0.0], [0.4, -1.0, 1.0, -1.0, -1.0, 0.3]]


def arm(**more):
    return ViaPointProblem(**{"robot": UR5, "points": POINTS, "objectives": ("time", "jerk", "energy")} | more)


PROBLEMS = {
    "arm": arm,
    "arm, freer": lambda: arm(interpolant="cubic", extra_points=1, duration_bounds=(0.02, 3.0)),
    "pointing": lambda: load_problem("pointing"),
    "hybrid": lambda: load_problem("hybrid"),
    "pick and place": lambda: load_problem("pick-place"),
    "along a path": lambda: load_problem("reparam"),
    "in millimetres": lambda: ViaPointProblem(robot="feed_drive", points=[[0.0, 0.0], [0.05, 0.02], [0.1, 0.1]]),
    "no body": lambda: ViaPointProblem(
        robot=Robot.from_limits(velocity=[2.0] * 2, acceleration=[5.0] * 2, jerk=[50.0] * 2, names=["a", "b"]),
        points=[[0.0, 0.0], [1.0, 0.5], [0.0, 1.0]],
    ),
}


@pytest.fixture(scope="module", params=mostly_long(PROBLEMS, "hybrid", "along a path", "in millimetres", "no body"))
def solved(request, tmp_path_factory):
    front = optimise(PROBLEMS[request.param](), **FEW)
    file = report(front, tmp_path_factory.mktemp("page") / "page.html", analyses={}, pictures=[])
    return front, Page.of(file)


@pytest.mark.thinned(2)
def test_numbers_are_those_of_the_front_to_the_bit(solved):
    front, page = solved
    rows = page.members("rows")
    np.testing.assert_array_equal(rows, front.thinned())
    np.testing.assert_array_equal(page.members("F"), front.F)
    np.testing.assert_allclose(page.members("G"), front.G, rtol=1e-6, atol=1e-6)
    assert page.data["constraints"] == list(front.record.constraints)
    chosen = {one["rule"]: rows[one["member"]] for one in page.data["choices"]}
    assert chosen == {choice.rule: choice.index for choice in front.choices()}


def test_motions_are_those_of_the_front(solved):
    front, page = solved
    row = len(front) // 2
    trajectory = front.rollouts.trajectory[row]
    duration = float(trajectory.duration[0])
    exact = type(as_polynomials(trajectory)) is type(trajectory)
    for order in range(len(DERIVATIVES) if exact else 2):
        times = np.linspace(0.0, duration, 23)[1:-1]
        expected = trajectory.evaluate(times, order)[0]
        near = 1e-4 * max(float(np.abs(expected).max()), 1e-9)
        found = [page.values(row, time, order) for time in times]
        np.testing.assert_allclose(found, expected, atol=near)


def test_efforts_are_those_of_the_front(solved):
    front, page = solved
    if not front.problem.robot.gives_effort:
        assert "effort" not in page.data["members"]
        return
    row = len(front) - 1
    rollout = front.problem.rollout(front.X[row])
    duration = float(rollout.trajectory.duration[0])
    ends = page.members("breaks")[row].astype(float)
    nodes = np.array(page.data["members"]["effort_at"])
    t = (ends[:-1, None] + np.diff(ends)[:, None] * nodes).ravel()
    inner = np.abs(t[:, None] - rollout.trajectory.breaks[0]).min(axis=1) > 1e-6 * duration
    states = [rollout.trajectory.evaluate(np.minimum(t, duration), order) for order in range(3)]
    expected = rollout.effort_in(*states, np.minimum(t, duration))[0]
    scale = np.array(page.data["members"]["effort_scale"])
    found = page.members("effort")[row] * scale
    near = scale + 1e-4 * np.abs(expected).max(axis=0)
    assert (np.abs(found - expected)[inner] <= near).all()


def test_limits_are_those_that_are_kept(solved):
    front, page = solved
    kept = front.problem.kept_limits
    for one in page.data["quantities"]:
        for end, expected in zip(("low", "high"), kept.bounds(one["name"]), strict=True):
            found = np.array([np.inf if value is None else value for value in one[end]])
            np.testing.assert_array_equal(np.abs(found), np.abs(expected))


@pytest.mark.thinned(2)
def test_files_are_what_export_writes_byte_for_byte(solved, tmp_path):
    front, page = solved
    choices = {str(choice.index): choice for choice in front.choices()}
    assert set(page.data["known"]) == set(choices)
    counted = 0
    for row, known in page.data["known"].items():
        for file in known["files"]:
            rule, _, ending = file["name"].partition(".")
            format = {"csv": "csv", "json": "json", "yaml": "ros2"}[ending]
            written = export(front.pick(rule), tmp_path / file["name"], format=format).read_bytes()
            assert page.array(file["text"]).tobytes() == written
            assert front.pick(rule).index == int(row)
            counted += 1
    assert counted >= min(3, 2 * len(choices))  # as many as there is room for, those of the knee first
    knee = page.data["known"][str(front.knee().index)]
    assert {file["kind"] for file in knee["files"]} >= {"text/csv", "application/json"}


def test_the_page_asks_for_nothing_and_can_be_read_without_scripts(solved):
    front, page = solved
    assert "default-src 'none'" in page.text
    assert not re.search(r"<(link|iframe|script[^>]*\ssrc)\b", page.text)
    assert not re.search(r"(src|href)\s*=\s*[\"'](https?:)?//", page.text)
    static = re.sub(r"<script.*?</script>", "", page.text, flags=re.DOTALL)
    for expected in ("<h2>Solutions</h2>", "<h2>Limits at the knee</h2>", "<summary>Run</summary>"):
        assert expected in static
    assert f"<h1>{front.record.title}</h1>" in static


def test_commands_that_the_page_names_exist():
    named = re.findall(r'(?:command|unknown)\("([a-z-]+)"', parts.static("page.js"))
    assert set(named) == {"certify", "capacity", "export"} <= set(COMMANDS)


def test_files_of_the_knee_alone_where_they_are_enough(tmp_path):
    front = optimise(arm(), **FEW)
    page = Page.of(report(front, tmp_path / "page.html", analyses={}, pictures=[], files="knee"))
    assert set(page.data["known"]) == {str(front.knee().index)}
    refused(lambda: report(front, tmp_path / "page.html", files="all"), "files: 'all'|unknown files 'all'")


def test_a_title_that_ends_a_script_stays_a_title(tmp_path):
    front = optimise(arm(title="</script><script>alert(1)</script>"), **FEW)
    page = Page.of(report(front, tmp_path / "page.html", analyses={}, pictures=[]))
    assert page.data["title"] == "</script><script>alert(1)</script>"
    assert "<script>alert" not in page.text


@pytest.mark.parametrize("name", mostly_long(["arm", "hybrid"], "hybrid"))
def test_three_thousand_members_take_less_than_six_megabytes(name, tmp_path):
    """Rows as a large run may have them; they need not be non-dominated for their size."""
    problem = arm(points=[*POINTS, POINTS[0]]) if name == "arm" else load_problem("hybrid")
    front = optimise(problem, **FEW)
    rng = np.random.default_rng(1)
    X = front.X[rng.integers(len(front), size=3000)] * rng.uniform(1.0, 1.5, (3000, 1))
    found = problem.evaluate(X, return_values_of=["F", "G"], return_as_dictionary=True)
    large = Front(X, found["F"], found["G"], front.record, front.run, front.history, None, _problem=problem)
    file = report(large, tmp_path / "page.html", analyses={}, pictures=[])
    page = Page.of(file)
    assert file.stat().st_size < 6e6
    assert len(page.members("rows")) >= 1000
    assert set(page.members("rows")) >= {choice.index for choice in large.choices()}


def test_without_the_viewer_the_rest_is_there(tmp_path, monkeypatch):
    monkeypatch.setattr("trajevo.page.explorer.packed_viewer", lambda: "")
    front = optimise(arm(), **FEW)
    page = Page.of(report(front, tmp_path / "page.html", analyses={}, pictures=[]))
    assert page.data["arm"] is None
    assert parts.NO_VIEWER in page.text.replace("&#x27;", "'")
    assert 'id="viewer"' not in page.text.replace('byId("viewer")', "")
