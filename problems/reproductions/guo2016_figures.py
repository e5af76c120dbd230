"""Figures 6 to 8, 14 and 15 of Guo et al. 2016: paths of the tool, its tracking error, and the search."""

from __future__ import annotations

from typing import Any

import numpy as np

from trajevo.base.arrays import Array
from trajevo.reproduction.paper import Desk, NumberTable, PrintedNumber, Shown

from ..hybrid_kinematics import forward_kinematics, path_normals, saddle_line, tracking_error, via_positions
from ..hybrid_manipulator import HybridManipulator, paper_solution
from .guo2016_motions import Descent, at_table_7, descent, error_statistics, optimum, rounding

#: Length of the arrows of Figure 6 [mm].
_ARROW = 60.0

#: Rows of the tables of curves.
_ROWS = 400


def desired_path(desk: Desk) -> Shown:
    """Figure 6: the saddle line (156), its via points, tangents, and the axes of the tool there."""
    points, line = 1e3 * via_positions(), 1e3 * saddle_line(np.linspace(0.0, 10.0, 101))
    normals = path_normals(via_positions())
    tangents = np.gradient(via_positions(), axis=0)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    ends = zip(
        ("first", "last"), (points[0], points[-1]), (("600", "-150", "1200"), ("1000", "150", "950")), strict=True
    )
    return Shown(
        numbers=[
            PrintedNumber(of=f"{which} point, {name}", unit="mm", printed=text, ours=float(value))
            for which, at, printed in ends
            for name, value, text in zip("xyz", at, printed, strict=True)
        ],
        table=NumberTable(
            ("x [mm]", "y [mm]", "z [mm]", "a_x", "a_y", "a_z"),
            np.column_stack([points, normals]).tolist(),
        ),
        figure=_arrows(line, points, {"tool axis a": normals, "tangent": tangents}),
        said=[
            "The axis z points down. The paper's text lays o along the tangent, which five joints cannot do; the axes "
            "here, the path's normals in its vertical plane, give Table 6."
        ],
    )


def _arrows(line: Array, points: Array, directions: dict[str, Array]) -> Any:
    from trajevo.plots.paper import colour, key, panel

    with panel(None, width="page", height=95.0, space=True) as ax:
        ax.plot(*line.T, color="black", label="desired path")
        ax.plot(*points.T, "o", color=colour(3), linestyle="none", label="via points")
        for k, (name, arrows) in enumerate(directions.items()):
            ax.quiver(*points.T, *arrows.T, length=_ARROW, color=colour(k), linewidth=0.9)
            ax.plot([], [], color=colour(k), label=name)
        _in_millimetres(ax, line)
        key(ax)
    return ax.figure


def _in_millimetres(ax: Any, line: Array) -> None:
    """Labels and one scale of axes in space around a path, shape (K, 3) [mm]; the third axis points down."""
    from trajevo.plots.pareto import clear_space

    centre, reach = 0.5 * (line.max(axis=0) + line.min(axis=0)), 0.6 * np.ptp(line, axis=0).max()
    ax.set(xlabel="x [mm]", ylabel="y [mm]", zlabel="z [mm], down")
    ax.set(**{f"{name}lim": (c - reach, c + reach) for name, c in zip("xyz", centre, strict=True)})
    ax.invert_zaxis()
    clear_space(ax)
    ax.set_box_aspect((1, 1, 1), zoom=0.84)
    ax.view_init(elev=20, azim=-60)
    ax.zaxis.set_tick_params(pad=8.0)
    ax.zaxis.labelpad = 9.0


def actual_path(desk: Desk) -> Shown:
    """Figure 14: where the tool goes at the times of Table 7."""
    from trajevo.plots.paper import curve, key, panel

    sampled = at_table_7().trajectory.sample(_ROWS)
    actual, wanted = 1e3 * forward_kinematics(sampled.q[0])[0], 1e3 * saddle_line(np.linspace(0.0, 10.0, 101))
    with panel(None, width="page", height=95.0, space=True) as ax:
        ax.plot(*actual.T, **curve(0), label="actual, times of Table 7")
        ax.plot(*wanted.T, color="black", linestyle=(0, (1, 2)), linewidth=1.6, label="desired")
        _in_millimetres(ax, wanted)
        key(ax)
    return Shown(
        table=NumberTable(("time [s]", "x [mm]", "y [mm]", "z [mm]"), np.column_stack([sampled.t[0], actual]).tolist()),
        figure=ax.figure,
        said=["The two lie within 0.3 mm of each other, see Figure 15."],
    )


