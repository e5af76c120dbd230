"""
Which limit binds, by the pace
==============================

A UR5-like arm on a stand, with a gripper, made faster and slower along one path with a second of rest: what it carries
by each limit alone, and by all of them. Torque constants and gear ratio are those that Raviola et al. 2021 print,
second-hand; all else is assumed.
"""

import numpy as np

from trajevo import (
    Dynamics,
    Grip,
    Payload,
    QuinticSpline,
    Rollout,
    Stand,
    ViaPoints,
    capacity_by_pace,
    load_robot,
    plots,
)

limits = {"acceleration": np.inf, "jerk": np.inf}
bare = load_robot("ur5", limits=limits, tool="tool0")
drives = {}
for name, peak, constant, stiffness in zip(
    bare.joint_names,
    bare.limits.effort,
    [0.1350, 0.1361, 0.1355, 0.0957, 0.0865, 0.0893],  # N·m/A
    [4e4, 4e4, 3e4, 1e4, 1e4, 1e4],  # N·m/rad
    strict=True,
):
    drives[name] = {
        "torque_speed": [["0 rad/s", peak], ["2 rad/s", peak], ["4 rad/s", 0.0]],
        "continuous_torque": 0.5 * peak,
        "gear_ratio": 101.0,
        "torque_constant": constant,
        "winding_resistance": "0.5 ohm",
        "thermal_resistance": "1.5 K/W",
        "thermal_time_constant": "900 s",
        "greatest_rise": "80 K",
        "stiffness": stiffness,
    }
corners = [[x, y, -0.8] for x, y in ((0.3, 0.3), (-0.3, 0.3), (-0.3, -0.3), (0.3, -0.3))]
robot = load_robot(
    "ur5",
    limits=limits,
    tool="tool0",
    drives=drives,
    grip=Grip(force_per_finger=150.0, friction=0.4, safety=1.5),
    stand=Stand(mass=90.0, com=(0.0, 0.0, -0.4), footprint=corners),
)
points = [[0.0, -1.2, 1.4, -1.7, -1.57, 0.0], [1.0, -0.9, 1.2, -1.9, -1.2, 0.8], [2.0, -1.3, 1.6, -1.8, -1.57, 0.0]]
spline = QuinticSpline(ViaPoints(np.array(points)), duration_bounds=(0.3, 5.0))
x = np.zeros(len(spline.variables))
x[:2] = 0.9  # two segments of 0.9 s
motion = Rollout(Dynamics(robot, Payload(5.0)), spline(x[None]))
paces = capacity_by_pace(motion, deviation=3.5e-3, dwell=1.0)
print(paces)
plots.what_binds(paces, width=120)
