"""Studies as data: cells, names and seeds that do not depend on each other, and files that are refused with a line."""

import json
import pickle

import pytest

from tests.helpers import refused
from trajevo import load_task
from trajevo.problems import HybridManipulator, PointingMechanism
from trajevo.study.definition import Study, load_study
from trajevo.study.folder import StudyFolder
from trajevo.study.record import cell_seed

TASK = """\
format = 1
robot = "pointing_mechanism"
points = [[0.2, 0.1], [0.0, 0.3], [-0.2, 0.0]]
duration_bounds = [1.0, 10.0]
objectives = ["time", "jerk"]

[limits]
jerk = 10.0

[constraints]
limits = ["position", "velocity", "acceleration", "jerk"]

[algorithm]
population = 20
generations = 6
"""

GOOD = """\
problem = "hybrid"
seed = 7
repeats = 2
generations = 5
population = 8

[fixed]
samples = 4

[factors]
payload = [5, { label = "offset", value = { mass = 5.0, com = [0.0, 0.0, 0.1] } }]
convention = ["continuous", "printed"]
"""


def seeds(study):
    return {cell.name: cell.seed for cell in study.cells}


def hybrid(**changes):
    return Study(**({"problem": "hybrid", "seed": 3, "repeats": 2, "factors": {"payload": [5, 10]}} | changes))


@pytest.fixture
def write(tmp_path):
    def written(text):
        file = tmp_path / "study.toml"
        file.write_text(text)
        return file

    return written


@pytest.fixture
def task(tmp_path):
    file = tmp_path / "task.toml"
    file.write_text(TASK)
    return file


def test_cells_are_the_product_of_levels_and_repeats_with_readable_names(write):
    study = load_study(write(GOOD))
    assert [cell.name for cell in study.cells] == [
        f"payload={payload},convention={convention},repeat={repeat}"
        for payload in ("5", "offset")
        for convention in ("continuous", "printed")
        for repeat in ("01", "02")
    ]
    assert len(set(seeds(study).values())) == 8
    job = study.jobs[4]
    assert job["arguments"]["payload"]["com"] == [0.0, 0.0, 0.1]
    assert job["arguments"]["samples"] == 4
    assert job["search"] == {"generations": 5, "population": 8}
    assert json.loads(json.dumps(job)) == job


def test_adding_levels_or_repeats_changes_no_other_cell():
    small = seeds(hybrid())
    large = seeds(hybrid(repeats=150, factors={"payload": [7.5, 10, 5]}))
    assert small.items() <= large.items()
    assert len(set(large.values())) == 450


def test_the_seed_is_that_of_its_settings_on_every_machine():
    assert (
        cell_seed(3, {"payload": 5}, 1) == cell_seed(3, {"payload": 5.0}, 1) == seeds(hybrid())["payload=5,repeat=01"]
    )
    assert cell_seed(3, {"payload": 5}, 1) == 2168490480
    others = {cell_seed(4, {"payload": 5}, 1), cell_seed(3, {"payload": 6}, 1), cell_seed(3, {"payload": 5}, 2)}
    assert len(others | {2168490480}) == 4


def test_names_are_safe_for_every_file_system():
    levels = [
        {"label": "a/b c", "value": [0.1, 1.0]},
        {"label": "a:b c", "value": [0.2, 1.0]},
        {"label": "é" * 60, "value": [0.3, 1.0]},
    ]
    many = {"duration_bounds": levels, "convention": ["continuous"], "objectives": ["all"], "samples": [4]}
    names = [cell.name for cell in hybrid(factors=many).cells]
    assert len(set(names)) == 6
    for name in names:
        assert name.isascii()
        assert len(name) <= 140
        assert not set(name) & set('/\\:*?"<>| ')


def test_a_study_without_factors_repeats_the_problem():
    assert [cell.name for cell in Study("pointing", seed=1, repeats=2).cells] == ["repeat=01", "repeat=02"]


def test_every_distinct_problem_is_made_once(monkeypatch):
    made = []
    monkeypatch.setattr(
        "trajevo.study.jobs.load_problem", lambda name, **given: made.append(given) or HybridManipulator(**given)
    )
    hybrid(repeats=5, factors={"payload": [5, 10], "population": [8, 12, 16]})
    assert made == [{"payload": 5}, {"payload": 10}]


def test_a_task_varies_by_the_keys_of_its_file(task):
    factors = {"interpolant": ["quintic_spline", "septic_spline"], "limits.jerk": ["300 deg/s^3", 5.0]}
    study = Study(task=task, seed=1, repeats=1, factors=factors, population=12)
    assert study.jobs[0]["problem"] == "via-points"
    assert study.cells[0].name.startswith("interpolant=quintic_spline,limits.jerk=300-deg-s-3-")
    assert study.jobs[0]["search"] == {"population": 12, "generations": 6}
    limits = [job["arguments"]["robot"]["limits"]["jerk"] for job in study.jobs]
    assert limits == ["300 deg/s^3", 5.0, "300 deg/s^3", 5.0]
    plain = Study(task="task.toml", folder=task.parent, seed=1, repeats=1)
    assert plain.jobs[0]["arguments"] == load_task(task).problem.settings


