"""Tournaments that break ties with the seeded random generator, for algorithms of pymoo that do not.

pymoo 0.6.2 does not pass its generator on when it compares the violations of two infeasible individuals. If these are
equal, NSGA-III, R-NSGA-III and U-NSGA-III use an unseeded generator, and two runs with the same seed differ.
"""

from __future__ import annotations

import copy
import sys
from typing import Any

import numpy as np
from pymoo.core.algorithm import Algorithm
from pymoo.core.population import Population

from trajevo.base.arrays import Array

#: Algorithms and operators of pymoo 0.6.2 that use an unseeded generator, apart from the tournaments -> where they do.
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
    """Tournament of NSGA-III: the lower violation wins; ties and pairs of feasible individuals are decided at random.

    Args:
        pop: individuals.
        P: pairs of indices, shape (n, 2).
        random_state: random generator; called once, whatever the pairs are.
        kwargs: further arguments from pymoo, not used.

    Returns:
        Winners, shape (n, 1).
    """
    del kwargs
    return _winners(P, _lesser(_violations(pop)[P]), random_state)


def niche_then_random(
    pop: Population, P: Array, *, random_state: np.random.Generator, **kwargs: Any
) -> np.ndarray[Any, np.dtype[np.intp]]:
    """Tournament of U-NSGA-III: the lower violation wins.

    Of two feasible individuals in the same niche, the one in the better front wins, then the one nearer to the niche's
    direction. All other pairs are decided at random.

    Args:
        pop: individuals; the feasible ones have the niche, rank and distance that the survival has assigned.
        P: pairs of indices, shape (n, 2).
        random_state: random generator; called once, whatever the pairs are.
        kwargs: further arguments from pymoo, not used.

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


#: Comparisons of pymoo 0.6.2 that do not use the seed, and their replacements.
_PAIRS = (
    ("pymoo.algorithms.moo.nsga3", "comp_by_cv_then_random", violation_then_random),
    ("pymoo.algorithms.moo.unsga3", "comp_by_rank_and_ref_line_dist", niche_then_random),
)


def seeded(algorithm: Algorithm) -> str | None:
    """Make an algorithm of pymoo depend on its seed alone, as far as that is possible from outside.

    Args:
        algorithm: an algorithm that has not run; its tournament is replaced if it does not use the seed.

    Returns:
        None, or a sentence that says which part does not use the seed and cannot be replaced.
    """
    mating = getattr(algorithm, "mating", None)
    selection = getattr(mating, "selection", None)
    for module, name, ours in _PAIRS:
        theirs = getattr(sys.modules.get(module), name, None)  # an algorithm that uses it has imported it
        if mating is not None and theirs is not None and getattr(selection, "func_comp", None) is theirs:
            mating.selection = copy.copy(selection)  # all algorithms of a class share the default object
            mating.selection.func_comp = ours
    operators = (getattr(mating, role, None) for role in ("crossover", "mutation"))
    for part in (algorithm, getattr(algorithm, "survival", None), *operators):
        for kind in type(part).__mro__:
            where = _UNSEEDED.get(f"{kind.__module__}.{kind.__qualname__}")
            if where is not None:
                return f"{type(part).__name__} does not use the seed where {where}, so none of its runs can be repeated"
    return None


def _violations(pop: Population) -> Array:
    """Constraint violations, shape (N,), 0 for feasible individuals."""
    violations: Array = np.maximum(pop.get("CV").reshape(len(pop)).astype(np.float64), 0.0)
    return violations


def _lesser(values: Array) -> Array:
    """Index of the lesser of two columns, -1 where they are equal; (n, 2) -> (n,)."""
    return np.select([values[:, 0] < values[:, 1], values[:, 1] < values[:, 0]], [0, 1], -1)


def _winners(P: Array, decided: Array, random_state: np.random.Generator) -> np.ndarray[Any, np.dtype[np.intp]]:
    drawn = random_state.integers(2, size=len(P))
    which = np.where(decided < 0, drawn, decided)
    return np.take_along_axis(np.asarray(P, dtype=np.intp), which[:, None], axis=1)
