"""Payload diagram of a motion, as in robot data sheets: the payload by the offset of its centre of mass.

At an offset L from the tool's z axis and L_z along it the centre of mass is (L cos φ, L sin φ, L_z). As a function of φ
every effort per kilogram is a trigonometric polynomial of degree 2, whose worst direction is found exactly. A bound in
closed form first selects the few efforts that can be the worst at all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, frozen, numbers
from trajevo.base.shown.brief import brief
from trajevo.capacity.notebook import diagram_html
from trajevo.capacity.payload_effort import MassRange, PayloadEffort, check_reach, limited_efforts
from trajevo.dynamics.payload_bounds import REACH
from trajevo.errors import InvalidInputError, checked_name
from trajevo.robot.payload import quadratic_forms

#: Number of directions from which Newton's method starts, and its steps; from 11° off a peak five are enough.
_STARTS, _STEPS = 32, 6


@final
@dataclass(frozen=True, eq=False)
class PayloadDiagram:
    """Masses that a motion can carry on a grid of offsets of the load: W from the tool's z axis, H along it.

    Attributes:
        offset_xy: distances of the centre of mass from the tool's z axis, ascending, shape (W,) [m].
        offset_z: its coordinates along the tool's z axis, ascending, shape (H,) [m].
        mass: greatest mass, inf where nothing limits it, NaN where no mass is feasible, shape (H, W) [kg].
        least: least mass; above 0 where the motion needs a counterweight, shape (H, W) [kg].
        joint: index of the joint that binds at ``mass``, -1 where none does, shape (H, W).
        time: instant at which it binds, NaN where none does, shape (H, W) [s].
        direction: angle of the offset about the tool's z axis from its x axis, shape (H, W) [rad]: the given direction,
            or the worst one of each cell.
        worst: whether ``direction`` is the worst of each cell.
        joint_names: names of the robot's joints.
        payload_model: how the payload acts.
        samples: instants per segment that were looked at; None if the masses are guaranteed at every instant.
        kept: share of the robot's effort limits that the motion's problem keeps.
    """

    offset_xy: Array
    offset_z: Array
    mass: Array
    least: Array
    joint: Array
    time: Array
    direction: Array
    worst: bool
    joint_names: tuple[str, ...]
    payload_model: str
    samples: int | None
    kept: float

    __repr__ = brief

    def _repr_html_(self) -> str:
        return diagram_html(self)


def payload_diagram(
    effort: PayloadEffort,
    offset_xy: Any,
    offset_z: Any,
    *,
    direction: float | None = None,
) -> PayloadDiagram:
    """The masses that a motion can carry, by the offset of the load.

    Args:
        effort: effort along the motion, at samples or bounded at every instant
            (:func:`~trajevo.capacity.payload_effort.payload_bounds`).
        offset_xy: distances from the tool's z axis, ascending from 0 on, shape (W,) [m].
        offset_z: coordinates along the tool's z axis, ascending, shape (H,) [m].
        direction: angle of the offset about the tool's z axis from its x axis [rad]; if None, the worst one for each
            cell, so that the masses hold in every direction.

    Raises:
        InvalidInputError: offsets that do not ascend, a negative distance, a direction that is not finite, offsets for
            which bounds do not hold, or a robot without effort limits.
    """
    xy, z = _rising(offset_xy, "offset_xy"), _rising(offset_z, "offset_z")
    if xy[0] < 0.0:
        raise InvalidInputError(f"offset_xy: expected distances from 0 on [m], got {xy[0]}")
    check_reach(effort, np.array([[xy[-1], 0.0, np.abs(z).max()]]))
    if direction is None:
        found, angle = _in_every_direction(effort, xy, z)
    else:
        turn = float(numbers(direction, name="direction", shape=()))
        high, wide = (grid.ravel() for grid in np.meshgrid(z, xy, indexing="ij"))
        found = effort.mass_range(np.column_stack([wide * np.cos(turn), wide * np.sin(turn), high]))
        angle = np.full(len(high), turn)
    shape = (len(z), len(xy))
    return PayloadDiagram(
        offset_xy=frozen(xy.copy()),
        offset_z=frozen(z.copy()),
        mass=found.upper.reshape(shape),
        least=found.lower.reshape(shape),
        joint=found.joint.reshape(shape),
        time=found.time.reshape(shape),
        direction=frozen(angle.reshape(shape)),
        worst=direction is None,
        joint_names=effort.robot.joint_names,
        payload_model=effort.payload_model,
        samples=effort.samples,
        kept=effort.kept,
    )


def _in_every_direction(effort: PayloadEffort, xy: Array, z: Array) -> tuple[MassRange, Array]:
    """The masses that hold in every direction, and the binding direction [rad], each of shape (H W,)."""
    rows = effort.rows_within(float(np.hypot(xy[-1], np.abs(z).max())))
    above, index, angle = _greatest_round(rows.above, xy, z, effort.inertia)
    below = _greatest_round(rows.below, xy, z, effort.inertia)[0]
    return rows.mass_range(above.ravel(), index.ravel(), below.ravel()), angle.ravel()


def _greatest_round(rows: Array, xy: Array, z: Array, inertia: Array) -> tuple[Array, Array, Array]:
    """Greatest value over all directions and rows, the row and the direction [rad], each of shape (H, W)."""
    value, index, angle = np.full((len(z), len(xy)), -np.inf), np.zeros((len(z), len(xy)), dtype=np.int64), None
    angle = np.zeros(value.shape)
    if not len(rows):
        return value, index, angle
    a, b, Q = quadratic_forms(rows, inertia)
    along = 0.5 * (Q[:, 0, 0] + Q[:, 1, 1])  # coefficient of L²
    second = np.stack([0.5 * (Q[:, 0, 0] - Q[:, 1, 1]), Q[:, 0, 1]])  # coefficients of L² cos 2φ and L² sin 2φ
    for i, height in enumerate(z):
        still = a + height * (b[:, 2] + height * Q[:, 2, 2])
        first = (b[:, :2] + 2.0 * height * Q[:, 2, :2]).T  # coefficients of L cos φ and L sin φ
        value[i], index[i], angle[i] = _worst_rows(still, first, along, second, xy)
    return value, index, angle


def _worst_rows(still: Array, first: Array, along: Array, second: Array, xy: Array) -> tuple[Array, Array, Array]:
    """As :func:`_greatest_round`, at one height: shapes (R,), (2, R), (R,), (2, R) and (W,) -> each (W,)."""
    round_twice = np.hypot(*second)
    bound = still + xy[:, None] * np.hypot(*first) + (xy**2)[:, None] * (along + round_twice)
    leader = bound.argmax(axis=1)
    if not round_twice.any():
        return bound.max(axis=1), leader, np.arctan2(*first[::-1, leader])
    reached = still[leader] + xy**2 * along[leader] + _peak(xy * first[:, leader], xy**2 * second[:, leader])[0]
    bound[np.arange(len(xy)), leader] = np.inf  # always a candidate, whatever the rounding
    cell, row = np.nonzero(bound >= reached[:, None])
    peak, angle = _peak(xy[cell] * first[:, row], xy[cell] ** 2 * second[:, row])
    value = still[row] + xy[cell] ** 2 * along[row] + peak
    order = np.lexsort((value, cell))
    last = order[np.append(np.flatnonzero(np.diff(cell[order])), len(order) - 1)]
    return value[last], row[last], angle[last]


def _peak(first: Array, second: Array) -> tuple[Array, Array]:
    """Greatest value and its φ [rad], each (P,), of first · (cos φ, sin φ) + second · (cos 2φ, sin 2φ), both (2, P)."""
    starts = np.arange(_STARTS) * (2.0 * np.pi / _STARTS)
    once, twice = (np.stack([np.cos(k * starts), np.sin(k * starts)]) for k in (1, 2))
    sampled = first.T @ once + second.T @ twice
    top = (sampled >= np.roll(sampled, 1, axis=1)) & (sampled >= np.roll(sampled, -1, axis=1))
    which, start = np.nonzero(top)
    (b, c), (d, e), angle = first[:, which], second[:, which], starts[start]
    for _ in range(_STEPS):
        x, y, x2, y2 = np.cos(angle), np.sin(angle), np.cos(2.0 * angle), np.sin(2.0 * angle)
        slope = c * x - b * y + 2.0 * (e * x2 - d * y2)
        bend = b * x + c * y + 4.0 * (d * x2 + e * y2)  # minus the second derivative
        bends = bend > 0.0
        angle = np.where(bends, angle + np.clip(slope / np.where(bends, bend, 1.0), -0.2, 0.2), angle)
    value = b * np.cos(angle) + c * np.sin(angle) + d * np.cos(2.0 * angle) + e * np.sin(2.0 * angle)
    order = np.lexsort((value, which))
    last = order[np.append(np.flatnonzero(np.diff(which[order])), len(order) - 1)]
    return value[last], angle[last]


def _rising(given: Any, name: str) -> Array:
    offsets = numbers(given, name=name, shape=("N",))
    if not len(offsets) or (np.diff(offsets) <= 0.0).any():
        raise InvalidInputError(f"{name}: expected rising offsets [m], at least one, got {offsets.tolist()}")
    return offsets


_AXES = "xyz"

#: Share of the longest normal below which a half-space does not depend on the centre of mass.
_FLAT = 1e-12

#: Radius [m] below which a section is a mere point or line and counts as empty.
_POINT = 1e-12

#: Points along each side of the grid on which a region that is not a polygon is sampled.
_GRID = 121


@final
@dataclass(frozen=True, eq=False)
class CentreOfMassPolyhedron:
    """The centres of mass that keep every effort limit along a motion: normals · c <= offsets.

    Attributes:
        mass: mass of the payload [kg].
        normals: normals of the half-spaces in the tool frame, shape (M, 3) [N·m/m or N/m].
        offsets: offsets of the half-spaces, shape (M,) [N·m or N].
        joint: index of the joint of each half-space, shape (M,).
        time: instant of each half-space, shape (M,) [s].
        reach: greatest distance of a centre of mass from the tool's origin for which the half-spaces are known [m].
        samples: instants per segment that were looked at; None if the set is guaranteed at every instant.
        kept: share of the robot's effort limits that the motion's problem keeps.
    """

    mass: float
    normals: Array
    offsets: Array
    joint: Array
    time: Array
    reach: float
    samples: int | None
    kept: float

    __repr__ = brief

    def contains(self, com: Any) -> Array:
        """Whether centres of mass, shape (P, 3) [m], are allowed: shape (P,), bool."""
        points = numbers(com, name="com", shape=("P", 3))
        inside = (points @ self.normals.T <= self.offsets).all(axis=1)
        return np.asarray(inside & (np.linalg.norm(points, axis=1) <= self.reach))

    def section(self, axis: str = "z", at: float = 0.0, *, within: float) -> Array:
        """The polygon in which a plane of the tool frame cuts the polyhedron.

        Args:
            axis: axis of the tool frame that is normal to the plane.
            at: position of the plane along this axis [m].
            within: bound of the magnitudes of the other two coordinates, at which the section is cut off [m].

        Returns:
            Corners, counterclockwise, in the other two coordinates in alphabetical order, shape (K, 2) [m]; K = 0
            if the plane misses or merely touches the polyhedron.

        Raises:
            UnknownNameError: no such axis.
            InvalidInputError: numbers that are not finite, or a bound that is not positive or beyond the reach.
        """
        normal = _AXES.index(checked_name("axis", axis, _AXES))
        place, bound = (float(numbers(x, name=name, shape=())) for x, name in ((at, "at"), (within, "within")))
        if not bound > 0.0:
            raise InvalidInputError(f"within: expected a positive length [m], got {bound}")
        furthest = float(np.linalg.norm([bound, bound, place]))
        if furthest > self.reach:
            raise InvalidInputError(
                f"within: expected corners up to {self.reach:g} m from the tool's origin, where the bounds hold, got "
                f"{furthest:g} m"
            )
        A = np.delete(self.normals, normal, axis=1)
        b = self.offsets - place * self.normals[:, normal]
        length = np.hypot(*A.T)
        felt = length > _FLAT * np.linalg.norm(self.normals, axis=1).max()
        if (b[~felt] < 0.0).any():
            return frozen(np.empty((0, 2)))
        A = np.concatenate([A[felt] / length[felt, None], np.eye(2), -np.eye(2)])
        b = np.concatenate([b[felt] / length[felt], np.full(4, bound)])
        return frozen(_corners(A, b))


def allowed_centres(effort: PayloadEffort, mass: float) -> CentreOfMassPolyhedron:
    """The exact set of centres of mass that a motion allows a payload of known mass.

    Args:
        effort: effort that is affine in the centre of mass, as for a bare weight, a robot at rest, or with the inertia
            about the tool's origin known
            (:meth:`~trajevo.capacity.payload_effort.PayloadEffort.with_inertia_about_tool`).
        mass: mass of the payload [kg].

    Raises:
        InvalidInputError: a mass that is not positive, an effort that is quadratic in the centre of mass, or a robot
            without effort limits.
    """
    carried = float(numbers(mass, name="mass", shape=()))
    if not carried > 0.0:
        raise InvalidInputError(f"mass: expected a positive number [kg], got {carried}")
    if not effort.affine:
        raise InvalidInputError(
            "effort: quadratic in the centre of mass, as the inertia about the tool's origin changes with it; "
            "give that inertia by with_inertia_about_tool"
        )
    efforts = limited_efforts(effort)
    return CentreOfMassPolyhedron(
        mass=carried,
        normals=frozen(carried * efforts.slopes[:, 1:4]),
        offsets=frozen(efforts.limit - efforts.base - carried * efforts.slopes[:, 0]),
        joint=frozen(efforts.joint),
        time=frozen(efforts.time),
        reach=REACH if effort.samples is None else np.inf,
        samples=effort.samples,
        kept=effort.kept,
    )


@final
@dataclass(frozen=True, eq=False)
class AllowedRegions:
    """Regions of a plane of the tool frame in which the centre of mass may lie, one for each mass.

    Attributes:
        masses: K masses of payloads, ascending [kg].
        axis: axis of the tool frame that is normal to the plane.
        at: position of the plane along this axis [m].
        within: bound of the magnitudes of the other two coordinates [m].
        polygons: if effort is affine in the centre of mass, the exact corners of each region, counterclockwise, in the
            other two coordinates in alphabetical order, K arrays of shape (C, 2) [m], empty if the mass is allowed
            nowhere; otherwise no arrays.
        sides: coordinates of a grid along either side, shape (G,) [m].
        used: if effort is not affine, the greatest effort over its limit [1], shape (K, G, G), rows along the second
            coordinate; a centre of mass is allowed where it is at most 1.
        samples: instants per segment that were looked at; None if the regions are guaranteed at every instant.
        kept: share of the robot's effort limits that the motion's problem keeps.
    """

    masses: tuple[float, ...]
    axis: str
    at: float
    within: float
    polygons: tuple[Array, ...]
    sides: Array
    used: Array
    samples: int | None
    kept: float

    __repr__ = brief


def allowed_regions(
    effort: PayloadEffort, masses: Sequence[float], *, within: float, axis: str = "z", at: float = 0.0
) -> AllowedRegions:
    """Regions of a plane of the tool frame in which the centres of mass of payloads may lie.

    Args:
        effort: effort along the motion. If it is affine in the centre of mass, see :func:`allowed_centres`, the regions
            are exact polygons, otherwise values on a grid.
        masses: masses of the payloads [kg].
        within: bound of the magnitudes of the other two coordinates [m].
        axis: axis of the tool frame that is normal to the plane.
        at: position of the plane along this axis [m].

    Raises:
        UnknownNameError: no such axis.
        InvalidInputError: as for :func:`allowed_centres` and :meth:`CentreOfMassPolyhedron.section`.
    """
    checked_name("axis", axis, _AXES)
    ascending = tuple(sorted(float(mass) for mass in masses))
    polygons: tuple[Array, ...] = ()
    sides, used = np.linspace(-within, within, _GRID), np.empty((0, _GRID, _GRID))
    if effort.affine:
        polygons = tuple(allowed_centres(effort, mass).section(axis, at, within=within) for mass in ascending)
    else:
        across = [k for k, name in enumerate(_AXES) if name != axis]
        com = np.full((_GRID, _GRID, 3), at)
        com[..., across[0]], com[..., across[1]] = np.meshgrid(sides, sides)
        used = np.array([effort.used(mass, com.reshape(-1, 3)) for mass in ascending]).reshape(-1, _GRID, _GRID)
    return AllowedRegions(
        ascending, axis, float(at), float(within), polygons, frozen(sides), frozen(used), effort.samples, effort.kept
    )


def _corners(A: Array, b: Array) -> Array:
    """Corners of the bounded polygon A x <= b, rows of A of length 1, counterclockwise, shape (K, 2)."""
    from scipy.optimize import linprog
    from scipy.spatial import HalfspaceIntersection

    inside = linprog(
        [0.0, 0.0, -1.0], np.column_stack([A, np.ones(len(A))]), b, bounds=[(None, None)] * 2 + [(0, None)]
    )
    if inside.status != 0 or inside.x[2] <= _POINT:
        return np.empty((0, 2))
    middle = inside.x[:2]
    corners = HalfspaceIntersection(np.column_stack([A, -b]), middle).intersections
    corners = np.unique(corners.round(12), axis=0)
    order = np.argsort(np.arctan2(*(corners - middle).T[::-1]))
    turned: Array = corners[order]
    return turned
