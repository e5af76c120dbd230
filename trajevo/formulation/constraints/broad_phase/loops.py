"""Loops over the solids of a robot in many states, which numba (the optional extra ``fast``) compiles.

They replace the numpy code of :mod:`trajevo.formulation.constraints.broad_phase.bodies` and
:mod:`trajevo.formulation.constraints.broad_phase.lower_bounds` for real numbers; results agree up to rounding. States
are handled in blocks of :data:`WIDE`: every component is a row with its values in all states of the block, and loops
over a row are vectorised by the compiler.
"""

from __future__ import annotations

import math

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.jit import fast

#: Number of states of a block.
WIDE = 64

#: Multiples of π/2 are subtracted as a sum of three parts; multiples of the first two up to 2²⁰ are exact.
_PER_QUARTER = 2.0 / np.pi
_FIRST, _SECOND, _THIRD = 1.57079632673412561417e00, 6.07710050630396597660e-11, 2.02226624879595063154e-21

#: Greatest angle for the polynomials [rad]; beyond it the functions of the math library are used.
_GREATEST_ANGLE = 1e5

#: Kinds of obstacles; boxes are 0.
CYLINDER, SPHERE = 1, 2

#: Taken off every bound [m], far above rounding.
SLACK = 1e-9


@fast("f8[2], i8[1], i8[1], b1[1], f8[3] -> f8[3]")
def frames(q: Array, parents: Array, columns: Array, turns: Array, starts: Array, out: Array) -> None:
    """Axes and origins of the base and of every joint.

    Args:
        q: positions, shape (N, n) [rad or m].
        parents: number of every joint's parent from 1, or 0 for the base, shape (J,).
        columns: column of every joint in ``q``, shape (J,).
        turns: which joints turn about the z axis of their frame; the others slide along it, shape (J,).
        starts: x, y and z axis of every joint's frame at position 0 and its origin in its parent's, shape (J, 4, 3).
        out: output, shape (blocks, 1 + J, 12 WIDE): all of x, y, z axis and origin, component by component.
    """
    angle, slide, c, s = np.zeros(WIDE), np.zeros(WIDE), np.empty(WIDE), np.empty(WIDE)
    for block in range(len(out)):
        count = min(WIDE, len(q) - block * WIDE)
        base = out[block, 0]
        for row in range(12):
            value = 1.0 if row in (0, 4, 8) else 0.0
            for i in range(WIDE):
                base[row * WIDE + i] = value
        for joint in range(len(parents)):
            column = columns[joint]
            for i in range(count):
                position = q[block * WIDE + i, column]
                angle[i], slide[i] = (position, 0.0) if turns[joint] else (0.0, position)
            _cosine_and_sine(angle, c, s)
            _joint_frame(out[block, parents[joint]], starts[joint], c, s, slide, out[block, joint + 1])


@fast
def _cosine_and_sine(angle: Array, c: Array, s: Array) -> None:
    """Cosines and sines as in :mod:`trajevo.dynamics.rnea_loops`.

    They are written again because numba does not compile a loop anew if one in another file has changed.
    """
    far_away = False
    for i in range(WIDE):
        quarters = np.floor(angle[i] * _PER_QUARTER + 0.5)
        x = angle[i] - quarters * _FIRST - quarters * _SECOND - quarters * _THIRD
        y = x * x
        p = (1.58969099521155010221e-10 * y - 2.50507602534068634195e-08) * y + 2.75573137070700676789e-06
        p = ((p * y - 1.98412698298579493134e-04) * y + 8.33333333332248946124e-03) * y - 1.66666666666666324348e-01
        sine = x + x * y * p
        p = (-1.13596475577881948265e-11 * y + 2.08757232129817482790e-09) * y - 2.75573143513906633035e-07
        p = ((p * y + 2.48015872894767294178e-05) * y - 1.38888888888741095749e-03) * y + 4.16666666666666019037e-02
        cosine = 1.0 - (0.5 * y - y * y * p)
        quarter = quarters - 4.0 * np.floor(0.25 * quarters)
        odd = quarter == 1.0 or quarter == 3.0
        near, far = (sine, cosine) if odd else (cosine, sine)
        c[i] = -near if quarter == 1.0 or quarter == 2.0 else near
        s[i] = -far if quarter >= 2.0 else far
    for i in range(WIDE):
        far_away |= abs(angle[i]) > _GREATEST_ANGLE
    if far_away:
        for i in range(WIDE):
            if abs(angle[i]) > _GREATEST_ANGLE:
                c[i], s[i] = math.cos(angle[i]), math.sin(angle[i])