def test_files_beside_the_study_are_read_from_there(tmp_path):
    (tmp_path / "few.csv").write_text("azimuth [deg], pitch [deg]\n30, 30\n75, 15\n120, 0\n165, 15\n")
    file = tmp_path / "study.toml"
    file.write_text('problem = "pointing"\nseed = 1\nrepeats = 1\n[factors]\npoints = ["few.csv"]\n')
    study = load_study(file)
    assert study.cells[0].name == "points=few.csv,repeat=01"
    assert len(study.jobs[0]["arguments"]["points"]) == 4
    assert cell_seed(1, {"points": "few.csv"}, 1) == study.cells[0].seed


def test_a_study_is_pickled_and_made_again_from_its_record():
    study = hybrid()
    for again in (Study.of(study.record), pickle.loads(pickle.dumps(study))):
        assert again.record == study.record
        assert again.cells == study.cells
        assert again.jobs == study.jobs


def test_a_folder_takes_more_levels_and_repeats_and_no_other_study(tmp_path):
    folder = StudyFolder(tmp_path / "study")
    folder.keep(hybrid().record)
    folder.keep(hybrid(repeats=3, factors={"payload": [7, 5, 10]}).record)
    assert folder.record().repeats == 3
    for changes, says in (
        ({"seed": 4}, "its seed differs, 3 there and 4 here; choose another folder"),
        ({"problem": "pick-place", "factors": {"payload": [5, 7, 10]}}, "its problem differs, hybrid there"),
        ({"factors": {"payload": [7, 5]}}, "its factor payload has the level 10, which is missing here"),
        ({"factors": {"payload": [{"label": "7", "value": 6}, 5, 10]}}, "has the level 7, which is missing"),
        ({"factors": {"payload": [7, 5, 10]}}, "it has 3 repeats, more than 2"),
        ({"factors": {"payload": [7, 5, 10], "samples": [4]}}, r"its factors differs, \['payload'\] there"),
        ({"fixed": {"samples": 4}}, "its fixed differs"),
    ):
        refused(lambda changes=changes: folder.keep(hybrid(**changes).record), says)
    assert folder.record().repeats == 3


def test_a_folder_notices_that_a_file_has_changed(tmp_path):
    (tmp_path / "some.csv").write_text("azimuth [deg], pitch [deg]\n30, 30\n75, 15\n120, 0\n165, 15\n")
    given = {"seed": 1, "repeats": 1, "fixed": {"points": "some.csv"}, "folder": tmp_path}
    folder = StudyFolder(tmp_path / "study")
    folder.keep(Study("pointing", **given).record)
    (tmp_path / "some.csv").write_text("azimuth [deg], pitch [deg]\n30, 30\n75, 15\n120, 0\n170, 15\n")
    refused(lambda: folder.keep(Study("pointing", **given).record), "what a cell solves is no longer the same")


def test_a_folder_without_a_study_is_refused(tmp_path):
    refused(StudyFolder(tmp_path).record, "holds no study: it has no study.json")
    for content, says in (
        ("{", "is no study of this version"),
        ('{"format": "other"}', "format: expected 'trajevo study', got 'other'"),
    ):
        (tmp_path / "study.json").write_text(content)
        refused(StudyFolder(tmp_path).record, says)


