"""MOEA/D for problems with constraints, which pymoo's MOEA/D refuses."""

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
    """pymoo's parallel MOEA/D with two additions: Deb's rules for constraints, and scaled objectives.

    An offspring replaces a neighbour if it violates the constraints less, or if both are feasible and it is better
    along the neighbour's direction (Jain and Deb 2014 call this C-MOEA/D). Objectives are divided by their range in the
    feasible population, as Zhang and Li 2007 advise for objectives of different magnitudes.

    Args:
        ref_dirs: reference directions, shape (N, n_obj); the population has one individual for each.
        pop_size: N, or None.
        n_offsprings: new individuals per generation, at most N; N if None.
        others: further arguments of pymoo's class.

    Raises:
        InvalidInputError: a population other than N, or more than N offspring.
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
        # pymoo's _setup only reads the number of objectives, and refuses problems with constraints.
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
    """Range of every objective, 1 where it is 0, shape (n_obj,)."""
    if not len(F):
        return np.ones(F.shape[1])
    width: Array = np.ptp(F, axis=0)
    return np.where(width > 0.0, width, 1.0)
