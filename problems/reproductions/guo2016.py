"""Guo et al. 2016: Tables 6 to 9, Figures 6 to 15 and the payload capacity, made again beside what is printed.

Symbols are the paper's: h times, X_S and φ joints, z₁ to z₄ objectives, F_c their weighted sum. Conventions of the
objectives are those of :mod:`trajevo.problems.hybrid_manipulator`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from trajevo.base.arrays import Array
from trajevo.reproduction.paper import Desk, Item, LeftOut, NumberTable, Paper, PrintedNumber, Shown

from ..hybrid_kinematics import forward_kinematics, inverse_kinematics, path_normals, via_positions
from ..hybrid_manipulator import HybridManipulator, cost, paper_solution
from .guo2016_figures import actual_path, cost_by_generation, desired_path, error_along, objectives_by_generation
from .guo2016_motions import SHOWN, descent, knots, optimum, rounding, timed_optimum, times_behind_table_6
from .guo2016_printed import JOINTS, PLACES, TABLE_6, TABLE_7, TABLE_8, TABLE_9, VIA, VIRTUAL, beside, cells_of
from .guo2016_profiles import profile, with_capacity

#: What is said of cells of Tables 6 and 8 that are the same joints at the same via points.
_OF_VIA: dict[tuple[int, str], Mapping[str, Any]] = {
    (3, "X_S3"): {"within": 0.01, "why": "cut off instead of rounded"},
    (6, "X_S3"): {"differs": True, "why": "misprint of 226.38"},
}

#: Points whose place in Table 8 is further off the path than rounded or cut off joints can be.
_OFF = ((4, "y"), (5, "x"), (8, "x"), (8, "z"), (9, "z"), (13, "z"))


def table_6(desk: Desk) -> Shown:
    """Via points in joint space by (29)-(32), and the two knots that Table 6 adds."""
    ours = np.empty((13, 8))
    ours[list(VIA), :5] = _via_joints()
    ours[list(VIA), 5:] = 1e3 * via_positions()
    ours[list(VIRTUAL), :5] = knots(times_behind_table_6()[None])[0, list(VIRTUAL)]
    printed = cells_of(TABLE_6)
    between = np.array([[float(cell) for cell in printed[row][:5]] for row in VIRTUAL]) / SHOWN
    ours[list(VIRTUAL), 5:] = 1e3 * forward_kinematics(between)[0]
    known = _OF_VIA | {(12, "z"): {"differs": True, "why": "misprint of 951.221"}}
    numbers, table = beside("Table 6", printed, JOINTS | PLACES, ours, known)
    return Shown(
        numbers=numbers,
        table=table,
        said=[
            "Points 2 and 12 have no via point: their joints follow from times that the paper does not print. Ours are "
            "those of times found by least squares, so that agreeing says that there are such times, not more. Their "
            "places are those of the joints that are printed beside them."
        ],
    )


def table_7(desk: Desk) -> Shown:
    """The times of the paper beside those at the least F_c of two conventions."""
    least = {name: optimum(desk, name).x for name in ("printed", "continuous")}
    h = TABLE_7.split()
    why = "those at the least F_c, which the paper's search did not reach"
    numbers = [
        PrintedNumber(of=f"h{i}", unit="s", printed=text, ours=float(ours), differs=True, why=why)
        for i, (text, ours) in enumerate(zip(h, least["printed"], strict=True), 1)
    ]
    headers = ("interval", "printed [s]", "least F_c by (154) [s]", "least F_c by (113)-(116) [s]")
    rows = [
        (f"h{i}", float(text), float(a), float(b))
        for i, (text, a, b) in enumerate(zip(h, least["printed"], least["continuous"], strict=True), 1)
    ]
    told = cost(HybridManipulator(convention="printed").evaluate(paper_solution(), return_values_of=["F"]))[0]
    return Shown(
        numbers=numbers,
        table=NumberTable(headers, rows),
        said=[
            f"By (154) the printed times have F_c = {told:.4f}, ours {optimum(desk, 'printed').cost:.4f}. Where a "
            "table or a figure shows the paper's motion, it is that of the printed times."
        ],
    )


def table_8(desk: Desk) -> Shown:
    """Instants, joints and places of the tool at the knots of the motion of Table 7."""
    q = knots(paper_solution())[0]
    q[list(VIA)] = _via_joints()
    at = np.concatenate([[0.0], np.cumsum(paper_solution()[0])])
    ours = np.column_stack([at, q, 1e3 * forward_kinematics(q / SHOWN)[0]])
    known = _OF_VIA | _instants() | _virtual_joints() | _places(q)
    numbers, table = beside("Table 8", cells_of(TABLE_8), {"t": "s"} | JOINTS | PLACES, ours, known)
    return Shown(
        numbers=numbers,
        table=table,
        said=[
            "A spline passes through its via points, so that our places there are those of Table 6 to rounding. The "
            "paper's are up to 0.07 mm off, as places of joints that were rounded before are."
        ],
    )


def _via_joints() -> Array:
    """Joints at the via points, shape (11, 5) [mm, rad]."""
    joints: Array = inverse_kinematics(via_positions(), path_normals(via_positions())) * SHOWN
    return joints


def _instants() -> dict[tuple[int, str], Mapping[str, Any]]:
    """Instants of Table 8 are sums of times that Table 7 rounds to milliseconds."""
    why = "sums of times that are rounded to ms"
    said: dict[tuple[int, str], Mapping[str, Any]] = {
        (i, "t"): {"within": 0.0005 * i, "why": why} for i in range(3, 14)
    }
    return said | {(5, "t"): {"differs": True, "why": "misprint of 2.539, the sum of h1 to h4"}}


def _virtual_joints() -> dict[tuple[int, str], Mapping[str, Any]]:
    """What is said of the two knots without a via point, which depend on the times."""
    moved = rounding(knots)[list(VIRTUAL)]
    said: dict[tuple[int, str], Mapping[str, Any]] = {}
    half = (5e-3, 5e-3, 5e-3, 5e-4, 5e-4)
    for row, by in zip(VIRTUAL, moved.tolist(), strict=True):
        for name, one, digit in zip(JOINTS, by, half, strict=True):
            said[row + 1, name] = {"within": one + digit, "why": "the times of Table 7 are rounded to ms"}
    not_rounding = "more than the rounding of Table 7 explains"
    return said | {
        (2, "X_S1"): {"differs": True, "why": f"probably a misprint of 263.47; {not_rounding}"},
        (2, "X_S2"): {"differs": True, "why": not_rounding},
        (12, "X_S1"): {"differs": True, "why": not_rounding},
        (12, "X_S2"): {"differs": True, "why": "misprint of 657.51"},
        (12, "X_S3"): {"differs": True, "why": not_rounding},
        (12, "φ5"): {"differs": True, "why": "0.1969 is that of the last point, 0.19687"},
    }


def _places(q: Array) -> dict[tuple[int, str], Mapping[str, Any]]:
    """What is said of the places of Table 8: how far joints with the printed digits may be off, to first order."""
    here, reach = forward_kinematics(q / SHOWN)[0], np.zeros((13, 3))
    for joint, digit in enumerate((1e-5, 1e-5, 1e-5, 1e-3, 1e-3)):
        step = digit * np.eye(5)[joint]
        sides = [np.abs(forward_kinematics(q / SHOWN + sign * step)[0] - here) for sign in (1.0, -1.0)]
        reach += 1e3 * np.maximum(*sides)
    said: dict[tuple[int, str], Mapping[str, Any]] = {}
    for i, row in enumerate(reach.tolist(), 1):
        for name, width in zip(PLACES, row, strict=True):
            rounded = {"within": width + 0.0005, "why": "of joints that were rounded or cut off to the printed digits"}
            away = {"differs": True, "why": f"off the path by more than cut off joints can be, {width:.3f} mm"}
            said[i, name] = away if (i, name) in _OFF else rounded
    return said


def table_9(desk: Desk) -> Shown:
    """F_c and objectives: the paper's solution, its mean by gradients, and what is found here."""
    found, alone = descent(desk, "all"), descent(desk, "cost")
    best, seconds = timed_optimum(desk, "printed")
    rows = [
        *((f"Table 7, {name}", *_costed(_at_table_7(name))) for name in ("printed", "continuous", "as_run")),
        ("NSGA-II on z1 to z4, best F_c of all individuals", float(found.held[-1]), *found.objectives[-1].tolist()),
        ("NSGA-II on F_c alone", float(alone.held[-1]), *alone.objectives[-1].tolist()),
        (f"SLSQP, best of {len(best.costs)} random starts", best.cost, *best.F.values()),
    ]
    starts = len(best.costs)
    spread = float(best.costs.max() - best.costs.min())
    return Shown(
        numbers=[
            *_solution_of_the_paper(),
            *_mean_by_gradients(best.cost, best.F),
            *_seconds(found.cpu_seconds, 100.0 / starts * seconds),
        ],
        table=NumberTable(("solution", "F_c", "z1 [s]", "z2 [W^2*s]", "z3", "z4"), rows),
        said=[
            f"SLSQP with exact gradients ends at the same F_c from all of {starts} random starts, within {spread:.1e}: "
            "no local minimum holds it up. NSGA-II does not do better than a gradient method here, on four objectives "
            "nor on F_c alone.",
            "z2, F_c and the capacity of the paper follow from none of its formulas. The convention as_run is a "
            "conjecture that comes near to all three: the payload's weight along the tool, and power summed before it "
            "is squared. z3 and z4 are in (rad or m)²/s⁵ and (rad or m)²/s³.",
        ],
    )


