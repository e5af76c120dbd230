"""Any robot through any points: interpolant, objectives, limits and obstacles by name or as data."""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, final

from trajevo.base.arrays import Array
from trajevo.base.own.code import known_at, named, naming
from trajevo.base.plain import plain_data
from trajevo.dynamics.drives.over_cycles import of_duty
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.errors import InvalidInputError, known_names
from trajevo.formulation.cell.free_places import check_numbers
from trajevo.formulation.cell.varied_cell import varied_cell
from trajevo.formulation.cell.varied_points import VariedPoints
from trajevo.formulation.constraints import kinds
from trajevo.formulation.constraints.clearance import load_clearances, notes_on_shapes
from trajevo.formulation.constraints.constraint import Limited, LimitParameter
from trajevo.formulation.constraints.drives.heat import CYCLES, DWELL, SHARED, duty_of
from trajevo.formulation.constraints.kinds import KINDS, NAMED_KINDS, constraints_of, kinds_for, parameters_of
from trajevo.formulation.moving_points import MovingPoints, box_settings, boxes_of, check_widths
from trajevo.formulation.objectives import UNUSED_PAYLOAD, needs_payload_variable, objectives_of, of_joints_alone
from trajevo.formulation.passing_points import (
    check_free,
    check_jumps,
    check_seam,
    check_velocities,
    closed,
    left_open,
    notes_on_jumps,
    window_limits,
)
from trajevo.formulation.payload_variable import PayloadVariable, carrying
from trajevo.formulation.points_on_limits import notes_on_height, notes_on_turning, turning
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.formulation.segments.limits import segment_limits
from trajevo.formulation.segments.ways import check_limits, curves_of, with_stops
from trajevo.path.boxes import CartesianBox, JointBox
from trajevo.path.passing import Passing, passings_of
from trajevo.path.segments import segments_of
from trajevo.path.via_points import OnLimit, ViaPoints, joint_points
from trajevo.robot.joints import length_unit
from trajevo.robot.payload import Payload
from trajevo.robot.robot import Robot, robot_of
from trajevo.trajectory.interpolants import (
    NAMED_INTERPOLANTS,
    BSplineShape,
    ExtraPoints,
    FixedCurve,
    HermiteShape,
    Interpolant,
    interpolant_through,
    price_of_rest,
    usual_interpolant,
)
from trajevo.trajectory.interpolants.legs import checked_durations
from trajevo.trajectory.pace.choice import notes_on_pace, with_pace
from trajevo.trajectory.pace.paced import Paced

#: Greatest number of characters of a problem's title, which stands above tables and pictures.
LONGEST_TITLE = 120


