"""Programs of points for controllers that plan between points by themselves: ABB RAPID, KUKA KRL, Fanuc LS.

Such a program says through which points the robot moves, where it rests, how long it waits, and what it carries. It
cannot say how the joints move between the points: the controller rounds corners and shapes speeds as it does for any
program. What each language can carry is in the comments of its files. Only URScript's ``servoj`` and trajectories of
ROS 2 repeat a motion as it was planned and proven.
"""

from __future__ import annotations

import itertools
import math
import re
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError, one_line
from trajevo.exporters.events import Carrying, Stretch, carried, stretches
from trajevo.exporters.exporter import Exporter
from trajevo.front.front import Solution
from trajevo.robot.payload import Payload
from trajevo.robot.robot import Robot
from trajevo.robot.transmission import Direct
from trajevo.verification.certify import certify

#: Greatest number of axes of a robot that these languages name without external axes.
_MOST_AXES = 6

#: Decimal places of angles [deg], lengths [mm] and times [s].
_DIGITS, _TIME_DIGITS = 5, 4

#: Greatest number of points of a program; controllers refuse much longer ones.
_MOST_POINTS = 9_000

_MM = 1e3

#: Least mass and distance of the centre of mass that RAPID takes for a load [kg], [mm].
_LEAST_MASS, _LEAST_ARM = 0.001, 0.001

#: RAPID's value of an axis that does not exist.
_NO_AXIS = "9E+09"

#: Least and greatest override of a move, in percent.
_PERCENT = (1, 100)

#: Greatest number of characters of a name, and of a comment, in a program of Fanuc.
_NAME, _COMMENT = 8, 32


@final
@dataclass(frozen=True)
class _Move:
    """A move to the next point.

    Attributes:
        position: the point in deg and mm, shape (n_joints,).
        time: time of the move [s].
        rests: whether the robot rests at the point.
        percent: mean speed as a share of the fastest axis's greatest speed, in whole percent.
    """

    position: Array
    time: float
    rests: bool
    percent: int


@final
@dataclass(frozen=True)
class _Language:
    """How a language says what happens, each as lines of a program.

    Attributes:
        remark: a comment.
        load: what is carried from now on.
        wait: a time in which nothing moves [s].
        move: a move.
    """

    remark: Callable[[str], list[str]]
    load: Callable[[Carrying], list[str]]
    wait: Callable[[float], list[str]]
    move: Callable[[_Move], list[str]]

    def lines(self, solution: Solution, step: float) -> list[str]:
        """The motion from its start on, line by line."""
        rows: list[str] = []
        for stretch in _stretches(solution, step):
            if stretch.gripper:
                rows += self.remark(f"gripper: {stretch.gripper}")
            if stretch.before is not None:
                rows += self.load(stretch.before)
            if stretch.dwells:
                rows += self.wait(float(stretch.t[-1] - stretch.t[0]))
                continue
            for move in _moves(solution, stretch):
                rows += self.move(move)
        last = carried(solution.rollout)[-1]
        if last.placed and last.t >= float(solution.trajectory.duration[0]):
            rows += [*self.remark(f"gripper: {last.changes}"), *self.load(last)]
        return rows


def rapid(solution: Solution, step: float) -> str:
    """A RAPID module: ``MoveAbsJ`` through points with the time of each, ``GripLoad`` where the load changes.

    Args:
        solution: a solution for a robot of at most six joints.
        step: greatest time between points [s].

    Raises:
        InvalidInputError: another robot, or too many points.
    """
    _check(solution, "rapid")
    loads: list[Payload] = []

    def move(given: _Move) -> list[str]:
        zone = "fine" if given.rests else "z1"
        return [f"MoveAbsJ {_jointtarget(given.position)}, v1000\\T:={_time(given.time)}, {zone}, tool0;"]

    language = _Language(
        remark=lambda text: [f"! {text}"],
        load=lambda change: [f"! {_told(change)}", f"GripLoad {_named(loads, change.payload)};"],
        wait=lambda time: [f"WaitTime {_time(time)};"],
        move=move,
    )
    rows = [f"MoveAbsJ {_jointtarget(_start(solution))}, v200, fine, tool0;", *language.lines(solution, step)]
    return "\n".join(
        [
            "MODULE Trajevo",
            *(f"  ! {line}" for line in _head(solution, _RAPID_CARRIES)),
            *(f"  PERS loaddata load{k} := {_loaddata(payload)};" for k, payload in enumerate(loads, start=1)),
            "  PROC trajevo_motion()",
            *(f"    {row}" for row in rows),
            "  ENDPROC",
            "ENDMODULE",
            "",
        ]
    )


