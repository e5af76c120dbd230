"""What a motion carries over its speed, one line for each share of time in motion, with what binds as markers."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from trajevo.capacity.accuracy.found import CAUSES
from trajevo.capacity.duty.capacity_study import CapacityStudy
from trajevo.errors import checked_name
from trajevo.plots.paper import Width, curve, key, panel

#: Markers of causes, in their order.
_MARKERS = "osD^v<>Ph"

#: Top of the picture over the greatest payload.
_ROOM = 1.15


def payload_by_duty(
    study: CapacityStudy, *, load: str | None = None, ax: Axes | None = None, width: Width = "column"
) -> Axes:
    """The largest payload over the speed, one line for each duty; a marker tells what binds.

    Args:
        study: result of :func:`trajevo.capacity_study`.
        load: name of a load; the first one if None.
        ax: axes.
        width: ``"column"``, ``"page"`` or millimetres.

    Returns:
        The axes.

    Raises:
        UnknownNameError: no such load.
    """
    name = study.loads[0] if load is None else checked_name("load", load, study.loads)
    column = study.loads.index(name)
    mass, cause = study.mass[:, column], study.cause[:, column]
    with panel(ax, width=width, height=58.0) as ax:
        for d, duty in enumerate(study.duties.tolist()):
            carried = np.where(np.isfinite(mass[:, d]), mass[:, d], np.nan)
            look = {"linewidth": 0.9} | curve(d)
            ax.plot(study.speeds, carried, **look, label=f"{100.0 * duty:g} % of the time in motion")
            for number, one in enumerate(CAUSES):
                bound = cause[:, d] == one
                ax.plot(study.speeds[bound], carried[bound], _MARKERS[number], color=look["color"], markersize=3.2)
        finite = mass[np.isfinite(mass)]
        top = _ROOM * float(finite.max()) if len(finite) and finite.max() > 0.0 else None
        ax.set(xlabel="speed over that of the motion", ylabel="largest payload [kg]", ylim=(0.0, top))
        if len(study.loads) > 1 or load is not None:
            ax.set_title(name)
        shown = [one for one in CAUSES if (cause == one).any()]
        marks = [
            Line2D(
                [],
                [],
                color="0.3",
                linestyle="",
                markersize=3.2,
                marker=_MARKERS[list(CAUSES).index(one)],
                label=CAUSES[one],
            )
            for one in shown
        ]
        key(ax, [*ax.get_legend_handles_labels()[0], *marks])
    return ax
