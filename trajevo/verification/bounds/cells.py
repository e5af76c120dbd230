"""Bounds from below of all motions whose ratios of segment times lie in a cell, for thousands of cells at once."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cache
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.base.shown.brief import brief
from trajevo.verification.bounds.enclosed import Enclosed
from trajevo.verification.bounds.pieces import ShapePieces, Times
from trajevo.verification.bounds.question import MARGIN, Question

#: Instants of each piece between which its peaks are looked for; where a peak is need not be known exactly.
_LOOKED = 17

#: RatioCells that are enclosed together.
_TOGETHER = 512


@final
@dataclass(frozen=True, eq=False)
class RatioCells:
    """N boxes of the logarithms of ratios of segment times, with what no motion in them can be better than.

    Attributes:
        low: least logarithms, shape (N, n).
        high: greatest logarithms, shape (N, n).
        constants: bounds of the objectives' constants from below, (N, n_obj).
        least: bound of the duration from below, (N,) [s].
        most: bound of the duration from above, (N,) [s].
        split: the variable along which to split each cell, (N,).
    """

    low: Array
    high: Array
    constants: Array
    least: Array
    most: Array
    split: Array

    __repr__ = brief

    def __len__(self) -> int:
        return len(self.low)

    def __getitem__(self, rows: Any) -> RatioCells:
        return RatioCells(*(getattr(self, field.name)[rows] for field in fields(self)))

    def with_others(self, others: RatioCells) -> RatioCells:
        """These cells and then others."""
        return RatioCells(*(np.concatenate([getattr(self, f.name), getattr(others, f.name)]) for f in fields(self)))

    def halves(self) -> tuple[Array, Array]:
        """Both halves of every cell, ends (2 N, n)."""
        rows = np.arange(len(self))
        middle = 0.5 * (self.low[rows, self.split] + self.high[rows, self.split])
        upper, lower = self.high.copy(), self.low.copy()
        upper[rows, self.split] = lower[rows, self.split] = middle
        return np.concatenate([self.low, lower]), np.concatenate([upper, self.high])


def coarse_cells(question: Question, low: Array, high: Array) -> RatioCells:
    """Bounds that hold for all motions through the points at given times, whatever the interpolant.

    The least integral of the square of an acceleration through points from rest to rest is the greatest value of its
    dual, which for fixed multipliers is a sum over segments. Multipliers that are best at the middle of a cell lose
    little elsewhere. An acceleration that begins and ends with 0 and has the mean 0 has a root mean square of at most
    1/(2π) times that of the jerk, for the unit of time.
    """
    shares = _shares(low, high)
    least = (question.durations[0] / shares[1]).max(axis=1)
    most = (question.durations[1] / shares[0]).min(axis=1)
    chords = np.diff(question.positions, axis=0)
    if 1 in question.limits:
        slowest = np.where(chords < 0.0, question.limits[1][0], question.limits[1][1])
        least = np.maximum(least, ((np.abs(chords) / slowest).max(axis=1) / shares[1]).max(axis=1))
    rms = _least_rms(chords, shares) if question.joined else np.zeros((len(low), chords.shape[1]))
    if 2 in question.limits:
        least = np.maximum(least, np.sqrt((rms / question.limits[2].max(axis=0)).max(axis=1)))
    columns = []
    for one in question.objectives:
        size = rms * (2.0 * np.pi) ** (one.derivative - 2)
        value = {
            "time": np.ones(len(low)),
            "rms": size.sum(axis=1),
            "integral": (size**2).sum(axis=1),
            "peak": size.max(axis=1),
        }
        columns.append(value[one.form] * (1.0 if one.form == "time" else 1.0 - MARGIN))
    widest = (high - low).argmax(axis=1)
    return RatioCells(low, high, np.stack(columns, axis=1), least * (1.0 - MARGIN), most * (1.0 + MARGIN), widest)


def _shares(low: Array, high: Array) -> Array:
    """Least and greatest segment times as shares of the duration, (2, N, n_segments)."""
    inverse = []
    for ends in ((low, high), (high, low)):
        ahead, behind = (np.concatenate([np.zeros((len(low), 1)), np.cumsum(one, axis=1)], axis=1) for one in ends)
        total = np.zeros_like(ahead)
        for k in range(ahead.shape[1]):
            for other in range(ahead.shape[1]):
                # log d_other - log d_k, a sum of the variables between them or minus it.
                apart = ahead[:, other] - ahead[:, k] if other >= k else behind[:, other] - behind[:, k]
                total[:, k] += np.exp(apart)
        inverse.append(total)
    return np.stack([(1.0 - MARGIN) / inverse[1], (1.0 + MARGIN) / inverse[0]])


def _least_rms(chords: Array, shares: Array) -> Array:
    """Bounds of the root mean square acceleration of every joint in the unit of time, (N, n_joints)."""
    middle = np.sqrt(shares[0] * shares[1])
    count = middle.shape[1] + 1
    gram, rows = np.zeros((len(middle), count, count)), np.arange(count - 1)
    for a, b, factor in ((0, 0, 1 / 3), (1, 1, 1 / 3), (0, 1, 1 / 6), (1, 0, 1 / 6)):
        gram[:, rows + a, rows + b] += factor * middle
    slopes = chords / middle[..., None]
    drive = np.zeros((len(middle), count, chords.shape[1]))
    drive[:, :-1] += slopes
    drive[:, 1:] -= slopes
    nodes = np.linalg.solve(gram, drive)
    first, second = nodes[:, :-1], nodes[:, 1:]
    gain = 2.0 * (first - second) * chords
    price = (first**2 + first * second + second**2) / 3.0
    rate = -gain / middle[..., None] ** 2 - price  # of the dual with each share
    width = (shares[1] - shares[0])[..., None]
    even = -(rate * width).sum(axis=1, keepdims=True) / width.sum(axis=1, keepdims=True)
    best = np.zeros((len(middle), chords.shape[1]))
    for multiplier in (0.0, even):  # shares sum to 1
        slope = multiplier - price
        with np.errstate(invalid="ignore", divide="ignore"):
            inside = np.where((gain > 0.0) & (slope > 0.0), np.sqrt(gain / slope), shares[1][..., None])
        places = (
            shares[0][..., None],
            shares[1][..., None],
            np.clip(inside, shares[0][..., None], shares[1][..., None]),
        )
        values = np.min([gain / place + slope * place for place in places], axis=0)
        loss = 1e-12 * (np.abs(gain) / shares[0][..., None] + np.abs(slope)).sum(axis=1)
        best = np.maximum(best, values.sum(axis=1) - np.broadcast_to(multiplier, values.shape)[:, 0] - loss)
    return np.asarray(np.sqrt(best))


def fine_cells(question: Question, cells: RatioCells) -> RatioCells:
    """The same cells with the bounds of the interpolant's own motions, where they are better."""
    narrow = np.flatnonzero((cells.high - cells.low).max(axis=1) <= 2.0 * question.shape.widest)
    for first in range(0, len(narrow), _TOGETHER):
        rows = narrow[first : first + _TOGETHER]
        with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
            found = _enclosed(question, cells.low[rows], cells.high[rows])
        constants, least, split, out = found
        cells.constants[rows] = np.fmax(cells.constants[rows], constants)
        cells.least[rows] = np.fmax(cells.least[rows], least)
        cells.most[rows] = np.where(out, -np.inf, cells.most[rows])
        cells.split[rows] = np.where(split >= 0, split, cells.split[rows])
    return cells