@final
class ViaPointProblem(TrajectoryProblem):
    """Any robot through points; the variables are the times and, if wanted, the positions of points.

    Args:
        robot: name, folder or URDF of a robot, a :class:`~trajevo.robot.robot.Robot`, or the arguments of
            :func:`~trajevo.robot.robot.load_robot` as a mapping, or one with ``dh`` or ``joints`` as in a task.
        points: the points to visit, in order: an array (K, n_joints) [rad or m], a list of joint positions and tool
            poses (:class:`~trajevo.path.inverse_kinematics.Pose` or mappings ``{"position": ..., "rpy": ...}``), or a
            CSV file with a column for each joint, with its unit. Where an inner point lies on a joint's position limit,
            the joint is at rest, if the interpolant can hold it; :attr:`notes` tell it.
        base: where the robot may stand, ``{"moving": {"x": [-0.3, 0.3], "yaw": ["-90 deg", "90 deg"]}}``: ranges of its
            displacement from its given place along ``x``, ``y`` and ``z`` of the cell [m], of its turn about the
            vertical axis ``yaw`` and of its tilt ``roll`` and ``pitch`` [rad], which become variables. The points are
            then tool poses that stay in the cell, and efforts are those under gravity as each base sees it.
        order: which points may be visited in any order: ``"free"`` for all between the ends, or ``{"free": [1, 2, 3],
            "after": {3: [1]}}`` with the numbers of the points and, if wanted, of those that come before others. Points
            of the group have its places in the list, all others their own. The order is then a variable.
        postures: how postures of tool poses are chosen: ``"nearest"`` to that of the point before; ``"best"``, of all
            postures those with the least time from rest to rest; ``"all"``, a variable that chooses among all. If None,
            ``"nearest"``, or ``"best"`` where the order is free.
        turns: ``"as_written"``, or ``"shortest"``: joint positions are shifted by whole turns, within the ranges, so
            that every joint goes the shorter way round from point to point.
        duration_bounds: least and greatest time between two points [s], or such a pair for every segment, shape
            (K - 1, 2); a duration whose bounds are equal is fixed, and no variable.
        interpolant: a name in :data:`~trajevo.trajectory.interpolants.THROUGH_POINTS`, an interpolant of another
            package, your own class derived from :class:`~trajevo.trajectory.interpolants.Interpolant`, or its place. If
            None, ``"bspline"`` where time and the motions of joints alone count, for up to 60 variables, else
            ``"quintic_spline"``; see :func:`~trajevo.trajectory.interpolants.usual.usual_interpolant`.
        extra_points: number of free points between every two points, for ``quintic_spline``, ``septic_spline``,
            ``cubic`` and ``hermite``: when they are passed, and where, are variables; 0 for none.
        pace: number of variables of a smooth pace that all segment times follow, from 4 to 200, instead of a time for
            each; 0 for none. If None, 24 where there are more than 40 points, and nothing but points, their times and
            loads that are always carried are asked for.
        bspline: of the interpolant ``"bspline"``: ``degree`` 3, 5 or 7, ``control_points`` in every gap between two
            points, ``knots`` ``"even"`` or ``"free"``, and the highest derivative held at both ``ends``, by name.
        moving: points that may move: :class:`~trajevo.path.boxes.JointBox`, :class:`~trajevo.path.boxes.CartesianBox`,
            or mappings with the number of the ``point`` and the half widths ``joints`` (n_joints) [rad or m] or
            ``tool`` (3) [m].
        passing: how points are passed: :class:`~trajevo.path.passing.Passing`, or mappings with the number of the
            ``point`` and ``stop``, ``dwell`` [s], ``velocity``, ``acceleration`` (n_joints) or ``window`` [s].
        segments: what is asked of segments: :class:`~trajevo.path.segments.ToolSegment`, or mappings with the numbers
            of the points ``from`` and ``to``, and ``tool`` (``"line"`` or ``"arc"`` with ``through`` (3) [m],
            ``tolerance`` [m] and ``turning`` [rad]) or ``upright`` [rad] with ``axis`` and ``direction``.
        cyclic: whether the end meets the start with all derivatives that are continuous on the way, instead of rests at
            both; the last point is then the first.
        objectives: names, see :data:`~trajevo.formulation.objectives.OBJECTIVES`; your own functions of a rollout, or
            :class:`~trajevo.formulation.objectives.Objective`, or their places ``"module:name"``.
        constraints: names of limits that need no parameter, see
            :data:`~trajevo.formulation.constraints.kinds.KINDS`; your own functions of a rollout, or
            :class:`~trajevo.formulation.constraints.constraint.Constraint`, or their places.
        limits: ``"certified"`` for effort and tool-speed limits proven at every instant, see
            :mod:`trajevo.formulation.constraints.certified`, or ``"sampled"``.
        payload: mass [kg], a :class:`~trajevo.robot.payload.Payload`, or its settings; or a list of loads that are
            picked up and put down on the way: :class:`~trajevo.path.loads.Load`, or mappings with the settings of a
            payload and ``from``, ``to``, ``vary``, ``shape`` and ``touches``. If ``"unused_payload"`` is an objective,
            the mass is a variable, and this gives the payload's shape and model.
        payload_range: least and greatest mass [kg] if the mass is a variable; if None, from 0 to the greatest mass that
            the robot can hold at rest at the first and the last point.
        reference_point: reference point of the hypervolume [SI]; taken from the first feasible points if None.
        samples: instants per segment at which effort and tool are sampled, both ends included.
        threads: threads for the evaluation of populations; results do not depend on the number.
        title: what it is called in tables, reports and pictures; results do not depend on it.
        **parameters: of limits, those above and those of other packages; a limit whose parameter is None is off.

    Raises:
        UnknownNameError: no such robot, interpolant, objective or constraint, or another value of ``limits`` or
            ``turns``.
        UnreachableError: a pose that the tool cannot take.
        InvalidInputError: points that the robot cannot reach or the interpolant cannot use, bad bounds or boxes,
            or a parameter of a limit that does not exist or cannot be used.
    """

    registered_name: ClassVar[str] = "via-points"
    title: str = "Any robot through via points"

    def __init__(
        self,
        *,
        robot: str | Path | Robot | Mapping[str, Any] = "puma560",
        points: Any = None,
        base: Mapping[str, Any] | None = None,
        order: str | Mapping[str, Any] | None = None,
        postures: str | None = None,
        turns: str = "as_written",
        duration_bounds: Sequence[float] | Sequence[Sequence[float]] = (0.5, 6.0),
        interpolant: str | type[Interpolant] | None = None,
        extra_points: int = 0,
        pace: int | None = None,
        bspline: Mapping[str, Any] | None = None,
        moving: Sequence[Any] = (),
        passing: Sequence[Any] = (),
        segments: Sequence[Any] = (),
        cyclic: bool = False,
        objectives: Sequence[Any] = ("time", "jerk"),
        constraints: Sequence[Any] = ("position", "velocity", "acceleration", "jerk"),
        limits: str = "certified",
        payload: float | Payload | dict[str, Any] | Sequence[Any] = 0.0,
        payload_range: tuple[float, float] | None = None,
        reference_point: Sequence[float] | None = None,
        samples: int = 6,
        threads: int = 1,
        title: str | None = None,
        **parameters: Any,
    ) -> None:
        if title is not None:
            self.title = checked_title(title)
        self._own: dict[str, Any] = {}
        asked_for = None if interpolant is None else self._named([interpolant], "interpolant")[0]
        objectives, constraints = self._named(objectives, "objectives"), self._named(constraints, "constraints")
        _check_keys(parameters)
        named = robot_of(robot)
        beside = {"moving": moving, "segments": segments, "cyclic": cyclic, "pace": pace, "bspline": bspline}
        beside |= {"extra_points": extra_points, "turns": turns != "as_written"}
        chosen: dict[str, Any] = {"order": order, "postures": postures}
        cell = varied_cell(base, points, named, beside=beside, parameters=parameters, **chosen)
        via = closed(joint_points(points, named, turns=turns) if cell is None else cell.nominal, cyclic)
        bounds = checked_durations(duration_bounds, len(via))
        boxes = boxes_of(moving)
        check_widths(boxes, via, named)
        kept = isinstance(constraints, Sequence) and "position" in constraints
        given_passing, on_limits = (
            passings_of(passing, len(via), named.joint_names),
            turning(via, named, boxes) if kept and cell is None else (),
        )
        parts = segments_of(segments, len(via))
        plain = cell is None and not any((boxes, given_passing, parts, cyclic))
        alone = plain and kinds.of_joints_alone(constraints, parameters) and of_joints_alone(objectives)
        usual = usual_interpolant(via, of_joints_alone=alone and not any((pace, extra_points, on_limits)))
        kind: str = ("bspline" if bspline else usual) if asked_for is None else asked_for
        NAMED_INTERPOLANTS.find(kind)
        asked, curves = with_stops(given_passing, parts, len(via)), curves_of(parts, named, via, kind)
        check_limits(parts, on_limits, named)
        at_limits = left_open(on_limits, asked)
        extra = _between(kind, extra_points, bspline, named, via, alone)
        decoder = (
            _interpolant(kind, via, named, bounds, boxes, at_limits, asked, cyclic, curves, extra)
            if cell is None
            else VariedPoints(kind, cell.arrangement, duration_bounds=bounds, passing=asked)
        )
        other: dict[str, Any] = {"moving": boxes, kind if kind in ("bspline", "hermite") else "extra_points": extra}
        other |= {"passing": given_passing, "segments": parts, "cyclic": cyclic}
        besides = next((key for key, value in other.items() if value), "")
        decoder = with_pace(decoder, via, named, pace, besides=besides)
        dynamics = carrying(named, payload, decoder, asked, cyclic=cyclic, samples=samples, threads=threads)
        if cell is not None and cell.order is not None:
            numbered: dict[str, Any] = {"passing": asked, "segments": parts, "duration_bounds": bounds}
            check_numbers(cell.order, carried=dynamics.carried, **numbered)
        given = {"limits": limits, "shared": SHARED if of_duty(objectives) else (), **parameters}
        held = constraints_of(constraints, Limited(named, via, decoder), **given)
        check_velocities(asked, named, via, on_limits, held)
        check_seam(cyclic, named, via, held)
        check_jumps(kind, objectives, held)
        duty = duty_of(parameters.get(DWELL.name), parameters.get(CYCLES.name))
        mass = _payload_variable(dynamics, decoder, objectives, constraints, payload_range)
        followed = VariedPoints if cell is not None and cell.box is not None else MovingPoints
        reach = (decoder.reach_constraint,) if isinstance(decoder, followed) else ()
        super().__init__(
            dynamics=dynamics if mass is None else mass.dynamics,
            interpolant=decoder,
            objectives=objectives_of(objectives, named, payload=None if mass is None else mass.objective, duty=duty),
            constraints=(
                *held,
                *reach,
                *window_limits(asked, decoder),
                *load_clearances(held, dynamics.schedule),
                *segment_limits(parts, named, via, decoder, curves, limits=limits),
            ),
            payload_range=None if mass is None else mass.range,
            reference_point=reference_point,
            length=length_unit(named),
        )
        told = notes_on_turning(at_limits, named, kind, price_of_rest(kind))
        told = (*told, *notes_on_shapes(held, dynamics.schedule), *notes_on_pace(decoder, pace))
        told = (*told, *notes_on_jumps(kind, named))
        self._notes = (*told, *notes_on_height(via, named, held), *(named.friction_notes if named.gives_effort else ()))
        given = {
            "robot": named.settings,
            "points": via.positions.tolist() if cell is None else list(cell.points),
            **({} if cell is None else cell.settings),
            "turns": turns,
            "duration_bounds": bounds.tolist(),
            "interpolant": kind,
            **({"extra_points": extra.count} if isinstance(extra, ExtraPoints | HermiteShape) and extra.count else {}),
            **({"bspline": extra.settings} if isinstance(extra, BSplineShape) else {}),
            **({"pace": decoder.count} if isinstance(decoder, Paced) else {} if pace is None else {"pace": 0}),
            "moving": [box_settings(box) for box in boxes],
            "passing": [one.settings for one in given_passing],
            **({"segments": [one.settings for one in parts]} if parts else {}),
            **({"cyclic": True} if cyclic else {}),  # hardly any motion is, and settings are told
            "objectives": list(objectives),
            "constraints": list(constraints),
            **_settings_of_limits(parameters, limits),
            "payload": self.dynamics.carried,
            "payload_range": None if payload_range is None else list(payload_range),
            "reference_point": None if reference_point is None else list(reference_point),
            "samples": dynamics.samples,
            "threads": dynamics.threads,
            **({} if title is None else {"title": title}),
        }
        self._settings: dict[str, Any] = plain_data("settings", given)

    @property
    def settings(self) -> dict[str, Any]:
        """Keyword arguments that make an equal problem; what is the user's own by its place in Python."""
        return dict(self._settings)

    def with_payload(self, payload: Payload) -> TrajectoryProblem:
        """The same problem with another payload, and the same own functions, whatever their places mean by now."""
        with naming(self._own):
            return super().with_payload(payload)

    def _named(self, given: Any, argument: str) -> Any:
        """Names, and places of what is the user's own, which are remembered."""
        if isinstance(given, str) or not isinstance(given, Sequence):
            return given  # is refused elsewhere
        names = [named(one, argument) for one in given]
        self._own |= {name: known_at(name) for name in names if known_at(name) is not None}
        return names

    @property
    def notes(self) -> tuple[str, ...]:
        """Points that lie on a joint's limit and what follows from it, and the URDF's friction, used or left out."""
        return self._notes


