"""Effort along a motion for every payload at once: exact in mass, centre of mass and inertia.

A payload of mass m, centre of mass c and inertia I about the tool's origin adds s₀ m + s·(m c) + S·I to each effort.
With an inertia about the centre of mass that scales with the mass, m Ī, this is m f(c), where

    f(c) = s₀ + s·c + S·(Ī + |c|² 1 - c cᵀ)

is affine in c at rest and quadratic in motion. An effort |τ₀ + m f| <= limit leaves the masses with m g <= h, where
g = ±f and h = limit ∓ τ₀: g/h <= 1/m where h > 0, and where the motion breaks a limit without payload, h < 0, a mass
of at least h/g. All bounds on m are therefore maxima of g/|h|.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, frozen, numbers, one_blas_thread, row_products
from trajevo.capacity.dlcc import SAMPLES, sampled_motion
from trajevo.dynamics.payload_masses import NEGLIGIBLE
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.front.front import Solution
from trajevo.robot.payload import Payload, entries_of, tensor_of
from trajevo.robot.robot import Robot
from trajevo.solvers.gradient.weighted_sum import WeightedOptimum

#: Centres of mass that are looked at together, few enough for a processor's cache.
_BLOCK = 48

#: Stands for the room of a joint that is at its limit without payload.
_NO_ROOM = 1e-200


@final
@dataclass(frozen=True, eq=False)
class MassRange:
    """The masses that a motion can carry, from ``lower`` to ``upper``, for P centres of mass or boxes of them.

    Attributes:
        lower: shape (P,) [kg]; above 0 where a motion needs the payload as a counterweight, NaN where no mass is
            feasible.
        upper: shape (P,) [kg]; inf where nothing limits it, NaN where no mass is feasible.
        joint: index of the joint that binds at ``upper``, -1 where none does, shape (P,).
        time: when it binds, NaN where none does, shape (P,) [s].
    """

    lower: Array
    upper: Array
    joint: Array
    time: Array


@final
@dataclass(frozen=True, eq=False)
class SlopeRows:
    """Slopes of all efforts over |h|, those with a limit; see the module.

    Attributes:
        above: where h > 0, shape (R, 10); max g/h is the inverse of the greatest mass.
        joint: of the rows of ``above``, shape (R,).
        time: of the rows of ``above``, shape (R,) [s].
        below: where h < 0, shape (R', 10); -max g/|h| is the inverse of the least mass.
    """

    above: Array
    joint: Array
    time: Array
    below: Array

    def mass_range(self, above: Array, index: Array, below: Array) -> MassRange:
        """The masses that greatest g/h over both kinds of rows leave.

        Args:
            above: greatest g/h, -inf where there are no rows, shape (P,).
            index: the row of ``above`` that it is of, shape (P,).
            below: greatest g/|h|, -inf where there are no rows, shape (P,).
        """
        upper = np.where(above > 0.0, 1.0 / np.where(above > 0.0, above, 1.0), np.inf)
        lower = np.where(below < 0.0, -1.0 / np.where(below < 0.0, below, -1.0), np.inf)
        never = (lower > upper) | np.isinf(lower)
        binds = np.isfinite(upper) & ~never
        joint, time = np.full(upper.shape, -1), np.full(upper.shape, np.nan)
        joint[binds], time[binds] = self.joint[index[binds]], self.time[index[binds]]
        joint.setflags(write=False)
        lower, upper = (frozen(np.where(never, np.nan, bound)) for bound in (lower, upper))
        return MassRange(lower, upper, joint, frozen(time))


@final
@dataclass(frozen=True, eq=False)
class PayloadEffort:
    """Effort along one motion as an affine function of a payload's ten parameters.

    Attributes:
        robot: the robot.
        times: instants, shape (T,) [s].
        base: effort without payload, shape (T, n_joints) [N·m or N].
        slopes: what each parameter adds per unit, in the order of :data:`trajevo.robot.payload.PARAMETERS`, shape
            (T, n_joints, 10).
        inertia: of the payload about its centre of mass along the tool's axes, per kilogram, shape (3, 3) [m²].
        payload_model: how the payload acts, ``"rigid"`` or ``"weight_only"``.
    """

    robot: Robot
    times: Array
    base: Array
    slopes: Array
    inertia: Array
    payload_model: str

    def effort(self, payload: Payload) -> Array:
        """Effort with a payload, shape (T, n_joints) [N·m or N].

        Raises:
            InvalidInputError: the payload acts in another way.
        """
        if payload.model != self.payload_model:
            raise InvalidInputError(f"payload.model: expected {self.payload_model!r} as here, got {payload.model!r}")
        if payload.mass == 0.0:
            return self.base
        own = np.zeros((3, 3)) if payload.inertia is None else np.array(payload.inertia)
        shape = com_features(np.array([payload.com]), own / payload.mass)[0]
        return frozen(self.base + self.slopes @ (payload.mass * shape))

    def mass_range(self, com: Any) -> MassRange:
        """The masses that the motion can carry at each centre of mass, in closed form.

        Args:
            com: centres of mass in the tool frame, shape (P, 3) [m].

        Raises:
            InvalidInputError: another shape, or a robot without effort limits.
        """
        features = com_features(numbers(com, name="com", shape=("P", 3)), self.inertia)
        above, index = _greatest(self.rows.above, features)
        return self.rows.mass_range(above, index, _greatest(self.rows.below, features)[0])

    def used(self, mass: float, com: Any) -> Array:
        """Greatest effort over limit of a payload at each centre of mass, shape (P,).

        At most 1 is the exact set of allowed centres of mass, of any shape, for payloads whose inertia about the centre
        of mass scales with the mass.

        Args:
            mass: of the payload [kg].
            com: centres of mass in the tool frame, shape (P, 3) [m].

        Raises:
            InvalidInputError: a negative mass, another shape, or a robot without effort limits.
        """
        carried = Payload(mass).mass
        features = com_features(numbers(com, name="com", shape=("P", 3)), self.inertia)
        base, slopes, limit, _, _ = limited_efforts(self)
        signed = np.concatenate([base / limit, -base / limit])
        rows = np.concatenate([slopes, -slopes]) / np.tile(limit, 2)[:, None]
        columns = np.ascontiguousarray(carried * rows.T)
        greatest = np.empty(len(features))
        with one_blas_thread():
            for start in range(0, len(features), _BLOCK):
                block = slice(start, start + _BLOCK)
                greatest[block] = (row_products(features[block], columns) + signed).max(axis=1)
        return frozen(greatest)

    def with_inertia_about_tool(self, inertia: Any) -> PayloadEffort:
        """The same for payloads whose inertia about the tool's origin is known, whatever their mass.

        Effort is then affine in the centre of mass too, in motion as at rest.

        Args:
            inertia: along the tool's axes, shape (3, 3) [kg·m²]; ``base`` takes it on.

        Raises:
            InvalidInputError: no symmetric tensor without negative moments, or a payload that has no inertia.
        """
        tensor = numbers(inertia, name="inertia", shape=(3, 3))
        if not np.allclose(tensor, tensor.T, rtol=1e-9) or np.linalg.eigvalsh(tensor)[0] < 0.0:
            raise InvalidInputError(
                f"inertia: expected a symmetric tensor without negative moments, got {tensor.tolist()}"
            )
        if self.payload_model != "rigid":
            raise InvalidInputError(f"inertia: the model {self.payload_model!r} has no inertia")
        slopes = self.slopes.copy()
        slopes[..., 4:] = 0.0
        base = self.base + self.slopes[..., 4:] @ entries_of(tensor)
        return replace(self, base=frozen(base), slopes=frozen(slopes))

    @cached_property
    def affine(self) -> bool:
        """Whether effort is affine in the centre of mass: no inertia has a part in it."""
        return not _without_rounding(self.slopes)[..., 4:].any()

    @cached_property
    def rows(self) -> SlopeRows:
        """Slopes over what is left of the limits, of every joint that has one.

        Raises:
            InvalidInputError: none has.
        """
        base, slopes, limit, joint, time = limited_efforts(self)
        room = np.concatenate([limit - base, limit + base])
        rows = np.concatenate([slopes, -slopes]) / np.maximum(np.abs(room), _NO_ROOM)[:, None]
        joint, time = np.tile(joint, 2), np.tile(time, 2)
        above = (room >= 0.0) & rows.any(axis=1)  # what no payload loads binds none
        return SlopeRows(rows[above], joint[above], time[above], rows[room < 0.0])


def payload_effort(motion: Solution | Rollout | WeightedOptimum, *, samples: int = SAMPLES) -> PayloadEffort:
    """Effort along a motion for every payload.

    Args:
        motion: a solution of a front, an optimum, or a rollout (of its batch the first trajectory counts). How the
            payload acts and its inertia per kilogram are the rollout's own; its mass and centre of mass play no part.
        samples: instants per segment, both ends included.

    Raises:
        InvalidInputError: a payload whose model knows no centre of mass.
    """
    fine = sampled_motion(motion, samples)
    payload = fine.dynamics.payload
    inertia = np.zeros((3, 3)) if payload.inertia is None else np.array(payload.inertia) / payload.mass
    return PayloadEffort(
        robot=fine.robot,
        times=frozen(fine.t[0]),
        base=frozen(fine.unloaded_effort[0]),
        slopes=frozen(fine.dynamics.effort_per_parameter(fine.q[0], fine.v[0], fine.a[0])),
        inertia=frozen(inertia),
        payload_model=payload.model,
    )


def com_features(com: Array, inertia: Array) -> Array:
    """The ten parameters of one kilogram, shape (P, 10), of centres of mass (P, 3) [m] and its inertia (3, 3) [m²]."""
    about_tool = inertia + (com**2).sum(axis=1)[:, None, None] * np.eye(3) - com[:, :, None] * com[:, None, :]
    return np.column_stack([np.ones(len(com)), com, entries_of(about_tool)])


def quadratic_forms(rows: Array, inertia: Array) -> tuple[Array, Array, Array]:
    """The same rows as a + b·c + cᵀ Q c of a centre of mass c.

    Args:
        rows: shape (R, 10).
        inertia: per kilogram about the centre of mass, shape (3, 3) [m²].

    Returns:
        a (R,), b (R, 3), Q (R, 3, 3).
    """
    tensors = tensor_of(rows[:, 4:] * np.array([1.0, 0.5, 1.0, 0.5, 0.5, 1.0]))
    trace = np.trace(tensors, axis1=1, axis2=2)
    a = rows[:, 0] + (tensors * inertia).sum(axis=(1, 2))
    return a, rows[:, 1:4], trace[:, None, None] * np.eye(3) - tensors


def limited_efforts(effort: PayloadEffort) -> tuple[Array, Array, Array, Array, Array]:
    """Efforts of every joint that has a limit, R = instants x joints of them, without the rounding of the slopes.

    Returns:
        Base (R,), slopes (R, 10), limit (R,), index of the joint (R,), instant (R,) [s].

    Raises:
        InvalidInputError: none has.
    """
    limit = effort.robot.limits.effort
    limited = np.flatnonzero(np.isfinite(limit))
    if not len(limited):
        raise InvalidInputError(f"robot {effort.robot.name!r} has no effort limits, so nothing bounds its payload")
    instants, joint = (grid.ravel() for grid in np.indices((len(effort.times), len(limited))))
    joint = limited[joint]
    slopes = _without_rounding(effort.slopes)
    return effort.base[instants, joint], slopes[instants, joint], limit[joint], joint, effort.times[instants]


def _greatest(rows: Array, features: Array) -> tuple[Array, Array]:
    """Greatest product over the rows and which it is of, both (P,); -inf and 0 without rows."""
    value, index = np.full(len(features), -np.inf), np.zeros(len(features), dtype=np.int64)
    if not len(rows):
        return value, index
    columns = np.ascontiguousarray(rows.T)
    with one_blas_thread():
        for start in range(0, len(features), _BLOCK):
            block = slice(start, start + _BLOCK)
            products = row_products(features[block], columns)
            index[block] = products.argmax(axis=1)
            value[block] = np.take_along_axis(products, index[block, None], axis=1)[:, 0]
    return value, index


def _without_rounding(slopes: Array) -> Array:
    """Slopes that are only rounding set to 0."""
    felt = np.abs(slopes)
    return np.where(felt > NEGLIGIBLE * felt.max(), slopes, 0.0)
