"""Raji 2022 made again: every number that the paper prints is as told, every picture shows something."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from scipy.interpolate import BPoly

from trajevo.problems import PickAndPlace
from trajevo.problems.pick_and_place import paper_solution
from trajevo.problems.reproductions.raji2022 import PAPER
from trajevo.reproduction.reproduce import reproduce

#: Printed numbers of each item; and those that are told to differ.
NUMBERS = {"Table 1": 24, "Figure 3": 12, "Table 2": 48, "Figure 4": 1, "Figure 5": 1, "Figure 6": 1}
DIFFERENT = {("Figure 3", "unload, z"), ("Figure 4", "displacement of joint 1"), ("Figure 6", "execution")}

#: Curves whose least time follows from the limits alone, under those of the PUMA 560 [s].
CLOSED = {
    "cycloidal, stops": 6.0703,
    "harmonic, stops": 4.4201,
    "trigonometric, stops": 7.2379,
    "trapezoid, stops": 3.4937,
}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    return reproduce(PAPER, tmp_path_factory.mktemp("raji2022"), short=True)


def test_every_item_is_made_and_no_number_is_unexpected(made):
    assert {str(item): len(shown.numbers) for item, shown in made.shown.items()} == NUMBERS
    assert not made.unexpected
    assert {(str(item), one.of) for item, one in made.numbers if one.verdict != "as printed"} == DIFFERENT


def test_every_item_has_a_table_and_every_figure_a_picture(made):
    for item, shown in made.shown.items():
        assert 3 < len(shown.table.rows) <= 400
        if item.kind == "figure":
            picture = plt.imread(made.folder / f"{item.stem}.png")
            assert min(picture.shape[:2]) > 250
            assert 0.0005 < (np.ptp(picture[..., :3], axis=2) > 0.3).mean() < 0.5


def test_the_septic_is_scipys_polynomial(made):
    """Table 2 from divided conditions: SciPy's polynomial through the points with the rests at both ends."""
    motion = PickAndPlace().decode(paper_solution())
    points = PickAndPlace().interpolant.points.positions
    (four,) = (shown for item, shown in made.shown.items() if str(item) == "Figure 4")
    rows = np.array(four.table.rows)
    for joint in range(6):
        ends = np.stack([motion.evaluate(np.array([0.0, 9.0]), k)[0, :, joint] for k in range(4)], axis=1)
        whole = BPoly.from_derivatives([0.0, 9.0], ends)
        np.testing.assert_allclose(whole([2.0, 6.0]), points[1:3, joint], atol=1e-9)
        for order in range(3):
            theirs = whole.derivative(order)(rows[:, 0]) if order else whole(rows[:, 0])
            np.testing.assert_allclose(rows[:, 1 + 6 * order + joint], theirs, atol=1e-9)


def test_lines_with_blends_stay_between_the_points_and_come_to_rest(made):
    (five,) = (shown for item, shown in made.shown.items() if str(item) == "Figure 5")
    rows, points = np.array(five.table.rows), PickAndPlace().interpolant.points.positions
    assert rows[-1, 0] == pytest.approx(9.0)
    np.testing.assert_allclose(rows[[0, -1], 1:], points[[0, -1]], atol=1e-12)
    assert (rows[:, 1:].max(axis=0) <= points.max(axis=0) + 1e-12).all()
    assert np.abs(np.diff(rows[-2:, 1:], axis=0)).max() < 1e-3


def test_rivals_are_the_papers_other_curves(made):
    (six,) = (shown for item, shown in made.shown.items() if str(item) == "Figure 6")
    time = {row[0]: float(row[1]) for row in six.table.rows}
    assert "4-3-4, C2" in time
    for title, expected in CLOSED.items():
        assert time[title] == pytest.approx(expected, abs=1e-4)


@pytest.mark.long
def test_the_whole_paper(tmp_path):
    found = reproduce(PAPER, tmp_path)
    assert not found.unexpected
    (six,) = (shown for item, shown in found.shown.items() if str(item) == "Figure 6")
    time = {row[0]: float(row[1]) for row in six.table.rows}
    assert len(time) == 12
    assert time["one polynomial"] == pytest.approx(4.4737, rel=1e-3)
    assert time["4-3-4, C2"] == pytest.approx(4.3004, rel=1e-3)