#: Its own arguments; the others are parameters of limits.
_ARGUMENTS = tuple(inspect.signature(ViaPointProblem.__init__).parameters.values())[1:-1]


@final
class _Signature:
    """The signature of the class: its own arguments, then the parameters of all available limits."""

    def __get__(self, instance: object, owner: type) -> inspect.Signature:
        return inspect.Signature([*_ARGUMENTS, *map(_as_argument, limit_parameters().values())])


def limit_parameters() -> dict[str, LimitParameter]:
    """The parameters of all available limits by name, those of other packages last.

    Raises:
        InvalidInputError: a parameter has the name of another, or of an argument of :class:`ViaPointProblem`.
    """
    found = parameters_of(NAMED_KINDS.all())
    taken = [argument.name for argument in _ARGUMENTS if argument.name in found]
    if taken:
        raise InvalidInputError(f"constraints: a limit's parameter {taken[0]!r} needs another name, which is taken")
    return found


def _as_argument(parameter: LimitParameter) -> inspect.Parameter:
    kind = Any if parameter.plain else parameter.type if parameter.default is not None else parameter.type | None
    return inspect.Parameter(parameter.name, inspect.Parameter.KEYWORD_ONLY, default=parameter.default, annotation=kind)


def _documented(text: str) -> str:
    """The docstring of the class with the parameters of limits inserted."""
    lines = (f"{p.name}: {p.help}" + (f" [{p.unit}]." if p.unit else ".") for p in parameters_of(KINDS).values())
    return text.replace("**parameters: of limits", "\n        ".join([*lines, "**parameters: of limits"]))


