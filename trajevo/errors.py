"""Errors of trajevo: every message is one sentence that names the culprit, what was expected and what was given."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

#: Characters that steer a terminal or reorder its text, and what is shown for them.
_SHOWN = {
    **{code: 0x2400 + code for code in range(0x20) if chr(code) not in "\t\n"},
    0x7F: 0x2421,
    **dict.fromkeys(
        (
            *range(0x80, 0xA0),
            0x61C,
            0x200E,
            0x200F,
            *range(0x2028, 0x202F),
            *range(0x2066, 0x206A),
            *range(0xD800, 0xE000),
        ),
        0xFFFD,
    ),
}


def visible(text: str) -> str:
    """Text in which control and bidirectional characters are replaced by signs; tabs and line ends stay."""
    return text if text.isascii() and text.isprintable() else text.translate(_SHOWN)


def one_line(text: str) -> str:
    """Text as :func:`visible` gives it, on one line."""
    return text if text.isascii() and text.isprintable() else " ".join(visible(text).split())


class TrajevoError(ValueError):
    """Base of every error that trajevo raises on purpose.

    Args:
        *said: one sentence; what files brought into it cannot steer a terminal.
    """

    def __init__(self, *said: str) -> None:
        super().__init__(*map(visible, said))


class InvalidInputError(TrajevoError):
    """An argument or a file has a value that cannot be used."""


class UnknownNameError(TrajevoError):
    """A name is not registered; the message lists the registered names and suggests the nearest."""

    def __init__(self, kind: str, name: object, valid: Iterable[str]) -> None:
        super().__init__(f"unknown {kind} {str(name)!r}; {known_names(str(name), valid)}")


class NotRegisteredError(InvalidInputError):
    """The problem of a front or a run is not registered, so that it must be passed.

    Attributes:
        said: which problem it is.
    """

    def __init__(self, title: str) -> None:
        self.said = f"its problem {title!r} is not a registered one"
        super().__init__(f"{self.said}; pass it as problem=...")


def known_names(given: str, valid: Iterable[str]) -> str:
    """End of a message about an unknown name: all known names, and the nearest one if it is similar."""
    names = sorted(valid)
    nearest = difflib.get_close_matches(given, names, n=1)
    meant = f"; did you mean {nearest[0]!r}?" if nearest and len(names) > 1 else ""
    return f"known: {', '.join(names) or 'none'}{meant}"


def checked_name(kind: str, name: object, valid: Iterable[str]) -> str:
    """The name, if it is one of the valid ones.

    Raises:
        UnknownNameError: it is none of them, or is not a string.
    """
    names = list(valid)
    if not isinstance(name, str) or name not in names:
        raise UnknownNameError(kind, name, names)
    return name


class UnreachableError(TrajevoError):
    """A point to be visited lies outside what the mechanism can reach."""


class NoSolutionError(TrajevoError):
    """A solution was to be selected from a front that holds no feasible one."""


class GradientWarning(UserWarning):
    """Derivatives of an objective or a constraint are not exact, but computed by finite differences."""