def _enclosed(question: Question, low: Array, high: Array) -> tuple[Array, Array, Array, Array]:
    """Bounds of constants (B, n_obj) and durations (B,), NaN where unknown; where to split, or -1; what is outside."""
    times = Times(low, high, degree=question.shape.degree)
    pieces, total = question.shape(times), times.total
    influence = np.zeros_like(low)
    constants = np.ones((len(low), len(question.objectives)))
    energies: dict[int, Enclosed] = {}
    terms: dict[int, Enclosed] = {}
    for k, one in enumerate(question.objectives):
        if one.form == "time":
            continue
        if one.form == "peak":
            constants[:, k] = _greatest(_peaks(pieces, total, one.derivative, terms), None, influence)
            continue
        if one.derivative not in energies:
            energies[one.derivative] = _energies(pieces, one.derivative, question)
        energy = energies[one.derivative]
        scale = total.to_power(2.0 * one.derivative - 1.0)
        size = np.sqrt(np.maximum((energy * scale.shaped(-1)).low, 0.0))
        lost = _lost(pieces, one.derivative, size, question)
        if one.form == "rms":
            whole = energy.to_power(0.5).summed() * total.to_power(one.derivative - 0.5)
            found = np.fmax(
                np.fmax(whole.low, _by_chords(energy * scale.shaped(-1))) - lost.sum(axis=1), (size - lost).sum(axis=1)
            )
        else:
            whole = energy.summed() * scale
            alone = ((size - lost) ** 2).sum(axis=1)
            found = alone if pieces.apart is not None else np.fmax(whole.low, alone)
        constants[:, k] = found * (1.0 - MARGIN)
        influence += whole.influence
    least = np.full(len(low), np.nan)
    for order, limit in question.limits.items():
        if np.isfinite(limit).any():
            used = _greatest(_peaks(pieces, total, order, terms), limit, influence)
            least = np.fmax(least, np.maximum(used, 0.0) ** (1.0 / order) * (1.0 - MARGIN))
    out = _outside(pieces, question.range)
    split = np.where(np.isfinite(influence).all(axis=1) & (influence > 0.0).any(axis=1), influence.argmax(axis=1), -1)
    return constants, least, split, out


