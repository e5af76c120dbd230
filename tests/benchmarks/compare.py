"""CPU time of actions taken in turn, for the benchmarks of this folder."""

from __future__ import annotations

import math
import resource
import statistics
import time
from collections.abc import Callable, Sequence

import numpy as np

from trajevo.base.arrays import Array

Action = Callable[[], object]

#: What is called again and again until it has taken this long [s], so that clocks can tell it.
_LEAST = 0.005
#: What takes longer than this [s] is not called once before it counts.
_LONG = 1.0


def cpu(action: Action) -> float:
    """CPU time of one call, that of processes it waits for included [s]."""
    began = _spent()
    action()
    return _spent() - began


def _spent() -> float:
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def in_turn(ways: Sequence[Action], rounds: int) -> Array:
    """CPU time per call of every way in every round, shape (rounds, ways) [s].

    One round after the other, so that what else the machine does meets all of them.
    """
    first = [cpu(way) for way in ways]
    calls = [1 if spent > _LEAST else math.ceil(_LEAST / max(spent, 1e-6)) for spent in first]
    found = np.empty((rounds, len(ways)))
    for turn in range(rounds):
        for k, way in enumerate(ways):
            counts_already = turn == 0 and first[k] > _LONG
            found[turn, k] = first[k] if counts_already else cpu(_repeated(way, calls[k])) / calls[k]
    return found


def _repeated(action: Action, calls: int) -> Action:
    def repeated() -> None:
        for _ in range(calls):
            action()

    return action if calls == 1 else repeated


def compare(title: str, ours: Action, theirs: Action, rounds: int) -> tuple[float, float]:
    """Medians of CPU time of both, taken in turn after one round that is not counted."""
    pairs = [(cpu(ours), cpu(theirs)) for _ in range(rounds + 1)][1:]
    mine, other = (statistics.median(column) for column in zip(*pairs, strict=True))
    print(f"{title}: ours {1e3 * mine:.2f} ms, theirs {1e3 * other:.2f} ms (medians of {rounds}, CPU)")
    return mine, other
