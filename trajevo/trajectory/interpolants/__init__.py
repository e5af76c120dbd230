"""Interpolants: decision vectors in, batches of trajectories out; one file per family."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from trajevo.base.own.code import told
from trajevo.base.plugins import Registry
from trajevo.errors import InvalidInputError, TrajevoError
from trajevo.path.passing import Passing
from trajevo.path.via_points import ViaPoints
from trajevo.trajectory.interpolants.along_way import FixedCurve, curve_along
from trajevo.trajectory.interpolants.hybrid_quartic import HybridQuartic
from trajevo.trajectory.interpolants.improved_quartic import ImprovedQuarticBSpline
from trajevo.trajectory.interpolants.interpolant import AtRest, Interpolant, Variable
from trajevo.trajectory.interpolants.legs import Legs, checked_durations
from trajevo.trajectory.interpolants.linear_blends import LinearBlends
from trajevo.trajectory.interpolants.reparameterised import LinearReparameterisation, Reparameterisation, slowness
from trajevo.trajectory.interpolants.septic import SepticPolynomial, State
from trajevo.trajectory.interpolants.single_polynomial import SinglePolynomial
from trajevo.trajectory.interpolants.splines.b_spline import BSpline, BSplineShape
from trajevo.trajectory.interpolants.splines.cubic import CubicSpline
from trajevo.trajectory.interpolants.splines.free_points import ExtraPoints
from trajevo.trajectory.interpolants.splines.hermite import HermiteShape, HermiteSpline
from trajevo.trajectory.interpolants.splines.odd_degree import QuinticSpline, SepticSpline
from trajevo.trajectory.interpolants.splines.quartic_cubic_quartic import QuarticCubicQuartic
from trajevo.trajectory.interpolants.stop_and_go import stop_and_go
from trajevo.trajectory.interpolants.usual import usual_interpolant

#: Interpolants through via points whose times are free: name -> class that takes points and ``duration_bounds``.
THROUGH_POINTS: dict[str, Callable[..., Interpolant]] = {
    "bspline": BSpline,
    "cubic": CubicSpline,
    "hermite": HermiteSpline,
    "hybrid": HybridQuartic,
    "improved_quartic_bspline": ImprovedQuarticBSpline,
    "linear_blends": LinearBlends,
    "polynomial": SinglePolynomial,
    "quartic_cubic_quartic": QuarticCubicQuartic,
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


def interpolant_through(
    name: str,
    points: ViaPoints,
    *,
    duration_bounds: Any,
    at_rest: AtRest = (),
    passing: Sequence[Passing] = (),
    cyclic: bool = False,
    curves: Mapping[int, FixedCurve] | None = None,
    extra: ExtraPoints | BSplineShape | HermiteShape | None = None,
) -> Interpolant:
    """The interpolant of a name through points, in legs if it stops or has other wishes on the way.

    Args:
        name: a name of :data:`NAMED_INTERPOLANTS`.
        points: the points.
        duration_bounds: least and greatest duration, shape (2,), or for every segment (n_points - 1, 2) [s].
        at_rest: joints at rest at inner points, for an interpolant that takes them.
        passing: how points are passed, in their order.
        cyclic: whether the end meets the start.
        curves: fixed curves of the tool by the point at which they begin, at whose ends the motion stops.
        extra: free points between the given ones, or the shape of B-splines or Hermite splines.

    Raises:
        UnknownNameError: no such interpolant.
        InvalidInputError: what the interpolant cannot do, see :class:`Legs`.
    """
    found: Callable[..., Interpolant] = NAMED_INTERPOLANTS.find(name)
    bounds = checked_durations(duration_bounds, len(points))
    if cyclic and not getattr(found, "takes_cycles", False):
        raise InvalidInputError(f"cyclic: {name!r} makes no cyclic motions; quintic_spline and septic_spline do")
    if extra is not None:
        found = extra.around(name, found)
    given: dict[str, Any] = ({"at_rest": at_rest} if at_rest else {}) | ({"cyclic": True} if cyclic else {})
    try:
        if bounds.ndim == 2 or curves or any(one.stop or one.vectors for one in passing):
            given |= {"curves": curves} if curves else {}
            return Legs(name, found, points, passing=tuple(passing), duration_bounds=bounds, **given)
        return found(points, duration_bounds=tuple(bounds.tolist()), **given)
    except TrajevoError:
        raise
    except Exception as error:
        if name in THROUGH_POINTS:
            raise
        raise InvalidInputError(f"interpolant: {name} cannot be made of points: {told(error)}") from error


__all__ = [
    "NAMED_INTERPOLANTS",
    "THROUGH_POINTS",
    "BSpline",
    "BSplineShape",
    "CubicSpline",
    "ExtraPoints",
    "FixedCurve",
    "HermiteShape",
    "HermiteSpline",
    "HybridQuartic",
    "ImprovedQuarticBSpline",
    "Interpolant",
    "Legs",
    "LinearBlends",
    "LinearReparameterisation",
    "QuarticCubicQuartic",
    "QuinticSpline",
    "Reparameterisation",
    "SepticPolynomial",
    "SepticSpline",
    "SinglePolynomial",
    "State",
    "Variable",
    "curve_along",
    "interpolant_through",
    "price_of_rest",
    "slowness",
    "stop_and_go",
    "usual_interpolant",
]
