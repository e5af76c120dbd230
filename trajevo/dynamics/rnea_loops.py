"""Newton-Euler recursion over the joints of any tree, which numba (the optional extra ``fast``) compiles once.

The tree, masses, gravity and armature are arguments, so that a robot that was never used before compiles nothing.
States are handled in blocks of :data:`_WIDE`: every variable of a joint is a row with its values in all states of the
block, and loops over a row are vectorised by the compiler. A block is always as wide, with zeros at its end if states
are missing, so that a state's result depends neither on its neighbours nor on their number.

Joints have frames whose z-axis is the joint's axis, see :class:`~trajevo.dynamics.rnea_tree.Tree`.
"""

from __future__ import annotations

import math

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.jit import fast

#: Number of states of a block.
_WIDE = 64

#: Rows of a joint: angle and shift with their velocities and accelerations, 0 where it does not turn or slide; cosine
#: and sine; angular velocity and acceleration, and acceleration of the origin, of its frame; force and moment on it and
#: all that it carries.
_ANGLE, _SPIN, _SPIN_UP, _SHIFT, _SLIDE, _SLIDE_UP, _COSINE, _SINE = range(8)
_TURNING, _RATE, _GAIN, _FORCE, _MOMENT, _ROWS = 8, 11, 14, 17, 20, 23

#: Multiples of π/2 are subtracted as a sum of three parts; multiples of the first two up to 2²⁰ are exact.
_PER_QUARTER = 2.0 / np.pi
_FIRST, _SECOND, _THIRD = 1.57079632673412561417e00, 6.07710050630396597660e-11, 2.02226624879595063154e-21

#: Greatest angle for the polynomials [rad]; beyond it the functions of the math library are used.
_GREATEST_ANGLE = 1e5

#: Three components, one number each in a loop over states.
_Vector = tuple[float, float, float]


@fast("f8[2], f8[2], f8[2], i8[1], b1[1], f8[2], f8[2], f8[1], f8[1] -> f8[2]")
def torques(
    q: Array,
    v: Array,
    a: Array,
    parents: Array,
    slides: Array,
    places: Array,
    bodies: Array,
    gravity: Array,
    armature: Array,
    torque: Array,
) -> None:
    """Torques of states.

    Args:
        q: positions, shape (N, n) [rad or m].
        v: velocities, shape (N, n).
        a: accelerations, shape (N, n).
        parents: number of every joint's parent from 1, or 0 for the base, shape (n,).
        slides: which joints slide along their z-axis; the others turn about it, shape (n,).
        places: rotation, row by row, and origin of every joint's frame in its parent's, shape (n, 12).
        bodies: mass, mass times centre of mass, inertia about the frame's origin, shape (n, 10).
        gravity: shape (3,) [m/s²].
        armature: shape (n,).
        torque: output, shape (N, n) [N·m or N].
    """
    rows = _rows_of(gravity, len(parents))
    for begin in range(0, len(q), _WIDE):
        count = min(_WIDE, len(q) - begin)
        for j in range(len(parents)):
            own, first = rows[j + 1], _SHIFT if slides[j] else _ANGLE
            for i in range(count):
                own[first * _WIDE + i] = q[begin + i, j]
                own[(first + 1) * _WIDE + i] = v[begin + i, j]
                own[(first + 2) * _WIDE + i] = a[begin + i, j]
        _recursion(rows, parents, places, bodies)
        for j in range(len(parents)):
            own, along = rows[j + 1], (_FORCE if slides[j] else _MOMENT) + 2
            for i in range(count):
                torque[begin + i, j] = own[along * _WIDE + i] + armature[j] * a[begin + i, j]


