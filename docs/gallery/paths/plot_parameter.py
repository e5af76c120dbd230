"""
How the path's parameter runs
=============================

The map from time to the path's parameter, a B-spline whose rises are the variables: three of a front.
"""

from trajevo import plots, solve_nnc
from trajevo.problems import TimeJerkReparameterisation

front = solve_nnc(TimeJerkReparameterisation(path="s"), points=9)
three = {"fastest": front.least("time"), "nearest to utopia": front.utopia(), "smoothest": front.least("jerk")}
plots.parameter(three, width=120)
