"""Proof files: what a certificate relied on, so that a program which knows nothing of trajevo can check its claims.

That program is :mod:`trajevo.verification.check_proof`; the format is described in ``exporters/proof.schema.json``.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.enclosure import enclose_pieces
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.robot.joints import JointLimits
from trajevo.robot.payload import Payload, entries_of
from trajevo.robot.robot import Robot
from trajevo.robot.transmission import CoupledScrews, Direct, Mimicking
from trajevo.trajectory.along_path import ComposedBatch
from trajevo.trajectory.batch import DERIVATIVES
from trajevo.trajectory.polynomial import PolynomialBatch

if TYPE_CHECKING:
    from trajevo.verification.certificate import Certificate, Proof

#: Quantities of joints of which proof files claim something.
CHECKED = (*DERIVATIVES, "effort")

#: First keys of every file, and what its numbers mean.
FORMAT, VERSION = "trajevo proof", 1
CLAIM = (
    "At every instant from the first break to the last, each quantity in rows lies between least and greatest, and "
    "within its limits but for a share of 1e-9. The motion is that of the polynomials in motion, of the time since "
    "their segment began; effort is that of the rigid bodies in robot by Newton and Euler, with its friction. Every "
    "number stands for the double nearest to it. Nothing is claimed of what stands in not_checked."
)
UNITS = "SI: s, rad or m by joint, kg, kg*m^2, N*m or N"

#: Thousandths of a row's bound by which those of pieces are widened, so that their proof is cheap.
_WIDER = 2

#: Roundings by which bounds of positions are widened that are computed from shares of ranges.
_ROUNDINGS = 4.0


@final
@dataclass(frozen=True, eq=False)
class Relied:
    """What a certificate relied on.

    Attributes:
        rollout: the motions.
        motion: which of them the certificate is of.
        limits: limits of efforts, powers and the tool's speed, inf for none, shape (2 n_joints + 1,)
            [N·m or N, W, m/s].
    """

    rollout: Rollout
    motion: int
    limits: Array

    @property
    def one(self) -> Rollout:
        """The motion alone."""
        return self.rollout.rows(slice(self.motion, self.motion + 1))


def proof_text(certificate: Certificate, relied: Relied | None) -> str:
    """The proof file of a certificate, as JSON.

    Raises:
        InvalidInputError: the certificate was read from a file, or the motion is not one of polynomials of time.
    """
    if relied is None:
        raise InvalidInputError("certificate: it was read from a file, and its motion is not there; certify it again")
    rollout = relied.one
    if isinstance(rollout.trajectory, ComposedBatch):
        rollout = replace(rollout, trajectory=rollout.trajectory.polynomials(0))
    if not isinstance(rollout.trajectory, PolynomialBatch):
        raise InvalidInputError(
            "motion: expected polynomials of time, for which proof files are made, got "
            f"{type(rollout.trajectory).__name__}: export its samples and the certificate"
        )
    no_effort = _why_no_effort(rollout.dynamics)
    rows = [row for row in certificate.rows if row.quantity in CHECKED[: -1 if no_effort else None]]
    enclosed = [rollout.robot.joint_names.index(str(row.joint)) for row in rows if row.quantity == "effort"]
    content = {
        "format": FORMAT,
        "version": VERSION,
        "claim": CLAIM,
        "units": UNITS,
        "motion": _motion(certificate.motion, rollout, rollout.trajectory),
        "robot": _robot(rollout) if enclosed else None,
        "carried": _carried(rollout.dynamics, len(rollout.trajectory.breaks[0]) - 1),
        "rows": [_row(row, rollout) for row in rows],
        "pieces": _pieces(relied, rollout, certificate.tolerance, enclosed) if enclosed else [],
        "not_checked": [*_left_out(certificate, rows, no_effort)],
    }
    lines = [f"{json.dumps(key)}: {_on_lines(value)}" for key, value in content.items()]
    return "{\n" + ",\n".join([*lines, f'"digest": {json.dumps(digest(content))}']) + "\n}\n"


def digest(content: dict[str, Any]) -> str:
    """SHA-256 of a file's content without its digest."""
    plain = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return f"sha256:{hashlib.sha256(plain.encode()).hexdigest()}"


def _on_lines(value: Any) -> str:
    """JSON with an entry of a list on each line."""
    if not isinstance(value, list) or not value:
        return json.dumps(value, allow_nan=False)
    return "[\n " + ",\n ".join(json.dumps(each, allow_nan=False) for each in value) + "\n]"


