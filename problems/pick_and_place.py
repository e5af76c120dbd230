"""Pick and place with the PUMA 560 (Raji et al. 2022), and the optimisation that the paper leaves as future work.

Symbols are the paper's: q joint angles [rad], T times between points [s]. What can be reproduced, and the errata:
docs/papers/raji2022.md.
"""

from __future__ import annotations

from typing import Any, ClassVar, final

import numpy as np

from trajevo.base.arrays import Array, numbers
from trajevo.base.plain import plain_data
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.errors import checked_name
from trajevo.formulation.constraints.constraint import Limited
from trajevo.formulation.constraints.kinds import constraints_of
from trajevo.formulation.objectives import objectives_of
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.formulation.search import Search
from trajevo.path.via_points import joint_points
from trajevo.robot.payload import Payload
from trajevo.robot.robot import load_robot
from trajevo.trajectory.interpolants import THROUGH_POINTS

from .puma_kinematics import TABLE_1_JOINTS

#: Times between the four points of the paper's motion, section 3.2 [s].
PAPER_TIMES = (2.0, 4.0, 3.0)

#: Least and greatest time between two points [s]; the paper prints none.
DURATION_BOUNDS = (0.5, 6.0)

#: Centre of mass of the load in the flange's frame [m].
PAYLOAD_COM = (0.0, 0.0, 0.1)

#: Far corner of the hypervolume's box: time [s], Σ RMS jerk [rad/s³], energy [J].
REFERENCE_POINT = (20.0, 20.0, 800.0)

#: Limits that always apply; position limits depend on an argument.
_LIMITS = ("velocity", "acceleration", "jerk", "effort")


@final
class PickAndPlace(TrajectoryProblem):
    """Time, jerk and energy of the PUMA 560 from take to place, through lift and unload.

    The paper fixes the times and compares velocities by eye; here the times are the variables. Energy is ∫ Σ |τ q̇| dt
    with friction and payload. Limits hold at exact peaks, those of torque at samples, or at every instant with
    ``limits="certified"``.

    Args:
        interpolant: ``"septic"``, the single polynomial, or one of
            :data:`trajevo.trajectory.interpolants.THROUGH_POINTS`.
        payload: mass [kg] with its centre 0.1 m in front of the flange, a :class:`~trajevo.robot.payload.Payload`, or
            its settings.
        points: joint angles (K, 6) [rad] or a CSV file of them; Table 1 if None.
        duration_bounds: least and greatest time between two points [s].
        position_limits: keep the joints' ranges, widened so that they contain Table 1; the septic swings far beyond its
            points.
        overshoot: how far a joint may leave the range of the points [rad]; not limited if None.
        limits: how torque limits are checked, ``"sampled"`` or ``"certified"``, see
            :mod:`trajevo.formulation.constraints.certified`.
        samples: instants per segment at which torque is computed, both ends included.
        threads: number of threads that evaluate populations; it does not affect the results.

    Raises:
        UnknownNameError: no such interpolant or limits.
        InvalidInputError: points out of range, or bad bounds, payload or samples.
    """

    registered_name: ClassVar[str] = "pick-place"
    title: str = "PUMA 560 pick and place: time, jerk, energy (Raji 2022)"
    evolution: Search = Search(
        population=100,
        generations=100,
        crossover_probability=0.9,
        crossover_index=15.0,
        mutation_probability=1.0 / 3.0,
        mutation_index=20.0,
    )
    compares_rivals: ClassVar[bool] = True

    def __init__(
        self,
        *,
        interpolant: str = "septic",
        payload: float | Payload | dict[str, Any] = 2.5,
        points: Any = None,
        duration_bounds: tuple[float, float] = DURATION_BOUNDS,
        position_limits: bool = True,
        overshoot: float | None = None,
        limits: str = "sampled",
        samples: int = 40,
        threads: int = 1,
    ) -> None:
        smooth = {
            name: made for name, made in THROUGH_POINTS.items() if getattr(made, "continuous", 2) > 1
        }  # jerk is an objective
        known = {"septic": THROUGH_POINTS["polynomial"]} | smooth
        checked_name("interpolant", interpolant, known)
        robot = load_robot("puma560")
        via = joint_points(TABLE_1_JOINTS if points is None else points, robot)
        bounds = tuple(numbers(duration_bounds, name="duration_bounds", shape=(2,)).tolist())
        names = ("position", *_LIMITS) if position_limits else _LIMITS
        decoder = known[interpolant](via, duration_bounds=bounds)
        super().__init__(
            dynamics=Dynamics(robot, _carried(payload), samples=samples, threads=threads),
            interpolant=decoder,
            objectives=objectives_of(("time", "jerk", "energy"), robot, reference="Raji 2022, section 5, future work"),
            constraints=constraints_of(names, Limited(robot, via, decoder), overshoot=overshoot, limits=limits),
            reference_point=REFERENCE_POINT,
        )
        given = {
            "interpolant": interpolant,
            "payload": self.dynamics.payload.settings,
            "points": via.positions.tolist(),
            "duration_bounds": list(bounds),
            "position_limits": bool(position_limits),
            "overshoot": overshoot,
            "limits": limits,
            "samples": self.dynamics.samples,
            "threads": self.dynamics.threads,
        }
        self._settings: dict[str, Any] = plain_data("settings", given)

    @property
    def settings(self) -> dict[str, Any]:
        """Keyword arguments that make an equal problem."""
        return dict(self._settings)


def paper_solution() -> Array:
    """Times of the paper's motion, shape (1, 3) [s]."""
    return np.array([PAPER_TIMES])


def _carried(payload: float | Payload | dict[str, Any]) -> Payload:
    bare = not isinstance(payload, Payload | dict)
    found = Payload.of(payload, model=None)
    return Payload(found.mass, PAYLOAD_COM) if bare else found
