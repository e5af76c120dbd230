"""
Three objectives in space
=========================

The same kind of front with all three objectives [s, °/s², °/s³] at once.
"""

from trajevo import optimise, plots
from trajevo.problems import PointingMechanism

front = optimise(PointingMechanism(interpolant="quintic"), generations=100, seed=1)
plots.front_3d(front, mark=front.knee(), width=120)
