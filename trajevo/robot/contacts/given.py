"""Grip and stand as files and callers give them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import numpy as np

from trajevo.base.units import quantity
from trajevo.errors import InvalidInputError, checked_name
from trajevo.robot.contacts.grip import GRIP_UNITS, Grip
from trajevo.robot.contacts.stand import STAND_UNITS, Stand

_Record = TypeVar("_Record", Grip, Stand)


def grip_of(given: Any, at: Callable[..., str] = lambda *names: ".".join(("grip", *names))) -> Grip | None:
    """The grip that a caller or a file gave.

    Args:
        given: a grip, a mapping from its attributes to numbers in SI or text with a unit, or None.
        at: beginning of a message about it, or about the attribute that is its argument.

    Raises:
        InvalidInputError: anything else, or a grip that there cannot be.
        UnknownNameError: another name of an attribute.
    """
    return _made(Grip, given, GRIP_UNITS, at)


def stand_of(given: Any, at: Callable[..., str] = lambda *names: ".".join(("stand", *names))) -> Stand | None:
    """The stand that a caller or a file gave; arguments and errors are those of :func:`grip_of`."""
    return _made(Stand, given, STAND_UNITS, at)


def contacts_of(declared: Mapping[str, Any], *, grip: Any, stand: Any) -> dict[str, Any]:
    """Grip and stand of a robot: those that a caller gave, or what a file declares."""
    found = {"grip": grip_of(grip), "stand": stand_of(stand)}
    return {name: declared.get(name) if given is None else given for name, given in found.items()}


def plain_contacts(**given: Any) -> dict[str, Any]:
    """Grip and stand that a caller gave as plain data."""
    return {name: _plain(one) for name, one in given.items()}


def _plain(given: Any) -> Any:
    if not isinstance(given, Grip | Stand):
        return given
    told = {name: getattr(given, name) for name in given.names()}
    return {name: _listed(value) for name, value in told.items() if value is not None and value != ""}


def _made(kind: type[_Record], given: Any, units: Mapping[str, str], at: Callable[..., str]) -> _Record | None:
    if given is None or isinstance(given, kind):
        return given
    if not isinstance(given, Mapping):
        raise InvalidInputError(f"{at()}: expected a mapping from {', '.join(kind.names())}, got {given!r}")
    found = {}
    for name, value in given.items():
        checked_name(f"key of {at()}", name, kind.names())
        if value is not None:
            found[name] = _si(value, units[name], at(name)) if name in units else value
    needed = [name for name in kind.needed() if name not in found]
    if needed:
        raise InvalidInputError(f"{at(needed[0])}: this key is missing")
    try:
        return kind(**found)
    except InvalidInputError as error:
        raise InvalidInputError(f"{at(str(error).partition(':')[0])}{str(error)[str(error).index(':') :]}") from error


def _si(value: Any, unit: str, name: str) -> Any:
    """A number, or numbers, in SI; what is neither is as it is."""
    if isinstance(value, str):
        return quantity(value, unit, name=name)
    if isinstance(value, list | tuple | np.ndarray):
        return [_si(entry, unit, name) for entry in value]
    return value


def _listed(value: Any) -> Any:
    return [_listed(entry) for entry in value] if isinstance(value, tuple) else value