ViaPointProblem.__signature__ = _Signature()
ViaPointProblem.__doc__ = _documented(ViaPointProblem.__doc__ or "")


def checked_title(title: Any, *, name: str = "title") -> str:
    """A problem's title.

    Args:
        title: what was given.
        name: name of the argument, for the message.

    Raises:
        InvalidInputError: not one line of text, or too long.
    """
    if not isinstance(title, str) or not title.strip() or len(title) > LONGEST_TITLE or len(title.splitlines()) > 1:
        raise InvalidInputError(f"{name}: expected one line of 1 to {LONGEST_TITLE} characters, got {title!r}")
    return title.strip()


def _check_keys(given: Mapping[str, Any]) -> None:
    """Refuse names that are neither arguments nor parameters of limits; other packages are loaded only if needed."""
    if set(given) <= set(parameters_of(KINDS)):
        return
    known = [*(argument.name for argument in _ARGUMENTS), *limit_parameters()]
    for key in given:
        if key not in known:
            raise InvalidInputError(f"ViaPointProblem takes no {key!r}; {known_names(key, known)}")


def _settings_of_limits(given: Mapping[str, Any], limits: str) -> dict[str, Any]:
    """Parameters of limits as plain data: all of trajevo's own, and the given ones of other packages."""
    always, at_hand = parameters_of(KINDS), parameters_of(kinds_for((), given))
    told = [parameter for name, parameter in at_hand.items() if name in always or name in given]
    keys, tables = (
        {p.name: p.setting(given.get(p.name, p.default)) for p in told if p.table is table} for table in (False, True)
    )
    return {**keys, "limits": limits, **tables}


