"""Guo 2016, slowly: the paper's own recursion, its objectives as loops over the knots, and stored numbers.

Nothing here imports trajevo or problems; all of it is SI.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

GUO2016 = json.loads((Path(__file__).parent / "data" / "guo2016.json").read_text())
TABLE_7 = np.array(GUO2016["table7_h"])

GRAVITY = 9.80665
L1, L2, L3, L4, L5, L6, LT, L01 = 0.420, 0.050, 0.450, 0.180, 0.180, 0.080, 0.225, 0.400
E = 0.0
LP = LT - (L4 + np.sqrt(2.0) * L6 + E)

MASS = GUO2016["table4"]["mass"]
INERTIA = 1e-6 * np.array(GUO2016["table4"]["inertia_kg_mm2"])
COM = 1e-3 * np.array(GUO2016["table4"]["com_mm"], dtype=float)


def actuator_forces(q, v, a, *, payload=0.0, along_tool_axis=False) -> np.ndarray:
    """U = (F₁, F₂, F₃, τ₄, τ₅) of eqs. (42)-(87) for one state; (60) and (67) rotate ω before the product.

    The payload is an external force at the origin of frame 5, eqs. (73)-(76): its weight, which points down (along z₀)
    or, in the conjectured variant, along the tool's z axis.
    """
    x1, x2, x3, phi4, phi5 = q
    u, du, ddu = x2 - x1, v[1] - v[0], a[1] - a[0]
    alpha, denominator = np.arctan(u / L1), L1**2 + u**2
    dalpha = L1 * du / denominator
    ddalpha = L1 * ddu / denominator - 2.0 * L1 * u * du**2 / denominator**2  # (43)
    z, half = np.array([0.0, 0.0, 1.0]), np.sqrt(2.0) / 2.0
    tilted = np.array([0.0, half, half])
    c4, s4, c5, s5 = np.cos(phi4), np.sin(phi4), np.cos(phi5), np.sin(phi5)
    R10 = np.array([[np.cos(alpha), np.sin(alpha), 0.0], [-np.sin(alpha), np.cos(alpha), 0.0], [0.0, 0.0, 1.0]])  # (51)
    R32 = np.array([[s4, -c4, 0.0], [c4 * half, s4 * half, half], [-c4 * half, -s4 * half, half]])  # (65)
    R43 = np.array([[-c5, -s5, 0.0], [s5 * half, -c5 * half, half], [-s5 * half, c5 * half, half]])  # (72)
    P2 = np.array([L3, 0.0, x3 + L01])  # (58)
    P3 = np.array([0.0, 0.0, L2 + L4 + np.sqrt(2.0) * L5])
    P4 = np.array([0.0, 0.0, np.sqrt(2.0) * E])
    P5 = np.array([0.0, 0.0, LP])

    w1 = R10 @ (z * dalpha)  # (42), (44)
    dw1 = R10 @ (z * ddalpha)
    dv1 = R10 @ np.array([(a[0] + a[1]) / 2.0, 0.0, -GRAVITY])
    w2, dw2 = w1, dw1  # (52), (53)
    dv2 = dv1 + _shift(w1, dw1, P2) + 2.0 * np.cross(w2, z * v[2]) + z * a[2]  # (54)
    w3 = R32 @ w2 + tilted * v[3]  # (59)
    dw3 = R32 @ dw2 + np.cross(R32 @ w2, tilted * v[3]) + tilted * a[3]  # (60) corrected
    dv3 = R32 @ (dv2 + _shift(w2, dw2, P3))  # (61)
    w4 = R43 @ w3 + tilted * v[4]  # (66)
    dw4 = R43 @ dw3 + np.cross(R43 @ w3, tilted * v[4]) + tilted * a[4]  # (67) corrected
    dv4 = R43 @ (dv3 + _shift(w3, dw3, P4))  # (68)

    own = [_body(i, *state) for i, state in enumerate([(w1, dw1, dv1), (w2, dw2, dv2), (w3, dw3, dv3), (w4, dw4, dv4)])]
    down = z if along_tool_axis else R43 @ R32 @ R10 @ z
    f5 = -payload * GRAVITY * down
    f4 = f5 + own[3][0]  # (73)
    n4 = own[3][1] + np.cross(P5, f5)  # (74)
    f3 = R43.T @ f4 + own[2][0]  # (77)
    n3 = R43.T @ n4 + own[2][1] + np.cross(P4, R43.T @ f4)  # (78)
    f2 = R32.T @ f3 + own[1][0]  # (80)
    n2 = R32.T @ n3 + own[1][1] + np.cross(P3, R32.T @ f3)  # (81)
    f1 = f2 + own[0][0]  # (83)
    n1 = n2 + own[0][1] + np.cross(P2, f2)  # (84)
    push, turn = (R10.T @ f1)[0] / 2.0, (R10.T @ n1)[2] * np.cos(alpha) ** 2 / L1
    return np.array([push - turn, push + turn, f2[2], tilted @ n3, tilted @ n4])  # (86), (87), (82), (79), (75)


def forces_along(q, v, a, **payload) -> np.ndarray:
    """:func:`actuator_forces` of every row."""
    return np.array([actuator_forces(*row, **payload) for row in zip(q, v, a, strict=True)])


def _shift(w, dw, r):
    return np.cross(dw, r) + np.cross(w, np.cross(w, r))


def _body(i, w, dw, dv):
    """Force at the centre of mass of link i, (48)-(49), and moment about the origin of its frame, (50), (74)."""
    force = MASS[i] * (dv + _shift(w, dw, COM[i]))
    return force, INERTIA[i] @ dw + np.cross(w, INERTIA[i] @ w) + np.cross(COM[i], force)


def objectives(convention: str, h, q, v, a, payload: float) -> list[float]:
    """z₁ to z₄ from the values at the m knots, shapes (m, 5): eq. (154) to the letter, or the variant of a convention.

    The payload is weight only (``as_run``: along the tool axis), so that the paper's own recursion serves throughout.
    """
    h = np.asarray(h)
    m = len(h) + 1
    U = forces_along(q, v, a, payload=payload, along_tool_axis=convention == "as_run")
    z1 = sum(h)
    z2 = z3 = z4 = 0.0
    for i in range(m - 1):
        for end in (i, i + 1):
            if convention == "printed":
                z2 += h[i] / 2.0 * sum((abs(U[end, j]) * abs(v[end, j])) ** 2 for j in range(5))
            elif convention == "as_run":
                z2 += h[i] / 2.0 * sum(abs(U[end, j]) * abs(v[end, j]) for j in range(5)) ** 2
        if convention == "continuous":
            z2 += _gauss_energy(h[i], q[i], v[i], a[i], a[i + 1], payload)
        for j in range(5):
            jerk = (a[i + 1, j] - a[i, j]) / h[i]
            if convention != "printed":
                z3 += h[i] * jerk**2
            elif i < m - 2:
                z3 += h[i] / 2.0 * (jerk**2 + ((a[i + 2, j] - a[i + 1, j]) / h[i + 1]) ** 2)
            if convention == "continuous":
                z4 += h[i] * (a[i, j] ** 2 + a[i, j] * a[i + 1, j] + a[i + 1, j] ** 2) / 3.0
            else:
                z4 += h[i] / 2.0 * (a[i, j] ** 2 + a[i + 1, j] ** 2)
    return [z1, z2, z3, z4]


def _gauss_energy(h, q, v, a, a_end, payload, nodes=16) -> float:
    """∫ Σⱼ (Uⱼ vⱼ)² dt over one interval of a cubic, weight-only payload, by Gauss-Legendre."""
    total = 0.0
    for node, weight in zip(*np.polynomial.legendre.leggauss(nodes), strict=True):
        t = h * (node + 1.0) / 2.0
        jerk = (a_end - a) / h
        now = (q + v * t + a * t**2 / 2.0 + jerk * t**3 / 6.0, v + a * t + jerk * t**2 / 2.0, a + jerk * t)
        total += h / 2.0 * weight * sum((actuator_forces(*now, payload=payload) * now[1]) ** 2)
    return total


def cost(z) -> float:
    """F_c of eq. (112)."""
    return sum(
        w * value / scale for w, value, scale in zip((0.3, 0.3, 0.2, 0.2), z, (1.0, 1e3, 10.0, 1.0), strict=True)
    )


def bisected_capacity(unloaded, per_kilogram, limit, *, high=1e6, steps=60) -> float:
    """Largest mass m with |τ₀ + m τ₁| ≤ limit everywhere, by bisection; 0 where even no payload is feasible."""

    def feasible(mass):
        return bool((np.abs(unloaded + mass * per_kilogram) <= limit).all())

    if not feasible(0.0):
        return 0.0
    low = 0.0
    for _ in range(steps):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if feasible(middle) else (low, middle)
    return low
