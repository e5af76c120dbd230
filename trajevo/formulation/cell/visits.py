"""Postures and the order of visits as decision variables, on top of where each posture of each point lies.

The order has one key for each free point: of the points that may come next, a place takes that of the least key. So any
decision vector is an order that keeps the precedence. Where the order is given, one column chooses among the best
sequences of postures, ranked by their times from rest to rest. Where it is free, the best sequence for the order of
each individual is found with it, and one column for each pose may hold it to another posture.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import final

import numpy as np

from trajevo.base.arrays import Array, read_only
from trajevo.base.shown.brief import brief
from trajevo.formulation.cell.arrangement import Arrangement
from trajevo.path.choices.branches import Branches
from trajevo.path.choices.orders import FreeOrder
from trajevo.path.choices.sequences import Sequences, best_sequences, best_states
from trajevo.path.choices.tours import Tour, best_tour
from trajevo.path.choices.travel_times import TravelTimes
from trajevo.trajectory.arranged import Arranged
from trajevo.trajectory.interpolants import Variable

#: Greatest number of ranked sequences of postures among which one column chooses.
MOST_SEQUENCES = 32

#: Ways to choose postures: each nearest to the one before; the best sequence; or sequences as a decision variable.
POSTURES = ("nearest", "best", "all")


@final
@dataclass(frozen=True, eq=False)
class StillCell(Arrangement):
    """Points whose postures do not depend on decision variables.

    Attributes:
        solutions: joint positions of every branch of every point, shape (K, C, n_joints) [rad or m].
        tool: positions of the tool at the points, NaN for a robot without a body, shape (K, 3) [m].
    """

    solutions: Array
    tool: Array

    __repr__ = brief

    def __post_init__(self) -> None:
        for name in ("solutions", "tool"):
            object.__setattr__(self, name, read_only(getattr(self, name)))

    @property
    def variables(self) -> tuple[Variable, ...]:
        """None."""
        return ()

    @property
    def branches(self) -> Array:
        """Joint positions of every branch of every point, shape (K, C, n_joints) [rad or m]."""
        return self.solutions

    @property
    def nominal(self) -> Array:
        """The first branch of every point, shape (K, n_joints) [rad or m]."""
        return self.solutions[:, 0]

    @property
    def positions(self) -> Array:
        """Positions of the tool at the points, NaN for a robot without a body, shape (K, 3) [m]."""
        return self.tool

    @property
    def base_origin(self) -> Array | None:
        """None: the base stands still."""
        return None

    @property
    def base_tilts(self) -> bool:
        """False: the base stands still."""
        return False

    @property
    def still(self) -> Array:
        """Whether a point has one branch alone, shape (K,)."""
        return np.asarray((self.solutions == self.solutions[:, :1]).all(axis=(1, 2)))

    def __call__(self, columns: Array, branch: Array | None = None) -> Arranged:
        """The points of every individual; see :meth:`Arrangement.__call__`."""
        K = len(self.solutions)
        chosen = np.zeros((len(columns), K), dtype=np.intp) if branch is None else branch
        points = self.solutions[np.arange(K), chosen].astype(columns.dtype)
        return Arranged(points, np.zeros((len(columns), K, 2)), branch=branch)


@final
@dataclass(frozen=True, eq=False)
class Visits(Arrangement):
    """Points in an order and with postures that decision variables choose.

    Attributes:
        inner: where each branch of each point lies.
        branches_of: the branches of every point; those of the inner arrangement begin with them.
        travel: times between joint positions.
        free: which points may be visited in any order; None if the order is given.
        varied: whether postures are decision variables; else the best sequence for the order is taken.
    """

    inner: Arrangement
    branches_of: tuple[Branches, ...]
    travel: TravelTimes
    free: FreeOrder | None = None
    varied: bool = False
    _allowed: Array = field(init=False, repr=False)

    __repr__ = brief

    def __post_init__(self) -> None:
        # The states that are left where a column holds a point to a posture, 0 for any: (K, postures + 1, C).
        states = self.times.shape[2]
        most = max(len(each.names) for each in self.branches_of)
        allowed = np.zeros((len(self.branches_of), most + 1, states), dtype=bool)
        for k, each in enumerate(self.branches_of):
            allowed[k, 0, : len(each.q)] = True
            allowed[k, 1 + each.posture, np.arange(len(each.q))] = True
        object.__setattr__(self, "_allowed", read_only(allowed))

    @cached_property
    def times(self) -> Array:
        """Costs between the states of all points, shape (K, K, S, S) [s]."""
        return read_only(self.travel.between([each.q for each in self.branches_of]))

    @cached_property
    def ranked(self) -> Sequences:
        """The best sequences of postures in the given order."""
        steps = [
            self.travel.costs(one.q[:, None], other.q[None])
            for one, other in zip(self.branches_of[:-1], self.branches_of[1:], strict=True)
        ]
        count = MOST_SEQUENCES if self.varied else 1
        return best_sequences(steps, [each.posture for each in self.branches_of], count)

    @cached_property
    def tour(self) -> Tour:
        """The order and the postures with which the points are visited in the least time from rest to rest."""
        if self.free is not None:
            return best_tour(self.free, self.times)
        return Tour(np.arange(len(self.branches_of)), self.ranked.states[0], float(self.ranked.cost[0]), exact=True)

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Those of the inner arrangement, a key for each free point, then the columns of postures."""
        keys = () if self.free is None else self.free.free
        visits = tuple(Variable(f"visit of point {point}", "1", 0.0, 1.0) for point in keys)
        return (*self.inner.variables, *visits, *self._posture_variables)

    @property
    def _posture_variables(self) -> tuple[Variable, ...]:
        if not self.varied:
            return ()
        if self.free is None:
            count = len(self.ranked.cost)
            return (Variable("postures", "1", 0.0, float(count)),) if count > 1 else ()
        return tuple(
            Variable(f"posture of point {k}", "1", 0.0, 1.0 + len(self.branches_of[k].names)) for k in self._several
        )

    @property
    def _several(self) -> list[int]:
        """Points that are reached in several postures."""
        return [k for k, each in enumerate(self.branches_of) if len(each.names) > 1]

    @property
    def order_columns(self) -> slice:
        """The columns of keys among :attr:`variables`."""
        first = len(self.inner.variables)
        return slice(first, first + (0 if self.free is None else len(self.free.free)))

    @property
    def posture_columns(self) -> slice:
        """The columns of postures among :attr:`variables`; a column counts by its whole part."""
        first = self.order_columns.stop
        return slice(first, first + len(self._posture_variables))

    @property
    def branches(self) -> Array:
        """Joint positions of every branch of every point, shape (K, C, n_joints) [rad or m]."""
        return self.inner.branches

    @property
    def nominal(self) -> Array:
        """Joint positions of the points of :attr:`tour`, place by place, shape (K, n_joints) [rad or m]."""
        return np.asarray(self.branches[self.tour.order, self.tour.states])

    @property
    def positions(self) -> Array:
        """Positions of the tool at the points, in the given order and in the cell, shape (K, 3) [m]."""
        return self.inner.positions

    @property
    def base_origin(self) -> Array | None:
        """Origin of the robot's base at its given place, shape (3,) [m]; None if the base stands still."""
        return self.inner.base_origin

    @property
    def base_tilts(self) -> bool:
        """Whether the robot's base may be tilted."""
        return self.inner.base_tilts

    @property
    def still(self) -> Array:
        """Whether a place has the same joint positions in all arrangements, shape (K,)."""
        fixed = np.ones(len(self.branches_of), dtype=bool)
        if self.free is not None:
            fixed[list(self.free.free)] = False
        return np.asarray(fixed & self.inner.still)

    def __call__(self, columns: Array, branch: Array | None = None) -> Arranged:
        """The points of every individual, place by place; it chooses branches itself."""
        orders, states = self.chosen(columns)
        own = np.empty_like(states)
        np.put_along_axis(own, orders, states, axis=1)
        found = self.inner(columns[:, : self.order_columns.start], own)
        points, missed = (np.take_along_axis(each, orders[..., None], axis=1) for each in (found.points, found.missed))
        postures = self._postures[orders, states]
        return Arranged(points, missed, found.bases, found.origin, None if self.free is None else orders, postures)

    def chosen(self, columns: Array) -> tuple[Array, Array]:
        """Number of the point and of its state at each place for columns (B, n_variables), shape (B, K) each."""
        values = columns.real
        orders = self.orders(values)
        held = self._indices(values)
        if self.free is None:
            rank = held[:, 0] if held.shape[1] else np.zeros(len(held), dtype=np.int64)
            return orders, self.ranked.states[rank]
        if self.times.shape[2] == 1:
            return orders, np.zeros_like(orders)
        allowed = None
        if held.shape[1]:
            postures = np.zeros(orders.shape, dtype=np.int64)
            postures[:, self._several] = held
            allowed = self._allowed[np.arange(orders.shape[1]), postures]
        return orders, best_states(orders, self.times, allowed)[0]

    def orders(self, columns: Array) -> Array:
        """Number of the point at each place for columns (B, n_variables), shape (B, K)."""
        if self.free is None:
            return np.tile(np.arange(len(self.branches_of)), (len(columns), 1))
        return self.free.decoded(columns[:, self.order_columns].real)

    def _indices(self, columns: Array) -> Array:
        """Whole parts of the columns of postures, within their bounds."""
        held = np.floor(columns[:, self.posture_columns]).astype(np.int64)
        most = np.array([int(each.upper) - 1 for each in self._posture_variables], dtype=np.int64)
        return np.clip(held, 0, most)

    @cached_property
    def _postures(self) -> Array:
        """Number of the posture of every state, shape (K, S)."""
        found = np.zeros((len(self.branches_of), self.times.shape[2]), dtype=np.int64)
        for k, each in enumerate(self.branches_of):
            found[k, : len(each.posture)] = each.posture
        return found

    def leg_times(self, columns: Array) -> Array:
        """Times from rest to rest from each place to the next one, for columns (B, n_variables), (B, K - 1) [s]."""
        orders, states = self.chosen(columns)
        before, after = (orders[:, :-1], states[:, :-1]), (orders[:, 1:], states[:, 1:])
        times: Array = self.times[before[0], after[0], before[1], after[1]]
        return times

    def plain(self, columns: Array) -> Array:
        """The same choices by the plainest numbers: even keys, and postures in the middle of their whole number."""
        found = columns.copy()
        if self.free is not None:
            found[:, self.order_columns] = self.free.keys(self.orders(columns))
        found[:, self.posture_columns] = self._indices(columns.real) + 0.5
        return found


def still_branches(branches: tuple[Branches, ...]) -> Array:
    """Joint positions of all states of all points, the first one repeated where there are fewer, (K, C, n_joints)."""
    most = max(len(each.q) for each in branches)
    return np.stack([np.concatenate([each.q, np.repeat(each.q[:1], most - len(each.q), axis=0)]) for each in branches])
