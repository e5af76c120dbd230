"""Crossover and mutation where some variables choose: the order of visits, and postures.

Times and other real variables go through simulated binary crossover and polynomial mutation. The order of visits goes
through order crossover (Davis, IJCAI 1985) and the inversion of a part, a posture through exchange and drawing again.
The time of a leg is inherited as a multiple of the time that the leg takes from rest to rest: the same time would be
wrong for another leg.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, NamedTuple, final

import numpy as np
from pymoo.core.crossover import Crossover
from pymoo.core.mutation import Mutation
from pymoo.operators.crossover.sbx import SBX
from pymoo.operators.mutation.pm import PM

from trajevo.base.arrays import Array
from trajevo.formulation.cell.varied_points import VariedPoints
from trajevo.formulation.cell.visits import Visits
from trajevo.solvers.evolutionary.operators import crossed, mutated

#: Probabilities that an individual's order, and one of its postures, are changed by mutation.
ORDER_PROBABILITY, POSTURE_PROBABILITY = 0.3, 0.3

#: Least time of a leg, as a share of the mean of all legs, so that multiples of it are of use.
_LEAST_LEG = 0.05


class Choices(NamedTuple):
    """Where a problem's variables choose.

    Attributes:
        interpolant: the interpolant of the problem.
        visits: the arrangement whose columns choose.
        columns: the columns of the arrangement among the problem's variables.
    """

    interpolant: VariedPoints
    visits: Visits
    columns: slice

    def legs(self, X: Array) -> Array:
        """The time from rest to rest of the leg to which each variable belongs, 1 for others, (B, n_var)."""
        found = np.ones(X.shape)
        leg_of = self.interpolant.leg_of
        of_legs = np.flatnonzero(leg_of >= 0)
        if len(of_legs):
            times = self.visits.leg_times(X[:, self.columns])
            times = np.maximum(times, _LEAST_LEG * times.mean(axis=1, keepdims=True))
            found[:, of_legs] = times[:, leg_of[of_legs]]
        return found


def choices_of(problem: Any) -> Choices | None:
    """Where a problem's variables choose; None if none does."""
    interpolant = getattr(problem, "interpolant", None)
    if not isinstance(interpolant, VariedPoints) or not isinstance(interpolant.arrangement, Visits):
        return None
    visits = interpolant.arrangement
    if visits.order_columns.start == visits.posture_columns.stop:
        return None
    first = len(interpolant.variables) - len(visits.variables)
    return Choices(interpolant, visits, slice(first, first + len(visits.variables)))


@final
class ChoiceCrossover(Crossover):
    """Simulated binary crossover, order crossover for the order of visits, exchange for postures.

    Args:
        prob: probability of crossover, per pair of parents.
        eta: distribution index of simulated binary crossover.
    """

    def __init__(self, prob: float = 0.9, eta: float = 15.0) -> None:
        super().__init__(2, 2, prob=prob)
        self.eta = eta

    def _do(self, problem: Any, X: Array, *args: Any, random_state: np.random.Generator, **kwargs: Any) -> Array:
        """Children of pairs of parents (2, N, n_var)."""
        choices = choices_of(problem)
        sbx = SBX(prob=1.0, eta=self.eta)
        if choices is None:
            return crossed(sbx, problem, X, random_state)
        flat = X.reshape(-1, X.shape[2])
        legs = choices.legs(flat)
        shares = SimpleNamespace(xl=problem.xl / legs.max(axis=0), xu=problem.xu / legs.min(axis=0))
        children = crossed(sbx, shares, (flat / legs).reshape(X.shape), random_state).reshape(flat.shape)
        own = children[:, choices.columns]
        visits, held = choices.visits, choices.visits.posture_columns
        parents = X[:, :, choices.columns]
        exchanged = random_state.random(parents[0, :, held].shape) < 0.5
        pair = [np.where(exchanged, parents[1 - k, :, held], parents[k, :, held]) for k in range(2)]
        own[:, held] = np.concatenate(pair)
        if visits.free is not None:
            orders = visits.orders(parents.reshape(-1, parents.shape[2])).reshape(2, X.shape[1], -1)
            own[:, visits.order_columns] = ordered(visits, orders, random_state)
        return _timed(choices, problem, children, own).reshape(X.shape)


