"""The two example paths of Paing 2021, with the limits and the longest time under which the paper runs them.

The airfoil's file is in chord lengths; all coordinates and limits here are in SI units.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.path.curve import GeometricPath

#: "GEMINI (smoothed)" of the UIUC airfoil collection: 79 points, upper trailing edge to lower, in chords.
GEMINI_FILE = Path(__file__).with_name("geminism.dat")

#: Chord of the airfoil, section VI.C [m].
CHORD = 0.1

#: Radius of the two arcs of the S [m]. The paper prints no coordinates; with this radius the best trade-off takes as
#: long as in the paper, 3.63 s.
S_RADIUS = 0.0214

#: Directions from the centres of the arcs to the points of the S [deg].
_UPPER_DEG, _LOWER_DEG = (30.0, 90.0, 150.0, 210.0, 270.0), (30.0, -30.0, -90.0, -150.0)


@dataclass(frozen=True)
class ExamplePath:
    """A path with the limits under which it is run.

    Attributes:
        title: one line.
        make: function that makes the path.
        velocity: velocity limit of each axis [m/s].
        acceleration: acceleration limit of each axis [m/s²].
        jerk: jerk limit of each axis [m/s³].
        longest_time: t_max [s].
    """

    title: str
    make: Callable[[], GeometricPath]
    velocity: float
    acceleration: float
    jerk: float
    longest_time: float

    __repr__ = brief


def gemini_points() -> Array:
    """Points of the GEMINI airfoil, shape (79, 2) [m]."""
    return CHORD * np.loadtxt(GEMINI_FILE, skiprows=1)


def s_points() -> Array:
    """Nine points on two arcs that meet at the origin, shape (9, 2) [m]."""
    arcs = [(S_RADIUS, _UPPER_DEG), (-S_RADIUS, _LOWER_DEG)]
    return np.concatenate(
        [
            S_RADIUS * np.stack([np.cos(np.radians(angles)), np.sin(np.radians(angles))], axis=1) + [0.0, centre]
            for centre, angles in arcs
        ]
    )


def gemini() -> GeometricPath:
    """The airfoil's path, section VI.C: order 6, with 12 control points fitted near the points.

    The knots ``"shifted"`` follow the rule of Piegl and Tiller with indices counted from 1. Of all rules tried, only
    this one gives the printed errors, 123.34 and 8.17 mm².
    """
    return GeometricPath.near(gemini_points(), control_points=12, parameters="chord", knots="shifted")


def s_shape() -> GeometricPath:
    """The path of the S, section VI.B: order 6, through nine points."""
    return GeometricPath.through(s_points())


EXAMPLE_PATHS = {
    "gemini": ExamplePath("GEMINI airfoil, chord 100 mm", gemini, 0.150, 1.0, 30.0, 8.0),
    "s": ExamplePath("S of two arcs of 21.4 mm", s_shape, 0.080, 0.5, 20.0, 6.0),
}
