"""One record of what a search is: declared once, and there in Python, in tasks, in studies and on the command line."""

import subprocess
from pathlib import Path

import numpy as np
import pydantic
import pytest

from tests.helpers import refused, trajevo
from trajevo import Search, Study, load_study, load_task, optimise
from trajevo.formulation.search import OF_ALGORITHM
from trajevo.front.records import ProblemRecord
from trajevo.problems import PointingMechanism

ROOT = Path(__file__).parents[2]

#: A value of every setting that is not the one it has by itself.
OTHERS = {
    "seed": 7,
    "algorithm": "nsga2",
    "generations": 3,
    "population": 12,
    "offsprings": 6,
    "crossover_probability": 0.5,
    "crossover_index": 3.0,
    "mutation_probability": 0.25,
    "mutation_index": 5.0,
    "starts": "sobol",
    "evaluations": 30,
    "cpu_time": 1000.0,
    "time_limit": 100.0,
    "polish": False,
    "polish_every": 2,
}


def test_every_setting_is_in_the_list_of_this_test():
    assert set(OTHERS) == set(Search.model_fields)
    assert Search(**OTHERS).given == OTHERS
    assert set(OF_ALGORITHM) < set(OTHERS)


def test_every_setting_is_an_option_of_the_command_line():
    shown = trajevo("solve", "--help").stdout
    for name, field in Search.model_fields.items():
        assert f"--{name.replace('_', '-')}" in shown
        assert field.description


@pytest.mark.parametrize("name", [name for name in OTHERS if name != "seed"])
def test_every_setting_is_a_key_of_a_task_and_of_a_study_and_a_factor(name, tmp_path):
    text = (ROOT / "problems" / "tasks" / "panda_six_points.toml").read_text()
    head, _, rest = text.partition("[algorithm]")
    rest = rest.partition("\n\n")[2]
    key = "name" if name == "algorithm" else name
    value = str(OTHERS[name]).lower() if isinstance(OTHERS[name], bool) else repr(OTHERS[name])
    (tmp_path / "task.toml").write_text(f"{head}[algorithm]\n{key} = {value}\n\n{rest}")
    assert load_task(tmp_path / "task.toml").search.given[name] == OTHERS[name]
    (tmp_path / "study.toml").write_text(f'problem = "pointing"\nseed = 1\n{name} = {value}\n')
    given = {name: OTHERS[name]}
    assert load_study(tmp_path / "study.toml").jobs[0]["search"] == given
    assert Study("pointing", seed=1, factors={name: [OTHERS[name]]}).jobs[0]["search"] == given


def test_settings_by_name_go_before_the_record_and_the_record_before_the_paper(tmp_path):
    search = Search(seed=3, population=12, generations=4, polish=False)
    front = optimise(PointingMechanism(), search, generations=2, out=tmp_path, progress=False)
    again = optimise(PointingMechanism(), seed=3, population=12, generations=2, polish=False, progress=False)
    np.testing.assert_array_equal(front.X, again.X)
    settings = front.run.settings
    assert (settings["population"], settings["generations"], settings["crossover_index"]) == (12, 2, 15.0)
    assert front.record == ProblemRecord.of(PointingMechanism())


def test_a_search_is_frozen_and_refuses_what_cannot_be_in_one_sentence():
    search = Search(seed=1)
    with pytest.raises(pydantic.ValidationError, match="frozen"):
        search.seed = 2
    refused(lambda: Search.of(sead=1), "unknown setting of a search 'sead'; known: .*seed")
    refused(lambda: search.updated(polish="yes"), "polish: expected True, False or None, got 'yes'")
    refused(lambda: search.updated(population=True), "population: expected a whole number of at least 4, got True")
    refused(lambda: search.updated(cpu_time=-1.0), r"cpu_time: expected a positive time \[s\], got -1.0")
    refused(lambda: search.updated(starts="magic"), "starts: unknown starts 'magic'; known: .*spread")
    refused(lambda: search.updated(mutation_index=0.5), "mutation_index: expected a number from 1 to 100, got 0.5")
    refused(lambda: optimise(PointingMechanism(), Search()), "seed: expected a whole number of at least 0, got None")


def test_settings_are_not_listed_again_elsewhere():
    found = subprocess.run(
        ["git", "grep", "-l", "polish_every", "--", "trajevo", "problems"], cwd=ROOT, capture_output=True, text=True
    ).stdout.split()
    # Where it is declared, where the generations are, where it stands in a run's folder, and who decides on gradients.
    assert set(found) <= {
        "trajevo/formulation/search.py",
        "trajevo/solvers/run/evolution.py",
        "trajevo/solvers/run/folder.py",
        "trajevo/solvers/run/turns.py",
        "trajevo/solvers/optimise.py",
    }
