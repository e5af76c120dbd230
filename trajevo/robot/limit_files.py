"""Joint limits from all their sources.

The limits of ``robot.toml``, or else those of the URDF, are completed and replaced by those of the caller. A limit that
is still missing is an error: nothing is filled in silently.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from trajevo.base.arrays import Array, real_number
from trajevo.base.units import believed, per_time, quantity
from trajevo.errors import InvalidInputError, MissingLimitError, UnknownNameError, checked_name, known_names
from trajevo.robot.description import Description
from trajevo.robot.joints import DIRECTED
from trajevo.robot.moveit_limits import read_joint_limits
from trajevo.robot.urdf.joints import Follower

#: Formats in a sentence.
A_FORMAT = {"URDF": "a URDF", "xacro": "a URDF", "MJCF": "MJCF"}

QUANTITIES = ("position", "velocity", "acceleration", "jerk", "effort")

#: Keys of a limit that differs by direction, both of them magnitudes.
WAYS = ("backward", "forward")


def declared_limits(
    model: Any,
    names: tuple[str, ...],
    units: tuple[str, ...],
    declared: Mapping[str, Array] | None,
    given: Mapping[str, Any],
    urdf: Path,
    followers: Sequence[Follower] = (),
    *,
    source: Description,
) -> dict[str, Array]:
    """Columns of JointLimits, SI: limits of ``robot.toml``, or else of the file, overridden by those of the caller.

    What limits a joint that follows another limits that one as well: as its URDF has it, unless there is a
    ``robot.toml``, which says what the leader may do, and as the caller has it.
    """
    columns = dict(declared) if declared is not None else _of_urdf(model, names, followers, urdf, source.limits)
    _replace(columns, given, names, units, followers, urdf)
    missing = {key: _without(columns.get(key), names) for key in QUANTITIES[1:]}
    missing = {key: joints for key, joints in missing.items() if joints}
    if missing:
        key, joints = next(iter(missing.items()))
        held = f"which {A_FORMAT[source.kind]} cannot hold"
        lacking = "for which the file has no forcerange" if key == "effort" else held
        raise MissingLimitError(
            f"{urdf}: no {key} limit for {', '.join(joints)}, {lacking}: give it in robot.toml "
            f"({key} = {{ limit = 10.0, unit = ... }} of each joint), in task.toml ([limits] {key} = 10.0), or as "
            f'an argument (limits={{"{key}": 10.0}}); inf means no limit',
            missing,
        )
    _check(columns, names, urdf)
    return columns


def _without(limits: Array | None, names: tuple[str, ...]) -> tuple[str, ...]:
    """The joints that have no limit of a quantity, not even an explicit infinity."""
    return tuple(name for k, name in enumerate(names) if limits is None or np.isnan(limits[k]))


def limits_or_none(
    names: tuple[str, ...], units: tuple[str, ...], given: Mapping[str, Any], where: str
) -> dict[str, Array]:
    """Columns of JointLimits, SI, of a robot that no file gives limits: those of the caller, and else none."""
    columns = {key: np.full(len(names), np.inf) for key in ("upper", *QUANTITIES[1:])}
    columns["lower"] = -columns["upper"]
    _replace(columns, given, names, units, (), where)
    _check(columns, names, where)
    return columns


def _replace(
    columns: dict[str, Array],
    given: Mapping[str, Any],
    names: tuple[str, ...],
    units: tuple[str, ...],
    followers: Sequence[Follower],
    where: Path | str,
) -> None:
    """Replace limits by those of the caller, and tighten those of leaders to what their followers may do."""
    for key, value in given.items():
        checked_name("limit", key, QUANTITIES)
        led = {each.name: value[each.name] for each in followers if isinstance(value, Mapping) and each.name in value}
        own = {joint: entry for joint, entry in value.items() if joint not in led} if led else value
        if key == "position":
            pairs = per_joint("limits.position", own, names, units, size=2)
            columns["lower"], columns["upper"] = (
                _merged(columns.get("lower"), pairs[:, 0]),
                _merged(columns.get("upper"), pairs[:, 1]),
            )
        else:
            si = [unit_of(key, unit) for unit in units]
            _merge_sides(columns, key, per_side(f"limits.{key}", own, names, si))
        for follower in (each for each in followers if each.name in led):
            chosen, unit = {follower.name: led[follower.name]}, unit_of(key, follower.unit)
            limit = (
                per_joint(f"limits.{key}", chosen, [follower.name], [unit], size=2)[0]
                if key == "position"
                else per_side(f"limits.{key}", chosen, [follower.name], [unit])[:, 0]
            )
            tighten(columns, names.index(follower.leader), follower, {key: limit}, where)


def given_limits(
    given: Any,
    names: tuple[str, ...],
    units: tuple[str, ...],
    locked: Collection[str],
    followers: Sequence[Follower] = (),
) -> Mapping[str, Any]:
    """The limits that a caller gave, as a mapping: none, the mapping itself, or those of a MoveIt file.

    Raises:
        InvalidInputError: anything else, or as for :func:`~trajevo.robot.moveit_limits.read_joint_limits`.
    """
    if isinstance(given, str | Path):
        led, of_led = (tuple(each.name for each in followers), tuple(each.unit for each in followers))
        return read_joint_limits(given, names + led, units + of_led, locked)
    if not isinstance(given, Mapping | None):
        raise InvalidInputError(f"limits: expected a mapping from limits to values or a MoveIt file, got {given!r}")
    return {} if given is None else given


def _check(columns: Mapping[str, Array], names: tuple[str, ...], urdf: Path | str) -> None:
    """Refuse limits of zero, which mean "not known" in many URDFs, and empty ranges."""
    for key in QUANTITIES[1:]:
        backward = columns.get(f"{key}_backward", columns[key])
        for name, value in zip(names, np.minimum(columns[key], backward).tolist(), strict=True):
            if not value > 0.0:
                raise InvalidInputError(
                    f"{urdf}: joint {name!r}: {key}: expected a positive limit, got {value:g}: give it in robot.toml, "
                    f'in task.toml ([limits] {key} = ...), or as an argument (limits={{"{key}": ...}}); '
                    "inf means no limit"
                )
    for name, lower, upper in zip(names, columns["lower"].tolist(), columns["upper"].tolist(), strict=True):
        if not lower < upper:
            raise InvalidInputError(
                f"{urdf}: joint {name!r}: position: lower must be below upper, got {lower:g} and {upper:g}"
            )


def _of_urdf(
    model: Any,
    names: tuple[str, ...],
    followers: Sequence[Follower],
    urdf: Path,
    of_file: Mapping[str, Mapping[str, float]],
) -> dict[str, Array]:
    """Limits of the joints of a URDF that move by themselves, and what its source says of negative efforts."""
    of_model = {
        "lower": np.array(model.lowerPositionLimit),
        "upper": np.array(model.upperPositionLimit),
        "velocity": np.array(model.upperVelocityLimit),
        "effort": np.array(model.upperEffortLimit),
    }
    places = list(model.names)[1:]
    columns = {key: column[[places.index(name) for name in names]] for key, column in of_model.items()}
    if any("effort_backward" in of_file.get(name, {}) for name in names):
        efforts = zip(names, columns["effort"].tolist(), strict=True)
        backward = [of_file.get(name, {}).get("effort_backward", forward) for name, forward in efforts]
        columns["effort_backward"] = np.array(backward)
    for follower in followers:
        at = places.index(follower.name)
        own = {"position": np.array([of_model["lower"][at], of_model["upper"][at]])}
        own["velocity"] = of_model["velocity"][at : at + 1]
        tighten(columns, names.index(follower.leader), follower, own, urdf)
    return columns


def tighten(
    columns: dict[str, Array], leader: int, follower: Follower, limits: Mapping[str, Array], where: Path | str
) -> None:
    """Limit a leader, by its index, to what a joint that follows it may do; its effort is the leader's to bear."""
    for key, limit in limits.items():
        if key == "effort":
            raise InvalidInputError(
                f"limits.effort.{follower.name}: expected a joint with an actuator, but {follower}, which bears its "
                f"effort: limit that of {follower.leader!r}"
            )
        if key != "position":
            forward, backward = limit[[0, -1]] / abs(follower.multiplier)
            if follower.multiplier < 0.0:
                forward, backward = backward, forward
            other = f"{key}_backward"
            if forward != backward or other in columns:
                columns[other] = np.array(columns.get(other, columns[key]))
                columns[other][leader] = np.fmin(columns[other][leader], backward)
            columns[key][leader] = np.fmin(columns[key][leader], forward)
            continue
        ends = np.sort((limit - follower.offset) / follower.multiplier)
        columns["lower"][leader] = np.fmax(columns["lower"][leader], ends[0])
        columns["upper"][leader] = np.fmin(columns["upper"][leader], ends[1])
        if not columns["lower"][leader] < columns["upper"][leader]:
            raise InvalidInputError(
                f"{where}: joint {follower.leader!r}: position: no range is left, as {follower} and may go "
                f"from {limit[0]:g} to {limit[1]:g} {follower.unit}"
            )


