"""Balls that contain a solid: one around all of it, and smaller ones that cover it together."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, final

import coal
import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.formulation.constraints.solids import bounding_ball

#: Greatest number of balls that cover a solid, and length of a slice per ball in widths of the solid.
_MOST, _SLICE = 4, 0.5

#: Steps towards the furthest point in the search for the centre of a small ball.
_STEPS = 100

#: Number of sides of the prism that replaces a cylinder.
_SIDES = 16


@final
@dataclass(frozen=True, eq=False)
class Cover:
    """Balls around a solid, in the frame of the joint that carries it.

    Attributes:
        centres: the ball around all of it, then K smaller balls that cover it together, shape (1 + K, 3) [m].
        radii: their radii, shape (1 + K,) [m].
    """

    centres: Array
    radii: Array

    @classmethod
    def of(cls, entry: Any) -> Cover:
        """The balls around one of Pinocchio's geometry objects."""
        polytope = _polytope(entry.geometry)
        if polytope is None:  # a ball, or a shape without corners
            centre, radius = bounding_ball(entry)
            return cls(frozen(np.tile(centre, (2, 1))), frozen(np.full(2, radius)))
        balls = [_ball(points) for points in (polytope[0], *_slices(*polytope))]
        centres = np.array([centre for centre, _ in balls]) @ entry.placement.rotation.T + entry.placement.translation
        return cls(frozen(centres), frozen(np.array([radius for _, radius in balls])))


def _polytope(solid: Any) -> tuple[Array, Array] | None:
    """Corners (M, 3) [m] and ends of edges (E, 2) of a polytope that contains a solid; None if it has no corners."""
    match solid:
        case coal.Convex():
            triangles = [solid.polygons(k) for k in range(solid.num_polygons)]
            sides = np.array([[triangle[0], triangle[1], triangle[2]] for triangle in triangles])
            sides = np.sort(sides[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
            return np.array(solid.points()), np.unique(sides, axis=0)
        case coal.Box():
            base = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
            return _prism(base * solid.halfSide[:2], float(solid.halfSide[2]))
        case coal.Cylinder():
            turns = 2.0 * np.pi / _SIDES * np.arange(_SIDES)
            around = solid.radius / np.cos(np.pi / _SIDES)
            return _prism(around * np.stack([np.cos(turns), np.sin(turns)], axis=1), float(solid.halfLength))
    return None


def _prism(base: Array, height: float) -> tuple[Array, Array]:
    """Corners and edges of the prism over a polygon (M, 2), from -height to height along z."""
    corners = np.concatenate([np.column_stack([base, np.full(len(base), side * height)]) for side in (-1.0, 1.0)])
    low = np.arange(len(base))
    following, high = np.roll(low, -1), low + len(base)
    pairs = ((low, following), (high, following + len(base)), (low, high))
    return corners, np.concatenate([np.stack(pair, axis=1) for pair in pairs])


def _slices(corners: Array, edges: Array) -> list[Array]:
    """Corners of the slices of a polytope across its longest direction."""
    centred = corners - corners.mean(axis=0)
    along = centred @ np.linalg.svd(centred, full_matrices=False)[2].T
    extents = np.ptp(along, axis=0)
    longest, width = int(extents.argmax()), float(np.median(extents))
    count = int(np.clip(np.ceil(extents[longest] / max(_SLICE * width, 1e-9)), 1, _MOST))
    place = along[:, longest]
    borders = np.linspace(place.min(), place.max(), count + 1)
    borders[[0, -1]] += [-1.0, 1.0]  # rounding must not lose a corner
    cuts = [_cut(corners, edges, place - border) for border in borders]
    inside = [(place >= low) & (place <= high) for low, high in pairwise(borders)]
    return [np.concatenate([corners[inside[k]], cuts[k], cuts[k + 1]]) for k in range(count)]


def _cut(corners: Array, edges: Array, beyond: Array) -> Array:
    """Where edges cross a plane from which the corners are at signed distances (M,), shape (C, 3) [m]."""
    ends = beyond[edges]
    crossing = (ends.min(axis=1) < 0.0) & (ends.max(axis=1) > 0.0)
    (first, second), (before, after) = np.swapaxes(corners[edges[crossing]], 0, 1), ends[crossing].T[:, :, None]
    cut: Array = first + before / (before - after) * (second - first)
    return cut


def _ball(points: Array) -> tuple[Array, float]:
    """Centre (3,) and radius of a small ball around points (M, 3) [m], by steps of Bădoiu and Clarkson (2003)."""
    centre = points.mean(axis=0)
    for step in range(1, _STEPS):
        furthest = points[np.square(points - centre).sum(axis=1).argmax()]
        centre = centre + (furthest - centre) / (step + 1)
    return centre, float(np.sqrt(np.square(points - centre).sum(axis=1).max()))
