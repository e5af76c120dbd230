"""One paper's problem per file, each a pymoo problem."""

from trajevo.formulation.via_points import ViaPointProblem

from .hybrid_manipulator import HybridManipulator
from .pick_and_place import PickAndPlace
from .pointing_mechanism import PointingMechanism
from .time_jerk_reparameterisation import TimeJerkReparameterisation

__all__ = ["HybridManipulator", "PickAndPlace", "PointingMechanism", "TimeJerkReparameterisation", "ViaPointProblem"]
