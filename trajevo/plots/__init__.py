"""Pictures: functions that take data and axes, and return the axes; reports are made of them."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from trajevo.plots.along_path import fronts, parameter, path
    from trajevo.plots.cell.base_map import base_map
    from trajevo.plots.cell.visits import visits
    from trajevo.plots.chain import stick_figure
    from trajevo.plots.drives.energy import electrical_power, energy_uses
    from trajevo.plots.effort import (
        capacity_margins,
        desired_path,
        dlcc_iteration,
        effort_utilisation,
        front_capacities,
        payload_curve,
        payload_front,
        tracking_error,
    )
    from trajevo.plots.identification.payload import identified_payload
    from trajevo.plots.limits.binding import what_binds
    from trajevo.plots.limits.duty import payload_by_duty
    from trajevo.plots.motion import profiles, tool_path
    from trajevo.plots.paper import WIDTHS, style
    from trajevo.plots.pareto import front, front_3d, hypervolume, parallel_coordinates
    from trajevo.plots.payload import (
        allowed_region,
        payload_contours,
        robust_mass,
        slowdown_curve,
        uncertainty_price,
        workspace_capacity,
    )
    from trajevo.plots.pictures import draw_all, save_figure, save_pictures
    from trajevo.plots.rivals import plot_rivals
    from trajevo.plots.robots.fronts import robot_fronts
    from trajevo.plots.tradeoffs import exchange_rates, weight_map
    from trajevo.plots.twin.closed_loop import achieved_front, closed_loop

#: Modules of the pictures; a module is imported when one of its pictures is used.
_NAMES = {
    "pareto": ("front", "front_3d", "hypervolume", "parallel_coordinates"),
    "motion": ("profiles", "tool_path"),
    "along_path": ("fronts", "parameter", "path"),
    "effort": (
        "capacity_margins",
        "desired_path",
        "dlcc_iteration",
        "effort_utilisation",
        "front_capacities",
        "payload_curve",
        "payload_front",
        "tracking_error",
    ),
    "drives.energy": ("electrical_power", "energy_uses"),
    "payload": (
        "allowed_region",
        "payload_contours",
        "robust_mass",
        "slowdown_curve",
        "uncertainty_price",
        "workspace_capacity",
    ),
    "cell.base_map": ("base_map",),
    "cell.visits": ("visits",),
    "chain": ("stick_figure",),
    "rivals": ("plot_rivals",),
    "robots.fronts": ("robot_fronts",),
    "paper": ("WIDTHS", "style"),
    "tradeoffs": ("exchange_rates", "weight_map"),
    "identification.payload": ("identified_payload",),
    "limits.binding": ("what_binds",),
    "twin.closed_loop": ("achieved_front", "closed_loop"),
    "limits.duty": ("payload_by_duty",),
    "pictures": ("draw_all", "save_figure", "save_pictures"),
}
_HOMES = {name: module for module, names in _NAMES.items() for name in names}

__all__ = [
    "WIDTHS",
    "achieved_front",
    "allowed_region",
    "base_map",
    "capacity_margins",
    "closed_loop",
    "desired_path",
    "dlcc_iteration",
    "draw_all",
    "effort_utilisation",
    "electrical_power",
    "energy_uses",
    "exchange_rates",
    "front",
    "front_3d",
    "front_capacities",
    "fronts",
    "hypervolume",
    "identified_payload",
    "parallel_coordinates",
    "parameter",
    "path",
    "payload_by_duty",
    "payload_contours",
    "payload_curve",
    "payload_front",
    "plot_rivals",
    "profiles",
    "robot_fronts",
    "robust_mass",
    "save_figure",
    "save_pictures",
    "slowdown_curve",
    "stick_figure",
    "style",
    "tool_path",
    "tracking_error",
    "uncertainty_price",
    "visits",
    "weight_map",
    "what_binds",
    "workspace_capacity",
]


if not TYPE_CHECKING:  # otherwise type checkers would accept any name

    def __getattr__(name: str) -> Any:
        if name not in _HOMES:
            raise AttributeError(f"module 'trajevo.plots' has no attribute {name!r}")
        value = getattr(importlib.import_module(f"trajevo.plots.{_HOMES[name]}"), name)
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
