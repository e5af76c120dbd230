"""What no motion can be better than, and what a front misses at most: the record, and what a search for it has."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, final

import numpy as np

from trajevo.base.arrays import Array, frozen, numbers
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError
from trajevo.front.front import Front
from trajevo.front.quantities import with_unit


class LowerSet(ABC):
    """Objective values that motions can have at best: each motion is at least as bad as one of them."""

    @abstractmethod
    def points(self, corner: Array, count: int) -> Array:
        """Lower points of the box up to a corner, whose duration is cut into a number of slices, (M, n_obj)."""

    @abstractmethod
    def excludes(self, F: Array, corner: Array) -> Array:
        """Which values (N, n_obj) no motion can have, mask (N,)."""

    @abstractmethod
    def better(self, F: Array, corner: Array) -> Array:
        """By what share a motion can be better than values (N, n_obj) in all objectives at once, at most, (N,)."""


@final
@dataclass(frozen=True, eq=False)
class FrontBound:
    """What no motion can be better than, and what a front misses at most.

    Attributes:
        kind: the motions for which it holds, in words.
        names: names of the objectives.
        units: their units.
        corner: far corner of the box, which begins at 0, (n_obj,) [SI].
        below: the values that motions can have at best:
            :class:`~trajevo.verification.bounds.lower_curves.LowerCurves` by branch and bound,
            :class:`~trajevo.verification.path_bounds.weighted_sums.WeightedSums` along a path.
        lower: least value that each objective can have, proven, (n_obj,) [SI].
        upper: the least value that is known, of the front or of motions found on the way, (n_obj,) [SI].
        gap: share of the box that the front misses at most.
        missing: share of the box that the front misses at least, by motions that were found on the way.
        better: by what share a motion can have less than each solution of the front in all objectives at once, at
            most, (N,); NaN for a solution outside the box.
        cells: number of cells that were bounded, of ratios of segment times or of the path.
        cpu_time: CPU time of the search [s].
        ended: why it ended: ``"gap"``, ``"missing"``, ``"cpu-time"``, ``"stopped"`` or ``"nothing left"``.
        left_out: limits of the problem that were not used; with them the truth can only lie above the bound.
        front: the front's :attr:`~trajevo.front.front.Front.digest`.
    """

    kind: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    corner: Array
    below: LowerSet
    lower: Array
    upper: Array
    gap: float
    missing: float
    better: Array
    cells: int
    cpu_time: float
    ended: str
    left_out: tuple[str, ...]
    front: str

    __repr__ = brief

    def __str__(self) -> str:
        return f"{self.told} ({self.cells} cells, {self.cpu_time:.1f} s of CPU)"

    @property
    def told(self) -> str:
        """What is proven, in a sentence."""
        least = f", at least {100.0 * self.missing:.2g} %" if self.missing > 0.0 else ""
        told = f"the front misses at most {100.0 * self.gap:.2g} % of the box{least}"
        known = self.better[~np.isnan(self.better)]
        if not len(known) or known.max() >= 1.0:
            return told
        better = f"better than any of its solutions by more than {100.0 * known.max():.2g} % in all objectives"
        return f"{told}; no motion of this kind is {better}"

    @property
    def rows(self) -> tuple[tuple[str, str, str], ...]:
        """For each objective its name, what no motion is below, and the least value that is known."""
        ends = zip(self.names, self.units, self.lower, self.upper, strict=True)
        return tuple(
            (name, with_unit(f"{low:.7g}", unit), with_unit(f"{high:.7g}", unit)) for name, unit, low, high in ends
        )

    def points(self, count: int = 60) -> Array:
        """Lower points, each at least as good as all motions that it stands for, (M, n_obj) [SI].

        Args:
            count: number of slices into which durations are cut; a point has the least duration of its slice and the
                other objectives at the greatest.
        """
        return frozen(self.below.points(self.corner, count))

    def excludes(self, F: Any) -> Array:
        """Whether objective values lie below the bound, so that no motion of this kind can have them.

        Args:
            F: shape (N, n_obj) [SI]; nothing is known of values outside the box, which are not excluded.

        Returns:
            Mask (N,). If a motion of this kind has values that are excluded, the bound is wrong.
        """
        values = numbers(F, name="F", shape=("N", len(self.names)))
        inside = (values <= self.corner).all(axis=1)
        found = np.zeros(len(values), dtype=bool)
        found[inside] = self.below.excludes(values[inside], self.corner)
        return frozen(found)


class FrontSearch(ABC):
    """A search for a bound, step by step; what it knows can be kept after any step.

    Attributes:
        method: name of the way in which it is searched; a search that is kept goes on in the same way only.
    """

    method: ClassVar[str]

    @property
    @abstractmethod
    def gap(self) -> float:
        """Share of the box that the front misses at most, as last measured."""

    @property
    @abstractmethod
    def missing(self) -> float:
        """Share of the box that it misses at least, as last measured."""

    @property
    @abstractmethod
    def cells(self) -> int:
        """Number of cells bounded so far."""

    @abstractmethod
    def step(self, over: Callable[[], bool]) -> bool:
        """One step, cut short once ``over`` says so; False if no step is left."""

    @abstractmethod
    def finish(self) -> None:
        """Measure for the last time, as finely as is wanted."""

    @abstractmethod
    def kept(self) -> tuple[dict[str, Any], dict[str, Array]]:
        """What a file keeps of it: plain data, and arrays."""

    @abstractmethod
    def go_on(self, about: dict[str, Any], arrays: dict[str, Array]) -> None:
        """Go on from what a file has kept; what is given comes from :meth:`kept` of a search of the same front."""

    @abstractmethod
    def found(self) -> tuple[str, LowerSet, Array, Array, tuple[str, ...]]:
        """Kind of motions, values that they can have at best, least values proven and known, limits left out."""


def corner_of(front: Front, given: Any) -> Array:
    """Far corner of the box: a given one, the problem's reference point, or 1.1 times the front's greatest values.

    Raises:
        InvalidInputError: not one positive number for each objective.
    """
    own = front.problem.reference_point
    if given is None:
        return np.array(own) if own is not None else 1.1 * front.F.max(axis=0)
    corner = numbers(given, name="corner", shape=(front.F.shape[1],))
    if not (corner > 0.0).all():
        raise InvalidInputError(f"corner: expected positive numbers, got {corner.tolist()}")
    return corner
