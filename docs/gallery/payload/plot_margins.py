"""
What is left at each instant
============================

How much more each actuator could carry, by time: the least over all is the capacity of the motion.
"""

from trajevo import dlcc, plots
from trajevo.problems import HybridManipulator, hybrid_manipulator

motion = HybridManipulator().rollout(hybrid_manipulator.paper_solution())
plots.capacity_margins(dlcc(motion), width="page")
