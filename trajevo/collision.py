"""Distances between the links of a robot and obstacles, and between its links, by Pinocchio and coal.

Meshes are replaced by their convex hulls. A hull contains its mesh, so every distance is at most the mesh's: clearance
of the hulls is clearance of the robot. What the robot carries is not part of it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, final

import numpy as np
import pinocchio as pin

from trajevo.arrays import Array, frozen, numbers, row_products
from trajevo.errors import InvalidInputError
from trajevo.robot import Robot
from trajevo.scene import Scene
from trajevo.solids import bounding_ball, robot_geometry, solid_of

#: Configurations drawn to find the pairs that always touch, and the share in which they do (as MoveIt's assistant).
_DRAWN, _ALWAYS = 200, 0.95

#: What coal iterates distances to [m]; no slower than its usual 1e-6, which stays for depths: closer it gives up.
_TOLERANCE = 1e-10

#: Depth [m] of overlaps whose depth coal does not find: it then says 1.8e308, far above the greatest in earnest.
_UNKNOWN_DEPTH, _DEEPEST = 1e-3, 1e3

#: Bound of the error of a distance [m].
DISTANCE_ERROR = 2e-6


@final
@dataclass(frozen=True)
class Pair:
    """Two solids whose distance is watched.

    Attributes:
        first: a geometry of the robot, ``<link>_<number>``.
        second: an obstacle, or another geometry of the robot.
        itself: whether the second belongs to the robot.
    """

    first: str
    second: str
    itself: bool


@dataclass(frozen=True, eq=False)
class _Made:
    """Geometry, the pairs in its order, those that always touch, and buffers for distances that nobody used."""

    geometry: Any
    pairs: tuple[Pair, ...]
    skipped: tuple[Pair, ...]
    unused: Any


@final
@dataclass(frozen=True, eq=False)
class Collision:
    """The collision geometry of a robot in a scene.

    Watched are all geometries that move against all obstacles and, with a ``self_clearance``, all geometries on joints
    that are neither the same nor parent and child, except pairs that touch in at least 95 % of 200 random
    configurations within the joint limits (seed 0): their distance says nothing about the motion.

    Attributes:
        robot: the robot.
        scene: obstacles and clearances.

    Raises:
        InvalidInputError: the robot has no collision geometry, or a mesh cannot be read.
    """

    robot: Robot
    scene: Scene
    _cache: dict[str, _Made] = field(default_factory=dict, init=False, repr=False)

    def __post_init__(self) -> None:
        self._made()

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_cache": {}}  # geometry cannot be pickled; made again when needed

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """What is watched, in the order of every (..., n_pairs) array."""
        return self._made().pairs

    @property
    def skipped(self) -> tuple[Pair, ...]:
        """Pairs of links that are not watched because they touch in nearly every configuration."""
        return self._made().skipped

    def distances(self, q: Array, *, motion: Array | None = None) -> Array:
        """Signed distances of all pairs; where two solids overlap, minus the depth.

        Args:
            q: joint positions, shape (N, n_joints) [rad or m].
            motion: number of the motion that each state is of, from 0 on, shape (N,); all of one if None. Where the
                states of a motion follow each other, their last digits depend on those of no other motion.

        Returns:
            Shape (N, n_pairs) [m].
        """
        configurations = self._configurations(q)
        geometry, places, data, requests = self._buffers()
        distances, last = np.empty((len(configurations), len(self.pairs))), -1
        # One call in C++ per state: neither Pinocchio nor coal returns distances of a batch.
        for row, configuration, number in zip(distances, configurations, _motions(motion, len(q)), strict=True):
            if number != last:
                data.distanceRequests, last = requests, number
            pin.computeDistances(self.robot.model, places, geometry, data, configuration)
            row[:] = [result.min_distance for result in data.distanceResults]
        return _plausible(distances)

    def distances_of(self, q: Array, state: Array, pair: Array, *, motion: Array | None = None) -> Array:
        """Signed distances of some pairs in some states, cheaper than all where few are asked for.

        Args:
            q: joint positions, shape (N, n_joints) [rad or m].
            state: rows of ``q``, shape (K,), ascending.
            pair: indices of pairs, shape (K,).
            motion: as for :meth:`distances`, shape (N,).

        Returns:
            Shape (K,) [m].
        """
        configurations = self._configurations(q)
        geometry, places, data, requests = self._buffers()
        motions, distances, last, last_row = _motions(motion, len(q)), np.empty(len(state)), -1, -1
        for k, (row, watched) in enumerate(zip(state.tolist(), pair.tolist(), strict=True)):  # as above
            if motions[row] != last:
                data.distanceRequests, last = requests, motions[row]
            if row != last_row:
                pin.updateGeometryPlacements(self.robot.model, places, geometry, data, configurations[row])
                last_row = row
            distances[k] = pin.computeDistance(geometry, data, watched).min_distance
        return _plausible(distances)

    def reach(self, lower: Array, upper: Array) -> Array:
        """How fast the distance of a pair can change at most per speed of a joint, in whatever configuration.

        A ball around a geometry is carried down the chain: a revolute joint sweeps it around its axis, a prismatic one
        along it, and what is swept lies in the next ball. A point moves at most its distance from a joint's axis times
        the joint's speed. Joints that carry both solids do not change their distance.

        Args:
            lower: least joint positions, shape (B, n_joints) [rad or m]; only those of prismatic joints count.
            upper: greatest joint positions.

        Returns:
            Shape (B, n_pairs, n_joints) [m/rad or 1].
        """
        geometry = self._made().geometry
        single = [self._geometry_reach(entry, lower, upper) for entry in geometry.geometryObjects]
        rows = []
        for pair in geometry.collisionPairs:
            first, second = single[pair.first], single[pair.second]
            rows.append(np.where((first > 0.0) & (second > 0.0), 0.0, first + second))
        return frozen(np.stack(rows, axis=1))

    def _geometry_reach(self, entry: Any, lower: Array, upper: Array) -> Array:
        model = self.robot.model
        axes, turns = self.robot.joint_axes
        centre, radius = bounding_ball(entry)
        centres, radii = np.tile(centre, (len(lower), 1)), np.full(len(lower), radius)
        found, joint = np.zeros(lower.shape), entry.parentJoint
        while joint > 0:
            column, axis = model.joints[joint].idx_v, axes[joint - 1]
            if turns[joint - 1]:
                on_axis = np.outer(np.sum(centres * axis, axis=1), axis)
                radii = radii + np.linalg.norm(centres - on_axis, axis=1)
                # A solid on the axis of its joint still counts as carried by it.
                found[:, column], centres = np.maximum(radii, np.finfo(float).tiny), on_axis
            else:
                found[:, column] = 1.0
                centres = centres + np.outer(0.5 * (lower[:, column] + upper[:, column]), axis)
                radii = radii + 0.5 * (upper[:, column] - lower[:, column])
            placement = model.jointPlacements[joint]
            centres = row_products(centres, placement.rotation.T) + placement.translation
            joint = model.parents[joint]
        return found

    def _configurations(self, q: Array) -> Array:
        actuated = numbers(q, name="q", shape=("N", self.robot.dof))
        still = np.zeros_like(actuated)
        return self.robot.transmission.motion(actuated, still, still)[0]

    def _buffers(self) -> tuple[Any, Any, Any, Any]:
        # coal notes in the requests where it ended and starts from there, which is fast along a motion; so that digits
        # do not depend on other motions, every one begins with a copy of requests that nobody used.
        made = self._made()
        return made.geometry, self.robot.model.createData(), made.geometry.createData(), made.unused.distanceRequests

    def _made(self) -> _Made:
        if "made" not in self._cache:
            self._cache["made"] = self._make()
        return self._cache["made"]

    def _make(self) -> _Made:
        robot, geometry = self.robot, robot_geometry(self.robot)
        count = len(geometry.geometryObjects)
        for obstacle in self.scene.obstacles:
            placement = pin.SE3(obstacle.rotation, np.array(obstacle.position))
            # Obstacles may be called like links, and Pinocchio wants names that differ.
            entry = pin.GeometryObject(f"obstacle {obstacle.name}", 0, placement, solid_of(obstacle))
            geometry.addGeometryObject(entry)
        own = list(geometry.geometryObjects)[:count]  # not before: adding moves the others in memory
        if not any(entry.parentJoint > 0 for entry in own):
            raise InvalidInputError(f"robot {robot.name!r}: {robot.urdf}: expected <collision> geometry, got none")
        moving = [k for k, entry in enumerate(own) if entry.parentJoint > 0]
        outside = [(k, len(own) + j) for k in moving for j in range(len(self.scene.obstacles))]
        inside = [] if self.scene.self_clearance is None else _apart(robot.model, own)
        touching = self._touching(geometry, inside)
        kept = [*outside, *(pair for pair in inside if pair not in touching)]
        if not kept:
            raise InvalidInputError(f"robot {robot.name!r}: expected links that can touch something, got none")
        _watch(geometry, kept)
        names = [entry.name for entry in own] + [obstacle.name for obstacle in self.scene.obstacles]
        pairs = [Pair(names[i], names[j], j < len(own)) for i, j in kept]
        skipped = [Pair(names[i], names[j], True) for i, j in touching]
        return _Made(geometry, tuple(pairs), tuple(skipped), _distance_data(geometry))

    def _touching(self, geometry: Any, inside: list[tuple[int, int]]) -> list[tuple[int, int]]:
        if not inside:
            return []
        limits = self.robot.limits
        most = np.where(np.array(self.robot.joint_units) == "rad", np.pi, 1.0)
        lower, upper = np.maximum(limits.lower, -most), np.minimum(limits.upper, most)
        lower, upper = np.where(lower < upper, lower, limits.lower), np.where(lower < upper, upper, limits.upper)
        drawn = np.random.default_rng(0).uniform(lower, upper, (_DRAWN, self.robot.dof))
        _watch(geometry, inside)
        data, places, contacts = _distance_data(geometry), self.robot.model.createData(), np.zeros(len(inside))
        for configuration in self._configurations(drawn):
            pin.computeDistances(self.robot.model, places, geometry, data, configuration)
            contacts += [result.min_distance <= 0.0 for result in data.distanceResults]
        return [pair for pair, count in zip(inside, contacts, strict=True) if count >= _ALWAYS * _DRAWN]


def _apart(model: Any, own: list[Any]) -> list[tuple[int, int]]:
    """Pairs of geometries whose joints are neither the same nor parent and child, the moving one first."""
    joints, parents = [entry.parentJoint for entry in own], list(model.parents)
    pairs = [(i, k) if joints[i] > 0 else (k, i) for i in range(len(own)) for k in range(i + 1, len(own))]
    return [
        (i, k)
        for i, k in pairs
        if joints[i] != joints[k] and parents[joints[k]] != joints[i] and parents[joints[i]] != joints[k]
    ]


def _watch(geometry: Any, pairs: list[tuple[int, int]]) -> None:
    """Make these the pairs of a geometry."""
    geometry.removeAllCollisionPairs()
    for first, second in pairs:
        geometry.addCollisionPair(pin.CollisionPair(first, second))


def _distance_data(geometry: Any) -> Any:
    """Buffers for the distances of a geometry's pairs."""
    data = geometry.createData()
    for request in data.distanceRequests:
        request.gjk_tolerance, request.gjk_max_iterations = _TOLERANCE, 1000
    return data


def _motions(motion: Array | None, count: int) -> list[int]:
    """Numbers of the motions that states are of."""
    return [0] * count if motion is None else motion.tolist()


def _plausible(distances: Array) -> Array:
    return frozen(np.where(distances < -_DEEPEST, -_UNKNOWN_DEPTH, distances))
