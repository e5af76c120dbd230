"""Lines and arcs of the tool from one pose to another, and the postures along them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from trajevo.base.arrays import Array, read_only
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError, UnreachableError
from trajevo.path.boxes import followed
from trajevo.path.segments import ToolSegment
from trajevo.robot.kinematics import ToolKinematics
from trajevo.robot.robot import Robot

#: Joints from which on a robot can keep the orientation of its tool along a way.
WHOLE_POSE = 6
#: Length of the shortest way [m], and angle of the greatest turn of the tool, beyond which there is no shortest one.
_SHORTEST, _GREATEST_TURN = 1e-6, np.pi - 1e-3
#: Steps in which postures are followed, and share of the tolerances with which a pose on the way is reached.
_STEPS, _REACHED = 96, 0.1
#: Share by which joints may move more in a step than on average over the way and twice as fast, before it is a jump.
_JUMP, _LEAST_JUMP = 12.0, 0.05
#: Greatest step of a joint to the next posture that is no jump to another branch [rad or m].
_LONGEST_STEP = 0.3
#: How far a joint may be beyond a limit by rounding [rad or m].
_ROUNDING = 1e-9
#: Height of the point through which an arc goes over the line of its ends, as a share of their distance, that is none.
_FLAT = 1e-6


@final
@dataclass(frozen=True, eq=False)
class ToolWay:
    """A way of the tool by the share of it, 0 to 1: evenly along a line or an arc, evenly turned.

    A line is ``start + s chord``; an arc is ``centre + cos(s angle) across + sin(s angle) along``. The orientation is
    that of the start turned by ``s turn`` about ``about``.

    Attributes:
        start: position of the tool at the start, shape (3,) [m].
        chord: from the start to the end, for a line, shape (3,) [m]; 0 for an arc.
        centre: centre of the arc, shape (3,) [m].
        across: from the centre to the start, shape (3,) [m]; 0 for a line.
        along: at right angles to it in the direction of motion, of the same length [m].
        angle: of the arc [rad].
        rotation: orientation of the tool at the start, shape (3, 3).
        about: unit axis of its turn in the base frame, shape (3,).
        turn: angle of its turn [rad].
        oriented: whether the orientation is followed too.
    """

    start: Array
    chord: Array
    centre: Array
    across: Array
    along: Array
    angle: float
    rotation: Array
    about: Array
    turn: float
    oriented: bool

    __repr__ = brief

    @classmethod
    def of(cls, segment: ToolSegment, robot: Robot, first: Array, last: Array) -> ToolWay:
        """The way of a segment between two points.

        Args:
            segment: the segment.
            robot: the robot.
            first: joint positions at its start, shape (n_joints,) [rad or m].
            last: joint positions at its end.

        Raises:
            InvalidInputError: the points are one, an arc goes through a point in line with its ends, or the tool would
                turn by half a turn, which has no shortest way.
        """
        robot.check_body(f"a {segment.tool} of the tool")
        positions, rotations = ToolKinematics.of(robot).pose(np.stack([first, last]))
        oriented = robot.dof >= WHOLE_POSE
        about, turn = _turn(rotations) if oriented else (np.array([0.0, 0.0, 1.0]), 0.0)
        if turn > _GREATEST_TURN:
            raise InvalidInputError(
                f"{segment.name}: the tool would turn by {np.degrees(turn):.4g} deg, half a turn, which has no "
                "shortest way; put a point between the two"
            )
        chord = positions[1] - positions[0]
        if np.linalg.norm(chord) < _SHORTEST:
            raise InvalidInputError(
                f"{segment.name}: expected two positions of the tool, got {positions[0].tolist()} m twice; a tool that "
                "only turns needs no line"
            )
        none = np.zeros(3)
        centre, across, along, angle = none, none, none, 0.0
        if segment.through is not None:
            centre, across, along, angle = _arc(segment, positions[0], segment.through, positions[1])
            chord = none
        start, chord, centre, across, along = map(read_only, (positions[0], chord, centre, across, along))
        tool = read_only(rotations[0]), read_only(about)
        return cls(start, chord, centre, across, along, angle, *tool, turn, oriented)

    def position(self, s: Array) -> Array:
        """Positions at shares of the way, (...) -> (..., 3) [m]."""
        share = s[..., None]
        if not self.angle:
            straight: Array = self.start + share * self.chord
            return straight
        found: Array = self.centre + np.cos(self.angle * share) * self.across + np.sin(self.angle * share) * self.along
        return found

    def orientation(self, s: Array) -> Array:
        """Rotation matrices at shares of the way, (...) -> (..., 3, 3)."""
        x, y, z = self.about
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        angle = self.turn * s[..., None, None]
        turned: Array = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * (cross @ cross)
        return turned @ self.rotation

    def reach(self, imaginary: Array, magnitude: Array) -> tuple[Array, Array]:
        """Bounds of the sizes of position [m] and orientation at complex shares of the way.

        Args:
            imaginary: bounds of the imaginary parts of the shares.
            magnitude: bounds of their magnitudes, the same shape.
        """
        size = np.linalg.norm
        place = size(self.start) + magnitude * size(self.chord)
        if self.angle:
            place = size(self.centre) + np.exp(self.angle * imaginary) * size(self.across)
        return place, np.exp(self.turn * imaginary)

    def apart(self, kinematics: ToolKinematics, s: Array, q: Array) -> tuple[Array, Array]:
        """How far the tool is from shares of the way, in position [m] and orientation [rad], (...) each.

        Args:
            kinematics: of the tool.
            s: shares, shape (...).
            q: joint positions, shape (..., n_joints) [rad or m].
        """
        position, rotation = kinematics.pose(q)
        distance: Array = np.linalg.norm(position - self.position(s), axis=-1)
        if not self.oriented:
            return distance, np.zeros_like(distance)
        half = np.linalg.norm((rotation - self.orientation(s)).reshape(*s.shape, 9), axis=-1) / np.sqrt(8.0)
        return distance, 2.0 * np.arcsin(np.minimum(half, 1.0))


@final
@dataclass(frozen=True, eq=False)
class WayPostures:
    """Postures along a way of the tool, followed from its start to its end; made by :meth:`of`."""

    segment: ToolSegment
    way: ToolWay
    kinematics: ToolKinematics
    shares: Array
    q: Array

    @classmethod
    def of(cls, segment: ToolSegment, robot: Robot, first: Array, last: Array) -> WayPostures:
        """Follow the way of a segment between two points.

        Raises:
            UnreachableError: a place on the way that the tool does not reach, or where a joint would leave its range or
                would have to jump.
            InvalidInputError: as :meth:`ToolWay.of`.
        """
        way, kinematics = ToolWay.of(segment, robot, first, last), ToolKinematics.of(robot)
        shares = read_only(np.linspace(0.0, 1.0, _STEPS + 1))
        straight = first + shares[:, None] * (last - first)
        at_once = cls(segment, way, kinematics, shares, read_only(_reached(way, kinematics, straight, shares)))
        if at_once._faulty(robot, last) is None:
            return at_once
        found = [first]
        for before, share in zip(shares[:-1].tolist(), shares[1:].tolist(), strict=True):
            found.append(_next(segment, way, kinematics, (found[-1], last), (before, share)))
        found[-1] = last
        one_by_one = cls(segment, way, kinematics, shares, read_only(np.array(found)))
        faulty = one_by_one._faulty(robot, last)
        if faulty is not None:
            raise faulty
        return one_by_one

    def at(self, s: Array) -> Array:
        """Joint positions at shares of the way, (N,) -> (N, n_joints) [rad or m]; at the ends those of the points."""
        guess = np.stack([np.interp(s, self.shares, column) for column in self.q.T], axis=1)
        found = _reached(self.way, self.kinematics, guess, s)
        for end, share in ((0, 0.0), (-1, 1.0)):
            found[s == share] = self.q[end]
        return found

    def _faulty(self, robot: Robot, last: Array) -> UnreachableError | None:
        """What is wrong with the first place on the way that is not as it should be."""
        distance, angle = self.way.apart(self.kinematics, self.shares, self.q)
        limits = robot.limits
        outside = np.maximum(limits.lower - self.q, self.q - limits.upper)
        moved = np.abs(np.diff(self.q, axis=0))
        usual = np.maximum(_JUMP * np.median(moved, axis=0), _LEAST_JUMP)
        for k in range(1, len(self.shares)):
            where = self._place(k)
            if _missed(self.segment, distance[k], angle[k]) > _REACHED:
                turned = f" and {np.degrees(angle[k]):.4g} deg" if self.way.oriented else ""
                return UnreachableError(
                    f"{where} {robot.name!r} does not reach the {self.segment.tool}: it is {1e3 * distance[k]:.4g} mm"
                    f"{turned} away; choose other points, or another posture at one of them"
                )
            if outside[k].max() > _ROUNDING:
                joint = int(outside[k].argmax())
                return UnreachableError(
                    f"{where} {robot.joint_names[joint]!r} leaves its range, {limits.lower[joint]:g} to "
                    f"{limits.upper[joint]:g} {robot.joint_units[joint]}, with {self.q[k, joint]:.6g}"
                )
            if (moved[k - 1] > usual).any():
                joint = int((moved[k - 1] - usual).argmax())
                return UnreachableError(
                    f"{where} no posture joins the points {self.segment.from_point} and {self.segment.last}: "
                    f"{robot.joint_names[joint]!r} would jump from {self.q[k - 1, joint]:.4g} to "
                    f"{self.q[k, joint]:.4g} {robot.joint_units[joint]}; give both points in one posture, as joint "
                    "positions or as poses near each other"
                )
        return None

    def _place(self, k: int) -> str:
        position = np.round(self.way.position(self.shares[k]), 4).tolist()
        return f"{self.segment.name}: at {100.0 * self.shares[k]:.0f} % of the {self.segment.tool}, {position} m,"


def _reached(way: ToolWay, kinematics: ToolKinematics, guess: Array, s: Array) -> Array:
    return followed(kinematics, guess, way.position(s), way.orientation(s) if way.oriented else None)


def _missed(segment: ToolSegment, distance: float, angle: float) -> float:
    """How far a pose is from the way, as a share of the tolerance of which it is more."""
    return max(distance / segment.tolerance, angle / segment.turning)


def _next(
    segment: ToolSegment,
    way: ToolWay,
    kinematics: ToolKinematics,
    postures: tuple[Array, Array],
    shares: tuple[float, float],
) -> Array:
    """The posture at the second share of the way from that at the first, on the way to the last one if possible.

    A redundant robot must be led to the last posture; another one is led away from its branch if the last posture is
    on another branch, and then goes on by itself.
    """
    (q, last), (before, share) = postures, shares
    s = np.array([share])
    for guess in (q + (last - q) * (share - before) / (1.0 - before), q):
        found = _reached(way, kinematics, guess[None], s)
        error = _missed(segment, *(float(each[0]) for each in way.apart(kinematics, s, found)))
        if error <= _REACHED and np.abs(found[0] - q).max() <= _LONGEST_STEP:
            break
    here: Array = found[0]
    return here


def _turn(rotations: Array) -> tuple[Array, float]:
    """Unit axis in the base frame and angle of the shortest turn from one orientation to another, (2, 3, 3)."""
    from scipy.spatial.transform import Rotation  # imported where it computes, since that takes long

    vector = Rotation.from_matrix(rotations[1] @ rotations[0].T).as_rotvec()
    angle = float(np.linalg.norm(vector))
    return (vector / angle, angle) if angle > 1e-12 else (np.array([0.0, 0.0, 1.0]), 0.0)


def _arc(segment: ToolSegment, first: Array, through: Array, last: Array) -> tuple[Array, Array, Array, float]:
    """Centre, vectors to the start and at right angles to it, and angle of the circle through three points in order."""
    one, other = through - first, last - first
    normal = np.cross(one, other)
    size = float(np.linalg.norm(normal))
    if size <= _FLAT * float(other @ other) or np.linalg.norm(one) < _SHORTEST:
        raise InvalidInputError(
            f"{segment.name}: through: expected a position beside the line of the two points, got {through.tolist()} "
            'm; tool = "line" goes straight'
        )
    centre = first + (one @ one * np.cross(other, normal) - other @ other * np.cross(one, normal)) / (2.0 * size**2)
    axis = normal / size
    across = first - centre
    along = np.cross(axis, across)
    ends = [float(np.arctan2((p - centre) @ along, (p - centre) @ across)) % (2.0 * np.pi) for p in (through, last)]
    angle = ends[1]
    if ends[0] > ends[1]:
        along, angle = -along, 2.0 * np.pi - ends[1]
    return centre, across, along, angle
