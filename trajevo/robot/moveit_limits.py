"""MoveIt's ``joint_limits.yaml``, read in the forms in which it is met, and written.

Numbers are read as YAML 1.2 and ROS read them, not as YAML 1.1: ``5e3`` is a number, ``1:30`` and ``010`` are refused,
since they mean different numbers to different programs.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from trajevo.base.files import read_bytes, why_not
from trajevo.base.toml import shortened
from trajevo.base.units import believed, per_time, quantity, to_si, with_unit
from trajevo.errors import InvalidInputError, known_names, no_such_file
from trajevo.robot.joints import DIRECTED, JointLimits

#: Limit of trajevo -> MoveIt's flag and keys.
_KEYS = {
    "position": ("has_position_limits", ("min_position", "max_position")),
    "velocity": ("has_velocity_limits", ("max_velocity",)),
    "acceleration": ("has_acceleration_limits", ("max_acceleration",)),
    "jerk": ("has_jerk_limits", ("max_jerk",)),
    "effort": ("has_effort_limits", ("max_effort",)),
}

#: Pilz's limit of braking, a negative number; a motion of trajevo keeps it and the other alike.
_BRAKING = ("has_deceleration_limits", ("max_deceleration",))

#: MoveIt's scaling factors -> the limit that each one multiplies, for all joints.
_SCALES = {
    "default_velocity_scaling_factor": "velocity",
    "default_acceleration_scaling_factor": "acceleration",
}

_ORDERS = ("position", "velocity", "acceleration", "jerk")
_KNOWN = {key for flag, keys in (*_KEYS.values(), _BRAKING) for key in (flag, *keys)} | {"angle_wraparound"}

#: Entries of a file, also those that references repeat, and how deep they may lie in each other.
_MOST_ENTRIES, _MOST_DEPTH = 20_000, 12

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
#: Numbers of YAML 1.1 that later versions read otherwise: octal, sexagesimal, with underscores, hexadecimal, binary.
_OLD_NUMBER = re.compile(r"[+-]?(0[0-7_]+|0o[0-7]+|[0-9][0-9_]*(:[0-5]?[0-9])+(\.[0-9_]*)?|[0-9]+_[0-9_.]*|0[xb]\w+)")
_ROS_ANGLE = re.compile(r"(deg|rad)\(([^()]*)\)")
_TAGS = {"!degrees": "deg", "!radians": "rad"}
_PLAIN_TAGS = {f"tag:yaml.org,2002:{kind}" for kind in ("str", "int", "float", "bool", "null", "timestamp", "value")}
_TRUTHS = {"true": True, "yes": True, "on": True, "false": False, "no": False, "off": False}


@dataclass(frozen=True)
class _Entry:
    """A value of the file: its line, and a mapping, a number, a truth value or text; for an angle its unit."""

    line: int
    value: Any
    angle: str = ""

    def __str__(self) -> str:
        return shortened("a mapping" if isinstance(self.value, dict) else repr(self.value))


def read_joint_limits(
    file: str | Path, names: tuple[str, ...], units: tuple[str, ...], locked: Collection[str] = ()
) -> dict[str, dict[str, Any]]:
    """Limits of a MoveIt file, as :func:`examined_joint_limits` finds them.

    Raises:
        InvalidInputError: the file is not of this kind, or the first thing that is wrong with it.
    """
    found, problems = examined_joint_limits(file, names, units, locked)
    if problems:
        raise InvalidInputError(problems[0])
    return found


def examined_joint_limits(
    file: str | Path, names: tuple[str, ...], units: tuple[str, ...], locked: Collection[str] = ()
) -> tuple[dict[str, dict[str, Any]], list[str]]:
    """Limits of a MoveIt file, and everything that is wrong with them, one sentence each.

    Limits are as :func:`trajevo.robot.robot.load_robot` takes them: limit -> joint -> value, SI; those that are wrong
    are left out. A problem is a joint that the robot does not have, an unknown key, a value that is missing or not a
    number, or a factor for a joint whose limit is not in the file; its sentence names the line.

    The mapping ``joint_limits`` may lie in the mappings of a file of ROS parameters. A limit whose ``has_...`` is false
    is infinite. A limit counts as not given if the file does not mention it, or if ``has_...`` is false beside a
    number, which MoveIt's setup assistant writes for limits that nobody has filled in. The default scaling factors are
    applied, as in MoveIt. Of the limits of acceleration and deceleration the lower one holds, as a motion of trajevo
    keeps one limit in both directions.

    Args:
        file: YAML with ``joint_limits``; numbers are SI, or angles such as ``!degrees 90.0`` and ``deg(90.0)``.
        names: joints of the robot.
        units: ``"rad"`` or ``"m"`` of each.
        locked: locked joints; their entries are ignored.

    Raises:
        InvalidInputError: the file cannot be read, holds no limits of joints, or gives a key twice; the message names
            the line.
    """
    problems: list[str] = []
    around = _around_joint_limits(_content(Path(file)), str(file))
    scales = dict.fromkeys(_KEYS, 1.0)
    for key, entry in around.items():
        if key == "joint_limits":
            continue
        with _collected(problems):
            _check_key(key, ["joint_limits", *_SCALES], f"{file}: line {entry.line}")
            scales[_SCALES[key]] = _number(entry, f"{file}: line {entry.line}: {key}", least=0.0)
    found: dict[str, dict[str, Any]] = {}
    for joint, entry in around["joint_limits"].value.items():
        if joint in locked:
            continue
        if joint not in names:
            problems.append(f"{file}: line {entry.line}: unknown joint {joint!r}; {known_names(joint, names)}")
            continue
        for limit, value in _of_joint(entry, str(file), joint, units[names.index(joint)], scales, problems).items():
            found.setdefault(limit, {})[joint] = value
    for key, limit in _SCALES.items():
        elsewhere = [name for name in names if name not in found.get(limit, {})]
        if scales[limit] != 1.0 and elsewhere:
            problems.append(f"{file}: {key}: expected the {limit} limit of {elsewhere[0]!r} too, to scale it")
    return found, problems


@contextmanager
def _collected(problems: list[str]) -> Iterator[None]:
    """Add the sentence of a refusal to the problems instead of raising it."""
    try:
        yield
    except InvalidInputError as error:
        problems.append(str(error))


def _of_joint(
    entry: _Entry, file: str, joint: str, unit: str, scales: dict[str, float], problems: list[str]
) -> dict[str, Any]:
    """Limits of one joint: a number or text with a unit, a pair of them for positions; what is wrong is a problem."""
    if not isinstance(entry.value, dict):
        problems.append(f"{file}: line {entry.line}: {joint}: expected a mapping of limits, got {entry}")
        return {}
    for key, given in entry.value.items():
        with _collected(problems):
            _check_key(key, _KNOWN, f"{file}: line {given.line}: {joint}")
    found: dict[str, Any] = {}
    for limit, (flag, keys) in _KEYS.items():
        si = "" if limit == "effort" else per_time(unit, _ORDERS.index(limit))
        with _collected(problems):
            values = _values(entry, flag, keys, f"{joint}: ", file, si, scales[limit])
            if values is not None:
                found[limit] = values if limit == "position" else values[0]
    with _collected(problems):
        _brake(entry, file, joint, unit, scales["acceleration"], found)
    return found


def _brake(entry: _Entry, file: str, joint: str, unit: str, scale: float, found: dict[str, Any]) -> None:
    """Replace the limit of acceleration by that of deceleration, if that is lower."""
    si = per_time(unit, 2)
    braking = _values(entry, *_BRAKING, f"{joint}: ", file, si, scale)
    if braking is None or braking[0] == math.inf:
        return
    if "acceleration" in found:
        least = min((found["acceleration"], braking[0]), key=lambda value: abs(_plain(value, si)))
        found["acceleration"] = with_unit(abs(_plain(least, si)), si) if isinstance(least, str) else abs(least)
    elif "max_acceleration" not in entry.value:
        raise InvalidInputError(
            f"{file}: line {entry.line}: {joint}: expected max_acceleration beside max_deceleration"
        )


def _plain(value: float | str, si: str) -> float:
    return quantity(value, si, name="limit") if isinstance(value, str) else value


def _values(
    entry: _Entry, flag: str, keys: tuple[str, ...], joint: str, file: str, si: str, scale: float
) -> tuple[Any, ...] | None:
    """The numbers of a limit, infinite if it is switched off, or None if it is not given."""
    given = {key: entry.value[key] for key in keys if key in entry.value}
    has = entry.value.get(flag, _Entry(entry.line, bool(given)))
    where = f"{file}: line {has.line}: {joint}"
    if not isinstance(has.value, bool):
        raise InvalidInputError(f"{where}{flag}: expected true or false, got {has}")
    if has.value and len(given) < len(keys):
        missing = next(key for key in keys if key not in given)
        raise InvalidInputError(f"{where}{flag} is true, but {missing} is missing")
    if has.value:
        return tuple(_si(one, f"{file}: line {one.line}: {joint}{key}", si, scale) for key, one in given.items())
    if flag in entry.value and not given:
        return (-math.inf, math.inf) if len(keys) == 2 else (math.inf,)
    return None


def _si(entry: _Entry, where: str, si: str, scale: float) -> float | str:
    """A number in SI; as text with its unit if it is an angle that would not be believed without."""
    value = _number(entry, where)
    if not entry.angle:
        try:
            return believed(value, si, name=where) * scale
        except InvalidInputError:
            meant = f"write !degrees {value:g}, or !radians {value:g} if it is meant"
            likely = f"looks like degrees: {meant}" if si.startswith("rad") else "looks like millimetres"
            raise InvalidInputError(f"{where}: {value:g} {si} {likely}") from None
    if not si.startswith("rad"):
        raise InvalidInputError(f"{where}: expected a number{f' [{si}]' if si else ''}, got an angle")
    return with_unit(value * to_si(entry.angle) * scale, si)


def _number(entry: _Entry, where: str, least: float = -math.inf) -> float:
    value = entry.value
    if not isinstance(value, float) or not math.isfinite(value) or value <= least:
        kind = "a finite number" if least == -math.inf else f"a finite number above {least:g}"
        raise InvalidInputError(f"{where}: expected {kind}, got {f'{value:g}' if isinstance(value, float) else entry}")
    return value


def _check_key(key: str, known: Collection[str], where: str) -> None:
    if key not in known:
        raise InvalidInputError(f"{where}: unknown key {key!r}; {known_names(key, known)}")


def _around_joint_limits(content: _Entry, file: str) -> dict[str, _Entry]:
    """The mapping that holds ``joint_limits``: the file, or one inside it, as of a node's ROS parameters."""

    def holders(entry: _Entry) -> Iterator[dict[str, _Entry]]:
        if not isinstance(entry.value, dict):
            return
        inner = entry.value.get("joint_limits")
        if inner is not None and isinstance(inner.value, dict):
            yield entry.value
            return
        for one in entry.value.values():
            yield from holders(one)

    found = list(holders(content))
    if len(found) != 1:
        keys = ", ".join(map(repr, content.value)) if isinstance(content.value, dict) and content.value else "none"
        got = f"{len(found)} of them" if found else f"the keys {keys}"
        raise InvalidInputError(
            f"{file}: expected a mapping 'joint_limits' from joints to limits, got {shortened(got)}"
        )
    return found[0]


