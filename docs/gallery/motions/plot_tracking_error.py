"""
How far joint splines leave a line of the tool
==============================================

The tool should follow a straight line through eleven points; between them a spline of the joints leaves it by 0.29 mm.
"""

import numpy as np

from trajevo import plots
from trajevo.problems import HybridManipulator, hybrid_kinematics, hybrid_manipulator

motion = HybridManipulator().rollout(hybrid_manipulator.paper_solution()).trajectory.sample(2000)
error = hybrid_kinematics.tracking_error(hybrid_kinematics.forward_kinematics(motion.q[0])[0])  # m
print(f"greatest {1e3 * error.max():.4f} mm, standard deviation {1e3 * np.std(error):.4f} mm")
plots.tracking_error(motion.t[0], error, width=120)
