"""The commented example of a task that ``trajevo init`` writes."""

from __future__ import annotations

from pathlib import Path

from trajevo.errors import InvalidInputError

_EXAMPLE = Path(__file__).with_name("task.toml")


def write_example(file: str | Path) -> Path:
    """Write a commented example of a task that can be solved as it stands.

    Raises:
        InvalidInputError: the file exists, or cannot be written.
    """
    target = Path(file)
    if target.exists():
        raise InvalidInputError(f"{target}: exists already; choose another name")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(_EXAMPLE.read_text(encoding="utf-8"), encoding="utf-8")
    except OSError as error:
        raise InvalidInputError(f"{target}: cannot be written: {error.strerror}") from error
    return target
