"""The examples of CONTRIBUTING.md are a package that adds one of each kind of thing, and all of them can be used."""

import importlib
import json
import pickle
import re
import shutil
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

from tests.helpers import UNDRAWN, refused, trajevo
from trajevo import Front, ViaPointProblem, export, load_problem, load_robot, load_task, optimise
from trajevo.exporters.export import is_exported
from trajevo.formulation.registry import list_problems
from trajevo.problems.puma_kinematics import TABLE_1_JOINTS

ROOT = Path(__file__).parents[1]
TEXT = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
SMALL = {"seed": 1, "generations": 3, "population": 12, "progress": False, "polish": False}

TASK = """\
robot = "puma560"
points = {points}
duration_bounds = [0.5, 6.0]
interpolant = "even"
objectives = ["time", "joint_power"]

[constraints]
limits = ["velocity", "acceleration"]
most_power = {most}

[algorithm]
name = "small-steps"
population = 12
generations = 3
"""


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", TEXT, re.DOTALL)


@pytest.fixture(scope="module", autouse=True)
def package(tmp_path_factory):
    """A folder with the package and what an installation of it says of its entry points."""
    folder = tmp_path_factory.mktemp("installed")
    (folder / "my_package").mkdir()
    (folder / "my_package" / "__init__.py").touch()
    for code in blocks("python"):
        file = code.partition("\n")[0].removeprefix("# ")
        (folder / file).write_text(code, encoding="utf-8")
    groups = tomllib.loads(blocks("toml")[0])["project"]["entry-points"]
    lines = [
        line for group, points in groups.items() for line in (f"[{group}]", *(f"{k} = {v}" for k, v in points.items()))
    ]
    about = folder / "my_package-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: my_package\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("\n".join(lines))
    sys.path.insert(0, str(folder))
    importlib.invalidate_caches()
    yield folder
    sys.path.remove(str(folder))
    for name in [name for name in sys.modules if name.partition(".")[0] == "my_package"]:
        del sys.modules[name]


def problem(**arguments) -> ViaPointProblem:
    return ViaPointProblem(
        robot="puma560",
        points=TABLE_1_JOINTS,
        constraints=("velocity", "acceleration"),
        **{"objectives": ("time", "jerk")} | arguments,
    )


def with_the_objective():
    made = problem(objectives=("time", "joint_power"))
    x = np.full((2, made.n_var), 2.0)
    rollout = made.rollout(x)
    expected = np.abs(rollout.effort * rollout.v).sum(axis=2).max(axis=1)
    np.testing.assert_allclose(made.evaluate(x)[0][:, 1], expected, rtol=1e-12)
    assert [objective.unit for objective in made.objectives] == ["s", "W"]
    return made


def with_the_limit():
    made = problem(objectives=("time", "joint_power"), most_power=200.0)
    x = np.full((2, made.n_var), 2.0)
    F, G = made.evaluate(x)
    assert made.constraint_names[-1] == "power"
    np.testing.assert_allclose(G[:, -1], F[:, 1] / 200.0 - 1.0, rtol=1e-12)
    assert made.settings["most_power"] == 200.0
    assert "most_power" not in problem().settings
    return made


def with_the_interpolant():
    made = problem(interpolant="even")
    assert made.n_var == 1
    times = made.via_times(np.array([[2.0]]))[0]
    np.testing.assert_allclose(np.diff(times), 2.0)
    return made


def with_the_exporter():
    return problem()  # every front is exported below


def with_the_algorithm():
    made = problem()
    front = optimise(made, **SMALL | {"algorithm": "small-steps"})
    assert "PM(prob=0.9, eta=80" in front.run.settings["mutation"]
    return made


def with_the_problem():
    made = load_problem("swing", angle=0.4)
    assert made.settings == {"angle": 0.4}
    return made


#: What uses each example from Python.
USES = {
    "objective": with_the_objective,
    "limit": with_the_limit,
    "interpolant": with_the_interpolant,
    "exporter": with_the_exporter,
    "algorithm": with_the_algorithm,
    "problem": with_the_problem,
}


