"""Mutations of a file: of its bytes, of numbers and texts in it, of JSON trees, of arrays, and of lines."""

from __future__ import annotations

import io
import json
import re
import zipfile
from collections.abc import Callable
from random import Random
from typing import Any

import numpy as np

#: Numbers that readers are likely to trip over.
NUMBERS = (
    "nan", "NaN", "inf", "-inf", ".inf", "Infinity", "1e400", "-1", "0", "-0.0", "1e308", "5e-324", "1e20",
    "2147483648", "9223372036854775808", "-9223372036854775809", "1000000000", "9" * 5000,
    "0x10", "1_0", "true", "null", '""',
    "[]", "{}", "1:30", "010",
)  # fmt: skip

#: Texts that readers, terminals, spreadsheets or file systems are likely to trip over.
TEXTS = (
    "", "\x1b[31mred", "\x9b31m", "\u202eright", "two\nlines", "a\rb", "a\tb", "\0", "=HYPERLINK(1)", "@SUM(1)",
    "../../x", "/etc/passwd", "/dev/zero", "file:///etc/passwd", "package://../x", "a" * 5000,
    "\ud800", "\U0001f916", "inf", "nan",
    "1 deg", "-1 kg", "1e999 N", "%s%n", "${x}", "{0}", "<x>", "&lt;", "joint_1", "j1", "time", "x", "..", ".",
    "-", "#",
)  # fmt: skip

#: Values that a JSON tree may get anywhere.
VALUES: tuple[Any, ...] = (
    None, True, False, 0, -1, 1, 2**31, 2**63, 10**30, -(2**63) - 1, 0.5, 1e308, -1e308, 5e-324, float("nan"),
    float("inf"),
    "", [], {}, [[]], [None], [1, 2], {"name": 1}, {"label": "a", "value": 1}, *TEXTS,
)  # fmt: skip

#: Share of numbers that are changed to others which a reader may take.
_GENTLY = 0.6

#: Digits from which Python refuses to turn a number into text, and fewer.
_LONG = 1000

_NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?")
_TEXT = re.compile(rb'"[^"\n]{0,80}"')
_DTYPES = ("f8", "f4", "f2", "c16", "i8", "i1", "u8", "?", "U3", "S3", "M8[s]", "V4")

Mutation = Callable[[bytes, Random], bytes]


def mutated(content: bytes, random: Random) -> bytes:
    """A file with one to three mutations that fit its content."""
    for _ in range(random.choice((1, 1, 1, 2, 3))):
        content = random.choice(_fitting(content))(content, random)
    return content


def _fitting(content: bytes) -> tuple[Mutation, ...]:
    if content.startswith(b"PK"):
        return (_arrays,) * 20 + _BYTES
    if content[:1] in (b"{", b"["):
        return (_tree,) * 20 + _TOKENS * 4 + _BYTES
    readable = not content[:4096].translate(None, bytes(range(9, 14)) + bytes(range(32, 256)))
    return _TOKENS * 12 + _LINES * 2 + _BYTES if readable else _BYTES


def _span(content: bytes, random: Random, longest: int = 200) -> tuple[int, int]:
    begin = random.randrange(len(content) + 1)
    return begin, min(len(content), begin + random.randrange(1, longest))


def _flip(content: bytes, random: Random) -> bytes:
    changed = bytearray(content or b"\0")
    for _ in range(random.choice((1, 1, 4, 32))):
        changed[random.randrange(len(changed))] ^= 1 << random.randrange(8)
    return bytes(changed)


def _cut(content: bytes, random: Random) -> bytes:
    begin, end = _span(content, random)
    return content[:begin] + content[end:]


def _truncate(content: bytes, random: Random) -> bytes:
    return content[: random.randrange(len(content) + 1)]


def _repeat(content: bytes, random: Random) -> bytes:
    begin, end = _span(content, random)
    return content[:begin] + content[begin:end] * random.choice((2, 3, 50)) + content[end:]


def _insert(content: bytes, random: Random) -> bytes:
    begin, _ = _span(content, random)
    return content[:begin] + random.randbytes(random.choice((1, 2, 4, 64))) + content[begin:]


def _stand_for(pattern: re.Pattern[bytes], by: Callable[[bytes, Random], bytes]) -> Mutation:
    def replaced(content: bytes, random: Random) -> bytes:
        places = list(pattern.finditer(content))
        if not places:
            return _flip(content, random)
        place = random.choice(places)
        return content[: place.start()] + by(place[0], random) + content[place.end() :]

    return replaced


def _number(old: bytes, random: Random) -> bytes:
    if random.random() < _GENTLY and len(old) < _LONG:
        return json.dumps(_near(json.loads(old.lstrip(b"0") or b"0") if old.isdigit() else float(old), random)).encode()
    return random.choice(NUMBERS).encode()


def _text(old: bytes, random: Random) -> bytes:
    text = random.choice(TEXTS)
    return (json.dumps(text) if random.random() < 0.5 else f'"{text}"').encode(errors="surrogatepass")


def _nest(content: bytes, random: Random) -> bytes:
    begin, _ = _span(content, random)
    mark = random.choice((b"[", b"{", b"[[", b'{"a":', b"- ", b"<a>", b"(", b"a.", b"&a [*a,"))
    return content[:begin] + mark * random.choice((20, 40, 150, 3000)) + content[begin:]


