"""Inverse dynamics of one kinematic tree written out for numpy, where numba is not installed.

Every operation writes into a row of a room that stays in the processor's cache; a row is used again when nobody needs
what it holds. That takes four fifths of the time of arrays that come and go.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import final

from trajevo.rnea_source import Joint, head, written_out
from trajevo.straight_line import Assignment, Term

#: States that one operation is done for, at least two thirds and at most half as many again.
_STATES = 4096
#: Numbers between the ends of rows, so that rows do not lie at the same place of every page.
_APART = 8
_OPERATIONS = {"+": "np.add", "-": "np.subtract", "*": "np.multiply"}


def arrays_source(tree: tuple[Joint, ...], carrier: int | None) -> str:
    """The function of :func:`trajevo.rnea_source.source`, every variable a row of the states of one block.

    Masses and other numbers are arrays without dimensions, with which numpy is twice as fast as with numbers.
    """
    written, results = written_out(tree, carrier)
    rows = _Rows()
    for i, joint in enumerate(tree, start=1):
        taken = [("q", "np.copyto({}, {})")] if joint.slides else [("c", "np.cos({1}, {0})"), ("s", "np.sin({1}, {0})")]
        for name, call in taken:
            rows.take(f"{name}{i}", call, f"q[part, {i - 1}]")
        for name in "va":
            rows.take(f"{name}{i}", "np.copyto({}, {})", f"{name}[part, {i - 1}]")
    rows.assign(written.assignments(results.values()), results.values())
    lines = head("kernel(q, v, a, torque, bodies, gravity, armature, load)", tree, carrier, entry="[{}, ...]")
    lines += rows.numbers
    lines += [f"    size = max(1, -(-len(q) // max(1, round(len(q) / {_STATES}))))"]
    lines += [f"    room = np.empty(({rows.count}, size + {_APART}))"]
    lines += ["    for begin in range(0, len(q), size):", "        part = slice(begin, min(begin + size, len(q)))"]
    lines += [f"        {', '.join(f'r{k}' for k in range(rows.count))}, = room[:, : part.stop - begin]"]
    lines += [f"        {line}" for line in rows.lines]
    lines += [f"        torque[part, {i - 1}] = {rows.text(term)}" for i, term in results.items()]
    return "\n".join([*lines, ""])


@final
class _Rows:
    """Which row holds which variable.

    Attributes:
        lines: what is done with them.
        numbers: definitions of what is the same for every state.
        count: how many rows there are.
    """

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.numbers: list[str] = []
        self.count = 0
        self._free: list[str] = []
        self._where: dict[Term, str] = {}
        self._known: dict[float, str] = {}

    def take(self, name: str, call: str, values: str) -> None:
        """Put values into a row of their own by a call of the row and them."""
        self.lines.append(call.format(self._row(name), values))

    def assign(self, assignments: list[Assignment], results: Iterable[Term]) -> None:
        """All assignments, a row given back after the last one that needs it."""
        last: dict[Term, int] = {}
        for number, (_, _, *terms) in enumerate(assignments):
            last.update(dict.fromkeys(terms, number))
        last.update(dict.fromkeys(results, len(assignments)))
        for number, (name, operation, *terms) in enumerate(assignments):
            texts = [self.text(term) for term in terms]
            if not any(term in self._where for term in terms):
                self.numbers.append(f"    {name} = np.asarray({f' {operation} '.join(texts)})")
                continue
            self._free += [self._where[term] for term in {*terms} if term in self._where and last[term] == number]
            self.lines.append(f"{_OPERATIONS[operation]}({', '.join([*texts, self._row(name)])})")

    def text(self, term: Term) -> str:
        """A term as it stands in source text."""
        if isinstance(term, str):
            return self._where.get(term, term)
        if term not in self._known:
            self._known[term] = f"number{len(self._known)}"
            self.numbers.append(f"    {self._known[term]} = np.array({term!r})")
        return self._known[term]

    def _row(self, name: str) -> str:
        if not self._free:
            self._free.append(f"r{self.count}")
            self.count += 1
        self._where[name] = self._free.pop()
        return self._where[name]
