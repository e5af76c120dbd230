"""What is limited along a path, as functions of the place: joint accelerations and efforts are linear in ṡ² and s̈.

With z = ṡ, a row is

    y = bend s̈ + speed z² + rate z + held,

all four functions of s: for the acceleration of an axis bend = q' and speed = q'', the others 0; for an effort they
come from the inverse dynamics. Only bend, speed - bend' / 2, rate and held enter a bound.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.dynamics.complex_bounds import Bounds, EffortReach
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.piece_bounds import ELLIPSES, interpolation_errors, motion_bounds
from trajevo.verification.path_bounds.cells import PathCells

#: Nodes of a cell at which inverse dynamics are interpolated, and size of a complex step.
EFFORT_NODES, _STEP = 12, 1e-30


@final
@dataclass(frozen=True, eq=False)
class LimitRows:
    """R limited quantities at the nodes of C cells, as polynomials of degree below N - 1, and how far these are off.

    Attributes:
        bend: factor of s̈, shape (C, N, R).
        half: factor of z² less half the derivative of ``bend``, the same shape.
        rate: factor of z, the same shape.
        held: what is there at rest, dry friction included, the same shape.
        errors: bounds of the errors of the four on every cell, shape (4, C, R); zero for polynomials.
        forward: greatest values, inf for none, shape (R,).
        backward: greatest magnitudes of negative values, inf for none, shape (R,).
    """

    bend: Array
    half: Array
    rate: Array
    held: Array
    errors: Array
    forward: Array
    backward: Array

    __repr__ = brief

    @property
    def count(self) -> int:
        """Number of rows R."""
        return len(self.forward)

    def in_unit(self, time: float, inertial: float) -> LimitRows:
        """The same in another unit of time.

        Args:
            time: the unit [s].
            inertial: factor of all values: ``time`` squared for accelerations, 1 for efforts.
        """
        scales = inertial * np.array([time**-2, time**-2, 1.0 / time, 1.0])
        return LimitRows(
            self.bend * scales[0],
            self.half * scales[1],
            self.rate * scales[2],
            self.held * scales[3],
            self.errors * scales[:, None, None],
            self.forward * inertial,
            self.backward * inertial,
        )


def accelerations(cells: PathCells, forward: Array, backward: Array) -> LimitRows:
    """Rows of the axes' accelerations.

    Args:
        cells: cells of the path.
        forward: greatest accelerations, inf for none, shape (n_axes,) [rad/s² or m/s²].
        backward: greatest magnitudes of negative ones, the same shape.
    """
    _, slope, bend, _ = cells.slopes
    none = np.zeros_like(slope)
    errors = np.zeros((4, cells.count, cells.path.n_axes))
    return LimitRows(slope, 0.5 * bend, none, none, errors, forward, backward)


def efforts(cells: PathCells, dynamics: Dynamics, forward: Array, backward: Array) -> LimitRows:
    """Rows of the joints' efforts, proven: what interpolation leaves is bounded by magnitudes at complex places.

    Args:
        cells: cells of the path.
        dynamics: the robot and its payload.
        forward: greatest efforts, inf for none, shape (n_joints,) [N·m or N].
        backward: greatest magnitudes of negative ones, the same shape.
    """
    few = PathCells(cells.path, cells.stations, EFFORT_NODES)
    smooth, friction = dynamics.without_dry_friction, dynamics.robot.friction
    errors = _errors(few, smooth)
    parts = [_resampled(part, cells.shares) for part in _terms(few, smooth)]
    viscous = friction.viscous * cells.slopes[1]
    ahead, behind = (np.abs(friction.dry(np.full(cells.path.n_axes, sign))) for sign in (1.0, -1.0))
    dry = np.where(cells.signs > 0.0, ahead, np.where(cells.signs < 0.0, -behind, 0.0))
    errors[3] += np.where(cells.unsure, np.maximum(ahead, behind), 0.0)
    return LimitRows(parts[0], parts[1], viscous, parts[2] + dry[:, None], errors, forward, backward)


def _terms(cells: PathCells, smooth: Dynamics) -> tuple[Array, Array, Array]:
    """Factors of s̈, of z² less half the derivative of the former, and effort at rest, each (C, N, n_joints)."""
    q, slope, bend, _ = cells.slopes
    still = np.zeros_like(q)
    held, viscous = smooth.effort(q, still, still), smooth.robot.friction.viscous * slope
    by_bend = smooth.effort(q, still, slope) - held
    by_speed = smooth.effort(q, slope, bend) - held - viscous
    place = q + 1j * _STEP * slope
    none = np.zeros_like(place)
    stepped = smooth.effort(place, none, slope + 1j * _STEP * bend) - smooth.effort(place, none, none)
    return by_bend, by_speed - 0.5 * stepped.imag / _STEP, held


def _errors(cells: PathCells, smooth: Dynamics) -> Array:
    """Bounds of the errors of the polynomials through the terms of efforts, shape (4, C, n_joints).

    A derivative at a complex place is at most the greatest magnitude on a larger ellipse over the distance to it
    (Cauchy), and that is at least the difference of the major semi-axes.
    """
    q, slope, bend, _ = cells.slopes
    degree = cells.path.order - 1
    motion = motion_bounds(np.concatenate([q, slope, bend], axis=-1), degree)
    reach = EffortReach.of(smooth, any_mass=False)
    with np.errstate(over="ignore", invalid="ignore"):
        held = reach.effort(motion.at_rest())
        by_bend = reach.effort(Bounds(motion.imaginary, motion.q, np.zeros_like(motion.v), motion.v)) + held
        by_speed = reach.effort(motion) + held + smooth.robot.friction.viscous * motion.v
        axes = 0.5 * (ELLIPSES + 1.0 / ELLIPSES)
        per_place = 2.0 / (cells.widths[:, None] * np.diff(axes))
        derived = np.full_like(by_bend, np.inf)
        derived[:, :-1] = by_bend[:, 1:] * per_place[..., None]
    found, _ = interpolation_errors([by_bend, by_speed + 0.5 * derived, held], EFFORT_NODES)
    bends, halves, helds = np.split(found, 3, axis=-1)
    return np.stack([bends, halves, np.zeros_like(bends), helds])


def _resampled(values: Array, shares: Array) -> Array:
    """Polynomials given at Gauss nodes, at other places, (C, N, R) -> (C, M, R)."""
    size = values.shape[1]
    given = np.polynomial.legendre.leggauss(size)[0]
    basis = np.linalg.solve(
        np.polynomial.legendre.legvander(given, size - 1).T,
        np.polynomial.legendre.legvander(2.0 * shares - 1.0, size - 1).T,
    )
    return np.moveaxis(np.tensordot(basis, values, axes=(0, 1)), 0, 1)
