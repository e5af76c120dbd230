"""Rest-to-rest profiles of sines: cycloidal, harmonic, trigonometric, with their peaks in closed form."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

import numpy as np

from trajevo.base.arrays import Array

#: Pieces and degree of the polynomials that stand for a profile: over an eighth of the time those of Taylor differ from
#: it by 4e-16, their jerk by 4e-14 of its peak, which is rounding.
PROFILE_PIECES, PROFILE_DEGREE = 8, 19


@final
@dataclass(frozen=True)
class SinusoidalProfile:
    """A profile s(u) = rate u + middle - Σ amplitude cos(turns 2π u + phase) from 0 to 1 in unit time.

    Attributes:
        cosines: amplitude, whole or half turns, and phase [rad] of each cosine.
        peaks: greatest velocity, acceleration and jerk of s; without the jerk where the acceleration steps at the ends,
            so that the jerk is infinite there.
        rate: factor of u.
        middle: constant.
    """

    cosines: tuple[tuple[float, float, float], ...]
    peaks: tuple[float, ...]
    rate: float = 0.0
    middle: float = 0.5

    def at(self, u: Array, derivative: int) -> Array:
        """A derivative of s at shares u of its time."""
        value = np.zeros_like(u) + (self.rate * u + self.middle if derivative == 0 else self.rate * (derivative == 1))
        for amplitude, turns, phase in self.cosines:
            rate = 2.0 * math.pi * turns
            value -= amplitude * rate**derivative * np.cos(rate * u + phase + 0.5 * math.pi * derivative)
        return np.asarray(value)

    def pieces(self) -> Array:
        """Power coefficients in the share since each piece's beginning, shape (PROFILE_PIECES, PROFILE_DEGREE + 1)."""
        starts = np.arange(PROFILE_PIECES) / PROFILE_PIECES
        return np.stack([self.at(starts, k) / math.factorial(k) for k in range(PROFILE_DEGREE + 1)], axis=1)


#: Profiles by name. Cycloidal: u - sin(2πu)/2π; its jerk steps at both ends. Harmonic: (1 - cos πu)/2; its acceleration
#: steps there. Trigonometric: the trigonometric spline of order 4 (Simon and Isik 1993; Raji 2022, eqs. (7)-(8)) over
#: half a turn from rest to rest, where velocity, acceleration and jerk are 0: 1/2 - (9 cos πu - cos 3πu)/16, with the
#: velocity 3/4 π sin³ πu.
SINUSOIDAL = {
    "cycloidal": SinusoidalProfile(
        cosines=((1.0 / (2.0 * math.pi), 1.0, -0.5 * math.pi),),
        peaks=(2.0, 2.0 * math.pi, 4.0 * math.pi**2),
        rate=1.0,
        middle=0.0,
    ),
    "harmonic": SinusoidalProfile(cosines=((0.5, 0.5, 0.0),), peaks=(0.5 * math.pi, 0.5 * math.pi**2)),
    "trigonometric": SinusoidalProfile(
        cosines=((9.0 / 16.0, 0.5, 0.0), (-1.0 / 16.0, 1.5, 0.0)),
        peaks=(0.75 * math.pi, 0.5 * math.sqrt(3.0) * math.pi**2, 2.25 * math.pi**3),
    ),
}
