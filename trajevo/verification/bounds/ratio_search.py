"""Branch and bound over the ratios of a front's segment times, as a search that can be kept."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from typing import Any, ClassVar, final

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.front.front import Front
from trajevo.front.hypervolume import hypervolume
from trajevo.verification.bounds.cells import RatioCells
from trajevo.verification.bounds.curves import Curves, Frame, undominated
from trajevo.verification.bounds.lower_curves import LowerCurves
from trajevo.verification.bounds.question import MARGIN, Question
from trajevo.verification.bounds.search import SearchState, begun, ends, frame_curves, stepped
from trajevo.verification.front_bound import FrontSearch, LowerSet

#: Slices of durations in which volumes are measured while searching, and at the end.
_SLICES, _LAST = 400, 1600

#: Growth of the number of cells after which volumes are measured again.
_GROWTH = 1.25


@final
class RatioSearch(FrontSearch):
    """Cells of ratios that may hold better motions than are known are halved until the gap is small.

    Args:
        front: the front.
        corner: far corner of the box, (n_obj,) [SI].

    Raises:
        InvalidInputError: an objective, an interpolant or a variable of which no bounds are known.
    """

    method: ClassVar[str] = "ratios of segment times"

    def __init__(self, front: Front, corner: Array) -> None:
        self.question, self.front = Question.of(front.problem), front
        self.frame = Frame(self.question.powers, corner, self.question.time_at)
        self.state = begun(self.question, self.frame, _known(self.question, front))
        self.own = hypervolume(front.F[(corner > front.F).all(axis=1)], corner)
        self.measured, self._gap, self._missing = 1, 1.0, 0.0

    @property
    def gap(self) -> float:
        """Share of the box that the front misses at most."""
        return self._gap

    @property
    def missing(self) -> float:
        """Share of the box that it misses at least."""
        return self._missing

    @property
    def cells(self) -> int:
        """Number of cells bounded."""
        return self.state.made

    def step(self, over: Callable[[], bool]) -> bool:
        """Halve the cells that may hide most."""
        state = stepped(self.question, self.frame, self.state)
        if state is self.state:
            return False
        self.state = state
        if state.made >= _GROWTH * self.measured:
            self._measure(_SLICES)
            self.measured = state.made
        return True

    def finish(self) -> None:
        """Measure in many slices."""
        self._measure(_LAST)

    def kept(self) -> tuple[dict[str, Any], dict[str, Array]]:
        """The state of the search."""
        state = self.state
        about: dict[str, Any] = {"steps": state.steps, "made": state.made, "measured": self.measured}
        about |= {"gap": self._gap, "missing": self._missing}
        arrays: dict[str, Any] = {"depths": state.depths}
        arrays |= {f"cells_{field.name}": getattr(state.cells, field.name) for field in fields(RatioCells)}
        arrays |= {f"known_{field.name}": getattr(state.known, field.name) for field in fields(Curves)}
        return about, arrays

    def go_on(self, about: dict[str, Any], arrays: dict[str, Array]) -> None:
        """Go on from a state that was kept."""
        cells = RatioCells(*(arrays[f"cells_{field.name}"] for field in fields(RatioCells)))
        known = Curves(*(arrays[f"known_{field.name}"] for field in fields(Curves)))
        self.state = SearchState(cells, arrays["depths"], known, about["steps"], about["made"])
        self.measured, self._gap, self._missing = about["measured"], float(about["gap"]), float(about["missing"])

    def found(self) -> tuple[str, LowerSet, Array, Array, tuple[str, ...]]:
        """The bound."""
        curves = self._lower()
        low, high = ends(self.frame, self.state)
        parts = (self.frame.powers, curves.constants, curves.least, curves.most)
        below = LowerCurves(*(frozen(part) for part in parts))
        return _kind(self.question), below, low * (1.0 - MARGIN), high, self.question.left_out

    def _measure(self, count: int) -> None:
        """Measure what the front misses at most, and at least."""
        curves, frame = self._lower(), self.frame
        slices = frame.slices(count, float(curves.least.min(initial=np.inf)))
        whole = frame.volume(curves, slices, inner=False)
        known = frame.volume(frame.trimmed(self.state.known), slices, inner=True)
        self._gap, self._missing = max(0.0, whole - self.own), max(0.0, known - self.own)

    def _lower(self) -> Curves:
        """Curves that no motion in the box is better than: those of open cells, and what is known less rounding."""
        known = self.state.known
        known = Curves(known.constants * (1.0 - MARGIN), known.least * (1.0 - MARGIN), known.most * (1.0 + MARGIN))
        if self.frame.time_at is not None:
            known.constants[:, self.frame.time_at] = 1.0
        curves = self.frame.trimmed(frame_curves(self.state.cells).with_others(known))
        return curves[undominated(curves)]


def _known(question: Question, front: Front) -> Curves:
    """What the front knows: the curves of its shapes where all limits are powers of the duration, else its points."""
    durations = front.X.sum(axis=1)
    points = front.F / durations[:, None] ** question.powers
    if question.time_at is not None:
        points[:, question.time_at] = 1.0
    alone = Curves(points, durations, durations)
    if question.left_out:
        return alone
    constants, least, most, _ = question.at_points(np.diff(np.log(front.X), axis=1))
    return alone.with_others(Curves(constants, least, most).real())


def _kind(question: Question) -> str:
    interpolant: Any = question.problem.interpolant
    form = f" ({interpolant.form})" if hasattr(interpolant, "form") else ""
    low, high = question.durations
    return (
        f"motions of {type(interpolant).__name__}{form} through {len(question.positions)} points, from {low:g} to "
        f"{high:g} s in each segment"
    )
