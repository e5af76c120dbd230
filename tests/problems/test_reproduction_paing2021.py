"""Paing 2021 made again: every printed number is there and as said, and the curves have second opinions."""

import csv
from collections import Counter

import numpy as np
import pytest
from matplotlib.image import imread
from scipy.interpolate import BSpline

from tests.reference import PAING2021
from trajevo.problems.gemini_and_s import EXAMPLE_PATHS
from trajevo.reproduction.registry import paper_named
from trajevo.reproduction.reproduce import reproduce

#: Printed numbers of every item, and of those the ones that differ for a known reason.
COUNTS = {
    "Figure 3": (3, 0),
    "Figure 4": (9, 0),
    "Figure 5": (0, 0),
    "Figure 6": (3, 0),
    "Figure 7": (5, 0),
    "Figure 8": (5, 0),
    "Figure 8s": (0, 0),
    "Figure 9": (3, 0),
    "Figure 10": (0, 0),
    "Figure 11": (2, 2),
    "Figure 12": (0, 0),
    "Figure 15": (4, 4),
}


#: Items of which the tests of curves ask, made with short searches; all are made at full size.
SOME = ("3", "4", "5", "6", "7")


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    return reproduce(paper_named("paing2021"), tmp_path_factory.mktemp("paing2021"), short=True, figures=SOME)


def check(made):
    assert not made.unexpected
    counts = Counter(str(item) for item, _ in made.numbers)
    differ = Counter(str(item) for item, number in made.numbers if number.verdict == "differs")
    assert {str(item): (counts[str(item)], differ[str(item)]) for item in made.shown}.items() <= COUNTS.items()
    for item, shown in made.shown.items():
        assert shown.table is not None
        assert (1 if str(item) == "Figure 15" else 2) <= len(shown.table.rows) <= 400
        picture = imread(made.folder / f"{item.stem}.png")
        assert picture.shape[1] > 900
        assert 0.005 < (picture[..., :3].min(axis=-1) < 0.9).mean() < 0.5


def table(made, stem, name):
    """Rows of a table whose first cell is a name, as numbers, shape (rows, columns - 1)."""
    found = list(csv.reader((made.folder / f"{stem}.csv").open()))[1:]
    return np.array([[float(cell) for cell in row[1:]] for row in found if row[0] == name])


def test_every_printed_number_is_as_said(short):
    check(short)
    assert len(short.shown) == len(SOME)


@pytest.mark.long
def test_every_printed_number_is_as_said_at_full_size(tmp_path):
    made = reproduce(paper_named("paing2021"), tmp_path)
    check(made)
    assert len(made.shown) == len(COUNTS)
    ours = {(str(item), number.of): number.ours for item, number in made.numbers}
    for figure, path in (("Figure 4", "sshape"), ("Figure 8", "gemini")):
        nearest = PAING2021[path]["trap1000"]["nnc"]["0.515625"]
        assert ours[figure, "t_f of the best trade-off"] == pytest.approx(nearest["tf"], rel=1e-6)
    proposed, linear = (table(made, "figure_11", name) for name in ("proposed", "linear reparameterisation"))
    for _, time, jerk in linear:  # no run of the linear reparameterisation is as good as one of the proposed
        assert ((proposed[:, 1] < time) & (proposed[:, 2] < jerk)).any()
    for stem in ("figure_04", "figure_08"):  # true peaks are never above their bounds
        hull, true = (table(made, stem, name) for name in ("limits (20)-(25)", "limits of the true peaks"))
        at, times, jerks = np.log(hull[:, 1]), np.log(true[:, 1]), np.log(true[:, 2])  # power laws are straight then
        assert (np.exp(np.interp(at, times, jerks)) < 1.02 * hull[:, 2]).all()
        assert true[0, 1] < hull[0, 1]
    check_sensitivity(made, ours["Figure 8", "t_f of the best trade-off"])


def check_sensitivity(made, printed):
    """What Figure 8s depends on, in the directions that its text tells."""
    names = [row[0] for row in csv.reader((made.folder / "figure_08s.csv").open())][1:]
    points, _, best = np.array([table(made, "figure_08s", name)[0, :3] for name in names]).T
    points, best = dict(zip(names, points, strict=True)), dict(zip(names, best, strict=True))
    usual = names[0]
    assert best[usual] == printed
    assert best["least trade-off 0.02"] == pytest.approx(printed, rel=1e-4)
    assert points["least trade-off 0.05"] < points["least trade-off 0.02"] < points[usual]
    assert best["order 5"] > printed > best["order 7"]
    assert best["control points 12"] > printed > best["control points 20"]


@pytest.mark.parametrize(("stem", "path"), [("figure_03", "s"), ("figure_07", "gemini")])
def test_paths_are_those_of_scipys_b_splines(short, stem, path):
    curve = EXAMPLE_PATHS[path].make()
    u, x, y = table(short, stem, "path").T
    again = BSpline(curve.knots, curve.control_points, curve.order - 1)(u)
    np.testing.assert_allclose(np.column_stack([x, y]), 1e3 * again, atol=1e-9)


@pytest.mark.parametrize("name", ["time-optimal", "best trade-off", "jerk-optimal"])
def test_motions_are_differences_along_the_path(short, name):
    """Velocities integrate to the way from the first point to the last; accelerations to 0, as at rest at the ends."""
    t, *columns = table(short, "figure_06", name).T
    v, a, j = np.reshape(columns, (3, 2, -1))
    path = EXAMPLE_PATHS["s"].make()
    way = 1e3 * (path(1.0) - path(0.0))
    np.testing.assert_allclose(np.trapezoid(v, t), way, atol=0.05)
    np.testing.assert_allclose(np.trapezoid(a, t), 0.0, atol=0.3)
    np.testing.assert_allclose(np.cumsum(0.5 * np.diff(t) * (j[:, 1:] + j[:, :-1]), axis=1), a[:, 1:], atol=6.0)
    np.testing.assert_allclose(v[:, [0, -1]], 0.0, atol=1e-9)
    np.testing.assert_allclose(a[:, [0, -1]], 0.0, atol=1e-6)


@pytest.mark.parametrize("name", ["time-optimal", "best trade-off", "jerk-optimal"])
def test_the_parameter_gives_the_velocities(short, name):
    """Figures 5 and 6 are of the same runs: s(u(t)) moves as fast as Figure 6 says."""
    t, u = table(short, "figure_05", name).T
    at, vx, vy, *_ = table(short, "figure_06", name).T
    places = 1e3 * EXAMPLE_PATHS["s"].make()(u)
    middle, speed = 0.5 * (t[1:] + t[:-1]), np.diff(places, axis=0) / np.diff(t)[:, None]
    said = np.column_stack([np.interp(middle, at, vx), np.interp(middle, at, vy)])
    np.testing.assert_allclose(speed, said, atol=0.4)
    assert (u[0], u[-1]) == pytest.approx((0.0, 1.0), abs=0.02)


def test_the_second_objective_is_that_of_the_jerk_drawn(short):
    for name, stem, row in (("time-optimal", "figure_06", 0), ("jerk-optimal", "figure_06", -1)):
        t, *columns = table(short, stem, name).T
        square = (np.reshape(columns, (3, 2, -1))[2] ** 2).sum(axis=0)
        integral = np.trapezoid(square, t)
        F2 = table(short, "figure_04", "limits (20)-(25)")[row, 2]
        assert integral == pytest.approx(F2, rel=0.01)