def _by_chords(squares: Any) -> Array:
    """Bound of the sum of roots from below: a root is above its chord, which keeps what squares have in common."""
    middle, radius = squares.over_box
    low, high = np.maximum(squares.low, 0.0), middle + radius
    ends = np.sqrt(low), np.sqrt(high)
    steep = 1.0 / (ends[0] + ends[1])
    return np.asarray((squares.weighed(steep).low + (ends[0] - low * steep).sum(axis=1)) * (1.0 - 1e-13))


def _lost(pieces: ShapePieces, order: int, size: Array, question: Question) -> Array:
    """By how much the root mean square of a derivative can be below that of the pieces, at most that, (B, J)."""
    if pieces.apart is None:
        return np.zeros_like(size)
    moving = np.flatnonzero(np.ptp(question.positions, axis=0) > 0.0)
    apart = pieces.apart.rms_of(order)[:, moving]
    if order == pieces.apart.order:  # the spline has the least of all: squares differ by that of the difference
        apart = apart**2 / np.maximum(size + np.sqrt(np.maximum(size**2 - apart**2, 0.0)), 1e-300)
    return np.asarray(np.fmin(np.where(np.isfinite(apart), apart, np.inf), size))


def _energies(pieces: ShapePieces, order: int, question: Question) -> Enclosed:
    """∫ of the squared derivative of every joint that moves, (B, J), in the shape's unit of time."""
    moving = np.flatnonzero(np.ptp(question.positions, axis=0) > 0.0)
    values = pieces.through(_quadrature(pieces.coefficients.middle.shape[-1] - 1, order))[:, moving]
    square = (values * values).summed()
    rates = pieces.rates.to_power(2.0 * order - 1.0).shaped(-1)
    whole = square * rates
    return whole.swapped().summed()


def _peaks(pieces: ShapePieces, total: Enclosed, order: int, known: dict[int, Enclosed]) -> Enclosed:
    """The derivative at one instant of every piece, near its peak at the middle of the cell, (B, S, n_joints)."""
    if order not in known:
        at = _near_peaks(pieces.coefficients.middle[0], order)
        value = pieces.weighed(_basis(at, pieces.coefficients.middle.shape[-1] - 1, order))
        scale = pieces.rates.to_power(float(order)) * total.to_power(float(order)).shaped(-1)
        found: Any = value * scale.shaped(-1)
        if pieces.apart is not None:
            middle, radius = (pieces.rates * total.shaped(-1)).over_box
            found = found.widened(pieces.apart.greatest_of(order, 1.0 / (middle + radius)))
        known[order] = found
    return known[order]


