"""One line that tells what an object is: dataclasses of arrays would fill pages of a notebook."""

from __future__ import annotations

import dataclasses
import reprlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, final

import numpy as np

from trajevo.errors import one_line

#: Greatest length of a line.
MOST = 200

#: Greatest length of a value in it, and greatest number of entries of a sequence or a mapping.
_VALUE, _ENTRIES = 60, 4

#: Types of numbers and texts, and of collections: what equals its default is left out.
_PLAIN, _COLLECTIONS = (str, int, float), (tuple, list, dict)


def cut(text: str, most: int = MOST) -> str:
    """Text on one line, without its end if that is longer than ``most`` characters."""
    line = one_line(text)
    return line if len(line) <= most else f"{line[: most - 1]}…"


def brief(record: Any) -> str:
    """A dataclass, or a model of pydantic, as one line: its class, and as many of its fields as fit.

    Arrays are told by their shapes, records in it by their classes, and fields that have their defaults are left out.
    It is meant as the ``__repr__`` of a class: ``__repr__ = brief``.
    """
    said, name = "", type(record).__name__
    for field, value in _fields(record):
        more = f"{', ' if said else ''}{field}={_SHORT.repr(value)}"
        if len(name) + len(said) + len(more) > MOST - len("(, …)"):
            return f"{name}({said}{', ' if said else ''}…)"
        said += more
    return f"{name}({said})"


def _fields(record: Any) -> Iterator[tuple[str, Any]]:
    """Names and values of the fields that do not have their defaults."""
    if dataclasses.is_dataclass(record):
        declared = [(field.name, field.default) for field in dataclasses.fields(record) if field.repr]
    else:
        declared = [(name, field.default) for name, field in type(record).model_fields.items()]
    for name, default in declared:
        value = getattr(record, name)
        if not _same(value, default):
            yield name, value


def _same(value: Any, default: Any) -> bool:
    """Whether a value is the default of its field; arrays and what holds some are not compared."""
    if type(value) is not type(default):
        return False
    if isinstance(value, _COLLECTIONS):
        return not value and not default
    return value is default or (isinstance(value, _PLAIN) and value == default)


@final
class _Short(reprlib.Repr):
    """Values of fields: short ones as Python writes them, of all others what they are."""

    def __init__(self) -> None:
        super().__init__()
        self.maxlevel = 2
        self.maxstring = self.maxother = _VALUE
        self.maxtuple = self.maxlist = self.maxdict = self.maxset = self.maxfrozenset = _ENTRIES

    def repr1(self, x: Any, level: int) -> str:
        """A value at a level of nesting, on one line."""
        return cut(super().repr1(x, level), _VALUE)

    def repr_instance(self, x: Any, level: int) -> str:
        """Whatever is neither a number, a text nor a sequence or mapping of Python."""
        del level
        if isinstance(x, np.ndarray):
            return f"<array {'×'.join(map(str, x.shape))}>"
        if isinstance(x, np.generic):
            return repr(x.item())
        if isinstance(x, Path):
            return repr(str(x))
        if getattr(type(x), "__repr__", None) is brief:
            return f"{type(x).__name__}(…)"
        if callable(x) and hasattr(x, "__qualname__"):
            return f"<{x.__qualname__}>"
        if isinstance(x, Sequence):  # may compute what it holds when it is read
            return f"<{len(x)} {type(x).__name__}>"
        text = one_line(repr(x))
        return text if len(text) <= _VALUE else f"{type(x).__name__}(…)"


_SHORT = _Short()
