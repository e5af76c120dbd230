"""Pages of the interface in Python: one for each public name, and for each class that these take or return."""

from __future__ import annotations

import ast
import importlib
import inspect
import itertools
import sys
import typing
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from types import ModuleType
from typing import Any

import pydantic

import trajevo
from trajevo import errors

#: Rooms beside the facade, with the titles of their groups.
ROOMS = {"trajevo.plots": "Pictures", "trajevo.problems": "Problems of papers"}

#: Title of the group of classes that are no public names: what public functions take and return.
RECORDS = "What is taken and returned"

#: Title of the group of errors and warnings.
ERRORS = "Errors"


@dataclass(frozen=True)
class Entry:
    """Something with a page of its own.

    Attributes:
        home: module from which users import it; of a record, the module in which it is.
        name: its name.
        value: the thing itself.
    """

    home: str
    name: str
    value: Any

    @property
    def place(self) -> str:
        """Dotted name, by which pages refer to it."""
        return f"{self.home}.{self.name}"

    @property
    def kind(self) -> str:
        """What it is in the words of Sphinx."""
        if inspect.isclass(self.value):
            return "exception" if issubclass(self.value, BaseException) else "class"
        return "function" if callable(self.value) else "data"

    @property
    def says(self) -> str:
        """The first sentence of its docstring, on one line."""
        text = self._comment() if self.kind == "data" else inspect.getdoc(self.value) or ""
        return " ".join(text.partition("\n\n")[0].split())

    def _comment(self) -> str:
        """What a value's `#:` comment says, in the module that holds it."""
        room = importlib.import_module(self.home)
        module = importlib.import_module(f"{self.home}.{room._HOMES[self.name]}")
        above = inspect.getsource(module).partition(f"\n{self.name} = ")[0].splitlines()
        lines = list(itertools.takewhile(lambda line: line.startswith("#:"), reversed(above)))
        return " ".join(line.removeprefix("#:").strip() for line in reversed(lines))


@cache
def groups() -> dict[str, tuple[Entry, ...]]:
    """All that has a page, by the title of its group, in the order of the data flow."""
    found = {title: tuple(Entry("trajevo", n, getattr(trajevo, n)) for n in names) for title, names in _facade()}
    known = {id(entry.value) for entries in found.values() for entry in entries}
    for home, title in ROOMS.items():
        room = importlib.import_module(home)
        own = (Entry(home, name, getattr(room, name)) for name in room.__all__)
        found[title] = tuple(entry for entry in own if id(entry.value) not in known)
    public = [entry for entries in found.values() for entry in entries]
    return found | {RECORDS: tuple(_records(public)), ERRORS: tuple(_errors())}


def _facade() -> Iterator[tuple[str, list[str]]]:
    """Titles and names as the facade's table `_NAMES` lists them, whose comments are the titles."""
    source = inspect.getsource(trajevo)
    table = source.partition("_NAMES = {\n")[2].partition("\n}\n")[0]
    for part in table.split("    # ")[1:]:
        title, _, rows = part.partition("\n")
        yield title, [name for names in ast.literal_eval(f"{{{rows}}}").values() for name in names]


def bare_types(value: Any) -> None:
    """Give a model of pydantic a signature with its types alone, without what pydantic checks of them."""
    if inspect.isclass(value) and issubclass(value, pydantic.BaseModel):
        types, signature = typing.get_type_hints(value), inspect.signature(value)
        bare = [p.replace(annotation=types.get(p.name, p.annotation)) for p in signature.parameters.values()]
        value.__signature__ = signature.replace(parameters=bare)


def _errors() -> Iterator[Entry]:
    """Errors and warnings that are no public names, in the order of their module."""
    for name, value in vars(errors).items():
        if inspect.isclass(value) and issubclass(value, Exception) and name not in trajevo.__all__:
            yield Entry("trajevo.errors", name, value)


def _records(public: list[Entry]) -> list[Entry]:
    """Classes of trajevo in annotations of public names and of one another, in alphabetical order."""
    known = {id(entry.value) for entry in public}
    found: dict[str, Entry] = {}
    waiting = [entry.value for entry in public]
    while waiting:
        for one in _classes_of(waiting.pop()):
            entry = Entry(one.__module__, one.__name__, one)
            if id(one) in known or entry.place in found or one.__name__.startswith("_"):
                continue
            found[entry.place] = entry
            waiting.append(one)
    return sorted(found.values(), key=lambda entry: entry.name.lower())


def _classes_of(value: Any) -> Iterator[type]:
    """Classes of trajevo that the annotations of a function, or of a class's public members, name."""
    members = [value]
    if inspect.isclass(value):
        members = [value.__init__, *(m for n, m in vars(value).items() if not n.startswith("_"))]
        yield from _named(getattr(value, "__annotations__", {}), sys.modules[value.__module__])
    for member in members:
        member = getattr(member, "fget", None) or getattr(member, "__func__", None) or getattr(member, "func", member)
        if inspect.isfunction(member) and member.__module__.startswith("trajevo"):
            yield from _named(member.__annotations__, sys.modules[member.__module__])


def _named(annotations: dict[str, Any], module: ModuleType) -> Iterator[type]:
    for name, annotation in annotations.items():
        if name.startswith("_") or not isinstance(annotation, str):
            continue
        for node in ast.walk(ast.parse(annotation, mode="eval")):
            if isinstance(node, ast.Name):
                found = getattr(module, node.id, None) or _only_for_types(module).get(node.id)
                if inspect.isclass(found) and found.__module__.startswith("trajevo"):
                    yield found


@cache
def _only_for_types(module: ModuleType) -> dict[str, Any]:
    """What a module imports for type checkers alone."""
    found = {}
    for node in ast.walk(ast.parse(inspect.getsource(module))):
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            for line in (line for line in node.body if isinstance(line, ast.ImportFrom) and line.module):
                home = importlib.import_module(str(line.module))
                found |= {alias.asname or alias.name: getattr(home, alias.name, None) for alias in line.names}
    return found
