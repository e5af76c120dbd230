"""Picture of rivals: interpolants through the same points at their least times, one joint of each."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

from trajevo.base.units import display, per_time, pretty
from trajevo.errors import InvalidInputError, checked_name
from trajevo.solvers.rivals import Rival
from trajevo.trajectory.batch import DERIVATIVES


def plot_rivals(rivals: Iterable[Rival], *, joint: str | None = None, samples: int = 1000, axes: Any = None) -> Any:
    """Position, velocity, acceleration and jerk of one joint, all rivals in each panel.

    Args:
        rivals: at least one rival.
        joint: name of the joint; the one that overshoots most if None.
        samples: number of instants drawn.
        axes: four Axes.

    Returns:
        Array of four Axes; dashed lines are the limits.
    """
    drawn = list(rivals)
    if not drawn:
        raise InvalidInputError("rivals: expected at least one")
    robot = drawn[0].rollout.robot
    chosen = robot.joint_names.index(checked_name("joint", joint, robot.joint_names)) if joint else _widest(drawn)
    if axes is None:
        axes = plt.subplots(4, 1, figsize=(7.6, 9.6), sharex=True, layout="constrained")[1]
    panels = np.atleast_1d(np.asarray(axes, dtype=object)).ravel()
    if len(panels) != len(DERIVATIVES):
        raise InvalidInputError(f"axes: expected {len(DERIVATIVES)}, got {len(panels)}")
    for order, (panel, name) in enumerate(zip(panels, DERIVATIVES, strict=True)):
        for rival in drawn:
            trajectory = rival.rollout.trajectory[0]
            t = np.linspace(0.0, float(trajectory.duration[0]), samples)
            panel.plot(t, trajectory.evaluate(t, order)[0, :, chosen], label=rival.title, linewidth=1.2)
        for bound in (end[chosen] for end in (robot.limits.bounds(name) if order else ())):
            if np.isfinite(bound):
                panel.axhline(bound, color="black", linestyle="--", linewidth=0.8)
        unit = display(per_time(robot.joint_units[chosen], order), angle="rad")[0]
        panel.set_ylabel(f"{name} [{pretty(unit)}]")
        panel.grid(alpha=0.3)
    panels[0].set_title(robot.joint_names[chosen])
    panels[0].legend(fontsize="small", loc="upper left", bbox_to_anchor=(1.0, 1.0))
    panels[-1].set_xlabel("time [s]")
    return panels


def _widest(rivals: list[Rival]) -> int:
    """The joint that, in any rival, leaves the range between its values at the ends of the motion furthest."""
    beyond = [np.ptp(np.stack(rival.rollout.trajectory.extremes(0))[:, 0], axis=0) for rival in rivals]
    return int(np.max(beyond, axis=0).argmax())
