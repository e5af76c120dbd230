"""Multi-objective evolutionary trajectory optimisation and payload capacity for robots."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from trajevo.curve import GeometricPath
    from trajevo.errors import TrajevoError
    from trajevo.front import Front, Solution
    from trajevo.optimiser import optimise
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

#: Modules by what they hold; each is imported when somebody asks for it, so that the command line answers at once.
_HOMES = {
    "curve": ("GeometricPath",),
    "errors": ("TrajevoError",),
    "front": ("Front", "Solution"),
    "optimiser": ("optimise",),
    "path": ("ViaPoints",),
    "payload": ("Payload",),
    "piecewise": ("PolynomialBatch",),
    "problem": ("TrajectoryProblem",),
    "registry": ("load_problem",),
    "robot": ("JointLimits", "Robot", "load_robot"),
    "runs": ("read_run", "resume"),
    "scene": ("Scene",),
    "task": ("load_task",),
    "trajectory": ("Motion", "TrajectoryBatch"),
}
_HOME = {name: module for module, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'trajevo' has no attribute {name!r}")
    value = getattr(importlib.import_module(f"trajevo.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
