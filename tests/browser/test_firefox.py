"""The same pages in Firefox, where it is installed: nothing is wrong there, clicks choose, and no WebGL is no harm."""

import pytest

from tests.browser import firefox
from trajevo import Study, collect, export, load_problem, optimise, report, run_study, write_study

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(firefox.found() is None, reason="Firefox is not installed: apt-get install firefox-esr"),
]

FEW = {"population": 16, "generations": 4, "polish": False, "progress": False, "seed": 1}


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with firefox.Firefox(tmp_path_factory.mktemp("profile"), **{"webgl.disabled": True}) as running:
        yield running


def opened(browser, file):
    browser("WebDriver:Navigate", url=file.as_uri())
    browser.until("Boolean(window.trajevo && window.trajevo.state)")


def test_the_page_of_a_run_chooses_by_clicks_and_says_that_the_robot_cannot_be_drawn(browser, tmp_path):
    front = optimise(load_problem("pointing"), **FEW)
    file = report(front, tmp_path / "report.html", analyses={}, pictures=[])
    opened(browser, file)
    assert browser.evaluate("trajevo.state.rows[trajevo.state.chosen]") == front.knee().index
    browser.click("#choices button:nth-child(3)")
    least = front.choices()[2]
    assert browser.evaluate("trajevo.state.rows[trajevo.state.chosen]") == least.index
    assert browser.evaluate("document.querySelectorAll('#profiles canvas').length") >= 4
    browser.until("Boolean(trajevo.state.views[0].spots)")
    held = browser.evaluate(f"[...trajevo.state.file(trajevo.state.data.known[{least.index}].files[0].text)]")
    assert bytes(held) == export(least, tmp_path / "a.csv", format="csv").read_bytes()
    assert "has no WebGL" in browser.evaluate("document.getElementById('arm').textContent")
    assert browser.evaluate("document.getElementById('arm').clientHeight") < 200
    assert [one for one in browser.said(file.as_uri()) if "WebGL" not in one] == []


def test_the_page_of_a_study_leaves_levels_out_and_sorts(browser, tmp_path):
    factors = {"interpolant": ["smooth", "quintic"]}
    sizes = {"repeats": 2, "generations": 4, "population": 12}
    run_study(Study("pointing", seed=1, factors=factors, fixed={"polish": False}, **sizes), tmp_path, progress=False)
    results = collect(tmp_path)
    write_study(results)
    opened(browser, tmp_path / "study.html")
    browser.click("button[aria-label='interpolant smooth']")
    assert browser.evaluate("[...trajevo.state.lines.within]") == [2, 2, 1, 1]
    browser.click("#cells th:nth-child(3) button")
    browser.click("#cells tbody tr:not([hidden]) td")
    least = min(results.cells[2:], key=lambda one: one.hypervolume[-1])
    assert browser.evaluate("document.getElementById('cell').textContent") == least.cell.name
    assert browser.said((tmp_path / "study.html").as_uri()) == []
