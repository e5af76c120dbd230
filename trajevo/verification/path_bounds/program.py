"""Good multipliers by linear programs: what a place contributes is the least over speeds, a few of which are tried.

A program maximises the bound with the trapezoidal rule, the least over speeds replaced by speeds tried so far and
prices of jerk and effort by tangents. Where its multipliers make another speed the least, that is added (Kelley's
cutting planes). Every program's multipliers prove a bound; none has to be solved exactly.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.verification.path_bounds.pointwise import least
from trajevo.verification.path_bounds.relaxation import Multipliers, Relaxation

#: Speeds tried first, as shares of the mean speed, and of the greatest speed of a place.
_SPEEDS = (0.02, 0.1, 0.3, 0.6, 0.9, 1.2, 1.6, 2.2)
_OF_FASTEST = (0.05, 0.3, 0.7, 1.0)
_OF_KNOWN = (0.7, 0.9, 1.0, 1.1, 1.4)

#: Tangents of a price tried first, as shares of what is usual or allowed.
_TANGENTS = (-1.0, -0.5, -0.2, -0.05, 0.05, 0.2, 0.5, 1.0)

#: The best multiplier of an effort is twice the weight times effort / z, which grows where a motion comes to rest:
#: the greatest effort / z, as a share of the effort's unit, and tangents of the price tried first. It is a square, of
#: which tangents far apart tell nothing.
_MOST_EFFORT = 512.0
_EFFORT_TANGENTS = (0.02, 0.05, 0.1, 0.2, 0.35, 0.6, *(2.0**k for k in range(10)))

#: What a program may at most make of a multiplier in its own scale; keeps programs bounded.
_MOST = 1e4

#: Bernstein coefficients of a cell, where each has its prices, and a cell's start and end among the stations.
_PARTS = 3
_STARTS, _ENDS = slice(None, -1), slice(1, None)
_SHARED = (((_STARTS, 1.0),), ((_STARTS, 0.5), (_ENDS, 0.5)), ((_ENDS, 1.0),))
_PRICES = (("price", _STARTS), ("middle", slice(None)), ("price", _ENDS))

#: Share of a margin that is kept when less is needed.
_FORGOTTEN = 0.5

#: Slack of an added cut from which on it is left out again.
_FAR = 0.3

#: Excess of a program's value over the least above which a speed is added, and slowest speed tried.
_EXCESS, _SLOWEST = 1e-7, 1e-4


@final
@dataclass(frozen=True)
class Round:
    """One program.

    Attributes:
        proven: the bound that its multipliers prove.
        most: the program's value: with these stations hardly more can be proven.
        multipliers: its multipliers.
        speeds: speeds at which places contribute least, in the middle of every cell, shape (C,).
    """

    proven: float
    most: float
    multipliers: Multipliers
    speeds: Array


def rounds(relaxation: Relaxation, most: int, speeds: tuple[Array, Array] | None = None) -> Iterator[Round]:
    """Programs one after another, each with the speeds that the one before lacked; ends if no program is solved.

    Args:
        relaxation: the relaxation.
        most: number of programs at most.
        speeds: places (P,) and speeds there (P,), near which speeds are tried first; None if nothing is known.
    """
    program = _Program(relaxation, speeds)
    for _ in range(most):
        found = program.solved()
        if found is None:
            return
        yield found


class _Program:
    """The program, with cuts that are added.

    Columns, in blocks of one for each station (or cell) and axis, row or joint, each in a scale of its own: the jerk's
    multipliers, their slopes, the prices of the former at stations and in the middle of cells, those of limits forward
    and backward, of efforts with their prices, of speeds, and the contributions of the three Bernstein coefficients
    of every cell.
    """

    def __init__(self, relaxation: Relaxation, speeds: tuple[Array, Array] | None) -> None:
        self.given, self.known = relaxation, speeds
        cells, n, rows = relaxation.cells, relaxation.axes, relaxation.rows.count
        self.cells, self.n, self.rows = cells.count, n, rows
        self.stations = cells.count + 1
        joints = rows - n if relaxation.effort_weight > 0.0 else 0
        self.joints = joints
        sizes = {
            "jerk": (self.stations, n),
            "slope": (self.stations, n),
            "price": (self.stations, n),
            "middle": (self.cells, n),
            "ahead": (self.stations, rows),
            "behind": (self.stations, rows),
            "effort": (self.stations, joints),
            "cost": (self.stations, joints),
            "speed": (self.stations, n),
            "share": (self.cells, _PARTS),
        }
        self.columns: dict[str, Any] = {}
        total = 0
        for name, shape in sizes.items():
            self.columns[name] = total + np.arange(np.prod(shape, dtype=int)).reshape(shape)
            total += int(np.prod(shape, dtype=int))
        self.total = total
        self._scales()
        self.parts = self._parts()
        self.margin = np.zeros(self.cells)
        self.cuts: list[tuple[Any, Array, Array | None]] = [*self._first_cuts()]
        self.lasting = len(self.cuts)
        self.equal = self._equalities()
        self.cost, self.bounds = self._costs(), self._bounds()

    def _scales(self) -> None:
        """Units of the multipliers, so that all columns are of the order of one."""
        given = self.given
        # A jerk whose price is that of time; beyond three times that none is worth while.
        usual = 3.0 / np.sqrt(given.jerk_weight) if given.jerk_weight > 0.0 else np.inf
        jerk = np.minimum(given.jerk, usual)
        self.jerk_unit = np.where(np.isfinite(jerk), jerk, 1.0)
        sides = np.minimum(given.rows.forward, given.rows.backward)
        held = np.abs(given.rows.held).max(axis=(0, 1)) + np.abs(given.rows.bend).max(axis=(0, 1)) + 1e-12
        self.row_unit = np.where(np.isfinite(sides), sides, held)
        top = np.abs(given.cells.slopes[1]).max(axis=(0, 1)) + 1e-12
        self.speed_unit = np.where(np.isfinite(given.velocity), given.velocity, top)

    def _matrix(self, parts: list[tuple[Any, Any, Any]], rows: int) -> Any:
        from scipy import sparse

        shaped = [np.broadcast_arrays(*part) for part in parts]
        row, column, value = (np.concatenate([part[k].ravel() for part in shaped]) for k in range(3))
        return sparse.csr_matrix((value, (row, column)), shape=(rows, self.total))

    def _parts(self) -> list[tuple[Any, Any, Any]]:
        """What multiplies 1/z (less one), z and z²: three quadratic Bernstein coefficients of every cell.

        Each is three matrices (C, columns). The one in the middle is twice the value there less the mean of both ends.
        """
        start, middle, end = (self._at(share) for share in (0.0, 0.5, 1.0))
        twice = [2.0 * m - 0.5 * (s + e) for s, m, e in zip(start, middle, end, strict=True)]
        c = np.arange(self.cells)[:, None]
        inverse = [self._matrix([(c, self.columns[name][part], -1.0)], self.cells) for name, part in _PRICES]
        found = []
        for k, (linear, square) in enumerate((start, twice, end)):
            # The square of a linear function has, in the middle, at most the mean of its squares at the ends.
            cost = [(c, self.columns["cost"][at], -weight) for at, weight in _SHARED[k]]
            found.append((inverse[k], linear + self._matrix(cost, self.cells), square))
        return found

    def _at(self, share: float) -> tuple[Any, Any]:
        """What multiplies z and z² at a share of every cell, two matrices (C, columns), without prices of effort."""
        given, c = self.given, np.arange(self.cells)[:, None]
        half, bend, rate, squares = (
            given.cells.at(part, share) for part in (given.rows.half, given.rows.bend, given.rows.rate, given.squares)
        )
        half, bend, rate = (part / self.row_unit for part in (half, bend, rate))
        slower = 0.5 * bend / given.cells.widths[:, None]
        square, linear = [], []
        for name, sign, scale in self._weights():
            kept = slice(0, self.n) if name == "slope" else slice(self.n, None) if name == "effort" else slice(None)
            columns, factor = self.columns[name], sign * scale
            for end, weight, change in ((columns[:-1], 1.0 - share, slower), (columns[1:], share, -slower)):
                square.append((c, end, factor * (weight * half + change)[:, kept]))
                linear.append((c, end, factor * weight * rate[:, kept]))
        squares = squares / self.speed_unit**2
        square.append((c, self.columns["speed"][:-1], (1.0 - share) * squares))
        square.append((c, self.columns["speed"][1:], share * squares))
        return self._matrix(linear, self.cells), self._matrix(square, self.cells)

    def _weights(self) -> list[tuple[str, float, Any]]:
        """Columns that make up the weights of rows, in units of the rows' scale."""
        found: list[tuple[str, float, Any]] = [("ahead", 1.0, 1.0), ("behind", -1.0, 1.0)]
        found.append(("slope", -1.0, self.row_unit[: self.n] / self.jerk_unit))
        if self.joints:
            found.append(("effort", 1.0, 1.0))
        return found

    def _equalities(self) -> tuple[Any, Array]:
        """The jerk's multipliers change by the integral of their slopes."""
        c, width = np.arange(self.cells)[:, None], self.given.cells.widths[:, None]
        row = c * self.n + np.arange(self.n)
        jerk, slope = self.columns["jerk"], self.columns["slope"]
        parts = [
            (row, jerk[1:], 1.0),
            (row, jerk[:-1], -1.0),
            (row, slope[1:], -width / 2),
            (row, slope[:-1], -width / 2),
        ]
        return self._matrix(parts, self.cells * self.n), np.zeros(self.cells * self.n)

    def _costs(self) -> Array:
        """What is minimised: costs of limits, less held efforts and contributions."""
        given, cost = self.given, np.zeros(self.total)
        width = given.cells.widths
        share = np.zeros(self.stations)
        share[:-1] += 0.5 * width
        share[1:] += 0.5 * width
        for name, side in (("ahead", given.rows.forward), ("behind", given.rows.backward)):
            cost[self.columns[name]] = share[:, None] * np.where(np.isfinite(side), side, 0.0) / self.row_unit
        cost[self.columns["speed"]] = share[:, None] * (given.velocity < np.inf)
        before, after = (
            given.cells.widths[:, None] * np.einsum("n,knr->kr", weight, given.rows.held) / self.row_unit
            for weight in self._hats()
        )
        held = np.zeros((self.stations, self.rows))
        held[:-1] += before
        held[1:] += after
        for name, sign, _ in self._weights():
            if name != "slope":
                kept = slice(self.n, None) if name == "effort" else slice(None)
                cost[self.columns[name]] -= sign * held[:, kept]
        cost[self.columns["share"]] = -width[:, None] / _PARTS
        return cost

    def _hats(self) -> tuple[Array, Array]:
        from trajevo.trajectory.bernstein import gauss

        nodes, weights = gauss(self.given.cells.nodes)
        return weights * (1.0 - nodes), weights * nodes

    def _bounds(self) -> Array:
        """Least and greatest values of the columns, (columns, 2)."""
        given = self.given
        bounds = np.stack([np.zeros(self.total), np.full(self.total, _MOST)], axis=1)
        for name in ("jerk", "slope", "effort", "share"):
            bounds[self.columns[name], 0] = -_MOST
        if self.joints:
            most = 2.0 * given.effort_weight * _MOST_EFFORT * self.row_unit[self.n :] ** 2
            bounds[self.columns["effort"]] = np.stack([-most, most], axis=-1)
        none = ~given.jerk_counts
        for name in ("jerk", "slope", "price", "middle"):
            bounds[self.columns[name][:, none]] = 0.0
        for name, side in (("ahead", given.rows.forward), ("behind", given.rows.backward)):
            bounds[self.columns[name][:, ~np.isfinite(side)]] = 0.0
        bounds[self.columns["speed"][:, ~np.isfinite(given.velocity)]] = 0.0
        return bounds

    def _first_cuts(self) -> Iterator[tuple[Any, Array, Array | None]]:
        given, every = self.given, np.arange(self.cells)
        fastest = given.fastest
        for part in range(_PARTS):
            for share in _SPEEDS:
                yield self._speed_cut(part, np.minimum(share, fastest), every)
            bounded = np.flatnonzero(np.isfinite(fastest))
            for share in _OF_FASTEST:
                yield self._speed_cut(part, share * fastest, bounded)
            if self.known is not None:
                near = np.interp(given.cells.stations[:-1] + 0.5 * part * given.cells.widths, *self.known)
                for share in _OF_KNOWN:
                    yield self._speed_cut(part, np.minimum(share * near, fastest), every)
            free = np.flatnonzero(~np.isfinite(fastest))
            yield -self.parts[part][2][free], np.zeros(len(free)), np.eye(self.cells)[free]
        for axis in np.flatnonzero(given.jerk_counts):
            for share in _TANGENTS:
                for name in ("price", "middle"):
                    size = len(self.columns[name])
                    yield self._price_cut(name, int(axis), np.full(size, share), np.arange(size))
        for joint in range(self.joints):
            for share in (*(-x for x in _EFFORT_TANGENTS), *_EFFORT_TANGENTS):
                yield self._effort_cut(joint, np.full(self.stations, share), np.arange(self.stations))
        most = [(np.arange(self.cells)[:, None], self.columns["middle"], 1.0)]
        yield self._matrix(most, self.cells), np.ones(self.cells), None
        most = [(np.arange(self.stations)[:, None], self.columns["price"], 1.0)]
        yield self._matrix(most, self.stations), np.ones(self.stations), None

    def _speed_cut(self, part: int, speeds: Array, chosen: Array) -> tuple[Any, Array, Any]:
        """A contribution is at most that of a speed, shape (C,), in the chosen cells."""
        from scipy import sparse

        z = speeds[chosen]
        inverse, linear, square = (each[chosen] for each in self.parts[part])
        own = self._matrix([(np.arange(len(z)), self.columns["share"][chosen, part], np.ones(len(z)))], len(z))
        rest = sparse.diags(1.0 / z) @ inverse + sparse.diags(z) @ linear + sparse.diags(z * z) @ square
        return own - rest, 1.0 / z, sparse.csr_matrix((z * z, (np.arange(len(z)), chosen)), shape=(len(z), self.cells))

    def _price_cut(self, name: str, axis: int, shares: Array, chosen: Array) -> tuple[Any, Array, None]:
        """A price is at least λ x - weight x² of a jerk x, a share of its unit, at the chosen stations or cells."""
        x, row = shares[chosen], np.arange(len(chosen))
        parts = [(row, self.columns[name][chosen, axis], -np.ones(len(row)))]
        if name == "price":
            parts.append((row, self.columns["jerk"][chosen, axis], x))
        else:  # the middle Bernstein coefficient of the quadratic
            parts.append((row, self.columns["jerk"][chosen, axis], x))
            parts.append((row, self.columns["slope"][chosen, axis], 0.5 * x * self.given.cells.widths[chosen]))
        return self._matrix(parts, len(row)), self.given.jerk_weight * (x * self.jerk_unit[axis]) ** 2, None

    def _effort_cut(self, joint: int, shares: Array, chosen: Array) -> tuple[Any, Array, None]:
        """A price of effort is at least ρ x - weight x² of an effort x, a share of its unit, at the chosen stations."""
        x, row = shares[chosen], np.arange(len(chosen))
        unit = self.row_unit[self.n + joint]
        parts = [
            (row, self.columns["cost"][chosen, joint], -np.ones(len(row))),
            (row, self.columns["effort"][chosen, joint], x),
        ]
        return self._matrix(parts, len(row)), self.given.effort_weight * (x * unit) ** 2, None

    def solved(self) -> Round | None:
        """Solve the program, add cuts where its solution lacks them, and say what it proves; None if not solved."""
        from scipy import sparse
        from scipy.optimize import linprog

        matrix = sparse.vstack([cut[0] for cut in self.cuts]).tocsr()
        limits = np.concatenate([self._limit(cut) for cut in self.cuts])
        for method in ("highs-ipm", "highs-ds"):
            found = linprog(
                self.cost,
                A_ub=matrix,
                b_ub=limits,
                A_eq=self.equal[0],
                b_eq=self.equal[1],
                bounds=self.bounds,
                method=method,
            )
            if found.status == 0:
                break
        else:
            return None
        multipliers = self._multipliers(found.x)
        self._set_margin(found.x, multipliers)
        self._drop_cuts(found.x)
        speeds = self._add_cuts(found.x)
        return Round(self.given.proven(multipliers), float(-found.fun), multipliers, speeds)

    def _limit(self, cut: tuple[Any, Array, Any]) -> Array:
        """Limits of a cut's rows, less what the terms of z² fall below quadratics of the place."""
        found: Array = cut[1] if cut[2] is None else cut[1] - cut[2] @ self.margin
        return found

    def _set_margin(self, x: Array, multipliers: Multipliers) -> None:
        """By how much, in every cell, what multiplies z² is below the quadratic that the program takes it for."""
        start, middle, end = ((part[2] @ x)[:, None] for part in self.parts)
        share = self.given.cells.shares
        quadratic = start * (1.0 - share) ** 2 + 2.0 * middle * share * (1.0 - share) + end * share**2
        taken = self.given.cells.bernstein(quadratic)[0]
        below = (taken - self.given.square(multipliers)).max(axis=1)
        self.margin = np.maximum(below, _FORGOTTEN * self.margin)

    def _drop_cuts(self, x: Array) -> None:
        """Leave out added cuts that are far from binding."""
        for k in range(self.lasting, len(self.cuts)):
            matrix, limit, margin = self.cuts[k]
            near = np.flatnonzero(self._limit(self.cuts[k]) - matrix @ x < _FAR)
            self.cuts[k] = matrix[near], limit[near], None if margin is None else margin[near]

    def _multipliers(self, x: Array) -> Multipliers:
        x = np.clip(x, self.bounds[:, 0], self.bounds[:, 1])
        limits = x[self.columns["ahead"]] - x[self.columns["behind"]]
        return Multipliers(
            x[self.columns["jerk"][0]] / self.jerk_unit,
            x[self.columns["slope"]] / self.jerk_unit,
            limits / self.row_unit,
            x[self.columns["effort"]] / self.row_unit[self.n :][: self.joints],
            x[self.columns["speed"]] / self.speed_unit**2,
        )

    def _add_cuts(self, x: Array) -> Array:
        """Add what the solution lacks, and give the speeds in the middle of the cells."""
        given, speeds = self.given, []
        for part in range(_PARTS):
            inverse, linear, square = (each @ x for each in self.parts[part])
            price = np.maximum(1.0 + inverse, 0.0)
            value, z = least(price, linear, square - self.margin, given.fastest)
            speeds.append(np.maximum(z, _SLOWEST))
            lacking = np.flatnonzero(x[self.columns["share"][:, part]] - value > _EXCESS)
            self.cuts.append(self._speed_cut(part, speeds[-1], lacking))
        for axis in np.flatnonzero(given.jerk_counts) if given.jerk_weight > 0.0 else ():
            unit, weight = self.jerk_unit[axis], given.jerk_weight
            for name in ("price", "middle"):
                size = len(self.columns[name])
                multiplier = x[self.columns["jerk"][:size, axis]] / unit
                if name == "middle":
                    multiplier = multiplier + 0.5 * given.cells.widths * x[self.columns["slope"][:size, axis]] / unit
                most = given.jerk[axis]
                best = np.clip(multiplier / (2.0 * weight), -most, most)
                price = multiplier * best - weight * best**2
                lacking = np.flatnonzero(price - x[self.columns[name][:, axis]] > _EXCESS)
                self.cuts.append(self._price_cut(name, int(axis), best / unit, lacking))
        for joint in range(self.joints):
            unit, weight = self.row_unit[self.n + joint], given.effort_weight
            multiplier = x[self.columns["effort"][:, joint]] / unit
            best = multiplier / (2.0 * weight)
            lacking = np.flatnonzero(multiplier * best / 2.0 - x[self.columns["cost"][:, joint]] > _EXCESS)
            self.cuts.append(self._effort_cut(joint, best / unit, lacking))
        return speeds[1]
