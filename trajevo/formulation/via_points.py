"""Any robot through any points: interpolant, objectives, limits and obstacles by name or as data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, final

import numpy as np

from trajevo.base.arrays import numbers
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.errors import InvalidInputError, checked_name
from trajevo.formulation.catalogue import limits_of, objectives_of
from trajevo.formulation.constraints.certified import held
from trajevo.formulation.constraints.clearance import clearance_limit
from trajevo.formulation.constraints.constraint import Constraint
from trajevo.formulation.constraints.joint_limits import effort_limits, overshoot_limit, time_limit
from trajevo.formulation.constraints.scene import Scene
from trajevo.formulation.constraints.tool import keep_out_height, tool_speed_limit
from trajevo.formulation.moving_points import MovingPoints
from trajevo.formulation.payload_variable import UNUSED_PAYLOAD, PayloadVariable
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.path.boxes import CartesianBox, JointBox
from trajevo.path.via_points import ViaPoints, joint_points
from trajevo.robot.payload import Payload
from trajevo.robot.robot import Robot, length_unit, robot_of
from trajevo.trajectory.interpolants import THROUGH_POINTS, Interpolant


def constraints_of(
    names: Sequence[str],
    robot: Robot,
    points: ViaPoints,
    *,
    overshoot: float | None = None,
    effort_margin: float = 0.0,
    tool_speed: float | None = None,
    tool_height: float | None = None,
    longest_time: float | None = None,
    scene: Scene | None = None,
    limits: str = "certified",
) -> tuple[Constraint, ...]:
    """Limits by name, see :func:`trajevo.formulation.catalogue.limits_of`, and what else is limited where it is given.

    Effort and tool speed are proven between the samples, see :mod:`trajevo.formulation.constraints.certified`, unless
    ``limits="sampled"``.
    """
    found = list(limits_of(names, robot))
    if effort_margin != 0.0:
        if "effort" not in names:
            raise InvalidInputError("effort_margin: expected 'effort' among the constraints, which it tightens")
        found[list(names).index("effort")] = effort_limits(robot, margin=effort_margin)
    if overshoot is not None:
        found.append(overshoot_limit(points, _positive("overshoot", overshoot, "rad or m")))
    if tool_speed is not None:
        found.append(tool_speed_limit(robot, _positive("tool_speed", tool_speed, "m/s")))
    if tool_height is not None:
        found.append(keep_out_height(robot, tool_height))
    if longest_time is not None:
        found.append(time_limit(_positive("longest_time", longest_time, "s")))
    if scene is not None:
        found.append(clearance_limit(robot, scene))
    return held(found, limits)


@final
class ViaPointProblem(TrajectoryProblem):
    """Any robot through points: times, and where wanted the points' places, as variables.

    Args:
        robot: name, folder or URDF of a robot, a :class:`~trajevo.robot.robot.Robot`, or the arguments of
            :func:`~trajevo.robot.robot.load_robot` as a mapping.
        points: what is visited, in order: an array (K, n_joints) [rad or m], a list of joint positions and of tool
            poses (:class:`~trajevo.path.inverse_kinematics.Pose` or mappings ``{"position": ..., "rpy": ...}``), or a
            CSV file with a column for each joint, with its unit.
        duration_bounds: least and greatest time between two points [s].
        interpolant: ``"quintic_spline"``, ``"septic_spline"``, ``"cubic"``, ``"polynomial"`` (a single one),
            ``"linear_blends"`` (points inside are passed nearby) or ``"hybrid"`` (Sun 2020).
        moving: points that may move: :class:`~trajevo.path.boxes.JointBox`, :class:`~trajevo.path.boxes.CartesianBox`,
            or mappings of ``point``, its number, and the half widths ``joints`` (n_joints) [rad or m] or ``tool`` (3)
            [m].
        objectives: names, see :func:`~trajevo.formulation.catalogue.objectives_of`.
        constraints: names, see :func:`~trajevo.formulation.catalogue.limits_of`.
        overshoot: how far a joint may leave the range of the points [rad or m]; not limited if None, as what follows.
        effort_margin: share of the effort limits that is kept free.
        tool_speed: greatest speed of the tool [m/s].
        tool_height: least z of the tool in the base frame [m].
        longest_time: greatest duration [s].
        limits: of effort and tool speed: ``"certified"``, proven at every instant, see
            :mod:`trajevo.formulation.constraints.certified`, or ``"sampled"``.
        scene: obstacles and clearances, a :class:`~trajevo.formulation.constraints.scene.Scene` or its settings.
        payload: mass [kg], a :class:`~trajevo.robot.payload.Payload`, or its settings; where ``"unused_payload"`` is an
            objective its mass is a variable, and this gives its shape and model.
        payload_range: least and greatest mass [kg] of a payload that is a variable; if None from 0 to what the robot
            can hold at rest at the first and the last point.
        reference_point: far corner of the hypervolume's box, SI; taken from the first feasible points if None.
        samples: instants per segment at which effort and tool are looked at, both ends included.
        threads: threads that populations are evaluated on; results are the same for any number.

    Raises:
        UnknownNameError: no such robot, interpolant, objective, constraint or limits.
        UnreachableError: a pose that the tool cannot take.
        InvalidInputError: points that the robot cannot reach or the interpolant not use, or bad bounds, boxes, scene.
    """

    registered_name: ClassVar[str] = "via-points"
    title: ClassVar[str] = "Any robot through via points"

    def __init__(
        self,
        *,
        robot: str | Path | Robot | Mapping[str, Any] = "puma560",
        points: Any = None,
        duration_bounds: tuple[float, float] = (0.5, 6.0),
        interpolant: str = "quintic_spline",
        moving: Sequence[Any] = (),
        objectives: Sequence[str] = ("time", "jerk"),
        constraints: Sequence[str] = ("position", "velocity", "acceleration", "jerk"),
        overshoot: float | None = None,
        effort_margin: float = 0.0,
        tool_speed: float | None = None,
        tool_height: float | None = None,
        longest_time: float | None = None,
        limits: str = "certified",
        scene: Scene | Mapping[str, Any] | None = None,
        payload: float | Payload | dict[str, Any] = 0.0,
        payload_range: tuple[float, float] | None = None,
        reference_point: Sequence[float] | None = None,
        samples: int = 6,
        threads: int = 1,
    ) -> None:
        checked_name("interpolant", interpolant, THROUGH_POINTS)
        named = robot_of(robot)
        via = joint_points(points, named)
        bounds = tuple(numbers(duration_bounds, name="duration_bounds", shape=(2,)).tolist())
        dynamics = Dynamics(named, Payload.of(payload, model=None), samples=samples, threads=threads)
        obstacles = scene if scene is None or isinstance(scene, Scene) else Scene.of(scene)
        decoder, boxes = _interpolant(interpolant, via, named, bounds, moving)
        extra: dict[str, Any] = {
            "overshoot": overshoot,
            "effort_margin": effort_margin,
            "tool_speed": tool_speed,
            "tool_height": tool_height,
            "longest_time": longest_time,
            "limits": limits,
        }
        held = constraints_of(constraints, named, via, scene=obstacles, **extra)
        mass = _payload_variable(dynamics, decoder, objectives, constraints, payload_range)
        reach = (decoder.reach_constraint,) if isinstance(decoder, MovingPoints) else ()
        super().__init__(
            dynamics=dynamics if mass is None else mass.dynamics,
            interpolant=decoder,
            objectives=objectives_of(objectives, named, reference="by name", payload=mass),
            constraints=(*held, *reach),
            payload_range=None if mass is None else mass.range,
            reference_point=reference_point,
            length=length_unit(named),
        )
        self._settings = {
            "robot": named.settings,
            "points": via.positions.tolist(),
            "duration_bounds": list(bounds),
            "interpolant": interpolant,
            "moving": boxes,
            "objectives": list(objectives),
            "constraints": list(constraints),
            **extra,
            "scene": None if obstacles is None else obstacles.settings,
            "payload": self.dynamics.payload.settings,
            "payload_range": None if payload_range is None else list(payload_range),
            "reference_point": None if reference_point is None else list(reference_point),
            "samples": dynamics.samples,
            "threads": dynamics.threads,
        }

    @property
    def settings(self) -> dict[str, Any]:
        """Keyword arguments that make an equal problem."""
        return dict(self._settings)


def _payload_variable(
    dynamics: Dynamics,
    interpolant: Interpolant,
    objectives: Sequence[str],
    constraints: Sequence[str],
    payload_range: tuple[float, float] | None,
) -> PayloadVariable | None:
    """The payload's mass as a variable, where it is an objective."""
    if not isinstance(objectives, Sequence) or UNUSED_PAYLOAD not in objectives:  # what is no list is refused elsewhere
        if payload_range is not None:
            raise InvalidInputError(
                f"payload_range: expected {UNUSED_PAYLOAD!r} among the objectives, got {objectives}"
            )
        return None
    if "effort" not in constraints:
        raise InvalidInputError(f"objectives: {UNUSED_PAYLOAD!r} needs 'effort' among the constraints, which bounds it")
    return PayloadVariable.of(dynamics, interpolant, payload_range)


def _interpolant(
    kind: str, via: ViaPoints, robot: Robot, bounds: tuple[float, ...], moving: Sequence[Any]
) -> tuple[Interpolant, list[dict[str, Any]]]:
    """The interpolant, and the boxes as plain data."""
    if not moving:
        return THROUGH_POINTS[kind](via, duration_bounds=bounds), []
    if isinstance(moving, Mapping | str) or not isinstance(moving, Sequence):
        raise InvalidInputError(f"moving: expected a list of boxes, got {moving!r}")
    boxes = tuple(_box(k, given) for k, given in enumerate(moving))
    decoder = MovingPoints(kind, via, boxes, robot=robot, duration_bounds=(bounds[0], bounds[1]))
    return decoder, [_box_settings(box) for box in boxes]


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


def _box_settings(box: JointBox | CartesianBox) -> dict[str, Any]:
    half_width = np.asarray(box.half_width).tolist()
    if isinstance(box, JointBox):
        return {"point": box.point, "joints": half_width}
    return {"point": box.point, "tool": half_width, "keep_orientation": box.keep_orientation}


def _positive(name: str, value: Any, unit: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 < value < float("inf"):
        raise InvalidInputError(f"{name}: expected a positive number [{unit}], got {value!r}")
    return float(value)
