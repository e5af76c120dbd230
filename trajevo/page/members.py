"""The solutions of a front as the page has them: numbers, and motions that it evaluates by itself."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.units import display, per_time, pretty
from trajevo.dynamics.integrals.nodes import lobatto
from trajevo.dynamics.rollout import Rollout
from trajevo.front.front import Front, Solution
from trajevo.page.packing import Packed
from trajevo.robot.transmission import Direct, Mimicking, Transmission
from trajevo.trajectory.batch import DERIVATIVES, TrajectoryBatch
from trajevo.trajectory.interpolants.hermite import hermite_segments
from trajevo.trajectory.polynomial import PolynomialBatch

#: Least number of solutions that have motions, whatever these take, and greatest number of them.
_LEAST, _MOST = 50, 4000

#: Instants of the positions of a model whose joints actuators do not drive one by one, and least and greatest number of
#: instants with efforts.
_PIECES, _INSTANTS = 60, (28, 160)

#: Size that efforts may take where there are more than the least number of instants [byte].
_ROOM_OF_EFFORTS = 600_000

#: Pieces of a segment that is no polynomial of low degree.
_PARTS = 3

#: Share of a motion's time that is rounding.
_ROUNDING = 1e-12

#: Greatest number that stands for a value.
_GREATEST = 32_000


def rows_of(solution: Solution, room: int) -> Array:
    """Rows of a solution's front whose motions a page has room for, spread over it, ascending, (R,).

    Args:
        solution: one of them.
        room: greatest size of all solutions, before they are compressed [byte].
    """
    record = solution.front.record
    numbers = 8 * len(record.objectives) + 4 * len(record.constraints)
    most = int(room / (_bytes_each(solution.rollout) + numbers))
    return solution.front.thinned(max(min(most, _MOST), _LEAST))


def numbers_of(front: Front, rows: Array, pack: Packed) -> dict[str, Any]:
    """Rows, objectives and constraints of the solutions in some rows, and when they pass points.

    Args:
        front: the front.
        rows: ascending rows, shape (R,).
        pack: where the arrays go.
    """
    return {
        "rows": pack.add(rows, "u4"),
        "F": pack.add(front.F[rows], "f8"),
        "G": pack.add(front.G[rows], "f4"),
        "via": via_times(front, front.X[rows], pack),
    }


def via_times(front: Front, x: Array, pack: Packed) -> dict[str, Any] | None:
    """When motions of decision vectors, shape (R, n_var), pass the points of their problem; None if it has none."""
    if getattr(front.problem.interpolant, "points", None) is None:
        return None
    return pack.add(front.problem.via_times(x), "f4")


def motions_of(rollout: Rollout, pack: Packed) -> dict[str, Any]:
    """Motions as piecewise polynomials, with efforts and, as needed, positions of the model's joints and bases.

    Args:
        rollout: the robot on R motions.
        pack: where the arrays go.
    """
    motion = as_polynomials(rollout.trajectory)
    found = {"breaks": pack.add(motion.breaks, "f4"), "coefficients": pack.add(motion.coefficients, "f4")}
    if rollout.robot.gives_effort:
        found |= _efforts(rollout, motion.breaks, pack)
    placed = None if rollout.arranged is None else rollout.arranged.placements
    if placed is not None:
        found["bases"] = pack.add(_matrices(*placed), "f4")
    if not _linear(rollout.robot.transmission) and rollout.robot.has_body:
        shares = np.linspace(0.0, 1.0, _PIECES + 1)
        q = rollout.trajectory.evaluate(rollout.trajectory.duration[:, None] * shares)
        still = np.zeros_like(q)
        found |= _whole("model", rollout.robot.transmission.motion(q, still, still)[0], pack)
    return found


def quantities(front: Front) -> list[dict[str, Any]]:
    """Position, velocity, acceleration, jerk and effort as the page shows them, with the limits that are kept."""
    problem, robot = front.problem, front.problem.robot
    shown = []
    names = [*DERIVATIVES, *(["effort"] if robot.gives_effort else [])]
    for order, name in enumerate(names):
        of_effort = ["N*m" if unit == "rad" else "N" for unit in robot.joint_units]
        si = of_effort if name == "effort" else [per_time(unit, order) for unit in robot.joint_units]
        units = [display(unit, angle=problem.angle, length=problem.length) for unit in si]
        low, high = (_finite(end) for end in problem.kept_limits.bounds(name))
        shown.append(
            {
                "name": name,
                "units": [pretty(unit) for unit, _ in units],
                "factors": [factor for _, factor in units],
                "low": low,
                "high": high,
            }
        )
    return shown


def as_polynomials(trajectory: TrajectoryBatch) -> PolynomialBatch:
    """Motions as piecewise polynomials; others are met with velocity and acceleration a few times in every segment."""
    if isinstance(trajectory, PolynomialBatch):
        return trajectory
    own, shares = trajectory.breaks, np.arange(_PARTS + 1) / _PARTS
    rows, segments = len(own), own.shape[1] - 1
    inner = own[:, :-1, None] + np.diff(own, axis=1)[..., None] * shares[:-1]
    breaks = np.concatenate([inner.reshape(rows, -1), own[:, -1:]], axis=1)
    # Accelerations may jump where segments meet, so that each has its own at its ends.
    states = np.stack([trajectory.at_shares(shares, order) / max(order, 1) for order in range(3)], axis=-1)
    apart = states.reshape(rows, segments, len(shares), trajectory.n_joints, 3)
    begin, end = (apart[:, :, part].reshape(rows, -1, trajectory.n_joints, 3) for part in (np.s_[:-1], np.s_[1:]))
    durations = np.diff(breaks, axis=1)
    nothing = durations <= _ROUNDING * trajectory.duration[:, None]
    found = np.array(hermite_segments(begin, end, np.where(nothing, 1.0, durations)))
    found[nothing, :, 1:] = 0.0
    return PolynomialBatch(breaks, found)


def _matrices(rotations: Array, translations: Array) -> Array:
    """Placements as matrices of homogeneous coordinates, column by column as WebGL has them, shape (R, 16)."""
    placed = np.tile(np.eye(4), (len(rotations), 1, 1))
    placed[:, :3, :3], placed[:, :3, 3] = rotations.real, translations.real
    return placed.swapaxes(1, 2).reshape(-1, 16)


def _bytes_each(rollout: Rollout) -> int:
    """Bytes that a motion takes."""
    motion, robot = as_polynomials(rollout.trajectory), rollout.robot
    size = int(4 * (motion.breaks[0].size + motion.coefficients[0].size))
    size += 2 * _INSTANTS[0] * motion.n_joints if robot.gives_effort else 0
    return size + (0 if _linear(robot.transmission) or not robot.has_body else 2 * (_PIECES + 1) * robot.model.nq)


def _efforts(rollout: Rollout, breaks: Array, pack: Packed) -> dict[str, Any]:
    """Efforts at nodes of every piece, as whole numbers, and the nodes as shares of a piece.

    Args:
        rollout: the robot on R motions.
        breaks: where the pieces of the motions meet, shape (R, S + 1) [s].
        pack: where the arrays go.
    """
    count, pieces = len(breaks), breaks.shape[1] - 1
    least, most = _INSTANTS
    wanted = min(max(int(_ROOM_OF_EFFORTS / (2 * rollout.robot.dof * count)), least), most)
    samples = max(-(-wanted // pieces), 3)
    nodes = lobatto(samples)[0]
    if isinstance(rollout.trajectory, PolynomialBatch):
        effort = replace(rollout, dynamics=rollout.dynamics.sampled(samples)).effort
    else:
        t = (breaks[:, :-1, None] + np.diff(breaks, axis=1)[..., None] * nodes).reshape(count, -1)
        q, v, a = (rollout.trajectory.evaluate(t, order) for order in range(3))
        effort = rollout.effort_in(q, v, a, t)
    return _whole("effort", effort, pack) | {"effort_at": nodes.tolist()}


def _whole(name: str, values: Array, pack: Packed) -> dict[str, Any]:
    """Values of joints, shape (R, T, n), as whole numbers, and what these stand for."""
    scale = np.abs(values).max(axis=(0, 1))
    scale = np.where(scale > 0.0, scale, 1.0) / _GREATEST
    return {name: pack.add(np.rint(values / scale), "i2"), f"{name}_scale": scale.tolist()}


def _linear(transmission: Transmission) -> bool:
    return isinstance(transmission, Direct | Mimicking)


def _finite(values: Array) -> list[float | None]:
    """Numbers as JSON holds them: none for what is not limited."""
    return [value if np.isfinite(value) else None for value in np.asarray(values, dtype=np.float64).tolist()]