def _at_table_7(convention: str) -> Array:
    F: Array = HybridManipulator(convention=convention).evaluate(paper_solution(), return_values_of=["F"])[0]
    return F


def _costed(F: Array) -> tuple[float, ...]:
    return float(cost(F)), *F.tolist()


def _solution_of_the_paper() -> list[PrintedNumber]:
    """The first row of Table 9 beside the motion of Table 7."""
    total, z1, z2, z3, z4 = TABLE_9["NSGA-II"].split()
    printed, exact = _at_table_7("printed"), _at_table_7("continuous")
    moved = rounding(lambda h: HybridManipulator(convention="continuous").evaluate(h, return_values_of=["F"]))
    ms = "the times of Table 7 are rounded to ms"
    conjecture = f"{_costed(_at_table_7('as_run'))[0]:.4f}"
    unknown = "by (154), with the payload's weight downwards; no printed formula gives the paper's"
    row = "NSGA-II"
    return [
        PrintedNumber(
            of=f"{row}, F_c",
            unit="1",
            printed=total,
            ours=float(cost(printed)),
            differs=True,
            why=f"follows from z2; {conjecture} by the conjecture as_run",
        ),
        PrintedNumber(of=f"{row}, z1", unit="s", printed=z1, ours=float(printed[0]), within=0.0065, why=ms),
        PrintedNumber(of=f"{row}, z2", unit="W^2*s", printed=z2, ours=float(printed[1]), differs=True, why=unknown),
        PrintedNumber(
            of=f"{row}, z3",
            unit="(rad or m)^2/s^5",
            printed=z3,
            ours=float(exact[2]),
            within=float(moved[2]) + 0.0005,
            why=f"(115), not (154), which gives {printed[2]:.3f}; {ms}",
        ),
        PrintedNumber(of=f"{row}, z4", unit="(rad or m)^2/s^3", printed=z4, ours=float(printed[3])),
    ]


