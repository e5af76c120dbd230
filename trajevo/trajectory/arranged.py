"""Where the points of a population lie if the cell itself varies: where the robot stands, how it reaches each point."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief


@final
@dataclass(frozen=True, eq=False)
class Arranged:
    """The points of B individuals, and how they came about.

    Attributes:
        points: joint positions in the order of the visits, shape (B, K, n_joints) [rad or m].
        missed: how far the tool misses the pose at each of them: distance [m] and angle [rad], shape (B, K, 2).
        bases: how far the robot stands from the given place: along x, y and z of the cell [m] and turned by yaw about
            the vertical axis through its own origin [rad], shape (B, 4); where it may tilt, by pitch and roll too,
            shape (B, 6), see :func:`base_rotations`. None if it stands at its place.
        origin: origin of the robot's base at its given place, shape (3,) [m]; None if it stands there.
        order: number of the point that is visited at each place, shape (B, K); None for the given order.
        branch: number of the posture with which each place is reached, shape (B, K); None if there is one for each.
    """

    points: Array
    missed: Array
    bases: Array | None = None
    origin: Array | None = None
    order: Array | None = None
    branch: Array | None = None

    __repr__ = brief

    @property
    def placements(self) -> tuple[Array, Array] | None:
        """What takes places on robots from where they are without displacement of the base to where they are.

        Returns:
            Rotations (B, 3, 3) and translations (B, 3) [m]; None if no base moves.
        """
        if self.bases is None or self.origin is None:
            return None
        turned = base_rotations(self.bases)
        return turned, self.origin + self.bases[:, :3] - turned @ self.origin

    @property
    def tilts(self) -> bool:
        """Whether bases may be tilted."""
        return self.bases is not None and self.bases.shape[1] == 6

    def gravity(self, own: Array) -> Array | None:
        """Gravity in the frame of every base, shape (B, 3) [m/s²]; None if no base turns it.

        Args:
            own: gravity in the frame of the cell, shape (3,) [m/s²].
        """
        if self.bases is None or not (self.tilts or own[:2].any()):
            return None
        turned: Array = (base_rotations(self.bases) * own[:, None]).sum(axis=1)
        return turned

    def rows(self, chosen: Any) -> Arranged:
        """Those of some individuals, by a slice or numbers of rows."""
        of_rows = (self.bases, self.order, self.branch)
        bases, order, branch = (None if each is None else each[chosen] for each in of_rows)
        return Arranged(self.points[chosen], self.missed[chosen], bases, self.origin, order, branch)


def base_rotations(bases: Array) -> Array:
    """Rotations from the frames of displaced bases to that of the cell, shape (B, 3, 3); complex ones stay complex.

    They are turned by roll, pitch and yaw about the fixed axes x, y and z of the cell, one after another.

    Args:
        bases: displacements, shape (B, 4) or (B, 6), see :attr:`Arranged.bases` [m, and rad from yaw on].
    """
    turned = np.zeros((len(bases), 3, 3), dtype=bases.dtype)
    cosine, sine = np.cos(bases[:, 3]), np.sin(bases[:, 3])
    if bases.shape[1] == 4:
        turned[:, 0, 0], turned[:, 0, 1], turned[:, 1, 0], turned[:, 1, 1] = cosine, -sine, sine, cosine
        turned[:, 2, 2] = 1.0
        return turned
    (c, s), (d, t) = ((np.cos(angle), np.sin(angle)) for angle in (bases[:, 4], bases[:, 5]))
    turned[:, 0, 0], turned[:, 0, 1], turned[:, 0, 2] = (
        cosine * c, cosine * s * t - sine * d, cosine * s * d + sine * t
    )  # fmt: skip
    turned[:, 1, 0], turned[:, 1, 1], turned[:, 1, 2] = (
        sine * c, sine * s * t + cosine * d, sine * s * d - cosine * t
    )  # fmt: skip
    turned[:, 2, 0], turned[:, 2, 1], turned[:, 2, 2] = -s, c * t, c * d
    return turned
