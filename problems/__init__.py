"""One paper's problem per file, each a pymoo problem."""

from problems.hybrid_manipulator import HybridManipulator
from problems.pointing_mechanism import PointingMechanism
from problems.time_jerk_reparameterisation import TimeJerkReparameterisation

__all__ = ["HybridManipulator", "PointingMechanism", "TimeJerkReparameterisation"]
