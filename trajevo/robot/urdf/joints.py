"""What the joints of a URDF say besides their ranges: which of them follow others, and their friction."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import NamedTuple
from xml.etree import ElementTree

from trajevo.robot.urdf.file import read_number, urdf_number

#: Types of joints that move.
MOVING = ("revolute", "continuous", "prismatic")


class Follower(NamedTuple):
    """A joint that mimics another: its position is multiplier × that of its leader + offset.

    Attributes:
        name: name of the joint.
        leader: name of the joint that it follows; in :func:`followers` one that follows no other.
        multiplier: units of the joint per unit of its leader.
        offset: its position where its leader is at 0 [rad or m].
        unit: ``"rad"`` or ``"m"``.
    """

    name: str
    leader: str
    multiplier: float
    offset: float
    unit: str

    def __str__(self) -> str:
        return f"{self.name!r} follows {self.leader!r} × {self.multiplier:g}" + (
            f" + {self.offset:g}" if self.offset else ""
        )


def mimicking(robot: ElementTree.Element, lock: Collection[str]) -> dict[str, Follower]:
    """The joints that mimic another as the URDF has them, by name; what is fixed or locked follows nothing.

    Numbers that cannot be read are NaN, see :func:`trajevo.robot.urdf.problems.urdf_problems`.
    """
    found = {}
    for joint in robot.iterfind("joint"):
        mimic, name = joint.find("mimic"), joint.get("name", "")
        if mimic is None or joint.get("type") not in MOVING or name in lock:
            continue
        unit = "m" if joint.get("type") == "prismatic" else "rad"
        multiplier = read_number(mimic, "multiplier") if "multiplier" in mimic.attrib else 1.0
        offset = read_number(mimic, "offset") if "offset" in mimic.attrib else 0.0
        found[name] = Follower(name, mimic.get("joint", ""), multiplier, offset, unit)
    return found


def mimic_loop(found: Mapping[str, Follower]) -> list[str]:
    """Joints that mimic each other in a circle, the first again at the end; empty if there are none."""
    clear: set[str] = set()  # joints from which the leaders were walked through: they lead to no circle
    for start in found:
        path, at = {start: None}, found[start].leader
        while at in found and at not in clear:
            if at in path:
                walked = list(path)
                return [*walked[walked.index(at) :], at]
            path[at] = None
            at = found[at].leader
        clear.update(path)
    return []


def followers(robot: ElementTree.Element, lock: Mapping[str, float]) -> tuple[tuple[Follower, ...], dict[str, float]]:
    """The joints that follow joints that move, and all joints that are held still.

    Args:
        robot: top element of a URDF. Joints that follow each other in a circle, which
            :func:`~trajevo.robot.urdf.problems.urdf_problems` tells, are no followers.
        lock: positions of the joints that a caller locks [rad or m].

    Returns:
        Followers, each with a leader that moves by itself, and positions [rad or m]: those of ``lock``, and of joints
        that follow a locked or a fixed one, or one by a multiplier of 0.
    """
    found, held = mimicking(robot, lock), dict(lock)
    if mimic_loop(found):
        return (), held
    fixed = {joint.get("name", "") for joint in robot.iterfind("joint") if joint.get("type") == "fixed"}
    following = []
    for name, (_, leader, multiplier, offset, unit) in found.items():
        while leader in found:
            _, leader, factor, shift, _ = found[leader]
            multiplier, offset = multiplier * factor, multiplier * shift + offset
        if leader in lock or leader in fixed or multiplier == 0.0:
            held[name] = multiplier * lock.get(leader, 0.0) + offset
        else:
            following.append(Follower(name, leader, multiplier, offset, unit))
    return tuple(following), held


class JointFriction(NamedTuple):
    """Friction and damping of a joint by ``<dynamics>``.

    Attributes:
        viscous: ``damping``, viscous friction [N·m·s/rad or N·s/m].
        coulomb: ``friction``, dry friction [N·m or N].
        slides: whether the joint is prismatic.
        armature: inertia of motor and gear, which a URDF cannot hold [kg·m² or kg].
    """

    viscous: float
    coulomb: float
    slides: bool
    armature: float = 0.0


def dynamics_of(
    robot: ElementTree.Element, lock: Collection[str], armature: Mapping[str, float] | None = None
) -> dict[str, JointFriction]:
    """Friction and armature of the joints that move and have any, by name.

    Args:
        robot: top element of a URDF.
        lock: joints that are held still.
        armature: of joints, by name [kg·m² or kg].
    """
    inertias = armature or {}
    found = {}
    for joint in robot.iterfind("joint"):
        element, name = joint.find("dynamics"), joint.get("name", "")
        inertia = inertias.get(name, 0.0)
        if (element is None and not inertia) or joint.get("type") not in MOVING or name in lock:
            continue
        given = {} if element is None else element.attrib
        viscous, coulomb = (urdf_number(given.get(key)) or 0.0 for key in ("damping", "friction"))
        if viscous or coulomb or inertia:
            found[name] = JointFriction(viscous, coulomb, joint.get("type") == "prismatic", inertia)
    return found
