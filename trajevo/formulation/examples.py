"""Worked examples in the installed package: tasks, studies and notebooks, by name."""

from __future__ import annotations

import json
import os
import shutil
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from trajevo.base.files import data_folder, why_not
from trajevo.errors import InvalidInputError, checked_name, no_such_file
from trajevo.formulation.registry import list_problems

#: Kinds of examples: their data folder, and the pattern of their files.
KINDS = {
    "task": ("problems", "tasks/*.toml"),
    "study": ("problems", "studies/*.toml"),
    "notebook": ("notebooks", "[0-9]*.ipynb"),
}


@dataclass(frozen=True)
class Example:
    """A worked example.

    Attributes:
        kind: ``"task"``, ``"study"`` or ``"notebook"``.
        file: path of its file.
    """

    kind: str
    file: Path

    @property
    def name(self) -> str:
        """Its name, which is that of the file without suffix."""
        return self.file.stem

    @property
    def summary(self) -> str:
        """Its first line: the comment at the top of a TOML file, or the title of a notebook."""
        text = self.file.read_text(encoding="utf-8")
        if self.kind == "notebook":
            text = "".join(json.loads(text)["cells"][0]["source"])
        return text.partition("\n")[0].lstrip("# ").rstrip(".")

    @property
    def compares_robots(self) -> bool:
        """Whether it is a task that names robots to choose from, for ``trajevo choose-robot``."""
        return self.kind == "task" and "robots" in tomllib.loads(self.file.read_text(encoding="utf-8"))

    @property
    def files(self) -> tuple[Path, ...]:
        """The file itself, and the files in its folder that its values name."""
        if self.kind == "notebook":
            return (self.file,)
        texts = _texts(tomllib.loads(self.file.read_text(encoding="utf-8")))
        beside = (self.file.parent / text for text in texts if Path(text).name == text)
        return (self.file, *sorted({file for file in beside if file.is_file()}))


def list_examples(kind: str | None = None) -> dict[str, Example]:
    """Worked examples by name, all (tasks, then studies, then notebooks) or those of one kind."""
    found = (
        Example(own, file)
        for own, (folder, pattern) in KINDS.items()
        for file in sorted(data_folder(folder).glob(pattern))
        if kind in (None, own)
    )
    return {example.name: example for example in found}


def example_file(kind: str, given: str | Path, *, folder: str | Path = ".") -> Path:
    """The file that a user means: a path, or the name of a worked example.

    Args:
        kind: ``"task"`` or ``"study"``.
        given: path of a TOML file, or a name of :func:`list_examples`.
        folder: folder from which a relative path starts.

    Raises:
        UnknownNameError: ``given`` is not a file, does not end in ``.toml`` and is not the name of an example.
    """
    path = Path(folder) / given
    if path.suffix == ".toml" or os.path.isfile(path):
        return path
    if len(Path(given).parts) > 1:
        raise InvalidInputError(no_such_file(path))
    known = list_examples(kind)
    return known[checked_name(kind, str(given), known)].file


def is_task(given: str) -> bool:
    """Whether the argument of ``trajevo solve`` is a task (its file or its name), not a registered problem.

    Raises:
        UnknownNameError: it is neither a task nor a problem.
    """
    problems, tasks = list_problems(), list_examples("task")
    if Path(given).suffix == ".toml":
        return True
    if Path(f"{given}.toml").is_file() and given not in (*problems, *tasks):
        raise InvalidInputError(f"{given}: no such problem or task; did you mean the file '{given}.toml'?")
    return checked_name("problem or task", given, [*problems, *tasks]) not in problems


def copy_example(name: str, folder: str | Path) -> list[Path]:
    """Copy a worked example, with the files that it reads, to a folder in which it can be changed.

    Args:
        name: a name in :func:`list_examples`.
        folder: target folder; it is created if it does not exist.

    Returns:
        The copies, that of the example itself first.

    Raises:
        UnknownNameError: no such example.
        InvalidInputError: one of the files exists already, in which case nothing is copied, or cannot be written.
    """
    known = list_examples()
    files = known[checked_name("example", name, known)].files
    copies = [Path(folder) / file.name for file in files]
    for copy in copies:
        if copy.exists() or copy.is_symlink():
            raise InvalidInputError(f"{copy}: exists already; choose another folder")
    try:
        Path(folder).mkdir(parents=True, exist_ok=True)
        for file, copy in zip(files, copies, strict=True):
            shutil.copyfile(file, copy)  # without its permissions: installed files may be read-only
    except OSError as error:
        raise InvalidInputError(f"{folder}: cannot be written: {why_not(error)}") from error
    return copies


def _texts(value: Any) -> Iterator[str]:
    """All strings among the values of a TOML file."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict | list):
        for entry in value.values() if isinstance(value, dict) else value:
            yield from _texts(entry)
