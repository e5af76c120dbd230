"""The archive: what is left of all points together, whatever came when, and what is known of its hypervolumes."""

import pickle

import moocore
import numpy as np
import pydantic
import pytest

from tests.helpers import mostly_long, small_problem
from trajevo.base import jit
from trajevo.front import archive as module
from trajevo.front import hypervolume as volumes
from trajevo.front.archive import Archive
from trajevo.front.books import Books
from trajevo.front.hypervolume import Chronicle, Volume, Volumes
from trajevo.front.records import History


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


@pytest.fixture(params=[False, True])
def compiles(request, monkeypatch):
    """With the compiled loops, and as where numba is not installed."""
    if request.param:
        pytest.importorskip("numba")
    monkeypatch.setattr(jit, "can_compile", lambda: request.param)
    return request.param


def at_once(parts):
    """The archive by its definition: the feasible points that nothing dominates, the first of equal ones."""
    X, F, G = (np.concatenate(values) for values in zip(*parts, strict=True))
    feasible = np.isfinite(F).all(axis=1) & (G <= 0.0).all(axis=1)
    X, F, G = X[feasible], F[feasible], G[feasible]
    less = (F[:, None] <= F).all(axis=2)
    dominates = less & ~less.T | np.triu(less & less.T, 1)
    left = ~dominates.any(axis=0)
    return X[left], F[left], G[left]


#: Whether loops are compiled, from which sizes on pairs are compared, and how many at a time.
WAYS = [(False, (4, 500), 2**16), (False, (1, 0), 2**16), (False, (1, 0), 500), (False, (1, 0), 1), (True, (1, 0), 1)]


@pytest.mark.thinned(5)
@pytest.mark.parametrize("n_obj", mostly_long([1, 2, 3, 4, 5], 1, 3))
@pytest.mark.parametrize("levels", [5, 10**6])
@pytest.mark.parametrize(
    ("compiles", "slow_from", "pairs"),
    mostly_long(WAYS, WAYS[0], WAYS[2], WAYS[4], several=True),
    indirect=["compiles"],
)
def test_an_archive_is_that_of_all_points_together(monkeypatch, compiles, n_obj, levels, slow_from, pairs):
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
def test_every_step_is_that_of_moocore(monkeypatch, compiles, n_obj):
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


def test_a_chronicle_knows_what_an_archive_held_at_any_time():
    archive, chronicle, held = Archive(2, 3, 2), Chronicle(3), [np.empty((0, 3))]
    for part in populations(3, levels=10**6, seed=3):
        change = archive.add(*part)
        if change is not None:
            chronicle.change(*change)
            held.append(archive.F)
    assert chronicle.time == len(held) - 1 > 10
    for time, F in enumerate(held):
        np.testing.assert_array_equal(chronicle.at(time), F)


@pytest.fixture
def watched(monkeypatch):
    """A watch, a function that closes a generation of points, and how many were measured so far, each time."""
    measured = []
    monkeypatch.setattr(volumes, "hypervolume", lambda F, corner: measured.append(len(F)) or float(F[:, 0].min()))
    watch = Books(small_problem())
    sizes = watch.problem.n_var, watch.problem.n_obj, watch.problem.n_ieq_constr

    def close(F=None):
        if F is not None:
            watch.collect(np.zeros((len(F), sizes[0])), {"F": F, "G": np.full((len(F), sizes[2]), -1.0)})
        return watch.close(len(watch.evaluations) + 1, 0)

    return watch, close, measured


def test_hypervolumes_are_measured_when_they_are_looked_at_and_once(watched):
    watch, close, measured = watched
    F = np.random.default_rng(0).random((8, watch.problem.n_obj))
    least = F[:, 0].min()
    shown = [close(), close(F), close(F + 1.0), close(F - 0.5), close(F - 0.7)]
    history = watch.history()
    assert measured == []
    assert history.hypervolume[3] == least - 0.5
    assert len(measured) == 1
    assert [float(generation.hypervolume) for generation in shown] == list(history.hypervolume)
    np.testing.assert_allclose(history.hypervolume, [0.0, least, least, least - 0.5, least - 0.7], rtol=1e-15)
    assert len(measured) == 3
    assert watch.measured() == list(watch.history().hypervolume)
    assert f"{least - 0.7:.6f}" in str(shown[-1])
    assert len(measured) == 3


def test_a_checkpoint_measures_what_waited(watched):
    watch, close, measured = watched
    F = np.random.default_rng(0).random((8, watch.problem.n_obj))
    close(F)
    close(F - 0.5)
    books = watch.arrays()
    assert len(measured) == 2
    again = Books(small_problem())
    again.reopen(books)
    assert again.hypervolume == watch.measured()


def test_hypervolumes_are_a_sequence_of_numbers():
    corner = np.array([1.0, 1.0])
    waiting = [Volume(lambda share=share: np.array([[share, share]]), corner) for share in (0.5, 0.25)]
    found, expected = Volumes([0.0, *waiting]), (0.0, 0.25, 0.5625)
    assert found == expected
    assert expected == found == Volumes(expected)
    assert found != expected[:2]
    assert (len(found), found[-1], found[1:], list(found)) == (3, 0.5625, expected[1:], list(expected))
    assert found.followed_by(1.0) == (*expected, 1.0)
    assert hash(found) == hash(Volumes(expected))
    assert pickle.loads(pickle.dumps(found)) == found
    assert repr(found) == repr(expected)


def test_hypervolumes_go_into_a_file_and_come_back_equal():
    others = {"evaluations": (1, 2), "least_violation": (None, 0.0), "front_size": (0, 3)}
    history = History(reference_point=(1.0,), hypervolume=(0.0, 0.5), **others)
    assert History.model_validate_json(history.model_dump_json()) == history
    assert '"hypervolume":[0.0,0.5]' in history.model_dump_json()
    for wrong in ((0.0, np.nan), (0.0, "much"), 1.0):
        with pytest.raises(pydantic.ValidationError, match="hypervolume"):
            History(reference_point=(1.0,), hypervolume=wrong, **others)


def test_a_growing_and_shrinking_archive_keeps_its_rows_together():
    """Through many compactions: every decision vector and constraint tells the objectives that it belongs to."""
    rng, archive = np.random.default_rng(5), Archive(3, 2, 4)
    for radius in np.linspace(2.0, 0.5, 150):
        angle = rng.uniform(0.0, 0.5 * np.pi, 40)
        F = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1) + rng.uniform(0.0, 0.3, (40, 1))
        archive.add(np.stack([*F.T, F.sum(axis=1)], axis=1), F, -np.tile(F, 2))
        np.testing.assert_array_equal(archive.X[:, :2], archive.F)
        np.testing.assert_array_equal(archive.G, -np.tile(archive.F, 2))
    X, F, G = archive.ordered()
    np.testing.assert_array_equal(F, archive.F[np.lexsort(archive.F.T[::-1])])
    np.testing.assert_array_equal(X[:, :2], F)
    np.testing.assert_array_equal(G, -np.tile(F, 2))
    last = archive.ordered(last=True)
    assert not any(values.flags.writeable for values in (X, F, G, *last))
    for handed, copied in zip(last, (X, F, G), strict=True):
        np.testing.assert_array_equal(handed, copied)
    assert not len(archive.F)
    assert [values.shape for values in archive.ordered()] == [(0, 3), (0, 2), (0, 4)]
