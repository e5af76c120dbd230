"""Inverse dynamics as code generated for one kinematic tree, for numba (the optional extra ``fast``) or for numpy.

The code comes from a Newton-Euler recursion over names instead of numbers (:mod:`trajevo.dynamics.rnea_source`). Only
the tree's placements and axes are numbers in it. Masses, gravity and armature are arguments, so that a robot needs one
compilation whatever it carries. Pinocchio remains the reference: a kernel is used only if it gives the same torques on
a thousand random states.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from trajevo.base import jit
from trajevo.base.arrays import Array
from trajevo.base.threads import in_threads, usable_threads
from trajevo.dynamics.rnea_source import Joint, arrays_source, slopes_source, source, tree_of

#: Number of states on which a kernel must agree with Pinocchio, and to what share of the greatest torque.
_STATES, _AGREES = 1000, 1e-10
#: Number of groups into which these states are divided for derivatives, and number of directions of each group.
_GROUPS, _EACH = 5, 3
#: Number of states for which one more thread pays off.
_WORTH_A_THREAD = 2**15

#: Key of a kernel: what it computes, for which tree, with a load on which joint, and whether it is compiled.
_What = tuple[str, tuple[Joint, ...], int | None, bool]


class Inertias(NamedTuple):
    """Data of a model that a kernel needs besides the tree: bodies (n, 10), gravity (3,), armature (n,)."""

    bodies: Array
    gravity: Array
    armature: Array

    @classmethod
    def of(cls, model: Any) -> Inertias:
        """The data of a Pinocchio model."""
        bodies = []
        for inertia in list(model.inertias)[1:]:
            mass, lever = float(inertia.mass), np.array(inertia.lever)
            about_origin = np.array(inertia.inertia) + mass * (lever @ lever * np.eye(3) - np.outer(lever, lever))
            bodies.append([mass, *(mass * lever), *about_origin[np.triu_indices(3)]])
        return cls(np.array(bodies), np.array(model.gravity.linear), np.array(model.armature))


@dataclass(frozen=True)
class Load:
    """A load that acts by its weight alone: a mass, and a massless model of the robot that carries 1 kg of it."""

    model: Any
    mass: float

    @property
    def carrier(self) -> int | None:
        """Number of the joint that carries the load; None if it is not exactly one."""
        bearing = np.flatnonzero(Inertias.of(self.model).bodies[:, 0])
        return int(bearing[0]) + 1 if len(bearing) == 1 else None

    def body(self, carrier: int) -> Array:
        """Mass, and mass times centre of mass, of the load, shape (4,)."""
        body: Array = self.mass * Inertias.of(self.model).bodies[carrier - 1, :4]
        return body

    def torque(self, compute: Callable[..., None], q: Array) -> Array:
        """Torque that holds the load at rest, shape (N, n), by the inverse dynamics of its model."""
        torque, rest = np.empty_like(q), np.zeros_like(q)
        compute(q, rest, rest, torque)
        torque *= self.mass
        return torque


def kernel_of(model: Any, load: Load | None = None) -> Callable[..., None] | None:
    """A function generated for a model's tree that takes states q, v, a (N, n) and an array for their torques.

    It is compiled if numba is installed, otherwise it runs in numpy. None if there is a joint of an unsupported kind, a
    load that more than one joint carries, or a result that differs from Pinocchio's.

    Warns:
        UserWarning: the results differ from Pinocchio's, so that Pinocchio has to be used.
    """

    def make(tree: tuple[Joint, ...], carrier: int | None) -> jit.Kernel:
        if jit.can_compile():
            return jit.kernel(source(tree, carrier))
        return jit.interpreted(arrays_source(tree, carrier))

    return _agreeing("inverse dynamics", model, load, make, _difference)


def slopes_kernel_of(model: Any, load: Load | None = None) -> Callable[..., None] | None:
    """A compiled function of complex states q, v, a (R, T, n), the starts of groups and an array for the torques.

    None without numba, and in the cases of :func:`kernel_of`.

    Warns:
        UserWarning: the results differ from Pinocchio's, so that Pinocchio has to be used.
    """

    def make(tree: tuple[Joint, ...], carrier: int | None) -> jit.Kernel:
        return jit.kernel(slopes_source(tree, carrier))

    if not jit.can_compile():
        return None
    return _agreeing("derivatives of inverse dynamics", model, load, make, _difference_of_slopes)


def _agreeing(
    what: str,
    model: Any,
    load: Load | None,
    make: Callable[[tuple[Joint, ...], int | None], jit.Kernel],
    difference: Callable[[Callable[..., None], Any, Load | None], float],
) -> Callable[..., None] | None:
    """A kernel with the inertias of a model and a load, made at first use; None if it differs from Pinocchio."""
    tree, carrier = tree_of(model), None if load is None else load.carrier
    if tree is None or (carrier is None and load is not None):
        return None
    rest = *Inertias.of(model), np.zeros(4) if load is None or carrier is None else load.body(carrier)

    def with_inertias(kernel: jit.Kernel) -> Callable[..., None]:
        return lambda *states: kernel(*states, *rest)

    key = what, tree, carrier, jit.can_compile()
    if key not in _known:
        kernel = make(tree, carrier)
        off = difference(with_inertias(kernel), model, load)
        _known[key] = kernel if off <= _AGREES else None  # NaN agrees with nothing
        if _known[key] is None:
            warnings.warn(
                f"robot {model.name!r}: the generated {what} differ from Pinocchio's by {off:.1e} of the "
                "greatest value and are not used",
                stacklevel=4,
            )
    known = _known[key]
    return None if known is None else with_inertias(known)


def inverse_dynamics(
    model: Any, load: Load | None = None, *, threads: int
) -> Callable[[Array, Array, Array, Array], None]:
    """A function that writes the torques of states q, v, a (N, n) into a fourth array, all of float64 in C order.

    Args:
        model: a Pinocchio model.
        load: load that the robot holds in addition.
        threads: threads to use; a state's torque does not depend on their number.
    """
    kernel = None if jit.avoided() else kernel_of(model, load)
    if kernel is None:
        return _pinocchio(model, threads) if load is None else _two_passes(model, threads, load)

    def compute(*states: Array) -> None:
        shares = max(1, min(usable_threads(threads), -(-len(states[0]) // _WORTH_A_THREAD)))
        in_threads(kernel, zip(*(np.array_split(x, shares) for x in states), strict=True), shares)

    return compute


def _pinocchio(model: Any, threads: int) -> Callable[..., None]:
    pool = pin.ModelPool(model, threads)
    return lambda *states: pin.rneaInParallel(usable_threads(threads), pool, *(x.T for x in states))


def _two_passes(model: Any, threads: int, load: Load) -> Callable[..., None]:
    moving, held = inverse_dynamics(model, threads=threads), inverse_dynamics(load.model, threads=threads)

    def compute(q: Array, v: Array, a: Array, torque: Array) -> None:
        moving(q, v, a, torque)
        torque += load.torque(held, q)

    return compute


def stepped_dynamics(model: Any, load: Load | None = None) -> Callable[[Array, Array, Array], Array]:
    """A function that returns torques of complex states q, v, a (R, T, n), exact to first order in imaginary parts.

    Consecutive rows with equal real parts share what depends on the real parts.

    Args:
        model: a Pinocchio model.
        load: load that the robot holds in addition.
    """
    kernel = slopes_kernel_of(model, load)
    if kernel is None:
        return lambda *states: _by_pinocchio(model, load, *states)

    def compute(*states: Array) -> Array:
        states = tuple(np.ascontiguousarray(x, dtype=np.complex128) for x in states)
        torque = np.empty_like(states[0])
        kernel(*states, np.append(np.flatnonzero(_begins(*states)), len(torque)), torque)
        return torque

    return compute


#: Kernels of this process by key, None for one that does not agree with Pinocchio.
_known: dict[_What, jit.Kernel | None] = {}


def _difference(compute: Callable[..., None], model: Any, load: Load | None) -> float:
    """Greatest difference from Pinocchio on random states, as a share of the greatest torque."""
    random = np.random.default_rng(0)
    states = random.uniform(-3.0, 3.0, (3, _STATES, model.nv))
    torque, expected = np.empty_like(states[0]), np.empty_like(states[0])
    compute(*states, torque)
    by_pinocchio = _pinocchio(model, 1)
    by_pinocchio(*states, expected)
    if load is not None:
        expected += load.torque(_pinocchio(load.model, 1), states[0])
    return float(np.abs(torque - expected).max() / max(np.abs(expected).max(), np.finfo(float).tiny))


def _difference_of_slopes(compute: Callable[..., None], model: Any, load: Load | None) -> float:
    """Greatest difference from Pinocchio of torques and derivatives on random states, as a share of the greatest."""
    random = np.random.default_rng(0)
    shape = (_GROUPS, _EACH, _STATES // _GROUPS, model.nv)
    states = [np.empty(shape, dtype=np.complex128) for _ in range(3)]
    for x in states:
        x.real, x.imag = random.uniform(-3.0, 3.0, (_GROUPS, 1, *shape[2:])), random.uniform(-3.0, 3.0, shape)
    flat = [x.reshape(-1, *shape[2:]) for x in states]
    torque = np.empty_like(flat[0])
    compute(*flat, np.arange(0, len(torque) + 1, _EACH), torque)
    expected = _by_pinocchio(model, load, *flat)
    parts = ((torque.real, expected.real), (torque.imag, expected.imag))
    return max(float(np.abs(x - y).max() / max(np.abs(y).max(), np.finfo(float).tiny)) for x, y in parts)


def _by_pinocchio(model: Any, load: Load | None, q: Array, v: Array, a: Array) -> Array:
    """Torque of complex states (R, T, n) by Pinocchio's own derivatives, one call for every different real state."""
    first, size, data = _begins(q, v, a), q.shape[-1], model.createData()
    states = [x[first].real for x in (q, v, a)]
    torque, slopes = np.empty(states[0].shape), np.empty((*states[0].shape, 3 * size))
    for i in np.ndindex(torque.shape[:2]):
        slopes[i] = np.hstack(pin.computeRNEADerivatives(model, data, *(x[i] for x in states)))
        torque[i] = data.tau
    which, steps = np.cumsum(first) - 1, np.concatenate([q.imag, v.imag, a.imag], axis=-1)
    result: Array = torque[which] + 1j * (slopes[which] @ steps[..., None])[..., 0]
    if load is not None:
        rest = np.zeros_like(q)
        result += load.mass * _by_pinocchio(load.model, None, q, rest, rest)
    return result


def _begins(*states: Array) -> Array:
    """Whether a row differs in its real parts from the one before it, shape (R,); the first one always does."""
    later = [(x.real[1:] != x.real[:-1]).any(axis=(1, 2)) for x in states]
    begins: Array = np.append(np.full(min(1, len(states[0])), True), np.logical_or.reduce(later))
    return begins
