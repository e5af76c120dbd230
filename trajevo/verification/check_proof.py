"""Check a proof file of a robot's motion: ``python check_proof.py FILE``; it imports nothing but the standard library.

Nothing of how the file was made is trusted. Positions and derivatives are polynomials of rationals: their coefficients
of Bernstein, without rounding, enclose them on intervals that are halved until a claim is proven or broken. Efforts are
those of Newton and Euler, of quantities that are polynomials with a bound of all truncation and rounding (``Tube``).
Exit code 0: all that is checked is proven; 1: something is not; 2: it is no proof file.
"""

from __future__ import annotations

import hashlib
import json
import math
import sys
from contextlib import suppress
from fractions import Fraction
from itertools import accumulate, pairwise
from operator import mul
from types import SimpleNamespace
from typing import Any

KINDS = *ORDERS, _ = ("position", "velocity", "acceleration", "jerk", "effort")
#: At most: bytes, coefficients in a row, halvings of intervals and of pieces, looks per piece. Coefficients of tubes.
LARGEST, LONGEST, CUTS, DEEPEST, PIECES, TERMS = 2**26, 64, 60, 48, 10, 10
#: Shares: by which limits may be exceeded; of a peak, and of positions over a power of the shortest segment, that are
#: no step at a break; of a peak, up to which a joint is at rest.
WITHIN, STEP, ROUNDED, AT_REST = map(Fraction, (1e-9, 1e-6, 1e-11, 1.001e-9))
#: Rounding of a double; factor and term for the rounding and underflow of error bounds themselves; pi, to 70 digits.
U, UP, TINY = 2.0**-53, 1.0 + 2.0**-30, 1e-290
FAR = Fraction(10) ** 300  # for what has no limit, or of which nothing is claimed
PI = Fraction(31415926535897932384626433832795028841971693993751058209749445923078164, 10**70)


class BadFileError(ValueError):
    """The file is no proof file, or contradicts itself."""


def decide(b: list[int], low: int, high: int) -> tuple[bool | None, Fraction]:
    """Whether low <= p(u) <= high for u in [0, 1] and Bernstein coefficients b; False or None (undecided) with a u."""
    n, stack = len(b) - 1, [(b, low, high, 0, 0)]
    while stack:
        b, low, high, place, depth = stack.pop()
        if low <= min(b) and max(b) <= high:
            continue
        if not low <= b[0] <= high or not low <= b[-1] <= high:
            return False, Fraction(place + (low <= b[0] <= high), 1 << depth)
        if depth == CUTS:
            return None, Fraction(place, 1 << depth)
        row, left, right = [x << n for x in b], list[int](), list[int]()
        while row:  # de Casteljau's halving; exact, as everything has been multiplied by 2^n
            left, right, row = [*left, row[0]], [row[-1], *right], [(x + y) >> 1 for x, y in pairwise(row)]
        stack += [(x, low << n, high << n, 2 * place + k, depth + 1) for k, x in ((1, right), (0, left))]
    return True, Fraction(0)


def moved(a: list[Any], start: Any, width: Any) -> list[Any]:
    """Coefficients of the powers of u in p(start + width u), by Taylor's shift."""
    a = a.copy()
    for i in range(len(a) - 1):
        for k in range(len(a) - 2, i - 1, -1):
            a[k] += a[k + 1] * start
    return [x * width**k for k, x in enumerate(a)]


