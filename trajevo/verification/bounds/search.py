"""Branch and bound over the ratios of segment times: cells that may hold better motions than are known are halved."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.verification.bounds.cells import RatioCells, coarse_cells, fine_cells
from trajevo.verification.bounds.curves import Curves, Frame, depth, dominated, undominated
from trajevo.verification.bounds.question import Question

#: Most cells that are halved in one step.
MOST = 2048

#: Slices of durations at which cells are compared with what is known, and steps after which all of them are again.
_SLICES, _AGAIN = 64, 12

#: Share by which the least value of an objective may lie above its bound before cells are halved for it.
END_TOLERANCE = 2e-5

#: Depth below which no cell is worth halving, as a share of the box.
_SHALLOW = 1e-5

#: Width of a cell that is not halved any more, as a logarithm.
_NARROWEST = 1e-7


@final
@dataclass(frozen=True, eq=False)
class SearchState:
    """Where a search stands; the next step depends on nothing else.

    Attributes:
        cells: all cells that may hold motions that are not dominated by known ones.
        depths: how far each may lie below what is known, (N,).
        known: motions that are known, as curves.
        steps: number of steps made.
        made: number of cells bounded so far.
    """

    cells: RatioCells
    depths: Array
    known: Curves
    steps: int
    made: int

    __repr__ = brief


def begun(question: Question, frame: Frame, known: Curves) -> SearchState:
    """The whole range of ratios as one cell, and what is known."""
    widest = np.log(question.durations[1] / question.durations[0])
    n = len(question.positions) - 2
    ends = np.full((1, n), -widest), np.full((1, n), widest)
    cells = coarse_cells(question, *ends)
    return SearchState(cells, np.ones(1), known[undominated(known)], 0, 1)


def stepped(question: Question, frame: Frame, state: SearchState) -> SearchState:
    """One step: the cells that may hide most are halved; the same state if there are none left."""
    chosen = _chosen(frame, state)
    if not len(chosen):
        return state
    kept = np.ones(len(state.cells), dtype=bool)
    kept[chosen] = False
    parents = state.cells[chosen]
    halves = _bounded(question, frame, parents, state.known)
    known = state.known
    if not question.left_out and len(halves):
        constants, least, most, _ = question.at_points(0.5 * (halves.low + halves.high))
        known = known.with_others(Curves(constants, least, most).real())
        known = known[undominated(known)]
    slices = frame.slices(_SLICES, _first(frame, state.cells))
    deep = depth(frame, frame_curves(halves), known, slices)
    cells, depths = state.cells[kept].with_others(halves), np.concatenate([state.depths[kept], deep])
    if (state.steps + 1) % _AGAIN == 0:
        alive = ~dominated(_trimmed(frame, cells), known)
        cells = cells[alive]
        depths = depth(frame, frame_curves(cells), known, slices)
    return SearchState(cells, depths, known, state.steps + 1, state.made + 2 * len(chosen))


def frame_curves(cells: RatioCells) -> Curves:
    """What no motion of a cell is better than, as a curve."""
    return Curves(cells.constants, cells.least, cells.most)


def ends(frame: Frame, state: SearchState) -> tuple[Array, Array]:
    """Least value of every objective: its bound from below, and that of what is known, each (n_obj,)."""
    known = frame.best(state.known).min(axis=0, initial=np.inf)
    below = frame.best(frame_curves(state.cells)).min(axis=0, initial=np.inf)
    return np.minimum(below, known), known


def _bounded(question: Question, frame: Frame, parents: RatioCells, known: Curves) -> RatioCells:
    """The halves of cells that may hold something better than what is known."""
    low, high = parents.halves()
    cells = coarse_cells(question, low, high)
    rows = np.concatenate([np.arange(len(parents))] * 2)
    cells = replace(
        cells,
        constants=np.maximum(cells.constants, parents.constants[rows]),
        least=np.maximum(cells.least, parents.least[rows]),
        most=np.minimum(cells.most, parents.most[rows]),
    )
    cells = cells[_open(frame, cells, known)]
    cells = fine_cells(question, cells)
    return cells[_open(frame, cells, known)]


def _open(frame: Frame, cells: RatioCells, known: Curves) -> Array:
    """Which cells have motions in the box that no known one dominates."""
    trimmed = _trimmed(frame, cells)
    return (trimmed.least <= trimmed.most) & ~dominated(trimmed, known)


def _trimmed(frame: Frame, cells: RatioCells) -> Curves:
    """The part of each cell's curve that lies in the box; its least duration is above the greatest if none does."""
    return frame.clipped(frame_curves(cells))


def _first(frame: Frame, cells: RatioCells) -> float:
    return float(cells.least.min(initial=np.inf)) if frame.time_at is not None else 0.0


def _chosen(frame: Frame, state: SearchState) -> Array:
    """The cells to halve: those at an end of the front first, then the deepest."""
    cells = state.cells
    width = (cells.high - cells.low).max(axis=1, initial=0.0)
    best, known = frame.best(frame_curves(cells)), ends(frame, state)[1]
    at_end = np.zeros(len(cells), dtype=bool)
    for k in range(best.shape[1]):
        if np.isfinite(known[k]) and known[k] <= frame.corner[k]:
            missing = np.flatnonzero(best[:, k] < known[k] * (1.0 - END_TOLERANCE))
            at_end[missing[np.argsort(best[missing, k], kind="stable")[: MOST // 8]]] = True
    threshold = max(_SHALLOW, 0.5 * float(state.depths.max(initial=0.0)))
    deep = np.flatnonzero((state.depths >= threshold) & ~at_end)
    deep = deep[np.argsort(-state.depths[deep], kind="stable")[:MOST]]
    chosen = np.concatenate([np.flatnonzero(at_end), deep])
    return np.asarray(chosen[width[chosen] > _NARROWEST])
