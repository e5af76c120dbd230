"""Loops that numba compiles, once for an installation: ``python -m trajevo.base.kernels`` compiles all of them.

No run waits for the compiler: where the loops are not compiled yet, a run computes with numpy, and a process beside it
compiles all of them for later ones (:func:`compile_beside`). A file in the user's cache says that this is done.
"""

from __future__ import annotations

import hashlib
import importlib
import importlib.metadata
import json
import os
import platform
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache, cached_property
from pathlib import Path
from types import FunctionType
from typing import Any, final

import numpy as np

from trajevo.base.files import cache_folder, locked, write_whole
from trajevo.base.machine_code import loading
from trajevo.base.machine_code.arguments import arguments_of

#: All modules with loops that are called from Python, those first that take longest to compile.
MODULES = (
    "trajevo.trajectory.polynomial_loops",
    "trajevo.dynamics.rnea_loops",
    "trajevo.formulation.constraints.broad_phase.loops",
    "trajevo.trajectory.interpolants.splines.cubic",
    "trajevo.dynamics.integrals.loops",
    "trajevo.base.solving.crossings",
    "trajevo.base.solving.neighbours",
    "trajevo.dynamics.bounds.torque_loops",
    "trajevo.front.archive",
    "trajevo.formulation.constraints.broad_phase.search_loops",
    "trajevo.formulation.cell.tracking_loops",
)

#: Folder that holds the package.
_ROOT = Path(__file__).resolve().parents[2]

#: Time after which compiling is begun again if it did not end well [s].
_AGAIN_AFTER = 3600.0

#: Time between two looks at whether another process has ended its compiling [s].
_PAUSE = 0.2


@final
class Loop:
    """A loop with the types of its arguments, compiled when it is first called, or read from numba's cache.

    Attributes:
        signatures: types of the arguments: what is read, an arrow, what is written; as codes of numpy, with the number
            of an array's axes in brackets. Empty for a loop that only other loops call.
    """

    def __init__(self, function: Callable[..., Any], *signatures: str) -> None:
        self.__doc__, self._function, self.signatures = function.__doc__, function, signatures

    def __call__(self, *arguments: Any) -> None:
        """Call the compiled loop; arrays that it reads may lie in memory in any order and be read-only."""
        given = [
            np.ascontiguousarray(x) if isinstance(x, np.ndarray) and not x.flags.c_contiguous else x for x in arguments
        ]
        if self._entry is None or not self._entry(given):
            self.compiled(*given)  # numba knows what is wrong, if anything is

    @cached_property
    def _entry(self) -> loading.Call | None:
        """What calls the loop without numba; None where its machine code is not kept."""
        module = self._function.__module__
        with suppress(RuntimeError):
            if self.signatures and module in MODULES and loading.load(_file(f"{module}.o")):
                return loading.call(self.entries, self.signatures)
        return None

    @property
    def entries(self) -> list[str]:
        """Names of the entries of the machine code, one for each signature."""
        return [f"{self._function.__module__}.{self._function.__qualname__}.{k}" for k in range(len(self.signatures))]

    @cached_property
    def compiled(self) -> Any:
        """The compiled loop: with its signatures and no others, or with any if other loops call it."""
        import numba

        function = self._with_compiled_loops()

        def made(*, cache: bool) -> Any:
            # Without reassociation or contraction, so that a row's result does not depend on its neighbours.
            return numba.njit(error_model="numpy", nogil=True, cache=cache)(function)

        if not self.signatures:
            return made(cache=False)
        try:
            loop = made(cache=True)
        except RuntimeError:  # neither the module's folder nor the user's can be written to
            loop = made(cache=False)
        for signature in self.signatures:
            loop.compile(_types(signature))
        loop.disable_compile()
        return loop

    def kept(self) -> list[Path]:
        """Files in which numba keeps the compiled loop; empty if it cannot."""
        folder = self.compiled.stats.cache_path
        module, name = self._function.__module__.rpartition(".")[2], self._function.__qualname__
        return [] if folder is None else sorted(Path(folder).glob(f"{module}.{name}-*.nb[ci]"))

    def _with_compiled_loops(self) -> FunctionType:
        """The function with other loops compiled: numba accepts no others among a function's globals."""
        around = dict(self._function.__globals__)
        for name in self._function.__code__.co_names:
            if isinstance(around.get(name), Loop):
                around[name] = around[name].compiled
        function = FunctionType(self._function.__code__, around, self._function.__name__)
        function.__module__, function.__qualname__ = self._function.__module__, self._function.__qualname__
        return function


def _types(signature: str) -> tuple[Any, ...]:
    """Numba's types of arguments: arrays in C order, and read-only where they are read, which suits all arrays."""
    import numba

    types = []
    for argument in arguments_of(signature):
        number = numba.from_dtype(np.dtype(argument.code))
        array = argument.axes and numba.types.Array(number, argument.axes, "C", readonly=not argument.written)
        types.append(array or number)
    return tuple(types)


def ready() -> bool:
    """Whether all loops have been compiled for this installation; takes less than a millisecond."""
    try:
        listed = json.loads(_file("json").read_text(encoding="utf-8"))
        return bool(listed) and all(Path(file).exists() for file in listed)
    except (OSError, RuntimeError, TypeError, ValueError):
        return False


