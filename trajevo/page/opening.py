"""The page of a front in a browser, for a front that has no folder."""

from __future__ import annotations

import tempfile
import webbrowser
from pathlib import Path

from trajevo.base.files import named_file
from trajevo.front.front import Front
from trajevo.page.report import report
from trajevo.plots.analyses import analyse


def open_page(front: Front, file: str | Path | None = None) -> Path:
    """Write the page of a front, with the analyses that take no time, and open it.

    Args:
        front: the front.
        file: HTML to write; in a folder of its own among the system's temporary files if None.

    Raises:
        InvalidInputError: the file cannot be written.
    """
    target = Path(tempfile.mkdtemp(prefix="trajevo-")) / "front.html" if file is None else named_file(file)
    found = analyse(front, "short") if len(front) else {}
    report(front, target, analyses=found, pictures=[], run="RUN")
    webbrowser.open(target.resolve().as_uri())
    return target
