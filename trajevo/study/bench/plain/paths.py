"""Motions along a fixed path, one decision vector at a time: SciPy's B-splines s(u) and u(t), and bounds as printed.

Bounds are those of Paing 2021, eqs. (20)-(25), or the true extremes; of quadratures, the trapezoidal rule, eq. (29),
has a plain statement. Efforts that the problem proves are looked at at more instants.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, final

import numpy as np
from scipy.interpolate import BSpline

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.robot.joints import JointLimits
from trajevo.study.bench.plain.arm import Arm
from trajevo.study.bench.plain.curves import extremes, lobatto_shares, pieces_of

#: Added to every rise, as by the problem, so that u(t) rises even where all rises are 0.
_LEAST_RISE = 1e-12

#: Instants in every piece at which efforts are checked that the problem proves.
_DENSE = 25

#: Coefficients of velocity and acceleration that meet in a term of eq. (25), from that of the jerk.
_MEETING = ((0, 0), (1, 0), (1, 1), (2, 1))


@final
@dataclass(frozen=True, eq=False)
class AlongPath:
    """A problem along a path.

    Attributes:
        path: s(u) of degree 3 at least.
        course: what u(t) is like: its knots in unit time, and its degree.
        rises: number of rises among the variables.
        limits: limits of the axes.
        longest: longest time [s].
        intervals: intervals of the trapezoidal rule.
        printed: whether velocities, accelerations and jerks are bounded as printed; else by their true extremes.
        quantities: what is limited, in the order of the constraints.
        arm: the robot with its payload, for efforts.
        shares: where efforts are sampled between the instants at which the polynomials of s(u(t)) change.
    """

    path: BSpline
    course: tuple[Array, int]
    rises: int
    limits: JointLimits
    longest: float
    intervals: int
    printed: bool
    quantities: tuple[str, ...]
    arm: Arm
    shares: Array

    __repr__ = brief

    @classmethod
    def of(cls, problem: TrajectoryProblem) -> AlongPath:
        """The plain statement of a problem along a path.

        Raises:
            InvalidInputError: other quadratures or variables.
        """
        runs: Any = problem.interpolant
        intervals = getattr(problem.objectives[1].function, "intervals", None)
        if getattr(runs, "timing", "") != "share" or intervals is None:
            raise InvalidInputError("interpolant: no plain statement of motions along a path but as printed")
        proven = any(limit.quantity == "effort" and limit.proof != "samples" for limit in problem.constraints)
        path, count, order = runs.path, runs.control_points, runs.order
        inner = np.linspace(0.0, 1.0, count - order + 2)
        knots = np.concatenate([[0.0] * (order - 1), inner, [1.0] * (order - 1)])
        s = BSpline(np.array(path.knots), np.array(path.control_points), path.order - 1)
        return cls(
            path=s,
            course=(knots, order - 1),
            rises=count - 5,
            limits=problem.robot.limits,
            longest=runs.longest_time,
            intervals=intervals,
            printed=runs.bound == "hull",
            quantities=tuple(limit.quantity for limit in problem.constraints),
            arm=Arm.of(problem.robot, problem.dynamics.payload),
            shares=lobatto_shares(_DENSE if proven else problem.dynamics.samples),
        )

    def evaluate(self, x: Array) -> tuple[Array, Array]:
        """Objectives (2,) and constraints (n_constr,) of a decision vector [SI]."""
        u = self._course(x)
        bounds = self._bounds(u) if self.printed else self._extremes(u)
        least = max(float((bound / self._most(name)).max() ** (1.0 / k)) for k, (name, bound) in enumerate(bounds, 1))
        duration = max(self.longest - (1.0 - x[-1]) * (self.longest - least), least)
        excess = {name: bound / duration**k / self._most(name) for k, (name, bound) in enumerate(bounds, 1)}
        excess["duration"] = np.array([duration / self.longest])
        if "effort" in self.quantities:
            excess["effort"] = self._efforts(u, duration) / self._most("effort")
        squared = self._jerk(u, np.linspace(0.0, 1.0, self.intervals + 1))
        mean = (squared.sum() - 0.5 * (squared[0] + squared[-1])) / self.intervals
        kept = {name: share for name, share in excess.items() if name == "duration"}
        kept |= {name: share[np.isfinite(self._most(name))] for name, share in excess.items() if name not in kept}
        G = np.concatenate([kept[quantity] for quantity in self.quantities]) - 1.0
        return np.array([duration, mean / duration**5]), G

    def _most(self, quantity: str) -> Array:
        return np.array(self.limits.sides(quantity).lesser)

    def _bounds(self, u: BSpline) -> list[tuple[str, Array]]:
        """Bounds (20)-(25) of velocity, acceleration and jerk in unit time, shape (n_axes,) each."""
        v, a, j = (self._coefficients(u, order) for order in (1, 2, 3))
        s1, s2, s3 = self._peaks
        a, j = np.abs(a), np.abs(j)
        second = [s2 * some**2 + s1 * a for some in (v[:-1], v[1:])]
        third = [
            s3 * v[k : k + len(j)] ** 3 + 3.0 * s2 * a[i : i + len(j)] * v[k : k + len(j)] + s1 * j for k, i in _MEETING
        ]
        found = [s1 * v, np.maximum.reduce(second), np.maximum.reduce(third)]
        return list(zip(("velocity", "acceleration", "jerk"), (bound.max(axis=1) for bound in found), strict=True))

    def _extremes(self, u: BSpline) -> list[tuple[str, Array]]:
        """Greatest velocity, acceleration and jerk in unit time, shape (n_axes,) each; those without a limit are 0."""
        degree = self.path.k * u.k - 1
        nodes = np.polynomial.chebyshev.chebpts1(degree + 1)
        ends = self._changes(u)
        t = (ends[:-1, None] + 0.5 * (nodes + 1.0) * np.diff(ends)[:, None]).reshape(-1)
        found = []
        for name, values in zip(("velocity", "acceleration", "jerk"), self._rates(u, t), strict=True):
            axes = np.flatnonzero(np.isfinite(self._most(name)))
            greatest = np.zeros(values.shape[1])
            pieces = values.reshape(len(ends) - 1, len(nodes), -1)
            for axis in axes:
                series = np.polynomial.chebyshev.chebfit(nodes, pieces[:, :, axis].T, degree).T
                # The sum of a series' coefficients bounds it: most pieces stay below what is sampled in others.
                may = np.abs(series).sum(axis=1) >= np.abs(values[:, axis]).max()
                greatest[axis] = max(map(_greatest, series[may]))
            found.append((name, greatest))
        return found

    def _rates(self, u: BSpline, t: Array) -> tuple[Array, ...]:
        """Velocity, acceleration and jerk in unit time at instants (T,), shape (T, n_axes) each."""
        at = np.clip(u(t), 0.0, 1.0)
        s1, s2, s3 = (self.path(at, order) for order in (1, 2, 3))
        v, a, j = (u(t, order)[:, None] for order in (1, 2, 3))
        return s1 * v, s2 * v**2 + s1 * a, s3 * v**3 + 3.0 * s2 * v * a + s1 * j

    def _changes(self, u: BSpline) -> Array:
        """Instants at which u(t) changes its polynomial or crosses a knot of the path, from 0 to 1."""
        whole = pieces_of(u)
        crossings = [whole.solve(knot, discontinuity=False, extrapolate=False) for knot in np.unique(self.path.t)[1:-1]]
        return np.sort(np.concatenate([whole.x, *(found[np.isfinite(found)][:1] for found in crossings)]))

    def _efforts(self, u: BSpline, duration: float) -> Array:
        """Greatest magnitudes of efforts at samples between the instants at which u(t) changes or crosses a knot."""
        ends = self._changes(u)
        t = (ends[:-1, None] + self.shares * np.diff(ends)[:, None]).reshape(-1)
        at, first, second = np.clip(u(t), 0.0, 1.0), u(t, 1)[:, None], u(t, 2)[:, None]
        s1, s2 = self.path(at, 1), self.path(at, 2)
        v, a = s1 * first / duration, (s2 * first**2 + s1 * second) / duration**2
        greatest: Array = np.abs(self.arm.efforts(self.path(at), v, a)).max(axis=0)
        return greatest

    def sampled(self, x: Array, *, instants: int) -> tuple[Array, Array]:
        """Objectives (2,), and excesses of the motion at as many instants, not of bounds, whatever is limited."""
        F, u = self.evaluate(x)[0], self._course(x)
        t = np.linspace(0.0, 1.0, instants)
        rates = zip(("velocity", "acceleration", "jerk"), self._rates(u, t), strict=True)
        motion = {name: values / F[0] ** order for order, (name, values) in enumerate(rates, 1)}
        if "effort" in self.quantities:
            at = np.clip(u(t), 0.0, 1.0)
            motion["effort"] = self.arm.efforts(self.path(at), motion["velocity"], motion["acceleration"])
        shares = [np.abs(values).max(axis=0) / self._most(name) for name, values in motion.items()]
        return F, np.concatenate([*shares, [F[0] / self.longest]]) - 1.0

    def _course(self, x: Array) -> BSpline:
        climbed = np.cumsum(x[: self.rises] + _LEAST_RISE)
        control = np.concatenate([[0.0] * 3, climbed / climbed[-1], [1.0] * 2])
        return BSpline(self.course[0], control, self.course[1])

    def _coefficients(self, u: BSpline, order: int) -> Array:
        """Control points of a derivative of u(t)."""
        rate = u.derivative(order)
        found: Array = rate.c[: len(rate.t) - rate.k - 1]
        return found

    @cached_property
    def _peaks(self) -> tuple[Array, ...]:
        """Greatest magnitudes of the path's first three derivatives, shape (n_axes, 1) each."""
        whole = pieces_of(self.path)
        return tuple(np.abs(extremes(whole, order)).max(axis=0)[:, None] for order in (1, 2, 3))

    def _jerk(self, u: BSpline, t: Array) -> Array:
        """Squared jerk of all axes together in unit time, shape (T,)."""
        at, first, second, third = (u(t, order) if order else u(t) for order in range(4))
        at = np.clip(at, 0.0, 1.0)
        s1, s2, s3 = (self.path(at, order) for order in (1, 2, 3))
        jerk = s3 * first[:, None] ** 3 + 3.0 * s2 * (first * second)[:, None] + s1 * third[:, None]
        squared: Array = np.square(jerk).sum(axis=1)
        return squared


def _greatest(series: Array) -> float:
    """Greatest magnitude of a Chebyshev series between -1 and 1."""
    roots = np.polynomial.chebyshev.chebroots(np.polynomial.chebyshev.chebder(series))
    inside = roots.real[(np.abs(roots.imag) < 1e-6) & (np.abs(roots.real) < 1.0)]
    values = np.polynomial.chebyshev.chebval(np.concatenate([[-1.0, 1.0], inside]), series)
    return float(np.abs(values).max())
