"""The archive: what is left of all points together, whatever came when, and a hypervolume that is measured once."""

import moocore
import numpy as np
import pytest

from tests.helpers import small_problem
from trajevo import archive as module
from trajevo import watch as books
from trajevo.archive import Archive
from trajevo.watch import Watch


def populations(n_obj, *, levels, seed, count=40, size=60):
    """X, F, G of populations near a front, with equal values, copies, infeasible points and some without numbers."""
    random = np.random.default_rng(seed)
    for number in range(count):
        F = random.random((size, n_obj)) ** 2
        F = np.round(levels * (F / np.linalg.norm(F, axis=1, keepdims=True) + 0.3 * random.random((size, 1)))) / levels
        F[random.random(size) < 0.05] = F[0]
        G = random.normal(-1.5, 1.0, (size, 2))
        G[random.random(size) < 0.02, 0] = np.nan
        F[random.random(size) < 0.05, 0] = random.choice([np.nan, np.inf])
        yield np.column_stack([np.full(size, number), np.arange(size)]).astype(float), F, G


def at_once(parts):
    """The archive by its definition: the feasible points that nothing dominates, the first of equal ones."""
    X, F, G = (np.concatenate(values) for values in zip(*parts, strict=True))
    feasible = np.isfinite(F).all(axis=1) & (G <= 0.0).all(axis=1)
    X, F, G = X[feasible], F[feasible], G[feasible]
    less = (F[:, None] <= F).all(axis=2)
    dominates = less & ~less.T | np.triu(less & less.T, 1)
    left = ~dominates.any(axis=0)
    return X[left], F[left], G[left]


@pytest.mark.parametrize("n_obj", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("levels", [5, 10**6])
@pytest.mark.parametrize(("slow_from", "pairs"), [((4, 500), 2**16), ((1, 0), 2**16), ((1, 0), 500), ((1, 0), 1)])
def test_an_archive_is_that_of_all_points_together(monkeypatch, n_obj, levels, slow_from, pairs):
    monkeypatch.setattr(module, "_SLOW_FROM", slow_from)
    monkeypatch.setattr(module, "_PAIRS", pairs)
    parts = list(populations(n_obj, levels=levels, seed=n_obj))
    archive = Archive(2, n_obj, 2)
    for part in parts:
        archive.add(*part)
    for found, expected in zip((archive.X, archive.F, archive.G), at_once(parts), strict=True):
        np.testing.assert_array_equal(found, expected)
    assert archive.failures == sum(int((~np.isfinite(F).all(axis=1)).sum()) for _, F, _ in parts)


@pytest.mark.parametrize("n_obj", [2, 3, 4])
def test_every_step_is_that_of_moocore(monkeypatch, n_obj):
    monkeypatch.setattr(module, "_SLOW_FROM", (1, 0))
    old = np.empty((0, n_obj))
    for _, F, _ in populations(n_obj, levels=10**6, seed=9):
        new = F[np.isfinite(F).all(axis=1)]
        together = np.concatenate([old, new])
        expected = moocore.is_nondominated(together)
        kept, taken = module._non_dominated(old, new)
        np.testing.assert_array_equal(kept, expected[: len(old)])
        np.testing.assert_array_equal(taken, np.flatnonzero(expected[len(old) :]))
        old = together[expected]


def test_what_an_archive_gave_does_not_change_with_it():
    archive = Archive(2, 3, 2)
    given = []
    for part in populations(3, levels=10**6, seed=3):
        archive.add(*part)
        given.append([(array, array.copy()) for array in (archive.X, archive.F, archive.G)])
    for array, copy in (pair for pairs in given for pair in pairs):
        np.testing.assert_array_equal(array, copy)


def test_the_nearest_miss_is_that_of_all_points():
    archive, least = Archive(2, 2, 2), np.inf
    for X, F, G in populations(2, levels=100, seed=5, count=5):
        G = np.nan_to_num(np.abs(G))
        archive.add(X, F, G)
        least = min(least, G[np.isfinite(F).all(axis=1)].sum(axis=1).min())
        assert archive.least_violation == least
    assert len(archive.F) == 0


def test_a_hypervolume_is_measured_where_the_archive_has_changed(monkeypatch):
    measured = []
    monkeypatch.setattr(books, "hypervolume", lambda F, corner: measured.append(len(F)) or float(len(measured)))
    watch = Watch(small_problem())
    random = np.random.default_rng(0)
    n_var, n_obj, n_constr = watch.problem.n_var, watch.problem.n_obj, watch.problem.n_ieq_constr
    X, F, G = random.random((8, n_var)), random.random((8, n_obj)), np.full((8, n_constr), -1.0)
    assert watch.close(1, 0).hypervolume == 0.0
    watch.collect(X, {"F": F, "G": G})
    assert watch.close(2, 8).hypervolume == 1.0
    watch.collect(X, {"F": F + 1.0, "G": G})
    assert watch.close(3, 16).hypervolume == 1.0
    watch.collect(X, {"F": F - 0.5, "G": G})
    assert watch.close(4, 24).hypervolume == 2.0
    assert watch.hypervolume == [0.0, 1.0, 1.0, 2.0]
    assert len(measured) == 2
