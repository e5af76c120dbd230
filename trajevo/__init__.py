"""Multi-objective evolutionary trajectory optimisation and payload capacity for robots."""

from trajevo.curve import GeometricPath
from trajevo.errors import TrajevoError
from trajevo.front import Front, Solution
from trajevo.optimise import optimise
from trajevo.path import ViaPoints
from trajevo.payload import Payload
from trajevo.piecewise import PolynomialBatch
from trajevo.problem import TrajectoryProblem
from trajevo.registry import load_problem
from trajevo.robot import JointLimits, Robot, load_robot
from trajevo.runs import read_run, resume
from trajevo.scene import Scene
from trajevo.task import load_task
from trajevo.trajectory import Motion, TrajectoryBatch

__all__ = [
    "Front",
    "GeometricPath",
    "JointLimits",
    "Motion",
    "Payload",
    "PolynomialBatch",
    "Robot",
    "Scene",
    "Solution",
    "TrajectoryBatch",
    "TrajectoryProblem",
    "TrajevoError",
    "ViaPoints",
    "load_problem",
    "load_robot",
    "load_task",
    "optimise",
    "read_run",
    "resume",
]
