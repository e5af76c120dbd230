"""All postures for many tool poses: from random starts in one batch, then from postures of neighbouring poses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, frozen, numbers
from trajevo.errors import InvalidInputError, checked_name
from trajevo.path.levenberg_marquardt import TOLERANCE, JointRanges, PostureSolver, check_search, rotation_matrix
from trajevo.robot.kinematics import ToolKinematics
from trajevo.robot.robot import Robot

#: Rounds of random starts, each for the poses for which the previous round found new postures.
_ROUNDS = 4

#: Random starts per pose and round, and their least total number.
_STARTS, _STARTS_IN_ALL = 16, 1024

#: Sweeps over neighbours, and number of best postures of a pose from which its neighbours are tried. Without redundancy
#: these numbers only stop the search at singular poses with infinitely many postures: six-axis arms have at most 16.
_SWEEPS, _PASSED_ON = 40, 16

#: The same for redundant arms, which have infinitely many postures.
_REDUNDANT_SWEEPS, _REDUNDANT_PASSED_ON = 10, 1

#: Successive spreads of starts around the best posture, as shares of the joint ranges, and number of starts for each.
_AROUND, _AROUND_STARTS = np.geomspace(0.2, 0.002, 8), 4

#: Number of projections by which postures are compared, and the difference above which they are distinct [rad or m].
_PROJECTIONS, _APART = 3, 1e-3


@final
@dataclass(frozen=True, eq=False)
class Postures:
    """Distinct postures found for poses, in the order of the poses.

    Attributes:
        pose: index of the pose of each posture, shape (P,).
        q: joint positions within the limits, shape (P, n_joints) [rad or m]; for joints that can turn more than once,
            the whole turn nearest to the start.
        worth: worth of each posture, shape (P,).
    """

    pose: Array
    q: Array
    worth: Array


def find_postures(
    robot: Robot,
    positions: Any,
    rotation: Any,
    *,
    neighbours: Any = None,
    free: str | None = None,
    worth: Callable[[Array], Array] | None = None,
    start: Sequence[float] | None = None,
    seed: int = 0,
    starts: int | None = None,
    tolerance: float = TOLERANCE,
) -> Postures:
    """The distinct postures that put the tool into poses.

    Every pose is tried from the start, the middle of the joint ranges and random starts, then from the postures found
    for its neighbours until nothing new is found. If random starts found new postures, more random starts follow. An
    arm with as many joints as the pose has coordinates has few postures per pose; one is rarely missed, but there is no
    proof that all are found. A redundant arm has infinitely many: a sample of them is found, followed by starts ever
    nearer to the best posture of each pose.

    Args:
        robot: the robot with its tool and position limits.
        positions: positions of the tool, shape (C, 3) [m].
        rotation: wanted rotation matrix for all positions, shape (3, 3); None for any orientation.
        neighbours: indices of the poses near each pose, shape (C, K), -1 for none; None if no pose has any.
        free: axis of the tool about which it may be turned, ``"x"``, ``"y"`` or ``"z"``; None for none.
        worth: joint positions (P, n_joints) -> worth, shape (P,): neighbours are tried from the postures of greatest
            worth; all have the same worth if None.
        start: joint positions to begin with, shape (n_joints,) [rad or m]; the middle of the joint ranges if None.
        seed: seed of the random starts.
        starts: random starts per pose and round; if None, 16, or more for few poses so that there are 1024 in all.
        tolerance: greatest error of position [m] and of orientation [rad].

    Raises:
        UnknownNameError: another axis.
        InvalidInputError: shapes that do not fit, not a rotation matrix, or values that are not finite numbers.
    """
    wanted = numbers(positions, name="positions", shape=("C", 3))
    count = max(_STARTS, -(-_STARTS_IN_ALL // max(len(wanted), 1))) if starts is None else starts
    check_search(count, seed, tolerance)
    turned = None if rotation is None else rotation_matrix(rotation)
    near = np.full((len(wanted), 0), -1) if neighbours is None else _checked_neighbours(neighbours, len(wanted))
    kinematics = ToolKinematics.of(robot)
    ranges = JointRanges.of(robot, kinematics)
    begun = ranges.middle if start is None else numbers(start, name="start", shape=(robot.dof,))
    axis = None if free is None or turned is None else np.eye(3)["xyz".index(checked_name("free axis", free, "xyz"))]
    solver = PostureSolver(kinematics, ranges, turned, axis)
    search = _Search(solver, wanted, near, worth or (lambda q: np.zeros(len(q))), begun, float(tolerance))
    return search.found(np.random.default_rng(seed), count)


def _checked_neighbours(given: Any, count: int) -> Array:
    try:
        near = np.asarray(given)
    except ValueError as error:
        raise InvalidInputError(f"neighbours: expected whole numbers of shape ({count}, K), got {given!r}") from error
    if near.ndim != 2 or len(near) != count or near.dtype.kind not in "iu":
        raise InvalidInputError(f"neighbours: expected whole numbers of shape ({count}, K), got shape {near.shape}")
    if near.size and not (near.min() >= -1 and near.max() < count):
        raise InvalidInputError(
            f"neighbours: expected numbers from -1 to {count - 1}, got {near.min()} to {near.max()}"
        )
    return near


@dataclass
class _Search:
    """Search for postures, with those found so far in the order in which they were found."""

    solver: PostureSolver
    wanted: Array
    neighbours: Array
    worth: Callable[[Array], Array]
    start: Array
    tolerance: float

    def __post_init__(self) -> None:
        self.pose = np.zeros(0, dtype=np.int64)
        self.q, self.worths = np.zeros((0, len(self.start))), np.zeros(0)
        anywhere = self.solver.ranges.random(np.random.default_rng(0), 1)
        held = self.solver.kinematics.jacobian(anywhere)[0, : 3 if self.solver.rotation is None else 6]
        freedom = held.shape[1] - np.linalg.matrix_rank(held) + (self.solver.free is not None)
        self.redundant = bool(freedom > 0)
        few, many = (_REDUNDANT_SWEEPS, _REDUNDANT_PASSED_ON), (_SWEEPS, _PASSED_ON)
        self.sweeps, self.passed_on = few if self.redundant else many

    def found(self, generator: np.random.Generator, starts: int) -> Postures:
        """Run the whole search and return the postures found."""
        poses = np.arange(len(self.wanted))
        for first in np.stack([self.start, self.solver.ranges.middle]):
            self._spread(self._add(poses, np.tile(first, (len(poses), 1))))
        for _ in range(1 if self.redundant else _ROUNDS):
            tried = np.repeat(poses, starts)
            new = self._add(tried, self.solver.ranges.random(generator, len(tried)))
            poses = np.unique(self.pose[new])
            self._spread(new)
            if not len(poses):
                break
        if self.redundant:
            self._improve(generator)
        order = np.argsort(self.pose, kind="stable")
        pose = self.pose[order]
        pose.setflags(write=False)
        return Postures(pose, frozen(self.q[order]), frozen(self.worths[order]))

    def _improve(self, generator: np.random.Generator) -> None:
        """Try starts ever nearer to the best posture of every pose."""
        width = self.solver.ranges.high - self.solver.ranges.low
        for share in _AROUND:
            best = np.repeat(np.flatnonzero(self._rank() == 0), _AROUND_STARTS)
            moved = share * width * generator.standard_normal((len(best), len(width)))
            self._add(self.pose[best], self.q[best] + moved)

    def _spread(self, new: Array) -> None:
        """Try neighbours from new postures, then their neighbours, until nothing new is found."""
        for _ in range(self.sweeps):
            best = new[self._rank()[new] < self.passed_on]
            towards = self.neighbours[self.pose[best]]
            there = towards >= 0
            if not there.any():
                return
            new = self._add(towards[there], np.repeat(self.q[best], there.sum(axis=1), axis=0))

    def _rank(self) -> Array:
        """Rank of every posture among those of its pose, 0 for the best, shape (P,)."""
        order = np.lexsort((-self.worths, self.pose))
        begins = np.searchsorted(self.pose[order], self.pose[order])
        rank = np.empty(len(order), dtype=np.int64)
        rank[order] = np.arange(len(order)) - begins
        return rank

    def _add(self, pose: Array, starts: Array) -> Array:
        """Add the new postures found from starts for poses; returns their indices."""
        q, error = self.solver(self.wanted[pose], starts)
        met = error <= self.tolerance
        before = len(self.pose)
        both = np.concatenate([self.pose, pose[met]])
        all_q = np.concatenate([self.q, self.solver.ranges.unwound(q[met], self.start)])
        kept = np.flatnonzero(self._first_of_their_kind(both, all_q))
        kept = kept[kept >= before]
        self.pose, self.q = np.concatenate([self.pose, both[kept]]), np.concatenate([self.q, all_q[kept]])
        self.worths = np.concatenate([self.worths, self._worth_of(all_q[kept])])
        return np.arange(before, len(self.pose))

    def _worth_of(self, q: Array) -> Array:
        """Worth of joint positions, shape (P,).

        Raises:
            InvalidInputError: the function does not return one number for each.
        """
        values = np.asarray(self.worth(q), dtype=np.float64) if len(q) else np.zeros(0)
        if values.shape != (len(q),) or np.isnan(values).any():
            raise InvalidInputError(f"worth: expected one number per posture ({len(q)}), got {values.tolist()}")
        return values

    def _first_of_their_kind(self, pose: Array, q: Array) -> Array:
        """Whether no earlier row is the same posture of the same pose, shape (P,).

        Rows are the same if there is no gap between their projections on fixed directions; whole turns do not matter.
        """
        turning = self.solver.ranges.turning
        features = np.concatenate([q[:, ~turning], np.cos(q[:, turning]), np.sin(q[:, turning])], axis=1)
        directions = np.random.default_rng(0).uniform(0.5, 1.5, (features.shape[1], _PROJECTIONS))
        kind = pose
        for along in (features @ directions).T:
            order = np.lexsort((along, kind))
            apart = (np.diff(kind[order]) != 0) | (np.diff(along[order]) > _APART)
            kind = np.empty_like(kind)
            kind[order] = np.concatenate([[0], np.cumsum(apart)])[: len(order)]
        first = np.zeros(len(pose), dtype=bool)
        first[np.unique(kind, return_index=True)[1]] = True
        return first
