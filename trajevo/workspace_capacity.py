"""What a robot can carry where: the largest payload held at rest, or accelerated, over a plane of tool positions.

Joint positions come from :mod:`trajevo.inverse_kinematics`, cell by cell from a neighbour; the effort of all cells is
one batched call, and affine in the mass as along a motion.
"""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from trajevo.arrays import Array, frozen, numbers, read_only
from trajevo.dynamics import Dynamics
from trajevo.errors import InvalidInputError, UnreachableError, checked_name
from trajevo.inverse_kinematics import Pose, inverse_kinematics
from trajevo.kinematics import ToolKinematics
from trajevo.mass_bounds import mass_bounds
from trajevo.payload import Payload
from trajevo.robot import Robot

#: Planes by the base frame's axes along their columns and rows.
PLANES = ("xy", "xz", "yx", "yz", "zx", "zy")

#: Share of a tool acceleration that joint accelerations may miss at a reachable cell.
_MISSED = 1e-6

#: Neighbours from which a cell is tried at first.
_NEIGHBOURS = 2


@final
@dataclass(frozen=True, eq=False)
class ToolPlane:
    """Tool positions on a plane through a pose, parallel to two axes of the base frame.

    Attributes:
        pose: its rotation, if any, is kept in all cells, and its position along the third axis.
        axes: a name of :data:`PLANES`: the base frame's axes along which ``columns`` and ``rows`` run.
        columns: base coordinates along the first axis, shape (N,) [m].
        rows: base coordinates along the second axis, shape (M,) [m].

    Raises:
        UnknownNameError: another plane.
        InvalidInputError: coordinates that do not increase, or a pose that is none.
    """

    pose: Pose
    axes: str
    columns: Array
    rows: Array

    def __post_init__(self) -> None:
        checked_name("plane", self.axes, PLANES)
        object.__setattr__(self, "pose", Pose.of(self.pose))
        for name in ("columns", "rows"):
            values = numbers(getattr(self, name), name=name, shape=("N",))
            if not len(values) or not (np.diff(values) > 0.0).all():
                raise InvalidInputError(f"{name}: expected increasing coordinates [m], got {values.tolist()}")
            object.__setattr__(self, name, read_only(values))

    @classmethod
    def around(cls, pose: Pose | Mapping[str, Any], axes: str, *, reach: float = 0.5, cells: int = 21) -> ToolPlane:
        """A square around a pose.

        Args:
            pose: its middle.
            axes: a name of :data:`PLANES`.
            reach: from the middle to the sides [m].
            cells: along each side.

        Raises:
            UnknownNameError: another plane.
            InvalidInputError: a reach that is not positive, or fewer than 2 cells.
        """
        middle = Pose.of(pose)
        first, second = _places(checked_name("plane", axes, PLANES))
        if not float(numbers(reach, name="reach", shape=())) > 0.0:
            raise InvalidInputError(f"reach: expected a positive length [m], got {reach!r}")
        if not isinstance(cells, int | np.integer) or isinstance(cells, bool) or cells < 2:
            raise InvalidInputError(f"cells: expected a whole number of at least 2, got {cells!r}")
        offsets = np.linspace(-float(reach), float(reach), cells)
        return cls(middle, axes, middle.position[first] + offsets, middle.position[second] + offsets)

    @property
    def positions(self) -> Array:
        """Tool positions of all cells in the base frame, shape (M, N, 3) [m]."""
        first, second = _places(self.axes)
        positions = np.broadcast_to(self.pose.position, (len(self.rows), len(self.columns), 3)).copy()
        positions[..., first] = self.columns
        positions[..., second] = self.rows[:, None]
        return positions


@final
@dataclass(frozen=True, eq=False)
class WorkspaceCapacity:
    """The largest payload at every cell of a plane.

    Attributes:
        plane: the cells.
        joint_names: of the robot.
        q: joint positions of the cells, shape (M, N, n_joints) [rad or m]; NaN where the tool does not reach.
        mass: largest payload, shape (M, N) [kg]; NaN where the tool does not reach or cannot be accelerated so, inf
            where no limit is ever reached, 0 where one is broken without payload.
        joint: binding joint as a place in ``joint_names``, shape (M, N); -1 where there is none.
        per_joint: largest payload by each joint alone, shape (M, N, n_joints) [kg].
        acceleration: of the tool, from rest, in the base frame, shape (3,) [m/s²].
        payload_model: how the payload acts.
    """

    plane: ToolPlane
    joint_names: tuple[str, ...]
    q: Array
    mass: Array
    joint: Array
    per_joint: Array
    acceleration: Array
    payload_model: str

    @property
    def reached(self) -> Array:
        """Cells that the tool reaches, shape (M, N)."""
        return np.asarray(np.isfinite(self.q).all(axis=-1))

    def __str__(self) -> str:
        known = self.mass[~np.isnan(self.mass)]
        if not len(known):
            return f"none of {self.mass.size} cells is reached"
        spread = f"{known.min():.4g} to {known.max():.4g} kg ({self.payload_model} payload)"
        held = "held at rest" if not self.acceleration.any() else f"accelerated at {self.acceleration.tolist()} m/s²"
        return f"{spread} {held} in {len(known)} of {self.mass.size} cells"


