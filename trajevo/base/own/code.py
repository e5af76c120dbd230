"""Functions, classes and records of the user's own, by their places in Python, ``module:name``.

A module is imported where the user names it: as an argument in Python, in a task or a study, or on the command line.
The data of a run, which may be from a stranger, imports nothing that was not named before in this process.
"""

from __future__ import annotations

import importlib
import re
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any

from trajevo.base.files import source_of_names
from trajevo.errors import InvalidInputError, NotImportedError, UnknownNameError, known_names

#: A place in Python, ``module:name``; both may have dots.
_IN_MODULE = re.compile(r"[^\W\d]\w*(\.[^\W\d]\w*)*:[^\W\d]\w*(\.[^\W\d]\w*)*")

#: A module in Python.
_MODULE = re.compile(r"[^\W\d]\w*(\.[^\W\d]\w*)*")

#: Place -> what was named there in this process.
_named: dict[str, Any] = {}

#: Places that mean something known already, see :func:`naming`.
_meant: ContextVar[dict[str, Any] | None] = ContextVar("_meant", default=None)

#: Modules that the data of runs may name.
_allowed: set[str] = set()

#: Folder in which modules are looked for too.
_folder: ContextVar[Path | None] = ContextVar("_folder", default=None)


def in_module(name: object) -> bool:
    """Whether a name is a place in Python, ``module:name``."""
    return isinstance(name, str) and _IN_MODULE.fullmatch(name) is not None


def is_module(name: str) -> bool:
    """Whether a name can be that of a module."""
    return _MODULE.fullmatch(name) is not None


def allow_module(module: str) -> None:
    """Let the data of runs name functions in a module, for as long as this process runs."""
    _allowed.add(module)


@contextmanager
def looking_in(folder: str | Path) -> Iterator[None]:
    """A context in which modules are looked for in a folder too, before anywhere else."""
    before = _folder.set(Path(folder).resolve())
    try:
        yield
    finally:
        _folder.reset(before)


@contextmanager
def naming(found: dict[str, Any]) -> Iterator[None]:
    """A context in which places mean what they meant elsewhere, whatever was named there in between."""
    before = _meant.set(found)
    try:
        yield
    finally:
        _meant.reset(before)


def known_at(place: object) -> Any:
    """What was named at a place in this process; None if nothing was."""
    return _named.get(place) if isinstance(place, str) else None


def named(given: Any, argument: str) -> Any:
    """The place of something of the user's own, which :func:`known_at` finds from now on; a plain name stays as it is.

    Args:
        given: a name, a place ``module:name``, or the thing itself.
        argument: the argument that it is given for, for messages.

    Raises:
        InvalidInputError: a place where nothing is, or one in the data of a run.
    """
    if not isinstance(given, str):
        place = _place_of(given)
        _named[place] = given
        return place
    meant = _meant.get() or {}
    if given in meant:
        _named[given] = meant[given]
    elif in_module(given):
        _named[given] = _found(given, argument)
    elif ":" in given and given not in _named and source_of_names():
        raise InvalidInputError(
            f"{argument}: {source_of_names()} names {given!r}, which was made in Python and has no place there; pass "
            "the problem"
        )
    return given


def imported(place: str, argument: str) -> Any:
    """What is at a place in Python; the module is also looked for in the folder of :func:`looking_in`.

    Args:
        place: ``module:name``, or ``module`` for the module itself.
        argument: the argument that it is given for, with which messages begin.

    Raises:
        UnknownNameError: nothing of that name is there.
        InvalidInputError: there is no such module, or it cannot be imported.
    """
    module, _, name = place.partition(":")
    found = _module(module, argument)
    for part in name.split(".") if name else ():
        space = getattr(found, "__dict__", {})
        if part not in space:
            raise UnknownNameError(f"name in module {module}", part, [one for one in space if not one.startswith("_")])
        found = space[part]
    return found


def told(error: BaseException) -> str:
    """An error of a user's code in one line, with the last file and line of that code."""
    frames = traceback.extract_tb(error.__traceback__)
    ours = str(Path(__file__).parents[2])
    own = [frame for frame in frames if not frame.filename.startswith((ours, "<frozen"))]
    at = f", {own[-1].filename}, line {own[-1].lineno}" if own else ""
    return f"{type(error).__name__}: {' '.join(str(error).split())}{at}"


def _found(place: str, argument: str) -> Any:
    """What a place means: imported, unless it is named by the data of a run."""
    source = source_of_names()
    module = place.partition(":")[0]
    if not source or module in _allowed:
        try:
            return imported(place, argument)
        except UnknownNameError as error:
            raise InvalidInputError(f"{argument}: {error}") from error
    if place in _named:
        return _named[place]
    raise NotImportedError(
        f"{argument}: {source} names {place!r}, a place in the Python module {module!r}, which is not imported for the "
        f"data of a run; if you trust it: --problem {module}, or the task's file as --problem TASK.toml; in Python "
        "pass the problem"
    )


def _place_of(thing: Any) -> str:
    """The place of a function, a class or a record in its module; of one without a place a text that is none."""
    own: Callable[..., Any] = (
        thing if callable(thing) else getattr(thing, "function", None) or getattr(thing, "make", thing)
    )
    module = getattr(own, "__module__", None) or type(own).__module__
    name = getattr(thing, "__qualname__", "")
    space = vars(sys.modules[module]) if module in sys.modules else {}
    if name and "<" not in name:
        return f"{module}:{name}"
    for key, value in space.items():
        if value is thing:
            return f"{module}:{key}"
    label = name or getattr(thing, "name", "") or type(thing).__name__
    return f"{module}: {label}"


def _module(module: str, argument: str) -> Any:
    folder = _folder.get()
    if folder is not None and str(folder) not in sys.path:
        sys.path.insert(0, str(folder))
        importlib.invalidate_caches()
    try:
        found = importlib.import_module(module)
    except ModuleNotFoundError as error:
        if error.name != module and not module.startswith(f"{error.name}."):
            raise InvalidInputError(f"{argument}: module {module}: {told(error)}") from error
        where = "" if folder is None else f", neither installed nor in {folder}"
        there = [] if folder is None else sorted(file.stem for file in folder.glob("*.py"))
        listed = f"; there are {known_names(module, there)}" if folder is not None else ""
        raise InvalidInputError(f"{argument}: no Python module {module!r}{where}{listed}") from None
    except Exception as error:
        raise InvalidInputError(f"{argument}: module {module} cannot be imported: {told(error)}") from error
    _check_same(found, module, folder, argument)
    return found


def _check_same(found: Any, module: str, folder: Path | None, argument: str) -> None:
    """Refuse a module that was imported from another folder although there is one of its name in this one."""
    file, top = getattr(found, "__file__", None), module.split(".")[0]
    if folder is None or file is None or not ((folder / f"{top}.py").is_file() or (folder / top).is_dir()):
        return
    if not Path(file).resolve().is_relative_to(folder):
        raise InvalidInputError(
            f"{argument}: module {module!r} of {folder} cannot be imported, as another one of this name is in use: "
            f"{file}; give yours another name"
        )
