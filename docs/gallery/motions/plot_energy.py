"""
What a motion draws from the mains
==================================

Power of every motor over time, and what its energy goes into: motors that brake give energy back to the shared link.
"""

import numpy as np

from trajevo import Dynamics, QuinticSpline, Rollout, ViaPoints, energy_balance, load_robot, plots

drive = {"gear_ratio": 100.0, "torque_constant": 0.1, "winding_resistance": "0.8 ohm", "efficiency_driving": 0.8}
given = {"limits": {"acceleration": np.inf, "jerk": np.inf}, "tool": "tool0"}
names = load_robot("ur5", **given).joint_names
robot = load_robot("ur5", **given, drives={name: drive | {"source": "made up"} for name in names})

points = np.array(
    [[0.0, -1.6, 1.2, -1.2, -1.57, 0.0], [1.0, -0.5, 0.8, -1.9, -1.2, 0.8], [2.0, -1.4, 1.6, -1.8, -1.57, 0.0]]
)
spline = QuinticSpline(ViaPoints(points), duration_bounds=(0.3, 5.0))
x = np.where(np.arange(len(spline.variables)) < 2, 0.9, 0.0)  # two segments of 0.9 s
balance = energy_balance(Rollout(Dynamics(robot), spline(x[None])))
plots.electrical_power(balance, width="page")

# %%
# The same by joint:

plots.energy_uses(balance, width="page")