BAD = {
    "no TOML": ("problem =", "cannot be read as TOML"),
    "no problem": ("seed = 1", "expected either a problem, by its name, or a task, by its file"),
    "both": ('problem = "hybrid"\ntask = "task.toml"\nseed = 1', "expected either a problem"),
    "unknown problem": ('problem = "hybris"\nseed = 1', "unknown problem 'hybris'; known: hybrid"),
    "no seed": ('problem = "hybrid"', "seed: this key is missing"),
    "seed as text": ('problem = "hybrid"\nseed = "1"', "line 2: seed: expected a whole number, got '1'"),
    "unknown key": (
        'problem = "hybrid"\nseed = 1\nrepeat = 3',
        "line 3: repeat: unknown key; did you mean 'repeats'",
    ),
    "no repeats": ('problem = "hybrid"\nseed = 1\nrepeats = 0', "line 3: repeats: .*greater than or equal to 1, got 0"),
    "no generations": ('problem = "hybrid"\nseed = 1\ngenerations = 0', "line 3: generations: .* got 0"),
    "unknown argument": (
        GOOD.replace("samples", "simples"),
        "line 8: fixed.simples: problem 'hybrid' takes no 'simples'; it takes: ",
    ),
    "bad argument": (
        GOOD.replace("samples = 4", "samples = 1"),
        "line 8: fixed.samples: expected a whole number of at least 2, got 1",
    ),
    "unknown factor": (
        GOOD + "mass = [1]",
        "line 13: factors.mass: problem 'hybrid' takes no 'mass'; it takes: .*the search: algor",
    ),
    "bad level": (
        GOOD.replace("[5,", "[5, 50,"),
        r"line 11: factors.payload: expected 0 to 10 kg, eq. \(123\), got 50 kg",
    ),
    "unknown level": (
        GOOD.replace('"printed"', '"drawn"'),
        "line 12: factors.convention: unknown convention 'drawn'; known: as_run",
    ),
    "no list": (GOOD + "samples = 3", "line 13: factors.samples: expected a list of at least one level, got 3"),
    "empty list": (
        GOOD + "objectives = []",
        r"line 13: factors.objectives: expected a list of at least one level, got \[\]",
    ),
    "level twice": (GOOD.replace("[5,", "[5, 5.0,"), "line 11: factors.payload: the level '5' is given twice"),
    "label twice": (GOOD.replace('"offset"', '"5"'), "line 11: factors.payload: the label '5' is given twice"),
    "no label": (GOOD.replace('label = "offset", value', "value"), "line 11: factors.payload: a table needs a label"),
    "label of two lines": (
        GOOD.replace('"offset"', '"off\\nset"'),
        "line 11: factors.payload: expected labels of one line",
    ),
    "infinite level": (GOOD.replace("[5,", "[5, inf,"), "line 11: factors.payload: expected finite numbers, got inf"),
    "date": (
        GOOD.replace("[5,", "[5, 2024-01-01,"),
        "line 11: factors.payload: expected a number, text, list or table, got date",
    ),
    "fixed and varied": (GOOD + "samples = [3]", "line 13: factors.samples: the argument is fixed and cannot vary"),
    "fixed twice": (
        GOOD.replace("samples = 4", "population = 4"),
        "line 8: fixed.population: given twice, in this table and outside it",
    ),
    "reserved": (GOOD + "repeat = [3]", "line 13: factors.repeat: this name has a meaning of its own in studies"),
    "no name": (GOOD + '"a b" = [3]', "line 13: factors.a b: expected the name of an argument, got 'a b'"),
    "unknown algorithm": (
        GOOD + 'algorithm = ["nsga9"]',
        "line 13: factors.algorithm: unknown algorithm 'nsga9'; known: age-moea2, moea/d, nsga2",
    ),
    "small population": (
        GOOD + "offsprings = [0]",
        "line 13: factors.offsprings: expected a whole .* at least 1, got 0",
    ),
    "wide index": (GOOD + "mutation_index = [500.0]", "line 13: factors.mutation_index: expected .* 100.*, got 500"),
    "no such setting": (
        GOOD + 'algorithm = ["spea2"]\nmutation_index = [5.0]',
        "line 14: factors.mutation_index: the algorithm 'spea2' has no",
    ),
    "no time": (GOOD + "time_limit = [-1]", "line 13: factors.time_limit: expected a positive time"),
    "no task": ('task = "nowhere.toml"\nseed = 1', "nowhere.toml: no such file"),
}


@pytest.mark.parametrize("case", BAD)
def test_mistakes_are_told_with_file_line_and_remedy(write, case):
    text, says = BAD[case]
    file = write(text)
    refused(lambda: load_study(file), says)
    with pytest.raises(ValueError, match="study.toml|nowhere.toml"):
        load_study(file)


BAD_TASKS = {
    "unknown key": ({"robots": ["ur5"]}, "factors.robots: unknown key of a task 'robots'; did you mean 'robot'"),
    "unknown key in a table": (
        {"constraints.speed": [1]},
        "factors.constraints.speed: unknown key; known: ",
    ),
    "no table": ({"points.x": [1]}, "factors.points.x: points is no table in this task"),
    "algorithm": ({"algorithm.population": [8]}, "factors.algorithm.population: this key of a task cannot vary"),
    "seed": ({"samples": [3], "seed": [1]}, "factors.seed: this name has a meaning of its own in studies"),
    "value": (
        {"interpolant": ["cubits"]},
        "factors.interpolant: unknown interpolant 'cubits'; known: bspline, cubic",
    ),
    "unit": ({"limits.jerk": ["9 deg/s"]}, r"factors.limits.jerk: .*converts to rad/s\^3, such as .*, got '9 deg/s'"),
}


@pytest.mark.parametrize("case", BAD_TASKS)
def test_mistakes_in_what_varies_a_task_name_the_factor(task, case):
    factors, says = BAD_TASKS[case]
    refused(lambda: Study(task=task, seed=1, factors=factors), says)


def test_a_broken_task_is_told_with_its_own_line(task):
    task.write_text(TASK.replace("format = 1", "format = 2"))
    refused(lambda: Study(task=task, seed=1), "task.toml: line 1: format: expected 1, got 2")


def test_wrong_types_are_refused():
    refused(lambda: Study(5, seed=1), "unknown problem 5: expected a name, got int")
    refused(lambda: hybrid(seed=-1), "seed: .*greater than or equal to 0, got -1")
    refused(lambda: hybrid(factors={"payload": "ab"}), "factors.payload: expected a list")
    refused(lambda: hybrid(factors={"payload": [PointingMechanism()]}), "expected a number, text, list or table, got P")