def _mean_by_gradients(least: float, F: Mapping[str, float]) -> list[PrintedNumber]:
    """The second row of Table 9 beside the end of SLSQP, which is the same from all starts."""
    units = {"F_c": "1", "z1": "s", "z2": "W^2*s", "z3": "(rad or m)^2/s^5", "z4": "(rad or m)^2/s^3"}
    why = "a mean of 100 runs of fmincon that ended above the least F_c; SLSQP reaches it from every start"
    ours = zip(units.items(), TABLE_9["fmincon"].split(), (least, *F.values()), strict=True)
    return [
        PrintedNumber(of=f"fmincon, {name}", unit=unit, printed=text, ours=float(value), differs=True, why=why)
        for (name, unit), text, value in ours
    ]


def _seconds(evolution: float, gradients: float) -> list[PrintedNumber]:
    """Times of both methods, which are those of a computer: CPU times here."""
    printed = {"NSGA-II, time": ("74.55", evolution), "fmincon, time of 100 runs": ("1032.78", gradients)}
    why = "another computer and another language; CPU time here"
    return [
        PrintedNumber(of=of, unit="s", printed=text, ours=round(ours, 1), differs=True, why=why)
        for of, (text, ours) in printed.items()
    ]


_INPUTS = "an input, not a result: it is what robots/hybrid_manipulator and the problem are made of"
_SKETCH = "a drawing without data"

