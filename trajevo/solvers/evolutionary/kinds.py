"""Classes of algorithms by name, each imported when it is asked for: most runs need one, a list of names none."""

from __future__ import annotations

import importlib
from contextlib import suppress
from functools import cache

from pymoo.core.algorithm import Algorithm

from trajevo.errors import InvalidInputError

#: Modules of the algorithms that a run folder can store, by the names of their classes.
KINDS = {
    "NSGA2": "pymoo.algorithms.moo.nsga2",
    "ArrayNSGA2": "trajevo.solvers.evolutionary.nsga2",
    "SMSEMOA": "pymoo.algorithms.moo.sms",
    "SPEA2": "pymoo.algorithms.moo.spea2",
    "RVEA": "pymoo.algorithms.moo.rvea",
    "NSGA3": "pymoo.algorithms.moo.nsga3",
    "UNSGA3": "pymoo.algorithms.moo.unsga3",
    "ConstrainedMOEAD": "trajevo.solvers.evolutionary.moead",
    "AGEMOEA2": "pymoo.algorithms.moo.age2",
}


def class_of(name: str) -> type[Algorithm]:
    """The class of an algorithm.

    Args:
        name: a key of :data:`KINDS`.

    Raises:
        InvalidInputError: AGE-MOEA-II, which needs numba, and numba is not installed.
    """
    if name == "AGEMOEA2":
        try:
            import numba  # noqa: F401 - pymoo raises a bare Exception without it
        except ImportError as error:
            raise InvalidInputError("algorithm: 'age-moea2' needs numba: pip install 'trajevo[fast]'") from error
        _keep_compiled()
    found: type[Algorithm] = getattr(importlib.import_module(KINDS[name]), name)
    return found


@cache
def _keep_compiled() -> None:
    """Let numba keep pymoo's loops for later processes, each of which would take 5 s of CPU time to compile them."""
    from numba.core.dispatcher import Dispatcher  # imported where it is there

    for name in ("age", "age2"):
        module = importlib.import_module(f"pymoo.algorithms.moo.{name}")
        classes = [found for found in vars(module).values() if isinstance(found, type)]
        for place in (module, *(found for found in classes if found.__module__ == module.__name__)):
            for found in vars(place).values():
                loop = getattr(found, "__func__", found)
                if isinstance(loop, Dispatcher):
                    with suppress(RuntimeError):  # no folder can be written to
                        loop.enable_caching()
