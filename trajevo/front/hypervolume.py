"""Hypervolumes of a growing archive, computed only when they are read.

With four objectives and a thousand points, computing a hypervolume takes longer than evaluating a population, and the
hypervolumes of most generations are never read.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, final, overload

import moocore
import numpy as np
from pydantic import GetCoreSchemaHandler
from pydantic_core import CoreSchema, core_schema

from trajevo.base.arrays import Array

_NEVER = np.iinfo(np.int32).max

#: Growth of the memory of a chronicle that is full.
_GROWTH = 1.1


def hypervolume(F: Array, reference_point: Array) -> float:
    """Share of the box from 0 to the reference point that objective values (N, n_obj) dominate."""
    if not len(F):
        return 0.0
    return float(moocore.hypervolume(F / reference_point, ref=np.ones(len(reference_point))))


@final
class Chronicle:
    """All points that an archive has ever held, and the change at which each was added or removed."""

    def __init__(self, n_obj: int) -> None:
        self.time = 0
        self._F = np.empty((0, n_obj))
        self._came, self._went = np.empty(0, dtype=np.int32), np.empty(0, dtype=np.int32)
        self._held, self._count = np.empty(0, dtype=np.intp), 0

    def change(self, kept: Array, new: Array) -> None:
        """Keep the current points of a mask and append new points, shape (N, n_obj)."""
        self.time += 1
        self._went[self._held[~kept]] = self.time
        begin, self._count = self._count, self._count + len(new)
        if self._count > len(self._F):
            self._make_room(int(_GROWTH * self._count))
        came = slice(begin, self._count)
        self._F[came], self._came[came], self._went[came] = new, self.time, _NEVER
        self._held = np.concatenate([self._held[kept], np.arange(begin, self._count)])

    def at(self, time: int) -> Array:
        """The points of the archive after the given number of changes, shape (N, n_obj)."""
        before = slice(self._count)
        held: Array = self._F[before][(self._came[before] <= time) & (self._went[before] > time)]
        return held

    def _make_room(self, size: int) -> None:
        for array in (self._F, self._came, self._went):
            array.resize((size, *array.shape[1:]), refcheck=False)


@final
class Volume:
    """A hypervolume that is computed when it is first converted to a float.

    Args:
        points: function that returns the objective values, shape (N, n_obj).
        reference_point: far corner of the box, shape (n_obj,) [SI].
    """

    def __init__(self, points: Callable[[], Array], reference_point: Array) -> None:
        self._about: tuple[Callable[[], Array], Array] | None = points, reference_point
        self._measured = 0.0

    def __float__(self) -> float:
        if self._about is not None:
            points, corner = self._about
            self._measured = hypervolume(points(), corner)
            self._about = None
        return self._measured


@final
class Volumes(Sequence[float]):
    """A sequence of hypervolumes, computed when they are read; equal to a tuple of the same numbers.

    Args:
        volumes: numbers or :class:`Volume` objects.
    """

    def __init__(self, volumes: Iterable[float | Volume] = ()) -> None:
        self._volumes = tuple(volumes)

    def __len__(self) -> int:
        return len(self._volumes)

    @overload
    def __getitem__(self, index: int) -> float: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[float, ...]: ...
    def __getitem__(self, index: int | slice) -> float | tuple[float, ...]:
        chosen = self._volumes[index]
        return tuple(map(float, chosen)) if isinstance(chosen, tuple) else float(chosen)

    def __eq__(self, other: object) -> bool:
        return self[:] == other[:] if isinstance(other, Volumes | tuple) else NotImplemented

    def __hash__(self) -> int:
        return hash(self[:])

    def __repr__(self) -> str:
        return repr(self[:])

    def __reduce__(self) -> tuple[type[Volumes], tuple[tuple[float, ...]]]:
        return Volumes, (self[:],)

    def followed_by(self, volume: float) -> Volumes:
        """The same sequence with one more hypervolume."""
        return Volumes((*self._volumes, volume))

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Let pydantic read and write the sequence as a list of numbers."""

        def made(value: Any, validate: core_schema.ValidatorFunctionWrapHandler) -> Volumes:
            return value if isinstance(value, cls) else cls(validate(value))

        numbers = handler(tuple[float, ...])
        written = core_schema.plain_serializer_function_ser_schema(lambda volumes: volumes[:], return_schema=numbers)
        return core_schema.no_info_wrap_validator_function(made, numbers, serialization=written)
