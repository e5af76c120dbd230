"""Errors of trajevo: every message is one sentence that names the culprit, what was expected and what was given."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping, Sequence
from os import PathLike
from pathlib import Path

#: Greatest length of a message.
_LONGEST = 4000

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
        super().__init__(*(visible(_shortened(each)) for each in said))


def _shortened(text: str) -> str:
    """A message without the middle of what it quotes, if that is longer than anybody reads."""
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST // 2]} … {text[-_LONGEST // 4 :]}"


class InvalidInputError(TrajevoError):
    """An argument or a file has a value that cannot be used."""


class MissingLimitError(InvalidInputError):
    """Limits of joints are neither in a robot's files nor given; nothing is filled in for them.

    Attributes:
        missing: quantity, such as ``"jerk"`` -> names of the joints that have no such limit.
    """

    def __init__(self, said: str, missing: Mapping[str, Sequence[str]]) -> None:
        super().__init__(said)
        self.missing = {quantity: tuple(joints) for quantity, joints in missing.items()}


class NoSuchRowError(InvalidInputError, IndexError):
    """A row that a front does not have; an IndexError, by which Python ends a loop."""


class UnknownNameError(TrajevoError):
    """A name is not registered; the message lists the registered names and suggests the nearest.

    Attributes:
        kind: what the name should be the name of, such as ``"objective"``.
    """

    def __init__(self, kind: str, name: object, valid: Iterable[str]) -> None:
        self.kind = kind
        if isinstance(name, str | PathLike):
            super().__init__(f"unknown {kind} {str(name)!r}; {known_names(str(name), valid)}")
        else:
            super().__init__(
                f"unknown {kind} {name!r}: expected a name, got {type(name).__name__}; {known_names('', valid)}"
            )


class NotRegisteredError(InvalidInputError):
    """The problem of a front or a run is not registered, so that it must be passed.

    Attributes:
        said: which problem it is.
    """

    def __init__(self, title: str) -> None:
        self.said = f"its problem {title!r} is not a registered one"
        super().__init__(f"{self.said}; pass it as problem=...")


class NotImportedError(InvalidInputError):
    """Data of a run name something of the user's own, which is not imported for them."""


#: Names in a list that is still read; of a longer one the nearest are told, if any is near.
_MOST_LISTED = 20

#: Fewest characters with which the beginning of a name counts as like it.
_BEGINNING = 4

#: What others call a key or a name -> what it is called here. These are no misspellings, so no measure finds them.
_ALSO_CALLED = {
    "best": "knee",
    "bounds": "duration_bounds",
    "continue": "resume",
    "durations": "duration_bounds",
    "effort_limits": "effort",
    "end_effector": "tool",
    "excel": "csv",
    "flange": "tool",
    "iterations": "generations",
    "joint_limits": "limits",
    "mat": "netcdf",
    "matlab": "netcdf",
    "max_acceleration": "acceleration",
    "max_effort": "effort",
    "max_jerk": "jerk",
    "max_speed": "max_velocity",
    "max_velocity": "velocity",
    "n_gen": "generations",
    "nsga_ii": "nsga2",
    "nsga_iii": "nsga3",
    "obstacles": "scene",
    "optimise": "solve",
    "optimiser": "algorithm",
    "optimize": "solve",
    "optimizer": "algorithm",
    "orientation": "quaternion",
    "plan": "solve",
    "plot": "report",
    "pop_size": "population",
    "popsize": "population",
    "pose": "position",
    "power": "energy",
    "rotvec": "rotation_vector",
    "safety_factor": "effort_margin",
    "solver": "algorithm",
    "speed": "velocity",
    "tcp": "tool",
    "torque": "effort",
    "units": "angle",
    "via_points": "points",
    "waypoints": "points",
    "weight": "mass",
    "xlsx": "csv",
    "xyz": "position",
}


def nearest_names(given: object, valid: Iterable[str], *, most: int = 1) -> list[str]:
    """The valid names that are most like a given one, best first; none if none is similar.

    Capitals, spaces, the kind of dash and the dashes of an option do not count.

    Args:
        given: what was written; a key in Python may be no text.
        valid: the names that are allowed.
        most: greatest number of names.
    """
    plain: dict[str, str] = {}
    for name in sorted(valid):
        plain.setdefault(_plain(name), name)
    asked = _plain(str(given))
    near = [asked] if asked in plain else difflib.get_close_matches(asked, plain, n=most)
    longer = [name for name in plain if name.startswith(asked)]
    if len(asked) >= _BEGINNING and len(longer) == 1:  # the only name that begins so is meant, however long it is
        near = [*longer, *(name for name in near if name not in longer)]
    called = _ALSO_CALLED.get(asked)
    if called in plain and called not in near:
        near = [called, *near]
    return [plain[name] for name in near[:most]]


def _plain(name: str) -> str:
    return name.strip().lstrip("-").casefold().replace("-", "_").replace(" ", "_")


def known_names(given: object, valid: Iterable[str]) -> str:
    """End of a message about an unknown name: the known names, and the nearest if it is similar.

    Of a long list only the nearest names are told, if there are any.
    """
    names = sorted(valid)
    if len(names) > _MOST_LISTED:
        nearest = nearest_names(given, names, most=3)
        if nearest:
            return f"did you mean {_either(nearest)}?"
    nearest = nearest_names(given, names)
    meant = f"; did you mean {nearest[0]!r}?" if nearest and len(names) > 1 else ""
    return f"known: {', '.join(names) or 'none'}{meant}"


def _either(names: Sequence[str]) -> str:
    """Names in quotes: ``'a'``, ``'a' or 'b'``, ``'a', 'b' or 'c'``."""
    *before, last = map(repr, names)
    return f"{', '.join(before)} or {last}" if before else last


def no_such_file(file: str | Path, kind: str = "file") -> str:
    """Sentence about a file that is not there, with the file of its folder that is most like it."""
    path = Path(file)
    try:
        there = [entry.name for entry in path.parent.iterdir()]
    except OSError:
        return f"{file}: no such {kind}, nor the folder {str(path.parent)!r}"
    stems = {Path(name).stem: name for name in sorted(there) if Path(name).suffix.lower() == path.suffix.lower()}
    nearest = [stems[stem] for stem in nearest_names(path.stem, stems)] or nearest_names(
        path.name, set(there) - set(stems.values())
    )
    meant = f"; did you mean {str(path.with_name(nearest[0]))!r}?" if nearest else ""
    return f"{file}: no such {kind}{meant}"


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
