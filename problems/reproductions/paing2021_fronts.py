"""Fronts and runs along paths that figures of Paing et al. 2021 share, and their curves."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.units import pretty
from trajevo.front.front import Front, Solution
from trajevo.path.curve import GeometricPath
from trajevo.reproduction.paper import Desk, NumberTable
from trajevo.solvers.gradient.normal_constraint import solve_nnc, weighting_factors
from trajevo.solvers.optimise import optimise

from ..time_jerk_reparameterisation import TimeJerkReparameterisation

#: Problem of each front: the paper's limits (20)-(25) and its quadrature (29), or true peaks and the exact integral.
PROBLEMS: dict[str, dict[str, Any]] = {
    "gemini": {"path": "gemini", "limits": "hull", "quadrature": "trapezoid"},
    "s": {"path": "s", "limits": "hull", "quadrature": "trapezoid"},
    "s, linear": {"path": "s", "interpolant": "linear", "limits": "hull", "quadrature": "trapezoid"},
    "gemini, true peaks": {"path": "gemini", "limits": "tight"},
    "s, true peaks": {"path": "s", "limits": "tight"},
}

#: Least trade-off of divide and conquer, section VI.B, and number of points of a short look.
TOLERANCE, FEW = 0.01, 3

#: Size of a short look at a front under true peaks, by evolution.
SHORT: dict[str, Any] = {"generations": 4, "population": 20}

#: From SI to mm.
MM = 1e3

#: Instants of each curve in a picture, and which of them a table has.
_INSTANTS, _EVERY = 391, 3

#: The three runs of Figures 5, 6 and 9.
RUNS = ("time-optimal", "best trade-off", "jerk-optimal")


def front(desk: Desk, name: str) -> Front:
    """The front of one of :data:`PROBLEMS` by normal constraints, divide and conquer, and SLSQP."""
    return front_of(desk, f"front of {name}", PROBLEMS[name])


def front_of(desk: Desk, what: str, given: Mapping[str, Any], tolerance: float = TOLERANCE) -> Front:
    """The front of a problem with some arguments; in a short look few points, with the exact integral."""
    points = FEW if desk.short else None
    arguments = dict(given) | ({"quadrature": "gauss"} if desk.short else {})
    if desk.short and given.get("limits") == "tight":
        problem = TimeJerkReparameterisation(**arguments)
        return desk.once(what, lambda: optimise(problem, seed=desk.seed, polish=False, progress=False, **SHORT))
    return desk.once(
        what, lambda: solve_nnc(TimeJerkReparameterisation(**arguments), tolerance=tolerance, points=points)
    )


def runs(found: Front) -> dict[str, Solution]:
    """The fastest run, the best trade-off (36), and the run of the least jerk, as :data:`RUNS`."""
    return dict(zip(RUNS, (found[0], found.utopia(), found[-1]), strict=True))


def best_factor(found: Front) -> float:
    """The weighting factor ω* of the best trade-off."""
    return float(weighting_factors(found)[found.utopia().index])


def saved(found: Front) -> tuple[float, float]:
    """Time saved by the best trade-off against the least jerk, and F₂ against the least time [%]."""
    best = found.utopia()
    shares = 1.0 - best.F["time"] / found.F[-1, 0], 1.0 - best.F["jerk"] / found.F[0, 1]
    return 100.0 * float(shares[0]), 100.0 * float(shares[1])


def front_table(found: Mapping[str, Front]) -> NumberTable:
    """Points of fronts, with their weighting factors."""
    rows: list[tuple[str | float, ...]] = []
    for name, one in found.items():
        factors = weighting_factors(one).tolist()
        rows += [(name, w, time, MM**2 * jerk) for w, (time, jerk) in zip(factors, one.F.tolist(), strict=True)]
    return NumberTable(("front", "omega [1]", "F1 [s]", "F2 [mm^2/s^5]"), rows)


def motions(named: Mapping[str, Solution]) -> tuple[dict[str, tuple[Array, Array]], NumberTable]:
    """Velocity, acceleration and jerk of runs in x and y.

    Returns:
        Label -> instants (T,) [s] and values (3, T, 2) [mm/s, mm/s², mm/s³]; and a table of every third instant.
    """
    curves, rows = {}, []
    for name, run in named.items():
        sampled = run.trajectory.sample(_INSTANTS)
        values = MM * np.stack([sampled.v[0], sampled.a[0], sampled.j[0]])
        curves[name] = sampled.t[0], values
        flat = values.transpose(1, 0, 2).reshape(_INSTANTS, -1)
        rows += [(name, *row) for row in np.column_stack([sampled.t[0], flat])[::_EVERY].tolist()]
    units = (("v", "mm/s"), ("a", "mm/s^2"), ("j", "mm/s^3"))
    return curves, NumberTable(
        ("run", "time [s]", *(f"{name}_{axis} [{unit}]" for name, unit in units for axis in "xy")), rows
    )


def limits_of(path: str) -> tuple[float, float, float]:
    """Limits of velocity, acceleration and jerk that both axes have along a path [mm/s, mm/s², mm/s³]."""
    own = TimeJerkReparameterisation(path=path).robot.limits
    return MM * float(own.velocity[0]), MM * float(own.acceleration[0]), MM * float(own.jerk[0])


def used(curves: Mapping[str, tuple[Array, Array]], limits: tuple[float, ...]) -> str:
    """How much of each limit runs use at most, in words."""
    peaks = np.max([np.abs(values).max(axis=(1, 2)) for _, values in curves.values()], axis=0)
    shares = (f"{100.0 * share:.3g} % of that of {name}" for share, name in zip(peaks / limits, _NAMES, strict=True))
    return ", ".join(shares)


_NAMES = ("velocity", "acceleration", "jerk")


def axis_panels(curves: Mapping[str, tuple[Array, Array]], limits: tuple[float, ...], above: int = 0) -> Any:
    """Panels of velocity, acceleration and jerk, x on the left and y on the right, below ``above`` empty ones."""
    from trajevo.plots.motion import draw_limits
    from trajevo.plots.paper import curve, key, label, panels

    units = ("mm/s", "mm/s^2", "mm/s^3")
    with panels(None, 6 + above, width="page", columns=2, height=36.0, share=True) as made:
        for k, ax in enumerate(made[above:]):
            order, axis = divmod(k, 2)
            for number, (name, (t, values)) in enumerate(curves.items()):
                ax.plot(t, values[order, :, axis], label=name, **curve(number))
            drawn = np.concatenate([values[order, :, axis] for _, values in curves.values()])[:, None]
            bound = np.array([limits[order]])
            draw_limits(ax, drawn, -bound, bound, pretty(units[order]))
            ax.set_ylabel(label(f"{_NAMES[order]}, {'xy'[axis]}", units[order]))
        for ax in made[-2:]:
            ax.set_xlabel("time [s]")
        key(made[0], made[above].get_lines()[: len(curves)])
    return made


def drawn_paths(
    paths: Mapping[str, GeometricPath], points: Array, name: str, *, height: float = 75.0
) -> tuple[Any, NumberTable]:
    """Paths in the plane with the points they pass or are near to, and their places as a table.

    Args:
        paths: label -> path.
        points: the points, shape (K, 2) [m].
        name: what the points are.
        height: height of the picture [mm].
    """
    from trajevo.plots.paper import curve, key, panel

    u = np.linspace(0.0, 1.0, 400 // len(paths))
    rows: list[tuple[str | float, ...]] = []
    with panel(None, width="page", height=height) as ax:
        for number, (label, path) in enumerate(paths.items()):
            places = MM * path(u)
            ax.plot(*places.T, label=label, **curve(number))
            rows += [(label, *row) for row in np.column_stack([u, places]).tolist()]
        ax.plot(*(MM * points).T, "k.", markersize=4, label=name)
        ax.set(xlabel="x [mm]", ylabel="y [mm]")
        ax.margins(0.04)
        ax.set_aspect("equal", adjustable="box")
        key(ax)
    return ax.figure, NumberTable(("path", "u [1]", "x [mm]", "y [mm]"), rows)
