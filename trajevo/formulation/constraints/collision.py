"""Distances between the links of a robot and obstacles, and between its links, by Pinocchio and coal.

Meshes are replaced by their convex hulls. A hull contains its mesh, so its distances are at most those of the mesh, and
if the hulls keep a clearance, so does the robot. A load with a shape is a solid fixed to the tool, and a scene may have
solids that are attached to links.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, final

import coal
import numpy as np
import pinocchio as pin

from trajevo.base.arrays import Array, frozen, numbers
from trajevo.errors import InvalidInputError
from trajevo.formulation.constraints.broad_phase.bodies import Bodies
from trajevo.formulation.constraints.broad_phase.lower_bounds import LowerBounds
from trajevo.formulation.constraints.scene import Scene
from trajevo.formulation.constraints.scenes.obstacles import Obstacle
from trajevo.formulation.constraints.solids import (
    Witnesses,
    assembled,
    bounding_ball,
    parting,
    solid_reach,
)
from trajevo.robot.robot import Robot

#: Number of random configurations, and the share of them in which a pair touches to be skipped (as MoveIt's assistant).
_DRAWN, _ALWAYS = 200, 0.95

#: Tolerances of coal's distances and depths [m], no slower than its default 1e-6. Below these coal misses some depths.
_TOLERANCE, _DEPTH_TOLERANCE = 1e-10, 3e-7

#: Depth [m] assumed where coal does not find it and returns 1.8e308, and the greatest depth that is believed [m].
_UNKNOWN_DEPTH, _DEEPEST = 1e-3, 1e3

#: Tolerance of a unit normal's squared length; coal gives no direction where it finds no depth.
_UNIT = 1e-6

#: Bound of the error of a distance [m].
DISTANCE_ERROR = 2e-6


@final
@dataclass(frozen=True)
class Pair:
    """Two solids whose distance is checked.

    Attributes:
        first: a geometry of the robot, ``<link>_<number>``.
        second: an obstacle, or another geometry of the robot.
        itself: whether the second belongs to the robot.
    """

    first: str
    second: str
    itself: bool


@final
@dataclass(frozen=True, eq=False)
class CarriedSolid:
    """A solid that is fixed to the tool.

    Attributes:
        solid: its shape, with name and place in the tool frame.
        touches: names of obstacles from which it need not stay away, such as the table on which it stands.
    """

    solid: Obstacle
    touches: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class _Made:
    """What is made of a robot and a scene once.

    Attributes:
        geometry: geometry of both.
        derived: what is kept with the robot's geometry by :func:`robot_geometry`.
        ends: first and second solid of every pair, shape (n_pairs, 2).
        pairs: the pairs by name.
        skipped: pairs that nearly always touch.
        unused: buffers that no thread uses.
    """

    geometry: Any
    derived: dict[str, Any]
    ends: Array
    pairs: tuple[Pair, ...]
    skipped: tuple[Pair, ...]
    unused: list[tuple[Any, Any]] = field(default_factory=list)


@final
@dataclass(frozen=True, eq=False)
class Collision:
    """The collision geometry of a robot in a scene.

    All moving geometries are checked against all obstacles. With a ``self_clearance``, geometries are also checked
    against each other if their joints are neither the same nor parent and child, except pairs that touch in at least
    95 % of 200 random configurations within the joint limits (seed 0): their distance says nothing about the motion.
    Solids that the scene attaches to links are checked as geometries of these links are. What a solid ``touches`` is
    not checked against it.

    With a carried solid, only this solid is checked, against obstacles and against the robot's geometries.

    Attributes:
        robot: the robot.
        scene: obstacles and clearances.
        carried: a solid that is fixed to the tool; None for the robot alone.

    Raises:
        InvalidInputError: the robot has no collision geometry, or a mesh cannot be read.
    """

    robot: Robot
    scene: Scene
    carried: CarriedSolid | None = None
    _cache: dict[str, Any] = field(default_factory=dict, init=False, repr=False)

    def __post_init__(self) -> None:
        self._made()

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_cache": {}}  # geometry cannot be pickled; it is built again when needed

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """The pairs that are checked, in the order of every (..., n_pairs) array."""
        return self._made().pairs

    @property
    def skipped(self) -> tuple[Pair, ...]:
        """Pairs of links that are not checked because they touch in nearly every configuration."""
        return self._made().skipped

    def distances(self, q: Array) -> Array:
        """Signed distances of all pairs; minus the depth where two solids overlap.

        To the bit, a distance depends on the state and the pair alone.

        Args:
            q: joint positions, shape (N, n_joints) [rad or m].

        Returns:
            Shape (N, n_pairs) [m].
        """
        configurations = self._configurations(q)
        distances = np.empty((len(configurations), len(self.pairs)))
        with self._buffers() as (geometry, places, data):
            # One call in C++ per state: neither Pinocchio nor coal returns distances of a batch.
            for row, configuration in zip(distances, configurations, strict=True):
                pin.computeDistances(self.robot.model, places, geometry, data, configuration)
                row[:] = [result.min_distance for result in data.distanceResults]
        return _plausible(distances)

    def distances_of(self, q: Array, state: Array, pair: Array) -> Array:
        """Signed distances of some pairs in some states: the same as all distances, cheaper if they are few.

        Args:
            q: joint positions, shape (N, n_joints) [rad or m].
            state: rows of ``q``, shape (K,); cheapest if equal ones are next to each other.
            pair: indices of pairs, shape (K,).

        Returns:
            Shape (K,) [m].
        """
        compute, found, last = pin.computeDistance, [], -1
        configurations, model = self._configurations(q), self.robot.model
        with self._buffers() as (geometry, places, data):
            for row, watched in zip(state.tolist(), pair.tolist(), strict=True):
                if row != last:
                    pin.updateGeometryPlacements(model, places, geometry, data, configurations[row])
                    last = row
                found.append(compute(geometry, data, watched).min_distance)
        return _plausible(np.array(found, dtype=np.float64))

    def slopes_of(self, q: Array, state: Array, pair: Array) -> Array:
        """Derivatives of signed distances with respect to the positions of the robot's joints, depths included.

        If two solids overlap and coal does not find the depth, the distance of their centres is used instead.

        Args:
            q: joint positions, shape (N, n_joints) [rad or m].
            state: rows of ``q``, shape (K,); cheapest if equal ones are next to each other.
            pair: indices of pairs, shape (K,).

        Returns:
            Shape (K, n_joints) [m/rad or 1].
        """
        made = self._made()
        entries, own = made.geometry.geometryObjects, made.ends[pair]
        carriers = np.array([entry.parentJoint for entry in entries], dtype=np.intp)[own]
        points, normals = np.empty((len(state), 2, 3)), np.empty((len(state), 3))
        for k, (result, places) in enumerate(self._results(q, state, pair)):
            points[k, 0], points[k, 1], normals[k] = result.getNearestPoint1(), result.getNearestPoint2(), result.normal
            x, y, z = normals[k].tolist()
            if result.min_distance < -_DEEPEST or not abs(x * x + y * y + z * z - 1.0) < _UNIT:
                solids = (entries[i] for i in own[k].tolist())
                points[k] = [places.oMi[solid.parentJoint].act(bounding_ball(solid)[0]) for solid in solids]
                apart = points[k, 1] - points[k, 0]
                normals[k] = apart / max(float(np.linalg.norm(apart)), _TOLERANCE)
        frames = self.bodies.joint_frames(numbers(q, name="q", shape=("N", self.robot.dof)))[state]
        slopes = parting(self.robot, frames, Witnesses(carriers, points, normals))
        return frozen(self.bodies.coordinates.slopes(slopes))

    def _results(self, q: Array, state: Array, pair: Array) -> Iterator[tuple[Any, Any]]:
        """The result of coal for each pair in its state, and Pinocchio's data of that state."""
        configurations, last_row = self._configurations(q), -1
        with self._buffers() as (geometry, places, data):
            for row, watched in zip(state.tolist(), pair.tolist(), strict=True):
                if row != last_row:
                    pin.updateGeometryPlacements(self.robot.model, places, geometry, data, configurations[row])
                    last_row = row
                yield pin.computeDistance(geometry, data, watched), places

    def reach(self, lower: Array, upper: Array) -> Array:
        """Bound of the rate of change of each pair's distance per unit of joint speed, in every configuration.

        Joints that carry both solids do not change their distance, see
        :func:`trajevo.formulation.constraints.solids.solid_reach`.

        Args:
            lower: least joint positions, shape (B, n_joints) [rad or m]; only those of prismatic joints matter. Complex
                steps are kept.
            upper: greatest joint positions, the same shape [rad or m].

        Returns:
            Shape (B, n_pairs, n_joints) [m/rad or 1].
        """
        solids = self.solid_reach(lower, upper)
        still = np.zeros((len(solids), len(self.scene.obstacles), solids.shape[2]))
        first, second = (np.concatenate([solids, still], axis=1)[:, end] for end in self.ends.T)
        reach = self.bodies.coordinates.reaches(np.where((first > 0.0) & (second > 0.0), 0.0, first + second))
        return frozen(np.broadcast_to(reach, (len(lower), *reach.shape[1:])))

    def solid_reach(self, lower: Array, upper: Array) -> Array:
        """Bound of the speed of each of the robot's G solids per unit of speed of a joint of the model.

        Args:
            lower: as for :meth:`reach`.
            upper: as for :meth:`reach`.

        Returns:
            Shape (B, G, n_model) [m/rad or 1], or (1, G, n_model) if no joint slides: it is the same for all motions.
        """
        robot, derived = self.robot, self._made().derived
        if not self.bodies.turning.all():
            lower, upper = self.bodies.coordinates.ranges(lower, upper)
            return np.stack([solid_reach(robot, entry, lower, upper) for entry in self._own], axis=1)
        if "reach" not in derived:
            still = np.zeros((1, robot.model.nv))
            derived["reach"] = np.stack([solid_reach(robot, entry, still, still) for entry in self._own], axis=1)
        found: Array = derived["reach"]
        return found

    @property
    def ends(self) -> Array:
        """First and second solid of every pair, shape (n_pairs, 2); obstacles are numbered after the robot's solids."""
        return self._made().ends

    @property
    def bodies(self) -> Bodies:
        """The robot's solids in balls."""
        derived = self._made().derived
        if "bodies" not in derived:
            derived["bodies"] = Bodies(self.robot, self._own)
        found: Bodies = derived["bodies"]
        return found

    @property
    def lower_bounds(self) -> LowerBounds:
        """Lower bounds of the distances, for many states at once."""
        if "bounds" not in self._cache:
            self._cache["bounds"] = LowerBounds(self.bodies, self.scene.obstacles, self.ends)
        found: LowerBounds = self._cache["bounds"]
        return found

    @property
    def _own(self) -> list[Any]:
        """The robot's geometry objects."""
        entries = list(self._made().geometry.geometryObjects)
        return entries[: len(entries) - len(self.scene.obstacles)]

    def _configurations(self, q: Array) -> Array:
        actuated = numbers(q, name="q", shape=("N", self.robot.dof))
        still = np.zeros_like(actuated)
        return self.robot.transmission.motion(actuated, still, still)[0]

    @contextmanager
    def _buffers(self) -> Iterator[tuple[Any, Any, Any]]:
        """Geometry, and Pinocchio's data of model and geometry, which no other thread uses meanwhile."""
        made = self._made()
        try:
            places, data = made.unused.pop()
        except IndexError:
            places, data = self.robot.model.createData(), _distance_data(made.geometry)
        try:
            yield made.geometry, places, data
        finally:
            made.unused.append((places, data))

    def _made(self) -> _Made:
        if "made" not in self._cache:
            self._cache["made"] = self._make()
        made: _Made = self._cache["made"]
        return made

    def _make(self) -> _Made:
        robot, scene, carried = self.robot, self.scene, self.carried
        made = assembled(robot, scene, None if carried is None else (carried.solid, carried.touches))
        geometry, count = made.geometry, made.count
        own = list(geometry.geometryObjects)[:count]
        if not any(entry.parentJoint > 0 for entry in own):
            raise InvalidInputError(f"robot {robot.name!r}: {robot.where}: expected <collision> geometry, got none")
        moving, apart = [k for k, entry in enumerate(own) if entry.parentJoint > 0], _apart(robot.model, own)
        if carried is not None:
            moving, apart = [count - 1], [(count - 1, min(pair)) for pair in apart if count - 1 in pair]
        around = range(count, len(made.names))
        outside = [(k, j) for k in moving for j in around if not made.may_touch(k, j)]
        inside = [pair for pair in apart if scene.self_clearance is not None and not made.may_touch(*pair)]
        touching = self._touching(geometry, inside)
        kept = [*outside, *(pair for pair in inside if pair not in touching)]
        if not kept and carried is None:
            raise InvalidInputError(f"robot {robot.name!r}: expected links that can touch something, got none")
        _watch(geometry, kept)
        pairs = [Pair(made.names[i], made.names[j], j < count) for i, j in kept]
        skipped = [Pair(made.names[i], made.names[j], True) for i, j in touching]
        return _Made(geometry, made.derived, np.array(kept).reshape(-1, 2), tuple(pairs), tuple(skipped))

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
    """Set the pairs of a geometry."""
    geometry.removeAllCollisionPairs()
    for first, second in pairs:
        geometry.addCollisionPair(pin.CollisionPair(first, second))


def _distance_data(geometry: Any) -> Any:
    """Buffers for the distances of a geometry's pairs."""
    request, data = coal.DistanceRequest(), geometry.createData()
    request.gjk_tolerance, request.gjk_max_iterations = _TOLERANCE, 1000
    request.epa_tolerance = _DEPTH_TOLERANCE
    # Pinocchio lets coal start from what it found last, so that digits depend on what was asked before. To start from
    # the centres of the bounding volumes takes as long, and pairs that are far apart can be left out.
    request.gjk_initial_guess = coal.GJKInitialGuess.BoundingVolumeGuess
    for k in range(len(geometry.collisionPairs)):
        data.distanceRequests[k] = request
    return data


def _plausible(distances: Array) -> Array:
    return frozen(np.where(distances < -_DEEPEST, -_UNKNOWN_DEPTH, distances))
