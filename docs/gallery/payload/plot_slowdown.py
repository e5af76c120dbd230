"""
How slowly a heavier load must go
=================================

Least time along the same path by payload, in closed form; the dashed line is what can be held at rest.
"""

from trajevo import plots, slowdown_curve
from trajevo.problems import HybridManipulator, hybrid_manipulator

motion = HybridManipulator().rollout(hybrid_manipulator.paper_solution())
plots.slowdown_curve(slowdown_curve(motion), width=120)
