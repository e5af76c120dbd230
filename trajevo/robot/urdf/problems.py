"""Checks of a URDF before Pinocchio reads it, which silently drops an inertia that it cannot read."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Generator, Iterator
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError, nearest_names
from trajevo.robot.urdf.bodies import bodies
from trajevo.robot.urdf.file import read_urdf, urdf_number
from trajevo.robot.urdf.joints import followers, mimic_loop, mimicking
from trajevo.robot.urdf.look import keep_look, without_look

#: Greatest number of links: Pinocchio's reader ends the process where a chain of 4,000 exhausts its stack.
MOST_LINKS = 2_000

#: Share by which a tensor may break the triangle inequality: files hold rounded numbers, which matters for thin plates.
_ROUNDING = 1e-6

#: Elements that nobody reads here. Pinocchio's parser would print their mistakes, raw, on the terminal.
_NOT_READ = ("gazebo", "transmission", "calibration", "safety_controller")

#: Shapes of collision geometry, with the counts of numbers in their attributes.
_SHAPES = {
    "box": {"size": 3},
    "sphere": {"radius": 1},
    "cylinder": {"radius": 1, "length": 1},
    "mesh": {},
}

#: Joint types of the URDF format, and the names of those with several coordinates, which cannot be planned for.
_TYPES = ("revolute", "prismatic", "continuous", "fixed", "floating", "planar")
_UNPLANNABLE = {"floating": "free-flyer", "planar": "planar joint"}

#: Type of a check: it yields problems and returns the value that it read, or None if that cannot be used.
_Reading = Generator[str, None, "float | None"]
_TENSOR = (("ixx", "ixy", "ixz"), ("ixy", "iyy", "iyz"), ("ixz", "iyz", "izz"))


def checked_urdf(file: Path, locked: Collection[str] = ()) -> str:
    """Read a URDF and refuse impossible robots: masses and inertias that no body can have, joints without an axis.

    A link without ``<inertial>``, or with zero mass and inertia, is massless. A link with mass but zero inertia is a
    point mass. Both are allowed.

    Args:
        file: the URDF.
        locked: joints that will be locked; these follow no others.

    Returns:
        The file as XML text for Pinocchio: exactly what was checked, without what is not read, such as colours.

    Raises:
        InvalidInputError: the file is missing or not XML, or the first of :func:`urdf_problems`; the message names
            file, link or joint, and value.
    """
    return checked_text(read_urdf(file), file, locked)


def checked_text(
    robot: ElementTree.Element,
    file: Path | str,
    locked: Collection[str] = (),
    *,
    look: bool = False,
) -> str:
    """As :func:`checked_urdf`, of the top element of a URDF, which is changed.

    Args:
        robot: the element.
        file: where it is from, for messages.
        locked: joints that will be locked.
        look: whether to keep what links look like.
    """
    for problem in urdf_problems(robot, file, locked):
        raise InvalidInputError(problem)
    if look:
        keep_look(robot)
    else:
        without_look(robot)
    for parent in (robot, *robot.iterfind("link"), *robot.iterfind("joint")):
        for child in [child for child in parent if child.tag in _NOT_READ]:
            parent.remove(child)
    return ElementTree.tostring(robot, encoding="unicode")


def urdf_problems(robot: ElementTree.Element, file: Path | str, locked: Collection[str] = ()) -> Iterator[str]:
    """All reasons to refuse a URDF before Pinocchio reads it, one sentence each.

    These are numbers that cannot be read, a negative mass, an inertia that is not positive definite or breaks the
    triangle inequality, a zero axis, a ``<mimic>`` that follows no joint or itself, friction that is negative, limits
    that are missing, negative or cannot be read, a joint whose type is unknown or cannot be planned for, no movable
    joint, names that are missing or not unique, and links that do not form one tree.

    Args:
        robot: top element of the URDF.
        file: the URDF, for the sentences.
        locked: joints that will be locked; these follow no others.
    """
    if robot.tag != "robot":
        yield f"{file}: expected <robot> as the top element, got <{robot.tag}>"
        return
    count = len(robot.findall("link"))
    if count > MOST_LINKS:
        yield f"{file}: expected at most {MOST_LINKS} links, got {count}"
        return
    still = {link.name for body in bodies(robot, ()) if body.joint is None for link in body.links}
    for link in robot.iterfind("link"):
        inertial = link.find("inertial")
        if inertial is not None:
            yield from _inertial_problems(
                inertial, f"{file}: link {link.get('name')!r}", moves=link.get("name", "") not in still
            )
        for collision in link.iterfind("collision"):
            yield from _collision_problems(collision, f"{file}: link {link.get('name')!r}: collision")
    joints = robot.findall("joint")
    for joint in joints:
        yield from _joint_problems(joint, f"{file}: joint {joint.get('name')!r}")
    yield from _mimic_problems(robot, file, locked)
    if all(joint.get("type") == "fixed" for joint in joints):
        yield f"{file}: expected at least one movable joint, got {len(joints)} fixed ones"
    yield from _name_problems(robot, file)
    yield from _tree_problems(robot, file)


def _inertial_problems(inertial: ElementTree.Element, where: str, *, moves: bool) -> Iterator[str]:
    mass = None
    element = inertial.find("mass")
    if element is None:
        yield f"{where}: <inertial> has no <mass>"
    else:
        mass = yield from _number(element, "value", f"{where}: mass")
    if mass is not None and mass < 0.0:
        yield f"{where}: mass: expected a number from 0 on [kg], got {mass}"
    yield from _origin_problems(inertial, f"{where}: inertial")
    element = inertial.find("inertia")
    if element is None:
        yield f"{where}: <inertial> has no <inertia>"
        return
    read = {}
    for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"):
        read[key] = yield from _number(element, key, f"{where}: inertia")
    tensor = np.array([[read[key] for key in row] for row in _TENSOR], dtype=float)  # None becomes NaN
    if mass is None or np.isnan(tensor).any() or not tensor.any():
        return
    if mass > 0.0:
        yield from _tensor_problems(tensor, f"{where}: inertia")
    elif mass == 0.0 and moves:  # of what stands still nothing is used
        yield f"{where}: inertia: expected zeros for a link of mass 0, got {tensor.tolist()} [kg·m²]"


def _collision_problems(collision: ElementTree.Element, where: str) -> Iterator[str]:
    """What Pinocchio's parser cannot read of collision geometry, which it then leaves out."""
    yield from _origin_problems(collision, where)
    shapes = [shape for geometry in collision.iterfind("geometry") for shape in geometry]
    if len(shapes) != 1 or shapes[0].tag not in _SHAPES:
        yield f"{where}: expected one of {', '.join(_SHAPES)}, got {', '.join(shape.tag for shape in shapes) or 'none'}"
        return
    (shape,) = shapes
    for key, count in (_SHAPES[shape.tag] | ({"scale": 3} if "scale" in shape.attrib else {})).items():
        parts = [urdf_number(part) for part in (shape.get(key) or "").split()]
        if len(parts) != count or None in parts:
            yield f"{where}: <{shape.tag}>: expected {count} finite numbers as {key}, got {shape.get(key)!r}"