def _why_no_effort(dynamics: Dynamics) -> str:
    """Why efforts cannot be in a proof file; empty if they can."""
    transmission, payload = dynamics.robot.transmission, dynamics.payload
    if not isinstance(transmission, Direct | Mimicking | CoupledScrews):
        return f"proof files know no transmission such as {type(transmission).__name__}"
    known = payload.model == "rigid" or not dynamics.loaded
    return "" if known else f"proof files know no payload whose model is {payload.model}"


def _motion(name: str, rollout: Rollout, trajectory: PolynomialBatch) -> dict[str, Any]:
    joints = zip(rollout.robot.joint_names, rollout.robot.joint_units, strict=True)
    return {
        "name": name,
        "joints": [{"name": joint, "unit": unit} for joint, unit in joints],
        "breaks": _hexadecimal(trajectory.breaks[0].real),
        "coefficients": _hexadecimal(trajectory.coefficients[0].real),
    }


def _hexadecimal(numbers: Array) -> Any:
    """Nested lists of doubles as hexadecimal text, which is exact."""
    return float(numbers).hex() if np.ndim(numbers) == 0 else [_hexadecimal(each) for each in numbers]


def _row(row: Proof, rollout: Rollout) -> dict[str, Any]:
    joint = rollout.robot.joint_names.index(str(row.joint))
    ends = (float(each[joint]) for each in rollout.limits.bounds(row.quantity))
    least, greatest = _claimed(row, rollout.limits, joint)
    lower, upper = (x if np.isfinite(x) else None for x in ends)
    by = "interval dynamics on pieces" if row.quantity == "effort" else "exact polynomials"
    return {
        "quantity": row.quantity,
        "joint": row.joint,
        "unit": row.unit,
        "lower": lower,
        "upper": upper,
        "least": least,
        "greatest": greatest,
        "proven_by": by,
    }


def _claimed(row: Proof, limits: JointLimits, joint: int) -> tuple[float | None, float | None]:
    """Least and greatest value that a row stands for, None where it says nothing."""
    if not np.isfinite(row.bound):
        return None, None
    lower, upper = (float(each[joint]) for each in limits.bounds(row.quantity))
    if row.quantity == "position":
        if not np.isfinite(lower) or not np.isfinite(upper):
            return (None, row.bound) if np.isfinite(upper) else (row.bound, None)
        beyond = 0.5 * (row.share - 1.0) * (upper - lower) + _ROUNDINGS * np.finfo(float).eps * max(-lower, upper)
        return lower - beyond, upper + beyond
    if -lower == upper:
        return -row.bound, row.bound
    return tuple(row.share * side if np.isfinite(side) else None for side in (lower, upper))  # type: ignore[return-value]


def _left_out(certificate: Certificate, rows: list[Proof], no_effort: str) -> Iterator[dict[str, Any]]:
    """What a certificate says of which a proof file claims nothing."""
    for row in certificate.rows:
        if row not in rows:
            why = no_effort if row.quantity == "effort" else "of this kind proof files claim nothing"
            limit, bound = (float(x) if np.isfinite(x) else None for x in (row.limit, row.bound))
            yield {"name": row.name, "unit": row.unit, "limit": limit, "bound": bound, "proven": row.proven, "why": why}
    for one in certificate.uncovered:
        yield {"name": one.name, "unit": "1", "limit": None, "bound": None, "proven": False, "why": one.reason}


def _robot(rollout: Rollout) -> dict[str, Any]:
    """Joints and bodies of the model that efforts were computed with, and what drives them."""
    robot, friction, screws = rollout.robot, rollout.robot.friction, rollout.robot.transmission
    model, turns = robot.model, robot.joint_axes[1]
    frames = _frames(robot)
    matrix, offset = _driven(robot)
    links = []
    for k in range(1, model.njoints):
        parent, place, own = int(model.parents[k]), model.jointPlacements[k], model.inertias[k]
        before = frames[parent].T
        links.append(
            {
                "name": model.names[k],
                "parent": parent - 1,
                "turns": bool(turns[k - 1]),
                "rotation": (before @ place.rotation @ frames[k]).tolist(),
                "offset": (before @ place.translation).tolist(),
                "body": _parameters(own.mass, frames[k].T @ own.lever, frames[k].T @ own.inertia @ frames[k]),
            }
        )
    coupled = screws if isinstance(screws, CoupledScrews) else None
    return {
        "name": robot.name,
        "gravity": model.gravity.linear.tolist(),
        "links": links,
        "loads": _loads(rollout, frames),
        "matrix": matrix.tolist(),
        "offset": offset.tolist(),
        "screws": None if coupled is None else {key: getattr(coupled, key) for key in ("slide", "swivel", "span")},
        "friction": {
            "viscous": friction.viscous.tolist(),
            "coulomb": friction.coulomb.tolist(),
            "coulomb_backward": np.asarray(friction.coulomb_backward).tolist(),
            "armature": friction.armature.tolist(),
            "standing": rollout.standing[0].tolist(),
        },
    }


