"""Pictures of payload and centre of mass: payload diagram, allowed centres of mass, price of uncertainty."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.ticker import MaxNLocator

from trajevo.base.arrays import Array
from trajevo.capacity.capacity import your_margin
from trajevo.capacity.payload_diagram import AllowedRegions, PayloadDiagram
from trajevo.capacity.robust import RobustCurve
from trajevo.capacity.slowdown import SlowdownCurve
from trajevo.capacity.uncertainty import UncertaintyPrice
from trajevo.capacity.workspace import WorkspaceCapacity
from trajevo.errors import InvalidInputError, checked_name
from trajevo.plots.effort import dots
from trajevo.plots.paper import LIMIT, NOTE, Width, area, colour, key, panel, scale_beside, sequence

#: Share of white in the colour of a joint, in the bands of the least and of the greatest masses.
_LIGHTEST, _DARKEST = 0.78, 0.05

_LINE_STYLES: tuple[Literal["solid", "dashed", "dotted", "dashdot"], ...] = ("solid", "dashed", "dotted", "dashdot")

_NOTHING_LIMITS, _NO_MASS = "white", "0.6"

#: Points from which a line is long enough for its mass to stand on it.
_LABELLED = 8

#: Places along each side of a map between which its grid is interpolated.
_FINE = 280


def payload_contours(
    diagrams: PayloadDiagram | Mapping[str, PayloadDiagram],
    *,
    levels: int = 8,
    ax: Axes | None = None,
    width: Width = "column",
) -> Axes:
    """The payload diagram: masses by the offset of the load; the colour is the binding joint.

    Args:
        diagrams: a diagram, or label -> diagram; the first is filled, the others are drawn as lines at the same masses.
        levels: approximate number of masses with lines; fewer if several motions are overlaid.
        ax: axes.
        width: ``"column"``, ``"page"`` or millimetres.

    Returns:
        The axes; lengths in mm, dark for great masses, grey where no mass is feasible, white where nothing limits it.

    Raises:
        InvalidInputError: no diagram, more diagrams than line styles, or diagrams with different directions or payload
            models.
    """
    named = {"": diagrams} if isinstance(diagrams, PayloadDiagram) else dict(diagrams)
    if not 1 <= len(named) <= len(_LINE_STYLES):
        raise InvalidInputError(f"diagrams: expected 1 to {len(_LINE_STYLES)} of them, got {len(named)}")
    first = next(iter(named.values()))
    for label, diagram in named.items():
        if (diagram.worst, diagram.payload_model) != (first.worst, first.payload_model):
            raise InvalidInputError(f"diagrams: {label!r} differs from the first in its direction or payload model")
    masses = _levels(list(named.values()), levels if len(named) == 1 else max(levels // 2, 2))
    with panel(ax, width=width, height=58.0) as ax:
        handles = _fill(first, masses, ax)
        for k, (name, diagram) in enumerate(named.items()):
            style = _LINE_STYLES[k]
            _lines(diagram, masses, style, ax, at=(k + 1.0) / (len(named) + 1.0))
            if name:
                handles.append(Line2D([], [], color="black", linestyle=style, linewidth=0.8, label=name))
        where = "in the worst direction" if first.worst else f"at {np.degrees(first.direction.flat[0]):g}°"
        ax.set(xlabel=f"L_xy off the tool's z axis [mm],\n{where}", ylabel="L_z along the tool's z axis [mm]")
        ax.set_title(f"largest payload [kg] ({first.payload_model})", loc="left", color=NOTE)
        key(ax, handles)
    return ax


def robust_mass(curve: RobustCurve, *, ax: Axes | None = None, width: Width = "column") -> Axes:
    """The largest payload by the tolerance of its centre of mass; colour and shape tell the binding joint.

    Args:
        curve: result of :func:`trajevo.capacity.robust.robust_curve`.
        ax: axes.
        width: ``"column"``, ``"page"`` or millimetres.

    Returns:
        The axes; lengths in mm.
    """
    place = ", ".join(f"{1e3 * x:g}" for x in curve.com)
    with panel(ax, width=width, height=45.0) as ax:
        ax.plot(1e3 * curve.tolerances, curve.mass, "-", color="0.75", linewidth=0.8, zorder=1)
        for number, joint in enumerate(dict.fromkeys(name for name in curve.joints if name)):
            chosen = np.array([name == joint for name in curve.joints])
            ax.plot(1e3 * curve.tolerances[chosen], curve.mass[chosen], label=f"{joint} binds", **dots(number))
        ax.set(
            xlabel=f"centre of mass known to ± [mm], along every axis around ({place}) mm",
            ylabel=f"largest payload, wherever it is [kg] ({curve.payload_model})",
            ylim=(0.0, None),
        )
        key(ax)
    return ax


def allowed_region(regions: AllowedRegions, *, ax: Axes | None = None, width: Width = "column") -> Axes:
    """Regions of a plane of the tool frame in which the centre of mass may lie, one per mass.

    Args:
        regions: polygons, or values on a grid, from :func:`trajevo.capacity.payload_diagram.allowed_regions`.
        ax: axes.
        width: ``"column"``, ``"page"`` or millimetres.

    Returns:
        The axes, in mm; a mass without a region appears only in the legend.
    """
    colours = sequence("viridis_r")(np.linspace(0.1, 1.0, max(len(regions.masses), 1)))
    horizontal, vertical = (name for name in "xyz" if name != regions.axis)
    bound = 1.05e3 * regions.within
    with panel(ax, width=width, height=58.0) as ax:
        for k, tint in enumerate(colours[: len(regions.masses)]):
            _region(regions, k, tint, ax)
        ax.plot(0.0, 0.0, "k+", markersize=6)
        ax.set(
            xlabel=f"{horizontal} of the centre of mass [mm]",
            ylabel=f"{vertical} of the centre of mass [mm]",
            xlim=(-bound, bound),
            ylim=(-bound, bound),
            aspect="equal",
        )
        ax.set_title(f"allowed centres of mass at {regions.axis} = {1e3 * regions.at:g} mm", color=NOTE)
        key(ax)
    return ax


def _region(regions: AllowedRegions, k: int, tint: Any, ax: Axes) -> None:
    """Fill the exact polygon of one mass, or the part of a grid in which every effort keeps its limit."""
    filling: dict[str, Any] = {"facecolor": (*tint[:3], 0.25), "edgecolor": tint, "linewidth": 1.0, "linestyle": "-"}
    if regions.polygons:
        corners, anywhere = 1e3 * regions.polygons[k], len(regions.polygons[k]) > 0
    else:
        sides, used = 1e3 * regions.sides, regions.used[k]
        ax.contourf(sides, sides, used, [-np.inf, 1.0], colors=[filling["facecolor"]])
        ax.contour(sides, sides, used, [1.0], colors=[tint], linewidths=1.0)
        corners, anywhere = np.empty((0, 2)), bool((used <= 1.0).any())
    mass = regions.masses[k]
    ax.fill(*corners.T, label=f"{mass:g} kg" if anywhere else f"{mass:g} kg: nowhere", **filling)


def uncertainty_price(
    prices: UncertaintyPrice | Mapping[str, UncertaintyPrice], *, ax: Axes | None = None, width: Width = "column"
) -> Axes:
    """The price in time of a payload known only as intervals: least time by the tolerance of the centre of mass.

    Args:
        prices: a price, or label -> price.
        ax: axes.
        width: ``"column"``, ``"page"`` or millimetres.

    Returns:
        The axes. The right axis is the share by which a motion is slower than that of the first curve for the exactly
        known payload. A cross on the lower edge means that no feasible motion was found. The legend shows whether the
        mass is uncertain too.

    Raises:
        InvalidInputError: no price.
    """
    named = {"": prices} if isinstance(prices, UncertaintyPrice) else dict(prices)
    if not named:
        raise InvalidInputError("prices: expected at least one, got none")
    known = float(next(iter(named.values())).times[0])
    in_percent: Any = (lambda time: 100.0 * (time / known - 1.0), lambda share: known * (1.0 + share / 100.0))
    with panel(ax, width=width, height=48.0) as ax:
        for number, (name, price) in enumerate(named.items()):
            found, x = np.isfinite(price.times), 1e3 * price.tolerances
            looks: dict[str, Any] = {"color": colour(number), "linestyle": ("-", "--", "-.", ":")[number % 4]}
            told = ", ".join(filter(None, (name, _masses(price))))
            ax.plot(x[found], price.times[found], marker="os^v"[number % 4], label=told, **looks)
            if not found.all():
                missed = x[~found]
                edge: dict[str, Any] = {"transform": ax.get_xaxis_transform(), "clip_on": False}
                ax.plot(missed, np.zeros(len(missed)), "x", color=colour(number), **edge)
        if not all(np.isfinite(price.times).all() for price in named.values()):
            ax.plot([], [], "kx", label="no motion found")
        shares = ax.secondary_yaxis("right", functions=in_percent)
        shares.set_ylabel("more than with the known payload [%]")
        shares.yaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
        ax.set(xlabel="tolerance of each coordinate of the centre of mass, to either side [mm]")
        ax.set_ylabel(f"least time [s] ({next(iter(named.values())).payload_model})")
        key(ax)
    return ax


def _masses(price: UncertaintyPrice) -> str:
    """The nominal mass and its interval, in words."""
    (low, high), nominal = price.masses[-1], price.masses[0, 0]
    if low == high:
        return f"{nominal:g} kg"
    return f"{nominal:g} kg, at the end {low:.4g} to {high:.4g} kg"


def _levels(diagrams: Sequence[PayloadDiagram], count: int) -> Array:
    """Round masses over the range of all cells, which the few cells that almost nothing limits do not stretch."""
    finite = np.concatenate([diagram.mass[np.isfinite(diagram.mass)] for diagram in diagrams])
    if not len(finite):
        return np.empty(0)
    low, high = np.percentile(finite, [0.0, 98.0])
    return np.asarray(MaxNLocator(count).tick_values(low, max(high, low + 1e-9)))


def _fill(diagram: PayloadDiagram, masses: Array, ax: Axes) -> list[Any]:
    """Fill with the colours of the joints, lightened by bands of mass; returns the legend entries."""
    x, y = 1e3 * diagram.offset_xy, 1e3 * diagram.offset_z
    nothing, free = np.isnan(diagram.mass), np.isposinf(diagram.mass)
    tints = [*(to_rgb(area(joint)) for joint in range(len(diagram.joint_names))), to_rgb(_NO_MASS), (1.0, 1.0, 1.0)]
    kinds = np.where(nothing, len(tints) - 2, np.where(free, len(tints) - 1, diagram.joint))
    fine_x, fine_y = _between(x), _between(y)
    shown = _finer_regions(kinds, len(tints), (y, x), (fine_y, fine_x))
    cells = np.array(tints)[shown]
    ax.pcolormesh(fine_x, fine_y, cells, shading="nearest", rasterized=True)
    if len(masses) > 1 and min(diagram.mass.shape) > 1:
        white = np.linspace(_LIGHTEST, _DARKEST, len(masses) + 1)
        bands = [(1.0, 1.0, 1.0, share) for share in white]
        mass = _finer(_filled(diagram.mass), (y, x), (fine_y, fine_x))
        bound = np.ma.masked_where(shown >= len(diagram.joint_names), mass)
        ax.contourf(fine_x, fine_y, bound, masses, colors=bands, extend="both", antialiased=False)
        for kind in np.unique(shown)[1:]:  # borders, which colours alone do not show in grey
            ax.contour(fine_x, fine_y, shown >= kind, [0.5], colors="0.35", linewidths=0.5, linestyles="dotted")
    handles: list[Any] = [
        Patch(color=area(int(joint)), label=f"{diagram.joint_names[joint]} binds")
        for joint in np.unique(diagram.joint[diagram.joint >= 0])
    ]
    if nothing.any():
        handles.append(Patch(color=_NO_MASS, label="no mass is feasible"))
    if free.any():
        handles.append(Patch(facecolor=_NOTHING_LIMITS, edgecolor="black", label="nothing limits it"))
    ax.set(xlim=(x[0], x[-1]) if len(x) > 1 else None, ylim=(y[0], y[-1]) if len(y) > 1 else None)
    return handles


def _between(places: Array) -> Array:
    """The places of a grid, and as many between them as a map needs to look smooth."""
    if len(places) < 2:
        return places
    steps = -(-_FINE // (len(places) - 1))
    counted = np.arange(len(places), dtype=float)
    return np.interp(np.arange(steps * (len(places) - 1) + 1) / steps, counted, places)


def _finer(values: Array, places: tuple[Array, Array], fine: tuple[Array, Array]) -> Array:
    """Values on a finer grid, straight between those of a grid, shape (R, C)."""
    across = np.array([np.interp(fine[1], places[1], row) for row in values])
    return np.array([np.interp(fine[0], places[0], column) for column in across.T]).T


def _finer_regions(kinds: Array, count: int, places: tuple[Array, Array], fine: tuple[Array, Array]) -> Array:
    """Kinds of cells, from 0 to count, on a finer grid, with borders between the cells that are no stairs."""
    shares = []
    for kind in range(count):
        own = (kinds == kind).astype(float)
        shares.append(_finer(_softened(_softened(own).T).T, places, fine) if own.any() else np.full((1, 1), -1.0))
    kind_of: Array = np.array(np.broadcast_arrays(*shares)).argmax(axis=0)
    return kind_of


def _softened(values: Array) -> Array:
    """Means of each row with its neighbours, which weigh half as much."""
    wide = np.pad(values, ((1, 1), (0, 0)), mode="edge")
    mean: Array = 0.25 * wide[:-2] + 0.5 * wide[1:-1] + 0.25 * wide[2:]
    return mean


def _filled(values: Array) -> Array:
    """Values with those of the nearest finite neighbours in place of others, ring by ring."""
    filled = np.where(np.isfinite(values), values, np.nan)
    while np.isnan(filled).any() and not np.isnan(filled).all():
        wide = np.pad(filled, 1, constant_values=np.nan)
        beside = np.stack([wide[:-2, 1:-1], wide[2:, 1:-1], wide[1:-1, :-2], wide[1:-1, 2:]])
        known = np.isfinite(beside)
        mean = np.where(known, beside, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
        filled = np.where(np.isnan(filled) & known.any(axis=0), mean, filled)
    return np.nan_to_num(filled)


def _lines(diagram: PayloadDiagram, masses: Array, style: str, ax: Axes, *, at: float) -> None:
    """Lines of equal mass, with the mass at a share of the length of each, so that overlaid ones do not meet."""
    if not len(masses) or min(diagram.mass.shape) < 2:
        return
    finite = np.ma.masked_invalid(diagram.mass)
    inside = masses[(masses > finite.min()) & (masses < finite.max())] if finite.count() else masses[:0]
    if not len(inside):
        return
    x, y = 1e3 * diagram.offset_xy, 1e3 * diagram.offset_z
    looks: dict[str, Any] = {"colors": "black", "linewidths": 0.7, "linestyles": style}
    lines = ax.contour(x, y, finite, inside, **looks)
    parts: list[Any] = [path.to_polygons(closed_only=False) for path in lines.get_paths()]
    longest = [max(part, key=len) for part in parts if part]
    places = [(*line[int(at * (len(line) - 1))],) for line in longest if len(line) >= _LABELLED]
    ax.clabel(lines, fmt="%g kg", fontsize=8, manual=places)


#: Quantities that a picture of the workspace can show.
SHOWN = ("mass", "joint")


def slowdown_curve(curve: SlowdownCurve, *, ax: Axes | None = None, width: Width = "column") -> Axes:
    """Payload against the least duration along the same path; colour and shape tell what binds.

    The dashed line is the original motion; payloads whose motion breaks a constraint of its problem are hollow; the
    curve at the robot's full limits is grey.
    """
    bound, kept = list(zip(curve.limits, curve.joints, strict=True)), np.array([not text for text in curve.not_kept])
    with panel(ax, width=width, height=48.0) as ax:
        ax.plot(curve.durations, curve.payloads, "-", color="0.75", linewidth=0.8, zorder=1)
        for number, (limit, joint) in enumerate(dict.fromkeys(pair for pair in bound if pair[0])):
            chosen, looks = np.array([pair == (limit, joint) for pair in bound]), dots(number)
            name = f"{limit} of {joint}" if joint else limit
            ax.plot(curve.durations[chosen & kept], curve.payloads[chosen & kept], label=name, **looks)
            hollow: dict[str, Any] = looks | {"markerfacecolor": "white", "markersize": 4.0, "markeredgewidth": 0.7}
            ax.plot(curve.durations[chosen & ~kept], curve.payloads[chosen & ~kept], **hollow)
        for names in dict.fromkeys(text for text in curve.not_kept if text):
            ax.plot([], [], "o", markersize=4.0, color="black", markerfacecolor="white", label=f"not kept: {names}")
        line: dict[str, Any] = {"color": LIMIT, "linewidth": 0.8}
        ax.axvline(curve.present_duration, linestyle="--", label="the motion as it is", **line)
        full = curve.at_full_limits
        if full is not None:
            name = "at the robot's full limits"
            ax.plot(full.durations, full.payloads, color="0.5", linestyle="-.", linewidth=0.8, label=name)
        if np.isfinite(curve.static_bound):
            ax.axhline(curve.static_bound, linestyle=":", label=f"held at rest: {curve.static_bound:.3f} kg", **line)
        margin = f"{your_margin(curve.effort_margin)} kept; " if curve.effort_margin else ""
        ax.set(xlabel="least time along the same path [s]", ylabel=f"payload [kg] ({curve.payload_model})")
        ax.set_title(f"{margin}effort sampled at {curve.instants} instants", color=NOTE)
        key(ax)
    return ax


def workspace_capacity(
    found: WorkspaceCapacity,
    *,
    show: str = "mass",
    path: Array | None = None,
    ax: Axes | None = None,
    width: Width = "column",
) -> Axes:
    """Map of the largest payload at every tool position of a plane; hatched where the tool does not reach.

    Args:
        found: the capacities of the cells.
        show: ``"mass"`` [kg], or ``"joint"`` for the binding joint.
        path: path of a tool to draw on the map, shape (T, 2), along columns and rows [m].
        ax: axes.
        width: ``"column"``, ``"page"`` or millimetres.

    Raises:
        UnknownNameError: another value of ``show``.
    """
    checked_name("thing to show", show, SHOWN)
    plane = found.plane
    fine = _between(plane.rows), _between(plane.columns)
    sides = _edges(fine[1]), _edges(fine[0])
    unreached: dict[str, Any] = {"facecolor": "0.94", "edgecolor": "0.75", "hatch": "////", "linewidth": 0.0}
    with panel(ax, width=width, height=58.0) as ax:
        across, up = (float(np.ptp(edges)) for edges in sides)
        ax.add_patch(Rectangle((sides[0][0], sides[1][0]), across, up, **unreached))
        handles = [Patch(label="not reached", **unreached)]
        if show == "mass":
            _map_of_masses(found, fine, ax)
        else:
            handles = [*_map_of_joints(found, fine, ax), *handles]
        if path is not None:
            ax.plot(*np.asarray(path).T, "-", color="black", linewidth=0.8, zorder=3)
        third = next(k for k, name in enumerate("xyz") if name not in plane.axes)
        accelerated = f"accelerated at ({', '.join(f'{value:g}' for value in found.acceleration)}) m/s²"
        moving = accelerated if found.acceleration.any() else "held at rest"
        title = f"{moving},\ntool {'xyz'[third]} = {plane.pose.position[third]:.4g} m"
        if found.effort_margin:
            title += f", {your_margin(found.effort_margin)} kept"
        ax.set(xlabel=f"tool {plane.axes[0]} [m]", ylabel=f"tool {plane.axes[1]} [m]", aspect="equal")
        ax.set(xlim=(sides[0][0], sides[0][-1]), ylim=(sides[1][0], sides[1][-1]))
        ax.set_title(title, color=NOTE)
        key(ax, handles)
    return ax


def _map_of_masses(found: WorkspaceCapacity, fine: tuple[Array, Array], ax: Axes) -> None:
    places, reached = (found.plane.rows, found.plane.columns), np.isfinite(found.mass)
    inside = _finer_regions(reached.astype(int), 2, places, fine) == 1
    masses = np.ma.masked_where(~inside, _finer(_filled(found.mass), places, fine))
    image = ax.pcolormesh(fine[1], fine[0], masses, cmap=sequence(), shading="nearest", zorder=2, rasterized=True)
    if masses.count() and np.ptp(masses.compressed()) <= 1e-6 * float(masses.max()):
        image.set_clim(0.0, 2.0 * float(masses.max()) or 1.0)  # so that the scale does not show rounding errors
    elif masses.count() and min(masses.shape) > 1:
        levels = MaxNLocator(6).tick_values(float(masses.min()), float(masses.max()))
        ax.contour(fine[1], fine[0], masses, levels, colors="white", linewidths=0.5, zorder=2.5)
    scale_beside(ax, image, f"payload [kg] ({found.payload_model})")


def _map_of_joints(found: WorkspaceCapacity, fine: tuple[Array, Array], ax: Axes) -> list[Any]:
    """Fill with the colours of the binding joints; returns the legend entries."""
    count = len(found.joint_names)
    kinds = np.where(found.joint < 0, count, found.joint)
    shown = _finer_regions(kinds, count + 1, (found.plane.rows, found.plane.columns), fine)
    tints = np.array([*((*to_rgb(area(k)), 1.0) for k in range(count)), (1.0, 1.0, 1.0, 0.0)])
    ax.pcolormesh(fine[1], fine[0], tints[shown], shading="nearest", zorder=2, rasterized=True)
    return [Patch(color=area(k), label=found.joint_names[k]) for k in np.unique(kinds[kinds < count]).tolist()]


def _edges(centres: Array) -> Array:
    """Ends of cells around their centres."""
    if len(centres) == 1:
        return np.array([centres[0] - 0.5, centres[0] + 0.5])
    middles = 0.5 * (centres[1:] + centres[:-1])
    return np.concatenate([[2.0 * centres[0] - middles[0]], middles, [2.0 * centres[-1] - middles[-1]]])
