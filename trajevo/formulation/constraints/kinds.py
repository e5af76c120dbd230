"""Kinds of limits by name: trajevo's own, those of other packages, and the user's by their places in Python.

To add one, write a file with its function and its :class:`~trajevo.formulation.constraints.constraint.LimitKind`, and
add the kind to :data:`KINDS`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from trajevo.base.own.code import known_at
from trajevo.base.plugins import Registry
from trajevo.errors import InvalidInputError, checked_name, known_names
from trajevo.formulation.constraints.certified import held
from trajevo.formulation.constraints.clearance import CLEARANCE
from trajevo.formulation.constraints.constraint import Constraint, Limited, LimitKind, LimitParameter
from trajevo.formulation.constraints.drives.heat import RMS_TORQUE, WINDING_TEMPERATURE
from trajevo.formulation.constraints.drives.peak_power import PEAK_POWER
from trajevo.formulation.constraints.drives.torque_at_speed import TORQUE_AT_SPEED
from trajevo.formulation.constraints.further.dexterity import MANIPULABILITY, SINGULARITY
from trajevo.formulation.constraints.further.effort_rate import EFFORT_RATE
from trajevo.formulation.constraints.further.own import own_kind
from trajevo.formulation.constraints.joint_limits import ACCELERATION, EFFORT, JERK, POSITION, VELOCITY
from trajevo.formulation.constraints.motion_limits import LONGEST_TIME, MEAN_VELOCITY, OVERSHOOT, VIA_ERROR
from trajevo.formulation.constraints.tool import TOOL_HEIGHT, TOOL_SPEED

#: Kinds of limits by name. Columns of kinds that a parameter switches on follow those of named kinds, in this order.
KINDS: dict[str, LimitKind] = {
    kind.name: kind
    for kind in (
        POSITION,
        VELOCITY,
        ACCELERATION,
        JERK,
        MEAN_VELOCITY,
        OVERSHOOT,
        VIA_ERROR,
        EFFORT,
        TOOL_SPEED,
        TOOL_HEIGHT,
        EFFORT_RATE,
        MANIPULABILITY,
        SINGULARITY,
        LONGEST_TIME,
        CLEARANCE,
        TORQUE_AT_SPEED,
        RMS_TORQUE,
        WINDING_TEMPERATURE,
        PEAK_POWER,
    )
}

#: Those that know nothing but time and the motion of the joints.
_OF_JOINTS = {kind.name for kind in (POSITION, VELOCITY, ACCELERATION, JERK, MEAN_VELOCITY, OVERSHOOT, LONGEST_TIME)}

#: Kinds of limits by name, with those of other packages.
NAMED_KINDS: Registry[LimitKind] = Registry(
    kind="constraint",
    group="trajevo.constraints",
    own=KINDS,
    expected="a trajevo.LimitKind",
    fits=lambda found: isinstance(found, LimitKind),
    made=own_kind,
)


def constraints_of(
    names: Sequence[str], limited: Limited, *, limits: str = "certified", shared: Sequence[str] = (), **given: Any
) -> tuple[Constraint, ...]:
    """The limits of a problem: those that are named, then those that a parameter switches on.

    Args:
        names: kinds of limits that have no parameters, or only parameters with a default; places of the user's own,
            see :func:`trajevo.base.own.code.named`.
        limited: robot, points and interpolant.
        limits: ``"certified"`` to prove effort and tool speed between the samples, see
            :mod:`trajevo.formulation.constraints.certified`, or ``"sampled"``.
        shared: parameters that something else takes too, so that no limit must be named for them.
        **given: parameters of limits; None means not given.

    Raises:
        UnknownNameError: no such constraint, or another value of ``limits``.
        InvalidInputError: the names are not a list, no limit has such a parameter, or its value cannot be used.
    """
    if isinstance(names, str) or not isinstance(names, Sequence):
        raise InvalidInputError(f"constraints: expected a list of names, got {names!r}")
    kinds = kinds_for(names, given)
    by_name = [name for name, kind in kinds.items() if kind.by_name]
    for name in names:
        _check_named(name, kinds, by_name)
    for kind in kinds.values():
        _check_unused(kind, names, {key: value for key, value in given.items() if key not in shared}, kinds)
    found = [kinds[name].constraint(limited, given) for name in names]
    asked = [kind for kind in kinds.values() if not kind.by_name and kind.asked_for(given)]
    return held([*found, *(kind.constraint(limited, given) for kind in asked)], limits)


def kinds_for(names: Sequence[str], given: Mapping[str, Any]) -> dict[str, LimitKind]:
    """The kinds in which names and parameters are looked up; other packages' kinds only if they are needed.

    Raises:
        InvalidInputError: no kind has a parameter of that name.
    """
    own = {name: _of_user(name) for name in names if known_at(name) is not None}
    others = [name for name in names if name not in own]
    if all(name in KINDS for name in others) and set(given) <= set(parameters_of(KINDS)):
        return KINDS | own
    kinds = NAMED_KINDS.all() | own
    for name in others:
        NAMED_KINDS.find(name)  # raises an error that says why another package's kind cannot be used
    known = parameters_of(kinds)
    for key in given:
        if key not in known:
            raise InvalidInputError(f"constraints: no limit takes {key!r}; {known_names(key, known)}")
    return kinds


def parameters_of(kinds: Mapping[str, LimitKind]) -> dict[str, LimitParameter]:
    """The parameters of kinds by name, in the kinds' order; kinds may share one.

    Raises:
        InvalidInputError: two kinds have different parameters of the same name.
    """
    found: dict[str, LimitParameter] = {}
    for kind in kinds.values():
        for parameter in kind.parameters:
            if found.get(parameter.name, parameter) is not parameter:
                raise InvalidInputError(
                    f"constraint {kind.name!r}: its parameter {parameter.name!r} needs another name, which is taken"
                )
            found[parameter.name] = parameter
    return found


def of_joints_alone(names: Sequence[str], given: Mapping[str, Any]) -> bool:
    """Whether named limits, and those that a parameter switches on, know nothing but time and the joints' motion.

    Args:
        names: as in :func:`constraints_of`; False for what is no list.
        given: parameters of limits; None means not given.
    """
    if isinstance(names, str) or not isinstance(names, Sequence):
        return False
    known = {parameter.name for name in _OF_JOINTS for parameter in KINDS[name].parameters}
    usual = {name: parameter.default for name, parameter in parameters_of(KINDS).items()}
    asked = {key for key, value in given.items() if value is not None and value != usual.get(key)}
    return set(names) <= _OF_JOINTS and asked <= known


def _of_user(place: str) -> LimitKind:
    """A kind of the user's, which cannot have parameters: only entry points can add arguments and keys."""
    kind = NAMED_KINDS.find(place)
    if kind.parameters:
        raise InvalidInputError(
            f"constraints: {place!r}: expected a LimitKind without parameters, got {kind.parameters[0].name!r}; one "
            "with parameters needs an entry point, and a function or a Constraint has its numbers in it"
        )
    return kind


def _check_named(name: str, kinds: Mapping[str, LimitKind], by_name: list[str]) -> None:
    if name in kinds and name not in by_name:
        needed = next(p.name for p in kinds[name].parameters if p.default is None)
        raise InvalidInputError(f"constraints: {name!r} is switched on by giving {needed!r}, not by its name here")
    checked_name("constraint", name, by_name)


def _check_unused(
    kind: LimitKind, names: Sequence[str], given: Mapping[str, Any], kinds: Mapping[str, LimitKind]
) -> None:
    """Refuse a parameter of a limit that is not named, unless a named one shares it."""
    if not kind.by_name or not kind.parameters or kind.name in names:
        return
    for parameter in kind.parameters:
        if given.get(parameter.name, parameter.default) in (None, parameter.default):
            continue
        sharing = [other.name for other in kinds.values() if parameter in other.parameters]
        if not any(name in names for name in sharing):
            raise InvalidInputError(
                f"{parameter.name}: expected {' or '.join(map(repr, sharing))} among the constraints, of which it is a "
                "parameter"
            )
