"""Formats for robots and their simulators: ROS 2 trajectories, MoveIt limits, MuJoCo replays and URScript programs.

All are in SI units. Comments in each file explain its rows.
"""

from __future__ import annotations

import csv
import io
import json
import math
from dataclasses import dataclass

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError, one_line
from trajevo.exporters.events import Carrying, carried
from trajevo.exporters.exporter import Exporter, cell, certificate_of, comments
from trajevo.front.front import Solution
from trajevo.robot.moveit_limits import write_joint_limits
from trajevo.robot.robot import Robot
from trajevo.robot.transmission import Direct

#: Least and greatest cycle of ``servoj`` [s]: an e-Series runs at 500 Hz; below 10 Hz the motion is not smooth.
SERVOJ_STEPS = (0.002, 0.1)

#: The controller's own defaults of ``servoj``: lookahead time [s] and gain.
_LOOKAHEAD, _GAIN = 0.1, 300

#: The controller's own defaults of ``movej`` [rad/s²], [rad/s]; lower for robots with lower limits.
_MOVEJ_ACCELERATION, _MOVEJ_SPEED = 1.4, 1.05

#: Decimal places of URScript's angles [rad].
_DIGITS = 12

#: Frame of the flange in models of Universal Robots.
_FLANGE = "tool0"

_NANOSECONDS = 1_000_000_000


@dataclass(frozen=True, eq=False)
class States:
    """States of a motion at some instants.

    Attributes:
        t: instants, shape (T,) [s].
        q: joint positions, shape (T, n_joints) [rad or m].
        v: velocities, shape (T, n_joints) [rad/s or m/s].
        a: accelerations, shape (T, n_joints) [rad/s² or m/s²].
        effort: efforts of the actuators, payload included [N·m or N]; None if the robot has no masses.
    """

    t: Array
    q: Array
    v: Array
    a: Array
    effort: Array | None


def states(rollout: Rollout, t: Array) -> States:
    """States of a single motion at instants, shape (T,) [s]; past its end the robot holds its last position.

    Raises:
        InvalidInputError: an instant before 0.
    """
    duration = float(rollout.trajectory.duration[0])
    moving = (t <= duration * (1.0 + 1e-9))[:, None]  # k step may round to just past it
    q, v, a = (rollout.trajectory.evaluate(np.minimum(t, duration), order)[0] for order in range(3))
    v, a = np.where(moving, v, 0.0), np.where(moving, a, 0.0)
    effort = (
        rollout.effort_in(q[None], v[None], a[None], np.minimum(t, duration))[0] if rollout.robot.gives_effort else None
    )
    return States(frozen(t), q, frozen(v), frozen(a), effort)


