"""Calls of compiled loops by entries of an object file, which LLVM's linker loads in a few milliseconds."""

from __future__ import annotations

import ctypes
import hashlib
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from trajevo.base.files import write_whole
from trajevo.base.machine_code.arguments import arguments_of

#: Calls a loop with numbers and contiguous arrays; whether that went well, which a caller leaves to numba otherwise.
Call = Callable[[list[Any]], bool]


def save(file: Path, code: bytes) -> None:
    """Write an object file behind its digest, by which a damaged one is known."""
    write_whole(file, hashlib.sha256(code).digest() + code)


def load(file: Path) -> bool:
    """Make the entries of an object file known to this process, once; whether that is possible."""
    try:
        kept = file.read_bytes()
    except OSError:
        return False
    size = hashlib.sha256().digest_size
    return hashlib.sha256(kept[size:]).digest() == kept[:size] and _loaded(kept[size:])


@cache
def _loaded(code: bytes) -> bool:
    """Whether LLVM has taken in machine code."""
    try:
        from llvmlite import binding  # type: ignore[import-untyped]

        engine = _engine()
        engine.add_object_file(binding.ObjectFileRef.from_data(code))
        engine.finalize_object()
    except (AttributeError, ImportError, RuntimeError):
        return False
    return True


@cache
def _engine() -> Any:
    """LLVM's linker in this process."""
    from llvmlite import binding

    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    machine = binding.Target.from_default_triple().create_target_machine()
    return binding.create_mcjit_compiler(binding.parse_assembly(""), machine)


def call(names: Sequence[str], signatures: Sequence[str]) -> Call:
    """What calls a loop by its entries.

    Args:
        names: name of the entry of every signature; their file is loaded.
        signatures: types of the arguments, the first of which that fits is called.

    Returns:
        A function of a list of arguments; whether they fit a signature, and the loop came to its end.
    """
    arguments = arguments_of(signatures[0])
    are_arrays = [argument.axes is not None for argument in arguments]
    types = [
        ctypes.c_void_p if argument.axes is not None else ctypes.c_double if argument.code == "f8" else ctypes.c_int64
        for argument in arguments
    ]
    kind = ctypes.CFUNCTYPE(ctypes.c_int32, *types)  # which lets other threads go on
    entries = [kind(_engine().get_function_address(name)) for name in names]

    def called(given: list[Any]) -> bool:
        if [isinstance(x, np.ndarray) for x in given] != are_arrays:
            return False
        places = [
            id(x) if is_array else x.item() if isinstance(x, np.generic) else x
            for x, is_array in zip(given, are_arrays, strict=True)
        ]
        try:
            for entry in entries:
                if entry(*places) == 0:
                    return True
        except ctypes.ArgumentError:
            return False
        return False

    return called