def krl(solution: Solution, step: float) -> str:
    """A KRL module: ``PTP`` through points, the speed of each as a share of the axes', ``$LOAD`` where it changes.

    Args:
        solution: a solution for a robot of at most six joints with limits of speed.
        step: greatest time between points [s].

    Raises:
        InvalidInputError: another robot, or too many points.
    """
    _check(solution, "krl", speeds=True)
    language = _Language(
        remark=lambda text: [f"; {text}"],
        load=lambda change: [f"; {_told(change)}", *_load_of_kuka(change.payload)],
        wait=lambda time: [f"WAIT SEC {_time(time)}"],
        move=lambda given: [
            f"BAS(#VEL_PTP, {given.percent})",
            f"PTP {_axes(given.position)}{'' if given.rests else ' C_PTP'}",
        ],
    )
    return "\n".join(
        [
            *(f"; {line}" for line in _head(solution, _KRL_CARRIES)),
            "DEF trajevo_motion()",
            "BAS(#INITMOV, 0)",
            "BAS(#VEL_PTP, 20)",
            f"PTP {_axes(_start(solution))}",
            *language.lines(solution, step),
            "END",
            "",
        ]
    )


def fanuc(solution: Solution, step: float) -> str:
    """A TP program in ASCII (LS): joint moves through points with the time of each, ``PAYLOAD`` where it changes.

    Args:
        solution: a solution for a robot of at most six joints.
        step: greatest time between points [s].

    Raises:
        InvalidInputError: another robot, or too many points.
    """
    _check(solution, "fanuc")
    positions, payloads = [_start(solution)], itertools.count(1)

    def load(change: Carrying) -> list[str]:
        number, com = next(payloads), " ".join(f"{_MM * value:.0f}" for value in change.payload.com)
        return [*remark(f"{number}: {change.payload.mass:g} kg at {com} mm"), f"PAYLOAD[{number}]"]

    def move(given: _Move) -> list[str]:
        positions.append(given.position)
        time = max(round(1e3 * given.time), 1)
        return [f"J P[{len(positions)}] {time}msec {'FINE' if given.rests else 'CNT100'}"]

    def remark(text: str) -> list[str]:
        return [f"!{text[:_COMMENT]}"]

    language = _Language(remark=remark, load=load, wait=lambda time: [f"WAIT {time:.2f}(sec)"], move=move)
    rows = [*(line for text in _FANUC_CARRIES for line in remark(text)), "J P[1] 10% FINE"]
    rows += language.lines(solution, step)
    name = re.sub(r"[^A-Z0-9_]", "", f"T{solution.front.record.title.upper()}")[:_NAME]
    return "\n".join(
        [
            f"/PROG  {name}",
            "/ATTR",
            f'COMMENT     = "trajevo row {solution.index}";',
            "DEFAULT_GROUP   = 1,*,*,*,*;",
            "/MN",
            *(f"{k:4d}:  {row} ;" for k, row in enumerate(rows, start=1)),
            "/POS",
            *(line for k, position in enumerate(positions, start=1) for line in _position(solution, k, position)),
            "/END",
            "",
        ]
    )


#: What each language can carry, for the comments of its files.
_RAPID_CARRIES = (
    "the times of moves are kept as long as the robot can; what is between points is the controller's own",
    "tool0 is used; give the load of the tool by its tooldata, and what it carries by these loaddata",
)
_KRL_CARRIES = (
    "name the file trajevo_motion.src, as its module is called",
    "KRL has no times of moves: speeds are mean speeds as shares of the axes' greatest ones, so that the cycle takes "
    "longer by what accelerating and rounding take",
)
_FANUC_CARRIES = (
    "times of moves are wishes",
    "between points: controller's own",
    "J3 as in the URDF, no J2 added",
    "PAYLOAD numbers: set up first",
)


