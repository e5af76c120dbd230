"""What a problem's motions carry, segment by segment, and the payload's mass as a decision variable.

The mass comes with an objective: the greatest mass minus it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, numbers
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.payload_masses import mass_bounds, masses_held
from trajevo.errors import InvalidInputError
from trajevo.formulation.constraints.scene import Plane, Scene
from trajevo.formulation.objectives import OBJECTIVES, UNUSED_PAYLOAD, Objective, unused_payload
from trajevo.path.loads import Load, Schedule, is_loads, loads_of, varied_of
from trajevo.path.passing import Passing
from trajevo.robot.payload import Payload
from trajevo.robot.robot import Robot
from trajevo.trajectory.interpolants import Interpolant
from trajevo.trajectory.interpolants.interpolant import ArrangesPoints, breaks_where, example_of

#: Speed and acceleration of a joint, as a share of its greatest, and difference of positions, that count as none.
_REST, _SAME = 1e-7, 1e-7

#: Distance from the tool's origin within which carried solids are believed to be [m].
_FARTHEST = 5.0

#: Arrangements of a cell from which the greatest payload is sought, the factor by which another one may allow more, and
#: the error up to which points are reached there [m and rad].
_ARRANGEMENTS, _MORE, _REACHED = 512, 1.2, 1e-6


def carrying(
    robot: Robot, payload: Any, interpolant: Interpolant, passing: Sequence[Passing] = (), *, cyclic: bool, **more: Any
) -> Dynamics:
    """Dynamics of a robot with what it carries on the motions of an interpolant.

    Args:
        robot: the robot.
        payload: a payload in any form in which a user may give it, or a list of loads, see
            :func:`~trajevo.path.loads.loads_of`.
        interpolant: interpolant of the motions.
        passing: how points are passed.
        cyclic: whether the motions are cycles.
        **more: further arguments of :class:`~trajevo.dynamics.inverse_dynamics.Dynamics`.

    Raises:
        InvalidInputError: no such payload, or a load that is picked up or put down within a segment.
    """
    if not is_loads(payload):
        return Dynamics(robot, Payload.of(payload, model=None), **more)
    payload = payload if isinstance(payload, list | tuple) else [payload]
    count = interpolant.via_times(example_of(interpolant)).shape[1]
    loads = tuple(_with_solid(k, load) for k, load in enumerate(loads_of(payload, count, cyclic=cyclic)))
    varied = varied_of(loads)
    if len(loads) == 1 and not loads[0].switched and loads[0].shape is None:
        return Dynamics(robot, loads[0].payload, **more)
    schedule = Schedule(loads, _on_segments(loads, interpolant, passing), varied)
    own = Payload(0.0) if varied is None else loads[varied].payload
    return Dynamics(robot, own, schedule=schedule, **more)


def _with_solid(place: int, load: Load) -> Load:
    """A load whose shape is a solid, in its centre of mass unless it says where.

    Raises:
        InvalidInputError: no shape of a solid, or one that is too large to be carried.
    """
    if load.shape is None:
        return load
    where, name = f"payload.{place}.shape", f"payload {place}"
    given = load.shape
    if isinstance(given, Mapping):
        given = {"name": name, "position": load.payload.com} | dict(given)
    try:
        solid = Scene.of({"obstacles": [given]}).obstacles[0]
    except InvalidInputError as error:
        said = str(error).removeprefix("scene: ").removeprefix(f"obstacle {name!r}: ").removeprefix("obstacle 1: ")
        raise InvalidInputError(f"{where}: {said}") from error
    if isinstance(solid, Plane):
        raise InvalidInputError(f"{where}: expected a solid that can be carried, got a plane, which has no end")
    if solid.motion is not None:
        raise InvalidInputError(f"{where}.motion: expected none, as a load moves with the tool")
    if solid.touches:
        raise InvalidInputError(f"{where}.touches: expected the names in payload.{place}.touches, beside the shape")
    away = float(np.linalg.norm(solid.position)) + solid.radius_around
    if away > _FARTHEST:
        raise InvalidInputError(
            f"{where}: expected a solid within {_FARTHEST:g} m of the tool's origin, got one that reaches {away:.4g} m "
            "and looks like mm: lengths are in m"
        )
    return replace(load, shape=solid)


def _on_segments(
    loads: Sequence[Load], interpolant: Interpolant, passing: Sequence[Passing]
) -> tuple[tuple[int, ...], ...]:
    """Numbers of the loads that are carried on every segment of an interpolant's motions."""
    breaks, count = breaks_where(interpolant), interpolant(example_of(interpolant)).breaks.shape[1] - 1
    waits = {one.point for one in passing if one.dwell}
    carried: list[list[int]] = [[] for _ in range(count)]
    for k, load in enumerate(loads):
        first, last = 0, count
        for key, point in (("from", load.from_point), ("to", load.to_point)):
            place = 0 if point is None else breaks[point]
            if place is None:
                raise InvalidInputError(
                    f"payload.{k}.{key}: expected a point at which two segments meet, and point {point} is passed "
                    "within one: stop there (passing), or take an interpolant such as quintic_spline"
                )
            if point is not None and key == "from":
                first = place + (point in waits)
            elif point is not None:
                last = place
        on = range(first, last) if first < last else [*range(first, count), *range(last)]
        for segment in on:
            carried[segment].append(k)
    return tuple(map(tuple, carried))


