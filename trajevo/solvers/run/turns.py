"""How evolution and polishing share a limit of CPU time: in turns, so that a run is good whenever it ends.

Evolution finds the valleys and spreads a front, but comes near to it slowly; gradients converge from nearly anywhere.
So the first short polish comes after a few generations. Its members go into the next generation, the evolution goes on
for half the time that the polish took, and is polished again. What is left at the end is for the whole polish, which
also seeks exact anchors and other valleys.
"""

from __future__ import annotations

from typing import final

from trajevo.front.books import Books
from trajevo.solvers.gradient.minimax import in_terms_alone
from trajevo.solvers.run.folder import Manifest

#: Generations before the first short polish, and where it descends by the terms of a single maximum: that takes less
#: time than a generation or two, from nearly anywhere.
_FIRST, _FIRST_IN_TERMS = 6, 1

#: CPU time of evolution between two short polishes, as a share of what the former took.
_BETWEEN = 0.5

#: Share of the limit that is kept for the whole polish at most, and how many times a short one takes it takes.
_KEPT, _WHOLE = 0.5, 4.0


@final
class Turns:
    """Decides from the books alone, which a checkpoint keeps, so that a resumed run decides alike.

    Args:
        books: what the run has recorded.
        manifest: settings of the run.
    """

    def __init__(self, books: Books, manifest: Manifest) -> None:
        self._books, self._manifest = books, manifest
        self._cpu_time = manifest.cpu_time if manifest.polish and manifest.polish_every is None else None

    @property
    def taken(self) -> tuple[int, ...]:
        """Generations that were polished before they were evaluated, from 1; of a run without such turns none."""
        if self._cpu_time is None:
            return ()
        return tuple(number for number, cost in enumerate(self._books.polishing, start=1) if number > 1 and cost)

    @property
    def due(self) -> bool:
        """Whether a short polish comes before the next generation."""
        cpu, last = self._books.cpu_seconds, self.taken[-1:]
        if self._cpu_time is None or not len(self._books.archive.F):
            return False
        if not last:
            return len(cpu) >= (_FIRST_IN_TERMS if in_terms_alone(self._books.target) else _FIRST)
        return cpu[-1] - cpu[last[0] - 1] >= _BETWEEN * self._took(last[0])

    @property
    def left(self) -> float:
        """CPU time that is left of the limit after the last generation [s]."""
        return (self._cpu_time or 0.0) - self._books.cpu_seconds[-1]

    @property
    def share(self) -> float:
        """Share of the limits after which the evolution ends; the rest is for the whole polish."""
        if not self._manifest.polish:
            return 1.0
        taken = self.taken
        # With one objective, short polishes seek other valleys too, and say nothing of what the whole one takes.
        if self._cpu_time is None or not taken or self._books.target.n_obj == 1:
            return 1.0 - _KEPT
        return 1.0 - min(_KEPT, _WHOLE * max(map(self._took, taken)) / self._cpu_time)

    def _took(self, number: int) -> float:
        """CPU time of a generation with its polish [s]."""
        return self._books.cpu_seconds[number - 1] - self._books.cpu_seconds[number - 2]