def _check(solution: Solution, format: str, *, speeds: bool = False) -> None:
    robot = solution.front.problem.robot
    if robot.dof > _MOST_AXES or not isinstance(robot.transmission, Direct):
        raise InvalidInputError(
            f"{format}: expected a robot of at most {_MOST_AXES} joints that its actuators drive directly, got "
            f"{robot.name!r} with {robot.dof}"
        )
    endless = [
        name for name, speed in zip(robot.joint_names, _greatest_speeds(robot), strict=True) if not math.isfinite(speed)
    ]
    if speeds and endless:
        raise InvalidInputError(
            f"{format}: speeds are shares of the axes' greatest ones, and joint {endless[0]!r} of {robot.name!r} has "
            "no limit of velocity"
        )


def _stretches(solution: Solution, step: float) -> tuple[Stretch, ...]:
    found = stretches(solution.rollout, step)
    count = sum(len(one.t) - 1 for one in found)
    if count > _MOST_POINTS:
        raise InvalidInputError(
            f"step: {step:g} s gives {count} points, and controllers take at most about {_MOST_POINTS}: take at least "
            f"{step * count / _MOST_POINTS:.3g} s"
        )
    return found


def _moves(solution: Solution, stretch: Stretch) -> Iterator[_Move]:
    """Moves to every point of a stretch but its first."""
    times = np.diff(stretch.t)
    speeds = np.abs(np.diff(stretch.q, axis=0)) / times[:, None]
    shares = (speeds / _greatest_speeds(solution.front.problem.robot)).max(axis=1)
    percents = np.clip(np.ceil(100.0 * shares), *_PERCENT).astype(int).tolist()
    rests = np.append(np.zeros(len(times) - 1, dtype=bool), stretch.rests).tolist()
    for given in zip(_shown(solution, stretch.q)[1:], times.tolist(), rests, percents, strict=True):
        yield _Move(*given)


def _start(solution: Solution) -> Array:
    """The first point in deg and mm, shape (n_joints,)."""
    first: Array = _shown(solution, solution.trajectory.evaluate(np.zeros(1))[0])[0]
    return first


def _greatest_speeds(robot: Robot) -> Array:
    """Greatest speeds of the axes, of both directions the greater, as controllers have one [rad/s or m/s]."""
    return robot.limits.sides("velocity").greater


def _shown(solution: Solution, q: Array) -> Array:
    """Positions of shape (K, n_joints) in deg and mm."""
    turns = np.array([unit == "rad" for unit in solution.front.problem.robot.joint_units])
    return np.round(q * np.where(turns, 180.0 / math.pi, _MM), _DIGITS) + 0.0


def _jointtarget(position: Array) -> str:
    """A jointtarget of RAPID: axes of the robot, 0 for those that it does not have, and no external axes."""
    axes = [*map(_number, position.tolist()), *["0"] * (_MOST_AXES - len(position))]
    return f"[[{', '.join(axes)}], [{', '.join([_NO_AXIS] * _MOST_AXES)}]]"


def _axes(position: Array) -> str:
    return "{" + ", ".join(f"A{k} {_number(value)}" for k, value in enumerate(position.tolist(), start=1)) + "}"


def _position(solution: Solution, number: int, position: Array) -> list[str]:
    units = ["deg" if unit == "rad" else "mm" for unit in solution.front.problem.robot.joint_units]
    axes = [f"J{k}= {value:.{_DIGITS}f} {unit}" for k, (value, unit) in enumerate(zip(position, units, strict=True), 1)]
    return [f"P[{number}]{{", "   GP1:", "  UF : 0, UT : 1,", f"  {', '.join(axes)}", "};"]


def _told(change: Carrying) -> str:
    """What is carried, in words."""
    return f"from {change.t:.{_TIME_DIGITS}f} s on {change.payload.mass:g} kg are carried"


def _named(loads: list[Payload], payload: Payload) -> str:
    """Name of a payload's loaddata; it is added to the list unless it is nothing."""
    if payload.mass < _LEAST_MASS:
        return "load0"
    loads.append(payload)
    return f"load{len(loads)}"


