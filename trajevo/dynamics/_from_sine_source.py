"""Cosine and sine as source text: arithmetic without branches that a compiler does for several angles at once."""

from __future__ import annotations

import numpy as np

#: Coefficients of sine and cosine on [-π/4, π/4], lowest power first (minimax polynomials of Sun's fdlibm, 1993), and
#: π/2 in three parts, of which multiples up to 2²⁰ of the first two are exact.
_SINE = (
    -1.66666666666666324348e-01,
    8.33333333332248946124e-03,
    -1.98412698298579493134e-04,
    2.75573137070700676789e-06,
    -2.50507602534068634195e-08,
    1.58969099521155010221e-10,
)
_COSINE = (
    4.16666666666666019037e-02,
    -1.38888888888741095749e-03,
    2.48015872894767294178e-05,
    -2.75573143513906633035e-07,
    2.08757232129817482790e-09,
    -1.13596475577881948265e-11,
)
_QUARTER = (1.57079632673412561417e00, 6.07710050630396597660e-11, 2.02226624879595063154e-21)
#: Angle up to which that holds [rad]; beyond it the library's functions do the work.
GREATEST_ANGLE = 1e5


def cosine_and_sine(row: str) -> list[str]:
    """Lines that replace the angle in ``row, 0, i]`` by its cosine and put its sine into ``row, 1, i]``."""

    def polynomial(coefficients: tuple[float, ...]) -> str:
        result = repr(coefficients[-1])
        for coefficient in coefficients[-2::-1]:
            result = f"({result} * square + {coefficient!r})"
        return result

    rest = "".join(f" - quarters * {part!r}" for part in _QUARTER)
    return [
        f"angle = {row}, 0, i]",
        f"quarters = np.floor(angle * {2.0 / np.pi!r} + 0.5)",
        f"rest = angle{rest}",
        "square = rest * rest",
        f"sine = rest + rest * square * {polynomial(_SINE)}",
        f"cosine = 1.0 - (0.5 * square - square * square * {polynomial(_COSINE)})",
        "quarter = quarters - 4.0 * np.floor(0.25 * quarters)",
        "odd = quarter == 1.0 or quarter == 3.0",
        "near, far = (sine, cosine) if odd else (cosine, sine)",
        f"{row}, 0, i] = -near if quarter == 1.0 or quarter == 2.0 else near",
        f"{row}, 1, i] = -far if quarter >= 2.0 else far",
    ]
