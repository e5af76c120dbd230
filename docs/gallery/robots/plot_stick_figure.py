"""
An arm by its joints
====================

A PUMA 560 at eight instants of a pick and place; a picture for a paper that needs no meshes.
"""

from trajevo import plots
from trajevo.problems import PickAndPlace

problem = PickAndPlace(payload=2.5)
motion = problem.rollout([[2.0, 4.0, 3.0]])  # s, the times of Raji 2022
plots.stick_figure(motion, width=120)
