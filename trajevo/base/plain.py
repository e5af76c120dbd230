"""Plain data: what JSON and TOML can hold, so that it is equal after it is written to a file and read again; and XML.

Files of such data may come from strangers: their size, their depth, and the memory that they unpack to are bounded
before that memory is taken.
"""

from __future__ import annotations

import io
import json
import math
import re
import struct
import sys
import tomllib
import zipfile
import zlib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path, PurePath
from typing import Any
from xml.etree import ElementTree

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.files import MOST_DATA, read_bytes
from trajevo.errors import InvalidInputError

#: Greatest depth of lists and tables in each other.
MOST_LEVELS = 32

#: Greatest depth of XML elements in each other; those of a URDF are seven deep.
MOST_DEEP = 100

#: Greatest number of arrays in a file.
_MOST_ARRAYS = 10_000

#: Beginning of an array of numpy's format 1.0, and its header: numbers or text, and nothing that could be executed.
_NPY = b"\x93NUMPY\x01\x00"
_HEADER = re.compile(
    rb"\{'descr': '([<>|][biufU]\d{1,9})', 'fortran_order': (True|False), 'shape': \(([\d, ]{0,200})\), \}\s*"
)


def plain_data(place: str, value: Any, *, levels: int = MOST_LEVELS) -> Any:
    """Data as numbers, texts, lists and tables; arrays and tuples become lists, numbers of numpy those of Python.

    Args:
        place: where the data comes from, with which messages begin.
        value: the data.
        levels: how deep lists and tables may lie in each other.

    Raises:
        InvalidInputError: anything else, a number that is not finite, text that is no Unicode, or data that is deeper.
    """
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, PurePath):
        value = str(value)
    if isinstance(value, Mapping | list | tuple) and not levels:
        raise InvalidInputError(f"{place}: expected lists and tables at most {MOST_LEVELS} deep in each other")
    if isinstance(value, Mapping):
        entries = value.items()
        return {_text(place, str(key)): plain_data(f"{place}.{key}", each, levels=levels - 1) for key, each in entries}
    if isinstance(value, list | tuple):
        return [plain_data(place, entry, levels=levels - 1) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        raise InvalidInputError(f"{place}: expected finite numbers, got {value}; for no limit, write the text 'inf'")
    if isinstance(value, str):
        return _text(place, value)
    if value is None or isinstance(value, bool | int | float):
        return value
    raise InvalidInputError(f"{place}: expected a number, text, list or table, got {type(value).__name__}")


def _text(place: str, value: str) -> str:
    try:
        value.encode()
    except UnicodeEncodeError as error:
        raise InvalidInputError(f"{place}: expected text that can be written as UTF-8, got {value!r}") from error
    return value


def from_json(text: str) -> Any:
    """The data of a JSON text.

    Raises:
        ValueError: it is no JSON, or deeper than :data:`MOST_LEVELS`.
    """
    return _parsed(json.loads, text)


def from_toml(text: str, *, parse_float: Callable[[str], Any] = float) -> dict[str, Any]:
    """The data of a TOML text.

    Args:
        text: the text.
        parse_float: what makes a number of what is written.

    Raises:
        ValueError: it is no TOML, or deeper than :data:`MOST_LEVELS`; ``TOMLDecodeError`` names line and column.
    """
    found: dict[str, Any] = _parsed(partial(tomllib.loads, parse_float=parse_float), text)
    return found


def _parsed(parse: Callable[[str], Any], text: str) -> Any:
    try:
        found = parse(text)
    except RecursionError as error:
        raise ValueError(_TOO_DEEP) from error
    except ValueError as error:
        if "integer string conversion" in str(error):
            raise ValueError(f"expected whole numbers of at most {sys.get_int_max_str_digits()} digits") from error
        raise
    level = [found]
    for _ in range(MOST_LEVELS + 1):
        level = [entry for each in level for entry in _inside(each) if isinstance(entry, dict | list)]
        if not level:
            return found
    raise ValueError(_TOO_DEEP)


_TOO_DEEP = f"expected lists and tables at most {MOST_LEVELS} deep in each other"


def _inside(value: Any) -> Iterator[Any]:
    yield from value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()


def parsed_xml(content: bytes, file: Path) -> ElementTree.Element:
    """The top element of an XML file.

    Raises:
        InvalidInputError: it is not XML, declares entities, which could unpack to any size, or is deeper than
            :data:`MOST_DEEP`.
    """
    try:
        top = ElementTree.fromstring(content, ElementTree.XMLParser(target=_Builder()))
    except InvalidInputError as error:
        raise InvalidInputError(f"{file}: {error}") from error
    except (LookupError, ValueError, ElementTree.ParseError) as error:
        raise InvalidInputError(f"{file}: cannot be read as XML: {error}") from error
    found: ElementTree.Element = top
    return found


class _Builder(ElementTree.TreeBuilder):
    """Builds elements, of a document without declarations and not too deep."""

    def __init__(self) -> None:
        super().__init__()
        self._depth = 0

    def start(self, tag: Any, attrs: Any) -> ElementTree.Element:
        self._depth += 1
        if self._depth > MOST_DEEP:
            raise InvalidInputError(f"expected XML elements at most {MOST_DEEP} deep in each other")
        return super().start(tag, attrs)

    def end(self, tag: str) -> ElementTree.Element:
        self._depth -= 1
        return super().end(tag)

    def doctype(self, *_: object) -> None:
        raise InvalidInputError("expected XML without <!DOCTYPE>, whose entities could unpack to any size")


def read_arrays(file: Path) -> dict[str, Array]:
    """The arrays of numbers and text of a file of ``numpy.savez``, of which nothing is executed.

    Args:
        file: the file; its arrays take at most :data:`~trajevo.base.files.MOST_DATA` bytes together.

    Raises:
        OSError: it cannot be read.
        InvalidInputError: it is no such file, an array is damaged, given twice or holds objects, or it is too large.
    """
    content = read_bytes(file, most=MOST_DATA)
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            entries = archive.infolist()
            _check_entries(entries)
            return {entry.filename.removesuffix(".npy"): _array(archive, entry) for entry in entries}
    except InvalidInputError as error:
        raise InvalidInputError(f"{file}: is damaged or no file of arrays: {error}") from error
    # Whatever a reader of zip files may raise for bytes that are not theirs.
    except (ArithmeticError, LookupError, RuntimeError, TypeError, ValueError, OSError, EOFError, struct.error,
            zipfile.BadZipFile, zipfile.LargeZipFile, zlib.error) as error:  # fmt: skip
        said = " ".join(str(error).split()) or type(error).__name__
        raise InvalidInputError(f"{file}: is damaged or no file of arrays: {said}") from error


def _check_entries(entries: list[zipfile.ZipInfo]) -> None:
    names = Counter(entry.filename for entry in entries)
    twice = next((name for name, count in names.items() if count > 1), None)
    if twice is not None:
        raise InvalidInputError(f"the array {twice!r} is given twice")
    size = sum(entry.file_size for entry in entries)
    if size > MOST_DATA or len(entries) > _MOST_ARRAYS:
        raise InvalidInputError(
            f"expected at most {_MOST_ARRAYS} arrays of {MOST_DATA / 2**20:g} MiB together, got {len(entries)} "
            f"of {size / 2**20:.1f} MiB"
        )
    other = next(
        (entry for entry in entries if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)), None
    )
    if other is not None:
        raise InvalidInputError(f"the array {other.filename!r} is packed in a way that numpy does not use")


def _array(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> Array:
    """An array whose header is compared with its bytes first: numpy would take the memory that the header claims."""
    data = archive.read(entry)
    begin = 10 + int.from_bytes(data[8:10], "little")
    header = _HEADER.fullmatch(data[10:begin]) if data.startswith(_NPY) else None
    if header is None:
        objects = b"'|O'" in data[:begin]
        what = "objects, which are not read" if objects else "something else than numbers or text of numpy's format 1.0"
        raise InvalidInputError(f"the array {entry.filename!r} holds {what}")
    kind, shape = np.dtype(header[1].decode()), tuple(map(int, re.findall(rb"\d+", header[3])))
    if math.prod(shape) * kind.itemsize != len(data) - begin:
        raise InvalidInputError(
            f"the array {entry.filename!r} says that it has shape {shape} and type {kind}, but it holds "
            f"{len(data) - begin} bytes"
        )
    values: Array = np.frombuffer(data, dtype=kind, offset=begin) if len(data) > begin else np.empty(0, kind)
    return values.reshape(shape, order="F" if header[2] == b"True" else "C")