def _merge_sides(columns: dict[str, Array], key: str, sides: Array) -> None:
    """Replace a limit by what is given, forward and backward, shape (2, n_joints), NaN where nothing is."""
    other = f"{key}_backward"
    before = columns.get(other, columns.get(key))
    if other in columns or not np.array_equal(sides[0], sides[1], equal_nan=True):
        columns[other] = _merged(before, sides[1])
    columns[key] = _merged(columns.get(key), sides[0])


def per_side(key: str, value: Any, names: Sequence[str], units: Sequence[str]) -> Array:
    """Limits forward and backward, shape (2, n_joints) [SI], NaN where nothing was given; as :func:`per_joint`.

    In the place of a number may stand a mapping ``{"backward": 60.0, "forward": 80.0}``: two numbers in a list would be
    read as one for each of two joints.

    Raises:
        InvalidInputError: only one of both directions, or a quantity that has one limit for both.
    """
    found = [per_joint(key, _side(key, value, way, names), names, units)[:, 0] for way in WAYS]
    return np.array(found[::-1])


def is_pair(value: Any, names: Sequence[str] = ()) -> bool:
    """Whether a value is a limit for each direction, and no mapping from joints."""
    return isinstance(value, Mapping) and bool(value) and set(value) <= set(WAYS) and not set(value) & set(names)


