"""Run rivals on problems of the suite: every run in a file of its own, kept as soon as it ends."""

from __future__ import annotations

import platform
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from trajevo.base.arrays import one_blas_thread
from trajevo.base.own.code import told
from trajevo.base.shown.brief import brief
from trajevo.base.signals import Stopping
from trajevo.errors import InvalidInputError, one_line
from trajevo.front.records import installed_versions
from trajevo.study.bench.adapters.adapter import BenchRival, adapter, adapters
from trajevo.study.bench.contest import Contest, OutOfTimeError, judged
from trajevo.study.bench.record import (
    RESULTS_FILE,
    BenchResults,
    BenchRun,
    End,
    Entry,
    Machine,
    file_name,
    read_runs,
    write_run,
)
from trajevo.study.bench.score import INSTANTS, MOST_KEPT, SHARES, Measure, Story, kept_rows, violation_of
from trajevo.study.bench.suite import benchmark, benchmarks
from trajevo.study.bench.yardstick import yardstick
from trajevo.study.engines import Engine, InProcess


@dataclass(frozen=True)
class Size:
    """How much is run.

    Attributes:
        seeds: number of runs of a rival on a problem.
        budget: CPU time of a run [s].
    """

    seeds: int
    budget: float

    __repr__ = brief


#: Sizes by name: 20 minutes on two cores, and a night.
SIZES = {"small": Size(3, 3.0), "full": Size(10, 40.0)}


@dataclass(frozen=True)
class BenchCell:
    """A run to be made: problem, rival, seed, CPU time [s], the folders of the benchmark and of its problems."""

    problem: str
    rival: str
    seed: int
    budget: float
    folder: str
    suite: str | None = None

    __repr__ = brief

    @property
    def name(self) -> str:
        """Name of its file, without the suffix."""
        return file_name(self.problem, self.rival, self.seed)


@dataclass(frozen=True)
class BenchOutcome:
    """How a run ended, in a few words.

    Attributes:
        name: name of the run.
        end: how it ended.
        said: its score, or why there is none.
    """

    name: str
    end: End
    said: str

    __repr__ = brief


@dataclass(frozen=True)
class BenchStanding:
    """What stands in the folder of a benchmark after its runs.

    Attributes:
        results: all results, those of former calls included.
        file: where they are.
        made: number of runs that were made now.
        left: number of runs that were asked for and are not made.
        stopped_by: name of the signal that ended them, or empty.
    """

    results: BenchResults
    file: Path
    made: int
    left: int
    stopped_by: str = ""

    __repr__ = brief


def run_benchmark(
    folder: str | Path,
    *,
    problems: Sequence[str] | None = None,
    rivals: Sequence[str] | None = None,
    seeds: int = SIZES["small"].seeds,
    budget: float = SIZES["small"].budget,
    suite: str | Path | None = None,
    engine: Engine | None = None,
    tell: Callable[[BenchOutcome], None] = lambda outcome: None,
) -> BenchStanding:
    """Run rivals on problems, with several seeds each; what a former call has finished in the folder is kept.

    Args:
        folder: folder of the benchmark: each run in ``runs``, and all of them in ``results.json``.
        problems: names of problems; all if None.
        rivals: names of rivals, or places of the user's own in Python; all of ours if None.
        seeds: number of runs of each rival on each problem, with seeds from 1.
        budget: CPU time of each run [s].
        suite: folder with problems of the user's own, each in a folder; that of trajevo if None.
        engine: runs them; one after the other in this process if None.
        tell: called with the outcome of each run.

    Raises:
        UnknownNameError: no such problem or rival.
        InvalidInputError: a number that cannot be used, or a folder that cannot be written or holds a damaged run.
    """
    place = Path(folder).absolute()
    own = None if suite is None else Path(suite).absolute()
    asked = BenchCell(
        "", "", _checked_seeds(seeds), _checked_budget(budget), str(place), None if own is None else str(own)
    )
    cells = _cells(asked, _named(problems, own), rivals)
    known = {file.stem: run for file, run in read_runs(place).items()}
    waiting = [cell for cell in cells if not _made(known.get(cell.name), cell)]
    made = 0
    try:
        with Stopping() as stopping:
            for outcome in (engine or InProcess()).map(run_cell_of_bench, waiting):
                made += 1
                tell(outcome)
                if stopping:
                    break
    finally:  # what is made counts, even if a process has died
        results = BenchResults.of(read_runs(place).values())
        results.save(place / RESULTS_FILE)
    return BenchStanding(results, place / RESULTS_FILE, made, len(waiting) - made, stopping.asked_by)


def run_cell_of_bench(cell: BenchCell) -> BenchOutcome:
    """Make a run and keep it.

    Raises:
        InvalidInputError: it cannot be written.
    """
    with one_blas_thread():
        run = run_rival(cell.problem, cell.rival, seed=cell.seed, budget=cell.budget, suite=cell.suite)
    write_run(Path(cell.folder), run)
    score = f"{100.0 * run.share:.2f} % of the best known after {run.cpu:.1f} s"
    return BenchOutcome(cell.name, run.end, score if run.end == "scored" else run.said)


