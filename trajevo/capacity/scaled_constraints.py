"""What a problem's constraints ask of a motion that is scaled uniformly in time.

Velocity, acceleration, jerk, mean velocity and tool speed change with a power of the speed, the duration with its
inverse, and what depends on the path alone not at all. Any other constraint, such as a user's own, is evaluated on the
scaled motion. Limits of joints and their efforts are left to :mod:`trajevo.capacity.scaled_path`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.enclosure import decide
from trajevo.dynamics.piece_bounds import Over, PieceBounds, Pieces
from trajevo.dynamics.rollout import Rollout, rollout_of
from trajevo.formulation.constraints.constraint import Constraint
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.trajectory.bernstein import gauss

#: Quantity of a constraint -> power of the speed by which its share of the limit changes.
SPEED_POWERS = {
    "position": 0,
    "overshoot": 0,
    "tool height": 0,
    "clearance": 0,
    "reach": 0,
    "via error": 0,
    "velocity": 1,
    "mean velocity": 1,
    "tool speed": 1,
    "acceleration": 2,
    "jerk": 3,
    "duration": -1,
    "latest instant": -1,
    "earliest instant": 1,
}

#: Number of nodes of each piece in a proof.
_NODES = 10

#: Greatest number of bounds of the tool's speed that are tried, and how far each lies above what was found.
_BOUNDS, _ABOVE = 8, 1e-8

#: Factors that are tried in search of one that keeps all constraints, as a ratio between neighbours and their number:
#: up to a million times the least factor, or the least tried where nothing else bounds it.
_RATIO, _TRIED, _LEAST = 1.15, 100, 1e-3

#: Excess over a limit, as a share of it, that counts as rounding.
_KEPT = 1e-9

#: Halvings of the last of these ratios.
_HALVINGS = 32


@final
@dataclass(frozen=True)
class Scaling:
    """How one column of a constraint changes with the speed.

    Attributes:
        name: name of the column.
        power: power of the speed.
        share: share of the limit that is used at the original speed.
        time: instant of the original motion at which it is used [s], NaN if it is none or not known.
    """

    name: str
    power: int
    share: float
    time: float

    @property
    def greatest_speed(self) -> float:
        """The greatest speed that the limit allows, relative to the original; inf if none breaks it."""
        return np.inf if self.power <= 0 or self.share <= 0.0 else float(self.share ** (-1.0 / self.power))

    @property
    def greatest_factor(self) -> float:
        """The greatest factor of time that the limit allows, within the solvers' tolerance; inf if none breaks it."""
        return np.inf if self.power >= 0 or self.share <= 0.0 else (1.0 + _KEPT) / self.share


@final
@dataclass(frozen=True, eq=False)
class ScaledConstraints:
    """The constraints of a motion's problem, except limits of joints and their efforts.

    Attributes:
        motion: the original motion, sampled as its problem does.
        constraints: constraints of its problem; none for a mere rollout.
        full: whether the robot's full limits are meant, without the problem's margins.
    """

    motion: Rollout
    constraints: tuple[Constraint, ...]
    full: bool = False

    @classmethod
    def of(cls, motion: Any, *, full: bool = False) -> ScaledConstraints:
        """The constraints of a solution or an optimum; of a mere rollout, none."""
        rollout, problem = rollout_of(motion), problem_of(motion)
        trajectory = rollout.trajectory if len(rollout.trajectory) == 1 else rollout.trajectory[0]
        given = () if problem is None else problem.constraints
        return cls(replace(rollout, trajectory=trajectory, masses=None), tuple(filter(_own, given)), full)

    @cached_property
    def scalings(self) -> tuple[Scaling, ...]:
        """Columns whose change with the speed is known and not 0."""
        return tuple(self._scalings())

    def _scalings(self) -> Iterator[Scaling]:
        for constraint in self.constraints:
            power = SPEED_POWERS.get(constraint.quantity, 0)
            if constraint.quantity == "tool speed" and isinstance(constraint.limit, float):
                peak, time = greatest_tool_speed(self.motion)
                yield Scaling(constraint.names[0], power, peak / constraint.limit, time)
            elif power:
                shares = 1.0 + self._excess(constraint, self.motion)
                for name, share in zip(constraint.names, shares.tolist(), strict=True):
                    yield Scaling(name, power, share, np.nan)

    @cached_property
    def longest(self) -> tuple[float, str]:
        """The greatest factor of time that limits of the duration allow, and their name; inf if there are none."""
        bounds = [(scaling.greatest_factor, scaling.name) for scaling in self.scalings]
        return min(bounds, key=lambda bound: bound[0], default=(np.inf, ""))

    @cached_property
    def never_kept(self) -> tuple[str, ...]:
        """Names of the columns that the path itself breaks, at every speed."""
        at_every_speed = [c for c in self.constraints if SPEED_POWERS.get(c.quantity) == 0]
        return tuple(name for c in at_every_speed for name, excess in self._columns(c, self.motion) if excess > _KEPT)

    @cached_property
    def others(self) -> tuple[Constraint, ...]:
        """Constraints of which it is not known how they change with the speed."""
        return tuple(c for c in self.constraints if c.quantity not in SPEED_POWERS)

    @cached_property
    def evaluated(self) -> tuple[str, ...]:
        """Quantities, or else names of columns, of constraints that are not proven between samples."""
        at_samples = [c for c in self.constraints if c.proof == "samples" and c.quantity != "tool speed"]
        return tuple(name for c in at_samples for name in ((c.quantity,) if c.quantity else c.names))

    def broken(self, motion: Rollout, factor: float, *, tolerance: float = _KEPT) -> tuple[str, ...]:
        """Names of the columns of :attr:`others` that a motion at a factor of time breaks by more than a tolerance."""
        if not self.others:
            return ()
        slower = replace(motion, trajectory=motion.trajectory.slowed(factor))
        columns = [column for constraint in self.others for column in self._columns(constraint, slower)]
        return tuple(name for name, excess in columns if not excess <= tolerance)

    def _columns(self, constraint: Constraint, motion: Rollout) -> list[tuple[str, float]]:
        return list(zip(constraint.names, self._excess(constraint, motion).tolist(), strict=True))

    def _excess(self, constraint: Constraint, motion: Rollout) -> Array:
        """Values of a constraint for one motion, shape (columns,)."""
        excess = np.asarray(constraint.function(motion), dtype=np.float64).reshape(-1)
        if self.full and constraint.share is not None:
            excess = (1.0 + excess) * constraint.share - 1.0
        return excess


