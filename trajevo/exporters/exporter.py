"""What every exporter is, and what its files say of the motion that they hold."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, final

from trajevo.front.front import Solution
from trajevo.verification.certify import certify

#: How a file begins whose first lines are :func:`comments`.
COMMENTED = b"# problem: {"


@final
@dataclass(frozen=True)
class Exporter:
    """A format that a solution, or a whole front, can be written in.

    Attributes:
        name: of the format.
        ending: how the name of its files ends, after the point; no two formats share one.
        help: one line that says what is in the file.
        function: source, time between samples [s] and unit of angles -> content of the file.
        holds: ``"motion"``, the source is one solution, or ``"front"``, it may be a whole front too.
        needs: what the robot must be like, ``""`` for any robot.
        step: usual time between samples [s]; None if the function knows.
        si: whether the format is SI by definition, so that it takes no degrees.
        beginning: how its files begin, by which they are known again.
        recognises: whether a file that begins so is one that was made here, where its beginning does not tell.
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

    def wrote(self, file: Path, first: bytes) -> bool:
        """Whether a file is of this format and was made here.

        Args:
            file: the file.
            first: its first bytes.
        """
        known = file.name.endswith(f".{self.ending}") and first.startswith(self.beginning)
        return known and (self.recognises is None or self.recognises(file))


def about(solution: Solution) -> dict[str, Any]:
    """What a stranger needs to know about a motion, as plain data: problem, run, solution and certificate."""
    front = solution.front
    return {
        "problem": front.record.model_dump(mode="json"),
        "run": front.run.model_dump(mode="json"),
        "solution": {
            "row": solution.index,
            "rule": solution.rule,
            "reason": solution.reason,
            "x": solution.x.tolist(),
            "objectives": solution.F,
            "constraints": solution.G,
        },
        "certificate": certify(solution).summary,
    }


def comments(solution: Solution) -> str:
    """The same as lines of comment, ``# problem: {...}`` and so on."""
    return "".join(f"# {key}: {json.dumps(value)}\n" for key, value in about(solution).items())