def _payload_variable(
    dynamics: Dynamics,
    interpolant: Interpolant,
    objectives: Sequence[str],
    constraints: Sequence[str],
    payload_range: tuple[float, float] | None,
) -> PayloadVariable | None:
    """The payload's mass as a variable if an objective needs it, else None."""
    no_list = isinstance(objectives, str) or not isinstance(objectives, Sequence)  # is refused elsewhere
    if no_list or not needs_payload_variable(objectives):
        if payload_range is not None:
            raise InvalidInputError(
                f"payload_range: expected {UNUSED_PAYLOAD!r} among the objectives, got {objectives}"
            )
        return None
    if "effort" not in constraints:
        raise InvalidInputError(f"objectives: {UNUSED_PAYLOAD!r} needs 'effort' among the constraints, which bounds it")
    return PayloadVariable.of(dynamics, interpolant, payload_range)


def _interpolant(
    kind: str,
    via: ViaPoints,
    robot: Robot,
    bounds: Array,
    boxes: Sequence[JointBox | CartesianBox],
    turns: Sequence[OnLimit],
    passing: tuple[Passing, ...],
    cyclic: bool,
    curves: dict[int, FixedCurve],
    extra: ExtraPoints | BSplineShape | HermiteShape | None,
) -> Interpolant:
    """The interpolant, with joints at rest where they turn, if it can."""
    rests = () if price_of_rest(kind) is None else tuple((at.point, at.joint) for at in turns)
    given: dict[str, Any] = {"duration_bounds": bounds, "at_rest": rests, "passing": passing, "cyclic": cyclic}
    given |= ({"curves": curves} if curves else {}) | ({} if extra is None else {"extra": extra})
    found = (
        MovingPoints(kind, via, tuple(boxes), robot=robot, **given)
        if boxes
        else interpolant_through(kind, via, **given)
    )
    check_free(found)
    return found


def _between(
    kind: str, extra_points: Any, bspline: Any, robot: Robot, via: ViaPoints, of_joints_alone: bool
) -> ExtraPoints | BSplineShape | HermiteShape | None:
    """What is free between the points: points, velocities, or control points of B-splines."""
    if kind == "hermite" and bspline is None:
        return HermiteShape.of(extra_points, robot, via)
    extra = ExtraPoints.of(extra_points, robot, via)
    if bspline is None and kind != "bspline":
        return extra
    if extra is not None:
        raise InvalidInputError("extra_points: 'bspline' takes none; its control_points are free, in [bspline]")
    return BSplineShape.of(bspline, robot, via, of_joints_alone=of_joints_alone)
