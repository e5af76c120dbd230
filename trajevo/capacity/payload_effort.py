"""Effort along a motion for every payload at once: exact in mass, centre of mass and inertia.

A payload of mass m, centre of mass c and inertia I about the tool's origin adds s₀ m + s·(m c) + S·I to each effort.
If the inertia about the centre of mass scales with the mass, m Ī, this is m f(c), where

    f(c) = s₀ + s·c + S·(Ī + |c|² 1 - c cᵀ)

is affine in c at rest and quadratic in motion. The limit |τ₀ + m f| <= limit allows the masses with m g <= h, where
g = ±f and h = limit ∓ τ₀. If h > 0, this means g/h <= 1/m. If h < 0, the motion breaks the limit without payload and
needs a mass of at least h/g. All bounds on m are therefore maxima of g/|h|.
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

#: Centres of mass that are computed together, few enough for a processor's cache.
_BLOCK = 48

#: Least divisor, in place of the remaining effort of a joint that is at its limit without payload.
_NO_ROOM = 1e-200


@final
@dataclass(frozen=True, eq=False)
class MassRange:
    """The masses that a motion can carry, from ``lower`` to ``upper``, for P centres of mass or boxes of them.

    Attributes:
        lower: least mass, above 0 where a motion needs the payload as a counterweight, NaN where no mass is feasible,
            shape (P,) [kg].
        upper: greatest mass, inf where nothing limits it, NaN where no mass is feasible, shape (P,) [kg].
        joint: index of the joint that binds at ``upper``, -1 where none does, shape (P,).
        time: instant at which it binds, NaN where none does, shape (P,) [s].
    """

    lower: Array
    upper: Array
    joint: Array
    time: Array


@final
@dataclass(frozen=True, eq=False)
class SlopeRows:
    """Slopes of all limited efforts divided by |h|, see the module's docstring.

    Attributes:
        above: rows with h >= 0, shape (R, 10); max g/h is the inverse of the greatest mass.
        joint: index of the joint of each row of ``above``, shape (R,).
        time: instant of each row of ``above``, shape (R,) [s].
        below: rows with h < 0, shape (R', 10); -max g/|h| is the inverse of the least mass.
    """

    above: Array
    joint: Array
    time: Array
    below: Array

    def mass_range(self, above: Array, index: Array, below: Array) -> MassRange:
        """The feasible masses, from the greatest g/|h| over either kind of rows.

        Args:
            above: greatest g/h over rows with h >= 0, -inf if there are none, shape (P,).
            index: index of the row that has it, shape (P,).
            below: greatest g/|h| over rows with h < 0, -inf if there are none, shape (P,).
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
        slopes: effort that each parameter adds per unit, in the order of :data:`trajevo.robot.payload.PARAMETERS`,
            shape (T, n_joints, 10).
        inertia: inertia of the payload about its centre of mass along the tool's axes, per kilogram, shape (3, 3) [m²].
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
            InvalidInputError: the payload has another model.
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
        """Greatest ratio of effort to limit with a payload at each centre of mass, shape (P,).

        The allowed centres of mass are exactly those where it is at most 1, provided that the inertia about the centre
        of mass scales with the mass.

        Args:
            mass: mass of the payload [kg].
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
            inertia: inertia along the tool's axes, shape (3, 3) [kg·m²]; its effort becomes part of ``base``.

        Raises:
            InvalidInputError: not a symmetric tensor without negative moments, or a payload model without inertia.
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
        """Whether effort is affine in the centre of mass, because inertia adds nothing to it."""
        return not _without_rounding(self.slopes)[..., 4:].any()

    @cached_property
    def rows(self) -> SlopeRows:
        """Slopes divided by the remaining effort |h|, for every joint that has a limit.

        Raises:
            InvalidInputError: no joint has one.
        """
        base, slopes, limit, joint, time = limited_efforts(self)
        room = np.concatenate([limit - base, limit + base])
        rows = np.concatenate([slopes, -slopes]) / np.maximum(np.abs(room), _NO_ROOM)[:, None]
        joint, time = np.tile(joint, 2), np.tile(time, 2)
        above = (room >= 0.0) & rows.any(axis=1)  # an effort that no payload changes cannot bind
        return SlopeRows(rows[above], joint[above], time[above], rows[room < 0.0])


def payload_effort(motion: Solution | Rollout | WeightedOptimum, *, samples: int = SAMPLES) -> PayloadEffort:
    """Effort along a motion for every payload.

    Args:
        motion: a solution of a front, an optimum, or the first trajectory of a rollout. The payload's model and inertia
            per kilogram are those of its rollout; its mass and centre of mass are not used.
        samples: instants per segment, both ends included.

    Raises:
        InvalidInputError: a payload model without centre of mass.
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
    """The ten parameters of one kilogram, (P, 10), with centres of mass (P, 3) [m] and an inertia (3, 3) [m²]."""
    about_tool = inertia + (com**2).sum(axis=1)[:, None, None] * np.eye(3) - com[:, :, None] * com[:, None, :]
    return np.column_stack([np.ones(len(com)), com, entries_of(about_tool)])


def quadratic_forms(rows: Array, inertia: Array) -> tuple[Array, Array, Array]:
    """Rows of slopes as quadratic forms a + b·c + cᵀ Q c of the centre of mass c.

    Args:
        rows: slopes per kilogram, shape (R, 10).
        inertia: inertia per kilogram about the centre of mass, shape (3, 3) [m²].

    Returns:
        a (R,), b (R, 3), Q (R, 3, 3).
    """
    tensors = tensor_of(rows[:, 4:] * np.array([1.0, 0.5, 1.0, 0.5, 0.5, 1.0]))
    trace = np.trace(tensors, axis1=1, axis2=2)
    a = rows[:, 0] + (tensors * inertia).sum(axis=(1, 2))
    return a, rows[:, 1:4], trace[:, None, None] * np.eye(3) - tensors


def limited_efforts(effort: PayloadEffort) -> tuple[Array, Array, Array, Array, Array]:
    """Efforts of every joint that has a limit, with slopes that are mere rounding set to 0.

    Returns:
        Base (R,), slopes (R, 10), limit (R,), index of the joint (R,), instant (R,) [s], with R = instants x joints.

    Raises:
        InvalidInputError: no joint has a limit.
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
    """Greatest product over the rows and the index of its row, both (P,); -inf and 0 without rows."""
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
    """Slopes with those that are mere rounding set to 0."""
    felt = np.abs(slopes)
    return np.where(felt > NEGLIGIBLE * felt.max(), slopes, 0.0)
