"""Bounds of torques, one motion at a time, in loops that numba (the optional extra ``fast``) compiles.

They replace the recursion over whole arrays in :mod:`trajevo.dynamics.complex_bounds`, and passes over arrays in
:mod:`trajevo.dynamics.piece_bounds`, with the same arithmetic in the same order.
"""

from __future__ import annotations

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.jit import fast

#: Number of rows that are handled together, so that the compiler can compute several at once.
_WIDE = 64


@fast("i8[2], f8[2], f8, f8[2], f8[2], f8[2], f8[2] -> f8[2]")
def torque_bounds(
    tree: Array, links: Array, gravity: float, turned: Array, q: Array, v: Array, a: Array, out: Array
) -> None:
    """Bounds of the torque of every joint.

    Args:
        tree: of every joint, the base first: number of the joint before it, column of its velocity, and 1 if it turns,
            shape (L, 3).
        links: of every joint: distance of its frame from that of the joint before it, and its body's mass, lever and
            inertia, shape (L, 4) [m, kg, m, kg·m²].
        gravity: bound of the acceleration of the base [m/s²].
        turned: bounds of the norms of rotations, shape (P, n).
        q: bounds of positions, shape (P, n) [rad or m].
        v: bounds of velocities, shape (P, n) [rad/s or m/s].
        a: bounds of accelerations, shape (P, n) [rad/s² or m/s²].
        out: output, shape (P, n) [N·m or N].
    """
    count = len(tree)
    size = count, _WIDE
    turn, arm, spin, rate = np.ones(size), np.zeros(size), np.zeros(size), np.zeros(size)
    pull, force, moment = np.full(size, gravity), np.zeros(size), np.zeros(size)
    for begin in range(0, len(out), _WIDE):
        wide = min(_WIDE, len(out) - begin)
        for joint in range(1, count):
            parent, column, turns = tree[joint]
            if turns:
                for i in range(wide):
                    turn[joint, i], arm[joint, i] = turned[begin + i, column], links[joint, 0]
                    carried = turn[joint, i] * spin[parent, i]
                    spin[joint, i] = carried + v[begin + i, column]
                    rate[joint, i] = turn[joint, i] * rate[parent, i] + (
                        a[begin + i, column] + carried * v[begin + i, column]
                    )
            else:
                for i in range(wide):
                    arm[joint, i] = links[joint, 0] + q[begin + i, column]
                    spin[joint, i], rate[joint, i] = spin[parent, i], rate[parent, i]
            for i in range(wide):
                before = spin[parent, i]
                pull[joint, i] = turn[joint, i] * (
                    pull[parent, i] + (rate[parent, i] + before * before) * arm[joint, i]
                )
            if not turns:
                for i in range(wide):
                    sliding = 2.0 * spin[parent, i] * v[begin + i, column]
                    pull[joint, i] = pull[joint, i] + sliding + a[begin + i, column]
        for joint in range(count):
            mass, lever, inertia = links[joint, 1], links[joint, 2], links[joint, 3]
            for i in range(wide):
                swing = rate[joint, i] + spin[joint, i] * spin[joint, i]
                force[joint, i] = mass * (pull[joint, i] + swing * lever)
                moment[joint, i] = inertia * swing + lever * force[joint, i]
        for joint in range(count - 1, 0, -1):
            parent, column, turns = tree[joint]
            for i in range(wide):
                out[begin + i, column] = moment[joint, i] if turns else force[joint, i]
                force[parent, i] = force[parent, i] + turn[joint, i] * force[joint, i]
                reached = moment[joint, i] + arm[joint, i] * force[joint, i]
                moment[parent, i] = moment[parent, i] + turn[joint, i] * reached


@fast("f8[3], f8[3], f8, f8[3], f8[1], f8 -> f8[2], f8[2], f8[2]")
def enclosures(
    bernstein: Array,
    values: Array,
    rounding: float,
    magnitudes: Array,
    errors: Array,
    own_rounding: float,
    lower: Array,
    upper: Array,
    slack: Array,
) -> None:
    """Enclosures of functions from polynomials through their values, and what these leave out.

    Args:
        bernstein: Bernstein coefficients of both halves of the polynomials, shape (K, Q, C).
        values: at the nodes, shape (K, N, Q).
        rounding: bound of the rounding error of a coefficient, as a share of the greatest value.
        magnitudes: bounds of the functions' magnitudes on E ellipses, NaN where there is none, shape (K, E, Q).
        errors: error of a polynomial per unit of the magnitude on every ellipse, shape (E,).
        own_rounding: bound of the rounding of the values, as a share of the magnitude on the first ellipse.
        lower: output, lower bounds, shape (K, Q).
        upper: output, upper bounds, the same shape.
        slack: output, the part of the bounds that allows for rounding of the values, the same shape.
    """
    pieces, quantities, count = bernstein.shape
    for k in range(pieces):
        for j in range(quantities):
            least = greatest = bernstein[k, j, 0]
            for c in range(1, count):
                least, greatest = min(least, bernstein[k, j, c]), max(greatest, bernstein[k, j, c])
            most = abs(values[k, 0, j])
            for n in range(1, values.shape[1]):
                most = max(most, abs(values[k, n, j]))
            error, first = np.inf, np.inf
            for e in range(len(errors)):
                magnitude = magnitudes[k, e, j]
                if np.isnan(magnitude):
                    magnitude = np.inf
                if e == 0:
                    first = magnitude
                error = min(error, magnitude * errors[e])
            most *= rounding
            slack[k, j] = own_rounding * first if np.isfinite(first) else 0.0
            error += own_rounding * first
            lower[k, j], upper[k, j] = (least - most) - error, (greatest + most) + error
