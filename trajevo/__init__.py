"""Multi-objective evolutionary trajectory optimisation and payload capacity for robots.

Everything that users need is here, in :mod:`trajevo.plots` and in :mod:`trajevo.problems`.
"""

from __future__ import annotations

import gc
import importlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from trajevo import plots
    from trajevo.capacity.accuracy.full_capacity import full_capacity, tool_deviation
    from trajevo.capacity.accuracy.paces import capacity_by_pace
    from trajevo.capacity.dlcc import capacities, dlcc, dlcc_iterative, dlcc_sampled
    from trajevo.capacity.drives.drive_capacity import drive_capacity, drive_load
    from trajevo.capacity.drives.energy import energy_balance
    from trajevo.capacity.drives.fitting import fit_drives
    from trajevo.capacity.duty.capacity_study import capacity_study
    from trajevo.capacity.identification.identify import identify_payload
    from trajevo.capacity.payload_diagram import allowed_centres, allowed_regions, payload_diagram
    from trajevo.capacity.payload_effort import payload_bounds, payload_effort
    from trajevo.capacity.payload_time import capacity_front, largest_payload, max_payload_problem
    from trajevo.capacity.robust import robust_capacity, robust_curve, robust_slowdown, worst_case
    from trajevo.capacity.sensitivity import sensitivity
    from trajevo.capacity.slowdown import slowdown_curve, slowdown_for
    from trajevo.capacity.uncertainty import price_along_path, price_of_uncertainty, robust_problem
    from trajevo.capacity.workspace import ToolPlane, workspace_capacity
    from trajevo.dynamics.inverse_dynamics import Dynamics
    from trajevo.dynamics.rollout import Rollout
    from trajevo.errors import TrajevoError
    from trajevo.exporters.export import export
    from trajevo.exporters.exporter import Exporter
    from trajevo.formulation.constraints.clearance import clearance_along
    from trajevo.formulation.constraints.constraint import Constraint, LimitKind, LimitParameter
    from trajevo.formulation.constraints.motion_limits import overshoot
    from trajevo.formulation.constraints.scene import Scene
    from trajevo.formulation.feasibility.check import check
    from trajevo.formulation.objectives import Objective
    from trajevo.formulation.problem import TrajectoryProblem
    from trajevo.formulation.registry import load_problem
    from trajevo.formulation.search import Search
    from trajevo.formulation.via_points import ViaPointProblem
    from trajevo.front.front import Front, Solution
    from trajevo.front.weighing.weights import comparison_weights, entropy_weights, least_information_weights
    from trajevo.page.animation import animate
    from trajevo.page.report import report
    from trajevo.page.sheet.sheet import payload_sheet
    from trajevo.path.boxes import CartesianBox, JointBox
    from trajevo.path.curve import GeometricPath
    from trajevo.path.inverse_kinematics import Pose
    from trajevo.path.loads import Load
    from trajevo.path.passing import Passing
    from trajevo.path.segments import ToolSegment
    from trajevo.path.via_points import ViaPoints
    from trajevo.plots.analyses import analyse
    from trajevo.robot.contacts.grip import Grip
    from trajevo.robot.contacts.stand import Stand
    from trajevo.robot.drive import Drive
    from trajevo.robot.joints import JointLimits
    from trajevo.robot.loading.supply import Supply
    from trajevo.robot.payload import Payload
    from trajevo.robot.robot import Robot, load_robot
    from trajevo.solvers.base_map import BaseMap, base_map
    from trajevo.solvers.evolutionary.algorithms import EvolutionaryAlgorithm
    from trajevo.solvers.gradient.normal_constraint import solve_nnc, weighting_factors
    from trajevo.solvers.gradient.polish import polish
    from trajevo.solvers.gradient.weighted_sum import minimise_weighted
    from trajevo.solvers.optimise import optimise
    from trajevo.solvers.rivals import rivals_of, rivals_table
    from trajevo.solvers.run.runs import read_run, resume
    from trajevo.solvers.task import Task, load_task
    from trajevo.study.bench.adapters.adapter import BenchRival
    from trajevo.study.cluster import DaskCluster
    from trajevo.study.collection import collect
    from trajevo.study.definition import Study, load_study
    from trajevo.study.engines import InProcess, Processes
    from trajevo.study.report import write_study
    from trajevo.study.robots.choice import RobotChoice
    from trajevo.study.robots.choose import choose_robot
    from trajevo.study.run import run_study, study_standing
    from trajevo.trajectory.batch import Motion, TrajectoryBatch
    from trajevo.trajectory.interpolants import (
        BSpline,
        CubicSpline,
        HermiteSpline,
        HybridQuartic,
        ImprovedQuarticBSpline,
        Interpolant,
        LinearBlends,
        QuarticCubicQuartic,
        QuinticSpline,
        SepticPolynomial,
        SepticSpline,
        SinglePolynomial,
        Variable,
        stop_and_go,
    )
    from trajevo.trajectory.polynomial import PolynomialBatch
    from trajevo.verification.bound_front import bound_front
    from trajevo.verification.certify import certify, certify_all
    from trajevo.verification.front_bound import FrontBound
    from trajevo.verification.path_bounds.bound import path_bound
    from trajevo.verification.twin.simulate import simulate
    from trajevo.verification.verify import verify

