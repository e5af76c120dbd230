"""The largest payload of one motion over its speed, the shape of the load, and the share of time in motion.

Every combination is a cell that is computed alone, so that cells can be spread over processes or a cluster.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, Protocol, TypeVar, final

import numpy as np

from trajevo.base.arrays import Array, frozen, numbers
from trajevo.base.shown import html
from trajevo.base.shown.brief import brief
from trajevo.capacity.accuracy.found import CAUSES, FullCapacity
from trajevo.capacity.accuracy.full_capacity import deviation_of, full_capacity
from trajevo.capacity.accuracy.paces import check_paces
from trajevo.capacity.dlcc import sampled_motion
from trajevo.capacity.drives.drive_capacity import DENSE
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError, checked_name
from trajevo.front.front import Solution
from trajevo.robot.payload import Payload
from trajevo.solvers.gradient.weighted_sum import WeightedOptimum

Item = TypeVar("Item")
Result = TypeVar("Result")

#: Name of the load that the motion carries, if no loads are given.
AS_IT_IS = "as it is"

#: Greatest number of rows that a notebook shows, and of cells that are computed.
_ROWS, _MOST_CELLS = 40, 100_000


class _Engine(Protocol):
    """What computes many things: an engine of studies, such as ``Processes(2)`` or ``DaskCluster(2)``."""

    def map(self, function: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
        """The function of every item, in the order of the items."""


@final
@dataclass(frozen=True, eq=False)
class CapacityStudy:
    """What one motion carries at S speeds, with L loads and D duties.

    Attributes:
        speeds: shares of the motion's speed, ascending, shape (S,) [1].
        loads: names of the loads, whose shapes are known and whose masses are found.
        duties: shares of a cycle in which the arm moves, ascending, shape (D,) [1].
        durations: of the motion at every speed, shape (S,) [s].
        found: the capacities under all limits, one for each cell, speeds first and duties last.
    """

    speeds: Array
    loads: tuple[str, ...]
    duties: Array
    durations: Array
    found: tuple[FullCapacity, ...]

    __repr__ = brief

    @property
    def shape(self) -> tuple[int, int, int]:
        """Numbers of speeds, loads and duties."""
        return len(self.speeds), len(self.loads), len(self.duties)

    @property
    def cycle_times(self) -> Array:
        """Durations with the time at rest, shape (S, D) [s]."""
        return frozen(self.durations[:, None] / self.duties)

    @property
    def mass(self) -> Array:
        """The largest payload, shape (S, L, D) [kg]; 0 where none is feasible, inf where nothing limits it."""
        return frozen(np.array([each.mass for each in self.found]).reshape(self.shape))

    @property
    def cause(self) -> Array:
        """What binds, keys of :data:`CAUSES` or empty, shape (S, L, D), no unit."""
        return frozen(np.array([each.cause for each in self.found], dtype=object).reshape(self.shape))

    @property
    def per_hour(self) -> Array:
        """The mass that is moved in an hour by the largest payloads, shape (S, L, D) [kg/h]."""
        return frozen(self.mass * 3600.0 / self.cycle_times[:, None, :])

    def by(self, cause: str) -> Array:
        """The largest payload that one cause alone allows, shape (S, L, D) [kg]; inf where it is not known.

        Raises:
            UnknownNameError: no key of :data:`CAUSES`.
        """
        checked_name("cause", cause, CAUSES)
        return frozen(np.array([max(each.by(cause), 0.0) for each in self.found]).reshape(self.shape))

    def at(self, speed: int, load: int, duty: int) -> FullCapacity:
        """The capacity of one cell, by its numbers along the three axes."""
        return self.found[int(np.ravel_multi_index((speed, load, duty), self.shape))]

    def __str__(self) -> str:
        binding = sorted({each.cause for each in self.found if each.cause}, key=list(CAUSES).index)
        told = ", ".join(f"{CAUSES[cause]} in {sum(each.cause == cause for each in self.found)}" for cause in binding)
        finite = self.mass[np.isfinite(self.mass)]
        range_ = f"{finite.min():.4g} to {finite.max():.4g} kg" if len(finite) else "unlimited"
        counts = "{} speeds x {} loads x {} duties".format(*self.shape)
        return f"{counts}: {range_}; what binds: {told or 'nothing'}; not proven between instants"

    def _repr_html_(self) -> str:
        cells = list(product(range(self.shape[0]), range(self.shape[1]), range(self.shape[2])))
        few = np.unique(np.linspace(0, len(cells) - 1, min(len(cells), _ROWS)).round().astype(int)).tolist()
        rows = []
        for s, load, d in (cells[k] for k in few):
            one = self.at(s, load, d)
            time = f"{self.cycle_times[s, d]:.4g}"
            cell = (f"{self.speeds[s]:.4g}", self.loads[load], f"{self.duties[d]:.4g}", time)
            rows.append((*cell, f"{one.mass:.5g}", CAUSES.get(one.cause, ""), one.place))
        head = ("speed", "load", "duty", "cycle time [s]", "largest payload [kg]", "limited by", "at")
        told = html.sentence(f"{self}; {len(few)} of {len(cells)} cells")
        return html.shown("Payload by speed, load and duty", told, html.table(head, rows))


def capacity_study(
    motion: Solution | Rollout | WeightedOptimum,
    *,
    speeds: Sequence[float],
    loads: Mapping[str, Payload] | None = None,
    duties: Sequence[float] = (1.0,),
    deviation: float | None = None,
    counted: str = "all",
    cycles: int | None = None,
    samples: int = DENSE,
    engine: _Engine | None = None,
) -> CapacityStudy:
    """The largest payload of a motion under all limits, over its speed, the shape of the load, and the duty.

    Args:
        motion: as for :func:`full_capacity`.
        speeds: shares of the motion's speed along the same path, positive; 1 is as it is [1].
        loads: loads by name, of which the centre of mass, the inertia and the model count, and not the mass; that of
            the motion if None.
        duties: shares of a cycle in which the arm moves, above 0 up to 1; it rests after each motion for the rest [1].
        deviation: as for :func:`full_capacity`.
        counted: as for :func:`full_capacity`.
        cycles: as for :func:`full_capacity`.
        samples: as for :func:`full_capacity`.
        engine: what computes the cells, such as ``DaskCluster(2)``; this process, one after the other, if None. The
            results are the same.

    Raises:
        InvalidInputError: a speed or a duty that is out of its range, no loads, something that is no payload, too many
            cells, no engine, or as for :func:`full_capacity`.
    """
    by_speed = _ascending(speeds, "speeds", "positive numbers", np.inf)
    check_paces(by_speed, "speeds")
    by_duty = _ascending(duties, "duties", "shares above 0 up to 1", 1.0)
    rollout = sampled_motion(motion, samples)
    most, counted = deviation_of(motion, deviation, counted)
    shapes = _shapes(loads, rollout)
    if engine is not None and not callable(getattr(engine, "map", None)):
        raise InvalidInputError(f"engine: expected an engine such as Processes(2) or DaskCluster(2), got {engine!r}")
    count = len(by_speed) * len(shapes) * len(by_duty)
    if count > _MOST_CELLS:
        raise InvalidInputError(f"speeds, loads, duties: expected at most {_MOST_CELLS} cells, got {count}")
    duration = float(rollout.trajectory.duration[0])
    given: dict[str, Any] = {"deviation": most, "counted": counted, "cycles": cycles, "samples": samples}
    cells = []
    for speed, dynamics, duty in product(by_speed.tolist(), shapes.values(), by_duty.tolist()):
        paced = replace(rollout, dynamics=dynamics, trajectory=rollout.trajectory.slowed(1.0 / speed))
        cells.append(_Cell(paced, given | {"dwell": duration / speed * (1.0 / duty - 1.0)}))
    mapped = map(_capacity, cells) if engine is None else engine.map(_capacity, cells)
    return CapacityStudy(by_speed, tuple(shapes), by_duty, frozen(duration / by_speed), tuple(mapped))


@final
@dataclass(frozen=True, eq=False)
class _Cell:
    motion: Rollout
    given: Mapping[str, Any]


def _capacity(cell: _Cell) -> FullCapacity:
    return full_capacity(cell.motion, **cell.given)


def _ascending(given: Sequence[float], name: str, expected: str, most: float) -> Array:
    found = np.unique(numbers(given, name=name, shape=("values",)))
    if not len(found) or not ((found > 0.0) & (found <= most)).all():
        raise InvalidInputError(f"{name}: expected {expected}, at least one, got {list(given)}")
    return frozen(found)


def _shapes(loads: Mapping[str, Payload] | None, rollout: Rollout) -> dict[str, Dynamics]:
    """The dynamics with each load, by its name."""
    if loads is None:
        return {AS_IT_IS: rollout.dynamics}
    if not isinstance(loads, Mapping) or not loads:
        raise InvalidInputError(f"loads: expected a mapping from names to payloads, at least one, got {loads!r}")
    if rollout.dynamics.schedule is not None:
        raise InvalidInputError("loads: expected none, as loads change along the motion")
    for name, load in loads.items():
        if not isinstance(load, Payload):
            raise InvalidInputError(f"loads: {name!r}: expected a trajevo.Payload, got {type(load).__name__}")
    return {str(name): replace(rollout.dynamics, payload=load) for name, load in loads.items()}