def _side(key: str, value: Any, way: str, names: Sequence[str]) -> Any:
    """A limit as given, with the number of one direction in the place of those of both."""
    if is_pair(value, names):
        return _chosen(key, value, way)
    if isinstance(value, list | tuple):
        return [_chosen(key, entry, way) for entry in value]
    if isinstance(value, Mapping):
        return {joint: _chosen(f"{key}.{joint}", entry, way) for joint, entry in value.items()}
    return value


def _chosen(key: str, entry: Any, way: str) -> Any:
    if not isinstance(entry, Mapping):
        return entry
    quantity_of = key.removeprefix("limits.").split(".")[0]
    if quantity_of not in DIRECTED:
        raise InvalidInputError(
            f"{key}: expected one limit for both directions, which only {', '.join(DIRECTED[:-1])} and {DIRECTED[-1]} "
            f"may have apart, got {dict(entry)!r}"
        )
    unknown = next((name for name in entry if name not in WAYS), None)
    if unknown is not None:
        raise InvalidInputError(f"{key}: unknown direction {unknown!r}; {known_names(str(unknown), WAYS)}")
    missing = next((name for name in WAYS if name not in entry), None)
    if missing is not None:
        raise InvalidInputError(f"{key}: expected backward and forward, got no {missing}")
    return entry[way]


def _merged(before: Array | None, after: Array) -> Array:
    return np.array(after) if before is None else np.where(np.isnan(after), before, after)


def per_joint(key: str, value: Any, names: Sequence[str], units: Sequence[str], *, size: int = 1) -> Array:
    """Numbers of joints from one for all, one for each in order, or a mapping from joints.

    Args:
        key: name of the argument, for messages.
        value: what was given; numbers are SI or text with a unit.
        names: the joints.
        units: SI unit of the number of each joint.
        size: how many numbers each joint has.

    Returns:
        Shape (n_joints, size) [SI], NaN where nothing was given.

    Raises:
        UnknownNameError: a joint that is none of these.
        InvalidInputError: another count of values, or what is no number in such a unit.
    """
    table = np.full((len(names), size), np.nan)
    if isinstance(value, Mapping):
        for joint in value:
            if joint not in names:
                raise UnknownNameError(f"joint in {key}", joint, names)
        chosen = value
    else:
        rows = list(value) if isinstance(value, list | tuple | np.ndarray) else [value]
        if size == 2 and len(rows) == 2 and not isinstance(rows[0], list | tuple | np.ndarray):
            rows = [rows]
        if len(rows) == 1:
            rows = rows * len(names)
        if len(rows) != len(names):
            raise InvalidInputError(f"{key}: expected 1 or {len(names)} values, got {len(rows)}")
        chosen = dict(zip(names, rows, strict=True))
    for joint, entry in chosen.items():
        k = names.index(joint)
        parts = list(entry) if isinstance(entry, list | tuple | np.ndarray) else [entry]
        if len(parts) != size:
            raise InvalidInputError(f"{key}.{joint}: expected {size} numbers, got {entry!r}")
        table[k] = [_with_unit(f"{key}.{joint}", part, units[k]) for part in parts]
    return table


def unit_of(key: str, unit: str) -> str:
    """SI unit of a limit of a joint whose positions are in ``"rad"`` or ``"m"``."""
    if key == "effort":
        return "N" if unit == "m" else "N*m"
    return per_time(unit, ("position", "velocity", "acceleration", "jerk").index(key))


def _with_unit(name: str, value: Any, unit: str) -> float:
    if value in ("inf", "-inf"):  # JSON can write infinity only as text
        return float(value)
    if isinstance(value, str):
        return quantity(value, unit, name=name)
    number = real_number(value)
    if number is None or np.isnan(number):
        raise InvalidInputError(f"{name}: expected a number [{unit}] or inf, got {value!r}")
    return believed(number, unit, name=name)
