"""
Optimised again for each payload
================================

The least time of the best motion for each payload, not of one motion slowed down.
"""

from trajevo import capacity_front, plots
from trajevo.problems import HybridManipulator

problem = HybridManipulator(payload_model="weight_only", payload_bounds=(0.0, 13.0), duration_bounds=(0.002, 3.0))
curve = capacity_front(problem, [0.0, 4.0, 8.0, 10.0, 12.0], seed=1)
plots.payload_curve(curve, width=120)
