"""Solve again for one trade-off: the least weighted sum of the objectives, from members of a front that are near."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import moocore
import numpy as np

from trajevo.base.arrays import Array
from trajevo.formulation.problem import Weights
from trajevo.front.covering import ReferenceBox
from trajevo.front.front import Front
from trajevo.front.selection import normalised
from trajevo.solvers.gradient.polish import check_polishable
from trajevo.solvers.gradient.weighted_sum import WeightedOptimum, minimise_weighted

#: Number of members from which the sum is minimised, those with the least.
_STARTS = 4


def solve_weighted(front: Front, weights: Sequence[float]) -> tuple[Front, WeightedOptimum]:
    """Minimise a weighted sum of the objectives from the members of a front that have least of it.

    Args:
        front: a front that is not empty, of a problem with gradients.
        weights: one non-negative number for each objective, not all zero; they weigh objectives that run from 0 at the
            least to 1 at the greatest value on the front, as :meth:`Front.weighted` does.

    Returns:
        The front with the optimum, if nothing dominates it and it keeps all limits, without what it dominates; and the
        optimum.

    Raises:
        InvalidInputError: weights that cannot be used, or a problem without gradients.
        NoSolutionError: the front is empty.
    """
    front.weighted(weights)  # which refuses weights that cannot be used, and an empty front
    check_polishable(front.problem)
    share = np.array(weights, dtype=np.float64)
    sums = normalised(front.F) @ (share / share.sum())
    nearest = np.argsort(sums, kind="stable")[:_STARTS]
    span = np.ptp(front.F, axis=0)
    scaled = Weights(tuple(share.tolist()), tuple(np.where(span > 0.0, span, 1.0).tolist()))
    began = time.process_time()
    found = minimise_weighted(front.problem, scaled, seed=front.run.seed, initial=front.X[nearest])
    if not np.isfinite(found.cost):
        return front, found
    return _with(front, found, weights, time.process_time() - began), found


def _with(front: Front, found: WeightedOptimum, weights: Sequence[float], spent: float) -> Front:
    """The front with an optimum, if nothing dominates it; the run's record tells what was done."""
    F = np.vstack([front.F, [found.F[name] for name in front.objective_names]])
    if not _stays(F):
        return front
    kept = moocore.is_nondominated(F)
    X, G = np.vstack([front.X, found.x]), np.vstack([front.G, [found.G[name] for name in front.record.constraints]])
    run, history = front.run, front.history
    corner = history.reference_point
    volume = 0.0 if corner is None else ReferenceBox.of(front.F, np.array(corner)).hypervolume(F[kept])
    before: Any = run.settings.get("weighed", ())
    cpu = run.cpu_seconds[-1] if run.cpu_seconds else 0.0
    return replace(
        front,
        X=X[kept],
        F=F[kept],
        G=G[kept],
        run=run.model_copy(
            update={
                "settings": run.settings | {"weighed": [*before, [float(weight) for weight in weights]]},
                "seconds": run.seconds + found.seconds,
                "cpu_seconds": (*run.cpu_seconds, cpu + spent),
            }
        ),
        history=history.model_copy(
            update={
                "evaluations": (*history.evaluations, history.evaluations[-1]),
                "hypervolume": history.hypervolume.followed_by(volume),
                "least_violation": (*history.least_violation, 0.0),
                "front_size": (*history.front_size, int(kept.sum())),
            }
        ),
    )


def _stays(F: Array) -> bool:
    """Whether no other row covers the last one."""
    return not bool((F[:-1] <= F[-1]).all(axis=1).any())
