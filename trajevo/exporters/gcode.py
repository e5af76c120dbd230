"""A motion of linear axes as straight blocks, each with its feed, for numerical controls."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.errors import InvalidInputError, one_line
from trajevo.exporters.events import stretches
from trajevo.exporters.exporter import Exporter, comments
from trajevo.front.front import Solution
from trajevo.verification.certify import certify

#: Letters that a numerical control knows as linear axes.
AXIS_LETTERS = "XYZUVW"

#: Decimal places of coordinates [mm]; a block must be longer than one unit of the last place.
_DIGITS = 6

_MM = 1e3

#: Speed at an end that counts as rest, as a share of the greatest.
_REST = 1e-9


@dataclass(frozen=True, eq=False)
class Blocks:
    """Straight blocks along a motion.

    Attributes:
        letters: names of the axes for the control.
        time: instants at which blocks end, the start first, shape (K + 1,) [s].
        position: positions at which blocks end, the start first, shape (K + 1, n_axes) [mm].
        feed: feed of each block, 0 for a dwell, shape (K,) [mm/min].
        deviation: greatest distance of the motion from its block, at the middle of each block's time [mm].
    """

    letters: tuple[str, ...]
    time: Array
    position: Array
    feed: Array
    deviation: float


def blocks(solution: Solution, step: float) -> Blocks:
    """Cut a motion into straight blocks of equal duration; where nearly nothing moves, several are merged.

    Args:
        solution: a solution for a robot whose joints are all linear axes.
        step: duration of a block [s].

    Raises:
        InvalidInputError: a joint is not a linear axis or not named by its letter, or the step is not shorter than the
            motion.
    """
    robot, trajectory = solution.front.problem.robot, solution.trajectory
    letters = tuple(name.upper() for name in robot.joint_names)
    for letter, name, unit in zip(letters, robot.joint_names, robot.joint_units, strict=True):
        if unit != "m" or letter not in tuple(AXIS_LETTERS):
            raise InvalidInputError(
                f"feed: joint {name!r} [{unit}] of robot {robot.name!r} is no linear axis; "
                f"expected joints in m that are named by a letter of {AXIS_LETTERS}"
            )
    duration = float(trajectory.duration[0])
    if step >= duration:
        raise InvalidInputError(
            f"step: expected less than the duration of the motion, {duration:.4g} s, got {step:g} s"
        )
    time, position = _ends_of_blocks(solution, step)
    length = np.linalg.norm(np.diff(position, axis=0), axis=1)
    middle = _MM * trajectory.evaluate(0.5 * (time[1:] + time[:-1]))[0]
    return Blocks(
        letters=letters,
        time=frozen(time),
        position=frozen(position),
        feed=frozen(60.0 * length / np.diff(time)),
        deviation=float(_distance(middle, position[:-1], position[1:]).max()),
    )


def _ends_of_blocks(solution: Solution, step: float) -> tuple[Array, Array]:
    """Instants and positions [mm] at the ends of blocks, the start first; a dwell is one block that goes nowhere."""
    times, positions = [np.zeros(1)], [np.round(_MM * solution.trajectory.evaluate(np.zeros(1))[0], _DIGITS)]
    for stretch in stretches(solution.rollout, step):
        position = np.round(_MM * stretch.q, _DIGITS)
        kept = [0]
        for k in range(1, len(position)):
            if stretch.dwells or (position[k] != position[kept[-1]]).any():
                kept.append(k)
        if len(kept) > 1 and kept[-1] != len(position) - 1:
            kept[-1] = len(position) - 1
        times.append(stretch.t[kept[1:]])
        positions.append(position[kept[1:]])
    return np.concatenate(times), np.concatenate(positions)


def feed_table(solution: Solution, step: float) -> str:
    """The blocks as CSV: time, coordinates and feed."""
    found = blocks(solution, step)
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(["time [s]", *(f"{letter} [mm]" for letter in found.letters), "feed [mm/min]"])
    feeds = np.concatenate([[0.0], found.feed])
    for time, position, feed in zip(found.time.tolist(), found.position.tolist(), feeds.tolist(), strict=True):
        writer.writerow([repr(time), *map(repr, position), repr(feed)])
    return stream.getvalue()


def g_code(solution: Solution, step: float) -> str:
    """The blocks as G-code of ISO 6983: G1 with the feed of each block, mm and mm/min, absolute; G4 for dwells [s]."""
    found, duration = blocks(solution, step), float(solution.trajectory.duration[0])
    lines = [
        f"; trajevo: {solution.front.record.title}",
        f"; {solution.rule}, row {solution.index} of the front, {duration:.6f} s in {len(found.feed)} blocks",
        f"; greatest distance of the motion from a block {found.deviation:.3g} mm",
        f"; certificate: {one_line(str(certify(solution)))}",  # a line break would end the comment
        f"; {_ends(solution)}; feeds are the mean speeds of the blocks; G4 waits for P seconds",
        "G21 G90 G94",
        f"G0 {_words(found.letters, found.position[0])}",
    ]
    for position, feed, time in zip(found.position[1:], found.feed.tolist(), np.diff(found.time).tolist(), strict=True):
        if not feed:
            lines.append(f"G4 P{time:.6f}")
            continue
        lines.append(f"G1 {_words(found.letters, position)} F{np.format_float_positional(feed, 8, fractional=False)}")
    return "\n".join([*lines, "M2", ""])


def _ends(solution: Solution) -> str:
    """Whether the motion begins and ends at rest, which a control does by itself."""
    speeds = np.abs(solution.trajectory.evaluate(np.array([0.0, float(solution.trajectory.duration[0])]), 1)[0]).max(
        axis=1
    )
    still = speeds <= _REST * float(solution.trajectory.peak(1).max())
    return " and ".join(
        f"{verb} {'at rest' if rests else 'in motion'}" for verb, rests in zip(("starts", "ends"), still, strict=True)
    )


def _words(letters: tuple[str, ...], position: Array) -> str:
    return " ".join(f"{letter}{value:.{_DIGITS}f}" for letter, value in zip(letters, position.tolist(), strict=True))


def _distance(points: Array, start: Array, end: Array) -> Array:
    """Distance of points from the segments between starts and ends, each (K, n_axes) -> (K,)."""
    along = end - start
    square = np.square(along).sum(axis=1)
    share = np.clip(((points - start) * along).sum(axis=1) / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
    distance: Array = np.linalg.norm(points - start - share[:, None] * along, axis=1)
    return distance


def _feed(solution: Solution, step: float, angle: str) -> str:
    return comments(solution) + feed_table(solution, step)


def _gcode(solution: Solution, step: float, angle: str) -> str:
    return g_code(solution, step)


_LINEAR = "linear axes alone, named by letters of XYZUVW"

FEED = Exporter("feed", "feed", "CSV of straight blocks with their feeds, mm and mm/min", _feed, needs=_LINEAR)

GCODE = Exporter(
    "gcode",
    "gcode",
    "straight blocks as G1 lines with their feeds, mm and mm/min",
    _gcode,
    needs=_LINEAR,
    beginning=b"; trajevo",
)
