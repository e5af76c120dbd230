"""Picture of rivals: interpolants through the same points at their least times, one joint of each."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from trajevo.base.units import display, per_time, pretty
from trajevo.errors import InvalidInputError, checked_name
from trajevo.plots.motion import PANEL, draw_limits
from trajevo.plots.paper import TWO_BESIDE, Width, curve, inches, key, panels
from trajevo.solvers.rivals import Rival
from trajevo.trajectory.batch import DERIVATIVES


def plot_rivals(
    rivals: Iterable[Rival],
    *,
    joint: str | None = None,
    samples: int = 1000,
    axes: Any = None,
    width: Width = "page",
) -> Any:
    """Position, velocity, acceleration and jerk of one joint, all rivals in each panel.

    Args:
        rivals: at least one rival.
        joint: name of the joint; the one that overshoots most if None.
        samples: number of instants drawn.
        axes: four Axes.
        width: ``"column"``, ``"page"`` or millimetres.

    Returns:
        Array of four Axes; dashed lines are the limits that the motions keep, where they are near the curves.
    """
    drawn = list(rivals)
    if not drawn:
        raise InvalidInputError("rivals: expected at least one")
    robot = drawn[0].rollout.robot
    chosen = robot.joint_names.index(checked_name("joint", joint, robot.joint_names)) if joint else _widest(drawn)
    columns = 2 if inches(width) > TWO_BESIDE else 1
    with panels(axes, len(DERIVATIVES), width=width, columns=columns, height=PANEL, share=True) as made:
        for order, (ax, name) in enumerate(zip(made, DERIVATIVES, strict=True)):
            curves = []
            for k, rival in enumerate(drawn):
                trajectory = rival.rollout.trajectory[0]
                t = np.linspace(0.0, float(trajectory.duration[0]), samples)
                curves.append(trajectory.evaluate(t, order)[0, :, chosen])
                ax.plot(t, curves[-1], label=rival.title, **curve(k))
            low, high = (end[[chosen]] for end in drawn[0].rollout.limits.bounds(name))
            unit = pretty(display(per_time(robot.joint_units[chosen], order), angle="rad")[0])
            draw_limits(ax, np.stack(curves, axis=1), low, high, unit, coloured=False)
            ax.set_ylabel(f"{name} [{unit}]")
        made[0].set_title(robot.joint_names[chosen])
        for ax in made[-columns:]:
            ax.set_xlabel("time [s]")
        key(made[0])
    return made


def _widest(rivals: list[Rival]) -> int:
    """The joint that, in any rival, leaves the range between its values at the ends of the motion furthest."""
    beyond = [np.ptp(np.stack(rival.rollout.trajectory.extremes(0))[:, 0], axis=0) for rival in rivals]
    return int(np.max(beyond, axis=0).argmax())
