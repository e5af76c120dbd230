"""
How much of each actuator a motion takes
========================================

Forces and torques of a five-joint manipulator with 10 kg, as shares of their limits, at the times that Guo 2016 prints.
"""

from trajevo import plots
from trajevo.problems import HybridManipulator, hybrid_manipulator

motion = HybridManipulator(payload=10.0).rollout(hybrid_manipulator.paper_solution())
plots.effort_utilisation(motion, width="page")
