"""Source text of functions that compute the inverse dynamics of one kinematic tree.

The Newton-Euler recursion runs once over names instead of numbers (:func:`written_out`). The result is a few hundred
assignments in which only the tree's placements and axes are numbers; masses, gravity and armature are arguments.
:func:`source` puts the assignments into loops for numba, :func:`slopes_source` does so with their derivatives, and
:func:`arrays_source` turns them into operations on whole arrays for numpy.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple, final

import numpy as np

from trajevo.dynamics.straight_line import GREATEST_ANGLE, Assignment, StraightLine, Term, Vector, cosine_and_sine, text

#: Number of states whose values are side by side in memory at a time.
_SIDE_BY_SIDE = 256

#: Entries of placements that are this near to 0, 1 or -1 differ from it only by rounding.
_ROUNDING = 1e-15

#: Variables for the rigid body of every joint: mass, mass times centre of mass, inertia about the joint's origin.
_BODY = ("m", "hx", "hy", "hz", "ixx", "ixy", "ixz", "iyy", "iyz", "izz")

#: Variables for a load that acts by its weight alone: mass, mass times centre of mass.
_LOAD = ("load_m", "load_hx", "load_hy", "load_hz")


class Joint(NamedTuple):
    """One joint of a tree: number of its parent joint (0: the base), its placement there, and how it moves."""

    parent: int
    rotation: tuple[float, ...]
    origin: tuple[float, ...]
    slides: bool
    axis: tuple[float, ...]


def tree_of(model: Any) -> tuple[Joint, ...] | None:
    """The joints of a model; None if any of them neither turns about nor slides along a single axis."""
    joints = []
    for number, joint in enumerate(list(model.joints)[1:], start=1):
        moves = _axis(joint)
        if moves is None or joint.idx_v != number - 1 or joint.nq != 1:
            return None
        place = model.jointPlacements[number]
        rotation, origin = (_rounded(values) for values in (place.rotation, place.translation))
        joints.append(Joint(model.parents[number], rotation, origin, *moves))
    return tuple(joints)


def source(tree: tuple[Joint, ...], carrier: int | None) -> str:
    """Source text of a function of states q, v, a (N, n) that writes their torques (N, n).

    Its arguments are q, v, a, torque, bodies (n, 10), gravity (3,), armature (n,) and load (4,).

    Args:
        tree: the joints.
        carrier: number of the joint that carries a load, None for no load. The load acts by its weight alone and is
            given as its mass and mass times centre of mass.
    """
    written, results = written_out(tree, carrier)
    lines = [*head("kernel(q, v, a, torque, bodies, gravity, armature, load)", tree, carrier), _side(tree, 5)]
    lines += [f"    for begin in range(0, len(q), {_SIDE_BY_SIDE}):"]
    lines += [f"        count = min({_SIDE_BY_SIDE}, len(q) - begin)"]
    lines += [f"        {line}" for line in _laid_out(tree, "begin + i, ", "")]
    lines += ["        for i in range(count):"]
    lines += [f"            {line}" for line in _picked_up(tree)]
    lines += [f"            {line}" for line in written.lines(results.values())]
    lines += [f"            side[{i - 1}, 4, i] = {text(results[i])}" for i in results]
    lines += ["        for i in range(count):"]
    lines += [f"            torque[begin + i, {i - 1}] = side[{i - 1}, 4, i]" for i in results]
    return "\n".join([*lines, ""])


def slopes_source(tree: tuple[Joint, ...], carrier: int | None) -> str:
    """Source text of a function of complex states q, v, a (R, T, n): imaginary parts of torques are exact derivatives.

    Rows with equal real parts form consecutive groups; ``begins`` (S + 1,) holds the first row of each group, and R.
    The other arguments are torque (R, T, n), complex, and those of the function of :func:`source`.
    """
    written, results = written_out(tree, carrier)
    moving: dict[Term, Term] = {f"{name}{i}": f"d{name}{i}" for i in results for name in "csqva"}
    written, values, slopes = written.differentiated(moving)
    ends = {i: (values.get(term, term), slopes.get(term, 0.0)) for i, term in results.items()}
    lines = [*head("kernel(q, v, a, begins, torque, bodies, gravity, armature, load)", tree, carrier), _side(tree, 9)]
    lines += ["    for group in range(len(begins) - 1):", "        first = begins[group]"]
    lines += [f"        for begin in range(0, q.shape[1], {_SIDE_BY_SIDE}):"]
    lines += [f"            count = min({_SIDE_BY_SIDE}, q.shape[1] - begin)"]
    lines += [f"            {line}" for line in _laid_out(tree, "first, begin + i, ", ".real")]
    lines += ["            for row in range(first, begins[group + 1]):", "                for i in range(count):"]
    for k, name in enumerate("qva"):
        lines += [
            f"                    side[{i - 1}, {4 + k}, i] = {name}[row, begin + i, {i - 1}].imag" for i in results
        ]
    lines += ["                for i in range(count):"]
    lines += [f"                    {line}" for line in _picked_up(tree)]
    for i, joint in enumerate(tree, start=1):
        names = "qva" if joint.slides else "eva"
        lines += [f"                    d{name}{i} = side[{i - 1}, {4 + k}, i]" for k, name in enumerate(names)]
        if not joint.slides:
            lines += [f"                    dc{i} = -s{i} * de{i}", f"                    ds{i} = c{i} * de{i}"]
    lines += [f"                    {line}" for line in written.lines(term for end in ends.values() for term in end)]
    for i, end in ends.items():
        lines += [f"                    side[{i - 1}, {7 + k}, i] = {text(term)}" for k, term in enumerate(end)]
    lines += ["                for i in range(count):"]
    lines += [
        f"                    torque[row, begin + i, {i - 1}] = complex(side[{i - 1}, 7, i], side[{i - 1}, 8, i])"
        for i in results
    ]
    return "\n".join([*lines, ""])


def written_out(tree: tuple[Joint, ...], carrier: int | None) -> tuple[StraightLine, dict[int, Term]]:
    """The assignments of the recursion, and the torque of every joint by its number."""
    written, results = StraightLine(), dict[int, Term]()
    # The base accelerates upwards, which replaces gravity.
    upwards = [written.subtract(0.0, f"g{k}") for k in "xyz"]
    states: dict[int, Any] = {0: ([0.0] * 3, [0.0] * 3, upwards)}
    places, forces, held = {}, {}, {0: upwards}
    for number, joint in enumerate(tree, start=1):
        places[number] = _place(written, joint, number)
        states[number] = _moved(written, states[joint.parent], places[number], joint, number)
        forces[number] = _force(written, states[number], number)
        held[number] = _back(written, places[number][0], held[joint.parent])
        if number == carrier:
            mass, *lever = _LOAD
            weight = written.scaled(mass, held[number]), written.cross(lever, held[number])
            force, moment = forces[number]
            forces[number] = written.sum(force, weight[0]), written.sum(moment, weight[1])
    for number, joint in reversed(list(enumerate(tree, start=1))):
        force, moment = forces[number]
        torque = written.dot(joint.axis, force if joint.slides else moment)
        results[number] = written.add(torque, written.multiply(f"armature{number}", f"a{number}"))
        if joint.parent:
            rotation, arm = places[number]
            turned = written.product(rotation, force)
            carried = written.sum(written.product(rotation, moment), written.cross(arm, turned))
            onto = forces[joint.parent]
            forces[joint.parent] = written.sum(onto[0], turned), written.sum(onto[1], carried)
    return written, dict(sorted(results.items()))


def _axis(joint: Any) -> tuple[bool, tuple[float, ...]] | None:
    """Whether a joint slides, and along or about which axis; None for other kinds of joints."""
    name = joint.shortname()
    for kind, slides in (("JointModelR", False), ("JointModelP", True)):
        if name in {kind + letter for letter in "XYZ"}:
            return slides, tuple(1.0 if letter == name[-1] else 0.0 for letter in "XYZ")
    if name in ("JointModelRevoluteUnaligned", "JointModelPrismaticUnaligned"):
        return "Prismatic" in name, tuple(float(x) for x in joint.extract().axis)
    return None


def _rounded(values: Any) -> tuple[float, ...]:
    flat = np.ravel(np.asarray(values, dtype=np.float64))
    whole = np.round(flat)
    return tuple(np.where(np.abs(flat - whole) < _ROUNDING, whole, flat).tolist())


def _place(written: StraightLine, joint: Joint, number: int) -> tuple[list[Vector], list[Term]]:
    """Rotation and origin of a joint's frame in its parent's."""
    along, fixed = joint.axis, [joint.rotation[3 * i : 3 * i + 3] for i in range(3)]
    if joint.slides:
        shift = written.product(fixed, written.scaled(f"q{number}", along))
        return list(fixed), written.sum(joint.origin, shift)
    cosine, sine = f"c{number}", f"s{number}"
    versine: Term = 0.0 if max(along) == 1.0 else written.subtract(1.0, cosine)
    own = [[written.multiply(versine, x * y) for y in along] for x in along]
    for i in range(3):
        # For an axis along x, y or z the diagonal is 1 at that axis and the cosine at the others.
        unit = versine == 0.0 and along[i] == 1.0
        own[i][i] = 1.0 if unit else written.add(own[i][i], cosine)
        own[i - 2][i - 1] = written.subtract(own[i - 2][i - 1], written.multiply(along[i], sine))
        own[i - 1][i - 2] = written.add(own[i - 1][i - 2], written.multiply(along[i], sine))
    columns = [written.product(fixed, [row[k] for row in own]) for k in range(3)]
    return [[column[i] for column in columns] for i in range(3)], list(joint.origin)


def _moved(written: StraightLine, state: Any, place: Any, joint: Joint, number: int) -> tuple[Any, Any, Any]:
    """Angular velocity and acceleration, and acceleration of the origin, of a joint's frame in its own axes."""
    (turning, rate, gain), (rotation, arm) = state, place
    whirled = written.cross(turning, written.cross(turning, arm))
    gain = _back(written, rotation, written.sum(gain, written.cross(rate, arm), whirled))
    turning, rate = _back(written, rotation, turning), _back(written, rotation, rate)
    speed, growth = written.scaled(f"v{number}", joint.axis), written.scaled(f"a{number}", joint.axis)
    if joint.slides:
        coriolis = written.scaled(2.0, written.cross(turning, speed))
        return turning, rate, written.sum(gain, coriolis, growth)
    rate = written.sum(rate, written.cross(turning, speed), growth)
    return written.sum(turning, speed), rate, gain