def run_rival(problem: str, rival: str, *, seed: int, budget: float, suite: str | None = None) -> BenchRun:
    """Run a rival on a problem and score what it has tried; a rival that fails is a run too.

    Args:
        problem: name of the problem.
        rival: name of the rival, or its place in Python.
        seed: seed of all randomness.
        budget: CPU time [s].
        suite: folder of the problem's folder; that of trajevo if None.
    """
    named, own = benchmark(problem, None if suite is None else Path(suite)), adapter(rival)
    versions = installed_versions() | {own.distribution: own.version or "none", "python": platform.python_version()}
    about: dict[str, Any] = {
        "problem": problem,
        "rival": rival,
        "seed": seed,
        "budget": budget,
        "machine": Machine.here(),
    }
    contest = Contest(named, seed=seed, budget=budget)
    refused = own.refuses(contest)
    if refused:
        return BenchRun(**about, versions=versions, end="not stated", said=refused)
    if not own.installed:
        return BenchRun(**about, versions=versions, end="not installed", said=f"not installed: {own.install}")
    before = yardstick()
    failure = _solved(own, contest)
    about["yardstick"] = 0.5 * (before + yardstick())
    end: End = "failed" if failure and not (contest.tried or contest.motions) else "scored"
    said = one_line(failure) or own.says
    return BenchRun(**about, versions=versions, end=end, said=said, **_scores(contest))


def _solved(own: BenchRival, contest: Contest) -> str:
    """Let a rival solve; what went wrong, or empty."""
    own.prepare()
    contest.start()
    try:
        # Overflows of candidates that are far off are the rival's own business.
        with np.errstate(all="ignore"):
            own.solve(contest)
    except OutOfTimeError:
        pass
    except Exception as error:  # noqa: BLE001 - whatever a rival raises is told in its row
        if contest.in_time():  # some raise errors of their own where an evaluation raises
            return f"failed: {told(error)}"
    finally:
        contest.stop()
    return ""


def _scores(contest: Contest) -> dict[str, Any]:
    """What a run has reached, as fields of its record."""
    named = contest.benchmark
    if contest.motions:
        return _scores_of_motions(contest)
    cpu, evaluations, X, F = judged(contest.problem, contest.tried, contest.budget)
    measure = Measure(named.reference)
    story = Story(measure, cpu, evaluations, measure.told(X, F), budget=contest.budget)
    rows = story.rows[kept_rows(F[story.rows], MOST_KEPT)]
    violation, checked = violation_of(named, X[rows], F[rows])
    return {
        "objectives": contest.problem.objective_names,
        "units": tuple(one.unit for one in contest.problem.objectives),
        "cpu": contest.spent,
        "evaluations": contest.evaluations,
        "history": tuple(Entry(**asdict(one)) for one in story.history()),
        "share": story.share,
        "times": {f"{share:g}": story.time_to(share) for share in SHARES},
        "X": tuple(map(tuple, X[rows].tolist())),
        "F": tuple(map(tuple, F[rows].tolist())),
        "violation": violation,
        "checked": checked,
        "instants": INSTANTS,
    }


def _scores_of_motions(contest: Contest) -> dict[str, Any]:
    """The same of motions that no decision vectors stand for, of which the least counts."""
    objective = contest.problem.objectives[0]
    cpu, values, excesses = np.array(contest.motions).T
    numbers = np.arange(1, len(cpu) + 1)
    story = Story(Measure(contest.benchmark.reference), cpu, numbers, values[:, None], budget=contest.budget)
    best = int(values.argmin())
    return {
        "objectives": (objective.name,),
        "units": (objective.unit,),
        "cpu": contest.spent,
        "evaluations": contest.evaluations,
        "history": tuple(Entry(**asdict(one)) for one in story.history()),
        "share": story.share,
        "times": {f"{share:g}": story.time_to(share) for share in SHARES},
        "F": ((float(values[best]),),),
        "violation": float(excesses[best]),
        "checked": 1,
        "instants": INSTANTS,
    }


def _named(problems: Sequence[str] | None, suite: Path | None) -> list[str]:
    """The problems that are asked for.

    Raises:
        InvalidInputError: a folder without problems, or a problem whose files cannot be used.
    """
    known = benchmarks(suite)
    if suite is not None and not known:
        raise InvalidInputError(
            f"suite: {suite}: expected a folder with problems, each in a folder with reference.json"
        )
    return [benchmark(name, suite).name for name in dict.fromkeys(problems or known)]


def _cells(asked: BenchCell, problems: Sequence[str], rivals: Sequence[str] | None) -> list[BenchCell]:
    """All runs that are asked for: first seeds first, so that what stands early compares all rivals."""
    for rival in rivals or ():
        adapter(rival)
    names = list(dict.fromkeys(rivals or adapters()))
    return [
        replace(asked, problem=problem, rival=rival, seed=seed)
        for seed in range(1, asked.seed + 1)
        for problem in problems
        for rival in names
    ]


def _made(run: BenchRun | None, cell: BenchCell) -> bool:
    """Whether a run is made already, with as much time and by what is installed now."""
    if run is None or run.budget != cell.budget:
        return False
    own = adapter(cell.rival)
    if run.end == "not installed":
        return not own.installed
    return run.versions.get(own.distribution) == (own.version or "none")


def _checked_seeds(seeds: object) -> int:
    if not isinstance(seeds, int) or isinstance(seeds, bool) or seeds < 1:
        raise InvalidInputError(f"seeds: expected a whole number of at least 1, got {seeds!r}")
    return seeds


def _checked_budget(budget: object) -> float:
    number = isinstance(budget, int | float) and not isinstance(budget, bool)
    if not number or not 0.0 < float(budget) < np.inf:  # type: ignore[arg-type]
        raise InvalidInputError(f"budget: expected a positive CPU time [s], got {budget!r}")
    return float(budget)  # type: ignore[arg-type]