def joint_trajectory(solution: Solution, step: float) -> str:
    """A ROS 2 ``trajectory_msgs/JointTrajectory`` as YAML, with points equally spaced in time to the nanosecond.

    Args:
        solution: the solution to write, with the planned joints.
        step: least time between points [s], rounded to the nanosecond; the last point is the end of the motion.
    """
    rollout = solution.rollout
    duration = float(rollout.trajectory.duration[0])
    total, least = round(duration * _NANOSECONDS), max(round(step * _NANOSECONDS), 1)
    count = max(total // least, 1)
    stamps = [k * total // count for k in range(count + 1)]
    t = np.minimum(np.array(stamps) / _NANOSECONDS, duration)
    t[-1] = duration  # exactly, not rounded to the nanosecond
    found = states(rollout, t)
    lines = [
        f"# points: {count + 1}, equally far apart and never nearer than {step:g} s; SI",
        "# effort: of the actuators, to be fed forward; a controller that takes no effort refuses points that have"
        " it: delete the lines that begin with it",
        *_events(rollout),
        "header: {stamp: {sec: 0, nanosec: 0}, frame_id: ''}",
        f"joint_names: {json.dumps(rollout.robot.joint_names)}",
        "points:",
    ]
    efforts = np.empty((len(t), 0)) if found.effort is None else found.effort
    for stamp, *values in zip(
        stamps, found.q.tolist(), found.v.tolist(), found.a.tolist(), efforts.tolist(), strict=True
    ):
        for mark, key, row in zip("-   ", ("positions", "velocities", "accelerations", "effort"), values, strict=True):
            lines.append(f"{mark} {key}: {_yaml_floats(row)}")
        seconds, nanoseconds = divmod(stamp, _NANOSECONDS)
        lines.append(f"  time_from_start: {{sec: {seconds}, nanosec: {nanoseconds}}}")
    return "\n".join([*lines, ""])


def replay_table(solution: Solution, step: float) -> str:
    """A table at a fixed rate for a replay in MuJoCo: time, then qpos, qvel, qacc and actuator forces.

    Comments say gravity [m/s²], the tool frame, and the payload in it that a body of the simulation has to have, with
    the instants at which it changes.

    qpos, qvel and qacc are those of the model's joints, which are the joints of the URDF that are not locked; forces
    are those of the actuators. With a transmission between joints and actuators, the actuators have their own names.

    Args:
        solution: the solution to write.
        step: time between rows [s]; row k is at k step. Rows past the end of the motion hold its last position at rest.
    """
    rollout = solution.rollout
    robot = rollout.robot
    t = _fixed_rate(float(rollout.trajectory.duration[0]), step)
    found = states(rollout, t)
    model = robot.transmission.motion(found.q, found.v, found.a)
    names = list(robot.model.names)[1:]
    headers = ["time", *(f"{name}_{kind}" for kind in ("qpos", "qvel", "qacc") for name in names)]
    columns = [t[:, None], *model]
    if found.effort is not None:
        headers += [f"{name}_force" for name in robot.joint_names]
        columns.append(found.effort)
    stream = io.StringIO()
    stream.write(
        f"# rows: one every {step!r} s; a row past the end of the motion holds its last position at rest; SI\n"
        f"# locked: {json.dumps(dict(robot.locked))}\n"
        f"# gravity: {json.dumps(robot.model.gravity.linear.tolist())}\n"
        f"# tool: {json.dumps(robot.tool)}\n"
    )
    stream.writelines(f"{line}\n" for line in _events(rollout))
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(map(cell, headers))
    writer.writerows([[repr(value) for value in row] for row in np.concatenate(columns, axis=1).tolist()])
    return stream.getvalue()


def urscript(solution: Solution, step: float) -> str:
    """A program for a controller of Universal Robots: ``movej`` to the start, then ``servoj`` at a fixed rate.

    ``servoj`` smooths over its lookahead time, so the last position is commanded for this time before the stop.
    ``set_payload`` tells the controller what is carried, in the frame of the flange ``tool0``, at the first cycle after
    every change; a comment there says what the gripper has to do.

    Args:
        solution: a solution for a robot with six revolute joints.
        step: cycle of ``servoj`` [s], from 0.002 to 0.1.

    Raises:
        InvalidInputError: another robot, or another step.
    """
    from scipy.spatial.transform import Rotation  # takes as long to import as all else here together

    robot, trajectory = solution.front.problem.robot, solution.trajectory
    if robot.joint_units != ("rad",) * 6 or not isinstance(robot.transmission, Direct):
        raise InvalidInputError(
            f"urscript: expected a robot with six joints that turn, got {robot.name!r} with joints in "
            f"{', '.join(robot.joint_units)}"
        )
    least, most = SERVOJ_STEPS
    if not least <= step <= most:
        raise InvalidInputError(f"step: expected {least:g} to {most:g} s, which servoj can run, got {step:g} s")
    duration = float(trajectory.duration[0])
    t = _fixed_rate(duration + _LOOKAHEAD, step)
    q = np.round(trajectory.evaluate(np.minimum(t, duration))[0], _DIGITS) + 0.0  # no -0.0
    acceleration = min(_MOVEJ_ACCELERATION, float(robot.limits.sides("acceleration").lesser.min()))
    speed = min(_MOVEJ_SPEED, float(robot.limits.sides("velocity").lesser.min()))
    cycle = f"t={_decimal(step)}, lookahead_time={_LOOKAHEAD}, gain={_GAIN}"
    carrying, tool = carried(solution.rollout), _at_flange(robot)
    changes, gripper = (
        {_cycle(instant, step): change for instant, change in each}
        for each in (((one.t, one) for one in carrying), ((one.gripper, one) for one in carrying if one.changes))
    )
    rows = [f"  movej({_angles(q[0])}, a={_decimal(acceleration)}, v={_decimal(speed)})"]
    for k, row in enumerate(q):
        if k in gripper:
            rows.append(f"  # gripper: {gripper[k].changes}")
        if k in changes:
            rows.append(_set_payload(changes[k], tool))
        if k:
            rows.append(f"  servoj({_angles(row)}, {cycle})")
    return "\n".join(
        [
            f"# trajevo: {solution.front.record.title}",
            f"# {solution.rule}, row {solution.index} of the front, {robot.name!r}, seed {solution.front.run.seed}",
            f"# {duration:.9f} s; the last position is held {_LOOKAHEAD} s longer, as servoj looks ahead; rad",
            f"# certificate: {one_line(str(certificate_of(solution)))}",  # a line break would end the comment
            "def trajevo_motion():",
            f"  set_tcp(p{_angles(np.concatenate([tool[0], Rotation.from_matrix(tool[1]).as_rotvec()]))})",
            *rows,
            f"  stopj({_decimal(acceleration)})",
            "end",
            "",
        ]
    )


def _events(rollout: Rollout) -> list[str]:
    """Comment lines, one for what is carried at the start and for every change, as JSON."""
    if not rollout.robot.gives_effort:
        return []
    return [f"# carried: {json.dumps(change.plain)}" for change in carried(rollout)]


def _at_flange(robot: Robot) -> tuple[Array, Array]:
    """Position (3,) [m] and rotation (3, 3) of the tool frame in the flange ``tool0``; none if there is no flange."""
    frames = {frame.name: frame for frame in robot.model.frames}
    tool, flange = frames[robot.tool], frames.get(_FLANGE, frames[robot.tool])
    if tool.parentJoint != flange.parentJoint:
        return np.zeros(3), np.eye(3)
    back = flange.placement.rotation.T
    return back @ (tool.placement.translation - flange.placement.translation), back @ tool.placement.rotation


def _cycle(instant: float, step: float) -> int:
    """Number of the first cycle that is not before an instant."""
    return max(math.ceil(instant / step - 1e-9), 0)


def _set_payload(change: Carrying, tool: tuple[Array, Array]) -> str:
    """The line that tells the controller what is carried from now on."""
    payload, (position, rotation) = change.payload, tool
    com = np.round(position + rotation @ np.array(payload.com), _DIGITS) + 0.0
    call = f"  set_payload({_decimal(payload.mass)}, {_angles(com)}"
    if payload.inertia is None:
        return f"{call})"
    turned = rotation @ np.array(payload.inertia) @ rotation.T
    return f"{call}, {_angles(turned[(0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)])})"


def _fixed_rate(duration: float, step: float) -> Array:
    """Instants k step from 0 to the first that is, up to rounding, not before the end, shape (T,) [s]."""
    count = max(math.ceil(duration / step - 1e-9), 1)
    return frozen(np.arange(count + 1) * step)


def _yaml_floats(values: list[float]) -> str:
    """A list of numbers, each by :func:`_yaml_float`."""
    text = repr(values)
    return f"[{', '.join(map(_yaml_float, values))}]" if "e" in text else text


def _yaml_float(value: float) -> str:
    """The shortest text that reads back exactly; YAML 1.1 takes ``1e-05`` for text and ``1.0e-05`` for a number."""
    text = repr(value)
    return text.replace("e", ".0e") if "e" in text and "." not in text else text


def _decimal(value: float) -> str:
    """A number without an exponent."""
    return np.format_float_positional(value, trim="0")


def _angles(row: Array) -> str:
    return f"[{', '.join(map(_decimal, row.tolist()))}]"


def _ros2(solution: Solution, step: float, angle: str) -> str:
    return comments(solution) + joint_trajectory(solution, step)


def _moveit(solution: Solution, step: float, angle: str) -> str:
    robot = solution.front.problem.robot
    return comments(solution) + write_joint_limits(robot.limits, robot.joint_names)


def _mujoco(solution: Solution, step: float, angle: str) -> str:
    return comments(solution) + replay_table(solution, step)


def _urscript(solution: Solution, step: float, angle: str) -> str:
    return urscript(solution, step)


ROS2 = Exporter("ros2", "yaml", "a trajectory_msgs/JointTrajectory as YAML", _ros2, si=True)

MOVEIT = Exporter("moveit", "joint_limits.yaml", "the robot's limits as MoveIt reads them", _moveit, si=True)

# The replay is a CSV table too, so its ending differs from that of the format "csv". The step is MuJoCo's default.
MUJOCO = Exporter("mujoco", "mujoco.csv", "CSV at a fixed rate for a replay in MuJoCo", _mujoco, step=0.002, si=True)

# Every controller that has servoj can run its cycle in 0.008 s.
URSCRIPT = Exporter(
    "urscript",
    "script",
    "a program that streams the motion to a controller of Universal Robots",
    _urscript,
    needs="six joints that turn",
    step=0.008,
    si=True,
    beginning=b"# trajevo: ",
)
