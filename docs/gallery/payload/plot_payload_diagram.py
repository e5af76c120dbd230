"""
The makers' diagram, for one's own motion
=========================================

Greatest mass by how far its centre lies off the tool.
"""

import numpy as np

from trajevo import payload_diagram, payload_effort, plots
from trajevo.problems import HybridManipulator, hybrid_manipulator

effort = payload_effort(HybridManipulator().rollout(hybrid_manipulator.paper_solution()))
offsets = np.linspace(0.0, 0.3, 61)  # m, off the tool's axis and along it
plots.payload_contours(payload_diagram(effort, offsets, offsets), width=120)
