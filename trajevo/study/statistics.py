"""Whether the levels of a factor differ: Wilcoxon's signed-rank test of every pair, Holm's correction, effect size."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from trajevo.base.arrays import Array, numbers
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError, checked_name
from trajevo.study.results import StudyResults


@dataclass(frozen=True)
class Comparison:
    """Two levels of a factor over matched cells.

    Attributes:
        factor: the factor.
        first: one level.
        second: the other.
        pairs: number of pairs of matched cells, including those without a difference.
        difference: median of first minus second over the pairs [SI unit of what is compared].
        effect: matched-pairs rank-biserial correlation, from -1 (first always below second) to 1 (always above).
        p: probability of a difference at least this great if neither level were better, two-sided.
        p_holm: the same, corrected for the number of pairs of levels of the factor.
    """

    factor: str
    first: Any
    second: Any
    pairs: int
    difference: float
    effect: float
    p: float
    p_holm: float

    __repr__ = brief


def compare_levels(results: StudyResults, factor: str, *, measure: str = "hypervolume") -> tuple[Comparison, ...]:
    """Compare every pair of levels of a factor over cells that are matched in all other factors and the repeat.

    Cells are matched because other factors affect the measure too: a heavy payload makes every front worse, whatever
    the interpolant, and this spread would hide the difference of interest. Within a pair only the factor differs. The
    test uses signed ranks because differences of hypervolumes are not normally distributed. With fewer than six pairs p
    cannot fall below 0.05.

    Args:
        results: results of :func:`trajevo.study.collection.collect`.
        factor: the factor.
        measure: a numeric column of the table.

    Returns:
        The comparisons, in the order of the levels.

    Raises:
        UnknownNameError: no such factor or measure.
        InvalidInputError: no cells that match.
    """
    checked_name("factor", factor, results.record.factors)
    table = results.table()
    columns = [name for name in table.columns if name not in (*results.record.factors, "cell", "repeat", "seed")]
    checked_name("measure", measure, columns)
    others = [name for name in results.record.factors if name != factor]
    wide = table.pivot(index=[*others, "repeat"], columns=factor, values=measure)
    found = []
    for first, second in combinations(results.levels(factor), 2):
        both = wide.reindex(columns=[first, second]).dropna().to_numpy(dtype=np.float64)
        if not len(both):
            raise InvalidInputError(f"{factor}: no finished cells match in all but {first} and {second}")
        effect, p = signed_rank(both[:, 0], both[:, 1])
        found.append((first, second, len(both), float(np.median(both[:, 0] - both[:, 1])), effect, p))
    corrected = holm([row[-1] for row in found])
    return tuple(Comparison(factor, *row, p_holm=float(q)) for row, q in zip(found, corrected, strict=True))


def signed_rank(first: Array, second: Array) -> tuple[float, float]:
    """Matched-pairs rank-biserial correlation and p value of Wilcoxon's signed-rank test, two-sided.

    Pairs without a difference are left out; if no pair differs, the effect is 0 and p is 1.

    Args:
        first: values, shape (N,).
        second: values matched with them, shape (N,).

    Raises:
        InvalidInputError: another shape, or values that are not finite.
    """
    # Imported here, since it would delay the start of every command by a quarter of a second.
    from scipy.stats import rankdata, wilcoxon

    x = numbers(first, name="first", shape=("N",))
    d = x - numbers(second, name="second", shape=(len(x),))
    d = d[d != 0.0]
    if not len(d):
        return 0.0, 1.0
    ranks = rankdata(np.abs(d))
    effect = float((ranks[d > 0.0].sum() - ranks[d < 0.0].sum()) / ranks.sum())
    return effect, float(wilcoxon(d).pvalue)


def holm(p: Sequence[float]) -> Array:
    """P values of several tests, corrected by Holm's step-down method, which bounds the chance of any false positive.

    Args:
        p: p values, shape (N,).
    """
    values = numbers(p, name="p", shape=("N",))
    order = np.argsort(values)
    stepped = np.maximum.accumulate(values[order] * np.arange(len(values), 0, -1))
    corrected = np.empty(len(values))
    corrected[order] = np.minimum(stepped, 1.0)
    return corrected
