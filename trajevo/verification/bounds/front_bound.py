"""How good a front is at best: bounds from below of all motions of its kind, and what the front misses at most."""

from __future__ import annotations

import io
import json
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, frozen, numbers
from trajevo.base.files import why_not, write_whole
from trajevo.base.plain import from_json, read_arrays
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError, NoSolutionError
from trajevo.front.front import Front
from trajevo.front.hypervolume import hypervolume
from trajevo.front.quantities import with_unit
from trajevo.verification.bounds.cells import RatioCells
from trajevo.verification.bounds.curves import Curves, Frame, undominated
from trajevo.verification.bounds.question import MARGIN, Question
from trajevo.verification.bounds.search import SearchState, begun, ends, frame_curves, stepped

#: Format and version of the file in which a search is kept.
_FORMAT, _VERSION = "trajevo bound", 1

#: Ending of its name beside that of the front.
BOUND_SUFFIX = ".bound.npz"

#: Slices of durations in which volumes are measured while searching, and at the end.
_SLICES, _LAST = 400, 1600

#: Growth of the number of cells after which volumes are measured again, and CPU time between two writings [s].
_GROWTH, _WRITTEN = 1.25, 15.0

#: Bounds of the wanted gap, as a share of the box.
_GAPS = (1e-4, 1.0)

#: Lower points and solutions that are compared together.
_TOGETHER = 4_000_000


