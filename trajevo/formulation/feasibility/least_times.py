"""Times that no motion through given points can beat.

A joint that covers a distance D covers at most ∫ w(t) dt, with w(t) the greatest speed that it can have at t. This is
V, and after a rest also what acceleration and jerk limits allow since: w(t) = min(V, J t²/2) while t <= A/J, then
min(V, A (t - A/2J)). From rest to rest the same holds backwards from the end, so that half the distance takes half the
time. The bounds hold for every motion; the fastest is slower wherever joints must wait for each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.formulation.constraints.joint_limits import LIMITED_BY
from trajevo.formulation.feasibility.known_points import SAME_POSITION, KnownPoints
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.path.curve import GeometricPath
from trajevo.robot.joints import Sides

#: Number of chords by which the length of a path is bounded from below.
_CHORDS = 256

#: Stand-ins for no limit of velocity, acceleration and jerk, and the time that they may add [s].
_NONE, _NEGLIGIBLE = (1e15, 1e25, 1e40), 1e-9


@final
@dataclass(frozen=True)
class LeastTime:
    """A time that no motion can beat.

    Attributes:
        first: number of the point at which it begins.
        last: number of the point at which it ends.
        seconds: the time [s].
        joint: index of the joint that needs it; -1 if the tool does, None if the variables' own bounds do.
    """

    first: int
    last: int
    seconds: float
    joint: int | None


@final
@dataclass(frozen=True, eq=False)
class SpeedLimits:
    """What limits the speeds of every motion of a problem; inf where nothing does.

    Attributes:
        velocity: of each joint and direction, shape (n_joints,) [rad/s or m/s].
        acceleration: the same [rad/s² or m/s²]; of no effect if velocities may jump.
        jerk: the same [rad/s³ or m/s³]; of no effect if accelerations may jump.
        tool: greatest speed of the tool [m/s].
    """

    velocity: Sides
    acceleration: Sides
    jerk: Sides
    tool: float

    @classmethod
    def of(cls, problem: TrajectoryProblem, smooth: int) -> SpeedLimits:
        """The limits that a problem's constraints hold at every instant of motions with that many derivatives."""
        held = [c for c in problem.constraints if c.names and c.proof != "samples"]
        kept = {LIMITED_BY.get(c.quantity) for c in held if c.share is not None}
        free = Sides.of(np.full(problem.robot.dof, np.inf))
        velocity, acceleration, jerk = (
            problem.kept_limits.sides(name) if name in kept and smooth >= order else free
            for order, name in enumerate(("velocity", "acceleration", "jerk"))
        )
        tool = [c.limit for c in held if c.quantity == "tool speed" and isinstance(c.limit, float)]
        return cls(velocity, acceleration, jerk, min(tool, default=np.inf))

    def least(self, moved: Array, *, rests: int) -> Array:
        """Least times in which joints move by signed distances (..., n_joints) with rest at none, one or both ends [s].

        A joint speeds up with the acceleration of its direction and slows down with that of the other one. Between two
        rests, the greater of both bounds the time under a limit of jerk, and both together that without one.
        """
        distance, velocity = np.abs(moved), self.velocity.toward(moved)
        if not rests:
            return distance / velocity
        whole: Array = rests * from_rest(distance / rests, velocity, self.acceleration.greater, self.jerk.forward)
        if rests < 2 or self.acceleration.agree:
            return whole
        mean = 2.0 / (1.0 / self.acceleration.forward + 1.0 / self.acceleration.backward)
        return np.maximum(whole, 2.0 * from_rest(0.5 * distance, velocity, mean, np.full(len(mean), np.inf)))

    def along(self, steps: Sequence[Array], *, rests: int) -> Array:
        """Least times in which joints cover the longest of ways, each of signed steps (K, n_joints) [s]."""
        way = np.max([np.abs(each).sum(axis=0) for each in steps], axis=0)
        if self.velocity.agree and self.acceleration.agree:
            return self.least(way, rests=rests)
        fastest = replace(
            self, velocity=Sides.of(self.velocity.greater), acceleration=Sides.of(self.acceleration.greater)
        )
        directed = [self.velocity.share(each).sum(axis=0) for each in steps]
        longest: Array = np.max([fastest.least(way, rests=rests), *directed], axis=0)
        return longest


