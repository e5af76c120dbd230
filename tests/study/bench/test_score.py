"""Scores against numbers by hand, against moocore, and against a search of every row."""

from types import SimpleNamespace

import moocore
import numpy as np
import pytest

from trajevo.study.bench.score import MOST_CHECKED, SHARES, Measure, Story, kept_rows


def reference(values, *, kind="front", ideal=(0.0, 0.0), corner=(1.0, 1.0)):
    return SimpleNamespace(
        kind=kind, ideal=np.array(ideal), reference_point=np.array(corner), values=np.array(values, dtype=float)
    )


def random_story(seed, *, objectives=2, rows=200, budget=10.0):
    """A run whose values become better, in a box of many units; and what it is measured by."""
    rng = np.random.default_rng(seed)
    scale, ideal = np.array([2.0, 3000.0, 0.1])[:objectives], np.array([1.0, -50.0, 0.0])[:objectives]
    drawn = rng.uniform(size=(rows, objectives)) * np.linspace(1.2, 0.4, rows)[:, None]
    best = rng.uniform(0.05, 0.3, size=(20, objectives))
    measure = Measure(reference(ideal + scale * best, ideal=ideal, corner=ideal + scale))
    cpu = np.sort(rng.uniform(0.0, budget, rows))
    F = ideal + scale * drawn
    return measure, cpu, F, Story(measure, cpu, np.arange(1, rows + 1), F, budget=budget)


def test_a_share_is_that_of_volumes_by_hand():
    # Two points of which each dominates 3/8 of the unit box and both 1/4; the best known one dominates 9/16.
    measure = Measure(reference([[0.25, 0.25]]))
    assert measure(np.array([[0.25, 0.5], [0.5, 0.25]])) == pytest.approx(0.5 / 0.5625, rel=1e-12)
    assert measure(np.array([[0.25, 0.25]])) == pytest.approx(1.0, rel=1e-12)
    assert measure(np.empty((0, 2))) == 0.0
    assert measure(np.array([[1.5, 0.1]])) == 0.0, "outside the box"


def test_units_do_not_matter():
    one, other = np.array([[0.2, 0.6], [0.5, 0.3]]), np.array([[0.1, 0.1]])
    scale, shift = np.array([1e3, 1e-4]), np.array([7.0, -2.0])
    plain = Measure(reference(other))(one)
    shifted = reference(shift + scale * other, ideal=shift, corner=shift + scale)
    assert Measure(shifted)(shift + scale * one) == pytest.approx(plain, rel=1e-9)


def test_of_a_least_value_the_share_is_the_best_known_over_it():
    measure = Measure(reference([[3.0, 9.0]], kind="least"))
    assert measure(np.array([[4.0, 1.0], [6.0, 0.0]])) == pytest.approx(0.75)
    assert measure(np.array([[2.0, 50.0]])) > 1.0
    np.testing.assert_array_equal(measure.front(np.array([[4.0, 1.0], [3.5, 8.0]])), [1])


@pytest.mark.parametrize("objectives", [2, 3])
def test_the_end_of_a_story_is_what_moocore_says_of_all_its_rows(objectives):
    measure, _, F, story = random_story(3, objectives=objectives)
    ideal, corner = measure._ideal, measure._corner
    whole = moocore.hypervolume((F - ideal) / corner, ref=np.ones(objectives))
    assert story.share * measure._best == pytest.approx(whole, rel=1e-12)
    assert set(story.rows) == set(np.flatnonzero(moocore.is_nondominated(F)))


@pytest.mark.parametrize("seed", range(5))
def test_times_are_those_of_the_first_row_that_reaches_a_share(seed):
    measure, cpu, F, story = random_story(seed)
    shares = np.array([measure(F[: k + 1]) for k in range(len(F))])
    for share in (*SHARES, 0.3, 0.5):
        reached = np.flatnonzero(shares >= share)
        assert story.time_to(share) == (cpu[reached[0]] if len(reached) else None)


@pytest.mark.parametrize("seed", range(3))
def test_a_history_grows_and_ends_at_the_end(seed):
    _, cpu, F, story = random_story(seed)
    history = story.history()
    for key in ("cpu", "evaluations", "share"):
        values = [getattr(one, key) for one in history]
        assert values == sorted(values)
    assert history[-1].share == story.share
    assert history[-1].cpu == cpu[-1]
    np.testing.assert_array_equal(history[-1].least, F.min(axis=0))


def test_of_nothing_there_is_no_story():
    measure = Measure(reference([[0.25, 0.25]]))
    story = Story(measure, np.empty(0), np.empty(0, dtype=int), np.empty((0, 2)), budget=1.0)
    assert (story.history(), story.share, story.time_to(0.95)) == ((), 0.0, None)


def test_few_members_stand_for_many_with_the_least_of_every_objective():
    F = np.random.default_rng(0).uniform(size=(300, 2))
    F = F[moocore.is_nondominated(F)]
    many = np.stack([np.linspace(0.0, 1.0, 500), np.linspace(1.0, 0.0, 500) ** 2], axis=1)
    for front in (F, many):
        rows = kept_rows(front, MOST_CHECKED)
        assert len(rows) <= max(MOST_CHECKED, 2)
        assert set(front.argmin(axis=0)) <= set(rows)
