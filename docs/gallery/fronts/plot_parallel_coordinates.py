"""
Four objectives side by side
============================

A five-joint manipulator (Guo 2016) with time, squared power, jerk and acceleration: each line is a motion, from its
least (bottom) to its greatest value (top) of each objective.
"""

from trajevo import optimise, plots
from trajevo.problems import HybridManipulator

front = optimise(HybridManipulator(payload=10.0), generations=60, seed=1, polish=False)
plots.parallel_coordinates(front, mark=front.weighted(), width="page")
