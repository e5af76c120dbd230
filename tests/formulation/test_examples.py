import tomllib
from pathlib import Path

import pytest

from tests.helpers import refused
from trajevo import load_problem, load_task
from trajevo.errors import UnknownNameError
from trajevo.formulation.examples import KINDS, copy_example, example_file, is_task, list_examples
from trajevo.formulation.registry import list_problems

TASK = "hybrid_manipulator"


def test_every_example_has_a_name_of_its_own_and_says_in_a_line_what_it_shows():
    examples = list_examples()
    assert sum(len(list_examples(kind)) for kind in KINDS) == len(examples) == 24
    assert not set(examples) & set(list_problems())
    for name, example in examples.items():
        assert example.name == name
        assert 20 < len(example.summary) < 130, name
        assert not example.summary.startswith("#")


def test_studies_name_problems_and_tasks_that_are_there():
    for example in list_examples("study").values():
        content = tomllib.loads(example.file.read_text(encoding="utf-8"))
        assert content.get("problem") in list_problems() or content.get("task") in list_examples("task")


def test_a_name_and_a_file_give_the_same_task():
    file = example_file("task", TASK)
    assert file.name == f"{TASK}.toml"
    assert load_task(TASK).problem.settings == load_task(file).problem.settings == load_task(str(file)).problem.settings


def test_files_of_the_user_go_before_names(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert example_file("task", "ur5_pick_and_place.toml") == Path("ur5_pick_and_place.toml")
    assert example_file("task", "mine.toml", folder="there") == Path("there/mine.toml")
    (tmp_path / TASK).touch()
    assert example_file("task", TASK) == Path(TASK)


def test_names_that_are_not_there_are_refused_and_the_nearest_is_told():
    refused(
        lambda: load_task("ur5_pick_and"),
        "unknown task 'ur5_pick_and'; known: .*; did you mean 'ur5_pick_and_place'\\?$",
    )
    refused(lambda: load_task("hybrid_payloads"), "unknown task 'hybrid_payloads'; known: hybrid_manipulator")
    refused(lambda: is_task("pointng"), "unknown problem or task 'pointng'; .*; did you mean 'pointing'\\?")
    refused(lambda: load_problem("nothing of ours"), "unknown problem 'nothing of ours'; known: [^?]*$")
    with pytest.raises(UnknownNameError):
        is_task("01_first_front")


def test_problems_and_tasks_are_told_apart():
    assert [is_task(name) for name in ("pointing", "via-points", TASK, "any/where.toml")] == [False, False, True, True]


@pytest.mark.parametrize("name", list_examples())
def test_a_copy_reads_as_the_example_does(name, tmp_path):
    copies = copy_example(name, tmp_path / "new" / "folder")
    example = list_examples()[name]
    assert [copy.read_bytes() for copy in copies] == [file.read_bytes() for file in example.files]
    assert copies[0] == tmp_path / "new" / "folder" / example.file.name
    assert {copy.name for copy in copies[1:]} == ({"hybrid_points.csv"} if name == TASK else set())


def test_nothing_is_overwritten_and_then_nothing_is_copied(tmp_path):
    (tmp_path / "hybrid_points.csv").write_text("mine", encoding="utf-8")
    refused(lambda: copy_example(TASK, tmp_path), "hybrid_points.csv: exists already; choose another folder")
    assert [file.name for file in tmp_path.iterdir()] == ["hybrid_points.csv"]
    refused(lambda: copy_example(TASK, tmp_path / "hybrid_points.csv"), "hybrid_points.csv: cannot be written: ")
