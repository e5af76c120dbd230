"""Loops compiled by numba (the optional extra ``fast``), and the choice between them and numpy.

Both give the same numbers to rounding, not to the bit. So a run uses one kind of kernel from its first evaluation to
its last (:func:`one_kind`), whatever has been compiled meanwhile.
"""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from typing import Any, Literal, TypeVar, cast, overload

from trajevo.base import kernels
from trajevo.errors import InvalidInputError

Function = TypeVar("Function", bound=Callable[..., Any])

#: What computes: compiled loops, or numpy.
Kind = Literal["compiled", "numpy"]

#: Variable of the environment that chooses one, instead of whatever is ready: ``numpy``; or ``compiled``, which waits
#: for the compiler where nothing has been compiled yet.
CHOICE = "TRAJEVO_KERNELS"


_avoided: ContextVar[bool] = ContextVar("compiling avoided", default=False)
_kind: ContextVar[Kind | None] = ContextVar("kind of kernel", default=None)


def can_compile() -> bool:
    """Whether compiled loops are used here: by the run that goes on or by this process, if not :func:`uncompiled`."""
    return not _avoided.get() and kind() == "compiled"


def kind() -> Kind:
    """The kind of kernel of the run that goes on, or of this process."""
    return _kind.get() or _of_this_process()


@contextmanager
def one_kind(wanted: Kind | None = None) -> Iterator[Kind]:
    """Use one kind of kernel within.

    Args:
        wanted: the kind, for a run that goes on; None for that of the run which this is a part of, or else for what is
            ready now.

    Raises:
        InvalidInputError: compiled loops are asked for, but numba is not installed.
    """
    chosen = wanted or _kind.get() or _ready()
    if chosen == "compiled" and not _installed():
        raise InvalidInputError(
            "kernels: expected 'numpy', got 'compiled', for which numba is missing: pip install 'trajevo[fast]'"
        )
    token = _kind.set(chosen)
    try:
        yield chosen
    finally:
        _kind.reset(token)


@contextmanager
def uncompiled() -> Iterator[None]:
    """Compile nothing within: a few evaluations take less time than the import of numba, a quarter of a second."""
    token = _avoided.set(True)
    try:
        yield
    finally:
        _avoided.reset(token)


def avoided() -> bool:
    """Whether compiling is avoided by :func:`uncompiled`."""
    return _avoided.get()


@overload
def fast(function: Function, /) -> Function: ...
@overload
def fast(*signatures: str) -> Callable[[Function], Function]: ...
def fast(*given: Any) -> Any:
    """A loop that numba compiles; check :func:`can_compile` before calling it.

    Without signatures it can be called by other loops only, which take it in when they are compiled.

    Args:
        *given: types of the arguments, what is read before the arrow and what is written after it, such as
            ``"f8[2], i8 -> f8[1]"`` for a matrix and a whole number, which are read, and a vector.
    """
    if callable(given[0]):
        return kernels.Loop(given[0])

    def made(function: Function) -> Function:
        return cast(Function, kernels.Loop(function, *given))

    return made


@cache
def _of_this_process() -> Kind:
    """The kind for everything outside of runs, the same as long as the process lives."""
    return _ready()


def _ready() -> Kind:
    """The kind to begin with now; what is not compiled yet is compiled in a process beside this one.

    Raises:
        InvalidInputError: the environment asks for another kind than the two.
    """
    asked = os.environ.get(CHOICE, "")
    if asked not in ("", "numpy", "compiled"):
        raise InvalidInputError(f"{CHOICE}: expected 'numpy', 'compiled' or nothing, got {asked!r}")
    if asked == "numpy" or not _installed():
        return "numpy"
    if asked == "compiled" or kernels.ready():
        return "compiled"
    kernels.compile_beside()
    return "numpy"


@cache
def _installed() -> bool:
    return importlib.util.find_spec("numba") is not None
