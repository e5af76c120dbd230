"""How near a point is to an optimum: what is left of the slope where limits and bounds have borne what they can."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.solving.least_squares import non_negative
from trajevo.solvers.gradient.scaling import Scaled

#: Distance from a bound, on a variable's scale, that counts as none; share of a limit within which it may bear.
_AT_BOUND, _NEAR = 1e-6, 1e-2

#: Slope of a limit, as a share of it per unit of the scaled variables, that is rounding.
_FLAT = 1e-9

#: Iterations for each multiplier.
_MOST = 30


@final
@dataclass(frozen=True)
class Anchor:
    """The least of an objective or a weighted sum, and how near it is to an optimum.

    Attributes:
        name: the objective, or those of the sum.
        value: the least value [SI].
        residual: share of the slope that is left where limits and bounds bear what they can, see :func:`residual`; 0 at
            an optimum.
        starts: starts of the search.
        agreeing: how many of them ended at most a thousandth above the best.
    """

    name: str
    value: float
    residual: float
    starts: int
    agreeing: int

    @property
    def settings(self) -> dict[str, Any]:
        """As plain data, for the record of a run."""
        return {
            "objective": self.name,
            "value": self.value,
            "residual": self.residual,
            "starts": self.starts,
            "agreeing": self.agreeing,
        }


def anchors_told(settings: Mapping[str, Any]) -> str:
    """How near the anchors of a run are to optima, in a few words; empty if its front was not polished.

    Args:
        settings: settings of the run.
    """
    polish = settings.get("polish")
    found = polish.get("anchors", []) if isinstance(polish, Mapping) else []
    return "; ".join(
        f"least {one['objective']}: residual {one['residual']:.1g}"
        + (f", {one['agreeing']} of {one['starts']} starts within 0.1 %" if one["starts"] > 1 else "")
        for one in found
    )


def residual(scaled: Scaled, y: Array, column: int) -> float:
    """The residual of the first-order conditions (Karush, Kuhn and Tucker) at a point.

    The multipliers are those that leave least of it, with the complementarity of every limit as another residual. Where
    the column is the logarithm of an objective, it is the share by which the objective falls, to first order, along
    its steepest descent within the limits, per unit of the scaled variables.

    Args:
        scaled: the problem in scaled variables.
        y: the point, shape (n,).
        column: the column that is minimised.

    Returns:
        The residual; NaN if there are no gradients.
    """
    _, df, G, dG = (values[0] for values in scaled.slopes(y[None]))
    lengths = np.linalg.norm(dG, axis=1)
    near = (G > -_NEAR) & ~(lengths <= _FLAT)  # a limit that nothing moves, as that of a given point, bears nothing
    if not (np.isfinite(df[column]).all() and np.isfinite(dG[near]).all()):
        return float("nan")
    lengths = lengths[near]
    at_bounds = np.abs(y - scaled.bounds) < _AT_BOUND
    bounds = [sign * np.eye(len(y))[side] for sign, side in zip((-1.0, 1.0), at_bounds, strict=True)]
    columns = np.concatenate([dG[near] / lengths[:, None], *bounds])
    slack = np.concatenate([np.maximum(-G[near], 0.0) / lengths, np.zeros(len(columns) - len(lengths))])
    matrix = np.concatenate([columns.T, np.diag(slack)])
    wanted = np.concatenate([-df[column], np.zeros(len(columns))])
    if not len(columns):
        return float(np.linalg.norm(df[column]))
    borne = non_negative(matrix, wanted, _MOST * len(columns))
    return float(np.linalg.norm(matrix @ borne - wanted))
