"""A paper's items are made again, written one by one, and compared with what is printed."""

import csv
import json
import math
import signal

import matplotlib.pyplot as plt
import pytest

from tests.helpers import refused
from trajevo.reproduction.paper import Item, LeftOut, NumberTable, Paper, PrintedNumber, Shown
from trajevo.reproduction.reproduce import reproduce


def number(printed="4.52", ours=4.5161, **said):
    return PrintedNumber(of="least time", unit="s", printed=printed, ours=ours, **said)


@pytest.mark.parametrize(
    ("printed", "ours", "verdict"),
    [
        ("4.52", 4.5161, "as printed"),
        ("4.52", 4.515, "as printed"),
        ("4.52", 4.5149, "unexpected"),
        ("4.52", 4.5251, "unexpected"),
        ("7", 7.4, "as printed"),
        ("7", 7.6, "unexpected"),
        ("-0.030", -0.0304, "as printed"),
        ("-0.030", -0.0306, "unexpected"),
        ("1.5e-3", 0.00154, "as printed"),
        ("1.5e-3", 0.00156, "unexpected"),
        ("1200", math.nan, "unexpected"),
    ],
)
def test_a_number_is_as_printed_within_half_of_its_last_digit(printed, ours, verdict):
    assert number(printed, ours).verdict == verdict


def test_a_number_that_is_said_to_differ_must_differ():
    assert number(ours=4.7, why="other bounds", differs=True).verdict == "differs"
    assert number(ours=4.52, why="other bounds", differs=True).verdict == "unexpected"
    assert number(ours=None, why="no masses are printed").verdict == "differs"


def test_a_wider_tolerance_needs_a_reason():
    assert number(ours=4.6, within=0.1, why="read off a picture").verdict == "as printed"
    refused(lambda: number(within=0.1), "least time: why: expected a reason")
    refused(lambda: number(ours=None), "least time: why: expected a reason")
    refused(lambda: number(printed="about 4"), "printed: expected a number as text, such as '4.52', got 'about 4'")


def test_rows_have_as_many_cells_as_headers():
    refused(lambda: NumberTable(("a", "b"), [(1.0, 2.0), (3.0,)]), r"rows\[1\]: expected 2 cells, .*, got 1")


def paper(*, second=None):
    def first(desk):
        desk.once("front", lambda: made.append("front"))
        figure, axes = plt.subplots()
        axes.plot([0.0, 1.0], [1.0, 3.0])
        return Shown(
            numbers=[number(), number("3.1", 3.4, why="no bounds are printed", differs=True)],
            table=NumberTable(("t [s]", "q [rad]"), [(0.0, 1.0), (1.0, 1.0 / 3.0)]),
            figure=figure,
            said=["Measured here."],
        )

    def other(desk):
        desk.once("front", lambda: made.append("front"))
        return Shown(table=NumberTable(("name", "value [1]"), [("a | b", 2.0)]))

    made = []
    left = (LeftOut("Figure 9", "the experiment", "no data are printed"),)
    items = (Item("figure", "1", "a curve", first), Item("table", "2a", "a table", second or other, searches=True))
    return Paper(name="some2020", citation="A. Author, 2020", doi="", items=items, left_out=left), made


