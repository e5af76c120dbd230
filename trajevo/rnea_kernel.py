"""Inverse dynamics written out for one kinematic tree and compiled by numba, the optional extra ``fast``.

The recursion of Newton and Euler runs once over names instead of numbers. What comes out are a few hundred assignments
in which only the tree's placements and axes are numbers: masses, gravity and armature are arguments, so that one robot
takes one compilation whatever it carries. Pinocchio stays the reference: a kernel is used only if it gives the same
torques on a thousand random states.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import sys
import warnings
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from trajevo.arrays import Array, usable_threads
from trajevo.files import write_whole
from trajevo.straight_line import StraightLine, Term, Vector, text

#: States on which a kernel must agree with Pinocchio, and to what share of the greatest torque.
_STATES, _AGREES = 1000, 1e-10
#: States whose values lie side by side in memory at a time.
_SIDE_BY_SIDE = 256
#: States that are worth a thread of their own.
_WORTH_A_THREAD = 4096
#: Entries of placements that are rounding of 0 or 1.
_ROUNDING = 1e-15
#: Variables for the rigid body of every joint: mass, mass times centre of mass, inertia about the joint's origin.
_BODY = ("m", "hx", "hy", "hz", "ixx", "ixy", "ixz", "iyy", "iyz", "izz")

#: q, v, a, torque (N, n), bodies (n, 10), gravity (3,), armature (n,): writes the torque.
Kernel = Callable[..., None]


class Inertias(NamedTuple):
    """What a kernel needs of a model besides its tree: bodies (n, 10), gravity (3,), armature (n,)."""

    bodies: Array
    gravity: Array
    armature: Array

    @classmethod
    def of(cls, model: Any) -> Inertias:
        """Those of a model of Pinocchio."""
        bodies = []
        for inertia in list(model.inertias)[1:]:
            mass, lever = float(inertia.mass), np.array(inertia.lever)
            about_origin = np.array(inertia.inertia) + mass * (lever @ lever * np.eye(3) - np.outer(lever, lever))
            bodies.append([mass, *(mass * lever), *about_origin[np.triu_indices(3)]])
        return cls(np.array(bodies), np.array(model.gravity.linear), np.array(model.armature))


class _Joint(NamedTuple):
    """One joint of a tree: number of the one that carries it (0: the base), its place there, and how it moves."""

    parent: int
    rotation: tuple[float, ...]
    origin: tuple[float, ...]
    slides: bool
    axis: tuple[float, ...]


def kernel_of(model: Any) -> Kernel | None:
    """The compiled kernel of a model's tree; None without numba, or for a joint that is not one of ours.

    Warns:
        UserWarning: the kernel was compiled and does not agree with Pinocchio, which is used then.
    """
    tree = _tree(model)
    if tree is None or importlib.util.find_spec("numba") is None:
        return None
    if tree not in _known:
        compiled = _compiled(_source(tree))
        off = _difference(compiled, model)
        _known[tree] = compiled if off <= _AGREES else None
        if _known[tree] is None:
            warnings.warn(
                f"robot {model.name!r}: the compiled inverse dynamics differ from Pinocchio's by {off:.1e} of the "
                "greatest torque and are not used",
                stacklevel=2,
            )
    return _known[tree]


def inverse_dynamics(model: Any, threads: int) -> Callable[[Array, Array, Array, Array], None]:
    """What writes the torques of states q, v, a (N, n), arrays in C order of float64, into the last of four arrays.

    Args:
        model: a model of Pinocchio.
        threads: threads to use; a state's torque does not depend on their number.
    """
    kernel = kernel_of(model)
    if kernel is None:
        pool = pin.ModelPool(model, threads)
        return lambda *states: pin.rneaInParallel(usable_threads(threads), pool, *(x.T for x in states))
    inertias = Inertias.of(model)

    def compiled(*states: Array) -> None:
        shares = min(usable_threads(threads), -(-len(states[0]) // _WORTH_A_THREAD))
        if shares <= 1:
            kernel(*states, *inertias)
            return
        with ThreadPoolExecutor(shares) as pool:
            parts = zip(*(np.array_split(x, shares) for x in states), strict=True)
            for done in [pool.submit(kernel, *part, *inertias) for part in parts]:
                done.result()

    return compiled


#: Kernels of this process, None where one does not agree with Pinocchio.
_known: dict[tuple[_Joint, ...], Kernel | None] = {}


def _difference(compiled: Kernel, model: Any) -> float:
    """Greatest difference from Pinocchio on random states, as a share of the greatest torque."""
    random = np.random.default_rng(0)
    q, v, a = (random.uniform(-3.0, 3.0, (_STATES, model.nv)) for _ in range(3))
    torque, data = np.empty_like(q), model.createData()
    compiled(q, v, a, torque, *Inertias.of(model))
    expected = np.array([pin.rnea(model, data, *state) for state in zip(q, v, a, strict=True)])
    return float(np.abs(torque - expected).max() / max(np.abs(expected).max(), np.finfo(float).tiny))


def _tree(model: Any) -> tuple[_Joint, ...] | None:
    """The joints of a model; None where one neither turns nor slides about or along one axis."""
    joints = []
    for number, joint in enumerate(list(model.joints)[1:], start=1):
        moves = _axis(joint)
        if moves is None or joint.idx_v != number - 1 or joint.nq != 1:
            return None
        place = model.jointPlacements[number]
        rotation, origin = (_rounded(values) for values in (place.rotation, place.translation))
        joints.append(_Joint(model.parents[number], rotation, origin, *moves))
    return tuple(joints)


def _source(tree: tuple[_Joint, ...]) -> str:
    """Source text of a kernel."""
    written, results = StraightLine(), {}
    # A base that accelerates upwards instead of gravity that pulls down.
    states: dict[int, Any] = {0: ([0.0] * 3, [0.0] * 3, [written.subtract(0.0, f"g{k}") for k in "xyz"])}
    places, forces = {}, {}
    for number, joint in enumerate(tree, start=1):
        places[number] = _place(written, joint, number)
        states[number] = _moved(written, states[joint.parent], places[number], joint, number)
        forces[number] = _force(written, states[number], number)
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
    return _function(written, results, tree)


def _axis(joint: Any) -> tuple[bool, tuple[float, ...]] | None:
    """Whether a joint slides, and along or about which axis; None of other kinds."""
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


def _place(written: StraightLine, joint: _Joint, number: int) -> tuple[list[Vector], list[Term]]:
    """Rotation and origin of a joint's frame in its parent's."""
    along, fixed = joint.axis, [joint.rotation[3 * i : 3 * i + 3] for i in range(3)]
    if joint.slides:
        shift = written.product(fixed, written.scaled(f"q{number}", along))
        return list(fixed), written.sum(joint.origin, shift)
    cosine, sine = f"c{number}", f"s{number}"
    versine: Term = 0.0 if max(along) == 1.0 else written.subtract(1.0, cosine)
    own = [[written.multiply(versine, x * y) for y in along] for x in along]
    for i in range(3):
        # An axis along x, y or z has 1 at its own place and the cosine at the others.
        unit = versine == 0.0 and along[i] == 1.0
        own[i][i] = 1.0 if unit else written.add(own[i][i], cosine)
        own[i - 2][i - 1] = written.subtract(own[i - 2][i - 1], written.multiply(along[i], sine))
        own[i - 1][i - 2] = written.add(own[i - 1][i - 2], written.multiply(along[i], sine))
    columns = [written.product(fixed, [row[k] for row in own]) for k in range(3)]
    return [[column[i] for column in columns] for i in range(3)], list(joint.origin)


def _moved(written: StraightLine, state: Any, place: Any, joint: _Joint, number: int) -> tuple[Any, Any, Any]:
    """Angular velocity and acceleration, and acceleration of the origin, of a joint's frame in its own axes."""
    (turning, rate, gain), (rotation, arm) = state, place
    back = [list(column) for column in zip(*rotation, strict=True)]
    whirled = written.cross(turning, written.cross(turning, arm))
    gain = written.product(back, written.sum(gain, written.cross(rate, arm), whirled))
    turning, rate = written.product(back, turning), written.product(back, rate)
    speed, growth = written.scaled(f"v{number}", joint.axis), written.scaled(f"a{number}", joint.axis)
    if joint.slides:
        coriolis = written.scaled(2.0, written.cross(turning, speed))
        return turning, rate, written.sum(gain, coriolis, growth)
    rate = written.sum(rate, written.cross(turning, speed), growth)
    return written.sum(turning, speed), rate, gain