@fast("c16[3], c16[3], c16[3], i8[1], i8[1], b1[1], f8[2], f8[2], f8[1], f8[1] -> c16[3]")
def stepped_torques(
    q: Array,
    v: Array,
    a: Array,
    begins: Array,
    parents: Array,
    slides: Array,
    places: Array,
    bodies: Array,
    gravity: Array,
    armature: Array,
    torque: Array,
) -> None:
    """Torques of complex states, whose imaginary parts are exact derivatives.

    Rows with equal real parts form consecutive groups and share what depends on the real parts alone.

    Args:
        q: positions, shape (R, T, n) [rad or m].
        v: velocities, shape (R, T, n).
        a: accelerations, shape (R, T, n).
        begins: the first row of each group, and R, shape (groups + 1,).
        parents: as for :func:`torques`, and so are the next five.
        slides: shape (n,).
        places: shape (n, 12).
        bodies: shape (n, 10).
        gravity: shape (3,) [m/s²].
        armature: shape (n,).
        torque: output, shape (R, T, n) [N·m or N].
    """
    joints = len(parents)
    rows, steps = _rows_of(gravity, joints), np.zeros((joints + 1, _ROWS * _WIDE))
    for group in range(len(begins) - 1):
        for begin in range(0, q.shape[1], _WIDE):
            count, shared = min(_WIDE, q.shape[1] - begin), begins[group]
            for j in range(joints):
                own, first = rows[j + 1], _SHIFT if slides[j] else _ANGLE
                for i in range(count):
                    own[first * _WIDE + i] = q[shared, begin + i, j].real
                    own[(first + 1) * _WIDE + i] = v[shared, begin + i, j].real
                    own[(first + 2) * _WIDE + i] = a[shared, begin + i, j].real
            _recursion(rows, parents, places, bodies)
            for row in range(shared, begins[group + 1]):
                for j in range(joints):
                    step, first = steps[j + 1], _SHIFT if slides[j] else _ANGLE
                    for i in range(count):
                        step[first * _WIDE + i] = q[row, begin + i, j].imag
                        step[(first + 1) * _WIDE + i] = v[row, begin + i, j].imag
                        step[(first + 2) * _WIDE + i] = a[row, begin + i, j].imag
                _recursion_of_steps(steps, rows, parents, places, bodies)
                for j in range(joints):
                    own, step, along = rows[j + 1], steps[j + 1], (_FORCE if slides[j] else _MOMENT) + 2
                    for i in range(count):
                        up = armature[j] * a[row, begin + i, j].real, armature[j] * a[row, begin + i, j].imag
                        at = along * _WIDE + i
                        torque[row, begin + i, j] = complex(own[at] + up[0], step[at] + up[1])


@fast
def _rows_of(gravity: Array, joints: int) -> Array:
    """Rows of the base, which accelerates upwards instead of gravity, and of joints, all 0."""
    rows = np.zeros((joints + 1, _ROWS * _WIDE))
    for k in range(3):
        for i in range(_WIDE):
            rows[0, (_GAIN + k) * _WIDE + i] = -gravity[k]
    return rows


@fast
def _recursion(rows: Array, parents: Array, places: Array, bodies: Array) -> None:
    """Force and moment on every joint of a block, from the motion of all joints."""
    for j in range(len(parents)):
        own = rows[j + 1]
        _cosine_and_sine(own)
        _outwards(own, rows[parents[j]], places[j])
        _moved(own, bodies[j])
    for j in range(len(parents) - 1, -1, -1):
        if parents[j] > 0:
            _inwards(rows[j + 1], rows[parents[j]], places[j])


@fast
def _recursion_of_steps(steps: Array, rows: Array, parents: Array, places: Array, bodies: Array) -> None:
    """Derivatives of all rows in the direction of steps of the motion, after :func:`_recursion`."""
    for j in range(len(parents)):
        _step_outwards(steps[j + 1], steps[parents[j]], rows[j + 1], rows[parents[j]], places[j])
        _step_moved(steps[j + 1], rows[j + 1], bodies[j])
    for j in range(len(parents) - 1, -1, -1):
        if parents[j] > 0:
            _step_inwards(steps[j + 1], steps[parents[j]], rows[j + 1], places[j])