def test_everything_is_written_and_computed_once(tmp_path):
    some, made = paper()
    found = reproduce(some, tmp_path / "out")
    assert made == ["front"]
    names = {file.name for file in (tmp_path / "out").iterdir()}
    assert names == {"figure_01.png", "figure_01.csv", "table_02a.csv", "numbers.csv", "numbers.json", "page.md"}
    assert not found.unexpected
    rows = list(csv.DictReader((tmp_path / "out/numbers.csv").open()))
    assert [row["verdict"] for row in rows] == ["as printed", "differs"]
    assert float(rows[0]["difference"]) == 4.5161 - 4.52
    told = json.loads((tmp_path / "out/numbers.json").read_text())
    assert told[1]["why"] == "no bounds are printed"
    points = list(csv.reader((tmp_path / "out/figure_01.csv").open()))
    assert float(points[2][1]) == 1.0 / 3.0
    page = (tmp_path / "out/page.md").read_text()
    for said in ("![Figure 1: a curve](figure_01.png)", "no data are printed", "a \\| b", "Measured here.", "[s]"):
        assert said in page
    assert (tmp_path / "out/figure_01.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_what_is_made_stays_when_a_later_item_is_interrupted(tmp_path, number):
    """Searches end early when they are asked to stop; what comes of that is not shown as if it were whole."""

    def search():
        signal.raise_signal(number)
        return "too little"

    some, _ = paper(second=lambda desk: Shown(said=[desk.once("search", search)]))
    found = reproduce(some, tmp_path)
    assert found.stopped_by == number.name
    assert [str(item) for item in found.shown] == ["Figure 1"]
    assert {file.name for file in tmp_path.iterdir()} == {
        "figure_01.png",
        "figure_01.csv",
        "numbers.csv",
        "numbers.json",
        "page.md",
    }
    assert "Table 2a" not in (tmp_path / "page.md").read_text()


def test_an_item_that_is_interrupted_without_a_search_is_not_written(tmp_path):
    def interrupted(desk):
        signal.raise_signal(signal.SIGINT)
        return Shown(table=NumberTable(("a",), [(1.0,)]))

    some, _ = paper(second=interrupted)
    assert [str(item) for item in reproduce(some, tmp_path).shown] == ["Figure 1"]
    assert not (tmp_path / "table_02a.csv").exists()


def test_the_page_of_all_outlives_a_run_of_some(tmp_path):
    some, _ = paper()
    assert (tmp_path / "page.md") in reproduce(some, tmp_path).files
    before = (tmp_path / "page.md").read_text()
    assert reproduce(some, tmp_path, figures=["1"]).files == (tmp_path / "figure_01.csv", tmp_path / "figure_01.png")
    assert (tmp_path / "page.md").read_text() == before


@pytest.mark.parametrize("place", ["file", "file/below"])
def test_a_folder_that_cannot_be_made_is_told(tmp_path, place):
    (tmp_path / "file").write_text("", encoding="utf-8")
    refused(lambda: reproduce(paper()[0], tmp_path / place), f"{place}: the output folder cannot be written: ")


def test_items_are_chosen_by_their_numbers(tmp_path):
    some, _ = paper()
    assert [str(item) for item in some.chosen(tables=["2a"])] == ["Table 2a"]
    assert [str(item) for item in reproduce(some, tmp_path, figures=["1"]).shown] == ["Figure 1"]
    refused(lambda: some.chosen(figures=["9"]), "Figure 9, the experiment, cannot be made again: no data are printed")
    refused(lambda: some.chosen(tables=["1"]), "some2020: --table: expected one of 2a, got '1'")


def test_a_kind_that_a_paper_does_not_have_is_refused():
    item = Item("figure", "1", "a curve", lambda desk: Shown())
    some = Paper(name="some2020", citation="", doi="", items=(item,))
    refused(lambda: some.chosen(tables=["1"]), "some2020: --table: there is no table of this paper, got '1'")


def test_two_items_of_one_number_are_refused():
    item = Item("figure", "1", "a curve", lambda desk: Shown())
    refused(
        lambda: Paper(name="some2020", citation="", doi="", items=(item, item)),
        "expected one item of each kind and number, got Figure 1 twice",
    )


def test_short_searches_excuse_only_numbers_of_searches(tmp_path):
    some, _ = paper(second=lambda desk: Shown(numbers=[number(ours=9.0)]))
    assert len(reproduce(some, tmp_path).unexpected) == 1
    assert not reproduce(some, tmp_path, short=True).unexpected
    assert "Searches were short" in (tmp_path / "page.md").read_text()
