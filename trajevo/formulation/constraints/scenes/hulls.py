"""Corners of convex hulls."""

from __future__ import annotations

import numpy as np

from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError


def hull_points(points: Array, where: str) -> Array:
    """Those of points (N, 3) that are corners of their convex hull, in the same order [m].

    Args:
        points: points of a solid [m].
        where: what they belong to, for messages.

    Raises:
        InvalidInputError: they are in one plane.
    """
    from scipy.spatial import ConvexHull, QhullError  # takes as long to import as all else together

    if len(points) > 3:
        try:
            kept: Array = points[np.sort(ConvexHull(points).vertices)]
        except (QhullError, ValueError) as error:
            raise InvalidInputError(f"{where}: expected a solid, got {len(points)} corners in one plane") from error
        return kept
    raise InvalidInputError(f"{where}: expected a solid, got {len(points)} corners in one plane")
