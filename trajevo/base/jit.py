"""Source text and loops compiled by numba (the optional extra ``fast``) and cached between processes."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache, cached_property
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar, cast, final

from trajevo.base.files import write_whole

#: A compiled function that writes into arrays.
Kernel = Callable[..., None]
Function = TypeVar("Function", bound=Callable[..., Any])


_avoided: ContextVar[bool] = ContextVar("compiling avoided", default=False)


@cache
def _installed() -> bool:
    return importlib.util.find_spec("numba") is not None


def can_compile() -> bool:
    """Whether numba is installed, and not avoided by :func:`uncompiled`."""
    return not _avoided.get() and _installed()


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


def kernel(source: str) -> Kernel:
    """The compiled function ``kernel`` of a source text, from numba's cache if it has been compiled before."""
    import numba

    name = f"trajevo_{hashlib.sha256(source.encode()).hexdigest()[:24]}"
    file = _kept(source, name)
    # numba looks up the module by its name when it reads from its cache.
    sys.modules[name] = module = ModuleType(name)
    module.__file__ = str(file or "<kernel>")
    exec(compile(source, module.__file__, "exec"), vars(module))
    # Without reassociation or contraction, so that a row's result does not depend on its neighbours.
    compiled: Kernel = numba.njit(error_model="numpy", nogil=True, cache=file is not None)(module.kernel)
    return compiled


def interpreted(source: str) -> Kernel:
    """The function ``kernel`` of a source text, not compiled."""
    names: dict[str, Any] = {}
    exec(compile(source, "<kernel>", "exec"), names)
    as_it_is: Kernel = names["kernel"]
    return as_it_is


def fast(function: Function) -> Function:
    """A loop that numba compiles at its first call; check :func:`can_compile` before calling it."""
    return cast(Function, _Loop(function))


@final
class _Loop:
    """A loop that is compiled only when it is called, because numba takes long to import."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self.__doc__, self._function = function.__doc__, function

    def __call__(self, *arguments: Any) -> Any:
        return self._compiled(*arguments)

    @cached_property
    def _compiled(self) -> Callable[..., Any]:
        import numba

        # numba looks up the functions that a loop calls in the loop's globals, and accepts only compiled ones.
        around = self._function.__globals__
        for name in self._function.__code__.co_names:
            if isinstance(around.get(name), _Loop):
                around[name] = around[name]._compiled
        try:
            return cast(Kernel, numba.njit(error_model="numpy", nogil=True, cache=True)(self._function))
        except RuntimeError:  # neither the module's folder nor the user's can be written to
            return cast(Kernel, numba.njit(error_model="numpy", nogil=True)(self._function))


def _kept(source: str, name: str) -> Path | None:
    """A file that holds the source, beside which numba caches the compiled code; None if no file can be written."""
    base = os.environ.get("XDG_CACHE_HOME", "")
    try:
        folder = (Path(base) if base else Path.home() / ".cache") / "trajevo" / "kernels"
        folder.mkdir(parents=True, exist_ok=True)
        file = folder / f"{name}.py"
        if not file.exists():
            write_whole(file, source.encode())
    except (OSError, RuntimeError):
        return None
    return file
