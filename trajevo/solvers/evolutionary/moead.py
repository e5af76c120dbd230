"""MOEA/D for problems with limits, which pymoo's refuses."""

from __future__ import annotations

import copy
from typing import Any, final

import numpy as np
from pymoo.algorithms.moo.moead import ParallelMOEAD
from pymoo.core.population import Population

from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError


@final
class ConstrainedMOEAD(ParallelMOEAD):
    """pymoo's parallel MOEA/D with two additions: Deb's rules for limits, and objectives of equal weight.

    An individual replaces a neighbour if it breaks the limits by less, or both keep them and it is better along the
    neighbour's direction (Jain and Deb 2014 call it C-MOEA/D). Objectives are divided by the width of the population's,
    as Zhang and Li 2007 advise for objectives of different sizes.

    Args:
        ref_dirs: directions between the objectives, shape (N, n_obj); the population has one individual for each.
        pop_size: N, where it is given.
        n_offsprings: new individuals per generation, N at most and if None.
        others: as pymoo's.

    Raises:
        InvalidInputError: another population, or more offspring.
    """

    def __init__(
        self, ref_dirs: Array, *, pop_size: int | None = None, n_offsprings: int | None = None, **others: Any
    ) -> None:
        count = len(ref_dirs)
        if pop_size not in (None, count):
            raise InvalidInputError(f"population: MOEA/D has one individual for each of {count} directions")
        if n_offsprings is not None and n_offsprings > count:
            raise InvalidInputError(f"offsprings: expected at most the population, {count}, got {n_offsprings}")
        super().__init__(ref_dirs, n_offsprings=n_offsprings or count, **others)

    def _setup(self, problem: Any, **kwargs: Any) -> None:
        # pymoo's looks at the problem for its number of objectives, and to refuse limits.
        unlimited = copy.copy(problem)
        unlimited.n_ieq_constr = 0
        super()._setup(unlimited, **kwargs)

    def _replace(self, k: int, off: Any) -> None:
        neighbours = self.neighbors[k]
        pop: Population = self.pop
        F, CV = pop.get("F"), pop.get("CV")[:, 0]
        scale = _widths(F[CV <= 0.0])
        weights, ideal = self.ref_dirs[neighbours], self.ideal / scale
        theirs = self.decomposition.do(F[neighbours] / scale, weights=weights, ideal_point=ideal)
        own = self.decomposition.do(off.F[None] / scale, weights=weights, ideal_point=ideal)
        keeps = (off.CV[0] <= 0.0) & (CV[neighbours] <= 0.0)
        better = np.where(keeps, own.ravel() < theirs.ravel(), off.CV[0] < CV[neighbours])
        pop[neighbours[better]] = off


def _widths(F: Array) -> Array:
    """Width of every objective, 1 where there is none, shape (n_obj,)."""
    if not len(F):
        return np.ones(F.shape[1])
    width: Array = np.ptp(F, axis=0)
    return np.where(width > 0.0, width, 1.0)
