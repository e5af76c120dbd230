"""Transmissions: maps from actuator coordinates, in which motions are planned, to model coordinates.

Formulas are analytic, so they take complex arrays too (derivatives by complex step).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.robot.urdf.joints import Follower


class Transmission(ABC):
    """A map ψ(q) from n_joints actuator coordinates to n_model coordinates of the model, at least as many."""

    @abstractmethod
    def motion(self, q: Array, v: Array, a: Array) -> tuple[Array, Array, Array]:
        """Positions, velocities and accelerations of the model, (..., n_joints) -> (..., n_model), SI."""

    @abstractmethod
    def effort(self, q: Array, torque: Array) -> Array:
        """Actuator efforts Jᵀ τ of model torques τ at actuator positions q, (..., n_model) -> (..., n_joints), SI."""

    @abstractmethod
    def reach(self, imaginary: Array, q: Array, v: Array, a: Array) -> tuple[Array, Array, Array, Array]:
        """Bounds of a motion in model coordinates from its bounds in actuator coordinates, at complex instants.

        Args:
            imaginary: bounds of the imaginary parts of the positions, shape (..., n_joints) [rad or m].
            q: bounds of the magnitudes of the positions, the same shape [rad or m].
            v: the same for velocities [rad/s or m/s].
            a: the same for accelerations [rad/s² or m/s²].

        Returns:
            The same four bounds in model coordinates, shapes (..., n_model) [SI]; inf where there is no bound.
        """

    @abstractmethod
    def effort_reach(self, imaginary: Array, torque: Array) -> Array:
        """Bounds of the magnitudes of actuator efforts, shape (..., n_joints) [N·m or N].

        Args:
            imaginary: as for :meth:`reach`.
            torque: bounds of the magnitudes of model torques, shape (..., n_model) [N·m or N].
        """


@final
@dataclass(frozen=True)
class Direct(Transmission):
    """Every actuator drives one joint of the model."""

    def motion(self, q: Array, v: Array, a: Array) -> tuple[Array, Array, Array]:
        """The same arrays."""
        return q, v, a

    def effort(self, q: Array, torque: Array) -> Array:
        """The same torques."""
        del q
        return torque

    def reach(self, imaginary: Array, q: Array, v: Array, a: Array) -> tuple[Array, Array, Array, Array]:
        """The same arrays."""
        return imaginary, q, v, a

    def effort_reach(self, imaginary: Array, torque: Array) -> Array:
        """The same torques."""
        del imaginary
        return torque


class Mimic(NamedTuple):
    """A coordinate of the model that follows another: multiplier × leader + offset.

    Attributes:
        column: its index in model coordinates.
        leader: index of its leader in actuator coordinates.
        multiplier: units of the coordinate per unit of its leader.
        offset: its position where its leader is at 0 [rad or m].
    """

    column: int
    leader: int
    multiplier: float
    offset: float


@final
@dataclass(frozen=True)
class Mimicking(Transmission):
    """Some joints of the model follow others, as the fingers of a gripper; every other joint has its own actuator.

    By virtual work, an actuator bears the torque of its own joint and multiplier times that of every follower.

    Attributes:
        own: index in model coordinates of the joint that each actuator drives itself, in the order of the actuators.
        mimics: the other coordinates of the model.
    """

    own: tuple[int, ...]
    mimics: tuple[Mimic, ...]

    __repr__ = brief

    @classmethod
    def of(cls, model: Sequence[str], followers: Sequence[Follower]) -> Mimicking:
        """The transmission of a model with joints of these names, of which some follow others."""
        following = {each.name for each in followers}
        names = [name for name in model if name not in following]
        return cls(
            tuple(model.index(name) for name in names),
            tuple(
                Mimic(model.index(each.name), names.index(each.leader), each.multiplier, each.offset)
                for each in followers
            ),
        )

    def motion(self, q: Array, v: Array, a: Array) -> tuple[Array, Array, Array]:
        """Of followers multiplier q + offset, multiplier v and multiplier a."""
        position, velocity, acceleration = (self._led(x) for x in (q, v, a))
        for mimic in self.mimics:
            position[..., mimic.column] += mimic.offset
        return position, velocity, acceleration

    def effort(self, q: Array, torque: Array) -> Array:
        """The torque of the own joint and multiplier times that of every follower."""
        del q
        effort = torque[..., list(self.own)]
        for mimic in self.mimics:
            effort[..., mimic.leader] += mimic.multiplier * torque[..., mimic.column]
        return effort

    def reach(self, imaginary: Array, q: Array, v: Array, a: Array) -> tuple[Array, Array, Array, Array]:
        """The magnitudes of followers are |multiplier| times those of their leaders, and |offset| more in positions."""
        most_imaginary, position, velocity, acceleration = (np.abs(self._led(x)) for x in (imaginary, q, v, a))
        for mimic in self.mimics:
            position[..., mimic.column] += abs(mimic.offset)
        return most_imaginary, position, velocity, acceleration

    def effort_reach(self, imaginary: Array, torque: Array) -> Array:
        """As :meth:`effort`, with the magnitudes of multipliers."""
        del imaginary
        effort = torque[..., list(self.own)]
        for mimic in self.mimics:
            effort[..., mimic.leader] += abs(mimic.multiplier) * torque[..., mimic.column]
        return effort

    def _led(self, x: Array) -> Array:
        """Actuator coordinates times the multipliers, (..., n_joints) -> (..., n_model)."""
        led = np.empty((*x.shape[:-1], len(self.own) + len(self.mimics)), dtype=x.dtype)
        led[..., list(self.own)] = x
        for mimic in self.mimics:
            led[..., mimic.column] = mimic.multiplier * x[..., mimic.leader]
        return led


@final
@dataclass(frozen=True)
class CoupledScrews(Transmission):
    """Two parallel screws that together drive a slide and a swivel (Guo 2016, eqs. (1), (43), (90), (110)).

    slide = (x₁ + x₂)/2, swivel = atan((x₂ - x₁)/span).

    Attributes:
        slide: index of the slide in model coordinates, and of the first screw in actuator coordinates.
        swivel: index of the swivel, and of the second screw.
        span: distance between the screws [m].
    """

    slide: int
    swivel: int
    span: float

    def motion(self, q: Array, v: Array, a: Array) -> tuple[Array, Array, Array]:
        """ψ, J v and J a + J' v: the last has the term -2 L u u'²/(L² + u²)² of eq. (43)."""
        u, du, ddu = (x[..., self.swivel] - x[..., self.slide] for x in (q, v, a))
        share = self.span / (self.span**2 + u * u)
        rate = share * du
        swivel = np.arctan(u / self.span), rate, share * ddu - 2.0 / self.span * u * rate * rate
        position, velocity, acceleration = (
            self._replaced(x, 0.5 * (x[..., self.slide] + x[..., self.swivel]), turned)
            for x, turned in zip((q, v, a), swivel, strict=True)
        )
        return position, velocity, acceleration

    def effort(self, q: Array, torque: Array) -> Array:
        """Eq. (110): each screw carries half of the slide's force, minus or plus its share of the swivel's torque."""
        u = q[..., self.swivel] - q[..., self.slide]
        half = 0.5 * torque[..., self.slide]
        share = torque[..., self.swivel] * self.span / (self.span**2 + u**2)
        return self._replaced(torque, half - share, half + share)

    def reach(self, imaginary: Array, q: Array, v: Array, a: Array) -> tuple[Array, Array, Array, Array]:
        """All ratios have the denominator L² + u²; its least magnitude, L² - y², is at the imaginary number u = iy."""
        y, u, du, ddu = (x[..., self.swivel] + x[..., self.slide] for x in (imaginary, q, v, a))
        share = self._greatest_share(y)
        swivel = y * share, 0.5 * np.pi + y * share, du * share, ddu * share + 2.0 / self.span * u * (du * share) ** 2
        bounds = (
            self._replaced(x, 0.5 * (x[..., self.slide] + x[..., self.swivel]), turned)
            for x, turned in zip((imaginary, q, v, a), swivel, strict=True)
        )
        most_imaginary, position, velocity, acceleration = bounds
        return most_imaginary, position, velocity, acceleration

    def effort_reach(self, imaginary: Array, torque: Array) -> Array:
        """Half of the slide's force plus the share of the swivel's torque, for both screws."""
        y = imaginary[..., self.swivel] + imaginary[..., self.slide]
        both = 0.5 * torque[..., self.slide] + torque[..., self.swivel] * self._greatest_share(y)
        return self._replaced(torque, both, both)

    def _greatest_share(self, y: Array) -> Array:
        """Bound of |L/(L² + u²)| where the imaginary part of u does not exceed y; inf where L² + u² may be 0."""
        inside = y < self.span
        return np.where(inside, self.span / (self.span**2 - np.where(inside, y, 0.0) ** 2), np.inf)

    def _replaced(self, array: Array, slide: Array, swivel: Array) -> Array:
        replaced = array.copy()
        replaced[..., self.slide], replaced[..., self.swivel] = slide, swivel
        return replaced
