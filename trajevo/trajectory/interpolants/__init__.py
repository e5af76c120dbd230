"""Interpolants: decision vectors in, batches of trajectories out; one file per family."""

from collections.abc import Callable

from trajevo.interpolants.blends import LinearBlends
from trajevo.interpolants.cubic import CubicSpline
from trajevo.interpolants.hybrid_quartic import HybridQuartic
from trajevo.interpolants.interpolant import Interpolant, Variable
from trajevo.interpolants.profiles import stop_and_go
from trajevo.interpolants.quintic import QuinticSpline
from trajevo.interpolants.reparameterised import LinearReparameterisation, Reparameterisation, slowness
from trajevo.interpolants.septic import SepticPolynomial, SepticSpline, State
from trajevo.interpolants.single import SinglePolynomial

#: Interpolants through via points whose times are free: name -> class that takes points and ``duration_bounds``.
THROUGH_POINTS: dict[str, Callable[..., Interpolant]] = {
    "cubic": CubicSpline,
    "hybrid": HybridQuartic,
    "linear_blends": LinearBlends,
    "polynomial": SinglePolynomial,
    "quintic_spline": QuinticSpline,
    "septic_spline": SepticSpline,
}

__all__ = [
    "THROUGH_POINTS",
    "CubicSpline",
    "HybridQuartic",
    "Interpolant",
    "LinearBlends",
    "LinearReparameterisation",
    "QuinticSpline",
    "Reparameterisation",
    "SepticPolynomial",
    "SepticSpline",
    "SinglePolynomial",
    "State",
    "Variable",
    "slowness",
    "stop_and_go",
]
