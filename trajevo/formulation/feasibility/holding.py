"""Efforts that hold a robot at rest at the points, and the payloads that can be held there."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.payload_masses import mass_bounds
from trajevo.dynamics.rollout import Rollout
from trajevo.formulation.constraints.constraint import Constraint
from trajevo.formulation.constraints.joint_limits import LIMITED_BY
from trajevo.formulation.feasibility.findings import (
    CLOSE,
    ROUNDING,
    Finding,
    Severity,
    at_least,
    at_most,
    effort_unit,
    number,
    of,
)
from trajevo.formulation.feasibility.known_points import KnownPoints, segments_at_points
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.robot.joints import Sides
from trajevo.trajectory.interpolants.interpolant import ArrangesPoints
from trajevo.trajectory.polynomial import PolynomialBatch


@final
@dataclass(frozen=True, eq=False)
class Holding:
    """Efforts at rest at K points.

    Attributes:
        problem: the problem, with effort limits.
        given: what its motions have in common.
        needed: effort of every joint with the payload, of several payloads the greatest, and the least that any mass of
            a variable payload needs, shape (K, n_joints) [N·m or N].
        limits: limits that the problem keeps, inf for none, shape (n_joints,) [N·m or N].
        directions: efforts at rest of the nominal payload, whose signs say which limit counts, shape (K, n_joints)
            [N·m or N].
    """

    problem: TrajectoryProblem
    given: KnownPoints
    needed: Array
    limits: Sides
    directions: Array

    @classmethod
    def of(cls, problem: TrajectoryProblem, given: KnownPoints) -> Holding | None:
        """The efforts of a problem; None if it keeps no effort limit, or if bases tilt, each under its own gravity."""
        if isinstance(problem.interpolant, ArrangesPoints) and problem.interpolant.base_tilts:
            return None
        held = [c for c in problem.constraints if LIMITED_BY.get(c.quantity) == "effort" and c.share is not None]
        if not any(c.names for c in held):
            return None
        needed, limits = np.zeros(given.positions.shape), problem.kept_limits.sides("effort")
        for constraint in held:
            if constraint.names:
                needed = np.maximum(needed, _needed(problem, given, constraint))
        if limits.agree:
            return cls(problem, given, needed, limits, np.zeros_like(needed))
        directions = _directions(problem, given, limits)
        told, limited = limits.told(directions), limits.limited
        scale = np.where(limited, told, 1.0) / np.where(limited, limits.lesser, 1.0)
        return cls(problem, given, needed * scale, limits, directions)

    @property
    def available(self) -> Array:
        """Limit in the direction that counts, inf for none, shape (K, n_joints) [N·m or N]."""
        return np.broadcast_to(self.limits.told(self.directions), self.needed.shape)

    @property
    def used(self) -> Array:
        """Share of the limit that is needed, shape (K, n_joints)."""
        share: Array = self.needed / self.available
        return share

    def findings(self) -> list[Finding]:
        """One finding for each point that cannot be held, one for those nearly so, one for masses no payload can have.

        Among payloads that are variable, the lightest load counts that some mass gives.
        """
        worst = self.used.max(axis=1, initial=0.0)
        found = [self._too_much(k) for k in np.flatnonzero(worst > 1.0 + ROUNDING).tolist()]
        if not any(finding.impossible for finding in found):
            found += self._no_common_mass()
        return found + self._close(np.flatnonzero((worst > CLOSE) & (worst <= 1.0 + ROUNDING)))

    def _too_much(self, k: int) -> Finding:
        joint, names = int(self.used[k].argmax()), self.problem.robot.joint_names
        others = [names[j] for j in np.flatnonzero(self.used[k] > 1.0 + ROUNDING).tolist() if j != joint]
        rests = bool(self.given.resting[k] and self.given.on_break[k])
        sentence = f"holding point {k} takes {self._told(k, joint)}"
        sentence += f", and too much on {', '.join(others)}" if others else ""
        sentence += "" if rests else ", so that only a motion that does not rest there may pass it"
        return self._finding(k, joint, "impossible" if rests else "warning", sentence, self._remedy(k, joint))

    def _close(self, points: Array) -> list[Finding]:
        if not len(points):
            return []
        k = int(points[self.used[points].max(axis=1).argmax()])
        joint = int(self.used[k].argmax())
        others = f", and {len(points) - 1} more points take nearly as much" if len(points) > 1 else ""
        told = f"holding point {k} takes {self._told(k, joint)}{others}"
        return [self._finding(k, joint, "warning", told, "little is left to move with")]

    def _finding(self, k: int, joint: int, severity: Severity, sentence: str, remedy: str) -> Finding:
        return Finding(
            kind="effort",
            point=k,
            joint=self.problem.robot.joint_names[joint],
            needed=float(self.needed[k, joint]),
            available=float(self.available[k, joint]),
            unit=effort_unit(self.problem.robot, joint),
            severity=severity,
            sentence=sentence,
            remedy=remedy,
        )

    def _told(self, k: int, joint: int) -> str:
        robot, unit = self.problem.robot, effort_unit(self.problem.robot, joint)
        full, kept = self._full(k)[joint], self.available[k, joint]
        margin = "" if full == kept else f" ({number(full)} {unit} less the margin)"
        return f"{of(self.needed[k, joint], kept, unit)} on {robot.joint_names[joint]}{margin}"

    def _full(self, k: int) -> Array:
        """The robot's own limits in the direction that counts at a point, shape (n_joints,) [N·m or N]."""
        return self.problem.robot.limits.sides("effort").told(self.directions[k])

    def _remedy(self, k: int, joint: int) -> str:
        """What makes the point easy to hold."""
        robot = self.problem.robot
        of_full = float((self.needed[k] / self._full(k)).max())
        helps = [] if of_full > 1.0 else [f"an effort_margin of at most {at_most(1.0 - of_full)}"]
        helps += self._payload(k)
        unit, share = effort_unit(robot, joint), self.available[k, joint] / self._full(k)[joint]
        helps.append(f"another posture there, or a limit of at least {at_least(self.needed[k, joint] / share)} {unit}")
        return f"remedy: {', or '.join(helps)}"

    def _payload(self, k: int) -> list[str]:
        """The payloads that can be held at a point, if there are any."""
        if any(c.quantity == "effort of every payload" for c in self.problem.constraints):
            return []
        lower, upper = (float(m) for m in (self._masses()[0][k].max(), self._masses()[1][k].min()))
        least, greatest = _range(self.problem)
        if lower > upper:
            return []
        if upper < least:
            return [f"a payload of at most {at_most(upper)} kg"]
        return [f"a payload of at least {at_least(lower)} kg as a counterweight"] if lower > greatest else []

    def _masses(self) -> tuple[Array, Array]:
        """Least and greatest payload that every joint can hold, shape (K, n_joints) [kg]."""
        lower, upper = np.zeros(self.needed.shape), np.full(self.needed.shape, np.inf)
        for points, unloaded, each in _efforts(self.problem, self.given):
            least, greatest = mass_bounds(unloaded, each, self.limits)
            lower[points], upper[points] = np.maximum(lower[points], least), np.minimum(upper[points], greatest)
        return lower, upper

    def _no_common_mass(self) -> list[Finding]:
        """A finding if no mass of a variable payload can be held at all points at which motions rest."""
        resting = np.flatnonzero(self.given.resting & self.given.on_break)
        if self.problem.payload_range is None or not len(resting):
            return []
        lower, upper = (masses[resting] for masses in self._masses())
        least, greatest = self.problem.payload_range
        needed, room = max(float(lower.max()), least), min(float(upper.min()), greatest)
        if needed <= room * (1.0 + ROUNDING):
            return []
        schedule = self.problem.dynamics.schedule
        where = "at both ends" if schedule is None else "wherever the motion rests with it"
        held = f"at least {at_least(float(lower.max()))} kg and at most {at_most(float(upper.min()))} kg"
        return [
            Finding(
                kind="payload",
                point=None,
                joint="",
                needed=needed,
                available=room,
                unit="kg",
                severity="impossible",
                sentence=f"no payload of {number(least)} to {number(greatest)} kg can be held at rest {where}",
                remedy=f"remedy: other {'ends' if schedule is None else 'points'}; what can be held there is {held}",
            )
        ]


