"""Good orders and postures with which an evolution begins, found by the times of the motions themselves.

The best order from rest to rest is not the best one where points are passed without a stop. So orders near it are
compared by the least time of their motions under the limits of joint velocity, acceleration and jerk. It is found in a
few rounds: every leg's time is multiplied by the share of a limit that it uses, to the power with which it falls, and
all of them by the greatest share. Loads and torques are left to the evolution.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.formulation.feasibility.least_times import SpeedLimits
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.path.choices.sequences import best_states
from trajevo.path.choices.tours import neighbours
from trajevo.solvers.evolutionary.choices import Choices
from trajevo.trajectory.batch import TrajectoryBatch

#: Rounds of adapting legs when neighbours are compared and when the best are kept, and the power of a leg's share.
_ROUNDS, _MORE_ROUNDS, _POWER = 8, 25, 0.6

#: Neighbours of an order whose motions are compared, the quickest from rest to rest; descents in vain after which the
#: search ends, and most descents; orders that are kept.
_SCREENED, _IN_VAIN, _DESCENTS, _KEPT = 100, 3, 10, 24

#: Fall of a time that is none, as a share, and the share by which times are longer than the limits ask, for rounding.
_GAIN, _MARGIN = 1e-6, 1e-9

#: Share of the first individuals that begin with what was found, and of these the share that has its times too.
_BEGINNING, _TIMED = 0.75, 0.5


@final
@dataclass(eq=False)
class OrderSearch:
    """Good choices for a problem.

    Attributes:
        problem: the problem.
        choices: where its variables choose.
        x: decision vectors of the choices found, the quickest first, shape (N, n_var).
        seconds: least times of their motions under the limits of the joints' speeds, shape (N,) [s].
    """

    problem: TrajectoryProblem
    choices: Choices
    x: Array = field(init=False)
    seconds: Array = field(init=False)

    def __post_init__(self) -> None:
        self._limits = SpeedLimits.of(self.problem, 2)
        leg_of = self.choices.interpolant.leg_of
        self._timed = np.append(leg_of >= 0, np.zeros(self.problem.n_var - len(leg_of), dtype=bool))
        self._leg_of = leg_of[leg_of >= 0]
        self.x, self.seconds = np.empty((0, self.problem.n_var)), np.empty(0)
        self._known: set[bytes] = set()

    def run(self, random: np.random.Generator) -> OrderSearch:
        """Search by descents from the best order from rest to rest, and from the best found with parts exchanged."""
        visits = self.choices.visits
        if visits.free is None:
            postures = visits.posture_columns
            columns = np.zeros((len(visits.ranked.cost) if postures.stop > postures.start else 1, postures.stop))
            columns[:, postures] = np.arange(len(columns))[:, None] + 0.5
            self._add(self._vectors(columns))
        else:
            self._descend(visits.tour.order)
            vain = 0
            for _ in range(_DESCENTS):
                before = self.seconds[0]
                self._descend(self._kicked(random))
                vain = 0 if self.seconds[0] < before * (1.0 - _GAIN) else vain + 1
                if vain == _IN_VAIN:
                    break
            self._hold_postures()
        self.x, self.seconds = self.quickest(self._different(), _MORE_ROUNDS)
        order = self.seconds.argsort(kind="stable")
        self.x, self.seconds = self.x[order], self.seconds[order]
        return self

    def begun(self, drawn: Array, random: np.random.Generator) -> Array:
        """Individuals that begin with what was found; others keep their choices, with times that suit their legs.

        Args:
            drawn: individuals that were drawn, shape (B, n_var).
            random: random generator.
        """
        problem, choices, visits = self.problem, self.choices, self.choices.visits
        columns, count = choices.columns, len(drawn)
        begun = drawn.copy()
        begun[:, columns] = visits.plain(drawn[:, columns])
        found = (len(self.x) * random.random(count) ** 2).astype(np.intp)
        own, timed = (random.random(count) < share for share in (_BEGINNING, _TIMED))
        taken = self.x[found]
        chosen = np.arange(problem.n_var)[columns][visits.order_columns.start : visits.posture_columns.stop]
        begun[np.ix_(own, chosen)] = taken[np.ix_(own, chosen)]
        held = visits.posture_columns
        several = held.stop - held.start
        if several > 1:  # most of them hold one point to another posture, or none
            again = (own & ~timed)[:, None] & (random.random((count, several)) < 0.5 / several)
            postures = begun[:, columns]
            postures[:, held] = np.where(again, drawn[:, columns][:, held], postures[:, held])
            begun[:, columns] = visits.plain(postures)
        legs = choices.legs(begun)
        legs = np.where((own & timed)[:, None], taken, legs)[:, self._timed]
        if legs.shape[1]:
            mean = np.exp(np.log(legs).mean(axis=1, keepdims=True))
            level = np.exp(np.log(drawn[:, self._timed]).mean(axis=1, keepdims=True))
            ratio = np.where((own & timed)[:, None], level, drawn[:, self._timed])
            begun[:, self._timed] = ratio * legs / mean
        return np.asarray(np.clip(begun, problem.xl, problem.xu))

    def quickest(self, x: Array, rounds: int) -> tuple[Array, Array]:
        """Decision vectors with legs adapted to the limits of the joints' speeds, and their times.

        Args:
            x: decision vectors, shape (N, n_var).
            rounds: how often the legs are adapted.

        Returns:
            Decision vectors (N, n_var) and times (N,) [s].
        """
        best, least = x.copy(), np.full(len(x), np.inf)
        for _ in range(rounds if len(self._leg_of) else 1):
            trajectory = self.problem.decode(x)
            used = self._used(trajectory, self.problem.via_times(x))
            most = used.max(axis=1, keepdims=True) * (1.0 + _MARGIN)
            own = x[:, self._timed]
            whole = trajectory.duration + ((most - 1.0) * own).sum(axis=1)
            better = whole < least
            best[better], least[better] = self._with_times(x, own * most)[better], whole[better]
            x = self._with_times(x, own * np.maximum(used, 1e-3)[:, self._leg_of] ** _POWER)
        return np.asarray(best), least

    def _used(self, trajectory: TrajectoryBatch, instants: Array) -> Array:
        """Factor of each leg's time with which it would just keep the limits, (B, K - 1), 1 where nothing limits."""
        used = np.zeros(trajectory.segment_durations.shape)
        for order, limit in enumerate((self._limits.velocity, self._limits.acceleration, self._limits.jerk), start=1):
            share = (trajectory.segment_peaks(order) / limit.lesser).max(axis=2)
            used = np.maximum(used, share ** (1.0 / order))
        middle = 0.5 * (trajectory.breaks[:, 1:] + trajectory.breaks[:, :-1])
        within = (middle[:, None] > instants[:, :-1, None]) & (middle[:, None] < instants[:, 1:, None])
        of_legs: Array = (within * used[:, None]).max(axis=2)
        return np.where(of_legs.max(axis=1, keepdims=True) > 0.0, of_legs, 1.0)

    def _with_times(self, x: Array, times: Array) -> Array:
        found = x.copy()
        found[:, self._timed] = times
        return np.asarray(np.clip(found, self.problem.xl, self.problem.xu))

    def _vectors(self, columns: Array) -> Array:
        """Decision vectors for columns that choose, each leg with its time from rest to rest."""
        problem, choices = self.problem, self.choices
        x = np.tile(0.5 * (problem.xl + problem.xu), (len(columns), 1))
        inner = choices.visits.order_columns.start
        x[:, choices.columns.start + inner : choices.columns.stop] = columns[:, inner:]
        return self._with_times(x, choices.legs(x)[:, self._timed])

    def _of_orders(self, orders: Array) -> Array:
        visits = self.choices.visits
        columns = np.full((len(orders), len(visits.variables)), 0.5)
        if visits.free is not None:
            columns[:, visits.order_columns] = visits.free.keys(orders)
        return self._vectors(columns)

    def _add(self, x: Array) -> tuple[Array, Array]:
        """Compare motions, keep them among the known ones in the order of their times; returns them as they are."""
        x, seconds = self.quickest(x, _ROUNDS)
        every, all_seconds = np.concatenate([self.x, x]), np.concatenate([self.seconds, seconds])
        order = all_seconds.argsort(kind="stable")
        self.x, self.seconds = every[order], all_seconds[order]
        return x, seconds

    def _descend(self, order: Array) -> None:
        """Go from an order to its quickest neighbour until none is quicker."""
        free, times = self.choices.visits.free, self.choices.visits.times
        if free is None:
            return
        self._known.add(order.tobytes())
        seconds = self._add(self._of_orders(order[None]))[1][0]
        while True:
            near = neighbours(free, order)
            near = near[[each.tobytes() not in self._known for each in near]]
            if not len(near):
                return
            near = near[best_states(near, times)[1].argsort(kind="stable")[:_SCREENED]]
            self._known.update(each.tobytes() for each in near)
            found = self._add(self._of_orders(near))[1]
            if found.min() >= seconds * (1.0 - _GAIN):
                return
            order, seconds = near[found.argmin()], found.min()

    def _different(self) -> Array:
        """The quickest of what was found, each with other points than the ones before, shape (N, n_var)."""
        columns = self.x[: 4 * _KEPT, self.choices.columns]
        points = np.concatenate(self.choices.visits.chosen(columns), axis=1)
        kept = np.sort(np.unique(points, axis=0, return_index=True)[1])[:_KEPT]
        return np.asarray(self.x[kept])

    def _hold_postures(self) -> None:
        """Hold one point of the best order to each of its postures, to which the others are fitted."""
        visits, first = self.choices.visits, self.choices.columns.start
        held = visits.posture_columns
        counts = [int(each.upper) - 1 for each in visits.variables[held]]
        if not counts:
            return
        x = np.repeat(self.x[:1], sum(counts), axis=0)
        columns = first + np.arange(held.start, held.stop).repeat(counts)
        x[np.arange(len(x)), columns] = np.concatenate([np.arange(count) + 1.5 for count in counts])
        legs = self.choices.legs(x)[:, self._timed]
        self._add(self._with_times(x, legs))

    def _kicked(self, random: np.random.Generator) -> Array:
        """The best order with two neighbouring parts exchanged in one group, as far as precedence allows."""
        visits = self.choices.visits
        order = visits.orders(self.x[:1, self.choices.columns])[0]
        if visits.free is None:
            return np.asarray(order)
        group = np.array(visits.free.groups[random.integers(len(visits.free.groups))])
        inner = order[group]
        cuts = np.sort(random.choice(len(group) + 1, min(3, len(group) + 1), replace=False))
        kicked = order.copy()
        kicked[group] = np.concatenate(
            [inner[: cuts[0]], inner[cuts[1] : cuts[-1]], inner[cuts[0] : cuts[1]], inner[cuts[-1] :]]
        )
        keys = visits.free.keys(kicked[None])
        return np.asarray(visits.free.decoded(keys)[0])
