"""How an obstacle moves: its pose over time."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, final

import numpy as np

from trajevo.base.arrays import Array, frozen, numbers
from trajevo.base.shown.brief import brief
from trajevo.base.units import if_degrees
from trajevo.errors import InvalidInputError, known_names
from trajevo.formulation.constraints.scenes.rotations import Triple, matrix_of, rpy_of
from trajevo.path.inverse_kinematics import Pose
from trajevo.path.point_files import read_timed_poses

#: Distance of a turn from half a turn at which it has no shorter way, and rounding of an angle [rad].
_UNDECIDED, _ROUNDED = 1e-6, 1e-6

#: Keys of a pose.
_KEYS = ("t", "position", "rpy", "quaternion", "rotation_vector")

#: Greatest number of poses.
_MOST_POSES = 10_000


class _Timed(NamedTuple):
    """A pose at an instant [s]; the orientation is None if none is given."""

    t: float
    position: Triple
    rpy: Triple | None


class _Pieces(NamedTuple):
    """The P + 1 pieces of a motion: before the first of P poses, between them, and after the last.

    Attributes:
        t: when each begins, shape (P + 1,) [s]; that of the first piece is when it ends.
        position: where the frame is then, shape (P + 1, 3) [m].
        velocity: shape (P + 1, 3) [m/s].
        turning: angular velocity in the base frame, shape (P + 1, 3) [rad/s].
        rotation: the rotation then, that times the axis's cross product, and that times its square, (P + 1, 3, 3, 3).
        rate: size of the angular velocity, shape (P + 1,) [rad/s].
        way: how far the frame's origin has come then, shape (P + 1,) [m].
        turned: how far it has turned, shape (P + 1,) [rad].
    """

    t: Array
    position: Array
    velocity: Array
    turning: Array
    rotation: Array
    rate: Array
    way: Array
    turned: Array


@final
@dataclass(frozen=True)
class ObstacleMotion:
    """Poses of a frame over time.

    From pose to pose its origin moves in a line at constant speed, and it turns about one axis at a constant rate, the
    shorter way. Before the first pose and after the last it stands still there.

    Attributes:
        t: instants of P poses, rising; the robot's motion begins at 0 [s].
        positions: P positions in the base frame [m].
        rpys: P times roll, pitch and yaw about fixed axes, each within ±π [rad].

    Raises:
        InvalidInputError: fewer than two poses, instants that do not rise, numbers that are not finite, angles beyond
            ±π, or half a turn from one pose to the next, which has no shorter way.
    """

    t: tuple[float, ...]
    positions: tuple[Triple, ...]
    rpys: tuple[Triple, ...]

    __repr__ = brief

    def __post_init__(self) -> None:
        t = numbers(self.t, name="motion: t", shape=("poses",))
        if not 2 <= len(t) <= _MOST_POSES:
            raise InvalidInputError(f"motion: expected 2 to {_MOST_POSES} poses, got {len(t)}")
        positions = numbers(self.positions, name="motion: position", shape=(len(t), 3))
        rpys = numbers(self.rpys, name="motion: rpy", shape=(len(t), 3))
        falls = np.flatnonzero(np.diff(t) <= 0.0)
        if len(falls):
            k = int(falls[0])
            raise InvalidInputError(f"motion: t: expected rising instants [s], got {t[k + 1]:g} after {t[k]:g}")
        most = float(np.abs(rpys).max())
        if most > math.pi + _ROUNDED:
            raise InvalidInputError(
                f"motion: rpy: expected angles within ±π rad, got {most:.4g}{if_degrees(most)}; it turns the shorter "
                "way from pose to pose, so that a longer turn needs poses between"
            )
        object.__setattr__(self, "t", tuple(t.tolist()))
        object.__setattr__(self, "positions", tuple(map(tuple, positions.tolist())))
        object.__setattr__(self, "rpys", tuple(map(tuple, rpys.tolist())))
        wide = np.flatnonzero(self._turns[1] > math.pi - _UNDECIDED)
        if len(wide):
            k = int(wide[0])
            raise InvalidInputError(
                "motion: expected less than half a turn from one pose to the next, which has a shorter way, got half a "
                f"turn between t = {t[k]:g} and {t[k + 1]:g} s: give a pose between"
            )

    @classmethod
    def of(cls, given: ObstacleMotion | Mapping[str, Any] | Any) -> ObstacleMotion:
        """A motion from plain data.

        Args:
            given: a list of mappings with ``t`` [s], ``position`` and, for all or none of them, an orientation as
                :class:`trajevo.path.inverse_kinematics.Pose` takes it; or a mapping with ``file``, a table with the
                columns ``t``, ``x``, ``y``, ``z`` and those of an orientation, each with its unit.

        Raises:
            InvalidInputError: another key, a value that cannot be used, or a file that cannot be read; the message
                names the pose or the file.
        """
        if isinstance(given, ObstacleMotion):
            return given
        if isinstance(given, Mapping):
            if set(given) != {"file"}:
                raise InvalidInputError(f"motion: expected a list of poses, or only a file, got keys {sorted(given)}")
            given = read_timed_poses(Path(given["file"]))
        if not isinstance(given, list | tuple):
            raise InvalidInputError(f"motion: expected a list of poses with t and position, got {given!r}")
        found = [_pose(k, entry) for k, entry in enumerate(given, 1)]
        turned = [one.rpy is not None for one in found]
        if any(turned) and not all(turned):
            k = turned.index(not turned[0]) + 1
            raise InvalidInputError(
                f"motion: pose {k}: expected orientations of all poses or of none, got "
                f"{'one' if turned[k - 1] else 'none'} here and {'one' if turned[0] else 'none'} before"
            )
        rpys = tuple(one.rpy or (0.0, 0.0, 0.0) for one in found)
        return cls(tuple(one.t for one in found), tuple(one.position for one in found), rpys)

    @property
    def settings(self) -> list[dict[str, Any]]:
        """Plain data that makes an equal one."""
        poses = zip(self.t, self.positions, self.rpys, strict=True)
        return [{"t": t, "position": list(position), "rpy": list(rpy)} for t, position, rpy in poses]

    def poses(self, t: Array) -> tuple[Array, Array]:
        """Where the frame is at instants.

        Args:
            t: instants, shape (N,) [s]; complex steps are kept.

        Returns:
            Rotation matrices to the base frame, shape (N, 3, 3), and positions, shape (N, 3) [m].
        """
        pieces, piece, since = self._at(t)
        angle = (pieces.rate[piece] * since)[:, None, None]
        start, sine, rest = np.moveaxis(pieces.rotation, 1, 0)[:, piece]
        rotation = start + np.sin(angle) * sine + (1.0 - np.cos(angle)) * rest
        return rotation, pieces.position[piece] + pieces.velocity[piece] * since[:, None]

    def rates(self, t: Array) -> tuple[Array, Array]:
        """Velocity of the frame's origin [m/s] and its angular velocity in the base frame [rad/s], shapes (N, 3)."""
        pieces, piece, _ = self._at(t)
        return pieces.velocity[piece], pieces.turning[piece]

    def travelled(self, t: Array) -> tuple[Array, Array]:
        """How far the frame's origin has come at instants [m], and how far it has turned [rad], shapes (N,)."""
        pieces, piece, since = self._at(t)
        speed = np.linalg.norm(pieces.velocity, axis=1)[piece]
        return pieces.way[piece] + speed * since, pieces.turned[piece] + pieces.rate[piece] * since

    def _at(self, t: Array) -> tuple[_Pieces, Array, Array]:
        """The pieces, the one at each instant and the time since it began."""
        pieces = self._pieces
        piece = np.searchsorted(np.array(self.t), t.real, side="right")
        return pieces, piece, t - pieces.t[piece]

    @cached_property
    def _turns(self) -> tuple[Array, Array]:
        """Axis in the base frame and angle [rad] of the turn from each pose to the next, (P - 1, 3) and (P - 1,)."""
        from scipy.spatial.transform import Rotation  # imported where it computes, since that takes long

        rotations = np.stack([matrix_of(rpy) for rpy in self.rpys])
        vectors = Rotation.from_matrix(rotations[1:] @ np.swapaxes(rotations[:-1], 1, 2)).as_rotvec()
        angles = np.linalg.norm(vectors, axis=1)
        return vectors / np.where(angles > 0.0, angles, 1.0)[:, None], angles

    @cached_property
    def _pieces(self) -> _Pieces:
        t, positions = np.array(self.t), np.array(self.positions)
        span, (axes, angles) = np.diff(t), self._turns
        velocity = np.diff(positions, axis=0) / span[:, None]
        still = np.zeros((1, 3))
        around = np.concatenate([still, axes, still])
        x, y, z = around.T
        none = np.zeros(len(around))
        cross = np.moveaxis(np.array([[none, -z, y], [z, none, -x], [-y, x, none]]), 2, 0)
        start = np.stack([matrix_of(rpy) for rpy in (self.rpys[0], *self.rpys)])
        way, turned = (np.cumsum(each) for each in (np.linalg.norm(np.diff(positions, axis=0), axis=1), angles))
        return _Pieces(
            t=frozen(np.append(t[0], t)),
            position=frozen(np.concatenate([positions[:1], positions])),
            velocity=frozen(np.concatenate([still, velocity, still])),
            turning=frozen(np.concatenate([still, axes * (angles / span)[:, None], still])),
            rotation=frozen(np.stack([start, cross @ start, cross @ cross @ start], axis=1)),
            rate=frozen(np.concatenate([[0.0], angles / span, [0.0]])),
            way=frozen(np.concatenate([[0.0, 0.0], way])),
            turned=frozen(np.concatenate([[0.0, 0.0], turned])),
        )


def _pose(place: int, given: Any) -> _Timed:
    where = f"motion: pose {place}"
    if not isinstance(given, Mapping):
        raise InvalidInputError(f"{where}: expected a mapping with t and position, got {given!r}")
    if "t" not in given:
        raise InvalidInputError(f"{where}: t: expected an instant [s], got none")
    for key in given:
        if key not in _KEYS:
            raise InvalidInputError(f"{where}: {key}: unknown key; {known_names(str(key), _KEYS)}")
    try:
        t = float(numbers(given["t"], name="t", shape=()))
        pose = Pose.of({key: value for key, value in given.items() if key != "t"})
        x, y, z = pose.position.tolist()
        if "rpy" in given:
            roll, pitch, yaw = numbers(given["rpy"], name="rpy", shape=(3,)).tolist()
            return _Timed(t, (x, y, z), (roll, pitch, yaw))
        return _Timed(t, (x, y, z), None if pose.rotation is None else rpy_of(pose.rotation, "orientation"))
    except InvalidInputError as error:
        raise InvalidInputError(f"{where}: {str(error).removeprefix('pose: ')}") from error
