"""Algorithms of pymoo as plain data: how they were set up, and their full state between two generations.

A run folder never holds pickled objects. To continue, an algorithm needs its population, the data that operators have
attached to the individuals, its random generator and its counters. Some algorithms also need values that their survival
adapts from generation to generation; a small adapter per algorithm names these values.
"""

from __future__ import annotations

import copy
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import FunctionType
from typing import Any

import numpy as np
from pymoo.core.algorithm import Algorithm
from pymoo.core.population import Population
from pymoo.operators.crossover.sbx import SBX
from pymoo.operators.mutation.pm import PM

from trajevo.base.arrays import Array
from trajevo.base.plain import from_json
from trajevo.errors import InvalidInputError
from trajevo.formulation.search import MOST_INDIVIDUALS
from trajevo.solvers.evolutionary.choices import ChoiceCrossover, ChoiceMutation
from trajevo.solvers.evolutionary.kinds import KINDS, class_of

#: Attributes that only show the progress of an algorithm and do not affect its result.
_SHOWN = frozenset({"output", "display"})

#: Kinds of numpy's types of the data that operators attach to individuals and read again.
_KINDS_OF_NOTES = {"rank": "i", "crowding": "f", "n_gen": "i", "n_iter": "i"}

_OPERATORS: dict[str, tuple[type, tuple[str, ...]]] = {
    "SBX": (SBX, ("prob", "eta", "prob_var", "prob_exch", "prob_bin")),
    "PM": (PM, ("prob", "eta", "prob_var", "at_least_once")),
    "ChoiceCrossover": (ChoiceCrossover, ("prob", "eta")),
    "ChoiceMutation": (ChoiceMutation, ("prob", "eta", "prob_var", "order", "posture")),
}
_NORMALISATION = ("ideal_point", "worst_point", "nadir_point", "extreme_points")


@dataclass(frozen=True)
class _Adapter:
    """What one algorithm has besides a population, and where it is stored.

    ``arguments``: further arguments of its class, stored in attributes of the same name. ``survival``: arguments that
    are stored in its survival. ``learnt``: attributes (arrays or None) of the object that ``keeper`` returns, which
    change from generation to generation.
    """

    arguments: tuple[str, ...] = ()
    survival: tuple[str, ...] = ()
    learnt: tuple[str, ...] = ()
    keeper: Callable[[Algorithm], Any] = lambda algorithm: algorithm.survival


def _spea2_normalisation(algorithm: Algorithm) -> Any:
    """The normalisation of SPEA2, which creates it with the first population; an unused one is equivalent."""
    if algorithm.survival.norm is None:
        from pymoo.algorithms.moo.nsga3 import HyperplaneNormalization  # which SPEA2 has imported

        algorithm.survival.norm = HyperplaneNormalization(algorithm.problem.n_obj)
    return algorithm.survival.norm


def _survival_normalisation(algorithm: Algorithm) -> Any:
    return algorithm.survival.norm


_OF_NSGA3 = _Adapter(arguments=("ref_dirs",), learnt=_NORMALISATION, keeper=_survival_normalisation)

#: Adapters by the name of the class, for all algorithms of :data:`~trajevo.solvers.evolutionary.kinds.KINDS`.
_ADAPTERS = dict.fromkeys(KINDS, _Adapter()) | {
    "SMSEMOA": _Adapter(arguments=("normalize",)),
    "SPEA2": _Adapter(learnt=_NORMALISATION, keeper=_spea2_normalisation),
    "RVEA": _Adapter(
        arguments=("ref_dirs", "adapt_freq"), survival=("alpha",), learnt=("ideal", "nadir", "V", "gamma")
    ),
    "NSGA3": _OF_NSGA3,
    "UNSGA3": _OF_NSGA3,
    "ConstrainedMOEAD": _Adapter(arguments=("ref_dirs",), learnt=("ideal",), keeper=lambda algorithm: algorithm),
}


def _adapter_of(algorithm: Algorithm) -> _Adapter:
    found = _ADAPTERS.get(type(algorithm).__name__)
    if found is None:
        raise InvalidInputError(f"{type(algorithm).__name__} has no adapter")
    return found