@fast
def _cosine_and_sine(own: Array) -> None:
    """Cosines and sines of angles by minimax polynomials on [-π/4, π/4] (Sun's fdlibm, 1993)."""
    for i in range(_WIDE):
        quarters = np.floor(own[i] * _PER_QUARTER + 0.5)
        x = own[i] - quarters * _FIRST - quarters * _SECOND - quarters * _THIRD
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
        own[_COSINE * _WIDE + i] = -near if quarter == 1.0 or quarter == 2.0 else near
        own[_SINE * _WIDE + i] = -far if quarter >= 2.0 else far
    far_away = False
    for i in range(_WIDE):
        far_away |= abs(own[i]) > _GREATEST_ANGLE
    if far_away:
        for i in range(_WIDE):
            if abs(own[i]) > _GREATEST_ANGLE:
                own[_COSINE * _WIDE + i], own[_SINE * _WIDE + i] = math.cos(own[i]), math.sin(own[i])


@fast
def _outwards(own: Array, before: Array, place: Array) -> None:
    """Motion of a joint's frame from that of its parent's."""
    rotation = _matrix(place)
    for i in range(_WIDE):
        c, s = own[_COSINE * _WIDE + i], own[_SINE * _WIDE + i]
        spin, slide = own[_SPIN * _WIDE + i], own[_SLIDE * _WIDE + i]
        w, d = _vector(before, _TURNING, i), _vector(before, _RATE, i)
        g = _sum(_vector(before, _GAIN, i), _whirled(w, d, _arm(place, own[_SHIFT * _WIDE + i])))
        x, y, z = _back(rotation, w)
        x, y = c * x + s * y, c * y - s * x
        _put(own, _TURNING, i, (x, y, z + spin))
        u, v, z = _back(rotation, d)
        _put(own, _RATE, i, (c * u + s * v + y * spin, c * v - s * u - x * spin, z + own[_SPIN_UP * _WIDE + i]))
        u, v, z = _back(rotation, g)
        u, v = c * u + s * v + 2.0 * (y * slide), c * v - s * u - 2.0 * (x * slide)
        _put(own, _GAIN, i, (u, v, z + own[_SLIDE_UP * _WIDE + i]))


@fast
def _moved(own: Array, body: Array) -> None:
    """Force, and moment about the frame's origin, that move a joint's own body."""
    mass, lever = body[0], (body[1], body[2], body[3])
    for i in range(_WIDE):
        w, d, g = _vector(own, _TURNING, i), _vector(own, _RATE, i), _vector(own, _GAIN, i)
        _put(own, _FORCE, i, _sum(_scaled(mass, g), _whirled(w, d, lever)))
        spun = _sum(_turned(body, d), _cross(w, _turned(body, w)))
        _put(own, _MOMENT, i, _sum(spun, _cross(lever, g)))


@fast
def _inwards(own: Array, before: Array, place: Array) -> None:
    """Add the force and the moment on a joint to those on its parent."""
    rotation = _matrix(place)
    for i in range(_WIDE):
        c, s = own[_COSINE * _WIDE + i], own[_SINE * _WIDE + i]
        force = _onwards(rotation, c, s, _vector(own, _FORCE, i))
        moment = _onwards(rotation, c, s, _vector(own, _MOMENT, i))
        moment = _sum(moment, _cross(_arm(place, own[_SHIFT * _WIDE + i]), force))
        _put(before, _FORCE, i, _sum(_vector(before, _FORCE, i), force))
        _put(before, _MOMENT, i, _sum(_vector(before, _MOMENT, i), moment))


