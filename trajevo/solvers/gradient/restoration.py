"""Feasibility restored by gradients, where an evolution has found nothing: from its nearest miss down the excess."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from trajevo.base.arrays import Array, one_blas_thread
from trajevo.errors import TrajevoError
from trajevo.front.archive import Archive
from trajevo.front.front import Front
from trajevo.solvers.gradient.batch_sqp import Lockstep
from trajevo.solvers.gradient.scaling import Columns, Scaled

#: Starts around the nearest miss, their spread on the scales of the variables, and greatest number of steps.
_STARTS, _SPREAD, _STEPS = 8, 0.1, 60

#: Margin by which limits are tightened; restarts of every start; decrease that ends it.
_MARGIN, _RESTARTS, _SETTLED = 1e-6, 3, 1e-9


def restored(front: Front) -> Front:
    """A front with what gradients have found feasible near the nearest miss; the front itself if that is nothing.

    Nothing but the greatest excess over a limit is minimised, by bold steps from the nearest miss and shaken copies.

    Args:
        front: an empty front.
    """
    problem = front.problem
    if len(front) or front.blocking is None or not front.blocking.violations or problem.smooth is not None:
        return front
    nothing = Columns(np.zeros((1, problem.n_obj)), np.full(1, False), np.zeros(1), np.ones(1))
    scaled = Scaled(problem.in_terms(), nothing, _MARGIN)
    y = scaled.inside(np.array(front.blocking.x)[None])
    shaken = _SPREAD * np.random.default_rng(front.run.seed).standard_normal((_STARTS - 1, problem.n_var))
    try:
        with one_blas_thread():
            X, F, G = _ends(front, scaled, np.concatenate([y, y + shaken]))
    except TrajevoError:  # no gradients there
        return front
    archive = Archive(problem.n_var, problem.n_obj, problem.n_ieq_constr)
    archive.add(X, F, G)
    cost = scaled.evaluations + scaled.gradients * int(problem.n_var) + _STARTS
    return front if not len(archive.F) else _with(front, archive, cost)


def _ends(front: Front, scaled: Scaled, y: Array) -> tuple[Array, Array, Array]:
    """The ends of starts in scaled variables (S, n_var) as decision vectors, with objectives and limits."""
    run = Lockstep(
        scaled,
        np.clip(y, *scaled.bounds),
        reference=np.zeros((len(y), 1)),
        augmentation=np.zeros((len(y), 1)),
        restarts=_RESTARTS,
        bold=True,
    )
    run.run(np.full(len(y), _STEPS), np.full(len(y), _SETTLED), lambda: False)
    X = scaled.outside(run.y)
    F, G = front.problem.evaluate(X, return_values_of=["F", "G"])
    finite = np.isfinite(F).all(axis=1)
    return X[finite], F[finite], G[finite]


def _with(front: Front, archive: Archive, cost: int) -> Front:
    """The archive as a front; its cost counts as that of the last generation."""
    run, history = front.run, front.history
    counted = (*history.evaluations[:-1], history.evaluations[-1] + cost)
    return replace(
        front,
        X=archive.X,
        F=archive.F,
        G=archive.G,
        blocking=None,
        run=run.model_copy(
            update={
                "evaluations": run.evaluations + cost,
                "settings": run.settings | {"restored": {"members": len(archive.F), "evaluations": cost}},
            }
        ),
        history=history.model_copy(update={"evaluations": counted}),
    )
