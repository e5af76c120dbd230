"""What is proven of a motion, as frozen records that say in a sentence what they hold."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, final

import numpy as np

from trajevo.units import pretty

#: Share of a limit by which a proven bound may exceed it and still count as within: rounding of what is exactly at it.
WITHIN = 1e-9


@final
@dataclass(frozen=True)
class Proof:
    """What is proven of one quantity of one joint, SI.

    Attributes:
        quantity: ``"position"``, ``"velocity"``, ``"acceleration"``, ``"jerk"``, ``"effort"``, ``"power"`` or
            ``"tool speed"``.
        joint: the joint, or None for the tool.
        unit: SI unit of the values.
        limit: inf where there is none; of a position the end of its range that is used most.
        bound: magnitude that is not exceeded at any instant; the outermost one of positions.
        exhibited: magnitude of a sample that comes closest to the limit, or exceeds it; the value itself of positions.
        instant: when that is [s].
        share: proven upper bound of the share of the limit that is used, 0 where there is none; of the half range from
            its middle for positions.
        exhibited_share: the share that the sample uses.
        gap: how far the bound lies above what is exhibited, as a share of the limit, or where there is none of the
            exhibited value or a thousandth of the greatest of all joints, whichever is more.
    """

    quantity: str
    joint: str | None
    unit: str
    limit: float
    bound: float
    exhibited: float
    instant: float
    share: float
    exhibited_share: float
    gap: float

    @property
    def proven(self) -> bool:
        """Whether the limit is kept at every instant."""
        return self.share <= 1.0 + WITHIN

    @property
    def violated(self) -> bool:
        """Whether a sample exceeds the limit."""
        return not self.exhibited_share <= 1.0 + WITHIN

    @property
    def name(self) -> str:
        """Quantity and joint."""
        return self.quantity if self.joint is None else f"{self.quantity} of {self.joint}"

    def __str__(self) -> str:
        unit = pretty(self.unit)
        told = f"{self.name} reaches {self.exhibited:.6g} {unit} at {self.instant:.4f} s"
        if np.isinf(self.limit):
            return f"{told}, never exceeds {self.bound:.6g} {unit}, and has no limit"
        share = f"{100.0 * self.exhibited_share:.3f} %"
        if self.violated:
            return f"{told}, {share} of the limit of {self.limit:g} {unit}"
        return f"{told}, {share} of the limit of {self.limit:g} {unit}, proven at most {100.0 * self.share:.3f} %"


@final
@dataclass(frozen=True)
class Certificate:
    """What is proven of one motion.

    Attributes:
        motion: which one, in words.
        tolerance: share of a limit by which bounds of effort, power and tool speed were to come near exhibited values.
        pieces: into how many pieces the motion was cut.
        rows: every limited quantity of every joint; effort, power and tool speed whether they are limited or not.
    """

    motion: str
    tolerance: float
    pieces: int
    rows: tuple[Proof, ...]

    @property
    def proven(self) -> bool:
        """Whether every limit is kept at every instant."""
        return all(row.proven for row in self.rows)

    @property
    def violated(self) -> tuple[Proof, ...]:
        """Limits that a sample exceeds."""
        return tuple(row for row in self.rows if row.violated)

    @property
    def gap(self) -> float:
        """The widest gap between a bound and what is exhibited, as a share of the limit."""
        return max((row.gap for row in self.rows), default=0.0)

    @cached_property
    def closest(self) -> Proof | None:
        """The limit that is used most, or None where nothing is limited."""
        limited = [row for row in self.rows if np.isfinite(row.limit)]
        return max(limited, key=lambda row: np.inf if np.isnan(row.share) else row.share, default=None)

    @cached_property
    def by_quantity(self) -> tuple[Proof, ...]:
        """The row of every quantity with the greatest share of its limit, or the greatest bound where none has one."""
        worst: dict[str, Proof] = {}
        for row in self.rows:
            other = worst.get(row.quantity)
            if other is None or (row.share, row.bound) > (other.share, other.bound):
                worst[row.quantity] = row
        return tuple(worst.values())

    @property
    def summary(self) -> dict[str, Any]:
        """What is proven as plain data, of every quantity the row that is nearest to its limit; None for no limit."""
        rows = [
            {
                "quantity": row.quantity,
                "joint": row.joint,
                "unit": row.unit,
                "limit": row.limit if np.isfinite(row.limit) else None,
                "bound": row.bound,
                "exhibited": row.exhibited,
                "instant": row.instant,
                "share": row.share,
            }
            for row in self.by_quantity
        ]
        about = {"verdict": str(self), "proven": self.proven, "violated": bool(self.violated)}
        return about | {"tolerance": self.tolerance, "pieces": self.pieces, "rows": rows}

    def __str__(self) -> str:
        if self.violated:
            worst = max(self.violated, key=lambda row: np.inf if np.isnan(row.share) else row.exhibited_share)
            others = len(self.violated) - 1
            more = f", and {others} more limit{'s are' if others > 1 else ' is'} broken" if others else ""
            return f"{self.motion} breaks a limit: {worst}{more}."
        open_ = [row for row in self.rows if not row.proven]
        if open_:
            excess = max(row.share for row in open_) - 1.0
            return f"{self.motion} is not decided: no sample breaks a limit, but {open_[0].name} may by {excess:.2g}."
        if self.closest is None:
            return f"{self.motion} keeps every limit at every instant: nothing is limited."
        return f"{self.motion} keeps every limit at every instant, proven; closest: {self.closest}."
