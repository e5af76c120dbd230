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
from typing import Any, NamedTuple, final

import numpy as np

from trajevo.base.arrays import Array, frozen, numbers, one_blas_thread, row_products
from trajevo.base.shown.brief import brief
from trajevo.capacity.dlcc import SAMPLES, sampled_motion
from trajevo.dynamics.payload_bounds import REACH, bound_payloads
from trajevo.dynamics.payload_masses import NEGLIGIBLE
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.front.front import Solution
from trajevo.robot.joints import Sides, least_share
from trajevo.robot.payload import Payload, com_features, entries_of, quadratic_forms
from trajevo.robot.robot import Robot
from trajevo.solvers.gradient.weighted_sum import WeightedOptimum

#: Centres of mass that are computed together, few enough for a processor's cache.
_BLOCK = 48

#: Least and greatest tolerance of bounds.
_TOLERANCES = (1e-5, 0.1)

#: Share by which rows must differ to be told apart from the greatest one.
_ALIKE = 1e-9

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

    __repr__ = brief


@final
@dataclass(frozen=True, eq=False)
class SlopeRows:
    """Slopes of all limited efforts divided by |h|, see the module's docstring.

    Attributes:
        above: rows with h >= 0, shape (R, 10) [1 / parameter]; max g/h is the inverse of the greatest mass.
        joint: index of the joint of each row of ``above``, shape (R,).
        time: instant of each row of ``above``, shape (R,) [s].
        below: rows with h < 0, shape (R', 10) [1 / parameter]; -max g/|h| is the inverse of the least mass.
    """

    above: Array
    joint: Array
    time: Array
    below: Array

    def mass_range(self, above: Array, index: Array, below: Array) -> MassRange:
        """The feasible masses, from the greatest g/|h| over either kind of rows.

        Args:
            above: greatest g/h over rows with h >= 0 [1/kg], -inf if there are none, shape (P,).
            index: index of the row that has it, shape (P,).
            below: greatest g/|h| over rows with h < 0 [1/kg], -inf if there are none, shape (P,).
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

    It is known at sampled instants (:func:`payload_effort`), or bounded at every instant (:func:`payload_bounds`): then
    base and slopes are Bernstein coefficients of the effort over short pieces, and what follows from them is
    guaranteed for centres of mass up to :data:`trajevo.dynamics.payload_bounds.REACH` away from the tool's origin.

    Attributes:
        robot: the robot.
        times: instants, shape (T,) [s].
        base: effort without payload, shape (T, n_joints) [N·m or N].
        slopes: effort that each parameter adds per unit of it [N·m or N], in the order of
            :data:`trajevo.robot.payload.PARAMETERS`, shape (T, n_joints, 10).
        inertia: inertia of the payload about its centre of mass along the tool's axes, per kilogram, shape (3, 3) [m²].
        payload_model: how the payload acts, ``"rigid"`` or ``"weight_only"``.
        limit: effort limits that the motion's problem keeps, inf for none, shape (n_joints,) [N·m or N].
        samples: instants per segment, both ends included; None if every instant counts.
        above: what the effort may exceed ``base`` by, shape (T, n_joints) [N·m or N]; 0 at samples.
        below: what it may fall short of it by, the same shape [N·m or N].
        each: what either may be more by for each kilogram, the same shape [N·m/kg or N/kg].
        limit_backward: limits of negative efforts; None if they are as :attr:`limit`.
    """

    robot: Robot
    times: Array
    base: Array
    slopes: Array
    inertia: Array
    payload_model: str
    limit: Array
    samples: int | None
    above: Array
    below: Array
    each: Array
    limit_backward: Array | None = None

    __repr__ = brief

    @property
    def sides(self) -> Sides:
        """The limits in both directions."""
        return Sides(self.limit, self.limit if self.limit_backward is None else self.limit_backward)

    @property
    def kept(self) -> float:
        """Share of the robot's effort limits that :attr:`limit` keeps."""
        return least_share(self.sides.lesser, self.robot.limits.sides("effort").lesser)

    @property
    def at_full_limit(self) -> PayloadEffort:
        """The same with the robot's full effort limits."""
        limits = self.robot.limits
        return replace(self, limit=limits.effort, limit_backward=limits.effort_backward)

    def effort(self, payload: Payload) -> Array:
        """Effort with a payload, shape (T, n_joints) [N·m or N].

        Raises:
            InvalidInputError: the payload has another model, or efforts are not known at samples.
        """
        if self.samples is None:
            raise InvalidInputError("effort: expected efforts at samples, as payload_effort has them, got bounds")
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
        features = self._features(com)
        rows = self.rows_within(float(np.linalg.norm(features[:, 1:4], axis=1).max(initial=0.0)))
        above, index = _greatest(rows.above, features)
        return rows.mass_range(above, index, _greatest(rows.below, features)[0])

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
        features, efforts = self._features(com), limited_efforts(self)
        signed = efforts.base / efforts.limit
        columns = np.ascontiguousarray(carried * (efforts.slopes / efforts.limit[:, None]).T)
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
        # Errors are known for kilograms with their centre REACH away: the inertia is a sum of differences of these.
        more = 3.0 * np.trace(tensor) / REACH**2 * self.each
        return replace(
            self,
            base=frozen(base),
            slopes=frozen(slopes),
            above=frozen(self.above + more),
            below=frozen(self.below + more),
            each=frozen(2.0 * self.each),
        )

    def _features(self, com: Any) -> Array:
        """The ten parameters of a kilogram at each centre of mass, shape (P, 10)."""
        points = numbers(com, name="com", shape=("P", 3))
        check_reach(self, points)
        return com_features(points, self.inertia)

    @cached_property
    def affine(self) -> bool:
        """Whether effort is affine in the centre of mass, because inertia adds nothing to it."""
        return not _without_rounding(self.slopes)[..., 4:].any()

    def rows_within(self, distance: float) -> SlopeRows:
        """The rows that can be the greatest for some centre of mass within a distance of the origin [m]."""
        near = [form.can_be_greatest(distance) for form in self._forms]
        rows = self.rows
        return SlopeRows(rows.above[near[0]], rows.joint[near[0]], rows.time[near[0]], rows.below[near[1]])

    @cached_property
    def _forms(self) -> tuple[_Forms, _Forms]:
        return _Forms.of(self.rows.above, self.inertia), _Forms.of(self.rows.below, self.inertia)

    @cached_property
    def rows(self) -> SlopeRows:
        """Slopes divided by the remaining effort |h|, for every joint that has a limit.

        Raises:
            InvalidInputError: no joint has one.
        """
        efforts = limited_efforts(self)
        room = efforts.limit - efforts.base
        rows = efforts.slopes / np.maximum(np.abs(room), _NO_ROOM)[:, None]
        above = (room >= 0.0) & rows.any(axis=1)  # an effort that no payload changes cannot bind
        return SlopeRows(rows[above], efforts.joint[above], efforts.time[above], rows[room < 0.0])


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
    none = frozen(np.zeros(fine.unloaded_effort[0].shape))
    return PayloadEffort(
        robot=fine.robot,
        times=frozen(fine.t[0]),
        base=frozen(fine.unloaded_effort[0]),
        slopes=frozen(fine.dynamics.effort_per_parameter(fine.q[0], fine.v[0], fine.a[0], fine.segments)),
        inertia=frozen(_per_kilogram(payload)),
        payload_model=payload.model,
        limit=fine.limits.effort,
        samples=samples,
        above=none,
        below=none,
        each=none,
        limit_backward=fine.limits.effort_backward,
    )


