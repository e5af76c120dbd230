"""
A motion inside its limits
==========================

Position, velocity, acceleration and jerk of the knee. Dashed lines are limits; the greatest values between the
instants drawn are computed exactly, too.
"""

from trajevo import optimise, plots
from trajevo.problems import PointingMechanism

best = optimise(PointingMechanism(), generations=100, seed=1).knee()
plots.profiles(best, width="page")
