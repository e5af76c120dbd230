"""Registries of objects chosen by name: trajevo's own, those of installed packages by entry points, the user's own."""

from __future__ import annotations

import importlib
import os
import sys
import warnings
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from importlib import metadata
from importlib.metadata import EntryPoint, EntryPoints
from typing import Any, Generic, TypeVar, final

from trajevo.base.own.code import known_at
from trajevo.errors import InvalidInputError, checked_name

T = TypeVar("T")

#: The distribution whose entry points take precedence over those of others with the same name.
_OWN = "trajevo"


@final
@dataclass(frozen=True, eq=False)
class Registry(Generic[T]):
    """Objects of one kind by name. A name that trajevo itself uses always means trajevo's object.

    Attributes:
        kind: what one object is called, such as ``"objective"``.
        group: entry-point group in which other packages register theirs.
        own: trajevo's own objects by name.
        expected: what must be registered, for messages, such as ``"a trajevo.Objective"``.
        fits: whether an object is of that kind.
        made: place and what the user has there, such as a function -> the object; None if it must be one.
    """

    kind: str
    group: str
    own: Mapping[str, T]
    expected: str
    fits: Callable[[Any], bool]
    made: Callable[[str, Any], T] | None = None

    def names(self) -> list[str]:
        """All available names, those of other packages last."""
        return [*self.own, *(name for name in registered(self.group) if name not in self.own)]

    def find(self, name: object) -> T:
        """The object with a name, or at a place ``module:name`` that :func:`trajevo.base.own.code.named` has looked up.

        Raises:
            UnknownNameError: no object has that name.
            InvalidInputError: another package registers something that cannot be used, or the user's is no such thing.
        """
        if isinstance(name, str) and name in self.own:
            return self.own[name]
        thing = known_at(name)
        if thing is not None:
            return self._of_user(str(name), thing)
        points = registered(self.group)
        asked = checked_name(self.kind, name, [*self.own, *points])
        return self._loaded(points[asked])

    def all(self) -> dict[str, T]:
        """All usable objects by name, with a warning for each unusable object that another package registers."""
        found = dict(self.own)
        for name, point in registered(self.group).items():
            if name in self.own:
                continue
            try:
                found[name] = self._loaded(point)
            except InvalidInputError as error:
                warnings.warn(str(error), stacklevel=2)
        return found

    def _of_user(self, place: str, thing: Any) -> T:
        if self.fits(thing):
            found: T = thing
        elif self.made is not None:
            found = self.made(place, thing)
        else:
            raise InvalidInputError(
                f"{argument_of(self.kind)}: {place!r}: expected {self.expected}, got {told_kind(thing)}"
            )
        name = getattr(found, "name", "")
        if isinstance(name, str) and name in self.own:
            raise InvalidInputError(
                f"{argument_of(self.kind)}: {place!r}: expected another name than {name!r}, which is trajevo's own"
            )
        return found

    def _loaded(self, point: EntryPoint) -> T:
        found: T = loaded(point, self.kind, self.expected, self.fits)
        name = getattr(found, "name", point.name)
        if isinstance(name, str) and name != point.name:
            raise InvalidInputError(f"{self.kind} {point.name!r}: {point.value} is named {name!r}; the two must agree")
        return found


def registered(group: str) -> dict[str, EntryPoint]:
    """Entry points of a group by name, in the order of their names.

    Raises:
        InvalidInputError: two packages other than trajevo register different things under one name.
    """
    found: dict[str, EntryPoint] = {}
    for point in sorted(entry_points(group=group), key=lambda point: (point.name, not _is_own(point))):
        first = found.setdefault(point.name, point)
        if first.value != point.value and not _is_own(first):
            raise InvalidInputError(
                f"{group}: two packages register {point.name!r}, as {first.value} and as {point.value}; uninstall one"
            )
    return found


def entry_points(*, group: str) -> Iterable[EntryPoint]:
    """Entry points of a group, of all packages that are installed now."""
    changed = []
    for folder in sys.path:
        with suppress(OSError):
            changed.append(os.stat(folder or ".").st_mtime_ns)
    found: EntryPoints = _installed(tuple(sys.path), tuple(changed)).select(group=group)
    return found


@lru_cache(maxsize=1)
def _installed(path: tuple[str, ...], changed: tuple[int, ...]) -> Any:
    """All entry points, of which one can select; read again if a folder of the path changes.

    Reading opens a file of every package. What is returned is called EntryPoints only since Python 3.12.
    """
    return metadata.entry_points()


def loaded(point: EntryPoint, kind: str, expected: str, fits: Callable[[Any], bool]) -> Any:
    """The object that an entry point refers to.

    Args:
        point: the entry point.
        kind: what the object is called, for the message.
        expected: what the object must be, for the message.
        fits: whether an object is that.

    Raises:
        InvalidInputError: the object cannot be imported, or is of another kind.
    """
    try:
        found = point.load()
    except (ImportError, AttributeError) as error:
        raise InvalidInputError(f"{kind} {point.name!r}: {point.value} cannot be imported: {error}") from error
    if not fits(found):
        raise InvalidInputError(f"{kind} {point.name!r}: {point.value} is not {expected}")
    return found


def plain_name(kind: str, place: str, function: Any, remedy: str) -> str:
    """The name of a user's function, which is also that of its column in tables.

    Args:
        kind: what it is given as, for messages.
        place: where it is.
        function: the function.
        remedy: what to write for one without a name.

    Raises:
        InvalidInputError: no function, or one without a name.
    """
    if not callable(function) or isinstance(function, type):
        raise InvalidInputError(
            f"{argument_of(kind)}: {place!r}: expected a function of a rollout, or {remedy}, got {told_kind(function)}"
        )
    name = getattr(function, "__name__", "")
    if not name.isidentifier():
        raise InvalidInputError(f"{argument_of(kind)}: {place!r}: expected a function with a name; give {remedy}")
    return name


def argument_of(kind: str) -> str:
    """The argument, and key of a task, in which things of a kind are named."""
    return kind if kind == "interpolant" else f"{kind}s"


def first_line(function: Any) -> str:
    """The first line of a function's docstring, without its full stop."""
    return (getattr(function, "__doc__", None) or "").strip().partition("\n")[0].rstrip(".")


def told_kind(thing: Any) -> str:
    """What something is, for messages."""
    return f"the class {thing.__name__}" if isinstance(thing, type) else type(thing).__name__


def _is_own(point: EntryPoint) -> bool:
    return _name(point.dist) == _OWN


@lru_cache(maxsize=256)
def _name(distribution: Any) -> str | None:
    """The name of a distribution, for which its whole description is parsed."""
    return getattr(distribution, "name", None)


def deferred(name: str) -> Any:
    """A package that is imported when something of it is first used, in place of the module itself."""
    return _Deferred(name)


@final
class _Deferred:
    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, attribute: str) -> Any:
        return getattr(importlib.import_module(self._name), attribute)
