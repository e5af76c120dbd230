"""Payload over the workspace: the largest payload held at rest, or accelerated, on a plane of tool positions.

For each tool position, the posture that carries most is chosen from all that :mod:`trajevo.path.postures` finds. The
effort of all postures is computed in one batched call and is affine in the mass, as along a motion.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, frozen, numbers, read_only
from trajevo.base.shown.brief import brief
from trajevo.capacity.capacity import told_both
from trajevo.capacity.notebook import workspace_html
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.payload_masses import mass_bounds
from trajevo.errors import InvalidInputError, checked_name
from trajevo.formulation.constraints.constraint import share_kept_free
from trajevo.path.inverse_kinematics import Pose
from trajevo.path.levenberg_marquardt import JointRanges
from trajevo.path.postures import Postures, find_postures
from trajevo.robot.joints import Sides
from trajevo.robot.kinematics import ToolKinematics
from trajevo.robot.payload import Payload
from trajevo.robot.robot import Robot

#: Planes by the base frame's axes along their columns and rows.
PLANES = ("xy", "xz", "yx", "yz", "zx", "zy")

#: Share of the tool acceleration by which joint accelerations may miss it.
_MISSED = 1e-6

#: Share of the greatest payload within which postures count as equal; the one nearest to the start is taken.
_EQUAL = 1e-9

#: Digits of joint positions that count when postures are sorted.
_DIGITS = 6


@final
@dataclass(frozen=True, eq=False)
class ToolPlane:
    """Tool positions on a plane through a pose, parallel to two axes of the base frame.

    Attributes:
        pose: the pose; all cells have its rotation, if it has one, and its position along the third axis.
        axes: a name in :data:`PLANES`: the base frame's axes along which ``columns`` and ``rows`` run.
        columns: base coordinates along the first axis, shape (N,) [m].
        rows: base coordinates along the second axis, shape (M,) [m].

    Raises:
        UnknownNameError: another plane.
        InvalidInputError: coordinates that do not increase, or an invalid pose.
    """

    pose: Pose
    axes: str
    columns: Array
    rows: Array

    __repr__ = brief

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
            pose: middle of the square.
            axes: a name in :data:`PLANES`.
            reach: distance from the middle to the sides [m].
            cells: number of cells along each side.

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
        joint_names: names of the robot's joints.
        q: joint positions that carry most, shape (M, N, n_joints) [rad or m]; NaN where the tool does not reach.
        mass: largest payload, shape (M, N) [kg]; NaN where the tool cannot reach or cannot have this acceleration, inf
            where no limit is ever reached, 0 where a limit is broken without payload.
        joint: index of the binding joint in ``joint_names``, shape (M, N); -1 where there is none.
        per_joint: largest payload that each joint alone allows, shape (M, N, n_joints) [kg].
        postures: number of distinct postures found, of which the best was taken, shape (M, N); 0 where the tool does
            not reach. For an arm with as many joints as the tool has coordinates, these are the branches of its inverse
            kinematics within the limits; for a redundant arm, a sample of its infinitely many postures.
        acceleration: acceleration of the tool, from rest, in the base frame, shape (3,) [m/s²].
        payload_model: how the payload acts.
        effort_margin: share of the effort limits that is kept free.
        at_full_limits: the same without this margin; None if there is none.
    """

    plane: ToolPlane
    joint_names: tuple[str, ...]
    q: Array
    mass: Array
    joint: Array
    per_joint: Array
    postures: Array
    acceleration: Array
    payload_model: str
    effort_margin: float = 0.0
    at_full_limits: WorkspaceCapacity | None = None

    __repr__ = brief

    def _repr_html_(self) -> str:
        return workspace_html(self)

    @property
    def reached(self) -> Array:
        """Mask of the cells that the tool reaches, shape (M, N)."""
        return np.asarray(np.isfinite(self.q).all(axis=-1))

    def __str__(self) -> str:
        if self.at_full_limits is None:
            return self._told
        return told_both(self._told, str(self.at_full_limits), self.effort_margin)

    @property
    def _told(self) -> str:
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
    effort_margin: float = 0.0,
    start: Sequence[float] | None = None,
    seed: int = 0,
    starts: int | None = None,
) -> WorkspaceCapacity:
    """The largest payload that the effort limits allow at every tool position of a plane, in the best posture.

    For each cell, the posture that carries most is taken from all that are found. For a redundant arm, and for a plane
    without orientation, there are infinitely many postures, so that more than the best one found may be possible. It
    may be much more where links can stand or hang straight in line with the load, since the payload that they can hold
    then grows without bound.

    Args:
        robot: the robot.
        plane: the tool positions.
        payload: payload that gives shape and model; a point mass at the tool if None.
        acceleration: acceleration of the tool, from rest and without rotation, in the base frame, shape (3,) [m/s²];
            the joint accelerations are the least ones that yield it.
        effort_margin: share of the effort limits that is kept free, from 0 to below 1, such as that of a problem,
            :attr:`~trajevo.dynamics.rollout.Rollout.effort_margin`; with one, the map at the full limits is added.
        start: joint positions to begin with, shape (n_joints,) [rad or m]; among postures that carry the same, the one
            nearest to them is taken. The middle of the joint ranges if None.
        seed: seed of the random starts.
        starts: random starts per cell and round; chosen by :func:`~trajevo.path.postures.find_postures` if None. A cell
            that is reached neither from them nor from the postures of its neighbours counts as not reached.

    Raises:
        InvalidInputError: an argument of another type or shape, or numbers that are not finite.
    """
    if not isinstance(plane, ToolPlane):
        raise InvalidInputError(f"plane: expected a ToolPlane, got {type(plane).__name__}")
    wanted = read_only(numbers(acceleration, name="acceleration", shape=(3,)))
    margin = share_kept_free("effort_margin", effort_margin, "1")
    search: dict[str, Any] = {"start": start, "seed": seed, "starts": starts}
    found = _capacity(robot, plane, payload, wanted, margin, search)
    if not margin:
        return found
    return replace(found, at_full_limits=_capacity(robot, plane, payload, wanted, 0.0, search))


