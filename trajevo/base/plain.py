"""Plain data: what JSON and TOML can hold, so that it is equal after it is written to a file and read again."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import PurePath
from typing import Any

import numpy as np

from trajevo.errors import InvalidInputError


def plain_data(place: str, value: Any) -> Any:
    """Data as numbers, texts, lists and tables; arrays and tuples become lists, numbers of numpy those of Python.

    Args:
        place: where the data comes from, with which messages begin.
        value: the data.

    Raises:
        InvalidInputError: anything else, a number that is not finite, or text that is no Unicode.
    """
    if isinstance(value, Mapping):
        return {_text(place, str(key)): plain_data(f"{place}.{key}", entry) for key, entry in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, PurePath):
        value = str(value)
    if isinstance(value, list | tuple):
        return [plain_data(place, entry) for entry in value]
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
