"""Clearance as a constraint, proven between samples.

The distance of two solids changes at most as fast as their points move. Over an interval with distances d₀, d₁ at its
ends it therefore stays above (d₀ + d₁ - T)/2, if the solids move by at most T relative to each other
(:mod:`trajevo.formulation.constraints.broad_phase.sweeps`). Intervals whose bound is too low are halved until the bound
is high enough or within a tolerance of the distance.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.base.shown.brief import brief
from trajevo.dynamics.rollout import Rollout, rollout_of
from trajevo.errors import InvalidInputError, known_names
from trajevo.formulation.constraints.clearance_gradients import (
    ClearanceTerms,
    Deciding,
    bases_of,
    from_bases,
    missing,
    part_of,
    real_parts,
    stepped_bounds,
    takes_steps,
    wanted_clearances,
)
from trajevo.formulation.constraints.clearance_search import ClearanceSearch
from trajevo.formulation.constraints.collision import CarriedSolid, Collision, Pair
from trajevo.formulation.constraints.constraint import Constraint, LimitKind, LimitParameter
from trajevo.formulation.constraints.scene import Scene
from trajevo.path.loads import Schedule
from trajevo.robot.robot import Robot
from trajevo.robot.shapes.gantry import CARRIAGE, carriage_of, on_gantry
from trajevo.robot.transmission import Direct, Mimicking
from trajevo.trajectory.batch import TrajectoryBatch

#: Names of the columns: for pairs with an obstacle, and for pairs of the robot's own links.
NAMES = ("clearance to obstacles", "clearance to itself")


def clearance_limit(
    robot: Robot, scene: Scene, *, tolerance: float = 1e-3, moved_from: Array | None = None, tilts: bool = False
) -> Constraint:
    """Missing clearance, divided by the clearance (0.01 m at least); at most 0 only if the clearance is proven.

    For a motion that keeps the clearance at all instants checked, the distance is a proven lower bound: the least of
    those of sixteenths of segments, or of parts of these where they leave it open. For any other motion it is the least
    distance found, negative in a collision, so that a search can reduce the violation. Both are those of all pairs,
    whichever distances need not be computed. Loads are left to :func:`load_clearances`.

    Args:
        robot: the robot; its actuators drive its joints directly, of which some may follow others.
        scene: obstacles and clearances.
        tolerance: how far the proven distance may be below the true one where feasibility depends on it [m].
        moved_from: origin of the robot's base at its given place, shape (3,) [m], if every motion has a base of its
            own; the obstacles stay where they are, and what the base stands on there it may touch everywhere.
        tilts: whether these bases are tilted too.

    Returns:
        A constraint with one column for obstacles and one for the robot itself, as far as the scene has them. It can be
        pickled. Its terms are the least distances of every pair at fixed shares of every segment.

    Raises:
        InvalidInputError: a robot without collision geometry or with a transmission, or a tolerance that is not
            positive.
    """
    if not isinstance(robot.transmission, Direct | Mimicking):
        raise InvalidInputError(
            f"robot {robot.name!r}: clearance is proven for actuators that drive joints directly, "
            f"got {type(robot.transmission).__name__}"
        )
    real = isinstance(tolerance, int | float) and not isinstance(tolerance, bool)
    if not (real and 0.0 < tolerance < np.inf):
        raise InvalidInputError(f"tolerance: expected a positive number [m], got {tolerance!r}")
    if moved_from is not None:
        robot = on_gantry(robot, moved_from, tilts=tilts)
        scene = standing_on(robot, scene)
    return _limit(ProvenClearance(Collision(robot, scene), float(tolerance)))


def standing_on(robot: Robot, scene: Scene) -> Scene:
    """A scene that the base of a robot on a gantry may touch where it does so, or comes too close, at its given place.

    Args:
        robot: a robot on a gantry.
        scene: obstacles and clearances.
    """
    collision = Collision(robot, scene)
    given = carriage_of(robot)
    entries = collision.bodies.carriers
    fixed = [k for k, (first, _) in enumerate(collision.ends.tolist()) if given and entries[first] == given.joint]
    fixed = [k for k in fixed if not collision.pairs[k].itself]
    if not fixed:
        return scene
    still = np.zeros((1, robot.dof + collision.timed))
    distances = collision.distances_of(still, np.zeros(len(fixed), dtype=np.intp), np.array(fixed))
    touched: dict[str, list[str]] = {}
    for k, distance in zip(fixed, distances.tolist(), strict=True):
        if distance < scene.clearance:
            touched.setdefault(collision.pairs[k].second, []).append(collision.pairs[k].first.rpartition("_")[0])
    return replace(
        scene,
        obstacles=tuple(
            replace(one, touches=tuple(dict.fromkeys((*one.touches, *touched.get(one.name, ())))))
            for one in scene.obstacles
        ),
    )


def _limit(clearance: ProvenClearance) -> Constraint:
    """The constraint of a clearance."""
    terms = ClearanceTerms(clearance.collision, clearance.tolerance, clearance.part)
    names = tuple(clearance.name(kind) for kind in clearance.kinds)
    columns = tuple(clearance.kinds.index(int(pair.itself)) for pair in clearance.collision.pairs)
    return Constraint(names, "scene", clearance, terms, quantity="clearance", proof="pieces", terms_of=columns)


def load_clearances(constraints: Sequence[Constraint], schedule: Schedule | None) -> tuple[Constraint, ...]:
    """Clearances of loads that have a shape, where they are carried, from obstacles and from the robot's links.

    Args:
        constraints: constraints of a problem; those on clearance say scene and tolerance.
        schedule: the loads, if there are any.

    Raises:
        InvalidInputError: a load that touches an obstacle that does not exist.
    """
    return tuple(_load_clearances(constraints, schedule)) if schedule is not None else ()


def notes_on_shapes(constraints: Sequence[Constraint], schedule: Schedule | None) -> tuple[str, ...]:
    """One sentence where loads have shapes that no constraint uses."""
    shaped = [] if schedule is None else [k for k, load in enumerate(schedule.loads) if load.shape is not None]
    if not shaped or any(isinstance(each.function, ProvenClearance) for each in constraints):
        return ()
    return (f"payload.{shaped[0]}.shape: of no effect, as there is no scene whose clearance it could keep",)


def scene_of(constraints: Sequence[Constraint]) -> Scene | None:
    """The scene whose clearance constraints keep, None for none."""
    kept = [each.function.collision for each in constraints if isinstance(each.function, ProvenClearance)]
    return next((collision.scene for collision in kept if collision.carried is None), None)


def _load_clearances(constraints: Sequence[Constraint], schedule: Schedule) -> Iterator[Constraint]:
    for clearance in [each.function for each in constraints if isinstance(each.function, ProvenClearance)]:
        robot, scene = clearance.collision.robot, clearance.collision.scene
        named = [obstacle.name for obstacle in scene.obstacles]
        for k, load in enumerate(schedule.loads):
            for touched in load.touches:
                if touched not in named:
                    raise InvalidInputError(
                        f"payload.{k}.touches: unknown obstacle {touched!r}; {known_names(touched, named)}"
                    )
            if load.shape is None:
                continue
            on = schedule.segments_of(k)
            solid = Collision(robot, scene, CarriedSolid(load.shape, load.touches))
            if solid.pairs:
                yield _limit(ProvenClearance(solid, clearance.tolerance, on))


@final
@dataclass(frozen=True, eq=False)
class ProvenClearance:
    """The function of :func:`clearance_limit`: rollout of B trajectories -> (B, number of kinds).

    Attributes:
        collision: robot and scene.
        tolerance: as for :func:`clearance_limit` [m].
        part: numbers of the segments on which it is kept, one after another; None for all.
    """

    collision: Collision
    tolerance: float
    part: tuple[int, ...] | None = None

    __repr__ = brief

    def name(self, kind: int) -> str:
        """Name of the column of a kind of pairs."""
        carried = self.collision.carried
        if carried is None:
            return NAMES[kind]
        return f"clearance of {carried.solid.name} to {'the robot' if kind else 'obstacles'}"

    @property
    def kinds(self) -> tuple[int, ...]:
        """Indices into :data:`NAMES` for which there are pairs."""
        return tuple(sorted({int(pair.itself) for pair in self.collision.pairs}))

    def __call__(self, rollout: Rollout) -> Array:
        """Missing clearance divided by the clearance, at most 0 only if the clearance is proven."""
        columns, wanted = list(self.kinds), wanted_clearances(self.collision.scene)
        return missing(wanted[columns], self.least(rollout.trajectory, bases_of(rollout))[:, columns])

    def least(self, trajectory: TrajectoryBatch, bases: Array | None = None) -> Array:
        """Distance to obstacles and to itself, proven if not below the clearance, (B, 2) [m]; inf if not checked.

        For complex steps it is the distance of the real parts, with the derivative of the sample or bound that decides.

        Args:
            trajectory: B motions.
            bases: see :func:`~trajevo.formulation.constraints.clearance_gradients.from_bases`.
        """
        trajectory = self._states(trajectory, bases)
        if not takes_steps(trajectory):
            return self._searched(trajectory)[0]
        first, which = real_parts(trajectory)
        real, columns = trajectory.real_rows(first), list(self.kinds)
        least, pair, t = self._searched(real)
        deciding = Deciding(pair[:, columns], t[:, :, columns])
        stepped = least[which].astype(np.complex128)
        stepped[:, columns] += 1j * stepped_bounds(self.collision, trajectory, real, which, deciding)
        return stepped

    def closest(self, trajectory: TrajectoryBatch, bases: Array | None = None) -> tuple[Closest, ...]:
        """The least distance of every kind of pair, sampled and proven to the tolerance, however much room there is.

        Args:
            trajectory: B motions.
            bases: see :func:`~trajevo.formulation.constraints.clearance_gradients.from_bases`.
        """
        search = self._search(self._states(trajectory, bases), to_the_end=True)
        return tuple(
            Closest(
                name=self.name(kind),
                wanted=float(search.wanted[kind]),
                proven=frozen(np.minimum(search.proven.d[:, kind], search.sampled.d[:, kind])),
                sampled=frozen(search.sampled.d[:, kind]),
                instant=frozen(self._instants(trajectory, search.sampled.t[0, :, kind])),
                pairs=tuple(self.collision.pairs[k] for k in search.sampled.pair[:, kind]),
            )
            for kind in self.kinds
        )

    def _states(self, trajectory: TrajectoryBatch, bases: Array | None) -> TrajectoryBatch:
        """The states that the motions pass on the segments on which the clearance is kept."""
        return part_of(self.collision.with_time(from_bases(trajectory, bases)), self.part)

    def _instants(self, trajectory: TrajectoryBatch, t: Array) -> Array:
        """Instants of the whole motions, from those of the part, (B,) [s]."""
        if self.part is None:
            return t
        breaks = part_of(trajectory, self.part).breaks
        within = (t[:, None] >= breaks[:, 1:-1]).sum(axis=1)
        rows = np.arange(len(t))
        moved: Array = t - breaks[rows, within] + trajectory.breaks[rows, np.array(self.part)[within]]
        return moved

    def _searched(self, trajectory: TrajectoryBatch) -> tuple[Array, Array, Array]:
        """Distances (B, 2) [m], the pairs that decide them (B, 2) and both ends of the interval, (2, B, 2) [s]."""
        search = self._search(trajectory)
        found = np.where(search.sampled.d < search.wanted, 0, 1)
        rows, kinds = np.indices(found.shape)
        both = search.sampled, search.proven
        d, pair = (np.stack([getattr(least, name) for least in both])[found, rows, kinds] for name in ("d", "pair"))
        return d, pair, np.stack([least.t for least in both], axis=1)[:, found, rows, kinds]

    def _search(self, trajectory: TrajectoryBatch, *, to_the_end: bool = False) -> ClearanceSearch:
        """The finished search."""
        wanted = wanted_clearances(self.collision.scene)
        search = ClearanceSearch(self.collision, trajectory, wanted, self.tolerance, to_the_end)
        work = search.start()
        while len(work.row):
            work = search.halve(work)
        return search


@final
@dataclass(frozen=True, eq=False)
class Closest:
    """Where B motions come closest to obstacles, or to the robot itself.

    Attributes:
        name: name of the constraint's column.
        wanted: clearance that is to be kept [m].
        proven: distance that is kept at every instant, shape (B,) [m].
        sampled: least distance found, shape (B,) [m].
        instant: instant of this distance, shape (B,) [s].
        pairs: the two solids of each motion that are so near, B of them.
    """

    name: str
    wanted: float
    proven: Array
    sampled: Array
    instant: Array
    pairs: tuple[Pair, ...]

    __repr__ = brief


@final
@dataclass(frozen=True, eq=False)
class ClearanceProfile:
    """Distances along motions at samples, for pictures and checks.

    Attributes:
        t: instants, shape (B, T) [s].
        distances: distance of every pair, shape (B, T, n_pairs) [m].
        pairs: the pairs, in the order of the columns.
    """

    t: Array
    distances: Array
    pairs: tuple[Pair, ...]

    __repr__ = brief

    def least(self, *, itself: bool) -> Array:
        """Least distance between links of the robot, or to obstacles, shape (B, T) [m]; inf if not checked."""
        columns = [k for k, pair in enumerate(self.pairs) if pair.itself == itself]
        return frozen(self.distances[:, :, columns].min(axis=2, initial=np.inf))


def clearance_along(motion: Any, scene: Scene, *, density: int = 50) -> ClearanceProfile:
    """Distances along a motion.

    Args:
        motion: a solution, an optimum or a rollout.
        scene: obstacles and clearances.
        density: instants per segment.

    Raises:
        InvalidInputError: another kind of motion, a density that is no whole number from 1 on, or a robot without
            collision geometry.
    """
    if not isinstance(density, int) or isinstance(density, bool) or density < 1:
        raise InvalidInputError(f"density: expected a whole number from 1 on, got {density!r}")
    rollout = rollout_of(motion)
    bases, origin = bases_of(rollout), None if rollout.arranged is None else rollout.arranged.origin
    robot = rollout.robot
    if bases is not None and origin is not None:
        robot = on_gantry(robot, origin, tilts=bases.shape[1] > len(CARRIAGE))
    collision = Collision(robot, scene)
    states = collision.with_time(from_bases(rollout.trajectory, bases))
    samples = states.sample(density * (states.breaks.shape[1] - 1) + 1)
    distances = collision.distances(samples.q.reshape(-1, states.n_joints))
    return ClearanceProfile(samples.t, frozen(distances.reshape(*samples.t.shape, -1)), collision.pairs)


CLEARANCE = LimitKind(
    "clearance",
    "distances from the robot's links to obstacles and to each other, at every instant",
    lambda limited, scene: clearance_limit(limited.robot, scene, moved_from=limited.moved_from, tilts=limited.tilts),
    (
        LimitParameter(
            "scene",
            "",
            "obstacles and clearances, a trajevo.Scene or its settings",
            lambda name, given, unit: Scene.of(given),
            type=dict[str, Any],
            table=True,
            plain=lambda scene: scene.settings,
        ),
    ),
)
