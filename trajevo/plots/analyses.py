"""What is computed for a report before anything is drawn: analyses by name, kept beside the front they are of."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from trajevo.capacity.payload_studies import PAYLOAD_STUDIES, Studied
from trajevo.errors import InvalidInputError, checked_name
from trajevo.front.front import Front
from trajevo.plots.analyses_file import read_analyses, write_analyses
from trajevo.solvers.rivals import rivals_of
from trajevo.verification.certify import certify

#: Analyses by name, in the order in which they are computed.
ANALYSES: dict[str, Callable[[Studied], Any]] = {
    "certificate": lambda of: certify(of.knee),
    "rivals": lambda of: rivals_of(of.front.problem),
    **PAYLOAD_STUDIES,
}

#: How much is computed for a report: nothing, what takes no time worth mentioning, or everything.
KINDS: dict[str, tuple[str, ...]] = {"none": (), "short": ("certificate", "carried", "effort"), "full": tuple(ANALYSES)}

#: How the name of the file that keeps them ends; it begins as that of the front.
ANALYSES_SUFFIX = ".analyses.npz"


def analysed(front: Front, kind: str = "full") -> tuple[str, ...]:
    """Names of the analyses that there are of a front.

    Args:
        front: the front; an empty one has none.
        kind: a key of :data:`KINDS`.

    Raises:
        UnknownNameError: no such kind.
    """
    wanted = KINDS[checked_name("report", kind, KINDS)]
    if not wanted or not len(front):
        return ()
    problem = front.problem
    limited = bool(np.isfinite(problem.robot.limits.effort).any())
    suits = {"certificate": True, "rivals": problem.compares_rivals}
    return tuple(name for name in wanted if suits.get(name, limited))


def analyse(front: Front, kind: str = "full", *, file: str | Path | None = None) -> Mapping[str, Any]:
    """Everything that a report shows beyond the front, by name; what was kept of it is read and not computed again.

    Args:
        front: the front.
        kind: ``"none"``, ``"short"``: what is proven of the knee, and what the solutions carry; or ``"full"``: payload
            studies and rivals too, some of which optimise again.
        file: where analyses of this front are kept; read, and written where something was missing. Those of another
            front, as of this one before it was polished, count as missing, and so does a damaged file, with a warning.

    Returns:
        Name -> analysis, None where it has nothing to show.

    Raises:
        UnknownNameError: no such kind.
    """
    names = analysed(front, kind)
    found = {} if file is None or not names else read_analyses(Path(file), front)
    missing = [name for name in names if name not in found]
    subject = Studied(front)
    for name in missing:
        found[name] = ANALYSES[name](subject)
    if missing and file is not None:
        try:
            write_analyses(Path(file), front, found)
        except InvalidInputError as error:  # a report can be made without
            warnings.warn(f"{error}; analyses are not kept", stacklevel=2)
    return {name: found[name] for name in names}