@fast
def _step_outwards(step: Array, step_before: Array, own: Array, before: Array, place: Array) -> None:
    """Derivative of :func:`_outwards`."""
    rotation = _matrix(place)
    for i in range(_WIDE):
        c, s = own[_COSINE * _WIDE + i], own[_SINE * _WIDE + i]
        spin, slide, turn = own[_SPIN * _WIDE + i], own[_SLIDE * _WIDE + i], step[_ANGLE * _WIDE + i]
        of_spin, of_slide = step[_SPIN * _WIDE + i], step[_SLIDE * _WIDE + i]
        w, d = _vector(before, _TURNING, i), _vector(before, _RATE, i)
        of_w, of_d = _vector(step_before, _TURNING, i), _vector(step_before, _RATE, i)
        shift = _scaled(step[_SHIFT * _WIDE + i], (rotation[2], rotation[5], rotation[8]))
        whirled = _sum(_whirled_step(w, of_w, of_d, _arm(place, own[_SHIFT * _WIDE + i])), _whirled(w, d, shift))
        g = _sum(_vector(step_before, _GAIN, i), whirled)
        along, across = own[_TURNING * _WIDE + i], own[(_TURNING + 1) * _WIDE + i]
        x, y, z = _back(rotation, of_w)
        x, y = c * x + s * y + turn * across, c * y - s * x - turn * along
        _put(step, _TURNING, i, (x, y, z + of_spin))
        u, v, z = _back(rotation, of_d)
        u, v = c * u + s * v + y * spin + across * of_spin, c * v - s * u - x * spin - along * of_spin
        u += turn * (own[(_RATE + 1) * _WIDE + i] + along * spin)
        v -= turn * (own[_RATE * _WIDE + i] - across * spin)
        _put(step, _RATE, i, (u, v, z + step[_SPIN_UP * _WIDE + i]))
        u, v, z = _back(rotation, g)
        # A joint either turns or slides, so that no product of both is missing here.
        u, v = c * u + s * v + turn * own[(_GAIN + 1) * _WIDE + i], c * v - s * u - turn * own[_GAIN * _WIDE + i]
        u, v = u + 2.0 * (y * slide + across * of_slide), v - 2.0 * (x * slide + along * of_slide)
        _put(step, _GAIN, i, (u, v, z + step[_SLIDE_UP * _WIDE + i]))


@fast
def _step_moved(step: Array, own: Array, body: Array) -> None:
    """Derivative of :func:`_moved`."""
    mass, lever = body[0], (body[1], body[2], body[3])
    for i in range(_WIDE):
        w = _vector(own, _TURNING, i)
        of_w, of_d, of_g = _vector(step, _TURNING, i), _vector(step, _RATE, i), _vector(step, _GAIN, i)
        _put(step, _FORCE, i, _sum(_scaled(mass, of_g), _whirled_step(w, of_w, of_d, lever)))
        spun = _sum(_cross(of_w, _turned(body, w)), _cross(w, _turned(body, of_w)))
        _put(step, _MOMENT, i, _sum(_sum(_turned(body, of_d), spun), _cross(lever, of_g)))


@fast
def _step_inwards(step: Array, step_before: Array, own: Array, place: Array) -> None:
    """Derivative of :func:`_inwards`."""
    rotation = _matrix(place)
    for i in range(_WIDE):
        c, s, turn = own[_COSINE * _WIDE + i], own[_SINE * _WIDE + i], step[_ANGLE * _WIDE + i]
        shift = _scaled(step[_SHIFT * _WIDE + i], (rotation[2], rotation[5], rotation[8]))
        x, y, z = _vector(own, _FORCE, i)
        u, v, t = _vector(step, _FORCE, i)
        force, of_force = _onwards(rotation, c, s, (x, y, z)), _onwards(rotation, c, s, (u - turn * y, v + turn * x, t))
        x, y, z = _vector(own, _MOMENT, i)
        u, v, t = _vector(step, _MOMENT, i)
        moment = _onwards(rotation, c, s, (u - turn * y, v + turn * x, t))
        levers = _sum(_cross(_arm(place, own[_SHIFT * _WIDE + i]), of_force), _cross(shift, force))
        _put(step_before, _FORCE, i, _sum(_vector(step_before, _FORCE, i), of_force))
        _put(step_before, _MOMENT, i, _sum(_vector(step_before, _MOMENT, i), _sum(moment, levers)))