def _frames(robot: Robot) -> list[Array]:
    """For the base and every joint of the model, axes of which z is the joint's, as columns (3, 3)."""
    frames = [np.eye(3)]
    for axis in robot.joint_axes[0]:
        first = np.eye(3)[(int(np.abs(axis).argmax()) + 1) % 3]  # exact where the axis is one of the frame's
        y = np.cross(axis, first)
        y /= np.linalg.norm(y)
        frames.append(np.stack([np.cross(y, axis), y, axis], axis=1))
    return frames


def _driven(robot: Robot) -> tuple[Array, Array]:
    """Coordinates of the model as a matrix times those of the actuators, and an offset, shapes (m, n) and (m,)."""
    if not isinstance(robot.transmission, Mimicking):
        return np.eye(robot.dof), np.zeros(robot.dof)
    still = np.zeros((1, robot.dof))
    offset, _, _ = robot.transmission.motion(still, still, still)
    return robot.transmission.motion(np.eye(robot.dof), still, still)[0].T - offset[0][:, None], offset[0]


def _parameters(mass: float, com: Array, inertia: Array) -> list[float]:
    """The ten :data:`~trajevo.robot.payload.PARAMETERS` of a body, from its inertia about its centre of mass."""
    about = inertia + mass * (com @ com * np.eye(3) - np.outer(com, com))
    return [float(mass), *(mass * com).tolist(), *entries_of(about).tolist()]


def _loads(rollout: Rollout, frames: list[Array]) -> list[list[dict[str, Any]]]:
    """What is carried in every phase, in the frame of the link that carries the tool."""
    robot, schedule, payload = rollout.robot, rollout.dynamics.schedule, rollout.dynamics.payload
    if rollout.masses is not None:
        payload = payload.with_mass(float(rollout.masses[0].real))
    if schedule is None:
        return [_load(robot, [payload], frames)]
    parts = []
    for phase in schedule.phases:
        fixed = schedule.fixed(phase)
        both = [*([] if fixed is None else [fixed]), *([payload] if schedule.varies(phase) else [])]
        parts.append(_load(robot, both, frames))
    return parts


def _load(robot: Robot, payloads: list[Payload], frames: list[Array]) -> list[dict[str, Any]]:
    frame = robot.model.frames[robot.model.getFrameId(robot.tool)]
    link = int(frame.parentJoint)
    turn = frames[link].T @ frame.placement.rotation
    found = []
    for each in payloads:
        if each.mass > 0.0 and link > 0:
            own = np.zeros((3, 3)) if each.inertia is None else np.array(each.inertia)
            com = turn @ np.array(each.com) + frames[link].T @ frame.placement.translation
            body = _parameters(each.mass, com, turn @ own @ turn.T)
            found.append({"link": link - 1, "body": body})
    return found


def _carried(dynamics: Dynamics, segments: int) -> list[int]:
    """For every segment the number of what is carried on it."""
    return [0] * segments if dynamics.schedule is None else list(dynamics.schedule.phase_of_segment)


def _pieces(relied: Relied, rollout: Rollout, tolerance: float, joints: list[int]) -> list[dict[str, Any]]:
    """Dyadic pieces of segments in the order of time, with thousandths of the rows' bounds that efforts keep."""
    pieces, above = enclose_pieces(rollout, relied.limits, tolerance=tolerance)
    most = above.max(axis=0)[joints]
    begins, durations = rollout.trajectory.breaks[0, :-1].real, rollout.trajectory.segment_durations[0].real
    found, seen = [], set(pieces.segment.tolist())
    for k in np.lexsort((pieces.start, pieces.segment)):
        segment = int(pieces.segment[k])
        level = round(np.log2(durations[segment] / pieces.width[k]))
        place = round((pieces.start[k] - begins[segment]) / durations[segment] * 2**level)
        shares = [
            min(1000, int(1000.0 * x / y) + _WIDER) if y else 1000 for x, y in zip(above[k, joints], most, strict=True)
        ]
        found.append({"segment": segment, "level": level, "place": place, "shares": shares})
    whole = {"level": 0, "place": 0, "shares": [1000] * len(joints)}  # of segments that are shorter than rounding
    found += [{"segment": k, **whole} for k in range(len(durations)) if k not in seen]
    return sorted(found, key=lambda piece: piece["segment"])  # stable
