"""What weights of the objectives choose, for the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import numpy as np

from trajevo.base.files import read_text, why_not
from trajevo.cli.console import Terminal
from trajevo.cli.screen.tables import Listing
from trajevo.errors import InvalidInputError, NoSolutionError, UnknownNameError, no_such_file
from trajevo.front.front import Front
from trajevo.front.weighing.stability import WEIGHT_RULES, WeightStability
from trajevo.front.weighing.weights import GivenWeights, comparison_weights, entropy_weights
from trajevo.page.facts import objective_headers

#: Words for weights.
WORDS = ("equal", "entropy", "paper")


def print_weighed(out: Terminal, front: Front, text: str, *, angle: str | None = None) -> None:
    """Print what weights choose by each rule, and how stable that is."""
    if not len(front):
        raise NoSolutionError(f"the front is empty: {front.blocking}")
    weights, how = weights_of(text, front)
    found = [front.stability(weights, rule=rule) for rule in WEIGHT_RULES]
    pairs = zip(front.objective_names, found[0].weights, strict=True)
    out.print(f"weights, {how}: {', '.join(f'{name} {weight:.4g}' for name, weight in pairs)}")
    headers, factors = zip(*objective_headers(front, angle=angle), strict=True)
    table = Listing("rule", "row", *headers, "share of all weights [%]", "other choice")
    for each in found:
        values = [f"{value:.5g}" for value in front.F[each.row] * np.array(factors)]
        table.add(each.rule, str(each.row), *values, each.told, _other(each, front))
    out.print(table)


def _other(found: WeightStability, front: Front) -> str:
    """The nearest weights that choose another row."""
    if found.rule != "weighted":
        return ""
    if found.change is None:
        return "by no weights"
    ends = zip(front.objective_names, found.change.weights, strict=True)
    where = ", ".join(f"{name} {weight:.3g}" for name, weight in ends)
    return f"row {found.change.row} if weights change by {found.change.size:.3g}: {where}"


def weights_of(text: str, front: Front) -> tuple[GivenWeights, str]:
    """Weights as they are given on the command line, and how they were found.

    Args:
        text: one of :data:`WORDS`; ``OBJECTIVE=NUMBER,...``; or a CSV file of comparisons in pairs.
        front: the front.

    Raises:
        InvalidInputError: weights or a file that cannot be used.
        UnknownNameError: another word, or no such objective.
    """
    if text == "equal":
        return [1.0] * len(front.objective_names), "equal"
    if text == "entropy":
        lowest = front.F.min(initial=0.0)  # shares of a sum need values that are not negative
        found = entropy_weights(front.F, normalisation="sum" if lowest >= 0.0 else "range")
        return found.weights, f"by entropy of shares of the {found.normalisation}"
    if text == "paper":
        if front.paper_weights is None:
            raise InvalidInputError("weights: the problem's paper gives none")
        return front.paper_weights, "of the paper"
    if "=" in text:
        return _given(text), "as given"
    if Path(text).suffix.lower() == ".csv":
        compared = comparison_weights(_comparisons(Path(text)), names=front.objective_names)
        how = f"lambda {compared.eigenvalue:.5g}, CI {compared.index:.2g}, CR {compared.ratio:.2g}"
        return compared.weights, f"by comparisons in pairs ({how})"
    known = (*WORDS, ",".join(f"{name}=1" for name in front.objective_names), "a CSV file of comparisons")
    raise UnknownNameError("weights", text, known)


def _given(text: str) -> dict[str, float]:
    """Weights by the names of the objectives."""
    weights: dict[str, float] = {}
    for part in text.split(","):
        name, sign, value = (each.strip() for each in part.partition("="))
        if not sign or name in weights:
            raise InvalidInputError(f"weights: expected OBJECTIVE=NUMBER once for each, got {part.strip()!r}")
        weights[name] = _number(value, f"weights: of {name}")
    return weights


def _comparisons(file: Path) -> Sequence[Sequence[float]]:
    """Rows of numbers or fractions as 1/3."""
    if not file.is_file():
        raise InvalidInputError(f"weights: {no_such_file(file)}")
    try:
        lines = read_text(file).splitlines()
    except (OSError, UnicodeDecodeError) as error:
        why = why_not(error) if isinstance(error, OSError) else "not UTF-8 text"
        raise InvalidInputError(f"weights: {file}: cannot be read: {why}") from error
    rows = [[_number(cell, str(file)) for cell in line.split(",")] for line in lines if line.strip()]
    if len({len(row) for row in rows}) != 1:
        raise InvalidInputError(f"{file}: expected rows of equal length, got {[len(row) for row in rows]}")
    return rows


def _number(text: str, where: str) -> float:
    try:
        return float(Fraction(text.strip()))
    except (ValueError, ZeroDivisionError, OverflowError) as error:
        raise InvalidInputError(f"{where}: expected a number, got {text.strip()!r}") from error
