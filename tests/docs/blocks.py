"""The blocks of a page of the documentation: what they are, and how they are run in order, in an empty folder."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt

DOCS = Path(__file__).parents[2] / "docs"

#: Folders of pages that the build makes.
MADE = {"_build", "auto_gallery", "gallery", "reference", "reproduced", "tutorials"}

#: First lines of blocks that are files: their name in a comment.
_NAMED = re.compile(r"(?:# |<!-- |// )([\w./-]+\.(?:toml|py|csv|urdf|xml|yaml|scene))(?: -->)?\n")

#: Sizes that make a search short, in Python and in files.
_SIZES = {"generations": 2, "population": 8, "repeats": 1}


@dataclass(frozen=True)
class Block:
    """A fenced block.

    Attributes:
        language: first word after the fence.
        said: the other words.
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
        """Arguments of each command, and the exit code that is said after it."""
        for line in self.code.replace("\\\n", " ").splitlines():
            words = shlex.split(line, comments=True)
            if words:
                ends = re.search(r"# exits with (\d)", line)
                yield words, int(ends[1]) if ends else 0


def pages() -> list[str]:
    """Every page that is written by hand, by its place in the documentation."""
    files = (file.relative_to(DOCS) for file in DOCS.rglob("*.md"))
    return sorted(str(file) for file in files if not MADE & set(file.parts))


def blocks(page: str) -> list[Block]:
    """The fenced blocks of a page in order."""
    text = (DOCS / page).read_text(encoding="utf-8")
    found = re.finditer(r"^( *)```([^\n`{]*)\n(.*?)^\1```$", text, re.DOTALL | re.MULTILINE)
    return [
        Block(
            language=match[2].partition(" ")[0],
            said=match[2].partition(" ")[2].strip(),
            code=re.sub(rf"^{match[1]}", "", match[3], flags=re.MULTILINE),
            line=text.count("\n", 0, match.start()) + 1,
        )
        for match in found
    ]


def written(block: Block, folder: Path, *, short: bool) -> None:
    """Write a block that is a file into a folder, with small sizes of searches if they are to be short."""
    code = block.code
    if short:
        for key, size in _SIZES.items():
            code = re.sub(rf"^{key} = \d+", f"{key} = {size}", code, flags=re.MULTILINE)
    place = folder / block.file
    place.parent.mkdir(parents=True, exist_ok=True)
    place.write_text(code, encoding="utf-8")


def run_page(
    page: str, folder: Path, command: Callable[[list[str]], Any], *, short: bool, told: Callable[[], str]
) -> None:
    """Run what a page shows in an empty folder, in order, and compare what is printed with what it shows.

    Args:
        page: its place in the documentation.
        folder: an empty folder, the current one.
        command: runs a command line of trajevo, and prints what it prints.
        short: whether searches are short, so that numbers are not compared.
        told: gives all that was printed so far.
    """
    names: dict[str, Any] = {"__name__": "__page__"}
    for block in blocks(page):
        where = f"{page}:{block.line}"
        if block.file:
            written(block, folder, short=short)
        if block.no_run:
            continue
        if block.language == "python":
            exec(compile(block.code, where, "exec"), names)
            plt.close("all")
        elif block.language == "sh":
            for words, code in block.commands:
                assert words[0] == "trajevo", f"{where}: {words[0]} is not run: say ```sh no-run: why"
                done = command(words[1:])
                assert done.returncode == code, f"{where}: {' '.join(words)}\n{done.stdout}{done.stderr}"
                print(done.stdout)
        elif block.language == "text" and not short and block.said != "an example":
            seen = " ".join(told().split())
            for line in block.code.splitlines():
                for part in re.split(r"\s*\.\.\.\s*", line):
                    assert " ".join(part.split()) in seen, f"{where}: {part!r} was not printed"
    if not short:
        seen = told()
        for block in blocks(page):
            if block.language == "python" and not block.no_run:
                for said in re.findall(r"print\(.*\)  # ([^.,;]*\d\.\d{3,}[^.,;]*)", block.code):
                    assert said.strip() in seen, f"{page}:{block.line}: {said}"
