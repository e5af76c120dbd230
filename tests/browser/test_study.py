"""What a person does on the page of a study, in a browser, and that it shows what Python has."""

from urllib.parse import unquote

import numpy as np
import pytest

from tests.browser.conftest import until
from tests.browser.test_pages import contrast
from trajevo import Study, collect, run_study, write_study

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study") / "study"
    study = Study(
        "pointing",
        seed=3,
        repeats=3,
        generations=6,
        population=16,
        factors={"interpolant": ["smooth", "quintic"], "crossover_probability": [0.5, 1]},
        fixed={"polish": False},
    )
    run_study(study, folder, progress=False)
    found = collect(folder)
    write_study(found)
    return found


@pytest.fixture
def page(results, opened):
    return opened(results.folder / "study.html")


def chosen(page):
    return page.evaluate("trajevo.state.chosen")


def numbers(page, column=2):
    """Title -> what the table of the chosen cell has."""
    rows = page.locator("#values tbody tr")
    titles = rows.locator("th").all_inner_texts()
    return dict(zip(titles, rows.locator(f"td:nth-child({column})").all_inner_texts(), strict=True))


def test_it_opens_at_the_cell_with_the_greatest_hypervolume_and_tells_its_numbers(page, results):
    volumes = [one.hypervolume[-1] for one in results.cells]
    best = results.cells[chosen(page)]
    assert chosen(page) == int(np.argmax(volumes))
    told = numbers(page)
    assert float(told["hypervolume"]) == pytest.approx(max(volumes), rel=1e-5)
    assert float(told["knee time [s]"]) == pytest.approx(best.knee[0], rel=1e-5)
    assert float(told["least acceleration [deg/s²]"]) == pytest.approx(np.degrees(best.F[:, 1].min()), rel=1e-5)
    assert (int(told["solutions"]), int(told["failed"])) == (len(best.F), best.failures)
    assert f"trajevo open {results.folder / 'cells' / best.cell.name}" in page.locator("#known").inner_text()


def test_a_click_on_a_point_chooses_its_cell(page, results):
    until(page, "Boolean(trajevo.state.views[0].spots)")
    canvas = page.locator("#front canvas").first
    # The point that stands farthest from all points of other cells.
    point, x, y = page.evaluate(
        """() => { const {spots} = trajevo.state.views[0], {owner, count} = trajevo.state;
        let best = [0, 0]; for (let k = 0; k < count; k += 1) { let near = Infinity;
          for (let i = 0; i < count; i += 1) if (owner[i] !== owner[k]) near = Math.min(near,
            Math.hypot(spots[2 * i] - spots[2 * k], spots[2 * i + 1] - spots[2 * k + 1]));
          if (near > best[1]) best = [k, near]; }
        return [best[0], spots[2 * best[0]], spots[2 * best[0] + 1]]; }"""
    )
    canvas.hover(position={"x": x, "y": y})
    owner = page.evaluate(f"trajevo.state.owner[{point}]")
    labels = results.cells[owner].cell.labels
    assert f"interpolant {labels['interpolant']}" in page.locator("#tip").inner_text()
    canvas.click(position={"x": x, "y": y})
    assert chosen(page) == owner
    assert page.locator("#cell").inner_text() == results.cells[owner].cell.name
    assert f"#cell={results.cells[owner].cell.name}" in page.url.replace("%3D", "=").replace("%2C", ",")


def test_levels_are_left_out_and_shown_alone_again(page, results):
    page.get_by_role("button", name="interpolant smooth").click()
    within = page.evaluate("[...trajevo.state.lines.within]")
    assert within == [2 if one.cell.labels["interpolant"] == "smooth" else 1 for one in results.cells]
    assert "6 of 12 cells shown" in page.locator("#factors").inner_text()
    assert page.locator("#cells tbody tr:visible").count() == 6
    quintic = np.concatenate([one.F for one in results.cells if one.cell.labels["interpolant"] == "quintic"])
    np.testing.assert_allclose(page.evaluate("trajevo.state.ends[0][0]"), quintic[:, 0].min(), rtol=1e-12)
    page.get_by_role("button", name="interpolant smooth").click(modifiers=["Shift"])
    assert page.evaluate("[...trajevo.state.lines.within]") == [3 - one for one in within]


def test_a_factor_gives_the_colours(page, results):
    page.get_by_role("button", name="colour by crossover_probability").click()
    groups = page.evaluate("trajevo.state.cells.map((_, k) => trajevo.state.groupOfCell(k))")
    assert groups == [["0.5", "1"].index(one.cell.labels["crossover_probability"]) for one in results.cells]
    pressed = page.get_by_role("button", name="colour by interpolant").get_attribute("aria-pressed")
    assert pressed == "false"


