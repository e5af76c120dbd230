"""A robot whose base moves: the joint positions that reach fixed poses from every base of a population.

Postures are found once for the nodes of a grid of bases, each from its neighbour, so that all of them belong to the
same branch. From the postures at the nodes around a base those of the base follow in a few steps of inverse kinematics.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import final

import numpy as np

from trajevo.base.arrays import Array, frozen, read_only
from trajevo.base.shown.brief import brief
from trajevo.formulation.cell.arrangement import Arrangement
from trajevo.formulation.cell.base_box import BASE_VARIABLE, COORDINATES, LEVEL, BaseBox
from trajevo.formulation.cell.tracking import PoseTargets, tracked
from trajevo.path.inverse_kinematics import Pose
from trajevo.robot.kinematics import ToolKinematics
from trajevo.trajectory.arranged import Arranged, base_rotations
from trajevo.trajectory.interpolants import Variable

#: Distance of nodes [m and rad], and greatest number of postures at all nodes.
_APART, _MOST_POSTURES = (*(0.1,) * 3, *(np.radians(15.0),) * 3), 20_000

#: Difference of the postures of nodes around a base up to which they belong to one branch [rad or m].
_SAME_BRANCH = 1.0

#: Sum of the weights of nodes that reach a pose below which they are not interpolated.
_LEAST_SHARE = 1e-6

#: Error up to which a node is reached [m and rad], steps of a node's posture, and sweeps from nodes that are reached to
#: others beside them.
_REACHED, _STEPS, _SWEEPS = 1e-9, 100, 4


def placed_targets(targets: PoseTargets, bases: Array, origin: Array) -> PoseTargets:
    """Poses of the cell as the robot sees them from bases that are displaced.

    Args:
        targets: N poses in the cell.
        bases: displacements, shape (N, 4) or (N, 6) [m, and rad from yaw on].
        origin: origin of the base at its given place, shape (3,) [m].
    """
    back = np.ascontiguousarray(np.swapaxes(base_rotations(bases), 1, 2))
    away = targets.position - origin - bases[:, :3]
    position = origin + (back * away[:, None]).sum(axis=-1)
    return PoseTargets(position, back @ targets.rotation, targets.axis, targets.turned)


@final
@dataclass(frozen=True, eq=False)
class MovingBase(Arrangement):
    """Poses in the cell, reached from bases that move in a box.

    Attributes:
        kinematics: of the robot's tool, in the cell while the base is at its given place.
        poses: K poses in the cell.
        box: displacements of the base.
        home: a displacement at which the postures are known, shape (6,) [m, and rad from yaw on].
        solutions: joint positions there of every branch of every pose, shape (K, C, n_joints) [rad or m].
        origin: origin of the base at its given place, shape (3,) [m].
    """

    kinematics: ToolKinematics
    poses: Sequence[Pose]
    box: BaseBox
    home: Array
    solutions: Array
    origin: Array
    _targets: PoseTargets = field(init=False, repr=False)

    __repr__ = brief

    def __post_init__(self) -> None:
        object.__setattr__(self, "poses", tuple(self.poses))
        for name in ("home", "solutions", "origin"):
            object.__setattr__(self, name, read_only(getattr(self, name)))
        object.__setattr__(self, "_targets", PoseTargets.of(self.poses))

    @property
    def variables(self) -> tuple[Variable, ...]:
        """A displacement for every coordinate that moves."""
        names, ends = list(COORDINATES.items()), (self.box.lower.tolist(), self.box.upper.tolist())
        return tuple(Variable(BASE_VARIABLE + names[k][0], names[k][1], ends[0][k], ends[1][k]) for k in self.box.free)

    @property
    def branches(self) -> Array:
        """Joint positions of every branch of every pose at the known base, shape (K, C, n_joints) [rad or m]."""
        return self.solutions

    @property
    def positions(self) -> Array:
        """Positions of the poses in the cell, shape (K, 3) [m]."""
        return self._targets.position

    @property
    def base_origin(self) -> Array:
        """Origin of the base at its given place, shape (3,) [m]."""
        return self.origin

    @property
    def base_tilts(self) -> bool:
        """Whether the base may be tilted."""
        return self.box.tilts

    @property
    def nominal(self) -> Array:
        """The first branch of every pose at the known base, shape (K, n_joints) [rad or m]."""
        return self.solutions[:, 0]

    @property
    def still(self) -> Array:
        """None of the points: all of them move against the base."""
        return np.zeros(len(self.solutions), dtype=bool)

    def bases(self, columns: Array) -> Array:
        """Displacements of columns, (B, n_variables) -> (B, 4), or (B, 6) in a box that tilts [m and rad]."""
        bases = np.tile(self.box.lower, (len(columns), 1)).astype(columns.dtype)
        bases[:, list(self.box.free)] = columns
        return bases if self.box.tilts else bases[:, :LEVEL]

    def __call__(self, columns: Array, branch: Array | None = None) -> Arranged:
        """The points of every individual; see :meth:`Arrangement.__call__`."""
        bases = self.bases(columns)
        count, (K, _, n) = len(bases), self.branches.shape
        chosen = np.zeros((count, K), dtype=np.intp) if branch is None else branch
        starts = self.nodes.starts(columns, chosen)
        pose = np.tile(np.arange(K), count)
        targets = placed_targets(self._targets.chosen(pose), np.repeat(bases, K, axis=0), self.origin)
        q, missed = tracked(self.kinematics, starts.reshape(-1, n), targets)
        return Arranged(q.reshape(count, K, n), missed.reshape(count, K, 2), bases, self.origin, branch=branch)

    @cached_property
    def nodes(self) -> PostureGrid:
        """The postures at the nodes of a grid of bases; computed once."""
        lower, upper = self.box.lower[list(self.box.free)], self.box.upper[list(self.box.free)]
        axes = _axes(self.box, self.branches.shape[0] * self.branches.shape[1])
        shape = tuple(map(len, axes))
        columns = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
        q, reached = _Spreading(self, columns, shape).found()
        return PostureGrid(lower, upper, q, reached, self.box.tilts)

    def solved(self, bases: Array, starts: Array) -> tuple[Array, Array]:
        """Postures of all branches from starts, and whether they reach their poses.

        Args:
            bases: displacements, shape (N, 4) or (N, 6) [m, and rad from yaw on].
            starts: joint positions, shape (N, K, C, n_joints) [rad or m].

        Returns:
            Joint positions of that shape, and a mask (N, K, C).
        """
        count, (K, C, n) = len(bases), self.branches.shape
        pose = np.tile(np.arange(K).repeat(C), count)
        targets = placed_targets(self._targets.chosen(pose), np.repeat(bases, K * C, axis=0), self.origin)
        q, missed = tracked(self.kinematics, starts.reshape(-1, n), targets, steps=_STEPS)
        reached = missed.max(axis=1) <= _REACHED
        return q.reshape(starts.shape), reached.reshape(starts.shape[:-1])


@final
@dataclass(frozen=True, eq=False)
class PostureGrid:
    """Postures at the nodes of a grid of bases.

    Attributes:
        lower: least values of the columns that move the base, shape (D,).
        upper: the greatest, shape (D,).
        q: postures of all branches, shape (..., K, C, n_joints) after one axis for each column [rad or m].
        reached: whether they reach their poses, shape (..., K, C).
        by_simplices: whether postures are interpolated between the D + 1 nodes of a simplex around a base, of which
            there are fewer than the 2ᴰ nodes of a cell.
    """

    lower: Array
    upper: Array
    q: Array
    reached: Array
    by_simplices: bool = False

    __repr__ = brief

    def starts(self, columns: Array, branch: Array) -> Array:
        """Postures from which those of given bases follow.

        They are interpolated along every column between the nodes around a base that reach the pose, if these are of
        one branch. Otherwise they are those of the nearest of these nodes, or of the nearest one if none reaches it.

        Args:
            columns: values of the columns, shape (B, D); complex ones stay complex.
            branch: number of the branch of each pose, shape (B, K).

        Returns:
            Shape (B, K, n_joints) [rad or m].
        """
        steps = np.array(self.q.shape[: len(self.lower)]) - 1
        at = (columns - self.lower) / (self.upper - self.lower) * steps
        cell = np.clip(np.floor(at.real).astype(np.intp), 0, steps - 1)
        corners, weights = (_of_simplices if self.by_simplices else _of_cells)(at - cell)
        pose = np.arange(branch.shape[1])
        index = tuple((cell[:, None] + corners)[..., k][..., None] for k in range(len(steps)))
        place = (*index, pose, branch[:, None])
        q, reached = self.q[place], self.reached[place]  # (B, corners, K, n), (B, corners, K)
        best = (weights.real[:, :, None] + 2.0 * reached).argmax(axis=1)
        nearest = np.take_along_axis(q, best[:, None, :, None], axis=1)[:, 0]
        # On the way from cell to cell these weights have no steps, as those of nodes that are left behind fall to 0.
        shares = weights[:, :, None] * reached
        total = shares.sum(axis=1)
        some = total.real > _LEAST_SHARE
        blended = (shares[..., None] * q).sum(axis=1) / np.where(some, total, 1.0)[..., None]
        apart = np.where(reached[..., None], np.abs(q - nearest[:, None]), 0.0).max(axis=(1, 3))
        return np.where((some & (apart <= _SAME_BRANCH))[..., None], blended, nearest)


def _of_cells(share: Array) -> tuple[Array, Array]:
    """Steps from the lowest to all corners of a cell, (1, 2ᴰ, D), and their weights (B, 2ᴰ) at shares (B, D) of it."""
    corners = np.array(list(itertools.product((0, 1), repeat=share.shape[1])))
    return corners[None], np.where(corners, share[:, None], 1.0 - share[:, None]).prod(axis=2)


def _of_simplices(share: Array) -> tuple[Array, Array]:
    """Steps from the lowest corner to those of the simplex in which shares (B, D) of a cell lie, and their weights.

    A cell is cut into the simplices of Kuhn (IBM Journal of Research and Development 4, 1960): corners follow from the
    lowest one by a step along each axis, the one with the greatest share first. Shapes (B, D + 1, D) and (B, D + 1).
    """
    order = np.argsort(-share.real, axis=1, kind="stable")
    falling = np.take_along_axis(share, order, axis=1)
    ends = np.concatenate([np.ones_like(falling[:, :1]), falling], axis=1)
    weights = ends - np.concatenate([falling, np.zeros_like(falling[:, :1])], axis=1)
    rank = np.argsort(order, axis=1)
    return (rank[:, None] < np.arange(share.shape[1] + 1)[:, None]).astype(np.intp), weights


def _axes(box: BaseBox, postures: int) -> list[Array]:
    """Nodes along every coordinate that moves, as fine as the number of postures at each of them allows."""
    free = list(box.free)
    widths, apart = (box.upper - box.lower)[free], np.array(_APART)[free]
    while True:
        counts = 2 + np.floor(widths / apart).astype(np.intp)
        if counts.prod() * postures <= _MOST_POSTURES or (counts == 2).all():
            break
        apart = 1.2 * apart
    ends = zip(box.lower[free], box.upper[free], counts, strict=True)
    return [np.linspace(low, high, count) for low, high, count in ends]


class _Spreading:
    """Postures spread over a grid of bases, from the known base to the node beside it and on to its neighbours."""

    def __init__(self, moving: MovingBase, columns: Array, shape: tuple[int, ...]) -> None:
        self.moving, self.columns, self.shape = moving, columns, shape
        own = moving.branches.shape
        self.q = np.empty((len(columns), *own))
        self.reached = np.zeros((len(columns), *own[:2]), dtype=bool)
        self.places = np.stack(np.unravel_index(np.arange(len(columns)), shape), axis=1)

    def found(self) -> tuple[Array, Array]:
        """Postures and whether they reach their poses, on the grid."""
        width = np.ptp(self.columns, axis=0)
        home = self.moving.home[list(self.moving.box.free)]
        first = int((((self.columns - home) / width) ** 2).sum(axis=1).argmin())
        self._start(first)
        steps = np.abs(self.places - self.places[first]).sum(axis=1)
        for wave in range(1, int(steps.max()) + 1):
            self._advance(np.flatnonzero(steps == wave), steps < wave)
        for _ in range(_SWEEPS):
            if not self._sweep():
                break
        own = self.moving.branches.shape
        return frozen(self.q.reshape(*self.shape, *own)), frozen(self.reached.reshape(*self.shape, *own[:2]))

    def _start(self, first: int) -> None:
        """The first node, in steps from the known base."""
        moving, there = self.moving, self.moving.bases(self.columns[first][None])[0]
        home = moving.home[: len(there)]
        q = moving.branches[None]
        for share in (0.25, 0.5, 0.75, 1.0):
            q, reached = moving.solved((home + share * (there - home))[None], q)
        self.q[first], self.reached[first] = q[0], reached[0]

    def _neighbours(self, nodes: Array) -> Array:
        """Numbers of the nodes beside nodes (N,), shape (N, 2 D); -1 for none."""
        beside = []
        for k, count in enumerate(self.shape):
            for step in (-1, 1):
                moved = self.places[nodes].copy()
                moved[:, k] += step
                inside = (moved[:, k] >= 0) & (moved[:, k] < count)
                moved[:, k] = np.clip(moved[:, k], 0, count - 1)
                beside.append(np.where(inside, np.ravel_multi_index(tuple(moved.T), self.shape), -1))
        return np.stack(beside, axis=1)

    def _parents(self, nodes: Array, known: Array) -> tuple[Array, Array]:
        """Number of the known node beside each node for each posture, one that reaches if there is one, and if so."""
        beside = self._neighbours(nodes)
        usable = (beside >= 0) & known[beside]
        worth = usable[:, :, None, None] * (1 + self.reached[beside])  # (N, 2 D, K, C)
        best = worth.argmax(axis=1)
        parent = np.take_along_axis(np.broadcast_to(beside[:, :, None, None], worth.shape), best[:, None], axis=1)[:, 0]
        return parent, worth.max(axis=1) == 2

    def _from(self, parent: Array) -> Array:
        K, C = parent.shape[1:]
        started: Array = self.q[parent, np.arange(K)[:, None], np.arange(C)]
        return started

    def _advance(self, nodes: Array, known: Array) -> None:
        parent, _ = self._parents(nodes, known)
        bases = self.moving.bases(self.columns[nodes])
        self.q[nodes], self.reached[nodes] = self.moving.solved(bases, self._from(parent))

    def _sweep(self) -> bool:
        """Try postures that reach nothing from neighbours that do; whether any was found."""
        nodes = np.flatnonzero(~self.reached.all(axis=(1, 2)))
        if not len(nodes):
            return False
        parent, can = self._parents(nodes, np.ones(len(self.q), dtype=bool))
        can &= ~self.reached[nodes]
        some = can.any(axis=(1, 2))
        nodes, parent, can = nodes[some], parent[some], can[some]
        if not len(nodes):
            return False
        q, reached = self.moving.solved(self.moving.bases(self.columns[nodes]), self._from(parent))
        better = can & reached
        self.q[nodes] = np.where(better[..., None], q, self.q[nodes])
        self.reached[nodes] |= better
        return bool(better.any())
