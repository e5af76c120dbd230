"""Runs that are killed at random instants and resumed until they are done."""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
import warnings
from pathlib import Path

import numpy as np
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.algorithms.moo.nsga3 import NSGA3
from pymoo.algorithms.moo.rvea import RVEA
from pymoo.algorithms.moo.sms import SMSEMOA
from pymoo.algorithms.moo.spea2 import SPEA2
from pymoo.algorithms.moo.unsga3 import UNSGA3
from pymoo.core.algorithm import Algorithm
from pymoo.util.ref_dirs import get_reference_directions

from tests.helpers import refused
from trajevo import Front, optimise
from trajevo.formulation.registry import load_problem
from trajevo.solvers.evolutionary.moead import ConstrainedMOEAD
from trajevo.solvers.run import evolution
from trajevo.solvers.run.folder import RunFolder
from trajevo.solvers.run.runs import read_run, resume, standing

#: Objectives of the problems that are run here.
OBJECTIVES = {"pointing": 3, "hybrid": 4, "pick-place": 3}

ALGORITHMS = ("NSGA2", "SMSEMOA", "RVEA", "SPEA2", "NSGA3", "UNSGA3", "AGEMOEA2", "ConstrainedMOEAD")


def algorithm(name: str, objectives: int, size: int = 24) -> Algorithm:
    """An algorithm that has not run yet."""
    plain = {"NSGA2": NSGA2, "SMSEMOA": SMSEMOA, "SPEA2": SPEA2}
    if name in plain:
        return plain[name](pop_size=size, n_offsprings=size)
    if name == "AGEMOEA2":
        # Its module needs numba, and some time to be compiled.
        from pymoo.algorithms.moo.age2 import AGEMOEA2

        return AGEMOEA2(pop_size=size, n_offsprings=size)
    directions = get_reference_directions("das-dennis", objectives, n_partitions=4 if objectives == 3 else 3)
    if name == "ConstrainedMOEAD":
        return ConstrainedMOEAD(directions)
    return {"RVEA": RVEA, "NSGA3": NSGA3, "UNSGA3": UNSGA3}[name](directions, pop_size=size)


def begin(problem: str, name: str, generations: int, seed: int, out: Path | None) -> Front:
    """Begin a run."""
    return optimise(
        load_problem(problem),
        seed=seed,
        generations=generations,
        algorithm=algorithm(name, OBJECTIVES[problem]),
        progress=False,
        out=out,
        polish=False,
    )


def killed_and_resumed(problem: str, name: str, generations: int, folder: Path, chance: np.random.Generator) -> int:
    """How often a run was killed, in turn at a random time and at a random step of writing, until it was done.

    After every kill the folder is read; in the end the run equals one that was never interrupted.
    """
    arguments = problem, name, generations, int(chance.integers(1000)), folder
    began = time.perf_counter()
    expected = begin(*arguments[:4], None)
    whole = time.perf_counter() - began
    kills, first = 0, int(chance.integers(2))
    while True:
        torn = int(chance.integers(1, 25)) if (kills + first) % 2 else 0
        child = multiprocessing.get_context("fork").Process(target=_go_on, args=(*arguments, torn))
        child.start()
        if not torn and kills < 6:
            child.join(float(chance.uniform(0.0, whole)))
            child.kill()
        child.join()
        if child.exitcode == 0 and kills:
            break
        if child.exitcode == 0:
            RunFolder(folder).clear()
            continue
        assert child.exitcode == -signal.SIGKILL
        kills += 1
        _readable(folder)
    front = read_run(folder)
    for kept in "XFG":
        np.testing.assert_array_equal(getattr(front, kept), getattr(expected, kept))
    assert front.history == expected.history
    assert not front.run.interrupted
    return kills


def _go_on(problem: str, name: str, generations: int, seed: int, folder: Path, torn: int) -> None:
    """In a process of its own: go on with the run or begin it, with a checkpoint after every generation."""
    warnings.simplefilter("error", UserWarning)
    evolution._FIRST_DUE = 0.0
    evolution._SHARE = 1e9
    if torn:
        _kill_at(torn)
    resume(folder, progress=False) if RunFolder(folder).begun else begin(problem, name, generations, seed, folder)


def _kill_at(step: int) -> None:
    """Kill this process at a step of writing: half a file written, a whole one without its name, or just named."""
    sync, replace, steps = os.fsync, os.replace, iter(range(1, 10**9))

    def now() -> bool:
        return next(steps) == step

    def torn_sync(handle: int) -> None:
        if now():
            size = os.fstat(handle).st_size
            if size > 0:
                os.ftruncate(handle, size // 2)
            os.kill(os.getpid(), signal.SIGKILL)
        sync(handle)

    def torn_replace(scratch: object, file: object) -> None:
        if now():
            os.kill(os.getpid(), signal.SIGKILL)
        replace(scratch, file)
        if now():
            os.kill(os.getpid(), signal.SIGKILL)

    os.fsync, os.replace = torn_sync, torn_replace


def _readable(folder: Path) -> None:
    """A folder is readable whenever a run was begun in it: its standing, and its front from the first generation on."""
    if not RunFolder(folder).begun:
        return
    where = standing(folder)
    if where.generation == 0:
        refused(lambda: read_run(folder), "has not finished its first generation")
        return
    front = read_run(folder)
    assert front.run.generations == where.generation
    assert front.run.evaluations == front.history.evaluations[-1]
    assert (front.G <= 0.0).all()
