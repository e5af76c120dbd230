"""Distances between the links of a robot and obstacles, and between its links, by Pinocchio and coal.

Meshes are replaced by their convex hulls. A hull contains its mesh, so its distances are at most those of the mesh, and
if the hulls keep a clearance, so does the robot. A load with a shape is a solid fixed to the tool, and a scene may have
solids that are attached to links.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
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
from trajevo.formulation.constraints.broad_phase.movers import Movers
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
from trajevo.trajectory.batch import TrajectoryBatch
from trajevo.trajectory.polynomial import PolynomialBatch

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


@dataclass(frozen=True, eq=False, repr=False)
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
@dataclass(frozen=True, eq=False, repr=False)
class Collision:
    """The collision geometry of a robot in a scene.

    All moving geometries are checked against all obstacles. With a ``self_clearance``, geometries are also checked
    against each other if their joints are neither the same nor parent and child, except pairs that touch in at least
    95 % of 200 random configurations within the joint limits (seed 0): their distance says nothing about the motion.
    Solids that the scene attaches to links are checked as geometries of these links are. What a solid ``touches`` is
    not checked against it.

    With a carried solid, only this solid is checked, against obstacles and against the robot's geometries.

    Where an obstacle of the scene moves, the last number of a state is the instant [s], see :meth:`with_time`: the
    state has n_columns = n_joints + 1 numbers, otherwise n_joints.

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

    @property
    def timed(self) -> bool:
        """Whether distances depend on the time, since an obstacle of the scene moves."""
        return bool(self.scene.moving)

    def with_time(self, trajectory: TrajectoryBatch) -> TrajectoryBatch:
        """Motions whose values are states: with the time as a last column if distances depend on it.

        Raises:
            InvalidInputError: an obstacle moves, and motions are no piecewise polynomials.
        """
        if not self.timed:
            return trajectory
        if not isinstance(trajectory, PolynomialBatch):
            name = self.scene.moving[0].name
            raise InvalidInputError(
                f"scene: obstacle {name!r}: motion: expected an interpolant of piecewise polynomials, for which the "
                f"distance to what moves is proven, got motions along a fixed path ({type(trajectory).__name__})"
            )
        return trajectory.with_time()

    def distances(self, states: Array) -> Array:
        """Signed distances of all pairs; minus the depth where two solids overlap.

        To the bit, a distance depends on the state and the pair alone.

        Args:
            states: positions of the joints [rad or m], and the instant if an obstacle moves [s], shape (N, n_columns).

        Returns:
            Shape (N, n_pairs) [m].
        """
        checked = self._checked(states)
        configurations, frames = self._configurations(checked), self._frames(checked)
        distances = np.empty((len(configurations), len(self.pairs)))
        with self._buffers() as (geometry, places, data):
            # One call in C++ per state: neither Pinocchio nor coal returns distances of a batch.
            for row, (own, configuration) in enumerate(zip(distances, configurations, strict=True)):
                pin.updateGeometryPlacements(self.robot.model, places, geometry, data, configuration)
                self._place(data, frames, row)
                pin.computeDistances(geometry, data)
                own[:] = [result.min_distance for result in data.distanceResults]
        return _plausible(distances)

    def distances_of(self, states: Array, state: Array, pair: Array) -> Array:
        """Signed distances of some pairs in some states: the same as all distances, cheaper if they are few.

        Args:
            states: as for :meth:`distances`, shape (N, n_columns).
            state: rows of ``states``, shape (K,); cheapest if equal ones are next to each other.
            pair: indices of pairs, shape (K,).

        Returns:
            Shape (K,) [m].
        """
        found = [result.min_distance for result, _ in self._results(states, state, pair)]
        return _plausible(np.array(found, dtype=np.float64))

    def slopes_of(self, states: Array, state: Array, pair: Array) -> Array:
        """Derivatives of signed distances with respect to the numbers of a state, depths included.

        If two solids overlap and coal does not find the depth, the distance of their centres is used instead.

        Args:
            states: as for :meth:`distances`, shape (N, n_columns).
            state: rows of ``states``, shape (K,); cheapest if equal ones are next to each other.
            pair: indices of pairs, shape (K,).

        Returns:
            Shape (K, n_columns) [m/rad or 1, and m/s for the time].
        """
        made = self._made()
        entries, own = made.geometry.geometryObjects, made.ends[pair]
        carriers = np.array([entry.parentJoint for entry in entries], dtype=np.intp)[own]
        points, normals = np.empty((len(state), 2, 3)), np.empty((len(state), 3))
        for k, (result, carrier) in enumerate(self._results(states, state, pair)):
            points[k, 0], points[k, 1], normals[k] = result.getNearestPoint1(), result.getNearestPoint2(), result.normal
            x, y, z = normals[k].tolist()
            if result.min_distance < -_DEEPEST or not abs(x * x + y * y + z * z - 1.0) < _UNIT:
                points[k] = [carrier(i).act(bounding_ball(entries[i])[0]) for i in own[k].tolist()]
                apart = points[k, 1] - points[k, 0]
                normals[k] = apart / max(float(np.linalg.norm(apart)), _TOLERANCE)
        q, t = self.bodies.split(self._checked(states))
        witnesses = Witnesses(carriers, points, normals)
        slopes = self.bodies.coordinates.slopes(parting(self.robot, self.bodies.joint_frames(q)[state], witnesses))
        if t is not None:
            slopes = np.column_stack([slopes, self._drifts(t[state], own[:, 1], witnesses)])
        return frozen(slopes)

    def _drifts(self, t: Array, second: Array, witnesses: Witnesses) -> Array:
        """How fast distances grow because the second solids of K pairs move by themselves, shape (K,) [m/s]."""
        drifts, count = np.zeros(len(t)), self.bodies.count
        for k, motion in enumerate(self.bodies.movers.motions):
            chosen = np.flatnonzero(second == count + k)
            (_, origins), (velocities, turning) = motion.poses(t[chosen]), motion.rates(t[chosen])
            speeds = velocities + np.cross(turning, witnesses.points[chosen, 1] - origins)
            drifts[chosen] = np.sum(witnesses.normals[chosen] * speeds, axis=1)
        return drifts

    def _results(self, states: Array, state: Array, pair: Array) -> Iterator[tuple[Any, Callable[[int], Any]]]:
        """The result of coal for each pair in its state, and what gives the frame that carries a solid there."""
        checked, last_row = self._checked(states), -1
        configurations, frames = self._configurations(checked), self._frames(checked)
        with self._buffers() as (geometry, places, data):

            def carrier(number: int) -> Any:
                entry = geometry.geometryObjects[number]
                if any(number == moving for moving, *_ in frames):
                    return data.oMg[number] * entry.placement.inverse()
                return places.oMi[entry.parentJoint]

            for row, watched in zip(state.tolist(), pair.tolist(), strict=True):
                if row != last_row:
                    pin.updateGeometryPlacements(self.robot.model, places, geometry, data, configurations[row])
                    self._place(data, frames, row)
                    last_row = row
                yield pin.computeDistance(geometry, data, watched), carrier

    @staticmethod
    def _place(data: Any, frames: list[tuple[int, Any, Array, Array]], row: int) -> None:
        """Place the obstacles that move, by their numbers, their places in their frames, and these frames in states."""
        for number, own, rotations, positions in frames:
            data.oMg[number] = pin.SE3(rotations[row], positions[row]) * own

    def _frames(self, states: Array) -> list[tuple[int, Any, Array, Array]]:
        """Of each obstacle that moves its number, its place in its frame, and that frame in N states."""
        if not self.timed:
            return []
        entries, first = self._made().geometry.geometryObjects, self.bodies.count
        moving = enumerate(self.bodies.movers.motions, first)
        return [(number, entries[number].placement, *motion.poses(states[:, -1])) for number, motion in moving]

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
            return np.stack([solid_reach(robot, entry, lower, upper) for entry in self._own()], axis=1)
        if "reach" not in derived:
            still = np.zeros((1, robot.model.nv))
            derived["reach"] = np.stack([solid_reach(robot, entry, still, still) for entry in self._own()], axis=1)
        found: Array = derived["reach"]
        return found

    @property
    def ends(self) -> Array:
        """First and second solid of every pair, shape (n_pairs, 2); obstacles are numbered after the robot's solids."""
        return self._made().ends

    @property
    def bodies(self) -> Bodies:
        """The robot's solids, and obstacles that move, in balls."""
        derived = self._made().derived
        if "bodies" not in derived:
            own, motions = self._own(), [obstacle.motion for obstacle in self.scene.moving if obstacle.motion]
            moving = list(self._made().geometry.geometryObjects)[len(own) : len(own) + len(motions)]
            derived["bodies"] = Bodies(self.robot, own, Movers.of(motions, moving))
        found: Bodies = derived["bodies"]
        return found

    @property
    def lower_bounds(self) -> LowerBounds:
        """Lower bounds of the distances, for many states at once."""
        if "bounds" not in self._cache:
            self._cache["bounds"] = LowerBounds(self.bodies, self.scene.still, self.ends)
        found: LowerBounds = self._cache["bounds"]
        return found

    def _own(self) -> list[Any]:
        """The robot's geometry objects."""
        entries = list(self._made().geometry.geometryObjects)
        return entries[: len(entries) - len(self.scene.obstacles)]

    def _checked(self, states: Array) -> Array:
        return numbers(states, name="states" if self.timed else "q", shape=("N", self.robot.dof + self.timed))

    def _configurations(self, states: Array) -> Array:
        return self._of_model(states[:, : self.robot.dof])

    def _of_model(self, q: Array) -> Array:
        still = np.zeros_like(q)
        return self.robot.transmission.motion(q, still, still)[0]

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
        for configuration in self._of_model(drawn):
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
