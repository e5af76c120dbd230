"""Work on several threads of one process: how many may be used, and the same function for every part of it."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

Result = TypeVar("Result")

#: Not empty in a process that was forked.
_forked: list[bool] = []
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=lambda: _forked.append(True))

_this_thread = threading.local()


def usable_threads(wanted: int) -> int:
    """Threads that may be used here: one within a thread of :func:`in_threads`, whose neighbours have the other cores.

    One in a forked process too, where GNU's OpenMP hangs once its parent used several.
    """
    return 1 if _forked or getattr(_this_thread, "is_one_of_many", False) else wanted


def in_threads(function: Callable[..., Result], parts: Iterable[tuple[Any, ...]], threads: int) -> list[Result]:
    """Results of a function for the arguments of every part, in their order.

    Args:
        function: what lets go of the interpreter while it works, as numpy and compiled loops do.
        parts: arguments.
        threads: how many to use at most.
    """
    listed = list(parts)
    workers = min(usable_threads(threads), len(listed))
    if workers <= 1:
        return [function(*part) for part in listed]
    with ThreadPoolExecutor(workers, initializer=_begin) as pool:
        return list(pool.map(lambda part: function(*part), listed))


def _begin() -> None:
    _this_thread.is_one_of_many = True
