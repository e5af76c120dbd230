"""One paper's problem per file, each a pymoo problem."""

from problems.pointing_mechanism import PointingMechanism

__all__ = ["PointingMechanism"]
