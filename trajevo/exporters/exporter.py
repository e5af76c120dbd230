"""Exporters, and the description of a motion that their files hold."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, final
from weakref import WeakKeyDictionary

from trajevo.base.shown.brief import brief
from trajevo.front.front import Solution
from trajevo.verification.certificate import Certificate
from trajevo.verification.certify import certify

#: Beginnings of cells that spreadsheets compute.
_FORMULAS = ("=", "+", "-", "@", "\t", "\r")

#: First bytes of a file that starts with :func:`comments`.
COMMENTED = b"# problem: {"


@final
@dataclass(frozen=True)
class Exporter:
    """A format that a solution, or a whole front, can be written in.

    Attributes:
        name: name of the format.
        ending: ending of its file names, after the dot; no two formats share one.
        help: content of the file in one line.
        function: source, time between samples [s] and unit of angles -> content of the file.
        holds: ``"motion"`` if the source is one solution, ``"front"`` if it may be a whole front too.
        needs: what the robot must be like, ``""`` for any robot.
        step: default time between samples [s]; None if the function has its own.
        si: whether the format is SI by definition, so that degrees are refused.
        beginning: first bytes of its files, by which they are recognised.
        recognises: file -> whether trajevo made it, for formats whose first bytes do not tell; otherwise None.
    """

    name: str
    ending: str
    help: str
    function: Callable[[Any, Any, str], str | bytes | memoryview]
    holds: Literal["motion", "front"] = field(default="motion", kw_only=True)
    needs: str = field(default="", kw_only=True)
    step: float | None = field(default=0.01, kw_only=True)
    si: bool = field(default=False, kw_only=True)
    beginning: bytes = field(default=COMMENTED, kw_only=True)
    recognises: Callable[[Path], bool] | None = field(default=None, kw_only=True)

    __repr__ = brief

    def wrote(self, file: Path, first: bytes) -> bool:
        """Whether a file is of this format and was made by trajevo.

        Args:
            file: the file.
            first: its first bytes.
        """
        known = file.name.endswith(f".{self.ending}") and first.startswith(self.beginning)
        return known and (self.recognises is None or self.recognises(file))


def cell(text: str) -> str:
    """Text of a cell of a table, which no spreadsheet takes for a formula."""
    return f"'{text}" if text.startswith(_FORMULAS) else text


#: Certificates of solutions that are exported more than once, as long as the solutions exist.
_certified: WeakKeyDictionary[Solution, Certificate] = WeakKeyDictionary()


def certificate_of(solution: Solution) -> Certificate:
    """The certificate of a solution, made once."""
    found = _certified.get(solution)
    if found is None:
        found = _certified[solution] = certify(solution)
    return found


def about(solution: Solution) -> dict[str, Any]:
    """Description of a motion as plain data: problem, run, solution and certificate."""
    front, certificate = solution.front, certificate_of(solution)
    proven = {row.name: row.share for row in certificate.rows}
    return {
        "problem": front.record.model_dump(mode="json"),
        "run": front.run.model_dump(mode="json"),
        "solution": {
            "row": solution.index,
            "rule": solution.rule,
            "reason": solution.reason,
            "x": solution.x.tolist(),
            "objectives": solution.F,
            "constraints": {name: proven.get(name, 1.0 + value) - 1.0 for name, value in solution.G.items()},
            **({} if solution.base is None else {"base": solution.base.settings}),
            **({} if solution.visits is None else {"visits": solution.visits.settings}),
        },
        "certificate": certificate.summary,
    }


def comments(solution: Solution) -> str:
    """The description from :func:`about` as comment lines, ``# problem: {...}`` and so on."""
    return "".join(f"# {key}: {json.dumps(value)}\n" for key, value in about(solution).items())
