"""A grip that holds a payload by friction, and the masses with which it does not slip."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, final

import numpy as np

from trajevo.base.arrays import numbers, real_number
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError

#: SI units of the numbers of a grip.
GRIP_UNITS = {
    "force_per_finger": "N",
    "total_force": "N",
    "friction": "1",
    "safety": "1",
    "fingers": "1",
    "closing_axis": "1",
    "point": "m",
    "torsion": "m",
}

#: Most fingers of a grip; what is more is a mistake.
_MOST_FINGERS = 1000


@final
@dataclass(frozen=True, kw_only=True)
class Grip:
    """Fingers that hold a payload by friction; all press along one axis, from both sides.

    Exactly one of ``force_per_finger`` and ``total_force`` is given, since makers state either as "gripping force".

    Attributes:
        force_per_finger: with which each finger presses [N].
        total_force: sum over all fingers [N], twice that of a finger for two of them.
        friction: coefficient of friction between payload and fingers [1].
        safety: factor by which friction must exceed what it holds [1]; usual are 1.5 to 2, and more for oily parts.
        fingers: how many press on the payload [1].
        closing_axis: direction in the tool's frame in which they press, of any length but 0 [1].
        point: middle between them in the tool's frame [m].
        torsion: greatest moment of friction about the closing axis over the force [m], of pads that are no points. None
            if moments are not looked at.
        source: where the numbers come from.

    Raises:
        InvalidInputError: a number that no grip has, or none or both of the forces.
    """

    force_per_finger: float | None = None
    total_force: float | None = None
    friction: float
    safety: float = 1.0
    fingers: int = 2
    closing_axis: tuple[float, float, float] = (0.0, 1.0, 0.0)
    point: tuple[float, float, float] = (0.0, 0.0, 0.0)
    torsion: float | None = None
    source: str = ""

    __repr__ = brief

    def __post_init__(self) -> None:
        if (self.force_per_finger is None) == (self.total_force is None):
            got = "neither" if self.total_force is None else "both"
            raise InvalidInputError(f"force_per_finger: expected either it or total_force [N], got {got}")
        for name in ("force_per_finger", "total_force", "friction", "safety", "torsion"):
            if getattr(self, name) is not None or name in ("friction", "safety"):
                object.__setattr__(self, name, _positive(name, getattr(self, name)))
        if self.safety < 1.0:
            raise InvalidInputError(f"safety: expected a factor of at least 1, got {self.safety:g}")
        whole = isinstance(self.fingers, int | np.integer) and not isinstance(self.fingers, bool)
        if not whole or not 2 <= self.fingers <= _MOST_FINGERS:
            raise InvalidInputError(f"fingers: expected a whole number from 2 to {_MOST_FINGERS}, got {self.fingers!r}")
        object.__setattr__(self, "fingers", int(self.fingers))
        for name in ("closing_axis", "point"):
            x, y, z = numbers(getattr(self, name), name=name, shape=(3,)).tolist()
            object.__setattr__(self, name, (x, y, z))
        if not any(self.closing_axis):
            raise InvalidInputError("closing_axis: expected a direction, got (0, 0, 0)")
        if not isinstance(self.source, str):
            raise InvalidInputError(f"source: expected text, got {self.source!r}")

    @property
    def pressing(self) -> float:
        """Force of all fingers together [N]."""
        if self.force_per_finger is not None:
            return self.fingers * self.force_per_finger
        return 0.0 if self.total_force is None else self.total_force

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """What can be told of a grip."""
        return tuple(field.name for field in fields(cls))

    @classmethod
    def needed(cls) -> tuple[str, ...]:
        """What must be told."""
        return ("friction",)


def _positive(name: str, given: Any) -> float:
    number = real_number(given)
    if number is None or not np.isfinite(number) or number <= 0.0:
        raise InvalidInputError(f"{name}: expected a positive number, got {given!r}")
    return number
