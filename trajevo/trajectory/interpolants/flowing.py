"""Motions whose velocities and accelerations at the ends vary from motion to motion, as those of what they join."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError
from trajevo.path.via_points import ViaPoints
from trajevo.trajectory.batch import TrajectoryBatch
from trajevo.trajectory.interpolants.interpolant import Interpolant, Variable, alike
from trajevo.trajectory.polynomial import PolynomialBatch

#: Ends of a motion.
ENDS = ("start", "end")


@final
@dataclass(frozen=True, eq=False)
class Flowing(Interpolant):
    """An interpolant through points, with states at one or both ends that are given with the decision vectors.

    Motions are linear in these states: further columns of the points, which are 0, begin or end with a velocity or an
    acceleration of 1, and are added as often as the states say.

    Attributes:
        kind: name of the interpolant, for messages.
        make: the interpolant; it takes states at its ends.
        points: via points.
        ends: which of :data:`ENDS` have states.
        given: further arguments of the interpolant.

    Raises:
        InvalidInputError: the interpolant takes no states at its ends.
    """

    kind: str
    make: Callable[..., Interpolant]
    points: ViaPoints
    ends: tuple[str, ...]
    given: Mapping[str, Any]
    _inner: Interpolant = field(init=False, repr=False)
    _group: tuple[int, ...] = field(init=False, repr=False)

    __repr__ = brief

    def __post_init__(self) -> None:
        if not getattr(self.make, "takes_velocities", False):
            raise InvalidInputError(
                f"segments: rest: {self.kind!r} begins and ends at rest, so that lines must too; quintic_spline, "
                "septic_spline, cubic and bspline need not"
            )
        if getattr(self.make, "continuous", 2) < 2:
            raise InvalidInputError(
                f"segments: rest: {self.kind!r} has accelerations that jump, so that lines must begin and end at rest; "
                "those of quintic_spline, septic_spline, cubic and bspline need not"
            )
        count, joints = len(self.points), self.points.n_joints
        groups, each = alike(self.given.get("at_rest", ()), joints), 2 * len(self.ends)
        owner = {joint: g for g, (members, _) in enumerate(groups) for joint in members}
        object.__setattr__(self, "_group", tuple(owner[joint] for joint in range(joints)))
        more = each * len(groups)
        given = dict(self.given)
        rests = [
            (point, joints + g * each + k)
            for g, (_, points) in enumerate(groups)
            for point in points
            for k in range(each)
        ]
        if rests:
            given["at_rest"] = [*given["at_rest"], *rests]
        given["velocities"] = {point: _wider(v, more) for point, v in given.get("velocities", {}).items()}
        for end in ENDS:
            for k, name in enumerate((f"{end}_velocity", f"{end}_acceleration")):
                state = _wider(given.get(name, np.zeros(joints)), more)
                if end in self.ends:
                    state[joints + 2 * self.ends.index(end) + k :: each] = 1.0
                given[name] = state
        wide = np.hstack([self.points.positions, np.zeros((count, more))])
        object.__setattr__(self, "_inner", self.make(ViaPoints(wide), **given))

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Those of the interpolant."""
        return self._inner.variables

    def __call__(self, x: Array) -> TrajectoryBatch:
        """Motions with all states 0, for decision vectors of shape (B, n_variables)."""
        none = np.zeros((len(x), self.points.n_joints))
        return self.with_states(x, dict.fromkeys(self.ends, (none, none)))

    def with_states(self, x: Array, states: Mapping[str, tuple[Array, Array]]) -> PolynomialBatch:
        """Motions with given states.

        Args:
            x: decision vectors, shape (B, n_variables).
            states: velocity and acceleration by end, shapes (B, n_joints) [rad/s or m/s, and per s].
        """
        whole = self._inner(x)
        if not isinstance(whole, PolynomialBatch):
            raise InvalidInputError(f"interpolant: expected one of piecewise polynomials, got {self.kind!r}")
        joints, each = self.points.n_joints, 2 * len(self.ends)
        total, basis = whole.coefficients[:, :, :joints], whole.coefficients[:, :, joints:]
        own = basis.reshape(*basis.shape[:2], -1, each, basis.shape[-1])[:, :, list(self._group)]
        for k, amount in enumerate(amount for end in self.ends for amount in states[end]):
            total = total + amount[:, None, :, None] * own[:, :, :, k]
        return PolynomialBatch(whole.breaks, total)

    def via_times(self, x: Array) -> Array:
        """Those of the interpolant."""
        return self._inner.via_times(x)


def _wider(values: Any, count: int) -> Array:
    return np.append(np.asarray(values, dtype=np.float64), np.zeros(count))
