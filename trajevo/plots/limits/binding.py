"""What one motion carries at different paces, by each limit, and which limit binds where."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from trajevo.base.arrays import Array
from trajevo.capacity.accuracy.found import CAUSES
from trajevo.capacity.accuracy.paces import PaceCapacity
from trajevo.plots.paper import BEYOND, NOTE, Width, curve, key, log_ticks, panel

#: Top of the picture over the greatest payload under all limits.
_ROOM = 1.8


def what_binds(paces: PaceCapacity, *, ax: Axes | None = None, width: Width = "column") -> Axes:
    """Payload by each limit against the cycle time; the thick line is what is carried, in the look of what binds.

    Args:
        paces: result of :func:`trajevo.capacity_by_pace`.
        ax: axes.
        width: ``"column"``, ``"page"`` or millimetres.

    Returns:
        The axes, with a logarithmic time; grey where joints would exceed velocity, acceleration or jerk.
    """
    times, carried = paces.cycle_times, paces.mass
    numbers = {cause: number for number, cause in enumerate(CAUSES)}
    with panel(ax, width=width, height=58.0) as ax:
        for cause in paces.causes:
            mass = paces.by(cause)
            ax.plot(times, np.where(np.isfinite(mass), mass, np.nan), **_look(numbers[cause]), label=CAUSES[cause])
        for cause in dict.fromkeys(filter(None, paces.binding)):
            bound = np.array([one == cause for one in paces.binding])
            look = _look(numbers[cause]) | {"linewidth": 2.6, "linestyle": "-", "alpha": 0.55}
            ax.plot(*_stretch(times, carried, bound), **look)
        finite = carried[np.isfinite(carried)]
        ax.set_xscale("log")
        ax.set(
            xlabel="cycle time, at rest included [s]",
            ylabel=f"largest payload [kg] ({paces.capacities[0].payload_model})",
            xlim=(times[0], times[-1]),
            ylim=(0.0, _ROOM * float(finite.max()) if len(finite) and finite.max() > 0.0 else None),
        )
        log_ticks(ax.xaxis)
        fastest = paces.least_duration + float(times[0] - paces.durations[0])
        if fastest > times[0]:
            ax.axvspan(times[0], min(fastest, float(times[-1])), color=BEYOND, linewidth=0.0, zorder=0)
            ax.text(times[0] * 1.02, 0.0, "joints too fast", color=NOTE, rotation=90.0, va="bottom", ha="left")
        key(ax)
    return ax


def _look(number: int) -> dict[str, Any]:
    """Colour and line of a cause, always the same one."""
    return {"linewidth": 0.9} | curve(number)


def _stretch(times: Array, mass: Array, bound: Array) -> tuple[Array, Array]:
    """The line where something binds, on to the middle of the way to where it does not."""
    at, values = [], []
    for k in np.flatnonzero(bound).tolist():
        for there in [k - 1, k] if k and not bound[k - 1] else [k]:
            if there == k:
                at.append(float(times[k]))
                values.append(float(mass[k]))
            else:
                at += [np.nan, float(np.sqrt(times[there] * times[k]))]
                values += [np.nan, float(0.5 * (mass[there] + mass[k]))]
        if k + 1 < len(times) and not bound[k + 1]:
            at.append(float(np.sqrt(times[k] * times[k + 1])))
            values.append(float(0.5 * (mass[k] + mass[k + 1])))
    return np.array(at), np.array(values)
