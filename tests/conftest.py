"""Fixtures that several files share."""

import gc
import importlib.util
import os
import signal
import sys
from collections import Counter

import pytest

from trajevo.base import jit

# A job in the background of a script ignores SIGINT, and so do its children, which would leave nothing to test.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

#: Where numba is installed compiled loops are tested, whether or not they are ready; `make test` compiles them before.
if importlib.util.find_spec("numba") is not None:
    os.environ.setdefault(jit.CHOICE, "compiled")

#: The command line's consoles take their width from here when they are made.
os.environ["COLUMNS"] = "160"


def pytest_collectstart():
    """Collecting tests makes half a million objects that stay: looking through them again and again finds nothing."""
    gc.disable()


def pytest_collection_finish():
    """From now on garbage is collected among what the tests themselves make."""
    gc.freeze()
    gc.enable()


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Make all cases but every n-th of a test that is `thinned(n)` long, before pytest looks at which are."""
    seen = Counter()
    for item in items:
        thinned = item.get_closest_marker("thinned")
        if thinned and not item.get_closest_marker("long"):
            test = item.nodeid.partition("[")[0]
            if seen[test] % thinned.args[0]:
                item.add_marker(pytest.mark.long)
            seen[test] += 1


@pytest.fixture
def stopped_after(monkeypatch):
    """Make runs stop by SIGINT after a generation."""
    from trajevo.front.books import Books  # the process that hands out the tests has no use for what computes

    close = Books.close

    def after(generation):
        def closing(self, number, evaluations, **spent):
            if number == generation:
                os.kill(os.getpid(), signal.SIGINT)
            return close(self, number, evaluations, **spent)

        monkeypatch.setattr(Books, "close", closing)

    return after


@pytest.fixture(autouse=True)
def close_figures():
    """No test draws into what another one left open."""
    yield
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")
