"""Limits of effort along a path: what the joints need is quadratic in the speed along it and linear in u''.

In a time T, with u' and u'' in unit time, a joint needs

    τ = g(u) + dry friction + (viscous friction) s'(u) u' / T + (A(u) u'' + B(u) u'²) / T².

All terms follow from three calls of the inverse dynamics at u; their derivatives with respect to u are differences.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.path_effort import Effort, greatest_allowed
from trajevo.robot.joints import Sides
from trajevo.solvers.along_path.kinematics import PathDerivatives, PathLimits
from trajevo.solvers.along_path.program import Linearised

#: Step of u for differences, and the slope of an axis below which it stands still, as a share of the greatest.
_STEP, _STILL = 1e-5, 1e-9

#: What stands for no limit in one direction, as a multiple of that in the other.
_UNLIMITED = 1e3


@final
@dataclass(frozen=True, eq=False)
class EffortLimits(PathLimits):
    """Limits of every joint's effort, with friction and payload.

    Attributes:
        path: the path.
        dynamics: the robot and its payload.
        share: share of the limits that may be used, of every joint, shape (n_joints,).
    """

    path: PathDerivatives
    dynamics: Dynamics
    share: Array

    def least_time(self, states: Array, at_least: float) -> float:
        """The least time from which on nothing else stands against the effort at the instants."""
        kept, sides = self._limited
        terms = self._terms(states[:, 0])
        speed, bend = states[:, 1, None], states[:, 2, None]
        inertial = terms.by_bend * bend + terms.by_speed * speed**2
        effort = Effort((terms.held + terms.dry)[:, kept], (terms.viscous * speed)[:, kept], inertial[:, kept])
        lower, upper = effort.excluded(sides)
        fastest = 1.0 / at_least if at_least > 0.0 else np.inf
        ends = [np.append(end.ravel(), more)[None] for end, more in ((lower, fastest), (upper, np.inf))]
        greatest = float(greatest_allowed(*ends)[0])
        if not np.isfinite(greatest):
            return at_least
        return max(at_least, 1.0 / greatest) if greatest > 0.0 else float("inf")

    def linearised(self, states: Array, time: float) -> Linearised:
        """Tangents of T² τ as shares of T² times the limit; that of T² lies below T²."""
        kept, sides = self._limited
        speed, bend = states[:, 1, None], states[:, 2, None]
        at, before, after = (self._terms(states[:, 0] + step) for step in (0.0, -_STEP, _STEP))
        smooth = [
            terms.held + terms.viscous * speed / time + (terms.by_bend * bend + terms.by_speed * speed**2) / time**2
            for terms in (at, before, after)
        ]
        effort, rubbing = smooth[0] + at.dry, at.viscous * speed / time
        slopes = np.stack(
            [
                (smooth[2] - smooth[1]) / (2.0 * _STEP),
                at.viscous / time + 2.0 * at.by_speed * speed / time**2,
                at.by_bend / time**2,
                np.zeros_like(effort),
            ],
            axis=2,
        )
        unit = sides.lesser
        forward, backward = (np.minimum(side, _UNLIMITED * unit) for side in (sides.forward, sides.backward))
        effort, still, rubbing = (part[:, kept] for part in (effort, at.held + at.dry, rubbing))
        return Linearised(
            slopes[:, kept] / unit[:, None],
            (forward - effort) / unit,
            (backward + effort) / unit,
            (2.0 * (forward - still) - rubbing) / unit,
            (2.0 * (backward + still) + rubbing) / unit,
        )

    @property
    def _limited(self) -> tuple[Array, Sides]:
        """The joints with a limit, and the limits that they may use."""
        sides = self.dynamics.robot.limits.sides("effort").times(self.share)
        kept = np.flatnonzero(sides.limited)
        return kept, sides[kept]

    def _terms(self, u: Array) -> _Terms:
        q, slope, bend, _, _ = self.path(u)
        still, friction = np.zeros_like(q), self.dynamics.robot.friction
        slope = np.where(np.abs(slope) > _STILL * np.abs(slope).max(), slope, 0.0)
        held = self.dynamics.effort(q, still, still)
        rubbing, viscous = friction.effort(slope, still), friction.viscous * slope
        return _Terms(
            held=held,
            dry=rubbing - viscous,
            viscous=viscous,
            by_bend=self.dynamics.effort(q, still, slope) - held,
            by_speed=self.dynamics.effort(q, slope, bend) - held - rubbing,
        )


@final
@dataclass(frozen=True, eq=False)
class _Terms:
    """Terms of the effort, each (K, n_joints), at unit u' and u''.

    Attributes:
        held: at rest [N·m or N].
        dry: dry friction.
        viscous: viscous friction per u'.
        by_bend: inertial effort per u''.
        by_speed: inertial effort per u'².
    """

    held: Array
    dry: Array
    viscous: Array
    by_bend: Array
    by_speed: Array
