"""The blocks of a page of the documentation: what they are, and how they are run in order, in an empty folder."""

from __future__ import annotations

import contextlib
import io
import re
import shlex
import sys
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import pytest

import trajevo
from tests.helpers import trajevo as command
from trajevo.solvers.task import Task

DOCS = Path(__file__).parents[2] / "docs"

#: Folders of pages that the build makes.
MADE = {"_build", "api", "auto_gallery", "gallery", "reproduced"}
#: Pages of the reference that it makes.
KEYS = {"catalogue_toml.md", "commands.md", "robot_toml.md", "study_toml.md", "task_toml.md"}

#: First lines of blocks that are files: their name in a comment.
_NAMED = re.compile(r"(?:# |<!-- )([\w./-]+\.(?:toml|py|csv|urdf|yaml))(?: -->)?\n")

#: Languages of blocks that are run.
LANGUAGES = ("python", "sh")

#: Sizes that make a search short.
SMALL = {"generations": 2, "population": 8}


@dataclass(frozen=True)
class Block:
    """A fenced block.

    Attributes:
        language: first word after the fence.
        said: the other words: why it is not run (`no-run: why`), or of a text that nothing here prints it.
        code: what is between the fences.
        line: line of the page on which it begins.
    """

    language: str
    said: str
    code: str
    line: int

    @property
    def no_run(self) -> str:
        """Why it is not run; empty if it is."""
        return self.said.removeprefix("no-run:").strip() if self.said.startswith("no-run:") else ""

    @property
    def file(self) -> str:
        """Name of the file that it is, if its first line says one."""
        found = _NAMED.match(self.code)
        return found[1] if found else ""

    @property
    def commands(self) -> Iterator[tuple[list[str], int]]:
        """Words of each command, and the exit code that is said after it."""
        for line in self.code.replace("\\\n", " ").splitlines():
            words = shlex.split(line, comments=True)
            if words:
                ends = re.search(r"# exits with (\d)", line)
                yield words, int(ends[1]) if ends else 0


def pages() -> list[str]:
    """Every page that is written by hand, by its place in the documentation."""
    files = (file.relative_to(DOCS) for file in DOCS.rglob("*.md"))
    return sorted(str(file) for file in files if not MADE & set(file.parts) and file.name not in KEYS)


def blocks(page: str) -> list[Block]:
    """The fenced blocks of a page in order."""
    text = (DOCS / page).read_text(encoding="utf-8")
    found = re.finditer(r"^```([^\n`]*)\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)
    return [
        Block(
            language=match[1].partition(" ")[0],
            said=match[1].partition(" ")[2].strip(),
            code=match[2],
            line=text.count("\n", 0, match.start()) + 1,
        )
        for match in found
    ]


def runs(page: str) -> bool:
    """Whether a page shows something that is run."""
    return any(block.language in LANGUAGES and not block.no_run for block in blocks(page))


@contextlib.contextmanager
def short_searches() -> Iterator[None]:
    """Searches of a few small generations, in Python and in tasks, that are not polished."""

    def short(search: Any) -> Any:
        return lambda problem, *given, **settings: search(problem, *given, **settings | SMALL | {"polish": False})

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(trajevo, "optimise", short(trajevo.optimise))
        patch.setattr(Task, "solve", short(Task.solve))
        yield


def run_page(page: str, folder: Path, *, short: bool = False, languages: Collection[str] = LANGUAGES) -> str:
    """Run what a page shows in an empty folder, in order, and compare what is printed with what it shows.

    Args:
        page: its place in the documentation.
        folder: an empty folder, the current one.
        short: whether searches are short, so that what is printed is not compared.
        languages: those of the blocks that are run.

    Returns:
        All that was printed.
    """
    names: dict[str, Any] = {"__name__": "__page__"}
    told = io.StringIO()
    try:
        with contextlib.redirect_stdout(told), short_searches() if short else contextlib.nullcontext():
            for block in blocks(page):
                where = f"{page}:{block.line}"
                if block.file:
                    _write(block, folder, short=short)
                if block.no_run or block.language not in {*languages, "text"}:
                    continue
                if block.language == "python":
                    exec(compile(block.code, where, "exec"), names)
                    plt.close("all")
                elif block.language == "sh":
                    _run_commands(block, where, short=short)
                if not short and (block.language == "python" or set(LANGUAGES) <= set(languages)):
                    compare(block, where, told.getvalue())
    finally:
        for name in [name for name, one in sys.modules.items() if str(folder) in str(getattr(one, "__file__", ""))]:
            del sys.modules[name]
    return told.getvalue()


def _write(block: Block, folder: Path, *, short: bool) -> None:
    code = block.code
    for key, size in (SMALL | {"repeats": 1}).items() if short else ():
        code = re.sub(rf"^{key} = \d+", f"{key} = {size}", code, flags=re.MULTILINE)
    place = folder / block.file
    place.parent.mkdir(parents=True, exist_ok=True)
    place.write_text(code, encoding="utf-8")


def _run_commands(block: Block, where: str, *, short: bool) -> None:
    for words, code in block.commands:
        assert words[0] == "trajevo", f"{where}: {words[0]} is not run; say so: ```sh no-run: why"
        if short and words[1] == "solve":
            sizes = [word for key, size in SMALL.items() for word in (f"--{key}", str(size))]
            words = [*words, *sizes, "--no-polish", "--no-pictures", "--report", "none", "--quiet"]
        done = command(*words[1:])
        assert done.returncode == code, f"{where}: {' '.join(words)}\n{done.stdout}{done.stderr}"
        print(done.stdout)


def compare(block: Block, where: str, told: str) -> None:
    """Assert that numbers that comments say were printed, and every line of a text that shows what was printed."""
    if block.language == "python" and not block.no_run:
        for said in re.findall(r"print\(.*\)  # ([^.,;\n]*\d\.\d{3,}[^.,;\n]*)", block.code):
            assert said.strip() in told, f"{where}: {said.strip()!r} was not printed"
    elif block.language == "text" and not block.said and not block.file:
        seen = " ".join(told.split())
        for part in re.split(r"\n|\.\.\.", block.code):
            assert " ".join(part.split()) in seen, f"{where}: {part.strip()!r} was not printed"