@pytest.mark.parametrize("kind", USES)
def test_the_example_is_used_from_python(kind, tmp_path):
    made = USES[kind]()
    again = load_problem(made.registered_name, **json.loads(json.dumps(made.settings)))
    x = np.linspace(made.xl, made.xu, 4)
    for other in (again, pickle.loads(pickle.dumps(made))):
        for ours, theirs in zip(made.evaluate(x), other.evaluate(x), strict=True):
            np.testing.assert_array_equal(ours, theirs)
    front = optimise(made, **SMALL)
    assert len(front), front.blocking
    front.save(tmp_path / "front.json")
    assert Front.load(tmp_path / "front.json") == front
    file = export(front.knee(), tmp_path / "knee.mat.txt", format="octave", step=0.05)
    table = np.loadtxt(file)
    assert table.shape[1] == 1 + made.robot.dof
    assert is_exported(file)


def task(tmp_path, most="400.0") -> Path:
    file = tmp_path / "task.toml"
    file.write_text(TASK.format(points=json.dumps(np.asarray(TABLE_1_JOINTS).tolist()), most=most))
    return file


def test_the_examples_are_used_from_a_task(tmp_path):
    made = load_task(task(tmp_path))
    front = made.solve(progress=False, polish=False)
    assert len(front), front.blocking
    assert front.objective_names == ("time", "joint_power")
    assert made.problem.constraint_names[-1] == "power"
    same = problem(objectives=("time", "joint_power"), interpolant="even", most_power=400.0)
    x = np.linspace(same.xl, same.xu, 3)
    np.testing.assert_array_equal(made.problem.evaluate(x)[0], same.evaluate(x)[0])
    assert (front.F[:, 1] <= 400.0).all()


def test_mistakes_in_a_task_are_told_as_of_any_other_key(tmp_path):
    refused(
        lambda: load_task(task(tmp_path, most='"many"')),
        "line 9: .*most_power: expected a number, got 'many'",
    )
    refused(
        lambda: load_task(task(tmp_path, most="-1.0")),
        r"line 9: constraints.most_power: expected a positive number \[W\], got -1.0",
    )
    file = task(tmp_path)
    file.write_text(file.read_text().replace("most_power", "most_powr"))
    refused(lambda: load_task(file), "line 9: constraints.most_powr: unknown key; known: .*; did you mean 'most_power'")
    refused(lambda: problem(most_powr=1.0), "takes no 'most_powr'; did you mean 'most_power'")


def test_the_examples_are_used_from_the_command_line(tmp_path):
    sizes = ("--generations", "3", "--population", "12", "--no-polish", "--quiet")
    done = trajevo("solve", task(tmp_path), *sizes, "--report", "none", "--out", tmp_path / "run")
    assert done.returncode == 0, done.stderr
    assert trajevo("export", tmp_path / "run", "--format", "octave").returncode == 0
    assert (tmp_path / "run" / "knee.mat.txt").is_file()
    file = tmp_path / "points.csv"
    headers = ", ".join(f"joint_{k} [rad]" for k in range(1, 7))
    rows = [", ".join(map(repr, row)) for row in np.asarray(TABLE_1_JOINTS).tolist()]
    file.write_text("\n".join([headers, *rows]))
    given = ("--points", file, "--interpolant", "even", "--set", "most_power=1e4", *sizes, "--out", tmp_path / "set")
    done = trajevo("solve", "via-points", *given, *UNDRAWN, "--set", 'constraints=["velocity"]')
    assert done.returncode == 0, done.stderr
    assert Front.load(tmp_path / "set/front.json").record.settings["most_power"] == 1e4
    listed = trajevo("list").stdout
    for name in ("joint_power", "most_power", "even", "octave", "small-steps", "swing"):
        assert name in listed


def test_the_example_of_a_robot_is_loaded(tmp_path):
    folder = tmp_path / "my_robot"
    folder.mkdir()
    content = blocks("toml")[1]
    assert content.startswith("# my_robot/robot.toml")
    (folder / "robot.toml").write_text(content)
    shutil.copy(ROOT / "robots" / "feed_drive" / "feed_drive.urdf", folder / "my_robot.urdf")
    assert load_robot(folder).limits.velocity.tolist() == [0.08, 0.08]


def test_it_names_every_room_group_and_command():
    for room in (folder for folder in (ROOT / "trajevo").iterdir() if (folder / "__init__.py").is_file()):
        assert f"| `{room.name}` |" in TEXT
    makefile = (ROOT / "Makefile").read_text()
    for command in re.findall(r"`make ([a-z-]+)`", TEXT):
        assert f"\n{command}:" in makefile
    for path in re.findall(r"`((?:formulation|trajectory|exporters|solvers)/[a-z_/.]+)`", TEXT):
        assert (ROOT / "trajevo" / path).exists(), path
    assert "swing" in list_problems()
