"""Solve a trajectory problem or a task: first population, evolution, polishing, front."""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import Any

from pymoo.core.algorithm import Algorithm

from trajevo.base import jit
from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError
from trajevo.formulation.evaluation import checked_time_limit
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.formulation.search import USUAL, Search
from trajevo.front.front import Front
from trajevo.front.records import ProblemRecord, installed_versions
from trajevo.solvers.evolutionary.algorithms import Chosen, algorithm_for
from trajevo.solvers.evolutionary.kinds import class_of
from trajevo.solvers.gradient.polish import check_polishable
from trajevo.solvers.run.folder import Manifest, begun


def optimise(
    problem: TrajectoryProblem,
    search: Search | None = None,
    *,
    initial: Front | Array | None = None,
    out: str | Path | None = None,
    overwrite: bool = False,
    progress: bool = True,
    **settings: Any,
) -> Front:
    """Run a multi-objective evolutionary algorithm and keep all non-dominated feasible points.

    The default is pymoo's NSGA-II with simulated binary crossover and polynomial mutation, with the settings of the
    problem's paper (``problem.evolution``). The front is refined by gradients at the end if the problem has them. The
    "pool size" of Sun 2020 corresponds to the number of offspring per generation: ``offsprings=75``.

    An interrupt from the keyboard or SIGTERM ends the run after the current generation and returns what was found so
    far, marked as interrupted; a second one aborts. With ``out`` the run can be killed at any time:
    :func:`trajevo.resume` continues from its latest checkpoint. Checkpoints take about 1 % of the time.

    Args:
        problem: what to solve.
        search: settings of the search; a seed is required, here or in ``settings``.
        initial: decision vectors to begin with, shape (N, n_var), or a front of the same problem, which may have
            another payload, see :func:`trajevo.solvers.evolutionary.first_population.warm_start`.
        out: folder for every evaluated individual, checkpoints and the front. If the front is polished, the front
            before polishing is kept too, in ``evolved.json``.
        overwrite: replace a run that the folder holds; otherwise such a folder is refused.
        progress: show generation, hypervolume, least violation and time left, on standard error or, in a
            notebook, in the output of the cell.
        **settings: settings of the search by name, see :class:`~trajevo.formulation.search.Search`; they take
            precedence over ``search``.

    Returns:
        The front. If solutions stand for curves of another problem's solutions (``problem.expansion``), it is the front
        of that problem, on the lower envelope of the curves. If nothing feasible was found, it is empty and
        ``front.blocking`` says which constraints are violated. If :func:`trajevo.check` rules out every motion, nothing
        is searched, the front is empty, and ``front.blocking`` says why.

    Raises:
        UnknownNameError: no such setting, algorithm or kind of first population.
        InvalidInputError: an invalid setting, or a folder that holds a run or cannot be written; the message names it.
    """
    if not isinstance(problem, TrajectoryProblem):
        raise InvalidInputError(f"problem: expected a TrajectoryProblem, got {type(problem).__name__}")
    search = decided(_given(search).updated(**settings), problem)
    with jit.one_kind():
        return _run(problem, search, initial, out, overwrite=overwrite, progress=progress)


def _run(
    problem: TrajectoryProblem,
    search: Search,
    initial: Front | Array | None,
    out: str | Path | None,
    *,
    overwrite: bool,
    progress: bool,
) -> Front:
    """A run with one kind of kernel; arguments as for :func:`optimise`, with all settings decided."""
    # What checks and searches imports obstacles, pymoo's algorithms and SciPy, as long as all other imports together.
    from trajevo.formulation.feasibility.check import check
    from trajevo.solvers.evolutionary.first_population import begin_with
    from trajevo.solvers.run.evolution import evolve, nothing_searched
    from trajevo.solvers.run.runs import polished

    algorithm = algorithm_for(search, problem)
    before = time.process_time()
    impossible = check(problem).impossible
    most = search.cpu_time
    in_time = None if most is None else lambda: time.process_time() - before < most
    first = {} if impossible else begin_with(algorithm, problem, search, initial=initial, in_time=in_time)
    manifest = _manifest(problem, algorithm, search, first)
    spent = time.process_time() - before
    with begun(out, manifest, overwrite=overwrite) as folder:
        if impossible:
            front = nothing_searched(problem, manifest, impossible)
        else:
            front = evolve(problem, algorithm.solver, manifest, folder=folder, progress=progress, cpu_spent=spent)
            front = polished(front, manifest, folder, progress=progress)
        if folder is not None:
            folder.keep(front)
    return front