PAPER = Paper(
    name="guo2016",
    citation=(
        "W. Guo, R. Li, C. Cao, X. Tong, Y. Gao: A New Methodology for Solving Trajectory Planning and Dynamic "
        "Load-Carrying Capacity of a Robot Manipulator, Mathematical Problems in Engineering, 2016"
    ),
    doi="10.1155/2016/1302537",
    items=(
        Item("figure", "6", "desired path and tool axes", desired_path),
        Item("table", "6", "via points in joint space", table_6),
        Item("table", "7", "times", table_7, searches=True),
        Item("table", "8", "joints and places at the knots", table_8),
        Item("figure", "7", "cost function by generation", cost_by_generation, searches=True),
        Item("figure", "8", "objectives by generation", objectives_by_generation, searches=True),
        Item("figure", "9", "displacement of the joints", lambda desk: profile(desk, "displacement")),
        Item("figure", "10", "velocity of the joints", lambda desk: profile(desk, "velocity")),
        Item("figure", "11", "acceleration of the joints", lambda desk: profile(desk, "acceleration")),
        Item("figure", "12", "jerk of the joints", lambda desk: profile(desk, "jerk")),
        Item("figure", "13", "forces and torques, and the payload capacity", with_capacity),
        Item("figure", "14", "actual path of the tool", actual_path),
        Item("figure", "15", "tracking error", error_along),
        Item("table", "9", "NSGA-II and a gradient method", table_9, searches=True),
    ),
    left_out=(
        LeftOut("Figure 1", "the manipulator", _SKETCH),
        LeftOut("Figure 2", "frames and centres of mass", _SKETCH),
        LeftOut("Figure 3", "forces on a link", _SKETCH),
        LeftOut("Figure 4", "external and resultant forces on a link", _SKETCH),
        LeftOut("Figure 5", "forces between screws and link 1", _SKETCH),
        LeftOut("Table 1", "lengths and payload bounds", _INPUTS),
        LeftOut("Table 2", "limits of the joints", _INPUTS),
        LeftOut("Table 3", "Denavit-Hartenberg parameters", _INPUTS),
        LeftOut("Table 4", "masses and inertia", _INPUTS),
        LeftOut(
            "Table 5",
            "pseudo-inertia matrices",
            "contradicts Table 4: it is about the centres of mass, and its row of link 2 repeats numbers of link 1",
        ),
        LeftOut(
            "Appendix C",
            "the 100 results of fmincon",
            "in supplementary files that the paper does not print; their means are in Table 9",
        ),
    ),
)
