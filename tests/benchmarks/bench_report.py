"""What a report costs, by its parts: reading, every analysis, every picture, writing; a run of a six-axis task."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

os.environ["MPLBACKEND"] = "Agg"

from trajevo import Front, load_task
from trajevo.capacity.payload_studies import Studied
from trajevo.page.report import report
from trajevo.plots import pictures
from trajevo.plots.analyses import ANALYSES, analyse, analysed

TASK = Path(__file__).parents[2] / "problems" / "tasks" / "ur5_pick_and_place.toml"


def timed(what: str, function: Callable[[], Any]) -> Any:
    """Result of a function, its CPU time printed."""
    began = time.process_time()
    result = function()
    print(f"{what:32s} {1e3 * (time.process_time() - began):8.0f} ms")
    return result


def main() -> None:
    """Print the table."""
    with tempfile.TemporaryDirectory() as folder:
        file, kept, page = (Path(folder) / name for name in ("front.json", "analyses.npz", "report.html"))
        load_task(TASK).solve(generations=20, population=40, progress=False).save(file)
        front = timed("read the front", lambda: Front.load(file))
        timed("make its problem", lambda: front.problem)
        subject = Studied(front)
        for name in analysed(front):
            timed(f"compute {name}", lambda name=name: ANALYSES[name](subject))
        found = analyse(front, file=kept)
        timed("read all analyses", lambda: analyse(front, file=kept))
        for stem, _, draw in pictures._drawings(front, found):
            timed(f"draw {stem}", lambda draw=draw: pictures._png(draw()))
        drawn = timed("draw all", lambda: pictures.draw_all(front, found))
        pictures.save_pictures(drawn, Path(folder) / "plots")
        timed("read all pictures", lambda: pictures.draw_all(front, found, kept=Path(folder) / "plots"))
        timed("write the report", lambda: report(front, page, analyses=found, pictures=drawn))
        print(f"{len(front)} solutions, {len(drawn)} pictures, {page.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
