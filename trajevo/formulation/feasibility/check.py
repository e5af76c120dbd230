"""Check a problem before its search: what can be held, what collides, what takes too long, told in one screen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.base.shown import html
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError
from trajevo.formulation.feasibility.findings import ROUNDING, Finding, at_least, number, of
from trajevo.formulation.feasibility.holding import Holding
from trajevo.formulation.feasibility.known_points import KnownPoints, known_points
from trajevo.formulation.feasibility.least_times import LeastTime, least_times
from trajevo.formulation.feasibility.surroundings import Nearest, dexterity_findings, height_findings
from trajevo.formulation.problem import TrajectoryProblem

#: Greatest number of points and of findings that are printed.
_MOST_ROWS, _MOST_FINDINGS = 16, 12


@final
@dataclass(frozen=True, eq=False)
class Feasibility:
    """What is known about a problem before its search; printing it fills one screen.

    What is impossible is so for every motion of the problem. That nothing is impossible does not say that there is a
    feasible motion: between the points, efforts, clearances and joint ranges are left to the search.

    Attributes:
        title: robot and problem, one line.
        joint_names: names of the joints.
        points: the points; of one that moves, its given place, shape (K, n_joints) [rad or m].
        passed: mask of the points that every motion passes exactly, shape (K,).
        range_used: share of its range that each joint uses, 1 at its end, -inf without one, shape (K, n_joints).
        effort_used: share of its effort limit that each joint needs to hold the payload at rest, 0 without a limit,
            shape (K, n_joints); None if the problem keeps no effort limit.
        clearance: least distance from an obstacle or between links, shape (K,) [m]; None if the problem keeps none.
        bodies: the two bodies of this distance, K texts; empty without one.
        least_times: least time from each point to the next that every motion passes, and last of the whole motion;
            empty if nothing is known.
        findings: what is impossible, then warnings, then notes.
        notes: what the problem itself has to say, as :attr:`~trajevo.formulation.problem.TrajectoryProblem.notes`.
    """

    title: str
    joint_names: tuple[str, ...]
    points: Array
    passed: Array
    range_used: Array
    effort_used: Array | None
    clearance: Array | None
    bodies: tuple[str, ...]
    least_times: tuple[LeastTime, ...]
    findings: tuple[Finding, ...]
    notes: tuple[str, ...]

    __repr__ = brief

    def _repr_html_(self) -> str:
        headers, *rows = self.table or [()]
        return html.shown(self.title, html.table(headers, rows), *map(html.sentence, self.sentences))

    @property
    def impossible(self) -> tuple[Finding, ...]:
        """What rules out every motion; empty if nothing does."""
        return tuple(finding for finding in self.findings if finding.impossible)

    def __str__(self) -> str:
        rows = self.table
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        lines = ("  ".join(map(str.ljust, row, widths)).rstrip() for row in rows)
        return "\n".join([self.title, *lines, *self.sentences])

    @property
    def sentences(self) -> tuple[str, ...]:
        """What is said below the table: what was left out of it, the least time, the findings, and the verdict last."""
        every = [*(f"{finding.severity}: {finding}" for finding in self.findings), *map("note: {}".format, self.notes)]
        told = every[:_MOST_FINDINGS]
        left = len(every) - len(told)
        more = [f"and {left} more findings of these kinds"] if left else []
        left_out = len(self.points) - len(self._shown())
        rows = [f"and {left_out} more points, with more room"] if left_out else []
        return (*rows, *self._whole(), *told, *more, self.verdict)

    @property
    def verdict(self) -> str:
        """The outcome in one sentence."""
        count = len(self.impossible)
        if count:
            return f"no motion is possible, for {'this reason' if count == 1 else f'these {count} reasons'}"
        if not len(self.points):
            return "nothing can be said before the search: the problem's motions have no points in common"
        return "nothing rules a motion out at its points; what happens between them is found by the search"

    def _whole(self) -> list[str]:
        if not self.least_times:
            return []
        return [f"the whole motion takes at least {number(self.least_times[-1].seconds)} s"]

    @property
    def table(self) -> list[tuple[str, ...]]:
        """Headers, then a row for each point, of many those that come nearest to something; empty without points."""
        if not len(self.points):
            return []
        times = {time.first: time for time in self.least_times[:-1]}
        columns = [["point", *(f"{k}" if self.passed[k] else f"{k} (near)" for k in range(len(self.points)))]]
        columns.append(["range used", *map(self._worst, self.range_used)])
        if self.effort_used is not None:
            columns.append(["held at rest", *map(self._worst, self.effort_used)])
        if self.clearance is not None:
            told = (f"{1e3 * d:.4g} mm, {bodies}" for d, bodies in zip(self.clearance, self.bodies, strict=True))
            columns.append(["least distance", *told])
        if times:
            columns.append(["to the next, at least", *(self._time(times.get(k)) for k in range(len(self.points)))])
        return [tuple(column[row] for column in columns) for row in (0, *(k + 1 for k in self._shown()))]

    def _shown(self) -> list[int]:
        """Numbers of the points in the table."""
        if len(self.points) <= _MOST_ROWS:
            return list(range(len(self.points)))
        room = np.zeros(len(self.points)) if self.effort_used is None else -self.effort_used.max(axis=1)
        if self.clearance is not None:
            nearest = np.argsort(self.clearance, kind="stable")[: _MOST_ROWS // 2]
            room[nearest] -= 1e6
        return sorted(np.argsort(room, kind="stable")[:_MOST_ROWS].tolist())

    def _worst(self, shares: Array) -> str:
        joint = int(shares.argmax())
        return f"{100.0 * shares[joint]:.1f} % {self.joint_names[joint]}" if np.isfinite(shares[joint]) else "no range"

    def _time(self, time: LeastTime | None) -> str:
        if time is None:
            return ""
        why = "" if time.joint is None else ", tool" if time.joint < 0 else f", {self.joint_names[time.joint]}"
        to = "" if time.last == time.first + 1 else f" to {time.last}"
        return f"{number(time.seconds)} s{to}{why}"


def check(problem: TrajectoryProblem) -> Feasibility:
    """Check what can be known about a problem before its search, in milliseconds.

    At every point: the share of each joint's range, the effort that holds the payload at rest against the limit that
    the problem keeps, and the clearance. Between points: the least time that velocity, acceleration and jerk limits
    allow, against the times that the problem allows. At the ends of a motion, and at every point that all motions pass
    in the same way, what exceeds a limit is impossible. Elsewhere it is a warning.

    Args:
        problem: the problem; of a task, ``load_task(file).problem``.

    Raises:
        InvalidInputError: not a problem.
    """
    if not isinstance(problem, TrajectoryProblem):
        raise InvalidInputError(f"problem: expected a TrajectoryProblem, got {type(problem).__name__}")
    given, robot = known_points(problem), problem.robot
    schedule = problem.dynamics.schedule
    own = f"{problem.dynamics.payload.mass:g} kg" if schedule is None else str(schedule)
    payload = "" if problem.payload_range is not None else f", {own}"
    title = f"{robot.name}{payload}: {problem.title}"
    if given is None:
        none = np.empty((0, robot.dof))
        return Feasibility(title, robot.joint_names, none, none[:, 0], none, None, None, (), (), (), problem.notes)
    holding, nearest, times = Holding.of(problem, given), Nearest.of(problem, given), least_times(problem, given)
    found = [
        *([] if holding is None else holding.findings()),
        *([] if nearest is None else nearest.findings(given)),
        *height_findings(problem, given),
        *dexterity_findings(problem, given),
        *_too_slow(problem, given, times),
    ]
    order = ("impossible", "warning", "note")
    return Feasibility(
        title=title,
        joint_names=robot.joint_names,
        points=given.positions,
        passed=given.passed,
        range_used=frozen(robot.limits.range_used(given.positions)),
        effort_used=None if holding is None else frozen(holding.used),
        clearance=None if nearest is None else frozen(nearest.distance),
        bodies=() if nearest is None else tuple(nearest.names(k) for k in range(len(given.positions))),
        least_times=times,
        findings=tuple(sorted(found, key=lambda finding: order.index(finding.severity))),
        notes=problem.notes,
    )


def _too_slow(problem: TrajectoryProblem, given: KnownPoints, times: tuple[LeastTime, ...]) -> list[Finding]:
    """Findings where a least time exceeds the greatest that the variables or a limit of the duration allow."""
    *parts, whole = times
    found: list[Finding] = []
    for part in (*parts, whole):
        longest = float(given.longest[part.first : part.last].sum())
        if part.seconds > longest * (1.0 + ROUNDING) and not (part is whole and found):
            found.append(_duration(problem, part, longest, f"from point {part.first} to {part.last}"))
    limits = [c.limit for c in problem.constraints if c.quantity == "duration" and isinstance(c.limit, float)]
    if limits and whole.seconds > min(limits) * (1.0 + ROUNDING):
        found.append(_duration(problem, whole, min(limits), "the whole motion"))
    return found


def _duration(problem: TrajectoryProblem, time: LeastTime, longest: float, where: str) -> Finding:
    joint = "" if time.joint is None or time.joint < 0 else problem.robot.joint_names[time.joint]
    by = f" for {joint}" if joint else " at the greatest speed of the tool" if time.joint == -1 else ""
    bounds = getattr(problem.interpolant, "duration_bounds", None)
    if where == "the whole motion":
        sentence = f"the whole motion takes at least {of(time.seconds, longest, 's')}{by}"
        remedy = f"remedy: a longest_time of at least {at_least(time.seconds)} s"
    else:
        sentence = f"{where} takes at least {of(time.seconds, longest, 's')}{by}"
        greatest = None if bounds is None or np.ndim(bounds) != 1 else at_least(bounds[1] * time.seconds / longest)
        more = "more time" if greatest is None else f"a greatest duration of at least {greatest} s (duration_bounds)"
        remedy = f"remedy: {more}, or nearer points"
    return Finding(
        kind="duration",
        point=time.first,
        joint=joint,
        needed=time.seconds,
        available=longest,
        unit="s",
        severity="impossible",
        sentence=sentence,
        remedy=remedy,
    )