def _force(written: StraightLine, state: Any, number: int) -> tuple[list[Term], list[Term]]:
    """Force and moment about its origin that move the body of a joint."""
    turning, rate, gain = state
    mass, hx, hy, hz, ixx, ixy, ixz, iyy, iyz, izz = (f"{name}{number}" for name in _BODY)
    lever, inertia = [hx, hy, hz], [[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]]
    whirled = written.cross(turning, written.cross(turning, lever))
    force = written.sum(written.scaled(mass, gain), written.cross(rate, lever), whirled)
    spun = written.cross(turning, written.product(inertia, turning))
    return force, written.sum(written.product(inertia, rate), spun, written.cross(lever, gain))


def _function(written: StraightLine, results: dict[int, Term], tree: tuple[_Joint, ...]) -> str:
    """The loops around the assignments: states side by side, so that the compiler handles several at once."""
    joints = range(1, len(tree) + 1)
    lines = ["def kernel(q, v, a, torque, bodies, gravity, armature):"]
    lines += [f"    {name}{i} = bodies[{i - 1}, {k}]" for i in joints for k, name in enumerate(_BODY)]
    lines += [f"    g{name} = gravity[{k}]" for k, name in enumerate("xyz")]
    lines += [f"    armature{i} = armature[{i - 1}]" for i in joints]
    lines += [f"    side = np.empty(({len(tree)}, 5, {_SIDE_BY_SIDE}))"]
    lines += [f"    for begin in range(0, len(q), {_SIDE_BY_SIDE}):"]
    lines += [f"        count = min({_SIDE_BY_SIDE}, len(q) - begin)", "        for i in range(count):"]
    for i, joint in zip(joints, tree, strict=True):
        row, entry = f"side[{i - 1}", f"[begin + i, {i - 1}]"
        position = [f"q{entry}"] if joint.slides else [f"math.cos(q{entry})", f"math.sin(q{entry})"]
        lines += [f"            {row}, {k}, i] = {value}" for k, value in enumerate(position)]
        lines += [f"            {row}, 2, i] = v{entry}", f"            {row}, 3, i] = a{entry}"]
    lines += ["        for i in range(count):"]
    for i, joint in zip(joints, tree, strict=True):
        names = (("q", 0),) if joint.slides else (("c", 0), ("s", 1))
        lines += [f"            {name}{i} = side[{i - 1}, {k}, i]" for name, k in (*names, ("v", 2), ("a", 3))]
    lines += [f"            {line}" for line in written.lines(results.values())]
    lines += [f"            side[{i - 1}, 4, i] = {text(results[i])}" for i in joints]
    lines += ["        for i in range(count):"]
    lines += [f"            torque[begin + i, {i - 1}] = side[{i - 1}, 4, i]" for i in joints]
    return "\n".join(["import math", "", "import numpy as np", "", "", *lines, ""])


def _compiled(source: str) -> Kernel:
    """The kernel of a source text, from numba's cache where it has been compiled before."""
    import numba

    name = f"trajevo_rnea_{hashlib.sha256(source.encode()).hexdigest()[:24]}"
    file = _kept(source, name)
    # numba looks for the module again by its name when it reads what it has kept.
    sys.modules[name] = module = ModuleType(name)
    module.__file__ = str(file or "<kernel>")
    exec(compile(source, module.__file__, "exec"), vars(module))
    # Without reassociation or contraction, so that a state's torque does not depend on its neighbours.
    compiled: Kernel = numba.njit(error_model="numpy", nogil=True, cache=file is not None)(module.kernel)
    return compiled


def _kept(source: str, name: str) -> Path | None:
    """A file that holds the source, beside which numba keeps what it compiled; None where none can be written."""
    base = os.environ.get("XDG_CACHE_HOME", "")
    try:
        folder = (Path(base) if base else Path.home() / ".cache") / "trajevo" / "kernels"
        folder.mkdir(parents=True, exist_ok=True)
        file = folder / f"{name}.py"
        if not file.exists():
            write_whole(file, source.encode())
    except (OSError, RuntimeError):
        return None
    return file
