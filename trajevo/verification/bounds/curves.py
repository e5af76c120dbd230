"""Curves of objective values, one for each shape of motion as its duration grows, and what they dominate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, final

import moocore
import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief

#: RatioCells and curves that are compared together.
_TOGETHER = 4_000_000

#: Share of the box by which motions that are compared may take longer.
_LATER = 5e-4


@final
@dataclass(frozen=True, eq=False)
class Curves:
    """N curves: objective i of a motion of duration T is ``constants[:, i] * T ** powers[i]``.

    Attributes:
        constants: shape (N, n_obj); 1 for the duration itself.
        least: least duration, (N,) [s].
        most: greatest duration, (N,) [s].
    """

    constants: Array
    least: Array
    most: Array

    __repr__ = brief

    def __len__(self) -> int:
        return len(self.least)

    def __getitem__(self, rows: Any) -> Curves:
        return Curves(self.constants[rows], self.least[rows], self.most[rows])

    def with_others(self, others: Curves) -> Curves:
        """These curves and then others."""
        pairs = zip((self.constants, self.least, self.most), (others.constants, others.least, others.most), strict=True)
        return Curves(*(np.concatenate(pair) for pair in pairs))

    def real(self) -> Curves:
        """Those that have a motion."""
        return self[self.least <= self.most]


@final
@dataclass(frozen=True, eq=False)
class Frame:
    """The box of objective values in which curves are compared.

    Attributes:
        powers: powers of the duration in the objectives, (n_obj,).
        corner: far corner of the box from 0, (n_obj,) [SI].
        time_at: which objective is the duration, or None.
    """

    powers: Array
    corner: Array
    time_at: int | None

    __repr__ = brief

    @property
    def others(self) -> Array:
        """The objectives that are not the duration."""
        return np.array([k for k in range(len(self.powers)) if k != self.time_at], dtype=np.intp)

    def trimmed(self, curves: Curves) -> Curves:
        """Only what of curves lies in the box."""
        return self.clipped(curves).real()

    def clipped(self, curves: Curves) -> Curves:
        """The part of each curve that lies in the box; without any, its least duration is above the greatest."""
        least, most = curves.least, curves.most
        if self.time_at is not None:
            most = np.minimum(most, self.corner[self.time_at])
        for k in self.others:
            # Other objectives fall with the duration: they are below their corner from one duration on.
            least = np.maximum(least, (curves.constants[:, k] / self.corner[k]) ** (-1.0 / self.powers[k]))
        return Curves(curves.constants, least, most)

    def at(self, curves: Curves, duration: float) -> tuple[Array, Array]:
        """Which curves have begun, and their best other objectives within a duration as shares of the box, (M, k)."""
        begun = np.flatnonzero(curves.least <= duration)
        paces = np.minimum(curves.most[begun], duration)[:, None]
        others = self.others
        return begun, curves.constants[begun][:, others] * paces ** self.powers[others] / self.corner[others]

    def slices(self, count: int, first: float) -> Array:
        """Durations from a first one to the box's corner; one that none exceeds if the duration is no objective."""
        if self.time_at is None:
            return np.array([np.finfo(float).max])
        return np.linspace(min(first, self.corner[self.time_at]), self.corner[self.time_at], count)

    def volume(self, curves: Curves, slices: Array, *, inner: bool) -> float:
        """Share of the box that curves dominate: at least if ``inner``, else at most, by the areas of slices."""
        areas = np.array([_area(self.at(curves, duration)[1]) for duration in slices])
        if self.time_at is None:
            return float(areas[-1])
        widths = np.diff(slices) / self.corner[self.time_at]
        return float(widths @ (areas[:-1] if inner else areas[1:]))

    def values(self, curves: Curves, durations: Array) -> Array:
        """Objective values of curves at durations, (N, n_obj)."""
        paces = np.clip(durations, curves.least, curves.most)
        return np.asarray(curves.constants * paces[:, None] ** self.powers)

    def best(self, curves: Curves) -> Array:
        """The least value of every objective on every curve, (N, n_obj)."""
        found = curves.constants * curves.most[:, None] ** self.powers
        if self.time_at is not None:
            found[:, self.time_at] = curves.least
        return np.asarray(found)


def _area(shares: Array) -> float:
    """Share of the box that points (M, k) dominate, all as shares of the corner."""
    inside = shares[(shares < 1.0).all(axis=1)]
    if not len(inside):
        return 0.0
    if not inside.shape[1]:
        return 1.0
    return float(moocore.hypervolume(inside, ref=np.ones(inside.shape[1])))


def undominated(curves: Curves) -> Array:
    """Rows of curves that no other one is at least as good as at every duration."""
    keys = np.column_stack([curves.constants, curves.least, -curves.most])
    varying = np.ptp(keys, axis=0) > 0.0 if len(keys) else np.zeros(keys.shape[1], dtype=bool)
    if not varying.any():
        return np.arange(min(len(curves), 1))
    return np.flatnonzero(moocore.is_nondominated(np.ascontiguousarray(keys[:, varying]), keep_weakly=False))


def dominated(curves: Curves, by: Curves) -> Array:
    """Whether one of some curves is at least as good as a curve at every duration of that curve, (N,)."""
    found = np.zeros(len(curves), dtype=bool)
    if not len(by):
        return found
    step = max(1, _TOGETHER // len(by))
    for first in range(0, len(curves), step):
        part = curves[slice(first, first + step)]
        better = (by.least <= part.least[:, None]) & (by.most >= part.most[:, None])
        for k in range(part.constants.shape[1]):
            better &= by.constants[:, k] <= part.constants[:, k, None]
        found[first : first + step] = better.any(axis=1)
    return found


def depth(frame: Frame, curves: Curves, known: Curves, slices: Array) -> Array:
    """How far curves lie below known ones at most, in every objective at once, as shares of the box, (N,)."""
    found = np.zeros(len(curves))
    for duration in slices:
        rows, points = frame.at(curves, duration)
        if not len(rows):
            continue
        inside = np.minimum(1.0 - points, 1.0).min(axis=1, initial=1.0)  # nothing is gained outside the box
        deep = np.minimum(inside, _below(points, frame.at(known, duration)[1]))
        if frame.time_at is not None:  # what takes a little longer counts too: no motion may be known to be as fast
            later = frame.at(known, duration + _LATER * frame.corner[frame.time_at])[1]
            deep = np.minimum(deep, np.maximum(_below(points, later), _LATER))
        found[rows] = np.maximum(found[rows], deep)
    return found


def _below(points: Array, upper: Array) -> Array:
    """For each point the least of all upper points' greatest excess, (M,)."""
    if not len(upper):
        return np.ones(len(points))
    if points.shape[1] == 0:
        return np.zeros(len(points))
    if points.shape[1] == 1:
        return np.asarray(upper.min() - points[:, 0])
    kept = upper[moocore.is_nondominated(upper)] if len(upper) > 1 else upper
    if points.shape[1] == 2:
        order = np.argsort(kept[:, 0])
        a, b = kept[order].T
        # Along the stairs a rises and b falls: the excess is least where a - b passes that of the point.
        right = np.clip(np.searchsorted(a - b, points[:, 0] - points[:, 1]), 0, len(a) - 1)
        left = np.maximum(right - 1, 0)
        both = [np.maximum(a[at] - points[:, 0], b[at] - points[:, 1]) for at in (left, right)]
        return np.asarray(np.minimum(*both))
    best = np.full(len(points), np.inf)
    for one in kept:
        best = np.minimum(best, (one - points).max(axis=1))
    return best
