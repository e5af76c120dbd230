"""What a robot stands on without being bolted down, which may tip over an edge of its footprint."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import final

import numpy as np

from trajevo.base.arrays import Array, frozen, numbers, real_number
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError

#: SI units of the numbers of a stand.
STAND_UNITS = {"mass": "kg", "com": "m", "footprint": "m"}

#: Share of the size of a footprint by which its corners may miss a plane, or a convex outline.
_FLAT = 1e-6


@final
@dataclass(frozen=True, kw_only=True)
class Stand:
    """A base that rests on the floor by its weight: a mobile platform, a table.

    Places are in the frame in which the robot's points are: that of its first link, or of the cell if the robot has a
    ``base``.

    Attributes:
        mass: of the stand without the robot's moving links [kg].
        com: its centre of mass [m].
        footprint: corners of the polygon in which it touches the floor, in order along its outline, either way round,
            at least three [m].
        source: where the numbers come from.

    Raises:
        InvalidInputError: a mass below 0, or corners that are not those of a plane and convex polygon.
    """

    mass: float
    com: tuple[float, float, float]
    footprint: tuple[tuple[float, float, float], ...]
    source: str = ""

    __repr__ = brief

    def __post_init__(self) -> None:
        mass = real_number(self.mass)
        if mass is None or not np.isfinite(mass) or mass < 0.0:
            raise InvalidInputError(f"mass: expected a number from 0 on [kg], got {self.mass!r}")
        object.__setattr__(self, "mass", mass)
        object.__setattr__(self, "com", tuple(numbers(self.com, name="com", shape=(3,)).tolist()))
        corners = numbers(self.footprint, name="footprint", shape=("corners", 3))
        if len(corners) < 3:
            raise InvalidInputError(f"footprint: expected at least 3 corners, got {len(corners)}")
        object.__setattr__(self, "footprint", tuple(map(tuple, corners.tolist())))
        if not isinstance(self.source, str):
            raise InvalidInputError(f"source: expected text, got {self.source!r}")
        self._check_outline(corners)

    def _check_outline(self, corners: Array) -> None:
        normal, size = _area(corners), float(np.abs(corners - corners.mean(axis=0)).max())
        length = float(np.linalg.norm(normal))
        if not length > _FLAT * size**2:
            raise InvalidInputError("footprint: expected corners of a polygon with an area, got one without")
        away = (corners - corners.mean(axis=0)) @ (normal / length)
        if np.abs(away).max() > _FLAT * size:
            raise InvalidInputError(
                f"footprint: expected corners in one plane, got one {1e3 * np.abs(away).max():.3g} mm off it"
            )
        sides = np.roll(corners, -1, axis=0) - corners
        turns = np.cross(sides, np.roll(sides, -1, axis=0)) @ (normal / length)
        angles = np.arctan2(turns, (sides * np.roll(sides, -1, axis=0)).sum(axis=1))
        if turns.min() < -_FLAT * size**2 or abs(angles.sum() - 2.0 * np.pi) > 1e-3:
            raise InvalidInputError("footprint: expected corners of a convex polygon, in order along its outline")

    def edges(self, up: Array) -> tuple[Array, Array]:
        """A point of every edge [m] and its unit direction, with the footprint on its left seen from above, (E, 3).

        Args:
            up: direction against gravity, shape (3,).
        """
        corners = np.array(self.footprint)
        sides = np.roll(corners, -1, axis=0) - corners
        way = 1.0 if float(_area(corners) @ up) > 0.0 else -1.0
        return frozen(corners), frozen(way * sides / np.linalg.norm(sides, axis=1, keepdims=True))

    @property
    def edge_names(self) -> tuple[str, ...]:
        """What every edge is called: by its ends."""
        ends = [f"({x:g}, {y:g}, {z:g})" for x, y, z in self.footprint]
        return tuple(f"{one} to {other} m" for one, other in zip(ends, [*ends[1:], ends[0]], strict=True))

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """What can be told of a stand."""
        return tuple(field.name for field in fields(cls))

    @classmethod
    def needed(cls) -> tuple[str, ...]:
        """What must be told."""
        return ("mass", "com", "footprint")


def _area(corners: Array) -> Array:
    """Twice the area of a polygon along its normal, shape (3,) [m²]."""
    about = corners - corners.mean(axis=0)
    area: Array = np.cross(about, np.roll(about, -1, axis=0)).sum(axis=0)
    return area
