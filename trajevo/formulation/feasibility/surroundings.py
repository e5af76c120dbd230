"""What stands around the points: ends of joint ranges, obstacles, the robot itself, the least height of the tool."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.formulation.constraints.clearance import ProvenClearance
from trajevo.formulation.constraints.clearance_gradients import wanted_clearances
from trajevo.formulation.constraints.collision import DISTANCE_ERROR, Pair
from trajevo.formulation.constraints.further.dexterity import TooLittle
from trajevo.formulation.feasibility.findings import ROUNDING, Finding, Severity, at_most, of
from trajevo.formulation.feasibility.known_points import KnownPoints, segments_at_points
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.robot.shapes.gantry import carriage_of

#: Distance by which a clearance must be missed to rule a motion out [m].
_SURE = 5.0 * DISTANCE_ERROR


@final
@dataclass(frozen=True, eq=False)
class Nearest:
    """The pair of solids that keeps its distance least at each of K points.

    Attributes:
        distance: from one to the other, negative where they overlap, shape (K,) [m].
        wanted: clearance that is to be kept between them, shape (K,) [m].
        pairs: the pairs, K of them.
        missed: number of pairs that miss their clearance, shape (K,).
    """

    distance: Array
    wanted: Array
    pairs: tuple[Pair, ...]
    missed: Array

    @classmethod
    def of(cls, problem: TrajectoryProblem, given: KnownPoints) -> Nearest | None:
        """The pairs of a problem's points; None if it keeps no clearance."""
        functions = [constraint.function for constraint in problem.constraints]
        clearances = [function for function in functions if isinstance(function, ProvenClearance)]
        clearances = [one for one in clearances if carriage_of(one.collision.robot) is None]  # the base moves
        if not clearances:
            return None
        touching = None if all(one.part is None for one in clearances) else segments_at_points(problem)
        pairs = [pair for one in clearances for pair in one.collision.pairs]
        distances = np.concatenate([_distances(one, given, touching) for one in clearances], axis=1)
        wanted = wanted_clearances(clearances[0].collision.scene)[[int(pair.itself) for pair in pairs]]
        worst = (distances - wanted).argmin(axis=1)
        return cls(
            np.take_along_axis(distances, worst[:, None], axis=1)[:, 0],
            wanted[worst],
            tuple(pairs[k] for k in worst.tolist()),
            (distances < wanted - _SURE).sum(axis=1),
        )

    def names(self, k: int) -> str:
        """The two bodies at a point."""
        return _names(self.pairs[k])

    def findings(self, given: KnownPoints) -> list[Finding]:
        """One finding for each point at which a clearance is missed."""
        return [self._finding(k, bool(given.passed[k])) for k in np.flatnonzero(self.missed).tolist()]

    def _finding(self, k: int, passed: bool) -> Finding:
        distance, wanted = float(self.distance[k]), float(self.wanted[k])
        others = int(self.missed[k]) - 1
        also = f" ({others} more {'pair' if others == 1 else 'pairs'} there)" if others else ""
        if distance < 0.0:
            what = f"point {k} is in collision: {self.names(k)} overlap{also}"
            remedy = "remedy: another point, or a box in which it may move"
        else:
            room = of(1e3 * distance, 1e3 * wanted, "mm")
            what = f"point {k} leaves {room} between {self.names(k)}{also}"
            remedy = "remedy: another point, a box in which it may move, or a clearance of at most "
            remedy += f"{at_most(distance)} m"
        return Finding(
            kind="clearance",
            point=k,
            joint="",
            needed=wanted,
            available=distance,
            unit="m",
            severity="impossible" if passed else "note",
            sentence=what if passed else f"{what}, where it is given",
            remedy=remedy if passed else "",
        )


def _distances(clearance: ProvenClearance, given: KnownPoints, touching: list[list[int]] | None) -> Array:
    """Distances of all pairs at the points, shape (K, n_pairs) [m].

    They are inf where a load is not carried, and to what moves, but at the first point: when the others are passed is
    not known.
    """
    collision, states = clearance.collision, given.positions
    if collision.timed:
        states = np.column_stack([states, np.zeros(len(states))])
    distances = np.array(collision.distances(states))
    moving = {obstacle.name for obstacle in collision.scene.moving}
    distances[1:, [not pair.itself and pair.second in moving for pair in collision.pairs]] = np.inf
    if clearance.part is not None and touching is not None:
        away = [not set(clearance.part) & set(segments) for segments in touching]
        distances[away] = np.inf
    return distances


def height_findings(problem: TrajectoryProblem, given: KnownPoints) -> list[Finding]:
    """One finding for each point at which the tool is lower than it may be."""
    limits = [c.limit for c in problem.constraints if c.quantity == "tool height" and isinstance(c.limit, float)]
    if not limits:
        return []
    least, found = max(limits), []
    heights = problem.robot.tool_poses(given.positions)[0][:, 2]
    for k in np.flatnonzero(heights < least - ROUNDING).tolist():
        height = float(heights[k])
        sure = bool(given.passed[k] and given.on_break[k])
        severity: Severity = "impossible" if sure else "note"
        told = f"the tool is {of(height, least, 'm')} high at point {k}"
        found.append(
            Finding(
                kind="tool height",
                point=k,
                joint="",
                needed=least,
                available=height,
                unit="m",
                severity=severity,
                sentence=told if sure else f"{told}, where it is given",
                remedy=f"remedy: another point, or a tool_height of at most {at_most(height)} m" if sure else "",
            )
        )
    return found


def dexterity_findings(problem: TrajectoryProblem, given: KnownPoints) -> list[Finding]:
    """One finding for each point that is nearer to a singular posture than a limit allows."""
    found = []
    for constraint in problem.constraints:
        lacking = constraint.terms
        if not isinstance(lacking, TooLittle):
            continue
        values = lacking.measure(given.positions)
        for k in np.flatnonzero(values < lacking.least * (1.0 - ROUNDING)).tolist():
            value = float(values[k])
            sure = bool(given.passed[k] and given.on_break[k])
            told = f"point {k} has a {constraint.quantity} {of(value, lacking.least, 'wanted')}"
            key = constraint.quantity.replace(" ", "_")
            found.append(
                Finding(
                    kind=constraint.quantity,
                    point=k,
                    joint="",
                    needed=lacking.least,
                    available=value,
                    unit="1",
                    severity="impossible" if sure else "note",
                    sentence=told if sure else f"{told}, where it is given",
                    remedy=f"remedy: another posture there, or {key} of at most {at_most(value)}" if sure else "",
                )
            )
    return found


def _names(pair: Pair) -> str:
    """The links or obstacles of a pair; geometries of a robot are named after their link, with a number."""
    first, second = (name.rpartition("_")[0] or name for name in (pair.first, pair.second))
    return f"{first} and {second if pair.itself else pair.second}"
