"""A fast motion to begin with: the least time under limits of velocity and acceleration, its acceleration smoothed.

Where jerk is limited, positions are averaged over the time in which an acceleration may rise to its limit. Where it is
not, they are averaged over one piece of u(t), since that is as fast as its acceleration can change: such a motion takes
about 1 % longer than the fastest one, if there are pieces enough.
"""

from __future__ import annotations

import numpy as np

from trajevo.base.arrays import Array
from trajevo.path.curve import GeometricPath
from trajevo.robot.joints import JointLimits
from trajevo.solvers.along_path.instants import HELD
from trajevo.solvers.along_path.reachability import greatest_squares
from trajevo.trajectory.pace.path_pace import averaged, squared_speed, window
from trajevo.trajectory.parameterisation import uniform_knots

#: Number of stations of the forward and the backward pass.
_STATIONS = 1_001


def begun(path: GeometricPath, limits: JointLimits, count: int, order: int) -> Array:
    """Control points of a fast u(t), at rest at both ends, shape (count,).

    Each is the value at the mean of its knots (Schoenberg 1967), so that they increase as u does.
    """
    knots = uniform_knots(order, count)
    means = np.array([knots[place + 1 : place + order].mean() for place in range(count)])
    if (np.isfinite(limits.velocity) | np.isfinite(limits.acceleration)).any():
        limited = (np.isfinite(limits.acceleration) & np.isfinite(limits.jerk)).any()
        u = _paced(path, limits, means) if limited else _jumping(path, limits, means, count - order + 1)
    else:
        u = means**3 * (10.0 - 15.0 * means + 6.0 * means**2)
    u = np.maximum.accumulate(np.clip(u, 0.0, 1.0))
    u[:HELD], u[-HELD:] = 0.0, 1.0
    return u


def _paced(path: GeometricPath, limits: JointLimits, t: Array) -> Array:
    """Values of u at instants of unit time, with limited jerk."""
    stations = np.linspace(0.0, 1.0, _STATIONS)
    squared = squared_speed(
        np.diff(stations), path(stations, 1), path(stations, 2), limits.velocity, limits.acceleration
    )
    instants = _instants(stations, squared)
    width = window(limits.acceleration, limits.jerk, instants[-1])
    return averaged(instants, stations, t * (instants[-1] + width), width)


def _jumping(path: GeometricPath, limits: JointLimits, t: Array, pieces: int) -> Array:
    """Values of u at instants of unit time, its acceleration as steep as so many pieces allow.

    Near the ends, where u grows with the square of the time, stations are closer in the same way.
    """
    stations = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, _STATIONS))
    squared = greatest_squares(
        np.diff(stations), path(stations, 1), path(stations, 2), limits.velocity, limits.acceleration
    )
    instants = _instants(stations, squared)
    width = instants[-1] / pieces
    return averaged(instants, stations, t * (instants[-1] + width), width)


def _instants(stations: Array, squared: Array) -> Array:
    """When stations are reached, with accelerations that are constant in between [s]."""
    steps = 2.0 * np.diff(stations) / (np.sqrt(squared[:-1]) + np.sqrt(squared[1:]))
    return np.append(0.0, np.cumsum(steps))