@final
@dataclass(frozen=True)
class PayloadVariable:
    """The payload's mass as the last variable of a problem.

    Attributes:
        dynamics: dynamics of the robot with a payload of the right shape and model; the payload's mass is not used.
        range: least and greatest mass [kg].
        objective: the greatest mass minus the mass [kg]; minimising it maximises the payload.
    """

    dynamics: Dynamics
    range: tuple[float, float]
    objective: Objective

    @classmethod
    def of(cls, dynamics: Dynamics, interpolant: Interpolant, payload_range: Any = None) -> PayloadVariable:
        """The payload variable of a robot that moves with an interpolant.

        Args:
            dynamics: dynamics of the robot; its payload gives shape and model.
            interpolant: interpolant of the motions.
            payload_range: least and greatest mass [kg]; if None, from 0 to the greatest mass that the robot can hold at
                rest at the first and the last point, or where every motion rests with the load if it is picked up or
                put down on the way. No motion that rests there can carry more.

        Raises:
            InvalidInputError: a range that is not 0 <= least < greatest, or no range although nothing limits the mass
                at rest.
        """
        if dynamics.schedule is not None:
            dynamics.schedule.check_varied("the mass as a variable")
        shape = dynamics.payload
        unit = shape if shape.mass > 0.0 else shape.with_mass(1.0)
        carrying = replace(dynamics, payload=unit)
        if payload_range is None:
            payload_range = (0.0, _bounded_at_rest(carrying, interpolant))
        low, high = numbers(payload_range, name="payload_range", shape=(2,)).tolist()
        if not 0.0 <= low < high:
            raise InvalidInputError(f"payload_range: expected 0 <= least < greatest [kg], got {low} and {high}")
        objective = replace(
            OBJECTIVES[UNUSED_PAYLOAD], reference=f"{high:g} kg minus mass", function=unused_payload(high)
        )
        return cls(carrying, (low, high), objective)


def _bounded_at_rest(dynamics: Dynamics, interpolant: Interpolant) -> float:
    """The greatest payload [kg] held at rest at both ends; an error if there is none or it is unbounded."""
    greatest, name = greatest_at_rest(dynamics, interpolant), dynamics.robot.name
    if np.isinf(greatest):
        why = f"no effort limit bounds what {name!r} can hold" if greatest > 0.0 else f"{name!r} cannot hold itself"
        where = "at both ends" if dynamics.schedule is None else "where it rests with the load"
        raise InvalidInputError(f"payload_range: expected least and greatest mass [kg], since {why} {where}")
    return greatest


def greatest_at_rest(dynamics: Dynamics, interpolant: Interpolant) -> float:
    """The greatest payload [kg] that effort limits allow at rest at the first and the last point of the motions.

    Where loads change, it is that which they allow wherever all motions rest, before and after a change.
    """
    if dynamics.schedule is not None:
        q, segments = _at_rest(interpolant)
        return masses_held(dynamics, q, segments)[1] if len(q) else np.inf
    if isinstance(interpolant, ArrangesPoints):
        return _greatest_anywhere(dynamics, interpolant)
    middle = [0.5 * (variable.lower + variable.upper) for variable in interpolant.variables]
    trajectory = interpolant(np.array([middle]))
    return masses_held(dynamics, trajectory.evaluate(np.array([0.0, trajectory.duration[0]]))[0])[1]


def _greatest_anywhere(dynamics: Dynamics, interpolant: Any) -> float:
    """The greatest payload [kg] held at rest at both ends from any of many arrangements, and some more."""
    low, high = (np.array([getattr(one, end) for one in interpolant.variables]) for end in ("lower", "upper"))
    drawn = np.random.default_rng(0).uniform(low, high, (_ARRANGEMENTS, len(low)))
    arranged = interpolant.motions(drawn)[1]
    reached = (arranged.missed <= _REACHED).all(axis=(1, 2))
    q = arranged.points[reached][:, [0, -1]]
    if not len(q):
        return np.inf
    still, gravity = np.zeros_like(q), arranged.gravity(np.array(dynamics.robot.model.gravity.linear))
    dynamics = dynamics.under(None if gravity is None else gravity[reached])
    unloaded, each = dynamics.unloaded_effort(q, still, still), dynamics.effort_per_kilogram(q, still, still)
    upper = mass_bounds(unloaded, each, dynamics.robot.limits.sides("effort"))[1].min(axis=(1, 2))
    greatest = float(upper.max())
    return _MORE * greatest if greatest > 0.0 else greatest


def _at_rest(interpolant: Interpolant) -> tuple[Array, Array]:
    """Positions at ends of segments at which all motions rest, (N, n_joints) [rad or m], and these segments, (N,)."""
    low, high = (np.array([getattr(one, end) for one in interpolant.variables]) for end in ("lower", "upper"))
    motions = interpolant(np.array([low + share * (high - low) for share in (0.3, 0.6)]))
    q, v, a = (motions.at_shares(np.array([0.0, 1.0]), order) for order in range(3))
    still = np.abs(q[1] - q[0]).max(axis=1) <= _SAME
    for values in (v, a):
        still &= np.abs(values).max(axis=(0, 2)) <= _REST * np.abs(values).max()
    segments = np.arange(q.shape[1] // 2).repeat(2)
    return q[0][still], segments[still]
