"""Straight-line code: expressions of numbers and named variables become assignments without loops or branches.

:class:`StraightLine` collects, simplifies and differentiates sums and products; :func:`cosine_and_sine` writes both
functions as polynomials.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import final

import numpy as np

#: Coefficients of sine and cosine on [-π/4, π/4], lowest power first (minimax polynomials of Sun's fdlibm, 1993), and
#: π/2 as a sum of three parts. Multiples of the first two parts up to 2²⁰ are exact.
_SINE = (
    -1.66666666666666324348e-01,
    8.33333333332248946124e-03,
    -1.98412698298579493134e-04,
    2.75573137070700676789e-06,
    -2.50507602534068634195e-08,
    1.58969099521155010221e-10,
)


_COSINE = (
    4.16666666666666019037e-02,
    -1.38888888888741095749e-03,
    2.48015872894767294178e-05,
    -2.75573143513906633035e-07,
    2.08757232129817482790e-09,
    -1.13596475577881948265e-11,
)


_QUARTER = (1.57079632673412561417e00, 6.07710050630396597660e-11, 2.02226624879595063154e-21)

#: Greatest angle for these polynomials [rad]; beyond it the functions of the math library are used.
GREATEST_ANGLE = 1e5


def cosine_and_sine(row: str) -> list[str]:
    """Lines that replace the angle in ``row, 0, i]`` by its cosine and put its sine into ``row, 1, i]``."""

    def polynomial(coefficients: tuple[float, ...]) -> str:
        result = repr(coefficients[-1])
        for coefficient in coefficients[-2::-1]:
            result = f"({result} * square + {coefficient!r})"
        return result

    rest = "".join(f" - quarters * {part!r}" for part in _QUARTER)
    return [
        f"angle = {row}, 0, i]",
        f"quarters = np.floor(angle * {2.0 / np.pi!r} + 0.5)",
        f"rest = angle{rest}",
        "square = rest * rest",
        f"sine = rest + rest * square * {polynomial(_SINE)}",
        f"cosine = 1.0 - (0.5 * square - square * square * {polynomial(_COSINE)})",
        "quarter = quarters - 4.0 * np.floor(0.25 * quarters)",
        "odd = quarter == 1.0 or quarter == 3.0",
        "near, far = (sine, cosine) if odd else (cosine, sine)",
        f"{row}, 0, i] = -near if quarter == 1.0 or quarter == 2.0 else near",
        f"{row}, 1, i] = -far if quarter >= 2.0 else far",
    ]


#: A number that is known, or the name of a variable.
Term = float | str
Vector = Sequence[Term]

#: Name of a variable, operation, and the two terms.
Assignment = tuple[str, str, Term, Term]


@final
class StraightLine:
    """Assignments in the order of the calls that need them, each expression once; numbers are computed at once."""

    def __init__(self) -> None:
        self._names: dict[tuple[str, Term, Term], str] = {}

    def add(self, one: Term, other: Term) -> Term:
        """One + other."""
        if isinstance(one, float) and isinstance(other, float):
            return one + other
        if one == 0.0 or other == 0.0:
            return other if one == 0.0 else one
        return self._assigned("+", one, other)

    def subtract(self, one: Term, other: Term) -> Term:
        """One - other."""
        if isinstance(one, float) and isinstance(other, float):
            return one - other
        if other == 0.0:
            return one
        return self._assigned("-", one, other)

    def multiply(self, one: Term, other: Term) -> Term:
        """One * other; zero times a variable is zero, whatever its value."""
        if isinstance(one, float) and isinstance(other, float):
            return one * other
        if isinstance(other, float):
            one, other = other, one
        if isinstance(one, float):
            if one == 0.0:
                return 0.0
            if abs(one) == 1.0:
                return other if one > 0.0 else self.subtract(0.0, other)
        return self._assigned("*", one, other)

    def sum(self, *vectors: Vector) -> list[Term]:
        """Sum of vectors, from the first to the last."""
        total = list(vectors[0])
        for vector in vectors[1:]:
            total = [self.add(x, y) for x, y in zip(total, vector, strict=True)]
        return total

    def scaled(self, factor: Term, vector: Vector) -> list[Term]:
        """Factor * vector."""
        return [self.multiply(factor, x) for x in vector]

    def dot(self, one: Vector, other: Vector) -> Term:
        """Inner product."""
        total: Term = 0.0
        for x, y in zip(one, other, strict=True):
            total = self.add(total, self.multiply(x, y))
        return total

    def product(self, matrix: Sequence[Vector], vector: Vector) -> list[Term]:
        """Matrix @ vector."""
        return [self.dot(row, vector) for row in matrix]

    def cross(self, one: Vector, other: Vector) -> list[Term]:
        """One x other, of three components."""
        return [
            self.subtract(self.multiply(one[i - 2], other[i - 1]), self.multiply(one[i - 1], other[i - 2]))
            for i in range(3)
        ]

    def differentiated(self, slopes: Mapping[Term, Term]) -> tuple[StraightLine, dict[Term, Term], dict[Term, Term]]:
        """The same assignments, each followed by the assignment of its derivative.

        Args:
            slopes: derivatives of the variables that are not constant.

        Returns:
            The new assignments, and two mappings from the terms used here, to the new terms and to their derivatives.
        """
        line, values, rates = StraightLine(), dict[Term, Term](), dict(slopes)
        for (operation, *terms), name in self._names.items():
            one, other = (values.get(term, term) if isinstance(term, str) else term for term in terms)
            rate, change = (rates.get(term, 0.0) if isinstance(term, str) else 0.0 for term in terms)
            if operation == "+":
                values[name], rates[name] = line.add(one, other), line.add(rate, change)
            elif operation == "-":
                values[name], rates[name] = line.subtract(one, other), line.subtract(rate, change)
            else:
                values[name] = line.multiply(one, other)
                rates[name] = line.add(line.multiply(rate, other), line.multiply(one, change))
        return line, values, rates

    def assignments(self, results: Iterable[Term]) -> list[Assignment]:
        """The assignments that results need, in order."""
        needed: set[Term] = set(results)
        kept = []
        for (operation, one, other), name in reversed(self._names.items()):
            if name in needed:
                kept.append((name, operation, one, other))
                needed |= {one, other}
        return kept[::-1]

    def lines(self, results: Iterable[Term]) -> list[str]:
        """The assignments that results need, as source text."""
        lines = []
        for name, operation, one, other in self.assignments(results):
            first = "" if operation == "-" and one == 0.0 else f"{text(one)} "
            lines.append(f"{name} = {first}{operation}{' ' if first else ''}{text(other)}")
        return lines

    def _assigned(self, operation: str, one: Term, other: Term) -> str:
        return self._names.setdefault((operation, one, other), f"t{len(self._names)}")


def text(term: Term) -> str:
    """A term as it is written in source text."""
    return term if isinstance(term, str) else f"({term!r})"
