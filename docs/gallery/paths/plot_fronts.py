"""
Two ways to one front
=====================

Normal constraints with SQP, and NSGA-II with polish, on the S-shaped path.
"""

from trajevo import optimise, plots, solve_nnc
from trajevo.problems import TimeJerkReparameterisation

problem = TimeJerkReparameterisation(path="s")
plots.fronts(
    {
        "NSGA-II, polished": optimise(problem, seed=1, generations=60),
        "normal constraints": solve_nnc(problem, points=15),
    },
    width=120,
)
