"""Which ten parameters a body can have, and the nearest ones that one has.

A body can have them exactly if its mass is positive and its pseudo-inertia is positive definite (Wensing, Kim and
Slotine 2018): the 4 x 4 matrix [[½ tr(I) 1 - I, m c], [(m c)ᵀ, m]] of I about the tool's origin, which is the second
moment of its density.
"""

from __future__ import annotations

import numpy as np

from trajevo.base.arrays import Array
from trajevo.robot.payload import Payload, entries_of, tensor_of

#: Least eigenvalue of the nearest pseudo-inertia, as a share of the greatest, so that rounding leaves it one.
_INSIDE = 1e-9


def pseudo_inertia(parameters: Array) -> Array:
    """The pseudo-inertia (4, 4) of ten parameters [kg·m², kg·m, kg]."""
    inertia = tensor_of(parameters[4:])
    found = np.empty((4, 4))
    found[:3, :3] = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    found[3, :3] = found[:3, 3] = parameters[1:4]
    found[3, 3] = parameters[0]
    return found


def is_consistent(parameters: Array) -> bool:
    """Whether a body can have ten parameters."""
    return bool(np.isfinite(parameters).all() and np.linalg.eigvalsh(pseudo_inertia(parameters))[0] > 0.0)


def nearest_consistent(parameters: Array, covariance: Array) -> Array:
    """The ten parameters of a body that lie nearest to given ones, by the covariance of these.

    The least of (φ - φ̂)ᵀ Σ⁻¹ (φ - φ̂) over positive semidefinite pseudo-inertias is a convex problem with one solution.
    With the pseudo-inertia L Lᵀ of any square L it has no local minimum besides that one (Burer and Monteiro 2005), so
    that a search for least squares finds it from anywhere.
    """
    from scipy.optimize import least_squares  # takes 0.3 s to import

    scale = np.sqrt(np.diagonal(covariance))
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    whiten = (vectors / np.sqrt(np.maximum(values, 1e-14 * values[-1]))).T / scale
    moments, axes = np.linalg.eigh(pseudo_inertia(parameters))
    start = axes * np.sqrt(np.maximum(moments, 1e-3 * moments[-1]))

    def excess(entries: Array) -> Array:
        away: Array = whiten @ (_parameters(entries.reshape(4, 4)) - parameters)
        return away

    found = least_squares(excess, start.reshape(-1), xtol=1e-14, ftol=1e-14, gtol=1e-14)
    root = found.x.reshape(4, 4)
    own = root @ root.T
    size = np.sqrt(np.diagonal(own))
    return _parameters(np.linalg.cholesky(own + _INSIDE * np.diag(size**2)))


def _parameters(root: Array) -> Array:
    """Ten parameters of the pseudo-inertia L Lᵀ."""
    pseudo = root @ root.T
    inertia = np.trace(pseudo[:3, :3]) * np.eye(3) - pseudo[:3, :3]
    return np.concatenate([pseudo[3:, 3], pseudo[:3, 3], entries_of(inertia)])


def payload_of(parameters: Array) -> Payload:
    """The payload with ten parameters that a body can have."""
    mass = float(parameters[0])
    com = parameters[1:4] / mass
    inertia = tensor_of(parameters[4:]) - mass * (com @ com * np.eye(3) - np.outer(com, com))
    return Payload(mass, tuple(com.tolist()), tuple(map(tuple, inertia.tolist())))
