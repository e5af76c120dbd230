"""Pictures of effort and payload: utilisation of the actuators, the DLCC iteration, payload against time, tracking."""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

from trajevo.base.arrays import Array, numbers
from trajevo.base.units import pretty
from trajevo.capacity.capacity import Capacities, Capacity, EffortAlong, your_margin
from trajevo.capacity.dlcc import effort_along
from trajevo.capacity.payload_time import PayloadCurve
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError, checked_name
from trajevo.formulation.objectives import UNUSED_PAYLOAD
from trajevo.front.front import Front, Solution
from trajevo.front.thinning import told_share
from trajevo.solvers.gradient.weighted_sum import WeightedOptimum


def effort_utilisation(
    motion: Solution | Rollout | WeightedOptimum | EffortAlong, *, mass: float | None = None, ax: Axes | None = None
) -> Axes:
    """Effort of every joint as a share of its limit over time, with the payload's capacity marked.

    Args:
        motion: a solution, an optimum, the first trajectory of a rollout, or the result of
            :func:`~trajevo.capacity.dlcc.effort_along`.
        mass: mass of the payload [kg]; the motion's own if None.
        ax: axes.

    Returns:
        The axes; grey is beyond the limits that the motion's problem keeps, the dot marks where the capacity binds, at
        the effort with ``mass``. With a margin, lines mark the robot's full limits.
    """
    found = motion if isinstance(motion, EffortAlong) else effort_along(motion)
    limits = found.sides
    if not limits.limited.any():
        raise InvalidInputError(f"effort_utilisation: robot {found.robot!r} has no effort limits")
    carried = found.mass if mass is None else mass
    effort = found.unloaded + carried * found.per_kilogram
    share = effort / limits.toward(effort)
    ax = ax or plt.subplots(figsize=(7.6, 4.2), layout="constrained")[1]
    for joint, name in enumerate(found.joint_names):
        if limits.limited[joint]:
            ax.plot(found.times, share[:, joint], label=name)
    capacity = found.capacity
    if capacity.joint:
        joint, instant = found.joint_names.index(capacity.joint), int(np.abs(found.times - capacity.time).argmin())
        ax.plot(capacity.time, share[instant, joint], "ko")
        ax.annotate(
            f"{capacity.joint} binds at {capacity.mass:.2f} kg",
            (capacity.time, share[instant, joint]),
            (0.3, 0.66),
            textcoords="axes fraction",
            arrowprops={"arrowstyle": "->"},
        )
    full = 1.0 / capacity.kept
    low, high = min(-full - 0.15, *ax.get_ylim()), max(full + 0.15, *ax.get_ylim())
    ax.axhspan(1.0, high, color="0.9", zorder=0)
    ax.axhspan(low, -1.0, color="0.9", zorder=0)
    if capacity.kept < 1.0:
        for bound, label in ((full, "robot's full limit"), (-full, None)):
            ax.axhline(bound, color="black", linestyle="-.", linewidth=1.0, label=label)
    limit = "limit" if capacity.kept == 1.0 else f"{100.0 * capacity.kept:.4g} % of the limit"
    ax.set(xlabel="time [s]", ylabel=f"effort / {limit}, with {carried:g} kg", ylim=(low, high))
    ax.grid(alpha=0.3)
    ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return ax


