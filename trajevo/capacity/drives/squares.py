"""The square of a motor's torque over a cycle, and the masses with which what follows from it stays within a limit.

Without losses of the gear the square is quadratic in the mass, and so are its average and the temperature at every
instant: masses are in closed form. With losses it is quadratic between the masses at which the load of a node changes
its direction: the closed form holds on each such interval, and pieces of the motion are split where it does.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from typing import NamedTuple, final

import numpy as np

from trajevo.base import polynomials
from trajevo.base.arrays import Array, frozen
from trajevo.base.shown.brief import brief
from trajevo.dynamics.drives.cycle import LOOKED_AT, NODES, ZOOM, ZOOMS, Cycle, around, legendre

#: Evenly spaced shares of every piece between which the load changes its direction once at most.
_SHARES = np.linspace(0.0, 1.0, 65)
_SEEN = np.polynomial.legendre.legvander(2.0 * _SHARES - 1.0, NODES - 1).T

#: How often pieces are split where the load changes its direction at the mass found.
_ROUNDS = 6

#: How far from the mass that was found first it is sought again, as a share of it.
_WINDOW = 0.02

#: Share of a limit below which polynomials through nodes cannot be wrong about it.
_CLEARLY = 0.95

#: Relative change of the mass that ends the splitting.
_SETTLED = 1e-12


class HeatLimit(NamedTuple):
    """What the square of a motor's torque must not exceed [(N·m)² or N²].

    Attributes:
        most: the limit.
        time_constant: of what follows the square, at every instant [s]; None for the average over a cycle.
    """

    most: float
    time_constant: float | None = None

    def response(self, cycle: Cycle, values: Array, held: Array) -> Array:
        """What the limit looks at, of values (3, K, P, N) and those at rest (3, K), at instants, (3, K, Q)."""
        if self.time_constant is None:
            return cycle.mean(values, held)[..., None]
        return cycle.response(values, held, self.time_constant)


class MassesOfJoint(NamedTuple):
    """Masses that a joint allows [kg], inf and -inf for none, and the instant that binds [s], NaN if there is none."""

    least: float
    most: float
    time: float


@final
@dataclass(frozen=True, eq=False)
class JointCycle:
    """What the motor of one joint bears over a cycle, see :mod:`trajevo.dynamics.drives.motors`, and while it stands.

    Attributes:
        cycle: its pieces.
        rotor: torque of the rotor at the nodes, shape (P, N) [N·m or N].
        load: torque of the load without payload, the same shape [N·m or N].
        per_kilogram: what a kilogram adds, the same shape [N·m/kg or N/kg].
        way: direction of the motion in every piece, -1, 0 or 1, shape (P,).
        held: load and what a kilogram adds to it while the joint stands; zeros if a brake holds it.
        efficiencies: while the motor drives, and while it is driven.
    """

    cycle: Cycle
    rotor: Array
    load: Array
    per_kilogram: Array
    way: Array
    held: tuple[float, float]
    efficiencies: tuple[float, float]

    __repr__ = brief

    @property
    def lossy(self) -> bool:
        """Whether the gear has losses."""
        return self.efficiencies != (1.0, 1.0)

    def roughly(self, limit: HeatLimit, up_to: float = np.inf) -> MassesOfJoint:
        """The masses that a limit allows, right to a share of :data:`_WINDOW` where a gear has losses.

        Args:
            limit: the limit.
            up_to: a mass beyond which none is of interest [kg]; the greatest that is found is then at most that.
        """
        if self.lossy and up_to < np.inf and self._keeps(limit, up_to):
            return MassesOfJoint(0.0, up_to, np.nan)
        found = self._masses(limit, (0.0, up_to))
        return found if found.most >= 0.0 or up_to == np.inf else self._masses(limit, (0.0, np.inf))

    def masses(self, limit: HeatLimit, found: MassesOfJoint) -> MassesOfJoint:
        """The masses that a limit allows, given those of :meth:`roughly`."""
        found = self._settled(limit, found)
        if limit.time_constant is None or not (np.isfinite(found.time) and np.isfinite(found.most)):
            return found
        return self.split_at(found.most)._hottest(found, limit.most, limit.time_constant)

    def _keeps(self, limit: HeatLimit, up_to: float) -> bool:
        """Whether all masses up to one [kg] clearly keep a limit.

        The torque at an instant rises or falls with the mass throughout, so that its square is greatest at either end.
        """
        ends = np.array([0.0, up_to])
        loads = self.load + ends[:, None, None] * self.per_kilogram
        squares = (self.rotor + self._factors(ends) * loads) ** 2
        held = (self.held[0] + ends * self.held[1]) ** 2
        return bool(limit.response(self.cycle, squares.max(axis=0), held.max()).max() <= _CLEARLY * limit.most)

    def at_mass(self, mass: float) -> tuple[Cycle, Array, Array]:
        """The cycle in pieces on which the square is smooth, the square at its nodes (P, N), and at rest ()."""
        fine = self.split_at(mass)
        squares, held = fine._squares(fine._factors(np.array([mass])))
        value, rest = (x[0] + 2.0 * mass * x[1] + mass**2 * x[2] for x in (squares, held))
        return fine.cycle, value[0], rest[0]

    def split_at(self, mass: float) -> JointCycle:
        """The same with pieces that end where the load changes its direction with a payload [kg]."""
        if not self.lossy:
            return self
        load = self.load + mass * self.per_kilogram
        coefficients = load @ legendre(NODES)[2].T
        seen = coefficients @ _SEEN
        piece, before = np.nonzero(seen[:, :-1] * seen[:, 1:] < 0.0)
        shares = _zeros(coefficients[piece], before)
        instants = self.cycle.ends[piece] + shares * self.cycle.durations[piece]
        finer = self.cycle.split(instants)
        owner = np.clip(np.searchsorted(self.cycle.ends, finer.ends[:-1], side="right") - 1, 0, len(self.way) - 1)
        rotor, load, each = self.cycle.onto(np.stack([self.rotor, self.load, self.per_kilogram]), finer)
        return JointCycle(finer, rotor, load, each, self.way[owner], self.held, self.efficiencies)

    def _settled(self, limit: HeatLimit, found: MassesOfJoint) -> MassesOfJoint:
        """The masses, with pieces split where the load changes its direction at the greatest and the least of them."""
        for _ in range(_ROUNDS if self.lossy else 0):
            fine = self
            for mass in (found.least, found.most):
                if np.isfinite(mass) and mass > 0.0:
                    fine = fine.split_at(mass)
            before, found = found, fine._near(limit, found)
            if np.allclose(found[:2], before[:2], rtol=_SETTLED, atol=0.0):
                break
        return found

    def _near(self, limit: HeatLimit, found: MassesOfJoint) -> MassesOfJoint:
        """The masses once more, sought near those that were found first, if only the greatest is a root."""
        if found.least == 0.0 and 0.0 < found.most < np.inf:
            window = (1.0 - _WINDOW) * found.most, (1.0 + _WINDOW) * found.most
            near = self._masses(limit, window)
            if near.least == window[0] and near.most < window[1]:
                return near._replace(least=0.0)
        return self.roughly(limit)

    def _masses(self, limit: HeatLimit, window: tuple[float, float]) -> MassesOfJoint:
        """The masses in a window, as if the load changed its direction at nodes alone."""
        edges = self._edges
        edges = np.concatenate([window[:1], edges[(edges > window[0]) & (edges < window[1])], window[1:]])
        inner = 0.5 * (edges[1:] + edges[:-1])
        inner[-1] = inner[-1] if np.isfinite(inner[-1]) else edges[-2] + 1.0
        squares, held = self._squares(self._factors(inner))
        a, b, c = limit.response(self.cycle, squares, held)
        low, high = within_square(a, b, c, limit.most)
        binding = high.argmin(axis=1)
        least = np.maximum(low.max(axis=1), edges[:-1])
        greatest = np.minimum(high.min(axis=1), edges[1:])
        possible = np.flatnonzero(least <= greatest)
        if not len(possible):
            return MassesOfJoint(np.inf, -np.inf, np.nan)
        first = last = int(possible[0])
        while last + 1 < len(least) and greatest[last] >= edges[last + 1] and least[last + 1] <= edges[last + 1]:
            last += 1
        instants = self.cycle.looked_at
        time = instants[binding[last]] if high.shape[1] == len(instants) and np.isfinite(greatest[last]) else np.nan
        return MassesOfJoint(float(least[first]), float(greatest[last]), float(time))

    def _hottest(self, found: MassesOfJoint, most: float, time_constant: float) -> MassesOfJoint:
        """The greatest mass once more, at the hottest instant itself instead of the nearest that was looked at."""
        squares, held = self._squares(self._factors(np.array([found.most])))
        begins = self.cycle.begins(squares, held, time_constant)[0][:, 0]
        mass, time = found.most, found.time
        for piece in self.cycle.pieces_at(time):
            share = (time - self.cycle.ends[piece]) / self.cycle.durations[piece]
            width = 1.0 / (LOOKED_AT - 1)
            for _ in range(ZOOMS):
                shares = around(share, width)
                a, b, c = self.cycle.inside(piece, squares[:, 0, piece], begins[:, piece], time_constant, shares)
                high = within_square(a, b, c, most)[1]
                share, width = shares[high.argmin()], width / ZOOM
                if high.min() < mass:
                    mass = float(high.min())
                    time = float(self.cycle.ends[piece] + share * self.cycle.durations[piece])
        return MassesOfJoint(found.least, mass, time)

    @cached_property
    def _edges(self) -> Array:
        """Masses between which the loads of all nodes keep their directions, from 0 to inf [kg]."""
        if not self.lossy:
            return np.array([0.0, np.inf])
        with np.errstate(divide="ignore", invalid="ignore"):
            turned = -self.load / self.per_kilogram
        return np.concatenate([[0.0], np.unique(turned[np.isfinite(turned) & (turned > 0.0)]), [np.inf]])

    def _factors(self, masses: Array) -> Array:
        """Factors from the load to the motor with payloads (K,) [kg], shape (K, P, N)."""
        driving, driven = self.efficiencies
        way = np.sign(self.load + masses[:, None, None] * self.per_kilogram) * self.way[:, None]
        factors: Array = np.where(way > 0.0, 1.0 / driving, np.where(self.way[:, None] == 0.0, 1.0, driven))
        return factors

    def _squares(self, factors: Array) -> tuple[Array, Array]:
        """Coefficients a, b and c of the square a + 2 b m + c m² at the nodes (3, K, P, N), and at rest (3, K)."""
        own, each = self.rotor + factors * self.load, factors * self.per_kilogram
        (load, slope), many = self.held, np.ones(len(factors))
        at_rest = np.stack([load**2 * many, load * slope * many, slope**2 * many])
        return np.stack([own**2, own * each, each**2]), at_rest


def _zeros(coefficients: Array, between: Array) -> Array:
    """Shares at which polynomials (R, N) change their sign between neighbours of :data:`_SHARES`, shape (R,).

    Over so little of a piece they are all but quintics, whose coefficients one product gives.

    Args:
        coefficients: Legendre coefficients.
        between: numbers of the shares before the changes, shape (R,).
    """
    quintics = (_quintics()[between] @ coefficients[..., None])[..., 0].T
    within = polynomials.crossing(quintics, np.zeros(len(between)), np.ones(len(between)))
    share: Array = _SHARES[between] + within * (_SHARES[1] - _SHARES[0])
    return share


@cache
def _quintics() -> Array:
    """Matrices from Legendre coefficients to those of quintics between neighbours of :data:`_SHARES`, (64, 6, N)."""
    places = 0.5 * (1.0 - np.cos(np.pi * np.arange(6) / 5.0))
    shares = _SHARES[:-1, None] + places * np.diff(_SHARES)[:, None]
    powers = np.linalg.inv(places[:, None] ** np.arange(6))
    return frozen(powers @ np.polynomial.legendre.legvander(2.0 * shares - 1.0, NODES - 1))


def within_square(a: Array, b: Array, c: Array, most: float) -> tuple[Array, Array]:
    """Ends of the masses with a + 2 b m + c m² <= most for c from 0 on, the shape of a; inf and -inf if there are none.

    Where b and c are 0 the mass is free: -inf and inf.
    """
    root = np.sqrt(np.maximum(b**2 - c * (a - most), 0.0))
    free, none = c <= 0.0, b**2 < c * (a - most)
    slope = np.where(free, 1.0, c)
    with np.errstate(divide="ignore", invalid="ignore"):
        high = np.where(b > 0.0, (most - a) / (b + root), (root - b) / slope)
        low = np.where(b > 0.0, -(b + root) / slope, (a - most) / (root - b))
    low, high = np.where(b == 0.0, -root / slope, low), np.where(b == 0.0, root / slope, high)
    kept = np.where(free, a <= most, ~none)
    return np.where(kept, np.where(free, -np.inf, low), np.inf), np.where(kept, np.where(free, np.inf, high), -np.inf)
