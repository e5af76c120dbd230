"""Where the centre of mass of a payload of known mass may lie: a convex polyhedron, one half-space per limit.

With the mass and the inertia about the tool's origin known, effort is affine in the centre of mass, so each of
±τ <= limit, at every joint and instant, is a half-space.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, final

import numpy as np

from trajevo.arrays import Array, frozen, numbers
from trajevo.errors import InvalidInputError, checked_name
from trajevo.payload_effort import PayloadEffort, limited_efforts

_AXES = "xyz"

#: Share of the longest normal below which a half-space does not feel the centre of mass.
_FLAT = 1e-12

#: Radius [m] of a section that counts as empty: no more than a point or a line.
_POINT = 1e-12


@final
@dataclass(frozen=True, eq=False)
class CentreOfMassPolyhedron:
    """The centres of mass that keep every effort limit along a motion: normals · c <= offsets.

    Attributes:
        mass: of the payload [kg].
        normals: shape (M, 3) [N·m/m or N/m], in the tool frame.
        offsets: shape (M,) [N·m or N].
        joint: index of the joint of each half-space, shape (M,).
        time: instant of each half-space, shape (M,) [s].
    """

    mass: float
    normals: Array
    offsets: Array
    joint: Array
    time: Array

    def contains(self, com: Any) -> Array:
        """Whether centres of mass, shape (P, 3) [m], are allowed: shape (P,), bool."""
        points = numbers(com, name="com", shape=("P", 3))
        kept: Array = points @ self.normals.T <= self.offsets
        return np.asarray(kept.all(axis=1))

    def section(self, axis: str = "z", at: float = 0.0, *, within: float) -> Array:
        """The polygon in which a plane of the tool frame cuts the polyhedron.

        Args:
            axis: of the tool frame, normal to the plane.
            at: place of the plane along it [m].
            within: the section is cut off where one of the other coordinates exceeds this [m].

        Returns:
            Corners, counterclockwise, of the other two coordinates in alphabetical order, shape (K, 2) [m]; K = 0
            where the plane misses the polyhedron, or does no more than touch it.

        Raises:
            UnknownNameError: no such axis.
            InvalidInputError: numbers that are not finite, or a bound that is not positive.
        """
        normal = _AXES.index(checked_name("axis", axis, _AXES))
        place, bound = (float(numbers(x, name=name, shape=())) for x, name in ((at, "at"), (within, "within")))
        if not bound > 0.0:
            raise InvalidInputError(f"within: expected a positive length [m], got {bound}")
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
        effort: affine in the centre of mass, as for a bare weight, a robot at rest, or with the inertia about the
            tool's origin known (:meth:`~trajevo.payload_effort.PayloadEffort.with_inertia_about_tool`).
        mass: of the payload [kg].

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
    base, slopes, limit, joint, time = limited_efforts(effort)
    loaded, turned = base + carried * slopes[:, 0], carried * slopes[:, 1:4]
    return CentreOfMassPolyhedron(
        mass=carried,
        normals=frozen(np.concatenate([turned, -turned])),
        offsets=frozen(np.concatenate([limit - loaded, limit + loaded])),
        joint=frozen(np.tile(joint, 2)),
        time=frozen(np.tile(time, 2)),
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
