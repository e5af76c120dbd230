"""Pictures of closed loops: errors over time, and a front as it is planned and as it is achieved."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from trajevo.base.units import display
from trajevo.errors import checked_name
from trajevo.plots.paper import LIMIT, TWO_BESIDE, Width, colour, curve, inches, key, label, panel, panels
from trajevo.verification.twin.simulated_front import SimulatedFront
from trajevo.verification.twin.simulation import Simulation


def closed_loop(simulation: Simulation, *, axes: Any = None, width: Width = "page") -> Any:
    """How far the tool and the joints are from their reference over time; a dotted line where the motion ends.

    Args:
        simulation: a motion in closed loop.
        axes: two Axes.
        width: ``"column"``, ``"page"`` or millimetres.

    Returns:
        Array of two Axes: the tool with its tolerance [mm], and all joints [mrad or mm].
    """
    units = simulation.robot.joint_units
    names = {"rad": "mrad", "m": "mm"}
    columns = 2 if inches(width) > TWO_BESIDE else 1
    with panels(axes, 2, width=width, columns=columns, height=45.0) as made:
        made[0].plot(simulation.t, 1e3 * simulation.tool_error, color="black", linewidth=1.0)
        made[0].axhline(
            1e3 * simulation.settings.tolerance, color=LIMIT, linestyle="--", linewidth=0.7, label="tolerance"
        )
        made[0].set(ylabel="tool off [mm]", ylim=(0.0, None))
        for k, name in enumerate(simulation.robot.joint_names):
            mixed = f", {names[units[k]]}" if len(set(units)) > 1 else ""
            made[1].plot(simulation.t, 1e3 * simulation.error[:, k], label=f"{name}{mixed}", **curve(k))
        made[1].set_ylabel(f"error of joints [{' or '.join(dict.fromkeys(names[unit] for unit in units))}]")
        for ax in made:
            ax.axvline(simulation.duration, color="0.5", linestyle=":", linewidth=0.8)
            ax.set_xlabel("time [s]")
        tolerance = made[0].get_lines()[1]
        joints = made[1].get_lines()[: simulation.robot.dof]
        key(made[0], [*joints, tolerance])
    return made


def achieved_front(
    found: SimulatedFront, *, objectives: tuple[str, str] | None = None, ax: Axes | None = None, width: Width = "column"
) -> Axes:
    """Two objectives of a front as planned and as achieved in closed loop; what stays undominated is filled.

    Args:
        found: the front in closed loop.
        objectives: names of two objectives; the first two if None.
        ax: axes.
        width: ``"column"``, ``"page"`` or millimetres.

    Returns:
        The axes; solutions that do not settle are drawn as planned alone.

    Raises:
        UnknownNameError: no such objective.
    """
    names = found.front.objective_names
    chosen = [names.index(checked_name("objective", name, names)) for name in objectives or names[:2]]
    shown = [found.front.record.objectives[k] for k in chosen]
    units = [display(one.unit, angle="rad") for one in shown]
    scales = np.array([scale for _, scale in units])
    planned, achieved = (scales * F[:, chosen] for F in (found.front.F[found.rows], found.F))
    settles = np.isfinite(achieved).all(axis=1)
    with panel(ax, width=width, height=58.0) as ax:
        ax.plot(*achieved[settles].T, "o", color=colour(1), fillstyle="none", markersize=3.5, label="achieved")
        ax.plot(*achieved[found.stands].T, "o", color=colour(1), markersize=3.5, label="achieved, undominated")
        ax.plot(*planned.T, ".", color="black", markersize=2.0, label="planned")
        x, y = (label(one.name, unit) for one, (unit, _) in zip(shown, units, strict=True))
        ax.set(xlabel=x, ylabel=y)
        key(ax)
    return ax
