"""Records of runs and studies with other types, lengths, names given twice, negative counts or NaN: a sentence each."""

import json
import shutil

import numpy as np
import pytest

from tests.fuzz.kinds import STUDY
from tests.helpers import refused
from trajevo import Front, load_problem, optimise, read_run, resume
from trajevo.solvers.run.runs import standing
from trajevo.study import Study, load_study, study_standing
from trajevo.study.folder import StudyFolder


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("made")
    problem = load_problem("pointing")
    optimise(problem, population=12, generations=4, seed=1, polish=False, out=folder / "run", progress=False)
    (folder / "study.toml").write_text(STUDY)
    StudyFolder(folder / "study").keep(load_study(folder / "study.toml").record)
    return folder


@pytest.fixture
def folder(made, tmp_path):
    return shutil.copytree(made, tmp_path / "made")


def change(file, place, value):
    content = json.loads(file.read_text())
    *keys, last = place
    at = content
    for key in keys:
        at = at[key]
    at[last] = value
    file.write_text(json.dumps(content))


@pytest.mark.parametrize(
    ("place", "value", "says"),
    [
        (
            ("problem", "objectives", 1, "name"),
            "time",
            "expected names of objectives that differ, got 'time' twice",
        ),
        (
            ("problem", "variables", 1, "name"),
            "dt_1",
            "expected names of variables that differ, got 'dt_1' twice",
        ),
        (("problem", "payload"), {}, "problem.payload: expected the mass of the payload"),
        (
            ("problem", "payload", "model"),
            "magic",
            "expected one of .* as the payload's model, got 'magic'",
        ),
        (("problem", "angle"), "turns", "problem.angle: expected 'rad' or 'deg', got 'turns'"),
        (("problem", "settings", "limits"), [[[[]]]] * 2, "the problem at hand differs|limits"),
        (("run", "evaluations"), -1, "run.evaluations: expected a number greater than or equal to 0, got -1"),
        (("run", "evaluations"), 2**31, "run.evaluations: expected a number below 2147483648"),
        (("run", "seconds"), float("nan"), "run.seconds"),
        (("run", "stopped_by"), "SIGNAL", "run.stopped_by"),
        (("run", "settings", "a"), float("nan"), "run.settings: settings.a: expected finite numbers"),
        (
            ("history", "front_size", 0),
            -1,
            "history.front_size.0: expected a number greater than or equal to 0, got -1",
        ),
        (("history", "least_violation", 0), -0.5, "history.least_violation.0"),
        (("F",), [[1.0]], "is no front of trajevo"),
        (("X", 0, 0), "1x", "X.0.0: expected a number, got '1x'"),
    ],
)
def test_a_front_s_record_is_checked(place, value, says, folder):
    file = folder / "run" / "front.json"
    names = [variable["name"] for variable in json.loads(file.read_text())["problem"]["variables"]]
    change(file, place, names[0] if value == "dt_1" else value)
    refused(lambda: Front.load(file).problem, says.replace("dt_1", names[0]))


def test_data_that_is_too_deep_is_refused(folder):
    deep = []
    for _ in range(60):
        deep = [deep]
    change(folder / "run" / "front.json", ("run", "settings", "a"), deep)
    refused(
        lambda: Front.load(folder / "run" / "front.json"), "expected lists and tables at most 32 deep in each other"
    )
    (folder / "run" / "manifest.json").write_text("[" * 3000)
    refused(lambda: standing(folder / "run"), "manifest.json: is no manifest of this version of trajevo: content")