def payload_bounds(motion: Solution | Rollout | WeightedOptimum, *, tolerance: float = 1e-3) -> PayloadEffort:
    """Bounds of the effort along a motion for every payload, which hold at every instant.

    Masses that follow from them are guaranteed: they are not greater than the motion can carry, and less by about the
    tolerance.

    Args:
        motion: as for :func:`payload_effort`.
        tolerance: how near to the effort its bounds are, as a share of the limit, 1e-5 to 0.1, for payloads whose
            centre of mass is within 0.3 m of the tool's origin.

    Raises:
        InvalidInputError: a payload model without centre of mass, or a tolerance out of its range.
    """
    share = float(numbers(tolerance, name="tolerance", shape=()))
    if not _TOLERANCES[0] <= share <= _TOLERANCES[1]:
        raise InvalidInputError(
            f"tolerance: expected a share from {_TOLERANCES[0]:g} to {_TOLERANCES[1]:g}, got {share}"
        )
    one = sampled_motion(motion, 2)
    inertia = _per_kilogram(one.dynamics.payload)
    found = bound_payloads(one, one.limits.sides("effort"), inertia=inertia, tolerance=share)
    return PayloadEffort(
        robot=one.robot,
        times=found.times,
        base=found.base,
        slopes=found.slopes,
        inertia=frozen(inertia),
        payload_model=one.dynamics.payload.model,
        limit=one.limits.effort,
        samples=None,
        above=found.above,
        below=found.below,
        each=found.each,
        limit_backward=one.limits.effort_backward,
    )


