"""Straight-line code: expressions of numbers and named variables become assignments without loops or branches."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import final

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

    def assignments(self, results: Iterable[Term]) -> list[Assignment]:
        """The assignments that results need, in order."""
        needed: set[Term] = set(results)
        kept = []
        for (operation, one, other), name in reversed(self._names.items()):
            if name in needed:
                kept.append((name, operation, one, other))
                needed |= {one, other}
        return kept[::-1]

    def _assigned(self, operation: str, one: Term, other: Term) -> str:
        return self._names.setdefault((operation, one, other), f"t{len(self._names)}")
