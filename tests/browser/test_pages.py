"""What a person does on the page of a run, in a browser, and that it shows what Python has."""

import numpy as np
import pytest

from tests.browser.conftest import until
from trajevo import ViaPointProblem, animate, export, load_problem, optimise, report

pytestmark = pytest.mark.browser

FEW = {"population": 24, "generations": 6, "polish": False, "progress": False, "seed": 1}
POINTS = [[0.0, -1.5, 1.5, -1.5, -1.5, 0.0], [0.8, -1.2, 1.4, -1.7, -1.5, 0.0], [0.4, -1.0, 1.0, -1.0, -1.0, 0.3]]
RUNS = {
    "pointing": lambda: load_problem("pointing"),
    "hybrid": lambda: load_problem("hybrid"),
    "ur5": lambda: ViaPointProblem(
        robot={"name": "ur5", "tool": "tool0", "limits": {"acceleration": 10.0, "jerk": 100.0}},
        points=POINTS,
        objectives=("time", "jerk", "energy"),
        scene={
            "obstacles": [
                {"name": "post", "shape": "cylinder", "radius": 0.05, "length": 1.0, "position": [-0.7, 0.4, 0.5]}
            ]
        },
    ),
    "along a path": lambda: load_problem("reparam"),
    "linear axes": lambda: ViaPointProblem(robot="feed_drive", points=[[0.0, 0.0], [0.05, 0.02], [0.1, 0.1]]),
}


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Name -> front and file of its page, made when it is first asked for."""
    made = {}

    def run(name):
        if name not in made:
            front = optimise(RUNS[name](), **FEW)
            folder = tmp_path_factory.mktemp(name.replace(" ", "_"))
            made[name] = front, report(front, folder / "page.html", analyses={}, pictures=[])
        return made[name]

    return run


@pytest.fixture
def ur5(runs, opened):
    front, file = runs("ur5")
    return front, opened(file)


def row(page):
    """Row of the front that the page has chosen."""
    return page.evaluate("trajevo.state.rows[trajevo.state.chosen]")


def shown(page):
    """Objectives of the chosen solution as the table has them."""
    texts = page.locator("#values tbody tr td:nth-child(2)").all_inner_texts()
    return np.array([float(text.replace("e", "E")) for text in texts])


@pytest.mark.parametrize("name", RUNS)
def test_a_page_opens_and_every_choice_shows_the_numbers_of_python(name, runs, opened):
    front, file = runs(name)
    page = opened(file)
    assert row(page) == front.knee().index
    factors = np.array(page.evaluate("trajevo.state.objectives.map(({factor}) => factor)"))
    for choice in front.choices():
        page.get_by_role("button", name=choice.rule.replace("_", " "), exact=True).click()
        assert row(page) == choice.index
        np.testing.assert_allclose(shown(page), front.F[choice.index] * factors, rtol=2e-5)
        assert f"#row={choice.index}" in page.url
    assert page.locator("#profiles canvas").count() >= 4
    assert page.evaluate("!document.getElementById('arm').textContent.includes('cannot be drawn')")


@pytest.mark.parametrize("name", RUNS)
def test_the_arm_is_where_pinocchio_has_it(name, runs, opened):
    front, file = runs(name)
    page = opened(file)
    if not front.problem.robot.has_body:
        return
    for index in (0, len(front) - 1):
        trajectory = front.rollouts.trajectory[index]
        for share in (0.0, 0.3, 1.0):
            time = share * float(trajectory.duration[0])
            place = page.evaluate(
                """([row, time]) => { const {chain} = trajevo.state.arm;
                chain.move(trajevo.state.rows.indexOf(row), time); return chain.atTool.toArray(); }""",
                [index, time],
            )
            position, rotation = front.problem.robot.tool_poses(trajectory.evaluate(np.array([time]))[0])
            found = np.array(place).reshape(4, 4).T
            np.testing.assert_allclose(found[:3, 3], position[0], atol=2e-3 if name == "hybrid" else 1e-5)
            np.testing.assert_allclose(found[:3, :3], rotation[0], atol=5e-3 if name == "hybrid" else 1e-5)


def test_a_click_on_a_point_of_the_front_picks_it(ur5):
    front, page = ur5
    canvas = page.locator("#front canvas").first
    box = canvas.bounding_box()
    until(page, "Boolean(trajevo.state.views[0].spots)")
    x, y = page.evaluate("[...trajevo.state.views[0].spots.slice(0, 2)]")
    canvas.click(position={"x": x, "y": y})
    assert row(page) == 0
    page.mouse.move(box["x"] + x - 1, box["y"] + y)
    assert "row 0" in page.locator("#tip").inner_text()
    assert "least_time" in page.locator("#tip").inner_text()
    np.testing.assert_allclose(shown(page), front.F[0], rtol=2e-5)


def test_keys_go_along_the_front(ur5):
    _, page = ur5
    page.locator("#front").focus()
    before = row(page)
    page.keyboard.press("ArrowRight")
    assert row(page) == before + 1
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("ArrowLeft")
    assert row(page) == before - 1
    assert f"row {before - 1}" in page.locator("#said").inner_text()


def test_ranges_on_parallel_coordinates_fade_the_others(ur5):
    front, page = ur5
    page.get_by_role("tab", name="Parallel view").click()
    canvas = page.locator("#front canvas:visible").first
    box = canvas.bounding_box()
    until(page, "Boolean(trajevo.state.views.at(-1).xs)")
    x = box["x"] + page.evaluate("trajevo.state.views.at(-1).xs[0]")
    page.mouse.move(x, box["y"] + 0.55 * box["height"])
    page.mouse.down()
    page.mouse.move(x, box["y"] + 0.99 * box["height"], steps=4)
    page.mouse.up()
    low, high = page.evaluate("trajevo.state.kept[0]")
    within = page.evaluate("[...trajevo.state.within]")
    np.testing.assert_array_equal(np.array(within, dtype=bool), (front.F[:, 0] >= low) & (front.F[:, 0] <= high))
    assert 0 < sum(within) < len(front)
    page.get_by_role("button", name="all ranges").click()
    assert page.evaluate("trajevo.state.within.every((one) => one === 1)")


def test_the_front_in_space_turns(ur5):
    _, page = ur5
    page.get_by_role("tab", name="Space view").click()
    until(page, "Boolean(trajevo.state.views.find((view) => 'turn' in view).spots)")
    box = page.locator("#front canvas:visible").first.bounding_box()
    before = page.evaluate("trajevo.state.views.find((view) => 'turn' in view).turn")
    page.mouse.move(box["x"] + 100, box["y"] + 100)
    page.mouse.down()
    page.mouse.move(box["x"] + 160, box["y"] + 120, steps=3)
    page.mouse.up()
    assert page.evaluate("trajevo.state.views.find((view) => 'turn' in view).turn") != before


def test_sliders_weigh_as_python_does(ur5):
    front, page = ur5
    for weights in ([100, 0, 0], [20, 80, 40], [0, 0, 100]):
        for k, weight in enumerate(weights):
            page.locator(f"#weight-{k}").fill(str(weight))
        assert row(page) == front.weighted([float(weight) for weight in weights]).index


def test_pinned_solutions_stand_side_by_side(ur5):
    front, page = ur5
    page.locator("#pin").click()
    page.get_by_role("button", name="least jerk", exact=True).click()
    assert page.locator("#values thead th").count() == 3
    texts = page.locator("#values tbody tr td:nth-child(3)").all_inner_texts()
    np.testing.assert_allclose([float(text.split()[0]) for text in texts], list(front.knee().F.values()), rtol=2e-5)
    assert "%" in texts[0]
    page.get_by_role("button", name="knee", exact=True).click()
    page.locator("#pin").click()
    assert page.evaluate("trajevo.state.pins.length") == 0


def test_the_motion_plays_in_real_time_and_is_scrubbed(ur5):
    _, page = ur5
    page.locator("#play").click()
    until(page, "trajevo.state.time > 0.05")
    page.locator("#play").click()
    assert page.locator("#play").inner_text() == "play"
    page.locator("#scrub").fill("500")
    duration = page.evaluate("trajevo.state.duration")
    assert page.evaluate("trajevo.state.time") == pytest.approx(0.5 * duration)
    assert f"{0.5 * duration:.3f} of {duration:.3f} s" == page.locator("#clock").inner_text()


def test_a_click_on_a_curve_moves_the_cursor_and_a_drag_zooms(ur5):
    _, page = ur5
    canvas = page.locator("#profiles canvas").first
    canvas.scroll_into_view_if_needed()
    until(page, "Boolean(trajevo.state.profiles[0].x)")
    box = canvas.bounding_box()
    canvas.click(position={"x": 0.5 * box["width"], "y": 80})
    assert 0.0 < page.evaluate("trajevo.state.time") < page.evaluate("trajevo.state.duration")
    page.mouse.move(box["x"] + 0.4 * box["width"], box["y"] + 60)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 60, steps=3)
    page.mouse.up()
    begin, end = page.evaluate("trajevo.state.zoom")
    assert 0.0 < begin < end < page.evaluate("trajevo.state.duration")
    page.get_by_role("button", name="whole motion").click()
    assert page.evaluate("trajevo.state.zoom") is None


def test_curves_are_those_of_python(ur5):
    front, page = ur5
    index = front.knee().index
    rollout = front.problem.rollout(front.X[index])
    for name, order in (("position", 0), ("velocity", 1), ("acceleration", 2), ("jerk", 3)):
        curve = page.evaluate(f"trajevo.state.motions.curves(trajevo.state.chosen, '{name}')")
        t, y = np.array(curve["t"]), np.array(curve["y"])
        inner = (t > 0.0) & (np.abs(t[:, None] - rollout.trajectory.breaks[0]).min(axis=1) > 1e-6) & (t < t[-1])
        values = rollout.trajectory.evaluate(t[inner], order)[0].T
        np.testing.assert_allclose(y[:, inner], values, atol=1e-4 * np.abs(values).max())
    peak = np.abs(np.array(page.evaluate("trajevo.state.motions.curves(trajevo.state.chosen, 'effort').y"))).max(axis=1)
    dense = np.linspace(0.0, float(rollout.trajectory.duration[0]), 4001)
    effort = rollout.effort_in(*(rollout.trajectory.evaluate(dense, order) for order in range(3)), dense)
    np.testing.assert_allclose(peak, np.abs(effort[0]).max(axis=0), rtol=0.03)


def test_joints_are_hidden_and_shares_of_limits_shown(ur5):
    _, page = ur5
    page.get_by_role("button", name="elbow_joint").click()
    assert page.evaluate("trajevo.state.joints.size") == 5
    page.get_by_role("button", name="% of limits").click()
    label = "document.querySelectorAll('#profiles canvas')[1].getAttribute('aria-label')"
    until(page, f"{label}.includes('% of the limit')")


def test_files_to_save_are_those_of_export(ur5, tmp_path):
    front, page = ur5
    for name, format in (("knee.csv", "csv"), ("knee.json", "json"), ("knee.yaml", "ros2")):
        with page.expect_download() as download:
            page.get_by_role("button", name=name).click()
        assert download.value.suggested_filename == name
        saved = download.value.path().read_bytes()
        assert saved == export(front.knee(), tmp_path / name, format=format).read_bytes()


def test_an_address_names_a_solution(runs, opened):
    _, file = runs("ur5")
    page = opened(file, address="#row=3")
    assert row(page) == 3
    page.evaluate("window.location.hash = '#row=5'")
    until(page, "trajevo.state.rows[trajevo.state.chosen] === 5")
    assert "trajevo certify" in page.locator("#known").inner_text()


def test_light_and_dark(runs, opened):
    _, file = runs("ur5")
    page = opened(file, color_scheme="dark")
    back = "getComputedStyle(document.body).backgroundColor"
    dark = page.evaluate(back)
    page.locator("#theme").click()
    assert page.evaluate(back) != dark
    assert contrast(page) >= 4.5
    page.locator("#theme").click()
    assert page.evaluate(back) == dark
    assert contrast(page) >= 4.5


def contrast(page):
    """Least contrast of text and muted text on panels, by WCAG's formula."""
    colours = page.evaluate(
        """() => { const probe = document.createElement('span'); document.body.append(probe);
        const of = (name) => { probe.style.color = `var(--${name})`; return getComputedStyle(probe).color; };
        const found = ['panel', 'back', 'text', 'muted', 'accent', 'second'].map(of); probe.remove(); return found; }"""
    )

    def light(colour):
        levels = np.array([float(part) for part in colour[colour.index("(") + 1 : -1].split(",")[:3]]) / 255.0
        linear = np.where(levels <= 0.04045, levels / 12.92, ((levels + 0.055) / 1.055) ** 2.4)
        return float(linear @ [0.2126, 0.7152, 0.0722])

    panel, back, *texts = map(light, colours)
    pairs = [sorted((ground, text)) for ground in (panel, back) for text in texts]
    return min((high + 0.05) / (low + 0.05) for low, high in pairs)


