"""Pictures of effort and payload: utilisation of the actuators, the DLCC iteration, payload against time, tracking."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from trajevo.base.arrays import Array, numbers
from trajevo.capacity.capacity import Capacities, Capacity, EffortAlong, your_margin
from trajevo.capacity.dlcc import effort_along
from trajevo.capacity.payload_time import PayloadCurve
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError, checked_name
from trajevo.formulation.objectives import UNUSED_PAYLOAD
from trajevo.front.front import Front, Solution
from trajevo.front.thinning import told_share
from trajevo.plots.motion import draw_limits
from trajevo.plots.paper import BEYOND, LIMIT, NOTE, Width, colour, curve, key, panel, scale_beside, sequence
from trajevo.plots.pareto import quantities
from trajevo.solvers.gradient.weighted_sum import WeightedOptimum

#: Limits of effort, of which the picture tells, are drawn as far from the curves as this, in extents of these.
_NEAR = 1.5


def effort_utilisation(
    motion: Solution | Rollout | WeightedOptimum | EffortAlong,
    *,
    mass: float | None = None,
    ax: Axes | None = None,
    width: Width = "column",
) -> Axes:
    """Effort of every joint as a share of its limit over time, with the payload's capacity marked.

    Args:
        motion: a solution, an optimum, the first trajectory of a rollout, or the result of
            :func:`~trajevo.capacity.dlcc.effort_along`.
        mass: mass of the payload [kg]; the motion's own if None.
        ax: axes.
        width: ``"column"``, ``"page"`` or millimetres.

    Returns:
        The axes; grey is beyond the limits that the motion's problem keeps, the dot marks where the capacity binds, at
        the effort with ``mass``. With a margin, lines mark the robot's full limits. Limits that would leave the curves
        less than half of the picture are told above it instead.
    """
    found = motion if isinstance(motion, EffortAlong) else effort_along(motion)
    limits = found.sides
    if not limits.limited.any():
        raise InvalidInputError(f"effort_utilisation: robot {found.robot!r} has no effort limits")
    carried = found.mass if mass is None else mass
    effort = found.unloaded + carried * found.per_kilogram
    share = effort / limits.toward(effort)
    limited, capacity = np.flatnonzero(limits.limited), found.capacity
    with panel(ax, width=width, height=54.0) as ax:
        for k in limited.tolist():
            ax.plot(found.times, share[:, k], label=found.joint_names[k], **curve(k))
        draw_limits(ax, share[:, limited], np.array([-1.0]), np.array([1.0]), "", coloured=False, near=_NEAR)
        if capacity.joint:
            joint, instant = found.joint_names.index(capacity.joint), int(np.abs(found.times - capacity.time).argmin())
            ax.plot(capacity.time, share[instant, joint], "ko")
            _note(ax, f"{capacity.joint} binds at {capacity.mass:.2f} kg")
        if capacity.kept < 1.0:
            _full_limits(ax, 1.0 / capacity.kept)
        limit = "limit" if capacity.kept == 1.0 else f"{100.0 * capacity.kept:.4g} % of the limit"
        ax.set(xlabel="time [s]", ylabel=f"effort / {limit}, with {carried:g} kg")
        key(ax)
    return ax


def _note(ax: Axes, text: str) -> None:
    """A note above a picture, on the left, where limits that are not drawn are told on the right."""
    if ax.get_title(loc="right"):
        text += "; " + ax.get_title(loc="right")
        ax.set_title("", loc="right")
    ax.set_title(text, loc="left", color=NOTE)


def _full_limits(ax: Axes, full: float) -> None:
    """Lines at the robot's full limits, beyond kept limits that are shown."""
    low, high = ax.get_ylim()
    label: str | None = "robot's full limit"
    for bound, kept in ((full, high > 1.0), (-full, low < -1.0)):
        if kept:
            ax.axhline(bound, color="black", linestyle="-.", linewidth=0.8, label=label)
            label = None
    reach = full + 0.05 * (high - low)
    low, high = (min(low, -reach) if low < -1.0 else low), (max(high, reach) if high > 1.0 else high)
    for patch in ax.patches:  # what lies beyond the kept limits
        top, bottom = (high, 1.0) if patch.get_y() > 0.0 else (-1.0, low)  # type: ignore[attr-defined]
        patch.set(y=bottom, height=top - bottom)
    ax.set_ylim(low, high)


