"""Pictures of what a robot carries: payload against time along one path, and over the workspace."""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.patches import Patch, Rectangle

from trajevo.arrays import Array
from trajevo.errors import checked_name
from trajevo.slowdown_curve import SlowdownCurve
from trajevo.workspace_capacity import WorkspaceCapacity

#: What a picture of the workspace can show.
SHOWN = ("mass", "joint")


def slowdown_curve(curve: SlowdownCurve, *, ax: Axes | None = None) -> Axes:
    """Payload against the least duration along the same path, what binds as colour; dashed the motion as it is."""
    ax = ax or plt.subplots(figsize=(6.8, 4.2), layout="constrained")[1]
    ax.plot(curve.durations, curve.payloads, color="0.75", linewidth=1.0, zorder=1)
    bound = list(zip(curve.limits, curve.joints, strict=True))
    for limit, joint in dict.fromkeys(pair for pair in bound if pair[0]):
        chosen = np.array([pair == (limit, joint) for pair in bound])
        ax.plot(curve.durations[chosen], curve.payloads[chosen], ".", label=f"{limit} of {joint}")
    ax.axvline(curve.present_duration, color="black", linestyle="--", linewidth=0.8, label="the motion as it is")
    if np.isfinite(curve.static_bound):
        label = f"held at rest: {curve.static_bound:.3f} kg"
        ax.axhline(curve.static_bound, color="black", linestyle=":", linewidth=1.0, label=label)
    ax.set(xlabel="least time along the same path [s]", ylabel=f"payload [kg] ({curve.payload_model})")
    ax.grid(alpha=0.3)
    ax.legend()
    return ax


def workspace_capacity(found: WorkspaceCapacity, *, show: str = "mass", ax: Axes | None = None) -> Axes:
    """Heat map of what is carried at every tool position of a plane; hatched where the tool does not get.

    Args:
        found: the cells.
        show: ``"mass"`` [kg], or ``"joint"``, the one that binds.
        ax: axes.

    Raises:
        UnknownNameError: another thing to show.
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
            image.set_clim(0.0, 2.0 * float(masses.max()) or 1.0)  # not a scale of rounding errors
        ax.figure.colorbar(image, ax=ax, shrink=0.8, label=f"payload [kg] ({found.payload_model})")
    else:
        count = len(found.joint_names)
        colours = plt.get_cmap("tab10")(np.arange(count) % 10)
        binding = np.ma.masked_less(found.joint, 0)
        norm = BoundaryNorm(np.arange(count + 1) - 0.5, count)
        ax.pcolormesh(*mesh, binding, cmap=ListedColormap(colours), norm=norm, zorder=2)
        present = np.unique(binding.compressed()).tolist()
        handles = [*(Patch(color=colours[k], label=found.joint_names[k]) for k in present), *handles]
    third = next(k for k, name in enumerate("xyz") if name not in plane.axes)
    accelerated = f"accelerated at ({', '.join(f'{value:g}' for value in found.acceleration)}) m/s²"
    moving = accelerated if found.acceleration.any() else "held at rest"
    title = f"{moving}, tool {'xyz'[third]} = {plane.pose.position[third]:.4g} m"
    ax.set(xlabel=f"tool {plane.axes[0]} [m]", ylabel=f"tool {plane.axes[1]} [m]", title=title, aspect="equal")
    ax.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.0, -0.12), ncols=3, frameon=False)
    return ax


def _edges(centres: Array) -> Array:
    """Ends of cells around their centres."""
    if len(centres) == 1:
        return np.array([centres[0] - 0.5, centres[0] + 0.5])
    middles = 0.5 * (centres[1:] + centres[:-1])
    return np.concatenate([[2.0 * centres[0] - middles[0]], middles, [2.0 * centres[-1] - middles[-1]]])