@fast
def _joint_frame(parent: Array, start: Array, c: Array, s: Array, slide: Array, own: Array) -> None:
    """Axes and origin of a joint in all states of a block."""
    for k in range(3):
        for i in range(WIDE):
            a, b = parent[k * WIDE + i], parent[(3 + k) * WIDE + i]
            d, e = parent[(6 + k) * WIDE + i], parent[(9 + k) * WIDE + i]
            x = a * start[0, 0] + b * start[0, 1] + d * start[0, 2]
            y = a * start[1, 0] + b * start[1, 1] + d * start[1, 2]
            z = a * start[2, 0] + b * start[2, 1] + d * start[2, 2]
            own[k * WIDE + i] = c[i] * x + s[i] * y
            own[(3 + k) * WIDE + i] = c[i] * y - s[i] * x
            own[(6 + k) * WIDE + i] = z
            own[(9 + k) * WIDE + i] = e + (a * start[3, 0] + b * start[3, 1] + d * start[3, 2]) + slide[i] * z


@fast("f8[3], i8[1], f8[2] -> f8[3]")
def centres(placed: Array, carriers: Array, points: Array, out: Array) -> None:
    """Where points of solids are.

    Args:
        placed: axes and origins of joints, shape (blocks, 1 + J, 12 WIDE).
        carriers: number of the joint that carries each solid, shape (G,).
        points: a point of each solid in the frame of its joint, shape (G, 3) [m].
        out: output, shape (G, 3, blocks WIDE) [m].
    """
    for block in range(len(placed)):
        for solid in range(len(carriers)):
            own, (x, y, z) = placed[block, carriers[solid]], points[solid]
            for k in range(3):
                row = out[solid, k, block * WIDE : (block + 1) * WIDE]
                for i in range(WIDE):
                    value = own[k * WIDE + i] * x + own[(3 + k) * WIDE + i] * y + own[(6 + k) * WIDE + i] * z
                    row[i] = value + own[(9 + k) * WIDE + i]


@fast("f8[3], f8[3], i8[1], f8[1] -> f8[2]")
def moved(placed: Array, whole: Array, carriers: Array, radii: Array, out: Array) -> None:
    """How far any point of each solid is moved from one state to the next, at most.

    Args:
        placed: axes and origins of joints, shape (blocks, 1 + J, 12 WIDE).
        whole: centres of the ball around each solid, shape (G, 3, blocks WIDE) [m].
        carriers: number of the joint that carries each solid, shape (G,).
        radii: radii of these balls, shape (G,) [m].
        out: output, shape (N - 1, G) [m].
    """
    around = np.empty(WIDE)
    for block in range(len(placed)):
        begin = block * WIDE
        count = min(WIDE, len(out) - begin)
        for solid in range(len(carriers)):
            own, x, y, z = placed[block, carriers[solid]], whole[solid, 0], whole[solid, 1], whole[solid, 2]
            for i in range(WIDE - 1):
                around[i] = 0.0
            for row in range(9):
                for i in range(WIDE - 1):
                    turned = own[row * WIDE + i + 1] - own[row * WIDE + i]
                    around[i] += turned * turned
            if count == WIDE:  # to the next block's first state
                other, around[WIDE - 1] = placed[block + 1, carriers[solid]], 0.0
                for row in range(9):
                    turned = other[row * WIDE] - own[row * WIDE + WIDE - 1]
                    around[WIDE - 1] += turned * turned
            for i in range(count):
                at = begin + i
                dx, dy, dz = x[at + 1] - x[at], y[at + 1] - y[at], z[at + 1] - z[at]
                # The spectral norm of the difference of two rotations is its Frobenius norm over √2.
                turned = math.sqrt(0.5 * around[i]) * radii[solid]
                out[at, solid] = math.sqrt(dx * dx + dy * dy + dz * dz) + turned


