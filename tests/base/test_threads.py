"""Work on several threads: results in order, one level of threads, errors told; populations to the bit."""

import threading

import numpy as np
import pytest

from trajevo.base.threads import in_threads, usable_threads
from trajevo.problems import HybridManipulator


@pytest.mark.parametrize("threads", [1, 2, 5])
@pytest.mark.parametrize("count", [0, 1, 7])
def test_results_come_in_the_order_of_their_parts(threads, count):
    assert in_threads(lambda a, b: a - b, [(i, 2 * i) for i in range(count)], threads) == [-i for i in range(count)]


def test_threads_within_threads_are_one_thread():
    inside = in_threads(lambda i: (usable_threads(4), threading.current_thread().name), [(i,) for i in range(8)], 2)
    assert {usable for usable, _ in inside} == {1}
    assert len({name for _, name in inside}) <= 2
    assert usable_threads(4) == 4


def test_what_one_part_raises_is_raised():
    with pytest.raises(ZeroDivisionError):
        in_threads(lambda x: 1 / x, [(1,), (0,), (2,)], 2)


def test_a_population_of_several_chunks_is_the_same_on_any_number_of_threads():
    one, three = HybridManipulator(), HybridManipulator(threads=3)
    x = np.random.default_rng(0).uniform(one.xl, one.xu, (1000, one.n_var))
    for first, other in zip(one.evaluate(x), three.evaluate(x), strict=True):
        np.testing.assert_array_equal(first, other)
    broken = x[:300].copy()  # each of them is then evaluated alone
    broken[[3, 200], 2] = np.nan
    alone, together = (problem.evaluate(broken, return_values_of=["F"]) for problem in (one, three))
    np.testing.assert_array_equal(alone, together)
    assert np.flatnonzero(~np.isfinite(together).all(axis=1)).tolist() == [3, 200]