def from_rest(distance: Array, velocity: Array, acceleration: Array, jerk: Array) -> Array:
    """Least time in which a joint at rest covers a distance, with limits that may be inf; shapes broadcast [s]."""
    V, A, J = (np.minimum(limit, none) for limit, none in zip((velocity, acceleration, jerk), _NONE, strict=True))
    rising = np.minimum(A / J, np.sqrt(2.0 * V / J))  # until the acceleration or the velocity is greatest
    speed, way = 0.5 * J * rising**2, J * rising**3 / 6.0
    steady = np.maximum(V - speed, 0.0) / A  # at the greatest acceleration
    steady_way = speed * steady + 0.5 * A * steady**2
    left = np.maximum(distance - way, 0.0)
    accelerating = 2.0 * left / (speed + np.sqrt(speed**2 + 2.0 * A * left))
    cruising = steady + (left - steady_way) / V
    after = rising + np.where(left <= steady_way, accelerating, cruising)
    return np.where(left > 0.0, after, np.cbrt(6.0 * distance / J))


def least_times(problem: TrajectoryProblem, given: KnownPoints) -> tuple[LeastTime, ...]:
    """Least times from each known point to the next one, and last of the whole motion.

    Args:
        problem: the problem.
        given: what its motions have in common.
    """
    limits, known = SpeedLimits.of(problem, given.smooth), given.known
    tool = problem.robot.tool_poses(given.positions[known])[0] if np.isfinite(limits.tool) and known else None
    found = []
    for n, (first, last) in enumerate(pairwise(known)):
        moved = _apart(given.positions[first], given.positions[last])
        passed = given.passed[first] and given.passed[last]
        rests = int(given.resting[first]) + int(given.resting[last]) if passed else 0
        least = limits.least(moved, rests=rests)
        curve = getattr(problem.interpolant, "curves", {}).get(first)
        if curve is not None and last == first + 1:
            along = curve.least_times(limits.velocity, limits.acceleration, limits.jerk)
            least = np.maximum(least, along[: len(least)])
        joint, seconds = _greatest(least)
        by_tool = 0.0 if tool is None else float(np.linalg.norm(tool[n + 1] - tool[n])) / limits.tool
        if by_tool > seconds:
            joint, seconds = -1, by_tool
        seconds += float(given.waits[first:last].sum())
        by_bounds = float(given.shortest[first:last].sum())
        found.append(LeastTime(first, last, *((by_bounds, None) if by_bounds > seconds else (seconds, joint))))
    return (*found, _whole(problem, given, limits, found))


def _whole(problem: TrajectoryProblem, given: KnownPoints, limits: SpeedLimits, parts: list[LeastTime]) -> LeastTime:
    """Least time of the whole motion: the sum of its parts, or that in which one joint covers all its ways."""
    last, rests = len(given.positions) - 1, int(given.resting[0]) + int(given.resting[-1])
    passed = given.positions[given.passed]
    steps = [_apart(passed[:-1], passed[1:]) if len(passed) else np.zeros((0, problem.robot.dof))]
    path = getattr(problem.interpolant, "path", None)
    along = 0.0
    if isinstance(path, GeometricPath) and path.n_axes == problem.robot.dof:
        chords = np.diff(path(np.linspace(0.0, 1.0, _CHORDS + 1)), axis=0)
        steps.append(chords)
        along = float(limits.velocity.share(chords).max(axis=1).sum())
    joint, seconds = _greatest(limits.along(steps, rests=rests))
    seconds += float(given.waits.sum())
    summed = max(sum(part.seconds for part in parts), along)
    by_bounds = float(given.shortest.sum())
    if by_bounds >= max(summed, seconds):
        return LeastTime(0, last, by_bounds, None)
    return LeastTime(0, last, seconds, joint) if seconds > summed else LeastTime(0, last, summed, None)


def _apart(start: Array, end: Array) -> Array:
    """How far every joint moves at least from one known point to the other, backward below 0 [rad or m]."""
    distance: Array = np.maximum(np.abs(end - start) - 2.0 * SAME_POSITION, 0.0)
    signed: Array = np.copysign(distance, end - start)
    return signed


def _greatest(seconds: Array) -> tuple[int | None, float]:
    joint = int(seconds.argmax())
    return (joint, float(seconds[joint])) if seconds[joint] > _NEGLIGIBLE else (None, 0.0)
