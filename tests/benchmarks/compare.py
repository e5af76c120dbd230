"""Comparison of two actions by CPU time, for the benchmarks of this folder."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable


def cpu(action: Callable[[], object]) -> float:
    """CPU time of one call [s]."""
    began = time.process_time()
    action()
    return time.process_time() - began


def compare(title: str, ours: Callable[[], object], theirs: Callable[[], object], rounds: int) -> tuple[float, float]:
    """Medians of CPU time of both, taken in turn after one round that is not counted."""
    pairs = [(cpu(ours), cpu(theirs)) for _ in range(rounds + 1)][1:]
    mine, other = (statistics.median(column) for column in zip(*pairs, strict=True))
    print(f"{title}: ours {1e3 * mine:.2f} ms, theirs {1e3 * other:.2f} ms (medians of {rounds}, CPU)")
    return mine, other
