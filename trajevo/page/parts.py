"""Parts that all pages share: their files, scripts with their data, and the library that draws in space."""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Iterable, Mapping
from functools import cache
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
