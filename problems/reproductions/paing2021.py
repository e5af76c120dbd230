"""Paing, Nshama, Uchiyama 2021: Figures 3 to 12 and 15 made again, and what the trade-off of Figure 8 depends on.

Symbols are the paper's: u(t) parameter of the path in time, F₁ = t_f and F₂ objectives, ω weighting factor.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from trajevo.path.curve import GeometricPath
from trajevo.reproduction.paper import Desk, Item, LeftOut, NumberTable, Paper, PrintedNumber, Shown

from ..gemini_and_s import EXAMPLE_PATHS, gemini_points, s_points
from ..path_settings import at_rest
from ..time_jerk_reparameterisation import PARTITIONS, TimeJerkReparameterisation
from .paing2021_fronts import (
    MM,
    TOLERANCE,
    axis_panels,
    best_factor,
    drawn_paths,
    front,
    front_of,
    front_table,
    limits_of,
    motions,
    runs,
    saved,
    used,
)
from .paing2021_tracking import tracking

#: What every number of the S depends on.
_S = "the paper prints no coordinates of its S: its radius here is chosen to meet the 3.63 s"

#: The paper's own case in Figure 8s.
_USUAL = "16 control points, order 6, least trade-off 0.01"


def s_path(desk: Desk) -> Shown:
    """Figure 3: the S."""
    path = EXAMPLE_PATHS["s"].make()
    figure, table = drawn_paths({"path": path}, s_points(), "via points")
    printed = {"via points": (9, len(s_points())), "control points": (9, len(path.control_points))}
    return Shown(
        numbers=[_count(of, *both) for of, both in (printed | {"order": (6, path.order)}).items()],
        table=table,
        figure=figure,
        said=[f"{_S}. Its points lie on two arcs."],
    )


def gemini_path(desk: Desk) -> Shown:
    """Figure 7: the airfoil, fitted in the sense of least squares."""
    path, points = EXAMPLE_PATHS["gemini"].make(), gemini_points()
    error, book = _errors(path), _errors(GeometricPath.near(points, control_points=12, parameters="chord"))
    figure, table = drawn_paths({"path": path}, points, "points of the UIUC collection", height=30.0)
    of_axes = zip("xy", ("123.34", "8.17"), error, strict=True)
    return Shown(
        numbers=[
            _count("points", 79, len(points)),
            _count("control points", 12, len(path.control_points)),
            PrintedNumber(of="chord", unit="mm", printed="100", ours=float(MM * np.ptp(points[:, 0]))),
            *(
                PrintedNumber(of=f"total squared error, {axis}", unit="mm^2", printed=text, ours=ours)
                for axis, text, ours in of_axes
            ),
        ],
        table=table,
        figure=figure,
        said=[
            "The errors are those of knots by the rule of Piegl and Tiller with its indices counted from 1; counted "
            f"from 0, as in their book, they are {book[0]:.2f} and {book[1]:.2f} mm²."
        ],
    )


def _errors(path: GeometricPath) -> list[float]:
    """Total squared error of a path near the airfoil's points in x and y [mm²]."""
    away = MM * (gemini_points() - path(np.asarray(path.parameters)))
    errors: list[float] = (away**2).sum(axis=0).tolist()
    return errors


def s_front(desk: Desk) -> Shown:
    """Figure 4: time against jerk along the S."""
    found = front(desk, "s")
    best, (_, jerk) = found.utopia(), saved(found)
    settings = TimeJerkReparameterisation(path="s").settings
    return Shown(
        numbers=[
            _count("control points of u(t)", 16, settings["control_points"]),
            _count("order of u(t)", 6, settings["order"]),
            _count("partitions N", 1000, PARTITIONS),
            PrintedNumber(of="least trade-off", unit="1", printed="0.01", ours=found.run.settings["tolerance"]),
            PrintedNumber(of="t_f of the least jerk", unit="s", printed="6", ours=float(found.F[-1, 0])),
            PrintedNumber(of="t_f of the best trade-off", unit="s", printed="3.63", ours=best.F["time"]),
            PrintedNumber(
                of="omega of the best trade-off",
                unit="1",
                printed="0.51",
                ours=best_factor(found),
                within=0.01,
                why=f"33/64 cut off instead of rounded; {_S}",
            ),
            PrintedNumber(of="F2 saved against the least time", unit="%", printed="75", ours=jerk),
            PrintedNumber(
                of="t_f of the best trade-off in t_max",
                unit="%",
                printed="60",
                ours=100.0 * best.F["time"] / settings["longest_time"],
            ),
        ],
        **_drawn_fronts(desk, "s"),
        said=[f"{_S}; the other numbers follow."],
    )