@final
@dataclass(frozen=True, eq=False)
class FrontBound:
    """What no motion of a front's kind can be better than.

    Every motion of this kind whose objectives lie in the box is at least as bad in all of them as some point of a
    curve: there objective i is ``constants[:, i]`` times the duration to the power ``powers[i]``, for durations from
    ``least`` to ``most``.

    Attributes:
        kind: the motions for which it holds, in words.
        names: names of the objectives.
        units: their units.
        corner: far corner of the box, which begins at 0, (n_obj,) [SI].
        powers: powers of the duration, (n_obj,) [1].
        constants: of K curves, (K, n_obj) [SI, for a duration of 1 s].
        least: least duration on each curve, (K,) [s].
        most: greatest duration on each curve, (K,) [s].
        lower: least value that each objective can have, proven, (n_obj,) [SI].
        upper: the least value that is known, of the front or of motions found on the way, (n_obj,) [SI].
        gap: share of the box that the front misses at most: that between it and the curves.
        missing: share of the box that the front misses at least, by motions that were found on the way.
        better: by what share a motion can be better than each solution of the front in all objectives at once, at
            most, (N,); NaN for a solution outside the box.
        cells: number of cells that were bounded.
        cpu_time: CPU time of the search [s].
        ended: why it ended: ``"gap"``, ``"missing"``, ``"cpu-time"`` or ``"nothing left"``.
        left_out: limits of the problem that were not used; with them the truth can only lie above the bound.
        front: the front's :attr:`~trajevo.front.front.Front.digest`.
    """

    kind: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    corner: Array
    powers: Array
    constants: Array
    least: Array
    most: Array
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
        if not len(known) or not np.isfinite(known.max()):
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
        time_at, found = self._frame.time_at, []
        curves = Curves(self.constants, self.least, self.most)
        slices = self._frame.slices(count + 1, float(self.least.min(initial=np.inf)))
        for k, duration in enumerate(slices[1:] if time_at is not None else slices):
            begun = curves[curves.least <= duration]
            values = self._frame.values(begun, np.full(len(begun), duration))
            if time_at is not None:
                values[:, time_at] = slices[k]
            values = values[(values <= self.corner).all(axis=1)]
            found.append(values[_best_rows(values)])
        return frozen(np.concatenate(found))

    def excludes(self, F: Any) -> Array:
        """Whether objective values lie below the bound, so that no motion of this kind can have them.

        Args:
            F: shape (N, n_obj) [SI]; nothing is known of values outside the box, which are not excluded.

        Returns:
            Mask (N,). If a motion of this kind has values that are excluded, the bound is wrong.
        """
        values = numbers(F, name="F", shape=("N", len(self.names)))
        found, time_at = np.zeros(len(values), dtype=bool), self._frame.time_at
        others, step = self._frame.others, max(1, _TOGETHER // max(1, len(self.least)))
        inside = np.flatnonzero((values <= self.corner).all(axis=1))
        for first in range(0, len(inside), step):
            rows = inside[first : first + step]
            part = values[rows]
            durations = part[:, time_at, None] if time_at is not None else np.full((len(part), 1), np.inf)
            reached = self.least <= durations * (1.0 + MARGIN)
            paces = np.minimum(self.most, durations)
            for k in others:
                reached &= self.constants[:, k] * paces ** self.powers[k] <= part[:, k, None] * (1.0 + MARGIN)
            found[rows] = ~reached.any(axis=1)
        return frozen(found)

    @property
    def _frame(self) -> Frame:
        time_at = next((k for k, power in enumerate(self.powers) if power > 0.0), None)
        return Frame(self.powers, self.corner, time_at)


def bound_front(
    front: Front,
    *,
    gap: float = 0.01,
    cpu_time: float = 600.0,
    corner: Any = None,
    file: str | Path | None = None,
    tell: Callable[[str], None] | None = None,
) -> FrontBound:
    """Bound a front from below by branch and bound over all ratios of its segment times.

    Objectives are enclosed over boxes of the logarithms of these ratios; the duration itself needs no box, since
    objectives and limits are powers of it: see docs/explanation/bounds.md.

    Args:
        front: a front whose variables are the segment times of motions from rest to rest, with objectives among time,
            acceleration, jerk, square_acceleration, square_jerk, peak_acceleration and peak_jerk.
        gap: share of the box, 0.0001 to 1, at which the search ends.
        cpu_time: CPU time after which it ends, that of earlier parts of it included [s].
        corner: far corner of the box in which motions are compared, (n_obj,) [SI]; if None, the problem's reference
            point, or 1.1 times the front's greatest values if it has none.
        file: where the search is kept: a search of the same front goes on from there. None to keep it nowhere.
        tell: is called with a line on where the search stands.

    Returns:
        The bound.

    Raises:
        NoSolutionError: the front is empty.
        InvalidInputError: an objective, an interpolant or a variable of which no bounds are known, or arguments out of
            range.
    """
    if not isinstance(front, Front):
        raise InvalidInputError(
            f"front: expected a front, as trajevo.optimise gives it or Front.load reads it, got {type(front).__name__}"
        )
    if not len(front):
        raise NoSolutionError(f"the front is empty: {front.blocking or 'none of its rows was taken'}")
    _checked("gap", gap, *_GAPS)
    _checked("cpu_time", cpu_time, 0.0, np.inf)
    question = Question.of(front.problem)
    frame = Frame(question.powers, _corner(front, corner), question.time_at)
    target = None if file is None else Path(file)
    search = _Search.at(question, frame, front, target)
    search.run(float(gap), float(cpu_time), tell)
    return search.found()


@final
class _Search:
    """A search that can be interrupted, with what was spent on it."""

    def __init__(self, question: Question, frame: Frame, front: Front, file: Path | None, state: SearchState) -> None:
        self.question, self.frame, self.front, self.file, self.state = question, frame, front, file, state
        self.spent, self.measured, self.ended = 0.0, 0, "cpu-time"
        self.own = hypervolume(front.F[(frame.corner > front.F).all(axis=1)], frame.corner)
        self.gap = self.missing = 0.0

    @classmethod
    def at(cls, question: Question, frame: Frame, front: Front, file: Path | None) -> _Search:
        """The search that a file keeps of this front, or a new one."""
        kept = None if file is None else _kept(file, front.digest)
        if kept is not None and np.array_equal(kept[0]["corner"], frame.corner):
            arrays, about = kept
            cells = RatioCells(*(arrays[f"cells_{field.name}"] for field in fields(RatioCells)))
            known = Curves(*(arrays[f"known_{field.name}"] for field in fields(Curves)))
            search = cls(
                question, frame, front, file, SearchState(cells, arrays["depths"], known, about["steps"], about["made"])
            )
            search.spent, search.measured = about["spent"], about["measured"]
            return search
        return cls(question, frame, front, file, begun(question, frame, _known(question, front)))

    def run(self, gap: float, cpu_time: float, tell: Callable[[str], None] | None) -> None:
        """Search until one of the ends is reached."""
        began, written = time.process_time() - self.spent, self.spent
        self._measure(_SLICES)
        while not self._reached(gap):
            self.spent = time.process_time() - began
            if self.spent >= cpu_time:
                self.ended = "cpu-time"
                break
            state = stepped(self.question, self.frame, self.state)
            if state is self.state:
                self.ended = "nothing left"
                break
            self.state = state
            if state.made >= _GROWTH * self.measured:
                self._measure(_SLICES)
                if tell is not None:
                    tell(f"{state.made} cells  gap at most {100.0 * self.gap:.3g} %  {self.spent:.0f} s of CPU")
            if self.spent - written > _WRITTEN:
                self._write()
                written = self.spent
        self._measure(_LAST)
        self.spent = time.process_time() - began

    def found(self) -> FrontBound:
        """The bound, when the search has been kept too."""
        state, frame, record = self.state, self.frame, self.front.record
        curves = self._lower()
        low, high = ends(frame, state)
        self._write()
        return FrontBound(
            kind=_kind(self.question),
            names=self.front.objective_names,
            units=tuple(one.unit for one in record.objectives),
            corner=frozen(frame.corner),
            powers=frozen(frame.powers),
            constants=frozen(curves.constants),
            least=frozen(curves.least),
            most=frozen(curves.most),
            lower=frozen(low * (1.0 - MARGIN)),
            upper=frozen(np.minimum(high, self.front.F.min(axis=0))),
            gap=self.gap,
            missing=self.missing,
            better=frozen(_better(frame, curves, self.front.F)),
            cells=state.made,
            cpu_time=self.spent,
            ended=self.ended,
            left_out=self.question.left_out,
            front=self.front.digest,
        )

    def _reached(self, gap: float) -> bool:
        if self.state.made == 1:
            return False
        self.ended = "gap" if self.gap <= gap else "missing" if self.missing > gap else self.ended
        return self.gap <= gap or self.missing > gap

    def _measure(self, count: int) -> None:
        """Measure what the front misses at most, and at least."""
        curves, frame = self._lower(), self.frame
        slices = frame.slices(count, float(curves.least.min(initial=np.inf)))
        whole = frame.volume(curves, slices, inner=False)
        known = frame.volume(frame.trimmed(self.state.known), slices, inner=True)
        self.gap, self.missing = max(0.0, whole - self.own), max(0.0, known - self.own)
        self.measured = self.state.made

    def _lower(self) -> Curves:
        """Curves that no motion in the box is better than: those of open cells, and what is known less rounding."""
        known = self.state.known
        known = Curves(known.constants * (1.0 - MARGIN), known.least * (1.0 - MARGIN), known.most * (1.0 + MARGIN))
        if self.frame.time_at is not None:
            known.constants[:, self.frame.time_at] = 1.0
        curves = self.frame.trimmed(frame_curves(self.state.cells).with_others(known))
        return curves[undominated(curves)]

    def _write(self) -> None:
        if self.file is None:
            return
        state = self.state
        about = {"format": _FORMAT, "version": _VERSION, "front": self.front.digest}
        about |= {"steps": state.steps, "made": state.made, "spent": self.spent, "measured": self.measured}
        arrays: dict[str, Any] = {"corner": self.frame.corner, "depths": state.depths}
        arrays |= {f"cells_{field.name}": getattr(state.cells, field.name) for field in fields(RatioCells)}
        arrays |= {f"known_{field.name}": getattr(state.known, field.name) for field in fields(Curves)}
        stream = io.BytesIO()
        np.savez_compressed(stream, allow_pickle=False, about=np.array(json.dumps(about)), **arrays)
        try:
            write_whole(self.file, stream.getbuffer())
        except OSError as error:
            raise InvalidInputError(f"{self.file}: cannot be written: {why_not(error)}") from error


def _kept(file: Path, digest: str) -> tuple[dict[str, Array], dict[str, Any]] | None:
    """Arrays of a file, and what it says about them; None if it is of another front or version."""
    if not file.exists():
        return None
    try:
        arrays = read_arrays(file)
        about = from_json(str(arrays["about"]))
        fits = (about["format"], about["version"], about["front"]) == (_FORMAT, _VERSION, digest)
    except (KeyError, ValueError, TypeError, OSError, InvalidInputError) as error:
        warnings.warn(f"{file}: a bound that was kept cannot be read and counts as none: {error}", stacklevel=3)
        return None
    return (arrays, about) if fits else None


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


def _better(frame: Frame, curves: Curves, F: Array) -> Array:
    """By what share curves are better than solutions in all objectives at once, at most, (N,)."""
    found = np.full(len(F), np.nan)
    rows, others = np.flatnonzero((frame.corner >= F).all(axis=1)), frame.others
    step = max(1, _TOGETHER // max(1, len(curves)))
    for first in range(0, len(rows), step):
        part = F[rows[first : first + step]]
        pace = np.broadcast_to(curves.most, (len(part), len(curves)))
        if frame.time_at is not None:
            # The duration's own ratio falls with it, all others rise: the least of all is greatest where they meet.
            own = part[:, frame.time_at, None]
            meets = [
                (curves.constants[:, k] * own / part[:, k, None]) ** (1.0 / (1.0 - frame.powers[k])) for k in others
            ]
            pace = np.clip(np.max(meets, axis=0) if meets else curves.least, curves.least, curves.most)
        with np.errstate(divide="ignore"):  # of a cell of which nothing is known yet
            ratios = [part[:, k, None] / (curves.constants[:, k] * pace ** frame.powers[k]) for k in others]
        if frame.time_at is not None:
            ratios.append(own / pace)
        found[rows[first : first + step]] = np.maximum(np.min(ratios, axis=0).max(axis=1) - 1.0, 0.0)
    return found


def _best_rows(values: Array) -> Array:
    curves = Curves(values, np.zeros(len(values)), np.zeros(len(values)))
    return undominated(curves)


def _corner(front: Front, given: Any) -> Array:
    own = front.problem.reference_point
    if given is None:
        return np.array(own) if own is not None else 1.1 * front.F.max(axis=0)
    corner = numbers(given, name="corner", shape=(front.F.shape[1],))
    if not (corner > 0.0).all():
        raise InvalidInputError(f"corner: expected positive numbers, got {corner.tolist()}")
    return corner


def _kind(question: Question) -> str:
    interpolant: Any = question.problem.interpolant
    form = f" ({interpolant.form})" if hasattr(interpolant, "form") else ""
    low, high = question.durations
    return (
        f"motions of {type(interpolant).__name__}{form} through {len(question.positions)} points, from {low:g} to "
        f"{high:g} s in each segment"
    )


def _checked(name: str, given: Any, low: float, high: float) -> None:
    number = isinstance(given, int | float | np.floating | np.integer) and not isinstance(given, bool)
    if not number or not low <= given <= high:
        raise InvalidInputError(f"{name}: expected a number from {low:g} to {high:g}, got {given!r}")
