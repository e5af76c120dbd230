"""Proofs that the tool keeps to its lines and arcs, and that an axis of it stays upright."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from trajevo.dynamics.enclosure import enclose_part
from trajevo.dynamics.rollout import Rollout
from trajevo.formulation.segments.limits import Cone, OffWays
from trajevo.verification.certificate import Proof

#: Share of the squared limit by which a proven square may lie above the greatest found.
_TOLERANCE = 1e-3


def add_ways(rows: Sequence[list[Proof]], names: Sequence[str], off: OffWays, rollout: Rollout) -> None:
    """Add a proof for every line or arc: the distance from it, or the angle from its orientation.

    Args:
        rows: proofs of every motion, to which these are added.
        names: names of the columns.
        off: the limit.
        rollout: the motions.
    """
    for name, way in zip(names, off.ways, strict=True):
        limit, column = off.limit(way), int(off.turned)
        # Of the squared distance, and of 8 sin² of half the angle.
        both = np.array([limit**2, 8.0 * np.sin(0.5 * limit) ** 2])
        others = np.where(np.arange(2) == column, both, np.inf)
        found = enclose_part(rollout, off.enclosed(way, rollout), way.segments, others, tolerance=_TOLERANCE)
        for k, row in enumerate(rows):
            square, shown, instant = (float(each[k, column]) for each in found)
            bound, exhibited = (_root(value, off.turned) for value in (square, shown))
            row.append(_proof(name, "rad" if off.turned else "m", limit, bound, exhibited, instant))


def add_tilt(rows: Sequence[list[Proof]], name: str, cone: Cone, rollout: Rollout) -> None:
    """Add a proof of the greatest angle of the tool's axis.

    Args:
        rows: proofs of every motion, to which these are added.
        name: name of the column.
        cone: the cone.
        rollout: the motions.
    """
    found = enclose_part(rollout, cone.over, cone.segments, np.array([cone.most]), tolerance=_TOLERANCE)
    for k, row in enumerate(rows):
        above, shown, instant = (float(each[k, 0]) for each in found)
        bound, exhibited = (float(2.0 * np.arcsin(np.sqrt(0.5 * min(max(x, 0.0), 2.0)))) for x in (above, shown))
        row.append(_proof(name, "rad", cone.segment.upright or 0.0, bound, exhibited, instant))


def _root(square: float, turned: bool) -> float:
    size = float(np.sqrt(max(square, 0.0)))
    return float(2.0 * np.arcsin(min(size / np.sqrt(8.0), 1.0))) if turned else size


def _proof(name: str, unit: str, limit: float, bound: float, exhibited: float, instant: float) -> Proof:
    return Proof(
        quantity=name,
        joint=None,
        unit=unit,
        limit=limit,
        bound=bound,
        exhibited=exhibited,
        instant=instant,
        share=bound / limit,
        exhibited_share=exhibited / limit,
        gap=(bound - exhibited) / limit,
        full_limit=limit,
    )
