"""A page that is served, in a browser: it shows what its buttons bring about, and keeps what was chosen."""

import json

import pytest

from tests.browser.conftest import until
from trajevo import certify, export, load_problem, optimise, read_run
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


def test_any_solution_gets_its_certificate_and_files_from_the_server(run, opened, tmp_path):
    front = read_run(run)
    row = next(k for k in range(len(front)) if k not in {choice.index for choice in front.choices()})
    with Served(run) as served:
        page = opened(served.address, address=f"#row={row}")
        page.get_by_role("button", name="compute the certificate").click()
        until(
            page, f"document.getElementById('known').textContent.includes({json.dumps(str(certify(front.pick(row))))})"
        )
        for format, ending in (("csv", "csv"), ("json", "json"), ("ros2", "yaml")):
            with page.expect_download() as download:
                page.get_by_role("button", name=f"{row}.{ending}", exact=True).click()
            assert download.value.suggested_filename == f"{row}.{ending}"
            file = export(front.pick(row), tmp_path / "file", format=format)
            assert download.value.path().read_bytes() == file.read_bytes()
        page.close()


def test_a_frame_of_a_notebook_tells_what_is_chosen_and_takes_it(run, opened, tmp_path):
    """The widget's own script in an empty page, with a model that keeps what it is told."""
    widget = read_run(run).widget(height=800)
    file = tmp_path / "notebook.html"
    page = widget.page.replace("\\", "\\\\").replace("`", "\\`").replace("${", "\\${").replace("</script", "<\\/script")
    script = widget._esm.replace("export default {render};", "")
    file.write_text(
        f"""<!DOCTYPE html><div id="cell"></div><script>{script}
        const held = {{page: `{page}`, title: "front", height: 800, row: {widget.row}}};
        const calls = {{}};
        const model = {{get: (name) => held[name], set: (name, value) => {{ held[name] = value; }},
          save_changes: () => {{}}, on: (name, call) => {{ calls[name] = call; }}, off: () => {{}}}};
        render({{model, el: document.getElementById("cell")}});</script>""",
        encoding="utf-8",
    )
    shown = opened(file, ready=False)
    frame = shown.frame_locator("iframe")
    frame.get_by_role("button", name="least time", exact=True).click()
    until(shown, f"held.row === {read_run(run).least('time').index}")
    shown.evaluate("held.row = 2; calls['change:row']()")
    assert frame.locator("#values thead th").nth(1).inner_text(timeout=10_000) == "row 2"
