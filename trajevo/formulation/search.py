"""What a search is, as one record: the same in Python, in task.toml, in study.toml and on the command line."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, Any, final

import numpy as np
import pydantic
from pymoo.core.algorithm import Algorithm

from trajevo.errors import InvalidInputError, UnknownNameError, checked_name

#: Name -> what the individuals of a first population are.
STARTS = {
    "random": "uniform between the bounds",
    "sobol": "a Sobol sequence, times in their logarithms",
    "latin_hypercube": "a Latin hypercube, times in their logarithms",
    "stretched": "those beyond a limit in the least time in which they keep it",
    "fastest": "all in the least time that the limits allow",
    "spread": "all in the least time that the limits allow, then slowed down by all factors that the bounds allow",
}

#: What a run begins with unless told otherwise: docs/algorithms.md.
DEFAULT_STARTS = "spread"


def _whole(least: int) -> pydantic.PlainValidator:
    """A whole number of at least so many, or None."""

    def check(value: Any) -> int | None:
        if value is None:
            return None
        if not isinstance(value, int | np.integer) or isinstance(value, bool) or value < least:
            raise ValueError(f"expected a whole number of at least {least}, got {value!r}")
        return int(value)

    return pydantic.PlainValidator(check)


def _between(least: float, most: float) -> pydantic.PlainValidator:
    """A number of a range, or None."""

    def check(value: Any) -> float | None:
        if value is None:
            return None
        if isinstance(value, bool) or not (isinstance(value, int | float | np.number) and least <= value <= most):
            raise ValueError(f"expected a number from {least:g} to {most:g}, got {value!r}")
        return float(value)

    return pydantic.PlainValidator(check)


def _seconds(value: Any) -> float | None:
    """A positive time [s], or None."""
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 < value < math.inf:
        raise ValueError(f"expected a positive time [s], got {value!r}")
    return float(value)


def _yes_or_no(value: Any) -> bool | None:
    if value is not None and not isinstance(value, bool):
        raise ValueError(f"expected True, False or None, got {value!r}")
    return value


def _starts(value: Any) -> str | None:
    try:
        return None if value is None else checked_name("starts", value, STARTS)
    except UnknownNameError as error:
        raise ValueError(str(error)) from error


def _algorithm(value: Any) -> str | Algorithm:
    if isinstance(value, str):
        return value
    if not isinstance(value, Algorithm) or value.is_initialized or value.problem is not None:
        raise ValueError(f"expected a name or a pymoo algorithm that has not run yet, got {value!r}")
    return value


def _setting(says: str, *, of_algorithm: bool = False, **more: Any) -> Any:
    """A setting that is the problem's where it is None: what it is, and whether it belongs to the algorithm."""
    return pydantic.Field(default=None, description=says, json_schema_extra={"of_algorithm": of_algorithm}, **more)


