"""Complex steps through functions that were written for real numbers: imaginary parts stay derivatives.

numpy's ``abs`` of a complex number is its magnitude, which drops the derivative, and comparisons look at imaginary
parts too. :class:`Stepped` arrays treat such functions as those of the real parts, with the right derivatives.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array


@final
class Stepped(np.ndarray[Any, Any]):
    """A complex array that stands for its real part; its imaginary part is a small step times a derivative."""

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, out: Any = None, **options: Any) -> Any:
        given = [unstepped(value) for value in inputs]
        rule = _RULES.get(ufunc) if any(map(np.iscomplexobj, given)) else None
        if rule is None:
            if out is not None:
                options["out"] = tuple(unstepped(array) for array in out)
            found = getattr(ufunc, method)(*given, **options)
            return found if found is None else stepped(found) if out is None else out[0] if len(out) == 1 else out
        if method != "__call__" or set(options) - {"dtype", "casting", "order", "subok"}:
            return NotImplemented
        found = rule(*given)
        if out is None:
            return stepped(found)
        unstepped(out[0])[...] = found
        return out[0]

    def __array_function__(self, function: Any, types: Any, args: Any, kwargs: Any) -> Any:
        rule = _FUNCTIONS.get(function)
        if rule is None:
            return stepped(super().__array_function__(function, types, args, kwargs))
        return stepped(rule(*map(unstepped, args), **kwargs))

    def __getitem__(self, index: Any) -> Any:
        return stepped(super().__getitem__(index))

    def __iter__(self) -> Iterator[Any]:
        return (self[place] for place in range(len(self)))

    def std(self, *args: Any, **options: Any) -> Any:
        """Standard deviation, as of real numbers."""
        return np.std(self, *args, **options)

    def var(self, *args: Any, **options: Any) -> Any:
        """Variance, as of real numbers."""
        return np.var(self, *args, **options)


def stepped(found: Any) -> Any:
    """Complex arrays and numbers as :class:`Stepped`, also in tuples and lists; anything else as it is."""
    if isinstance(found, tuple | list):
        parts = [stepped(part) for part in found]
        return parts if isinstance(found, list) else tuple(parts) if type(found) is tuple else type(found)(*parts)
    if isinstance(found, np.ndarray | np.complexfloating) and np.iscomplexobj(found):
        return np.asarray(found).view(Stepped)
    return found


def unstepped(value: Any) -> Any:
    """A :class:`Stepped` array as a plain one; anything else as it is."""
    return value.view(np.ndarray) if isinstance(value, Stepped) else value


def _absolute(x: Array) -> Any:
    return x * np.sign(x.real)


def _of_reals(function: Any) -> Callable[..., Any]:
    """A function whose derivative is 0, of the real parts alone."""
    return lambda *values: function(*map(np.real, values))


def _remainder(x: Array, y: Array) -> Any:
    return x - y * np.floor(np.real(x) / np.real(y))


def _arctan2(y: Array, x: Array) -> Any:
    angle = np.arctan2(np.real(y), np.real(x))
    turned = np.real(x) * np.imag(y) - np.real(y) * np.imag(x)
    squared = np.real(x) ** 2 + np.real(y) ** 2
    return angle + 1j * turned / squared


def _hypot(x: Array, y: Array) -> Any:
    return np.sqrt(x * x + y * y)


def _copysign(x: Array, y: Array) -> Any:
    return _absolute(np.asarray(x)) * np.copysign(1.0, np.real(y))


def _cube_root(x: Array) -> Any:
    root = np.cbrt(x.real)
    return root + 1j * x.imag / (3.0 * root * root)


def _norm(x: Any, ord: Any = None, axis: Any = None, keepdims: bool = False) -> Any:
    """Norms of vectors, and Frobenius norms.

    Raises:
        TypeError: another norm of a matrix.
    """
    values = np.asarray(x)
    vectors = isinstance(axis, int | np.integer) or (axis is None and values.ndim == 1)
    if ord is None or (ord == 2 and vectors) or ord == "fro":
        return np.sqrt((values * values).sum(axis=axis, keepdims=keepdims))
    if not vectors:
        raise TypeError(f"no derivative of the matrix norm {ord!r}")
    size = _absolute(values)
    if np.isinf(ord):
        return (size.max if ord > 0 else size.min)(axis=axis, keepdims=keepdims)
    return (size**ord).sum(axis=axis, keepdims=keepdims) ** (1.0 / ord)


def _variance(x: Any, axis: Any = None, *, ddof: float = 0, keepdims: bool = False) -> Any:
    values = np.asarray(x)
    apart = values - values.mean(axis=axis, keepdims=True)
    squared = (apart * apart).sum(axis=axis, keepdims=keepdims)
    return squared / (values.size / squared.size - ddof)


def _deviation(x: Any, axis: Any = None, *, ddof: float = 0, keepdims: bool = False) -> Any:
    return np.sqrt(_variance(x, axis, ddof=ddof, keepdims=keepdims))


#: What numpy computes from both parts of a complex number, or not at all: ufunc -> the same of real numbers.
_RULES: dict[np.ufunc, Callable[..., Any]] = {
    np.absolute: _absolute,
    np.fabs: _absolute,
    np.conjugate: np.asarray,
    np.remainder: _remainder,
    np.arctan2: _arctan2,
    np.hypot: _hypot,
    np.copysign: _copysign,
    np.cbrt: _cube_root,
    np.deg2rad: lambda x: x * (np.pi / 180.0),
    np.rad2deg: lambda x: x * (180.0 / np.pi),
    **{
        ufunc: _of_reals(ufunc)
        for ufunc in (
            np.sign,
            np.signbit,
            np.heaviside,
            np.floor,
            np.ceil,
            np.trunc,
            np.rint,
            np.floor_divide,
            np.less,
            np.less_equal,
            np.greater,
            np.greater_equal,
            np.equal,
            np.not_equal,
            np.logical_and,
            np.logical_or,
            np.logical_not,
        )
    },
}

#: The same for functions that are no ufuncs.
_FUNCTIONS: dict[Any, Callable[..., Any]] = {np.linalg.norm: _norm, np.var: _variance, np.std: _deviation}
