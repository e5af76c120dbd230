"""
How a search gets on
====================

Hypervolume by generation: the share of a box of objectives that the front dominates. When it stays level, more
generations gain nothing.
"""

from trajevo import optimise, plots
from trajevo.problems import PointingMechanism

front = optimise(PointingMechanism(), generations=200, seed=1, polish=False)
plots.hypervolume(front, width=120)
