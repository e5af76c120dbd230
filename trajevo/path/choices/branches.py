"""All the joint positions that reach each point: one for a point in joint space, every posture found for a tool pose.

A joint that can turn more than once reaches a pose after whole turns too. These joint positions belong to the same
posture, but the way to them is another one, so that they are states of their own.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.base.shown.brief import brief
from trajevo.path.choices.posture_names import posture_names
from trajevo.path.inverse_kinematics import Pose, inverse_kinematics
from trajevo.path.levenberg_marquardt import JointRanges
from trajevo.path.postures import find_postures
from trajevo.path.whole_turns import turning_joints
from trajevo.robot.kinematics import ToolKinematics
from trajevo.robot.robot import Robot

#: Greatest numbers of postures and of states of a point. Arms of six axes have at most 16 postures, mostly 8.
MOST_POSTURES, MOST_STATES = 16, 32

#: Random starts per pose and round of the search for postures.
_STARTS = 128

#: Difference of joint positions below which they are the same [rad or m].
_SAME = 1e-6

#: Least difference of two postures in a joint where there are infinitely many [rad or m].
_APART = 0.3

_TURN = 2.0 * np.pi


@final
@dataclass(frozen=True, eq=False)
class Branches:
    """The states that reach one point.

    Attributes:
        q: joint positions within the limits, shape (S, n_joints) [rad or m].
        posture: number of the posture of each state; those of one posture differ by whole turns, shape (S,).
        names: names of the postures.
    """

    q: Array
    posture: Array
    names: tuple[str, ...]

    __repr__ = brief


def branches_of(
    robot: Robot,
    points: Sequence[Any],
    nearest: Array,
    *,
    most: int = MOST_STATES,
    turns: bool = False,
    seed: int = 0,
) -> tuple[Branches, ...]:
    """The states of every point.

    The first state of each posture is the one nearest to the first point, and the first posture is the one that goes
    with the given joint positions. A redundant arm, or a pose with a free axis, has infinitely many postures: a sample
    of those nearest to the first point is taken.

    Args:
        robot: the robot with its tool and position limits.
        points: joint positions (n_joints,) or :class:`~trajevo.path.inverse_kinematics.Pose`, K of them.
        nearest: joint positions that reach the points, each near those before, shape (K, n_joints) [rad or m].
        most: greatest number of states of a point.
        turns: whether joint positions are reached by whole turns too, as poses are.
        seed: seed of the search for postures.
    """
    if not any(isinstance(point, Pose) for point in points):
        return tuple(_of_joints(robot, q, nearest[0], most if turns else 1) for q in nearest)
    kinematics = ToolKinematics.of(robot)
    ranges = JointRanges.of(robot, kinematics)
    return tuple(
        _of_pose(robot, kinematics, ranges, point, q, nearest[0], most, seed)
        if isinstance(point, Pose)
        else _of_joints(robot, q, nearest[0], most if turns else 1)
        for point, q in zip(points, nearest, strict=True)
    )


def reached(robot: Robot, points: Sequence[Any]) -> Array:
    """Joint positions of points, those of a pose the nearest found to the point before it, (K, n_joints) [rad or m].

    Raises:
        UnreachableError: a pose that the tool cannot take.
    """
    rows: list[Array] = []
    for k, point in enumerate(points):
        start = rows[-1] if rows else None
        rows.append(
            inverse_kinematics(robot, [point], start=start, first=k)[0]
            if isinstance(point, Pose)
            else np.asarray(point)
        )
    return np.array(rows)


def _of_joints(robot: Robot, q: Array, near: Array, most: int) -> Branches:
    """The states of joint positions: themselves, and those after whole turns up to a number of states."""
    turned = _turned(turning_joints(robot), robot.limits.lower, robot.limits.upper, q) if most > 1 else q[None]
    order = np.argsort(np.abs(turned - near).max(axis=1), kind="stable")[:most]
    return Branches(frozen(turned[order]), frozen(np.zeros(len(order), dtype=np.int64)), ("",))


def _of_pose(
    robot: Robot,
    kinematics: ToolKinematics,
    ranges: JointRanges,
    pose: Pose,
    known: Array,
    near: Array,
    most: int,
    seed: int,
) -> Branches:
    """The states of a pose, those of the known joint positions first."""
    found = find_postures(
        robot, pose.position[None], pose.rotation, free=pose.free, start=near.tolist(), seed=seed, starts=_STARTS
    )
    at_first = ranges.unwound(known, near)
    others = np.array([ranges.unwound(q, near) for q in found.q]).reshape(-1, robot.dof)
    apart = np.abs(ranges.unwound(others, at_first) - at_first).max(axis=1, initial=0.0)
    others = others[apart > 1e3 * _SAME]
    order = np.argsort(np.abs(others - near).max(axis=1, initial=0.0), kind="stable")
    postures = _spread(np.concatenate([at_first[None], others[order]]))
    states, numbers = _with_turns(ranges, postures, near, most)
    if np.abs(states - known).max(axis=1).min() > _SAME:  # a turn farther away than those kept
        states, numbers = np.concatenate([states[:-1], known[None]]), np.append(numbers[:-1], 0)
    return Branches(frozen(states), frozen(numbers), posture_names(robot, kinematics, postures))


def _spread(postures: Array) -> Array:
    """At most so many postures as are kept, the first ones; of infinitely many, ones that are not too near."""
    if len(postures) <= MOST_POSTURES:
        return postures
    kept = [0]
    for k, q in enumerate(postures):
        if len(kept) < MOST_POSTURES and np.abs(q - postures[kept]).max(axis=1).min() >= _APART:
            kept.append(k)
    return np.asarray(postures[kept])


def _with_turns(ranges: JointRanges, postures: Array, near: Array, most: int) -> tuple[Array, Array]:
    """States of postures with whole turns of joints, the nearest ones of each posture first, and their postures."""
    states, numbers, rank = [], [], []
    for number, q in enumerate(postures):
        turned = _turned(ranges.turning, ranges.lower, ranges.upper, q)
        away = np.sort(np.abs(turned - near), axis=1)[:, ::-1]
        order = np.lexsort(away.T[::-1])
        states.append(turned[order])
        numbers.append(np.full(len(turned), number))
        rank.append(np.arange(len(turned)))
    kept = np.sort(np.argsort(np.concatenate(rank), kind="stable")[: max(most, len(postures))])
    return np.concatenate(states)[kept], np.concatenate(numbers)[kept]


def _turned(joints: Array, lower: Array, upper: Array, q: Array) -> Array:
    """Joint positions with all whole turns of at most one to each side that the ranges allow, (N, n_joints)."""
    options = [
        [turn for turn in ((0.0, -_TURN, _TURN) if turning else (0.0,)) if turn == 0.0 or low <= value + turn <= high]
        for value, turning, low, high in zip(q, joints, lower, upper, strict=True)
    ]
    return np.asarray(q + np.array(list(itertools.product(*options))))
