"""Commands that a page names work for runs whose problem is not registered, or say what to put there."""

import pytest

from tests.helpers import small_problem
from tests.page.reading import Page
from trajevo import load_problem, optimise, report
from trajevo.front.records import ProblemRecord
from trajevo.page.commands import problem_option

FEW = {"population": 8, "generations": 2, "polish": False, "progress": False, "seed": 1}


def record(**settings):
    known = ProblemRecord.of(load_problem("pointing"))
    return known.model_copy(update={"settings": known.settings | settings})


@pytest.mark.parametrize(
    ("settings", "given", "option", "said"),
    [
        ({}, None, "", ""),
        ({}, "task.toml", "", ""),
        ({"title": "cell:seven"}, None, "", ""),
        ({"objectives": ["time", "my_cell:wear"]}, None, " --problem my_cell", ""),
        ({"objectives": ["time", "my_cell:wear"]}, "a task.toml", " --problem 'a task.toml'", ""),
        (
            {"objectives": ["a:f"], "constraints": [{"of": "b.c:g"}]},
            None,
            " --problem TASK.toml",
            "functions of a, b.c",
        ),
    ],
)
def test_functions_of_ones_own_are_told_by_their_module(settings, given, option, said):
    found = problem_option(record(**settings), given)
    assert found[0] == option
    assert said in found[1]
    assert bool(said) == bool(found[1])


def test_a_problem_made_in_python_is_named_or_asked_for(tmp_path):
    front = optimise(small_problem(), **FEW)
    page = Page.of(report(front, tmp_path / "a.html", analyses={}, pictures=[], problem="my_cell:problem"))
    assert page.data["option"] == [" --problem my_cell:problem", ""]
    option, said = Page.of(report(front, tmp_path / "b.html", analyses={}, pictures=[])).data["option"]
    assert option == " --problem MODULE:NAME"
    assert "NAME in the module MODULE is the problem" in said
