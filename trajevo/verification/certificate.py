"""Certificates: what is proven about a motion, limit by limit, and what is not covered."""

from __future__ import annotations

import copy
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, final

import numpy as np

from trajevo.base.files import named_file, why_not, write_whole
from trajevo.base.shown import html
from trajevo.base.shown.brief import brief
from trajevo.base.units import pretty
from trajevo.errors import InvalidInputError
from trajevo.verification.proof_file import Relied, proof_text

#: Share of a limit by which a proven bound may exceed it and still count as within, for rounding exactly at the limit.
WITHIN = 1e-9

#: Factor and unit in which distances between solids are told.
_MILLIMETRES = 1e3, "mm"


@final
@dataclass(frozen=True)
class Proof:
    """What is proven about one quantity of one joint, of the tool or of the motion, in SI units.

    Attributes:
        quantity: ``"position"``, ``"velocity"``, ``"acceleration"``, ``"jerk"``, ``"effort"``, ``"power"``,
            ``"tool speed"``, ``"via error"``, ``"torque at speed"`` (1 plus what a motor is asked for less what it can
            give at its speed, over its greatest torque), or the name of a column of a constraint, as ``"clearance to
            obstacles"``.
        joint: the joint, or None for the tool or the motion as a whole.
        unit: SI unit of the values; ``"1"`` for a share of a limit.
        limit: the limit that is kept [``unit``], inf if there is none; for a position the end of its range that is used
            most, for a clearance or a height the least value allowed.
        bound: magnitude that is not exceeded at any instant [``unit``]; for a position the outermost value, for a
            clearance or a height what is always kept.
        exhibited: magnitude of the sample that comes closest to the limit or exceeds it [``unit``]; for a position its
            value.
        instant: time of this sample [s], NaN if the quantity is one of the whole motion.
        share: proven upper bound of the share of the limit that is used, 0 if there is no limit; for a position the
            share of half its range, measured from the middle; for a clearance or a height as its constraint has it, 1
            where the least value is just kept.
        exhibited_share: share of the limit that the sample uses.
        gap: how far the bound lies above the exhibited value, as a share of the limit. If there is no limit, as a share
            of the exhibited value or of a thousandth of the greatest of all joints, whichever is more; if that is only
            rounding, of a coarse bound from the sizes of the robot and its motion.
        full_limit: the robot's own limit [``unit``] where the problem keeps less of it; otherwise as ``limit``.
        least: whether the limit is a least value, as for a clearance or a height.
        between: for a clearance the two solids that come closest, otherwise empty.
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
    full_limit: float
    least: bool = False
    between: tuple[str, ...] = ()

    __repr__ = brief

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

    @property
    def at(self) -> str:
        """The instant of the exhibited sample, empty if there is none."""
        return "" if np.isnan(self.instant) else f"{self.instant:.4f} s"

    def shown(self, value: float) -> str:
        """A value of the quantity [SI] as text with its unit."""
        factor, unit = _MILLIMETRES if self.between else (1.0, pretty(self.unit))
        return f"{factor * value:.6g} {unit}" if unit != "1" else f"{100.0 * value:.3f} %"

    @property
    def bound_shown(self) -> str:
        """The proven bound with its unit."""
        return f"{'≥' if self.least else '≤'} {self.shown(self.bound)}"

    @property
    def limit_shown(self) -> str:
        """The limit with its unit, and the robot's own where it is another."""
        own = f" (robot {self.shown(self.full_limit)})" if self.full_limit != self.limit else ""
        return "none" if np.isinf(self.limit) else f"{self.shown(self.limit)}{own}"

    def __str__(self) -> str:
        if np.isinf(self.exhibited) and np.isfinite(self.limit):
            return (
                f"{self.name} is infinite at {self.at}, where the derivative below it jumps, and its limit is "
                f"{self.shown(self.limit)}"
            )
        of = " of its limit" if self.unit == "1" and not self.least and np.isfinite(self.limit) else ""
        told = f"{self.name} reaches {self.shown(self.exhibited)}{of}" + (f" at {self.at}" if self.at else "")
        if self.least:
            where = f", between {' and '.join(self.between)}" if self.between else ""
            kept = "" if self.violated else f", proven at least {self.shown(self.bound)}"
            return f"{told}{where}{kept}, {self.shown(self.limit)} wanted"
        if np.isinf(self.limit):
            return f"{told}, never exceeds {self.shown(self.bound)}, and has no limit"
        proven = "" if self.violated else f", proven at most {100.0 * self.share:.3f} %"
        if self.unit == "1":
            return f"{told}{proven}"
        own = (
            f" that the problem keeps, {100.0 * self.exhibited_share * self.limit / self.full_limit:.3f} % of the "
            f"robot's {self.shown(self.full_limit)}"
            if self.full_limit != self.limit
            else ""
        )
        share = f"{100.0 * self.exhibited_share:.3f} %"
        return f"{told}, {share} of the limit of {self.limit:g} {pretty(self.unit)}{own}{proven}"


