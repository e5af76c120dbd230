"""Stretch the times of every individual in a population by one factor, to the least time that the limits allow.

If all times of an individual are multiplied by s, its path stays the same and its derivatives fall with powers of s. So
the use of a limit at one speed gives its use at all speeds. Effort is quadratic in 1/s, see
:mod:`trajevo.dynamics.path_effort`. Limits on the path itself, such as those of position, do not depend on speed. Where
a motion waits at a point, the same holds although the wait is not stretched: nothing moves, and effort only holds.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.sampling import sobol
from trajevo.dynamics.path_effort import EffortOfPath, greatest_allowed
from trajevo.formulation.problem import TrajectoryProblem

#: Number of individuals that show how a problem's limits scale, a power of two (Sobol), and factor of their times.
_PROBES, _STRETCH = 8, 1.25

#: Powers of the factor that shares of limits can follow: jerk, acceleration, speed, path, time.
_POWERS = np.array([-3, -2, -1, 0, 1])

#: Number of individuals that are stretched at a time, since their efforts at all samples take memory.
_AT_A_TIME = 100
#: Tolerance with which a share follows a power; margin by which limits are tightened; change that counts as none.
_AGREEMENT, _MARGIN, _SETTLED = 1e-6, 1e-9, 1e-8

#: How often an individual is stretched at most; the bounds of its variables may make another time necessary.
_ROUNDS = 8


@final
class Limits:
    """The constraints of a problem, with a count of the individuals that were evaluated.

    Args:
        problem: the problem.

    Attributes:
        evaluations: number of individuals.
    """

    def __init__(self, problem: TrajectoryProblem) -> None:
        self.problem, self.evaluations = problem, 0

    def __call__(self, X: Array) -> Array:
        """Constraints of decision vectors, shape (B, n_constr); infinite where the evaluation fails."""
        self.evaluations += len(X)
        G: Array = self.problem.evaluate(X, return_values_of=["F", "G"])[1]
        return G


@final
@dataclass(frozen=True, eq=False)
class Stretching:
    """How the limits of a problem change when all times are multiplied by one factor.

    Attributes:
        limits: limits of the problem.
        times: which variables are times that stretch the whole motion, shape (n_var,); none if stretching all of them
            changes the path.
        powers: power of the factor that the share of each limit follows, shape (n_constr,); NaN if there is none, as
            for effort.
        efforts: columns of the effort limits, and the share of the robot's limits that they allow.
    """

    limits: Limits
    times: Array
    powers: Array
    efforts: tuple[tuple[slice, float], ...]

    @classmethod
    def of(cls, limits: Limits) -> Stretching:
        """Find the powers of a problem's limits by evaluating a few individuals, as they are and stretched."""
        problem = limits.problem
        times = in_seconds(problem)
        efforts, column = [], 0
        for constraint in problem.constraints:
            columns = slice(column, column + len(constraint.names))
            column = columns.stop
            if constraint.quantity == "effort" and constraint.share is not None and constraint.names:
                efforts.append((columns, constraint.share))
        drawn = sobol(problem.n_var, _PROBES, np.random.default_rng(0))
        probes = problem.xl + drawn * (problem.xu - problem.xl)
        slower = np.where(times, _STRETCH * probes, probes)
        G, stretched = (limits(x) for x in (probes, slower))
        good = np.isfinite(G).all(axis=1) & np.isfinite(stretched).all(axis=1)
        if not times.any() or not good.any() or not _same_paths(problem, probes[good], slower[good]):
            return cls(limits, np.zeros_like(times), np.zeros(problem.n_ieq_constr), ())
        return cls(limits, times, _powers(G[good], stretched[good]), tuple(efforts))

    @property
    def possible(self) -> bool:
        """Whether the problem has times that stretch the whole motion."""
        return bool(self.times.any())

    def mended(self, X: Array, *, quicker: bool = False) -> tuple[Array, Array]:
        """Stretch individuals that break a limit to the least time that the limits allow, within the variables' bounds.

        If a time reaches its bound, the others are stretched further and the path changes. An individual stays as it is
        if it breaks a limit that does not depend on speed, or that cannot be kept at any speed.

        Args:
            X: decision vectors, shape (B, n_var), within their bounds.
            quicker: also speed up individuals that keep the limits, so that all end on a limit or a bound.

        Returns:
            Decision vectors (B, n_var) and their constraints (B, n_constr).
        """
        X, problem = X.copy(), self.limits.problem
        G = self.limits(X)
        moving = np.arange(len(X))
        for _ in range(_ROUNDS):
            factors = self.least_factors(X[moving], G[moving], quicker=quicker)
            changed = np.abs(factors - 1.0) > _SETTLED
            moving, factors = moving[changed], factors[changed]
            if not len(moving):
                break
            longer = np.where(self.times, X[moving] * factors[:, None], X[moving])
            X[moving] = np.clip(longer, problem.xl, problem.xu)
            G[moving] = self.limits(X[moving])
        return X, G

    def least_factors(self, X: Array, G: Array, *, quicker: bool) -> Array:
        """The least factor of all times with which each individual keeps the limits, shape (B,); 1 if there is none.

        Args:
            X: decision vectors, shape (B, n_var).
            G: their constraints, shape (B, n_constr).
            quicker: allow factors below 1, until a time reaches its lower bound.
        """
        if len(X) > _AT_A_TIME:
            rows = [slice(i, i + _AT_A_TIME) for i in range(0, len(X), _AT_A_TIME)]
            return np.concatenate([self.least_factors(X[part], G[part], quicker=quicker) for part in rows])
        factors = np.ones(len(X))
        known = np.isfinite(self.powers) & (self.powers != 0)
        scaled = known.copy()
        for columns, _ in self.efforts:
            scaled[columns] = True
        broken = G > 0.0
        asked = np.isfinite(G).all(axis=1) & ~broken[:, self.powers == 0].any(axis=1)
        asked &= quicker | broken[:, scaled].any(axis=1)
        if not self.possible or not asked.any():
            return factors
        X, share, powers = X[asked], 1.0 + G[asked][:, known], self.powers[known]
        # Speed u = 1/s: a share is proportional to s^p, so it becomes 1 where u^p equals the share at speed 1.
        with np.errstate(divide="ignore"):
            at = np.maximum(share, 0.0) ** (1.0 / powers)
        fall = powers < 0
        with np.errstate(divide="ignore"):
            most = (X[:, self.times] / self.limits.problem.xl[self.times]).min(axis=1) if quicker else np.ones(len(X))
        above = np.minimum(at[:, fall].min(axis=1, initial=np.inf) * (1.0 - _MARGIN), most)
        below = at[:, ~fall].max(axis=1, initial=0.0) * (1.0 + _MARGIN)
        lower, upper = self._effort_intervals(X)
        lower = np.concatenate([above[:, None], np.zeros((len(X), 1)), lower], axis=1)
        upper = np.concatenate([np.full((len(X), 1), np.inf), below[:, None], upper], axis=1)
        speed = greatest_allowed(lower, upper)
        factors[asked] = np.where((speed > 0.0) & np.isfinite(speed), 1.0 / np.where(speed > 0.0, speed, 1.0), 1.0)
        return factors

    def slowed(self, X: Array, G: Array, shares: Array) -> tuple[Array, Array]:
        """Slow individuals down on their paths; those that would then break a limit stay as they are.

        Args:
            X: decision vectors, shape (B, n_var).
            G: their constraints, shape (B, n_constr).
            shares: how far each is slowed down, in log time, from 0 (not at all) to 1 (until a variable reaches its
                bound or the motion takes the longest time allowed), shape (B,).

        Returns:
            Decision vectors (B, n_var) and their constraints (B, n_constr).
        """
        if not self.possible:
            return X, G
        most = (self.limits.problem.xu[self.times] / X[:, self.times]).min(axis=1, initial=np.inf)
        rising = self.powers > 0
        share = np.maximum(1.0 + G[:, rising], np.finfo(np.float64).tiny)
        most = np.minimum(most, (share ** (-1.0 / self.powers[rising])).min(axis=1, initial=np.inf))
        factors = np.where(np.isfinite(most) & (most > 1.0), most, 1.0) ** shares
        slower = np.where(self.times, np.minimum(X * factors[:, None], self.limits.problem.xu), X)
        found = self.limits(slower)
        kept = np.all(found <= 0.0, axis=1)[:, None]
        return np.where(kept, slower, X), np.where(kept, found, G)

    def _effort_intervals(self, X: Array) -> tuple[Array, Array]:
        """Speeds at which effort limits are broken: ends of open intervals, shapes (B, K)."""
        none = np.empty((len(X), 0))
        if not self.efforts:
            return none, none
        rollout = self.limits.problem.rollout(X)
        path = EffortOfPath.of(rollout, rollout.q, rollout.without_rounding(rollout.v), rollout.a, rollout.segments)
        masses = rollout.dynamics.payload.mass if rollout.masses is None else rollout.masses[:, None, None]
        effort = path.carrying(masses)
        lower, upper = [none], [none]
        for _, share in self.efforts:
            limit = rollout.robot.limits.sides("effort").times(share).times(1.0 - _MARGIN)
            for ends, found in zip((lower, upper), effort.excluded(limit), strict=True):
                ends.append(np.moveaxis(found, 1, 0).reshape(len(X), -1))
        return np.concatenate(lower, axis=1), np.concatenate(upper, axis=1)