@final
class Search(pydantic.BaseModel):
    """How a front is searched for. What is None is as the problem's paper has it, or as usual.

    A new setting is declared here alone: :func:`trajevo.optimise` and :class:`trajevo.Task` take it by name, tasks as
    a key of ``[algorithm]``, studies as a key or a factor, the command line as an option.

    Attributes:
        seed: of all randomness; the same seed gives the same front.
        algorithm: name of an algorithm (:data:`trajevo.solvers.evolutionary.algorithms.ALGORITHMS`), or a pymoo
            algorithm that has not run yet, which is copied. In a task its key is ``name``.
        generations: generations, the first population counted as the first.
        population: individuals.
        offsprings: new individuals per generation; as many as the population if None.
        crossover_probability: of simulated binary crossover, per pair of parents.
        crossover_index: distribution index of the crossover.
        mutation_probability: of polynomial mutation, per variable, as Deb defined it.
        mutation_index: distribution index of the mutation.
        starts: what the first population is, a key of :data:`STARTS`; ``"spread"`` if None, and of a pymoo algorithm
            that is passed its own.
        evaluations: individuals that the run may evaluate, a gradient counted as one for each variable. The evolution
            ends after the generation that reaches their number, or half of it where the front is polished.
        cpu_time: CPU time of this process that the run may take [s]. The evolution ends after the generation that
            passes it, or half of it where the front is polished, and not before the first; how far it gets depends on
            the machine.
        time_limit: time that evaluating one individual may take [s]; one that takes longer counts as failed. The
            evaluation then goes on in a process of its own.
        polish: refine the front by gradients at the end, see :func:`trajevo.polish`; where that is possible if None. A
            run that was interrupted or found nothing is left as it is.
        polish_every: generations after which a few members are refined each time, and put among the individuals of the
            next generation.

    Raises:
        ValidationError: a value that cannot be used; :meth:`of` and :meth:`updated` say so in one sentence.
    """

    model_config = pydantic.ConfigDict(extra="forbid", frozen=True, arbitrary_types_allowed=True)

    seed: Annotated[int | None, _whole(0)] = _setting("Seed of all randomness.")
    algorithm: Annotated[str | Algorithm, pydantic.PlainValidator(_algorithm)] = pydantic.Field(
        default="nsga2",
        description="Algorithm by name, nsga2 if not given.",
        validation_alias=pydantic.AliasChoices("algorithm", "name"),
        json_schema_extra={"of_algorithm": False},
    )
    generations: Annotated[int | None, _whole(1)] = _setting("Generations; the paper's if not given.")
    population: Annotated[int | None, _whole(4)] = _setting("Individuals; the paper's if not given.", of_algorithm=True)
    offsprings: Annotated[int | None, _whole(1)] = _setting(
        "New individuals per generation; as many as the population.", of_algorithm=True
    )
    crossover_probability: Annotated[float | None, _between(0.0, 1.0)] = _setting(
        "Probability of crossover, per pair of parents.", of_algorithm=True
    )
    # Wider indices are refused by pymoo.
    crossover_index: Annotated[float | None, _between(1.0, 100.0)] = _setting(
        "Distribution index of crossover.", of_algorithm=True
    )
    mutation_probability: Annotated[float | None, _between(0.0, 1.0)] = _setting(
        "Probability of mutation, per variable.", of_algorithm=True
    )
    mutation_index: Annotated[float | None, _between(1.0, 100.0)] = _setting(
        "Distribution index of mutation.", of_algorithm=True
    )
    starts: Annotated[str | None, pydantic.PlainValidator(_starts)] = _setting(
        f"The first population: {', '.join(STARTS)}; {DEFAULT_STARTS} if not given."
    )
    evaluations: Annotated[int | None, _whole(1)] = _setting(
        "Individuals that the run may evaluate, half of them for polishing."
    )
    cpu_time: Annotated[float | None, pydantic.PlainValidator(_seconds)] = _setting(
        "CPU time that the run may take, half of it for polishing [s]."
    )
    time_limit: Annotated[float | None, pydantic.PlainValidator(_seconds)] = _setting(
        "Time that evaluating one individual may take [s]; longer counts as failed."
    )
    polish: Annotated[bool | None, pydantic.PlainValidator(_yes_or_no)] = _setting(
        "Refine the front by gradients at the end; where possible if not said."
    )
    polish_every: Annotated[int | None, _whole(1)] = _setting(
        "Refine some members after every so many generations too."
    )

    @classmethod
    def of(cls, **settings: Any) -> Search:
        """A search of settings by name.

        Raises:
            UnknownNameError: no such setting.
            InvalidInputError: a value that cannot be used; the message begins with the setting's name.
        """
        for name in settings:
            if name not in cls.model_fields:
                raise UnknownNameError("setting of a search", name, list(cls.model_fields))
        try:
            return cls.model_validate(settings)
        except pydantic.ValidationError as error:
            first = error.errors()[0]
            raise InvalidInputError(f"{first['loc'][0]}: {first['msg'].removeprefix('Value error, ')}") from error

    def updated(self, **settings: Any) -> Search:
        """This search with other settings where they are given; None leaves a setting as it is.

        Raises:
            UnknownNameError: as for :meth:`of`.
            InvalidInputError: as for :meth:`of`.
        """
        return Search.of(**self.given | {name: value for name, value in settings.items() if value is not None})

    @property
    def given(self) -> dict[str, Any]:
        """Settings that are not left to the problem, by name."""
        return {name: getattr(self, name) for name in Search.model_fields if getattr(self, name) is not None}

    @property
    def of_algorithm(self) -> dict[str, Any]:
        """What is given of sizes and operators, by name."""
        return {name: value for name, value in self.given.items() if name in OF_ALGORITHM}


def _names(keep: Callable[[Any], bool]) -> tuple[str, ...]:
    return tuple(name for name, field in Search.model_fields.items() if keep(field.json_schema_extra))


#: Settings that belong to the algorithm: sizes and operators.
OF_ALGORITHM = _names(lambda extra: bool(extra["of_algorithm"]))

#: Settings of NSGA-II where nothing else is known: Table 3 of Sun 2020 and, where it is silent, pymoo's.
USUAL = Search(
    population=150,
    generations=200,
    crossover_probability=0.85,
    crossover_index=15.0,
    mutation_probability=0.15,
    mutation_index=20.0,
)