def _greatest(terms: Enclosed, limit: Array | None, influence: Array) -> Array:
    """Bound from below of the greatest of all terms, as shares of the limits, shape (B,)."""
    signs = np.where(terms.middle[0] < 0.0, -1.0, 1.0)
    most = np.ones(terms.middle.shape[-1]) if limit is None else limit
    share = signs / (most if limit is None else np.where(signs < 0.0, most[0], most[1]))
    used = terms.times(share)
    low = used.low
    flat = np.where(np.isfinite(low), low, -np.inf).reshape(len(low), -1)
    best = flat.argmax(axis=1)
    rows = np.arange(len(low))
    influence += used.picked(rows, best).influence
    return np.where(np.isfinite(flat[rows, best]), flat[rows, best], np.nan)


def _outside(pieces: ShapePieces, range_: Array) -> Array:
    """Whether all motions of a cell leave the range of a joint, shape (B,)."""
    if not np.isfinite(range_).any():
        return np.zeros(pieces.coefficients.middle.shape[1], dtype=bool)
    coefficients, found = pieces.coefficients, []
    looked = _basis(np.linspace(0.0, 1.0, _LOOKED), coefficients.middle.shape[-1] - 1, 0)
    values = coefficients.middle[0] @ looked.T
    for sign, end in ((1.0, range_[1]), (-1.0, -range_[0])):
        at = _summits(sign * values)
        reached = pieces.weighed(_basis(at, coefficients.middle.shape[-1] - 1, 0)).times(sign)
        slack = 1e-9 * (1.0 + np.abs(end))
        if pieces.apart is not None:
            slack = slack + pieces.apart.greatest_of(0, np.ones(reached.middle.shape[1:3]))
        found.append((reached.low > end + slack).any(axis=(1, 2)))
    return np.asarray(found[0] | found[1])


def _near_peaks(coefficients: Array, order: int) -> Array:
    """Where in each piece a derivative is greatest, (B, S, n_joints), as a share of the piece."""
    looked = np.linspace(0.0, 1.0, _LOOKED)
    size = np.abs(coefficients @ _basis(looked, coefficients.shape[-1] - 1, order).T)
    return _summits(size)


def _summits(size: Array) -> Array:
    """Where values at evenly spread shares (..., _LOOKED) are greatest, by the parabola around the greatest one."""
    best = size.argmax(axis=-1)
    inner = np.clip(best, 1, _LOOKED - 2)[..., None]
    before, here, after = (np.take_along_axis(size, inner + k, axis=-1)[..., 0] for k in (-1, 0, 1))
    bend = before - 2.0 * here + after
    shift = np.where(bend < 0.0, 0.5 * (before - after) / np.where(bend < 0.0, bend, 1.0), 0.0)
    at = np.where(best == inner[..., 0], inner[..., 0] + np.clip(shift, -1.0, 1.0), best) / (_LOOKED - 1.0)
    return np.asarray(np.nan_to_num(np.clip(at, 0.0, 1.0)))


def _basis(at: Array, degree: int, order: int) -> Array:
    """A derivative of the powers at shares of a piece: (...) -> (..., degree + 1)."""
    found = np.zeros((*at.shape, degree + 1))
    for power in range(order, degree + 1):
        factor = float(np.prod(np.arange(power - order + 1, power + 1)))
        found[..., power] = factor * at ** (power - order)
    return found


@cache
def _quadrature(degree: int, order: int) -> Array:
    """Coefficients of a derivative in orthonormal Legendre polynomials: the sum of their squares is ∫ of the square."""
    count = max(degree - order, 0) + 1
    nodes, weights = np.polynomial.legendre.leggauss(count)
    values = np.polynomial.legendre.legvander(nodes, count - 1) * np.sqrt(2.0 * np.arange(count) + 1.0)
    return frozen((values * (0.5 * weights)[:, None]).T @ _basis(0.5 * (nodes + 1.0), degree, order))
