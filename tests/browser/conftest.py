"""Pages in headless Chromium: `make test-browser` installs what these tests need."""

import os
import shutil
import time

import pytest

try:
    from playwright import sync_api
except ImportError:  # `make test` collects these tests without running them, and has no playwright
    sync_api = None

#: Chromium draws by its own software, so that every machine draws the same.
SOFTWARE = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")


@pytest.fixture(scope="session")
def chromium():
    found = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
    if sync_api is None or not found:
        pytest.skip(f"{'Chromium' if sync_api else 'playwright'} is not installed: make test-browser")
    as_root = ["--no-sandbox"] if os.getuid() == 0 else []
    with sync_api.sync_playwright() as running:
        browser = running.chromium.launch(executable_path=found, args=[*SOFTWARE, *as_root])
        yield browser
        browser.close()


@pytest.fixture
def opened(chromium):
    """Open a page that is watched: an error, or a request that leaves it, fails the test at its end."""
    pages, wrong = [], []

    def open_page(file, *, address="", ready=True, **settings):
        page = chromium.new_page(**{"viewport": {"width": 1300, "height": 1000}, "color_scheme": "light"} | settings)
        page.on("console", lambda message: wrong.append(message.text) if message.type in ("error", "warning") else None)
        page.on("pageerror", lambda error: wrong.append(str(error)))
        home = str(file) if str(file).startswith("http") else f"file://{file}"
        page.on("request", lambda request: wrong.append(request.url) if _leaves(request.url, home) else None)
        page.goto(f"{home}{address}")
        if ready:
            until(page, "Boolean(window.trajevo && window.trajevo.state)")
        pages.append(page)
        return page

    yield open_page
    for page in pages:
        page.close()
    assert not wrong


def until(page, condition, seconds=30.0):
    """Wait for a condition of the page; the browser's own way to wait needs what a page's policy forbids."""
    end = time.monotonic() + seconds
    while not _holds(page, condition):
        assert time.monotonic() < end, f"not within {seconds:g} s: {condition}"
        page.wait_for_timeout(50)


def _holds(page, condition):
    try:
        return page.evaluate(condition)
    except sync_api.Error as error:
        if "context was destroyed" not in str(error):  # the page is being loaded again
            raise
        return False


def _leaves(url, home):
    return not url.startswith((home, "data:", "blob:"))
