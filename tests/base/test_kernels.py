"""Compiling: all loops once for an installation, beside the runs, and harmless whatever fails."""

import importlib
import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import trajevo
from trajevo.base import jit, kernels
from trajevo.base.machine_code import writing
from trajevo.trajectory import polynomial_loops

pytest.importorskip("numba")

TINY = """
from trajevo.base.jit import fast


@fast("f8[2], i8 -> f8[1]", "c16[2], i8 -> c16[1]")
def sums(values, factor, out):
    for i in range(len(values)):
        out[i] = 0.0
        for k in range(values.shape[1]):
            out[i] += times(factor, values[i, k])


@fast
def times(factor, value):
    return factor * value
"""


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """An empty cache of the user's."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    kernels._installation.cache_clear()
    yield tmp_path / "cache" / "trajevo" / "kernels"
    kernels._installation.cache_clear()


@pytest.fixture
def tiny(tmp_path, monkeypatch, cache):
    """A module with one loop, as if it were all that there is."""
    folder = tmp_path / "modules"
    folder.mkdir()
    (folder / "tiny_loops.py").write_text(TINY)
    monkeypatch.syspath_prepend(folder)
    monkeypatch.setattr(kernels, "MODULES", ("tiny_loops",))
    monkeypatch.setattr(kernels, "_ROOT", folder)
    yield importlib.import_module("tiny_loops")
    del sys.modules["tiny_loops"]


@pytest.fixture
def begun(monkeypatch):
    """Processes that would have been started."""
    commands = []
    monkeypatch.setattr(kernels, "_start", commands.append)
    return commands


def test_every_module_with_loops_is_known():
    root = Path(trajevo.__file__).parent
    files = [file for file in root.rglob("*.py") if "\n@fast" in file.read_text(encoding="utf-8")]
    names = {".".join(file.relative_to(root.parent).with_suffix("").parts) for file in files}
    assert names == set(kernels.MODULES)


def test_a_loop_takes_arrays_in_any_order_and_read_only_ones_with_the_same_code(tiny):
    values = np.arange(12.0).reshape(3, 4)
    still = values.copy()
    still.setflags(write=False)
    for given in (values, still, np.asfortranarray(values), np.repeat(values, 2, axis=1)[:, ::2]):
        out = np.empty(3)
        tiny.sums(given, 2, out)
        np.testing.assert_array_equal(out, 2.0 * values.sum(axis=1))
    out = np.empty(3, dtype=complex)
    tiny.sums(values + 1j, 2, out)
    np.testing.assert_array_equal(out, 2.0 * values.sum(axis=1) + 8j)
    assert len(tiny.sums.compiled.signatures) == 2
    with pytest.raises(TypeError, match="No matching definition"):
        tiny.sums(values.astype(np.float32), 2, out)


def test_all_loops_are_ready_once_they_are_compiled_and_as_long_as_they_are_kept(tiny, cache):
    assert not kernels.ready()
    assert kernels.compile_all()
    (listed,) = (json.loads(file.read_text()) for file in cache.glob("*.json"))
    # An index, code for each signature, and where it is called without numba the module's object.
    assert [Path(file).suffix for file in listed] == [".nbc", ".nbc", ".nbi", *[".o"] * writing.suits()]
    assert kernels.ready()
    Path(listed[-1]).unlink()
    assert not kernels.ready()


@pytest.fixture
def again(tiny):
    """The loop of the module as a later process finds it."""
    assert kernels.compile_all()
    return lambda: kernels.Loop(tiny.sums._function, *tiny.sums.signatures)


needs_entries = pytest.mark.skipif(not writing.suits(), reason="numba calls its loops itself here")


@needs_entries
def test_a_kept_loop_needs_no_numba_and_takes_what_numba_takes(tiny, again):
    loop, draw = again(), np.random.default_rng(0)
    values = draw.normal(size=(5, 3)) * 10.0 ** draw.integers(-9, 9, size=(5, 3))
    still = np.repeat(values, 2, axis=1)[:, ::2]
    still.setflags(write=False)
    for kind in (float, complex):
        for given, factor in [(values, 3), (np.asfortranarray(values), np.int64(3)), (still, True), (values[:0], 2)]:
            outs = np.zeros((2, len(given)), dtype=kind)
            loop((given * (1.0 + 0.1j) if kind is complex else given), factor, outs[0])
            tiny.sums.compiled(
                np.ascontiguousarray(given * (1.0 + 0.1j) if kind is complex else given), factor, outs[1]
            )
            np.testing.assert_array_equal(*outs)
    assert "compiled" not in vars(loop)


@needs_entries
@pytest.mark.parametrize(
    "wrong", ["dtype", "axes", "order of bytes", "read-only", "no array", "array", "text", "fewer"]
)
def test_a_kept_loop_refuses_what_it_was_not_compiled_for(wrong, again):
    values, factor, out = np.ones((3, 2)), 2, np.zeros(3)
    if wrong == "read-only":
        out.setflags(write=False)
    given = {
        "dtype": (values.astype(np.float32), factor, out),
        "axes": (values[0], factor, out),
        "order of bytes": (values.astype(values.dtype.newbyteorder()), factor, out),
        "no array": (values.tolist(), factor, out),
        "array": (values, np.array(factor), out),
        "text": (values, "2", out),
        "fewer": (values, factor),
    }.get(wrong, (values, factor, out))
    with pytest.raises(TypeError):
        again()(*given)
    np.testing.assert_array_equal(out, 0.0)


@needs_entries
@pytest.mark.parametrize("damage", ["missing", "empty", "cut", "changed"])
def test_a_damaged_object_is_left_alone(damage, tiny, cache, again):
    (file,) = cache.glob("*.o")
    content = file.read_bytes()
    file.unlink()
    if damage != "missing":
        changed = content[:100] + bytes([content[100] ^ 1]) + content[101:]
        file.write_bytes({"empty": b"", "cut": content[:-1], "changed": changed}[damage])
    loop, out = again(), np.empty(3)
    loop(np.ones((3, 2)), 2, out)
    np.testing.assert_array_equal(out, 4.0)
    assert "compiled" in vars(loop)


@needs_entries
def test_powers_of_complex_numbers_and_rooms_of_kept_loops_are_numbas(monkeypatch, cache):
    """The two functions of numba's runtime that are written here again."""
    loop = polynomial_loops.square_integrals
    monkeypatch.setattr(kernels, "MODULES", (polynomial_loops.__name__,))
    assert kernels.compile_all()
    kept, draw = kernels.Loop(loop._function, *loop.signatures), np.random.default_rng(1)
    steps = np.concatenate([draw.uniform(1e-3, 9.0, (40, 3)) + 1j * draw.normal(size=(40, 3)), [[0.5, 2.0, 1.0]]])
    coefficients, powers = draw.normal(size=(41, 3, 2, 6)) + 0j, draw.normal(size=(5, 6))
    for order in (0, 1, 2, 3):
        outs = np.empty((2, 41, 2), dtype=complex)
        kept(coefficients, steps, order, powers, np.ones(5), outs[0])
        loop.compiled(coefficients, steps, order, powers, np.ones(5), outs[1])
        np.testing.assert_array_equal(*outs)
    assert "compiled" not in vars(kept)
    with pytest.raises(ZeroDivisionError):  # what a loop raises, numba raises
        kept(coefficients, 0.0 * steps, 1, powers, np.ones(5), outs[0])


