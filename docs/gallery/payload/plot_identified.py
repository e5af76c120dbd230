"""
A payload from a log
====================

What six seconds of torques with 1 % of noise tell of a load: its ten parameters with their 95 % intervals, and the load
that made the log. The log is simulated.
"""

import numpy as np

from trajevo import Dynamics, Payload, identify_payload, load_robot, plots

robot = load_robot("ur5", limits={"acceleration": 20.0, "jerk": 1e3}, tool="tool0")
inertia = ((0.02, 0.002, 0.001), (0.002, 0.03, -0.003), (0.001, -0.003, 0.025))
load = Payload(2.3, (0.03, -0.02, 0.08), inertia)

rng = np.random.default_rng(1)
time = np.linspace(0.0, 6.0, 500)
turn = 2.0 * np.pi / 6.0 * np.arange(1, 5)
size = rng.normal(size=(4, 6)) * (0.5 / np.arange(1, 5))[:, None]
angle = time[:, None] * turn
q, v, a = np.sin(angle) @ size, (np.cos(angle) * turn) @ size, -(np.sin(angle) * turn**2) @ size
effort = Dynamics(robot, load).effort(q, v, a)
effort += 0.01 * np.abs(effort).max(axis=0) * rng.normal(size=effort.shape)
position = q + 2e-5 * rng.normal(size=q.shape)

found = identify_payload({"time": time, "position": position, "effort": effort}, robot)
print(found)
plots.identified_payload(found, load)
