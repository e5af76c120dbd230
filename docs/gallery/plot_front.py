"""
A front
=======

Every point is a motion of the pointing mechanism; none is better than another in all objectives.
"""

from trajevo import optimise, plots
from trajevo.problems import PointingMechanism

front = optimise(PointingMechanism(), seed=1, generations=40, population=40, progress=False)
plots.front(front, mark=front.knee())
