"""Interpolants whose times follow a smooth pace: few variables instead of one for each segment."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, numbers, read_only, row_products
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError
from trajevo.path.via_points import ViaPoints
from trajevo.trajectory.batch import TrajectoryBatch
from trajevo.trajectory.interpolants.interpolant import Interpolant, Variable, decision_vectors

#: Least and greatest number of variables of a pace, and the degree of its splines.
LEAST, MOST, _DEGREE = 4, 200, 3


@final
@dataclass(frozen=True, eq=False)
class Paced(Interpolant):
    """An interpolant whose segment times are a given pace times a smooth function.

    Time k is share_k Π p_j^(B_kj), where the shares are those of the given pace in the whole motion and B_kj are cubic
    B-splines at the middle of the segment. They add up to 1: where all variables are p, the motion takes p in all, and
    where some are greater, it is slower there.

    Attributes:
        inner: the interpolant; its variables are times of segments alone.
        pace: times of a motion, shape (n_times,) [s]; only their ratios matter.
        count: number m of variables.

    Raises:
        InvalidInputError: another number of times, times that are not positive, a count that is not a whole number from
            4 to 200, or bounds of the times that no motion keeps at this pace.
    """

    inner: Interpolant
    pace: Array
    count: int
    _basis: Array = field(init=False, repr=False)
    _bounds: tuple[float, float] = field(init=False, repr=False)

    __repr__ = brief

    def __post_init__(self) -> None:
        variables = self.inner.variables
        if any(variable.unit != "s" for variable in variables):
            raise InvalidInputError(
                f"pace: expected an interpolant whose variables are times alone, got {type(self.inner).__name__} with "
                f"{next(variable.name for variable in variables if variable.unit != 's')!r}"
            )
        pace = numbers(self.pace, name="pace", shape=(len(variables),))
        if not (pace > 0.0).all():
            raise InvalidInputError(f"pace: expected positive times [s], got {pace.tolist()}")
        object.__setattr__(self, "count", checked_count(self.count))
        shares = read_only(pace / pace.sum())
        object.__setattr__(self, "pace", shares)
        object.__setattr__(self, "_basis", _basis(shares, self.count))
        lower = float(max(variable.lower / share for variable, share in zip(variables, shares, strict=True)))
        upper = float(min(variable.upper / share for variable, share in zip(variables, shares, strict=True)))
        if not lower < upper:
            raise InvalidInputError(
                "duration_bounds: expected bounds between which all segments fit at a smooth pace, got a motion of at "
                f"least {lower:.4g} s by the least times and of at most {upper:.4g} s by the greatest: make the least "
                "times shorter, or give pace = 0"
            )
        object.__setattr__(self, "_bounds", (lower, upper))

    @property
    def points(self) -> ViaPoints:
        """The points of the interpolant."""
        found: ViaPoints = self.inner.points  # type: ignore[attr-defined]
        return found

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Times [s] that the whole motion would take at the pace of a place, from the start to the end."""
        return tuple(Variable(f"pace_{k}", "s", *self._bounds) for k in range(1, self.count + 1))

    def times(self, x: Array) -> Array:
        """Variables of the interpolant, (B, m) -> (B, n_times) [s]; complex steps are kept."""
        rows = decision_vectors(x, self.count, "paces")
        if not (rows.real > 0.0).all():
            raise InvalidInputError(f"x: expected positive times [s], got {rows.real.min():g}")
        found: Array = self.pace * np.exp(row_products(np.log(rows), self._basis.T))
        return found

    def __call__(self, x: Array) -> TrajectoryBatch:
        """The motions."""
        return self.inner(self.times(x))

    def via_times(self, x: Array) -> Array:
        """Instants at which the points are passed."""
        return self.inner.via_times(self.times(x))


def checked_count(given: Any) -> int:
    """A number of variables of a pace.

    Raises:
        InvalidInputError: no whole number from 4 to 200.
    """
    whole = isinstance(given, int | np.integer) and not isinstance(given, bool)
    if not (whole and LEAST <= given <= MOST):
        raise InvalidInputError(f"pace: expected a whole number from {LEAST} to {MOST}, or 0 for none, got {given!r}")
    return int(given)


def _basis(shares: Array, count: int) -> Array:
    """B-splines over the share of the time at the middles of the segments, shape (n_times, count)."""
    from scipy.interpolate import BSpline  # imported where it computes, since that takes long

    middles = np.cumsum(shares) - 0.5 * shares
    knots = np.concatenate([np.zeros(_DEGREE), np.linspace(0.0, 1.0, count - _DEGREE + 1), np.ones(_DEGREE)])
    return read_only(BSpline.design_matrix(middles, knots, _DEGREE).toarray())
