"""CSV files of points: columns with a name and a unit in the header, converted to SI."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.files import read_text, why_not
from trajevo.base.units import si_unit, split_header, to_si
from trajevo.errors import InvalidInputError


def read_columns(file: str | Path, columns: dict[str, str]) -> Array:
    """Read named columns with units from a CSV file.

    Args:
        file: first line a header such as ``azimuth [deg], pitch [deg]``; lines that start with ``#`` are comments.
        columns: name of each column to read -> its SI unit.

    Returns:
        Shape (rows, len(columns)), SI.

    Raises:
        InvalidInputError: the file cannot be read, a column is missing, repeated or has the wrong unit, a row has
            another number of cells, or a cell is no finite number.
    """
    lines, header = _csv_table(Path(file))
    names = [name for name, _ in header]
    for name, unit in columns.items():
        if name not in names or si_unit(header[names.index(name)][1]) != unit:
            raise InvalidInputError(
                f"{file}: expected a column '{name} [{unit}]' (or a unit that converts to it), got {lines[0][1]}"
            )
    return _csv_numbers(file, lines, header, [names.index(name) for name in columns])


def read_header(file: str | Path) -> list[str]:
    """Names of the columns of a CSV file, without their units.

    Raises:
        InvalidInputError: as for :func:`read_columns`.
    """
    return [name for name, _ in _csv_table(Path(file))[1]]


def read_points(file: str | Path) -> tuple[Array, tuple[str, ...]]:
    """Read points from a CSV file whose every column is a coordinate.

    Args:
        file: first line a header with units such as ``x [mm], y [mm]``; lines that start with ``#`` are comments.

    Returns:
        Points in SI, shape (n_points, n_columns), and the SI unit of every column.

    Raises:
        InvalidInputError: as for :func:`read_columns`.
    """
    lines, header = _csv_table(Path(file))
    points = _csv_numbers(file, lines, header, range(len(header)))
    return points, tuple(si_unit(unit) for _, unit in header)


def _csv_table(file: Path) -> tuple[list[tuple[int, list[str]]], list[tuple[str, str]]]:
    """Lines of a CSV file, and the name and unit of every column."""
    lines = _csv_lines(file)
    header = [split_header(cell, where=str(file)) for cell in lines[0][1]]
    names = [name for name, _ in header]
    if len(set(names)) != len(names):
        raise InvalidInputError(f"{file}: column names must differ, got {names}")
    return lines, header


def _csv_numbers(
    file: str | Path, lines: list[tuple[int, list[str]]], header: list[tuple[str, str]], places: Sequence[int]
) -> Array:
    """The chosen columns in SI, shape (rows, len(places))."""
    table = np.empty((len(lines) - 1, len(places)))
    for i, (line, row) in enumerate(lines[1:]):
        if len(row) != len(header):
            raise InvalidInputError(
                f"{file}: line {line}: expected {len(header)} numbers, separated by commas and with decimal points, "
                f"got {len(row)}: {', '.join(row)}"
            )
        for k, place in enumerate(places):
            name, unit = header[place]
            table[i, k] = _cell(row[place], f"{file}: line {line}, column {name!r}") * to_si(unit)
    return table


def _csv_lines(file: Path) -> list[tuple[int, list[str]]]:
    """Line number and stripped cells of every line that is neither blank nor a comment, the header first."""
    try:
        text = read_text(file).removeprefix("\ufeff")
        rows = [[cell.strip() for cell in row] for row in csv.reader(io.StringIO(text, newline=""))]
    except InvalidInputError:
        raise
    except (OSError, ValueError, csv.Error) as error:
        raise InvalidInputError(f"{file}: cannot be read as CSV: {why_not(error)}") from error
    lines = [(i, row) for i, row in enumerate(rows, start=1) if any(row) and not row[0].startswith("#")]
    if not lines:
        raise InvalidInputError(f"{file}: empty; expected a header such as 'azimuth [deg], pitch [deg]'")
    return lines


def _cell(text: str, where: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not np.isfinite(value) or "_" in text:
        raise InvalidInputError(f"{where}: expected a finite number, got {text!r}")
    return value
