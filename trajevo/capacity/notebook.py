"""What notebooks show of capacities: the sentence that is printed, a table by joint or by payload, and a picture."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown import html

if TYPE_CHECKING:
    from trajevo.capacity.capacity import Capacities, Capacity
    from trajevo.capacity.payload_diagram import PayloadDiagram
    from trajevo.capacity.slowdown import Slowdown
    from trajevo.capacity.workspace import WorkspaceCapacity

#: Rows of a table of a curve.
_ROWS = 8


def capacity_html(capacity: Capacity) -> str:
    """The largest payload of a motion: what each joint carries, and how much of its effort is left over time."""
    rows = [
        (
            name,
            f"{capacity.per_joint[k]:.5g}",
            f"{100.0 * capacity.margin[k]:.2f}",
            html.line(capacity.margins[:, k], f"unused share of the effort limit of {name} over time"),
        )
        for k, name in enumerate(capacity.joint_names)
    ]
    headers = ("joint", "carries alone [kg]", "least unused effort [%]", f"over {capacity.times[-1]:.4g} s")
    return html.shown("Largest payload", html.sentence(str(capacity)), html.table(headers, rows))


def capacities_html(found: Capacities) -> str:
    """The largest payloads of many motions, over their durations."""
    finite = np.isfinite(found.mass)
    binding = Counter(found.joint_names[k] for k in found.joint.tolist() if k >= 0)
    said = {
        "motions": str(len(found.mass)),
        "payload model": found.payload_model,
        "largest payload": f"{found.mass.min():.5g} to {found.mass.max():.5g} kg" if len(found.mass) else "",
        "limited by": ", ".join(f"{name} ({count})" for name, count in binding.most_common()),
    }
    points = np.stack([found.duration, found.mass], axis=1)[finite]
    picture = html.cloud(points, ("duration [s]", "largest payload [kg]"), {})
    return html.shown("Largest payloads, guaranteed at every instant", html.facts(said), picture)


def slowdown_html(slowdown: Slowdown, limits: tuple[str, ...]) -> str:
    """The least duration with a payload, and how far each joint uses its limits then, which are named here."""
    names = slowdown.motion.robot.joint_names
    used = 100.0 * slowdown.utilisation
    rows = [(name, *(f"{value:.4g}" for value in used[:, k])) for k, name in enumerate(names)]
    headers = ("joint", *(f"{limit} used [%]" for limit in limits))
    return html.shown("Least duration", html.sentence(str(slowdown)), html.table(headers, rows))


def curve_html(title: str, headers: tuple[str, ...], columns: tuple[Array, ...], binding: tuple[str, ...] = ()) -> str:
    """A curve, by its first two columns: some of its points as a table, and all as a picture.

    Args:
        title: what it is.
        headers: names of the columns with their units, and of what binds if that is given.
        columns: numbers of shape (N,); infinite or NaN where nothing was found.
        binding: N texts.
    """
    count = len(columns[0])
    few = np.unique(np.linspace(0, count - 1, min(count, _ROWS)).round().astype(int)).tolist()
    texts = [(*(_number(column[k]) for column in columns), *binding[k : k + 1]) for k in few]
    points = np.stack(columns[:2], axis=1)
    picture = html.cloud(points[np.isfinite(points).all(axis=1)], (headers[0], headers[1]), {})
    return html.shown(title, html.table(headers, texts), picture)


def diagram_html(diagram: PayloadDiagram) -> str:
    """Masses on a grid of offsets: least and greatest, and what binds how often."""
    known = diagram.mass[~np.isnan(diagram.mass)]
    binding = Counter(diagram.joint_names[k] for k in diagram.joint.ravel().tolist() if k >= 0)
    said = {
        "offset from the tool's z axis": _millimetres(diagram.offset_xy),
        "offset along it": _millimetres(diagram.offset_z),
        "largest payload": f"{known.min():.4g} to {known.max():.4g} kg" if len(known) else "none is feasible",
        "limited by": ", ".join(f"{name} ({count} cells)" for name, count in binding.most_common()),
        "payload model": diagram.payload_model,
    }
    return html.shown(f"Payload diagram of {diagram.mass.size} cells", html.facts(said))


def workspace_html(found: WorkspaceCapacity) -> str:
    """What is carried over a plane, and which joint binds in how many cells."""
    binding = Counter(found.joint_names[k] for k in found.joint.ravel().tolist() if k >= 0)
    rows = [(name, str(count)) for name, count in binding.most_common()]
    table = html.table(("limited by", "cells"), rows)
    return html.shown("Largest payload over the workspace", html.sentence(str(found)), table)


def told_html(title: str, result: object) -> str:
    """A result whose sentence tells everything."""
    return html.shown(title, html.sentence(str(result)))


def _number(value: float) -> str:
    return f"{value:.5g}" if np.isfinite(value) else "–"


def _millimetres(values: Array) -> str:
    return f"{1e3 * values.min():.4g} to {1e3 * values.max():.4g} mm" if len(values) else ""