def capacity_margins(capacity: Capacity, *, ax: Axes | None = None, width: Width = "column") -> Axes:
    """Unused share of every joint's effort limit over time with the largest payload; the dot marks where it binds."""
    if not np.isfinite(capacity.margins).all():
        raise InvalidInputError("capacity_margins: a payload without bound leaves no margins")
    with panel(ax, width=width, height=45.0) as ax:
        for k, (name, margin) in enumerate(zip(capacity.joint_names, 100.0 * capacity.margins.T, strict=True)):
            if (margin < 100.0).any():
                ax.plot(capacity.times, margin, label=f"{name}: {margin.min():.1f} %", **curve(k))
        if capacity.joint:
            ax.plot(capacity.time, 100.0 * capacity.margins.min(), "ko")
        ax.axhspan(min(ax.get_ylim()[0], -5.0), 0.0, color=BEYOND, zorder=0, linewidth=0)
        ax.margins(y=0.0)
        margin = "" if capacity.kept == 1.0 else f", with {your_margin(1.0 - capacity.kept)}"
        ax.set_title(f"{capacity.mass:.4g} kg ({capacity.payload_model}){margin}", loc="left", color=NOTE)
        ax.set(xlabel="time [s]", ylabel="effort limit left [%]")
        key(ax, title="least")
    return ax


def front_capacities(
    found: Capacities, *, knee: int | None = None, ax: Axes | None = None, width: Width = "column"
) -> Axes:
    """Largest payload of every solution of a front against its time; colour and shape tell the binding joint.

    Args:
        found: result of :func:`trajevo.capacity.dlcc.capacities`.
        knee: row of the front to be ringed, such as ``front.knee().index``; none if None.
        ax: axes.
        width: ``"column"``, ``"page"`` or millimetres.
    """
    with panel(ax, width=width, height=45.0) as ax:
        for joint in np.unique(found.joint):
            chosen = (found.joint == joint) & np.isfinite(found.mass)
            if chosen.any():
                name = f"{found.joint_names[joint]} binds" if joint >= 0 else "none feasible"
                ax.plot(found.duration[chosen], found.mass[chosen], label=name, **dots(int(joint)))
        if knee is not None and np.isfinite(found.mass[knee]):
            at = found.duration[knee], found.mass[knee]
            ax.plot(*at, "o", mfc="none", color="black", markersize=7, label="knee")
        ax.set(xlabel="time [s]", ylabel=f"largest payload [kg] ({found.payload_model})")
        key(ax)
    return ax


def dots(number: int) -> dict[str, Any]:
    """Colour and shape of the points of one joint."""
    return {"linestyle": "none", "marker": "os^vDPX"[number % 7], "color": colour(number), "markersize": 2.5}


def payload_front(front: Front, *, colour: str | None = None, ax: Axes | None = None, width: Width = "column") -> Axes:
    """Payload against time for a front whose payload is a variable; the colour is a third objective.

    Args:
        front: a front whose problem has the payload's mass as a variable.
        colour: name of the objective that the colour shows; if None, the first besides time and payload, if any.
        ax: axes.
        width: ``"column"``, ``"page"`` or millimetres.

    Raises:
        UnknownNameError: no such objective.
        InvalidInputError: the payload is not a variable.
    """
    record = front.record
    if front.problem.payload_range is None:
        raise InvalidInputError("payload_front: expected a front whose payload is a variable")
    names = [objective.name for objective in record.objectives]
    if colour is not None:
        checked_name("objective", colour, names)
    third = colour or next((name for name in names if name not in ("time", UNUSED_PAYLOAD)), None)
    drawn = front.thinned()
    times, masses = front.rollouts_of(drawn).trajectory.duration, front.X[drawn, -1]
    with panel(ax, width=width, height=45.0) as ax:
        if third is None:
            ax.plot(times, masses, **dots(0))
        else:
            labels, factors = quantities(front)
            place = names.index(third)
            shown: dict[str, Any] = {"c": front.F[drawn, place] * factors[place], "cmap": sequence("viridis_r")}
            image = ax.scatter(times, masses, s=7, linewidths=0, **shown)
            scale_beside(ax, image, labels[place])
        most = front.problem.payload_range[1]
        ax.axhline(most, color=LIMIT, linestyle=":", linewidth=0.8, label=f"greatest allowed: {most:.4g} kg")
        ax.set(xlabel="time [s]", ylabel=f"payload [kg] ({front.problem.dynamics.payload.model})")
        ax.set_title(told_share(drawn, front), loc="left", color=NOTE)
        key(ax)
    return ax