def test_a_narrow_screen_needs_no_scrolling_sideways(runs, opened):
    _, file = runs("ur5")
    page = opened(file, viewport={"width": 400, "height": 800})
    assert page.evaluate("document.documentElement.scrollWidth") <= 400


def test_without_scripts_tables_remain(runs, opened):
    front, file = runs("ur5")
    page = opened(file, ready=False, java_script_enabled=False)
    assert page.get_by_role("heading", name="Solutions").is_visible()
    assert f"{front.knee().F['time']:.4g}"[:4] in page.locator("table").first.inner_text()
    assert not page.locator("#explore").is_visible()


def test_the_camera_turns_and_zooms_by_keys(ur5):
    _, page = ur5
    page.locator("#arm canvas").focus()
    before = page.evaluate("trajevo.state.arm.camera.position.toArray()")
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("+")
    after, target = (page.evaluate(f"trajevo.state.arm.{what}.toArray()") for what in ("camera.position", "target"))
    assert np.linalg.norm(np.subtract(after, target)) < 0.95 * np.linalg.norm(np.subtract(before, target))
    until(page, "trajevo.state.arm.renderer.info.render.triangles > 3000")


def test_an_animation_plays_by_itself(runs, opened, tmp_path):
    front, _ = runs("ur5")
    page = opened(animate(front.knee(), tmp_path / "arm.html"))
    until(page, "trajevo.state.time > 0.02")
    until(page, "trajevo.state.arm.renderer.info.render.triangles > 3000")