def test_a_range_of_what_cells_found_fades_the_others(page, results):
    until(page, "Boolean(trajevo.state.views.at(-1).xs)")
    canvas = page.locator("#lines canvas")
    canvas.scroll_into_view_if_needed()
    box = canvas.bounding_box()
    axis = page.evaluate("trajevo.state.lines.objectives.findIndex(({title}) => title === 'hypervolume')")
    x = box["x"] + page.evaluate(f"trajevo.state.views.at(-1).xs[{axis}]")
    page.mouse.move(x, box["y"] + 0.5 * box["height"])
    page.mouse.down()
    page.mouse.move(x, box["y"] + 0.05 * box["height"], steps=4)
    page.mouse.up()
    low, high = page.evaluate(f"trajevo.state.kept[{axis}]")
    volumes = np.array([one.hypervolume[-1] for one in results.cells])
    np.testing.assert_array_equal(
        page.evaluate("[...trajevo.state.lines.within]"), (volumes >= low) & (volumes <= high)
    )
    assert 0 < ((volumes >= low) & (volumes <= high)).sum() < 12
    page.get_by_role("button", name="all ranges").click()
    assert page.evaluate("trajevo.state.within.every((one) => one === 1)")


def test_a_header_sorts_and_a_row_chooses(page, results):
    table = results.table()
    page.locator("#cells th button", has_text="hypervolume").click()
    order = page.evaluate("[...document.querySelectorAll('#cells tbody tr')].map((row) => Number(row.dataset.row))")
    volumes = table["hypervolume"].to_numpy()[order]
    assert (np.diff(volumes) >= -1e-6 * volumes[1:]).all()
    page.locator("#cells th button", has_text="hypervolume").click()
    page.locator("#cells tbody tr").first.locator("td").first.click()
    assert table["hypervolume"][chosen(page)] == pytest.approx(table["hypervolume"].max(), rel=1e-6)
    assert page.locator("#cells tr.chosen").get_attribute("data-row") == str(chosen(page))


def test_cells_are_pinned_and_gone_through_by_keys(page, results):
    first = chosen(page)
    page.locator("#pin").click()
    page.locator("#front").focus()
    page.keyboard.press("ArrowLeft" if first else "ArrowRight")
    assert abs(chosen(page) - first) == 1
    assert float(numbers(page, 3)["hypervolume"]) == pytest.approx(results.cells[first].hypervolume[-1], rel=1e-5)
    assert page.locator("#values thead th").count() == 3


def test_a_click_on_the_course_of_a_run_chooses_it(page, results):
    page.get_by_role("tab", name="Course view").click()
    until(page, "Boolean(trajevo.state.views.find((view) => 'volumes' in view).spots)")
    volumes = [one.hypervolume[-1] for one in results.cells]
    worst = int(np.argmin(volumes))
    x, y = page.evaluate(
        """(cell) => { const {begins, spots} = trajevo.state.views.find((one) => 'volumes' in one);
        const k = begins[cell + 1] - 1; return [spots[2 * k] - 1, spots[2 * k + 1]]; }""",
        worst,
    )
    page.locator("#front canvas:visible").click(position={"x": x, "y": y})
    assert volumes[chosen(page)] <= sorted(volumes)[1]


def test_the_address_names_a_cell_and_links_lead_to_its_run(results, opened):
    one = results.cells[5]
    page = opened(results.folder / "study.html", address=f"#cell={one.cell.name}")
    assert chosen(page) == 5
    link = unquote(page.evaluate("document.querySelector('#known a').href"))
    assert link == f"{(results.folder / 'cells' / one.cell.name).as_uri()}/".replace("%3D", "=").replace("%2C", ",")


def test_light_dark_narrow_and_without_scripts(results, opened):
    file = results.folder / "study.html"
    dark = opened(file, color_scheme="dark", viewport={"width": 400, "height": 800})
    assert dark.evaluate("document.documentElement.scrollWidth") <= 400
    assert contrast(dark) >= 4.5
    dark.locator("#theme").click()
    assert contrast(dark) >= 4.5
    static = opened(file, ready=False, java_script_enabled=False)
    assert static.get_by_role("heading", name="Levels", exact=True).is_visible()
    assert f"{results.cells[0].hypervolume[-1]:.6g}" in static.locator("#cells").inner_text()
    assert not static.locator("#explore").is_visible()


def test_names_in_space_never_cover_one_another(page):
    page.get_by_role("tab", name="Space view").click()
    until(page, "Boolean(trajevo.state.views.find((view) => 'turn' in view).labels)")
    covered = page.evaluate(
        """() => {
        const view = trajevo.state.views.find((one) => 'turn' in one), titles = trajevo.state.objectives;
        const meet = (a, b) => Math.abs(a.x - b.x) < a.half + b.half && Math.abs(a.y - b.y) < a.tall + b.tall;
        const bad = [];
        for (let turn = -3; turn < 3; turn += 0.31) for (let tilt = -1.5; tilt <= 1.5; tilt += 0.25) {
          Object.assign(view, {turn, tilt, layer: null});
          view.drawNow();
          const {labels, middle} = view;
          const outside = ({x, half}) => x - half < -0.01 || x + half > 2 * middle[0] + 0.01;
          if (titles.some(({title}) => !labels.some(({text}) => text === title))) bad.push(["missing", turn, tilt]);
          if (labels.some(outside)) bad.push(["outside", turn, tilt]);
          if (labels.some((a, k) => labels.slice(0, k).some((b) => meet(a, b)))) bad.push(["covered", turn, tilt]);
        }
        return bad; }"""
    )
    assert covered == []
