"""Effort limits kept with every payload whose mass and centre of mass lie in given intervals.

Effort is τ₀ + m f(c), where f(c) is what each kilogram with its centre of mass at c adds. For masses from m₁ to m₂ and
the greatest value F of f over the box of c, the greatest effort is τ₀ + max(m₁ F, m₂ F); in the other direction, the
same holds with -τ₀ and -f. In the box's coordinates u from -1 to 1,

    f = a + b·u + uᵀ Q u

exactly, since f is affine (a bare weight) or quadratic (a rigid body) in c. So a, b and Q follow from f at the middle
of the box, at the middles of its faces and, for a rigid body, of three edges. The greatest value is found by
:func:`trajevo.base.intervals.greatest_quadratic`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.intervals import greatest_quadratic, interval, mass_interval
from trajevo.base.shown.brief import brief
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.formulation.constraints.constraint import Constraint
from trajevo.formulation.constraints.joint_limits import effort_limits


def robust_effort_limits(dynamics: Dynamics, *, mass: Any, com: Any, margin: float = 0.0) -> Constraint:
    """Greatest |effort| of every joint at the samples over all payloads in the intervals, over its limit, minus 1.

    Args:
        dynamics: dynamics of the robot. Its payload gives the model and the inertia per kilogram about the centre of
            mass; its mass and centre of mass are not used.
        mass: least and greatest mass, shape (2,) [kg].
        com: least and greatest coordinates of the centre of mass in the tool frame, shape (2, 3) [m].
        margin: share of the limit that is kept free, from 0 to below 1.

    Raises:
        InvalidInputError: a margin outside its range, an interval whose ends are not in ascending order, a negative
            mass, or a payload model without centre of mass.
    """
    ordinary = effort_limits(dynamics.robot, margin=margin)
    box = PayloadBox.of(dynamics, mass, com)
    excess, terms = (partial(function, box=box, share=1.0 - margin) for function in (_excess, _terms))
    columns = tuple(np.repeat(np.arange(len(ordinary.names)), 2).tolist())  # one term for each direction
    return replace(ordinary, function=excess, terms=terms, quantity="effort of every payload", terms_of=columns)


@final
@dataclass(frozen=True, eq=False)
class PayloadBox:
    """All payloads whose mass and centre of mass lie in given intervals.

    Attributes:
        masses: least and greatest mass [kg].
        middle: the robot with one kilogram in the middle of the box.
        faces: the robot with one kilogram in the middle of a face, for each axis along which the box extends, on the
            high and on the low side; the latter is None if effort is affine in the centre of mass.
        edges: pairs of these axes, and the robot with one kilogram in the middle of the edge on the high side of both;
            empty if effort is affine.
    """

    masses: tuple[float, float]
    middle: Dynamics
    faces: tuple[tuple[Dynamics, Dynamics | None], ...]
    edges: tuple[tuple[int, int, Dynamics], ...]

    __repr__ = brief

    @classmethod
    def of(cls, dynamics: Dynamics, mass: Any, com: Any) -> PayloadBox:
        """The box of given intervals, see :func:`robust_effort_limits`."""
        payload = dynamics.payload
        if dynamics.schedule is not None:
            dynamics.schedule.check_varied("a payload that is not known well")
        if payload.model == "tool_axis":
            raise InvalidInputError("payload.model: 'tool_axis' acts at the tool's origin and has no centre of mass")
        masses, (low, high) = mass_interval(mass), interval(com, "com", (2, 3))
        kilogram = payload.with_mass(1.0)
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        steps = np.diag(half)[half > 0.0]

        def carrying(offset: Array) -> Dynamics:
            return replace(dynamics, payload=replace(kilogram, com=tuple((middle + offset).tolist())))

        quadratic = payload.model == "rigid"
        return cls(
            masses=masses,
            middle=carrying(np.zeros(3)),
            faces=tuple((carrying(step), carrying(-step) if quadratic else None) for step in steps),
            edges=tuple(
                (i, j, carrying(steps[i] + steps[j])) for i, j in combinations(range(len(steps)), 2) if quadratic
            ),
        )

    def greatest_efforts(self, rollout: Rollout, joints: Array) -> Array:
        """Greatest effort in either direction at the samples, over all payloads in the box.

        Args:
            rollout: a rollout of the robot; its payload is not used.
            joints: indices of joints, shape (K,).

        Returns:
            Greatest τ and greatest -τ, shape (B, T, K, 2) [N·m or N].
        """
        base = rollout.unloaded_effort[..., joints]
        both = np.stack([base, -base], axis=-1)
        if self.masses[1] == 0.0:
            return both
        a, b, Q = (np.concatenate([form, -form]) for form in self._forms(rollout, joints))
        ends = np.ones(len(self.faces))
        most = greatest_quadratic(a, b, Q, -ends, ends)[0].reshape(2, *base.shape)
        most = np.moveaxis(most, 0, -1)
        low, high = self.masses
        greatest: Array = both + np.where(most.real > 0.0, high, low) * most
        return greatest

    def _forms(self, rollout: Rollout, joints: Array) -> tuple[Array, Array, Array]:
        """Coefficients a (R,), b (R, D) and Q (R, D, D) of f, with R = B x T x K and D axes of the box."""
        states = rollout.q, rollout.v, rollout.a

        schedule = rollout.dynamics.schedule

        def each(dynamics: Dynamics) -> Array:
            if dynamics.schedule != schedule:  # a motion that stands, of which other loads are asked
                dynamics = replace(dynamics, schedule=schedule)
            dynamics = dynamics.under(rollout.dynamics.gravity)
            added: Array = dynamics.effort_per_kilogram(*states, rollout.segments, axis=1)[..., joints].ravel()
            return added

        a, axes = each(self.middle), len(self.faces)
        b, Q = np.zeros((len(a), axes), dtype=a.dtype), np.zeros((len(a), axes, axes), dtype=a.dtype)
        above = [each(high) for high, _ in self.faces]
        for i, (_, low) in enumerate(self.faces):
            below = 2.0 * a - above[i] if low is None else each(low)
            b[:, i] = 0.5 * (above[i] - below)
            Q[:, i, i] = 0.0 if low is None else 0.5 * (above[i] - a) + 0.5 * (below - a)
        for i, j, dynamics in self.edges:
            Q[:, i, j] = Q[:, j, i] = 0.5 * ((each(dynamics) - above[i]) - (above[j] - a))
        return a, b, Q


def _excess(rollout: Rollout, *, box: PayloadBox, share: float) -> Array:
    excess: Array = _over_limit(rollout, box, share).max(axis=(1, 3))
    return excess


def _terms(rollout: Rollout, *, box: PayloadBox, share: float) -> Array:
    used = _over_limit(rollout, box, share)
    return used.reshape(len(used), -1)


def _over_limit(rollout: Rollout, box: PayloadBox, share: float) -> Array:
    """Greatest efforts divided by the usable share of the limits, minus 1, shape (B, T, K, 2)."""
    limit = rollout.robot.limits.sides("effort").times(share)
    kept = np.flatnonzero(limit.limited)
    over: Array = box.greatest_efforts(rollout, kept) / limit[kept].both.T - 1.0
    return over
