"""The band between a front and what no motion of its kind can be better than."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from trajevo.base.arrays import Array
from trajevo.plots.paper import colour


def band(ax: Axes, below: Array, F: Array, pair: tuple[int, int]) -> None:
    """Fill what lies between lower points and the best of a front, of two objectives.

    Args:
        ax: axes of the two objectives.
        below: lower points, shape (M, n_obj), in the units of the axes.
        F: the front, shape (N, n_obj), in the same units.
        pair: numbers of both objectives, the one along the horizontal axis first.
    """
    lower, upper = (_stairs(values[:, list(pair)]) for values in (below, F))
    right, top = F[:, list(pair)].max(axis=0)
    x = np.unique(np.concatenate([lower[0], upper[0], [right]]))
    x = x[x <= right]
    least, best = (np.minimum(_height(stairs, x), top) for stairs in (lower, upper))
    looks: dict[str, Any] = {"step": "post", "color": colour(1), "alpha": 0.35, "linewidth": 0}
    ax.fill_between(x, least, best, label="not ruled out", **looks)
    ax.step(x, least, where="post", color=colour(1), linewidth=0.8, label="no motion is below")


def _stairs(values: Array) -> tuple[Array, Array]:
    """The least second value of all points up to each first one."""
    order = np.lexsort(values.T[::-1])
    first, second = values[order].T
    return first, np.minimum.accumulate(second)


def _height(stairs: tuple[Array, Array], x: Array) -> Array:
    """The least second value that points have up to first values x; infinite before them."""
    place = np.searchsorted(stairs[0], x, side="right") - 1
    return np.where(place >= 0, stairs[1][np.maximum(place, 0)], np.inf)
