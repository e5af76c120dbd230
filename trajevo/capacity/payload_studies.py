"""Payload studies for reports, by name, each computed from a front alone."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, final

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.base.shown.brief import brief
from trajevo.capacity.capacity import Capacities, Capacity
from trajevo.capacity.dlcc import capacities, dlcc, effort_along
from trajevo.capacity.payload_effort import PayloadEffort, payload_effort
from trajevo.capacity.sensitivity import Sensitivity, sensitivity
from trajevo.errors import InvalidInputError
from trajevo.front.front import Front, Solution
from trajevo.path.inverse_kinematics import Pose

# Studies are imported when they are made: a first report, for which someone waits, has two of them.
if TYPE_CHECKING:
    from trajevo.capacity.payload_diagram import AllowedRegions, PayloadDiagram
    from trajevo.capacity.payload_time import PayloadCurve
    from trajevo.capacity.robust import RobustCurve
    from trajevo.capacity.slowdown import SlowdownCurve
    from trajevo.capacity.uncertainty import UncertaintyPrice
    from trajevo.capacity.workspace import WorkspaceCapacity

#: Instants per segment, enough for pictures.
_SAMPLES = 12

#: Greatest offset of loads from the tool's axes [m], and cells of the diagram along either side.
_REACH, _CELLS = 0.3, 41

#: Shares of the largest payload for which the allowed centres of mass are computed.
_SHARES = (0.4, 0.6, 0.8, 0.95)

#: Greatest tolerance of a centre of mass to either side [m], and number of boxes whose price in time is computed.
_TOLERANCE, _BOXES = 0.1, 6

#: Greatest product of the numbers of variables and of the limits' terms for which optimising again takes only seconds.
_QUICK = 20_000

#: Cells of the workspace map along either side, and distance from its middle to its sides [m].
_MAP_CELLS, _MAP_REACH = 15, 0.5

#: Instants at which the tool's path on the map is drawn.
_PATH = 101


@final
@dataclass(frozen=True, eq=False)
class Carried:
    """The payload that one solution of a front can carry.

    Attributes:
        rule: name of the rule that chose the solution.
        capacity: its largest payload.
        sensitivity: derivatives of the capacity; None if no joint limits it.
    """

    rule: str
    capacity: Capacity
    sensitivity: Sensitivity | None


@final
@dataclass(frozen=True, eq=False)
class LeastTimes:
    """The least time for each payload, with the motion optimised again for it.

    Attributes:
        curve: payloads and times.
        at_rest: greatest payload that the robot can hold at rest at the first and the last point [kg].
    """

    curve: PayloadCurve
    at_rest: float

    __repr__ = brief


@final
@dataclass(frozen=True, eq=False)
class AroundMotion:
    """Payloads that can be held at rest around the middle of a motion.

    Attributes:
        found: capacities on a vertical plane, with the tool's orientation at the middle of the motion.
        path: path of the tool in the plane's coordinates, shape (T, 2) [m].
    """

    found: WorkspaceCapacity
    path: Array

    __repr__ = brief


@final
class Studied:
    """A front under study, with values that several studies need computed once.

    Args:
        front: a front that is not empty; payload studies need a robot with effort limits.
    """

    def __init__(self, front: Front) -> None:
        self.front = front

    @cached_property
    def carried(self) -> tuple[Carried, ...]:
        """The payloads that the solutions worth comparing can carry; the first is the knee."""
        found = []
        for solution in self.choices:
            capacity = dlcc(solution)
            bounded = bool(capacity.joint) and capacity.feasible
            found.append(Carried(solution.rule, capacity, sensitivity(solution) if bounded else None))
        return tuple(found)

    @cached_property
    def choices(self) -> tuple[Solution, ...]:
        """The solutions worth comparing, the knee first."""
        return self.front.choices()

    @property
    def knee(self) -> Solution:
        """The knee."""
        return self.choices[0]

    @property
    def carries(self) -> bool:
        """Whether the knee can carry some payload, but not every one."""
        capacity = self.carried[0].capacity
        return bool(capacity.joint) and capacity.feasible and capacity.mass > 0.0

    @property
    def off_centre(self) -> bool:
        """Whether the position of the payload's centre of mass matters."""
        return self.carries and self.front.problem.dynamics.payload.model != "tool_axis"

    @cached_property
    def effort(self) -> PayloadEffort:
        """Effort along the knee's motion for every payload."""
        return payload_effort(self.knee, samples=_SAMPLES)


def _capacities(of: Studied) -> Capacities | None:
    return capacities(of.front.rollouts_of(of.front.thinned())) if of.carries else None


