"""Pictures as they stand in a paper: sizes, texts that do not meet, colours without colour, files, and bad input."""

import io
import re
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.text import Text

from tests.helpers import mostly_long, refused, trajevo
from tests.page.test_animation import rollout_through
from tests.random_robots import random_urdf
from trajevo import analyse, load_robot, optimise, plots
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.plots.paper import area, colour, curve
from trajevo.plots.pictures import _drawings, draw_files, save_figure
from trajevo.problems import HybridManipulator, PickAndPlace, PointingMechanism, TimeJerkReparameterisation

mpl.use("Agg")
SMALL = {"seed": 1, "generations": 12, "population": 20, "progress": False, "polish": False}
MM = 1.0 / 25.4


@pytest.fixture(autouse=True)
def _closed():
    yield
    plt.close("all")


@pytest.fixture(scope="module")
def fronts():
    """Three objectives; four with joints that turn and slide, and a margin of effort; a path in a plane."""
    problems = {
        "pointing": PointingMechanism(),
        "hybrid": HybridManipulator(payload=5.0),
        "reparam": TimeJerkReparameterisation(),
    }
    return {name: optimise(problem, **SMALL) for name, problem in problems.items()}


@pytest.fixture(scope="module")
def drawings(fronts):
    """Front, analyses and stem of each picture of each run, by run and stem."""
    found = {name: (front, analyse(front, "short")) for name, front in fronts.items()}
    return {f"{name} {stem}": (*one, stem) for name, one in found.items() for stem, _, _ in _drawings(*one, "column")}


def drawn_texts(figure):
    """All texts that a figure draws, with the boxes that they fill [pixel]."""
    found, draw = {}, Text.draw

    def drawing(self, renderer, *arguments, **named):
        if self.get_visible() and self.get_text().strip():
            found[id(self)] = self, self.get_window_extent(renderer)
        return draw(self, renderer, *arguments, **named)

    Text.draw = drawing
    try:
        figure.canvas.draw()
    finally:
        Text.draw = draw
    return list(found.values())


def assert_fit_for_print(figure, width):
    """The width, 8 pt, nothing beyond the edges, no text on another, and the legend on no panel."""
    assert figure.get_figwidth() == pytest.approx(width * MM)
    figure.set_dpi(200)
    texts = drawn_texts(figure)
    assert {text.get_fontsize() for text, _ in texts} == {8.0}
    edge = figure.bbox
    for text, box in texts:
        inside = box.x0 >= -1 and box.y0 >= -1 and box.x1 <= edge.x1 + 1 and box.y1 <= edge.y1 + 1
        assert inside, f"{text.get_text()!r} at {box.bounds} leaves {edge.bounds}"
    for (one, first), (other, second) in combinations(texts, 2):
        if one.get_rotation() in (0.0, 90.0) and other.get_rotation() in (0.0, 90.0):
            wide = min(first.x1, second.x1) - max(first.x0, second.x0)
            high = min(first.y1, second.y1) - max(first.y0, second.y0)
            assert wide < 2 or high < 4, f"{one.get_text()!r} meets {other.get_text()!r}"
    for ax in figure.axes:
        if ax.get_legend() is not None:
            key = ax.get_legend().get_window_extent()
            assert all(key.y0 >= panel.get_window_extent().y1 for panel in figure.axes if panel.name != "3d")


PRINTED = [("column", False), ("column", True), ("page", True), (120.0, True)]


@pytest.mark.parametrize(("width", "every"), mostly_long(PRINTED, PRINTED[0], several=True))
def test_every_picture_of_a_run_is_fit_for_print(drawings, width, every):
    """Of all runs, or each kind of picture of one of them."""
    kinds = {stem: name for name, (_, _, stem) in drawings.items()}
    for name in drawings if every else kinds.values():
        front, analyses, stem = drawings[name]
        (draw,) = (draw for each, _, draw in _drawings(front, analyses, width) if each == stem)
        try:
            assert_fit_for_print(draw(), plots.WIDTHS.get(width, width))
        except AssertionError as error:
            raise AssertionError(f"{name}: {error}") from error
        plt.close("all")