def _range(problem: TrajectoryProblem) -> tuple[float, float]:
    """Least and greatest payload of a problem [kg]."""
    mass = problem.dynamics.payload.mass
    return (mass, mass) if problem.payload_range is None else problem.payload_range


@final
@dataclass(frozen=True, eq=False)
class _Carried:
    """Points at which the same loads are carried, shape (K',), and the dynamics with them on a single segment."""

    points: Array
    dynamics: Dynamics


def _carried(problem: TrajectoryProblem, given: KnownPoints) -> list[_Carried]:
    """What is carried at the points; where a load is picked up or put down, what is there before and after."""
    dynamics, count = problem.dynamics, len(given.positions)
    schedule = dynamics.schedule
    if schedule is None:
        return [_Carried(np.arange(count), dynamics)]
    found: dict[tuple[int, ...], list[int]] = {}
    for point, segments in enumerate(segments_at_points(problem)):
        for phase in dict.fromkeys(schedule.carried[segment] for segment in segments):
            found.setdefault(phase, []).append(point)
    return [_Carried(np.array(k), replace(dynamics, schedule=schedule.only(phase))) for phase, k in found.items()]


def _efforts(problem: TrajectoryProblem, given: KnownPoints) -> Iterator[tuple[Array, Array, Array]]:
    """Points, and efforts at rest there without payload and for each kilogram, (K', n_joints) [N·m or N, per kg]."""
    for carried in _carried(problem, given):
        q, segments = np.array(given.positions[carried.points]), np.zeros(len(carried.points), dtype=np.intp)
        states = q, np.zeros_like(q), np.zeros_like(q), segments
        dynamics = carried.dynamics
        yield carried.points, dynamics.unloaded_effort(*states), dynamics.effort_per_kilogram(*states)


