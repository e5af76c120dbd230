"""Analyses by name, computed for a report before anything is drawn, and stored beside their front."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from trajevo.capacity.payload_studies import PAYLOAD_STUDIES, Studied
from trajevo.errors import InvalidInputError, checked_name
from trajevo.formulation.cell.base_box import BASE_VARIABLE
from trajevo.front.exchange_rates import exchange_rates_of_all
from trajevo.front.front import Front
from trajevo.plots.analyses_file import read_analyses, write_analyses
from trajevo.verification.certify import certify


def _rivals(of: Studied) -> Any:
    """Rivals of a front, which few reports show."""
    from trajevo.solvers.rivals import rivals_of

    return rivals_of(of.front.problem)


def _base_map(of: Studied) -> Any:
    """Least of the first objective over the places of a base, with its other coordinates as at the knee."""
    from trajevo.solvers.base_map import base_columns, base_map

    first, second, *_ = base_columns(of.front.problem)
    return base_map(of.front.problem, axes=(first, second), at=of.knee)


#: Analyses by name, in the order in which they are computed.
ANALYSES: dict[str, Callable[[Studied], Any]] = {
    "certificate": lambda of: certify(of.knee),
    "exchange_rates": lambda of: exchange_rates_of_all(of.front, of.knee.index),
    "rivals": _rivals,
    "base_map": _base_map,
    **PAYLOAD_STUDIES,
}

#: Analyses computed for a report: none, those that take almost no time, or all.
KINDS: dict[str, tuple[str, ...]] = {
    "none": (),
    "short": ("certificate", "exchange_rates", "carried", "effort"),
    "full": tuple(ANALYSES),
}

#: Analyses that have a command of their own and are shown where they are kept.
ASKED_FOR = ("bound",)

#: Ending of the name of the file that stores them; it begins like that of the front.
ANALYSES_SUFFIX = ".analyses.npz"


def analysed(front: Front, kind: str = "full") -> tuple[str, ...]:
    """Names of the analyses of a front.

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
    limited = problem.robot.gives_effort and bool(problem.robot.limits.sides("effort").limited.any())
    schedule = problem.dynamics.schedule
    limited = limited and (schedule is None or schedule.varied is not None)  # else no payload is asked about
    plane = sum(variable.name.startswith(BASE_VARIABLE) for variable in problem.variables) > 1
    suits = {"certificate": True, "exchange_rates": True, "rivals": problem.compares_rivals, "base_map": plane}
    return tuple(name for name in wanted if suits.get(name, limited))


def analyse(
    front: Front,
    kind: str = "full",
    *,
    file: str | Path | None = None,
    begin: Callable[[str], None] | None = None,
) -> Mapping[str, Any]:
    """Everything that a report shows beyond the front, by name; stored analyses are read, not computed again.

    Args:
        front: the front.
        kind: ``"none"``; ``"short"`` for the certificate of the knee, what holds it back, and the payloads of the
            solutions; or ``"full"`` for payload studies and rivals too, some of which optimise again.
        file: file that stores analyses of this front. It is read, and written if something was missing. Analyses of
            another front, such as this one before it was polished, count as missing; so does a damaged file, with a
            warning. If the computation is interrupted, it has what was computed so far.
        begin: function that is called with the name of every analysis before it is computed.

    Returns:
        Name -> analysis, None if it has nothing to show.

    Raises:
        UnknownNameError: no such kind.
    """
    names = analysed(front, kind)
    found = {} if file is None or not names else read_analyses(Path(file), front)
    missing = [name for name in names if name not in found]
    subject = Studied(front)
    try:
        for name in missing:
            if begin is not None:
                begin(name)
            found[name] = ANALYSES[name](subject)
    finally:
        if missing and file is not None:
            _keep(Path(file), front, found)
    return {name: found[name] for name in (*names, *ASKED_FOR) if name in found}


def _keep(file: Path, front: Front, found: Mapping[str, Any]) -> None:
    try:
        write_analyses(file, front, found)
    except InvalidInputError as error:  # the report does not need the file
        warnings.warn(f"{error}; analyses are not kept", stacklevel=3)


def kept_kind(front: Front, file: str | Path) -> str:
    """``"full"`` where a file keeps all analyses of a front, else ``"short"``."""
    return "full" if set(analysed(front)) <= set(read_analyses(Path(file), front)) else "short"
