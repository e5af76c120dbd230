"""Threads of one process: how many may be used, and one function called for many parts in parallel."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from typing import Any, TypeVar

Result = TypeVar("Result")

#: Not empty in a forked process.
_forked: list[bool] = []
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=lambda: _forked.append(True))

_this_thread = threading.local()


def usable_threads(wanted: int) -> int:
    """How many of the wanted threads may be used here: all of them, or only one in two cases.

    Only one inside a thread of :func:`in_threads`, since its other threads use the other cores. Only one in a forked
    process, where GNU OpenMP hangs if the parent process has used several.
    """
    return 1 if _forked or getattr(_this_thread, "is_one_of_many", False) else wanted


def in_threads(function: Callable[..., Result], parts: Iterable[tuple[Any, ...]], threads: int) -> list[Result]:
    """Results of a function for every part, in the order of the parts.

    Args:
        function: should release Python's interpreter lock while it works, as numpy and compiled loops do.
        parts: the arguments of each call.
        threads: greatest number of threads to use.
    """
    listed = list(parts)
    workers = min(usable_threads(threads), len(listed))
    if workers <= 1:
        return [function(*part) for part in listed]
    # Each part in a context of its own, with what is set in this one: the kind of kernel of a run, for example.
    contexts = [copy_context() for _ in listed]
    with ThreadPoolExecutor(workers, initializer=_begin) as pool:
        return list(pool.map(lambda context, part: context.run(function, *part), contexts, listed))


def _begin() -> None:
    _this_thread.is_one_of_many = True
