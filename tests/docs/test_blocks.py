"""Every block of every page runs: Python in one namespace, commands in order, in an empty folder, with what they print."""

import tomllib

import pytest

import trajevo
from tests.docs.blocks import blocks, pages, run_page
from tests.helpers import trajevo as command
from trajevo.cli.main import COMMANDS

PAGES = pages()


def runs(page):
    return any(block.language in ("python", "sh") and not block.no_run for block in blocks(page))


@pytest.mark.parametrize("page", [page for page in PAGES if runs(page)])
def test_page(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    import io, contextlib

    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        run_page(page, tmp_path, lambda words: command(*words), short=False, told=out.getvalue)
