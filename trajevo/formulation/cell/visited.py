"""In which order and postures the points of a motion are visited, as people read it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from trajevo.dynamics.rollout import Rollout
from trajevo.formulation.cell.varied_points import VariedPoints
from trajevo.formulation.cell.visits import Visits
from trajevo.trajectory.arranged import Arranged


@final
@dataclass(frozen=True)
class Visited:
    """The points of a motion, place by place.

    Attributes:
        order: number of the point that is visited at each place, from 0.
        postures: name of the posture with which the robot reaches it; empty for a point that is given by joint
            positions.
        free: whether the order is chosen too.
    """

    order: tuple[int, ...]
    postures: tuple[str, ...]
    free: bool = False

    @classmethod
    def of(cls, rollout: Rollout, interpolant: Any) -> Visited | None:
        """Those of the first motion of a rollout; None if neither postures nor the order are chosen."""
        return next(iter(cls.each(rollout.arranged, interpolant)), None)

    @classmethod
    def each(cls, arranged: Arranged | None, interpolant: Any) -> tuple[Visited, ...]:
        """Those of all motions of an arranged cell; none if neither postures nor the order are chosen."""
        chosen = isinstance(interpolant, VariedPoints) and isinstance(interpolant.arrangement, Visits)
        if arranged is None or arranged.branch is None or not chosen:
            return ()
        branches = interpolant.arrangement.branches_of
        orders = (
            np.tile(np.arange(len(branches)), (len(arranged.branch), 1)) if arranged.order is None else arranged.order
        )
        return tuple(
            cls(
                tuple(order),
                tuple(branches[point].names[k] for point, k in zip(order, postures, strict=True)),
                arranged.order is not None,
            )
            for order, postures in zip(orders.tolist(), arranged.branch.tolist(), strict=True)
        )

    @property
    def settings(self) -> dict[str, Any]:
        """Plain data: the numbers of the points and the names of their postures, place by place."""
        return {"order": list(self.order), "postures": list(self.postures)}

    @property
    def told_order(self) -> str:
        """The numbers of the points, place by place."""
        return ", ".join(map(str, self.order))

    @property
    def told_postures(self) -> str:
        """The postures: one for all points, or each with its points in the order of the visits."""
        named = [(posture, point) for posture, point in zip(self.postures, self.order, strict=True) if posture]
        groups = {posture: [point for each, point in named if each == posture] for posture, _ in named}
        if len(groups) == 1:
            return next(iter(groups))
        return "; ".join(f"{posture} at {_listed(points)}" for posture, points in groups.items())


def _listed(points: Sequence[int]) -> str:
    return f"{'point' if len(points) == 1 else 'points'} {', '.join(map(str, points))}"
