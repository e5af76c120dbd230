"""Errors of trajevo: every message is one sentence that names the culprit, what was expected and what was given."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from pathlib import Path


class TrajevoError(ValueError):
    """Base of every error that trajevo raises on purpose."""


class InvalidInputError(TrajevoError):
    """An argument or a file has a value that cannot be used."""


class UnknownNameError(TrajevoError):
    """A name is not registered; the message lists the registered names and suggests the nearest.

    Attributes:
        kind: what the name should be the name of, such as ``"objective"``.
    """

    def __init__(self, kind: str, name: object, valid: Iterable[str]) -> None:
        self.kind = kind
        super().__init__(f"unknown {kind} {str(name)!r}; {known_names(str(name), valid)}")


#: Names in a list that is still read; of a longer one the nearest are told, if any is near.
_MOST_LISTED = 20

#: What others call a key or a name -> what it is called here. These are no misspellings, so no measure finds them.
_ALSO_CALLED = {
    "bounds": "duration_bounds",
    "durations": "duration_bounds",
    "effort_limits": "effort",
    "end_effector": "tool",
    "flange": "tool",
    "iterations": "generations",
    "joint_limits": "limits",
    "max_acceleration": "acceleration",
    "max_effort": "effort",
    "max_jerk": "jerk",
    "max_speed": "max_velocity",
    "max_velocity": "velocity",
    "n_gen": "generations",
    "obstacles": "scene",
    "optimiser": "algorithm",
    "optimizer": "algorithm",
    "orientation": "quaternion",
    "pop_size": "population",
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
    "xyz": "position",
}


def nearest_names(given: str, valid: Iterable[str], *, most: int = 1) -> list[str]:
    """The valid names that are most like a given one, best first; none if none is similar.

    Capitals, spaces and the kind of dash do not count.

    Args:
        given: what was written.
        valid: the names that are allowed.
        most: greatest number of names.
    """
    plain: dict[str, str] = {}
    for name in sorted(valid):
        plain.setdefault(_plain(name), name)
    asked = _plain(given)
    near = [asked] if asked in plain else difflib.get_close_matches(asked, plain, n=most)
    called = _ALSO_CALLED.get(asked)
    if called in plain and called not in near:
        near = [called, *near]
    return [plain[name] for name in near[:most]]


def _plain(name: str) -> str:
    return name.strip().casefold().replace("-", "_").replace(" ", "_")


def known_names(given: str, valid: Iterable[str]) -> str:
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
