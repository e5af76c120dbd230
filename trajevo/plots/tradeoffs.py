"""Trade-offs of a front: what holds its solutions back, and what is chosen by which weights."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm, Normalize
from matplotlib.tri import Triangulation

from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError
from trajevo.formulation.problem import Weights
from trajevo.front.exchange_rates import ExchangeRates
from trajevo.front.front import Front
from trajevo.front.weighing.stability import Chooser, WeightStability, chooser
from trajevo.plots.paper import NOTE, Width, colour, inches, key, label, log_ticks, panel, scale_beside, sequence
from trajevo.plots.pareto import quantities

#: Greatest number of rows, and least change that is shown, in percent for 1 %.
_MOST, _LEAST = 14, 1e-3

#: Height of a row [mm].
_ROW = 5.0

#: Ratio of values from which colours are spread by their logarithms.
_WIDE = 4.0

#: Looks of the line around all weights that make the same choice as the given ones.
_OUTLINE: dict[str, Any] = {"colors": "white", "linewidths": 1.0}

#: Steps of a weight from 0 to 1 along a bar and along a side of a triangle.
_ALONG, _SIDE = 2000, 240

#: Corners of the triangle of weights, those of the first objective on top.
_CORNERS = np.array([[0.5, np.sqrt(0.75)], [0.0, 0.0], [1.0, 0.0]])


def exchange_rates(rates: Sequence[ExchangeRates], *, ax: Axes | None = None, width: Width = "page") -> Axes:
    """By how many percent an objective falls if one thing alone is relaxed by 1 %, along a front.

    Args:
        rates: rates of exchange of the same objective, as :meth:`trajevo.Front.sensitivities` gives them.
        ax: axes.
        width: ``"column"``, ``"page"`` or millimetres.

    Returns:
        The axes: a row for each limit and objective, those that matter most on top, a column for each solution.

    Raises:
        InvalidInputError: no rates, or rates of several objectives.
    """
    if not rates or len({each.objective for each in rates}) > 1:
        told = sorted({each.objective for each in rates})
        raise InvalidInputError(f"rates: expected those of one objective, got {told or 'none'}")
    sizes: dict[str, list[float]] = {}
    for column, each in enumerate(rates):
        for name, gain in each.buys(1.0).items():
            sizes.setdefault(name, [0.0] * len(rates))[column] = gain / max(abs(each.value), np.finfo(float).tiny)
    names = sorted(sizes, key=lambda name: -max(sizes[name]))[:_MOST]
    shown = np.array([sizes[name] for name in names]).reshape(len(names), len(rates))
    norm = LogNorm(_LEAST, max(float(shown.max(initial=0.0)), 1.0))
    with panel(ax, width=width, height=_ROW * max(len(names), 5)) as ax:
        mesh = ax.pcolormesh(np.ma.masked_less(shown, _LEAST), norm=norm, cmap=sequence("viridis_r"))
        ax.invert_yaxis()
        ax.set_yticks(0.5 + np.arange(len(names)), names)
        ticks = np.unique(np.linspace(0, len(rates) - 1, min(6, len(rates))).astype(int))
        ax.set_xticks(0.5 + ticks, [f"{rates[k].value:.3g}" for k in ticks])
        ax.set_xlabel(label(rates[0].objective, rates[0].unit))
        scale_beside(ax, mesh, f"less {rates[0].objective} [%] by 1 % more")
    return ax


def weight_map(
    front: Front,
    found: WeightStability,
    *,
    angle: str | None = None,
    ax: Axes | None = None,
    width: Width = "column",
) -> Axes:
    """Which solution is chosen by which weights: a bar for two objectives, a triangle for three.

    Colours are the first objective's value of the solution that is chosen there. A star marks the given weights, and a
    line encloses all that choose the same solution. For four or more objectives the shares of all weights that choose
    each solution are drawn, with their standard errors.

    Args:
        front: the front, of two objectives or more.
        found: what :meth:`trajevo.Front.stability` of this front gives.
        angle: ``"rad"`` or ``"deg"``.
        ax: axes.
        width: ``"column"``, ``"page"`` or millimetres.

    Raises:
        InvalidInputError: one objective only, or the stability of another front.
    """
    names, factors = quantities(front, angle)
    if len(names) < 2:
        raise InvalidInputError("front: expected at least 2 objectives, the front has 1")
    if len(found.weights) != len(names) or max(found.rows) >= len(front):
        raise InvalidInputError("found: expected the stability of a choice on this front, got that of another one")
    if len(names) > 3:
        return _shares(found, ax, width)
    rows = chooser(front.F, Weights(found.weights, found.scales), found.rule)
    values = front.F[:, 0] * factors[0]
    used = values[list(found.rows)]
    wide = used.min() > 0.0 and used.max() > _WIDE * used.min()
    looks = {"norm": (LogNorm if wide else Normalize)(used.min(), used.max()), "cmap": sequence()}
    words = [name.split(" [")[0] for name in names]
    draw, height = (_bar, 16.0) if len(names) == 2 else (_triangle, min(0.7 * 25.4 * inches(width), 80.0))
    with panel(ax, width=width, height=height) as ax:
        mesh, at = draw(ax, found, rows, values, looks, words)
        star: dict[str, Any] = {"marker": "*", "markersize": 9, "color": "white", "markeredgecolor": "black"}
        ax.plot(*at, linestyle="none", label=f"row {found.row}: {found.told} % of all weights", zorder=5, **star)
        scale_beside(ax, mesh, names[0] if len(names) == 2 else f"{names[0]} of the choice")
        if wide:
            log_ticks(mesh.colorbar.ax.yaxis)
        key(ax)
    return ax


def _bar(
    ax: Axes, found: WeightStability, rows: Chooser, values: Array, looks: dict[str, Any], names: list[str]
) -> tuple[Any, Array]:
    """Values of what is chosen along the weight of the first of two objectives, and where the given weights are."""
    edges = np.linspace(0.0, 1.0, _ALONG + 1)
    middle = 0.5 * (edges[1:] + edges[:-1])
    chosen = rows(np.stack([middle, 1.0 - middle], axis=1))
    mesh = ax.pcolormesh(edges, [0.0, 1.0], values[chosen][None], rasterized=True, **looks)
    ends = edges[1:-1][np.diff(chosen == found.row)]
    ax.vlines(ends, 0.0, 1.0, **_OUTLINE)
    ax.set(xlabel=f"weight of {names[0]}; the rest is of {names[1]}", xlim=(0.0, 1.0), ylim=(0.0, 1.0), yticks=[])
    return mesh, np.array([found.weights[0], 0.5])


def _triangle(
    ax: Axes, found: WeightStability, rows: Chooser, values: Array, looks: dict[str, Any], names: list[str]
) -> tuple[Any, Array]:
    """Values of what is chosen by weights of three objectives, each 1 at its corner, and where the given ones are."""
    first, second = (each.ravel() for each in np.mgrid[: _SIDE + 1, : _SIDE + 1])
    inside = first + second <= _SIDE
    first, second = first[inside], second[inside]
    weights = np.stack([first, second, _SIDE - first - second], axis=1) / _SIDE
    number = np.full((_SIDE + 2, _SIDE + 2), -1)
    number[first, second] = np.arange(len(first))
    upright = np.stack([number[first, second], number[first + 1, second], number[first, second + 1]], axis=1)
    upside = np.stack([number[first + 1, second], number[first + 1, second + 1], number[first, second + 1]], axis=1)
    corners = np.concatenate([each[(each >= 0).all(axis=1)] for each in (upright, upside)])
    across, high = (weights @ _CORNERS).T
    chosen = rows(weights[corners].mean(axis=1))
    mesh = ax.tripcolor(Triangulation(across, high, corners), values[chosen], rasterized=True, **looks)
    own = rows(weights) == found.row
    if own.any() and not own.all():
        ax.tricontour(across, high, own.astype(float), levels=[0.5], **_OUTLINE)
    ax.plot(*_CORNERS[[0, 1, 2, 0]].T, "-", color="black", linewidth=0.6)
    for name, place, side, over in zip(names, _CORNERS, ("center", "left", "right"), (3, -3, -3), strict=True):
        level = "bottom" if over > 0 else "top"
        ax.annotate(f"{name} alone", tuple(place), (0, over), textcoords="offset points", ha=side, va=level)
    ax.set(xticks=[], yticks=[], xlim=(-0.02, 1.02), ylim=(-0.12, 0.98))
    ax.set_aspect("equal")
    ax.spines[:].set_visible(False)
    return mesh, np.array(found.weights) @ _CORNERS


def _shares(found: WeightStability, ax: Axes | None, width: Width) -> Axes:
    """Shares of all weights that choose each solution, the greatest on top and the given weights' marked."""
    rows = list(found.rows[:_MOST])
    if found.row not in rows:
        rows = [*rows[: _MOST - 1], found.row]
    known = dict(zip(found.rows, zip(found.shares, found.errors, strict=True), strict=True))
    shares, errors = 100.0 * np.array([known.get(row, (0.0, 0.0)) for row in rows]).T
    own = [colour(1) if row == found.row else colour(0) for row in rows]
    with panel(ax, width=width, height=_ROW * max(len(rows), 5)) as ax:
        ax.barh(np.arange(len(rows)), shares, xerr=errors, color=own, error_kw={"linewidth": 0.8})
        ax.invert_yaxis()
        ax.set_yticks(np.arange(len(rows)), [f"row {row}" + ("*" if row == found.row else "") for row in rows])
        ax.set_xlabel("share of all weights that choose it [%] (* by the given ones)")
        ax.set_title(f"{len(found.rows)} rows by some weights", loc="left", color=NOTE)
    return ax
