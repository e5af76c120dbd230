"""The settings of a search, declared once for Python, task.toml, study.toml and the command line."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, Any, final

import numpy as np
import pydantic
from pymoo.core.algorithm import Algorithm

from trajevo.base.shown.brief import brief
from trajevo.base.toml import problem_of
from trajevo.errors import InvalidInputError, UnknownNameError, checked_name

#: Greatest number of individuals of a population: their motions are in memory together.
MOST_INDIVIDUALS = 200_000

#: Kinds of first population: name -> what its individuals are.
STARTS = {
    "random": "uniform between the bounds",
    "sobol": "a Sobol sequence, uniform in the logarithms of times",
    "latin_hypercube": "a Latin hypercube, uniform in the logarithms of times",
    "stretched": "those that break a limit are slowed down just enough to keep it",
    "fastest": "all in the least time that the limits allow",
    "spread": "all in the least time that the limits allow, then slowed down by all factors that the bounds allow",
}

#: Kind of first population unless another is given; the choice is explained in docs/explanation/algorithms.md.
DEFAULT_STARTS = "spread"


def _whole(least: int, most: int = 2**31 - 1) -> pydantic.PlainValidator:
    """Accept whole numbers from ``least`` to ``most``, and None."""

    def check(value: Any) -> int | None:
        if value is None:
            return None
        if not isinstance(value, int | np.integer) or isinstance(value, bool) or value < least:
            raise ValueError(f"expected a whole number of at least {least}, got {value!r}")
        if value > most:
            raise ValueError(f"expected a whole number of at most {most}, got {value!r}")
        return int(value)

    return pydantic.PlainValidator(check)


def _between(least: float, most: float) -> pydantic.PlainValidator:
    """Accept numbers from ``least`` to ``most``, and None."""

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
    """Declare a setting whose default, None, stands for the problem's own value.

    Args:
        says: description, also the help text of the command line.
        of_algorithm: whether the setting belongs to the algorithm, as sizes and operators do.
        **more: further arguments of :func:`pydantic.Field`.
    """
    return pydantic.Field(default=None, description=says, json_schema_extra={"of_algorithm": of_algorithm}, **more)


@final
class Search(pydantic.BaseModel):
    """Settings of a search for a front. One that is not given has the value of the problem's paper, or the usual one.

    A new setting is declared only here: :func:`trajevo.optimise` and :class:`trajevo.Task` accept it by name, tasks as
    a key of ``[algorithm]``, studies as a key or a factor, and the command line as an option.

    Attributes:
        seed: seed of all randomness; the same seed gives the same front.
        algorithm: name of an algorithm (:data:`trajevo.solvers.evolutionary.algorithms.ALGORITHMS`), or a pymoo
            algorithm that has not run yet, of which a copy is used. In a task the key is ``name``.
        generations: number of generations, including the first population.
        population: number of individuals.
        offsprings: new individuals per generation; as many as the population if None.
        crossover_probability: probability of simulated binary crossover, per pair of parents.
        crossover_index: distribution index of the crossover.
        mutation_probability: probability of polynomial mutation, per variable, as Deb defined it.
        mutation_index: distribution index of the mutation.
        starts: kind of first population, a key of :data:`STARTS`; if None, ``"spread"``, or the sampling of a pymoo
            algorithm that is passed.
        evaluations: greatest number of evaluations; a gradient counts as one per variable. The evolution ends after
            the generation that reaches this number, or half of it if the front is polished afterwards.
        cpu_time: greatest CPU time of this process [s]. The evolution ends after the generation that exceeds it; the
            first generation is always finished. If the front is polished, the evolution begins with few generations and
            is polished for a short time again and again, and at most half of the time is kept for the whole polish. How
            far a run gets depends on the machine.
        time_limit: greatest time for the evaluation of one individual [s]; one that takes longer counts as failed.
            Populations are then evaluated in a separate process.
        polish: refine the front by gradients at the end, see :func:`trajevo.polish`; if None, wherever that is
            possible. A run that was interrupted or found nothing feasible is not polished.
        polish_every: number of generations after which a few members are refined and inserted into the next
            generation, again and again; None for never.

    Raises:
        pydantic.ValidationError: an invalid value; :meth:`of` and :meth:`updated` raise :class:`InvalidInputError`
            instead, with a message of one sentence.
    """

    model_config = pydantic.ConfigDict(extra="forbid", frozen=True, defer_build=True, arbitrary_types_allowed=True)

    __repr__ = brief

    seed: Annotated[int | None, _whole(0, 2**128 - 1)] = _setting("Seed of all randomness.")
    algorithm: Annotated[str | Algorithm, pydantic.PlainValidator(_algorithm)] = pydantic.Field(
        default="nsga2",
        description="Name of the algorithm; nsga2 if not given.",
        validation_alias=pydantic.AliasChoices("algorithm", "name"),
        json_schema_extra={"of_algorithm": False},
    )
    population: Annotated[int | None, _whole(4, MOST_INDIVIDUALS)] = _setting(
        "Number of individuals; the paper's if not given.", of_algorithm=True
    )
    generations: Annotated[int | None, _whole(1)] = _setting("Number of generations; the paper's if not given.")
    offsprings: Annotated[int | None, _whole(1, MOST_INDIVIDUALS)] = _setting(
        "New individuals per generation; as many as the population if not given.", of_algorithm=True
    )
    crossover_probability: Annotated[float | None, _between(0.0, 1.0)] = _setting(
        "Probability of crossover, per pair of parents.", of_algorithm=True
    )
    # pymoo refuses indices outside this range.
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
        f"Kind of first population: {', '.join(STARTS)}; {DEFAULT_STARTS} if not given."
    )
    evaluations: Annotated[int | None, _whole(1)] = _setting(
        "Greatest number of evaluations, half of them for polishing."
    )
    cpu_time: Annotated[float | None, pydantic.PlainValidator(_seconds)] = _setting(
        "Greatest CPU time of the run [s], shared by evolution and polishing in turns."
    )
    time_limit: Annotated[float | None, pydantic.PlainValidator(_seconds)] = _setting(
        "Greatest time to evaluate one individual [s]; one that takes longer counts as failed."
    )
    polish: Annotated[bool | None, pydantic.PlainValidator(_yes_or_no)] = _setting(
        "Refine the front by gradients at the end; if not given, wherever that is possible."
    )
    polish_every: Annotated[int | None, _whole(1)] = _setting(
        "Also refine a few members each time this many generations have passed."
    )

    @classmethod
    def of(cls, **settings: Any) -> Search:
        """Make a search from settings given by name.

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
            raise InvalidInputError(f"{first['loc'][0]}: {problem_of(first)}") from error

    def updated(self, **settings: Any) -> Search:
        """A copy of this search in which the given settings are replaced; None leaves a setting unchanged.

        Raises:
            UnknownNameError: as for :meth:`of`.
            InvalidInputError: as for :meth:`of`.
        """
        return Search.of(**self.given | {name: value for name, value in settings.items() if value is not None})

    @property
    def given(self) -> dict[str, Any]:
        """Settings that are not None, by name."""
        return {name: getattr(self, name) for name in Search.model_fields if getattr(self, name) is not None}

    @property
    def of_algorithm(self) -> dict[str, Any]:
        """Settings of the algorithm (sizes and operators) that are not None, by name."""
        return {name: value for name, value in self.given.items() if name in OF_ALGORITHM}


def _names(keep: Callable[[Any], bool]) -> tuple[str, ...]:
    return tuple(name for name, field in Search.model_fields.items() if keep(field.json_schema_extra))


#: Settings that belong to the algorithm: sizes and operators.
OF_ALGORITHM = _names(lambda extra: bool(extra["of_algorithm"]))

#: Usual settings of NSGA-II: those of Table 3 of Sun 2020, and pymoo's where the table gives none.
USUAL = Search(
    population=150,
    generations=200,
    crossover_probability=0.85,
    crossover_index=15.0,
    mutation_probability=0.15,
    mutation_index=20.0,
)
