"""Parts that all pages share: their files, scripts with their data, and the library that draws in space."""

from __future__ import annotations

import base64
import importlib.util
import json
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from html import escape
from pathlib import Path
from string import Template
from typing import Any

from trajevo.page.packing import Packed, packed

_STATIC = Path(__file__).with_name("static")

#: What a page says in place of the robot.
NO_VIEWER = "the robot in space needs the package meshcat: pip install 'trajevo[animation]'"

#: The button that changes between light and dark.
THEME = '<button type="button" id="theme" class="live-only">light or dark</button>'


def static(name: str) -> str:
    """A file of all pages, as text."""
    return (_STATIC / name).read_text(encoding="utf-8")


def transport(instead: str = "") -> str:
    """The robot and what plays its motion.

    Args:
        instead: HTML that stands in place of the robot.
    """
    return Template(static("transport.html")).substitute(no_arm=instead)


def scripts_of(names: Iterable[str], data: Mapping[str, Any], pack: Packed, viewer: str) -> str:
    """The scripts of a page and what they read, for the end of it.

    Args:
        names: files of scripts, in the order in which they need each other.
        data: what they read, as plain data; ``arm`` is None where there is no robot to draw.
        pack: the arrays that the data names.
        viewer: the packed library that draws in space, see :func:`packed_viewer`.
    """
    # No end of a script can stand in the data.
    told = json.dumps(data, allow_nan=False).replace("<", "\\u003c")
    parts = [
        f'<script type="application/json" id="data">{told}</script>',
        f'<script type="text/plain" id="arrays">{pack.text()}</script>',
        f'<script type="text/plain" id="viewer">{viewer}</script>' if data["arm"] is not None else "",
        "<script>\n" + "\n".join(map(static, names)) + "\n</script>",
    ]
    return "\n".join(parts)


@cache
def packed_viewer() -> str:
    """The library that draws in space, three.js as meshcat brings it, packed; empty where it is not installed."""
    folder = _viewer_folder()
    return "" if folder is None else packed((folder / "main.min.js").read_bytes())


def viewer_licence() -> str:
    """The licence of that library; empty where it is not installed."""
    folder = _viewer_folder()
    return "" if folder is None else (folder / "main.min.js.LICENSE.txt").read_text(encoding="utf-8")


def _viewer_folder() -> Path | None:
    try:
        found = importlib.util.find_spec("meshcat")
    except ValueError:  # something else goes by this name
        found = None
    if found is None or not found.submodule_search_locations:
        return None
    return Path(found.submodule_search_locations[0]) / "viewer" / "dist"


def folded(title: str, content: Sequence[str]) -> str:
    """A section that is open only where no script runs, or on request."""
    return f"<details><summary>{escape(title)}</summary>{''.join(content)}</details>"


def table(
    headers: Sequence[str],
    rows: Sequence[Sequence[str]],
    *,
    numbers: int = 0,
    after: int = 1,
    chosen: int | None = None,
    key: str = "",
) -> str:
    """Rows of HTML cells.

    Args:
        headers: texts above the columns.
        rows: HTML of a cell for each header.
        numbers: number of columns that are aligned right.
        after: number of columns before these.
        chosen: row that stands out.
        key: name by which scripts find the table, and the numbers of its rows.
    """

    def cell(tag: str, column: int, content: str) -> str:
        kind = ' class="number"' if 0 <= column - after < numbers else ""
        return f"<{tag}{kind}>{content}</{tag}>"

    head = "".join(cell("th", i, escape(header)) for i, header in enumerate(headers)) if any(headers) else ""
    body = "".join(
        f"<tr{' class=chosen' if k == chosen else ''}{f' data-row={k}' if key else ''}>"
        + "".join(cell("td", i, text) for i, text in enumerate(row))
        + "</tr>"
        for k, row in enumerate(rows)
    )
    name = f' id="{key}"' if key else ""
    return f'<div class="scroll"><table{name}><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'


def figure(caption: str, png: bytes | memoryview, *, wide: bool = False) -> str:
    """A picture with its caption, which is told to those who do not see it."""
    data, told = base64.b64encode(png).decode("ascii"), escape(caption)
    image = f'<img alt="{told}" src="data:image/png;base64,{data}">'
    kind = ' class="wide"' if wide else ""
    return f"<figure{kind}>{image}<figcaption>{told}</figcaption></figure>"
