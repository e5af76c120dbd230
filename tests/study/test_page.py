"""The page of a study has the numbers of its results, few bytes, and something to read without scripts."""

import re
from dataclasses import replace
from urllib.parse import unquote

import numpy as np
import pytest

from tests.page.reading import Page
from trajevo.base.arrays import frozen
from trajevo.front.records import ObjectiveRecord
from trajevo.study.page import PAGE_FILE, study_page
from trajevo.study.record import StudyRecord, TaskContent, cells_of, levels_of
from trajevo.study.report import write_study
from trajevo.study.results import CellResult, StudyBox, StudyResults

UNITS = {"time": "s", "jerk": "rad/s^3", "sway": "rad"}


def results_of(folder, *, levels, repeats, points, seed=1):
    """Results of a study with made-up fronts, which no run could make as quickly."""
    rng = np.random.default_rng(seed)
    factors = {name: levels_of(name, given) for name, given in levels.items()}
    record = StudyRecord(problem="pointing", seed=1, repeats=repeats, fixed={}, factors=factors)
    objectives = tuple(ObjectiveRecord(name=name, unit=unit, reference="made up") for name, unit in UNITS.items())

    def found(cell):
        F = np.sort(rng.uniform(1.0, 2.0, (points, 3)), axis=0)
        F[:, 1:] = F[::-1, 1:]
        volumes = np.sort(rng.uniform(0.2, 0.8, 5))
        return CellResult(cell, frozen(F), F[points // 3], np.arange(5.0), volumes, 5, 1.5, 1.2, 2)

    box = StudyBox(np.zeros(3), np.full(3, 2.2), "made up")
    cells = tuple(map(found, cells_of(record)))
    return StudyResults(folder, record, 1, objectives, "deg", "m", box, cells)


@pytest.fixture
def results(tmp_path):
    return results_of(tmp_path, levels={"payload": [5, 10], "way": ["smooth", "<b>&"]}, repeats=3, points=12)


def read(results, file):
    file.write_bytes(study_page(results, file))
    return Page.of(file)


def test_numbers_are_those_of_the_results_to_the_bit(results, tmp_path):
    page = read(results, tmp_path / PAGE_FILE)
    np.testing.assert_array_equal(page.array(page.data["F"]), np.concatenate([one.F for one in results.cells]))
    np.testing.assert_array_equal(page.array(page.data["cell"]), np.repeat(np.arange(12), 12))
    assert page.data["knee"] == [4] * 12
    titles = [column["title"] for column in page.data["columns"]]
    values = dict(zip(titles, page.array(page.data["values"]).T, strict=True))
    np.testing.assert_array_equal(values["hypervolume"], [one.hypervolume[-1] for one in results.cells])
    np.testing.assert_array_equal(values["least time [s]"], [one.F[:, 0].min() for one in results.cells])
    np.testing.assert_allclose(values["knee sway [deg]"], [np.degrees(one.knee[2]) for one in results.cells])
    begins, evaluated, volumes = (page.array(page.data["course"][name]) for name in ("begins", "evaluated", "volumes"))
    for k, one in enumerate(results.cells):
        own = slice(begins[k], begins[k + 1])
        np.testing.assert_array_equal(evaluated[own], one.evaluations)
        np.testing.assert_allclose(volumes[own], one.hypervolume, rtol=1e-6)
    assert [cell["levels"] for cell in page.data["cells"][::3]] == [[0, 0], [0, 1], [1, 0], [1, 1]]
    assert [cell["name"] for cell in page.data["cells"]] == [one.cell.name for one in results.cells]


def test_tables_remain_without_scripts_and_texts_of_files_stay_texts(results, tmp_path):
    page = read(results, tmp_path / PAGE_FILE)
    static = re.sub(r"<script.*?</script>", "", page.text, flags=re.DOTALL)
    for expected in ("<h1>Study of pointing</h1>", "<h2>Levels</h2>", "<h2>Cells</h2>", "12 cells, 1 not finished"):
        assert expected in static
    assert "default-src 'none'" in page.text
    assert not re.search(r"<(link|iframe|script[^>]*\ssrc)\b", page.text)
    assert "<b>&" not in page.text
    assert "&lt;b&gt;&amp;" in static
    runs = results.cells[:3]
    low, middle, high = np.quantile([one.hypervolume[-1] for one in runs], [0.25, 0.5, 0.75])
    (first,) = re.findall(r'<table id="levels">.*?<tbody>(<tr.*?</tr>)', static)
    cells = re.findall(r"<td[^>]*>(.*?)</td>", first)
    assert cells[:5] == ["5", "smooth", "3", f"{middle:.6g}", f"{low:.6g} to {high:.6g}"]
    assert cells[5] == f"{np.median([one.F[:, 0].min() for one in runs]):.6g}"


def test_the_study_of_a_task_has_its_title(results, tmp_path):
    for content, title in (({"title": "Pick <it> up"}, "Study of Pick &lt;it&gt; up"), ({}, "Study of a task")):
        record = results.record.model_copy(update={"problem": None, "task": TaskContent(content=content, folder=".")})
        assert f"<h1>{title}</h1>" in read(replace(results, record=record), tmp_path / PAGE_FILE).text


def test_cells_are_linked_to_their_pages_where_they_have_some(results, tmp_path):
    folder = tmp_path / "cells" / results.cells[4].cell.name
    folder.mkdir(parents=True)
    (folder / "report.html").write_text("a page")
    (tmp_path / "elsewhere").mkdir()
    for file in (tmp_path / PAGE_FILE, tmp_path / "elsewhere" / "a.html"):
        links = [cell["link"] for cell in read(results, file).data["cells"]]
        assert [link["text"] for link in links] == ["folder"] * 4 + ["page"] + ["folder"] * 7
        assert (file.parent / unquote(links[4]["to"])).resolve() == folder / "report.html"
        assert (file.parent / unquote(links[0]["to"])).resolve().name == results.cells[0].cell.name


def test_five_hundred_cells_take_less_than_six_megabytes_and_keep_knees_and_ends(tmp_path):
    levels = {"payload": list(range(10)), "way": list("abcde")}
    large = results_of(tmp_path, levels=levels, repeats=10, points=800)
    page = read(large, tmp_path / PAGE_FILE)
    assert len(page.text.encode()) < 6e6
    F, owners = page.array(page.data["F"]), page.array(page.data["cell"])
    assert 40_000 < len(F) < 500 * 800
    assert f"Here are {len(F):,} of 400,000 points of their fronts" in page.text
    begins = np.searchsorted(owners, np.arange(500))
    for k in (0, 123, 499):
        own = F[owners == k]
        np.testing.assert_array_equal(own.min(axis=0), large.cells[k].F.min(axis=0))
        np.testing.assert_array_equal(own.max(axis=0), large.cells[k].F.max(axis=0))
        np.testing.assert_array_equal(F[begins[k] + page.data["knee"][k]], large.cells[k].knee)


@pytest.mark.long
def test_more_cells_than_a_page_holds_are_told(tmp_path):
    many = results_of(tmp_path, levels={"payload": list(range(300))}, repeats=10, points=9)
    page = read(many, tmp_path / PAGE_FILE)
    assert len(page.data["cells"]) == 2000
    assert "Here are 2,000 of 3,000 cells, spread over the study" in page.text
    assert len(page.text.encode()) < 6e6


def test_cells_that_found_nothing_and_a_study_without_factors_have_a_page(results, tmp_path):
    nothing = [replace(one, F=np.empty((0, 3)), knee=np.full(3, np.nan)) for one in results.cells]
    page = read(replace(results, cells=(*nothing[:3], *results.cells[3:])), tmp_path / PAGE_FILE)
    assert page.data["knee"][:4] == [None, None, None, 4]
    assert read(replace(results, cells=tuple(nothing), box=None), tmp_path / PAGE_FILE).data["F"]["shape"] == [0, 3]
    alone = results_of(tmp_path, levels={}, repeats=4, points=5)
    assert read(alone, tmp_path / PAGE_FILE).data["factors"] == []


def test_what_is_collected_has_the_page_with_its_pictures_and_comparisons(results, tmp_path):
    written = write_study(results, tmp_path / "out")
    assert tmp_path / "out" / PAGE_FILE in written.files
    text = (tmp_path / "out" / PAGE_FILE).read_text(encoding="utf-8")
    assert "<h2>Levels compared</h2>" in text
    assert "<figcaption>hypervolume by payload</figcaption>" in text
    assert text.count("<figure>") >= 4
