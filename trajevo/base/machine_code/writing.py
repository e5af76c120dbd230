"""Machine code of loops that numba has compiled, with an entry for each that is called without numba.

The code is numba's own. Around it come an entry, which looks up where the arrays lie in memory, and the few functions
of numba's runtime that loops use: allocating room, and powers of complex numbers. What belongs to numba's own way of
calling a loop is left out.
"""

from __future__ import annotations

import platform
import re
import sys
from collections.abc import Iterable
from typing import Any

import numpy as np

from trajevo.base.machine_code.arguments import Argument

#: Functions from elsewhere that loops may call: the math library's, and Python's own.
_KNOWN = {
    *("sin", "cos", "sincos", "tan", "asin", "acos", "atan", "atan2", "exp", "log", "pow", "sqrt", "hypot", "fmod"),
    *("memset", "memcpy", "memmove", "PyMem_RawMalloc", "PyMem_RawFree", "_Py_c_pow"),
}

#: Numba's runtime: room for arrays, which is freed when its count of uses reaches 0; and powers of complex numbers,
#: which numba takes from Python. Two numbers of a complex one are passed in registers, on the systems of :func:`suits`.
_RUNTIME = """
%room = type {{ i64, ptr, ptr, ptr, i64, ptr }}
declare ptr @PyMem_RawMalloc(i64)
declare void @PyMem_RawFree(ptr)
declare {{ double, double }} @_Py_c_pow(double, double, double, double)
define linkonce_odr ptr @NRT_MemInfo_alloc_aligned(i64 %size, i32 %align) {{
  %wide = zext i32 %align to i64
  %head = add i64 %wide, {head}
  %all = add i64 %head, %size
  %room = call ptr @PyMem_RawMalloc(i64 %all)
  %none = icmp eq ptr %room, null
  br i1 %none, label %failed, label %made
failed:
  ret ptr null
made:
  %place = ptrtoint ptr %room to i64
  %beyond = add i64 %place, %head
  %rest = urem i64 %beyond, %wide
  %even = sub i64 %beyond, %rest
  %data = inttoptr i64 %even to ptr
  store %room zeroinitializer, ptr %room
  store i64 1, ptr %room
  %at = getelementptr %room, ptr %room, i32 0, i32 3
  store ptr %data, ptr %at
  %length = getelementptr %room, ptr %room, i32 0, i32 4
  store i64 %size, ptr %length
  ret ptr %room
}}
define linkonce_odr void @NRT_MemInfo_call_dtor(ptr %room) {{
  call void @PyMem_RawFree(ptr %room)
  ret void
}}
define linkonce_odr void @numba_cpow(ptr %base, ptr %exponent, ptr %out) {{
  %base_up = getelementptr double, ptr %base, i32 1
  %exponent_up = getelementptr double, ptr %exponent, i32 1
  %out_up = getelementptr double, ptr %out, i32 1
  %a = load double, ptr %base
  %b = load double, ptr %base_up
  %c = load double, ptr %exponent
  %d = load double, ptr %exponent_up
  %power = call {{ double, double }} @_Py_c_pow(double %a, double %b, double %c, double %d)
  %real = extractvalue {{ double, double }} %power, 0
  %imaginary = extractvalue {{ double, double }} %power, 1
  %no_a = fcmp oeq double %a, 0.0
  %no_b = fcmp oeq double %b, 0.0
  %zero = and i1 %no_a, %no_b
  %below = fcmp olt double %c, 0.0
  %turning = fcmp une double %d, 0.0
  %bad = or i1 %below, %turning
  %none = and i1 %zero, %bad
  %x = select i1 %none, double 0x7FF8000000000000, double %real
  %y = select i1 %none, double 0x7FF8000000000000, double %imaginary
  store double %x, ptr %out
  store double %y, ptr %out_up
  ret void
}}
"""

#: Bytes of a room before its data.
_HEAD = 48

#: Names in LLVM's language.
_NAME = r'@("[^"]*"|[\w.$-]+)'

#: Where numpy keeps what belongs to an array, after the head of every Python object [bytes]; part of its ABI.
_DATA, _AXES, _SHAPE, _STRIDES, _DTYPE, _FLAGS = 0, 8, 16, 24, 40, 48
#: The same within a dtype.
_BYTE_ORDER, _NUMBER = 10, 12
#: Flags of an array: in C order, aligned, and one that may be written to.
_C_ORDER, _ALIGNED, _WRITEABLE = 0x1, 0x100, 0x400


def suits() -> bool:
    """Whether entries are written here; elsewhere numba calls its loops itself."""
    python = sys.implementation.name == "cpython" and object.__basicsize__ == 16
    return python and sys.platform.startswith("linux") and platform.machine() == "x86_64"


def object_code(compiled: Iterable[tuple[str, Any, tuple[Argument, ...]]]) -> bytes | None:
    """An object file with entries for compiled loops; None where that cannot be made.

    Args:
        compiled: an entry's name, the loop as numba has compiled it for one signature, and its arguments.
    """
    if not suits():
        return None
    try:
        return _linked(list(compiled))
    except (AttributeError, KeyError, RuntimeError):  # another numba has other insides
        return None


def _linked(compiled: list[tuple[str, Any, tuple[Argument, ...]]]) -> bytes | None:
    """One object file of all loops, by the compiler that numba uses."""
    from llvmlite import binding  # type: ignore[import-untyped]

    whole = binding.parse_assembly(_RUNTIME.format(head=_HEAD))
    machine = None
    for name, loop, arguments in compiled:
        inner = loop.fndesc.llvm_func_name
        text = _reachable(str(loop.library._get_module_for_linking()), inner)
        whole.link_in(binding.parse_assembly(text + _entry(name, inner, arguments)))
        machine = loop.library.codegen._tm
    whole.verify()
    missing = {function.name for function in whole.functions if function.is_declaration}
    if machine is None or not all(name in _KNOWN or name.startswith("llvm.") for name in missing):
        return None
    emitted: bytes = machine.emit_object(whole)
    return emitted


