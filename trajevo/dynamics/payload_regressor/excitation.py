"""How well a motion shows a payload's ten parameters: the condition number of its regressor (Armstrong 1989).

Columns have different units, so they are scaled: to a body whose mass, first moment and inertia are those of a common
payload (Gautier and Khalil 1992), not to columns of length 1. The latter would call a slow motion as good as a fast
one, although the inertia is lost in the noise: over random motions of a UR5 it falls while errors rise.
"""

from __future__ import annotations

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.payload_regressor.regressor import payload_regressor
from trajevo.dynamics.rollout import Rollout
from trajevo.robot.payload import PARAMETERS
from trajevo.robot.robot import Robot

#: Condition number from which on some parameter is not shown at all: squares of more are lost in rounding.
NOT_SHOWN = 1e7

#: Distance of the centre of mass, and radius of gyration, of a common payload [m].
COMMON_SIZE = 0.1

#: Parameters of a body of that size, per kilogram, in the order of :data:`trajevo.robot.payload.PARAMETERS`.
COMMON = np.array([1.0] + 3 * [COMMON_SIZE] + 6 * [COMMON_SIZE**2])
COMMON.setflags(write=False)


def payload_condition(rollout: Rollout) -> Array:
    """Condition number of the regressor of the ten parameters over the motion, scaled to a body of 0.1 m.

    Rows are efforts as shares of the joints' limits, if all joints have one, and count by their share of the time.

    Returns:
        Shape (B,) [1]: from 1 on, and :data:`NOT_SHOWN` where the motion leaves some parameter unseen.
    """
    regressor = payload_regressor(rollout.robot, rollout.q, rollout.v, rollout.a)
    regressor = regressor * (COMMON / row_scales(rollout.robot)[:, None])
    return condition_number(gram(regressor, rollout.quadrature))


def row_scales(robot: Robot) -> Array:
    """What makes efforts of different joints comparable, shape (n_joints,) [N·m or N]: their limits, or 1 without."""
    limits = robot.limits.sides("effort").lesser
    return limits if np.isfinite(limits).all() and (limits > 0.0).all() else np.ones(robot.dof)


def condition_number(products: Array) -> Array:
    """Condition numbers of regressors from the products of their columns, shapes (B, K, K) -> (B,) [1].

    Real or complex; of complex ones eigenvalues follow their first-order change.
    """
    values, vectors = np.linalg.eigh(products.real)
    ends = values[:, [0, -1]].astype(products.dtype)
    if np.iscomplexobj(products):
        along = vectors[:, :, [0, -1]]
        change = (along[:, :, None, :] * products.imag[:, :, :, None] * along[:, None, :, :]).sum(axis=(1, 2))
        ends = ends + 1j * change
    shown = values[:, 0] * NOT_SHOWN**2 > values[:, -1]
    found: Array = np.where(shown, np.sqrt(ends[:, 1] / np.where(shown, ends[:, 0], 1.0)), NOT_SHOWN)
    return found


def gram(regressor: Array, weights: Array) -> Array:
    """Products of the columns of regressors (B, T, n, K), with weights (B, T), summed over all but B: (B, K, K)."""
    count = len(PARAMETERS)
    columns = [np.ascontiguousarray(regressor[..., k]).reshape(len(regressor), -1) for k in range(count)]
    weight = np.repeat(weights, regressor.shape[2], axis=1)
    products = np.empty((len(regressor), count, count), dtype=regressor.dtype)
    for i in range(count):
        weighted = columns[i] * weight
        for j in range(i + 1):
            products[:, i, j] = products[:, j, i] = (weighted * columns[j]).sum(axis=1)
    return products
