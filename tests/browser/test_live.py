"""A page that is served, in a browser: it shows what its buttons bring about, and keeps what was chosen."""

import pytest

from tests.browser.conftest import until
from trajevo import load_problem, optimise, read_run
from trajevo.page.server import Served

pytestmark = pytest.mark.browser

_READY = "Boolean(window.trajevo && trajevo.state && document.getElementById('standing'))"


@pytest.fixture
def run(tmp_path):
    settings = {"population": 12, "generations": 5, "seed": 1, "polish": False, "progress": False}
    optimise(load_problem("pointing"), out=tmp_path / "run", **settings)
    return tmp_path / "run"


def test_a_button_goes_on_with_the_run_and_the_page_shows_it(run, opened):
    before = read_run(run)
    with Served(run) as served:
        page = opened(served.address)
        page.get_by_role("button", name="least time", exact=True).click()
        page.locator("#pin").click()
        stamp = page.evaluate("trajevo.state.data.live.stamp")
        page.get_by_role("button", name="50 more generations").click()
        until(page, f"{_READY} && trajevo.state.data.live.stamp !== '{stamp}'", 120.0)
        until(page, f"{_READY} && document.getElementById('standing').textContent.includes('more is done')", 60.0)
        after = read_run(run)
        assert after.run.generations == 55
        assert page.evaluate("trajevo.state.count") == len(after) > len(before)
        assert page.evaluate("trajevo.state.rows[trajevo.state.chosen]") == after.least("time").index
        assert page.evaluate("trajevo.state.pins.length") == 1
        page.close()


def test_the_sliders_solve_again(run, opened):
    with Served(run) as served:
        page = opened(served.address)
        for k, weight in enumerate((20, 50, 30)):
            page.locator(f"#weight-{k}").fill(str(weight))
        page.get_by_role("button", name="solve again with these weights").click()
        until(page, f"{_READY} && document.getElementById('standing').textContent.includes('weigh is done')", 120.0)
        assert read_run(run).run.settings["weighed"] == [[0.2, 0.5, 0.3]]
        page.close()
