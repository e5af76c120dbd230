"""Limits of velocity, acceleration and jerk along a path, (15) to (17) of Paing 2021, and their derivatives."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import final

import numpy as np

from trajevo.base import polynomials
from trajevo.base.arrays import Array
from trajevo.path.curve import GeometricPath
from trajevo.robot.joints import JointLimits
from trajevo.solvers.along_path.program import Linearised
from trajevo.trajectory.batch import DERIVATIVES

#: Names of the limits of the first three derivatives.
_KINDS = DERIVATIVES[1:]


class PathLimits(ABC):
    """Limits of one kind on motions along a path, in states u, u', u'', u''' of unit time, shape (K, 4)."""

    @abstractmethod
    def least_time(self, states: Array, at_least: float) -> float:
        """Least time of a motion with these states that keeps the limits, and is not below another [s]; inf if none."""

    @abstractmethod
    def linearised(self, states: Array, time: float) -> Linearised:
        """The limits near these states and a time [s]."""

    @final
    def excess(self, states: Array, time: float) -> Array:
        """By how much each instant exceeds a limit in a time [s], as a share of it, shape (K,)."""
        near = self.linearised(states, time)
        worst: Array = -np.minimum(near.above, near.below).min(axis=1)
        return worst


@final
@dataclass(frozen=True, eq=False)
class PathDerivatives:
    """s(u) and its first four derivatives.

    Attributes:
        path: the path.
    """

    path: GeometricPath

    def __call__(self, u: Array) -> list[Array]:
        """TimedShape (K,) -> five arrays (K, n_axes)."""
        inside = np.clip(u, 0.0, 1.0)
        piece = np.searchsorted(self.path.breaks[1:-1], inside, side="right")
        offset = inside - self.path.breaks[piece]
        return [polynomials.values(part[..., piece], offset).T for part in self._pieces]

    @cached_property
    def _pieces(self) -> list[Array]:
        found = [self.path.pieces(order) for order in range(4)]
        return [*found, polynomials.derivative(found[3], 1) if len(found[3]) > 1 else np.zeros_like(found[3])]


@final
@dataclass(frozen=True, eq=False)
class KinematicLimits(PathLimits):
    """PathLimits of velocity, acceleration and jerk of every axis, the same in both directions.

    Attributes:
        path: the path.
        limits: limits of the axes; at least one is finite.
    """

    path: PathDerivatives
    limits: JointLimits

    def least_time(self, states: Array, at_least: float) -> float:
        """The closed form of :class:`~trajevo.trajectory.interpolants.Reparameterisation`, at the instants alone."""
        values, _, powers = self._shares(states)
        return max(at_least, float((np.abs(values).max(axis=0) ** (1.0 / powers)).max()))

    def linearised(self, states: Array, time: float) -> Linearised:
        """Tangents; that of T^d lies below T^d, so that the limits are never wider than they are."""
        values, slopes, powers = self._shares(states)
        scale = time**-powers
        values, slower = values * scale, np.broadcast_to(powers, values.shape)
        return Linearised(slopes * scale[:, None], 1.0 - values, 1.0 + values, slower, slower)

    def _shares(self, states: Array) -> tuple[Array, Array, Array]:
        """Derivatives in unit time as shares of limits (K, R), slopes (K, R, 4), and the order of each, (R,)."""
        values, slopes, powers = [], [], []
        kinds = zip(_KINDS, derivatives(self.path, states), strict=True)
        for order, (name, (value, slope)) in enumerate(kinds, start=1):
            limit = getattr(self.limits, name)
            kept = np.flatnonzero(np.isfinite(limit))
            values.append(value[:, kept] / limit[kept])
            slopes.append(slope[:, kept] / limit[kept, None])
            powers.append(np.full(len(kept), float(order)))
        return np.concatenate(values, axis=1), np.concatenate(slopes, axis=1), np.concatenate(powers)


def derivatives(path: PathDerivatives, states: Array) -> list[tuple[Array, Array]]:
    """Velocity, acceleration and jerk in unit time (K, n_axes), each with its slopes (K, n_axes, 4)."""
    v, a, j = (states[:, order, None] for order in (1, 2, 3))
    _, s1, s2, s3, s4 = path(states[:, 0])
    none = np.zeros_like(s1)
    kinds = (
        (s1 * v, (s2 * v, s1, none, none)),
        (s2 * v**2 + s1 * a, (s3 * v**2 + s2 * a, 2.0 * s2 * v, s1, none)),
        (
            s3 * v**3 + 3.0 * s2 * v * a + s1 * j,
            (s4 * v**3 + 3.0 * s3 * v * a + s2 * j, 3.0 * (s3 * v**2 + s2 * a), 3.0 * s2 * v, s1),
        ),
    )
    return [(value, np.stack(slopes, axis=2)) for value, slopes in kinds]
