"""What a shell offers after a tab, and that nothing is imported for it which was not asked for."""

import json
import os
import subprocess
import sys

import pytest

from tests.helpers import trajevo
from trajevo.cli import completion
from trajevo.cli.main import COMMANDS
from trajevo.exporters.export import EXPORTERS
from trajevo.formulation.examples import list_examples
from trajevo.formulation.registry import list_problems
from trajevo.robot.locate import list_robots
from trajevo.trajectory.interpolants import THROUGH_POINTS

SCRIPT = """import sys
from trajevo.cli.main import main
try:
    main()
finally:
    print(*sys.modules, file=sys.stderr)
"""


def asked(words):
    """The environment in which bash asks what there is for words, the last of which is begun."""
    return {"_TRAJEVO_COMPLETE": "complete_bash", "COMP_WORDS": " ".join(words), "COMP_CWORD": str(len(words) - 1)}


def offered(*words):
    """What bash is offered."""
    with pytest.MonkeyPatch.context() as patch:
        for name, value in asked(("trajevo", *words)).items():
            patch.setenv(name, value)
        return trajevo().stdout.split()


def test_commands_are_offered_without_importing_any(tmp_path, monkeypatch):
    environment = os.environ | asked(["trajevo", "s"])
    done = subprocess.run([sys.executable, "-c", SCRIPT], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.stdout.split() == ["solve", "study", "show", "slowdown", "simulate"]
    assert set(done.stderr.split()) & {"numpy", "trajevo.cli.solve", "trajevo.cli.show", "matplotlib"} == set()
    monkeypatch.chdir(tmp_path)
    assert offered("") == list(COMMANDS)


def test_arguments_and_options_of_commands_that_are_imported_late(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert offered("solve", "po") == ["pointing"]
    assert offered("solve", "pointing", "--pop") == ["--population"]
    assert offered("solve", "pointing", "--algorithm", "nsga") == ["nsga2", "nsga3"]
    assert offered("study", "c") == ["collect"]
    assert offered("export", "run", "--format", "r") == ["rapid", "ros2"]


def test_the_shell_gets_its_script(tmp_path):
    environment = {**os.environ, "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1"}
    script = "from trajevo.cli.main import main; main()"
    for shell in ("bash", "zsh", "fish"):
        done = subprocess.run(
            [sys.executable, "-c", script, "--show-completion", shell], env=environment, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
        assert "_TRAJEVO_COMPLETE=complete_" in done.stdout


@pytest.fixture
def folder(tmp_path, monkeypatch):
    for place, name in (
        ("runs/a", "manifest.json"),
        ("runs/ab", "front.json"),
        ("c", "manifest.json"),
        ("d", "no.json"),
    ):
        (tmp_path / place).mkdir(parents=True)
        (tmp_path / place / name).write_text(
            json.dumps({"problem": {"objectives": [{"name": "time"}, {"name": "jerk"}]}})
        )
    (tmp_path / "press").mkdir()
    (tmp_path / "press" / "robot.toml").touch()
    (tmp_path / "many").mkdir()
    (tmp_path / "many" / "study.json").touch()
    for name in ("pond.toml", "arm.urdf", "notes.txt"):
        (tmp_path / name).touch()
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_names_and_files_are_offered(folder):
    assert completion.problems("po") == ["pointing", "pond.toml"]
    assert set(completion.problems("")) == {*list_problems(), *list_examples("task"), "pond.toml"}
    assert {*list_robots(), "ur5", "press", "arm.urdf"} <= set(completion.robots(""))
    assert set(completion.examples("")) == set(list_examples())
    assert set(completion.studies("")) == {*list_examples("study"), "pond.toml", "many"}
    assert completion.study_folders("m") == ["many"]
    assert set(completion.formats("")) >= set(EXPORTERS)
    assert set(completion.interpolants("")) >= set(THROUGH_POINTS)


def test_runs_are_offered_wherever_they_are_begun(folder):
    assert completion.runs("") == ["c", "runs/a", "runs/ab"]
    assert completion.runs("runs/") == ["runs/a", "runs/ab"]
    assert completion.runs("runs/ab") == ["runs/ab"]
    assert completion.runs(f"{folder}/r") == [f"{folder}/runs/a", f"{folder}/runs/ab"]
    assert completion.runs("nowhere/") == []


def test_solutions_are_those_of_the_run(folder):
    class Asked:
        def __init__(self, run):
            self.params = {"run": run}

    assert completion.solutions(Asked("c"), "least") == ["least_jerk", "least_time"]
    for run in ("d", "notes.txt", "missing", None):
        assert completion.solutions(Asked(run), "") == ["knee", "topsis", "utopia", "weighted"]
        assert completion.weights(Asked(run), "") == ["entropy", "equal", "paper"]
    (folder / "compared.csv").touch()
    assert completion.weights(Asked("c"), "") == ["compared.csv", "entropy", "equal", "paper", "time=1,jerk=1"]