def problem_of(motion: Any) -> TrajectoryProblem | None:
    """The problem of a solution, an optimum or a slowdown; None for a mere rollout."""
    found = getattr(getattr(motion, "front", motion), "problem", None)
    return found if isinstance(found, TrajectoryProblem) else None


def _own(constraint: Constraint) -> bool:
    """Whether a constraint is none of the limits of joints, or of their efforts, that rollouts carry."""
    of_joints = constraint.quantity in ("velocity", "acceleration", "jerk") and constraint.proof == "extremes"
    return constraint.share is None or not (of_joints or constraint.quantity == "effort")


def least_kept(
    motions: Sequence[Rollout], constraints: ScaledConstraints, allowed: Array
) -> tuple[float, tuple[str, ...]]:
    """The least of given factors of time at which motions keep the constraints that have no closed form.

    Args:
        motions: original motions along one path, with one payload each.
        constraints: the constraints.
        allowed: factors that all other limits allow, as ascending intervals, shape (K, 2).

    Returns:
        The factor, and the names of the constraints because of which it is not the least of the intervals. If none of
        the factors tried keeps all of them, the least of the intervals and no names.
    """
    least = float(allowed[0, 0])
    if not constraints.others:
        return least, ()
    least = next_allowed(allowed, _LEAST) if least == 0.0 else least

    def broken(factor: float, tolerance: float) -> tuple[str, ...]:
        found = [constraints.broken(motion, factor, tolerance=tolerance) for motion in motions]
        return tuple(dict.fromkeys(name for names in found for name in names))

    before = least
    if not broken(least, _KEPT):
        return float(allowed[0, 0]), ()
    for step in range(1, _TRIED):
        tried = next_allowed(allowed, least * _RATIO**step)
        if not np.isfinite(tried):
            break
        if not broken(tried, 0.0):
            return _between(before, tried, allowed, lambda factor: broken(factor, 0.0))
        before = tried
    return least, ()


def _between(
    low: float, high: float, allowed: Array, broken: Callable[[float], tuple[str, ...]]
) -> tuple[float, tuple[str, ...]]:
    """The least factor that breaks nothing between one that does and one that does not, and what binds there."""
    names = broken(low)
    for _ in range(_HALVINGS):
        middle = float(np.sqrt(low * high))
        tried = next_allowed(allowed, middle)
        found = broken(tried) if tried < high else ()
        if found:
            low, names = tried, found
        elif tried < high:
            high = tried
        else:
            low = middle
    return high, names


def next_allowed(allowed: Array, factor: float) -> float:
    """The least factor of intervals (K, 2) from a given one on; inf if there is none."""
    reached = allowed[allowed[:, 1] >= factor]
    return max(factor, float(reached[0, 0])) if len(reached) else np.inf


def greatest_tool_speed(motion: Rollout) -> tuple[float, float]:
    """A speed that the tool's origin never exceeds, close to its greatest one [m/s], and the instant of the latter [s].

    Args:
        motion: the robot on one motion.
    """
    bounds, pieces = PieceBounds.of(motion), Pieces.of(motion, _NODES)
    watch = Watched(bounds.tool_speed, np.ones(1))
    limit, above = float(watch(pieces).found.max()), _ABOVE
    for _ in range(_BOUNDS):
        limit = max(limit, watch.most) * (1.0 + above)
        bound = float(decide(watch, pieces, np.array([limit]), motions=1)[0, 0])
        if bound <= limit:
            return bound, watch.instant
        above *= 1.0 if watch.most > limit else 10.0
    return bound, watch.instant


@final
class Watched:
    """A bound over pieces of one motion that remembers its greatest value at a node, and when.

    Args:
        over: a method of :class:`~trajevo.dynamics.piece_bounds.PieceBounds` with Q columns.
        limits: what the values are measured by, shape (Q,).

    Attributes:
        most: the greatest share of a limit found so far.
        instant: its instant [s].
        column: its column.
    """

    def __init__(self, over: Callable[[Pieces], Over], limits: Array) -> None:
        self._over, self._limits = over, limits
        self.most, self.instant, self.column = 0.0, 0.0, 0

    def __call__(self, pieces: Pieces) -> Over:
        """The bound over pieces."""
        found = self._over(pieces)
        shares = found.found / self._limits
        piece, node, column = (int(i) for i in np.unravel_index(shares.argmax(), shares.shape))
        if shares[piece, node, column] > self.most:
            self.most, self.column = float(shares[piece, node, column]), column
            self.instant = float(pieces.start[piece] + pieces.width[piece] * gauss(shares.shape[1])[0][node])
        return found