def _back(written: StraightLine, rotation: list[Vector], vector: Vector) -> list[Term]:
    """A vector of the parent's frame, expressed in the joint's frame."""
    return written.product(list(zip(*rotation, strict=True)), vector)


def _force(written: StraightLine, state: Any, number: int) -> tuple[list[Term], list[Term]]:
    """Force, and moment about the joint's origin, that move the body of a joint."""
    turning, rate, gain = state
    mass, hx, hy, hz, ixx, ixy, ixz, iyy, iyz, izz = (f"{name}{number}" for name in _BODY)
    lever, inertia = [hx, hy, hz], [[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]]
    whirled = written.cross(turning, written.cross(turning, lever))
    force = written.sum(written.scaled(mass, gain), written.cross(rate, lever), whirled)
    spun = written.cross(turning, written.product(inertia, turning))
    return force, written.sum(written.product(inertia, rate), spun, written.cross(lever, gain))


def head(signature: str, tree: tuple[Joint, ...], carrier: int | None, *, entry: str = "[{}]") -> list[str]:
    """Lines before the loops: the signature, and a named variable for each entry of the argument arrays."""
    joints = range(1, len(tree) + 1)
    lines = ["import math", "", "import numpy as np", "", "", f"def {signature}:"]
    lines += [f"    {name}{i} = bodies{entry.format(f'{i - 1}, {k}')}" for i in joints for k, name in enumerate(_BODY)]
    lines += [f"    g{name} = gravity{entry.format(k)}" for k, name in enumerate("xyz")]
    lines += [f"    armature{i} = armature{entry.format(i - 1)}" for i in joints]
    lines += [] if carrier is None else [f"    {name} = load{entry.format(k)}" for k, name in enumerate(_LOAD)]
    return lines