def capacity_margins(capacity: Capacity, *, ax: Axes | None = None) -> Axes:
    """Unused share of every joint's effort limit over time with the largest payload; the dot marks where it binds."""
    if not np.isfinite(capacity.margins).all():
        raise InvalidInputError("capacity_margins: a payload without bound leaves no margins")
    ax = ax or plt.subplots(figsize=(7.6, 4.2), layout="constrained")[1]
    for name, margin in zip(capacity.joint_names, 100.0 * capacity.margins.T, strict=True):
        if (margin < 100.0).any():
            ax.plot(capacity.times, margin, label=f"{name}: {margin.min():.1f} %")
    if capacity.joint:
        ax.plot(capacity.time, 100.0 * capacity.margins.min(), "ko")
    ax.axhspan(min(ax.get_ylim()[0], -5.0), 0.0, color="0.9", zorder=0)
    margin = "" if capacity.kept == 1.0 else f", with {your_margin(1.0 - capacity.kept)}"
    title = f"{capacity.mass:.4g} kg ({capacity.payload_model}){margin}"
    ax.set(xlabel="time [s]", ylabel="effort limit left [%]", title=title)
    ax.grid(alpha=0.3)
    ax.legend(title="least", loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return ax


def front_capacities(found: Capacities, *, knee: int | None = None, ax: Axes | None = None) -> Axes:
    """Largest payload of every solution of a front against its time; the colour is the binding joint.

    Args:
        found: result of :func:`trajevo.capacity.dlcc.capacities`.
        knee: row of the front to be ringed, such as ``front.knee().index``; none if None.
        ax: axes.
    """
    ax = ax or plt.subplots(figsize=(6.8, 4.2), layout="constrained")[1]
    for joint in np.unique(found.joint):
        chosen = (found.joint == joint) & np.isfinite(found.mass)
        if chosen.any():
            label = f"{found.joint_names[joint]} binds" if joint >= 0 else "none feasible"
            ax.plot(found.duration[chosen], found.mass[chosen], ".", label=label)
    if knee is not None and np.isfinite(found.mass[knee]):
        at = found.duration[knee], found.mass[knee]
        ax.plot(*at, "o", mfc="none", color="black", markersize=10, label="knee")
    ax.set(xlabel="time [s]", ylabel=f"largest payload [kg] ({found.payload_model})")
    ax.grid(alpha=0.3)
    ax.legend()
    return ax


def payload_front(front: Front, *, colour: str | None = None, ax: Axes | None = None) -> Axes:
    """Payload against time for a front whose payload is a variable; the colour is a third objective.

    Args:
        front: a front whose problem has the payload's mass as a variable.
        colour: name of the objective that the colour shows; if None, the first besides time and payload, if any.
        ax: axes.

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
    ax = ax or plt.subplots(figsize=(6.8, 4.2), layout="constrained")[1]
    drawn = front.thinned()
    times, masses = front.rollouts_of(drawn).trajectory.duration, front.X[drawn, -1]
    if third is None:
        ax.plot(times, masses, ".")
    else:
        place = names.index(third)
        image = ax.scatter(times, masses, c=front.F[drawn, place], s=14, cmap="viridis_r")
        ax.figure.colorbar(image, ax=ax, label=f"{third} [{pretty(record.objectives[place].unit)}]")
    most = front.problem.payload_range[1]
    ax.axhline(most, color="black", linestyle=":", linewidth=1.0, label=f"greatest allowed: {most:.4g} kg")
    ax.set(xlabel="time [s]", ylabel=f"payload [kg] ({front.problem.dynamics.payload.model})")
    ax.set_title(told_share(drawn, front), fontsize="small")
    ax.grid(alpha=0.3)
    ax.legend()
    return ax


def dlcc_iteration(capacity: Capacity, *, ax: Axes | None = None) -> Axes:
    """Greatest effort over limit for every payload that the iteration tried; the colour is the joint that has it."""
    if not capacity.history:
        raise InvalidInputError("dlcc_iteration: a closed-form capacity has no history; pass that of dlcc_iterative")
    ax = ax or plt.subplots(figsize=(6.4, 4.2), layout="constrained")[1]
    for joint in dict.fromkeys(name for _, _, name in capacity.history):
        points = np.array([(mass, used) for mass, used, name in capacity.history if name == joint])
        ax.plot(*points.T, ".", label=joint)
    ax.axhline(1.0, color="black", linestyle="--", linewidth=0.8)
    if np.isfinite(capacity.mass):
        ax.axvline(capacity.mass, color="tab:red", linewidth=0.8, label=f"last feasible: {capacity.mass:.3f} kg")
    ax.set(xlabel=f"payload [kg] ({capacity.payload_model})", ylabel="greatest effort / limit")
    ax.grid(alpha=0.3)
    ax.legend()
    return ax


def payload_curve(curve: PayloadCurve, *, at_rest: float | None = None, ax: Axes | None = None) -> Axes:
    """Payload against the least time in which it can be carried along the points.

    Args:
        curve: curve of least times.
        at_rest: greatest payload that the robot can hold at rest [kg], drawn as a bound.
        ax: axes.
    """
    ax = ax or plt.subplots(figsize=(6.4, 4.2), layout="constrained")[1]
    full, margin = curve.at_full_limits, f"with {your_margin(curve.effort_margin)}"
    ax.plot(curve.times, curve.payloads, "o-", label=margin if curve.effort_margin else None)
    if full is not None:
        ax.plot(full.times, full.payloads, "o-.", color="0.5", label="at the robot's full limits")
    if at_rest is not None:
        label = f"held at rest: {at_rest:.4f} kg"
        ax.axhline(at_rest, color="black", linestyle=":", linewidth=1.0, label=label)
    if at_rest is not None or full is not None:
        ax.legend()
    ax.set(xlabel="least time [s]", ylabel=f"payload [kg] ({curve.payload_model})")
    ax.grid(alpha=0.3)
    return ax


def tracking_error(t: Array, error: Array, *, ax: Axes | None = None) -> Axes:
    """Distance of the tool to its desired path over time, shapes (T,) [s] and (T,) [m]; drawn in mm."""
    distance = 1000.0 * numbers(error, name="error", shape=("T",))
    ax = ax or plt.subplots(figsize=(6.4, 3.6), layout="constrained")[1]
    ax.plot(t, distance)
    greatest = int(distance.argmax())
    ax.plot(t[greatest], distance[greatest], "ko", label=f"greatest {distance[greatest]:.4f} mm")
    ax.set(xlabel="time [s]", ylabel="tracking error [mm]")
    ax.grid(alpha=0.3)
    ax.legend()
    return ax


def desired_path(positions: Any, *, ax: Any) -> Any:
    """Add a desired path, shape (K, 3) [m], to a picture of :func:`trajevo.plots.motion.tool_path`."""
    path = numbers(positions, name="positions", shape=("K", 3))
    ax.plot(*path.T, color="black", linestyle="--", linewidth=1.0, label="desired")
    ax.legend()
    return ax
