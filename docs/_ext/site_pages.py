"""Extension of Sphinx: before pages are read, those made from code and from other folders are written."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import copied


def _write(app: Any) -> None:
    docs = Path(app.srcdir)
    copied.notebooks(docs)
    copied.reproduced(docs)


def setup(app: Any) -> dict[str, Any]:
    """What Sphinx calls."""
    app.connect("builder-inited", _write)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