def compile_all(*, processes: int = 1) -> bool:
    """Compile all loops and note that it is done; whether numba could keep them for other processes.

    Args:
        processes: number of processes that compile, modules one by one; with 1 it is this one.
    """
    if processes > 1:
        from concurrent.futures import ProcessPoolExecutor
        from multiprocessing import get_context

        with ProcessPoolExecutor(min(processes, len(MODULES)), get_context("spawn")) as pool:
            kept = [files for module in pool.map(_compiled, MODULES) for files in module]
    else:
        kept = [files for module in MODULES for files in _compiled(module)]
    if not all(kept):
        return False
    try:
        note = _file("json")
        note.parent.mkdir(parents=True, exist_ok=True)
        write_whole(note, json.dumps([file for files in kept for file in files], indent=1).encode())
    except (OSError, RuntimeError):
        return False
    return True


def _compiled(name: str) -> list[list[str]]:
    """Compile the loops of a module; for each of them the files in which numba keeps it."""
    module = importlib.import_module(name)
    every = [loop for loop in vars(module).values() if isinstance(loop, Loop) and loop.signatures]
    loops = [loop for loop in every if loop._function.__module__ == name]
    kept = [[str(file) for file in loop.kept()] for loop in loops]
    return kept + _machine_code(name, loops) if all(kept) else kept


def _machine_code(name: str, loops: list[Loop]) -> list[list[str]]:
    """Keep the machine code of a module's loops for processes without numba; its file, if that is possible here."""
    from trajevo.base.machine_code.writing import object_code

    code = object_code(
        (entry, loop.compiled.overloads[_types(signature)], arguments_of(signature))
        for loop in loops
        for entry, signature in zip(loop.entries, loop.signatures, strict=True)
    )
    if code is None:
        return []
    try:
        file = _file(f"{name}.o")
        file.parent.mkdir(parents=True, exist_ok=True)
        loading.save(file, code)
    except (OSError, RuntimeError):
        return []
    return [[str(file)]]


def compile_beside() -> None:
    """Compile all loops in a process of their own, at the lowest priority, unless that was begun within an hour.

    It outlives this process, is no child of it, and prints nothing; if it fails, the reason is in the user's cache.
    """
    if not sys.executable or getattr(sys, "frozen", False):
        return
    try:
        lock = _file("lock")
        lock.parent.mkdir(parents=True, exist_ok=True)
        if lock.exists() and time.time() - lock.stat().st_mtime < _AGAIN_AFTER:
            return
        lock.touch()  # before the other process does so, which takes a while to start
        _start([sys.executable, "-m", __name__, "--beside"])
    except (OSError, RuntimeError):
        return


def _start(command: list[str]) -> None:
    """Start a process that nobody waits for, with this one's modules."""
    import subprocess

    path = os.pathsep.join([str(_ROOT), *(place for place in sys.path if place and place != str(_ROOT))])
    silent: dict[str, Any] = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.DEVNULL)
    silent["env"] = os.environ | {"PYTHONPATH": path}
    if sys.platform == "win32":
        flags = subprocess.BELOW_NORMAL_PRIORITY_CLASS | subprocess.CREATE_NO_WINDOW
        subprocess.Popen(command, creationflags=flags, **silent)
        return
    # The shell ends at once, so that this process has no child that it would have to wait for.
    subprocess.run(["/bin/sh", "-c", '"$@" &', "sh", *command], start_new_session=True, check=False, **silent)


@contextmanager
def _alone(*, wait: bool) -> Iterator[bool]:
    """Whether no other process compiles here, for as long as this lasts."""
    lock = _file("lock")
    lock.parent.mkdir(parents=True, exist_ok=True)
    with lock.open("ab") as stream:
        mine = locked(stream.fileno())
        while wait and not mine:
            time.sleep(_PAUSE)
            mine = locked(stream.fileno())
        os.utime(lock)  # for compile_beside
        yield mine


def _file(end: str) -> Path:
    """A file in the user's cache for this installation.

    Raises:
        RuntimeError: the user has no home, nor is there a place for caches.
    """
    return cache_folder("kernels") / f"{_installation()}.{end}"


@cache
def _installation() -> str:
    """A digest of all that compiled loops depend on: their source, numba, Python, the processor, numba's settings."""
    files = [Path(__file__), *sorted(Path(__file__).with_name("machine_code").glob("*.py"))]
    files += [_ROOT.joinpath(*module.split(".")).with_suffix(".py") for module in MODULES]
    sources = [(str(file), file.stat().st_mtime_ns, file.stat().st_size) for file in files]
    versions = [importlib.metadata.version(name) for name in ("numba", "llvmlite", "numpy")]
    settings = sorted((name, value) for name, value in os.environ.items() if name.startswith("NUMBA_"))
    parts = sources, versions, sys.version, platform.machine(), _processor(), settings
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:24]


def _processor() -> str:
    """What tells processors apart: compiled loops use whatever instructions theirs has."""
    with suppress(OSError):
        first = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").partition("\n\n")[0]
        return "".join(line for line in first.splitlines(keepends=True) if line.startswith(("model name", "flags")))
    return platform.processor()


def main() -> int:
    """Entry point."""
    import argparse
    import traceback

    parser = argparse.ArgumentParser(description="compile all loops of trajevo, 20 s of CPU time once")
    parser.add_argument("--beside", action="store_true", help="at the lowest priority, unless another process does so")
    beside = parser.parse_args().beside
    if beside and hasattr(os, "nice"):
        os.nice(19)
    try:
        with _alone(wait=not beside) as mine:
            if beside and not mine:
                return 0
            done = ready() or compile_all(processes=1 if beside else os.cpu_count() or 1)
            if done:
                os.utime(_file("lock"), (0.0, 0.0))  # should compiled loops get lost, they are compiled again at once
            return 0 if done else 1
    except Exception:
        if beside:
            _file("log").write_text(traceback.format_exc(), encoding="utf-8")
        raise


if __name__ == "__main__":
    from trajevo.base import kernels

    sys.exit(kernels.main())
