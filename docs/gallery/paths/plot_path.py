"""
Speed along an airfoil
======================

Time and jerk along a path that must not move (Paing 2021): the best trade-off on the GEMINI airfoil, its speed as
colour.
"""

from trajevo import plots, solve_nnc
from trajevo.problems import TimeJerkReparameterisation

front = solve_nnc(TimeJerkReparameterisation(path="gemini"), points=9)
plots.path(front.utopia(), width="page")
