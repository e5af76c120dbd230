"""Play motions in closed loop on a simulated robot: :func:`simulate`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.dynamics.rollout import Rollout, rollout_of
from trajevo.errors import InvalidInputError, NoSolutionError
from trajevo.front.front import Front, Solution
from trajevo.front.selection import rows_of
from trajevo.robot.kinematics import ToolKinematics
from trajevo.verification.twin.loop import played
from trajevo.verification.twin.settings import TwinSettings
from trajevo.verification.twin.simulated_front import SimulatedFront
from trajevo.verification.twin.simulation import Simulation

if TYPE_CHECKING:
    from trajevo.solvers.gradient.weighted_sum import WeightedOptimum

#: Motions that are played together: more take memory and no less time.
_TOGETHER = 50


def simulate(
    motion: Front | Solution | Rollout | WeightedOptimum,
    *,
    controller: str = "computed_torque",
    rate: float = 1000.0,
    natural_frequency: Any = 50.0,
    damping_ratio: Any = 1.0,
    resolution: Any = 0.0,
    noise: Any = 0.0,
    delay: float = 0.0,
    payload_error: float = 0.0,
    seed: int = 1,
    tolerance: float = 1e-3,
    settle: float = 1.0,
    step: float | None = None,
    rows: Sequence[int] | Array | None = None,
) -> Simulation | SimulatedFront:
    """Play a motion, or every motion of a front, in closed loop on the robot in MuJoCo, and tell what comes of it.

    The robot starts where the motion does, follows it, and is held at its end while it settles. Its joints have the
    friction and armature of the robot, and efforts end at the robot's limits. Controllers are those of
    :mod:`trajevo.verification.twin.controllers`; the plant is that of :mod:`trajevo.verification.twin.plant`.

    Args:
        motion: a front, a solution, an optimum, or a rollout, of which the first motion is played.
        controller: ``"computed_torque"`` or ``"pd"``.
        rate: how often the controller measures and acts [Hz]; in between, efforts are held.
        natural_frequency: of the error's decay, one number or one for each joint [rad/s].
        damping_ratio: of that decay, one number or one for each joint [1].
        resolution: step of the encoders, one number or one for each joint [rad or m]; 0 for none.
        noise: standard deviation of the measured positions, one number or one for each joint [rad or m].
        delay: from measuring to acting [s], in whole integration steps.
        payload_error: how much more payload the controller believes in than is carried, as a share of its mass [1].
        seed: seed of the noise, which is the same for every motion.
        tolerance: distance of the tool from where the motion ends within which it is settled [m].
        settle: how long it is watched after the end [s].
        step: integration step [s]; the longest that is not above 1 ms, or 0.25 ms with dry friction, if None. It is
            made shorter so that whole steps fill a period.
        rows: solutions of a front that are played, such as those of ``front.thinned(100)``, no unit; all if None.

    Returns:
        Of one motion a :class:`~trajevo.verification.twin.simulation.Simulation`, of a front a
        :class:`~trajevo.verification.twin.simulated_front.SimulatedFront`; a motion of a front comes out as it does
        alone.

    Raises:
        UnknownNameError: no such controller.
        NoSolutionError: the front is empty.
        InvalidInputError: MuJoCo is not installed, a number that is not in its range, or a robot or a load that is not
            simulated: links without mass, joints that follow others, loads that change or have no inertia.
    """
    settings = TwinSettings(
        controller=controller,
        rate=rate,
        natural_frequency=natural_frequency,
        damping_ratio=damping_ratio,
        resolution=resolution,
        noise=noise,
        delay=delay,
        payload_error=payload_error,
        seed=seed,
        tolerance=tolerance,
        settle=settle,
        step=step,
    )
    if isinstance(motion, Front):
        return _simulated_front(motion, settings, rows)
    if rows is not None:
        raise InvalidInputError(f"rows: expected a front with them, got {type(motion).__name__}")
    return next(_simulations(rollout_of(motion).rows(slice(0, 1)), settings))


def _simulated_front(front: Front, settings: TwinSettings, rows: Any) -> SimulatedFront:
    """Rows of a front in closed loop, all if None."""
    if not len(front):
        raise NoSolutionError(f"the front is empty: {front.blocking}")
    chosen = np.arange(len(front)) if rows is None else rows_of(rows, len(front))
    if isinstance(chosen, int) or not len(chosen):
        raise InvalidInputError(f"rows: expected several rows of the front, got {rows!r}")
    rollout, found = front.rollouts_of(chosen), []
    together = _TOGETHER if rollout.dynamics.gravity is None else 1  # a world has one gravity
    for begin in range(0, len(chosen), together):
        for one in _simulations(rollout.rows(slice(begin, begin + together)), settings):
            found.append({name: getattr(one, name) for name in _BY_MEMBER})
    step = settings.period / settings.steps(dry=rollout.robot.friction.is_dry)
    columns = {name: frozen(np.array([each[name] for each in found])) for name in _BY_MEMBER}
    return SimulatedFront(front=front, rows=frozen(chosen), settings=settings, integration_step=step, **columns)


#: What a simulated front has of each of its motions.
_BY_MEMBER = (
    "settling",
    "energy",
    "greatest_tool_error",
    "rms_tool_error",
    "greatest_error",
    "rms_error",
    "used",
    "saturation",
)


def _simulations(rollout: Rollout, settings: TwinSettings) -> Iterator[Simulation]:
    """The motions of a rollout, played together."""
    robot, found = rollout.robot, played(rollout, settings)
    tool = ToolKinematics.of(robot)
    for row, count in enumerate(found.counts.tolist()):
        q, reference = found.q[row, :count], found.reference[row, :count]
        gone: Array = np.asarray(~np.isfinite(q).all(axis=1))
        away = tool.pose(np.where(gone[:, None], reference, q))[0] - tool.pose(reference)[0]
        yield Simulation(
            robot=robot,
            settings=settings,
            duration=float(rollout.trajectory.duration[row]),
            t=frozen(found.t[:count].copy()),
            reference=frozen(reference.copy()),
            q=frozen(q.copy()),
            effort=frozen(found.effort[row, :count].copy()),
            saturated=frozen(found.saturated[row, :count].copy()),
            tool_error=frozen(np.where(gone, np.inf, np.sqrt((away**2).sum(axis=1)))),
            integration_step=settings.period / settings.steps(dry=robot.friction.is_dry),
        )
