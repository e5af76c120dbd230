"""Inverse kinematics of many poses from starts nearby, which numba (the optional extra ``fast``) compiles.

The formulas are those of :mod:`trajevo.formulation.cell.tracking`; every row goes its own way.
"""

from __future__ import annotations

import math

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.jit import fast


@fast("f8[2], f8[2], f8[2], f8[1], i8[1], f8[3], f8[2], f8[2], b1[1], f8[2], f8[1], i8, f8[1] -> f8[2], f8[2]")
def track(
    position: Array,
    rotation: Array,
    axis: Array,
    turned: Array,
    chain: Array,
    rotations: Array,
    translations: Array,
    axes: Array,
    turns: Array,
    tool_rotation: Array,
    tool_translation: Array,
    steps: int,
    numbers: Array,
    q: Array,
    missed: Array,
) -> None:
    """Take steps until a pose is reached or no step helps.

    Args:
        position: wanted positions, shape (N, 3) [m].
        rotation: wanted rotation matrices, row by row, shape (N, 9).
        axis: unit axis of the tool about which it may be turned, shape (N, 3); 0 where none is free.
        turned: 1 where the orientation matters, else 0, shape (N,).
        chain: index of each joint's position, shape (C,).
        rotations: rotation of each joint's frame in that of the joint before, shape (C, 3, 3).
        translations: origin of that frame, shape (C, 3) [m].
        axes: unit axes in the joints' own frames, shape (C, 3).
        turns: whether a joint is revolute, shape (C,).
        tool_rotation: rotation of the tool in the last joint's frame, shape (3, 3).
        tool_translation: origin of the tool there, shape (3,) [m].
        steps: greatest number of steps.
        numbers: damping per error, least damping, longest step, squared error at which a row is settled, and share by
            which it must fall.
        q: starts, replaced by what they lead to, shape (N, n_joints) [rad or m].
        missed: output, distance [m] and chord of the angle [rad] that are left, shape (N, 2).
    """
    count = len(chain)
    frame, origin = np.empty((3, 3)), np.empty(3)
    error, slopes = np.empty(6), np.empty((6, count))
    system, solved = np.empty((6, 6)), np.empty(6)
    origins, along = np.empty((count, 3)), np.empty((count, 3))
    moved = np.empty(count)
    for row in range(len(q)):
        before = np.inf
        for _ in range(steps):
            _placed(
                q[row], chain, rotations, translations, axes, turns, tool_rotation, tool_translation,
                frame, origin, origins, along,
            )  # fmt: skip
            _differences(position[row], rotation[row], axis[row], turned[row], frame, origin, error)
            _jacobian(axis[row], turned[row], turns, frame, origin, origins, along, slopes)
            squared = 0.0
            for i in range(6):
                squared += error[i] * error[i]
            damping = numbers[0] * math.sqrt(squared) + numbers[1]
            _solve(slopes, error, damping, system, solved)
            length = 0.0
            for k in range(count):
                total = 0.0
                for i in range(6):
                    total += slopes[i, k] * solved[i]
                moved[k] = total
                length += total * total
            share = 1.0 / math.sqrt(1.0 + length / (numbers[2] * numbers[2]))
            for k in range(count):
                q[row, chain[k]] += share * moved[k]
            if squared <= numbers[3] or (squared < before and squared > (1.0 - numbers[4]) * before):
                break
            before = squared
        _placed(
            q[row], chain, rotations, translations, axes, turns, tool_rotation, tool_translation,
            frame, origin, origins, along,
        )  # fmt: skip
        _missed(position[row], rotation[row], axis[row], turned[row], frame, origin, missed[row])


@fast
def _placed(
    q: Array,
    chain: Array,
    rotations: Array,
    translations: Array,
    axes: Array,
    turns: Array,
    tool_rotation: Array,
    tool_translation: Array,
    frame: Array,
    origin: Array,
    origins: Array,
    along: Array,
) -> None:
    """Frame and origin of the tool, and origin and axis of every joint, in the base frame."""
    turn, product = np.empty((3, 3)), np.empty((3, 3))
    for i in range(3):
        origin[i] = 0.0
        for j in range(3):
            frame[i, j] = 1.0 if i == j else 0.0
    for k in range(len(chain)):
        for i in range(3):
            origin[i] += (
                frame[i, 0] * translations[k, 0] + frame[i, 1] * translations[k, 1] + frame[i, 2] * translations[k, 2]
            )
            origins[k, i] = origin[i]
        _times(frame, rotations[k], product)
        x, y, z = axes[k, 0], axes[k, 1], axes[k, 2]
        for i in range(3):
            along[k, i] = product[i, 0] * x + product[i, 1] * y + product[i, 2] * z
        value = q[chain[k]]
        if turns[k]:
            s, c = math.sin(value), math.cos(value)
            d = 1.0 - c
            turn[0, 0], turn[0, 1], turn[0, 2] = c + d * x * x, d * x * y - s * z, d * x * z + s * y
            turn[1, 0], turn[1, 1], turn[1, 2] = d * x * y + s * z, c + d * y * y, d * y * z - s * x
            turn[2, 0], turn[2, 1], turn[2, 2] = d * x * z - s * y, d * y * z + s * x, c + d * z * z
            _times(product, turn, frame)
        else:
            for i in range(3):
                origin[i] += along[k, i] * value
                for j in range(3):
                    frame[i, j] = product[i, j]
    for i in range(3):
        origin[i] += (
            frame[i, 0] * tool_translation[0] + frame[i, 1] * tool_translation[1] + frame[i, 2] * tool_translation[2]
        )
    _times(frame, tool_rotation, product)
    for i in range(3):
        for j in range(3):
            frame[i, j] = product[i, j]


