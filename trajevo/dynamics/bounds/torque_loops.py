"""Bounds of torques, one motion at a time, in a loop that numba (the optional extra ``fast``) compiles.

It replaces the recursion over whole arrays in :mod:`trajevo.dynamics.complex_bounds`, with the same arithmetic in the
same order.
"""

from __future__ import annotations

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.jit import fast


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
    turn, arm, spin, rate = np.ones(count), np.zeros(count), np.zeros(count), np.zeros(count)
    pull, force, moment = np.full(count, gravity), np.zeros(count), np.zeros(count)
    for p in range(len(out)):
        for joint in range(1, count):
            parent, column, turns = tree[joint]
            before, rate_before = spin[parent], rate[parent]
            if turns:
                turn[joint], arm[joint] = turned[p, column], links[joint, 0]
                carried = turn[joint] * before
                spin[joint] = carried + v[p, column]
                rate[joint] = turn[joint] * rate_before + (a[p, column] + carried * v[p, column])
            else:
                arm[joint] = links[joint, 0] + q[p, column]
                spin[joint], rate[joint] = before, rate_before
            pull[joint] = turn[joint] * (pull[parent] + (rate_before + before * before) * arm[joint])
            if not turns:
                pull[joint] = pull[joint] + 2.0 * before * v[p, column] + a[p, column]
        for joint in range(count):
            swing = rate[joint] + spin[joint] * spin[joint]
            force[joint] = links[joint, 1] * (pull[joint] + swing * links[joint, 2])
            moment[joint] = links[joint, 3] * swing + links[joint, 2] * force[joint]
        for joint in range(count - 1, 0, -1):
            parent, column, turns = tree[joint]
            out[p, column] = moment[joint] if turns else force[joint]
            force[parent] = force[parent] + turn[joint] * force[joint]
            moment[parent] = moment[parent] + turn[joint] * (moment[joint] + arm[joint] * force[joint])