def gemini_front(desk: Desk) -> Shown:
    """Figure 8: time against jerk along the airfoil."""
    found = front(desk, "gemini")
    best, (time, jerk) = found.utopia(), saved(found)
    exact = front(desk, "gemini, true peaks")
    return Shown(
        numbers=[
            PrintedNumber(of="t_f of the least jerk", unit="s", printed="8", ours=float(found.F[-1, 0])),
            PrintedNumber(
                of="t_f of the best trade-off",
                unit="s",
                printed="4.52",
                ours=best.F["time"],
                within=0.01,
                why="cut off instead of rounded",
            ),
            PrintedNumber(of="omega of the best trade-off", unit="1", printed="0.52", ours=best_factor(found)),
            PrintedNumber(of="time saved against the least jerk", unit="%", printed="43", ours=time),
            PrintedNumber(of="F2 saved against the least time", unit="%", printed="81", ours=jerk),
        ],
        **_drawn_fronts(desk, "gemini"),
        said=[
            f"The limits (20)-(25) bound the motion by greatest values of the whole path. With the true peaks instead "
            f"the same 16 control points are there in {exact.F[0, 0]:.4f} s in place of {found.F[0, 0]:.4f} s."
        ],
    )


def _drawn_fronts(desk: Desk, path: str) -> dict[str, Any]:
    """Picture and table of the front under the paper's limits and under those of the true peaks."""
    from trajevo import plots

    named = {"limits (20)-(25)": front(desk, path), "limits of the true peaks": front(desk, f"{path}, true peaks")}
    marks = {"best trade-off, (20)-(25)": front(desk, path).utopia()}
    ax = plots.fronts(named, mark=marks, width="page")
    return {"figure": ax.get_figure(), "table": front_table(named)}


def s_parameter(desk: Desk) -> Shown:
    """Figure 5: u(t) of three runs along the S."""
    from trajevo import plots

    named = runs(front(desk, "s"))
    ax = plots.parameter(named, width="page")
    columns = [np.column_stack(line.get_data()) for line in ax.get_lines()]
    rows = [
        (name, *row) for name, points in zip(named, columns, strict=True) for row in points[::4].astype(float).tolist()
    ]
    return Shown(table=NumberTable(("run", "time [s]", "u [1]"), rows), figure=ax.get_figure(root=True))


def s_limits(desk: Desk) -> Shown:
    """Figure 6: velocity, acceleration and jerk of three runs along the S."""
    return _within_limits(desk, "s")


def gemini_limits(desk: Desk) -> Shown:
    """Figure 9: the same along the airfoil."""
    return _within_limits(desk, "gemini")


def _within_limits(desk: Desk, path: str) -> Shown:
    printed = {"s": ("80", "500", "20000"), "gemini": ("150", "1000", "30000")}[path]
    limits = limits_of(path)
    curves, table = motions(runs(front(desk, path)))
    names = (("velocity", "mm/s"), ("acceleration", "mm/s^2"), ("jerk", "mm/s^3"))
    return Shown(
        numbers=[
            PrintedNumber(of=f"limit of {name}", unit=unit, printed=text, ours=ours)
            for (name, unit), text, ours in zip(names, printed, limits, strict=True)
        ],
        table=table,
        figure=axis_panels(curves, limits)[0].figure,
        said=[f"All limits are kept; of each the three runs use at most {used(curves, limits)}."],
    )


