"""Results of the benchmark as data: one run of a rival, and all runs of a file with the machine they ran on."""

from __future__ import annotations

import os
import platform
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Literal, TypeVar, final

import numpy as np
import pydantic

from trajevo.base.arrays import Array
from trajevo.base.files import MOST_DATA, read_text, why_not, write_whole
from trajevo.errors import InvalidInputError, no_such_file
from trajevo.front.records import Count, FromZero, Line, Record, told
from trajevo.study.bench.suite import bench_folder

#: File of all results in the folder of a benchmark, and the folder of its single runs.
RESULTS_FILE, RUNS_FOLDER = "results.json", "runs"

#: Name that stands for the results that are published with this version, and their file.
PUBLISHED, PUBLISHED_FILE = "published", "published.json"

#: Ends of a run: what a rival found was scored, it was not there, it cannot be set on the problem, or it failed.
End = Literal["scored", "not installed", "not stated", "failed"]


Kept = TypeVar("Kept", bound=Record)


class Machine(Record):
    """The machine on which a run was made.

    Attributes:
        processor: name of its processor.
        cores: number of logical cores.
        system: operating system.
    """

    processor: Line
    cores: Annotated[int, pydantic.Field(ge=1)]
    system: Line

    @classmethod
    def here(cls) -> Machine:
        """This machine."""
        names = []
        try:
            with open("/proc/cpuinfo", encoding="utf-8", errors="replace") as stream:
                names = [line.partition(":")[2].strip() for line in stream if line.startswith("model name")]
        except OSError:  # another system than Linux
            pass
        processor = names[0] if names else platform.processor() or platform.machine()
        return cls(processor=processor, cores=os.cpu_count() or 1, system=f"{platform.system()} {platform.release()}")


class Entry(Record):
    """An entry of a run's history, see :class:`trajevo.study.bench.score.Reached`.

    Attributes:
        cpu: CPU time [s].
        evaluations: rows evaluated so far.
        share: share of the best known.
        least: least value of every objective so far [SI].
    """

    cpu: FromZero
    evaluations: Count
    share: FromZero
    least: tuple[float, ...]


@final
class BenchRun(Record):
    """A run of a rival on a problem.

    Attributes:
        problem: name of the problem.
        rival: name of the rival.
        seed: seed of all randomness.
        budget: CPU time that the rival was given [s].
        end: how it ended.
        said: why it has no score, or what the rival's adapter says of itself.
        versions: versions of Python and of the packages that computed it, the rival's own included.
        machine: the machine.
        yardstick: CPU time of fixed work on it, the mean of right before and after the run [s]; None in records of
            older versions. CPU times of different machines compare in units of it alone.
        objectives: names of the objectives.
        units: their SI units.
        cpu: CPU time that the rival has spent [s].
        evaluations: rows that it has evaluated.
        history: what it had reached at times that grow evenly in their logarithm.
        share: share of the best known at the end: of the hypervolume, or the best known least value over its own.
        times: share of the best known, as text -> CPU time until it was reached [s], None if it never was.
        X: decision vectors of at most 100 members at the end; none of motions that no decision vector stands for.
        F: their objective values [SI].
        violation: greatest excess over a limit, as a share of it, at ``instants`` instants of the motions of
            ``checked`` of them; None without members.
        checked: number of members that were looked at.
        instants: number of instants of each.
    """

    problem: Line
    rival: Line
    seed: Count
    budget: Annotated[float, pydantic.Field(gt=0.0)]
    end: End
    said: Line = ""
    versions: dict[Line, Line]
    machine: Machine
    yardstick: Annotated[float, pydantic.Field(gt=0.0)] | None = None
    objectives: tuple[Line, ...] = ()
    units: tuple[Line, ...] = ()
    cpu: FromZero = 0.0
    evaluations: Count = 0
    history: tuple[Entry, ...] = ()
    share: FromZero = 0.0
    times: dict[Line, FromZero | None] = pydantic.Field(default_factory=dict)
    X: tuple[tuple[float, ...], ...] = ()
    F: tuple[tuple[float, ...], ...] = ()
    violation: float | None = None
    checked: Count = 0
    instants: Count = 0

    @pydantic.model_validator(mode="after")
    def _rectangular(self) -> BenchRun:
        if len(self.X) not in (0, len(self.F)) or any(len(row) != len(self.objectives) for row in self.F):
            raise ValueError(f"expected {len(self.X)} rows of {len(self.objectives)} numbers in F")
        return self

    @property
    def values(self) -> Array:
        """F as an array, shape (members, objectives)."""
        return np.array(self.F, dtype=np.float64).reshape(len(self.F), len(self.objectives))

    def time_to(self, share: float) -> float:
        """CPU time until a share of the best known was reached [s]; infinite if it never was."""
        found = self.times.get(f"{share:g}")
        return np.inf if found is None else found


