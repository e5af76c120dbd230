"""
What a UR5 holds over its workspace
===================================

Greatest payload held at rest with the tool pointing down, by the tool's place: within the torques of its URDF, in the
best posture found for each cell.
"""

import numpy as np

from trajevo import Pose, ToolPlane, load_robot, plots, workspace_capacity

robot = load_robot("ur5", tool="tool0", limits={"acceleration": np.inf, "jerk": np.inf})
plane = ToolPlane.around(Pose([0.0, 0.11, 0.3], np.diag([1.0, -1.0, -1.0])), "xz", reach=0.9, cells=31)
plots.workspace_capacity(workspace_capacity(robot, plane), width=120)
