"""Files that texts name exist."""

import re
from pathlib import Path

import pytest

from tests.docs.blocks import pages

ROOT = Path(__file__).parents[1]


@pytest.mark.parametrize("text", ["README.md", "CONTRIBUTING.md", *(f"docs/{page}" for page in pages())])
def test_files_that_a_text_names_exist(text):
    content = (ROOT / text).read_text(encoding="utf-8")
    named = re.findall(r"`((?:trajevo|problems|robots|tests|docs)/[\w./-]+)`", content)
    assert [place for place in named if not (ROOT / place).exists()] == []
