"""All feasible points of a run that nothing dominates, and the nearest miss while there is none."""

from __future__ import annotations

from collections.abc import Sequence

import moocore
import numpy as np

from trajevo.arrays import Array

#: Failed individuals of a run that are listed; all are counted.
MOST_LISTED = 100


class Archive:
    """Grows with every evaluated population; only non-dominated feasible points stay.

    Attributes:
        X: decision vectors, shape (N, n_var).
        F: objective values, shape (N, n_obj).
        G: constraint values, shape (N, n_constr).
        least_violation: least Σ max(G, 0) of any individual so far; 0 once one is feasible, inf before any number.
        nearest: decision vector and constraint values of that individual, or None.
        failures: individuals whose evaluation gave no numbers.
        failed: decision vector and message of the first of them, at most :data:`MOST_LISTED`.
    """

    def __init__(self, n_var: int, n_obj: int, n_constr: int) -> None:
        self.X, self.F, self.G = np.empty((0, n_var)), np.empty((0, n_obj)), np.empty((0, n_constr))
        self.least_violation = float("inf")
        self.nearest: tuple[Array, Array] | None = None
        self.failures = 0
        self.failed: list[tuple[Array, str]] = []

    def add(self, X: Array, F: Array, G: Array, said: Sequence[str] | None = None) -> None:
        """Take in an evaluated population, shapes (B, n_var), (B, n_obj), (B, n_constr), and what failed ones said."""
        finite = np.isfinite(F).all(axis=1)
        self.failures += int((~finite).sum())
        for i in np.flatnonzero(~finite)[: MOST_LISTED - len(self.failed)]:
            self.failed.append((X[i].copy(), "" if said is None else str(said[i])))
        violation = np.where(finite, np.maximum(G, 0.0).sum(axis=1), np.inf)
        if len(X) and violation.min() < self.least_violation:
            best = int(violation.argmin())
            self.least_violation = float(violation[best])
            self.nearest = X[best].copy(), G[best].copy()
        feasible = violation == 0.0
        merged = np.concatenate([self.F, F[feasible]])
        if feasible.any():
            kept = moocore.is_nondominated(merged)
            self.X = np.concatenate([self.X, X[feasible]])[kept]
            self.F = merged[kept]
            self.G = np.concatenate([self.G, G[feasible]])[kept]


def hypervolume(F: Array, reference_point: Array) -> float:
    """Share of the box from 0 to the reference point that objective values (N, n_obj) dominate."""
    if not len(F):
        return 0.0
    return float(moocore.hypervolume(F / reference_point, ref=np.ones(len(reference_point))))