@fast
def _times(one: Array, other: Array, product: Array) -> None:
    for i in range(3):
        for j in range(3):
            product[i, j] = one[i, 0] * other[0, j] + one[i, 1] * other[1, j] + one[i, 2] * other[2, j]


@fast
def _differences(
    position: Array, rotation: Array, axis: Array, turned: float, frame: Array, origin: Array, error: Array
) -> None:
    """What is left to a pose: position, and sin(θ) times the axis of the rotation left."""
    for i in range(3):
        error[i] = position[i] - origin[i]
        error[3 + i] = 0.0
    if turned == 0.0:
        return
    free = axis[0] != 0.0 or axis[1] != 0.0 or axis[2] != 0.0
    for column in range(1 if free else 3):
        if free:
            a = frame[0, 0] * axis[0] + frame[0, 1] * axis[1] + frame[0, 2] * axis[2]
            b = frame[1, 0] * axis[0] + frame[1, 1] * axis[1] + frame[1, 2] * axis[2]
            c = frame[2, 0] * axis[0] + frame[2, 1] * axis[1] + frame[2, 2] * axis[2]
            u = rotation[0] * axis[0] + rotation[1] * axis[1] + rotation[2] * axis[2]
            v = rotation[3] * axis[0] + rotation[4] * axis[1] + rotation[5] * axis[2]
            w = rotation[6] * axis[0] + rotation[7] * axis[1] + rotation[8] * axis[2]
            share = 1.0
        else:
            a, b, c = frame[0, column], frame[1, column], frame[2, column]
            u, v, w = rotation[column], rotation[3 + column], rotation[6 + column]
            share = 0.5
        error[3] += share * (b * w - c * v)
        error[4] += share * (c * u - a * w)
        error[5] += share * (a * v - b * u)


@fast
def _jacobian(
    axis: Array,
    turned: float,
    turns: Array,
    frame: Array,
    origin: Array,
    origins: Array,
    along: Array,
    slopes: Array,
) -> None:
    """How fast the differences fall per joint."""
    free = axis[0] != 0.0 or axis[1] != 0.0 or axis[2] != 0.0
    a = frame[0, 0] * axis[0] + frame[0, 1] * axis[1] + frame[0, 2] * axis[2]
    b = frame[1, 0] * axis[0] + frame[1, 1] * axis[1] + frame[1, 2] * axis[2]
    c = frame[2, 0] * axis[0] + frame[2, 1] * axis[1] + frame[2, 2] * axis[2]
    for k in range(len(turns)):
        x, y, z = along[k, 0], along[k, 1], along[k, 2]
        if not turns[k]:
            slopes[0, k], slopes[1, k], slopes[2, k] = x, y, z
            slopes[3, k] = slopes[4, k] = slopes[5, k] = 0.0
            continue
        u, v, w = origin[0] - origins[k, 0], origin[1] - origins[k, 1], origin[2] - origins[k, 2]
        slopes[0, k], slopes[1, k], slopes[2, k] = y * w - z * v, z * u - x * w, x * v - y * u
        if free:
            within = a * x + b * y + c * z
            x, y, z = x - a * within, y - b * within, z - c * within
        slopes[3, k], slopes[4, k], slopes[5, k] = turned * x, turned * y, turned * z


@fast
def _solve(slopes: Array, error: Array, damping: float, system: Array, solved: Array) -> None:
    """(J Jᵀ + damping) y = error, by Cholesky's factors."""
    for i in range(6):
        for j in range(i + 1):
            total = damping if i == j else 0.0
            for k in range(slopes.shape[1]):
                total += slopes[i, k] * slopes[j, k]
            for m in range(j):
                total -= system[i, m] * system[j, m]
            if i == j:
                system[i, i] = math.sqrt(max(total, 1e-300))
            else:
                system[i, j] = total / system[j, j]
    for i in range(6):
        total = error[i]
        for m in range(i):
            total -= system[i, m] * solved[m]
        solved[i] = total / system[i, i]
    for i in range(5, -1, -1):
        total = solved[i]
        for m in range(i + 1, 6):
            total -= system[m, i] * solved[m]
        solved[i] = total / system[i, i]


@fast
def _missed(
    position: Array, rotation: Array, axis: Array, turned: float, frame: Array, origin: Array, missed: Array
) -> None:
    """Distance [m] and chord 2 sin(θ/2) of the angle [rad] that are left, (2,)."""
    away = angle = 0.0
    free = axis[0] != 0.0 or axis[1] != 0.0 or axis[2] != 0.0
    for i in range(3):
        away += (origin[i] - position[i]) ** 2
        if free:
            along = 0.0
            for j in range(3):
                along += (frame[i, j] - rotation[3 * i + j]) * axis[j]
            angle += along * along
        else:
            for j in range(3):
                angle += 0.5 * (frame[i, j] - rotation[3 * i + j]) ** 2
    missed[0] = math.sqrt(away)
    missed[1] = math.sqrt(angle) if turned != 0.0 else 0.0