__version__ = "0.1.0"

#: Where each name is, in the order of the data flow; a module is imported when one of its names is asked for, so that
#: the command line answers at once.
_NAMES = {
    # What moves
    "robot.robot": ("Robot", "load_robot"),
    "robot.drive": ("Drive",),
    "robot.contacts.grip": ("Grip",),
    "robot.contacts.stand": ("Stand",),
    "robot.loading.supply": ("Supply",),
    "robot.joints": ("JointLimits",),
    "robot.payload": ("Payload",),
    # What must be visited
    "path.via_points": ("ViaPoints",),
    "path.inverse_kinematics": ("Pose",),
    "path.boxes": ("CartesianBox", "JointBox"),
    "path.passing": ("Passing",),
    "path.segments": ("ToolSegment",),
    "path.loads": ("Load",),
    "path.curve": ("GeometricPath",),
    "formulation.constraints.scene": ("Scene",),
    "formulation.constraints.clearance": ("clearance_along",),
    # Motions
    "trajectory.interpolants": (
        "BSpline",
        "CubicSpline",
        "HermiteSpline",
        "HybridQuartic",
        "ImprovedQuarticBSpline",
        "Interpolant",
        "LinearBlends",
        "QuarticCubicQuartic",
        "QuinticSpline",
        "SepticPolynomial",
        "SepticSpline",
        "SinglePolynomial",
        "Variable",
        "stop_and_go",
    ),
    "trajectory.batch": ("Motion", "TrajectoryBatch"),
    "trajectory.polynomial": ("PolynomialBatch",),
    "dynamics.inverse_dynamics": ("Dynamics",),
    "dynamics.rollout": ("Rollout",),
    "formulation.constraints.motion_limits": ("overshoot",),
    # Problems
    "formulation.objectives": ("Objective",),
    "formulation.constraints.constraint": ("Constraint", "LimitKind", "LimitParameter"),
    "formulation.problem": ("TrajectoryProblem",),
    "formulation.via_points": ("ViaPointProblem",),
    "formulation.registry": ("load_problem",),
    "formulation.feasibility.check": ("check",),
    "formulation.search": ("Search",),
    # Searches and what comes out
    "solvers.evolutionary.algorithms": ("EvolutionaryAlgorithm",),
    "solvers.optimise": ("optimise",),
    "solvers.task": ("Task", "load_task"),
    "solvers.gradient.polish": ("polish",),
    "solvers.run.runs": ("read_run", "resume"),
    "solvers.gradient.normal_constraint": ("solve_nnc", "weighting_factors"),
    "solvers.gradient.weighted_sum": ("minimise_weighted",),
    "front.front": ("Front", "Solution"),
    "front.weighing.weights": ("comparison_weights", "entropy_weights", "least_information_weights"),
    "solvers.base_map": ("BaseMap", "base_map"),
    "solvers.rivals": ("rivals_of", "rivals_table"),
    # What a motion can carry
    "capacity.dlcc": ("capacities", "dlcc", "dlcc_iterative", "dlcc_sampled"),
    "capacity.drives.drive_capacity": ("drive_capacity", "drive_load"),
    "capacity.drives.energy": ("energy_balance",),
    "capacity.drives.fitting": ("fit_drives",),
    "capacity.identification.identify": ("identify_payload",),
    "capacity.accuracy.full_capacity": ("full_capacity", "tool_deviation"),
    "capacity.accuracy.paces": ("capacity_by_pace",),
    "capacity.duty.capacity_study": ("capacity_study",),
    "capacity.payload_effort": ("payload_bounds", "payload_effort"),
    "capacity.payload_diagram": ("allowed_centres", "allowed_regions", "payload_diagram"),
    "capacity.sensitivity": ("sensitivity",),
    "capacity.slowdown": ("slowdown_curve", "slowdown_for"),
    "capacity.payload_time": ("capacity_front", "largest_payload", "max_payload_problem"),
    "capacity.robust": ("robust_capacity", "robust_curve", "robust_slowdown", "worst_case"),
    "capacity.uncertainty": ("price_along_path", "price_of_uncertainty", "robust_problem"),
    "capacity.workspace": ("ToolPlane", "workspace_capacity"),
    # What is proven, and files
    "verification.certify": ("certify", "certify_all"),
    "verification.bound_front": ("bound_front",),
    "verification.front_bound": ("FrontBound",),
    "verification.path_bounds.bound": ("path_bound",),
    "verification.twin.simulate": ("simulate",),
    "verification.verify": ("verify",),
    "exporters.exporter": ("Exporter",),
    "exporters.export": ("export",),
    "plots.analyses": ("analyse",),
    "page.report": ("report",),
    "page.animation": ("animate",),
    "page.sheet.sheet": ("payload_sheet",),
    # Many runs
    "study.definition": ("Study", "load_study"),
    "study.engines": ("InProcess", "Processes"),
    "study.cluster": ("DaskCluster",),
    "study.run": ("run_study", "study_standing"),
    "study.bench.adapters.adapter": ("BenchRival",),
    "study.collection": ("collect",),
    "study.report": ("write_study",),
    "study.robots.choose": ("choose_robot",),
    "study.robots.choice": ("RobotChoice",),
    "errors": ("TrajevoError",),
}
_HOMES = {name: module for module, names in _NAMES.items() for name in names}
_ROOMS = ("plots", "problems")

