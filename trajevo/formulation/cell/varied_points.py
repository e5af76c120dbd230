"""Motions through points that differ from individual to individual, as the cell itself varies.

For fixed times the coefficients of a motion are linear in its points. So one call of an interpolant on indicators, of
which each is 1 at one point and 0 at the others, gives the motions through any points: the sum over the points of their
joint positions times the motion of their indicator.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.formulation.cell.arrangement import Arrangement
from trajevo.formulation.constraints.constraint import Constraint
from trajevo.path.passing import Passing
from trajevo.path.via_points import ViaPoints
from trajevo.trajectory.arranged import Arranged
from trajevo.trajectory.batch import TrajectoryBatch
from trajevo.trajectory.interpolants import (
    NAMED_INTERPOLANTS,
    Interpolant,
    Variable,
    interpolant_through,
)
from trajevo.trajectory.interpolants.interpolant import (
    decision_vectors,
    example_of,
)
from trajevo.trajectory.linear_in_points import LinearInPoints
from trajevo.trajectory.polynomial import PolynomialBatch

#: Greatest error allowed for the pose at a point [m or rad], and the error that counts as an excess of 1.
REACHED, SCALE = 1e-6, 0.1

#: Errors below this are rounding [m or rad]; the derivative of so small an error is meaningless.
_ROUNDING = 1e-9


@final
@dataclass(frozen=True, eq=False)
class VariedPoints(Interpolant):
    """An interpolant through points that an arrangement of the cell gives to every individual.

    Attributes:
        kind: interpolant, a name of :data:`~trajevo.trajectory.interpolants.NAMED_INTERPOLANTS`.
        arrangement: columns of decision vectors -> points.
        duration_bounds: least and greatest time of a segment, shape (2,), or of every segment (n_points - 1, 2) [s].
        passing: how points are passed, in the order of the visits; no velocities or accelerations.

    Raises:
        UnknownNameError: no such interpolant.
        InvalidInputError: an interpolant whose motions are not linear in the points, or given velocities.
    """

    kind: str
    arrangement: Arrangement
    duration_bounds: Any = field(kw_only=True)
    passing: tuple[Passing, ...] = field(default=(), kw_only=True)
    _linear: LinearInPoints = field(init=False, repr=False)

    __repr__ = brief

    def __post_init__(self) -> None:
        NAMED_INTERPOLANTS.find(self.kind)
        for one in self.passing:
            for key in one.vectors:
                raise InvalidInputError(
                    f"passing: point {one.point}: {key}: expected none where the cell varies, as it is one of joints, "
                    "which reach the point in many ways; stop, dwell and window can be given"
                )
        indicators = self._through(np.eye(len(self.points)))
        linear = LinearInPoints(indicators, len(self.points), self.kind, "as the cell varies")
        object.__setattr__(self, "_linear", linear)
        self._check_linear()

    @property
    def _inner(self) -> Interpolant:
        return self._linear.inner

    @property
    def points(self) -> ViaPoints:
        """The points at one arrangement that reaches all of them."""
        return ViaPoints(self.arrangement.nominal)

    @property
    def base_origin(self) -> Array | None:
        """Origin of the robot's base at its given place, shape (3,) [m]; None if it stands still."""
        return self.arrangement.base_origin

    @property
    def base_tilts(self) -> bool:
        """Whether the robot's base may be tilted."""
        return self.arrangement.base_tilts

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Those of the interpolant, then those of the arrangement."""
        return self._inner.variables + self.arrangement.variables

    def __call__(self, x: Array) -> PolynomialBatch:
        """Motions through the arranged points for decision vectors of shape (B, n_variables)."""
        return self.motions(x)[0]

    def motions(self, x: Array) -> tuple[PolynomialBatch, Arranged]:
        """The motions, and the arrangement of each, for decision vectors of shape (B, n_variables)."""
        rows = decision_vectors(x, len(self.variables))
        if not np.isfinite(rows).all():
            row, column = (int(i) for i in np.argwhere(~np.isfinite(rows))[0])
            raise InvalidInputError(f"x: expected finite numbers, got {rows[row, column]} in row {row}, {column=}")
        count = len(self._inner.variables)
        arranged = self.arrangement(rows[:, count:])
        whole = self._linear.motions(rows[:, :count])
        coefficients = np.einsum("bkj,bskd->bsjd", arranged.points, whole.coefficients)
        return PolynomialBatch(whole.breaks, coefficients), arranged

    @cached_property
    def leg_of(self) -> Array:
        """Number of the leg between two points to which each variable alone belongs, else -1, shape (n_variables,)."""
        own = self._inner.variables
        low, high = (np.array([getattr(each, end) for each in own]) for end in ("lower", "upper"))
        corners = np.vstack([low, low + np.diag(0.5 * (high - low)), 0.5 * (low + high)])
        spans = np.diff(self._inner.via_times(corners), axis=1)
        changes = np.abs(spans[1 : 1 + len(own)] - spans[0]) > _ROUNDING * np.abs(spans).max()
        linear = np.abs(spans[-1] - spans[0] - (spans[1 : 1 + len(own)] - spans[0]).sum(axis=0)).max()
        alone = (changes.sum(axis=1) == 1) & (linear <= _ROUNDING * np.abs(spans).max())
        found = np.full(len(self.variables), -1)
        found[: len(own)] = np.where(alone, changes.argmax(axis=1), -1)
        return found

    def arranged(self, x: Array) -> Arranged:
        """The arrangement alone for decision vectors of shape (B, n_variables)."""
        return self.arrangement(decision_vectors(x, len(self.variables))[:, len(self._inner.variables) :])

    def via_times(self, x: Array) -> Array:
        """When the points are passed, (B, n_variables) -> (B, K) [s]."""
        return self._inner.via_times(decision_vectors(x, len(self.variables))[:, : len(self._inner.variables)])

    def points_of(self, trajectory: TrajectoryBatch) -> Array:
        """The via points of motions of this interpolant, shape (B, K, n_joints) [rad or m].

        Lines with blends cut the corners; their points are where the lines would meet.
        """
        return self._linear.points_of(trajectory)

    def via_errors(self, trajectory: TrajectoryBatch) -> Array:
        """How far motions pass their points, (B, K, n_joints) [rad or m]; 0 if the interpolant meets them."""
        return self._linear.via_errors(trajectory)

    @property
    def reach_constraint(self) -> Constraint:
        """One column per point: how far the tool misses its pose, -1 where it is there, 0 where it misses it by 1e-6.

        Distance [m] and angle [rad] are added as squares. Beyond, the column grows by 1 for each 0.1 m or rad, so that
        a search finds its way, and is of the size of other limits.
        """
        names = tuple(f"reach of point {point}" for point in range(len(self.points)))
        return Constraint(names, "poses of the tool", _reach_excess, quantity="reach", proof="extremes")

    def _through(self, positions: Array) -> Interpolant:
        given: dict[str, Any] = {"duration_bounds": self.duration_bounds, "passing": self.passing}
        return interpolant_through(self.kind, ViaPoints(positions), **given)

    def _check_linear(self) -> None:
        """Refuse an interpolant whose motions are not linear in its points."""
        positions = np.random.default_rng(0).uniform(0.1, 1.0, (len(self.points), 2))
        x, made = example_of(self._inner), self._through(positions)
        if len(made.variables) != len(self._inner.variables):
            raise InvalidInputError(
                f"interpolant: expected one whose variables are times, as the cell varies, got {self.kind!r}, with "
                "which positions between the points are free too"
            )
        total = np.einsum("kj,bskd->bsjd", positions, self._linear.motions(x).coefficients)
        self._linear.check(made(x), total)


def _reach_excess(rollout: Rollout) -> Array:
    if rollout.arranged is None:
        raise InvalidInputError("rollout: expected one of an arranged cell, for the reach of its points")
    return reach_excess(rollout.arranged.missed)


def reach_excess(missed: Array) -> Array:
    """Errors of poses, (..., 2) [m and rad], as a constraint (...): -1 at the pose, 0 at 1e-6, then 1 for each 0.1."""
    total = np.sqrt((missed * missed).sum(axis=-1))
    total = np.where(total.real > _ROUNDING, total, 0.0)
    excess: Array = np.where(total.real > REACHED, (total - REACHED) / SCALE, total / REACHED - 1.0)
    return excess
