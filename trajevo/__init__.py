"""Multi-objective evolutionary trajectory optimisation and payload capacity for robots."""

from trajevo.errors import TrajevoError
from trajevo.front import Front, Solution
from trajevo.optimise import optimise
from trajevo.path import ViaPoints
from trajevo.problem import TrajectoryProblem, load_problem
from trajevo.robot import JointLimits, Robot, load_robot
from trajevo.trajectory import Motion, TrajectoryBatch

__all__ = [
    "Front",
    "JointLimits",
    "Motion",
    "Robot",
    "Solution",
    "TrajectoryBatch",
    "TrajectoryProblem",
    "TrajevoError",
    "ViaPoints",
    "load_problem",
    "load_robot",
    "optimise",
]
