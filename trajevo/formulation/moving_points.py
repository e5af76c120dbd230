"""Via points that may move: their offsets are decision variables, like the times.

For fixed times the coefficients of a motion are linear in its via points. So the motion through moved points is the
motion through the nominal points plus, for every moving point, its offset times the motion through indicators that are
1 at this point and 0 at the others. One call of the interpolant gives all of these motions, since each indicator is one
more column of the points.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.base.units import if_degrees
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.formulation.constraints.constraint import Constraint
from trajevo.path.boxes import CartesianBox, JointBox, followed, missed
from trajevo.path.passing import Passing
from trajevo.path.via_points import ViaPoints
from trajevo.robot.kinematics import ToolKinematics
from trajevo.robot.robot import Robot
from trajevo.trajectory.batch import TrajectoryBatch
from trajevo.trajectory.interpolants import (
    NAMED_INTERPOLANTS,
    BSpline,
    BSplineShape,
    ExtraPoints,
    FixedCurve,
    HermiteShape,
    HermiteSpline,
    Interpolant,
    Variable,
    interpolant_through,
)
from trajevo.trajectory.interpolants.interpolant import (
    AtRest,
    alike,
    checked_rests,
    decision_vectors,
    example_of,
)
from trajevo.trajectory.linear_in_points import LinearInPoints
from trajevo.trajectory.polynomial import PolynomialBatch

#: Greatest error allowed for the pose of a moved point [m or rad].
REACHED = 1e-6

#: Errors below this are rounding [m or rad]; the derivative of so small a distance is meaningless.
_ROUNDING = 1e-9

#: Half width of a box of the tool above which numbers are not believed [m].
_MOST_WIDTH = 20.0


@final
@dataclass(frozen=True, eq=False)
class MovingPoints(Interpolant):
    """An interpolant with via points that may move inside boxes, in joint space or in the Cartesian space of the tool.

    Attributes:
        kind: interpolant, a name of :data:`~trajevo.trajectory.interpolants.NAMED_INTERPOLANTS`.
        points: nominal via points.
        boxes: boxes in which points may move, at most one per point.
        robot: the robot, whose joint limits clip boxes in joint space and whose tool moves in Cartesian boxes.
        duration_bounds: least and greatest time of a segment, shape (2,), or of every segment (n_points - 1, 2) [s].
        ends: whether the first and the last point may move too.
        at_rest: joints at rest at inner points, pairs (point, joint) from 0; only for interpolants that take them.
        passing: how points are passed, in their order.
        cyclic: whether the end meets the start.
        curves: fixed curves of the tool by the point at which they begin; no box is at their ends.
        extra: free points between the via points, or the shape of B-splines or Hermite splines.

    Raises:
        UnknownNameError: no such interpolant.
        InvalidInputError: points that the robot cannot reach or the interpolant cannot use; an interpolant whose
            motions are not linear in the points; no boxes, two boxes for one point, or a box for an end point or a
            point that does not exist.
    """

    kind: str
    points: ViaPoints
    boxes: tuple[JointBox | CartesianBox, ...]
    robot: Robot = field(kw_only=True)
    duration_bounds: Any = field(kw_only=True)
    ends: bool = field(default=False, kw_only=True)
    at_rest: AtRest = field(default=(), kw_only=True)
    passing: tuple[Passing, ...] = field(default=(), kw_only=True)
    cyclic: bool = field(default=False, kw_only=True)
    curves: Mapping[int, FixedCurve] = field(default_factory=dict, kw_only=True)
    extra: ExtraPoints | BSplineShape | HermiteShape | None = field(default=None, kw_only=True)
    _linear: LinearInPoints = field(init=False, repr=False)
    _offsets: tuple[tuple[Variable, ...], ...] = field(init=False, repr=False)
    _group: tuple[int, ...] = field(init=False, repr=False)

    __repr__ = brief

    def __post_init__(self) -> None:
        NAMED_INTERPOLANTS.find(self.kind)
        if not isinstance(self.points, ViaPoints):
            raise InvalidInputError(f"points: expected ViaPoints, got {type(self.points).__name__}")
        ViaPoints.for_robot(self.robot, self.points.positions)
        object.__setattr__(self, "boxes", tuple(self.boxes))
        if self.extra is None:
            # What is free of them is so for the joints alone, not for the indicators beside them.
            found = NAMED_INTERPOLANTS.find(self.kind)
            if found is BSpline:
                object.__setattr__(self, "extra", BSplineShape.of(None, self.robot, self.points))
            elif found is HermiteSpline:
                object.__setattr__(self, "extra", HermiteShape.of(0, self.robot, self.points))
        self._check_boxes()
        object.__setattr__(self, "_offsets", tuple(self._offsets_of(box) for box in self.boxes))
        object.__setattr__(self, "at_rest", checked_rests(self.at_rest, self.points))
        linear = LinearInPoints(self._with_indicators(), len(self.points), self.kind, "as points move")
        object.__setattr__(self, "_linear", linear)
        self._check_linear()

    @property
    def _inner(self) -> Interpolant:
        return self._linear.inner

    @cached_property
    def _kinematics(self) -> ToolKinematics:
        return ToolKinematics.of(self.robot)

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Those of the interpolant, then the offsets, box by box."""
        return self._inner.variables + tuple(variable for offsets in self._offsets for variable in offsets)

    def __call__(self, x: Array) -> PolynomialBatch:
        """Motions through the moved points for decision vectors of shape (B, n_variables)."""
        timing, deltas = self._decoded(x)
        whole = self._linear.motions(timing)
        return PolynomialBatch(whole.breaks, self._moved(whole, deltas))

    def _moved(self, whole: PolynomialBatch, deltas: Array) -> Array:
        """Coefficients of the motions whose points are moved by (B, M, n_joints) [rad or m]."""
        n = self.points.n_joints
        base, basis = whole.coefficients[:, :, :n], whole.coefficients[:, :, n:]
        if not any(self._group):
            moved: Array = base + np.einsum("bmj,bsmd->bsjd", deltas, basis)
            return moved
        groups = basis.reshape(*basis.shape[:2], -1, len(self.boxes), basis.shape[-1])
        own: Array = base + np.einsum("bmj,bsjmd->bsjd", deltas, groups[:, :, list(self._group)])
        return own

    def _with_indicators(self) -> Interpolant:
        """The interpolant through the points, and through indicators for every group of joints that rest alike."""
        n, indicators = self.points.n_joints, np.eye(len(self.points))[:, [box.point for box in self.boxes]]
        groups, rests = alike(self.at_rest, n), list(self.at_rest)
        owner = {joint: g for g, (joints, _) in enumerate(groups) for joint in joints}
        object.__setattr__(self, "_group", tuple(owner[joint] for joint in range(n)))
        for g, (_, stops) in enumerate(groups):
            columns = range(n + g * len(self.boxes), n + (g + 1) * len(self.boxes))
            rests += [(point, column) for point in stops for column in columns]
        return self._made(np.hstack([self.points.positions, *([indicators] * len(groups))]), rests)

    def via_times(self, x: Array) -> Array:
        """When the points are passed, (B, n_variables) -> (B, K) [s]."""
        return self._inner.via_times(self._timing(x))

    def offsets_at(self, positions: Array) -> Array:
        """The offsets that move the points to joint positions, (B, K, n_joints) -> (B, n_offsets) [rad or m]."""
        columns = []
        for box in self.boxes:
            moved, nominal = positions[:, box.point], self.points.positions[box.point]
            if isinstance(box, CartesianBox):
                moved, nominal = (self._kinematics.pose(q)[0] for q in (moved, nominal))
            columns.append((moved - nominal)[:, np.flatnonzero(box.half_width)])
        return np.concatenate(columns, axis=1)

    @property
    def reach_constraint(self) -> Constraint:
        """One column per Cartesian box: the tool's error at that point divided by 1e-6 m or rad, minus 1.

        The error is how far the tool is outside the box or turned away from its orientation. It is computed at the
        points of the motion itself. Without Cartesian boxes there is no column.
        """
        names = tuple(f"reach of point {box.point}" for box in self._cartesian())
        return Constraint(names, "boxes of the tool", self._reach_excess, quantity="reach", proof="extremes")

    def points_of(self, trajectory: TrajectoryBatch) -> Array:
        """The via points of motions of this interpolant, shape (B, K, n_joints) [rad or m].

        Lines with blends cut the corners; their points are where the lines would meet.
        """
        return self._linear.points_of(trajectory)

    def via_errors(self, trajectory: TrajectoryBatch) -> Array:
        """How far motions pass their moved points, (B, K, n_joints) [rad or m]; 0 if the interpolant meets them."""
        return self._linear.via_errors(trajectory)

    def _reach_excess(self, rollout: Rollout) -> Array:
        boxes, points = self._cartesian(), self.points_of(rollout.trajectory)
        excess = np.empty((len(points), len(boxes)), dtype=points.dtype)
        for k, box in enumerate(boxes):
            nominal = self.points.positions[box.point]
            error = missed(self._kinematics, points[:, box.point], nominal, box)
            excess[:, k] = np.maximum(error - _ROUNDING, 0.0) / REACHED - 1.0
        return excess

    def _cartesian(self) -> list[CartesianBox]:
        return [box for box in self.boxes if isinstance(box, CartesianBox)]

    def _timing(self, x: Array) -> Array:
        rows = decision_vectors(x, len(self.variables))
        return rows[:, : len(self._inner.variables)]

    def _decoded(self, x: Array) -> tuple[Array, Array]:
        """The interpolant's own variables, and the offset of every moving point, (B, M, n_joints) [rad or m]."""
        rows, timing = decision_vectors(x, len(self.variables)), self._timing(x)
        if not np.isfinite(rows).all():
            row, column = (int(i) for i in np.argwhere(~np.isfinite(rows))[0])
            raise InvalidInputError(f"x: expected finite numbers, got {rows[row, column]} in row {row}, {column=}")
        deltas = np.zeros((len(rows), len(self.boxes), self.points.n_joints), dtype=rows.dtype)
        first = timing.shape[1]
        for m, box in enumerate(self.boxes):
            moves = np.zeros((len(rows), len(box.half_width)), dtype=rows.dtype)
            free = np.flatnonzero(box.half_width)
            moves[:, free] = rows[:, first : first + len(free)]
            first += len(free)
            deltas[:, m] = moves if isinstance(box, JointBox) else self._joint_moves(box, moves)
        return timing, deltas

    def _joint_moves(self, box: CartesianBox, moves: Array) -> Array:
        nominal = self.points.positions[box.point]
        position, rotation = self._kinematics.pose(nominal)
        kept = rotation if box.keep_orientation else None
        moved: Array = followed(self._kinematics, nominal, position + moves, kept) - nominal
        return moved

    def _offsets_of(self, box: JointBox | CartesianBox) -> tuple[Variable, ...]:
        free = [int(k) for k in np.flatnonzero(box.half_width)]
        if isinstance(box, CartesianBox):
            widths = box.half_width.tolist()
            return tuple(Variable(f"d{'xyz'[k]} of point {box.point}", "m", -widths[k], widths[k]) for k in free)
        position, limits = self.points.positions[box.point], self.robot.limits
        lower = np.maximum(-box.half_width, limits.lower - position).tolist()
        upper = np.minimum(box.half_width, limits.upper - position).tolist()
        names, units = self.robot.joint_names, self.robot.joint_units
        return tuple(Variable(f"q_{box.point} of {names[k]}", units[k], lower[k], upper[k]) for k in free)

    def _made(self, positions: Array, rests: AtRest) -> Interpolant:
        more = positions.shape[1] - self.points.n_joints
        passing = [one.with_more_columns(more) for one in self.passing]
        given: dict[str, Any] = {
            "duration_bounds": self.duration_bounds,
            "at_rest": rests,
            "passing": passing,
            "cyclic": self.cyclic,
            "curves": {point: curve.with_more_columns(more) for point, curve in self.curves.items()},
            "extra": self.extra,
        }
        return interpolant_through(self.kind, ViaPoints(positions), **given)

    def _check_boxes(self) -> None:
        if not self.boxes:
            raise InvalidInputError("boxes: expected at least 1 box, as otherwise no point moves; got none")
        last, taken = len(self.points) - 1, set()
        for box in self.boxes:
            if not isinstance(box, JointBox | CartesianBox):
                raise InvalidInputError(f"boxes: expected JointBox or CartesianBox, got {type(box).__name__}")
            if isinstance(box, CartesianBox):
                self.robot.check_body("a box of the tool")
            least, most = (0, last) if self.ends else (1, last - 1)
            if not least <= box.point <= most:
                advice = "" if self.ends else "; the ends move only with ends=True"
                raise InvalidInputError(f"boxes: expected a point from {least} to {most}, got {box.point}{advice}")
            held = [first for first, curve in self.curves.items() if box.point in (first, curve.segment.last)]
            if held:
                tool = self.curves[held[0]].segment.tool
                raise InvalidInputError(
                    f"moving: point {box.point}: expected a point that no {tool} of the tool begins or ends at, as its "
                    f"way is fixed; {self.curves[held[0]].segment.name} is one"
                )
            if box.point in taken:
                raise InvalidInputError(f"boxes: expected one box per point, got two for point {box.point}")
            taken.add(box.point)
            if isinstance(box, JointBox) and len(box.half_width) != self.robot.dof:
                raise InvalidInputError(
                    f"half_width at point {box.point}: robot {self.robot.name!r} has {self.robot.dof} joints, "
                    f"got {len(box.half_width)} numbers"
                )

    def _check_linear(self) -> None:
        """Refuse an interpolant whose motions are not linear in its points."""
        moves = np.random.default_rng(0).uniform(0.01, 0.1, (1, len(self.boxes), self.points.n_joints))
        positions = self.points.positions.copy()
        positions[[box.point for box in self.boxes]] += moves[0]
        x = example_of(self._inner)
        self._linear.check(self._made(positions, self.at_rest)(x), self._moved(self._linear.motions(x), moves))


