"""Check a proof file of a robot's motion: ``python check_proof.py FILE``; it imports nothing but the standard library.

Nothing of how it was made is trusted. Coefficients of Bernstein, without rounding, enclose positions and derivatives on
intervals that are halved until a claim is proven or broken. Efforts are those of Newton and Euler, of quantities that
are polynomials with a bound of all truncation and rounding (``Tube``).
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
from typing import Any

KINDS = *ORDERS, _ = ("position", "velocity", "acceleration", "jerk", "effort")
#: At most: bytes, coefficients in a row, halvings of intervals and of pieces, looks per piece. Coefficients of tubes.
LARGEST, LONGEST, CUTS, DEEPEST, PIECES, TERMS = 2**26, 64, 60, 48, 10, 10
#: Shares: by which limits may be exceeded; of a peak, and of positions over a power of the shortest segment, that are
#: no step at a break; of a peak, up to which a joint is at rest.
WITHIN, STEP, ROUNDED, AT_REST = map(Fraction, (1e-9, 1e-6, 1e-11, 1.001e-9))
#: Rounding of a double; factor and term for the rounding and underflow of error bounds themselves; pi, to 70 digits.
U, UP, TINY = 2.0**-53, 1.0 + 2.0**-30, 1e-290
CROSS = (2, 1), (0, 2), (1, 0)  # each entry of a x b is a[j] b[i] - a[i] b[j]
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


def bernstein(a: list[Any], start: int = 0, width: int = 1) -> tuple[list[int], Any]:
    """Bernstein coefficients of p(start + width u) on [0, 1] in whole numbers, and by what these are divided."""
    n, ratios = len(a) - 1, [x.as_integer_ratio() for x in a]
    divisor, m = math.lcm(*(d for _, d in ratios)), math.lcm(*(math.comb(n, k) for k in range(n + 1)))
    whole = moved([x * (divisor // d) for x, d in ratios], start, width)
    parts = [m // math.comb(n, k) * x for k, x in enumerate(whole)]
    return [sum(math.comb(j, k) * x for k, x in enumerate(parts[: j + 1])) for j in range(n + 1)], divisor * m


class Tube:
    """All functions that differ by at most e from the polynomial of s, |s| <= 1, with TERMS coefficients c."""

    def __init__(self, c: list[Any], e: float) -> None:
        self.c, self.e, self.size = c, e * UP + TINY, sum(map(abs, c))

    def __mul__(self, other: Tube) -> Tube:
        if self is ZERO or other is ZERO:
            return ZERO
        b = other.c[::-1]
        c = [sum(map(mul, self.c, b[TERMS - 1 - k :])) for k in range(TERMS)]
        lost = sum(map(mul, map(abs, self.c[1:]), accumulate(map(abs, b))))
        lost += (TERMS + 4) * U * self.size * other.size  # and rounding
        return Tube(c, self.size * other.e + other.size * self.e + self.e * other.e + lost)

    def keeps(self, low: Fraction, high: Fraction) -> tuple[bool | None, Fraction]:
        """Whether it stays between two numbers, None if it is too wide to tell; with a u = (1 + s) / 2 where not."""
        if not self.e + self.size < math.inf:
            return None, Fraction(1, 2)
        (b, divisor), e = bernstein(self.c, -1, 2), Fraction(self.e)
        kept, u = decide(b, math.ceil((low + e) * divisor), math.floor((high - e) * divisor))
        broken = (kept, u) if kept else decide(b, math.floor((low - e) * divisor), math.ceil((high + e) * divisor))
        return (None, u) if not kept and broken[0] is not False else broken

    def composed(self, first: complex, weight: Any, beyond: Any) -> Tube:
        """The function y of it with k y_k = sum of weight(i, k) c_i y_(k - i) over i from 1 to k, from y_0 = ``first``.

        The same with magnitudes alone is a series without a minus, whose sum after y_0 is ``beyond`` of theirs. What
        has no coefficient, or is due to the width e, is thus at most what they leave. Each is rounded <= 150 times.
        """
        y, most, whole = [first], [abs(first)], beyond((sum(map(abs, self.c[1:])) + self.e) * (1.0 + 32.0 * U))
        for k in range(1, TERMS):
            parts = [(weight(i, k) * self.c[i], k - i) for i in range(1, k + 1)]
            y.append(sum(w * y[j] for w, j in parts))
            most.append(sum(abs(w) * most[j] for w, j in parts))
        return Tube(y, whole - sum(most[1:]) + 2.0**-44 * whole + 4.0 * U * most[0])

    def phase(self) -> Tube:
        """Cosine and sine of an angle as exp(i angle); those of its middle in whole numbers over 2^180."""
        x = round((Fraction(self.c[0]) - round(self.c[0] / (2.0 * math.pi)) * 2 * PI) * 2**180)  # at most about pi
        terms = [*accumulate(range(1, 64), lambda term, k: (term * x >> 180) // k, initial=2**180)]
        c, s = ((sum(terms[k::4]) - sum(terms[k + 2 :: 4])) / 2**180 for k in (0, 1))
        return self.composed(complex(c, s), lambda i, k: 1j * i / k, lambda r: math.expm1(r + 1e-60 * abs(self.c[0])))

    def inverse_root(self) -> Tube:
        """1 / sqrt of it."""
        x, y = self.c[0], 1.0 / math.sqrt(self.c[0])
        return self.composed(y, lambda i, k: (i / k / 2 - 1) / x, lambda r: 1 / math.sqrt(x * (1 - 8 * U) - r) - y)

    def friction(self, ahead: float, behind: float, standing: float) -> Tube:
        """Dry friction at this speed; up to ``standing`` a joint has none."""
        if self is ZERO or ahead == behind == 0.0:
            return ZERO
        rest = Fraction(standing)
        most = -behind if self.keeps(-FAR, -rest)[0] else 0.0 if self.keeps(-FAR, rest)[0] else ahead
        least = ahead if self.keeps(rest, FAR)[0] else 0.0 if self.keeps(-rest, FAR)[0] else -behind
        return dot((most / 2 + least / 2, 1), (ONE, Tube(ZERO.c, most / 2 - least / 2)))


ZERO, ONE = (Tube([x] + [0.0] * (TERMS - 1), 0.0) for x in (0.0, 1.0))  # the object ZERO is exactly 0


def dot(constants: Any, tubes: list[Tube] | tuple[Tube, ...]) -> Tube:
    """The sum of constants times tubes."""
    some = [(k, x) for k, x in zip(constants, tubes, strict=True) if k and x is not ZERO]
    if len(some) == 1 and some[0][0] == 1.0:
        return some[0][1]
    c, e = [0.0] * TERMS, 0.0
    for k, x in some:  # constants may be rounded twice themselves
        c, e = [a + k * b for a, b in zip(c, x.c)], e + abs(k) * (x.e + (len(some) + 4) * U * x.size)
    return Tube(c, e) if some else ZERO


def turned(v: list[Tube], phase: Tube, sign: int) -> list[Tube]:
    """A vector turned about z by an angle whose exp(i angle) is given (sign 1), or back (-1)."""
    both = dot((1, sign * 1j), v[:2]) * phase  # one complex number, x + i y, for two coordinates
    if both is ZERO or phase is ONE:
        return v
    return [Tube([x.real for x in both.c], both.e), Tube([sign * x.imag for x in both.c], both.e), v[2]]


class _Link:
    """A joint with what it moves, in its own axes, of which z is that of the joint."""

    def __init__(self, data: Any, loads: list[Any]) -> None:
        self.parent, self.turns = data["parent"], {True: True, False: False}[data["turns"]]
        self.place, self.offset = numbers(data["rotation"], 3, 3), numbers(data["offset"], 3)
        if any(abs(sum(map(mul, x, y)) - (x is y)) > 1e-9 for x in self.place for y in self.place):
            raise BadFileError("rotation: expected an orthogonal matrix")
        bodies = [numbers(each["body"], 10) for each in (data, *loads)]
        m, x, y, z, xx, xy, yy, xz, yz, zz = [sum(map(Fraction, each)) for each in zip(*bodies)]
        half = (xx + yy + zz) / 2  # half the trace of an inertia less the inertia is the second moment of mass
        moments: Any = [[half - xx, -xy, -xz, x], [-xy, half - yy, -yz, y], [-xz, -yz, half - zz, z], [x, y, z, m]]
        self.moments = [[*map(float, row)] for row in moments]

    def move(self, before: Any, q: Tube, v: Tube, a: Tube, phase: Tube) -> None:
        """Motion of the link from that of the one before, then the force and the moment that its bodies need."""
        *known, motion = before
        known.append([dot([*self.offset, 1.0], row) for row in motion])
        w, d, p = (turned([dot(row, x) for row in zip(*self.place)], phase, -1) for x in known)
        (_, v, a), (self.slid, speed, gain) = ((q, v, a), [ZERO] * 3) if self.turns else ([ZERO] * 3, (q, v, a))
        d = [dot((1, 1), (d[0], w[1] * v)), dot((1, -1), (d[1], w[0] * v)), dot((1, 1), (d[2], a))]
        w = [w[0], w[1], dot((1, 1), (w[2], v))]
        squares, s = [x * x for x in w], [[ZERO] * 3 for _ in w]  # s times a place: acceleration less the origin's
        for k, (i, j) in enumerate(CROSS):
            s[k][k], both = dot((-1, -1), (squares[i], squares[j])), (w[i] * w[j], d[k])
            s[i][j], s[j][i] = dot((1, 1), both), dot((1, -1), both)
        for row, x, k, y in zip(s, p, (2, -2, 1), (w[1] * speed, w[0] * speed, gain)):
            row.append(dot((1, 1, k), (x, row[2] * self.slid, y)))
        self.phase, self.state = phase, (w, d, s)
        self.force, h = [dot(self.moments[3], row) for row in s], self.moments
        self.torque = [dot([*h[j], *(-x for x in h[i])], [*s[i], *s[j]]) for i, j in CROSS]

    def bears(self, links: list[_Link]) -> Tube:
        """The effort of the joint; what is beyond it is handed on to the link before."""
        if self.parent >= 0:
            (x, y, _), (tx, ty, tz), at, before = self.force, self.torque, self.offset, links[self.parent]
            inward = self.force, [dot((1, -1), (tx, self.slid * y)), dot((1, 1), (ty, self.slid * x)), tz]
            f, t = ([dot(row, v) for row in self.place] for v in [turned(x, self.phase, 1) for x in inward])
            pairs = zip(before.torque, t, CROSS)
            before.force = [dot((1, 1), each) for each in zip(before.force, f)]
            before.torque = [dot((1, 1, at[j], -at[i]), (x, y, f[i], f[j])) for x, y, (i, j) in pairs]
        return self.torque[2] if self.turns else self.force[2]


class _Robot:
    """A robot with some loads."""

    def __init__(self, data: Any, loads: list[Any]) -> None:
        if any(not 0 <= load["link"] < len(data["links"]) for load in loads):
            raise BadFileError("loads: expected each on one of the links")
        self.links = [_Link(x, [y for y in loads if y["link"] == k]) for k, x in enumerate(data["links"])]
        n, still, self.screws = len(self.links), [ZERO] * 3, data["screws"]
        matrix = zip(numbers(data["matrix"], n, None), numbers(data["offset"], n))
        self.drives = [[*row, x] for row, x in matrix]  # coordinates of the model, of the actuators' and 1
        if self.screws:  # of two coordinates the mean slides, their difference u swivels by atan(u / span)
            x, y = (self.drives[self.screws[key]] for key in ("slide", "swivel"))
            x[:], y[:] = [(a + b) / 2 for a, b in zip(x, y)], [b - a for a, b in zip(x, y)]
        self.ground = still, still, [[*still, dot([-g], [ONE])] for g in numbers(data["gravity"], 3)]
        keys = ("viscous", "armature", "coulomb", "coulomb_backward", "standing")
        self.own = [*zip(*(numbers(data["friction"][key], len(self.drives[0]) - 1) for key in keys))]
        if min(min(x[2:]) for x in self.own) < 0.0:
            raise BadFileError("friction: expected numbers from 0 on")

    def efforts(self, q: list[Tube], v: list[Tube], a: list[Tube]) -> list[Tube]:
        """Efforts of the actuators."""
        model, speeds, gains = ([dot(row, x) for row in self.drives] for x in ([*q, ONE], [*v, ZERO], [*a, ZERO]))
        phases = [x.phase() if link.turns else ONE for link, x in zip(self.links, model)]
        if self.screws:
            j, span = self.screws["swivel"], self.screws["span"]
            u, du, ddu = model[j], speeds[j], gains[j]
            root = dot((1, span**2), (u * u, ONE)).inverse_root()
            share, phases[j] = dot([span], [root * root]), dot((span, 1j), (ONE, u)) * root
            speeds[j], gains[j] = share * du, dot((1, -2.0 / span), (share * ddu, u * (share * du) * (share * du)))
        for link, *moving in zip(self.links, model, speeds, gains, phases):
            link.move(self.ground if link.parent < 0 else self.links[link.parent].state, *moving)
        torques = [link.bears(self.links) for link in reversed(self.links)][::-1]
        if self.screws:
            torques[j] *= share
        parts = zip(zip(*self.drives), self.own, v, a)
        return [dot([*row, d, m, 1], [*torques, x, y, x.friction(*dry)]) for row, (d, m, *dry), x, y in parts]


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
        self.breaks, joints = [*map(Fraction, numbers(motion["breaks"], None))], range(len(self.names))
        self.durations = [y - x for x, y in pairwise(self.breaks)]
        rows = numbers(motion["coefficients"], len(self.durations), len(joints), None)
        rising = self.breaks[0] == 0 and min(self.durations) > 0 and len({*self.names}) == len(joints)
        if not rising or any(len(x) > LONGEST for row in rows for x in row):
            raise BadFileError("motion: expected breaks that increase from 0, joints of different names, low degrees")
        # By segments and joints powers of shares of time; by orders, joints and segments what bernstein gives.
        self.powers, self.curves = list[Any](), [[list[Any]() for _ in joints] for _ in ORDERS]
        for t, row in zip(self.durations, rows):
            self.powers.append([[Fraction(c) * t**k for k, c in enumerate(x)] for x in row])
            for j, (b, d) in enumerate(map(bernstein, self.powers[-1])):
                for order in self.curves:
                    order[j].append((b, Fraction(d)))
                    b, d = [y - x for x, y in pairwise(b)] or [0], d * t / max(len(b) - 1, 1)
        self.peaks = [[max(max(map(abs, b)) / d for b, d in row) for row in each] for each in self.curves]  # or above

    def states(self, number: int, level: int, place: int) -> Any:
        """Positions, velocities, accelerations of all joints on u = (2 place + 1 + s) / 2^(level + 1), |s| <= 1."""
        half, found = Fraction(1, 2 << level), tuple(list[Tube]() for _ in range(3))
        rate = float(1 / (half * self.durations[number]))
        for a in self.powers[number]:
            c = [float(x) for x in moved(a, (2 * place + 1) * half, half)]
            for tubes in found:
                beyond = 8.0 * U * sum(map(abs, c)) + sum(map(abs, c[TERMS:]))
                tubes.append(Tube((c + ZERO.c)[:TERMS], beyond) if any(c) else ZERO)
                c = [k * x * rate for k, x in enumerate(c)][1:]
        return found

    def told(self, number: int, kept: bool | None, u: Fraction) -> str:
        """That a claim is broken, or not decided, near u in a segment."""
        at = float(self.breaks[number] + u * self.durations[number])
        return f"is claimed, {'perhaps ' if kept is None else ''}wrongly at {at:.6g} s"

    def polynomial(self, order: int, joint: int, low: Any = -FAR, high: Any = FAR) -> str:
        """Why a derivative may leave what is claimed, or is infinite, as the one before steps at a break; or empty."""
        for number, (b, d) in enumerate(self.curves[order][joint]):
            kept, u = decide(b, math.ceil(low * d), math.floor(high * d))
            if not kept:
                return self.told(number, kept, u)
        most = STEP * self.peaks[order - 1][joint] + ROUNDED * max(self.peaks[0]) / min(self.durations) ** (order - 1)
        for at, ((before, m), (after, n)) in zip(self.breaks[1:], pairwise(self.curves[order - 1][joint])):
            if order and abs(after[0] / n - before[-1] / m) > most:
                return f"is claimed, and {ORDERS[order - 1]} steps at {float(at):.6g} s"
        return ""

    def efforts(self, rows: list[tuple[int, Any, Any]]) -> dict[int, str]:
        """For the joints of rows (joint, least, greatest), why their efforts may leave what is claimed."""
        failed, done = {j: self.polynomial(1, j) or self.polynomial(2, j) for j, _, _ in rows}, Fraction(0)
        robots = [_Robot(self.data["robot"], loads) for loads in self.data["robot"]["loads"]]
        if any(rest > AT_REST * (v + q / self.breaks[-1]) for (*_, rest), q, v in zip(robots[0].own, *self.peaks[:2])):
            raise BadFileError("standing: expected no more than rounding of the joints' speeds")
        self.budget = PIECES * (len(self.data["pieces"]) + 10)
        for piece in self.data["pieces"]:
            number, level, first, shares = (piece[key] for key in ("segment", "level", "place", "shares"))
            follows = 0 <= level <= CUTS and 0 <= first < 1 << level and done == number + Fraction(first, 1 << level)
            if not follows or len(shares) != len(rows) or not all(type(x) is int and 0 <= x <= 1000 for x in shares):
                raise BadFileError("pieces: expected all of the motion one after the other, with shares up to 1000")
            todo = [(j, low * share / 1000, high * share / 1000) for (j, low, high), share in zip(rows, shares)]
            self.piece(robots[self.data["carried"][number]], (number, level, first), todo, failed)
            done += Fraction(1, 1 << level)
        if done != len(self.durations) or len(self.data["carried"]) != done:
            raise BadFileError("pieces: they end before the motion does")
        return failed

    def piece(self, robot: _Robot, place: tuple[int, int, int], rows: Any, failed: Any) -> None:
        """Prove what rows claim of a piece, or of its halves, and say of which joints it fails."""
        (number, level, first), todo = place, [row for row in rows if not failed[row[0]]]
        if not todo:
            return
        self.budget -= 1
        efforts, left = list[Tube](), list[Any]()
        with suppress(ArithmeticError, ValueError):  # as if nothing were known
            efforts = robot.efforts(*self.states(*place))
        for j, low, high in todo:
            kept, u = efforts[j].keeps(low, high) if efforts else (None, Fraction(1, 2))
            if kept is None and level < DEEPEST and self.budget > 0:
                left.append((j, low, high))
            elif not kept:
                failed[j] = self.told(number, kept, (first + u) / (1 << level))
        for half in (0, 1):
            self.piece(robot, (number, level + 1, 2 * first + half), left, failed)

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
            why = efforts[joint] if quantity == "effort" else self.polynomial(ORDERS.index(quantity), joint, *claim)
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