def _capacity(
    robot: Robot,
    plane: ToolPlane,
    payload: Payload | None,
    acceleration: Array,
    margin: float,
    search: Mapping[str, Any],
) -> WorkspaceCapacity:
    """As :func:`workspace_capacity`, with one margin."""
    limit = robot.limits.sides("effort").times(1.0 - margin)
    dynamics, turning = Dynamics(robot, payload or Payload(1.0)), plane.pose.rotation is None
    carried, start = _Carried(robot, dynamics, acceleration, turning, limit), search["start"]
    positions = plane.positions
    found = find_postures(
        robot,
        positions.reshape(-1, 3),
        plane.pose.rotation,
        neighbours=_neighbours(positions.shape[:2]),
        worth=carried.most,
        **search,
    )
    q = np.full((*positions.shape[:2], robot.dof), np.nan)
    per_joint = q.copy()
    best = _best(found, JointRanges.of(robot, ToolKinematics.of(robot)).middle if start is None else start)
    at = np.unravel_index(found.pose[best], positions.shape[:2])
    q[at], per_joint[at] = found.q[best], carried(found.q[best])
    mass = per_joint.min(axis=-1)
    joint = np.where(np.isfinite(mass), np.argmin(per_joint, axis=-1), -1)
    postures = np.bincount(found.pose, minlength=mass.size).reshape(mass.shape)
    for array in (joint, postures):
        array.setflags(write=False)
    return WorkspaceCapacity(
        plane=plane,
        joint_names=robot.joint_names,
        q=frozen(q),
        mass=frozen(mass),
        joint=joint,
        per_joint=frozen(per_joint),
        postures=postures,
        acceleration=acceleration,
        payload_model="rigid" if payload is None else payload.model,
        effort_margin=margin,
    )


