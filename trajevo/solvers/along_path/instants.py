"""Instants at which motions along a path are looked at, and what the control points of u(t) do to u there.

Every instant depends on as many neighbouring control points as the order of u(t), so that sums over instants give
banded matrices.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import perm
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.trajectory.parameterisation import span_coefficients

#: Number of derivatives of u that limits depend on, u itself included: u, u', u'', u'''.
STATES = 4

#: Control points at each end that rest fixes: 0, 0, 0 and 1, 1, 1.
HELD = 3


@final
@dataclass(frozen=True, eq=False)
class Instants:
    """K instants in unit time, for B-splines u(t) with uniform knots.

    Attributes:
        count: number of control points of u(t).
        order: order of u(t).
        span: polynomial piece of u(t) in which each instant lies, shape (K,).
        share: where in the piece it lies, from 0 to 1, shape (K,).
    """

    count: int
    order: int
    span: Array
    share: Array

    @classmethod
    def even(cls, count: int, order: int, per_span: int) -> Instants:
        """As many evenly spaced instants in every piece, and the end.

        A jump of the highest derivative between two pieces is looked at from both sides where it can have a jerk.
        """
        jumps = order <= STATES
        shares = np.linspace(0.0, 1.0, per_span) if jumps else np.arange(per_span) / per_span
        spans = count - order + 1
        span, share = np.repeat(np.arange(spans), per_span), np.tile(shares, spans)
        if not jumps:
            span, share = np.append(span, spans - 1), np.append(share, 1.0)
        return cls(count, order, span, share)

    def with_more(self, others: Instants, chosen: Array) -> Instants:
        """These and chosen ones of other instants."""
        span, share = np.append(self.span, others.span[chosen]), np.append(self.share, others.share[chosen])
        return Instants(self.count, self.order, span, share)

    @property
    def free(self) -> slice:
        """The control points that are not fixed by rest at the ends."""
        return slice(HELD, self.count - HELD)

    def states(self, control_points: Array) -> Array:
        """Values of u and its derivatives in unit time of control points (count,), shape (K, 4)."""
        found: Array = np.matmul(self.basis, control_points[self.places][:, :, None])[:, :, 0]
        return found

    @cached_property
    def basis(self) -> Array:
        """Derivatives of u per control point that an instant depends on, shape (K, 4, order)."""
        spans = self.count - self.order + 1
        powers = span_coefficients(self.order, self.count).reshape(self.count, self.order, spans)
        local = powers[self.places, :, self.span[:, None]]  # (K, control point, power)
        found = np.empty((len(self.span), STATES, self.order))
        for taken in range(STATES):
            rates = np.array([perm(power, taken) for power in range(taken, self.order)]) * float(spans) ** taken
            shares = self.share[:, None] ** np.arange(self.order - taken) * rates
            found[:, taken] = np.matmul(local[:, :, taken:], shares[:, :, None])[:, :, 0]
        return found

    @cached_property
    def places(self) -> Array:
        """Numbers of the control points that an instant depends on, shape (K, order)."""
        found: Array = self.span[:, None] + np.arange(self.order)
        return found

    def spread(self, slopes: Array) -> Array:
        """Sum over the instants of slopes with respect to states (K, 4), with respect to control points (count,)."""
        local = np.matmul(slopes[:, None, :], self.basis)[:, 0]
        return np.bincount(self.places.ravel(), local.ravel(), self.count)

    def gram(self, weights: Array) -> Array:
        """Sum over the instants of quadratic forms of states (K, 4, 4), as one of the control points.

        Returns:
            The lower diagonals as :func:`scipy.linalg.cholesky_banded` expects them, shape (order, count).
        """
        local = np.matmul(np.swapaxes(self.basis, 1, 2), np.matmul(weights, self.basis))
        row, column, flat = self._band
        summed = np.bincount(flat, local[:, row, column].ravel(), self.order * self.count)
        return summed.reshape(self.order, self.count)

    @cached_property
    def _band(self) -> tuple[Array, Array, Array]:
        row, column = np.triu_indices(self.order)
        flat = (column - row) * self.count + self.span[:, None] + row
        return row, column, flat.ravel()
