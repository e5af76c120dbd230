"""Which docstrings of public names leave a reader without a unit, a shape, or a word on an argument."""

from __future__ import annotations

import ast
import dataclasses
import inspect
import re
from collections.abc import Iterator
from typing import Any

import api

#: A unit in square brackets, as in ``[rad or m]``; ranges such as ``[0, 1]`` are none.
_UNIT = re.compile(r"\[(?![\d.\-]+,)[^\]\[]+\]")

#: Words that say that a number has no unit, or where its unit is told.
_WITHOUT = re.compile(
    r"\b(shares?|factors?|weights?|ratios?|counts?|numbers? of|no unit|probabilit\w+|fractions?|tolerances? of|"
    r"SI units?|units? of|in the unit|indices|index|seeds?|degree|inches|percent|normals?|directions?|axis|axes|"
    r"rotation matri\w+|quaternions?|ranks?|hypervolumes?|pseudo-weights?|levels?|exponents?|parameters? of|"
    r"decision vectors?|SI|masks?|numbers?|as for|as (?=:attr:|``))(?!\w)",
    re.IGNORECASE,
)

#: Annotations of numbers and of arrays.
_NUMBERS, _ARRAYS = {"float", "Array", "ndarray"}, {"Array", "ndarray"}


def sentences(value: Any) -> dict[str, str]:
    """What a docstring says of each argument and attribute; that of a class also what its bases say."""
    found: dict[str, str] = {}
    for one in reversed(value.__mro__) if inspect.isclass(value) else (value,):
        for heading in ("Args", "Attributes"):
            listed = inspect.cleandoc(one.__doc__ or "").partition(f"{heading}:\n")[2]
            listed = re.split(r"\n(?=\S)", listed)[0]
            for names, text in re.findall(
                r"^    (\*{0,2}\w+(?:, \*{0,2}\w+)*): (.*(?:\n {8}.*)*)", listed, re.MULTILINE
            ):
                found |= {name.strip("* "): text for name in names.split(",")}
    return found


def returned(value: Any) -> str:
    """All that a docstring says besides arguments and errors, where the unit of what is returned may stand."""
    text = inspect.cleandoc(value.__doc__ or "")
    return re.sub(r"(?ms)^(Args|Raises|Attributes):\n.*?(?=^\S|\Z)", "", text)


def members(value: type) -> Iterator[tuple[str, Any]]:
    """Public functions and properties that a class itself defines, as functions."""
    for name, member in list(vars(value).items()):
        function = getattr(member, "fget", None) or getattr(member, "func", None) or getattr(member, "__func__", member)
        if inspect.isfunction(function) and (not name.startswith("_") or name in ("__call__",)):
            yield name, function


def complaints(place: str, value: Any) -> Iterator[str]:
    """What a public function or class leaves unsaid: one sentence each.

    Args:
        place: its dotted name.
        value: the function or class.
    """
    if not inspect.getdoc(value):
        yield f"{place}: no docstring"
        return
    yield from _of_arguments(place, value)
    if inspect.isclass(value):
        for name, function in members(value):
            if not inspect.getdoc(function) and not _inherits(value, name):
                yield f"{place}.{name}: no docstring"
            elif function.__doc__ and not _inherits(value, name):  # what a base says holds for its kinds
                yield from _of_arguments(f"{place}.{name}", function)
                yield from _of_result(f"{place}.{name}", function)
    elif inspect.isfunction(value):
        yield from _of_result(place, value)


def _inherits(value: type, name: str) -> bool:
    return any(getattr(getattr(base, name, None), "__doc__", None) for base in value.__mro__[1:])


def _of_arguments(place: str, value: Any) -> Iterator[str]:
    said = sentences(value)
    wanted = _annotated(value)
    listed = "Args:" in (value.__doc__ or "") or "Attributes:" in (value.__doc__ or "")
    for name, annotation in wanted.items():
        if name in said:
            yield from _of_text(f"{place}: {name}", annotation, said[name], around=returned(value))
        elif listed or inspect.isclass(value):
            yield f"{place}: nothing is said of {name}"
        else:  # a line that says all
            yield from _of_text(f"{place}: {name}", annotation, returned(value))


def _annotated(value: Any) -> dict[str, str]:
    """Arguments of a function, or of a class's constructor or dataclass, with their annotations as text."""
    if inspect.isclass(value):
        if dataclasses.is_dataclass(value) and value.__dataclass_params__.init:  # type: ignore[attr-defined]
            return {
                one.name: str(one.type)
                for one in dataclasses.fields(value)
                if not one.name.startswith("_") and one.init
            }
        value = vars(value).get("__init__")
    if not inspect.isfunction(value):
        return {}
    parameters = inspect.signature(value).parameters.values()
    return {
        p.name: str(p.annotation) for p in parameters if p.name not in ("self", "cls") and not p.name.startswith("_")
    }


def _of_result(place: str, function: Any) -> Iterator[str]:
    annotation = str(inspect.signature(function).return_annotation)
    yield from _of_text(f"{place}: what it gives", annotation, returned(function))


def _of_text(place: str, annotation: str, text: str, around: str = "") -> Iterator[str]:
    """What is missing in what is said of a number; ``around`` is what is said of all numbers together."""
    if not _is_number(annotation):
        return
    if not (_UNIT.search(text) or _WITHOUT.search(text)):
        yield f"{place}: a number without a unit, or a word that it has none: {' '.join(text.split())!r}"
    shaped = re.search(r"\([^)]*[\w.,\d]\)|same shape|as for|as (?=:attr:|``)", text + around)
    if _names(annotation) & _ARRAYS and not shaped:
        yield f"{place}: an array without its shape: {' '.join(text.split())!r}"


def _is_number(annotation: str) -> bool:
    return bool(_names(annotation) & _NUMBERS)


def _names(annotation: str) -> set[str]:
    """Names in an annotation; of a function those of its arguments and result do not count."""
    try:
        tree = ast.parse(annotation, mode="eval")
    except SyntaxError:
        return set()
    if any(isinstance(node, ast.Name) and node.id == "Callable" for node in ast.walk(tree)):
        return set()
    return {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}


def all_complaints() -> Iterator[str]:
    """Complaints about all that has a page, each function and class once."""
    for title, entries in api.groups().items():
        for entry in entries:
            if entry.kind != "data" and title != api.ERRORS:
                yield from complaints(entry.place, entry.value)
