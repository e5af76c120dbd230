"""The files of a comparison of robots: its tables, its data, its picture and its page."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt

from trajevo.base.files import why_not, write_whole
from trajevo.errors import InvalidInputError
from trajevo.exporters.exporter import cell
from trajevo.page.parts import figure, table
from trajevo.plots.robots.fronts import robot_fronts
from trajevo.study.collection import collect
from trajevo.study.page import study_page
from trajevo.study.robots.asked import OF_ROBOTS

if TYPE_CHECKING:
    from trajevo.study.robots.choice import RobotChoice

ROBOTS_FILE, FRONT_FILE, DATA_FILE = "robots.csv", "front.csv", "choice.json"
PICTURE_FILE, MOTIONS_FILE, PAGE_FILE = "fronts.png", "motions.png", "choice.html"


def write_choice(choice: RobotChoice, folder: Path) -> tuple[Path, ...]:
    """Write what came out where robots were compared.

    Args:
        choice: what came out.
        folder: folder to write to.

    Returns:
        The files: ``robots.csv``, a row per robot; ``front.csv``, a row per motion of the common front;
        ``choice.json``, both; and, where a robot can do the task, ``fronts.png``, ``motions.png`` without what only the
        catalogue tells, and of a study that was kept the page ``choice.html``.

    Raises:
        InvalidInputError: they cannot be written.
    """
    robots = list(map(choice.facts, choice.robots))
    front = [dict(_member(choice, k, name)) for k, name in enumerate(choice.robot)]
    columns = ["robot", "row", *(f"{one.name} [{one.unit}]" for one in choice.objectives)]
    contents: dict[str, bytes] = {
        ROBOTS_FILE: _csv(list(robots[0]), robots),
        FRONT_FILE: _csv(columns, front),
        DATA_FILE: _json(choice, robots, front),
    }
    pictures: dict[str, bytes] = {}
    for name, drawn in _drawn(choice).items():
        contents[name] = pictures[f"fronts of all robots: {', '.join(drawn)}"] = _picture(choice, drawn)
    if len(choice) and choice.folder is not None:
        results, page = collect(choice.folder), folder / PAGE_FILE
        title = f"Which robot: {choice.title}"
        contents[PAGE_FILE] = study_page(results, page, sections=_sections(choice, pictures), title=title)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in contents.items():
            write_whole(folder / name, content)
    except OSError as error:
        raise InvalidInputError(f"{folder}: the results cannot be written there: {why_not(error)}") from error
    return tuple(folder / name for name in contents)


def _member(choice: RobotChoice, row: int, name: str) -> Mapping[str, Any]:
    units = (f"{one.name} [{one.unit}]" for one in choice.objectives)
    own = choice.rows_of_fronts[row]
    return {"robot": name, "row": own, **dict(zip(units, choice.F[row].tolist(), strict=True))}


def _csv(columns: Sequence[str], rows: Sequence[Mapping[str, Any]]) -> bytes:
    stream = io.StringIO()
    writer = csv.writer(stream)
    writer.writerow(columns)
    for row in rows:
        values = ("" if row[name] is None else row[name] for name in columns)
        writer.writerow(cell(value) if isinstance(value, str) else value for value in values)
    return stream.getvalue().encode()


def _json(choice: RobotChoice, robots: Sequence[Any], front: Sequence[Any]) -> bytes:
    told = {
        "format": "trajevo choice of a robot",
        "version": 1,
        "task": choice.title,
        "objectives": [one.model_dump() for one in choice.objectives],
        "within [s]": choice.within,
        "robots": robots,
        "front": front,
        "sentences": list(choice.sentences),
    }
    return json.dumps(told, indent=1, allow_nan=False).encode()


def _drawn(choice: RobotChoice) -> dict[str, tuple[str, ...]]:
    """Names of pictures, and the objectives in each: the first three, and two of motions beside a price."""
    if not len(choice) or len(choice.objectives) < 2:
        return {}
    found = {PICTURE_FILE: choice.objective_names[:3]}
    of_motions = tuple(name for name in choice.objective_names if name not in OF_ROBOTS)[:2]
    return found | ({MOTIONS_FILE: of_motions} if 1 < len(of_motions) < len(found[PICTURE_FILE]) else {})


def _picture(choice: RobotChoice, objectives: Sequence[str]) -> bytes:
    drawn = robot_fronts(choice, objectives=objectives, width="page" if len(objectives) > 2 else "column").figure
    stream = io.BytesIO()
    drawn.savefig(stream, format="png", dpi=150)
    plt.close(drawn)
    return stream.getvalue()


def _sections(choice: RobotChoice, pictures: Mapping[str, bytes]) -> list[str]:
    """What the page of the study says first: who can do the task, who is never the best, and the common front."""
    rows = [[escape(text) for text in row] for row in choice.rows]
    return [
        "<h2>Which robot</h2>",
        table(choice.columns, rows),
        *(f'<p class="note">{escape(one)}</p>' for one in choice.sentences),
        *(figure(caption, png) for caption, png in pictures.items()),
    ]