@fast("f8[3], i8[1], f8[3], f8[2], i8[2], i8[1], f8[2], i8[1], i8[1] -> f8[1]")
def bounds(
    placed: Array,
    carriers: Array,
    balls: Array,
    radii: Array,
    ends: Array,
    kinds: Array,
    numbers: Array,
    state: Array,
    pair: Array,
    out: Array,
) -> None:
    """Lower bounds of the distances of some pairs in some states.

    Args:
        placed: axes and origins of joints, shape (blocks, 1 + J, 12 WIDE).
        carriers: number of the joint that carries each solid, shape (G,).
        balls: centres of the ball around each solid and of those that cover it, in its joint's frame, shape
            (G, 1 + K, 3) [m].
        radii: their radii, shape (G, 1 + K) [m].
        ends: first and second solid of every pair, obstacles from G on, shape (n_pairs, 2).
        kinds: kinds of obstacles, shape (O,).
        numbers: what tells where they are, shape (O, 15).
        state: indices of states, shape (M,).
        pair: indices of pairs, shape (M,).
        out: output, shape (M,) [m].
    """
    one, other = np.empty((3, radii.shape[1])), np.empty((3, radii.shape[1]))
    for k in range(len(pair)):
        out[k] = _bound(placed, carriers, balls, radii, ends, kinds, numbers, state[k], pair[k], one, other)


@fast("f8[3], i8[1], f8[3], f8[2], i8[2], i8[1], f8[2], f8[2], i8[1], f8[2], f8, i8, i8, i8[2] -> i8[2], f8[2], i8[1]")
def near(
    placed: Array,
    carriers: Array,
    balls: Array,
    radii: Array,
    ends: Array,
    kinds: Array,
    numbers: Array,
    travel: Array,
    column: Array,
    most: Array,
    error: float,
    size: int,
    width: int,
    begin: Array,
    found: Array,
    lower: Array,
    counted: Array,
) -> None:
    """Intervals between neighbouring steps that may decide, from wider ones that are halved.

    Args:
        placed: as for :func:`bounds`, as the next six, in the states of a grid.
        carriers: see there.
        balls: see there.
        radii: see there.
        ends: see there.
        kinds: see there.
        numbers: see there.
        travel: how far solids can move relative to each other between neighbouring steps, shape (intervals, columns)
            [m].
        column: column of every pair, shape (n_pairs,).
        most: distance of each motion and pair from which on nothing decides, shape (B, n_pairs) [m].
        error: how far a distance may be below its lower bound [m].
        size: number of states of each motion.
        width: number of steps of the wider intervals.
        begin: their pairs, motions, and first steps, shape (3, K).
        found: output, numbers of intervals and indices of pairs, shape (2, K width).
        lower: output, lower bounds of the distance at both ends, shape (2, K width) [m].
        counted: output, how many were found, shape (1,).
    """
    one, other = np.empty((3, radii.shape[1])), np.empty((3, radii.shape[1]))
    steps, widths, low, high = np.empty(64, np.int64), np.empty(64, np.int64), np.empty(64), np.empty(64)
    counted[0], right = 0, 0.0
    for k in range(begin.shape[1]):
        pair, row, first = begin[0, k], begin[1, k], begin[2, k]
        after = k > 0 and begin[0, k - 1] == pair and begin[1, k - 1] == row and begin[2, k - 1] + width == first
        steps[0], widths[0], left = first, width, 1
        for side in range(2):
            if side == 0 and after:
                low[0] = right
                continue
            state = row * size + first + side * width
            right = _bound(placed, carriers, balls, radii, ends, kinds, numbers, state, pair, one, other) - error
            if side == 0:
                low[0] = right
        high[0] = right
        while left > 0:
            left -= 1
            step, wide, at, to = steps[left], widths[left], low[left], high[left]
            moved, interval = 0.0, row * (size - 1) + step
            for i in range(wide):
                moved += travel[interval + i, column[pair]]
            if at + to - moved >= 2.0 * most[row, pair]:
                continue
            if wide == 1:
                n = counted[0]
                found[0, n], found[1, n], lower[0, n], lower[1, n] = interval, pair, at, to
                counted[0] = n + 1
                continue
            half = wide // 2
            state = row * size + step + half
            middle = _bound(placed, carriers, balls, radii, ends, kinds, numbers, state, pair, one, other) - error
            steps[left], widths[left], low[left], high[left] = step, half, at, middle
            steps[left + 1], widths[left + 1], low[left + 1], high[left + 1] = step + half, half, middle, to
            left += 2


