"""The part of a page that answers to a click: the front, the robot, the chosen motion, and files of the choices."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from string import Template
from typing import Any

import numpy as np

from trajevo.base.units import display, pretty
from trajevo.errors import TrajevoError
from trajevo.exporters.export import EXPORTERS
from trajevo.exporters.exporter import certificate_of
from trajevo.front.front import Front, Solution
from trajevo.front.thinning import told_share
from trajevo.page.arm import arm
from trajevo.page.commands import problem_option
from trajevo.page.members import motions_of, numbers_of, quantities, rows_of
from trajevo.page.packing import Packed
from trajevo.page.parts import NO_VIEWER, packed_viewer, scripts_of, static, transport

#: Scripts in the order in which they need each other.
SCRIPTS = ("data.js", "canvas.js", "motions.js", "clock.js", "front.js", "profiles.js", "arm.js", "live.js", "page.js")

#: Greatest size of all files that a page holds, and of what they become, compressed [byte].
_ROOM, _PACKED_FILES = 1_800_000, 800_000

#: Greatest size of a page without its scripts and tables, and bytes that four letters of base64 hold [byte].
_PAGE, _OF_FOUR = 5_400_000, 3

#: Formats whose files a page holds, and their media types.
_FILES = {"csv": "text/csv", "json": "application/json", "ros2": "application/yaml"}


@dataclass(frozen=True)
class Explorer:
    """The interactive part of a page, as HTML.

    Attributes:
        body: its panels.
        scripts: data and scripts, for the end of the page.
        share: how many solutions it shows, in words; empty for all.
    """

    body: str
    scripts: str
    share: str


def explorer(
    front: Front,
    found: Mapping[str, Any],
    *,
    run: str,
    choices: Sequence[Solution],
    taken: int = 0,
    problem: str | None = None,
    live: Mapping[str, Any] | None = None,
) -> Explorer:
    """The interactive part of the page of a front.

    Args:
        front: a front that is not empty.
        found: analyses of it, from which the payloads of the choices are taken.
        run: what commands call the run.
        choices: the choices whose certificates and files are in the page, the knee first; files as far as there is
            room for them.
        taken: what pictures take of the page [byte].
        problem: what commands need as ``--problem``, if it is known.
        live: what a page that is served needs to follow its run.
    """
    pack, rows = Packed(), rows_of(choices[0], _OF_FOUR * (_PAGE - taken) // 4 - _PACKED_FILES)
    rollout, has_body, viewer = front.rollouts_of(rows), front.problem.robot.has_body, packed_viewer()
    data = {
        **_about(front, rows, run),
        "option": problem_option(front.record, problem),
        "members": numbers_of(front, rows, pack) | motions_of(rollout, pack),
        "arm": arm(choices[0], rollout, pack) if viewer and has_body else None,
        "known": _known(choices, found, pack),
        "live": live,
    }
    why = NO_VIEWER if has_body else "this robot is joints and limits alone; there is no body to draw"
    note = "" if data["arm"] else f'<p class="note">{escape(why)}</p>'
    body = Template(static("explorer.html")).substitute(transport=transport(note))
    return Explorer(body, scripts_of(SCRIPTS, data, pack, viewer), told_share(rows, front))


def _about(front: Front, rows: Any, run: str) -> dict[str, Any]:
    """What the page tells of the problem, its objectives, joints and choices."""
    problem, record = front.problem, front.record
    objectives = []
    for one in record.objectives:
        unit, factor = display(one.unit, angle=record.angle, length=record.length)
        known = "" if unit == "1" else pretty(unit)
        title = f"{one.name} [{known}]" if known else one.name
        objectives.append({"name": one.name, "unit": known, "factor": factor, "title": title})
    places = {int(row): place for place, row in enumerate(rows.tolist())}
    choices: dict[str, dict[str, Any]] = {
        one.rule: {"rule": one.rule, "member": places[one.index], "reason": one.reason} for one in front.choices()
    }
    return {
        "title": record.title,
        "robot": problem.robot.name,
        "run": run,
        "objectives": objectives,
        "constraints": list(record.constraints),
        "joints": list(problem.robot.joint_names),
        "quantities": quantities(front),
        "choices": list(choices.values()),
        "carries": problem.robot.gives_effort,
    }


def _known(choices: Sequence[Solution], found: Mapping[str, Any], pack: Packed) -> dict[str, Any]:
    """Certificates, payloads and files of choices by their rows; a choice that has the row of another adds nothing."""
    known: dict[str, Any] = {}
    room = _ROOM
    for one in choices:
        if str(one.index) in known:
            continue
        about: dict[str, Any] = {"certificate": str(certificate_of(one)), "files": []}
        carried = next((each for each in found.get("carried") or () if each.rule == one.rule), None)
        if carried is not None:
            about["payload"] = str(carried.capacity)
        for file, kind, content in _files(one):
            if len(content) <= room:
                room -= len(content)
                place = pack.add(np.frombuffer(content, np.uint8), "u1")
                about["files"].append({"name": file, "kind": kind, "text": place})
        known[str(one.index)] = about
    return known


def _files(solution: Solution) -> Iterator[tuple[str, str, bytes]]:
    """Name, media type and content of the files of a solution, as ``export`` writes them."""
    for name, kind in _FILES.items():
        exporter = EXPORTERS[name]
        try:
            content = exporter.function(solution, exporter.step, "rad")
        except TrajevoError:  # a robot that the format cannot hold
            continue
        held = content.encode() if isinstance(content, str) else bytes(content)
        yield f"{solution.rule}.{exporter.ending}", kind, held
