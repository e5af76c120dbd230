"""What the file of a robot says, whatever its format: URDF text, and what a URDF cannot hold."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from trajevo.base.arrays import Array


@dataclass(frozen=True, eq=False)
class Description:
    """A robot as URDF text, and what else its file says.

    Attributes:
        text: the URDF, checked.
        kind: format of the file, such as ``"URDF"`` or ``"MJCF"``.
        as_written: whether the text is the file itself, which can be read again.
        limits: of joints, by name and then ``lower``, ``upper``, ``velocity``, ``effort`` or, where it differs,
            ``effort_backward`` [SI], in place of those of the text; NaN for what the format cannot hold or the file
            does not say.
        armature: inertia of motor and gear at joints, by name [kg·m² or kg].
        gravity: in the base frame, shape (3,) [m/s²]; None if the file does not say.
        between: links without mass between joints of one body, which no body lacks.
        notes: what the file says and efforts leave out, one clause each.
    """

    text: str
    kind: str = "URDF"
    as_written: bool = True
    limits: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    armature: Mapping[str, float] = field(default_factory=dict)
    gravity: Array | None = None
    between: frozenset[str] = frozenset()
    notes: tuple[str, ...] = ()