def bernstein(a: list[Any], start: int = 0, width: int = 1) -> tuple[list[int], int]:
    """Bernstein coefficients of p(start + width u) on [0, 1] in whole numbers, and by what these are divided."""
    n, ratios = len(a) - 1, [x.as_integer_ratio() for x in a]
    divisor, m = math.lcm(*(d for _, d in ratios)), math.lcm(*(math.comb(n, k) for k in range(n + 1)))
    whole = moved([x * (divisor // d) for x, d in ratios], start, width)
    parts = [m // math.comb(n, k) * x for k, x in enumerate(whole)]
    return [sum(math.comb(j, k) * x for k, x in enumerate(parts[: j + 1])) for j in range(n + 1)], divisor * m


class _Segment:
    """The exact polynomials of all joints in a segment, of u = (time since its begin) / duration."""

    def __init__(self, begin: float, end: float, rows: list[list[float]]) -> None:
        self.begin, self.duration = Fraction(begin), Fraction(end) - Fraction(begin)
        exact = [[Fraction(c) * self.duration**k for k, c in enumerate(row)] for row in rows]
        self.b, self.d = [bernstein(a) for a in exact], [math.lcm(*(x.denominator for x in a)) for a in exact]
        self.a = [[int(x * d) for x in a] for a, d in zip(exact, self.d)]  # whole numbers, divided by d

    def derivative(self, joint: int, order: int) -> tuple[list[int], Fraction]:
        """Bernstein coefficients of a derivative, and by what they are divided."""
        b, divisor = self.b[joint][0], Fraction(self.b[joint][1])
        for _ in range(order):
            b, divisor = [y - x for x, y in pairwise(b)] or [0], divisor * self.duration / max(len(b) - 1, 1)
        return b, divisor

    def told(self, kept: bool | None, u: Fraction) -> str:
        """That a claim is broken, or not decided, near u."""
        return (
            f"is claimed, {'perhaps ' if kept is None else ''}wrongly at {float(self.begin + u * self.duration):.6g} s"
        )

    def on_piece(self, level: int, place: int) -> Any:
        """Positions, velocities, accelerations of all joints on u = (2 place + 1 + s) / 2^(level + 1), |s| <= 1."""
        rate, found = float((2 << level) / self.duration), tuple(list[Tube]() for _ in range(3))
        for a, d in zip(self.a, self.d):
            whole = moved([x << (level + 1) * (len(a) - 1 - k) for k, x in enumerate(a)], 2 * place + 1, 1)
            c = [x / (d << (level + 1) * (len(a) - 1)) for x in whole]
            for tubes in found:
                tubes.append(Tube.of(c, 8.0 * U * sum(map(abs, c))))
                c = [k * x * rate for k, x in enumerate(c)][1:]
        return found


class Tube:
    """All functions that differ by at most e from the polynomial of s, |s| <= 1, with TERMS coefficients c."""

    def __init__(self, c: list[float], e: float) -> None:
        self.c, self.e, self.size = c, e * UP + TINY, sum(map(abs, c))

    @staticmethod
    def of(c: list[float], e: float = 0.0) -> Tube:
        """A tube, ``ZERO`` if it is 0; what has no place in its polynomial widens it."""
        return Tube((c + [0.0] * TERMS)[:TERMS], e + sum(map(abs, c[TERMS:]))) if e or any(c) else ZERO

    def __mul__(self, other: Tube) -> Tube:
        if self is ZERO or other is ZERO:
            return ZERO
        b = other.c[::-1]
        c = [sum(map(mul, self.c, b[TERMS - 1 - k :])) for k in range(TERMS)]
        lost = sum(map(mul, map(abs, self.c[1:]), accumulate(map(abs, b))))
        lost += (TERMS + 2) * U * self.size * other.size  # and rounding
        return Tube(c, self.size * other.e + other.size * self.e + self.e * other.e + lost)

    def __rmul__(self, k: float) -> Tube:  # constants may be rounded twice themselves, as in dot
        return Tube([k * a for a in self.c], abs(k) * (self.e + 4 * U * self.size)) if k and self is not ZERO else ZERO

    def keeps(self, low: Fraction, high: Fraction) -> bool | None:
        """Whether it stays between two numbers; False if it surely does not, None if it is too wide to tell."""
        around = (sum(map(abs, self.c[1:])) + self.e) * UP + 2.0 * U * abs(self.c[0])
        if low <= self.c[0] - around and self.c[0] + around <= high:
            return True
        if not self.e + self.size < math.inf or low + Fraction(self.e) > high - Fraction(self.e):
            return None
        (b, divisor), e = bernstein(self.c, -1, 2), Fraction(self.e)
        kept, u = decide(b, math.ceil((low + e) * divisor), math.floor((high - e) * divisor))
        value = sum(Fraction(x) * (2 * u - 1) ** k for k, x in enumerate(self.c))
        return kept if kept is not False else None if low - e <= value <= high + e else False

    def series(self, factors: list[float], rest: float) -> Tube:
        """1 + f0 x (1 + f1 x (1 + ...)); all further terms together are at most ``rest``."""
        inner = ZERO
        for factor in reversed(factors):
            inner = factor * (self * dot((1, 1), (ONE, inner)))
        return dot((1, 1, 1), (ONE, inner, Tube.of([0.0], rest)))

    def sine_and_cosine(self) -> tuple[Tube, Tube]:
        """Those of an angle: of its middle in whole numbers over 2^180, and of what is around, by Taylor's series."""
        x = round((Fraction(self.c[0]) - round(self.c[0] / (2.0 * math.pi)) * 2 * PI) * 2**180)  # at most about pi
        found, term, k = [0, 0], 2**180, 0
        while abs(term) > 1:
            found[k % 2] += term if k % 4 < 2 else -term
            k, term = k + 1, (term * x >> 180) // (k + 1)
        c, s = (x / 2**180 for x in found)
        rest, e = Tube.of([0.0, *self.c[1:]]), Tube.of([0.0], 2.0 * U + 1e-60 * abs(self.c[0]) + self.e)
        count, left_out, square = 1, rest.size**2, rest * rest
        while left_out > 1e-19 and count < 60:
            count, left_out = count + 1, left_out * rest.size**2 / (4 * count**2)
        left_out = 2.0 * left_out * (1.0 + rest.size) if rest.size < count else math.inf
        even, odd = ([-1.0 / ((2 * k) * (2 * k + i)) for k in range(1, count + 1)] for i in (-1, 1))
        cosine, sine = square.series(even, left_out), rest * square.series(odd, left_out)
        return dot((s, c, 1), (cosine, sine, e)), dot((c, -s, 1), (cosine, sine, e))

    def inverse_root(self) -> Tube:
        """1 / sqrt of it, by the binomial series."""
        middle, around = self.c[0], Tube.of([0.0, *self.c[1:]], self.e)
        size = (around.size + around.e) / middle * UP if middle > 0.0 else 1.0
        left_out = size**50 / (1.0 - size) if size < 0.9 else math.inf
        rest = ((1.0 / middle) * around).series([-(2 * k - 1) / (2 * k) for k in range(1, 50)], left_out)
        return (1.0 / math.sqrt(middle)) * rest


ZERO = Tube([0.0] * TERMS, 0.0)  # this object is exactly 0
ONE = Tube.of([1.0])


def dot(constants: Any, tubes: Any) -> Tube:
    """The sum of constants times tubes."""
    some = [(k, x) for k, x in zip(constants, tubes, strict=True) if k and x is not ZERO]
    if len(some) < 2:
        return ZERO if not some else some[0][1] if some[0][0] == 1.0 else some[0][0] * some[0][1]
    c, e = [0.0] * TERMS, 0.0
    for k, x in some:
        c, e = [a + k * b for a, b in zip(c, x.c)], e + abs(k) * (x.e + (len(some) + 4) * U * x.size)
    return Tube(c, e)


def added(*vectors: Any) -> list[Tube]:
    """The sum of vectors of tubes."""
    return [dot([1] * len(vectors), column) for column in zip(*vectors, strict=True)]


def lin(matrix: Any, v: Any) -> list[Tube]:
    """A matrix of constants times a vector of tubes, or one of tubes times constants."""
    return [dot(v, row) if isinstance(row[0], Tube) else dot(row, v) for row in matrix]


def cross(a: Any) -> list[list[float]]:
    """The matrix of the cross product of a constant vector with another."""
    return [[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]]


class _Link:
    """A joint with what it moves, in its own axes, of which z is that of the joint."""

    def __init__(self, data: Any, loads: list[Any]) -> None:
        self.parent, self.turns = data["parent"], {True: True, False: False}[data["turns"]]
        self.place, self.offset = numbers(data["rotation"], 3, 3), numbers(data["offset"], 3)
        self.back = list(zip(*self.place))
        if any(abs(sum(map(mul, x, y)) - (x is y)) > 1e-9 for x in self.back for y in self.back):
            raise BadFileError("rotation: expected an orthogonal matrix")
        bodies = [numbers(each["body"], 10) for each in (data, *loads)]
        m, *h, xx, xy, yy, xz, yz, zz = [sum(map(Fraction, x)) for x in zip(*bodies)]
        half = (xx + yy + zz) / 2  # half the trace of an inertia less the inertia is the second moment of mass
        second = [[half - xx, -xy, -xz], [-xy, half - yy, -yz], [-xz, -yz, half - zz]]
        self.mass, self.moment, self.e = float(m), [*map(float, h)], [[*map(float, row)] for row in second]

    def rotated(self, v: Any, sign: int) -> list[Tube]:
        """A vector turned by the joint's angle (sign 1), or back (-1)."""
        (x, y, z), c, s = v, self.cosine, self.sine
        return [dot((1, -sign), (c * x, s * y)), dot((sign, 1), (s * x, c * y)), z] if self.turns else [x, y, z]

    def move(self, before: Any, q: Tube, v: Tube, a: Tube, angle: tuple[Tube, Tube]) -> None:
        """Motion of the link from that of the one before, then the force and the moment that its bodies need."""
        self.q, (self.sine, self.cosine) = q, angle
        known = before.spin, before.rate, added(before.pull, lin(before.swing, self.offset))
        w, d, self.pull = (self.rotated(lin(self.back, x), -1) for x in known)
        turning = [w[1] * v, -1 * (w[0] * v), ZERO]  # angular velocity x axis, times v
        if self.turns:
            w, d = added(w, [ZERO, ZERO, v]), added(d, turning, [ZERO, ZERO, a])
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = [[w[i] * w[j] if i <= j else ZERO for j in range(3)] for i in range(3)]
        self.spin, self.rate = w, d
        self.swing = s = [  # from a point's place to its acceleration about the origin
            [dot((-1, -1), (yy, zz)), dot((1, -1), (xy, d[2])), dot((1, 1), (xz, d[1]))],
            [dot((1, 1), (xy, d[2])), dot((-1, -1), (xx, zz)), dot((1, -1), (yz, d[0]))],
            [dot((1, -1), (xz, d[1])), dot((1, 1), (yz, d[0])), dot((-1, -1), (xx, yy))],
        ]
        if not self.turns:
            self.pull = added(self.pull, [row[2] * q for row in s], turning, turning, [ZERO, ZERO, a])
        self.force = added([self.mass * x for x in self.pull], lin(s, self.moment))
        turn = [dot([*self.e[j], *(-x for x in self.e[i])], [*s[i], *s[j]]) for i, j in ((2, 1), (0, 2), (1, 0))]
        self.torque = added(lin(cross(self.moment), self.pull), turn)

    def bears(self, links: list[_Link]) -> Tube:
        """The effort of the joint; what is beyond it is handed on to the link before."""
        if self.parent >= 0:
            x, y, _ = self.force if not self.turns else (ZERO, ZERO, ZERO)
            inward = self.force, added(self.torque, [-1 * (self.q * y), self.q * x, ZERO])
            force, torque = (lin(self.place, self.rotated(each, 1)) for each in inward)
            before = links[self.parent]
            before.force = added(before.force, force)
            before.torque = added(before.torque, torque, lin(cross(self.offset), force))
        return self.torque[2] if self.turns else self.force[2]


class _Robot:
    """A robot with some loads."""

    def __init__(self, data: Any, loads: list[Any]) -> None:
        if any(not 0 <= load["link"] < len(data["links"]) for load in loads):
            raise BadFileError("loads: expected each on one of the links")
        self.links = [_Link(x, [y for y in loads if y["link"] == k]) for k, x in enumerate(data["links"])]
        self.drives, self.screws = numbers(data["matrix"], len(self.links), None), data["screws"]
        self.offset, gravity, still = numbers(data["offset"], len(self.links)), numbers(data["gravity"], 3), [ZERO] * 3
        self.ground = SimpleNamespace(spin=still, rate=still, swing=[still] * 3, pull=[Tube.of([-g]) for g in gravity])
        keys = ("viscous", "armature", "coulomb", "coulomb_backward", "standing")
        self.viscous, self.armature, *self.dry = (numbers(data["friction"][key], len(self.drives[0])) for key in keys)
        if min(map(min, self.dry)) < 0.0:
            raise BadFileError("friction: expected numbers from 0 on")

    def efforts(self, q: list[Tube], v: list[Tube], a: list[Tube]) -> list[Tube]:
        """Efforts of the actuators without dry friction."""
        model = [dot([*row, 1], [*q, Tube.of([x])]) for row, x in zip(self.drives, self.offset)]
        speeds, gains = lin(self.drives, v), lin(self.drives, a)
        angles = [x.sine_and_cosine() if link.turns else (ZERO, ONE) for link, x in zip(self.links, model)]
        if self.screws:  # slide (x1 + x2) / 2 and swivel atan(u / span), u = x2 - x1
            i, j, span = (self.screws[key] for key in ("slide", "swivel", "span"))
            u, du, ddu = (dot((-1, 1), (x[i], x[j])) for x in (q, v, a))
            root = dot((1, span), (u * u, Tube.of([span]))).inverse_root()
            share, angles[j] = span * (root * root), (u * root, span * root)
            model[i], speeds[i], gains[i] = (dot((0.5, 0.5), (x[i], x[j])) for x in (q, v, a))
            speeds[j], gains[j] = share * du, dot((1, -2.0 / span), (share * ddu, u * (share * du) * (share * du)))
        for link, x, dx, ddx, angle in zip(self.links, model, speeds, gains, angles):
            link.move(self.ground if link.parent < 0 else self.links[link.parent], x, dx, ddx, angle)
        torques = [link.bears(self.links) for link in reversed(self.links)][::-1]
        if self.screws:
            torques[i], torques[j] = (dot((0.5, sign), (torques[i], torques[j] * share)) for sign in (-1, 1))
        parts = zip(zip(*self.drives), self.viscous, v, self.armature, a)
        return [dot([*row, d, m], [*torques, x, y]) for row, d, x, m, y in parts]

    def friction(self, joint: int, v: Tube) -> tuple[Any, Any]:
        """Least and greatest dry friction of a joint; up to a speed it stands and has none."""
        ahead, behind, rest = (Fraction(x[joint]) for x in self.dry)
        sure = (-rest, rest, 0, 0), (rest, FAR, ahead, ahead), (-FAR, -rest, -behind, -behind)
        for low, high, least, most in (*sure, (-rest, FAR, 0, ahead), (-FAR, rest, -behind, 0)):
            if v is ZERO or ahead == behind == 0 or v.keeps(low, high):
                return least, most
        return -behind, ahead


def numbers(x: Any, *shape: int | None) -> Any:
    """Nested lists of finite doubles in the given shape (None: any length); doubles may be hexadecimal texts."""
    if shape and isinstance(x, list) and x and shape[0] in (None, len(x)):
        return [numbers(each, *shape[1:]) for each in x]
    value = x if type(x) in (int, float) else float.fromhex(x) if str(x).lstrip("-").startswith("0x") else math.nan
    if shape or not abs(value) <= sys.float_info.max:
        raise BadFileError(f"expected {f'a list of {shape[0]} entries' if shape else 'a finite number'}, got {x!s:.40}")
    return float(value)


class _Motion:
    """What a file says of a motion, and the proofs of its rows."""

    def __init__(self, data: Any) -> None:
        motion, self.data, self.names = data["motion"], data, [str(x["name"]) for x in data["motion"]["joints"]]
        breaks, joints = numbers(motion["breaks"], None), range(len(self.names))
        rows = numbers(motion["coefficients"], len(breaks) - 1, len(joints), None)
        rising = breaks[0] == 0.0 and all(x < y for x, y in pairwise(breaks)) and len({*self.names}) == len(joints)
        if not rising or any(len(x) > LONGEST for row in rows for x in row):
            raise BadFileError("motion: expected breaks that increase from 0, joints of different names, low degrees")
        self.segments = [_Segment(x, y, row) for (x, y), row in zip(pairwise(breaks), rows)]
        all_ = [[[each.derivative(j, order) for each in self.segments] for j in joints] for order in range(3)]
        self.peaks = [[max(max(map(abs, b)) / d for b, d in each) for each in order] for order in all_]  # or above

    def steps(self, order: int, joint: int) -> str:
        """Where a derivative steps at a break, so that the next one is infinite; empty if nowhere."""
        shortest = min(each.duration for each in self.segments)
        most = STEP * self.peaks[order][joint] + ROUNDED * max(self.peaks[0]) / shortest**order
        for one, other in pairwise(self.segments):
            (before, m), (after, n) = one.derivative(joint, order), other.derivative(joint, order)
            if abs(after[0] / n - before[-1] / m) > most:
                return f"is claimed, and {ORDERS[order]} steps at {float(other.begin):.6g} s"
        return ""

    def polynomial(self, quantity: str, joint: int, low: Any, high: Any) -> str:
        """Why a derivative may leave what is claimed; empty if it does not."""
        order = ORDERS.index(quantity)
        for each in self.segments:
            b, divisor = each.derivative(joint, order)
            kept, u = decide(b, math.ceil(low * divisor), math.floor(high * divisor))
            if not kept:
                return each.told(kept, u)
        return self.steps(order - 1, joint) if order else ""

    def efforts(self, rows: list[tuple[int, Any, Any]]) -> dict[int, str]:
        """For the joints of rows (joint, least, greatest), why their efforts may leave what is claimed."""
        failed, done = {j: self.steps(0, j) or self.steps(1, j) for j, _, _ in rows}, Fraction(0)
        robots = [_Robot(self.data["robot"], loads) for loads in self.data["robot"]["loads"]]
        speeds = (v + q / sum(each.duration for each in self.segments) for q, v, _ in zip(*self.peaks))
        if any(rest > AT_REST * v for rest, v in zip(robots[0].dry[2], speeds)):
            raise BadFileError("standing: expected no more than rounding of the joints' speeds")
        self.budget = PIECES * (len(self.data["pieces"]) + 10)
        for piece in self.data["pieces"]:
            number, level, first, shares = (piece[key] for key in ("segment", "level", "place", "shares"))
            follows = 0 <= level <= CUTS and 0 <= first < 1 << level and done == number + Fraction(first, 1 << level)
            if not follows or len(shares) != len(rows) or not all(type(x) is int and 0 <= x <= 1000 for x in shares):
                raise BadFileError("pieces: expected all of the motion one after the other, with shares up to 1000")
            todo = [(j, low * share / 1000, high * share / 1000) for (j, low, high), share in zip(rows, shares)]
            self.piece(robots[self.data["carried"][number]], self.segments[number], level, first, todo, failed)
            done += Fraction(1, 1 << level)
        if done != len(self.segments) or len(self.data["carried"]) != done:
            raise BadFileError("pieces: they end before the motion does")
        return failed

    def piece(self, robot: _Robot, segment: _Segment, level: int, first: int, rows: Any, failed: Any) -> None:
        """Prove what rows claim of a piece, or of its halves, and say of which joints it fails."""
        todo = [row for row in rows if not failed[row[0]]]
        if not todo:
            return
        self.budget -= 1
        efforts, left, last = list[Tube](), list[Any](), level >= DEEPEST or self.budget <= 0
        with suppress(ArithmeticError, ValueError):  # as if nothing were known
            states = segment.on_piece(level, first)
            efforts = robot.efforts(*states)
        for j, low, high in todo:
            least, most = robot.friction(j, states[1][j]) if efforts else (0, 1)
            kept = efforts[j].keeps(low - least, high - most) if efforts else None
            kept = None if kept is False and least < most else kept
            if kept is None and not last:
                left.append((j, low, high))
            elif not kept:
                failed[j] = segment.told(kept, Fraction(2 * first + 1, 2 << level))
        for half in (0, 1):
            self.piece(robot, segment, level + 1, 2 * first + half, left, failed)

    def check(self) -> list[tuple[str, bool | None, str]]:
        """Every row: its name, whether it is proven that it keeps its limits (None: not checked), and why."""
        rows, found = dict[Any, Any](), list[tuple[str, bool | None, str]]()
        kinds = {u: dict(zip(KINDS, (u, f"{u}/s", f"{u}/s^2", f"{u}/s^3", f))) for u, f in (("rad", "N*m"), ("m", "N"))}
        for row in self.data["rows"]:
            key, joint = (row["quantity"], row["joint"]), self.names.index(row["joint"])
            if key in rows or row["unit"] != kinds[self.data["motion"]["joints"][joint]["unit"]].get(key[0]):
                raise BadFileError(f"rows: expected one for each quantity of a joint, in its unit, got {key}")
            ends = zip((row[each] for each in ("least", "greatest", "lower", "upper")), (-FAR, FAR, -FAR, FAR))
            rows[key] = str(row["unit"]), joint, *(far if x is None else Fraction(numbers(x)) for x, far in ends)
        forces = [row[1:4] for (quantity, _), row in rows.items() if quantity == "effort"]
        efforts = self.efforts(forces) if forces else {}
        for (quantity, name), (unit, joint, *claim, lower, upper) in rows.items():
            why = efforts[joint] if quantity == "effort" else self.polynomial(quantity, joint, *claim)
            middle = (lower + upper) / 2 if quantity == "position" and -FAR < lower < upper < FAR else 0
            low, high = (WITHIN * (abs(limit - middle) or 1) for limit in (lower, upper))
            if not lower - low <= claim[0] or not claim[1] <= upper + high:
                why = why or "is claimed, which is not within the limits"
            told = ["none" if abs(x) == FAR else f"{float(x):.9g}" for x in (*claim, lower, upper)]
            said = f"{told[0]} to {told[1]} {unit} {why or 'at every instant'}; limits {told[2]} to {told[3]}"
            found.append((f"{quantity} of {name}", not why, said))
        return found + [(str(each["name"]), None, str(each["why"])) for each in self.data["not_checked"]]


def check(content: bytes) -> list[tuple[str, bool | None, str]]:
    """What is proven of the content of a file: names, whether each is proven (None: not checked), and why."""

    def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        if len(dict(pairs)) < len(pairs):
            raise BadFileError(f"a key stands twice among {sorted(key for key, _ in pairs)}")
        return dict(pairs)

    try:
        data = json.loads(content.decode(), object_pairs_hook=unique)
        if not isinstance(data, dict) or (data.get("format"), data.get("version")) != ("trajevo proof", 1):
            raise BadFileError("expected format 'trajevo proof', version 1")
        digest = data.pop("digest", None)
        plain = json.dumps(data, sort_keys=True, separators=(",", ":"), allow_nan=False).encode()
        if digest != f"sha256:{hashlib.sha256(plain).hexdigest()}":
            raise BadFileError("its digest is not that of its content: it was changed after it was written")
        return _Motion(data).check()
    except (LookupError, TypeError, ValueError, AttributeError, ArithmeticError, RecursionError) as error:
        raise error if isinstance(error, BadFileError) else BadFileError(f"{type(error).__name__}: {error}") from None


def main(arguments: list[str]) -> int:
    """Print what is proven of a file, and give the exit code."""
    try:
        with open(arguments[0], "rb") as stream:
            rows = check(stream.read(LARGEST))
    except (BadFileError, OSError, IndexError) as error:
        print(f"bad file: {error!s:.300}")
        return 2
    for name, proven, why in rows:
        print(f"{ {True: 'proven', False: 'NOT PROVEN', None: 'not checked'}[proven] }: {name}: {why}")
    yes, no, left = (sum(x is verdict for _, x, _ in rows) for verdict in (True, False, None))
    print(f"{'NOT PROVEN' if no or not yes else 'PROVEN'}: {yes} of {yes + no} claims; {left} not checked")
    return 1 if no or not yes else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
