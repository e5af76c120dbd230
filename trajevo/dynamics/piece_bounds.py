"""Pieces of motions, and bounds of efforts, powers and the tool's speed over each piece.

Within a segment the motion is a polynomial of time, so that efforts without dry friction, their products with
velocities and the square of the tool's speed are analytic. Over a piece of a segment, each of these functions differs
from the polynomial through its values at a few Gauss-Legendre nodes by an error. The magnitude of the function on an
ellipse of complex instants bounds this error (see :mod:`trajevo.dynamics.complex_bounds` and
:func:`trajevo.trajectory.bernstein.interpolation_error`). The polynomial lies in the hull of its Bernstein form. As
pieces are halved, the error falls with their width to the power of the number of nodes, and the hull closes in with the
square of their width.

Dry friction jumps where a joint reverses. Over a piece it is enclosed by all values that it takes there; a joint that
moves no faster than :attr:`trajevo.dynamics.rollout.Rollout.standing` counts as at rest, without dry friction.

Intermediate results are not rounded outwards. Instead every enclosure is widened by :data:`ROUNDING` times the bound of
the magnitude, which exceeds every intermediate result of the recursion: thousands of times the rounding of double
precision.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, final

import numpy as np

from trajevo.base import jit, polynomials
from trajevo.base.arrays import Array
from trajevo.dynamics.bounds.torque_loops import enclosures
from trajevo.dynamics.complex_bounds import Bounds, EffortReach
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.path.tool_ways import ToolWay
from trajevo.robot.joints import Friction, Sides
from trajevo.robot.kinematics import ToolKinematics
from trajevo.trajectory.bernstein import (
    gauss,
    halving,
    hull,
    interpolation_error,
    to_bernstein_halves,
    to_chebyshev,
)

#: Share of the bound of the magnitude by which enclosures are widened for rounding.
ROUNDING = 1e-12

#: Width of the narrowest piece, as a share of the motion.
LEAST_WIDTH = 1e-12

#: Sums of the semi-axes of the ellipses that are tried.
ELLIPSES = np.geomspace(1.25, 256.0, 16)


class Pieces(NamedTuple):
    """K pieces of motions.

    These are the index of the motion, start [s], width [s], q, v, a at the nodes, (K, N, 3 n_joints), and the number of
    the motion's segment in which the piece lies.
    """

    owner: np.ndarray[Any, np.dtype[np.intp]]
    start: Array
    width: Array
    states: Array
    segment: np.ndarray[Any, np.dtype[np.intp]]

    @classmethod
    def of(cls, rollout: Rollout, nodes: int) -> Pieces:
        """Every segment that is longer than rounding; within segments motions are continuous.

        Of complex motions, which carry the steps of derivatives, only the real parts are used.

        Args:
            rollout: the motions.
            nodes: number of nodes of every piece, N, raised to the number of the polynomials' coefficients.
        """
        trajectory, robot = rollout.trajectory, rollout.robot
        size = max(nodes, trajectory.degree + 1)
        shape = (len(trajectory), -1, size, robot.dof)
        q, v, a = (trajectory.at_shares(gauss(size)[0], order).real.reshape(shape) for order in range(3))
        stands = (trajectory.peak(1).real <= rollout.standing)[:, None, None, :]  # its small motion is rounding
        states = np.concatenate([q, np.where(stands, 0.0, v), np.where(stands, 0.0, a)], axis=-1)
        widths = trajectory.segment_durations.real
        owner, segment = np.nonzero(widths > LEAST_WIDTH * trajectory.duration.real[:, None])
        starts = trajectory.breaks[:, :-1].real
        return cls(owner, starts[owner, segment], widths[owner, segment], states[owner, segment], segment)

    def rows(self, chosen: Array) -> Pieces:
        """The pieces that a mask (K,) chooses."""
        return Pieces(*(x[chosen] for x in self))

    def halved(self) -> Pieces:
        """Both halves of every piece."""
        count, size, columns = self.states.shape
        states = (halving(size) @ self.states).reshape(2 * count, size, columns)
        width = np.repeat(0.5 * self.width, 2)
        start = np.repeat(self.start, 2) + width * np.tile([0.0, 1.0], count)
        return Pieces(np.repeat(self.owner, 2), start, width, states, np.repeat(self.segment, 2))


class Over(NamedTuple):
    """Q magnitudes over K pieces [N·m or N, W, m/s].

    Upper bounds (K, Q), the part of these that allows for rounding (K, Q), and the values at the nodes (K, N, Q).
    """

    above: Array
    slack: Array
    found: Array


@final
@dataclass(frozen=True, eq=False)
class PieceBounds:
    """Bounds of efforts, powers and the tool's speed of B motions, over pieces of these.

    Attributes:
        smooth: dynamics of the robot and its payload, without dry friction.
        friction: friction of the robot.
        kinematics: kinematics of its tool.
        reach: bounds at complex instants.
        standing: greatest speeds at which joints count as at rest, shape (B, n_joints) [rad/s or m/s].
        masses: payload mass of each motion, shape (B,) [kg]; the payload's own if None.
        degree: degree of the motions' polynomials.
        limits: effort limits; of a joint whose limit differs by direction, the bound of the effort is what uses as much
            of the lesser limit as the effort does of its own, see :meth:`~trajevo.robot.joints.Sides.as_lesser`.
    """

    smooth: Dynamics
    friction: Friction
    kinematics: ToolKinematics
    reach: EffortReach
    standing: Array
    masses: Array | None
    degree: int
    limits: Sides

    @classmethod
    def of(cls, rollout: Rollout) -> PieceBounds:
        """The bounds for the motions of a rollout."""
        robot = rollout.robot
        smooth = rollout.dynamics.of_real_parts.without_dry_friction
        masses = rollout.masses
        return cls(
            smooth,
            robot.friction,
            smooth.once("kinematics of the tool", lambda: ToolKinematics.of(robot)),
            EffortReach.of(smooth, any_mass=masses is not None),
            rollout.standing,
            None if masses is None else masses.real,
            rollout.trajectory.degree,
            robot.limits.sides("effort"),
        )

    def everything(self, pieces: Pieces) -> Over:
        """Efforts, mechanical powers and the tool's speed, Q = 2 n_joints + 1."""
        reach = motion_bounds(pieces.states, self.degree)
        parts = self._joints(pieces, reach, powers=True), self._tool(pieces, reach)
        return Over(*(np.concatenate(both, axis=-1) for both in zip(*parts, strict=True)))

    def magnitudes(self, pieces: Pieces) -> Array:
        """Coarse bounds of the same quantities, from the sizes of the robot and its motion alone, (K, 2 n_joints + 1).

        They do not see that terms cancel or that a lever has another direction; NaN or inf where there is no bound.
        """
        # At real instants: on an ellipse about a whole segment the bounds may be beyond all sizes.
        reach = Bounds(*(bound[:, 0] for bound in motion_bounds(pieces.states, self.degree, np.ones(1))))
        dry = np.maximum(self.friction.dry(np.ones(reach.v.shape[1])), -self.friction.dry(-np.ones(reach.v.shape[1])))
        effort = self._effort_reach(pieces, reach, axes=2) + dry
        with np.errstate(over="ignore", invalid="ignore"):
            speed = np.sqrt(self.reach.squared_tool_speed(reach))[:, None]
            return np.concatenate([effort, effort * reach.v, speed], axis=1)

    def efforts(self, pieces: Pieces) -> Over:
        """Efforts alone, Q = n_joints."""
        return self._joints(pieces, motion_bounds(pieces.states, self.degree), powers=False)

    def smooth_efforts(self, pieces: Pieces, reach: Bounds) -> tuple[Array, Array]:
        """Efforts without dry friction at the nodes (K, N, n_joints), and bounds on ellipses, (K, ellipses, n_joints).

        Args:
            pieces: the pieces.
            reach: bounds of their motions, see :func:`motion_bounds`.
        """
        return self._smooth_effort(pieces, *np.split(pieces.states, 3, axis=-1)), self._effort_reach(pieces, reach)

    def tool_speed(self, pieces: Pieces) -> Over:
        """The tool's speed alone, Q = 1."""
        return self._tool(pieces, motion_bounds(pieces.states, self.degree))

    def tool_below(self, pieces: Pieces, height: float) -> Over:
        """How far the tool is below a height that it never exceeds, Q = 1 [m]."""
        q = np.split(pieces.states, 3, axis=-1)[0]
        below = height - self.kinematics.pose(q)[0][..., 2:]
        with np.errstate(over="ignore", invalid="ignore"):
            magnitude = height + self.reach.tool_distance(motion_bounds(pieces.states, self.degree))[..., None]
        error, slack = interpolation_errors([magnitude], pieces.states.shape[1])
        return Over(hull(np.moveaxis(below, 1, -1))[1] + error, slack, below)

    def tool_tilt(self, pieces: Pieces, axis: Array, direction: Array) -> Over:
        """1 - cos of the angle between an axis of the tool and a direction, Q = 1.

        Args:
            pieces: the pieces.
            axis: unit axis in the tool's frame, shape (3,).
            direction: unit direction in the base frame, shape (3,).
        """
        q = np.split(pieces.states, 3, axis=-1)[0]
        tilt = self.kinematics.tilt(q, axis, direction)[..., None]
        with np.errstate(over="ignore", invalid="ignore"):
            magnitude = 1.0 + self.reach.tool_turned(motion_bounds(pieces.states, self.degree))[..., None]
        error, slack = interpolation_errors([magnitude], pieces.states.shape[1])
        return Over(hull(np.moveaxis(tilt, 1, -1))[1] + error, slack, tilt)

    def tool_off_way(self, pieces: Pieces, way: ToolWay, law: Array, start: Array, duration: Array) -> Over:
        """Squared distance of the tool from a way [m²], and 8 sin² of half the angle from its orientation, Q = 2.

        Args:
            pieces: the pieces.
            way: the way.
            law: share of the way as ascending powers of the share of time, shape (degree + 1,).
            start: instant at which each motion is at the way's start, shape (B,) [s].
            duration: time in which it goes to its end, shape (B,) [s].
        """
        size = pieces.states.shape[1]
        instants = pieces.start[:, None] + pieces.width[:, None] * gauss(size)[0]
        s = polynomials.values(law, (instants - start[pieces.owner, None]) / duration[pieces.owner, None])
        position, rotation = self.kinematics.pose(np.split(pieces.states, 3, axis=-1)[0])
        off, turned = position - way.position(s), rotation - way.orientation(s)
        found = np.stack([(off * off).sum(axis=-1), (turned * turned).sum(axis=(-1, -2))], axis=-1)
        series = np.abs(s @ to_chebyshev(size)[: len(law)].T)
        powers = ELLIPSES[:, None] ** np.arange(len(law))
        reach = motion_bounds(pieces.states, self.degree)
        with np.errstate(over="ignore", invalid="ignore"):
            imaginary, magnitude = (0.5 * (powers + sign / powers) @ series[..., None] for sign in (-1.0, 1.0))
            place, tilted = way.reach(imaginary[..., 0], magnitude[..., 0])
            both = [(self.reach.tool_distance(reach) + place) ** 2, 3.0 * (self.reach.tool_turned(reach) + tilted) ** 2]
        error, slack = interpolation_errors([np.stack(both, axis=-1)], size)
        return Over(hull(np.moveaxis(found, 1, -1))[1] + error, slack, found)

    def _joints(self, pieces: Pieces, reach: Bounds, *, powers: bool) -> Over:
        """Efforts, and with ``powers`` mechanical powers after them."""
        q, v, a = np.split(pieces.states, 3, axis=-1)
        effort = self._smooth_effort(pieces, q, v, a)
        # What is left of this without dry friction is neither computed nor added.
        standing = self.standing[pieces.owner] if self.friction.is_dry else None
        total = effort
        if standing is not None:
            least, greatest = hull(np.moveaxis(v, 1, -1))
            total = effort + self.friction.dry(np.where(np.abs(v) <= standing[:, None], 0.0, v))
        values = [effort]
        if powers:
            values.append(effort * v)
            if standing is not None:
                # Where a joint does not reverse, dry friction is constant and its power a polynomial.
                forward, backward = greatest > standing, least < -standing
                against = self.friction.dry(np.where(forward & backward, 0.0, forward * 1.0 - backward))
                values[1] = (effort + against[:, None]) * v
        magnitude = self._effort_reach(pieces, reach)
        with np.errstate(over="ignore", invalid="ignore"):
            magnitudes = [magnitude, magnitude * reach.v] if powers else [magnitude]
        lower, upper, slack = _enclosed(values, magnitudes)
        if standing is not None:
            self._add_dry(lower, upper, least, greatest, standing)
        if not self.limits.agree:
            return self._measured(Over(upper, slack, total), lower, v, powers=powers)
        found = np.abs(np.concatenate([total, total * v], axis=-1) if powers else total)
        return Over(np.maximum(upper, -lower), slack, found)

    def _measured(self, over: Over, lower: Array, v: Array, *, powers: bool) -> Over:
        """Magnitudes from upper and lower bounds and signed efforts, those of efforts by their limits."""
        n, (upper, slack, total) = v.shape[-1], over
        ahead, behind = (self.limits.weights(np.full(n, sign)) for sign in (1.0, -1.0))
        above = np.maximum(upper, -lower)
        above[:, :n] = np.maximum(upper[:, :n] * ahead, -lower[:, :n] * behind)
        efforts = self.limits.as_lesser(total)
        found = np.concatenate([efforts, np.abs(total * v)], axis=-1) if powers else efforts
        return Over(above, slack, found)

    def _tool(self, pieces: Pieces, reach: Bounds) -> Over:
        q, v, _ = np.split(pieces.states, 3, axis=-1)
        squared = self.kinematics.squared_speed(q, v)[..., None]
        with np.errstate(over="ignore", invalid="ignore"):
            magnitude = self.reach.squared_tool_speed(reach)[..., None]
        error, slack = interpolation_errors([magnitude], pieces.states.shape[1])
        above = np.sqrt(hull(np.moveaxis(squared, 1, -1))[1] + error)
        slack /= np.maximum(above, np.sqrt(slack)) + np.finfo(np.float64).tiny  # of the speed, from that of its square
        return Over(above, slack, np.sqrt(squared))

    def _smooth_effort(self, pieces: Pieces, q: Array, v: Array, a: Array) -> Array:
        smooth = self.smooth.of_rows(pieces.owner)
        if self.masses is None:
            return smooth.effort(q, v, a, pieces.segment)
        mass = self.masses[pieces.owner][:, None, None]
        each = smooth.effort_per_kilogram(q, v, a, pieces.segment)
        effort: Array = smooth.unloaded_effort(q, v, a, pieces.segment) + mass * each
        return effort

    def _effort_reach(self, pieces: Pieces, reach: Bounds, *, axes: int = 3) -> Array:
        masses = None if self.masses is None else self.masses[pieces.owner].reshape(-1, *[1] * (axes - 1))
        with np.errstate(over="ignore", invalid="ignore"):
            magnitude: Array = self.reach.effort(reach, masses, pieces.segment)
        return magnitude

    def _add_dry(self, lower: Array, upper: Array, least: Array, greatest: Array, standing: Array) -> None:
        """Widen enclosures of efforts by all possible dry friction, and those of powers where a joint may reverse."""
        n = least.shape[1]
        lowest, highest = dry_range(self.friction, least, greatest, standing)
        lower[:, :n] += lowest
        upper[:, :n] += highest
        if upper.shape[1] == n:
            return
        forward, backward = greatest > standing, least < -standing
        may_stand = (least <= standing) & (greatest >= -standing)
        ahead, behind = self.friction.dry(np.ones(n)), self.friction.dry(-np.ones(n))
        lost = np.maximum(ahead * np.maximum(greatest, 0.0), behind * np.minimum(least, 0.0))
        upper[:, n:] += np.where(forward & backward, lost, 0.0)
        # The polynomial includes the power lost to dry friction, but a joint that counts as at rest loses none.
        at_most = np.where(may_stand & (forward ^ backward), np.maximum(ahead, -behind) * standing, 0.0)
        upper[:, n:] += at_most
        lower[:, n:] -= at_most


