"""What holds the solutions of a front back, along the front."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm

from trajevo.errors import InvalidInputError
from trajevo.front.exchange_rates import ExchangeRates
from trajevo.plots.paper import Width, label, panel, scale_beside, sequence

#: Greatest number of rows, and least change that is shown, in percent for 1 %.
_MOST, _LEAST = 14, 1e-3

#: Height of a row [mm].
_ROW = 5.0


def exchange_rates(rates: Sequence[ExchangeRates], *, ax: Axes | None = None, width: Width = "page") -> Axes:
    """By how many percent an objective falls if one thing alone is relaxed by 1 %, along a front.

    Args:
        rates: rates of exchange of the same objective, as :meth:`trajevo.Front.sensitivities` gives them.
        ax: axes.
        width: ``"column"``, ``"page"`` or millimetres.

    Returns:
        The axes: a row for each limit and objective, those that matter most on top, a column for each solution.

    Raises:
        InvalidInputError: no rates, or rates of several objectives.
    """
    if not rates or len({each.objective for each in rates}) > 1:
        told = sorted({each.objective for each in rates})
        raise InvalidInputError(f"rates: expected those of one objective, got {told or 'none'}")
    sizes: dict[str, list[float]] = {}
    for column, each in enumerate(rates):
        for name, gain in each.buys(1.0).items():
            sizes.setdefault(name, [0.0] * len(rates))[column] = gain / max(abs(each.value), np.finfo(float).tiny)
    names = sorted(sizes, key=lambda name: -max(sizes[name]))[:_MOST]
    shown = np.array([sizes[name] for name in names]).reshape(len(names), len(rates))
    norm = LogNorm(_LEAST, max(float(shown.max(initial=0.0)), 1.0))
    with panel(ax, width=width, height=_ROW * max(len(names), 5)) as ax:
        mesh = ax.pcolormesh(np.ma.masked_less(shown, _LEAST), norm=norm, cmap=sequence("viridis_r"))
        ax.invert_yaxis()
        ax.set_yticks(0.5 + np.arange(len(names)), names)
        ticks = np.unique(np.linspace(0, len(rates) - 1, min(6, len(rates))).astype(int))
        ax.set_xticks(0.5 + ticks, [f"{rates[k].value:.3g}" for k in ticks])
        ax.set_xlabel(label(rates[0].objective, rates[0].unit))
        scale_beside(ax, mesh, f"less {rates[0].objective} [%] by 1 % more")
    return ax
