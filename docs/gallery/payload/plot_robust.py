"""
A load that is not known well
=============================

What the motion carries wherever the centre of mass is within a tolerance.
"""

from trajevo import payload_effort, plots, robust_curve
from trajevo.problems import HybridManipulator, hybrid_manipulator

effort = payload_effort(HybridManipulator().rollout(hybrid_manipulator.paper_solution()))
plots.robust_mass(robust_curve(effort, com=(0.0, 0.0, 0.05), within=0.1), width=120)
