"""Where a robot's base may stand: ranges of its displacement from the place that is given."""

from __future__ import annotations

from collections.abc import Mapping, Set
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, numbers, read_only
from trajevo.base.shown.brief import brief
from trajevo.base.units import if_degrees, quantity
from trajevo.errors import InvalidInputError, known_names

#: Coordinates of a base in their order, and their SI units; the last two tilt it.
COORDINATES = {"x": "m", "y": "m", "z": "m", "yaw": "rad", "pitch": "rad", "roll": "rad"}

#: How many of them do not tilt it.
LEVEL = 4

#: Beginning of the names of variables that move a base, before the coordinate.
BASE_VARIABLE = "base "

#: Greatest displacement that is not taken for millimetres [m].
_MOST = 20.0


@final
@dataclass(frozen=True, eq=False)
class BaseBox:
    """Ranges of the displacement of a robot's base from its given place.

    A base is turned by roll, pitch and yaw about the fixed axes x, y and z of the cell through its own origin.

    Attributes:
        lower: least displacement along x, y and z of the cell [m], and least yaw, pitch and roll [rad], shape (6,).
        upper: the greatest, shape (6,); equal to the least where a coordinate does not move.

    Raises:
        InvalidInputError: ranges whose ends are the wrong way round, none that is wider than a point, or numbers that
            must be in millimetres or degrees.
    """

    lower: Array
    upper: Array

    __repr__ = brief

    def __post_init__(self) -> None:
        for name in ("lower", "upper"):
            object.__setattr__(
                self,
                name,
                read_only(numbers(getattr(self, name), name=f"base.moving.{name}", shape=(len(COORDINATES),))),
            )
        for k, (key, unit) in enumerate(COORDINATES.items()):
            low, high = float(self.lower[k]), float(self.upper[k])
            if low > high:
                raise InvalidInputError(
                    f"base.moving.{key}: expected the least and the greatest [{unit}], got {low:g} and {high:g}; "
                    f"{high:g} to {low:g} is such a range"
                )
            widest = max(-low, high)
            if unit == "m" and widest > _MOST:
                raise InvalidInputError(
                    f"base.moving.{key}: {widest:g} m looks like mm: expected at most {_MOST:g} m, "
                    f"{1e-3 * widest:g} if it is mm"
                )
            if unit == "rad" and widest > 2.0 * np.pi:
                raise InvalidInputError(
                    f"base.moving.{key}: expected at most a whole turn, 2π rad, got {widest:g} rad{if_degrees(widest)}"
                )
        if not (self.lower < self.upper).any():
            raise InvalidInputError(
                "base.moving: expected a range that is wider than a point for at least one of "
                f"{', '.join(COORDINATES)}, got {self._told()}"
            )

    def _told(self) -> str:
        """The places of a box that is one point, as ``x = 0.1 m``; those that are 0 are left out."""
        ends = zip(COORDINATES.items(), self.lower.tolist(), strict=True)
        return ", ".join(f"{key} = {end:g} {unit} alone" for (key, unit), end in ends if end) or "0 for all of them"

    @property
    def free(self) -> tuple[int, ...]:
        """Numbers of the coordinates that move."""
        return tuple(int(k) for k in np.flatnonzero(self.lower < self.upper))

    @property
    def tilts(self) -> bool:
        """Whether the base may be tilted in it, by roll or pitch."""
        return bool(self.lower[LEVEL:].any() or self.upper[LEVEL:].any())

    @property
    def nearest(self) -> Array:
        """The displacement in the box that is nearest to the given place, shape (6,) [m, and rad from yaw on]."""
        return np.clip(np.zeros(len(COORDINATES)), self.lower, self.upper)

    @property
    def settings(self) -> dict[str, Any]:
        """Plain data that makes an equal box: the ranges that are not 0."""
        pairs = zip(COORDINATES, self.lower.tolist(), self.upper.tolist(), strict=True)
        return {key: [low, high] for key, low, high in pairs if (low, high) != (0.0, 0.0)}

    @classmethod
    def of(cls, given: Any) -> BaseBox:
        """The box of a mapping ``{"x": [-0.3, 0.3], "yaw": ["-90 deg", "90 deg"]}``; what is not named does not move.

        Raises:
            InvalidInputError: another key, no mapping, no pair of numbers or of text with a unit, or as for the class.
        """
        if isinstance(given, BaseBox):
            return given
        if not isinstance(given, Mapping) or not given:
            raise InvalidInputError(
                f"base.moving: expected a range for at least one of {', '.join(COORDINATES)}, got {given!r}"
            )
        lower, upper = np.zeros((2, len(COORDINATES)))
        for key, pair in given.items():
            if key == "tilt":
                raise InvalidInputError(
                    "base.moving.tilt: expected roll and pitch, by which a base is tilted about x and y of the cell; "
                    f"roll = {pair!r} is such a range"
                )
            if key not in COORDINATES:
                raise InvalidInputError(f"base.moving: no coordinate {key!r}; {known_names(key, COORDINATES)}")
            k = list(COORDINATES).index(key)
            lower[k], upper[k] = _pair(key, pair, COORDINATES[key])
        return cls(lower, upper)


def _pair(key: str, given: Any, unit: str) -> tuple[float, float]:
    name = f"base.moving.{key}"
    if isinstance(given, str | Mapping | Set) or not hasattr(given, "__len__") or len(given) != 2:
        raise InvalidInputError(f"{name}: expected the least and the greatest [{unit}], got {given!r}")
    low, high = (quantity(end, unit, name=name) if isinstance(end, str) else end for end in given)
    least, greatest = numbers([low, high], name=name, shape=(2,)).tolist()
    return least, greatest
