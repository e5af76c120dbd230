"""The nearest valid name, whatever was misspelled."""

import pytest

from trajevo.errors import UnknownNameError, known_names, nearest_names, no_such_file

NAMES = ["algorithm", "duration_bounds", "limits", "points", "quintic_spline", "septic_spline", "tool"]


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        ("duration_bound", ["duration_bounds"]),
        ("Duration-Bounds", ["duration_bounds"]),
        ("quintic spline", ["quintic_spline"]),
        ("quintic", ["quintic_spline"]),
        ("optimizer", ["algorithm"]),
        ("waypoints", ["points"]),
        ("tcp", ["tool"]),
        ("joint_limits", ["limits"]),
        ("xyzzy", []),
        (1, []),
        (None, []),
        (b"tool", ["tool"]),
    ],
)
def test_the_nearest_name_is_found(given, meant):
    assert nearest_names(given, NAMES) == meant


def test_short_lists_are_told_whole_and_long_ones_by_their_nearest():
    assert known_names("tol", NAMES) == f"known: {', '.join(NAMES)}; did you mean 'tool'?"
    many = [f"robot_{k}" for k in range(30)]
    assert known_names("robto_7", many) == "did you mean 'robot_7', 'robot_27' or 'robot_17'?"
    assert known_names("xyzzy", many) == f"known: {', '.join(sorted(many))}"
    assert known_names("a", []) == "known: none"
    assert UnknownNameError("robot", "ur6", ["ur5", "ur10"]).kind == "robot"


def test_the_nearest_file_of_a_folder_is_found(tmp_path):
    for name in ("task.toml", "task.txt", "points.csv"):
        (tmp_path / name).touch()
    here = str(tmp_path)
    for wrong, says in (
        ("taks.toml", f"no such file; did you mean '{here}/task.toml'?"),
        ("points.cvs", f"no such file; did you mean '{here}/points.csv'?"),
        ("else.toml", "no such file"),
        ("no/a.csv", f"no such file, nor the folder '{here}/no'"),
    ):
        assert no_such_file(tmp_path / wrong) == f"{here}/{wrong}: {says}"
