"""Pinocchio models of robots: one coordinate per joint that is planned for, the others locked."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from trajevo.arrays import Array
from trajevo.errors import InvalidInputError, UnknownNameError


def build_model(text: str, file: Path, lock: Mapping[str, float]) -> tuple[Any, tuple[str, ...]]:
    """The model of a checked URDF with joints locked, and the unit of every joint that is left."""
    try:
        model = pin.buildModelFromXML(text)
    except (ValueError, RuntimeError) as error:
        raise InvalidInputError(f"{file}: Pinocchio cannot read it: {error}") from error
    model = _locked(model, file, lock)
    units = tuple(_joint_unit(joint, name, file) for joint, name in zip(model.joints[1:], model.names[1:], strict=True))
    return model, units


def held_still(model: Any, file: Path, lock: Mapping[str, float]) -> tuple[list[int], Array]:
    """Numbers of the joints to lock in the whole model, and a configuration of it that holds their positions."""
    held = pin.neutral(model)
    numbers = []
    for name, position in lock.items():
        if name not in list(model.names)[1:]:
            raise UnknownNameError(f"joint to lock in {file}", name, list(model.names)[1:])
        real = isinstance(position, int | float | np.number) and not isinstance(position, bool)
        if not (real and np.isfinite(position)):
            raise InvalidInputError(f"{file}: lock: expected a position of joint {name!r} [rad or m], got {position!r}")
        joint = model.joints[model.getJointId(name)]
        numbers.append(model.getJointId(name))
        turned = [np.cos(position), np.sin(position)] if joint.nq == 2 and joint.nv == 1 else [position]
        held[joint.idx_q : joint.idx_q + joint.nq] = turned
    return numbers, held


def _locked(model: Any, file: Path, lock: Mapping[str, float]) -> Any:
    if lock and len(lock) == model.njoints - 1:
        raise InvalidInputError(f"{file}: lock: expected at least one joint left to move, got all locked: {list(lock)}")
    return pin.buildReducedModel(model, *held_still(model, file, lock)) if lock else model


def _joint_unit(joint: Any, name: str, file: Path) -> str:
    """Unit of a joint's coordinate; joints with none or several coordinates cannot be planned for."""
    kind = joint.shortname()
    if joint.nq != 1 or joint.nv != 1:
        raise InvalidInputError(
            f"{file}: joint {name!r} is a {kind} with {joint.nq} coordinates; expected revolute or prismatic, "
            f"or lock it: lock={{{name!r}: position}}"
        )
    return "m" if "JointModelP" in kind else "rad"