@final
class ChoiceMutation(Mutation):
    """Polynomial mutation, inversion of a part of the order of visits, and postures that are drawn again.

    Args:
        prob: probability of mutation, per individual.
        eta: distribution index of polynomial mutation.
        prob_var: probability of mutation, per variable; pymoo's own if None.
        order: probability that an individual's order is changed.
        posture: probability that one of its postures is drawn again.
    """

    def __init__(
        self,
        prob: float = 1.0,
        eta: float = 20.0,
        prob_var: float | None = None,
        order: float = ORDER_PROBABILITY,
        posture: float = POSTURE_PROBABILITY,
    ) -> None:
        super().__init__(prob=prob, prob_var=prob_var)
        self.eta, self.order, self.posture = eta, order, posture

    def _do(self, problem: Any, X: Array, *args: Any, random_state: np.random.Generator, **kwargs: Any) -> Array:
        """Individuals (N, n_var) after mutation."""
        rate = self.get_prob_var(problem)
        changed = mutated(PM(prob=1.0, eta=self.eta, prob_var=rate), problem, X, random_state)
        choices = choices_of(problem)
        if choices is None:
            return changed
        visits, parents = choices.visits, X[:, choices.columns]
        changed = changed / choices.legs(X)
        own = changed[:, choices.columns]
        held = visits.posture_columns
        drawn = random_state.random(parents[:, held].shape) < self.posture / max(held.stop - held.start, 1)
        width = problem.xu[choices.columns][held]
        own[:, held] = np.where(drawn, width * random_state.random(drawn.shape), parents[:, held])
        if visits.free is not None:
            own[:, visits.order_columns] = inverted(visits, visits.orders(parents), self.order, random_state)
        return _timed(choices, problem, changed, own)


def _timed(choices: Choices, problem: Any, shares: Array, own: Array) -> Array:
    """Individuals from variables as multiples of their legs and from columns that choose, within the bounds."""
    shares[:, choices.columns] = choices.visits.plain(own)
    found: Array = np.clip(shares * choices.legs(shares), problem.xl, problem.xu)
    return found


def ordered(visits: Visits, orders: Array, random: np.random.Generator) -> Array:
    """Keys of the children of pairs of orders by order crossover, group by group.

    The child has a part of one parent at the same places; the other points follow each other as in the other parent.

    Args:
        visits: the arrangement, with a free order.
        orders: number of the point at each place, shape (2, N, K).
        random: random generator.

    Returns:
        Shape (2 N, number of free points), first children before second ones.
    """
    free = visits.free
    if free is None:
        raise ValueError("expected a free order")
    found = []
    for group in free.groups:
        places = [_ranks(each, group) for each in orders]
        start, end = _parts(len(places[0]), len(group), random)
        both = []
        for own, other in (places, places[::-1]):
            given = (other >= start) & (other <= end)
            rank = np.argsort(np.argsort(np.where(given, len(group), own), axis=1, kind="stable"), axis=1)
            both.append(np.where(given, other, np.where(rank < start, rank, rank + end - start + 1)))
        found.append((np.concatenate(both) + 0.5) / len(group))
    return np.concatenate(found, axis=1)


def inverted(visits: Visits, orders: Array, probability: float, random: np.random.Generator) -> Array:
    """Keys of orders of which some have a part of one group the other way round.

    Args:
        visits: the arrangement, with a free order.
        orders: number of the point at each place, shape (N, K).
        probability: of a change, per order.
        random: random generator.

    Returns:
        Shape (N, number of free points).
    """
    free = visits.free
    if free is None:
        raise ValueError("expected a free order")
    chosen = random.random(len(orders)) < probability
    which = random.integers(len(free.groups), size=len(orders))
    found = []
    for g, group in enumerate(free.groups):
        place = _ranks(orders, group)
        start, end = _parts(len(orders), len(group), random)
        turned = (chosen & (which == g))[:, None] & (place >= start) & (place <= end)
        found.append((np.where(turned, start + end - place, place) + 0.5) / len(group))
    return np.concatenate(found, axis=1)


def _ranks(orders: Array, group: tuple[int, ...]) -> Array:
    """Which of a group's places each of its points has, from 0, (N, K) -> (N, points of the group)."""
    inner = orders[:, list(group)]
    return np.argsort(inner, axis=1, kind="stable")


def _parts(count: int, size: int, random: np.random.Generator) -> tuple[Array, Array]:
    """Two different places for each of some individuals, the lesser first, (N, 1) each."""
    one = random.integers(size, size=(count, 1))
    other = (one + random.integers(1, size, size=(count, 1))) % size
    return np.minimum(one, other), np.maximum(one, other)
