"""Values that motions can have at best as curves, one for each shape of motion or cell of shapes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.verification.bounds.curves import Curves, Frame, undominated
from trajevo.verification.bounds.question import MARGIN
from trajevo.verification.front_bound import LowerSet

#: Lower points and solutions that are compared together.
_TOGETHER = 4_000_000


@final
@dataclass(frozen=True, eq=False)
class LowerCurves(LowerSet):
    """Every motion whose objectives lie in the box is at least as bad in all of them as some point of a curve.

    On a curve objective i is ``constants[:, i]`` times the duration to the power ``powers[i]``.

    Attributes:
        powers: powers of the duration, (n_obj,) [1].
        constants: of K curves, (K, n_obj) [SI, for a duration of 1 s].
        least: least duration on each curve, (K,) [s].
        most: greatest duration on each curve, (K,) [s].
    """

    powers: Array
    constants: Array
    least: Array
    most: Array

    __repr__ = brief

    def points(self, corner: Array, count: int) -> Array:
        """Lower points, by slices of durations."""
        frame, found = self._frame(corner), []
        curves = Curves(self.constants, self.least, self.most)
        slices = frame.slices(count + 1, float(self.least.min(initial=np.inf)))
        for k, duration in enumerate(slices[1:] if frame.time_at is not None else slices):
            begun = curves[curves.least <= duration]
            values = frame.values(begun, np.full(len(begun), duration))
            if frame.time_at is not None:
                values[:, frame.time_at] = slices[k]
            values = values[(values <= corner).all(axis=1)]
            found.append(values[_best_rows(values)])
        return np.concatenate(found)

    def excludes(self, F: Array, corner: Array) -> Array:
        """Which values no motion can have."""
        found, frame = np.zeros(len(F), dtype=bool), self._frame(corner)
        step = max(1, _TOGETHER // max(1, len(self.least)))
        for first in range(0, len(F), step):
            part = F[first : first + step]
            time_at = frame.time_at
            durations = part[:, time_at, None] if time_at is not None else np.full((len(part), 1), np.inf)
            reached = self.least <= durations * (1.0 + MARGIN)
            paces = np.minimum(self.most, durations)
            for k in frame.others:
                reached &= self.constants[:, k] * paces ** self.powers[k] <= part[:, k, None] * (1.0 + MARGIN)
            found[first : first + step] = ~reached.any(axis=1)
        return found

    def better(self, F: Array, corner: Array) -> Array:
        """By what share a motion can be better."""
        frame, found = self._frame(corner), np.zeros(len(F))
        others, step = frame.others, max(1, _TOGETHER // max(1, len(self.least)))
        for first in range(0, len(F), step):
            part = F[first : first + step]
            pace = np.broadcast_to(self.most, (len(part), len(self.most)))
            if frame.time_at is not None:
                # The duration's own ratio falls with it, all others rise: the least of all is greatest where they meet.
                own = part[:, frame.time_at, None]
                meets = [
                    (self.constants[:, k] * own / part[:, k, None]) ** (1.0 / (1.0 - self.powers[k])) for k in others
                ]
                pace = np.clip(np.max(meets, axis=0) if meets else self.least, self.least, self.most)
            ratios = [self.constants[:, k] * pace ** self.powers[k] / part[:, k, None] for k in others]
            if frame.time_at is not None:
                ratios.append(pace / own)
            found[first : first + step] = 1.0 - np.max(ratios, axis=0).min(axis=1, initial=1.0)
        return found

    def _frame(self, corner: Array) -> Frame:
        time_at = next((k for k, power in enumerate(self.powers) if power > 0.0), None)
        return Frame(self.powers, corner, time_at)


def _best_rows(values: Array) -> Array:
    curves = Curves(values, np.zeros(len(values)), np.zeros(len(values)))
    return undominated(curves)
