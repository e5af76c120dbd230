"""xacro made into a URDF by the package xacrodoc, which needs no ROS.

xacro runs expressions and opens whatever files it names: a program. So only a file that a user names is made into a
URDF; the data of a run, which may come from a stranger, holds the URDF that it gave, see
:func:`trajevo.robot.loading.arguments.load_settings`.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from trajevo.base.files import MOST_TEXT, read_bytes, why_not
from trajevo.base.plain import parsed_xml
from trajevo.errors import InvalidInputError, known_names

#: Ending of xacro files.
ENDING = ".xacro"

#: Names of the arguments that a text of xacro declares.
_DECLARED = re.compile(rb"""<xacro:arg\s[^>]*?\bname\s*=\s*["']([^"']+)["']""")


def checked_arguments(given: Any) -> dict[str, str]:
    """The arguments of a xacro file as text: numbers and truth values as ROS writes them.

    Raises:
        InvalidInputError: no mapping from names to texts, numbers or truth values.
    """
    if not isinstance(given, Mapping) or not all(isinstance(name, str) and name for name in given):
        raise InvalidInputError(f"xacro: expected a mapping from the names of arguments to values, got {given!r}")
    arguments = {}
    for name, value in given.items():
        if not isinstance(value, str | int | float):
            raise InvalidInputError(f"xacro: {name}: expected a text, a number or a truth value, got {value!r}")
        arguments[name] = str(value).lower() if isinstance(value, bool) else str(value)
    return arguments


def expanded(file: Path, arguments: Mapping[str, Any], packages: Sequence[Path]) -> ElementTree.Element:
    """The top element of the URDF that a xacro file gives.

    Args:
        file: the file.
        arguments: values of its ``<xacro:arg>``.
        packages: folders in which ``$(find NAME)`` looks, the first first; then those of ROS.

    Raises:
        InvalidInputError: the file cannot be read or evaluated, an argument that it does not have, or xacrodoc is not
            installed. Data of a run that names it, see :func:`trajevo.base.files.opening_robots_only`.
    """
    given = checked_arguments(arguments)
    try:
        content = read_bytes(file)
    except OSError as error:
        raise InvalidInputError(f"{file}: cannot be read: {why_not(error)}") from error
    try:
        xacro, finder = importlib.import_module("xacro"), importlib.import_module("xacrodoc.packages")
    except ImportError as error:
        raise InvalidInputError(
            f"{file} is xacro, which needs the package xacrodoc: pip install 'trajevo[xacro]' brings it; or run "
            f"`xacro {file.name} > {file.with_suffix('').stem}.urdf` where ROS is and give that file"
        ) from error
    before, said = len(xacro.all_includes), io.StringIO()
    with _finding(finder, file, packages), contextlib.redirect_stderr(said), contextlib.redirect_stdout(said):
        try:
            found = xacro.process_file(str(file.resolve()), mappings=dict(given), verbosity=0).toxml()
        except Exception as error:
            raise InvalidInputError(f"{file}: cannot be evaluated: {_reason(error)}") from error
    _check_declared(file, given, content, xacro.all_includes[before:])
    if len(found) > MOST_TEXT:
        raise InvalidInputError(f"{file}: gives a URDF of {len(found) / 2**20:.1f} MiB, expected at most 16 MiB")
    return parsed_xml(found.encode(), file)


@contextlib.contextmanager
def _finding(finder: Any, file: Path, packages: Sequence[Path]) -> Iterator[None]:
    """A context in which packages are found in these folders, as those of meshes are, and nowhere from before."""
    known: dict[str, Path] = {}
    for folder in packages:
        here = [folder, *sorted(each for each in folder.iterdir() if each.is_dir())] if folder.is_dir() else []
        for each in here:
            known.setdefault(each.name, each)
    usual = finder._finder
    finder.reset()
    try:
        finder.walk_up_from(file)
        finder.update_package_cache(known)
        yield
    finally:
        finder._finder = usual


def _check_declared(file: Path, given: Mapping[str, str], content: bytes, included: Sequence[str]) -> None:
    """Refuse arguments that nothing declares, which xacro takes without a word."""
    texts = [content, *(read_bytes(Path(each)) for each in included if Path(each).suffix == ENDING)]
    declared = {name.decode(errors="replace") for text in texts for name in _DECLARED.findall(text)}
    for name in given:
        if name not in declared:
            raise InvalidInputError(f"{file}: xacro: unknown argument {name!r}; {known_names(name, sorted(declared))}")


def _reason(error: Exception) -> str:
    """What xacro says, in one line."""
    inner = getattr(error, "exc", None)
    said = " ".join(str(error).split()) or type(error).__name__
    missing = re.fullmatch(r"Undefined substitution argument (\S+).*", said)
    if missing:
        return f"its argument {missing[1]!r} has no value: give it by xacro={{{missing[1]!r}: ...}}"
    lost = re.match(r".*Package not found: (\S+)", said)
    if lost:
        return f"package {lost[1]!r} is in none of the folders around it: name the folder that holds it by packages="
    return said if inner is None or str(inner) in said else f"{said} {inner}"