def _reachable(text: str, first: str) -> str:
    """A module's text with those functions only that one of them needs, and with what these call declared."""
    bodies = {}
    for body in re.findall(r"^define .*?^\}$", text, flags=re.MULTILINE | re.DOTALL):
        bodies[re.search(_NAME, body).group(1).strip('"')] = body  # type: ignore[union-attr]
    needed, found = set(), [first]
    while found:
        name = found.pop()
        if name in bodies and name not in needed:
            needed.add(name)
            found += [one.strip('"') for one in re.findall(_NAME, bodies[name])]
    for name, body in bodies.items():
        if name not in needed:
            text = text.replace(body, "")
    return _without_strays(text)


def _without_strays(text: str) -> str:
    """A module's text without declarations and global variables that nothing mentions."""
    while True:
        lines = text.split("\n")
        uses: dict[str, int] = {}
        for name in re.findall(_NAME, text):
            uses[name] = uses.get(name, 0) + 1
        kept = [line for line in lines if not (line[:1] == "@" or line[:8] == "declare ") or _used(line, uses)]
        if len(kept) == len(lines):
            return text
        text = "\n".join(kept)


def _used(line: str, uses: dict[str, int]) -> bool:
    name = re.search(_NAME, line)
    return name is None or uses[name.group(1)] > 1


def _entry(name: str, inner: str, arguments: tuple[Argument, ...]) -> str:
    """Function that is called: places of array objects and numbers; 0, the number of a wrong argument, or -1.

    Wrong is an array of another type or shape, and what is to be written but may not be; -1 says that the loop failed.
    """
    head = object.__basicsize__
    lines, passed, given = (
        ["begin:", "  %back = alloca ptr", "  %error = alloca ptr", "  store ptr null, ptr %back"],
        [],
        [],
    )
    lines.append("  store ptr null, ptr %error")
    for k, argument in enumerate(arguments):
        if argument.axes is None:
            kind = "double" if argument.code == "f8" else "i64"
            given.append(f"{kind} %a{k}")
            passed.append(f"{kind} %a{k}")
            continue
        given.append(f"ptr %a{k}")
        lines += _checked(k, argument, head)
        passed += ["ptr null", "ptr null", f"i64 %count{k}", f"i64 {np.dtype(argument.code).itemsize}", f"ptr %data{k}"]
        passed += [f"i64 %shape{k}.{i}" for i in range(argument.axes)]
        passed += [f"i64 %stride{k}.{i}" for i in range(argument.axes)]
    lines += [
        f'  %code = call i32 @"{inner}"(ptr %back, ptr %error, {", ".join(passed)})',
        "  %bad = icmp ne i32 %code, 0",
        "  %end = select i1 %bad, i32 -1, i32 0",
        "  ret i32 %end",
    ]
    return f'\ndefine i32 @"{name}"({", ".join(given)}) {{\n' + "\n".join(lines) + "\n}\n"


def _checked(k: int, argument: Argument, head: int) -> list[str]:
    """Lines that check an array and look up its place, lengths and strides."""
    dtype, flags = np.dtype(argument.code), _C_ORDER | _ALIGNED | (_WRITEABLE if argument.written else 0)
    lines = []

    def at(name: str, kind: str, base: str, offset: int) -> None:
        lines.append(f"  %{name}.at = getelementptr i8, ptr %{base}, i64 {offset}")
        lines.append(f"  %{name} = load {kind}, ptr %{name}.at")

    at(f"axes{k}", "i32", f"a{k}", head + _AXES)
    at(f"flags{k}", "i32", f"a{k}", head + _FLAGS)
    at(f"dtype{k}", "ptr", f"a{k}", head + _DTYPE)
    at(f"number{k}", "i32", f"dtype{k}", head + _NUMBER)
    at(f"order{k}", "i8", f"dtype{k}", head + _BYTE_ORDER)
    lines += [
        f"  %set{k} = and i32 %flags{k}, {flags}",
        f"  %e{k}.0 = icmp eq i32 %axes{k}, {argument.axes}",
        f"  %e{k}.1 = icmp eq i32 %set{k}, {flags}",
        f"  %e{k}.2 = icmp eq i32 %number{k}, {dtype.num}",
        f"  %e{k}.3 = icmp eq i8 %order{k}, {ord(dtype.byteorder)}",
        f"  %e{k}.4 = and i1 %e{k}.0, %e{k}.1",
        f"  %e{k}.5 = and i1 %e{k}.2, %e{k}.3",
        f"  %fits{k} = and i1 %e{k}.4, %e{k}.5",
        f"  br i1 %fits{k}, label %go{k}, label %wrong{k}",
        f"wrong{k}:",
        f"  ret i32 {k + 1}",
        f"go{k}:",
    ]
    at(f"data{k}", "ptr", f"a{k}", head + _DATA)
    at(f"shape{k}", "ptr", f"a{k}", head + _SHAPE)
    at(f"strides{k}", "ptr", f"a{k}", head + _STRIDES)
    count = "1"
    for i in range(argument.axes or 0):
        at(f"shape{k}.{i}", "i64", f"shape{k}", 8 * i)
        at(f"stride{k}.{i}", "i64", f"strides{k}", 8 * i)
        lines.append(f"  %count{k}.{i} = mul i64 {count}, %shape{k}.{i}")
        count = f"%count{k}.{i}"
    lines.append(f"  %count{k} = add i64 {count}, 0")
    return lines
