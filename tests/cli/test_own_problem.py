"""Problems made by hand in Python, on the command line: ``module:name``."""

import sys

import pytest

from tests.helpers import UNDRAWN, mostly_long, trajevo, trajevo_process
from trajevo import Front

CELL = """
from trajevo import Dynamics, QuinticSpline, TrajectoryProblem, ViaPoints, load_robot
from trajevo.formulation.constraints.joint_limits import kinematic_limits
from trajevo.formulation.objectives import objectives_of


class Cell(TrajectoryProblem):
    title = "Feeding press 3"

    def __init__(self, angle=0.5):
        robot = load_robot("pointing_mechanism")
        points = ViaPoints.for_robot(robot, [[0.0, 0.0], [angle, 0.1], [0.0, 0.0]])
        super().__init__(
            dynamics=Dynamics(robot),
            interpolant=QuinticSpline(points, duration_bounds=(0.5, 10.0)),
            objectives=objectives_of(["time", "jerk"], robot),
            constraints=kinematic_limits(robot),
        )


problem = Cell()
other = Cell(0.4)
number = 3


def fails():
    raise KeyError("no such press")
"""
SMALL = ("--generations", "4", "--population", "12", "--no-polish", "--quiet")


@pytest.fixture(scope="module", params=mostly_long([trajevo, trajevo_process], trajevo), ids=lambda each: each.__name__)
def folder(request, tmp_path_factory):
    place = tmp_path_factory.mktemp("cell")
    (place / "my_own_cell.py").write_text(CELL)
    (place / "broken_cell.py").write_text("import trajevo\nthis is no Python\n")
    (place / "needs_more.py").write_text("import not_installed_anywhere\n")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "path", list(sys.path))
        done = request.param("solve", "my_own_cell:problem", *SMALL, *UNDRAWN, cwd=place)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("Feeding press 3: ")
    yield place
    for name in ("my_own_cell", "broken_cell", "needs_more"):
        sys.modules.pop(name, None)


@pytest.fixture(autouse=True)
def path_of_a_new_process(monkeypatch):
    monkeypatch.setattr(sys, "path", list(sys.path))


RUN = "runs/my_own_cell.problem"
COMMANDS = [
    ("show",),
    ("verify",),
    ("certify",),
    ("explain",),
    ("report", "--no-pictures", "--out", "r.html"),
    ("export", "--format", "csv"),
    ("capacity",),
    ("polish", "--members", "2", "--rounds", "1", "--out", "polished.json"),
    ("resume", "--report", "none", "--no-pictures", "--quiet"),
]


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command[0])
@pytest.mark.parametrize("given", mostly_long(["problem", "Cell"], "problem"))
def test_commands_take_the_problem_that_is_not_registered(folder, command, given):
    name, *options = command
    refused = trajevo(name, RUN, *options, cwd=folder)
    assert refused.returncode == 2
    assert refused.stderr == (
        f"error: {RUN}: its problem 'Feeding press 3' is not a registered one; give it: --problem MODULE:NAME, where "
        "NAME in the Python module MODULE is the problem, or makes it\n"
    )
    done = trajevo(name, RUN, *options, "--problem", f"my_own_cell:{given}", cwd=folder)
    assert done.returncode == 0, done.stderr


def test_an_unfinished_run_is_shown_and_a_front_alone_too(folder, tmp_path):
    (tmp_path / "front.json").write_bytes((folder / RUN / "front.json").read_bytes())
    assert len(Front.load(tmp_path / "front.json")) > 0
    shown = trajevo("show", tmp_path / "front.json", "--problem", "my_own_cell:problem", cwd=folder)
    assert shown.returncode == 0, shown.stderr
    assert "--problem MODULE:NAME" in trajevo("show", tmp_path / "front.json", cwd=folder).stderr


def test_check_takes_a_place_in_python(folder):
    told = trajevo("check", "my_own_cell:Cell", cwd=folder)
    assert told.returncode == 0, told.stderr
    assert "Feeding press 3" in told.stdout


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ("my_own_cell", "its problem 'Feeding press 3' is not a registered one; give it: --problem MODULE:NAME"),
        ("my own cell", "problem: expected MODULE:NAME, such as my_cell:problem, got 'my own cell'"),
        ("my_own_cell.py:problem", "no Python module 'my_own_cell.py'"),
        ("my_own_cel:problem", "known: broken_cell, my_own_cell, needs_more; did you mean 'my_own_cell'?"),
        ("my_own_cell:problm", "unknown name in module my_own_cell 'problm'"),
        (
            "my_own_cell:number",
            "my_own_cell:number: expected a TrajectoryProblem, or a class or function that makes one",
        ),
        ("my_own_cell:fails", "my_own_cell:fails cannot be made: KeyError: 'no such press', "),
        ("my_own_cell:other", "or its problem is another one than that given"),
        ("broken_cell:problem", "module broken_cell cannot be imported: SyntaxError: "),
        ("needs_more:problem", "module needs_more: ModuleNotFoundError: No module named 'not_installed_anywhere'"),
    ],
)
def test_a_place_in_python_that_cannot_be_used_is_told(folder, given, says):
    told = trajevo("verify", RUN, "--problem", given, cwd=folder)
    assert told.returncode == 2
    assert says in told.stderr
    assert told.stderr.startswith("error: ")
    assert len(told.stderr.splitlines()) == 1


def test_options_of_registered_problems_are_refused(folder):
    told = trajevo("check", "my_own_cell:Cell", "--payload", "3", cwd=folder)
    assert told.returncode == 2
    assert told.stderr == "error: --payload: my_own_cell:Cell is made in Python, where it takes its arguments\n"
