"""Drives of the COPS robot arm: equations of motion of its own, as a constraint on any motion of three joints.

E. D. Dolan, J. J. Moré, T. S. Munson: Benchmarking optimization software with COPS 3.0, Argonne National Laboratory
(2004), problem 8. An arm of length L slides through its pivot by ρ and turns by θ and φ; each drive moves its own
inertia, Coriolis and centrifugal forces are left out, so that no robot of rigid bodies moves like that.
"""

from __future__ import annotations

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.rollout import Rollout
from trajevo.formulation.constraints.constraint import Constraint

#: Length L of the arm, as printed, without a unit.
LENGTH = 5.0

#: Greatest magnitude of each control.
MOST = 1.0


def controls(q: Array, a: Array) -> Array:
    """Controls (L ρ'', I_θ θ'', I_φ φ'') of positions and accelerations of (ρ, θ, φ), each of shape (..., 3)."""
    rho, phi = q[..., 0], q[..., 2]
    inertia = ((LENGTH - rho) ** 3 + rho**3) / 3.0
    return np.stack([LENGTH * a[..., 0], inertia * np.sin(phi) ** 2 * a[..., 1], inertia * a[..., 2]], axis=-1)


def _used(rollout: Rollout) -> Array:
    u = controls(rollout.q, rollout.a)
    used: Array = (u * np.sign(u.real)).max(axis=1) / MOST - 1.0
    return used


def _terms(rollout: Rollout) -> Array:
    """Both signs of every control at every sample, shape (B, samples x 2 x 3)."""
    u = controls(rollout.q, rollout.a) / MOST
    terms: Array = np.stack([u, -u], axis=2).reshape(len(u), -1) - 1.0
    return terms


#: |u| <= 1 of all three drives.
DRIVES = Constraint(("drive of rho", "drive of theta", "drive of phi"), "COPS 3.0, problem 8", _used, _terms)
