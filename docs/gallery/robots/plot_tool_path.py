"""
The tool in space
=================

The path of a UR5's tool at the knee of a front, with the points that it must visit.
"""

from trajevo import load_robot, optimise, plots
from trajevo.problems import ViaPointProblem

robot = load_robot("ur5", tool="tool0", limits={"acceleration": 12.0, "jerk": 120.0})  # rad/s², rad/s³
points = [{"position": [0.45, y, 0.2], "rpy": [3.141592653589793, 0.0, 0.0]} for y in (-0.25, 0.0, 0.25)]
problem = ViaPointProblem(robot=robot, points=points, payload=3.0, constraints=("velocity", "acceleration", "effort"))
best = optimise(problem, seed=1, generations=40, population=40).knee()
plots.tool_path(best, width=120)
