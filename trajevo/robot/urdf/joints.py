"""What the joints of a URDF say besides their limits: friction."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from xml.etree import ElementTree

from trajevo.robot.urdf.file import read_number


def dropped_friction(robot: ElementTree.Element, lock: Collection[str]) -> Iterator[str]:
    """Friction and damping of ``<dynamics>``, which efforts leave out, one clause for each joint that has any."""
    for joint in robot.iterfind("joint"):
        element = joint.find("dynamics")
        if element is None or joint.get("type") == "fixed" or joint.get("name") in lock:
            continue
        unit = "N" if joint.get("type") == "prismatic" else "N·m"
        rate = "N·s/m" if joint.get("type") == "prismatic" else "N·m·s/rad"
        parts = []
        for key, of in (("friction", unit), ("damping", rate)):
            value = read_number(element, key)
            if value > 0.0:  # NaN: not given, or unreadable, which the reader of the model ignores as well
                parts.append(f"{key} {value:g} {of}")
        if parts:
            yield f"{' and '.join(parts)} of {joint.get('name')!r}"
