"""
What it carries, by speed and duty
==================================

A line for each share of the time in motion; a marker tells what binds: heat, deviation, slip or torque at speed.
"""

import numpy as np

from trajevo import Dynamics, Payload, QuinticSpline, Rollout, ViaPoints, capacity_study, load_robot, plots

points = [[0.0, -1.2, 1.4, -1.7, -1.57, 0.0], [1.0, -0.9, 1.2, -1.9, -1.2, 0.8], [2.0, -1.3, 1.6, -1.8, -1.57, 0.0]]
spline = QuinticSpline(ViaPoints(np.array(points)), duration_bounds=(0.3, 5.0))
x = np.zeros(len(spline.variables))
x[:2] = 0.9
motion = Rollout(Dynamics(load_robot("ur5_drives"), Payload(3.0)), spline(x[None]))
study = capacity_study(
    motion, speeds=np.linspace(0.3, 1.4, 12), duties=[0.6, 0.8, 1.0], deviation=2.5e-3, counted="payload"
)
plots.payload_by_duty(study, width=120)
