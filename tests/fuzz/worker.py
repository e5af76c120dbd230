"""One process of the fuzzer: reads many mutated files of some kinds, and tells what each did that none may do.

    python -m tests.fuzz.worker FOLDER SEED FIRST COUNT KIND...

writes one line of JSON per finding to standard output, and a last line when it is done. The input that is read is kept
in FOLDER/current, so that nothing is lost if the process dies.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random

from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import seed as seeded
from hypothesis import strategies as st
from hypothesis.internal.conjecture import providers

from tests.fuzz.kinds import Kind, kinds, plant
from tests.fuzz.mutations import mutated
from tests.fuzz.sandbox import Finding, Sandbox, listening

#: Every so manieth block of inputs is drawn by hypothesis, and how many are in a block.
_EVERY, _BLOCK = 4, 25

#: One example per input, always the same, and no files of hypothesis's own.
_ONE = settings(
    max_examples=1, database=None, deadline=None, phases=[Phase.generate], suppress_health_check=list(HealthCheck)
)

#: How many of ten files that hypothesis draws are mutated seeds; the others are plain data or text.
_OF_TEN = 8

#: A block of examples, the same every time, without files of hypothesis's own.
_DRAWS = settings(
    max_examples=_BLOCK, database=None, deadline=None, phases=[Phase.generate], suppress_health_check=list(HealthCheck)
)

#: Characters of texts, all that UTF-8 can encode: by name of that code, hypothesis tries a million of them.
_CHARACTERS = st.characters(exclude_categories=["Cs"])

# Hypothesis would read 300 modules for the numbers in them: what is drawn is the same whatever stands in the source.
if hasattr(providers, "_local_constants"):
    providers._get_local_constants = lambda: providers._local_constants

_CANARY = b"nobody may change this"


def inputs(kind: Kind, seed: int, numbers: range) -> Iterator[tuple[int, bytes, Random]]:
    """Mutated files of a kind by number, always the same for a seed; hypothesis draws those of some blocks."""
    drawn: dict[int, list[bytes]] = {}
    for number in numbers:
        random, (block, place) = Random(f"{seed} {kind.name} {number}"), divmod(number, _BLOCK)
        if block % _EVERY == 0 and block not in drawn:
            drawn = {block: _drawn(kind, f"{seed} {kind.name} {block}")}
        chosen = drawn.get(block, ())
        yield number, chosen[place] if place < len(chosen) else mutated(random.choice(kind.seeds), random), random


def _drawn(kind: Kind, seed: str) -> list[bytes]:
    """Files that hypothesis draws: seeds with mutations that it chooses, or plain data or text without any."""
    found: list[bytes] = []

    @_DRAWS
    @given(st.one_of(*[_of(kind)] * _OF_TEN, *[_anything()] * (10 - _OF_TEN)))
    def draw(content: bytes) -> None:
        found.append(content)

    seeded(Random(seed).getrandbits(64))(draw)()
    return found


def _of(kind: Kind) -> st.SearchStrategy[bytes]:
    return st.builds(lambda content, chosen: mutated(content, chosen), st.sampled_from(kind.seeds), st.randoms())


def _anything() -> st.SearchStrategy[bytes]:
    scalars = st.none() | st.booleans() | st.integers() | st.floats() | st.text(_CHARACTERS, max_size=20)
    trees = st.recursive(
        scalars, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(_CHARACTERS), inner, max_size=4)
    )
    return (
        st.binary(max_size=300)
        | st.text(_CHARACTERS, max_size=300).map(str.encode)
        | trees.map(lambda tree: json.dumps(tree).encode())
    )


def work(folder: Path, seed: int, numbers: range, names: list[str], tell: Callable[[str, int, Finding], None]) -> int:
    """Read inputs of some kinds; returns how many.

    Args:
        folder: folder of this process.
        seed: seed of all inputs.
        numbers: numbers of the inputs of each kind.
        names: the kinds.
        tell: is called with kind and number of an input, and what it did that none may do.
    """
    sys.dont_write_bytecode = True
    made, place, outside = folder / "made", folder / "place", folder / "outside"
    for each in (made, place, outside, place / "tmp"):
        each.mkdir(parents=True, exist_ok=True)
    tempfile.tempdir = str(place)  # where a front is kept that cannot be written into its folder
    known = kinds(made)
    for name in names:  # without mutations and unwatched: what is imported late is imported here
        for content in known[name].seeds:
            known[name].lay(place, content)
            known[name].read(place)
    sandbox = Sandbox(place)
    sandbox.bound_memory()
    count = 0
    for name in names:
        kind = known[name]
        for number, content, random in inputs(kind, seed, numbers):
            (folder / "current").write_bytes(f"{name}\n{number}\n".encode() + content)
            (outside / "file").write_bytes(_CANARY)
            kind.lay(place, content)
            if kind.written and random.random() < 0.25:
                plant(place, outside, random)
            found = sandbox.watch(lambda kind=kind: kind.read(place))  # type: ignore[misc]
            if (outside / "file").read_bytes() != _CANARY or os.listdir(outside) != ["file"]:
                found.append(Finding("write", f"a file outside the folder was changed: {os.listdir(outside)}"))
            for finding in (*found, *listening()):
                tell(name, number, finding)
            count += 1
    return count


def _main() -> None:
    folder, seed, first, count, *names = sys.argv[1:]
    numbers = range(int(first), int(first) + int(count))

    def tell(kind: str, number: int, finding: Finding) -> None:
        line = {"input": [kind, number], "kind": finding.kind, "said": finding.said}
        sys.stdout.write(json.dumps(line) + "\n")
        sys.stdout.flush()

    done = work(Path(folder).resolve(), int(seed), numbers, names, tell)
    sys.stdout.write(json.dumps({"done": done}) + "\n")


if __name__ == "__main__":
    _main()
