"""Pictures of payload and centre of mass: payload diagram, allowed centres of mass, price of uncertainty."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap, to_rgb
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

#: Share of white in the colour of a joint, in the bands of the least and of the greatest masses.
_LIGHTEST, _DARKEST = 0.78, 0.05

_LINE_STYLES: tuple[Literal["solid", "dashed", "dotted", "dashdot"], ...] = ("solid", "dashed", "dotted", "dashdot")


_NOTHING_LIMITS, _NO_MASS = "white", "0.6"


def payload_contours(
    diagrams: PayloadDiagram | Mapping[str, PayloadDiagram], *, levels: int = 8, ax: Axes | None = None
) -> Axes:
    """The payload diagram: masses by the offset of the load; the colour is the binding joint.

    Args:
        diagrams: a diagram, or label -> diagram; the first is filled, the others are drawn as lines at the same masses.
        levels: approximate number of masses with lines; fewer if several motions are overlaid.
        ax: axes.

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
    ax = ax or plt.subplots(figsize=(7.6, 5.2), layout="constrained")[1]
    masses = _levels(list(named.values()), levels if len(named) == 1 else max(levels // 2, 2))
    handles = _fill(first, masses, ax)
    for style, (label, diagram) in zip(_LINE_STYLES, named.items(), strict=False):
        _lines(diagram, masses, style, ax)
        if label:
            handles.append(Line2D([], [], color="black", linestyle=style, label=label))
    ax.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    where = "in the worst direction" if first.worst else f"at {np.degrees(first.direction.flat[0]):g}°"
    ax.set(xlabel=f"L_xy, off the tool's z axis, {where} [mm]", ylabel="L_z, along the tool's z axis [mm]")
    ax.set_title(f"largest payload [kg] ({first.payload_model})")
    return ax


def robust_mass(curve: RobustCurve, *, ax: Axes | None = None) -> Axes:
    """The largest payload by the tolerance of its centre of mass; the colour is the binding joint.

    Args:
        curve: result of :func:`trajevo.capacity.robust.robust_curve`.
        ax: axes.

    Returns:
        The axes; lengths in mm.
    """
    ax = ax or plt.subplots(figsize=(6.4, 4.2), layout="constrained")[1]
    ax.plot(1e3 * curve.tolerances, curve.mass, color="0.75", linewidth=1.0, zorder=1)
    for joint in dict.fromkeys(name for name in curve.joints if name):
        chosen = np.array([name == joint for name in curve.joints])
        ax.plot(1e3 * curve.tolerances[chosen], curve.mass[chosen], ".", label=f"{joint} binds")
    place = ", ".join(f"{1e3 * x:g}" for x in curve.com)
    ax.set(
        xlabel=f"centre of mass known to ± [mm], along every axis around ({place}) mm",
        ylabel=f"largest payload, wherever it is [kg] ({curve.payload_model})",
        ylim=(0.0, None),
    )
    ax.grid(alpha=0.3)
    if ax.get_legend_handles_labels()[0]:
        ax.legend()
    return ax


def allowed_region(regions: AllowedRegions, *, ax: Axes | None = None) -> Axes:
    """Regions of a plane of the tool frame in which the centre of mass may lie, one per mass.

    Args:
        regions: polygons, or values on a grid, from :func:`trajevo.capacity.payload_diagram.allowed_regions`.
        ax: axes.

    Returns:
        The axes, in mm; a mass without a region appears only in the legend.
    """
    ax = ax or plt.subplots(figsize=(6.0, 5.2), layout="constrained")[1]
    colours = plt.get_cmap("viridis_r")(np.linspace(0.1, 0.9, max(len(regions.masses), 1)))
    for k, colour in enumerate(colours[: len(regions.masses)]):
        _region(regions, k, colour, ax)
    horizontal, vertical = (name for name in "xyz" if name != regions.axis)
    ax.plot(0.0, 0.0, "k+", markersize=10)
    bound = 1.05e3 * regions.within
    ax.set(
        xlabel=f"{horizontal} of the centre of mass [mm]",
        ylabel=f"{vertical} of the centre of mass [mm]",
        title=f"allowed centres of mass at {regions.axis} = {1e3 * regions.at:g} mm",
        xlim=(-bound, bound),
        ylim=(-bound, bound),
        aspect="equal",
    )
    ax.grid(alpha=0.3)
    ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return ax


def _region(regions: AllowedRegions, k: int, colour: Any, ax: Axes) -> None:
    """Fill the exact polygon of one mass, or the part of a grid in which every effort keeps its limit."""
    filling: dict[str, Any] = {"facecolor": (*colour[:3], 0.25), "edgecolor": colour, "linewidth": 1.5}
    if regions.polygons:
        corners, anywhere = 1e3 * regions.polygons[k], len(regions.polygons[k]) > 0
    else:
        sides, used = 1e3 * regions.sides, regions.used[k]
        ax.contourf(sides, sides, used, [-np.inf, 1.0], colors=[filling["facecolor"]])
        ax.contour(sides, sides, used, [1.0], colors=[colour], linewidths=1.5)
        corners, anywhere = np.empty((0, 2)), bool((used <= 1.0).any())
    mass = regions.masses[k]
    ax.fill(*corners.T, label=f"{mass:g} kg" if anywhere else f"{mass:g} kg: nowhere", **filling)


def uncertainty_price(prices: UncertaintyPrice | Mapping[str, UncertaintyPrice], *, ax: Axes | None = None) -> Axes:
    """The price in time of a payload known only as intervals: least time by the tolerance of the centre of mass.

    Args:
        prices: a price, or label -> price.
        ax: axes.

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
    ax = ax or plt.subplots(figsize=(7.0, 4.6), layout="constrained")[1]
    known, edge = float(next(iter(named.values())).times[0]), ax.get_xaxis_transform()
    for label, price in named.items():
        found, x = np.isfinite(price.times), 1e3 * price.tolerances
        (line,) = ax.plot(x[found], price.times[found], "o-", label=", ".join(filter(None, (label, _masses(price)))))
        if not found.all():
            missed = x[~found]
            ax.plot(missed, np.zeros(len(missed)), "x", color=line.get_color(), transform=edge, clip_on=False)
    if not all(np.isfinite(price.times).all() for price in named.values()):
        ax.plot([], [], "kx", label="no motion found")
    in_percent: Any = (lambda time: 100.0 * (time / known - 1.0), lambda share: known * (1.0 + share / 100.0))
    shares = ax.secondary_yaxis("right", functions=in_percent)
    shares.set_ylabel("more than with the known payload [%]")
    ax.set(
        xlabel="tolerance of each coordinate of the centre of mass, to either side [mm]",
        ylabel="least time [s]",
        title=f"the price of not knowing the payload ({next(iter(named.values())).payload_model})",
    )
    ax.grid(alpha=0.3)
    ax.legend(loc="upper left", fontsize=8)  # the curves rise
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
    colours = plt.get_cmap("tab10")(np.arange(len(diagram.joint_names)) % 10)[:, :3]
    cells = np.ones((*diagram.mass.shape, 3))
    binds, nothing = diagram.joint >= 0, np.isnan(diagram.mass)
    cells[binds] = colours[diagram.joint[binds]]
    cells[nothing] = to_rgb(_NO_MASS)
    x, y = 1e3 * diagram.offset_xy, 1e3 * diagram.offset_z
    ax.pcolormesh(x, y, cells, shading="nearest", rasterized=True)
    if len(masses) > 1 and min(diagram.mass.shape) > 1:
        white = np.linspace(_LIGHTEST, _DARKEST, len(masses) + 1)
        bands = [(1.0, 1.0, 1.0, share) for share in white]
        finite = np.ma.masked_invalid(diagram.mass)
        ax.contourf(x, y, finite, masses, colors=bands, extend="both", antialiased=False)
    handles: list[Any] = [
        Patch(color=colours[joint], label=f"{diagram.joint_names[joint]} binds")
        for joint in np.unique(diagram.joint[binds])
    ]
    if nothing.any():
        handles.append(Patch(color=_NO_MASS, label="no mass is feasible"))
    if np.isinf(diagram.mass).any():
        handles.append(Patch(facecolor=_NOTHING_LIMITS, edgecolor="black", label="nothing limits it"))
    ax.set(xlim=(x[0], x[-1]) if len(x) > 1 else None, ylim=(y[0], y[-1]) if len(y) > 1 else None)
    return handles


def _lines(diagram: PayloadDiagram, masses: Array, style: str, ax: Axes) -> None:
    if not len(masses) or min(diagram.mass.shape) < 2:
        return
    finite = np.ma.masked_invalid(diagram.mass)
    inside = masses[(masses > finite.min()) & (masses < finite.max())] if finite.count() else masses[:0]
    if not len(inside):
        return
    lines = ax.contour(
        1e3 * diagram.offset_xy,
        1e3 * diagram.offset_z,
        finite,
        inside,
        colors="black",
        linewidths=1.0,
        linestyles=style,
    )
    ax.clabel(lines, fmt="%g kg", fontsize=8)


#: Quantities that a picture of the workspace can show.
SHOWN = ("mass", "joint")


def slowdown_curve(curve: SlowdownCurve, *, ax: Axes | None = None) -> Axes:
    """Payload against the least duration along the same path; the colour is what binds, dashed the original motion.

    Payloads whose motion breaks a constraint of its problem are hollow; the curve at the robot's full limits is grey.
    """
    ax = ax or plt.subplots(figsize=(6.8, 4.2), layout="constrained")[1]
    ax.plot(curve.durations, curve.payloads, color="0.75", linewidth=1.0, zorder=1)
    bound, kept = list(zip(curve.limits, curve.joints, strict=True)), np.array([not text for text in curve.not_kept])
    for limit, joint in dict.fromkeys(pair for pair in bound if pair[0]):
        chosen = np.array([pair == (limit, joint) for pair in bound])
        label = f"{limit} of {joint}" if joint else limit
        (line,) = ax.plot(curve.durations[chosen & kept], curve.payloads[chosen & kept], ".", label=label)
        broken = ax.plot(curve.durations[chosen & ~kept], curve.payloads[chosen & ~kept], "o", markersize=4.0)
        broken[0].set(color=line.get_color(), markerfacecolor="white")
    for names in dict.fromkeys(text for text in curve.not_kept if text):
        ax.plot([], [], "o", markersize=4.0, color="black", markerfacecolor="white", label=f"not kept: {names}")
    ax.axvline(curve.present_duration, color="black", linestyle="--", linewidth=0.8, label="the motion as it is")
    full = curve.at_full_limits
    if full is not None:
        label = "at the robot's full limits"
        ax.plot(full.durations, full.payloads, color="0.5", linestyle="-.", linewidth=1.0, label=label)
    if np.isfinite(curve.static_bound):
        label = f"held at rest: {curve.static_bound:.3f} kg"
        ax.axhline(curve.static_bound, color="black", linestyle=":", linewidth=1.0, label=label)
    margin = f"{your_margin(curve.effort_margin)} kept; " if curve.effort_margin else ""
    title = f"{margin}effort sampled at {curve.instants} instants"
    ax.set(xlabel="least time along the same path [s]", ylabel=f"payload [kg] ({curve.payload_model})")
    ax.set_title(title, fontsize="small")
    ax.grid(alpha=0.3)
    ax.legend()
    return ax


def workspace_capacity(
    found: WorkspaceCapacity, *, show: str = "mass", path: Array | None = None, ax: Axes | None = None
) -> Axes:
    """Heat map of the largest payload at every tool position of a plane; hatched where the tool does not reach.

    Args:
        found: the capacities of the cells.
        show: ``"mass"`` [kg], or ``"joint"`` for the binding joint.
        path: path of a tool to draw on the map, shape (T, 2), along columns and rows [m].
        ax: axes.

    Raises:
        UnknownNameError: another value of ``show``.
    """
    checked_name("thing to show", show, SHOWN)
    ax = ax or plt.subplots(figsize=(6.8, 5.2), layout="constrained")[1]
    plane, mesh = found.plane, (_edges(found.plane.columns), _edges(found.plane.rows))
    width, height = (float(np.ptp(edges)) for edges in mesh)
    unreached: dict[str, Any] = {"facecolor": "0.92", "edgecolor": "0.75", "hatch": "////", "linewidth": 0.0}
    ax.add_patch(Rectangle((mesh[0][0], mesh[1][0]), width, height, **unreached))
    handles = [Patch(label="not reached", **unreached)]
    if show == "mass":
        masses = np.ma.masked_invalid(found.mass)
        image = ax.pcolormesh(*mesh, masses, cmap="viridis", zorder=2)
        if masses.count() and np.ptp(masses.compressed()) <= 1e-6 * float(masses.max()):
            image.set_clim(0.0, 2.0 * float(masses.max()) or 1.0)  # so that the scale does not show rounding errors
        ax.figure.colorbar(image, ax=ax, shrink=0.8, label=f"payload [kg] ({found.payload_model})")
    else:
        count = len(found.joint_names)
        colours = plt.get_cmap("tab10")(np.arange(count) % 10)
        binding = np.ma.masked_less(found.joint, 0)
        norm = BoundaryNorm(np.arange(count + 1) - 0.5, count)
        ax.pcolormesh(*mesh, binding, cmap=ListedColormap(colours), norm=norm, zorder=2)
        present = np.unique(binding.compressed()).tolist()
        handles = [*(Patch(color=colours[k], label=found.joint_names[k]) for k in present), *handles]
    if path is not None:
        ax.plot(*np.asarray(path).T, color="black", linewidth=1.0, zorder=3)
    third = next(k for k, name in enumerate("xyz") if name not in plane.axes)
    accelerated = f"accelerated at ({', '.join(f'{value:g}' for value in found.acceleration)}) m/s²"
    moving = accelerated if found.acceleration.any() else "held at rest"
    title = f"{moving}, tool {'xyz'[third]} = {plane.pose.position[third]:.4g} m"
    if found.effort_margin:
        title += f", {your_margin(found.effort_margin)} kept"
    ax.set(xlabel=f"tool {plane.axes[0]} [m]", ylabel=f"tool {plane.axes[1]} [m]", title=title, aspect="equal")
    ax.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.0, -0.12), ncols=3, frameon=False)
    return ax


def _edges(centres: Array) -> Array:
    """Ends of cells around their centres."""
    if len(centres) == 1:
        return np.array([centres[0] - 0.5, centres[0] + 0.5])
    middles = 0.5 * (centres[1:] + centres[:-1])
    return np.concatenate([[2.0 * centres[0] - middles[0]], middles, [2.0 * centres[-1] - middles[-1]]])