def _directions(problem: TrajectoryProblem, given: KnownPoints, limits: Sides) -> Array:
    """The effort at rest at each point, of several loads that which uses most of a limit, shape (K, n_joints)."""
    found = np.zeros(given.positions.shape)
    for points, unloaded, each in _efforts(problem, given):
        effort = unloaded + _lightest(problem, unloaded, each) * each
        more = limits.share(effort) > limits.share(found[points])
        found[points] = np.where(more, effort, found[points])
    return found


def _lightest(problem: TrajectoryProblem, unloaded: Array, each: Array) -> Array:
    """The payload, or that of a variable one with which each joint bears least, shape (K', n_joints) [kg]."""
    if problem.payload_range is None:
        return np.full(each.shape, problem.dynamics.payload.mass)
    best = np.divide(-unloaded, each, out=np.zeros_like(each), where=each != 0.0)
    return np.clip(best, *problem.payload_range)


def _needed(problem: TrajectoryProblem, given: KnownPoints, constraint: Constraint) -> Array:
    """Efforts at rest by which a constraint judges, shape (K, n_joints) [N·m or N].

    Where limits differ by direction, they are what uses as much of the lesser limit as the effort does of its own.
    """
    needed, limits = np.zeros(given.positions.shape), problem.robot.limits.sides("effort")
    if problem.payload_range is not None:
        for points, unloaded, each in _efforts(problem, given):
            lightest = limits.as_lesser(unloaded + _lightest(problem, unloaded, each) * each)
            needed[points] = np.maximum(needed[points], lightest)
        return needed
    limited = limits.limited
    for carried in _carried(problem, given):
        positions = given.positions[carried.points]
        standing = PolynomialBatch(np.tile([0.0, 1.0], (len(positions), 1)), positions[:, None, :, None])
        excess = constraint.at_samples.function(Rollout(carried.dynamics.sampled(2), standing))
        held = np.zeros(positions.shape)
        held[:, limited] = (1.0 + excess) * np.asarray(constraint.limit)
        needed[carried.points] = np.maximum(needed[carried.points], held)
    return needed
