"""Tables of points: text files with a name and a unit above every column, converted to SI.

Files of spreadsheets, of other programs and of hand-written lists are read alike. Commas, semicolons, tabs or spaces
may separate columns; decimal commas are read where commas do not separate. Lines may end in a comment, and rows in
separators without a value. No column is left out: what is not understood is refused by its name.
"""

from __future__ import annotations

import codecs
import csv
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.base.files import read_bytes, why_not
from trajevo.base.units import si_unit, split_header, to_si, units_of
from trajevo.errors import InvalidInputError, known_names, no_such_file

#: What may separate columns, in the order in which the header is searched for it. A header holds no numbers, so that
#: decimal commas do not deceive as they do `csv.Sniffer`.
_SEPARATORS = {";": "semicolons", "\t": "tabs", ",": "commas"}
_SPACES = "spaces"

_COMMENT = re.compile(r"(^|\s)#.*$")
_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+([eE][+-]?\d+)?")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


@dataclass(frozen=True)
class Column:
    """One column.

    Attributes:
        name: its name in the file.
        unit: its unit in the file, ``""`` if it has none.
    """

    name: str
    unit: str

    def __str__(self) -> str:
        return f"{self.name} [{self.unit}]" if self.unit else self.name


@dataclass(frozen=True, eq=False)
class Table:
    """A file of points.

    Attributes:
        file: the file.
        line: line number of the header.
        columns: its columns.
        numbers: as they are written, shape (rows, columns).
    """

    file: Path
    line: int
    columns: tuple[Column, ...]
    numbers: Array

    @property
    def names(self) -> list[str]:
        """Names of the columns."""
        return [column.name for column in self.columns]

    def si(self, expected: Mapping[str, str]) -> Array:
        """The numbers of all columns, which may stand in any order, in SI.

        Args:
            expected: name of each column -> its SI unit, in the order of the result.

        Returns:
            Shape (rows, len(expected)).

        Raises:
            InvalidInputError: a column is missing, has a unit of another kind or none, or there is one more; the
                message names it.
        """
        for column in self.columns:
            if column.name not in expected:
                raise InvalidInputError(
                    f"{self.file}: line {self.line}: unknown column '{column}'; {known_names(column.name, expected)}"
                )
        found = np.empty((len(self.numbers), len(expected)))
        for k, (name, unit) in enumerate(expected.items()):
            if name not in self.names:
                raise InvalidInputError(
                    f"{self.file}: line {self.line}: expected a column '{name} [{unit}]' too, "
                    f"got only {_listed(self.columns)}"
                )
            place = self.names.index(name)
            found[:, k] = self.numbers[:, place] * self._factor(self.columns[place], unit)
        return frozen(found)

    def renamed(self, names: Mapping[str, str]) -> Table:
        """The same table whose columns have other names, those of the file -> new ones; others stay as they are."""
        columns = tuple(Column(names.get(column.name, column.name), column.unit) for column in self.columns)
        return Table(self.file, self.line, columns, self.numbers)

    def _factor(self, column: Column, unit: str) -> float:
        if unit == "1" and not column.unit:
            return 1.0
        if not column.unit or si_unit(column.unit) != unit:
            known = " or ".join(f"'{column.name} [{one}]'" for one in units_of(unit))
            raise InvalidInputError(
                f"{self.file}: line {self.line}: expected a column header with a unit such as {known}, got '{column}'"
            )
        return to_si(column.unit)


