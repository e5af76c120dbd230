"""Kinematics and task of the 5-DOF hybrid manipulator in closed form (Guo et al. 2016, 10.1155/2016/1302537).

Symbols are the paper's: q = (X_S1, X_S2, X_S3, φ₄, φ₅) [m, rad], p the tool's origin [m], a its z axis. z₀ points down.
The offset e is 0 as in Table 1, and O₅ is the point that follows the path.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from trajevo.base.arrays import Array, numbers
from trajevo.errors import InvalidInputError, UnreachableError

#: Table 1 [m].
L1, L2, L3, L4, L5, L6, LT, L01 = 0.420, 0.050, 0.450, 0.180, 0.180, 0.080, 0.225, 0.400

#: Tool compensation, eq. (8) [m]; negative with Table 1's numbers.
LP = LT - (L4 + np.sqrt(2.0) * L6)

#: Height of the turret over the third screw, eq. (14) [m].
HEIGHT = L2 + L4 + np.sqrt(2.0) * L5 + L01

#: Via points on the saddle line, eq. (156).
VIA_COUNT = 11


def forward_kinematics(q: Any) -> tuple[Array, Array]:
    """Tool position p, eqs. (12)-(14), and tool axis a, eqs. (16)-(18): q (K, 5) -> (K, 3) [m], (K, 3)."""
    x1, x2, x3, phi4, phi5 = numbers(q, name="q", shape=("K", 5)).T
    alpha = np.arctan((x2 - x1) / L1)
    swing, tilt, lean = alpha + phi4, 0.5 * (np.cos(phi5) - 1.0), np.sin(phi5) / np.sqrt(2.0)
    a = np.stack(
        [
            np.cos(swing) * tilt - np.sin(swing) * lean,
            np.sin(swing) * tilt + np.cos(swing) * lean,
            0.5 * (1.0 + np.cos(phi5)),
        ],
        axis=-1,
    )
    base = np.stack([0.5 * (x1 + x2) + L3 * np.cos(alpha), L3 * np.sin(alpha), x3 + HEIGHT], axis=-1)
    return base + LP * a, a


def inverse_kinematics(position: Any, axis: Any) -> Array:
    """Joint coordinates that put the tool at a position along an axis, eqs. (29)-(32) with the branch φ₅ ≥ 0.

    Eq. (31) prints B₁ = √(1 - A₁²), which mixes a length with a number; √(L₃² - A₁²) is meant.

    Args:
        position: tool positions, shape (K, 3) [m].
        axis: tool axes, shape (K, 3), of any positive length.

    Returns:
        Joint coordinates, shape (K, 5) [m, rad].

    Raises:
        UnreachableError: an axis points up, straight down (φ₄ is then free) or is zero, or a position is too far
            sideways; the message names the via point.
    """
    p = numbers(position, name="position", shape=("K", 3))
    direction = numbers(axis, name="axis", shape=(len(p), 3))
    length = np.linalg.norm(direction, axis=1)
    _refuse(length < 1e-12, p, "its tool axis is zero")
    ax, ay, az = (direction / length[:, None]).T
    _refuse(az < 0.0, p, "its tool axis points up, and the wrist tilts by 90 deg at most")
    _refuse(1.0 - az < 1e-12, p, "its tool axis points straight down, where joint_4 is free")
    nz = -np.sqrt(2.0 * az * (1.0 - az))
    phi5 = np.arctan2(-np.sqrt(2.0) * nz, 2.0 * az - 1.0)
    px, py, pz = p.T
    a1 = py - LP * ay
    _refuse(np.abs(a1) > L3 * np.sin(np.pi / 4.0), p, "link 1 would have to swivel beyond 45 deg")
    alpha = np.arctan2(a1, np.sqrt(np.maximum(L3**2 - a1**2, 0.0)))
    phi4 = np.arctan2(ay * (az - 1.0) + ax * nz, ax * (az - 1.0) - ay * nz) - alpha
    middle, half = px - L3 * np.cos(alpha) - LP * ax, 0.5 * L1 * np.tan(alpha)
    wrapped = np.mod(phi4 + np.pi, 2.0 * np.pi) - np.pi
    return np.stack([middle - half, middle + half, pz - HEIGHT - az * LP, wrapped, phi5], axis=-1)


def saddle_line(eta: Any) -> Array:
    """The desired path, eqs. (155)-(156): parameter η (K,) -> position (K, 3) [m]."""
    parameter = np.asarray(eta, dtype=np.float64)
    x, y = 600.0 + 40.0 * parameter, -150.0 + 30.0 * parameter
    z = (y - 100.0) ** 2 / 20.0**2 - x**2 / 80.0**2 + 1100.0
    return np.stack([x, y, z], axis=-1) / 1000.0


def via_positions() -> Array:
    """The eleven via points of Table 6, shape (11, 3) [m]."""
    return saddle_line(np.arange(VIA_COUNT))


def path_normals(positions: Any) -> Array:
    """Tool axes along a path, shape (K, 3): the path's normal in the vertical plane of its tangent, pointing down.

    The paper's text asks for an o axis along the tangent, which five joints cannot achieve; this rule gives Table 6.
    The tangent is the central difference of the via points, one-sided at the ends.
    """
    points = numbers(positions, name="positions", shape=("K", 3))
    if len(points) < 2:
        raise InvalidInputError(f"positions: expected at least 2 via points, got {len(points)}")
    tx, ty, tz = np.gradient(points, axis=0).T
    level = np.hypot(tx, ty)
    _refuse(level < 1e-12, points, "the path is vertical there, so the tool axis is not defined")
    normal = np.stack([-tz * tx / level, -tz * ty / level, level], axis=-1)
    unit: Array = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    return unit


def tracking_error(positions: Array) -> Array:
    """Distance of tool positions to the saddle line, (K, 3) [m] -> (K,) [m]."""
    eta = np.linspace(-0.5, VIA_COUNT - 0.5, 2001)
    coarse = np.linalg.norm(positions[:, None] - saddle_line(eta)[None], axis=-1).argmin(axis=1)
    parameter = eta[coarse]
    for _ in range(20):  # Newton on the squared distance; the path is a parabola, so a few steps reach rounding
        step = 1e-4
        ahead, here, behind = (saddle_line(parameter + d) for d in (step, 0.0, -step))
        slope, bend = (ahead - behind) / (2.0 * step), (ahead - 2.0 * here + behind) / step**2
        away = here - positions
        parameter = parameter - (away * slope).sum(axis=1) / ((slope**2).sum(axis=1) + (away * bend).sum(axis=1))
    return np.asarray(np.linalg.norm(positions - saddle_line(parameter), axis=1), dtype=np.float64)


def _refuse(bad: Array, points: Array, why: str) -> None:
    if bad.any():
        i = int(np.flatnonzero(bad)[0])
        shown = ", ".join(f"{1000.0 * value:.6g}" for value in points[i])
        raise UnreachableError(f"via point {i} ({shown}) mm cannot be reached: {why}")
