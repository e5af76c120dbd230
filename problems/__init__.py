"""One paper's problem per file, each a pymoo problem."""

from problems.hybrid_manipulator import HybridManipulator
from problems.pointing_mechanism import PointingMechanism

__all__ = ["HybridManipulator", "PointingMechanism"]
