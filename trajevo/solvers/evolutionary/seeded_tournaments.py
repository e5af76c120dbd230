"""Tournaments whose ties are drawn from the seed, for algorithms of pymoo that lose it.

pymoo 0.6.2 compares the violations of two infeasible individuals without handing its generator on: among equal ones
NSGA-III, R-NSGA-III and U-NSGA-III draw from a generator that nobody seeded, and two runs of one seed part.
"""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
from pymoo.algorithms.moo.nsga3 import comp_by_cv_then_random
from pymoo.algorithms.moo.unsga3 import comp_by_rank_and_ref_line_dist
from pymoo.core.algorithm import Algorithm
from pymoo.core.population import Population

from trajevo.base.arrays import Array

#: Algorithms and operators of pymoo 0.6.2 that draw past the seed, besides the tournaments -> where they do.
_UNSEEDED = {
    "pymoo.algorithms.moo.cmopso.CMOPSO": "it thins its elites out",
    "pymoo.algorithms.soo.nonconvex.direct.DIRECT": "it chooses among equal boxes",
    "pymoo.algorithms.soo.nonconvex.ga_niching.NicheGA": "it chooses among equal individuals",
    "pymoo.algorithms.soo.nonconvex.pattern.PatternSearch": "it explores",
    "pymoo.algorithms.soo.nonconvex.sres.SRES": "it ranks individuals",
    "pymoo.operators.crossover.dex.DEX": "it brings variables back into their bounds",
    "pymoo.operators.mutation.gauss.GaussianMutation": "it brings variables back into their bounds",
    "pymoo.operators.survival.rank_and_crowding.classes.ConstrRankAndCrowding": "it chooses among equal violations",
}


def violation_then_random(
    pop: Population, P: Array, *, random_state: np.random.Generator, **kwargs: Any
) -> np.ndarray[Any, np.dtype[np.intp]]:
    """Tournament of NSGA-III: less violation wins; one of two equal or two feasible individuals by chance.

    Args:
        pop: individuals.
        P: pairs of indices, shape (n, 2).
        random_state: generator of every draw; one call of it, whatever the pairs are.
        kwargs: what pymoo passes besides; not used.

    Returns:
        Winners, shape (n, 1).
    """
    del kwargs
    return _winners(P, _lesser(_violations(pop)[P]), random_state)


def niche_then_random(
    pop: Population, P: Array, *, random_state: np.random.Generator, **kwargs: Any
) -> np.ndarray[Any, np.dtype[np.intp]]:
    """Tournament of U-NSGA-III: less violation wins; of two feasible individuals of one niche the better front, then
    the nearer to the niche's direction; by chance where none of this decides.

    Args:
        pop: individuals; feasible ones with the niche, rank and distance that the survival gave them.
        P: pairs of indices, shape (n, 2).
        random_state: generator of every draw; one call of it, whatever the pairs are.
        kwargs: what pymoo passes besides; not used.

    Returns:
        Winners, shape (n, 1).
    """
    del kwargs
    violations = _violations(pop)[P]
    niche, rank, distance = (pop.get(key).astype(np.float64)[P] for key in ("niche", "rank", "dist_to_niche"))
    decided = _lesser(rank)
    decided = np.where(decided < 0, _lesser(distance), decided)
    rivals = (violations == 0.0).all(axis=1) & (niche[:, 0] == niche[:, 1])
    return _winners(P, np.where(rivals, decided, _lesser(violations)), random_state)


#: Comparisons of pymoo 0.6.2 that lose the seed, and ours.
_PAIRS = (
    (comp_by_cv_then_random, violation_then_random),
    (comp_by_rank_and_ref_line_dist, niche_then_random),
)


def seeded(algorithm: Algorithm) -> str | None:
    """Make an algorithm of pymoo draw from its seed alone, where that can be done from outside.

    Args:
        algorithm: an algorithm that has not run; its tournament is replaced by ours where pymoo's loses the seed.

    Returns:
        None, or a sentence that says what in it draws past the seed and cannot be helped.
    """
    mating = getattr(algorithm, "mating", None)
    selection = getattr(mating, "selection", None)
    for theirs, ours in _PAIRS:
        if mating is not None and getattr(selection, "func_comp", None) is theirs:
            mating.selection = copy.copy(selection)  # the default is one object for all algorithms of its class
            mating.selection.func_comp = ours
    operators = (getattr(mating, role, None) for role in ("crossover", "mutation"))
    for part in (algorithm, getattr(algorithm, "survival", None), *operators):
        for kind in type(part).__mro__:
            where = _UNSEEDED.get(f"{kind.__module__}.{kind.__qualname__}")
            if where is not None:
                return f"{type(part).__name__} draws past the seed where {where}, so none of its runs can be repeated"
    return None


def _violations(pop: Population) -> Array:
    """Constraint violations, shape (N,), 0 for feasible individuals."""
    violations: Array = np.maximum(pop.get("CV").reshape(len(pop)).astype(np.float64), 0.0)
    return violations


def _lesser(values: Array) -> Array:
    """Which of two columns is less, 0 or 1, and -1 where neither is; (n, 2) -> (n,)."""
    return np.select([values[:, 0] < values[:, 1], values[:, 1] < values[:, 0]], [0, 1], -1)


def _winners(P: Array, decided: Array, random_state: np.random.Generator) -> np.ndarray[Any, np.dtype[np.intp]]:
    drawn = random_state.integers(2, size=len(P))
    which = np.where(decided < 0, drawn, decided)
    return np.take_along_axis(np.asarray(P, dtype=np.intp), which[:, None], axis=1)
