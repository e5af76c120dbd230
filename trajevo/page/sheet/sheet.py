"""The sheet of a payload: what is carried on a motion, verdicts at rest and moving, duty, margins, and who signs.

Its contents follow what makers of robots ask for with a load: load data at the flange, loads on the arm, a static and a
dynamic verdict with the axis that binds, and a place to sign.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path
from typing import Any, final

import numpy as np

from trajevo.base.files import named_file
from trajevo.base.shown.brief import brief
from trajevo.capacity.capacity import Capacity
from trajevo.capacity.dlcc import dlcc
from trajevo.capacity.drives.drive_capacity import drive_capacity, rollout_mass
from trajevo.capacity.drives.found import DriveCapacity
from trajevo.dynamics.drives.duty import checked_dwell
from trajevo.dynamics.rollout import Rollout, rollout_of
from trajevo.errors import InvalidInputError
from trajevo.front.front import Solution
from trajevo.front.records import installed_versions
from trajevo.page.sheet.load_data import LoadData
from trajevo.page.sheet.supplementary import SupplementaryLoad, loads_on
from trajevo.page.sheet.verdicts import Verdict, driven, held, moving, together
from trajevo.plots.pictures import written
from trajevo.robot.payload import with_loads
from trajevo.solvers.gradient.weighted_sum import WeightedOptimum
from trajevo.verification.certificate import Certificate
from trajevo.verification.certify import certify

#: Version of the JSON of a sheet.
SCHEMA = 1

#: What a sheet says of a robot without drives.
NO_DRIVES = "drives not known: neither heat nor RMS torque is judged"


@final
@dataclass(frozen=True, eq=False)
class PayloadSheet:
    """All that a sheet says of one motion with its load.

    Attributes:
        title: what the motion is of.
        motion: which motion, such as "knee (row 3)".
        robot: name of the robot.
        tool: frame of the load data.
        creator: who made the sheet; empty for a line to fill in.
        made_on: date, as 2026-11-30.
        version: version of the program.
        load: data of the load; of the one that capacities mean, if several are carried.
        carried: what is carried from where to where, if that changes; empty otherwise.
        load_model: how the load acts.
        supplementary: loads on links of the arm.
        static: verdict of the arm at rest.
        dynamic: verdict of the motion.
        duty: verdicts of the drives over a cycle.
        duration: of the motion [s].
        dwell: time at rest after it [s].
        kept: share of the robot's effort limits that the problem keeps.
        capacity: the largest payload by the efforts, or None where it is not told.
        capacity_note: why it is not told.
        drive_capacity: the largest payload by the drives over the cycle, or None where that is not told.
        certificate: what is proven of the motion with these loads.
    """

    title: str
    motion: str
    robot: str
    tool: str
    creator: str
    made_on: str
    version: str
    load: LoadData
    carried: str
    load_model: str
    supplementary: tuple[SupplementaryLoad, ...]
    static: Verdict
    dynamic: Verdict
    duty: tuple[Verdict, ...]
    duration: float
    dwell: float
    kept: float
    capacity: Capacity | None
    capacity_note: str
    drive_capacity: DriveCapacity | None
    certificate: Certificate

    __repr__ = brief

    @property
    def verdict(self) -> str:
        """The word of all verdicts together: ``"within limits"``, ``"overloaded"`` or ``"not decided"``."""
        return together((self.static, self.dynamic, *self.duty))

    @property
    def margin(self) -> float | None:
        """How much heavier the load may be by efforts and drives, as a share of its mass; None if that is not told."""
        masses = [one.mass for one in (self.capacity, self.drive_capacity) if one is not None]
        if self.capacity is None or not self.load.mass > 0.0 or not np.isfinite(min(masses)):
            return None
        return min(masses) / self.load.mass - 1.0

    @property
    def cycles_per_hour(self) -> float:
        """How often the motion is made in an hour [1/h]."""
        return 3600.0 / (self.duration + self.dwell)

    @property
    def certified(self) -> dict[str, Any]:
        """The certificate as plain data, of which :attr:`certificate_hash` is."""
        rows = [
            [row.quantity, row.joint, row.unit, *map(_plain, (row.limit, row.bound, row.share, row.instant))]
            for row in self.certificate.rows
        ]
        columns = ["quantity", "joint", "unit", "limit", "bound", "share", "instant_s"]
        return self.certificate.summary | {"motion": self.certificate.motion, "columns": columns, "all_rows": rows}

    @property
    def certificate_hash(self) -> str:
        """SHA-256 of the certificate: of its JSON with sorted keys and without spaces, in UTF-8."""
        text = json.dumps(self.certified, sort_keys=True, separators=(",", ":"), allow_nan=False, ensure_ascii=False)
        return hashlib.sha256(text.encode()).hexdigest()

    def save(self, file: str | Path) -> tuple[Path, Path]:
        """Write the sheet as HTML that needs no network, and the same as JSON beside it.

        Args:
            file: HTML to write; the JSON has the same name with the ending ``.json``.

        Returns:
            Both paths.

        Raises:
            InvalidInputError: a file that ends in .json, or one that cannot be written.
        """
        if not isinstance(file, str | Path):
            raise InvalidInputError(f"file: expected one for HTML, such as 'payload_sheet.html', got {file!r}")
        page = named_file(file)
        if page.suffix == ".json":
            raise InvalidInputError(f"file: expected one for HTML, such as {page.with_suffix('.html')}, got {page}")
        from trajevo.page.sheet.printed import sheet_html

        html = written(page, sheet_html(self).encode())
        return html, written(page.with_suffix(".json"), self.to_json().encode())

    def to_json(self) -> str:
        """The sheet as JSON: SI with units in the names, and a version of its schema."""
        from trajevo.page.sheet.as_json import sheet_data

        return json.dumps(sheet_data(self), indent=1, allow_nan=False, ensure_ascii=False) + "\n"

    def _repr_html_(self) -> str:
        from trajevo.page.sheet.printed import shown_in_notebook

        return shown_in_notebook(self)

    def __str__(self) -> str:
        parts = [f"{self.verdict}: {self.load.mass:g} kg on {self.robot}, {self.motion}"]
        parts += [f"static {self.static}", f"dynamic {self.dynamic}", *(f"{one.about} {one}" for one in self.duty)]
        if self.capacity is not None:
            parts.append(f"largest payload {self.capacity}")
        if self.drive_capacity is not None:
            parts.append(f"by the drives {self.drive_capacity}")
        return "; ".join(parts if self.duty else [*parts, NO_DRIVES])


def payload_sheet(
    motion: Solution | Rollout | WeightedOptimum,
    *,
    dwell: float = 0.0,
    supplementary: Mapping[str, Any] | None = None,
    creator: str = "",
) -> PayloadSheet:
    """The sheet of what a motion carries, to check, sign and keep.

    Args:
        motion: a solution of a front, an optimum, or the rollout of one motion.
        dwell: time at rest after the motion, until it begins anew [s].
        supplementary: loads that are mounted on the arm, joint -> payload, its settings or its mass [kg]; each is fixed
            to the link that the joint moves, with its centre of mass in the joint's frame. They are for the sheet
            alone: the motion was planned without them.
        creator: who makes the sheet.

    Raises:
        InvalidInputError: several motions, a dwell below 0, a robot whose efforts are not known, or a load that cannot
            be mounted.
    """
    given = rollout_of(motion)
    if len(given.trajectory) != 1:
        raise InvalidInputError(f"motion: expected one motion, got {len(given.trajectory)}")
    rest = checked_dwell(dwell)
    if not isinstance(creator, str):
        raise InvalidInputError(f"creator: expected a name, got {creator!r}")
    if given.dynamics.schedule is not None:
        given.dynamics.schedule.check_varied("a sheet")
    given.robot.check_masses("a sheet")
    mounted = loads_on(given.robot, supplementary or {})
    rollout = given
    if mounted:
        model = with_loads(given.robot, {one.joint: one.payload for one in mounted})
        heavier = replace(given.robot, model=model)
        rollout = replace(given, dynamics=replace(given.dynamics, robot=heavier))
    judged: Any = rollout if mounted else motion
    certificate = certify(judged)
    capacity, note = _largest(judged)
    mass = rollout_mass(rollout)
    duty = driven(rollout, rest, mass)
    return PayloadSheet(
        title=motion.front.record.title if isinstance(motion, Solution) else "A motion",
        motion=f"{motion.rule} (row {motion.index})" if isinstance(motion, Solution) else "one motion",
        robot=rollout.robot.name,
        tool=rollout.robot.tool,
        creator=creator,
        made_on=date.today().isoformat(),
        version=installed_versions()["trajevo"],
        load=LoadData.of(
            rollout.dynamics.payload.with_mass(mass) if rollout.masses is not None else rollout.dynamics.payload
        ),
        carried="" if rollout.dynamics.schedule is None else str(rollout.dynamics.schedule),
        load_model=rollout.dynamics.payload.model,
        supplementary=mounted,
        static=held(rollout),
        dynamic=moving(certificate),
        duty=duty,
        duration=float(rollout.trajectory.duration[0]),
        dwell=rest,
        kept=rollout.effort_kept,
        capacity=capacity,
        capacity_note=note,
        drive_capacity=_largest_of_drives(judged, rest) if duty else None,
        certificate=certificate,
    )


def _largest(motion: Any) -> tuple[Capacity | None, str]:
    """The largest payload, or why it is not told."""
    try:
        return dlcc(motion), ""
    except InvalidInputError as error:
        return None, str(error)


def _largest_of_drives(motion: Any, dwell: float) -> DriveCapacity | None:
    """The largest payload by the drives; None where their verdict says why it cannot be told."""
    try:
        return drive_capacity(motion, dwell=dwell)
    except InvalidInputError:
        return None


def _plain(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
