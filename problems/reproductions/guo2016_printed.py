"""Tables 6 to 9 of Guo et al. 2016 as they are printed, errata and all, and how to set numbers beside them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from trajevo.base.arrays import Array
from trajevo.reproduction.paper import NumberTable, PrintedNumber

#: i, then X_S1, X_S2, X_S3 [mm], φ₄, φ₅ [rad], and x_d, y_d, z_d [mm].
TABLE_6 = """
1   262.63 142.92 367.10 -1.030  1.028  600     -150     1200
2   264.82 149.16 361.35 -1.0374 1.0253 605.375 -146.070 1194.164
3   279.40 189.61 325.12 -1.082  0.993  640     -120     1157
4   298.23 236.26 288.21 -1.117  0.918  680     -90      1118
5   319.14 284.04 255.31 -1.149  0.838  720     -60      1083
6   341.88 333.02 223.38 -1.179  0.752  760     -30      1052
7   366.21 383.29 201.39 -1.206  0.662  800     0        1025
8   391.95 434.95 180.26 -1.232  0.566  840     30       1002
9   418.93 488.14 162.95 -1.257  0.466  880     60       983
10  447.03 543.04 149.39 -1.280  0.361  920     90       968
11  476.11 599.93 139.50 -1.303  0.252  960     120      957
12  502.37 651.71 134.09 -1.3412 0.2045 993.187 144.873  9.51221
13  507.92 662.77 132.92 -1.350  0.197  1000    150      950
"""

#: h₁ to h₁₂ [s].
TABLE_7 = "0.330 0.837 0.803 0.569 0.477 0.382 0.348 0.348 0.392 0.552 0.732 0.420"

#: i, t_i [s], then joints as in Table 6, and x, y, z [mm].
TABLE_8 = """
1   0     262.63 142.92 367.10 -1.030 1.028  599.974 -149.996 1199.998
2   0.330 263.57 145.35 364.92 -1.033 1.027  602.064 -148.530 1197.757
3   1.167 279.40 189.61 325.12 -1.082 0.993  639.988 -120.009 1156.971
4   1.970 298.23 236.26 288.21 -1.117 0.918  680.018 -89.937  1117.988
5   2.530 319.14 284.04 255.31 -1.149 0.838  719.961 -59.994  1082.990
6   3.016 341.88 333.02 223.38 -1.179 0.752  759.998 -30.042  1052.018
7   3.397 366.21 383.29 201.39 -1.206 0.662  799.999 0.022    1025.016
8   3.745 391.95 434.95 180.26 -1.232 0.566  839.951 30.000   1002.038
9   4.093 418.93 488.14 162.95 -1.257 0.466  879.967 59.997   983.048
10  4.485 447.03 543.04 149.39 -1.280 0.361  919.970 89.985   968.014
11  5.037 476.11 599.93 139.50 -1.303 0.252  959.982 119.989  956.999
12  5.769 505.32 667.51 133.42 -1.346 0.1969 996.812 147.566  950.498
13  6.189 507.92 662.77 132.92 -1.350 0.197  999.993 150.042  949.980
"""

#: F_c and z₁ to z₄ of NSGA-II and, as a mean of 100 runs, of fmincon.
TABLE_9 = {
    "NSGA-II": "3.093 6.189 3921.602 1.068 0.194",
    "fmincon": "3.220 7.146 3250.239 2.510 0.252",
}

#: Joints and coordinates: name -> unit.
JOINTS = {"X_S1": "mm", "X_S2": "mm", "X_S3": "mm", "φ4": "rad", "φ5": "rad"}
PLACES = {"x": "mm", "y": "mm", "z": "mm"}

#: Rows of the two tables that are knots without a via point, from 0, and of the via points.
VIRTUAL, VIA = (1, 11), (0, 2, 3, 4, 5, 6, 7, 8, 9, 10, 12)


def cells_of(table: str) -> list[list[str]]:
    """Rows of a table as printed, without the number of the point."""
    return [line.split()[1:] for line in table.strip().splitlines()]


def beside(
    table: str,
    printed: Sequence[Sequence[str]],
    units: Mapping[str, str],
    ours: Array,
    known: Mapping[tuple[int, str], Mapping[str, Any]],
) -> tuple[list[PrintedNumber], NumberTable]:
    """Every cell of a table beside ours, as printed numbers and as rows.

    Args:
        table: its name.
        printed: its rows as printed.
        units: column -> unit.
        ours: our numbers, shape (rows, columns).
        known: (number of the point, column) -> what is said of a cell, such as why it differs.
    """
    numbers = [
        PrintedNumber(
            of=f"{table}, point {i}, {name}", unit=unit, printed=text, ours=float(value), **known.get((i, name), {})
        )
        for i, (cells, row) in enumerate(zip(printed, ours.tolist(), strict=True), 1)
        for (name, unit), text, value in zip(units.items(), cells, row, strict=True)
    ]
    rows = [
        (one.of.removeprefix(f"{table}, "), one.unit, one.value, value, one.difference)
        for one, value in zip(numbers, ours.ravel().tolist(), strict=True)
    ]
    return numbers, NumberTable(("quantity", "unit", "printed", "ours", "difference"), rows)