def _enclosed(values: list[Array], magnitudes: list[Array]) -> tuple[Array, Array, Array]:
    """Lower and upper bounds over pieces, and their slacks for rounding, (K, Q) each, of Q columns together.

    Args:
        values: at the nodes, shapes (K, N, ...).
        magnitudes: bounds on the ellipses, shapes (K, ellipses, ...).
    """
    found, magnitude = (x[0] if len(x) == 1 else np.concatenate(x, axis=-1) for x in (values, magnitudes))
    if not jit.can_compile():
        error, slack = interpolation_errors([magnitude], found.shape[1])
        lower, upper = hull(np.moveaxis(found, 1, -1))
        return lower - error, upper + error, slack
    cut, rounding = to_bernstein_halves(found.shape[1])
    lower, upper, slack = (np.empty((len(found), found.shape[2])) for _ in range(3))
    errors = interpolation_error(found.shape[1], ELLIPSES)
    enclosures(np.moveaxis(found, 1, -1) @ cut, found, rounding, magnitude, errors, ROUNDING, lower, upper, slack)
    return lower, upper, slack


def motion_bounds(states: Array, degree: int, ellipses: Array = ELLIPSES) -> Bounds:
    """Bounds of motions on ellipses about their pieces, shapes (K, E, n_joints).

    Args:
        states: q, v, a at the nodes of the pieces, shape (K, N, 3 n_joints).
        degree: degree of the motions' polynomials.
        ellipses: sums of their semi-axes, shape (E,); 1 is the piece itself.
    """
    n = states.shape[-1] // 3
    series = np.abs(to_chebyshev(states.shape[1])[: degree + 1] @ states)
    for order in (1, 2):  # terms beyond the degree of a derivative are rounding
        series[:, max(degree + 1 - order, 1) :, order * n : (order + 1) * n] = 0.0
    powers = ellipses[:, None] ** np.arange(degree + 1)
    magnitude = 0.5 * (powers + 1.0 / powers) @ series
    imaginary = 0.5 * (powers - 1.0 / powers) @ series[..., :n]
    q, v, a = np.split(magnitude, 3, axis=-1)
    return Bounds(imaginary, q, v, a)


