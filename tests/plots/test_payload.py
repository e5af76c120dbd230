"""Pictures of loads off centre, and `trajevo payload-diagram` as a user meets it."""

from dataclasses import replace

import matplotlib as mpl
import matplotlib.image
import matplotlib.pyplot as plt
import numpy as np
import pytest

from tests.capacity.test_payload_effort import random_effort
from tests.helpers import UNDRAWN, refused, trajevo
from trajevo import Front
from trajevo.capacity.payload_diagram import allowed_centres, allowed_regions, payload_diagram
from trajevo.capacity.payload_effort import payload_effort
from trajevo.capacity.robust import robust_capacity
from trajevo.plots.payload import allowed_region, payload_contours

mpl.use("Agg")
XY, Z = np.linspace(0.0, 0.4, 21), np.linspace(0.0, 0.3, 16)


@pytest.fixture(autouse=True)
def _closed():
    yield
    plt.close("all")


@pytest.fixture(scope="module")
def effort():
    return random_effort("ur5", np.random.default_rng(1), speed=0.3)[1]


@pytest.fixture(scope="module")
def diagram(effort):
    return payload_diagram(effort, XY, Z)


def labels(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


def test_lines_of_a_diagram_are_where_the_masses_are(effort, diagram):
    ax = payload_contours(diagram)
    lines = ax.collections[-1]
    checked = 0
    for level, path in zip(lines.levels, lines.get_paths(), strict=True):
        corners = 1e-3 * path.vertices
        if len(corners):
            x = XY.searchsorted(corners[:, 0]).clip(0, len(XY) - 1)
            on_grid = np.isclose(XY[x], corners[:, 0], atol=1e-12)
            for xy, z in corners[on_grid]:
                assert payload_diagram(effort, [xy], [z]).mass[0, 0] == pytest.approx(level, rel=0.03)
                checked += 1
    assert checked > 10
    binding = {diagram.joint_names[joint] for joint in np.unique(diagram.joint)}
    assert set(labels(ax)) == {f"{name} binds" for name in binding}
    assert "worst direction" in ax.get_xlabel()
    assert ax.get_xlim() == (0.0, 400.0)


def test_motions_are_overlaid_in_the_given_axes(effort, diagram):
    ax = plt.subplots()[1]
    slower = payload_diagram(replace(effort, base=0.5 * effort.base), XY, Z)
    assert payload_contours({"fast": diagram, "slow": slower}, ax=ax) is ax
    assert labels(ax)[-2:] == ["fast", "slow"]
    assert len(ax.collections) > len(payload_contours(diagram).collections)


def test_cells_without_any_mass_are_grey_and_without_a_limit_white(diagram):
    mass, joint = diagram.mass.copy(), diagram.joint.copy()
    mass[:4], joint[:4] = np.nan, -1
    mass[-4:], joint[-4:] = np.inf, -1
    ax = payload_contours(replace(diagram, mass=mass, joint=joint))
    assert {"no mass is feasible", "nothing limits it"} <= set(labels(ax))
    colours = np.asarray(ax.collections[0].get_array())
    finer = len(colours) // (len(Z) - 1)
    assert finer > 1
    np.testing.assert_allclose(colours[: 3 * finer, :, :3], 0.6)
    np.testing.assert_allclose(colours[-3 * finer :, :, :3], 1.0)
    nothing = payload_contours(replace(diagram, mass=np.full_like(mass, np.nan), joint=np.full_like(joint, -1)))
    assert labels(nothing) == ["no mass is feasible"]


def test_what_cannot_be_overlaid_is_refused(effort, diagram):
    ahead = payload_diagram(effort, XY, Z, direction=0.5)
    assert "at 28.6479°" in payload_contours(ahead).get_xlabel()
    refused(lambda: payload_contours({"worst": diagram, "ahead": ahead}), "^diagrams: 'ahead' differs from the first")
    refused(lambda: payload_contours({}), "^diagrams: expected 1 to 4 of them, got 0")
    refused(lambda: payload_contours({str(i): diagram for i in range(5)}), "got 5")


def test_regions_are_sections_of_the_polyhedra(effort):
    fixed = effort.with_inertia_about_tool(0.05 * np.eye(3))
    ax = allowed_region(allowed_regions(fixed, [1000.0, 4.0, 2.0], within=0.6, axis="y", at=0.1))
    assert labels(ax) == ["2 kg", "4 kg", "1000 kg: nowhere"]
    for patch, mass in zip(ax.patches, (2.0, 4.0), strict=False):
        corners = allowed_centres(fixed, mass).section("y", 0.1, within=0.6)
        np.testing.assert_allclose(patch.get_xy()[:-1], 1e3 * corners)
    assert (ax.get_xlabel()[0], ax.get_ylabel()[0]) == ("x", "z")


def test_regions_that_are_no_polygons_are_contours_of_the_limit(effort):
    assert not effort.affine
    ax = allowed_region(allowed_regions(effort, [4.0, 1000.0], within=0.6, axis="z", at=0.05))
    assert labels(ax) == ["4 kg", "1000 kg: nowhere"]
    edges = [path.vertices for lines in ax.collections for path in lines.get_paths() if not lines.get_fill()]
    edge = 1e-3 * np.concatenate([points for points in edges if len(points)])
    used = effort.used(4.0, np.column_stack([edge, np.full(len(edge), 0.05)]))
    np.testing.assert_allclose(used, 1.0, atol=0.02)  # straight between the cells of the grid
    assert len(edge) > 20


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "hybrid"
    options = ["--payload", "8", "--generations", "12", "--population", "20", "--no-polish"]
    solved = trajevo("solve", "hybrid", *options, *UNDRAWN, "--out", folder, "--quiet")
    assert solved.returncode == 0, solved.stderr
    return folder


def test_command_prints_the_numbers_and_writes_the_picture(run):
    front = Front.load(run / "front.json")
    shown = trajevo("payload-diagram", run, "--solution", "least_time", "--grid", "11", "--tolerance", "0.05")
    assert shown.returncode == 0, shown.stderr
    effort = payload_effort(front.pick("least_time"))
    diagram = payload_diagram(effort, np.linspace(0.0, 0.3, 11), np.linspace(0.0, 0.3, 11))
    lines = [line.split() for line in shown.stdout.splitlines()]
    for row, column in ((0, 0), (0, -1), (-1, 0), (-1, -1)):
        begun = next(k for k, line in enumerate(lines) if line[:1] == [f"{1e3 * diagram.offset_z[row]:.4g}"])
        assert lines[begun][1:][column] == f"{diagram.mass[row, column]:.3f}"
        assert lines[begun + 1][column] == diagram.joint_names[diagram.joint[row, column]]
    robust = robust_capacity(effort, com=[[-0.05] * 3, [0.05] * 3])
    assert f"within 50 mm of (0, 0, 0) mm along every axis: {robust.upper:.6g} kg" in shown.stdout
    assert "largest payload [kg] (rigid), L_xy in the worst direction" in shown.stdout
    picture = matplotlib.image.imread(run / "payload_diagram.png")[..., :3]
    assert min(picture.shape[:2]) > 300
    assert 0.1 < (picture.mean(axis=2) < 0.95).mean() < 0.9


def test_command_overlays_and_turns(run, tmp_path):
    file = tmp_path / "both.png"
    several = ("--solution", "knee", "--solution", "least_time")
    turned = ("--direction", "90", "--offset-xy", "0.2", "--offset-z", "-0.1", "0.1", "--grid", "5")
    shown = trajevo("payload-diagram", run, *several, *turned, "--out", file)
    assert shown.returncode == 0, shown.stderr
    assert shown.stdout.count("L_xy at 90° from the tool's x axis") == 2
    assert file.is_file()


def test_command_refuses_bad_input_with_a_sentence(run, tmp_path):
    unlimited = tmp_path / "pointing"
    small = ("--generations", "5", "--population", "12", "--quiet")
    assert trajevo("solve", "pointing", *small, *UNDRAWN, "--out", unlimited).returncode == 0
    for arguments, says in (
        ([unlimited], "robot 'pointing_mechanism' has no effort limits, so nothing bounds its payload"),
        ([run, "--offset-xy", "0"], "--offset-xy: expected a positive length [m], got 0.0"),
        ([run, "--offset-z", "0.2", "0.1"], "--offset-z: expected the least place before the greatest [m]"),
        ([run, "--grid", "1"], "--grid: expected at least 2 cells, got 1"),
        ([run, "--tolerance", "-1"], "--tolerance: expected a length from 0 on [m], got -1.0"),
        ([run, "--direction", "nan"], "direction: expected finite numbers"),
        ([run, "--solution", "best"], "unknown solution 'best'"),
        ([run, "--out", tmp_path / "missing" / "a.png", "--grid", "3"], "cannot be written"),
    ):
        shown = trajevo("payload-diagram", *arguments)
        assert shown.returncode == 2, shown.stdout
        assert says in shown.stderr
        assert "Traceback" not in shown.stderr
