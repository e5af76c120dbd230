"""What came out where robots were compared: one front over all of them, and what is known of each."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, final

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.base.shown import html
from trajevo.base.shown.brief import brief, cut
from trajevo.base.units import display, pretty
from trajevo.errors import InvalidInputError, NoSolutionError, checked_name
from trajevo.front import selection
from trajevo.front.front import Front, Solution
from trajevo.front.records import ObjectiveRecord
from trajevo.front.selection import rows_of
from trajevo.study.robots.ability import Miss
from trajevo.study.robots.asked import OF_ROBOTS
from trajevo.study.robots.catalogue import Candidate
from trajevo.study.robots.largest import RobotPayload

if TYPE_CHECKING:
    import pandas as pd

#: What is said of a robot: it has motions of the common front, all its motions are beaten, no motion can do the task,
#: none was found, or its run failed or has not ended.
State = Literal["best", "beaten", "impossible", "nothing found", "failed", "not finished"]

#: The states in words of a table.
TOLD: dict[State, str] = {
    "best": "can do it",
    "beaten": "never the best",
    "impossible": "cannot do it",
    "nothing found": "nothing found",
    "failed": "its run failed",
    "not finished": "not finished",
}


@final
@dataclass(frozen=True, eq=False)
class ComparedRobot:
    """What is known of one of the robots.

    Attributes:
        candidate: the robot, with what the catalogue tells of it.
        state: one of :data:`TOLD`.
        stopped_by: what stops it in a word or two, such as ``"reach"``, ``"effort"`` or the name of the limit that the
            nearest miss of its search exceeds most; empty if nothing does.
        reason: the same in a sentence; of a robot that is beaten, by which ones.
        misses: the points that it does not reach, if reach stops it.
        front: its own front; None without a finished run.
        F: all objectives of its own front, those of the robot among them, shape (N, n_obj) [units of the objectives].
        best: mask of its motions that no motion of any robot beats, shape (N,).
        beaten_by: of a robot that is never the best, the robots whose motions beat all of its own.
        carried: its largest payload; None if that was not asked for or not computed.
        seed: seed of its run.
        cell: name of its run's folder among the cells of the study; empty without a run.
    """

    candidate: Candidate
    state: State
    stopped_by: str
    reason: str
    misses: tuple[Miss, ...]
    front: Front | None
    F: Array
    best: Array
    beaten_by: tuple[str, ...]
    carried: RobotPayload | None
    seed: int
    cell: str

    __repr__ = brief

    @property
    def name(self) -> str:
        """What it is called."""
        return self.candidate.name


@final
@dataclass(frozen=True, eq=False)
class Member:
    """One motion of the common front.

    Attributes:
        robot: name of the robot that makes it.
        solution: the motion, of the robot's own front.
        F: objective -> value, those of the robot among them [units of the objectives].
        rule: name of the rule that chose it.
    """

    robot: str
    solution: Solution
    F: dict[str, float]
    rule: str

    __repr__ = brief


@final
@dataclass(frozen=True, eq=False)
class RobotChoice:
    """Several robots at one task: their common front, and who is never the best or cannot do it.

    Attributes:
        title: what the task is called.
        objectives: names and units of the columns of ``F``; those that only robots have last named by the catalogue.
        robots: what is known of each robot, in the order in which they were given.
        within: the longest time of the motions of largest payload [s]; None for what the task allows.
        notes: what else has to be said of the comparison, one sentence each.
        folder: folder of the study; None if it was not kept.
        stopped_by: name of the signal that ended the runs, or empty.
    """

    title: str
    objectives: tuple[ObjectiveRecord, ...]
    robots: tuple[ComparedRobot, ...]
    within: float | None
    notes: tuple[str, ...]
    folder: Path | None
    stopped_by: str = ""

    def __repr__(self) -> str:
        return cut(str(self))

    def __str__(self) -> str:
        names = ", ".join(f"{one.name} {int(one.best.sum())}" for one in self.of("best"))
        return f"RobotChoice({self.title}, {len(self)} motions of {len(self.robots)} robots: {names or 'none'})"

    def __len__(self) -> int:
        return sum(int(one.best.sum()) for one in self.robots)

    def __getitem__(self, row: int) -> Member:
        """One motion of the common front, in the order of :attr:`F`.

        Raises:
            NoSuchRowError: no such row.
            InvalidInputError: no row.
        """
        found = rows_of(row, len(self))
        if not isinstance(found, int):
            raise InvalidInputError(f"choice: expected one row, got {row!r}")
        return self._member(found, "row")

    def __iter__(self) -> Iterator[Member]:
        return (self[row] for row in range(len(self)))

    @property
    def F(self) -> Array:
        """Objectives of the common front, sorted by the first, shape (N, n_obj) [units of the objectives]."""
        return frozen(self._stacked[2])

    @property
    def robot(self) -> tuple[str, ...]:
        """Name of the robot of each motion of the common front, N texts."""
        return tuple(self.robots[k].name for k in self._stacked[0].tolist())

    @property
    def rows_of_fronts(self) -> tuple[int, ...]:
        """Row of each motion of the common front in the front of its robot, N whole numbers."""
        return tuple(self._stacked[1].tolist())

    @property
    def objective_names(self) -> tuple[str, ...]:
        """Names of the columns of F."""
        return tuple(one.name for one in self.objectives)

    def of(self, state: State) -> tuple[ComparedRobot, ...]:
        """The robots of a state, one of :data:`TOLD`."""
        checked_name("state", state, TOLD)
        return tuple(one for one in self.robots if one.state == state)

    def knee(self) -> Member:
        """The motion of the common front that bulges furthest towards the ideal.

        Raises:
            NoSolutionError: no robot can do the task.
        """
        return self._chosen("knee")

    def least(self, objective: str) -> Member:
        """The motion of the common front with the least value of an objective.

        Raises:
            UnknownNameError: no such objective.
            NoSolutionError: no robot can do the task.
        """
        checked_name("objective", objective, self.objective_names)
        return self._chosen(objective)

    def _chosen(self, rule: str) -> Member:
        F = self.F
        if not len(F):
            raise NoSolutionError(f"no robot can do the task: {'; '.join(self.sentences)}")
        if rule == "knee":
            return self._member(selection.knee(F).index, "knee")
        column = self.objective_names.index(rule)
        return self._member(selection.least(F, column, rule).index, f"least_{rule}")

    def _member(self, row: int, rule: str) -> Member:
        robots, rows, F = self._stacked
        one = self.robots[int(robots[row])]
        if one.front is None:  # which has no motions in the common front
            raise InvalidInputError(f"choice: {one.name} has no front")
        values = dict(zip(self.objective_names, F[row].tolist(), strict=True))
        return Member(one.name, one.front[int(rows[row])], values, rule)

    @cached_property
    def _stacked(self) -> tuple[Array, Array, Array]:
        """Number of the robot, row of its front (N,) and objectives (N, n_obj) of the common front, in its order."""
        numbers = np.concatenate([np.full(int(one.best.sum()), k) for k, one in enumerate(self.robots)]).astype(int)
        rows = np.concatenate([np.flatnonzero(one.best) for one in self.robots]).astype(int)
        F = np.concatenate([one.F[one.best] for one in self.robots])
        order = np.lexsort((rows, numbers, *F.T[::-1]))
        return numbers[order], rows[order], F[order]

    @property
    def sentences(self) -> tuple[str, ...]:
        """What is to be said of each robot that is never the best or cannot do the task, then the notes."""
        return (*(_sentence(one) for one in self.robots if one.state != "best"), *self.notes)

    def shown(self, column: int) -> tuple[str, str, float]:
        """Name of an objective, the unit in which it is shown, and the factor from its own unit."""
        one = self.objectives[column]
        if one.name in OF_ROBOTS:
            return one.name, one.unit, 1.0
        record = next((each.front.record for each in self.robots if each.front is not None), None)
        angle, length = ("rad", "m") if record is None else (record.angle, record.length)
        return one.name, *display(one.unit, angle=angle, length=length)

    @property
    def columns(self) -> tuple[str, ...]:
        """Headers of :attr:`rows`."""
        return self._table[0]

    @property
    def rows(self) -> tuple[tuple[str, ...], ...]:
        """A row of texts for each robot, under :attr:`columns`; empty where nothing is known."""
        return self._table[1:]

    @cached_property
    def _table(self) -> tuple[tuple[str, ...], ...]:
        """Headers and rows, without columns in which nothing is known of any robot."""
        of_motions = [k for k, name in enumerate(self.objective_names) if name not in OF_ROBOTS]
        least = (f"least {name} [{pretty(unit)}]" for name, unit, _ in map(self.shown, of_motions))
        within = "" if self.within is None else f" within {self.within:g} s"
        bought = ("price", "mass [kg]", "reach [m]")
        head = ("robot", "at this task", "in the front", *least, f"largest payload{within} [kg]", *bought, "stopped by")
        rows = [head, *(tuple(self._row(one, of_motions)) for one in self.robots)]
        told = [k for k in range(len(head)) if any(row[k] for row in rows[1:])]
        return tuple(tuple(row[k] for k in told) for row in rows)

    def _row(self, one: ComparedRobot, of_motions: Sequence[int]) -> Iterator[str]:
        yield one.name
        yield TOLD[one.state]
        yield f"{int(one.best.sum())} of {len(one.F)}" if len(one.F) else ""
        for column in of_motions:
            yield f"{one.F[:, column].min() * self.shown(column)[2]:.5g}" if len(one.F) else ""
        yield "" if one.carried is None else str(one.carried)
        yield "" if one.candidate.price is None else f"{one.candidate.price:g} {one.candidate.currency}".strip()
        yield "" if one.candidate.mass is None else f"{one.candidate.mass:g}"
        yield "" if one.candidate.reach is None else f"{one.candidate.reach:g}"
        yield one.stopped_by

    def to_dataframe(self) -> pd.DataFrame:
        """One row per robot, numbers in SI units and prices in their currency; NaN where nothing is known."""
        import pandas as pd

        return pd.DataFrame(list(map(self.facts, self.robots)))

    def facts(self, one: ComparedRobot) -> dict[str, Any]:
        """What is known of a robot as plain data, with units in its keys.

        Args:
            one: one of :attr:`robots`.
        """
        found: dict[str, Any] = {"robot": one.name, "state": one.state, "stopped_by": one.stopped_by}
        found |= {"reason": one.reason, "beaten_by": ", ".join(one.beaten_by), "seed": one.seed}
        found |= {"motions": len(one.F), "best_motions": int(one.best.sum())}
        for column, objective in enumerate(self.objectives):
            if objective.name not in OF_ROBOTS:
                least = float(one.F[:, column].min()) if len(one.F) else None
                found[f"least_{objective.name} [{objective.unit}]"] = least
        carried = one.carried
        found["largest_payload [kg]"] = None if carried is None else carried.mass
        found["largest_payload_time [s]"] = None if carried is None else carried.time
        found["price"] = one.candidate.price
        found["currency"] = one.candidate.currency
        found["mass [kg]"], found["reach [m]"] = one.candidate.mass, one.candidate.reach
        return found

    def save(self, folder: str | Path | None = None) -> tuple[Path, ...]:
        """Write tables, data, picture and page.

        Args:
            folder: folder to write to; that of the study if None.

        Returns:
            The files, see :func:`trajevo.study.robots.written.write_choice`.

        Raises:
            InvalidInputError: no folder, or one that cannot be written.
        """
        from trajevo.study.robots.written import write_choice  # imported where pictures are drawn, which takes long

        place = self.folder if folder is None else Path(folder)
        if place is None:
            raise InvalidInputError("folder: expected one to write to, as the study was not kept (out=...)")
        return write_choice(self, place)

    def _repr_html_(self) -> str:
        told = html.sentence(str(self))
        rest = map(html.sentence, self.sentences)
        return html.shown(f"Which robot: {self.title}", told, html.table(self.columns, self.rows), *rest)


def _sentence(one: ComparedRobot) -> str:
    if one.state == "beaten":
        return f"{one.name} is {one.reason}"
    return f"{one.name}{' ' if one.state == 'impossible' else ': '}{TOLD[one.state]}: {one.reason}"


def beaten(names: Sequence[str]) -> str:
    """What is said of a robot that is never the best, by the names of those that beat it."""
    *before, last = names
    by = f"{', '.join(before)} or {last}" if before else last
    return f"never the best: every one of its motions is beaten by {by}"