def decided(search: Search, problem: TrajectoryProblem) -> Search:
    """Fill in what a search leaves open: the number of generations, and whether the front is polished.

    Raises:
        InvalidInputError: no seed, a time limit that this process cannot enforce, or polishing of a problem that does
            not allow it.
    """
    if search.seed is None:
        raise InvalidInputError("seed: expected a whole number of at least 0, got None")
    if search.time_limit is not None:
        checked_time_limit(search.time_limit)
    usual = USUAL.updated(**problem.evolution.given)
    if search.polish is None:
        search = search.updated(polish=usual.polish)
    return search.updated(generations=search.generations or usual.generations, polish=_polishes(search, problem))


def _given(search: Search | None) -> Search:
    if search is not None and not isinstance(search, Search):
        raise InvalidInputError(f"search: expected a Search, got {search!r}; settings are passed by name, as seed=1")
    return search or Search()


def _polishes(search: Search, problem: TrajectoryProblem) -> bool:
    """Whether the front is polished at the end; if the search leaves this open, whether it can be.

    Raises:
        InvalidInputError: the search asks for gradients, but the problem has none.
    """
    if search.polish is False and search.polish_every is None:
        return False
    try:
        if search.time_limit is not None:
            raise InvalidInputError("polish: gradients cannot be evaluated in a separate process, as time_limit needs")
        check_polishable(problem if problem.expansion is None else problem.expansion.problem)
    except InvalidInputError:
        if search.polish or search.polish_every is not None:
            raise
        return False
    return search.polish is not False


def _generations(search: Search, solver: Algorithm) -> int:
    """Number of generations, at most as many as the evaluations allow, since some algorithms adapt to this number."""
    planned, size = int(search.generations or 1), getattr(solver, "n_offsprings", None)
    if search.evaluations is None or not size:
        return planned
    for_evolution = (0.5 if search.polish else 1.0) * float(search.evaluations)
    return min(planned, max(1, math.ceil(for_evolution / int(size))))


def _manifest(problem: TrajectoryProblem, algorithm: Chosen, search: Search, first: dict[str, Any]) -> Manifest:
    """The manifest of a new run, with the algorithm as data, or else the reason why the run cannot be resumed.

    Raises:
        InvalidInputError: a part of the algorithm does not use the seed.
    """
    from trajevo.solvers.evolutionary.algorithm_state import specification
    from trajevo.solvers.evolutionary.seeded_tournaments import seeded

    solver, described, why = algorithm.solver, None, ""
    try:
        described = specification(solver)
    except InvalidInputError as error:
        why = str(error)
    reason = seeded(solver)
    if reason is not None:
        raise InvalidInputError(f"algorithm: {reason}")
    own = search.updated(generations=_generations(search, solver))
    of_run = {name: getattr(own, name) for name in Search.model_fields if name in Manifest.model_fields}
    said = {name: of_run[name] for name in of_run if name not in ("algorithm", "seed", "time_limit")}
    return Manifest(
        problem=ProblemRecord.of(problem),
        algorithm_name="NSGA2" if isinstance(solver, class_of("ArrayNSGA2")) else type(solver).__name__,
        settings=algorithm.settings | first | {name: value for name, value in said.items() if value is not None},
        versions=installed_versions(),
        kernels=jit.kind(),
        not_resumable=why,
        **of_run | {"algorithm": described},
    )