def _places(axes: str) -> tuple[int, int]:
    return "xyz".index(axes[0]), "xyz".index(axes[1])


def _neighbours(shape: tuple[int, ...]) -> Array:
    """Indices of the cells around each cell, shape (M N, 8), -1 beyond the edges."""
    framed = np.full((shape[0] + 2, shape[1] + 2), -1)
    framed[1:-1, 1:-1] = np.arange(shape[0] * shape[1]).reshape(shape)
    around = np.lib.stride_tricks.sliding_window_view(framed, (3, 3)).reshape(-1, 9)
    return np.delete(around, 4, axis=1)


def _best(found: Postures, near: Any) -> Array:
    """Index, for every pose, of the posture that carries most; among equal ones, of the nearest to joint positions."""
    poses, begins = np.unique(found.pose, return_index=True)
    if not len(poses):
        return begins
    most = np.maximum.reduceat(found.worth, begins)[np.searchsorted(poses, found.pose)]
    equal = found.worth >= most - _EQUAL * np.abs(np.where(np.isfinite(most), most, 0.0))
    # Rounded, with ties broken by the joints themselves, so that rounding errors do not choose among mirrored postures.
    distance = np.round(np.abs(found.q - near).max(axis=1), _DIGITS)
    order = np.lexsort((*np.round(found.q, _DIGITS).T, distance, ~equal, found.pose))
    return np.asarray(order[begins])


@final
@dataclass(frozen=True, eq=False)
class _Carried:
    """The payload that postures carry with the tool at rest or accelerated."""

    robot: Robot
    dynamics: Dynamics
    acceleration: Array
    turning: bool
    limit: Sides

    def __call__(self, q: Array) -> Array:
        """Largest payload by each joint alone, (P, n_joints) [kg]; NaN if the tool cannot have the acceleration."""
        if not len(q):
            return np.empty_like(q)  # Pinocchio takes no empty batch
        a, possible = _joint_accelerations(self.robot, q, self.acceleration, turning=self.turning)
        still = np.zeros_like(q)
        unloaded = self.dynamics.unloaded_effort(q, still, a)
        per_kilogram = self.dynamics.effort_per_kilogram(q, still, a)
        least, greatest = mass_bounds(unloaded, per_kilogram, self.limit)
        # A joint that is over its limit without payload allows none, unless a counterweight satisfies all joints.
        held = least.max(axis=1) <= greatest.min(axis=1)
        each = np.where(held[:, None] | (least == 0.0), greatest, 0.0)
        return np.where(possible[:, None], each, np.nan)

    def most(self, q: Array) -> Array:
        """Largest payload, shape (P,) [kg]; -1 if the tool cannot have the acceleration."""
        mass = self(q).min(axis=1)
        return np.where(np.isnan(mass), -1.0, mass)


def _joint_accelerations(robot: Robot, q: Array, wanted: Array, *, turning: bool) -> tuple[Array, Array]:
    """Least joint accelerations of a resting tool's acceleration, (C, n_joints), and whether they yield it, (C,).

    Args:
        robot: the robot.
        q: joint positions, shape (C, n_joints) [rad or m].
        wanted: acceleration of the tool, shape (3,) [m/s²].
        turning: whether the tool may turn.
    """
    jacobian = ToolKinematics.of(robot).jacobian(q)[:, : 3 if turning else 6]
    target = np.concatenate([wanted, np.zeros(jacobian.shape[1] - 3)])
    a: Array = np.linalg.pinv(jacobian, rcond=1e-9) @ target
    missed = np.linalg.norm((jacobian @ a[..., None])[..., 0] - target, axis=-1)
    return a, missed <= _MISSED * max(float(np.linalg.norm(wanted)), np.finfo(np.float64).tiny)
