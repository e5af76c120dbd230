"""Interpolants: decision vectors in, batches of trajectories out; one file per family."""

from collections.abc import Callable
from typing import Any

from trajevo.base.plugins import Registry
from trajevo.trajectory.interpolants.cubic import CubicSpline
from trajevo.trajectory.interpolants.hybrid_quartic import HybridQuartic
from trajevo.trajectory.interpolants.interpolant import Interpolant, Variable
from trajevo.trajectory.interpolants.linear_blends import LinearBlends
from trajevo.trajectory.interpolants.reparameterised import LinearReparameterisation, Reparameterisation, slowness
from trajevo.trajectory.interpolants.septic import SepticPolynomial, State
from trajevo.trajectory.interpolants.single_polynomial import SinglePolynomial
from trajevo.trajectory.interpolants.splines import QuinticSpline, SepticSpline
from trajevo.trajectory.interpolants.stop_and_go import stop_and_go

#: Interpolants through via points whose times are free: name -> class that takes points and ``duration_bounds``.
THROUGH_POINTS: dict[str, Callable[..., Interpolant]] = {
    "cubic": CubicSpline,
    "hybrid": HybridQuartic,
    "linear_blends": LinearBlends,
    "polynomial": SinglePolynomial,
    "quintic_spline": QuinticSpline,
    "septic_spline": SepticSpline,
}

#: The same, and the interpolants of other packages.
NAMED_INTERPOLANTS: Registry[Callable[..., Interpolant]] = Registry(
    kind="interpolant",
    group="trajevo.interpolants",
    own=THROUGH_POINTS,
    expected="a class derived from trajevo.Interpolant",
    fits=lambda found: isinstance(found, type) and issubclass(found, Interpolant),
)


def price_of_rest(name: str) -> str | None:
    """What an interpolant's rests at inner points cost, see :class:`Interpolant`; None if it does not take any.

    Raises:
        UnknownNameError: no such interpolant.
    """
    found: Any = NAMED_INTERPOLANTS.find(name)
    price: str | None = found.price_of_rest
    return price


__all__ = [
    "NAMED_INTERPOLANTS",
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
    "price_of_rest",
    "slowness",
    "stop_and_go",
]
