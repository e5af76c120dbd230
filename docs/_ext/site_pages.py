"""Extension of Sphinx: before pages are read, those made from code and from other folders are written."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import api
import api_pages
import bench_problems
import commands
import copied
import formats
import key_pages
import references
from jupyter_client.manager import AsyncKernelManager
from pygments.lexers.special import TextLexer


def _write(app: Any) -> None:
    for entry in (entry for entries in api.groups().values() for entry in entries):
        api.bare_types(entry.value)
    docs = Path(app.srcdir)
    copied.notebooks(docs)
    copied.reproduced(docs)
    reference = docs / "reference"
    copied.written(reference / "api", api_pages.pages())
    own = {"commands.md": commands, "file_formats.md": formats, "bench_problems.md": bench_problems}
    for name, text in {**{name: made.page() for name, made in own.items()}, **key_pages.pages()}.items():
        copied.written_file(reference / name, text)


def _resolve(app: Any, env: Any, node: Any, content: Any) -> Any:
    """A reference by the module in which a class is defined, or by its bare name, leads to its page.

    What is in the code but on no page is plain text; what is nowhere remains missing, which is told.
    """
    if node.get("refdomain") != "py":
        return None
    reference, domain = node["reftarget"], env.get_domain("py")
    place = references.target_of(reference)
    while place and place not in domain.objects:  # an attribute is described on the page of its class
        owner, _, name = place.rpartition(".")
        place = owner if owner and references.has_member(references.value_of(owner), name) else None
    if place:
        return domain.resolve_xref(env, node["refdoc"], app.builder, "obj", place, node, content)
    return content if references.exists(reference, node["refdoc"].rpartition("/")[2]) else None


def setup(app: Any) -> dict[str, Any]:
    """What Sphinx calls."""
    # Kernels are told by files of this user, not by ports, and notebooks are executed without a line for each.
    AsyncKernelManager.transport.default_value = "ipc"
    logging.getLogger("traitlets").setLevel(logging.WARNING)
    app.add_lexer("csv", TextLexer)  # which Pygments does not have
    app.connect("builder-inited", _write)
    app.connect("missing-reference", _resolve)
    # Before the extension that reads Google's style.
    app.connect(
        "autodoc-process-docstring", lambda _app, what, *rest: references.readable(what, rest[-1]), priority=400
    )
    return {"parallel_read_safe": True, "parallel_write_safe": True}
