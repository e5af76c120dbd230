"""The page of a front as a widget: what is chosen there is read here."""

import sys

import numpy as np
import pytest

from tests.helpers import refused
from trajevo import load_problem, optimise

pytest.importorskip("anywidget", reason="anywidget is not installed: pip install 'trajevo[notebook]'")


@pytest.fixture(scope="module")
def front():
    return optimise(load_problem("pointing"), population=12, generations=5, seed=1, polish=False, progress=False)


def test_what_the_page_chooses_is_a_solution_of_the_front(front):
    widget = front.widget()
    assert widget.solution.rule == "knee"
    assert '<script type="application/json" id="data">' in widget.page
    sent = []
    widget.observe(lambda change: sent.append(change["new"]), names="row")
    widget.set_state({"row": 3})  # what the browser sends
    assert sent == [3]
    assert widget.solution.index == 3
    np.testing.assert_array_equal(widget.solution.x, front.X[3])
    widget.row = front.least("time").index
    assert widget.solution.rule == "least_time"
    with pytest.raises(Exception, match=f"row: expected one from 0 to {len(front) - 1}, got 999"):
        widget.row = 999


def test_without_anywidget_a_sentence_says_what_to_install(front, monkeypatch):
    monkeypatch.setitem(sys.modules, "anywidget", None)
    refused(front.widget, "needs the package anywidget, pip install 'trajevo.notebook.' brings it")


def test_the_page_opens_in_a_browser(front, tmp_path, monkeypatch):
    shown = []
    monkeypatch.setattr("webbrowser.open", shown.append)
    file = front.open(tmp_path / "front.html")
    assert shown == [file.resolve().as_uri()]
    assert file.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
