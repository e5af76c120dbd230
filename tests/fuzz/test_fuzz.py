"""A few mutated files of every kind are read by each run of the tests; `make fuzz` reads thousands."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.fuzz.run import KINDS, Count, run_chunk
from tests.helpers import mostly_long

#: Inputs of each kind: where they begin, how many hypothesis draws at a time, which takes long, and how many are read.
#: An ordinary run reads one that it draws, and one that it does not.
FEW, SOME, MORE = (1, 2, 2), (20, 25, 3), (20, 25, 10)

SCRIPT = """
import sys
from pathlib import Path
from hypothesis import settings
from tests.fuzz import worker
found = []
folder, *names = sys.argv[1:]
worker._DRAWS = settings(worker._DRAWS, max_examples={drawn})
done = worker.work(Path(folder), 20, range({first}, {first} + {count}), names, lambda *told: found.append(told))
print(*found, sep="\\n")
print(done)
"""


@pytest.mark.parametrize(("first", "drawn", "count"), mostly_long([FEW, SOME, MORE], FEW, several=True))
def test_mutated_files_cost_a_sentence_each(tmp_path, first, drawn, count):
    """All kinds, at most at the places 20 to 29, of which hypothesis draws five, in a process with bounded memory."""
    command = [sys.executable, "-c", SCRIPT.format(first=first, drawn=drawn, count=count), tmp_path, *KINDS]
    result = subprocess.run(command, capture_output=True, text=True, cwd=Path(__file__).parents[2])
    assert (result.returncode, result.stderr) == (0, "")
    assert result.stdout.strip() == str(count * len(KINDS))


BROKEN = """
import os, signal, socket, subprocess, sys, time
from pathlib import Path
from tests.fuzz.sandbox import Sandbox, listening

folder, other = Path(sys.argv[1]), Path(sys.argv[2])
box = Sandbox(folder)
box.bound_memory()
(folder / "link").symlink_to(other / "file")


def listen():
    sockets.append(socket.create_server(("0.0.0.0", 0)))


sockets = []
deeds = {
    "traceback": lambda: {}["key"],
    "memory": lambda: bytearray(3 * 2**30),
    "write": lambda: (folder / "link").write_text("through"),
    "start": lambda: subprocess.Popen(["true"]).wait(),
    "socket": listen,
}
for name, deed in deeds.items():
    print(name, *(found.kind for found in box.watch(deed)))
print("heard", *(found.kind for found in listening()))
print("nothing", *box.watch(lambda: (folder / "own").write_text("own")))
"""


def test_the_fuzzer_notices_what_no_input_may_do(tmp_path):
    for name in ("inside", "outside"):
        (tmp_path / name).mkdir()
    command = [sys.executable, "-c", BROKEN, tmp_path / "inside", tmp_path / "outside"]
    result = subprocess.run(command, capture_output=True, text=True, cwd=Path(__file__).parents[2])
    assert result.returncode == 0, result.stderr
    found = [line.split() for line in result.stdout.splitlines()]
    assert [words[0] for words in found] == ["traceback", "memory", "write", "start", "socket", "heard", "nothing"]
    for name, *kinds in found[:5]:
        assert name in kinds, result.stdout
    assert found[5][1:] == ["socket"]
    assert found[6][1:] == []


@pytest.mark.parametrize(("deed", "kind"), [("os._exit(3)", "crash"), ("os.kill(os.getpid(), 11)", "crash")])
def test_a_process_that_ends_loses_no_input(deed, kind, tmp_path, monkeypatch):
    """The worker is replaced by one that ends at the third of its inputs; the others are read by those after it."""
    worker = f"""
import json, os, sys
from pathlib import Path
folder, seed, first, count, kind = sys.argv[1:]
for number in range(int(first), int(first) + int(count)):
    (Path(folder) / "current").write_bytes(f"{{kind}}\\n{{number}}\\n".encode())
    if number == 2:
        {deed}
print(json.dumps({{"done": int(count)}}))
"""
    (tmp_path / "tests" / "fuzz").mkdir(parents=True)
    for package in ("tests", "tests/fuzz"):
        (tmp_path / package / "__init__.py").touch()
    (tmp_path / "tests" / "fuzz" / "worker.py").write_text(worker)
    monkeypatch.setattr("tests.fuzz.run.ROOT", tmp_path)
    monkeypatch.setattr("tests.fuzz.run.KEPT", tmp_path / "kept")
    count = Count()
    run_chunk("front", 1, range(5), count)
    assert count.inputs["front"] == 5
    assert count.findings == {kind: 1}
    assert [file.name for file in (tmp_path / "kept").iterdir()] == ["front-2"]
