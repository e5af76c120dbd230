"""What stands for a large front: few rows, spread evenly, with all that pictures mark and label."""

import dataclasses

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.collections import LineCollection

from tests.helpers import refused, small_problem
from trajevo import Front, certify, certify_all, optimise, plots
from trajevo.exporters.netcdf import FEWER, MOST_SOLUTIONS, dataset, netcdf
from trajevo.front.thinning import MOST_SHOWN, thinned, told_share

RNG = np.random.default_rng(5)


def curved(count, objectives):
    """Points on a sphere's part, none of which dominates another, in very different units."""
    points = np.abs(RNG.normal(size=(count, objectives)))
    return (1.0 - points / np.linalg.norm(points, axis=1)[:, None]) * 10.0 ** np.arange(objectives)


FRONTS = {
    "two": curved(4000, 2),
    "three": curved(20000, 3),
    "six": curved(6000, 6),
    "one": RNG.uniform(size=(5000, 1)),
    "crowded": np.concatenate([curved(9000, 3) * 1e-6 + 0.5, curved(100, 3)]),
    "equal": np.ones((5000, 2)),
    "constant": np.column_stack([curved(5000, 2), np.ones(5000)]),
    "ties": np.repeat(curved(50, 3), 100, axis=0),
}


@pytest.mark.thinned(5)
@pytest.mark.parametrize("name", FRONTS)
@pytest.mark.parametrize("most", [20, 300, 3000])
def test_extremes_and_what_is_kept_are_among_few_rows(name, most):
    F, kept = FRONTS[name], [7, 11]
    rows = thinned(F, most, kept=kept)
    assert len(rows) <= most
    assert (np.diff(rows) > 0).all()
    assert set(kept) <= set(rows.tolist())
    np.testing.assert_array_equal(F[rows].min(axis=0), F.min(axis=0))
    np.testing.assert_array_equal(F[rows].max(axis=0), F.max(axis=0))
    np.testing.assert_array_equal(thinned(F, most, kept=kept), rows)


def test_the_rows_are_spread_evenly():
    """No solution is far from one that stands for it, wherever most solutions are."""
    crowd = np.concatenate([np.full(20000, 0.31) + RNG.uniform(0.0, 1e-4, 20000), np.linspace(0.0, 1.0, 2000)])
    F = np.column_stack([crowd, 1.0 - crowd])
    rows = thinned(F, 500)
    nearest = np.abs(F[:, None, 0] - F[None, rows, 0]).min(axis=1)
    assert nearest.max() <= 1.0 / 300.0
    assert len(rows) > 300


def test_small_fronts_stay_whole_and_too_few_rows_are_refused():
    F = FRONTS["two"]
    np.testing.assert_array_equal(thinned(F, len(F)), np.arange(len(F)))
    refused(lambda: thinned(F, 3, kept=[1, 2, 3]), "most: expected more than the [0-9]+ rows that are kept in any case")
    assert told_share(np.arange(5), np.arange(5)) == ""
    assert told_share(np.arange(1000), np.arange(100000)) == "1,000 of 100,000 solutions, spread over the front"


@pytest.fixture(scope="module")
def large():
    """A front of 6,000 rows, made of one search: its members many times, with objectives that differ slightly."""
    front = optimise(small_problem(), seed=1, generations=12, population=40, polish=False, progress=False)
    copies = -(-6000 // len(front))
    spread = 1.0 + 1e-9 * RNG.uniform(size=(copies, 1, front.F.shape[1]))
    F = (front.F[None] * spread).reshape(-1, front.F.shape[1])[:6000]
    X, G = (np.tile(values, (copies, 1))[:6000] for values in (front.X, front.G))
    return dataclasses.replace(front, X=X, F=F, G=G)


def test_every_choice_stands_for_a_front(large):
    rows = set(large.thinned().tolist())
    assert len(rows) <= MOST_SHOWN < len(large)
    assert {choice.index for choice in large.choices()} <= rows


def test_pictures_show_few_of_many_and_say_so(large):
    says = told_share(large.thinned(), large)
    panel = plots.front(large, mark=large.knee())[0]
    assert len(panel.collections[0].get_offsets()) == len(large.thinned())
    assert panel.get_title(loc="left") == says
    lines = plots.parallel_coordinates(large, mark=large.knee())
    (drawn,) = (one for one in lines.collections if isinstance(one, LineCollection))
    assert len(drawn.get_segments()) == len(large.thinned())
    assert lines.get_xlabel() == says
    np.testing.assert_allclose(sorted(panel.get_lines()[0].get_xdata()), large.knee().F["time"])
    plt.close("all")
    few = dataclasses.replace(large, X=large.X[:50], F=large.F[:50], G=large.G[:50])
    assert plots.front(few)[0].get_title(loc="left") == plots.parallel_coordinates(few).get_xlabel() == ""


def test_a_file_of_a_large_front_holds_few_motions_and_says_so(large):
    assert len(large) > MOST_SOLUTIONS
    made = dataset(large, samples=3)
    rows = large.thinned(FEWER)
    np.testing.assert_array_equal(made["solution"], rows)
    assert made["solution"].attrs["comment"] == told_share(rows, large)
    assert made["position"].shape[0] == len(rows) <= FEWER
    with pytest.warns(UserWarning, match="the file holds [0-9,]+ of 6,000 solutions, spread over the front"):
        netcdf(large, 100.0)


def test_chosen_rows_are_certified_under_their_own_numbers(large):
    rows = [0, 17, 5999]
    found = certify_all(large, rows=rows)
    assert [each.motion for each in found] == ["row 0", "row 17", "row 5999"]
    assert found[1].rows == certify(large.pick(17)).rows


def test_only_rows_that_are_used_are_compared_with_their_record(large, tmp_path, monkeypatch):
    large.save(tmp_path / "front.json")
    front, seen = Front.load(tmp_path / "front.json", problem=large.problem), []
    compare = type(front._check).compare
    monkeypatch.setattr(
        type(front._check), "compare", lambda self, problem, rows: (seen.extend(rows), compare(self, problem, rows))
    )
    rollout = front.rollouts_of(front.thinned(200))
    assert len(rollout.trajectory) == len(front.thinned(200))
    assert len(set(seen)) < 230
