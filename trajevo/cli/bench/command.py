"""The commands ``trajevo bench``: run, compare, table."""

from __future__ import annotations

import signal
from collections import Counter
from pathlib import Path
from typing import Annotated

import typer

from trajevo.cli.console import Terminal
from trajevo.cli.screen.tables import Listing
from trajevo.errors import InvalidInputError, checked_name
from trajevo.study.bench.compare import compared, unlike
from trajevo.study.bench.record import BenchResults
from trajevo.study.bench.run import SIZES, BenchOutcome, BenchStanding, run_benchmark
from trajevo.study.bench.table import HEADERS, cells_of, heading, left_out, rows_of, write_table
from trajevo.study.bench.update import update_references
from trajevo.study.engines import InProcess, Processes

app = typer.Typer(
    help="Rivals on published problems, on equal terms: times to what is best known.", no_args_is_help=True
)
_out = Terminal()

_Results = Annotated[Path, typer.Argument(help="File results.json, or the folder of a benchmark.")]


@app.command()
def run(
    problem: Annotated[
        list[str] | None, typer.Option("--problem", help="Name of a problem; repeatable; all if not given.")
    ] = None,
    rival: Annotated[
        list[str] | None,
        typer.Option("--rival", help="Name of a rival, or MODULE:CLASS of your own; repeatable; all if not given."),
    ] = None,
    size: Annotated[str, typer.Option(help=f"How much is run: {', '.join(SIZES)}.")] = "small",
    seeds: Annotated[int | None, typer.Option(help="Runs of a rival on a problem; the size's if not given.")] = None,
    budget: Annotated[float | None, typer.Option(help="CPU time of a run [s]; the size's if not given.")] = None,
    workers: Annotated[int, typer.Option(min=1, help="Runs at a time, each in a process.")] = 1,
    suite: Annotated[
        Path | None, typer.Option(help="Folder with problems of your own; those of trajevo if not given.")
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder of the benchmark.")] = Path("runs/bench"),
    update: Annotated[
        bool, typer.Option("--update", help="Keep what is better than the best known, in the problems' files.")
    ] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="No line for each run.")] = False,
) -> None:
    """Run rivals on problems; what a former call has finished in the folder is kept."""
    own = SIZES[checked_name("size", size, SIZES)]
    stands = run_benchmark(
        out,
        problems=problem,
        rivals=rival,
        seeds=own.seeds if seeds is None else seeds,
        budget=own.budget if budget is None else budget,
        suite=suite,
        engine=InProcess() if workers == 1 else Processes(workers),
        tell=(lambda outcome: None) if quiet else _tell,
    )
    if update:
        for one in update_references(stands.results, suite):
            _out.print(f"better: {one.problem}: {one.before} members before, {one.now} now")
            _out.print(f"written: {one.file}")
    _end(stands, out)


@app.command()
def table(
    results: _Results,
    out: Annotated[Path | None, typer.Option(help="Folder for the table and the pictures.")] = None,
    record: Annotated[
        Path | None, typer.Option(help="File for the results without members and histories, to be compared with.")
    ] = None,
) -> None:
    """Show the table of a benchmark, and write it as CSV and Markdown with pictures where a folder is given."""
    found = BenchResults.load(results)
    _show(found)
    if record is not None:
        found.brief_ones().save(record)
        _out.written(record, then=f"trajevo bench compare {record} OTHER")
    if out is not None:
        # Imported where pictures are drawn, since that takes long.
        from trajevo.study.bench.pictures import write_pictures

        files = write_table(found, out)
        pictures, notes = write_pictures(found, out / "pictures")
        for note in notes:
            _out.print(note)
        _out.written(*files, *pictures, then=f"trajevo bench compare OTHER {results}")


@app.command()
def compare(
    before: Annotated[
        Path,
        typer.Argument(help="Results of another version or machine: a file, a folder, or published, as in the docs."),
    ],
    after: Annotated[Path, typer.Argument(help="Results to compare with them: a file, or a folder.")],
    every: Annotated[bool, typer.Option("--all", help="Show what is within the quartiles too.")] = False,
    check: Annotated[bool, typer.Option("--check", help="End with an error if anything is slower or worse.")] = False,
) -> None:
    """Show medians and quartiles of two results side by side, and which differ by more than their runs do."""
    old, new = BenchResults.load(before), BenchResults.load(after)
    changes = compared(old, new)
    listing = Listing("problem", "rival", "measure", "before", "after", "ratio", "verdict")
    for one in [one for one in changes if every or one.verdict != "within the quartiles"]:
        ratio = "" if one.ratio is None else f"{one.ratio:.3g}"
        listing.add(one.problem, one.rival, one.measure, one.before.told(), one.after.told(), ratio, one.verdict)
    counts = Counter(one.verdict for one in changes)
    if every or counts["within the quartiles"] < len(changes):
        _out.print(listing)
    _out.print(f"{len(changes)} measures: {', '.join(f'{count} {verdict}' for verdict, count in counts.items())}")
    for told in unlike(old, new):
        _out.print(told)
    if check and (counts["slower"] or counts["worse"]):
        raise typer.Exit(1)


def _tell(outcome: BenchOutcome) -> None:
    Terminal(stderr=True).print(f"{outcome.name}: {outcome.said}")


def _show(results: BenchResults) -> None:
    if not results.runs:
        raise InvalidInputError("results: there is no run among them; make some: trajevo bench run")
    listing = Listing(*HEADERS, title=heading(results))
    for row in rows_of(results):
        if row.stated:
            listing.add(*cells_of(row))
    _out.print(listing)
    for line in left_out(results):
        _out.print(line)


def _end(stands: BenchStanding, out: Path) -> None:
    """Show the table, where it is, and how to go on."""
    if stands.results.runs:
        _show(stands.results)
    if stands.stopped_by:
        _out.print(f"stopped by {stands.stopped_by}: {stands.made} runs were made and are kept, {stands.left} are left")
        _out.print("next: the same command makes what is left")
        raise typer.Exit(128 + signal.Signals[stands.stopped_by])
    _out.written(stands.file, then=f"trajevo bench table {out} --out {out} writes the table and pictures")
