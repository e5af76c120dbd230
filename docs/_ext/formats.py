"""The page of file formats, from the records that read and write these files."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Any

import keys

from trajevo.exporters.export import EXPORTERS
from trajevo.exporters.samples import proof_schema
from trajevo.front.records import (
    Blocking,
    FailedIndividual,
    FrontFile,
    History,
    ObjectiveRecord,
    ProblemRecord,
    Run,
    VariableRecord,
)
from trajevo.solvers.run.folder import Block, Manifest
from trajevo.study.folder import Failure
from trajevo.study.record import Level, StudyRecord, TaskContent

INTRODUCTION = """# File formats

All files of a run are JSON or arrays of numbers and text; nothing in them is ever executed. JSON holds no NaN and no
infinity, numbers are in SI units, and keys that a reader does not know are refused. `format` and `version` say what a
file is; one of another version is refused with a sentence. `X`, `F` and `G` are what was computed, to the bit.
"""

FOLDER = """## The folder of a run

| file | content |
|---|---|
| `manifest.json` | how the run was begun: [below](#manifest-json) |
| `blocks/000001.npz`, ... | every evaluated individual, named by the first generation in the file: [below](#blocks) |
| `checkpoint.npz` | what the run needs to go on: its books by generation, and the state of the algorithm |
| `front.json` | the front: [below](#front-json) |
| `evolved.json` | the front before it was polished, in the same format |
| `front.bound.npz` | where `trajevo bound` stands with that front, from which it goes on; deleting it is safe |
| `front.analyses.npz` | what was computed for the report, by name, for that front; deleting it is safe |
| `report.html`, `plots/` | the report and pictures; deleting them is safe |

What a run's folder promises, and how it goes on: [](../how_to/runs.md).
"""

STUDY = """## The folder of a study

`study.json` is the study, `cells/NAME/` the folder of each run, with `failure.json` where it failed;
`trajevo study collect` adds `results.csv`, `results.nc` (netCDF-4), a page and pictures: [](../how_to/cluster.md).
"""

EXPORTS = """## Exports

`trajevo export RUN --format NAME` and [`export`](api/trajevo.export.rst) write them, with the problem, its settings,
units and the certificate of the motion. What each controller can and cannot carry:
[](../how_to/controllers.md).
"""

PROOF = """## Proof files

`trajevo certify RUN --proof FILE` and `certify(motion).write_proof(FILE)` write them, `trajevo check-proof FILE` and
`python check_proof.py FILE` check them: [](../how_to/proof.md). Their JSON Schema stands in
`trajevo/exporters/proof.schema.json`.
"""

#: Records of JSON files by the title of their section.
RECORDS: dict[str, tuple[type, ...]] = {
    "front.json": (FrontFile, ProblemRecord, VariableRecord, ObjectiveRecord, Run, FailedIndividual, History, Blocking),
    "manifest.json": (Manifest,),
}


def page() -> str:
    """The page in Markdown."""
    parts = [INTRODUCTION, FOLDER]
    for file, records in RECORDS.items():
        parts += [f"## {file}", *(_table(record) for record in records)]
    parts += [
        "## Blocks",
        "Arrays of `numpy.savez`, which `numpy.load(file, allow_pickle=False)` reads.",
        _table(Block),
    ]
    parts += [STUDY, *(_table(record) for record in (StudyRecord, TaskContent, Level, Failure)), EXPORTS, _exports()]
    parts += [PROOF, *_of_schema(proof_schema())]
    return "\n\n".join(part.strip() for part in parts) + "\n"


def _table(record: type) -> str:
    said = keys.described(record)
    first = inspect.cleandoc(record.__doc__ or "").partition("\n\n")[0].replace("\n", " ")
    rows = [f"| `{name}` | {_cell(said.get(name, ''))} |" for name in names(record)]
    title = record.__name__.removesuffix("Record").removesuffix("File")
    return "\n".join([f"### {title}", "", first, "", "| key | content |", "|---|---|", *rows])


def names(record: type) -> list[str]:
    """Keys of a record, or names of the arrays of a block."""
    if is_dataclass(record):
        return [one.name for one in fields(record)]
    return list(record.model_fields)  # type: ignore[attr-defined]


def _of_schema(schema: dict[str, Any]) -> Iterator[str]:
    """Tables of the keys of a JSON Schema's objects."""
    yield _keys("The file", schema)
    for name, part in schema["$defs"].items():
        if "properties" in part:
            yield _keys(name, part)


def _keys(title: str, part: dict[str, Any]) -> str:
    rows = []
    for key, value in part["properties"].items():
        inner = value.get("items", {})
        rows.append(f"| `{key}` | {_cell(value.get('description', ''))} |")
        if "properties" in inner:
            said = inner["properties"].items()
            rows += [f"| `{key}.{name}` | {_cell(each.get('description', ''))} |" for name, each in said]
    return "\n".join([f"### {title}", "", part.get("description", ""), "", "| key | content |", "|---|---|", *rows])


def _cell(text: str) -> str:
    return text.replace("|", r"\|").replace("[", r"\[").replace("]", r"\]")


def _exports() -> str:
    rows = []
    for exporter in EXPORTERS.values():
        holds = "a motion" if exporter.holds == "motion" else "a motion or a front"
        step = "its own" if exporter.step is None else f"{exporter.step:g} s"
        angle = "rad" if exporter.si else "rad or deg"
        said = f"{exporter.help}; needs {exporter.needs}" if exporter.needs else exporter.help
        rows.append(f"| `{exporter.name}` | `.{exporter.ending}` | {said} | {holds} | {step} | {angle} |")
    head = ["| format | file | content | of | time between samples | angles |", "|---|---|---|---|---|---|"]
    return "\n".join([*head, *rows])
