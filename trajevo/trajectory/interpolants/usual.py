"""Which interpolant a problem has unless one is asked for."""

from __future__ import annotations

import numpy as np

from trajevo.path.via_points import ViaPoints

#: Greatest number of variables of a B-spline that nobody asked for: optima of more take over 10 s of CPU.
MOST_VARIABLES = 60


def usual_interpolant(points: ViaPoints, *, of_joints_alone: bool) -> str:
    """The name of the interpolant that a problem has unless one is asked for.

    Where nothing but the motion of the joints counts, gradients cost little, and free control points make the motion
    faster by a fifth; ``docs/explanation/interpolants.md`` has the measurements. Efforts, tools and obstacles make each
    variable dear: there the times alone are free.

    Args:
        points: the points.
        of_joints_alone: whether limits and objectives know nothing but time and the joints' positions, velocities,
            accelerations and jerks, points are fixed and passed freely, and none lies on a joint's limit.

    Returns:
        ``"bspline"`` where that is so and it has at most :data:`MOST_VARIABLES`, else ``"quintic_spline"``.
    """
    gaps, moving = len(points) - 1, int(np.count_nonzero(np.ptp(points.positions, axis=0)))
    # As BSpline has them by default: times, weights of four pieces, and control points that neither rest at the ends
    # nor follow from a point.
    variables = gaps + 4 * gaps + moving * (3 * gaps - 2)
    return "bspline" if of_joints_alone and variables <= MOST_VARIABLES else "quintic_spline"