def _side(tree: tuple[Joint, ...], rows: int) -> str:
    """Line that allocates memory for states side by side, so that the compiler handles several at once."""
    return f"    side = np.empty(({len(tree)}, {rows}, {_SIDE_BY_SIDE}))"


def _laid_out(tree: tuple[Joint, ...], place: str, part: str) -> list[str]:
    """Lines that put states side by side: position or its cosine and sine, velocity, acceleration."""
    lines = ["for i in range(count):"]
    for i in range(len(tree)):
        lines += [f"    side[{i}, {k}, i] = {name}[{place}{i}]{part}" for k, name in ((0, "q"), (2, "v"), (3, "a"))]
    for i in (i for i, joint in enumerate(tree) if not joint.slides):
        lines += ["for i in range(count):", *(f"    {line}" for line in cosine_and_sine(f"side[{i}"))]
        entry = f"q[{place}{i}]{part}"
        lines += ["for i in range(count):", f"    if abs({entry}) > {GREATEST_ANGLE!r}:"]
        lines += [f"        side[{i}, {k}, i] = math.{name}({entry})" for k, name in enumerate(("cos", "sin"))]
    return lines


def _picked_up(tree: tuple[Joint, ...]) -> list[str]:
    """Lines that read the variables of one state."""
    lines = []
    for i, joint in enumerate(tree, start=1):
        names = (("q", 0),) if joint.slides else (("c", 0), ("s", 1))
        lines += [f"{name}{i} = side[{i - 1}, {k}, i]" for name, k in (*names, ("v", 2), ("a", 3))]
    return lines


