"""The choice between compiled loops and numpy: one kind for a run, whatever gets ready meanwhile."""

import multiprocessing
import sys

import pytest

from tests.helpers import refused
from trajevo.base import jit, kernels
from trajevo.base.threads import in_threads


@pytest.fixture
def state(monkeypatch):
    """An installation with numba, whose loops are not ready; what is started beside it is only counted."""
    said = {"installed": True, "ready": False, "begun": 0}
    monkeypatch.delenv(jit.CHOICE, raising=False)
    monkeypatch.setattr(jit, "_installed", lambda: said["installed"])
    monkeypatch.setattr(kernels, "ready", lambda: said["ready"])
    monkeypatch.setattr(kernels, "compile_beside", lambda: said.update(begun=said["begun"] + 1))
    jit._of_this_process.cache_clear()
    yield said
    jit._of_this_process.cache_clear()


def test_what_is_not_ready_is_compiled_beside_and_not_used(state):
    with jit.one_kind() as kind:
        assert (kind, jit.kind(), jit.can_compile(), state["begun"]) == ("numpy", "numpy", False, 1)
        state["ready"] = True
        assert not jit.can_compile()
        with jit.one_kind() as inner:
            assert inner == "numpy"
    with jit.one_kind() as kind:
        assert (kind, jit.can_compile(), state["begun"]) == ("compiled", True, 1)


def test_a_process_does_not_change_its_mind_outside_of_runs(state):
    assert jit.kind() == "numpy"
    state["ready"] = True
    assert jit.kind() == "numpy"
    with jit.one_kind() as kind:
        assert kind == "compiled"
    assert jit.kind() == "numpy"


def test_a_run_that_goes_on_keeps_its_kind(state):
    for wanted in ("compiled", "numpy"):
        with jit.one_kind(wanted) as kind:
            assert kind == jit.kind() == wanted
    assert state["begun"] == 0
    state["installed"] = False
    refused(lambda: jit.one_kind("compiled").__enter__(), "kernels: expected 'numpy', got 'compiled'")
    assert jit.kind() == "numpy"
    assert state["begun"] == 0


@pytest.mark.parametrize("asked", ["numpy", "compiled"])
@pytest.mark.parametrize("ready", [False, True])
def test_the_environment_can_ask_for_a_kind(asked, ready, state, monkeypatch):
    monkeypatch.setenv(jit.CHOICE, asked)
    state["ready"] = ready
    assert jit.kind() == asked
    assert state["begun"] == 0


def test_another_kind_is_refused(state, monkeypatch):
    monkeypatch.setenv(jit.CHOICE, "fast")
    refused(jit.kind, "TRAJEVO_KERNELS: expected 'numpy', 'compiled' or nothing, got 'fast'")


def test_uncompiled_holds_within_any_run(state):
    with jit.one_kind("compiled"):
        with jit.uncompiled():
            assert (jit.can_compile(), jit.avoided(), jit.kind()) == (False, True, "compiled")
        assert jit.can_compile()


def test_threads_of_a_run_have_its_kind(state):
    with jit.one_kind("compiled"):
        assert in_threads(jit.kind, [(), (), ()], 3) == ["compiled"] * 3


def _send_kind(pipe):
    pipe.send(jit.kind())


@pytest.mark.skipif(sys.platform == "win32", reason="Windows does not fork")
def test_a_forked_process_has_the_kind_of_its_run(state):
    ours, theirs = multiprocessing.Pipe()
    with jit.one_kind("compiled"):
        process = multiprocessing.get_context("fork").Process(target=_send_kind, args=(theirs,))
        process.start()
    assert ours.recv() == "compiled"
    process.join()
