"""The array type of the project: read-only results, shapes checked by name, and matrix products of small arrays."""

from __future__ import annotations

import ctypes
import sys
from contextlib import AbstractContextManager, suppress
from functools import cache
from typing import Any

import numpy as np
from threadpoolctl import ThreadpoolController

from trajevo.errors import InvalidInputError

#: float64, or complex128 where derivatives are computed by complex steps.
Array = np.ndarray[Any, np.dtype[Any]]


def read_only(values: Any) -> Array:
    """A read-only copy: complex128 if the values are complex, otherwise float64."""
    array: Array = np.array(values, dtype=np.complex128 if np.iscomplexobj(values) else np.float64)
    array.setflags(write=False)
    return array


def frozen(array: Array) -> Array:
    """The same array, made read-only without a copy: for new arrays that are returned to a caller."""
    array.setflags(write=False)
    return array


def keep_heap() -> None:
    """Let the allocator keep the memory that a population's arrays free, instead of returning it to the system.

    glibc returns freed blocks above a threshold to the system at once, so that each evaluation spends a quarter of its
    time on a thousand page faults. Allocating and freeing one block of 16 MB, without touching it, raises the
    threshold. With other allocators this does nothing.
    """
    np.empty(2**21)


def give_back_heap() -> None:
    """Return what :func:`keep_heap` keeps to the system: arrays that grow leave holes behind which nothing fits into.

    With other allocators this does nothing.
    """
    with suppress(OSError, AttributeError, TypeError):  # no C library of that name, or no such function in it
        ctypes.CDLL(None).malloc_trim(0)


def one_blas_thread() -> AbstractContextManager[Any]:
    """A context in which matrix products use one thread: they are small here, and waking threads costs more time.

    An SQP run along a path takes 0.33 s with two threads and 0.09 s with one.
    """
    limit: AbstractContextManager[Any] = _blas("scipy.linalg" in sys.modules).limit(limits=1, user_api="blas")
    return limit


@cache
def _blas(_with_scipy: bool) -> ThreadpoolController:
    """The libraries of matrix products that are loaded; looking for them takes milliseconds, and SciPy has its own."""
    return ThreadpoolController()


def scaled(values: Array, factor: Array) -> Array:
    """Values times real factors, real and imaginary parts separately: numpy would first make the factors complex."""
    if not np.iscomplexobj(values):
        return values * factor
    product = np.empty(np.broadcast_shapes(values.shape, factor.shape), dtype=values.dtype)
    np.multiply(values.real, factor, out=product.real)
    np.multiply(values.imag, factor, out=product.imag)
    return product


#: Number of rows passed to BLAS at a time: a multiple of the tiles of its kernels, and few enough for one thread.
_BLOCK = 48


def row_products(rows: Array, matrix: Array) -> Array:
    """Every row times a matrix; to the last digit, the result of a row does not depend on the other rows.

    BLAS adds the terms of a row in another order if the row lies in an incomplete tile or is the only row. Here all
    products have the same shape, so that neither the number nor the order of the rows matters.

    Args:
        rows: shape (M, K).
        matrix: shape (K, N).

    Returns:
        Shape (M, N).
    """
    blocks = -(-len(rows) // _BLOCK)
    padded = np.zeros((blocks * _BLOCK, rows.shape[1]), dtype=rows.dtype)
    padded[: len(rows)] = rows
    products: Array = padded.reshape(blocks, _BLOCK, rows.shape[1]) @ matrix
    return products.reshape(len(padded), matrix.shape[1])[: len(rows)]


def numbers(values: Any, *, name: str, shape: tuple[str | int, ...]) -> Array:
    """Turn an argument into a float64 array of a given shape with finite entries.

    Args:
        values: what the caller passed.
        name: name of the argument, for the message.
        shape: for each axis its name (any length) or its required length.

    Raises:
        InvalidInputError: not numbers, another shape, or NaN or infinite entries.
    """
    try:
        given = np.asarray(values)
        if given.dtype.kind == "c":
            raise TypeError
        array = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidInputError(f"{name}: expected numbers of shape ({_listed(shape)}), got {values!r}") from error
    fits = array.ndim == len(shape) and all(
        isinstance(wanted, str) or wanted == found for wanted, found in zip(shape, array.shape, strict=True)
    )
    if not fits:
        raise InvalidInputError(f"{name}: expected shape ({_listed(shape)}), got {array.shape}")
    if not np.isfinite(array).all():
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise InvalidInputError(f"{name}: expected finite numbers, got {array[where]} at index {where}")
    return array


def real_number(value: Any) -> float | None:
    """One real number as a float, None if it is anything else or is beyond all floats; inf and NaN are numbers here."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        return None
    try:
        return float(value)
    except OverflowError:
        return None


def _listed(shape: tuple[str | int, ...]) -> str:
    return ", ".join(str(axis) for axis in shape)
