"""
The paper's iteration and the closed form
=========================================

Guo 2016 raises the payload step by step until an actuator is at its limit; torque is affine in the mass, so a closed
form gives the same in one step.
"""

from trajevo import dlcc_iterative, plots
from trajevo.problems import HybridManipulator, hybrid_manipulator

motion = HybridManipulator().rollout(hybrid_manipulator.paper_solution())
plots.dlcc_iteration(dlcc_iterative(motion, step=0.5), width=120)