@fast
def _matrix(place: Array) -> tuple[float, ...]:
    """Rotation of a place, row by row."""
    return place[0], place[1], place[2], place[3], place[4], place[5], place[6], place[7], place[8]


@fast
def _arm(place: Array, shift: float) -> _Vector:
    """Origin of a place, shifted along its z-axis."""
    return place[9] + place[2] * shift, place[10] + place[5] * shift, place[11] + place[8] * shift


@fast
def _vector(rows: Array, first: int, i: int) -> _Vector:
    """A vector of a state, from three rows."""
    return rows[first * _WIDE + i], rows[(first + 1) * _WIDE + i], rows[(first + 2) * _WIDE + i]


@fast
def _put(rows: Array, first: int, i: int, vector: _Vector) -> None:
    """Put a vector of a state into three rows."""
    rows[first * _WIDE + i], rows[(first + 1) * _WIDE + i], rows[(first + 2) * _WIDE + i] = vector


@fast
def _sum(one: _Vector, other: _Vector) -> _Vector:
    """One + other."""
    return one[0] + other[0], one[1] + other[1], one[2] + other[2]


@fast
def _scaled(factor: float, vector: _Vector) -> _Vector:
    """Factor * vector."""
    return factor * vector[0], factor * vector[1], factor * vector[2]


@fast
def _cross(one: _Vector, other: _Vector) -> _Vector:
    """One x other."""
    x, y, z = one
    u, v, w = other
    return y * w - z * v, z * u - x * w, x * v - y * u


@fast
def _back(e: tuple[float, ...], vector: _Vector) -> _Vector:
    """A vector of the parent's frame in the frame of a place, whose rotation is ``e``."""
    x, y, z = vector
    return e[0] * x + e[3] * y + e[6] * z, e[1] * x + e[4] * y + e[7] * z, e[2] * x + e[5] * y + e[8] * z


@fast
def _onwards(e: tuple[float, ...], c: float, s: float, vector: _Vector) -> _Vector:
    """A vector of a joint's frame in its parent's."""
    x, y, z = vector
    x, y = c * x - s * y, s * x + c * y
    return e[0] * x + e[1] * y + e[2] * z, e[3] * x + e[4] * y + e[5] * z, e[6] * x + e[7] * y + e[8] * z


@fast
def _turned(body: Array, vector: _Vector) -> _Vector:
    """Inertia of a body times a vector."""
    x, y, z = vector
    return (
        body[4] * x + body[5] * y + body[6] * z,
        body[5] * x + body[7] * y + body[8] * z,
        body[6] * x + body[8] * y + body[9] * z,
    )


@fast
def _whirled(w: _Vector, d: _Vector, arm: _Vector) -> _Vector:
    """Acceleration d x arm + w x (w x arm) of a point, from angular velocity and acceleration."""
    (x, y, z), (p, q, r), (u, v, t) = w, d, arm
    xx, yy, zz, xy, xz, yz = x * x, y * y, z * z, x * y, x * z, y * z
    return (
        (xy - r) * v + (xz + q) * t - (yy + zz) * u,
        (xy + r) * u + (yz - p) * t - (xx + zz) * v,
        (xz - q) * u + (yz + p) * v - (xx + yy) * t,
    )


@fast
def _whirled_step(w: _Vector, of_w: _Vector, of_d: _Vector, arm: _Vector) -> _Vector:
    """Derivative of :func:`_whirled` in the direction of steps of angular velocity and acceleration."""
    (x, y, z), (e, f, g), (p, q, r), (u, v, t) = w, of_w, of_d, arm
    xx, yy, zz = 2.0 * (x * e), 2.0 * (y * f), 2.0 * (z * g)
    xy, xz, yz = x * f + y * e, x * g + z * e, y * g + z * f
    return (
        (xy - r) * v + (xz + q) * t - (yy + zz) * u,
        (xy + r) * u + (yz - p) * t - (xx + zz) * v,
        (xz - q) * u + (yz + p) * v - (xx + yy) * t,
    )
