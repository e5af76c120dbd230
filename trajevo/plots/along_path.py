"""Pictures of runs along a path: the path with its speed, its parameter over time, and several fronts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from trajevo.base.arrays import Array
from trajevo.base.units import display, pretty
from trajevo.dynamics.rollout import Rollout, rollout_of
from trajevo.errors import InvalidInputError
from trajevo.formulation.constraints.path_limits import along_path
from trajevo.front.front import Front, Solution

_COLOURS = ("tab:blue", "tab:orange", "tab:green", "tab:red", "tab:purple", "tab:brown")


def path(
    motion: Solution | Rollout, *, points: Array | None = None, samples: int = 1000, ax: Axes | None = None
) -> Axes:
    """A path of two axes with its control polygon; the colour is the speed along the path.

    Args:
        motion: a run along a path; the first trajectory of a rollout is drawn.
        points: points that the path passes or approximates, shape (K, 2) [m or rad].
        samples: instants drawn.
        ax: axes.
    """
    rollout = rollout_of(motion)
    batch = along_path(rollout)
    if batch.n_joints != 2:
        raise InvalidInputError(f"path: a picture in the plane needs 2 axes, the path has {batch.n_joints}")
    unit, factor = _length(rollout)
    sampled = batch[0].sample(samples)
    places, speed = factor * sampled.q[0], factor * np.linalg.norm(sampled.v[0], axis=1)
    ax = ax or plt.subplots(figsize=(8.0, 4.6), layout="constrained")[1]
    polygon = factor * batch.course.path.control_points
    ax.plot(*polygon.T, "o--", color="0.6", linewidth=0.8, markersize=4, label="control polygon")
    if points is not None:
        ax.plot(*(factor * np.asarray(points)).T, "k.", markersize=4, label="points")
    line = LineCollection(list(np.stack([places[:-1], places[1:]], axis=1)), cmap="viridis", linewidth=3.0)
    line.set_array(0.5 * (speed[:-1] + speed[1:]))
    ax.add_collection(line)
    ax.figure.colorbar(line, ax=ax, label=f"speed [{unit}/s]")
    names = rollout.robot.joint_names
    ax.set(xlabel=f"{names[0]} [{unit}]", ylabel=f"{names[1]} [{unit}]")
    ax.set_aspect("equal", adjustable="datalim")
    ax.grid(alpha=0.3)
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, frameon=False)
    return ax


def parameter(motions: Solution | Rollout | Mapping[str, Any], *, samples: int = 400, ax: Axes | None = None) -> Axes:
    """The path's parameter u over time, of one run or of several by label."""
    named = motions if isinstance(motions, Mapping) else {"": motions}
    ax = ax or plt.subplots(figsize=(6.4, 4.0), layout="constrained")[1]
    shares = np.linspace(0.0, 1.0, samples)
    for label, motion in named.items():
        batch = along_path(rollout_of(motion))[0]
        ax.plot(shares * float(batch.duration[0]), batch.course.parameter(shares[None])[0], label=label)
    ax.set(xlabel="time [s]", ylabel="parameter u of the path", ylim=(-0.02, 1.02))
    ax.grid(alpha=0.3)
    if any(named):
        ax.legend()
    return ax


def fronts(named: Mapping[str, Front], *, mark: Mapping[str, Solution] | None = None, ax: Axes | None = None) -> Axes:
    """Fronts of the same two objectives in one picture, the second objective on a logarithmic scale.

    Args:
        named: label -> front.
        mark: label -> solution to mark.
        ax: axes.
    """
    if not named or any(len(front.objective_names) != 2 or not len(front) for front in named.values()):
        raise InvalidInputError("fronts: expected fronts of two objectives with at least one point each")
    ax = ax or plt.subplots(figsize=(7.2, 4.8), layout="constrained")[1]
    record = next(iter(named.values())).record
    shown = [display(objective.unit, angle=record.angle, length=record.length) for objective in record.objectives]
    factors = np.array([factor for _, factor in shown])
    for i, (label, front) in enumerate(named.items()):
        ax.plot(*(front.F * factors).T, ".", markersize=4, color=_COLOURS[i % len(_COLOURS)], label=label)
    for i, (label, solution) in enumerate((mark or {}).items()):
        at = solution.front.F[solution.index] * factors
        ax.plot(*at, "*Dos"[i % 4], color="black", markersize=11 if i % 4 == 0 else 7, label=label)
    named_units = zip(record.objectives, shown, strict=True)
    labels = [f"{objective.name} [{pretty(unit)}]" for objective, (unit, _) in named_units]
    ax.set(xlabel=labels[0], ylabel=labels[1], yscale="log")
    ax.grid(alpha=0.3, which="both")
    ax.legend()
    return ax


def _length(rollout: Rollout) -> tuple[str, float]:
    """Unit and factor of the axes: mm for linear ones."""
    unit = rollout.robot.joint_units[0]
    return display(unit, angle="rad", length="mm")
