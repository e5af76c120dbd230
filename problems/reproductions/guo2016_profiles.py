"""Figures 9 to 13 of Guo et al. 2016: joints over time at the times of Table 7 and at the least F_c, and capacity."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.units import pretty
from trajevo.capacity.capacity import Capacity
from trajevo.capacity.dlcc import dlcc, dlcc_iterative
from trajevo.dynamics.rollout import Rollout
from trajevo.reproduction.paper import Desk, NumberTable, PrintedNumber, Shown
from trajevo.trajectory.batch import DERIVATIVES

from ..hybrid_manipulator import HybridManipulator, paper_solution
from .guo2016_motions import SHOWN, at_table_7, optimum

#: Quantity of a figure -> its order as a derivative of the joints.
_ORDERS = {"displacement": 0, "velocity": 1, "acceleration": 2, "jerk": 3}

#: Instants of each motion.
_INSTANTS = 200

#: Payload that is added in every step of the iteration [kg]; the paper does not print its own.
STEP = 0.05

Quantity = Literal["displacement", "velocity", "acceleration", "jerk"]


def profile(desk: Desk, quantity: Quantity) -> Shown:
    """Figure 9, 10, 11 or 12."""
    order = _ORDERS[quantity]
    curves = {name: _joints(one, order) for name, one in _motions(desk).items()}
    low, high = (bound * SHOWN for bound in at_table_7().limits.bounds(DERIVATIVES[order]))
    rate = ("", "/s", "/s^2", "/s^3")[order]
    share = max(float(np.max(np.abs(values) / np.maximum(np.abs(low), high))) for _, values in curves.values())
    return Shown(
        table=_table(curves, (f"mm{rate}", f"rad{rate}")),
        figure=_panels(curves, quantity, (f"mm{rate}", f"rad{rate}"), low, high)[0].figure,
        said=[f"At most {100.0 * share:.3g} % of a limit is used." if order else "Limits of Table 2 are kept."],
    )


def _motions(desk: Desk) -> dict[str, Rollout]:
    return {"Table 7": at_table_7(), "least F_c": optimum(desk, "printed").rollout}


def _joints(motion: Rollout, order: int) -> tuple[Array, Array]:
    """Evenly spaced instants (T,) [s] and a derivative of the joints at them, shape (T, 5) [mm, rad and s]."""
    sampled = motion.trajectory.sample(_INSTANTS)
    return sampled.t[0], (sampled.q, sampled.v, sampled.a, sampled.j)[order][0] * SHOWN


def _table(curves: dict[str, tuple[Array, Array]], units: tuple[str, str]) -> NumberTable:
    """All curves, one row for each motion and instant."""
    rows: list[tuple[str | float, ...]] = []
    for name, (t, values) in curves.items():
        rows += [(name, at, *row) for at, row in zip(t.tolist(), values.tolist(), strict=True)]
    headers = [f"joint {joint} [{units[joint > 3]}]" for joint in range(1, 6)]
    return NumberTable(("motion", "time [s]", *headers), rows)


def _panels(
    curves: dict[str, tuple[Array, Array]],
    quantity: str,
    units: tuple[str, str],
    low: Array,
    high: Array,
    extra: int = 0,
) -> Any:
    """Joints 1 to 3 on the left and 4, 5 on the right, one row for each motion, and ``extra`` empty panels below."""
    from trajevo.plots.motion import draw_limits
    from trajevo.plots.paper import curve, key, label, panels

    with panels(None, 2 * len(curves) + extra, width="page", columns=2, height=36.0) as made:
        lines = []
        for row, (name, (t, values)) in enumerate(curves.items()):
            for ax, joints, unit in zip(made[2 * row : 2 * row + 2], (slice(0, 3), slice(3, 5)), units, strict=True):
                for joint in range(5)[joints]:
                    lines += ax.plot(t, values[:, joint], **curve(joint), label=f"joint {joint + 1}")
                draw_limits(ax, values[:, joints], low[joints], high[joints], pretty(unit))
                ax.set_ylabel(label(quantity, unit))
                ax.set_xlabel(f"time [s], {name}")
        key(made[0], lines[:5])
    return made


def with_capacity(desk: Desk) -> Shown:
    """Figure 13, forces and torques, with the payload capacity of section 6 by the iteration of section 5."""
    curves = {name: (one.trajectory.sample(_INSTANTS).t[0], _forces(one)) for name, one in _motions(desk).items()}
    high = at_table_7().limits.effort
    made = _panels(curves, "effort", ("N", "N*m"), -high, high, extra=2)
    vertical = dlcc_iterative(at_table_7(), step=STEP)
    along = dlcc_iterative(at_table_7("as_run"), step=STEP)
    _iterations(made[-2], vertical, "weight downwards")
    _iterations(made[-1], along, "weight along the tool")
    return Shown(
        numbers=[_capacity(vertical)],
        table=_table(curves, ("N", "N*m")),
        figure=made[0].figure,
        said=_why_not(vertical, along),
    )


def _forces(motion: Rollout) -> Array:
    """Forces and torques at evenly spaced instants, shape (T, 5) [N, N·m]."""
    sampled = motion.trajectory.sample(_INSTANTS)
    efforts: Array = motion.effort_in(sampled.q, sampled.v, sampled.a, sampled.t)[0]
    return efforts


def _iterations(ax: Any, found: Capacity, title: str) -> None:
    """Greatest force over its limit by the payload that was tried."""
    from trajevo.plots.paper import LIMIT, NOTE, curve, panel

    mass, used, _ = zip(*found.history, strict=True)
    with panel(ax, width="page", height=36.0):
        ax.plot(mass, used, **curve(0))
        ax.axhline(1.0, color=LIMIT, linestyle="--", linewidth=0.7)
        ax.plot(mass[-1], used[-1], "ko")
        ax.set_title(f"{mass[-1]:.4g} kg is the first too heavy", loc="left", color=NOTE)
        ax.set(xlabel=f"payload [kg], {title}", ylabel="greatest force / limit")


def _capacity(vertical: Capacity) -> PrintedNumber:
    rest = _at_rest(12.65)
    return PrintedNumber(
        of="largest payload (DLCC)",
        unit="kg",
        printed="12.65",
        ours=vertical.mass,
        differs=True,
        why=f"at rest 12.65 kg already need {rest:.1f} N of the third screw, whose limit is 500 N",
    )


def _at_rest(payload: float) -> float:
    """Force of the third screw that holds a payload at rest [N]."""
    problem = HybridManipulator(payload=payload, payload_bounds=(0.0, payload), convention="printed")
    return float(np.abs(problem.rollout(paper_solution()).effort[0, 0, 2]))


def _why_not(vertical: Capacity, along: Capacity) -> list[str]:
    closed = {name: dlcc(at_table_7(name)).mass for name in ("printed", "continuous", "as_run")}
    bound = (500.0 - _at_rest(0.0)) / (_at_rest(1.0) - _at_rest(0.0))
    return [
        f"The iteration in steps of {STEP:g} kg ends at {vertical.mass:.2f} kg, at {closed['printed']:.4f} kg without "
        f"steps, and at {closed['continuous']:.4f} kg for a rigid payload with its inertia. At rest alone nothing "
        f"above {bound:.4f} kg can be held.",
        f"With the payload's weight along the tool, which is wrong, the iteration ends at {along.mass:.2f} kg and the "
        f"first payload that is too heavy is {along.history[-1][0]:.2f} kg, the number that the paper prints.",
    ]