def linear_path(desk: Desk) -> Shown:
    """Figure 10: the path of u = t / t_f must end at rest itself, and so is another one."""
    path = EXAMPLE_PATHS["s"].make()
    other = at_rest(path)
    figure, table = drawn_paths({"proposed": path, "linear reparameterisation": other}, s_points(), "via points")
    return Shown(
        table=table,
        figure=figure,
        said=[
            "How the paper lays the path of the linear reparameterisation is not printed. Here it passes through the "
            f"same points with {len(other.control_points)} control points in place of {len(path.control_points)}, its "
            "first and second derivatives 0 at both ends and its inner knots at the points' parameters."
        ],
    )


#: Why Figure 11 differs.
_BASELINE = "the path of the linear reparameterisation and the coordinates of the S are not printed"


def linear_fronts(desk: Desk) -> Shown:
    """Figure 11: time against jerk of both reparameterisations."""
    from trajevo import plots

    named = {"proposed": front(desk, "s"), "linear reparameterisation": front(desk, "s, linear")}
    ours, theirs = (one.utopia() for one in named.values())
    ax = plots.fronts(named, mark={"best trade-off, proposed": ours, "best trade-off, linear": theirs}, width="page")
    gains = {"faster": ("3", "time"), "less F2": ("75", "jerk")}
    return Shown(
        numbers=[
            PrintedNumber(
                of=f"best trade-off {of} than the linear one",
                unit="%",
                printed=text,
                ours=100.0 * (1.0 - ours.F[name] / theirs.F[name]),
                differs=True,
                why=_BASELINE,
            )
            for of, (text, name) in gains.items()
        ],
        table=front_table(named),
        figure=ax.get_figure(root=True),
        said=["As in the paper, no run of the linear reparameterisation is as good as one of the proposed."],
    )


def linear_motions(desk: Desk) -> Shown:
    """Figure 12: both best trade-offs over time."""
    from trajevo.plots.paper import curve, panels

    named = {"proposed": front(desk, "s").utopia(), "linear reparameterisation": front(desk, "s, linear").utopia()}
    curves, table = motions(named)
    made = axis_panels(curves, limits_of("s"), above=2)
    with panels(made[:2], 2, width="page", height=36.0) as (parameter, integral):
        for number, (name, run) in enumerate(named.items()):
            t, values = curves[name]
            parameter.plot(t, _parameter(run, t), **curve(number))
            square = (values[2] ** 2).sum(axis=1)
            running = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(t) * (square[1:] + square[:-1]))])
            integral.plot(t, running, **curve(number))
        parameter.set_ylabel("parameter u")
        integral.set_ylabel("F2 so far [mm²/s⁵]")
    peaks = [float(np.abs(values[2]).max()) for _, values in curves.values()]
    return Shown(
        table=table,
        figure=made[0].figure,
        said=[
            f"The greatest jerk of an axis is {peaks[0]:.0f} mm/s³ in place of {peaks[1]:.0f} mm/s³. The panel of F2 "
            "so far is not in the paper: it shows where along the run jerk is spent."
        ],
    )


def _parameter(run: Any, t: Any) -> Any:
    """The parameter at some instants of a run; t / t_f where it is linear."""
    course = getattr(run.trajectory, "course", None)
    shares = t / t[-1]
    return shares if course is None else course.parameter(shares[None])[0]


def _varied() -> list[tuple[str, dict[str, int], float]]:
    """Cases of Figure 8s: their names, arguments of the problem, and least trade-offs."""
    cases: list[tuple[str, dict[str, int], float]] = [(f"order {q}", {"order": q}, TOLERANCE) for q in (5, 7)]
    cases += [(f"control points {n}", {"control_points": n}, TOLERANCE) for n in (12, 20)]
    return cases + [(f"least trade-off {least:g}", {}, least) for least in (0.05, 0.02)]