@pytest.mark.parametrize("content", ["", "null", "[]", "{}", "[1]", '["/nowhere/else"]'])
def test_a_damaged_note_is_none(content, tiny, cache):
    cache.mkdir(parents=True)
    kernels._file("json").write_text(content)
    assert not kernels.ready()


def test_what_compiled_loops_depend_on_is_part_of_their_name(tiny, monkeypatch):
    def name():
        kernels._installation.cache_clear()
        return kernels._installation()

    names = {name()}
    os.utime(tiny.__file__, (1.0, 1.0))
    names.add(name())
    monkeypatch.setattr(kernels, "_processor", lambda: "another one")
    names.add(name())
    monkeypatch.setenv("NUMBA_CACHE_DIR", "elsewhere")
    names.add(name())
    monkeypatch.setattr("importlib.metadata.version", lambda package: f"another {package}")
    assert name() not in names
    assert len(names) == 4
    assert name() == name()


def test_compiling_is_begun_once_and_after_an_hour_again(cache, begun):
    kernels.compile_beside()
    kernels.compile_beside()
    ((python, *arguments),) = begun
    assert (python, arguments) == (sys.executable, ["-m", "trajevo.base.kernels", "--beside"])
    an_hour_ago = time.time() - 3601.0
    os.utime(kernels._file("lock"), (an_hour_ago, an_hour_ago))
    kernels.compile_beside()
    assert len(begun) == 2