def _tensor_problems(tensor: Array, where: str) -> Iterator[str]:
    """Problems of a tensor about the centre of mass; its principal moments do not depend on the axes of its frame."""
    moments = np.linalg.eigvalsh(tensor)
    if not moments[0] > 0.0:
        yield f"{where}: expected a positive definite tensor, got principal moments {moments.tolist()} [kg·m²]"
    elif moments[2] - moments[1] > moments[0] + _ROUNDING * moments[2]:
        yield (
            f"{where}: expected no principal moment above the sum of the others (triangle inequality), "
            f"got {moments.tolist()} [kg·m²]"
        )


def _joint_problems(joint: ElementTree.Element, where: str) -> Iterator[str]:
    kind = joint.get("type")
    if kind not in _TYPES:
        yield f"{where}: type: expected revolute, prismatic, continuous or fixed, got {kind!r}"
    elif kind in _UNPLANNABLE:
        yield f"{where} is a {_UNPLANNABLE[kind]}, which cannot be planned for; expected revolute or prismatic"
    yield from _origin_problems(joint, where)
    yield from _limit_problems(joint, where)
    yield from _dynamics_problems(joint, where)
    axis = joint.find("axis")
    # In the URDF format a missing <axis> means the x axis.
    if axis is None or kind in ("fixed", "floating"):
        return
    direction = yield from _vector(axis, "xyz", f"{where}: axis")
    if direction is None:
        return
    with np.errstate(over="ignore"):
        length = np.linalg.norm(direction)
    if not 0.0 < length < np.inf:  # Pinocchio scales it to length 1, which fails for both
        got = "the zero vector" if length == 0.0 else "a vector too long to be scaled to length 1"
        yield f"{where}: axis: expected a direction, got {got} {axis.get('xyz')!r}"


def _limit_problems(joint: ElementTree.Element, where: str) -> Iterator[str]:
    """Limits that Pinocchio's parser refuses, even if those of ``robot.toml`` are used; the rest is checked later."""
    limit = joint.find("limit")
    if limit is None:
        if joint.get("type") in ("revolute", "prismatic"):
            yield f"{where}: a {joint.get('type')} joint has no <limit>"
        return
    for key in ("lower", "upper", "velocity", "effort"):
        if key in limit.attrib or key in ("velocity", "effort"):  # lower and upper are 0 where they are not given
            value = yield from _number(limit, key, f"{where}: limit")
            if value is not None and value < 0.0 and key in ("velocity", "effort") and joint.get("type") != "fixed":
                yield f"{where}: limit: {key}: expected a positive number, got {value:g}"


def _dynamics_problems(joint: ElementTree.Element, where: str) -> Iterator[str]:
    """Friction and damping that cannot be read or would drive the joint."""
    element = joint.find("dynamics")
    if element is None or joint.get("type") == "fixed":
        return
    for key in ("friction", "damping"):
        if key in element.attrib:
            value = yield from _number(element, key, f"{where}: dynamics")
            if value is not None and value < 0.0:
                yield f"{where}: dynamics: {key}: expected a number from 0 on, got {value:g}"