__all__ = [
    "BSpline",
    "BaseMap",
    "BenchRival",
    "CartesianBox",
    "Constraint",
    "CubicSpline",
    "DaskCluster",
    "Drive",
    "Dynamics",
    "EvolutionaryAlgorithm",
    "Exporter",
    "Front",
    "FrontBound",
    "GeometricPath",
    "Grip",
    "HermiteSpline",
    "HybridQuartic",
    "ImprovedQuarticBSpline",
    "InProcess",
    "Interpolant",
    "JointBox",
    "JointLimits",
    "LimitKind",
    "LimitParameter",
    "LinearBlends",
    "Load",
    "Motion",
    "Objective",
    "Passing",
    "Payload",
    "PolynomialBatch",
    "Pose",
    "Processes",
    "QuarticCubicQuartic",
    "QuinticSpline",
    "Robot",
    "RobotChoice",
    "Rollout",
    "Scene",
    "Search",
    "SepticPolynomial",
    "SepticSpline",
    "SinglePolynomial",
    "Solution",
    "Stand",
    "Study",
    "Supply",
    "Task",
    "ToolPlane",
    "ToolSegment",
    "TrajectoryBatch",
    "TrajectoryProblem",
    "TrajevoError",
    "Variable",
    "ViaPointProblem",
    "ViaPoints",
    "allowed_centres",
    "allowed_regions",
    "analyse",
    "animate",
    "base_map",
    "bound_front",
    "capacities",
    "capacity_by_pace",
    "capacity_front",
    "capacity_study",
    "certify",
    "certify_all",
    "check",
    "choose_robot",
    "clearance_along",
    "collect",
    "comparison_weights",
    "dlcc",
    "dlcc_iterative",
    "dlcc_sampled",
    "drive_capacity",
    "drive_load",
    "energy_balance",
    "entropy_weights",
    "export",
    "fit_drives",
    "full_capacity",
    "identify_payload",
    "largest_payload",
    "least_information_weights",
    "load_problem",
    "load_robot",
    "load_study",
    "load_task",
    "max_payload_problem",
    "minimise_weighted",
    "optimise",
    "overshoot",
    "path_bound",
    "payload_bounds",
    "payload_diagram",
    "payload_effort",
    "payload_sheet",
    "plots",
    "polish",
    "price_along_path",
    "price_of_uncertainty",
    "read_run",
    "report",
    "resume",
    "rivals_of",
    "rivals_table",
    "robust_capacity",
    "robust_curve",
    "robust_problem",
    "robust_slowdown",
    "run_study",
    "sensitivity",
    "simulate",
    "slowdown_curve",
    "slowdown_for",
    "solve_nnc",
    "stop_and_go",
    "study_standing",
    "tool_deviation",
    "verify",
    "weighting_factors",
    "workspace_capacity",
    "worst_case",
    "write_study",
]

_PACKAGE = Path(__file__).resolve().parent
if not (_PACKAGE / "problems").is_dir() and (_PACKAGE.parent / "pyproject.toml").is_file():
    # In a checkout the problems and the robots lie beside this folder; a wheel has them in it.
    __path__.append(str(_PACKAGE.parent))


def _imported(module: str) -> Any:
    """A module; an import leaves no garbage behind, and takes a tenth less without a search for it."""
    collects = gc.isenabled()
    gc.disable()
    try:
        return importlib.import_module(module)
    finally:
        if collects:
            gc.enable()


if not TYPE_CHECKING:  # or type checkers would take every name for one of this package

    def __getattr__(name: str) -> Any:
        if name in _ROOMS:
            return _imported(f"trajevo.{name}")
        if name not in _HOMES:
            raise AttributeError(f"module 'trajevo' has no attribute {name!r}")
        value = getattr(_imported(f"trajevo.{_HOMES[name]}"), name)
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, *_ROOMS})