def _slowdown(of: Studied) -> SlowdownCurve | None:
    from trajevo.capacity.scaled_path import ScaledPath
    from trajevo.capacity.slowdown import slowdown_curve

    if not (of.carries and 0.0 < ScaledPath(of.knee, _SAMPLES).static_bound < np.inf):
        return None
    return slowdown_curve(of.knee, samples=_SAMPLES)


def _payload_time(of: Studied) -> LeastTimes | None:
    from trajevo.capacity.payload_time import capacity_front, largest_payload, payloads_up_to

    problem = of.front.problem
    if not of.carries or problem.payload_range is not None or "time" not in problem.objective_names:
        return None
    if problem.n_var * problem.in_terms().n_ieq_constr > _QUICK:
        return None
    with suppress(InvalidInputError):  # no motion is found that carries anything
        largest = largest_payload(problem, seed=1, starts=1)
        masses, _ = payloads_up_to(problem, largest.mass)
        return LeastTimes(capacity_front(problem, masses, seed=1, starts=1), largest.at_rest)
    return None


def _payload_diagram(of: Studied) -> Mapping[str, PayloadDiagram] | None:
    from trajevo.capacity.payload_diagram import payload_diagram

    if not of.off_centre:
        return None
    efforts = {"knee": of.effort}
    if "time" in of.front.problem.objective_names:
        fastest = next(choice for choice in of.choices if choice.rule == "least_time")
        if fastest.index != of.knee.index:
            efforts["least time"] = payload_effort(fastest, samples=_SAMPLES)
    xy, z = np.linspace(0.0, _REACH, _CELLS), np.linspace(-_REACH, _REACH, 2 * _CELLS - 1)
    return {name: payload_diagram(effort, xy, z) for name, effort in efforts.items()}


def _allowed_centres(of: Studied) -> AllowedRegions | None:
    from trajevo.capacity.payload_diagram import allowed_regions

    if not of.off_centre:
        return None
    largest = of.carried[0].capacity.mass
    masses = [float(f"{share * largest:.3g}") for share in _SHARES]
    return allowed_regions(of.effort, masses, within=_REACH, axis="y")


def _robust_payload(of: Studied) -> RobustCurve | None:
    from trajevo.capacity.robust import robust_curve

    if not of.off_centre:
        return None
    return robust_curve(of.effort, com=of.front.problem.dynamics.payload.com, within=_TOLERANCE)


def _uncertainty(of: Studied) -> UncertaintyPrice | None:
    from trajevo.capacity.uncertainty import price_along_path

    problem = of.front.problem
    if not of.off_centre or problem.payload_range is not None or not problem.dynamics.payload.mass > 0.0:
        return None
    with suppress(InvalidInputError):  # no speed along this path carries the payload as it is
        return price_along_path(of.knee, np.linspace(0.0, _TOLERANCE, _BOXES).tolist(), samples=_SAMPLES)
    return None


def _workspace(of: Studied) -> AroundMotion | None:
    """On the vertical plane along which the tool moves most."""
    from trajevo.capacity.workspace import ToolPlane, workspace_capacity

    if not of.carries:
        return None
    rollout = of.knee.rollout
    motion = rollout.trajectory.sample(_PATH)
    q, segments, schedule = motion.q[0], rollout.segments_at(motion.t)[0], rollout.dynamics.schedule
    loaded = (
        np.arange(_PATH)
        if schedule is None
        else np.flatnonzero([schedule.varied in schedule.carried[k] for k in segments])
    )
    robot, middle = rollout.robot, int(loaded[len(loaded) // 2])
    if schedule is not None:  # with the other loads that are carried there
        robot = rollout.dynamics.of_phase(schedule.carried[segments[middle]]).robot
    positions, rotations = robot.tool_poses(q)
    plane = "xz" if np.ptp(positions[:, 0]) >= np.ptp(positions[:, 1]) else "yz"
    pose = Pose(positions[middle], rotations[middle])
    square = ToolPlane.around(pose, plane, reach=_MAP_REACH, cells=_MAP_CELLS)
    margin = rollout.effort_margin
    found = workspace_capacity(robot, square, payload=rollout.dynamics.payload, start=q[middle], effort_margin=margin)
    return AroundMotion(found, frozen(positions[:, ["xyz".index(axis) for axis in plane]]))


#: Studies by name. A study returns None if it has nothing to show: if no payload reaches a limit or, for studies of the
#: centre of mass, if the payload acts at the tool's origin.
PAYLOAD_STUDIES: dict[str, Callable[[Studied], Any]] = {
    "carried": lambda of: of.carried,
    "effort": lambda of: effort_along(of.knee),
    "capacities": _capacities,
    "slowdown": _slowdown,
    "payload_time": _payload_time,
    "payload_diagram": _payload_diagram,
    "allowed_centres": _allowed_centres,
    "robust_payload": _robust_payload,
    "uncertainty": _uncertainty,
    "workspace": _workspace,
}