def dry_range(friction: Friction, least: Array, greatest: Array, standing: Array) -> tuple[Array, Array]:
    """Least and greatest dry friction of joints whose velocities are between bounds, shapes (K, n_joints) [N·m or N].

    Args:
        friction: friction of the robot.
        least: lower bounds of the velocities, shape (K, n_joints) [rad/s or m/s].
        greatest: upper bounds of the velocities, the same shape.
        standing: greatest speeds at which joints count as at rest, the same shape.
    """
    forward, backward = greatest > standing, least < -standing
    may_stand = (least <= standing) & (greatest >= -standing)
    ahead, behind = (friction.dry(np.full(least.shape[1], sign)) for sign in (1.0, -1.0))
    highest = np.where(forward, ahead, np.where(may_stand, 0.0, behind))
    return np.where(backward, behind, np.where(may_stand, 0.0, ahead)), highest


def interpolation_errors(magnitudes: list[Array], size: int) -> tuple[Array, Array]:
    """Bounds of the errors of the interpolating polynomials, rounding included, and those of rounding alone, (K, Q).

    Args:
        magnitudes: bounds on the ellipses, shapes (K, ellipses, ...), Q columns together.
        size: number of nodes of the polynomials.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        magnitude = np.concatenate(magnitudes, axis=-1)
        magnitude = np.where(np.isnan(magnitude), np.inf, magnitude)
        error = (magnitude * interpolation_error(size, ELLIPSES)[:, None]).min(axis=1)
    rounding = ROUNDING * magnitude[:, 0]
    return error + rounding, np.where(np.isfinite(rounding), rounding, 0.0)
