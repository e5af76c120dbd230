"""Pictures of what drives draw: their power over time, and what their energy goes into."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes

from trajevo.base.arrays import Array
from trajevo.capacity.drives.energy import USES, EnergyBalance
from trajevo.errors import InvalidInputError
from trajevo.plots.paper import LIMIT, Width, area, curve, key, panel


def electrical_power(balance: EnergyBalance, *, ax: Axes | None = None, width: Width = "column") -> Axes:
    """What each motor draws over time, and all together; below 0 they give back.

    Args:
        balance: of one motion.
        ax: axes.
        width: ``"column"``, ``"page"`` or millimetres.
    """
    _check(balance)
    with panel(ax, width=width, height=50.0) as ax:
        for k, name in enumerate(balance.joint_names):
            ax.plot(balance.times, balance.power[:, k], label=name, **curve(k + 1))
        ax.plot(balance.times, balance.power.sum(axis=1), label="all", color="black", linewidth=1.4)
        ax.axhline(0.0, color=LIMIT, linewidth=0.5)
        ax.set(xlabel="time [s]", ylabel="electrical power [W]")
        key(ax)
    return ax


def energy_uses(
    balances: EnergyBalance | Mapping[str, EnergyBalance], *, ax: Axes | None = None, width: Width = "column"
) -> Axes:
    """What the energy from the mains goes into, as stacked bars: one for each joint, or for each of several motions.

    Energy that moves links is below 0 where they drive the motors. Bars of several motions have what is burnt, left in
    the link and standby too, so that their heights from the lowest end on are the energy from the mains.

    Args:
        balances: of one motion, or label -> that of a motion.
        ax: axes.
        width: ``"column"``, ``"page"`` or millimetres.
    """
    if isinstance(balances, Mapping):
        if not balances:
            raise InvalidInputError("balances: expected at least one, got none")
        for one in balances.values():
            _check(one)
        labels, parts = list(balances), _of_motions(list(balances.values()))
    else:
        _check(balances)
        labels = list(balances.joint_names)
        parts = {called: getattr(balances, name) for name, called in USES.items()}
    with panel(ax, width=width, height=50.0) as ax:
        above, below, places = np.zeros(len(labels)), np.zeros(len(labels)), np.arange(len(labels))
        greatest = max(float(np.abs(values).max()) for values in parts.values())
        for k, (called, values) in enumerate(parts.items()):
            if np.abs(values).max() <= 1e-9 * greatest:
                continue
            bottom = np.where(values < 0.0, below, above)
            hatch = "////" if k >= len(USES) else None  # colours begin anew there
            ax.bar(places, values, 0.7, bottom=bottom, label=called, color=area(k), hatch=hatch)
            above, below = above + np.maximum(values, 0.0), below + np.minimum(values, 0.0)
        ax.axhline(0.0, color=LIMIT, linewidth=0.5)
        ax.set_xticks(places, labels, rotation=30.0 if len(labels) > 4 else 0.0)
        ax.set(ylabel="energy [J]")
        key(ax)
    return ax


def _of_motions(balances: list[EnergyBalance]) -> dict[str, Array]:
    """What the energy of motions goes into, by how it is called, each (M,) [J]."""
    parts = {called: np.array([getattr(one, name).sum() for one in balances]) for name, called in USES.items()}
    for name, called in (("burnt", "braking resistors"), ("stored", "left in the link"), ("standby", "standby")):
        parts[called] = np.array([getattr(one, name) for one in balances])
    return parts


def _check(balance: object) -> None:
    if not isinstance(balance, EnergyBalance):
        raise InvalidInputError(f"balance: expected what energy_balance(motion) gives, got {type(balance).__name__}")
