"""The whole site builds without a warning, and no page of it loads anything from the network."""

import os
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

#: What a browser loads by itself; links that people follow are no such thing.
LOADED = re.compile(
    r"""<(?:script|img|iframe|source|video|audio)\b[^>]*\bsrc=["'](?:https?:)?//|<link\b[^>]*href=["']https?://"""
)


def loaded(text):
    """What a page loads from the network."""
    return [found[0] for found in LOADED.finditer(text) if 'rel="canonical"' not in found[0]]


def test_what_a_page_loads_is_found():
    assert loaded('<script async="async" src="https://cdn.example.org/a.js"></script>')
    assert loaded('<link href="https://fonts.example.org/a.css" rel="stylesheet">')
    assert not loaded('<a href="https://example.org">there</a><script src="_static/a.js"></script>')


@pytest.mark.long
@pytest.mark.skipif(
    any(find_spec(name) is None for name in ("sphinx", "furo", "myst_nb", "sphinx_gallery", "sphinx_design")),
    reason="the extra docs is not installed: make docs",
)
def test_the_site_builds_without_a_warning_and_without_network(tmp_path):
    command = [
        sys.executable,
        "-m",
        "sphinx",
        "--quiet",
        "--fail-on-warning",
        "--keep-going",
        "-d",
        str(tmp_path / "trees"),
    ]
    environment = os.environ | {
        "PYTHONPATH": str(ROOT),
        "http_proxy": "http://127.0.0.1:9",
        "https_proxy": "http://127.0.0.1:9",
    }
    done = subprocess.run(
        [*command, str(ROOT / "docs"), str(tmp_path / "html")], env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr[-3000:]
    pages = list((tmp_path / "html").rglob("*.html"))
    assert len(pages) > 200
    for page in pages:
        assert loaded(page.read_text(encoding="utf-8")) == [], page
