"""Plots of a study: each function draws into the given axes, or into new ones, and returns them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import moocore
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.font_manager import FontProperties
from matplotlib.ticker import MaxNLocator

from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError, checked_name
from trajevo.plots.layout import width_of
from trajevo.plots.paper import TWO_BESIDE, Width, colour, curve, inches, key, label, log_ticks, panel, panels
from trajevo.study.results import CellResult, StudyResults

_VOLUME = "hypervolume / reference box"

#: Turn of labels that are too wide to stand side by side [degrees].
_TURNED = 35.0

#: Ratio of the worst to the best value above which an objective has a logarithmic axis.
_LOGARITHMIC_FROM = 50.0

#: Percentages of the runs whose attainment is drawn: a line for half of them, within a band from one to three quarters.
_QUARTERS = (25.0, 50.0, 75.0)


def hypervolume_boxes(
    results: StudyResults, factor: str | None = None, *, ax: Axes | None = None, width: Width = "column"
) -> Axes:
    """Box plot of the final hypervolume for each level of a factor, with every run as a point.

    Args:
        results: results of :func:`trajevo.study.collection.collect`.
        factor: the factor; all runs in one box if None.
        ax: axes to draw into; new ones if None.
        width: ``"column"``, ``"page"`` or millimetres.

    Raises:
        UnknownNameError: no such factor.
    """
    groups = _groups(results, factor)
    values = [[result.hypervolume[-1] for result in group] for group in groups.values()]
    with panel(ax, width=width, height=45.0) as ax:
        looks: dict[str, Any] = {"widths": 0.5, "showfliers": False, "patch_artist": True}
        boxes = ax.boxplot(values, medianprops={"color": "black", "linestyle": "-", "linewidth": 1.2}, **looks)
        ax.set_xticks(np.arange(1, len(groups) + 1), list(groups))
        for i, (box, own) in enumerate(zip(boxes["boxes"], values, strict=True)):
            box.set(facecolor=to_rgba(colour(i), 0.35), linewidth=0.6)
            # A fixed pattern spreads the points, the same at every drawing.
            spread = 0.12 * np.sin(2.4 * np.arange(len(own)))
            dots: dict[str, Any] = {"markersize": 2.2, "color": colour(i), "markeredgewidth": 0.0}
            ax.plot(i + 1 + spread, own, linestyle="none", marker="o", zorder=3, **dots)
        ax.set(xlabel=factor or "", ylabel=_VOLUME)
        _turn(ax, list(groups))
    return ax


def _turn(ax: Axes, labels: Sequence[str]) -> None:
    """Turn labels below a picture that would run into each other."""
    room = 72.0 * ax.get_position().width * ax.figure.get_figwidth() / len(labels)  # type: ignore[union-attr]
    if max(width_of(text, FontProperties()) for text in labels) > room - 4.0:
        ax.tick_params(axis="x", labelrotation=_TURNED)
        for text in ax.get_xticklabels():
            text.set(horizontalalignment="right", rotation_mode="anchor")


def hypervolume_bands(
    results: StudyResults, factor: str | None = None, *, ax: Axes | None = None, width: Width = "column"
) -> Axes:
    """Course of the hypervolume: median and quartiles over the runs of each level of a factor.

    The horizontal axis shows generations if all runs evaluate the same number of individuals in each generation.
    Otherwise it shows the number of individuals evaluated, since generations are then not equally expensive. A band
    ends with the shortest run of its level. Runs without a known history are left out.

    Args:
        results: results of :func:`trajevo.study.collection.collect`.
        factor: the factor; all runs in one band if None.
        ax: axes to draw into; new ones if None.
        width: ``"column"``, ``"page"`` or millimetres.

    Raises:
        UnknownNameError: no such factor.
    """
    groups = _groups(results, factor)
    longest = max((result.evaluations for result in results.cells), key=len)
    alike = all(np.array_equal(result.evaluations, longest[: len(result.evaluations)]) for result in results.cells)
    with panel(ax, width=width, height=45.0) as ax:
        for i, (name, group) in enumerate(groups.items()):
            grid = _grid(group, longest if alike else None)
            histories = [_at(result, grid) for result in group if np.isfinite(result.hypervolume).all()]
            if not histories:
                continue
            instants = np.arange(1, len(grid) + 1) if alike else grid
            band_drawn(ax, i, instants, np.quantile(histories, (0.25, 0.5, 0.75), axis=0), name)
        ax.set(xlabel="generation" if alike else "individuals evaluated", ylabel=_VOLUME)
        if alike:
            ax.xaxis.set_major_locator(MaxNLocator(6, integer=True))
        if factor:
            key(ax, title=factor)
    return ax


def band_drawn(ax: Axes, i: int, at: Array, quartiles: Array, name: str) -> None:
    """Draw a median within a band of its quartiles, shape (3, N), at places (N,), as the i-th of several."""
    low, middle, high = quartiles
    ax.fill_between(at, low, high, color=colour(i), alpha=0.2, linewidth=0)
    ax.plot(at, middle, label=name, **curve(i))


def attainment(
    results: StudyResults,
    factor: str | None = None,
    *,
    objectives: Sequence[str] | None = None,
    ax: Axes | None = None,
    width: Width = "column",
) -> Axes:
    """Attainment surfaces of two objectives for each level of a factor.

    A line shows what half of the runs attain, within a band between what one quarter and three quarters attain. With
    more than two objectives, two must be named; a run then attains what any of its solutions attains in these two. A
    run that found nothing feasible counts as a run that attains nothing.

    Args:
        results: results of :func:`trajevo.study.collection.collect`.
        factor: the factor; all runs together if None.
        objectives: names of two objectives; both objectives of the study if None.
        ax: axes to draw into; new ones if None.
        width: ``"column"``, ``"page"`` or millimetres.

    Raises:
        UnknownNameError: no such factor or objective.
        InvalidInputError: not two objectives, or too few runs that found anything feasible.
    """
    columns = _two(results, objectives)
    shown = [results.display(column) for column in columns]
    factors = np.array([by for _, _, by in shown])
    groups = {
        label: [surface * factors for surface in attained(group, columns)]
        for label, group in _groups(results, factor).items()
    }
    return surfaces_drawn(groups, [(name, unit) for name, unit, _ in shown], title=factor, ax=ax, width=width)


def surfaces_drawn(
    groups: Mapping[str, Sequence[Array]],
    objectives: Sequence[tuple[str, str]],
    *,
    title: str | None = None,
    ax: Axes | None = None,
    width: Width = "column",
) -> Axes:
    """Attainment surfaces of two objectives, a line within a band for each group of runs.

    Args:
        groups: name of a group -> what a quarter, half and three quarters of its runs attain, each shape (N, 2).
        objectives: name and unit of both objectives.
        title: title of the key; no key if it is None or empty.
        ax: axes to draw into; new ones if None.
        width: ``"column"``, ``"page"`` or millimetres.

    Raises:
        InvalidInputError: too few runs that found anything feasible.
    """
    every = np.concatenate([surface for surfaces in groups.values() for surface in surfaces])
    every = every[np.isfinite(every).all(axis=1)]
    if not len(every):
        raise InvalidInputError("attainment: too few runs of the study have found anything feasible")
    logarithmic, lower, upper = _window(every)
    with panel(ax, width=width, height=50.0) as ax:
        for i, (name, surfaces) in enumerate(groups.items()):
            best, half, most = (_stairs(surface, upper) for surface in surfaces)
            ax.fill(*np.concatenate([best, most[::-1]]).T, color=colour(i), alpha=0.2, linewidth=0)
            ax.plot(*half.T, label=name, **curve(i))
        for k, (axis, (name, unit)) in enumerate(zip("xy", objectives, strict=True)):
            ax.set(**{f"{axis}scale": "log" if logarithmic[k] else "linear", f"{axis}lim": (lower[k], upper[k])})
            ax.set(**{f"{axis}label": label(name.replace("_", " "), unit)})
            if logarithmic[k]:
                log_ticks(ax.xaxis if axis == "x" else ax.yaxis)
        if title:
            key(ax, title=title)
    return ax


def attainments(
    results: StudyResults, factor: str | None = None, *, axes: Any = None, width: Width | None = None
) -> Any:
    """:func:`attainment` for every pair of objectives.

    Args:
        results: results of :func:`trajevo.study.collection.collect`.
        factor: the factor; all runs together if None.
        axes: one Axes per pair, in the order (0, 1), (0, 2), (1, 2), ...; new ones if None.
        width: ``"column"``, ``"page"`` or millimetres; if None, a column for one pair and a page for more.

    Returns:
        Array of Axes.

    Raises:
        InvalidInputError: a single objective, or another number of axes.
    """
    pairs = list(combinations([one.name for one in results.objectives], 2))
    if not pairs:
        raise InvalidInputError("attainments: expected at least 2 objectives, the study has 1")
    chosen: Width = width if width is not None else "page" if len(pairs) > 1 else "column"
    columns = min(len(pairs), 3) if inches(chosen) > TWO_BESIDE else 1 if len(pairs) <= 3 else 2
    with panels(axes, len(pairs), width=chosen, columns=columns, height=45.0 if columns < 3 else 40.0) as made:
        for k, (ax, pair) in enumerate(zip(made, pairs, strict=True)):
            attainment(results, factor, objectives=pair, ax=ax)
            if k and ax.get_legend():
                ax.get_legend().remove()
    return made


def attained(group: Sequence[CellResult], columns: Sequence[int]) -> list[Array]:
    """What a quarter, half and three quarters of the runs attain in two objectives, each shape (N, 2), SI.

    Args:
        group: the runs.
        columns: columns of the two objectives in F.
    """
    return surfaces_of([result.F[:, list(columns)] for result in group])


def surfaces_of(runs: Sequence[Array]) -> list[Array]:
    """What a quarter, half and three quarters of runs attain, each shape (N, 2).

    Args:
        runs: values of two objectives that each run found, shape (N, 2); of a run that found nothing (0, 2).
    """
    sets = [found if len(found) else np.full((1, 2), np.inf) for found in runs]
    numbers = np.concatenate([np.full(len(points), i) for i, points in enumerate(sets)])
    surfaces = moocore.eaf(np.concatenate(sets), numbers, percentiles=_QUARTERS)
    return [surfaces[surfaces[:, -1] == share][:, :2] for share in _QUARTERS]


def _window(points: Array) -> tuple[Array, Array, Array]:
    """Which of two axes are logarithmic, and their lower and upper ends around points of shape (N, 2)."""
    best, worst = points.min(axis=0), points.max(axis=0)
    logarithmic = (best > 0.0) & (worst > _LOGARITHMIC_FROM * np.maximum(best, 1e-300))
    low, high = (np.log(np.where(logarithmic, end, 1.0)) for end in (best, worst))
    low, high = np.where(logarithmic, low, best), np.where(logarithmic, high, worst)
    margin = 0.05 * np.where(high > low, high - low, np.maximum(np.abs(high), 1.0))
    lower, upper = low - margin, high + margin
    return logarithmic, *(np.where(logarithmic, np.exp(np.minimum(end, 700.0)), end) for end in (lower, upper))


def _stairs(points: Array, corner: Array) -> Array:
    """Border of what points dominate, from the upper to the right end of the picture, shape (2 N + 1, 2)."""
    inside = np.minimum(points[np.argsort(points[:, 0])], corner)
    across = np.append(np.repeat(inside[:, 0], 2), corner[0])
    up = np.concatenate([[corner[1]], np.repeat(inside[:, 1], 2)])
    return np.stack([across, up], axis=1)


def _groups(results: StudyResults, factor: str | None) -> Mapping[str, list[CellResult]]:
    """Label of each level -> its runs; levels without runs are left out."""
    if factor is None:
        return {"all runs": list(results.cells)}
    checked_name("factor", factor, results.record.factors)
    groups = {
        level.label: [result for result in results.cells if result.cell.labels[factor] == level.label]
        for level in results.record.factors[factor]
    }
    return {label: group for label, group in groups.items() if group}


def _two(results: StudyResults, objectives: Sequence[str] | None) -> list[int]:
    names = [one.name for one in results.objectives]
    chosen = names if objectives is None else list(objectives)
    if len(chosen) != 2 or len(set(chosen)) != 2:
        raise InvalidInputError(
            f"objectives: attainment surfaces are drawn for 2 objectives; name two of {', '.join(names)}"
        )
    return [names.index(checked_name("objective", name, names)) for name in chosen]


def _grid(group: Sequence[CellResult], common: Array | None) -> Array:
    """Numbers of evaluated individuals that every run of a group has reached, from ``common`` or from its runs."""
    shortest = min(float(result.evaluations[-1]) for result in group)
    own = np.unique(np.concatenate([result.evaluations for result in group])) if common is None else common
    grid: Array = own[own <= shortest]
    return grid


def _at(result: CellResult, grid: Array) -> Array:
    """Hypervolume of a run after given numbers of evaluated individuals; 0 before its first generation."""
    after = np.searchsorted(result.evaluations, grid, side="right")
    volumes: Array = np.concatenate([[0.0], result.hypervolume])[after]
    return volumes
