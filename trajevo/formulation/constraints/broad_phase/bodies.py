"""Where many states put the balls around a robot's solids, and how far its solids move between two states.

To the bit, the numbers of a state do not depend on the other states. Complex steps are kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, final

import numpy as np

from trajevo.base import jit
from trajevo.base.arrays import Array
from trajevo.formulation.constraints.broad_phase import loops
from trajevo.formulation.constraints.broad_phase.coordinates import Coordinates
from trajevo.formulation.constraints.broad_phase.covers import Cover
from trajevo.formulation.constraints.broad_phase.movers import Movers
from trajevo.robot.robot import Robot


class _Joint(NamedTuple):
    """A joint, with the z axis of its frame along its axis.

    Attributes:
        parent: number of its parent.
        column: its column in q.
        turns: whether it turns, otherwise it slides.
        start: axes of its frame at position 0 and its origin in its parent's frame, shape (4, 3).
    """

    parent: int
    column: int
    turns: bool
    start: Array


@final
@dataclass(frozen=True, eq=False)
class Placed:
    """Solids in N states.

    Attributes:
        whole: centres of the ball around each solid, shape (G, 3, N) [m].
        axes: axes of the joint that carries it, shape (G, 9, N).
        balls: centres of all balls in blocks of states, shape (G, blocks, 3, 1 + K, BLOCK) [m].
        t: instants, shape (N,) [s]; None if no obstacle moves.
    """

    whole: Array
    axes: Array
    balls: Array
    t: Array | None = None


@final
@dataclass(frozen=True, eq=False)
class PlacedByLoops:
    """Solids in N states, by compiled loops.

    Attributes:
        count: number N of states.
        frames: axes and origins of joints in blocks of states, see :func:`loops.frames`.
        carriers: number of the joint that carries each solid, shape (G,).
        centres: centres of the ball around each solid, in all states of the blocks, see :func:`loops.centres` [m].
        t: instants, shape (N,) [s]; None if no obstacle moves.
    """

    count: int
    frames: Array
    carriers: Array
    centres: Array
    t: Array | None = None

    @property
    def whole(self) -> Array:
        """Centres of the ball around each solid, shape (G, 3, N) [m]."""
        return self.centres[..., : self.count]

    @property
    def axes(self) -> Array:
        """Axes of the joint that carries each solid, shape (G, 9, N)."""
        blocks, joints, _ = self.frames.shape
        rows = self.frames.reshape(blocks, joints, 4, 3, -1)[:, self.carriers, :3]
        axes: Array = np.moveaxis(rows, (0, 2), (3, 2)).reshape(len(self.carriers), 9, -1)[..., : self.count]
        return axes


@final
class Bodies:
    """The G solids of a robot and of obstacles that move, each in one ball and in K balls that cover it.

    Where an obstacle moves, a state is the positions of the robot's joints and, as its last number, the instant [s].

    Args:
        robot: the robot.
        solids: its geometry objects.
        movers: obstacles that move, numbered after these.

    Attributes:
        count: number of the robot's solids.
        movers: obstacles that move.
        radii: radii of the balls, the one around each solid first, shape (G, 1 + K) [m].
        centres: their centres in the frame of the joint that carries the solid, shape (G, 1 + K, 3) [m].
        carriers: number of this joint, shape (G,); frames of obstacles are numbered after the joints.
        turning: which joints of the model turn, otherwise they slide, shape (n_model,).
        coordinates: the joints of the model by those for which motions are planned.
    """

    def __init__(self, robot: Robot, solids: Sequence[Any], movers: Movers) -> None:
        self.count, self.movers = len(solids), movers
        self._joints, turned = _joints(robot)
        apart = 1 + len(self._joints) + np.arange(len(movers))
        self.carriers = np.concatenate([np.array([entry.parentJoint for entry in solids], dtype=np.int64), apart])
        turned = np.concatenate([turned, np.tile(np.eye(3), (len(movers), 1, 1))])
        covers = [*(Cover.of(entry) for entry in solids), *movers.covers]
        most = max(len(cover.radii) for cover in covers)
        # Covers of fewer balls repeat their last one.
        wide = [np.minimum(np.arange(most), len(cover.radii) - 1) for cover in covers]
        centres = np.stack([cover.centres[chosen] for cover, chosen in zip(covers, wide, strict=True)])
        self.centres = centres @ turned[self.carriers]
        self.radii = np.stack([cover.radii[chosen] for cover, chosen in zip(covers, wide, strict=True)])
        self._around = np.ascontiguousarray(self.radii[:, 0])

        self._tree = _tree(self._joints)
        self.coordinates = Coordinates.of(robot)
        self.turning = np.empty(robot.model.nv, dtype=bool)
        self.turning[self._tree[1]] = self._tree[2]

    def split(self, states: Array) -> tuple[Array, Array | None]:
        """Positions of the robot's joints, (N, n_joints), and instants, (N,) [s], or None if no obstacle moves."""
        return (states[:, :-1], states[:, -1]) if len(self.movers) else (states, None)

    def placed(self, states: Array) -> Placed | PlacedByLoops:
        """The solids in states.

        Args:
            states: positions of the robot's joints, shape (N, n_joints) [rad or m], and the instant where obstacles
                move [s].
        """
        q, t = self.split(states)
        q = self.coordinates.positions(q)
        if jit.can_compile() and states.dtype == np.float64:
            return self._placed_by_loops(q, t)
        frames = self._frames(_blocks(q))
        if t is not None:
            moving = np.moveaxis(self._moving_frames(t, BLOCK), 2, 4)  # (M, blocks, 4, 3, BLOCK)
            frames = np.concatenate([frames, np.swapaxes(moving, 2, 3)])
        frames = frames[self.carriers]
        balls = np.matmul(self.centres[:, None, None], frames[:, :, :, :3])
        balls += frames[:, :, :, 3:]
        solids, count = len(self.radii), len(q)
        axes = np.moveaxis(frames[:, :, :, :3], 1, 3).reshape(solids, 9, -1)[..., :count]
        return Placed(np.swapaxes(balls[:, :, :, 0], 1, 2).reshape(solids, 3, -1)[..., :count], axes, balls, t)

    def _placed_by_loops(self, q: Array, t: Array | None) -> PlacedByLoops:
        blocks, solids, joints = -(-len(q) // loops.WIDE), len(self.radii), 1 + len(self._joints)
        frames = np.empty((blocks, joints + len(self.movers), 12 * loops.WIDE))
        whole = np.empty((solids, 3, blocks * loops.WIDE))
        loops.frames(np.ascontiguousarray(q), *self._tree, frames)
        if t is not None:
            moving = np.moveaxis(self._moving_frames(t, loops.WIDE), (1, 2), (0, 4))  # (blocks, M, 4, 3, WIDE)
            frames[:, joints:] = moving.reshape(blocks, len(self.movers), -1)
        loops.centres(frames, self.carriers, self.centres[:, 0], whole)
        return PlacedByLoops(len(q), frames, self.carriers, whole, t)

    def _moving_frames(self, t: Array, size: int) -> Array:
        """Axes and origins of the frames of obstacles in blocks of states, shape (M, blocks, size, 4, 3)."""
        padded = np.append(t, np.repeat(t[-1:], -len(t) % size))
        return self.movers.frames(padded).reshape(len(self.movers), -1, size, 4, 3)

    def moved(self, placed: Placed | PlacedByLoops) -> Array:
        """How far any point of each solid is moved from one state to the next, at most, shape (N - 1, G) [m].

        For an obstacle that moves it is how far it moves in between.
        """
        own = self.count
        if isinstance(placed, PlacedByLoops):
            found = np.empty((max(placed.count - 1, 0), own))
            loops.moved(placed.frames, placed.centres[:own], self.carriers[:own], self._around[:own], found)
        else:
            along = _square(np.diff(placed.whole[:own]).swapaxes(0, 1))
            # The spectral norm of the difference of two rotations is its Frobenius norm over √2.
            around = _square(np.diff(placed.axes[:own]).swapaxes(0, 1))
            found = (np.sqrt(along) + np.sqrt(0.5 * around) * self._around[:own, None]).T
        return found if placed.t is None else np.concatenate([found, self.movers.moved(placed.t)], axis=1)

    def joint_frames(self, q: Array) -> Array:
        """Axis and origin of every joint of the model in the base frame, shape (N, 2, n_model, 3) [1 and m].

        Args:
            q: positions of the robot's joints, shape (N, n_joints) [rad or m].
        """
        q = self.coordinates.positions(q)
        frames = self._frames(_blocks(q))[1:, :, :, 2:]
        placed: Array = np.moveaxis(frames, (1, 4, 3, 0, 2), (0, 1, 2, 3, 4)).reshape(-1, 2, len(frames), 3)
        return placed[: len(q)]

    def _frames(self, q: Array) -> Array:
        """Axes and origins of the base and of every joint, shape (J, blocks, 3, 4, BLOCK); the last axis but one is x,
        y, z, and the origin.
        """
        sines, cosines = np.sin(q), np.cos(q)[:, :, None, None]
        crossed = np.stack([sines, -sines], axis=2)[:, :, None]
        frames = np.zeros((1 + len(self._joints), len(q), 3, 4, BLOCK), dtype=q.dtype)
        frames[0, :, :, :3] = np.eye(3)[:, :, None]
        for joint, (parent, column, turns, start) in enumerate(self._joints, 1):
            frame = frames[joint]
            np.matmul(start, frames[parent, :, :, :3], out=frame)
            frame[:, :, 3] += frames[parent, :, :, 3]
            if turns:  # x' = cos q x + sin q y, y' = cos q y - sin q x
                across = frame[:, :, :2]
                np.add(cosines[:, column] * across, crossed[:, column] * across[:, :, ::-1], out=across)
            else:
                frame[:, :, 3] += q[:, column, None] * frame[:, :, 2]
        return frames


#: Number of states in one matrix product: the products of all states have the same shape, so that the digits of a state
#: do not depend on the other states (see :func:`trajevo.base.arrays.row_products`).
BLOCK = 48


def _blocks(q: Array) -> Array:
    """States (N, n_joints) in blocks, shape (M, n_joints, BLOCK)."""
    count = -(-len(q) // BLOCK)
    padded = np.zeros((count * BLOCK, q.shape[1]), dtype=q.dtype)
    padded[: len(q)] = q
    return np.ascontiguousarray(padded.reshape(count, BLOCK, -1).swapaxes(1, 2))


def _square(vectors: Array) -> Array:
    """Sums of squares over the first axis, one after the other."""
    total: Array = vectors[0] * vectors[0]
    for row in vectors[1:]:
        total += row * row
    return total


def _tree(joints: Sequence[_Joint]) -> tuple[Array, Array, Array, Array]:
    """The joints as :func:`loops.frames` takes them."""
    parents = np.array([joint.parent for joint in joints], dtype=np.int64)
    columns = np.array([joint.column for joint in joints], dtype=np.int64)
    turns = np.array([joint.turns for joint in joints], dtype=bool)
    return parents, columns, turns, np.stack([joint.start for joint in joints])


def _joints(robot: Robot) -> tuple[list[_Joint], Array]:
    """The joints, and the axes of their frames in the model's frames, the base first, shape (J, 3, 3)."""
    model, (axes, turns) = robot.model, robot.joint_axes
    found, turned = [], [np.eye(3)]
    for joint, axis, turning in zip(range(1, model.njoints), axes, turns, strict=True):
        # Any frame whose last axis is the joint's.
        first = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
        first /= np.linalg.norm(first)
        turned.append(np.column_stack([first, np.cross(axis, first), axis]))
        parent, place = int(model.parents[joint]), model.jointPlacements[joint]
        start = turned[parent].T @ np.column_stack([place.rotation @ turned[-1], place.translation])
        found.append(_Joint(parent, int(model.joints[joint].idx_q), bool(turning), np.ascontiguousarray(start.T)))
    return found, np.stack(turned)
