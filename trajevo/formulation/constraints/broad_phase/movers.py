"""Where obstacles that move are at instants, and how far they move between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.formulation.constraints.broad_phase.covers import Cover
from trajevo.formulation.constraints.scenes.motions import ObstacleMotion


@final
@dataclass(frozen=True, eq=False)
class Movers:
    """M obstacles that move, each in a frame of its own. To the bit, numbers of an instant do not depend on others.

    Attributes:
        motions: poses of the frames over time, M of them.
        covers: balls around the obstacles, in their frames.
        around: radius of the ball around the origin of its frame that holds each obstacle, shape (M,) [m].
    """

    motions: tuple[ObstacleMotion, ...]
    covers: tuple[Cover, ...]
    around: tuple[float, ...]

    @classmethod
    def of(cls, motions: Sequence[ObstacleMotion], entries: Sequence[Any]) -> Movers:
        """The movers of Pinocchio's geometry objects, each placed in its frame."""
        covers = tuple(Cover.of(entry) for entry in entries)
        # The balls that cover a solid together bound its points at least as well as the one around all of it.
        around = (
            min(float(reach[0]), float(reach[1:].max()))
            for reach in (np.linalg.norm(cover.centres, axis=1) + cover.radii for cover in covers)
        )
        return cls(tuple(motions), covers, tuple(around))

    def __len__(self) -> int:
        return len(self.motions)

    def frames(self, t: Array) -> Array:
        """Axes x, y, z and origins of the frames at instants (N,) in the base frame, shape (M, N, 4, 3)."""
        found = []
        for motion in self.motions:
            rotation, position = motion.poses(t)
            found.append(np.concatenate([np.swapaxes(rotation, 1, 2), position[:, None]], axis=1))
        return np.stack(found)

    def moved(self, t: Array) -> Array:
        """How far any point of each moves from one of N instants to the next, at most, shape (N - 1, M) [m]."""
        ways = [motion.travelled(t) for motion in self.motions]
        paths = [way + turned * around for (way, turned), around in zip(ways, self.around, strict=True)]
        # Instants of a batch need not rise: a step back to the start of the next motion is no interval.
        return np.diff(np.stack(paths, axis=1), axis=0)
