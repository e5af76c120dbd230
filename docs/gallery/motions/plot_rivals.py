"""
The septic and its rivals
=========================

Interpolants through the same four points at their least times under the same limits, with what each costs
(Raji 2022).
"""

from trajevo import plots, rivals_of
from trajevo.problems import PickAndPlace

problem = PickAndPlace(payload=2.5)
plots.plot_rivals(rivals_of(problem), width="page")