def error_along(desk: Desk) -> Shown:
    """Figure 15: distance of the tool to the desired path, at the times of Table 7 and at the least F_c."""
    from trajevo.plots.paper import curve, key, panel

    found = {"times of Table 7": at_table_7().trajectory, "least F_c by (154)": optimum(desk, "printed").trajectory}
    rows: list[tuple[str | float, ...]] = []
    with panel(None, width="page", height=50.0) as ax:
        for k, (name, trajectory) in enumerate(found.items()):
            sampled = trajectory.sample(_ROWS // 2)
            error = 1e3 * tracking_error(forward_kinematics(sampled.q[0])[0])
            ax.plot(sampled.t[0], error, label=f"{name}: greatest {error.max():.3f} mm", **curve(k))
            rows += [(name, t, one) for t, one in zip(sampled.t[0].tolist(), error.tolist(), strict=True)]
        ax.set(xlabel="time [s]", ylabel="tracking error [mm]")
        ax.set_ylim(bottom=0.0)
        key(ax)
    return Shown(
        numbers=_statistics(),
        table=NumberTable(("motion", "time [s]", "tracking error [mm]"), rows),
        figure=ax.figure,
        said=[
            "The spline runs through its via points, so that the error is that between them. It is greatest in the "
            "second interval, next to the knot without a via point, as the paper says."
        ],
    )


def _statistics() -> list[PrintedNumber]:
    """Standard deviation, variance and greatest value of the error, at evenly spaced instants."""
    ours, moved = error_statistics(paper_solution(), instants=1001)[0], rounding(error_statistics)
    printed = {
        "standard deviation": ("mm", "0.0840"),
        "variance": ("mm^2", "0.0071"),
        "greatest tracking error": ("mm", "0.2933"),
    }
    return [
        PrintedNumber(
            of=name,
            unit=unit,
            printed=text,
            ours=float(value),
            within=float(by) + 0.00005,
            why="the times of Table 7 are rounded to ms",
        )
        for (name, (unit, text)), value, by in zip(printed.items(), ours, moved, strict=True)
    ]


def cost_by_generation(desk: Desk) -> Shown:
    """Figure 7: F_c over the generations of NSGA-II with the paper's settings."""
    from trajevo.plots.paper import LIMIT, colour, curve, key, panel

    four, alone, least = descent(desk, "all"), descent(desk, "cost"), optimum(desk, "printed").cost
    number = np.arange(1, len(four.held) + 1)
    with panel(None, width="page", height=62.0) as ax:
        ax.plot(number, four.of_generation, color=colour(0), linewidth=0.5, label="four objectives, of the generation")
        ax.plot(number, four.held, **curve(0) | {"linewidth": 1.6}, label="four objectives, so far")
        ax.plot(number, alone.held, **curve(1), label="F_c alone, so far")
        ax.axhline(least, color=LIMIT, linestyle=":", linewidth=0.9, label=f"least F_c by gradients, {least:.4f}")
        finite = four.of_generation[np.isfinite(four.of_generation)]
        ax.set(xlabel="generation", ylabel="F_c, eq. (154)", ylim=(least - 0.05, finite.max() + 0.1))
        key(ax)
    rows = np.column_stack([number, four.of_generation, four.held, alone.held]).tolist()
    return Shown(
        numbers=[*_settings(), *_converged(four)],
        table=NumberTable(
            ("generation", "of the generation", "four objectives, so far", "F_c alone, so far"),
            [tuple("none feasible" if np.isinf(cell) else cell for cell in row) for row in rows],
        ),
        figure=ax.figure,
        said=[
            "F_c by (154) with 10 kg. With four objectives NSGA-II spreads over the whole front, so that new "
            "individuals do not come nearer to the least F_c; on F_c alone it does."
        ],
    )


def _settings() -> list[PrintedNumber]:
    """The paper's settings of NSGA-II, which are those of the problem."""
    search = HybridManipulator.evolution
    printed = {
        "population": ("100", search.population),
        "generations": ("200", search.generations),
        "crossover probability": ("0.9", search.crossover_probability),
        "mutation probability": ("0.1", search.mutation_probability),
        "crossover index": ("10", search.crossover_index),
        "mutation index": ("100", search.mutation_index),
    }
    return [
        PrintedNumber(of=name, unit="1", printed=text, ours=float(value or 0.0))
        for name, (text, value) in printed.items()
    ]


def _converged(four: Descent) -> list[PrintedNumber]:
    return [
        PrintedNumber(
            of="generation from which F_c stays",
            unit="1",
            printed="66",
            ours=float(four.best_generation),
            differs=True,
            why="chance: ours depends on the seed, and bounds of the times are not printed",
        ),
        PrintedNumber(
            of="F_c at the end",
            unit="1",
            printed="3.093",
            ours=float(four.held[-1]),
            differs=True,
            why="the paper's z2 follows from none of its formulas; ours is by (154)",
        ),
    ]


def objectives_by_generation(desk: Desk) -> Shown:
    """Figure 8: the objectives of the best F_c so far, and the least of each objective so far."""
    from trajevo.plots.paper import LIMIT, curve, key, label, panels

    found = descent(desk, "all")
    number = np.arange(1, len(found.held) + 1)
    names = (("z1", "s"), ("z2", "W^2*s"), ("z3", "(rad or m)^2/s^5"), ("z4", "(rad or m)^2/s^3"))
    printed = (6.189, 3921.602, 1.068, 0.194)
    with panels(None, 4, width="page", columns=2, height=38.0, share=True) as made:
        for k, (ax, (name, unit)) in enumerate(zip(made, names, strict=True)):
            ax.plot(number, found.objectives[:, k], **curve(0), label="of the least F_c so far")
            ax.plot(number, found.least[:, k], **curve(1), label="least of all individuals so far")
            ax.axhline(printed[k], color=LIMIT, linestyle=":", linewidth=0.9, label="the paper's solution, Table 9")
            ax.set_ylabel(label(name, unit))
        for ax in made[2:]:
            ax.set_xlabel("generation")
        key(made[0])
    headers = (
        "generation",
        *(f"{name} of the least F_c" for name, _ in names),
        *(f"least {name}" for name, _ in names),
    )
    rows = np.column_stack([number, found.objectives, found.least]).tolist()
    return Shown(
        table=NumberTable(headers, [tuple("none" if np.isinf(cell) else cell for cell in row) for row in rows]),
        figure=made[0].figure,
        said=["By (154) with 10 kg, NSGA-II on four objectives; the four least values belong to different motions."],
    )
