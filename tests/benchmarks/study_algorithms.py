"""Which algorithm, with or without polish and good starts? `make study-algorithms`: problems/studies/*_algorithms.toml.

Each is run with as many evaluations for all cells, and again with as much CPU time. What is printed are the tables of
docs/explanation/algorithms.md; table, comparisons and pictures of each study are in its folder. Finished cells are
kept: a second call goes on. Two workers, on a machine with two idle cores, take about an hour.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import pandas as pd

from trajevo.study.collection import collect
from trajevo.study.definition import Study, load_study
from trajevo.study.engines import Processes
from trajevo.study.report import write_study
from trajevo.study.run import run_study

STUDIES = Path(__file__).parents[2] / "problems" / "studies"

#: CPU time of a run [s]: what the default takes for about 40 generations and its polish.
CPU_TIME = 1.5


def at_equal_cpu_time(study: Study) -> Study:
    """The same study with a limit of CPU time for each run in place of one of evaluations."""
    fixed = {key: value for key, value in study.record.fixed.items() if key != "evaluations"}
    return Study.of(study.record.model_copy(update={"fixed": fixed | {"cpu_time": CPU_TIME}}))


def shown(table: pd.DataFrame) -> str:
    """Medians of the hypervolume as a table in Markdown, a row for each algorithm."""
    lines = ["| algorithm | plain | good starts | polish | both | CPU time of both [s] | evaluations of both |"]
    lines.append("|---|---|---|---|---|---|---|")
    best = table.groupby(["algorithm", "polish", "starts"])["hypervolume"].median().max()
    for algorithm, own in table.groupby("algorithm", sort=False):
        cells = []
        for polish in ("false", "true"):
            for starts in ("random", "spread"):
                rows = own[(own["polish"] == polish) & (own["starts"] == starts)]
                median, low, high = rows["hypervolume"].quantile([0.5, 0.25, 0.75])
                text = f"{median:.4f} ({low:.4f} to {high:.4f})"
                cells.append(f"**{text}**" if median >= 0.99 * best else text)
        both = own[(own["polish"] == "true") & (own["starts"] == "spread")]
        spent = f"{both['cpu_seconds'].median():.2f} | {both['evaluations'].median():.0f}"
        lines.append(f"| {algorithm} | {' | '.join(cells)} | {spent} |")
    return "\n".join(lines)


def main() -> None:
    """Run, collect and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", default=sorted(file.stem for file in STUDIES.glob("*_algorithms.toml")))
    parser.add_argument("--budget", choices=["cpu_time", "evaluations"], nargs="*", default=["cpu_time", "evaluations"])
    parser.add_argument("--out", type=Path, default=Path("runs") / "algorithms")
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    for budget in given.budget:
        for name in given.names:
            study = load_study(STUDIES / f"{name}.toml")
            if budget == "cpu_time":
                study = at_equal_cpu_time(study)
            folder = given.out / f"{name}_{budget}"
            stands = run_study(study, folder, engine=Processes(given.workers), progress=False)
            results = collect(folder)
            write_study(results)
            print(f"\n{name}, equal {budget}: {stands}; {results.origin}\n\n{shown(results.table())}", flush=True)


if __name__ == "__main__":
    main()
