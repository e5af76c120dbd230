"""
Which weights choose which motion
=================================

All weights of time, acceleration and jerk are a triangle. Colours are the time of the motion that their weighted sum
chooses; the line is around all weights that choose the same as the star, twice as much for time as for the others.
"""

from trajevo import optimise, plots
from trajevo.problems import PointingMechanism

front = optimise(PointingMechanism(), generations=60, seed=1, polish=False)
few = front[front.thinned(40)]
plots.weight_map(few, few.stability({"time": 2, "acceleration": 1, "jerk": 1}))
