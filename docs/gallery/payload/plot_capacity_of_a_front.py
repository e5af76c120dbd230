"""
What every solution of a front can carry
========================================

Slower motions carry more, up to what can be held at rest.
"""

from trajevo import capacities, optimise, plots
from trajevo.problems import HybridManipulator

front = optimise(HybridManipulator(payload=10.0), generations=60, seed=1, polish=False)
plots.front_capacities(capacities(front), width=120)