def _loaddata(payload: Payload) -> str:
    """RAPID's loaddata: mass [kg], centre [mm], axes of the moments of inertia as a quaternion, these [kg·m²]."""
    com = [_MM * value for value in payload.com]
    if math.hypot(*com) < _LEAST_ARM:
        com[2] = _LEAST_ARM
    axes, moments = _principal(payload)
    x, y, z, w = _rotation(axes).as_quat().tolist()
    return (
        f"[{_number(payload.mass)}, [{', '.join(map(_number, com))}], [{', '.join(map(_number, (w, x, y, z)))}], "
        f"{', '.join(map(_number, moments))}]"
    )


def _load_of_kuka(payload: Payload) -> list[str]:
    """Assignments of ``$LOAD``: mass [kg], centre [mm] and axes [deg], moments of inertia [kg·m²]."""
    axes, moments = _principal(payload)
    a, b, c = _turns(axes)
    x, y, z = (_number(_MM * value) for value in payload.com)
    return [
        f"$LOAD.M = {_number(payload.mass)}",
        f"$LOAD.CM = {{X {x}, Y {y}, Z {z}, A {_number(a)}, B {_number(b)}, C {_number(c)}}}",
        f"$LOAD.J = {{X {_number(moments[0])}, Y {_number(moments[1])}, Z {_number(moments[2])}}}",
    ]


def _rotation(matrix: Array) -> Any:
    """A rotation of SciPy from its matrix (3, 3)."""
    from scipy.spatial.transform import Rotation  # takes as long to import as all else here together

    return Rotation.from_matrix(matrix)


def _turns(axes: Array) -> list[float]:
    """Turns about z, the new y and the new x that give a rotation (3, 3) [deg]."""
    with warnings.catch_warnings():  # at b = 90 deg only the sum of the others is defined, and one of them is 0
        warnings.simplefilter("ignore", UserWarning)
        found: list[float] = _rotation(axes).as_euler("ZYX", degrees=True).tolist()
    return found


def _principal(payload: Payload) -> tuple[Array, list[float]]:
    """Axes of the moments of inertia, as columns of a rotation (3, 3), and these [kg·m²]."""
    if payload.inertia is None:
        return np.eye(3), [0.0, 0.0, 0.0]
    tensor = np.array(payload.inertia)
    if not np.any(tensor - np.diag(np.diag(tensor))):
        return np.eye(3), np.diag(tensor).tolist()
    moments, axes = np.linalg.eigh(tensor)
    if np.linalg.det(axes) < 0.0:
        axes[:, 0] = -axes[:, 0]
    return axes, moments.tolist()


def _number(value: float) -> str:
    return np.format_float_positional(round(value, 9) + 0.0, trim="-")


def _time(value: float) -> str:
    return f"{value:.{_TIME_DIGITS}f}"


def _head(solution: Solution, carries: tuple[str, ...]) -> list[str]:
    """Lines that say what the program is and what it can carry."""
    return [
        f"trajevo: {one_line(solution.front.record.title)}",
        f"{solution.rule}, row {solution.index} of the front, {solution.front.problem.robot.name!r}, "
        f"{float(solution.trajectory.duration[0]):.6f} s, seed {solution.front.run.seed}; deg and mm",
        *carries,
        f"centres of mass are in the frame {solution.front.problem.robot.tool!r}, the tool of the planned motion",
        f"certificate, of the planned motion alone: {one_line(str(certify(solution)))}",
    ]


def _made(function: Callable[[Solution, float], str]) -> Callable[[Any, float, str], str]:
    return lambda solution, step, angle: function(solution, step)


_SIX = "at most six joints"

RAPID = Exporter(
    "rapid",
    "mod",
    "points with their times as a module in RAPID of ABB; the path between them is the controller's",
    _made(rapid),
    needs=_SIX,
    step=0.1,
    si=True,
    beginning=b"MODULE Trajevo",
)

KRL = Exporter(
    "krl",
    "src",
    "points as a module in KRL of KUKA; path and times between them are the controller's",
    _made(krl),
    needs=f"{_SIX} with limits of velocity",
    step=0.1,
    si=True,
    beginning=b"; trajevo: ",
)

FANUC = Exporter(
    "fanuc",
    "ls",
    "points with their times as a program in LS of Fanuc; the path between them is the controller's",
    _made(fanuc),
    needs=_SIX,
    step=0.1,
    si=True,
    beginning=b"/PROG  T",
)
