"""From the joints for which motions are planned to those of the model, of which some may follow others.

All maps are linear and keep complex steps; to the bit, numbers of a row do not depend on other rows.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.robot.robot import Robot
from trajevo.robot.transmission import Mimic, Mimicking


@final
@dataclass(frozen=True, eq=False)
class Coordinates:
    """Every coordinate of the model is a factor times one of the n_joints actuated ones, and an offset.

    Attributes:
        columns: the actuated coordinate of each, shape (n_model,).
        factors: shape (n_model,).
        offsets: shape (n_model,) [rad or m].
        own: coordinates of the model that actuators drive themselves, in their order, shape (n_joints,).
        mimics: the others.
    """

    columns: Array
    factors: Array
    offsets: Array
    own: Array
    mimics: tuple[Mimic, ...]

    @classmethod
    def of(cls, robot: Robot) -> Coordinates:
        """The coordinates of a robot whose actuators drive its joints directly, with or without followers."""
        count, transmission = robot.model.nv, robot.transmission
        own: Array = np.arange(count)
        mimics: tuple[Mimic, ...] = ()
        if isinstance(transmission, Mimicking):
            own, mimics = np.array(transmission.own, dtype=np.intp), transmission.mimics
        columns, factors, offsets = np.zeros(count, np.intp), np.ones(count), np.zeros(count)
        columns[own] = np.arange(len(own))
        for mimic in mimics:
            columns[mimic.column], factors[mimic.column] = mimic.leader, mimic.multiplier
            offsets[mimic.column] = mimic.offset
        return cls(columns, factors, offsets, own, mimics)

    def positions(self, q: Array) -> Array:
        """Positions of the model's joints, (..., n_joints) -> (..., n_model) [rad or m]."""
        if not self.mimics:
            return q
        found: Array = np.take(q, self.columns, axis=-1) * self.factors + self.offsets
        return found

    def ranges(self, lower: Array, upper: Array) -> tuple[Array, Array]:
        """Least and greatest positions of the model's joints, shapes as for :meth:`positions`."""
        ends = self.positions(lower), self.positions(upper)
        if not self.mimics:
            return ends
        back = self.factors < 0.0
        return np.where(back, ends[1], ends[0]), np.where(back, ends[0], ends[1])

    def sizes(self, values: Array) -> Array:
        """Greatest magnitudes of velocities or accelerations, (..., n_joints) -> (..., n_model)."""
        if not self.mimics:
            return values
        found: Array = np.take(values, self.columns, axis=-1) * np.abs(self.factors)
        return found

    def slopes(self, of_model: Array) -> Array:
        """Derivatives with respect to the actuated coordinates, (..., n_model) -> (..., n_joints)."""
        return self._gathered(of_model, lambda multiplier: multiplier)

    def reaches(self, of_model: Array) -> Array:
        """Bounds of such derivatives from bounds of those of the model, (..., n_model) -> (..., n_joints)."""
        return self._gathered(of_model, abs)

    def _gathered(self, values: Array, factor: Any) -> Array:
        if not self.mimics:
            return values
        found: Array = np.take(values, self.own, axis=-1)
        for mimic in self.mimics:
            found[..., mimic.leader] += factor(mimic.multiplier) * values[..., mimic.column]
        return found
