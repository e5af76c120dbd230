"""Quintic and septic splines over boxes of segment times: pieces near them, and how far splines can be from these."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from math import comb, factorial
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.trajectory.interpolants.hermite import hermite_matrix
from trajevo.verification.bounds.enclosed import Enclosed, joined, stacked
from trajevo.verification.bounds.pieces import Apart, ShapePieces, Times
from trajevo.verification.bounds.series import near_solution

#: Greatest half widths of boxes of quintic and septic splines, by r.
_WIDEST = {3: 0.1, 4: 0.05}


@final
@dataclass(frozen=True, eq=False)
class OddSpline:
    """The spline of degree 2r - 1: states at inner points by continuity, see :func:`hermite.odd_spline`.

    The unit of time of a point's state, and of the continuity there, is the geometric mean of both its segments.
    """

    positions: Array
    r: int
    degree: int = 4

    @property
    def widest(self) -> float:
        """Greatest half width of which anything is told."""
        return _WIDEST[self.r]

    def __call__(self, times: Times) -> ShapePieces:
        """Pieces near the spline and how far it can be from them; times must be series."""
        if times.segments == 1:
            return self._pieces(times.known(np.zeros((0, self.positions.shape[1]))), times)
        pieces = self._pieces(near_solution(*self._system(times)), times)
        return replace(pieces, apart=self._apart(pieces, times))

    def _pieces(self, rows: Enclosed, times: Times) -> ShapePieces:
        """Segments from states at the inner points, (B, (K - 2) (r - 1), n_joints), each in its unit of time."""
        before, after = self._states(rows, times)
        place = times.known(self.positions).shaped(-1)
        states = joined([joined([place[:-1], after], -1), joined([place[1:], before], -1)], -1)
        rates = stacked([times.product({k: -1.0}) for k in range(times.segments)])
        hermite = hermite_matrix(self.r)
        return ShapePieces(states.through(hermite), rates, None, states, hermite)

    def _apart(self, pieces: ShapePieces, times: Times) -> Apart:
        """How far the spline can be from motions through the same points whose derivative r - 1 is continuous.

        The spline has the least ∫ of the square of derivative r of all of them. So (Prager and Synge 1947) that of the
        difference is at most that of the distance between theirs and any function w of degree r - 1 in each segment
        with r - 2 continuous derivatives: the spline's own derivative r is the one w that is orthogonal to all
        differences, and nearest. Here w has nearly the spline's derivative 2r - 2 at points, and at the start nearly
        its lower ones.
        """
        r, segments = self.r, times.segments
        own: Any = pieces.through(_derivatives(r))  # derivatives r to 2r - 1 at the beginnings, in own units
        tip = [own[k, :, r - 2] for k in range(segments)]
        end = own[segments - 1, :, r - 2] + own[segments - 1, :, r - 1]
        knots = [one.polynomial for one in (*tip, end)]
        units = [*range(segments), segments - 1]
        w = [own[0, :, k].polynomial for k in range(r - 2)]
        whole = np.zeros((len(times), self.positions.shape[1]))
        total = times.total
        for k in range(segments):
            ratio = times.product({k: 2.0 * r - 2.0, units[k + 1]: 2.0 - 2.0 * r}).shaped(-1)
            last = knots[k + 1] * ratio if units[k + 1] != k else knots[k + 1]
            series = stacked([*w, knots[k], last - knots[k]])
            # In Legendre polynomials, of which the squares' integrals add up.
            part = pieces.through(_legendre(r) @ _derivatives(r))[k] - series.through(_legendre(r))
            scale = times.product({k: 0.5 - r}) * total.to_power(r - 0.5)
            middle, radius = (part * scale.shaped(-1, -2)).over_box
            whole += ((np.abs(middle) + radius) ** 2).sum(axis=-1)
            if k + 1 < segments:
                moved = [series.through(_shift(r)[j : j + 1])[:, 0] for j in range(r - 2)]
                w = [
                    one * times.product({k: -float(r + j), k + 1: float(r + j)}).shaped(-1)
                    for j, one in enumerate(moved)
                ]
        return Apart(r, np.sqrt(whole) * (1.0 + 1e-9))

    def _states(self, found: Enclosed, times: Times) -> tuple[Enclosed, Enclosed]:
        """Taylor coefficients 1 to r - 1 at the end and the beginning of each segment, in its own unit of time."""
        r, inner = self.r, times.segments - 1
        rest = times.known(np.zeros((self.positions.shape[1], r - 1)))
        if not inner:
            return rest.shaped(-3), rest.shaped(-3)
        ends: list[Enclosed] = []
        begins = [rest]
        for i in range(inner):
            rows = [found[i * (r - 1) + k] for k in range(r - 1)]
            for side, sign in ((ends, -0.5), (begins, 0.5)):
                units = [times.product({i: -sign * k, i + 1: sign * k}).shaped(-1) for k in range(1, r)]
                side.append(stacked([row * unit for row, unit in zip(rows, units, strict=True)]))
        return stacked([*ends, rest], -3), stacked(begins, -3)

    def _system(self, times: Times) -> tuple[Enclosed, Enclosed]:
        """Derivatives r to 2r - 2 at the end of each segment less those at the beginning of the next."""
        r, inner = self.r, times.segments - 1
        at_start = hermite_matrix(r)[r : 2 * r - 1]
        shift = np.array([[comb(power, k) for power in range(2 * r)] for k in range(r, 2 * r - 1)], dtype=np.float64)
        at_end, chords = shift @ hermite_matrix(r), np.diff(self.positions, axis=0)
        size = inner * (r - 1)
        entries = [[times.known(0.0)] * size for _ in range(size)]
        drives = []
        for i in range(inner):
            for row, order in enumerate(range(r, 2 * r - 1)):
                line, half = entries[i * (r - 1) + row], 0.5 * order
                # The unit of the point is (d_i d_i+1)^(1/2): in it a segment's derivatives are (unit / d)^order.
                for k in range(1, r):
                    place, own = i * (r - 1) + k - 1, 0.5 * (order - k)
                    earlier, later = times.product({i: -own, i + 1: own}), times.product({i: own, i + 1: -own})
                    line[place] = earlier.times(at_end[row, r + k]) - later.times(at_start[row, k])
                    if i > 0:
                        unit = {i - 1: -0.5 * k, i: 0.5 * k - half, i + 1: half}
                        line[place - r + 1] = times.product(unit).times(at_end[row, k])
                    if i + 1 < inner:
                        unit = {i: half, i + 1: 0.5 * k - half, i + 2: -0.5 * k}
                        line[place + r - 1] = times.product(unit).times(-at_start[row, r + k])
                earlier, later = times.product({i: -half, i + 1: half}), times.product({i: half, i + 1: -half})
                drive = later.shaped(-1).times(at_start[row, r] * chords[i + 1])
                drives.append(drive + earlier.shaped(-1).times(at_end[row, 0] * chords[i]))
        return stacked([stacked(line) for line in entries], -2), stacked(drives, -2)


def _derivatives(r: int) -> Array:
    """Derivatives r to 2r - 1 at the beginning from power coefficients, (r, 2r)."""
    found = np.zeros((r, 2 * r))
    for k in range(r):
        found[k, r + k] = factorial(r + k)
    return found


def _shift(r: int) -> Array:
    """Derivatives 0 to r - 1 at 1 from those at 0 of a polynomial of degree r - 1."""
    return np.array([[1.0 / factorial(m - j) if m >= j else 0.0 for m in range(r)] for j in range(r)])


@cache
def _legendre(r: int) -> Array:
    """Coefficients of orthonormal Legendre polynomials on [0, 1] from derivatives 0 to r - 1 at 0."""
    nodes, weights = np.polynomial.legendre.leggauss(r)
    values = np.polynomial.legendre.legvander(nodes, r - 1) * np.sqrt(2.0 * np.arange(r) + 1.0)
    return frozen((values * (0.5 * weights)[:, None]).T @ _taylor(0.5 * (nodes + 1.0), r))


def _taylor(at: Array, r: int) -> Array:
    """Values from derivatives 0 to r - 1 at 0, (len(at), r)."""
    return np.stack([at**k / factorial(k) for k in range(r)], axis=-1)
