"""The yardstick: the same work every time, in CPU time, without anything of trajevo's."""

import time

import numpy as np

from trajevo.study.bench.yardstick import yardstick


def test_it_tells_cpu_time_of_the_same_work():
    began = time.process_time()
    found = [yardstick() for _ in range(3)]
    spent = time.process_time() - began
    assert all(one > 0.0 for one in found)
    assert max(found) < 3.0 * min(found)
    # Each is the mean of ten.
    np.testing.assert_allclose(spent, 10.0 * sum(found), rtol=0.05)
    before = time.process_time()
    time.sleep(0.05)
    assert time.process_time() - before < 0.04, "waiting does not count"


def test_it_is_not_measured_by_another_random_state():
    np.random.seed(1)  # noqa: NPY002 - the global state is what is looked at
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    yardstick()
    np.testing.assert_array_equal(np.random.get_state()[1], before)  # noqa: NPY002