def read_table(file: str | Path, *, example: str = "azimuth [deg], pitch [deg]") -> Table:
    """Read a table of numbers.

    Args:
        file: a text file whose first line is a header such as ``x [mm], y [mm]``; ``#`` begins a comment.
        example: a header, for messages.

    Raises:
        InvalidInputError: the file cannot be read, has no header, a column is repeated, or has an unknown unit, a row
            has another number of cells, or a cell is no finite number; the message names file, line and column.
    """
    path = Path(file)
    lines = [(number, line) for number, line in _lines(path) if line.strip(" \t,;")]
    if not lines:
        raise InvalidInputError(f"{file}: empty; expected a header such as '{example}'")
    first, header = lines[0]
    where = f"{file}: line {first}"
    separator = next((mark for mark in _SEPARATORS if mark in header), _SPACES)
    titles = _cells(header, separator)
    while titles and not titles[-1]:
        titles.pop()
    if all(map(_NUMBER.fullmatch, titles)):
        raise InvalidInputError(
            f"{where}: expected a header with the name and unit of every column, such as '{example}', "
            f"got {', '.join(titles)}"
        )
    columns = tuple(Column(*split_header(title, where=where)) for title in titles)
    plain = [column.name.casefold() for column in columns]
    if "" in plain:
        raise InvalidInputError(
            f"{where}: expected a name above every column, got none above column {plain.index('') + 1}"
        )
    if len(set(plain)) < len(plain):
        raise InvalidInputError(f"{where}: column names must differ, got {_listed(columns)}")
    return Table(path, first, columns, _numbers(str(file), lines[1:], columns, separator))


def _lines(file: Path) -> Iterator[tuple[int, str]]:
    """Number and text of every line, without comments."""
    try:
        content = read_bytes(file)
        wide = content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))  # "Unicode text" of a spreadsheet
        text = content.decode("utf-16" if wide else "utf-8").removeprefix("\ufeff")
    except FileNotFoundError:
        raise InvalidInputError(no_such_file(file)) from None
    except UnicodeDecodeError as error:
        raise InvalidInputError(f"{file}: cannot be read as a table: is not UTF-8 text") from error
    except OSError as error:
        raise InvalidInputError(f"{file}: cannot be read as a table: {why_not(error)}") from error
    for number, line in enumerate(text.splitlines(), start=1):
        yield number, _COMMENT.sub("", line)


def _cells(line: str, separator: str) -> list[str]:
    if separator == _SPACES:
        return re.sub(r"\s+(?=[\[(])", "", line).split()  # the unit belongs to the name before it
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=separator, skipinitialspace=True))]
    except csv.Error:  # an open quotation mark or a null character, which is no number either
        return [line]


def _numbers(file: str, lines: Iterable[tuple[int, str]], columns: tuple[Column, ...], separator: str) -> Array:
    """The numbers of all rows, shape (rows, columns)."""
    rows: list[list[float]] = []
    commas: int | None = None  # first lines with a decimal comma and with a decimal point
    points: int | None = None
    for number, line in lines:
        cells = _cells(line, separator)
        while len(cells) > len(columns) and not cells[-1]:
            cells.pop()
        if len(cells) != len(columns):
            raise InvalidInputError(f"{file}: line {number}: {_wrong_count(cells, columns, separator)}")
        commas = commas or (number if separator != "," and any(map(_DECIMAL_COMMA.fullmatch, cells)) else None)
        points = points or (number if any("." in cell for cell in cells) else None)
        if commas and points:
            raise InvalidInputError(
                f"{file}: expected decimal points or decimal commas, got commas in line {commas} and points in "
                f"line {points}"
            )
        rows.append(
            [_number(cell, f"{file}: line {number}", column) for cell, column in zip(cells, columns, strict=True)]
        )
    return np.array(rows).reshape(len(rows), len(columns))


def _wrong_count(cells: list[str], columns: tuple[Column, ...], separator: str) -> str:
    said = f"expected {len(columns)} numbers, separated by {_SEPARATORS.get(separator, separator)} as in the header"
    if separator == ",":
        said += " and with decimal points"
    got = f"{said}, got {len(cells)}: {', '.join(cells)}"
    if separator == "," and len(cells) == 2 * len(columns):
        return f"{got}; with decimal commas, separate the columns by semicolons, also in the header"
    return got


def _number(cell: str, where: str, column: Column) -> float:
    written = cell.replace(",", ".") if _DECIMAL_COMMA.fullmatch(cell) else cell
    value = float(written) if _NUMBER.fullmatch(written) else float("nan")
    if not np.isfinite(value):
        got = repr(cell) if cell else "an empty cell"
        raise InvalidInputError(f"{where}, column {column.name!r}: expected a finite number, got {got}")
    return value


def _listed(columns: Iterable[Column]) -> str:
    return ", ".join(f"'{column}'" for column in columns)
