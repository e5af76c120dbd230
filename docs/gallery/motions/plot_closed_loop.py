"""
How far a controlled arm is from its motion
===========================================

A UR5 with 5 kg under PD control with gravity compensated, played in MuJoCo; the dotted line is where the motion ends.
"""

import numpy as np

from trajevo import Dynamics, Payload, QuinticSpline, Rollout, ViaPoints, load_robot, plots, simulate

robot = load_robot("ur5", limits={"acceleration": np.inf, "jerk": np.inf}, tool="tool0")
points = [[0.0, -1.2, 1.4, -1.7, -1.57, 0.0], [1.0, -0.9, 1.2, -1.9, -1.2, 0.8], [2.0, -1.3, 1.6, -1.8, -1.57, 0.0]]
spline = QuinticSpline(ViaPoints(np.array(points)), duration_bounds=(0.3, 5.0))
x = np.zeros((1, len(spline.variables)))
x[0, :2] = 0.9  # two segments of 0.9 s
motion = Rollout(Dynamics(robot, Payload(5.0)), spline(x))
plots.closed_loop(simulate(motion, controller="pd", settle=0.4))
