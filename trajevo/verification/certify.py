"""Prove that motions keep their limits at every instant, or show where they break one.

:func:`certify` makes a :class:`~trajevo.verification.certificate.Certificate` with one row per quantity and joint, and
one for every other constraint of the problem. Positions, velocities, accelerations and jerks are bounded by the
trajectory's extremes, effort, power and tool speed by :mod:`trajevo.dynamics.enclosure`, torques of drives in
:mod:`trajevo.verification.drive_proofs`, the other constraints in :mod:`trajevo.verification.constraint_proofs`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from trajevo.base.arrays import Array, numbers
from trajevo.dynamics.enclosure import Enclosure, enclose
from trajevo.dynamics.rollout import Rollout, rollout_of
from trajevo.errors import InvalidInputError, NoSolutionError
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.front.front import Front, Solution
from trajevo.verification.certificate import Certificate, Proof, Uncovered
from trajevo.verification.constraint_proofs import constraint_proofs
from trajevo.verification.drive_proofs import drive_proofs
from trajevo.verification.kinematic_proofs import kinematic_proofs
from trajevo.verification.proof_file import Relied

#: Least and greatest tolerance of a certificate.
TOLERANCES = (1e-7, 0.1)


def certify(
    motion: Solution | Rollout | Any, *, tolerance: float = 0.001, tool_speed: float | None = None, power: Any = None
) -> Certificate:
    """Prove bounds that a motion does not exceed at any instant, or show where it breaks a limit.

    The limits are those that the problem keeps, less its margins, and the robot's own where the problem keeps none.
    So with drives: their peak torques and torque-speed lines have rows, whether the problem keeps them or not.
    Every constraint of the problem has a row, or is named as not covered. Of a rollout, whose problem is not known,
    only the limits of the joints and drives are checked.

    Args:
        motion: a solution, an optimum, or the rollout of one motion.
        tolerance: share of the limit, or of the greatest value if there is no limit, by which proven bounds of effort,
            power, tool speed and torque at speed may lie above the exhibited values, 1e-7 to 0.1.
        tool_speed: limit of the speed of the tool's origin [m/s]; if None, that of the problem, if it has one.
        power: limit of the mechanical power of every joint [W], one number or one per joint; no limit if None.

    Returns:
        The certificate.

    Raises:
        InvalidInputError: not a motion, several motions, or an invalid tolerance or limit.
    """
    rollout = rollout_of(motion)
    if len(rollout.trajectory) != 1:
        raise InvalidInputError(f"motion: expected one motion, got {len(rollout.trajectory)}; use certify_all for more")
    limits = _limits(rollout, motion, tolerance, tool_speed, power)
    return _certified(rollout, [_named(motion)], limits, tolerance, _problem_of(motion))[0]


def certify_all(
    motions: Front | Rollout,
    *,
    rows: Sequence[int] | None = None,
    tolerance: float = 0.001,
    tool_speed: float | None = None,
    power: Any = None,
) -> tuple[Certificate, ...]:
    """:func:`certify` for every solution of a front, or every motion of a rollout, in one batch.

    Args:
        motions: a front or a rollout.
        rows: solutions of the front, such as those of ``front.thinned(1000)``; all if None.
        tolerance: as for :func:`certify`, as are the others.
        tool_speed: greatest speed of the tool [m/s].
        power: greatest mechanical power of every joint [W].

    Raises:
        NoSolutionError: the front is empty.
        InvalidInputError: as :func:`certify`.
    """
    owner: Any = motions
    if isinstance(motions, Front):
        if not len(motions):
            raise NoSolutionError(f"the front is empty: {motions.blocking}")
        chosen = np.arange(len(motions)) if rows is None else np.array(rows, dtype=np.intp)
        rollout, owner = motions.rollouts_of(chosen), motions.pick("0")
    else:
        rollout = rollout_of(motions)
        chosen = np.arange(len(rollout.trajectory))
    limits = _limits(rollout, owner, tolerance, tool_speed, power)
    names = [f"row {k}" for k in chosen]
    return tuple(_certified(rollout, names, limits, tolerance, _problem_of(owner)))


def _certified(
    rollout: Rollout, names: list[str], limits: Array, tolerance: float, problem: TrajectoryProblem | None
) -> list[Certificate]:
    count, found = len(rollout.trajectory), []
    enclosure = enclose(_computable(rollout), limits, tolerance=float(tolerance))
    kinematic, drives = kinematic_proofs(rollout), drive_proofs(rollout, float(tolerance))
    own, uncovered = ([()] * count, [()] * count) if problem is None else constraint_proofs(problem, rollout)
    for k, name in enumerate(names):
        rows = (*kinematic[k], *_dynamic_proofs(rollout, enclosure, k, limits), *drives[k], *own[k])
        missing = (*_without_effort(rollout), *uncovered[k])
        notes = rollout.robot.mass_notes if rollout.robot.gives_effort else ()
        made = Certificate(name, float(tolerance), int(enclosure.pieces[k]), rows, missing, notes)
        found.append(made.relying_on(Relied(rollout, k, limits)))
    return found


def _computable(rollout: Rollout) -> Rollout:
    """The rollout itself, or with efforts that nobody is told, if links without mass would refuse them."""
    if rollout.robot.gives_effort:
        return rollout
    robot = replace(rollout.robot, allow_massless=True, has_body=True)
    return replace(rollout, dynamics=replace(rollout.dynamics, robot=robot))


def _without_effort(rollout: Rollout) -> tuple[Uncovered, ...]:
    """Effort, if it is limited but cannot be computed."""
    robot = rollout.robot
    if robot.gives_effort or not rollout.limits.sides("effort").limited.any():
        return ()
    return (Uncovered("effort", f"links without mass: {', '.join(robot.massless)}", float("nan"), 0),)


def _problem_of(motion: Any) -> TrajectoryProblem | None:
    return motion.front.problem if isinstance(motion, Solution) else getattr(motion, "problem", None)


def _named(motion: Any) -> str:
    if isinstance(motion, Solution):
        return f"row {motion.index}" + ("" if motion.rule == "row" else f" ({motion.rule})")
    return "the motion"


def _dynamic_proofs(rollout: Rollout, enclosure: Enclosure, motion: int, limits: Array) -> Iterator[Proof]:
    """Proofs for effort and power of every joint, unless nothing has mass or friction, and for the tool speed."""
    robot = rollout.robot
    joints = list(zip(robot.joint_names, robot.joint_units, strict=True))
    columns: list[tuple[str, str | None, str]] = [
        *(("effort", name, "N*m" if unit == "rad" else "N") for name, unit in joints),
        *(("power", name, "W") for name, _ in joints),
        ("tool speed", None, "m/s"),
    ]
    carried = rollout.dynamics.loaded if rollout.masses is None else float(rollout.masses[motion]) > 0.0
    massless = not robot.gives_effort or (robot.mass == 0.0 and not carried and robot.friction.none)
    kept, own, scales = _by_direction(rollout, enclosure, motion, limits)
    for k, (quantity, joint, unit) in enumerate(columns):
        if (massless and joint is not None) or not robot.has_body:
            continue
        # Adding 0 makes the -0.0 of a joint that stands a plain 0.
        bound, shown = (float((x[motion, k] + 0.0) * scales[k]) for x in (enclosure.bound, enclosure.exhibited))
        limit = float(kept[k])
        scale = float(enclosure.scale[motion, k] * scales[k])
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
            gap=(bound - shown) / scale if bound > shown and scale > 0.0 else 0.0,
            full_limit=float(own[k]),
        )


def _by_direction(rollout: Rollout, enclosure: Enclosure, motion: int, limits: Array) -> tuple[Array, Array, Array]:
    """Limits of the columns, the robot's own, and what enclosed magnitudes are multiplied by, (2 n_joints + 1,) each.

    The effort of a joint whose limit differs by direction is told in the direction of the greatest share of a limit
    that was found.
    """
    robot, sides = rollout.robot, rollout.limits.sides("effort")
    kept, own, scales = limits.copy(), limits.copy(), np.ones(len(limits))
    own[: robot.dof] = robot.limits.effort
    if sides.agree:
        return kept, own, scales
    t, joints = enclosure.instants[motion, : robot.dof], np.arange(robot.dof)
    one = _one_motion(rollout, motion)
    q, v, a = (one.trajectory.evaluate(t[None], order) for order in range(3))
    effort = one.effort_in(q, v, a, t)[0, joints, joints]
    kept[: robot.dof] = sides.told(effort)
    own[: robot.dof] = robot.limits.sides("effort").told(effort)
    limited = np.flatnonzero(np.isfinite(kept[: robot.dof]))
    scales[limited] = kept[limited] / sides.lesser[limited]
    return kept, own, scales


def _one_motion(rollout: Rollout, motion: int) -> Rollout:
    """One motion of a rollout."""
    return _computable(rollout.rows(slice(motion, motion + 1)))


def _limits(rollout: Rollout, motion: Any, tolerance: float, tool_speed: float | None, power: Any) -> Array:
    """Limits of the efforts, the powers and the tool's speed, shape (2 n_joints + 1,)."""
    robot = rollout.robot
    number = isinstance(tolerance, int | float | np.number) and not isinstance(tolerance, bool)
    if not (number and TOLERANCES[0] <= tolerance <= TOLERANCES[1]):
        raise InvalidInputError(
            f"tolerance: expected a share from {TOLERANCES[0]:g} to {TOLERANCES[1]:g}, got {tolerance!r}"
        )
    for given, what in ((tool_speed, "a limit of tool speed"), (power, "a limit of power")):
        if given is not None:
            robot.check_body(what)
    powers = np.full(robot.dof, np.inf) if power is None else _positive(power, "power", robot.dof)
    if tool_speed is None:
        limited = [
            float(c.limit) for c in getattr(_problem_of(motion), "constraints", ()) if c.quantity == "tool speed"
        ]
        speed = np.array([min(limited, default=np.inf)])
    else:
        speed = _positive(tool_speed, "tool_speed", 1)
    return np.concatenate([rollout.limits.sides("effort").lesser, powers, speed])


def _positive(given: Any, name: str, count: int) -> Array:
    """A limit, one number or ``count`` of them, as an array of shape (count,)."""
    limit = numbers(given, name=name, shape=() if np.ndim(given) == 0 else (count,))
    if not (limit > 0.0).all():
        raise InvalidInputError(f"{name}: expected positive numbers, got {limit.tolist()}")
    return np.broadcast_to(limit, (count,))