def boxes_of(moving: Sequence[Any]) -> list[JointBox | CartesianBox]:
    """The boxes of a list of boxes or of mappings with ``point``, and ``joints`` or ``tool``."""
    if isinstance(moving, Mapping | str) or not isinstance(moving, Sequence):
        raise InvalidInputError(f"moving: expected a list of boxes, got {moving!r}")
    return [_box(k, given) for k, given in enumerate(moving)]


def check_widths(boxes: Sequence[JointBox | CartesianBox], via: ViaPoints, robot: Robot) -> None:
    """Refuse half widths that must be in degrees or millimetres."""
    for box in boxes:
        widths = np.asarray(box.half_width)
        if isinstance(box, CartesianBox):
            if widths.max() > _MOST_WIDTH:
                raise InvalidInputError(
                    f"moving: tool: a half width of {widths.max():g} m at point {box.point} looks like mm: expected at "
                    f"most {_MOST_WIDTH:g} m, {1e-3 * widths.max():g} if it is mm"
                )
        elif len(widths) == robot.dof and box.point < len(via):  # is told elsewhere if not
            q, limits = via.positions[box.point], robot.limits
            turns = (np.array(robot.joint_units) == "rad") & (widths > 2.0 * np.pi)
            for j in np.flatnonzero(turns & (q - widths <= limits.lower) & (q + widths >= limits.upper)).tolist():
                raise InvalidInputError(
                    f"moving: joints: a half width of {widths[j]:g} rad at point {box.point} covers the whole range of "
                    f"{robot.joint_names[j]!r}{if_degrees(float(widths[j]))}"
                )


def _box(place: int, given: Any) -> JointBox | CartesianBox:
    if isinstance(given, JointBox | CartesianBox):
        return given
    keys = set(given) if isinstance(given, Mapping) else set()
    if keys - {"keep_orientation"} == {"point", "tool"}:
        return CartesianBox(given["point"], given["tool"], keep_orientation=given.get("keep_orientation", True))
    if keys != {"point", "joints"}:
        raise InvalidInputError(
            f"moving.{place}: expected point, and joints or tool (with keep_orientation if wanted), got {given!r}"
        )
    return JointBox(given["point"], given["joints"])


def box_settings(box: JointBox | CartesianBox) -> dict[str, Any]:
    """Plain data that makes an equal box."""
    half_width = np.asarray(box.half_width).tolist()
    if isinstance(box, JointBox):
        return {"point": box.point, "joints": half_width}
    return {"point": box.point, "tool": half_width, "keep_orientation": box.keep_orientation}
