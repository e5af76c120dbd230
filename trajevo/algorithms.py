"""Algorithms by name, for the command line and for tasks."""

from __future__ import annotations

from typing import Any

from pymoo.algorithms.moo.sms import SMSEMOA
from pymoo.algorithms.moo.spea2 import SPEA2
from pymoo.core.algorithm import Algorithm

from trajevo.errors import InvalidInputError, checked_name

#: Algorithms besides NSGA-II that need nothing but a population size.
ALGORITHMS = {"sms-emoa": SMSEMOA, "spea2": SPEA2}


def algorithm_settings(name: str, own: dict[str, Any], usual: int) -> dict[str, Any]:
    """Keyword arguments of :func:`trajevo.optimise.optimise` for an algorithm by name.

    Args:
        name: ``"nsga2"`` or a key of :data:`ALGORITHMS`.
        own: settings of NSGA-II by name; of the others population and offsprings alone.
        usual: population where none is given.

    Raises:
        UnknownNameError: no such algorithm.
        InvalidInputError: a setting that the algorithm does not have.
    """
    if name == "nsga2":
        return own
    checked_name("algorithm", name, ["nsga2", *ALGORITHMS])
    size = own.get("population") or usual
    for key, value in own.items():
        if value is not None and key not in ("population", "offsprings"):
            raise InvalidInputError(f"{key}: the algorithm {name!r} has no such setting")
    solver: Algorithm = ALGORITHMS[name](pop_size=size, n_offsprings=own.get("offsprings") or size)
    return {"algorithm": solver}
