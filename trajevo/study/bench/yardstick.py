"""A yardstick of the machine: the CPU time of fixed work in which this project has no part.

CPU times of two machines, or of one under other loads, are compared in units of it.
"""

from __future__ import annotations

import time

import numpy as np

#: How often the work is done. The mean counts: what else a machine does takes its share of long runs too.
_TIMES = 10

#: Rounds of the work, some 10 ms on a machine of 2024.
_ROUNDS = 600


def yardstick() -> float:
    """CPU time of the work [s]: Python's own objects, small arrays and a larger one, as searches use them."""
    return sum(_once() for _ in range(_TIMES)) / _TIMES


def _once() -> float:
    began = time.process_time()
    values = np.linspace(0.0, 1.0, 6)
    table = np.linspace(-1.0, 1.0, 24_000).reshape(60, 400)
    for number in range(_ROUNDS):
        found = {str(k): (k, number) for k in range(60)}
        sorted(found.values(), reverse=True)
        values = np.sqrt(values * values + 1.0) - values.sum() / 6.0
        np.sort(table[number % 60] * values[0])
    (table @ table.T).sum()
    return time.process_time() - began
