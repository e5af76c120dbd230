"""A user's own objectives, constraints and interpolants: as they are, by their places, in tasks, as options."""

import json
import sys

import numpy as np
import pytest

from tests.helpers import UNDRAWN, mostly_long, refused, trajevo, trajevo_process
from trajevo import Front, Objective, Payload, ViaPointProblem, certify, load_task, optimise, resume
from trajevo.base.own.code import allow_module
from trajevo.formulation.constraints.constraint import Constraint, LimitKind, LimitParameter
from trajevo.trajectory.interpolants import QuinticSpline

ROWS = [[0.0, 0.0], [0.4, 0.1], [0.0, 0.2]]
SMALL = {"seed": 1, "generations": 3, "population": 12, "progress": False, "polish": False}
CELL = """
import numpy as np
from trajevo import Constraint, Interpolant, Objective, QuinticSpline, Variable

with open("imported.txt", "a") as file:
    file.write("x")


def peak_speed(rollout):
    '''Greatest speed of any joint.'''
    return np.abs(rollout.trajectory.peak(1)).max(axis=1)


peak_speed.unit = "rad/s"


def calm(rollout):
    return np.abs(rollout.v).max(axis=(1, 2)) / 0.8 - 1.0


def broken(rollout):
    return rollout.no_such_thing


HASTE = Objective("haste", "1/s", "mine", lambda rollout: 1.0 / rollout.trajectory.duration)
PATIENCE = Constraint(("patience",), "mine", lambda rollout: rollout.trajectory.duration[:, None] / 9.0 - 1.0)


class Even(Interpolant):
    def __init__(self, points, *, duration_bounds):
        self.points, self.spline = points, QuinticSpline(points, duration_bounds=duration_bounds)

    @property
    def variables(self):
        first = self.spline.variables[0]
        return (Variable("dt", "s", first.lower, first.upper),)

    def __call__(self, x):
        return self.spline(np.repeat(x, len(self.points) - 1, axis=1))

    def via_times(self, x):
        return self.spline.via_times(np.repeat(x, len(self.points) - 1, axis=1))
"""
TASK = """
robot = "pointing_mechanism"
points = [[0.0, 0.0], [0.4, 0.1], [0.0, 0.2]]
duration_bounds = [0.5, 6.0]
interpolant = "{interpolant}"
objectives = ["time", "{objective}"]
[constraints]
limits = ["velocity", "{constraint}"]
[algorithm]
generations = 3
population = 12
polish = false
"""
NAMES = {
    "interpolant": "own_places_cell:Even",
    "objective": "own_places_cell:peak_speed",
    "constraint": "own_places_cell:calm",
}


def slowest(rollout):
    """Negative least speed."""
    return -rollout.v.real.min(axis=(1, 2))


def modest(rollout):
    return np.abs(rollout.v).max(axis=(1, 2)) / 1.5 - 1.0


def one_column_more(rollout):
    return np.zeros((len(rollout.trajectory), 2))