def _known() -> str:
    return ", ".join(sorted(_ADAPTERS))


def specification(algorithm: Algorithm) -> dict[str, Any]:
    """How an algorithm that has not run yet was set up, as plain data for :func:`algorithm_of`.

    Raises:
        InvalidInputError: the algorithm has no adapter, or a setting that its adapter does not know; the message says
            which.
    """
    name = type(algorithm).__name__
    adapter = _ADAPTERS.get(name)
    if adapter is None or type(algorithm) is not class_of(name):
        raise InvalidInputError(f"{name} has no adapter; those with one are {_known()}")
    found: dict[str, Any] = {
        "name": name,
        "pop_size": _plain(algorithm.pop_size),
        "n_offsprings": _plain(algorithm.n_offsprings),
        "crossover": _operator(algorithm.mating.crossover),
        "mutation": _operator(algorithm.mating.mutation),
    }
    for argument in adapter.arguments:
        found[argument] = _plain(getattr(algorithm, argument))
    for argument in adapter.survival:
        found[argument] = _plain(getattr(algorithm.survival, argument))
    sampling = algorithm.initialization.sampling
    if isinstance(sampling, np.ndarray):
        found["sampling"] = sampling.tolist()
    other = _difference(algorithm, algorithm_of(found), type(algorithm).__name__)
    if other:
        raise InvalidInputError(f"{other} is set to something that a run folder cannot store")
    return found


def algorithm_of(found: Mapping[str, Any]) -> Algorithm:
    """Make an algorithm that has not run yet from the data of :func:`specification`.

    Raises:
        InvalidInputError: no such algorithm or operator, or arguments that it refuses.
    """
    arguments = dict(found)
    name = str(arguments.pop("name", ""))
    if name not in _ADAPTERS:
        raise InvalidInputError(f"algorithm: expected one of {_known()}, got {found.get('name')!r}")
    for role in ("ref_dirs", "sampling"):
        if arguments.get(role) is not None:
            arguments[role] = np.array(arguments[role], dtype=np.float64)
    for size in ("pop_size", "n_offsprings"):
        value = arguments.get(size)
        if value is not None and not (isinstance(value, int) and 1 <= value <= MOST_INDIVIDUALS):
            raise InvalidInputError(
                f"algorithm: {size}: expected a whole number up to {MOST_INDIVIDUALS}, got {value!r}"
            )
    try:
        for role in ("crossover", "mutation"):
            settings = dict(arguments[role])
            kind, _ = _OPERATORS[settings.pop("name")]
            arguments[role] = kind(**settings)
        # A copy, since all algorithms of a class share pymoo's default objects, and SPEA2's survival changes.
        return copy.deepcopy(class_of(name)(**arguments))
    except (KeyError, TypeError, ValueError) as error:
        raise InvalidInputError(f"algorithm: cannot be made from {sorted(found)}: {error!r}") from error


def state(algorithm: Algorithm) -> dict[str, Array]:
    """Everything that an algorithm needs to continue after a generation, as named arrays without objects.

    The termination is not included: it counts generations and is set up again with their number.
    """
    adapter = _adapter_of(algorithm)
    keeper = adapter.keeper(algorithm)
    learnt = {name: getattr(keeper, name) for name in adapter.learnt}
    counters = {
        "iteration": int(algorithm.n_iter),
        "evaluations": int(algorithm.evaluator.n_eval),
        "ended": bool(algorithm.termination.force_termination),
        "generator": algorithm.random_state.bit_generator.state,
    }
    return {
        "counters": np.array(json.dumps(counters)),
        **{f"learnt.{name}": np.array(value) for name, value in learnt.items() if value is not None},
        **_population_arrays(algorithm.pop),
    }


