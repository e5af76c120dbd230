"""Sun 2020 made again: every number that the paper prints is as told, every picture shows something."""

import json

import matplotlib.pyplot as plt
import numpy as np
import pytest
from scipy.interpolate import BSpline

from tests.helpers import mostly_long
from tests.reference import SUN2020, TABLE_4_DURATIONS, improved_spline
from trajevo.problems.reproductions.sun2020 import PAPER
from trajevo.problems.reproductions.sun2020_curves import control_points, pure_spline, quartic_curve
from trajevo.reproduction.reproduce import reproduce

#: Printed numbers of each item; those of Table 4 that differ are the times, and an azimuth that is none.
NUMBERS = {"Table 1": 7, "Figure 3": 2, "Figure 4": 3, "Table 2": 10, "Table 3": 4, "Table 4": 25}
DIFFERENT = {"P1, T", "P2, T", "P2, γ", "P3, T", "P4, T"}

ITEMS = ["Table 1", *(f"Figure {k}" for k in range(3, 10)), "Table 2", "Table 3", "Figure 10", "Table 4"]
ITEMS += ["Figure 11", "Figure 12"]


#: Items that are always made again: all with numbers, and of the curves and fronts one each.
SOME = {"figures": ("3", "4", "7", "10"), "tables": ("1", "2", "3", "4")}


@pytest.fixture(scope="module", params=mostly_long(["some", "all"], "some"))
def made(request, tmp_path_factory):
    items = SOME if request.param == "some" else {}
    return reproduce(PAPER, tmp_path_factory.mktemp("sun2020"), short=True, **items)


def test_every_item_is_made_and_no_number_is_unexpected(made):
    asked = {f"{kind[:-1].title()} {number}" for kind, numbers in SOME.items() for number in numbers}
    whole = len(made.shown) > len(asked)
    assert [str(item) for item in made.shown] == [item for item in ITEMS if whole or item in asked]
    assert not made.unexpected
    counts = {str(item): len(shown.numbers) for item, shown in made.shown.items() if shown.numbers}
    assert counts == NUMBERS


def test_only_what_was_chosen_differs(made):
    assert {number.of for _, number in made.numbers if number.verdict != "as printed"} == DIFFERENT


def test_every_figure_has_a_picture_and_every_item_a_table(made):
    for item, shown in made.shown.items():
        assert shown.table is not None
        assert 2 < len(shown.table.rows) <= 400 or item.kind == "table"
        if item.kind == "figure":
            picture = plt.imread(made.folder / f"{item.stem}.png")
            assert min(picture.shape[:2]) > 250
            coloured = np.ptp(picture[..., :3], axis=2) > 0.3
            assert 0.0005 < coloured.mean() < 0.5


def test_what_the_experiment_measured_is_left_out(made):
    left = {one.what for one in PAPER.left_out}
    assert {f"Figure {k}" for k in (1, 2, *range(13, 20))} <= left
    assert json.loads((made.folder / "numbers.json").read_text())


def test_quartic_curve_is_scipys():
    P = np.random.default_rng(3).normal(size=(5, 2))
    theirs = BSpline(np.arange(-4.0, 6.0), P, 4)(np.linspace(0.0, 1.0, 201))
    np.testing.assert_allclose(quartic_curve(P), theirs, atol=1e-13)


def test_the_pure_spline_is_the_papers_matrix_product_and_scipys_b_spline():
    spline, times = pure_spline(), np.asarray(SUN2020["table4_times"])
    P = np.radians(SUN2020["joint_angles"])
    extra = control_points(spline)
    chord = np.diff(P, axis=0)[1:]
    for k, share in enumerate((-1 / 12, -1 / 24, 1 / 24, 1 / 12)):
        np.testing.assert_allclose(extra[1:-1, k], P[1:-1] + share * chord, atol=1e-13)
        np.testing.assert_allclose(extra[[0, -1], k], P[[0, -1]], atol=1e-13)
    everywhere = BSpline(np.arange(-4.0, 21.0), extra.reshape(-1, 2), 4)
    for i in range(4):
        share = np.linspace(0.0, 0.9999, 41)
        own = spline.evaluate(times[i] + share * TABLE_4_DURATIONS[0, i])[0]
        np.testing.assert_allclose(own, everywhere(4.0 * (i + share)), atol=1e-12)
        if i in (1, 2):
            expected = [[improved_spline(P[:, joint], i, 4.0 * s) for joint in (0, 1)] for s in share]
            np.testing.assert_allclose(own, expected, atol=1e-12)


def test_acceleration_and_jerk_of_the_pure_spline_begin_and_end_at_zero(made):
    spline = pure_spline()
    for order, peak in ((1, 12.1717), (2, 11.8505), (3, 33.956)):
        ends = spline.evaluate(np.array([0.0, SUN2020["table4_times"][-1]]), order)
        assert np.degrees(np.abs(ends).max()) < 1e-9
        assert np.degrees(spline.peak(order).max()) == pytest.approx(peak, abs=1e-3)
    assert np.degrees(np.abs(spline.jump(3)).max()) > 0.1
    (seven,) = (shown for item, shown in made.shown.items() if str(item) == "Figure 7")
    assert "begins and ends at 0" in seven.said[0]
    assert "does jump" in seven.said[1]


@pytest.mark.long
def test_the_whole_paper(tmp_path):
    found = reproduce(PAPER, tmp_path)
    assert not found.unexpected
    fronts = next(shown for item, shown in found.shown.items() if str(item) == "Figure 10")
    rows = np.array([row[1:] for row in fronts.table.rows], dtype=float)
    names = np.array([row[0] for row in fronts.table.rows])
    least = {name: rows[names == name, 0].min() for name in set(names)}
    assert least["printed curve, default search"] == pytest.approx(15.773219, rel=1e-4)
    assert least["smooth curve, default search"] == pytest.approx(13.310307, rel=1e-4)
    assert least["printed curve, NSGA-II"] == pytest.approx(15.773219, rel=0.02)
