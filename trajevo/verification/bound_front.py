"""How good a front is at best: a search for what no motion can be better than, which can be stopped at any time."""

from __future__ import annotations

import io
import json
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.base.files import why_not, write_whole
from trajevo.base.plain import from_json, read_arrays
from trajevo.base.signals import Stopping
from trajevo.errors import InvalidInputError, NoSolutionError
from trajevo.front.front import Front
from trajevo.trajectory.interpolants import LinearReparameterisation, Reparameterisation
from trajevo.verification.bounds.ratio_search import RatioSearch
from trajevo.verification.front_bound import FrontBound, FrontSearch, corner_of
from trajevo.verification.path_bounds.weight_search import WeightSearch

#: Format and version of the file in which a search is kept.
_FORMAT, _VERSION = "trajevo bound", 2

#: Ending of its name beside that of the front.
BOUND_SUFFIX = ".bound.npz"

#: CPU time between two writings [s].
_WRITTEN = 15.0

#: Bounds of the wanted gap, as a share of the box.
_GAPS = (1e-4, 1.0)


def bound_front(
    front: Front,
    *,
    gap: float = 0.01,
    cpu_time: float = 600.0,
    corner: Any = None,
    file: str | Path | None = None,
    tell: Callable[[str], None] | None = None,
) -> FrontBound:
    """Bound a front from below: what no motion can be better than, and what the front misses at most.

    Where the variables are segment times, it is branch and bound over all their ratios: objectives are enclosed over
    boxes of the logarithms of these, and the duration itself needs no box, since objectives and limits are powers of
    it (docs/explanation/bounds.md). Along a fixed path it is a convex relaxation over all time laws, with more weights
    of both objectives and finer cells of the path until the gap is small (docs/explanation/path_bounds.md).

    The first Ctrl-C, or a limit of CPU time, ends the search with what is proven by then.

    Args:
        front: a front whose variables are the segment times of motions from rest to rest, with objectives among time,
            acceleration, jerk, square_acceleration, square_jerk, peak_acceleration and peak_jerk; or one along a fixed
            path, of the time and the integral of the squared jerk or effort.
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
    along = isinstance(front.problem.interpolant, Reparameterisation | LinearReparameterisation)
    box = corner_of(front, corner)
    search: FrontSearch = WeightSearch(front, box) if along else RatioSearch(front, box)
    keeper = _Keeper(None if file is None else Path(file), search, front.digest, box)
    ended = _run(search, keeper, float(gap), float(cpu_time), tell)
    return _bound(front, box, search, keeper.spent, ended)


class _Keeper:
    """The file of a search, if it has one, and the CPU time that was spent on it."""

    def __init__(self, file: Path | None, search: FrontSearch, digest: str, corner: Array) -> None:
        self.file, self.search, self.corner = file, search, corner
        self.identity = {"format": _FORMAT, "version": _VERSION, "method": search.method, "front": digest}
        self.spent = 0.0
        if file is not None and file.exists():
            self._read(file)

    def _read(self, file: Path) -> None:
        """Go on from what the file keeps, if it is of this front, in the same way and the same box."""
        try:
            arrays = read_arrays(file)
            about = from_json(str(arrays["about"]))
            fits = all(about.get(name) == value for name, value in self.identity.items())
            if fits and np.array_equal(arrays["corner"], self.corner):
                self.search.go_on(about, arrays)
                self.spent = float(about["spent"])
        except (KeyError, ValueError, TypeError, OSError, AttributeError, InvalidInputError) as error:
            told = f"{file}: a bound that was kept cannot be read and counts as none: {error}"
            warnings.warn(told, stacklevel=4)

    def write(self) -> None:
        """Write where the search stands."""
        if self.file is None:
            return
        about, arrays = self.search.kept()
        told = json.dumps(self.identity | about | {"spent": self.spent})
        stream = io.BytesIO()
        np.savez_compressed(stream, allow_pickle=False, about=np.array(told), corner=self.corner, **arrays)
        try:
            write_whole(self.file, stream.getbuffer())
        except OSError as error:
            raise InvalidInputError(f"{self.file}: cannot be written: {why_not(error)}") from error


def _run(search: FrontSearch, keeper: _Keeper, gap: float, cpu_time: float, tell: Callable[[str], None] | None) -> str:
    """Search until one of the ends is reached, and say which."""
    began, written, told = time.process_time() - keeper.spent, keeper.spent, search.gap

    def spent() -> float:
        return time.process_time() - began

    with Stopping() as stopping:
        while True:
            keeper.spent = spent()
            ended = _end(search, gap) or ("stopped" if stopping else "cpu-time" if keeper.spent >= cpu_time else "")
            if ended:
                break
            if not search.step(lambda: bool(stopping) or spent() >= cpu_time):
                ended = "nothing left"
                break
            if tell is not None and search.gap != told:
                told = search.gap
                tell(f"{search.cells} cells  gap at most {100.0 * told:.3g} %  {spent():.0f} s of CPU")
            if spent() - written > _WRITTEN:
                keeper.spent = written = spent()
                keeper.write()
        search.finish()
        keeper.spent = spent()
        keeper.write()
    return ended


def _end(search: FrontSearch, gap: float) -> str:
    return "gap" if search.gap <= gap else "missing" if search.missing > gap else ""


def _bound(front: Front, corner: Array, search: FrontSearch, spent: float, ended: str) -> FrontBound:
    """The record of what was found."""
    kind, below, lower, upper, left_out = search.found()
    better = np.full(len(front.F), np.nan)
    inside = (corner >= front.F).all(axis=1)
    better[inside] = below.better(front.F[inside], corner)
    return FrontBound(
        kind=kind,
        names=tuple(front.objective_names),
        units=tuple(one.unit for one in front.record.objectives),
        corner=frozen(corner),
        below=below,
        lower=frozen(lower),
        upper=frozen(np.minimum(upper, front.F.min(axis=0))),
        gap=search.gap,
        missing=search.missing,
        better=frozen(better),
        cells=search.cells,
        cpu_time=spent,
        ended=ended,
        left_out=left_out,
        front=front.digest,
    )


def _checked(name: str, given: Any, low: float, high: float) -> None:
    number = isinstance(given, int | float | np.floating | np.integer) and not isinstance(given, bool)
    if not number or not low <= given <= high:
        raise InvalidInputError(f"{name}: expected a number from {low:g} to {high:g}, got {given!r}")
