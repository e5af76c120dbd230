"""Inverse dynamics of a population: by loops that serve every tree, or by numpy code generated for one tree.

Where compiled loops are ready, :mod:`trajevo.dynamics.rnea_loops` takes placements, axes and masses as arguments, so
that a robot that was never used before needs no compiler. Elsewhere :mod:`trajevo.dynamics.rnea_source` writes the
recursion out for numpy. Pinocchio remains the reference: either is used for a tree only if it gives the same torques on
random states.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from trajevo.base import jit
from trajevo.base.arrays import Array
from trajevo.base.plugins import deferred
from trajevo.base.threads import in_threads, usable_threads
from trajevo.dynamics import rnea_loops
from trajevo.dynamics.rnea_source import arrays_source
from trajevo.dynamics.rnea_tree import Inertias, Joint, Tree, tree_of

if TYPE_CHECKING:
    import pinocchio as pin
else:  # which takes a tenth of the time of importing trajevo
    pin = deferred("pinocchio")

#: Number of states on which inverse dynamics must agree with Pinocchio's, and to what share of the greatest torque.
_STATES, _AGREES = 64, 1e-10
#: Number of groups into which these states are divided for derivatives, and number of directions of each group.
_GROUPS, _EACH = 4, 2
#: Number of states for which one more thread pays off.
_WORTH_A_THREAD = 2**15

#: Writes torques of states into its last argument.
Compute = Callable[..., None]


@dataclass(frozen=True)
class HeldLoad:
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

    def torque(self, compute: Compute, q: Array) -> Array:
        """Torque that holds the load at rest, shape (N, n), by the inverse dynamics of its model."""
        torque, rest = np.empty_like(q), np.zeros_like(q)
        compute(q, rest, rest, torque)
        torque *= self.mass
        return torque


def kernel_of(model: Any, load: HeldLoad | None = None) -> Compute | None:
    """A function that takes states q, v, a (N, n) and an array for their torques.

    It is compiled where compiled loops are used, otherwise it is generated for the model's tree and runs in numpy. None
    if there is a joint of an unsupported kind, a load that needs a pass of its own, or a result that differs from
    Pinocchio's. Loops always need a pass for a load, numpy only if more than one joint carries it.

    Warns:
        UserWarning: the results differ from Pinocchio's, so that Pinocchio has to be used.
    """
    if jit.can_compile():
        return None if load else _compiled(model, rnea_loops.torques, "inverse dynamics", _difference)
    return _of_arrays(model, load)


def slopes_kernel_of(model: Any) -> Compute | None:
    """A compiled function of complex states q, v, a (R, T, n), the starts of groups and an array for the torques.

    None where compiled loops are not used, and in the cases of :func:`kernel_of`.

    Warns:
        UserWarning: the results differ from Pinocchio's, so that Pinocchio has to be used.
    """
    if not jit.can_compile():
        return None
    return _compiled(model, rnea_loops.stepped_torques, "derivatives of inverse dynamics", _difference_of_slopes)


def _compiled(model: Any, loop: Compute, what: str, difference: Callable[[Compute, Any], float]) -> Compute | None:
    """A loop with a model's tree and masses; None for an unsupported joint or if it differs from Pinocchio."""
    joints = tree_of(model)
    if joints is None:
        return None
    tree = Tree.of(joints, Inertias.of(model))

    def compute(*states: Array) -> None:
        loop(*states[:-1], *tree, states[-1])

    return compute if _agrees(what, joints, model, lambda: difference(compute, model)) else None


def _of_arrays(model: Any, load: HeldLoad | None) -> Compute | None:
    """A function generated for numpy, with the masses of a model and a load; None as for :func:`kernel_of`."""
    joints, carrier = tree_of(model), None if load is None else load.carrier
    if joints is None or (carrier is None and load is not None):
        return None
    if (joints, carrier) not in _generated:
        names: dict[str, Any] = {}
        exec(compile(arrays_source(joints, carrier), "<kernel>", "exec"), names)
        _generated[joints, carrier] = names["kernel"]
    kernel = _generated[joints, carrier]
    rest = *Inertias.of(model), np.zeros(4) if load is None or carrier is None else load.body(carrier)

    def compute(*states: Array) -> None:
        kernel(*states, *rest)

    what = "inverse dynamics" if carrier is None else f"inverse dynamics with a load on joint {carrier}"
    return compute if _agrees(f"{what} in numpy", joints, model, lambda: _difference(compute, model, load)) else None


def _agrees(what: str, joints: tuple[Joint, ...], model: Any, difference: Callable[[], float]) -> bool:
    """Whether results of a tree agree with Pinocchio's; compared, and told if they do not, once in a process."""
    if (what, joints) not in _known:
        off = difference()
        _known[what, joints] = off <= _AGREES  # NaN agrees with nothing
        if not _known[what, joints]:
            warnings.warn(
                f"robot {model.name!r}: the {what} differ from Pinocchio's by {off:.1e} of the greatest value and are "
                "not used",
                stacklevel=5,
            )
    return _known[what, joints]


