"""The array type of the project and its two habits: read-only results, shapes checked by name."""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from trajevo.errors import InvalidInputError

#: float64, save for complex steps that derivatives are made of.
Array = np.ndarray[Any, np.dtype[Any]]


def read_only(values: Any) -> Array:
    """A copy that cannot be written to: float64, or complex128 where complex numbers come in."""
    array: Array = np.array(values, dtype=np.complex128 if np.iscomplexobj(values) else np.float64)
    array.setflags(write=False)
    return array


def frozen(array: Array) -> Array:
    """The same float64 array, locked: for arrays that were made here and are handed out."""
    array.setflags(write=False)
    return array


def keep_heap() -> None:
    """Let the allocator keep what arrays of a population free, instead of giving it back to the system every time.

    glibc hands blocks above a threshold back at once, and each evaluation then pays for a thousand page faults, a
    quarter of its time. Freeing one block of 16 MB, never touched, raises the threshold; elsewhere it does nothing.
    """
    np.empty(2**21)


def one_blas_thread() -> AbstractContextManager[Any]:
    """One thread for matrix products while it lasts: here they are small, and waking threads costs more than it saves.

    An SQP run along a path takes 0.33 s with two threads and 0.09 s with one.
    """
    limit: AbstractContextManager[Any] = threadpool_limits(limits=1, user_api="blas")
    return limit


def scaled(values: Array, factor: Array) -> Array:
    """Values times real factors; parts of complex ones apart, as numpy would make the factors complex first."""
    if not np.iscomplexobj(values):
        return values * factor
    product = np.empty(np.broadcast_shapes(values.shape, factor.shape), dtype=values.dtype)
    np.multiply(values.real, factor, out=product.real)
    np.multiply(values.imag, factor, out=product.imag)
    return product


#: Rows that BLAS is given at a time: whole tiles of its kernels, few enough for one thread.
_BLOCK = 48


def row_products(rows: Array, matrix: Array) -> Array:
    """Every row times a matrix, its digits those of the row alone: of no other row, nor of their number or order.

    BLAS sums a row up in another order where it stands in a rest of a tile, or where it is the only one; here all
    products are of one shape.

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
        shape: per axis its name (any length) or its required length.

    Raises:
        InvalidInputError: not numbers, another shape, or NaN or infinite entries.
    """
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
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


def _listed(shape: tuple[str | int, ...]) -> str:
    return ", ".join(str(axis) for axis in shape)
