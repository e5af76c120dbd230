"""
Where the centre of mass may lie
================================

For some masses, all places of the centre in a plane of the tool that the motion carries.
"""

from trajevo import allowed_regions, payload_effort, plots
from trajevo.problems import HybridManipulator, hybrid_manipulator

effort = payload_effort(HybridManipulator().rollout(hybrid_manipulator.paper_solution()))
plots.allowed_region(allowed_regions(effort, [4.0, 8.0, 10.0, 11.5], within=0.3, axis="y"), width=120)
