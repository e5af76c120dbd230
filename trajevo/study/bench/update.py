"""Keep what runs have found beyond the best known, after the problem itself has checked it."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from trajevo.base.files import why_not
from trajevo.errors import InvalidInputError
from trajevo.study.bench.record import BenchResults
from trajevo.study.bench.suite import REFERENCE, benchmark, benchmarks


class Improved(NamedTuple):
    """A best known set that has become better: name of the problem, its file, and members before and now."""

    problem: str
    file: Path
    before: int
    now: int


def update_references(results: BenchResults, suite: str | Path | None = None) -> tuple[Improved, ...]:
    """Merge the members of all runs into the best known sets, and write those that have become better.

    Only decision vectors within their bounds that keep every limit exactly are taken; their objectives are evaluated
    again. Problems that the suite does not have are left alone.

    Args:
        results: the results.
        suite: folder of the problems; that of trajevo if None.

    Raises:
        InvalidInputError: a best known set cannot be read or written.
    """
    folder = None if suite is None else Path(suite)
    written = []
    for name in benchmarks(folder):
        found = [(run.rival, run.X) for run in results.runs if run.problem == name and run.X]
        if not found:
            continue
        own = benchmark(name, folder)
        problem, reference = own.problem(), own.reference
        X = np.unique(np.concatenate([np.array(rows) for _, rows in found]), axis=0)
        if X.shape[1] != problem.n_var:
            raise InvalidInputError(
                f"{name}: expected {problem.n_var} decision variables, the results have {X.shape[1]}"
            )
        X = X[((problem.xl <= X) & (problem.xu >= X)).all(axis=1)]
        G = problem.evaluate(X, return_values_of=["F", "G"])[1] if len(X) else np.empty((0, 1))
        by = ", ".join(dict.fromkeys(rival for rival, _ in found))
        better = reference.improved(X[(G <= 0.0).all(axis=1)], found_by=f"trajevo bench run: {by}")
        if better is reference:
            continue
        try:
            better.write(own.folder / REFERENCE)
        except OSError as error:
            raise InvalidInputError(f"{own.folder / REFERENCE}: cannot be written: {why_not(error)}") from error
        written.append(Improved(name, own.folder / REFERENCE, len(reference.values), len(better.values)))
    return tuple(written)
