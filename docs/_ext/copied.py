"""What other folders hold and the site shows: notebooks, and what `trajevo reproduce` wrote."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

#: Papers whose figures and tables `trajevo reproduce` makes.
PAPERS = ("sun2020", "guo2016", "paing2021", "raji2022")


def notebooks(docs: Path) -> list[Path]:
    """Copy the notebooks to `docs/tutorials`, executed by `make docs`; those that are gone are removed there."""
    executed = docs.parent / "build" / "docs" / "tutorials"
    plain = sorted((docs.parent / "notebooks").glob("[0-9]*.ipynb"))
    sources = [executed / file.name if (executed / file.name).is_file() else file for file in plain]
    folder = docs / "tutorials"
    for old in folder.glob("*.ipynb"):
        if old.name not in {source.name for source in sources}:
            old.unlink()
    return [_copied(source, folder / source.name) for source in sources]


def reproduced(docs: Path) -> list[Path]:
    """Copy what was reproduced of each paper to `docs/papers/reproduced`, or a sentence where nothing was yet.

    Returns:
        One page for each paper, which its story includes.
    """
    pages = []
    for name in PAPERS:
        source, target = docs.parent / "build" / "reproduced" / name, docs / "papers" / "reproduced" / name
        page = target / "page.md"
        if (source / "page.md").is_file():
            for file in sorted(file for file in source.iterdir() if file.is_file() and file.suffix != ".md"):
                _copied(file, target / file.name)
            # The story that includes the page stands two folders above the files that the page links to.
            text = (source / "page.md").read_text(encoding="utf-8")
            written_file(page, re.sub(r"\]\((?=(?:figure|table)_)", f"](reproduced/{name}/", text))
        else:
            written_file(page, missing(name))
        pages.append(page)
    return pages


def missing(paper: str) -> str:
    """What a page says of a paper of which nothing was reproduced yet."""
    return (
        f"Figures and tables appear here once `trajevo reproduce {paper} --out build/reproduced/{paper}` has made them "
        "and the site is built again; `make reproduce` makes those of all papers.\n"
    )


def written(folder: Path, pages: dict[str, str]) -> None:
    """Write all pages of a folder, which holds nothing else; those that are gone are removed."""
    for old in folder.glob("*"):
        if old.name not in pages:
            old.unlink()
    for name, text in pages.items():
        written_file(folder / name, text)


def _copied(source: Path, target: Path) -> Path:
    """Copy a file unless it is there already, so that Sphinx reads again only what changed."""
    if not target.is_file() or target.read_bytes() != source.read_bytes():
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, target)
    return target


def written_file(target: Path, text: str) -> Path:
    """Write a text unless it is there already."""
    if not target.is_file() or target.read_text(encoding="utf-8") != text:
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(text, encoding="utf-8")
    return target