@pytest.mark.parametrize("joints", mostly_long([7, 12], 12))
@pytest.mark.parametrize("width", mostly_long(["column", "page"], "column"))
def test_many_joints_have_room(joints, width, tmp_path):
    file = tmp_path / "robot.urdf"
    file.write_text(random_urdf(np.random.default_rng(3), joints, kinds=("revolute",)), encoding="utf-8")
    robot = load_robot(file, limits={"acceleration": 50.0, "jerk": 900.0})
    rollout = rollout_through(robot)
    panels = plots.profiles(rollout, width=width)
    assert_fit_for_print(panels[0].figure, plots.WIDTHS[width])
    assert [text.get_text() for text in panels[0].get_legend().get_texts()] == list(robot.joint_names)
    heights = [panel.get_position().height * panel.figure.get_figheight() / MM for panel in panels]
    assert min(heights) > 28.0  # the legend takes none of it
    assert_fit_for_print(plots.effort_utilisation(rollout, width=width).figure, plots.WIDTHS[width])


def lightness(rgb):
    """L* of CIELAB."""
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    y = linear @ [0.2126, 0.7152, 0.0722]
    return 116.0 * np.cbrt(y) - 16.0 if y > 0.008856 else 903.3 * y


def lab(rgb):
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]) @ linear
    f = [np.cbrt(v) if v > 0.008856 else 7.787 * v + 16.0 / 116.0 for v in xyz / [0.9505, 1.0, 1.089]]
    return np.array([116.0 * f[1] - 16.0, 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2])])


#: Linear RGB as people see it without one kind of cones: Machado, Oliveira and Fernandes 2009, severity 1.
BLIND = {
    "protan": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deutan": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    "tritan": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
}


def seen(name, kind):
    rgb = np.array(to_rgb(name))
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    found = np.clip(np.array(BLIND[kind]) @ linear, 0.0, 1.0)
    return np.where(found <= 0.0031308, 12.92 * found, 1.055 * found ** (1 / 2.4) - 0.055)


def test_curves_differ_in_grey_and_to_the_colour_blind():
    for first, second in combinations(range(12), 2):
        if curve(first)["linestyle"] == curve(second)["linestyle"]:
            tones = [lightness(np.array(to_rgb(colour(k)))) for k in (first, second)]
            assert abs(tones[0] - tones[1]) >= 10.0, (first, second)
    for kind in BLIND:
        for first, second in combinations(range(7), 2):
            apart = np.linalg.norm(lab(seen(colour(first), kind)) - lab(seen(colour(second), kind)))
            assert apart >= 9.0, (kind, first, second)
    assert len({str(curve(k)) for k in range(35)}) == 35
    assert len({area(k) for k in range(7)}) == 7


def test_the_users_settings_stay_and_do_not_reach_our_figures(fronts):
    front = fronts["pointing"]
    with mpl.rc_context({"font.size": 20.0, "xtick.labelsize": 19.0, "axes.grid": True, "lines.linewidth": 7.0}):
        before = mpl.rcParams.copy()
        figures = [draw().figure for draw in (lambda: plots.front(front)[0], lambda: plots.hypervolume(front))]
        figures.append(plots.profiles(front.knee())[0].figure)
        assert dict(mpl.rcParams) == dict(before)
        for figure in figures:
            assert {text.get_fontsize() for text, _ in drawn_texts(figure)} == {8.0}
            stream = io.BytesIO()
            figure.savefig(stream, format="svg")
            assert dict(mpl.rcParams) == dict(before)
            assert b"<text" in stream.getvalue()


def test_the_style_is_there_for_own_figures():
    before = dict(mpl.rcParams)
    with plots.style():
        figure, ax = plt.subplots()
        ax.plot([0, 1])
        ax.set_xlabel("time [s]")
    assert dict(mpl.rcParams) == before
    assert ax.xaxis.label.get_fontsize() == 8.0
    assert figure.get_figwidth() == pytest.approx(85.0 * MM, abs=1e-3)
    assert to_rgb(ax.lines[0].get_color()) == to_rgb(colour(0))
    with plt.style.context("trajevo.plots.trajevo"):
        assert mpl.rcParams["pdf.fonttype"] == 42