@pytest.mark.parametrize(
    ("name", "changed", "says"),
    [
        (
            "books.evaluations",
            lambda array: -array,
            "checkpoint is damaged: .*expected evaluations of every",
        ),
        ("books.evaluations", lambda array: array[None], "the checkpoint is damaged: .*expected evaluations"),
        ("books.evaluations", lambda array: array.astype(str), "the checkpoint is damaged: .*expected evaluations"),
        ("books.hypervolume", lambda array: array * np.nan, "the checkpoint is damaged: .*expected hypervolume"),
        ("books.front_size", lambda array: array[1:], "the checkpoint is damaged: .*expected front_size"),
        ("books.cpu_seconds", lambda array: array * np.inf, "the checkpoint is damaged: .*expected cpu_seconds"),
        ("books.polishing", lambda array: array + 2**30, "the checkpoint is damaged: .*expected fewer than"),
        (
            "books.reference_point",
            lambda array: array[None],
            "checkpoint is damaged: .*expected a positive reference",
        ),
        ("story", lambda array: np.array("[" * 3000), "the checkpoint is damaged"),
        ("story", lambda array: np.array("[]"), "the checkpoint is damaged"),
    ],
)
def test_a_checkpoint_s_history_is_checked(name, changed, says, folder):
    file = folder / "run" / "checkpoint.npz"
    arrays = dict(np.load(file))
    np.savez(file, **arrays | {name: changed(arrays[name])})
    (folder / "run" / "front.json").unlink()
    refused(lambda: read_run(folder / "run"), says)
    refused(lambda: resume(folder / "run", progress=False), says)


@pytest.mark.parametrize(
    ("name", "changed"),
    [
        ("X", lambda array: array * np.nan),
        ("F", lambda array: array * np.nan),
        ("G", lambda array: array * 0.0 - np.inf),
        ("G", lambda array: array.astype(str)),
        ("X", lambda array: array[0]),
        ("generation", lambda array: array.astype(float)),
        ("said", lambda array: np.zeros(len(array))),
    ],
)
def test_a_block_s_columns_are_checked(name, changed, folder):
    file = folder / "run" / "blocks" / "000001.npz"
    arrays = dict(np.load(file))
    np.savez(file, **arrays | {name: changed(arrays[name])})
    (folder / "run" / "front.json").unlink()
    refused(lambda: read_run(folder / "run"), "000001.npz: is no block of a run")


@pytest.mark.parametrize(
    ("place", "value", "says"),
    [
        (("repeats",), 2**63 - 1, "repeats: expected a number up to 100000"),
        (("repeats",), 90_000, "content: expected at most 100000 cells, got 360000"),
        (
            ("factors", "offsprings", 0, "value"),
            float("nan"),
            "offsprings.0.value: value: expected finite",
        ),
        (("factors", "offsprings", 0, "label"), "many", "the label 'many' is given twice"),
        (("factors", "offsprings", 0, "label"), "x" * 61, "expected labels of one line with at most 60 characters"),
        (("factors", "offsprings", 0, "value"), 24, "the level '8' is given twice|the level 'many' is given twice"),
        (("factors", "x/../y"), [{"label": "a", "value": 1}], "factors.x/../y: expected the name of an argument"),
        (("fixed", "a"), [[float("inf")]], "fixed: settings.a: expected finite numbers"),
        (("fixed", "name"), "x", "problem 'pointing' takes no 'name'"),
    ],
)
def test_a_study_s_record_is_checked(place, value, says, folder):
    file = folder / "study" / "study.json"
    change(file, place, value)
    if place == ("fixed", "name"):
        refused(lambda: Study.of(StudyFolder(folder / "study").record()), says)
    else:
        refused(lambda: study_standing(folder / "study"), says)


@pytest.mark.parametrize("name", ["cells", "plots"])
def test_a_study_s_folders_are_not_reached_through_links(name, folder, tmp_path):
    study, other = folder / "study", tmp_path / "other"
    other.mkdir()
    shutil.rmtree(study / name, ignore_errors=True)
    (study / name).symlink_to(other)
    if name == "cells":
        refused(lambda: study_standing(study), "cells: expected a folder, got a link")
        refused(lambda: StudyFolder(study).keep(StudyFolder(study).record()), "cells: expected a folder, got a link")
    assert not list(other.iterdir())
