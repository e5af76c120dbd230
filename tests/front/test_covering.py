"""Few members that cover most, boxes, and neighbours."""

import numpy as np
import pytest

from trajevo.base import jit
from trajevo.front.covering import ReferenceBox, covering, gaps, neighbours


def test_the_first_covers_most_and_none_is_chosen_in_vain():
    F = np.array([[0.1, 0.9], [0.4, 0.4], [0.41, 0.41], [0.9, 0.1]])
    probes = ReferenceBox(np.zeros(2), np.ones(2)).probes(F, 0)
    chosen = covering(F, probes, 10)
    assert chosen.tolist()[0] == 1
    assert sorted(chosen.tolist()) == [0, 1, 3]
    assert covering(F, probes, 1).tolist() == [1]


def test_together_they_cover_what_all_do():
    F = np.random.default_rng(0).uniform(size=(200, 3))
    probes = ReferenceBox(np.zeros(3), np.ones(3)).probes(F, 1)
    chosen = F[covering(F, probes, 200)]
    covered = [(points[:, None] <= probes).all(axis=2).any(axis=0) for points in (F, chosen)]
    np.testing.assert_array_equal(*covered)
    assert len(chosen) < 60


def test_probes_repeat_with_their_seed_and_lie_where_the_front_reaches():
    F = np.array([[0.5, 0.7], [0.7, 0.5]])
    box = ReferenceBox(np.zeros(2), np.ones(2))
    np.testing.assert_array_equal(box.probes(F, 3), box.probes(F, 3))
    assert (box.probes(F, 3) != box.probes(F, 4)).any()
    assert (box.probes(F, 3) >= 0.5).all()
    outside = box.probes(F + 10.0, 3)
    assert (outside >= 10.5).all()
    assert len(covering(F + 10.0, outside, 5)) == 2


def test_hypervolumes_are_shares_of_the_box():
    half = np.array([[0.5, 0.5]])
    assert ReferenceBox(np.zeros(2), np.ones(2)).hypervolume(half) == pytest.approx(0.25)
    assert ReferenceBox(np.array([-1.0, -1.0]), np.ones(2)).hypervolume(half) == pytest.approx(1.0 / 16.0)
    own = ReferenceBox.of(np.array([[-2.0, 3.0], [-1.0, 2.0]]), None)
    assert own.low.tolist() == [-2.0, 2.0]
    np.testing.assert_allclose(own.corner, [-0.9, 3.1])


def test_neighbours_are_near_and_the_widest_gap_comes_first():
    f = np.array([[0.0], [1.0], [1.5], [5.0]])
    assert neighbours(f, 1).tolist() == [[0, 1], [1, 2], [2, 3]]
    assert gaps(f, 2).tolist() == [[2, 3], [0, 1]]
    assert neighbours(f, 10).tolist() == [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]


def test_members_that_are_the_same_are_each_other_s_neighbours():
    f = np.array([[0.0, 0.0]] * 4 + [[1.0, 2.0]])
    pairs = neighbours(f, 1)
    assert {int(i) for pair in pairs[:-1] for i in pair} <= {0, 1, 2, 3}
    assert set(pairs.ravel().tolist()) == {0, 1, 2, 3, 4}
    assert (pairs[:, 0] < pairs[:, 1]).all()
    assert neighbours(f[:1], 2).shape == (0, 2)


def test_neighbours_are_those_of_all_distances():
    f = np.random.default_rng(2).uniform(size=(300, 3))
    apart = np.abs(f[:, None] - f[None]).max(axis=2)
    np.fill_diagonal(apart, np.inf)
    nearest = np.argsort(apart, axis=1)[:, :3]
    assert {tuple(pair) for pair in neighbours(f, 3).tolist()} == {
        (min(i, int(j)), max(i, int(j))) for i in range(300) for j in nearest[i]
    }


@pytest.mark.parametrize("size", [5, 300, 2100])
def test_numpy_the_loop_and_a_tree_find_the_same_neighbours(size):
    """Beyond 2,048 members numpy leaves it to SciPy's tree, beyond 4,096 so do loops; equals come in their order."""
    f = np.random.default_rng(size).uniform(size=(size, 3))
    with jit.one_kind("compiled"):
        by_loop = neighbours(f, 4), neighbours(np.repeat(f[:3], 2, axis=0), 2)
    with jit.one_kind("numpy"):
        by_numpy = neighbours(f, 4), neighbours(np.repeat(f[:3], 2, axis=0), 2)
    for one, other in zip(by_loop, by_numpy, strict=True):
        np.testing.assert_array_equal(one, other)