def inverse_dynamics(
    model: Any, load: HeldLoad | None = None, *, threads: int
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
        if shares == 1:
            kernel(*states)
        else:
            in_threads(kernel, zip(*(np.array_split(x, shares) for x in states), strict=True), shares)

    return compute


def _pinocchio(model: Any, threads: int) -> Compute:
    pool = pin.ModelPool(model, threads)
    return lambda *states: pin.rneaInParallel(usable_threads(threads), pool, *(x.T for x in states))


def _two_passes(model: Any, threads: int, load: HeldLoad) -> Compute:
    moving, held = inverse_dynamics(model, threads=threads), inverse_dynamics(load.model, threads=threads)

    def compute(q: Array, v: Array, a: Array, torque: Array) -> None:
        moving(q, v, a, torque)
        torque += load.torque(held, q)

    return compute


def stepped_dynamics(model: Any, load: HeldLoad | None = None) -> Callable[[Array, Array, Array], Array]:
    """A function that returns torques of complex states q, v, a (R, T, n), exact to first order in imaginary parts.

    Consecutive rows with equal real parts share what depends on the real parts.

    Args:
        model: a Pinocchio model.
        load: load that the robot holds in addition.
    """
    if load is not None:
        moving, held, mass = stepped_dynamics(model), stepped_dynamics(load.model), load.mass
        return lambda q, v, a: moving(q, v, a) + mass * held(q, np.zeros_like(q), np.zeros_like(q))
    kernel = slopes_kernel_of(model)
    if kernel is None:
        return lambda *states: _by_pinocchio(model, *states)

    def compute(*states: Array) -> Array:
        states = tuple(np.ascontiguousarray(x, dtype=np.complex128) for x in states)
        torque = np.empty_like(states[0])
        kernel(*states, np.append(np.flatnonzero(_begins(*states)), len(torque)), torque)
        return torque

    return compute


#: Functions of this process that were generated for trees with a load on a joint or without one.
_generated: dict[tuple[tuple[Joint, ...], int | None], Compute] = {}

#: Whether results agree with Pinocchio's: what is computed, for which tree.
_known: dict[tuple[str, tuple[Joint, ...]], bool] = {}


def _difference(compute: Compute, model: Any, load: HeldLoad | None = None) -> float:
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


def _difference_of_slopes(compute: Compute, model: Any) -> float:
    """Greatest difference from Pinocchio of torques and derivatives on random states, as a share of the greatest."""
    random = np.random.default_rng(0)
    shape = (_GROUPS, _EACH, _STATES // _GROUPS, model.nv)
    states = [np.empty(shape, dtype=np.complex128) for _ in range(3)]
    for x in states:
        x.real, x.imag = random.uniform(-3.0, 3.0, (_GROUPS, 1, *shape[2:])), random.uniform(-3.0, 3.0, shape)
    flat = [x.reshape(-1, *shape[2:]) for x in states]
    torque = np.empty_like(flat[0])
    compute(*flat, np.arange(0, len(torque) + 1, _EACH), torque)
    expected = _by_pinocchio(model, *flat)
    parts = ((torque.real, expected.real), (torque.imag, expected.imag))
    return max(float(np.abs(x - y).max() / max(np.abs(y).max(), np.finfo(float).tiny)) for x, y in parts)


def _by_pinocchio(model: Any, q: Array, v: Array, a: Array) -> Array:
    """Torque of complex states (R, T, n) by Pinocchio's own derivatives, one call for every different real state."""
    first, size, data = _begins(q, v, a), q.shape[-1], model.createData()
    states = [x[first].real for x in (q, v, a)]
    torque, slopes = np.empty(states[0].shape), np.empty((*states[0].shape, 3 * size))
    columns = slopes.reshape(-1, size, 3, size).swapaxes(1, 2)
    rows, flat = (x.reshape(-1, size) for x in states), torque.reshape(-1, size)
    for k, state in enumerate(zip(*rows, strict=True)):
        columns[k] = pin.computeRNEADerivatives(model, data, *state)
        flat[k] = data.tau
    which, steps = np.cumsum(first) - 1, np.concatenate([q.imag, v.imag, a.imag], axis=-1)
    result: Array = torque[which] + 1j * (slopes[which] @ steps[..., None])[..., 0]
    return result


def _begins(*states: Array) -> Array:
    """Whether a row differs in its real parts from the one before it, shape (R,); the first one always does."""
    later = [(x.real[1:] != x.real[:-1]).any(axis=(1, 2)) for x in states]
    begins: Array = np.append(np.full(min(1, len(states[0])), True), np.logical_or.reduce(later))
    return begins