def in_seconds(problem: TrajectoryProblem) -> Array:
    """Which variables are times with positive bounds, shape (n_var,)."""
    return np.array([variable.unit == "s" and variable.lower > 0.0 for variable in problem.variables])


def _same_paths(problem: TrajectoryProblem, X: Array, slower: Array) -> bool:
    """Whether stretched individuals run along the same paths as before, every segment in the longer time.

    A segment in which nothing moves may keep its time: its derivatives are 0 at any.
    """
    one, other = problem.decode(X), problem.decode(slower)
    shares = np.linspace(0.0, 1.0, 5)
    before, after = one.segment_durations, other.segment_durations
    still = (one.segment_peaks(1) == 0.0).all(axis=2) & np.isclose(after, before, rtol=_SETTLED, atol=0.0)
    timed = (still | np.isclose(after, _STRETCH * before, rtol=_SETTLED, atol=0.0)).all()
    return bool(timed and np.allclose(one.at_shares(shares, 0), other.at_shares(shares, 0), rtol=_SETTLED))


def _powers(G: Array, stretched: Array) -> Array:
    """Power of the factor that the share of each limit follows, shape (n_constr,); NaN if there is none."""
    shares = 1.0 + G
    expected = shares[..., None] * _STRETCH ** _POWERS.astype(np.float64)
    off = np.abs(1.0 + stretched[..., None] - expected) / (1e-3 + np.abs(shares[..., None]))
    fits: Array = np.all(off <= _AGREEMENT, axis=0)
    return np.where(fits.any(axis=1), _POWERS[fits.argmax(axis=1)], np.nan)