@fast
def _bound(
    placed: Array,
    carriers: Array,
    balls: Array,
    radii: Array,
    ends: Array,
    kinds: Array,
    numbers: Array,
    state: int,
    pair: int,
    one: Array,
    other: Array,
) -> float:
    """Lower bound of the distance of a pair in a state [m]; the last two are room for the balls of both solids."""
    solids, count = radii.shape
    first, second = ends[pair, 0], ends[pair, 1]
    block, i = state // WIDE, state % WIDE
    _balls_of(placed[block, carriers[first]], i, balls[first], one)
    parts = np.inf
    if second >= solids:
        kind, where = kinds[second - solids], numbers[second - solids]
        whole = _distance(kind, where, one, 0) - radii[first, 0]
        for ball in range(1, count):
            parts = min(parts, _distance(kind, where, one, ball) - radii[first, ball])
    else:
        _balls_of(placed[block, carriers[second]], i, balls[second], other)
        whole = _length(one, 0, other, 0) - radii[first, 0] - radii[second, 0]
        for ball in range(1, count):
            for beside in range(1, count):
                apart = _length(one, ball, other, beside) - radii[first, ball] - radii[second, beside]
                parts = min(parts, apart)
    # A solid that overlaps may be deeper than each of its parts, but not than the ball around it.
    bound: float = (max(whole, parts) if parts > 0.0 else whole) - SLACK
    return bound


@fast
def _balls_of(frame: Array, i: int, balls: Array, out: Array) -> None:
    """Centres of the balls of a solid in one state of a block, shape (3, balls)."""
    for k in range(3):
        a, b = frame[k * WIDE + i], frame[(3 + k) * WIDE + i]
        c, d = frame[(6 + k) * WIDE + i], frame[(9 + k) * WIDE + i]
        for ball in range(len(balls)):
            out[k, ball] = a * balls[ball, 0] + b * balls[ball, 1] + c * balls[ball, 2] + d


@fast
def _length(one: Array, first: int, other: Array, second: int) -> float:
    """Distance of two of points (3, ...)."""
    x, y, z = one[0, first] - other[0, second], one[1, first] - other[1, second], one[2, first] - other[2, second]
    length: float = math.sqrt(x * x + y * y + z * z)
    return length


@fast
def _distance(kind: int, numbers: Array, points: Array, place: int) -> float:
    """Signed distance of one of points (3, ...) to an obstacle, negative inside [m]."""
    px, py, pz = points[0, place], points[1, place], points[2, place]
    x = numbers[0] * px + numbers[3] * py + numbers[6] * pz + numbers[9]
    y = numbers[1] * px + numbers[4] * py + numbers[7] * pz + numbers[10]
    z = numbers[2] * px + numbers[5] * py + numbers[8] * pz + numbers[11]
    a, b, c = numbers[12], numbers[13], numbers[14]
    inside = 0.0
    if kind == SPHERE:
        first, second, third = x, y, z
        inside = -a
    elif kind == CYLINDER:
        first, second, third = math.sqrt(x * x + y * y) - a, abs(z) - b, 0.0
        inside = min(max(first, second), 0.0)
        first, second = max(first, 0.0), max(second, 0.0)
    else:
        first, second, third = abs(x) - a, abs(y) - b, abs(z) - c
        inside = min(max(first, max(second, third)), 0.0)
        first, second, third = max(first, 0.0), max(second, 0.0), max(third, 0.0)
    signed: float = math.sqrt(first * first + second * second + third * third) + inside
    return signed
