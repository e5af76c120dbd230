"""The least time of a motion along a fixed path: linear programs in the control points of u(t) and ln T, one by one.

Near a motion its limits are linear in the control points, but for terms of second order. So a program is solved whose
solution may move every control point by no more than a reach; the reach grows where the limits are foreseen well. For
a shape the least time has a closed form, by which steps are judged. Between the instants the limits may be exceeded a
little: there, instants are added, and the programs go on.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.solvers.along_path.instants import HELD, Instants
from trajevo.solvers.along_path.kinematics import PathLimits
from trajevo.solvers.along_path.program import Linearised, Program

#: Least number of instants in a piece of u(t), and in a piece of the path on average, at which limits are kept; and how
#: many times more they are where limits are looked at to add instants.
PER_SPAN, _FINER = 3, 5

#: Least number of instants.
FEWEST = 200

#: Greatest move of a control point in the first program, and the least reach with which programs go on.
_REACH, _LEAST_REACH = 0.02, 1e-7

#: Programs solved at most for the first instants and after some were added; and the gain in ln T below which there is
#: no need for more, if foreseen for one program, or made by so many in a row.
_PROGRAMS, _MORE, _GAIN, _STALLED = 30, 8, 3e-5, 4

#: Gain in ln T below which the next program leaves out limits of which less than a share is used anywhere.
_SMALL, _FAR = 0.05, 0.4

#: Shares of a move that are tried, if it does not make the motion faster as a whole.
_SHARES = (1.0, 0.6, 0.35, 0.2, 0.1)

#: How often instants are added at most, and the excess over a limit that is left between them.
_ADDITIONS, _LEFT = 4, 3e-5


@final
@dataclass(frozen=True, eq=False)
class TimedShape:
    """A motion along a path as the programs see it.

    Attributes:
        control_points: of u(t), shape (count,).
        order: order of u(t).
        time: least time in which it keeps the limits at the instants [s]; inf if there is none.
        programs: number of linear programs that were solved for it.
    """

    control_points: Array
    order: int
    time: float
    programs: int = 0


def fastest(start: Array, order: int, limits: Sequence[PathLimits], pieces: int) -> TimedShape:
    """The shape of u(t) with the least time, from another one; arguments as for :func:`nearing`."""
    *_, found = nearing(start, order, limits, pieces)
    return found


def nearing(start: Array, order: int, limits: Sequence[PathLimits], pieces: int) -> Iterator[TimedShape]:
    """Shapes of u(t) on the way to the least time: the first one, then one for every set of instants.

    Args:
        start: control points, shape (count,), at rest at both ends.
        order: order of u(t).
        limits: what is kept.
        pieces: number of polynomial pieces of the path.
    """
    instants, fine = (even_instants(len(start), order, pieces, finer) for finer in (1, _FINER))
    found = TimedShape(frozen(start.copy()), order, least_time(limits, instants.states(start)))
    yield found
    found = _settled(found, instants, limits, _PROGRAMS)
    yield found
    for _ in range(_ADDITIONS):
        if not np.isfinite(found.time):
            break
        chosen = _broken(limits, fine.states(found.control_points), found.time)
        if not len(chosen):
            break
        instants = instants.with_more(fine, chosen)
        time = least_time(limits, instants.states(found.control_points))
        again = _settled(TimedShape(found.control_points, order, time), instants, limits, _MORE)
        found = TimedShape(again.control_points, order, again.time, found.programs + again.programs)
        yield found


def even_instants(count: int, order: int, pieces: int, finer: int = 1) -> Instants:
    """Instants for as many control points and pieces of the path, and so many times more."""
    spans = count - order + 1
    return Instants.even(count, order, finer * max(PER_SPAN, math.ceil(max(PER_SPAN * pieces, FEWEST) / spans)))


def least_time(limits: Sequence[PathLimits], states: Array) -> float:
    """Least time in which all limits are kept at instants [s]; inf if there is none."""
    time = 0.0
    for each in limits:
        time = each.least_time(states, time)
    return time


def moved(control_points: Array, move: Array) -> Array:
    """Control points after a move, increasing in spite of rounding."""
    found: Array = np.clip(np.maximum.accumulate(control_points + move), 0.0, 1.0)
    found[-HELD:] = 1.0
    return found


def _settled(shape: TimedShape, instants: Instants, limits: Sequence[PathLimits], most: int) -> TimedShape:
    """The end of a sequence of at most so many programs with limits at given instants."""
    reach, solved, times, least = _REACH, 0, [shape.time], -np.inf
    while solved < most and reach > _LEAST_REACH and np.isfinite(shape.time):
        near = Linearised.joined(
            [each.linearised(instants.states(shape.control_points), shape.time) for each in limits]
        )
        move, gain = Program(instants, near.nearer(least), np.diff(shape.control_points), reach).solve()
        solved += 1
        found, share = _along(shape, move, instants, limits)
        met = (shape.time - found.time) / max(-gain * shape.time, 1e-300)
        if met < 0.25:
            reach = share * min(reach, float(np.abs(move).max()))
        elif met > 0.75:
            reach *= 2.0
        # A program that moves little is solved without the limits that are far; if that was wrong, with all again.
        least = _FAR if -gain < _SMALL and met > 0.25 else -np.inf
        shape = found
        times.append(shape.time)
        if -gain < _GAIN or (len(times) > _STALLED and times[-1 - _STALLED] - shape.time < _GAIN * shape.time):
            break
    return TimedShape(shape.control_points, shape.order, shape.time, solved)


def _along(
    shape: TimedShape, move: Array, instants: Instants, limits: Sequence[PathLimits]
) -> tuple[TimedShape, float]:
    """The fastest shape of those at shares of a move, and the least share that was tried; the same one if none is."""
    best = shape
    for share in _SHARES:
        trial = moved(shape.control_points, share * move)
        time = least_time(limits, instants.states(trial))
        if time < best.time:
            best = TimedShape(frozen(trial), shape.order, time)
        elif best is not shape:
            break
        if share == 1.0 and time < shape.time:
            break
    return best, share


def _broken(limits: Sequence[PathLimits], states: Array, time: float) -> Array:
    """Instants where the excess over a limit is greatest among neighbours and matters."""
    excess = np.stack([each.excess(states, time) for each in limits]).max(axis=0)
    beside = np.concatenate([[-np.inf], excess, [-np.inf]])
    peaks = (excess >= beside[:-2]) & (excess >= beside[2:]) & (excess > _LEFT)
    return np.flatnonzero(peaks)
