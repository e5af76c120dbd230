"""One front, to the bit, however it is computed: one hash over threads, processes and batches."""

import hashlib
import multiprocessing
import os

import numpy as np
import pytest

from tests.helpers import mostly_long
from trajevo import optimise
from trajevo.problems import HybridManipulator

SIZE = {"seed": 3, "generations": 10, "population": 30, "progress": False}


class RowByRow(HybridManipulator):
    """Evaluated one individual at a time."""

    def _evaluate_rows(self, x):
        rows = [super(RowByRow, self)._evaluate_rows(x[i : i + 1]) for i in range(len(x))]
        return tuple(np.concatenate(column) for column in zip(*rows, strict=True))


def digest(problem, **more):
    front = optimise(problem, **SIZE, **more, polish=False)
    assert len(front) > 10
    return hashlib.sha256(b"".join(np.ascontiguousarray(getattr(front, name)).tobytes() for name in "XFG")).hexdigest()


def in_a_process(pipe, threads):
    pipe.send(digest(HybridManipulator(payload=5.0, threads=threads)))


@pytest.fixture(scope="module")
def expected():
    return digest(HybridManipulator(payload=5.0))


def test_two_threads_give_the_same_front(expected):
    assert digest(HybridManipulator(payload=5.0, threads=2)) == expected


def test_one_individual_at_a_time_gives_the_same_front(expected):
    assert digest(RowByRow(payload=5.0)) == expected


def test_a_time_limit_and_a_folder_give_the_same_front(expected, tmp_path):
    problem = HybridManipulator(payload=5.0, threads=2)
    problem.evaluate(np.array([problem.xu]))  # GNU's OpenMP hangs in what is forked after it used two threads
    assert digest(problem, time_limit=20.0, out=tmp_path / "run") == expected


@pytest.mark.parametrize("method", mostly_long(["fork", "spawn"], "fork"))
@pytest.mark.parametrize("threads", mostly_long([1, 2], 2))
def test_another_process_gives_the_same_front(method, threads, expected, monkeypatch):
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", str(threads))
    monkeypatch.setenv("PYTHONPATH", os.getcwd())
    context = multiprocessing.get_context(method)
    here, there = context.Pipe()
    process = context.Process(target=in_a_process, args=(there, threads), daemon=True)
    process.start()
    try:
        assert here.poll(60.0)
        assert here.recv() == expected
    finally:
        process.kill()
        process.join()