@final
@dataclass(frozen=True)
class Uncovered:
    """A constraint about which nothing is proven between samples, and how near the samples come to it.

    Attributes:
        name: name of the constraint's column, or of what is not covered.
        reason: why nothing is proven, a clause.
        share: greatest share of the limit that was found, 1 if it is reached; NaN if none was looked for.
        samples: number of samples, 0 if it was not found at samples.
    """

    name: str
    reason: str
    share: float
    samples: int

    @property
    def violated(self) -> bool:
        """Whether what was found exceeds the limit."""
        return self.looked_for and not self.share <= 1.0 + WITHIN

    @property
    def looked_for(self) -> bool:
        """Whether a share of the limit was looked for at all."""
        return self.samples > 0 or not np.isnan(self.share)

    def __str__(self) -> str:
        found = f"; {100.0 * self.share:.3f} % of its limit" if self.looked_for else ""
        found += f" at {self.samples} samples" if self.samples else ""
        return f"{self.name} ({self.reason}{found})"


@final
@dataclass(frozen=True)
class Certificate:
    """What is proven about one motion.

    Attributes:
        motion: name of the motion.
        tolerance: gap that was asked for between bounds and exhibited values of effort, power, tool speed and torque
            at speed, as a share of the limit.
        pieces: number of pieces into which the motion was cut.
        rows: a proof for every limited quantity of every joint, and for every constraint of the problem that can be
            proven; effort, power and tool speed even without a limit.
        uncovered: the constraints of the problem about which nothing is proven between samples.
        notes: other things to know before the numbers are used, one clause each.
    """

    motion: str
    tolerance: float
    pieces: int
    rows: tuple[Proof, ...]
    uncovered: tuple[Uncovered, ...] = ()
    notes: tuple[str, ...] = ()
    _relied: Relied | None = field(default=None, init=False, repr=False, compare=False)

    __repr__ = brief

    def relying_on(self, relied: Relied) -> Certificate:
        """The same certificate, which knows what it relied on and can be written as a proof file."""
        other = copy.copy(self)
        object.__setattr__(other, "_relied", relied)
        return other

    def write_proof(self, file: str | Path) -> Path:
        """Write what is claimed and what it rests on, for ``trajevo check-proof`` and other programs.

        The file holds the motion's polynomials to the last bit, the limits, the masses and joints that efforts need,
        the pieces of time with their bounds, and what is claimed of every quantity; what it claims nothing of is named.
        A certificate that is not proven can be written too; its file says no more than the certificate.

        Args:
            file: path of the file.

        Returns:
            Path of the file.

        Raises:
            InvalidInputError: the motion is not one of polynomials of time, the certificate was read from a file,
                ``file`` is no path, or the file cannot be written.
        """
        target = named_file(file)
        try:
            write_whole(target, proof_text(self, self._relied).encode())
        except OSError as error:
            raise InvalidInputError(f"{file}: cannot be written: {why_not(error)}") from error
        return target

    def _repr_html_(self) -> str:
        rows = [(row.name, row.bound_shown, row.limit_shown, _percent(row), row.at) for row in self.by_quantity]
        headers = ("closest to its limit", "proven", "limit", "used at most", "at")
        title = "Certificate: " + ("proven" if self.proven else "a limit is broken" if self.violated else "not decided")
        return html.shown(title, html.sentence(str(self)), html.table(headers, rows))

    @property
    def proven(self) -> bool:
        """Whether every limit is kept at every instant: all rows are proven and every constraint has one."""
        return not self.uncovered and all(row.proven for row in self.rows)

    @property
    def violated(self) -> tuple[Proof | Uncovered, ...]:
        """Limits that a sample exceeds."""
        listed: tuple[Proof | Uncovered, ...] = (*self.rows, *self.uncovered)
        return tuple(row for row in listed if row.violated)

    @property
    def gap(self) -> float:
        """The widest gap between a bound and an exhibited value, as a share of the limit."""
        return max((row.gap for row in self.rows), default=0.0)

    @cached_property
    def closest(self) -> Proof | None:
        """The limit that is used most, or None where nothing is limited."""
        limited = [row for row in self.rows if np.isfinite(row.limit)]
        return max(limited, key=lambda row: np.inf if np.isnan(row.share) else row.share, default=None)

    @cached_property
    def by_quantity(self) -> tuple[Proof, ...]:
        """For every quantity the row with the greatest share of its limit, or the greatest bound without limits."""
        worst: dict[str, Proof] = {}
        for row in self.rows:
            other = worst.get(row.quantity)
            if other is None or (row.share, row.bound) > (other.share, other.bound):
                worst[row.quantity] = row
        return tuple(worst.values())

    @property
    def summary(self) -> dict[str, Any]:
        """The certificate as plain data, with the row nearest to its limit for every quantity; None for infinity."""
        rows = [
            {
                "quantity": row.quantity,
                "joint": row.joint,
                "unit": row.unit,
                "limit": row.limit if np.isfinite(row.limit) else None,
                "full_limit": row.full_limit if np.isfinite(row.full_limit) else None,
                "bound": row.bound if np.isfinite(row.bound) else None,
                "exhibited": row.exhibited if np.isfinite(row.exhibited) else None,
                "instant": None if np.isnan(row.instant) else row.instant,
                "share": row.share if np.isfinite(row.share) else None,
                "between": list(row.between),
            }
            for row in self.by_quantity
        ]
        uncovered = [
            {
                "name": one.name,
                "reason": one.reason,
                "share": one.share if one.looked_for else None,
                "samples": one.samples,
            }
            for one in self.uncovered
        ]
        about = {"verdict": str(self), "proven": self.proven, "violated": bool(self.violated)}
        told = {"uncovered": uncovered, "notes": list(self.notes)}
        return about | {"tolerance": self.tolerance, "pieces": self.pieces, "rows": rows} | told

    def __str__(self) -> str:
        return " ".join([f"{self._verdict}.", *(f"{note[0].upper()}{note[1:]}." for note in self.notes)])

    @property
    def _verdict(self) -> str:
        missing = "; ".join(map(str, self.uncovered))
        if self.violated:
            worst = max(self.violated, key=_excess)
            others = len(self.violated) - 1
            more = f", and {others} more limit{'s are' if others > 1 else ' is'} broken" if others else ""
            return f"{self.motion} breaks a limit: {worst}{more}"
        open_ = [row for row in self.rows if not row.proven]
        if open_:
            excess = max(row.share for row in open_) - 1.0
            most = f"{open_[0].name} may exceed its limit by a share of {excess:.2g}"
            also = f"; not covered: {missing}" if missing else ""
            return f"{self.motion} is not decided: no sample breaks a limit, but {most}{also}"
        nearest = "nothing is limited" if self.closest is None else f"proven; closest: {self.closest}"
        if missing:
            kept = f"{self.motion} keeps every limit but those not covered at every instant, {nearest}"
            return f"{kept}; not covered: {missing}"
        if self.closest is None:
            return f"{self.motion} keeps every limit at every instant: {nearest}"
        return f"{self.motion} keeps every limit at every instant, {nearest}"


def _excess(row: Proof | Uncovered) -> float:
    share = row.exhibited_share if isinstance(row, Proof) else row.share
    return np.inf if np.isnan(share) else share


def _percent(row: Proof) -> str:
    return f"{100.0 * row.share:.3f} %" if np.isfinite(row.limit) else ""