def dlcc_iteration(capacity: Capacity, *, ax: Axes | None = None, width: Width = "column") -> Axes:
    """Greatest effort over limit for every payload that the iteration tried, by the joint that has it."""
    if not capacity.history:
        raise InvalidInputError("dlcc_iteration: a closed-form capacity has no history; pass that of dlcc_iterative")
    with panel(ax, width=width, height=45.0) as ax:
        for joint in dict.fromkeys(name for _, _, name in capacity.history):
            points = np.array([(mass, used) for mass, used, name in capacity.history if name == joint])
            ax.plot(*points.T, label=joint, **dots(capacity.joint_names.index(joint)))
        ax.axhline(1.0, color=LIMIT, linestyle="--", linewidth=0.7)
        if np.isfinite(capacity.mass):
            ax.axvline(capacity.mass, color=colour(1), linewidth=0.8, label=f"last feasible: {capacity.mass:.3f} kg")
        ax.set(xlabel=f"payload [kg] ({capacity.payload_model})", ylabel="greatest effort / limit")
        key(ax)
    return ax


def payload_curve(
    curve: PayloadCurve, *, at_rest: float | None = None, ax: Axes | None = None, width: Width = "column"
) -> Axes:
    """Payload against the least time in which it can be carried along the points.

    Args:
        curve: curve of least times.
        at_rest: greatest payload that the robot can hold at rest [kg], drawn as a bound.
        ax: axes.
        width: ``"column"``, ``"page"`` or millimetres.
    """
    full, margin = curve.at_full_limits, f"with {your_margin(curve.effort_margin)}"
    with panel(ax, width=width, height=45.0) as ax:
        ax.plot(curve.times, curve.payloads, "o-", color=colour(0), label=margin if curve.effort_margin else None)
        if full is not None:
            ax.plot(full.times, full.payloads, "o-.", color="0.5", label="at the robot's full limits")
        if at_rest is not None:
            name = f"held at rest: {at_rest:.4f} kg"
            ax.axhline(at_rest, color=LIMIT, linestyle=":", linewidth=0.8, label=name)
        ax.set(xlabel="least time [s]", ylabel=f"payload [kg] ({curve.payload_model})")
        if at_rest is not None or full is not None:
            key(ax)
    return ax


def tracking_error(t: Array, error: Array, *, ax: Axes | None = None, width: Width = "column") -> Axes:
    """Distance of the tool to its desired path over time, shapes (T,) [s] and (T,) [m]; drawn in mm."""
    distance = 1000.0 * numbers(error, name="error", shape=("T",))
    with panel(ax, width=width, height=42.0) as ax:
        ax.plot(t, distance, **curve(0))
        greatest = int(distance.argmax())
        ax.plot(t[greatest], distance[greatest], "ko", label=f"greatest {distance[greatest]:.4f} mm")
        ax.set(xlabel="time [s]", ylabel="tracking error [mm]")
        key(ax)
    return ax


def desired_path(positions: Any, *, ax: Any) -> Any:
    """Add a desired path, shape (K, 3) [m], to a picture of :func:`trajevo.plots.motion.tool_path`."""
    path = numbers(positions, name="positions", shape=("K", 3))
    with panel(ax, width="column", height=1.0, space=True) as space:
        space.plot(*path.T, color="black", linestyle="--", linewidth=0.8, label="desired")
        key(space)
    return ax