def problem(**given):
    usual = {"robot": "pointing_mechanism", "points": ROWS, "duration_bounds": (0.5, 6.0), "constraints": ("velocity",)}
    return ViaPointProblem(**(usual | given))


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with a task and the module that it names; what is imported from there is forgotten afterwards."""
    (tmp_path / "own_places_cell.py").write_text(CELL)
    (tmp_path / "task.toml").write_text(TASK.format(**NAMES))
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.setattr("trajevo.base.own.code._named", {})
    monkeypatch.setattr("trajevo.base.own.code._allowed", set())
    monkeypatch.chdir(tmp_path)
    yield tmp_path
    sys.modules.pop("own_places_cell", None)


def test_functions_stand_beside_names_and_problems_are_those_made_by_hand():
    own = problem(objectives=("time", slowest), constraints=("velocity", modest))
    assert [one.name for one in own.objectives] == ["time", "slowest"]
    assert (own.objectives[1].unit, own.objectives[1].help) == ("1", "Negative least speed")
    assert own.constraint_names[-1] == "modest"
    x = np.full((3, 2), [1.0, 2.0])
    F, G = own.evaluate(x)[:2]
    rollout = own.rollout(x)
    np.testing.assert_array_equal(F[:, 1], slowest(rollout))
    np.testing.assert_array_equal(G[:, -1], modest(rollout))
    assert own.settings["objectives"] == ["time", "tests.formulation.test_own_places:slowest"]
    json.dumps(own.settings)


def test_records_stand_for_themselves_and_keep_their_places():
    lateness = Objective("lateness", "s", "mine", lambda rollout: 2.0 * rollout.trajectory.duration)
    patience = Constraint(("patience",), "mine", lambda rollout: rollout.trajectory.duration[:, None] / 9.0 - 1.0)
    own = problem(objectives=[lateness, "time"], constraints=["velocity", patience])
    F, G = own.evaluate(np.full((1, 2), 2.0))[:2]
    np.testing.assert_allclose(F, [[8.0, 4.0]])
    np.testing.assert_allclose(G[0, -1], 4.0 / 9.0 - 1.0)
    heavier = own.with_payload(Payload(0.5))
    assert heavier.objectives[0].function is lateness.function


def test_an_interpolant_of_ones_own_takes_part_in_everything():
    own = problem(interpolant=Reversed, objectives=("time", "jerk"))
    assert [variable.name for variable in own.variables] == ["dt_1", "dt_2"]
    np.testing.assert_allclose(own.via_times([[1.0, 3.0]]), [[0.0, 3.0, 4.0]])
    stopping = problem(interpolant=Reversed, passing=[{"point": 1, "stop": True}])
    assert np.abs(stopping.decode(np.array([[1.0, 3.0]])).evaluate(np.array([[1.0]]), 1)).max() < 1e-12
    assert certify(optimise(own, **SMALL).pick("0")).proven


class Reversed(QuinticSpline.__base__):
    """A quintic spline whose durations are given from the last to the first."""

    def __init__(self, points, *, duration_bounds):
        self.spline = QuinticSpline(points, duration_bounds=duration_bounds)

    @property
    def variables(self):
        return self.spline.variables

    def __call__(self, x):
        return self.spline(np.asarray(x)[:, ::-1])

    def via_times(self, x):
        return self.spline.via_times(np.asarray(x)[:, ::-1])


class Demanding(Reversed):
    def __init__(self, points, *, duration_bounds, colour):
        self.colour = colour


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"objectives": [lambda rollout: rollout.t]}, r"expected a function with a name; give Objective\('my_name'"),
        ({"objectives": [3.0]}, "expected a function of a rollout, or Objective"),
        ({"objectives": ["time", Objective("jerk", "s", "t", slowest)]}, "expected another name than 'jerk'"),
        ({"constraints": [Reversed]}, "expected a function of a rollout, or Constraint.*got the class Reversed"),
        ({"constraints": [Constraint((), "t", slowest)]}, "expected at least one column"),
        (
            {"constraints": [LimitKind("k", "h", slowest, (LimitParameter("most", "1", "h"),))]},
            "expected a LimitKind without parameters, got 'most'",
        ),
        ({"interpolant": slowest}, "expected a class derived from trajevo.Interpolant, got function"),
        ({"interpolant": Demanding}, "Demanding cannot be made of points: TypeError: .*colour"),
        ({"objectives": ["no_such_module_anywhere:f"]}, "objectives: no Python module 'no_such_module_anywhere'"),
        ({"objectives": ["json:dunps"]}, "unknown name in module json 'dunps'.*did you mean 'dumps'"),
        ({"objectives": ["time", "json:"]}, "unknown objective 'json:'"),
    ],
)
def test_what_cannot_be_used_is_refused_in_a_sentence(given, says):
    refused(lambda: problem(**given), says)


def test_wrong_shapes_and_errors_name_the_function_and_its_line():
    refused(
        lambda: problem(constraints=[one_column_more]).evaluate(np.full((2, 2), 2.0)),
        r"constraint 'one_column_more': expected shape \(B, 1\)",
    )


def test_a_task_names_functions_beside_it(folder):
    task = load_task(folder / "task.toml")
    assert [one.name for one in task.problem.objectives] == ["time", "peak_speed"]
    assert [one.unit for one in task.problem.objectives] == ["s", "rad/s"]
    assert task.problem.n_var == 1
    assert task.problem.settings["constraints"] == ["velocity", NAMES["constraint"]]
    with_records = TASK.format(
        **NAMES | {"objective": "own_places_cell:HASTE", "constraint": "own_places_cell:PATIENCE"}
    )
    (folder / "records.toml").write_text(with_records)
    assert load_task(folder / "records.toml").problem.constraint_names[-1] == "patience"
    for key, name, says in (
        ("objective", "own_places_cell:peek_speed", "line 6.*did you mean 'peak_speed'"),
        ("objective", "own_place_cell:peak_speed", "line 6.*no Python module 'own_place_cell'.*own_places_cell"),
        ("interpolant", "own_places_cell:calm", "line 5.*expected a class derived"),
    ):
        (folder / "wrong.toml").write_text(TASK.format(**NAMES | {key: name}))
        refused(lambda: load_task(folder / "wrong.toml"), says)


def test_an_error_in_a_function_of_a_task_is_told_with_its_line(folder):
    (folder / "broken.toml").write_text(TASK.format(**NAMES | {"objective": "own_places_cell:broken"}))
    told = trajevo("solve", "broken.toml", "--quiet", "--report", "none", "--no-pictures", cwd=folder)
    assert told.returncode == 2
    line = 1 + CELL.splitlines().index("    return rollout.no_such_thing")
    assert "objective 'broken': fails for every individual, first with AttributeError" in told.stderr
    assert f"line {line} of {folder / 'own_places_cell.py'}" in told.stderr


def test_a_module_of_the_same_name_elsewhere_is_not_taken_for_it(folder):
    load_task(folder / "task.toml")
    other = folder / "other"
    other.mkdir()
    (other / "own_places_cell.py").write_text(CELL)
    (other / "task.toml").write_text(TASK.format(**NAMES))
    refused(lambda: load_task(other / "task.toml"), "another one of this name is in use: .*give yours another name")


QUIET = ("--quiet", *UNDRAWN)


def test_the_data_of_a_run_imports_nothing_until_it_is_allowed(folder):
    done = trajevo("solve", "task.toml", *QUIET, cwd=folder)
    assert done.returncode == 0, done.stderr
    sys.modules.pop("own_places_cell")
    _forget()
    (folder / "imported.txt").unlink()
    for command in (("show",), ("verify",), ("certify",), ("resume", *QUIET), ("export", "--format", "csv")):
        name, *options = command
        code = 1 if name == "certify" else 0  # what is known at samples only is not proven
        refused_here = trajevo(name, "runs/task", *options, cwd=folder)
        if name == "show":
            assert "not checked" in refused_here.stdout + refused_here.stderr
        else:
            assert refused_here.returncode == 2, name
            assert "names 'own_places_cell:Even'" in refused_here.stderr
            assert "--problem own_places_cell" in refused_here.stderr
        assert "own_places_cell" not in sys.modules
        assert not (folder / "imported.txt").exists()
        by_task = trajevo(name, "runs/task", *options, "--problem", "task.toml", cwd=folder)
        assert by_task.returncode == code, by_task.stderr
        sys.modules.pop("own_places_cell")
        _forget()
        allowed = trajevo(name, "runs/task", *options, "--problem", "own_places_cell", cwd=folder)
        assert allowed.returncode == code, allowed.stderr
        sys.modules.pop("own_places_cell")
        _forget()
        (folder / "imported.txt").unlink()


def _forget():
    from trajevo.base.own import code

    code._named.clear()
    code._allowed.clear()


def test_a_run_in_python_is_read_and_resumed_by_who_named_the_functions(folder):
    problem_of_task = load_task(folder / "task.toml").problem
    front = optimise(problem_of_task, **SMALL, out=folder / "run")
    assert resume(folder / "run", progress=False).problem.objective_names == ("time", "peak_speed")
    _forget()
    refused(lambda: resume(folder / "run", progress=False), "in Python pass the problem")
    again = resume(folder / "run", problem=problem_of_task, progress=False)
    np.testing.assert_array_equal(again.X, front.X)
    _forget()
    read = Front.load(folder / "run" / "front.json")
    refused(lambda: read.problem, "which is not imported for the data of a run")
    allow_module("own_places_cell")
    np.testing.assert_array_equal(read.problem.evaluate(front.X)[0], front.F)


def test_a_run_is_shown_as_recorded_without_its_functions(folder):
    front = optimise(load_task(folder / "task.toml").problem, **SMALL, out=folder / "recorded")
    _forget()
    shown = trajevo("show", "recorded", cwd=folder)
    assert shown.returncode == 0, shown.stderr
    knee = front.knee()
    assert all(f"{value:.6g}" in shown.stdout for value in knee.F.values())
    assert "limits and motions need the problem: trajevo show recorded --problem MODULE" in shown.stdout
    assert "the numbers are as recorded, not checked" in shown.stderr


def test_a_record_cannot_name_what_nobody_named(folder):
    front = optimise(problem(objectives=("time", "jerk")), **SMALL)
    front.save(folder / "front.json")
    content = json.loads((folder / "front.json").read_text())
    for place in ("os:system", "subprocess:run", "own_places_cell:peak_speed"):
        content["problem"]["settings"]["objectives"] = ["time", place]
        (folder / "wrong.json").write_text(json.dumps(content))
        refused(lambda: Front.load(folder / "wrong.json").problem, f"names '{place}'")
    assert not (folder / "imported.txt").exists()


def test_options_of_the_command_line_name_functions_too(folder):
    options = [
        "--interpolant", "own_places_cell:Even",
        "--set", 'robot="pointing_mechanism"',
        "--set", f"points={ROWS}",
        "--set", 'objectives=["time", "own_places_cell:peak_speed"]',
        "--set", 'constraints=["velocity", "own_places_cell:calm"]',
        "--generations", "3", "--population", "12", "--no-polish",
    ]  # fmt: skip
    done = trajevo("solve", "via-points", *options, *QUIET, cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "peak_speed" in done.stdout


@pytest.mark.parametrize("workers", mostly_long(["1", "2"], "1"))
def test_studies_run_with_functions_beside_them(folder, workers):
    (folder / "study.toml").write_text(
        'task = "task.toml"\nseed = 1\nrepeats = 1\ngenerations = 2\npopulation = 8\n[factors]\nsamples = [4, 6]\n'
    )
    run = trajevo if workers == "1" else trajevo_process
    done = run("study", "run", "study.toml", "--workers", workers, cwd=folder)
    assert done.returncode == 0, done.stderr + done.stdout
    fronts = list((folder / "runs" / "study").glob("cells/*/front.json"))
    assert len(fronts) == 2
