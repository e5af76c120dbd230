"""One paper's problem per file, each a pymoo problem."""

from problems.hybrid_manipulator import HybridManipulator
from problems.pick_and_place import PickAndPlace
from problems.pointing_mechanism import PointingMechanism
from problems.time_jerk_reparameterisation import TimeJerkReparameterisation
from problems.via_points import ViaPointProblem

__all__ = ["HybridManipulator", "PickAndPlace", "PointingMechanism", "TimeJerkReparameterisation", "ViaPointProblem"]
