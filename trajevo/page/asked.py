"""What a served page asks about solutions that it holds no files of: certificates, payloads and exports."""

from __future__ import annotations

from typing import Any, final

from trajevo.capacity.dlcc import dlcc
from trajevo.errors import InvalidInputError
from trajevo.exporters.export import NAMED_EXPORTERS
from trajevo.exporters.exporter import certificate_of
from trajevo.front.front import Front, Solution


@final
class Asked:
    """Answers about the solutions of a front; certificates are made once.

    Args:
        front: a front that is not empty.
    """

    def __init__(self, front: Front) -> None:
        self._front = front
        self._solutions: dict[int, Solution] = {}

    @staticmethod
    def formats() -> list[dict[str, str]]:
        """All formats as the page needs them: name, ending of file names, and what a robot must be like."""
        return [
            {"name": name, "ending": one.ending, "told": f"{one.help}; needs {one.needs}" if one.needs else one.help}
            for name, one in sorted(NAMED_EXPORTERS.all().items())
        ]

    def told(self, what: str, row: int) -> str:
        """The certificate or the largest payload of the solution in a row, in words.

        Args:
            what: ``"certificate"`` or ``"payload"``.
            row: row of the front.

        Raises:
            InvalidInputError: something else is asked, or there is no such row.
            TrajevoError: it cannot be computed, as for a robot without masses.
        """
        solution = self._solution(row)
        match what:
            case "certificate":
                return str(certificate_of(solution))
            case "payload":
                return str(dlcc(solution))
        raise InvalidInputError(f"expected certificate or payload, got {what!r}")

    def file(self, row: int, format: str) -> bytes:
        """The file that ``trajevo export`` writes of the solution in a row, with the defaults of the format.

        Raises:
            UnknownNameError: no such format.
            InvalidInputError: no such row, or a robot that the format cannot hold.
        """
        exporter = NAMED_EXPORTERS.find(format)
        content: Any = exporter.function(self._solution(row), exporter.step, "rad")
        return content.encode() if isinstance(content, str) else bytes(content)

    def _solution(self, row: int) -> Solution:
        """The solution in a row, by the name of its rule if it is a choice, as the files of the page have it."""
        if row not in self._solutions:
            if not 0 <= row < len(self._front):
                raise InvalidInputError(f"row: expected one from 0 to {len(self._front) - 1}, got {row}")
            choices = (choice for choice in self._front.choices() if choice.index == row)
            self._solutions[row] = next(choices, None) or self._front.pick(row)
        return self._solutions[row]
