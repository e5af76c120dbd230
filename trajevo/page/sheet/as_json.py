"""A sheet as plain data: SI, with units in the names."""

from __future__ import annotations

from typing import Any

import numpy as np

from trajevo.capacity.drives.found import DriveCapacity
from trajevo.page.sheet.load_data import LoadData
from trajevo.page.sheet.sheet import SCHEMA, PayloadSheet
from trajevo.page.sheet.verdicts import Axis, Verdict


def sheet_data(sheet: PayloadSheet) -> dict[str, Any]:
    """All of a sheet as plain data for other programs; None for what is not known or not limited."""
    capacity = sheet.capacity
    return {
        "format": "trajevo payload sheet",
        "schema_version": SCHEMA,
        "program_version": sheet.version,
        "date": sheet.made_on,
        "creator": sheet.creator,
        "problem": sheet.title,
        "motion": sheet.motion,
        "robot": sheet.robot,
        "verdict": sheet.verdict,
        "load": _load(sheet.load) | {"frame": sheet.tool, "model": sheet.load_model, "carried": sheet.carried},
        "supplementary_loads": [_load(one.data) | {"joint": one.joint} for one in sheet.supplementary],
        "static": _verdict(sheet.static),
        "dynamic": _verdict(sheet.dynamic),
        "drives": [_verdict(one) for one in sheet.duty],
        "duty": {
            "motion_s": sheet.duration,
            "dwell_s": sheet.dwell,
            "cycle_s": sheet.duration + sheet.dwell,
            "cycles_per_hour": sheet.cycles_per_hour,
        },
        "largest_payload": None
        if capacity is None
        else {
            "mass_kg": _plain(capacity.mass),
            "joint": capacity.joint or None,
            "instant_s": _plain(capacity.time),
            "margin": sheet.margin,
            "text": str(capacity),
        },
        "largest_payload_note": sheet.capacity_note,
        "largest_payload_by_drives": None if sheet.drive_capacity is None else _by_drives(sheet.drive_capacity),
        "share_of_effort_limits_kept": sheet.kept,
        "certificate": sheet.certified,
        "certificate_sha256": sheet.certificate_hash,
    }


def _by_drives(capacity: DriveCapacity) -> dict[str, Any]:
    return {
        "mass_kg": _plain(capacity.mass),
        "cause": capacity.cause or None,
        "joint": capacity.joint or None,
        "instant_s": _plain(capacity.time),
        "text": str(capacity),
    }


def _load(load: LoadData) -> dict[str, Any]:
    return {
        "mass_kg": load.mass,
        "com_m": load.com.tolist(),
        "inertia_about_com_kg_m2": load.inertia.tolist(),
        "inertia_about_frame_kg_m2": load.about_frame.tolist(),
        "principal_moments_kg_m2": load.principal.tolist(),
        "principal_axes_abc_rad": load.angles.tolist(),
        "principal_axes_quaternion_wxyz": load.quaternion.tolist(),
    }


def _verdict(verdict: Verdict) -> dict[str, Any]:
    return {
        "about": verdict.about,
        "verdict": verdict.word,
        "proven": verdict.proven,
        "binding": None if verdict.binding is None else verdict.binding.joint,
        "axes": [_axis(axis) for axis in verdict.axes],
    }


def _axis(axis: Axis) -> dict[str, Any]:
    return {
        "joint": axis.joint,
        "unit": axis.unit,
        "value": axis.value,
        "limit": axis.limit,
        "share": axis.share,
        "instant_s": axis.instant,
    }


def _plain(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