#: Number of states in one numpy operation; the real number is between two thirds and one and a half times this.
_STATES = 4096

#: Number of unused entries at the end of every row, so that rows do not begin at the same place of a memory page.
_APART = 8
_OPERATIONS = {"+": "np.add", "-": "np.subtract", "*": "np.multiply"}


def arrays_source(tree: tuple[Joint, ...], carrier: int | None) -> str:
    """Source text of the function of :func:`source` for numpy: every variable is a row with the states of one block.

    Masses and other numbers are zero-dimensional arrays, with which numpy is twice as fast as with Python numbers.
    """
    written, results = written_out(tree, carrier)
    rows = _Rows()
    for i, joint in enumerate(tree, start=1):
        taken = [("q", "np.copyto({}, {})")] if joint.slides else [("c", "np.cos({1}, {0})"), ("s", "np.sin({1}, {0})")]
        for name, call in taken:
            rows.take(f"{name}{i}", call, f"q[part, {i - 1}]")
        for name in "va":
            rows.take(f"{name}{i}", "np.copyto({}, {})", f"{name}[part, {i - 1}]")
    rows.assign(written.assignments(results.values()), results.values())
    lines = head("kernel(q, v, a, torque, bodies, gravity, armature, load)", tree, carrier, entry="[{}, ...]")
    lines += rows.numbers
    lines += [f"    size = max(1, -(-len(q) // max(1, round(len(q) / {_STATES}))))"]
    lines += [f"    room = np.empty(({rows.count}, size + {_APART}))"]
    lines += ["    for begin in range(0, len(q), size):", "        part = slice(begin, min(begin + size, len(q)))"]
    lines += [f"        {', '.join(f'r{k}' for k in range(rows.count))}, = room[:, : part.stop - begin]"]
    lines += [f"        {line}" for line in rows.lines]
    lines += [f"        torque[part, {i - 1}] = {rows.text(term)}" for i, term in results.items()]
    return "\n".join([*lines, ""])


@final
class _Rows:
    """Assignment of variables to rows, which are used again when their variable is no longer needed.

    Attributes:
        lines: source text of the operations on rows.
        numbers: source text that defines what is the same for every state.
        count: number of rows.
    """

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.numbers: list[str] = []
        self.count = 0
        self._free: list[str] = []
        self._where: dict[Term, str] = {}
        self._known: dict[float, str] = {}

    def take(self, name: str, call: str, values: str) -> None:
        """Put values into a new row by a call with the row and the values as arguments."""
        self.lines.append(call.format(self._row(name), values))

    def assign(self, assignments: list[Assignment], results: Iterable[Term]) -> None:
        """Add all assignments; a row is free after the last assignment that needs it."""
        last: dict[Term, int] = {}
        for number, (_, _, *terms) in enumerate(assignments):
            last.update(dict.fromkeys(terms, number))
        last.update(dict.fromkeys(results, len(assignments)))
        for number, (name, operation, *terms) in enumerate(assignments):
            texts = [self.text(term) for term in terms]
            if not any(term in self._where for term in terms):
                self.numbers.append(f"    {name} = np.asarray({f' {operation} '.join(texts)})")
                continue
            self._free += [
                self._where[term] for term in dict.fromkeys(terms) if term in self._where and last[term] == number
            ]
            self.lines.append(f"{_OPERATIONS[operation]}({', '.join([*texts, self._row(name)])})")

    def text(self, term: Term) -> str:
        """A term as it is written in source text."""
        if isinstance(term, str):
            return self._where.get(term, term)
        if term not in self._known:
            self._known[term] = f"number{len(self._known)}"
            self.numbers.append(f"    {self._known[term]} = np.array({term!r})")
        return self._known[term]

    def _row(self, name: str) -> str:
        if not self._free:
            self._free.append(f"r{self.count}")
            self.count += 1
        self._where[name] = self._free.pop()
        return self._where[name]