def _per_kilogram(payload: Payload) -> Array:
    """Inertia about the centre of mass per kilogram, shape (3, 3) [m²]."""
    return np.zeros((3, 3)) if payload.inertia is None else np.array(payload.inertia) / payload.mass


def check_reach(effort: PayloadEffort, com: Array) -> None:
    """Check that bounds hold for centres of mass, shape (P, 3) [m].

    Raises:
        InvalidInputError: one is too far away from the tool's origin.
    """
    furthest = float(np.linalg.norm(com, axis=1).max(initial=0.0))
    if effort.samples is None and furthest > REACH:
        raise InvalidInputError(
            f"com: expected centres of mass within {REACH:g} m of the tool's origin, where the bounds hold, got one "
            f"{furthest:g} m away; payload_effort has no such bound"
        )


class _Forms(NamedTuple):
    """Rows as a + b·c + cᵀ Q c: constants, and bounds of the norms of b and Q, each (R,)."""

    constant: Array
    linear: Array
    quadratic: Array

    @classmethod
    def of(cls, rows: Array, inertia: Array) -> _Forms:
        a, b, Q = quadratic_forms(rows, inertia)
        return cls(a, np.abs(b).sum(axis=1), np.abs(Q).sum(axis=(1, 2)))

    def can_be_greatest(self, distance: float) -> Array:
        """Rows whose bound within a distance [m] is not below what another one reaches everywhere there, (R,)."""
        spread = distance * (self.linear + distance * self.quadratic)
        most = (self.constant - spread).max(initial=-np.inf)
        return np.asarray(self.constant + spread >= most - _ALIKE * abs(most))


class LimitedEfforts(NamedTuple):
    """Efforts of joints that have a limit, upwards and downwards: each must not exceed its limit.

    Attributes:
        base: shape (R,) [N·m or N].
        slopes: shape (R, 10); those that are mere rounding are 0.
        limit: shape (R,) [N·m or N].
        joint: index of the joint, shape (R,).
        time: instant, shape (R,) [s].
    """

    base: Array
    slopes: Array
    limit: Array
    joint: Array
    time: Array


def limited_efforts(effort: PayloadEffort) -> LimitedEfforts:
    """Efforts of every joint that has a limit, R = 2 x instants x joints.

    Raises:
        InvalidInputError: no joint has a limit.
    """
    sides = effort.sides
    limited = np.flatnonzero(sides.limited)
    if not len(limited):
        raise InvalidInputError(f"robot {effort.robot.name!r} has no effort limits, so nothing bounds its payload")
    instants, joint = (grid.ravel() for grid in np.indices((len(effort.times), len(limited))))
    joint = limited[joint]
    base, above, below, each = (x[instants, joint] for x in (effort.base, effort.above, effort.below, effort.each))
    slopes = _without_rounding(effort.slopes)[instants, joint]
    both = np.concatenate([slopes, -slopes])
    both[:, 0] += np.tile(each, 2)
    columns = (
        np.concatenate([base + above, below - base]),
        both,
        np.concatenate([sides.forward[joint], sides.backward[joint]]),
        np.tile(joint, 2),
        np.tile(effort.times[instants], 2),
    )
    finite = np.isfinite(columns[2])  # of a joint with a limit in one direction the other rows bound nothing
    return LimitedEfforts(*(columns if finite.all() else (x[finite] for x in columns)))


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