def _mimic_problems(robot: ElementTree.Element, file: Path | str, locked: Collection[str]) -> Iterator[str]:
    """Joints that follow none, or themselves; a fixed or locked joint follows no other, whatever it mimics."""
    found, names = mimicking(robot, locked), [joint.get("name", "") for joint in robot.iterfind("joint")]
    for joint in robot.iterfind("joint"):
        follower, mimic = found.get(joint.get("name", "")), joint.find("mimic")
        if follower is None or mimic is None:
            continue
        where = f"{file}: joint {follower.name!r}: mimic"
        if follower.leader not in names:
            nearest = nearest_names(follower.leader, names)
            meant = f"; did you mean {nearest[0]!r}?" if nearest else ""
            yield f"{where}: expected a joint of the file, got {mimic.get('joint')!r}{meant}"
        for key in ("multiplier", "offset"):
            if key in mimic.attrib:
                yield from _number(mimic, key, where)
    loop = mimic_loop(found)
    if loop:
        yield f"{file}: expected joints that follow one that moves by itself, got a circle: {' -> '.join(loop)}"
    for follower in followers(robot, dict.fromkeys(locked, 0.0))[0]:
        if found[follower.name].multiplier < np.inf and not np.isfinite([follower.multiplier, follower.offset]).all():
            yield f"{file}: expected finite numbers for joints that follow followers, got {follower}"


def _name_problems(robot: ElementTree.Element, file: Path | str) -> Iterator[str]:
    for tag in ("link", "joint"):
        counts = Counter(element.get("name") for element in robot.iterfind(tag))
        for name, count in counts.items():
            if not name:
                yield f"{file}: expected a name for every {tag}, got {count} without one"
            elif not name.isprintable():
                yield f"{file}: {tag} {name!r}: expected a name of printable characters on one line"
            elif count > 1:
                yield f"{file}: {tag} {name!r}: expected a unique name, got {count} {tag}s with that name"


def _tree_problems(robot: ElementTree.Element, file: Path | str) -> Iterator[str]:
    """Links that the joints do not connect into one tree."""
    links = list(dict.fromkeys(link.get("name", "") for link in robot.iterfind("link")))
    parents: dict[str, list[str]] = {link: [] for link in links}
    torn = False
    for joint in robot.iterfind("joint"):
        ends = {}
        for role in ("parent", "child"):
            element = joint.find(role)
            ends[role] = None if element is None else element.get("link")
            if ends[role] not in parents:
                torn = True
                nearest = nearest_names(ends[role] or "", links)
                meant = f"; did you mean {nearest[0]!r}?" if nearest else ""
                where = f"{file}: joint {joint.get('name')!r}: {role}"
                yield f"{where}: expected a link of the file, got {ends[role]!r}{meant}"
        parent, child = ends["parent"], ends["child"]
        if parent in parents and child in parents and parent is not None and child is not None:
            parents[child].append(parent)
    for link, above in parents.items():
        if len(above) > 1:
            yield f"{file}: link {link!r}: expected one joint to carry it, got {len(above)}, from {above}"
    # A joint without a parent or child leaves a second root behind; the joint is already reported above.
    roots = [link for link, above in parents.items() if not above]
    if len(roots) > 1 and not torn:
        yield f"{file}: expected one root link, which no joint carries, got {len(roots)}: {roots}"
    loop = _loop(parents)
    if loop:
        yield f"{file}: expected links that form a tree, got a loop: {' -> '.join(loop)}"


def _loop(parents: dict[str, list[str]]) -> list[str]:
    """Links of a loop from parent to child, the first again at the end; empty if there is none."""
    clear: set[str] = set()  # links from which the way up was walked: no loop is above them
    for start in parents:
        path, at = {start: None}, start
        while at not in clear and parents[at]:
            at = parents[at][0]
            if at in path:
                walked = list(path)
                return [at, *reversed(walked[walked.index(at) :])]
            path[at] = None
        clear.update(path)
    return []


def _origin_problems(parent: ElementTree.Element, where: str) -> Iterator[str]:
    origin = parent.find("origin")
    for key in ("xyz", "rpy"):
        if origin is not None and key in origin.attrib:
            yield from _vector(origin, key, f"{where}: origin")


def _number(element: ElementTree.Element, key: str, where: str) -> _Reading:
    value = urdf_number(element.get(key))
    if value is None:
        written = element.get(key)
        yield f"{where}: expected a finite number as {key}, got {'none' if written is None else repr(written)}"
    return value


def _vector(element: ElementTree.Element, key: str, where: str) -> Generator[str, None, Array | None]:
    parts = [urdf_number(part) for part in (element.get(key) or "").split()]
    if len(parts) != 3 or None in parts:
        yield f"{where}: expected three finite numbers as {key}, got {element.get(key)!r}"
        return None
    return np.array(parts, dtype=float)
