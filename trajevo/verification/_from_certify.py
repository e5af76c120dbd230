"""Certificates: what a motion never exceeds at any instant, proven, and where it comes closest or breaks a limit.

Positions, velocities, accelerations and jerks are bounded by the extremes of the trajectory, exact or guaranteed, not
by samples. Effort, mechanical power and tool speed are enclosed between the samples by adaptive subdivision, see
:mod:`trajevo.enclosure`, which also says how dry friction and rounding are treated. What is proven is the model: the
robot's masses, friction and payload as they are given, moved exactly along the trajectory.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from trajevo.arrays import Array, numbers
from trajevo.certificate import Certificate, Proof
from trajevo.dynamics import Rollout, rollout_of
from trajevo.enclosure import Enclosure, enclose
from trajevo.errors import InvalidInputError, NoSolutionError
from trajevo.front import Front, Solution
from trajevo.kinematic_proofs import kinematic_proofs
from trajevo.tool import most_tool_speed

#: Least and greatest tolerance of a certificate.
TOLERANCES = (1e-7, 0.1)


def certify(
    motion: Solution | Rollout | Any, *, tolerance: float = 0.001, tool_speed: float | None = None, power: Any = None
) -> Certificate:
    """Prove what a motion does not exceed at any instant, or exhibit where it breaks a limit.

    The robot's limits count whether or not the problem asked for them.

    Args:
        motion: a solution, an optimum, or the rollout of one motion.
        tolerance: share of the limit, or of the greatest value where there is none, by which proven bounds of effort,
            power and tool speed may lie above what a sample exhibits, 1e-7 to 0.1.
        tool_speed: greatest speed of the tool's origin [m/s]; that of the problem if None, where it has one.
        power: greatest mechanical power [W] of every joint, one number or one per joint; none if None.

    Returns:
        The certificate.

    Raises:
        InvalidInputError: not a motion, several of them, or another tolerance or limit.
    """
    rollout = rollout_of(motion)
    if len(rollout.trajectory) != 1:
        raise InvalidInputError(f"motion: expected one motion, got {len(rollout.trajectory)}; certify_all takes them")
    return _certified(rollout, [_named(motion)], _limits(rollout, motion, tolerance, tool_speed, power), tolerance)[0]


def certify_all(
    motions: Front | Rollout, *, tolerance: float = 0.001, tool_speed: float | None = None, power: Any = None
) -> tuple[Certificate, ...]:
    """:func:`certify` for every solution of a front, or every motion of a rollout, in one batch.

    Raises:
        NoSolutionError: the front is empty.
        InvalidInputError: as :func:`certify`.
    """
    owner: Any = motions
    if isinstance(motions, Front):
        if not len(motions):
            raise NoSolutionError(f"the front is empty: {motions.blocking}")
        rollout, owner = motions.problem.rollout(motions.X), motions.pick("0")
    else:
        rollout = rollout_of(motions)
    limits = _limits(rollout, owner, tolerance, tool_speed, power)
    names = [f"row {k}" for k in range(len(rollout.trajectory))]
    return tuple(_certified(rollout, names, limits, tolerance))


def _certified(rollout: Rollout, names: list[str], limits: Array, tolerance: float) -> list[Certificate]:
    found: list[Certificate] = []
    enclosure = enclose(rollout, limits, tolerance=float(tolerance))
    for k, (name, kinematic) in enumerate(zip(names, kinematic_proofs(rollout), strict=True)):
        rows = (*kinematic, *_dynamic_proofs(rollout, enclosure, k, limits))
        found.append(Certificate(name, float(tolerance), int(enclosure.pieces[k]), rows))
    return found


def _named(motion: Any) -> str:
    if isinstance(motion, Solution):
        return f"row {motion.index}" + ("" if motion.rule == "row" else f" ({motion.rule})")
    return "the motion"


def _dynamic_proofs(rollout: Rollout, enclosure: Enclosure, motion: int, limits: Array) -> Iterator[Proof]:
    """Effort and power of every joint of a robot with masses, and tool speed."""
    robot = rollout.robot
    joints = list(zip(robot.joint_names, robot.joint_units, strict=True))
    columns: list[tuple[str, str | None, str]] = [
        *(("effort", name, "N*m" if unit == "rad" else "N") for name, unit in joints),
        *(("power", name, "W") for name, _ in joints),
        ("tool speed", None, "m/s"),
    ]
    carried = rollout.dynamics.payload.mass if rollout.masses is None else float(rollout.masses[motion])
    massless = robot.mass == 0.0 and carried == 0.0 and robot.friction.none
    for k, (quantity, joint, unit) in enumerate(columns):
        if massless and joint is not None:
            continue
        bound, shown = float(enclosure.bound[motion, k]), float(enclosure.exhibited[motion, k])
        limit = float(limits[k])
        scale = float(enclosure.scale[motion, k])
        yield Proof(
            quantity=quantity,
            joint=joint,
            unit=unit,
            limit=limit,
            bound=bound,
            exhibited=shown,
            instant=float(enclosure.instants[motion, k]),
            share=bound / limit,
            exhibited_share=shown / limit,
            gap=(bound - shown) / scale if bound > shown else 0.0,
        )


def _limits(rollout: Rollout, motion: Any, tolerance: float, tool_speed: float | None, power: Any) -> Array:
    """What efforts, powers and the tool's speed are held to, shape (2 n_joints + 1,)."""
    robot = rollout.robot
    number = isinstance(tolerance, int | float | np.number) and not isinstance(tolerance, bool)
    if not (number and TOLERANCES[0] <= tolerance <= TOLERANCES[1]):
        raise InvalidInputError(
            f"tolerance: expected a share from {TOLERANCES[0]:g} to {TOLERANCES[1]:g}, got {tolerance!r}"
        )
    powers = np.full(robot.dof, np.inf) if power is None else _positive(power, "power", robot.dof)
    if tool_speed is None:
        problem = motion.front.problem if isinstance(motion, Solution) else getattr(motion, "problem", None)
        found = [most_tool_speed(constraint) for constraint in getattr(problem, "constraints", ())]
        speed = np.array([min((most for most in found if most is not None), default=np.inf)])
    else:
        speed = _positive(tool_speed, "tool_speed", 1)
    return np.concatenate([robot.limits.effort, powers, speed])


def _positive(given: Any, name: str, count: int) -> Array:
    """A limit, one number or ``count`` of them, as an array of shape (count,)."""
    limit = numbers(given, name=name, shape=() if np.ndim(given) == 0 else (count,))
    if not (limit > 0.0).all():
        raise InvalidInputError(f"{name}: expected positive numbers, got {limit.tolist()}")
    return np.broadcast_to(limit, (count,))