@pytest.mark.parametrize("ending", ["pdf", "svg"])
def test_vector_files_keep_their_text_and_their_width(fronts, tmp_path, ending):
    front = fronts["hybrid"]
    ours, plain = tmp_path / f"ours.{ending}", tmp_path / f"plain.{ending}"
    plots.profiles(front.knee(), width="column")
    plt.savefig(plain)  # as anyone does it, without any setting
    save_figure(plots.profiles(front.knee(), width="column")[0].figure, ours)
    for file in (ours, plain):
        content = file.read_bytes()
        if ending == "svg":
            assert b"velocity / limit" in content
            width = float(re.search(rb'width="([\d.]+)pt"', content)[1])
        else:
            assert b"/CIDFontType2" in content or b"/TrueType" in content
            assert b"/Type3" not in content
            width = float(re.search(rb"/MediaBox \[ 0 0 ([\d.]+)", content)[1])
        assert width == pytest.approx(85.0 * MM * 72.0, abs=0.01)


@pytest.mark.long
@pytest.mark.parametrize("ending", ["pdf", "svg", "png"])
def test_files_are_the_same_each_time(fronts, tmp_path, ending):
    front = fronts["reparam"]
    first = {file.name: file.read_bytes() for file in draw_files(front, tmp_path, format=ending)}
    again = draw_files(front, tmp_path, format=ending)
    assert {file.name: file.read_bytes() for file in again} == first
    stems = ("front", "parallel", "hypervolume", "profiles", "path", "parameter")
    assert set(first) == {f"{stem}.{ending}" for stem in stems}


def given(front):
    """Every function that draws a front or its knee into given axes, with how many it takes and whether in space."""
    knee = front.knee()
    pairs = len(list(combinations(range(front.F.shape[1]), 2)))
    return {
        "front": (lambda axes: plots.front(front, mark=knee, axes=axes), pairs, False),
        "front_3d": (lambda axes: plots.front_3d(front, mark=knee, ax=axes[0]), 1, True),
        "parallel": (lambda axes: plots.parallel_coordinates(front, mark=knee, ax=axes[0]), 1, False),
        "hypervolume": (lambda axes: plots.hypervolume(front, ax=axes[0]), 1, False),
        "profiles": (lambda axes: plots.profiles(knee, axes=axes), 4, False),
        "tool_path": (lambda axes: plots.tool_path(knee, ax=axes[0]), 1, True),
        "stick_figure": (lambda axes: plots.stick_figure(knee, ax=axes[0]), 1, True),
        "effort": (lambda axes: plots.effort_utilisation(knee, ax=axes[0]), 1, False),
    }


def test_the_users_axes_stay_as_large_as_they_are(fronts):
    for name, (draw, count, space) in given(fronts["hybrid"]).items():
        with mpl.rc_context({"font.size": 11.0}):
            kind = {"projection": "3d"} if space else {}
            figure, axes = plt.subplots(1, count, figsize=(9.0, 3.0), subplot_kw=kind, squeeze=False)
            before = [tuple(ax.get_position(original=True).bounds) for ax in axes.ravel()]
            draw(list(axes.ravel()))
            figure.canvas.draw()
        assert tuple(figure.get_size_inches()) == (9.0, 3.0), name
        if len(figure.axes) == count:  # else a scale of colours stands beside
            assert [tuple(ax.get_position(original=True).bounds) for ax in axes.ravel()] == before, name
        assert plt.get_fignums() == [figure.number], name
        plt.close(figure)


def test_profiles_show_the_limits_that_are_kept_where_they_are_near(fronts):
    motion = fronts["pointing"].least("time").rollout
    robot = motion.robot
    kept = replace(robot.limits, velocity=0.5 * robot.limits.velocity)
    held = Rollout(Dynamics(robot), motion.trajectory, kept_limits=kept)
    panel = plots.profiles(held)[1]
    half, most = float(kept.velocity[0]), float(np.abs(motion.trajectory[0].sample(1000).v).max())
    assert half < most  # so that they are near
    assert {abs(line.get_ydata()[0]) for line in panel.lines if line.get_gid() == "limit"} == {half}
    grey = [patch.get_y() for patch in panel.patches]
    assert min(abs(half - each) for each in grey) < 1e-12


def test_limits_far_from_the_curves_are_told_and_do_not_flatten_them(fronts):
    knee = fronts["hybrid"].knee()
    for panel in plots.profiles(knee):
        curves = np.concatenate([line.get_ydata() for line in panel.lines if len(line.get_xdata()) > 100])
        low, high = panel.get_ylim()
        assert np.ptp(curves) >= 0.44 * (high - low)
        told = panel.get_title(loc="right")
        lines = [line for line in panel.lines if line.get_gid() == "limit"]
        assert bool(told) or len(lines) >= 2
        assert not told or re.fullmatch(
            r"limit outside: −?[\d.]+|(nearest )?limits outside: (±|−)?[\d.]+(, [\d.]+)?", told
        ), told


