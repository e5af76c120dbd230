"""Arrays and texts in a page: compressed, in base64, and read by the page without any library."""

from __future__ import annotations

import base64
import gzip
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array

#: Types that the page reads, by numpy's name.
_TYPES = ("f8", "f4", "i2", "u4", "u2", "u1")

#: Every array begins at a multiple of this, as the browser's arrays have to [byte].
_STEP = 8

#: Of 1 to 9: with 6 a page is 4 % smaller and takes twice as long.
_LEVEL = 1


@final
class Packed:
    """Arrays, one after another."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []
        self._size = 0

    def add(self, values: Any, kind: str) -> dict[str, Any]:
        """Store an array; what the page needs to find it again: place, type and shape.

        Args:
            values: the array.
            kind: one of ``f8``, ``f4``, ``i2``, ``u4``, ``u2`` and ``u1``, little-endian.
        """
        array: Array = np.ascontiguousarray(values)
        content = array.astype(f"<{_TYPES[_TYPES.index(kind)]}").tobytes()
        place = {"at": self._size, "type": kind, "shape": list(array.shape)}
        padding = -len(content) % _STEP
        self._parts += [content, bytes(padding)]
        self._size += len(content) + padding
        return place

    def text(self) -> str:
        """All arrays, compressed, in base64."""
        return packed(b"".join(self._parts))


def packed(content: bytes) -> str:
    """Bytes compressed, in base64; the same bytes give the same text."""
    return base64.b64encode(gzip.compress(content, _LEVEL, mtime=0)).decode("ascii")
