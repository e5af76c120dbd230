"""Drake's reachability analysis on the same path with the same limits of velocity and acceleration."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, final

import numpy as np

from trajevo.path.curve import GeometricPath
from trajevo.robot.robot import Robot
from trajevo.study.bench.along_path import STATIONS, PathProfile, PathRival, limits_of


@final
class Drake(PathRival):
    """The least time along a fixed path, limits kept at stations and by their interpolation between them."""

    name = "drake"
    says = f"Toppra of Drake at {STATIONS} stations of a fixed path, jerk not limited"
    module, distribution, install = "pydrake", "drake", "pip install drake"

    def prepare(self) -> None:
        """See :meth:`BenchRival.prepare`; what Drake loads takes longer than what it solves."""
        import pydrake.multibody.optimization
        import pydrake.multibody.plant
        import pydrake.trajectories  # noqa: F401

    def profiles(self, robot: Robot, path: GeometricPath) -> Iterable[PathProfile]:
        """See :meth:`PathRival.profiles`."""
        yield by_drake(robot, path)


def by_drake(robot: Robot, path: GeometricPath) -> PathProfile:
    """The least time along a path; without limits of effort any plant of as many joints will do.

    Raises:
        ValueError: Drake finds no motion.
    """
    from pydrake.math import BsplineBasis
    from pydrake.multibody.optimization import Toppra
    from pydrake.trajectories import BsplineTrajectory

    basis = BsplineBasis(path.order, list(path.knots))
    curve = BsplineTrajectory(basis, [point[:, None] for point in np.array(path.control_points)])
    stations = np.linspace(0.0, 1.0, STATIONS)
    solver = Toppra(curve, _sliders(path.n_axes), stations)
    velocity, acceleration, _ = limits_of(robot)
    solver.AddJointVelocityLimit(-velocity, velocity)
    solver.AddJointAccelerationLimit(-acceleration, acceleration)
    found = solver.SolvePathParameterization(0.0, 0.0)
    if found is None:
        raise ValueError("no motion was found")
    speeds = np.array([found.EvalDerivative(t, 1)[0, 0] for t in found.get_segment_times()])
    return PathProfile.linear_square(float(found.end_time()), stations, speeds**2)


def _sliders(count: int) -> Any:
    """A plant of sliding joints without mass."""
    from pydrake.multibody.plant import MultibodyPlant
    from pydrake.multibody.tree import PrismaticJoint, SpatialInertia

    plant = MultibodyPlant(0.0)
    for k in range(count):
        body = plant.AddRigidBody(f"body_{k}", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
        plant.AddJoint(PrismaticJoint(f"axis_{k}", plant.world_frame(), body.body_frame(), np.eye(3)[0]))
    plant.Finalize()
    return plant