def workspace_capacity(
    robot: Robot,
    plane: ToolPlane,
    *,
    payload: Payload | None = None,
    acceleration: Sequence[float] = (0.0, 0.0, 0.0),
    start: Sequence[float] | None = None,
    seed: int = 0,
    starts: int = 4,
) -> WorkspaceCapacity:
    """The largest payload that the effort limits allow at every tool position of a plane.

    Every cell takes the joint positions nearest to a neighbour's, so one branch of the inverse kinematics is followed
    as far as it goes. Where other joint positions put the tool into the same pose (another branch, a redundant arm, or
    a plane without orientation), what they could carry is not looked at.

    Args:
        robot: the robot.
        plane: where.
        payload: its shape and model count; a point mass at the tool if None.
        acceleration: of the tool, from rest and without turning, in the base frame, shape (3,) [m/s²]; joint
            accelerations are the least that give it.
        start: joint positions that the first cell, the one nearest to the plane's pose, shall be near, shape
            (n_joints,); the middle of the joint ranges if None.
        seed: of the random starts of the inverse kinematics.
        starts: random starts per cell that is not reached from its neighbours; what none of them meets counts as not
            reached.

    Raises:
        InvalidInputError: another type, a shape, or numbers that are none.
    """
    if not isinstance(plane, ToolPlane):
        raise InvalidInputError(f"plane: expected a ToolPlane, got {type(plane).__name__}")
    wanted = read_only(numbers(acceleration, name="acceleration", shape=(3,)))
    q = _joint_positions(robot, plane, start, seed, starts)
    reached = np.isfinite(q).all(axis=-1)
    per_joint = np.full_like(q, np.nan)
    at = q[reached]
    if len(at):
        a, possible = _joint_accelerations(robot, at, wanted, turning=plane.pose.rotation is None)
        dynamics, still = Dynamics(robot, payload or Payload(1.0)), np.zeros_like(at)
        unloaded, per_kilogram = dynamics.unloaded_effort(at, still, a), dynamics.effort_per_kilogram(at, still, a)
        least, greatest = mass_bounds(unloaded, per_kilogram, robot.limits.effort)
        per_joint[reached] = np.where(possible[:, None], np.where(least > 0.0, 0.0, greatest), np.nan)
    mass = per_joint.min(axis=-1)
    joint = np.where(np.isfinite(mass), np.argmin(per_joint, axis=-1), -1)
    joint.setflags(write=False)
    return WorkspaceCapacity(
        plane=plane,
        joint_names=robot.joint_names,
        q=frozen(q),
        mass=frozen(mass),
        joint=joint,
        per_joint=frozen(per_joint),
        acceleration=wanted,
        payload_model="rigid" if payload is None else payload.model,
    )


def _places(axes: str) -> tuple[int, int]:
    return "xyz".index(axes[0]), "xyz".index(axes[1])


def _joint_positions(robot: Robot, plane: ToolPlane, start: Any, seed: int, starts: int) -> Array:
    """Joint positions of every cell, shape (M, N, n_joints), NaN where the tool does not reach.

    Cells are taken from the pose outwards, each from neighbours that were met before; a second time, also from those
    further out.
    """
    positions = plane.positions
    first = None if start is None else numbers(start, name="start", shape=(robot.dof,))
    distance = np.linalg.norm(positions - plane.pose.position, axis=-1)
    order = [divmod(flat, distance.shape[1]) for flat in np.argsort(distance, axis=None, kind="stable").tolist()]
    q = np.full((*distance.shape, robot.dof), np.nan)
    for again in (False, True):
        for cell in (place for place in order if not np.isfinite(q[place]).all()):
            near = _nearest_found(q, cell, distance)
            # Random starts cost most of the time, so neighbours come first and alone.
            chosen = near[_NEIGHBOURS:] if again else near[:_NEIGHBOURS]
            tries: list[tuple[Array | None, int]] = [(before, 0) for before in chosen]
            for before, count in tries if again else (*tries, (near[0] if near else first, starts)):
                with contextlib.suppress(UnreachableError):
                    pose = Pose(positions[cell], plane.pose.rotation)
                    q[cell] = inverse_kinematics(robot, [pose], start=before, seed=seed, starts=count)[0]
                    break
    return q


def _nearest_found(q: Array, cell: tuple[int, int], distance: Array) -> list[Array]:
    """Joint positions of a cell's neighbours that have any, those nearest to the pose first."""
    rows, columns = (slice(max(k - 1, 0), k + 2) for k in cell)
    around = q[rows, columns].reshape(-1, q.shape[-1])
    order = np.argsort(distance[rows, columns], axis=None, kind="stable")
    return [around[k] for k in order if np.isfinite(around[k]).all()]


def _joint_accelerations(robot: Robot, q: Array, wanted: Array, *, turning: bool) -> tuple[Array, Array]:
    """Least joint accelerations, shape (C, n_joints), that accelerate a resting tool, and whether they do, (C,).

    Args:
        robot: the robot.
        q: joint positions, shape (C, n_joints).
        wanted: acceleration of the tool, shape (3,) [m/s²].
        turning: whether the tool may turn.
    """
    jacobian = ToolKinematics.of(robot).jacobian(q)[:, : 3 if turning else 6]
    target = np.concatenate([wanted, np.zeros(jacobian.shape[1] - 3)])
    a: Array = np.linalg.pinv(jacobian, rcond=1e-9) @ target
    missed = np.linalg.norm((jacobian @ a[..., None])[..., 0] - target, axis=-1)
    return a, missed <= _MISSED * max(float(np.linalg.norm(wanted)), np.finfo(np.float64).tiny)