def test_units_are_those_of_the_quantities(fronts):
    shown = " ".join(
        text.get_text() for front in fronts.values() for text, _ in drawn_texts(plots.front(front)[0].figure)
    )
    assert "SI" not in shown
    assert "(rad or m)²/s⁵" in shown
    assert {"jerk [deg/s³]", "energy [W²·s]", "jerk [mm²/s⁵]"} <= set(re.findall(r"\w+ \[[^\]]*\]", shown))


BAD = {
    "unknown width": (lambda front, ax: plots.front(front, width="colum"), r"width: expected 'column' \(85 mm\).*did"),
    "width in metres": (lambda front, ax: plots.hypervolume(front, width=0.085), "width: expected .* got 0.085"),
    "true": (lambda front, ax: plots.hypervolume(front, width=True), "width: expected .* got True"),
    "no axes": (lambda front, ax: plots.hypervolume(front, ax=5), "ax: expected Axes of matplotlib, got int"),
    "figure": (lambda front, ax: plots.hypervolume(front, ax=ax.figure), "ax: expected Axes of matplotlib, got Figure"),
    "plane": (lambda front, ax: plots.front_3d(front, ax=ax), "ax: expected axes in space, made with projection='3d'"),
    "few": (lambda front, ax: plots.profiles(front.knee(), axes=[ax, ax]), "axes: expected 4, got 2"),
    "ending": (lambda front, ax: save_figure(ax.figure, Path("a.jpg")), "a.jpg: expected a name that ends in"),
    "format": (lambda front, ax: draw_files(front, Path("x"), format="eps"), "unknown format 'eps'; known: pdf"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_gets_a_sentence(case, fronts):
    call, says = BAD[case]
    refused(lambda: call(fronts["pointing"], plt.subplots()[1]), says)


def test_axes_in_space_are_not_taken_for_a_plane(fronts):
    space = plt.figure().add_subplot(projection="3d")
    refused(lambda: plots.hypervolume(fronts["pointing"], ax=space), "ax: expected axes in the plane")


@pytest.mark.parametrize("ending", mostly_long(["pdf", "svg"], "svg"))
def test_the_command_writes_a_runs_pictures_the_same_each_time(fronts, tmp_path, ending):
    front = fronts["pointing"]
    front.save(tmp_path / "front.json")
    asked = ("--width", "column", *(() if ending == "pdf" else ("--format", ending)))
    done = trajevo("pictures", tmp_path / "front.json", *asked, "--out", tmp_path / "figures")
    assert done.returncode == 0, done.stderr
    files = sorted(file.name for file in (tmp_path / "figures").iterdir())
    drawn = ("front", "front_3d", "hypervolume", "parallel", "profiles", "tool_path")
    assert files == [f"{stem}.{ending}" for stem in drawn]
    again = draw_files(front, tmp_path / "again", width="column", format=ending)
    assert {file.name: file.read_bytes() for file in again} == {
        file.name: file.read_bytes() for file in (tmp_path / "figures").iterdir()
    }
    for arguments, says in ((("--format", "gif"), "unknown format 'gif'"), (("--width", "wide"), "width: expected")):
        told = trajevo("pictures", tmp_path / "front.json", *arguments, "--out", tmp_path / "figures")
        assert told.returncode == 2
        assert says in told.stderr


@pytest.mark.parametrize("width", ["column", 120, "page"])
def test_the_scale_of_colours_beside_an_arm_is_seen_whole(width):
    motion = PickAndPlace(payload=2.5).rollout([[2.0, 4.0, 3.0]])
    figure = plots.stick_figure(motion, width=width).figure
    figure.draw_without_rendering()
    arm, scale = figure.axes
    seen, whole = scale.get_tightbbox(), figure.bbox
    assert seen.x0 >= whole.x0 and seen.x1 <= whole.x1  # noqa: PT018 - one sentence
    assert seen.y0 >= whole.y0 and seen.y1 <= whole.y1  # noqa: PT018 - one sentence
    assert seen.x0 > arm.get_position().x1 * whole.width
    plt.close(figure)
