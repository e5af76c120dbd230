"""Source text compiled by numba, the optional extra ``fast``, and kept from one process to the next."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar, cast

from trajevo.files import write_whole

#: A compiled function that writes into arrays.
Kernel = Callable[..., None]
Function = TypeVar("Function", bound=Callable[..., Any])


@cache
def can_compile() -> bool:
    """Whether numba is installed."""
    return importlib.util.find_spec("numba") is not None


def kernel(source: str) -> Kernel:
    """The function ``kernel`` of a source text, from numba's cache where it has been compiled before."""
    import numba

    name = f"trajevo_{hashlib.sha256(source.encode()).hexdigest()[:24]}"
    file = _kept(source, name)
    # numba looks for the module again by its name when it reads what it has kept.
    sys.modules[name] = module = ModuleType(name)
    module.__file__ = str(file or "<kernel>")
    exec(compile(source, module.__file__, "exec"), vars(module))
    # Without reassociation or contraction, so that a row's result does not depend on its neighbours.
    compiled: Kernel = numba.njit(error_model="numpy", nogil=True, cache=file is not None)(module.kernel)
    return compiled


def interpreted(source: str) -> Kernel:
    """The function ``kernel`` of a source text as it is."""
    names: dict[str, Any] = {}
    exec(compile(source, "<kernel>", "exec"), names)
    as_it_is: Kernel = names["kernel"]
    return as_it_is


def fast(function: Function) -> Function:
    """A function that is compiled when it is first called; for modules that are not imported where numba is missing."""
    import numba

    try:
        compiled = numba.njit(error_model="numpy", nogil=True, cache=True)(function)
    except RuntimeError:  # neither the module's folder nor the user's can be written to
        compiled = numba.njit(error_model="numpy", nogil=True)(function)
    return cast(Function, compiled)


def _kept(source: str, name: str) -> Path | None:
    """A file that holds the source, beside which numba keeps what it compiled; None where none can be written."""
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