def _content(file: Path) -> _Entry:
    """The content of a YAML file, every value with its line."""
    import yaml  # imported where it reads and writes, since that takes long

    try:
        text = read_bytes(file).decode("utf-8-sig")
        node = yaml.compose(text, Loader=yaml.SafeLoader)
    except FileNotFoundError:
        raise InvalidInputError(no_such_file(file)) from None
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        at = f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""
        raise InvalidInputError(f"{file}: {at}cannot be read as YAML: {error.problem or error.context}") from error
    except InvalidInputError:
        raise
    except (OSError, ValueError, yaml.YAMLError) as error:
        raise InvalidInputError(f"{file}: cannot be read as YAML: {why_not(error)}") from error
    except RecursionError as error:
        raise InvalidInputError(f"{file}: cannot be read as YAML: {_TOO_DEEP}") from error
    if node is None:
        return _Entry(1, {})
    return _Reader(file).entry(node, _MOST_DEPTH)


_TOO_DEEP = f"expected mappings at most {_MOST_DEPTH} deep in each other"


class _Reader:
    """Turns the nodes of a YAML file into entries."""

    def __init__(self, file: Path) -> None:
        self.file, self.left = file, _MOST_ENTRIES

    def entry(self, node: Any, depth: int) -> _Entry:
        line = node.start_mark.line + 1
        self.left -= 1
        if depth == 0 or self.left < 0:
            many = f"expected at most {_MOST_ENTRIES} entries with all references written out"
            raise InvalidInputError(f"{self.file}: line {line}: {_TOO_DEEP if depth == 0 else many}")
        if node.id == "mapping":
            return _Entry(line, self._mapping(node, depth))
        if node.id == "sequence":
            return _Entry(line, [self.entry(one, depth - 1).value for one in node.value])
        return self._scalar(node, line)

    def _mapping(self, node: Any, depth: int) -> dict[str, _Entry]:
        found: dict[str, _Entry] = {}
        merged: dict[str, _Entry] = {}
        for key, value in node.value:
            at = f"{self.file}: line {key.start_mark.line + 1}"
            if key.tag == "tag:yaml.org,2002:merge":
                for one in value.value if value.id == "sequence" else [value]:
                    inner = self.entry(one, depth - 1).value
                    if not isinstance(inner, dict):
                        raise InvalidInputError(f"{at}: <<: expected a mapping to merge")
                    merged = inner | merged
                continue
            if key.id != "scalar":
                raise InvalidInputError(f"{at}: expected a name as key, got a {key.id}")
            if key.value in found:
                raise InvalidInputError(f"{at}: {key.value!r} is given twice, first in line {found[key.value].line}")
            found[key.value] = self.entry(value, depth - 1)
        return merged | found

    def _scalar(self, node: Any, line: int) -> _Entry:
        text, angle = str(node.value).strip(), _TAGS.get(node.tag, "")
        at = f"{self.file}: line {line}"
        if node.tag not in _PLAIN_TAGS and not angle:
            raise InvalidInputError(f"{at}: unknown tag {node.tag!r}; {known_names(node.tag, _TAGS)}")
        written = _ROS_ANGLE.fullmatch(text)
        if written and not angle and node.style is None:
            angle, text = written[1], written[2].strip()
        if node.style is not None and not angle:  # text in quotes
            return _Entry(line, text)
        if _OLD_NUMBER.fullmatch(text):
            raise InvalidInputError(
                f"{at}: expected a decimal number, got {text!r}, which different programs read as different numbers"
            )
        if _NUMBER.fullmatch(text):
            return _Entry(line, float(text), angle)
        if angle:
            raise InvalidInputError(f"{at}: expected an angle as a number of {angle}, got {text!r}")
        return _Entry(line, _TRUTHS.get(text.lower(), text))


