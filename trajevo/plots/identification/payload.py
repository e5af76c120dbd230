"""The picture of an identified payload: every parameter with its interval."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from trajevo.base.arrays import Array
from trajevo.capacity.identification.found import KINDS, UNITS, IdentifiedPayload
from trajevo.errors import InvalidInputError
from trajevo.plots.paper import LIMIT, Width, colour, key, panel
from trajevo.robot.payload import PARAMETERS, Payload, com_features


def identified_payload(
    found: IdentifiedPayload, true: Payload | None = None, *, ax: Axes | None = None, width: Width = "column"
) -> Axes:
    """Mass, first moments and inertia with their 95 % intervals, each as a share of the greatest of its kind.

    Args:
        found: what :func:`trajevo.identify_payload` found. What the motion does not show has no mark.
        true: a payload to compare with, such as that of a drawing.
        ax: axes.
        width: ``"column"``, ``"page"`` or millimetres.

    Raises:
        InvalidInputError: something else was given, or the motion shows no parameter.
    """
    if not isinstance(found, IdentifiedPayload):
        raise InvalidInputError(f"found: expected what identify_payload(log, robot) gives, got {type(found).__name__}")
    if true is not None and not isinstance(true, Payload):
        raise InvalidInputError(f"true: expected a trajevo.Payload, or None for none, got {true!r}")
    if np.isnan(found.parameters).all():
        raise InvalidInputError("found: expected a payload of which the motion shows something")
    places, scales, labels = np.arange(len(PARAMETERS)), np.ones(len(PARAMETERS)), list(PARAMETERS)
    for kind in KINDS:
        known = np.abs(found.parameters[kind])
        if not np.isnan(known).all() and np.nanmax(known) > 0.0:
            scales[kind] = np.nanmax(known)
    for k, (name, unit, scale) in enumerate(zip(PARAMETERS, UNITS, scales, strict=True)):
        labels[k] = f"{name} / {scale:.3g} {unit}"
    with panel(ax, width=width, height=62.0) as ax:
        ax.axvline(0.0, color=LIMIT, linewidth=0.5)
        looks: dict[str, Any] = {"fmt": "o", "markersize": 3.5, "capsize": 2.5, "linestyle": "none", "color": colour(1)}
        ax.errorbar(found.parameters / scales, places, xerr=found.doubt / scales, label="found, 95 %", **looks)
        if true is not None:
            ax.plot(_parameters(true) / scales, places, "x", color="black", zorder=3, label="true")
        ax.set_yticks(places, labels)
        ax.invert_yaxis()
        ax.set(xlabel="share of the greatest of its kind")
        key(ax)
    return ax


def _parameters(payload: Payload) -> Array:
    """The ten parameters of a payload, shape (10,)."""
    if payload.inertia is None or payload.mass == 0.0:
        shape = np.zeros((3, 3))
    else:
        shape = np.array(payload.inertia) / payload.mass
    found: Array = payload.mass * com_features(np.array([payload.com]), shape)[0]
    return found