@final
class BenchResults(Record):
    """All runs of a benchmark, the content of ``results.json``.

    Attributes:
        runs: the runs, in the order of their problems, rivals and seeds.
    """

    format: Literal["trajevo bench"] = "trajevo bench"
    version: Literal[1] = 1
    runs: tuple[BenchRun, ...]

    @classmethod
    def of(cls, runs: Iterable[BenchRun]) -> BenchResults:
        """Results of runs, sorted."""
        return cls(runs=tuple(sorted(runs, key=lambda run: (run.problem, run.rival != "trajevo", run.rival, run.seed))))

    @classmethod
    def load(cls, given: str | Path) -> BenchResults:
        """Read results.

        Args:
            given: a file, the folder of a benchmark, or ``"published"`` for what is published with this version.

        Raises:
            InvalidInputError: there is no such file, or it holds no results of this version; the message says where.
        """
        file = Path(given) / RESULTS_FILE if Path(given).is_dir() else Path(given)
        if str(given) == PUBLISHED and not file.exists():
            file = bench_folder() / PUBLISHED_FILE
        return _read(file, cls)

    def brief_ones(self) -> BenchResults:
        """The same without what tables and comparisons do not need, to be published.

        That is members and histories, and of runs that were none, since a rival cannot be set on a problem or was not
        there, all but the first.
        """
        kept: dict[tuple[str, str, int], BenchRun] = {}
        for run in self.runs:
            none = run.end in ("not stated", "not installed")
            kept.setdefault((run.problem, run.rival, -1 if none else run.seed), run)
        return BenchResults(
            runs=tuple(run.model_copy(update={"X": (), "F": (), "history": ()}) for run in kept.values())
        )

    def save(self, file: str | Path) -> None:
        """Write the results.

        Raises:
            InvalidInputError: the file cannot be written.
        """
        _write(Path(file), self)


def read_runs(folder: Path) -> dict[Path, BenchRun]:
    """The single runs that a folder of a benchmark holds, by their files.

    Raises:
        InvalidInputError: one of them is damaged.
    """
    return {file: _read(file, BenchRun) for file in sorted((folder / RUNS_FOLDER).glob("*.json"))}


def write_run(folder: Path, run: BenchRun) -> Path:
    """Write a single run into the folder of a benchmark.

    Raises:
        InvalidInputError: it cannot be written.
    """
    file = folder / RUNS_FOLDER / f"{file_name(run.problem, run.rival, run.seed)}.json"
    _write(file, run)
    return file


def file_name(problem: str, rival: str, seed: int) -> str:
    """Name of the file of a run, without its suffix."""
    return f"{problem},{rival.replace(':', '-')},seed={seed}"


def _write(file: Path, record: Record) -> None:
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        write_whole(file, record.model_dump_json(indent=1).encode())
    except OSError as error:
        raise InvalidInputError(f"{file}: cannot be written: {why_not(error)}") from error


def _read(file: Path, kind: type[Kept]) -> Kept:
    try:
        return kind.model_validate_json(read_text(file, most=MOST_DATA))
    except FileNotFoundError as error:
        raise InvalidInputError(no_such_file(file)) from error
    except (OSError, UnicodeDecodeError) as error:
        raise InvalidInputError(f"{file}: cannot be read: {why_not(error)}") from error
    except pydantic.ValidationError as error:
        raise InvalidInputError(f"{file}: holds no results of trajevo bench: {told(error)}") from error