def write_joint_limits(limits: JointLimits, names: tuple[str, ...]) -> str:
    """Limits as a MoveIt file; an infinite one is written as ``has_...: false``. MoveIt ignores jerk and effort.

    Of a limit that differs by direction, which the format cannot hold, the lesser is written and a comment says so.
    """
    import yaml  # imported where it reads and writes, since that takes long

    joints: dict[str, dict[str, Any]] = {}
    for k, name in enumerate(names):
        joint = joints.setdefault(name, {})
        for limit, (flag, keys) in _KEYS.items():
            columns = (limits.lower, limits.upper) if limit == "position" else (limits.sides(limit).lesser,)
            values = [float(column[k]) for column in columns]
            joint[flag] = all(map(math.isfinite, values))
            if joint[flag]:
                joint |= dict(zip(keys, values, strict=True))
    text: str = yaml.safe_dump({"joint_limits": joints}, sort_keys=False)
    return "".join(f"# {told}\n" for told in _one_of_both(limits, names)) + text


def _one_of_both(limits: JointLimits, names: tuple[str, ...]) -> Iterator[str]:
    """Sentences about the limits that differ by direction."""
    for limit in DIRECTED:
        sides = limits.sides(limit)
        for name, backward, forward in zip(names, sides.backward.tolist(), sides.forward.tolist(), strict=True):
            if backward != forward:
                yield (
                    f"{limit} of {name}: {backward:g} backward and {forward:g} forward; MoveIt has one limit for both "
                    "directions, so that the lesser is written"
                )