def sensitivity(desk: Desk) -> Shown:
    """Not in the paper: the trade-off of Figure 8 by control points and order of u(t), and by the least trade-off."""
    found = {_USUAL: front(desk, "gemini")}
    for name, given, least in _varied()[: 1 if desk.short else None]:
        found[name] = front_of(desk, name, {"path": "gemini", "limits": "hull"} | given, least)
    headers = (
        "varied",
        "points",
        "least t_f [s]",
        "t_f of the best [s]",
        "omega of the best",
        "F2 of the best [mm^2/s^5]",
    )
    rows = [
        (name, float(len(one)), float(one.F[0, 0]), one.utopia().F["time"], best_factor(one), _jerk(one))
        for name, one in found.items()
    ]
    return Shown(
        table=NumberTable(
            (*headers, "time saved [%]", "F2 saved [%]"), [(*row, *saved(found[str(row[0])])) for row in rows]
        ),
        figure=_sensitivity_figure(found),
        said=[
            "This figure is not in the paper, which has 16 control points, order 6 and a least trade-off of 0.01 only; "
            "F2 of the other cases is exact, where (29) is at most 2e-4 too high. More control points and a higher "
            "order make faster runs possible and move the best trade-off with them. A finer division of omega adds "
            "points between; the best one is the same with 0.02 as with 0.01.",
        ],
    )


def _jerk(found: Any) -> float:
    return MM**2 * float(found.utopia().F["jerk"])


def _sensitivity_figure(found: dict[str, Any]) -> Any:
    """One panel for each thing that is varied, the paper's own case in all of them."""
    from trajevo.plots.paper import curve, key, label, panels

    looks = {name: curve(number) for number, name in enumerate(found)}
    lines: dict[str, Any] = {}
    groups = ("control points", "order", "least trade-off")
    with panels(None, 3, width="page", columns=3, height=55.0) as made:
        for ax, group in zip(made, groups, strict=True):
            for name in (_USUAL, *(name for name in found if name.startswith(group))):
                F, best = found[name].F, found[name].utopia()
                (lines[name],) = ax.plot(F[:, 0], MM**2 * F[:, 1], label=name, **looks[name])
                ax.plot(best.F["time"], MM**2 * best.F["jerk"], "o", color=looks[name]["color"], markersize=3.5)
            ax.set(yscale="log", xlabel="t_f [s]")
            ax.set_title(group, loc="left")
        made[0].set_ylabel(label("F2", "mm^2/s^5"))
        key(made[0], list(lines.values()))
    return made[0].figure


def _count(of: str, printed: int, ours: int) -> PrintedNumber:
    return PrintedNumber(of=of, unit="1", printed=str(printed), ours=float(ours))


PAPER = Paper(
    name="paing2021",
    citation=(
        "M. S. Paing, E. W. Nshama, N. Uchiyama: A Kinematically Constrained Reparameterization Approach to Optimal "
        "Time and Jerk Motion of Industrial Machines, IEEE Access 9, 2021"
    ),
    doi="10.1109/ACCESS.2021.3095847",
    items=(
        Item("figure", "3", "the S", s_path),
        Item("figure", "4", "time against jerk along the S", s_front, searches=True),
        Item("figure", "5", "u(t) of three runs along the S", s_parameter, searches=True),
        Item("figure", "6", "limits of the axes along the S", s_limits),
        Item("figure", "7", "the GEMINI airfoil", gemini_path),
        Item("figure", "8", "time against jerk along the airfoil", gemini_front, searches=True),
        Item("figure", "8s", "what Figure 8 depends on, which the paper does not show", sensitivity, searches=True),
        Item("figure", "9", "limits of the axes along the airfoil", gemini_limits),
        Item("figure", "10", "paths of both reparameterisations", linear_path),
        Item("figure", "11", "time against jerk of both reparameterisations", linear_fronts, searches=True),
        Item("figure", "12", "motions of both reparameterisations", linear_motions, searches=True),
        Item("figure", "15", "tracking errors of both reparameterisations, simulated", tracking, searches=True),
    ),
    left_out=(
        LeftOut("Figure 1", "overview of the method", "a drawing without data"),
        LeftOut("Figure 2", "which coefficients limit what", "a drawing without data"),
        LeftOut("Figure 13", "the feed drive", "a photograph"),
        LeftOut("Figure 14", "measured velocities", "an experiment; Figure 15 is simulated"),
    ),
)