def restore(algorithm: Algorithm, arrays: Mapping[str, Array]) -> None:
    """Restore the state from :func:`state` in an algorithm that was set up but has not run.

    Raises:
        KeyError, TypeError, ValueError: the arrays are not such a state.
    """
    adapter = _adapter_of(algorithm)
    counters = from_json(str(arrays["counters"]))
    algorithm.pop = _population(arrays, algorithm.problem)
    algorithm.n_iter = int(counters["iteration"])
    algorithm.evaluator.n_eval = int(counters["evaluations"])
    algorithm.termination.force_termination = bool(counters["ended"])
    # As after the last generation, when the iteration has already been incremented.
    done = (algorithm.n_iter - 1) / algorithm.termination.n_max_gen
    algorithm.termination.perc = 1.0 if counters["ended"] else done
    algorithm.random_state.bit_generator.state = counters["generator"]
    algorithm.is_initialized = True
    # Used only by pymoo's result(), to tell the run time.
    algorithm.start_time = 0.0
    keeper = adapter.keeper(algorithm)
    for name in adapter.learnt:
        given = arrays.get(f"learnt.{name}")
        setattr(keeper, name, None if given is None else np.array(given, dtype=np.float64))


def _population_arrays(population: Population) -> dict[str, Array]:
    """X, F, G, and for all data that operators have attached: values, and a mask of the individuals that have them."""
    arrays = {name: np.array([getattr(one, name) for one in population], dtype=np.float64) for name in "XFG"}
    for key in sorted({key for one in population for key in one.data}):
        values = [one.data.get(key) for one in population]
        has = np.array([value is not None for value in values])
        filler = next(value for value in [*values, ""] if value is not None)
        arrays[f"note.{key}"] = np.array([type(filler)() if value is None else value for value in values])
        arrays[f"has.{key}"] = has
    return arrays


def _population(arrays: Mapping[str, Array], problem: Any) -> Population:
    rows = len(arrays["X"])
    widths = {"X": problem.n_var, "F": problem.n_obj, "G": problem.n_ieq_constr}
    for name, width in widths.items():
        if arrays[name].shape != (rows, width):
            raise ValueError(f"expected {name} of shape ({rows}, {width}), got {arrays[name].shape}")
    population = Population.new(**{name: np.array(arrays[name], dtype=np.float64) for name in widths})
    for one in population:
        one.evaluated.update("FGH")
    for key in (name.removeprefix("note.") for name in arrays if name.startswith("note.")):
        if arrays[f"note.{key}"].dtype.kind != _KINDS_OF_NOTES.get(key, arrays[f"note.{key}"].dtype.kind):
            raise ValueError(f"expected numbers as note.{key}, got {arrays[f'note.{key}'].dtype}")
        for one, value, has in zip(population, arrays[f"note.{key}"], arrays[f"has.{key}"], strict=True):
            if has:
                one.data[key] = value.item() if value.dtype.kind in "biU" else value
    return population


def _operator(operator: Any) -> dict[str, Any]:
    for name, (kind, arguments) in _OPERATORS.items():
        if type(operator) is kind:
            return {"name": name} | {argument: _plain(getattr(operator, argument)) for argument in arguments}
    raise InvalidInputError(f"{type(operator).__name__} is an operator that a run folder cannot store")


def _plain(value: Any) -> Any:
    """A value as a number, bool, list of numbers or None; pymoo wraps the numbers of its operators in objects."""
    value = getattr(value, "value", value)
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value


def _difference(one: Any, other: Any, where: str) -> str:
    """Name of the first attribute in which two objects differ, apart from display; empty if there is none."""
    numbers = (int, float, np.integer, np.floating)
    if isinstance(one, numbers) and isinstance(other, numbers):
        return "" if one == other else where
    if type(one) is not type(other):
        return where
    if isinstance(one, np.ndarray):
        return "" if np.array_equal(one, other) else where
    if isinstance(one, list | tuple):
        pairs = [(str(i), *pair) for i, pair in enumerate(zip(one, other, strict=False))]
        return where if len(one) != len(other) else _first_difference(pairs, where)
    if isinstance(one, dict):
        return where if one.keys() != other.keys() else _first_difference([(k, one[k], other[k]) for k in one], where)
    if isinstance(one, FunctionType | type) or not hasattr(one, "__dict__"):
        return "" if one is other or one == other else where
    return _difference(vars(one), vars(other), where)


def _first_difference(entries: list[tuple[Any, Any, Any]], where: str) -> str:
    for key, one, other in entries:
        found = "" if key in _SHOWN else _difference(one, other, f"{where}.{key}")
        if found:
            return found
    return ""