@pytest.mark.parametrize("missing", ["home", "folder", "python", "shell"])
def test_where_nothing_can_be_kept_or_started_there_is_no_word_about_it(missing, tmp_path, monkeypatch, capfd):
    kernels._installation.cache_clear()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    if missing == "home":
        monkeypatch.delenv("XDG_CACHE_HOME")
        monkeypatch.setattr(Path, "home", lambda: (_ for _ in ()).throw(RuntimeError("no home")))
    elif missing == "folder":
        (tmp_path / "file").write_text("no folder")
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    elif missing == "python":
        monkeypatch.setattr(sys, "executable", "")
    else:
        monkeypatch.setattr(subprocess, "run", lambda *command, **options: (_ for _ in ()).throw(OSError("no shell")))
    assert not kernels.ready()
    kernels.compile_beside()
    assert capfd.readouterr() == ("", "")


def test_loops_that_cannot_be_kept_are_compiled_all_the_same(tiny, monkeypatch):
    names = {"__name__": "nowhere"}
    exec(TINY, names)  # of no file, beside which there is no place
    out = np.empty(3)
    names["sums"](np.ones((3, 2)), 2, out)
    np.testing.assert_array_equal(out, 4.0)
    assert names["sums"].kept() == []
    monkeypatch.setattr(tiny, "sums", names["sums"])
    names["sums"]._function.__module__ = tiny.__name__
    assert not kernels.compile_all()
    assert not kernels.ready()


def printed(script, **environment):
    """What a script prints in a process of its own."""
    environment = {name: value for name, value in os.environ.items() if name != jit.CHOICE} | environment
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, env=environment)
    assert done.stderr == ""
    return done.stdout.split()


@pytest.mark.skipif(sys.platform == "win32", reason="POSIX processes")
def test_what_is_started_is_no_child_and_keeps_nobody_waiting(tmp_path):
    later = f"import os, time; time.sleep(2.0); open({str(tmp_path / 'done')!r}, 'w').write(str(os.getsid(0)))"
    script = (
        "import os, sys; from trajevo.base import kernels\n"
        f"kernels._start([sys.executable, '-c', {later!r}])\n"
        "try:\n    os.waitpid(-1, os.WNOHANG)\nexcept ChildProcessError:\n    print('childless', os.getsid(0))\n"
    )
    said, session = printed(script)
    assert said == "childless"
    assert not (tmp_path / "done").exists()
    end = time.monotonic() + 30.0
    while not (tmp_path / "done").exists() or not (tmp_path / "done").read_text():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.05)
    assert (tmp_path / "done").read_text() != session


RUN = """
import sys

from trajevo.base import jit
from trajevo.dynamics import rnea_loops
from trajevo import optimise
from trajevo.problems import PointingMechanism

front = optimise(PointingMechanism(), seed=1, generations=2, population=8, progress=False)
loops = [rnea_loops.torques.compiled] if front.run.kernels == "compiled" and "numba" in sys.modules else []
print(front.run.kernels, sum(sum(loop.stats.cache_misses.values()) for loop in loops))
"""


@pytest.mark.long
def test_a_first_run_waits_for_nothing_and_a_later_one_finds_compiled_loops(tmp_path):
    places = {"XDG_CACHE_HOME": str(tmp_path / "cache"), "NUMBA_CACHE_DIR": str(tmp_path / "numba")}
    assert printed(RUN, **places) == printed(RUN, **places) == ["numpy", "0"]
    end = time.monotonic() + 600.0
    while not list((tmp_path / "cache").rglob("*.json")):
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.5)
    assert len(list((tmp_path / "cache").rglob("*.lock"))) == 1
    assert not list((tmp_path / "cache").rglob("*.log"))
    assert printed(RUN, **places) == ["compiled", "0"]


@pytest.mark.long
def test_two_processes_that_compile_at_once_do_it_once(tmp_path):
    places = {"XDG_CACHE_HOME": str(tmp_path / "cache"), "NUMBA_CACHE_DIR": str(tmp_path / "numba")}
    command = [sys.executable, "-m", "trajevo.base.kernels"]
    both = [subprocess.Popen(command, env=os.environ | places) for _ in range(2)]
    beside = subprocess.run([*command, "--beside"], env=os.environ | places, check=False)
    assert beside.returncode == 0
    assert [process.wait() for process in both] == [0, 0]
    index = {file.stat().st_mtime for file in (tmp_path / "numba").rglob("*.nbc")}
    note = next((tmp_path / "cache").rglob("*.json")).stat().st_mtime
    assert max(index) <= note
