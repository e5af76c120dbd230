"""A population as arrays, one row for each individual, and the individuals of pymoo that it stands for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, final

import numpy as np
from pymoo.core.individual import Individual
from pymoo.core.population import Population

from trajevo.arrays import Array

#: What pymoo lets an equality constraint be off by.
_EQUAL = 1e-4
_UNRANKED = -1


@final
@dataclass(frozen=True, eq=False)
class Rows:
    """N evaluated individuals.

    Attributes:
        X: decision vectors, shape (N, n_var).
        F: objectives, shape (N, n_obj).
        G: inequality constraints, shape (N, n_ieq_constr).
        H: equality constraints, shape (N, n_eq_constr).
        violation: Σ max(G, 0) + Σ max(abs(H) - 1e-4, 0), shape (N,).
        rank: front that each was in when it was last ranked, shape (N,); -1 where it never was.
        crowding: crowding distance there, shape (N,).
        born: generation that each was made in, shape (N,).
        notes: what else the problem said of each, shape (N,) object arrays.
    """

    X: Array
    F: Array
    G: Array
    H: Array
    violation: Array
    rank: Array
    crowding: Array
    born: Array
    notes: Mapping[str, Array]

    @property
    def feasible(self) -> Array:
        """Whether each keeps all constraints, shape (N,)."""
        feasible: Array = self.violation <= 0.0
        return feasible

    @classmethod
    def of_evaluation(cls, X: Array, evaluated: Mapping[str, Any], generation: int) -> Rows:
        """New individuals from what a problem gave for them."""
        size = len(X)
        F, G, H = (_columns(evaluated.get(name), size) for name in "FGH")
        notes = {name: values for name, values in evaluated.items() if name not in "FGH" and values is not None}
        return cls(X, F, G, H, _violation(G, H), *_unranked(size), np.full(size, generation), notes)

    @classmethod
    def of_population(cls, population: Population) -> Rows:
        """The arrays of individuals."""
        size = len(population)
        X, F, G, H = (_columns(population.get(name), size) for name in ("X", "F", "G", "H"))
        rank, crowding = _unranked(size)
        born = np.zeros(size, dtype=np.int64)
        own: dict[str, Array] = {}
        for i, one in enumerate(population):
            for key, value in one.data.items():
                if key == "rank":
                    rank[i] = _UNRANKED if value is None else value
                elif key == "crowding":
                    crowding[i] = np.nan if value is None else value
                elif key == "n_gen":
                    born[i] = value
                elif key != "n_iter":
                    own.setdefault(key, np.full(size, None))[i] = value
        violation = np.concatenate([np.reshape(one.CV, -1) for one in population]) if size else np.empty(0)
        return cls(X, F, G, H, violation, rank, crowding, born, own)

    @classmethod
    def joined(cls, one: Rows, other: Rows) -> Rows:
        """All individuals of two."""
        keys = {*one.notes, *other.notes}
        notes = {key: np.concatenate([_noted(rows, key) for rows in (one, other)]) for key in keys}
        arrays = {name: np.concatenate([getattr(one, name), getattr(other, name)]) for name in _ARRAYS}
        return cls(**arrays, notes=notes)

    def chosen(self, indices: Array) -> Rows:
        """Some of them."""
        arrays = {name: getattr(self, name).take(indices, axis=0) for name in _ARRAYS}
        return Rows(**arrays, notes={key: values[indices] for key, values in self.notes.items()})

    def after(self, count: int) -> Rows:
        """All but the first ones, as views of the same arrays."""
        arrays = {name: getattr(self, name)[count:] for name in _ARRAYS}
        return Rows(**arrays, notes={key: values[count:] for key, values in self.notes.items()})

    def population(self) -> Population:
        """The same as individuals of pymoo."""
        return Population([self._individual(i) for i in range(len(self.X))])

    def _individual(self, i: int) -> Individual:
        one = Individual(X=self.X[i].copy(), F=self.F[i].copy(), G=self.G[i].copy(), H=self.H[i].copy())
        one.evaluated.update(("F", "G", "H"))
        one.CV = self.violation[i : i + 1].copy()
        one.data = {"n_gen": int(self.born[i]), "n_iter": int(self.born[i])}
        one.data |= {key: values[i] for key, values in self.notes.items() if values[i] is not None}
        if self.rank[i] != _UNRANKED:
            one.data |= {"rank": int(self.rank[i]), "crowding": float(self.crowding[i])}
        return one


_ARRAYS = tuple(field.name for field in fields(Rows) if field.name != "notes")


def _columns(values: Any, size: int) -> Array:
    """Values of all individuals as (N, columns), no columns where there are none."""
    if values is None:
        return np.empty((size, 0))
    found: Array = np.asarray(values, dtype=np.float64).reshape(size, -1 if size else 0)
    return found


def _violation(G: Array, H: Array) -> Array:
    violation: Array = np.maximum(0.0, G).sum(axis=1)
    return violation + np.maximum(0.0, np.abs(H) - _EQUAL).sum(axis=1) if H.shape[1] else violation


def _unranked(size: int) -> tuple[Array, Array]:
    return np.full(size, _UNRANKED), np.full(size, np.nan)


def _noted(rows: Rows, key: str) -> Array:
    found = rows.notes.get(key)
    return np.full(len(rows.X), None) if found is None else np.asarray(found, dtype=object)