def _line(content: bytes, random: Random) -> bytes:
    lines = content.split(b"\n")
    at, other = random.randrange(len(lines)), random.randrange(len(lines))
    match random.randrange(4):
        case 0:
            lines[at], lines[other] = lines[other], lines[at]
        case 1:
            del lines[at]
        case 2:
            lines.insert(other, lines[at])
        case _:
            lines[at] = random.choice(
                (b"", b"x", b"a = 1", b"[a]", b"[[a]]", b"a: &b [*b]", b"<a/>", b"1,2", b"\xef\xbb\xbf")
            )
    return b"\n".join(lines)


def _near(value: Any, random: Random) -> Any:
    """A value of the same type that a reader may take, so that what comes after its checks is tried too."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, int):
        return random.choice((0, 1, 2, 3, value + 1, value - 1, 2 * value, -value, 1000, 10**6, 2**31 - 1))
    if isinstance(value, float):
        return value * random.choice((0.0, 0.5, 1.0 + 1e-12, 1.1, 2.0, -1.0, 1e3, 1e-9, 1e9, 1e150))
    if isinstance(value, str):
        return random.choice(
            (*TEXTS, value + " ", value.upper(), value[:-1], "time", "quintic_spline", "nsga2", "rad", "deg")
        )
    if isinstance(value, list) and value:
        return random.choice((value[1:], [*value, value[0]], value[::-1], [value[0]] * len(value)))
    return value


#: Lines that take the place of others.
_ODD_LINES = (b"", b"x", b"a = 1", b"[a]", b"[[a]]", b"a: &b [*b]", b"<a/>", b"1,2", b"\xef\xbb\xbf", b"<!DOCTYPE a>")


def _tree(content: bytes, random: Random) -> bytes:
    """JSON with an entry replaced, removed, renamed or repeated."""
    try:
        whole = [json.loads(content)]
    except (ValueError, RecursionError):
        return _flip(content, random)
    above: Any = whole
    while True:
        keys = list(above) if isinstance(above, dict) else range(len(above))
        if not keys:
            return _flip(content, random)
        key = random.choice(keys)
        if not isinstance(above[key], dict | list) or not above[key] or random.random() < 0.25:
            break
        above = above[key]
    match random.randrange(8):
        case 0:
            above[key] = random.choice(VALUES)
        case 5 | 6 | 7:
            above[key] = _near(above[key], random)
        case 2 if above is not whole:
            del above[key]
        case 3 if isinstance(above, dict):
            above[random.choice(TEXTS)] = above[key]
        case 4 if isinstance(above, list) and above is not whole:
            above.insert(0, above[key])
        case _:
            above[key] = [above[key]]
    return json.dumps(whole[0]).encode(errors="surrogatepass")


def _arrays(content: bytes, random: Random) -> bytes:
    """A file of arrays with one of them changed, removed, renamed, repeated, or with a header that lies."""
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as found:
            arrays = dict(found)
    except Exception:  # noqa: BLE001 - mutated before, by other means
        return _flip(content, random)
    if not arrays:
        return _flip(content, random)
    name = random.choice(list(arrays))
    stream, change = io.BytesIO(), random.randrange(8)
    if change == 0:
        del arrays[name]
    elif change == 1:
        arrays[random.choice(("x", "X", "solver.X", "note.a", "has.a", "books.evaluations", "../x"))] = arrays.pop(name)
    elif change < 6:
        arrays[name] = _array(arrays[name], random)
    with zipfile.ZipFile(stream, "w", random.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED))) as archive:
        for key, array in arrays.items():
            packed = io.BytesIO()
            np.lib.format.write_array(packed, array, allow_pickle=True)
            data = packed.getvalue()
            if key == name and change == 6:
                data = re.sub(rb"'shape': \([^)]*\)", random.choice(_SHAPES), data, count=1)
            archive.writestr(f"{key}.npy", data)
    return stream.getvalue()


#: Shapes that a header may claim.
_SHAPES = (b"'shape': (9999999999,)", b"'shape': (-1, -1)", b"'shape': (0, 99999999)", b"'shape': ()", b"'shape': 1/0")


def _array(array: Any, random: Random) -> Any:
    match random.randrange(7):
        case 0:
            return array[:-1] if array.ndim else np.zeros((2, 2))
        case 1:
            return array[None]
        case 2:
            return array.ravel()
        case 3:
            return np.concatenate([array, array]) if array.ndim else np.array(random.choice(NUMBERS))
        case 4:
            return np.zeros(random.choice(((0,), (0, 3), (3, 0), (2, 2, 2), ())), random.choice(_DTYPES))
        case 0 | 5 | 6 if array.dtype.kind in "fi" and array.size and random.random() < _GENTLY:
            changed = array.copy()
            place = random.randrange(array.size)
            changed.flat[place] = min(max(_near(array.flat[place].item(), random), -(2**31)), 2**31)
            return changed
        case 5 if array.dtype.kind in "fi" and array.size:
            changed = array.copy()
            changed.flat[random.randrange(array.size)] = (
                random.choice((0, -1, 2**31 - 1))
                if array.dtype.kind == "i"
                else (random.choice((np.nan, np.inf, -np.inf, -1.0, 0.0, 1e308)))
            )
            return changed
        case 6 if array.dtype.kind == "U" and not array.ndim:
            return np.array(_tree(str(array).encode(), random).decode(errors="replace"))
    return np.full(array.shape, random.choice(("x", "1", "", "{")))


_BYTES: tuple[Mutation, ...] = (_flip, _flip, _cut, _truncate, _repeat, _insert)
_TOKENS: tuple[Mutation, ...] = (_stand_for(_NUMBER, _number), _stand_for(_TEXT, _text))
_LINES: tuple[Mutation, ...] = (_line, _line, _nest)
