"""Attributes of MJCF elements with those of their default classes, and the numbers that they hold."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import final
from xml.etree import ElementTree

from trajevo.errors import InvalidInputError, known_names
from trajevo.robot.urdf.file import urdf_number

#: Elements of actuators: in default classes each sets the attributes of all.
ACTUATORS = (
    "general",
    "motor",
    "position",
    "velocity",
    "intvelocity",
    "damper",
    "cylinder",
    "muscle",
    "adhesion",
    "dcmotor",
    "plugin",
)

#: Magnitude above which no number is believed, far below those whose powers are not finite.
_MOST = 1e15

#: Name of the class of elements that name none.
_MAIN = "main"

Attributes = Mapping[str, str]


@final
class Classes:
    """The default classes of a file: each has what the class around it has, and its own on top.

    Args:
        root: top element of the file.
        file: the file, for messages.

    Raises:
        InvalidInputError: a class in another one without a name, or a name that two classes have.
    """

    def __init__(self, root: ElementTree.Element, file: str) -> None:
        self._file = file
        self._classes: dict[str, dict[str, dict[str, str]]] = {_MAIN: {}}
        for top in root.iterfind("default"):
            name = top.get("class", _MAIN)
            self._add(top, name, {} if name == _MAIN else self._classes[_MAIN])

    def of(self, element: ElementTree.Element, childclass: str) -> Attributes:
        """The attributes of an element with those of its class.

        Args:
            element: a joint, a geom, a site or an actuator.
            childclass: class of the bodies around it, ``""`` for none.

        Raises:
            InvalidInputError: no such class.
        """
        name = element.get("class") or childclass or _MAIN
        if name not in self._classes:
            raise InvalidInputError(
                f"{self._file}: <{element.tag}> {element.get('name', '')!r}: class {name!r} has no <default>; "
                f"{known_names(name, self._classes)}"
            )
        return {**self._classes[name].get(_kind(element.tag), {}), **element.attrib}

    def _add(self, default: ElementTree.Element, name: str, inherited: dict[str, dict[str, str]]) -> None:
        if name in self._classes and name != _MAIN:
            raise InvalidInputError(f"{self._file}: <default>: expected one class {name!r}, got several")
        own = {tag: dict(given) for tag, given in (self._classes[_MAIN] if name == _MAIN else inherited).items()}
        self._classes[name] = own
        for element in default:
            if element.tag != "default":
                own.setdefault(_kind(element.tag), {}).update(element.attrib)
        for inner in default.iterfind("default"):
            if not inner.get("class"):
                raise InvalidInputError(f"{self._file}: <default>: expected a class for one inside {name!r}, got none")
            self._add(inner, inner.get("class", ""), own)


def _kind(tag: str) -> str:
    return ACTUATORS[0] if tag in ACTUATORS else tag


def numbers_of(given: Attributes, key: str, where: str, *, counts: Sequence[int]) -> tuple[float, ...] | None:
    """The numbers of an attribute, None if it is not there.

    Args:
        given: attributes.
        key: name of the attribute.
        where: what the attributes belong to, for messages.
        counts: how many numbers there may be.

    Raises:
        InvalidInputError: what is no number, or another count of them.
    """
    if key not in given:
        return None
    parts = [urdf_number(part) for part in given[key].split()]
    found = tuple(part for part in parts if part is not None and abs(part) < _MOST)
    if len(found) != len(parts) or len(found) not in counts:
        expected = str(counts[0]) if len(counts) == 1 else f"{counts[0]} to {counts[-1]}"
        raise InvalidInputError(f"{where}: {key}: expected {expected} numbers below {_MOST:g}, got {given[key]!r}")
    return found


def number_of(given: Attributes, key: str, where: str, usual: float) -> float:
    """The number of an attribute, ``usual`` if it is not there."""
    found = numbers_of(given, key, where, counts=(1,))
    return usual if found is None else found[0]


def is_on(given: Attributes, key: str, where: str, *, auto: bool) -> bool:
    """A switch ``"true"`` or ``"false"``, and ``auto`` if it is ``"auto"`` or not there.

    Raises:
        InvalidInputError: another value.
    """
    value = given.get(key, "auto")
    if value not in ("true", "false", "auto"):
        raise InvalidInputError(f"{where}: {key}: expected true, false or auto, got {value!r}")
    return auto if value == "auto" else value == "true"
