"""
A front and its knee
====================

Time, acceleration and jerk of an X-Y pointing mechanism (Sun 2020): each dot is a motion through the same five
directions that no other beats in everything. The knee is where a little more of one costs much of another.
"""

from trajevo import optimise, plots
from trajevo.problems import PointingMechanism

front = optimise(PointingMechanism(), generations=100, seed=1)
plots.front(front, mark=front.knee(), width="page")
