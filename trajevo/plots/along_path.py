"""Pictures of runs along a path: the path with its speed, its parameter over time, and several fronts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from trajevo.base.arrays import Array
from trajevo.base.units import display
from trajevo.dynamics.rollout import Rollout, rollout_of
from trajevo.errors import InvalidInputError
from trajevo.formulation.constraints.path_limits import along_path
from trajevo.front.front import Front, Solution
from trajevo.plots.limits.gap import below_all
from trajevo.plots.paper import Width, colour, curve, key, log_ticks, panel, scale_beside, sequence
from trajevo.plots.pareto import quantities
from trajevo.verification.front_bound import FrontBound

#: Slices of durations in which the area where no motion lies is drawn.
_SLICES = 400


def path(
    motion: Solution | Rollout,
    *,
    points: Array | None = None,
    samples: int = 1000,
    ax: Axes | None = None,
    width: Width = "page",
) -> Axes:
    """A path of two axes with its control polygon; the colour is the speed along the path.

    Args:
        motion: a run along a path; the first trajectory of a rollout is drawn.
        points: points that the path passes or approximates, shape (K, 2) [m or rad].
        samples: instants drawn.
        ax: axes.
        width: ``"column"``, ``"page"`` or millimetres.
    """
    rollout = rollout_of(motion)
    batch = along_path(rollout)
    if batch.n_joints != 2:
        raise InvalidInputError(f"path: a picture in the plane needs 2 axes, the path has {batch.n_joints}")
    unit, factor = _length(rollout)
    sampled = batch[0].sample(samples)
    places, speed = factor * sampled.q[0], factor * np.linalg.norm(sampled.v[0], axis=1)
    polygon = factor * batch.course.path.control_points
    with panel(ax, width=width, height=45.0 if width == "column" else 70.0) as ax:
        ax.plot(*polygon.T, "o--", color="0.6", linewidth=0.6, markersize=2.5, label="control polygon")
        if points is not None:
            ax.plot(*(factor * np.asarray(points)).T, "k.", markersize=3, label="points")
        segments = list(np.stack([places[:-1], places[1:]], axis=1))
        line = LineCollection(segments, cmap=sequence(), linewidth=2.0, capstyle="round")
        line.set_array(0.5 * (speed[:-1] + speed[1:]))
        ax.add_collection(line)
        names = rollout.robot.joint_names
        ax.set(xlabel=f"{names[0]} [{unit}]", ylabel=f"{names[1]} [{unit}]")
        ax.margins(0.04)
        ax.set_aspect("equal", adjustable="box")
        scale_beside(ax, line, f"speed [{unit}/s]")
        key(ax)
    return ax


def parameter(
    motions: Solution | Rollout | Mapping[str, Any],
    *,
    samples: int = 400,
    ax: Axes | None = None,
    width: Width = "column",
) -> Axes:
    """The path's parameter u over time, of one run or of several by label."""
    named = motions if isinstance(motions, Mapping) else {"": motions}
    shares = np.linspace(0.0, 1.0, samples)
    with panel(ax, width=width, height=42.0) as ax:
        for k, (name, motion) in enumerate(named.items()):
            batch = along_path(rollout_of(motion))[0]
            t, u = shares * float(batch.duration[0]), batch.course.parameter(shares[None])[0]
            ax.plot(t, u, label=name or None, **curve(k))
        ax.set(xlabel="time [s]", ylabel="parameter u of the path", ylim=(-0.02, 1.02))
        if any(named):
            key(ax)
    return ax


def fronts(
    named: Mapping[str, Front],
    *,
    mark: Mapping[str, Solution] | None = None,
    bound: FrontBound | None = None,
    ax: Axes | None = None,
    width: Width = "column",
) -> Axes:
    """Fronts of the same two objectives in one picture, the second objective on a logarithmic scale.

    Args:
        named: label -> front.
        mark: label -> solution to mark.
        bound: of :func:`trajevo.bound_front`, of one of the fronts: the area in which no motion lies.
        ax: axes.
        width: ``"column"``, ``"page"`` or millimetres.

    Raises:
        InvalidInputError: no front, an empty one, or one of other than two objectives.
    """
    if not named or any(len(front.objective_names) != 2 or not len(front) for front in named.values()):
        raise InvalidInputError("fronts: expected fronts of two objectives with at least one point each")
    labels, factors = quantities(next(iter(named.values())))
    values = [front.F * factors for front in named.values()]
    with panel(ax, width=width, height=50.0 if bound is None else 55.0) as ax:
        for i, (name, F) in enumerate(zip(named, values, strict=True)):
            dots: dict[str, Any] = {"markersize": 2.5, "color": colour(i), "label": name}
            ax.plot(*F.T, linestyle="none", marker="os^vD"[i % 5], markeredgewidth=0, **dots)
        for i, (name, solution) in enumerate((mark or {}).items()):
            at = solution.front.F[solution.index] * factors
            ax.plot(*at, "*Dos"[i % 4], color="black", markersize=8 if i % 4 == 0 else 5, label=name)
        ax.set(xlabel=labels[0], ylabel=labels[1], yscale="log")
        if bound is not None:
            below_all(ax, bound.points(_SLICES) * factors, np.concatenate(values))
        log_ticks(ax.yaxis)
        key(ax)
    return ax


def _length(rollout: Rollout) -> tuple[str, float]:
    """Unit and factor of the axes: mm for linear ones."""
    unit = rollout.robot.joint_units[0]
    return display(unit, angle="rad", length="mm")
