"""The band between a front and what no motion of its kind can be better than."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from trajevo.base.arrays import Array
from trajevo.plots.paper import colour

#: Lower end of an axis, as a share of the least value of a front.
_FLOOR = 0.3


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


def below_all(ax: Axes, below: Array, F: Array) -> None:
    """Fill what lies below lower points and left of them, where no motion lies; both axes end a little beyond a front.

    Args:
        ax: axes of two objectives, the second on a logarithmic scale.
        below: lower points, shape (M, 2), in the units of the axes.
        F: what is drawn, shape (N, 2), in the same units.
    """
    x, y = _stairs(below)
    low, high = F.min(axis=0), F.max(axis=0)
    begin, floor = x[0] - 0.05 * (high[0] - x[0]), _FLOOR * low[1]
    x, y = np.append(x, max(high[0], x[-1])), np.append(y, y[-1])
    x, y = np.concatenate([[begin, x[0]], x]), np.concatenate([[high[1], high[1]], np.clip(y, floor, high[1])])
    ax.fill_between(x, floor, y, step="post", color="0.85", linewidth=0, label="no motion lies here")
    ax.set(xlim=(begin, high[0]), ylim=(floor, high[1]))


def _stairs(values: Array) -> tuple[Array, Array]:
    """The least second value of all points up to each first one."""
    order = np.lexsort(values.T[::-1])
    first, second = values[order].T
    return first, np.minimum.accumulate(second)


def _height(stairs: tuple[Array, Array], x: Array) -> Array:
    """The least second value that points have up to first values x; infinite before them."""
    place = np.searchsorted(stairs[0], x, side="right") - 1
    return np.where(place >= 0, stairs[1][np.maximum(place, 0)], np.inf)
