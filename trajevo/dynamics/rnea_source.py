"""Source text of functions that compute the inverse dynamics of one kinematic tree with numpy.

The Newton-Euler recursion runs once over names instead of numbers (:func:`written_out`). The result is a few hundred
assignments in which only the tree's placements and axes are numbers; masses, gravity and armature are arguments.
:func:`arrays_source` turns them into operations on whole arrays.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, final

from trajevo.dynamics.rnea_tree import Joint
from trajevo.dynamics.straight_line import Assignment, StraightLine, Term, Vector

#: Variables for the rigid body of every joint: mass, mass times centre of mass, inertia about the joint's origin.
_BODY = ("m", "hx", "hy", "hz", "ixx", "ixy", "ixz", "iyy", "iyz", "izz")

#: Variables for a load that acts by its weight alone: mass, mass times centre of mass.
_LOAD = ("load_m", "load_hx", "load_hy", "load_hz")


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


def _head(tree: tuple[Joint, ...], carrier: int | None) -> list[str]:
    """Lines before the loop: the signature, and a named variable for each entry of the argument arrays."""
    joints = range(1, len(tree) + 1)
    lines = ["import numpy as np", "", "", "def kernel(q, v, a, torque, bodies, gravity, armature, load):"]
    lines += [f"    {name}{i} = bodies[{i - 1}, {k}, ...]" for i in joints for k, name in enumerate(_BODY)]
    lines += [f"    g{name} = gravity[{k}, ...]" for k, name in enumerate("xyz")]
    lines += [f"    armature{i} = armature[{i - 1}, ...]" for i in joints]
    lines += [] if carrier is None else [f"    {name} = load[{k}, ...]" for k, name in enumerate(_LOAD)]
    return lines


#: Number of states in one numpy operation; the real number is between two thirds and one and a half times this.
_STATES = 4096

#: Number of unused entries at the end of every row, so that rows do not begin at the same place of a memory page.
_APART = 8
_OPERATIONS = {"+": "np.add", "-": "np.subtract", "*": "np.multiply"}


def arrays_source(tree: tuple[Joint, ...], carrier: int | None) -> str:
    """Source text of a function of states q, v, a (N, n) that writes their torques (N, n).

    Its arguments are q, v, a, torque, bodies (n, 10), gravity (3,), armature (n,) and load (4,). Every variable is a
    row with the states of one block. Masses and other numbers are zero-dimensional arrays, with which numpy is twice as
    fast as with Python numbers.

    Args:
        tree: the joints.
        carrier: number of the joint that carries a load, None for no load. The load acts by its weight alone and is
            given as its mass and mass times centre of mass.
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
    lines = _head(tree, carrier)
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
