"""Bisection of the payloads of given motions: SciPy's motions and Pinocchio's efforts at many instants."""

from __future__ import annotations

from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.study.bench.adapters.adapter import BenchRival
from trajevo.study.bench.contest import Contest
from trajevo.study.bench.statement import Statement

#: Instants of a motion, and the share of the greatest mass of all at which bisection ends.
INSTANTS, ENOUGH = 1_000, 1e-6

#: Share of every limit that is kept free: between the instants efforts are a little greater.
FREE = 1e-4


@final
class Pinocchio(BenchRival):
    """Halves the interval of the greatest payload, motion by motion."""

    name = "pinocchio"
    says = f"bisection at {INSTANTS} instants of the plain statement, {100.0 * FREE:g} % of limits kept free"
    module, distribution = "pinocchio", "pin"
    plain = carries = True

    def refuses(self, contest: Contest) -> str:
        """See :meth:`BenchRival.refuses`."""
        if contest.motions_given is None:
            return "it finds payloads of given motions, the problem asks for motions"
        return super().refuses(contest)

    def solve(self, contest: Contest) -> None:
        """See :meth:`BenchRival.solve`."""
        statement = contest.benchmark.statement(instants=INSTANTS)
        for motion in contest.motions_given:
            mass = bisected(statement, motion, enough=ENOUGH, free=FREE)
            contest.one(np.append(motion[:-1], mass))


def bisected(statement: Statement, motion: Array, *, enough: float, free: float = 0.0) -> float:
    """The greatest payload of a motion at the instants of a plain statement [kg], from 0 to its greatest one.

    Args:
        statement: the problem; the last variable is the payload's mass [kg].
        motion: decision vector, shape (variables,), whose mass is not used.
        enough: share of the greatest mass of all up to which it is found.
        free: share of every limit that is kept free.
    """
    low, high = 0.0, float(statement.upper[-1])
    near = enough * high
    while high - low > near:
        mass = 0.5 * (low + high)
        kept = statement.evaluate(np.append(motion[:-1], mass))[1].max() <= -free
        low, high = (mass, high) if kept else (low, mass)
    return low
