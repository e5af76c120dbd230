"""All problems of a robot at once: errors that prevent loading it, and warnings about what is suspicious."""

from __future__ import annotations

import warnings as python_warnings
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from trajevo.base.shown.brief import brief
from trajevo.base.toml import read_toml
from trajevo.errors import InvalidInputError, TrajevoError
from trajevo.robot.description import Description
from trajevo.robot.files.formats import described
from trajevo.robot.files.xacro_files import ENDING
from trajevo.robot.joints import DIRECTED
from trajevo.robot.limit_files import A_FORMAT, per_joint, tighten, unit_of
from trajevo.robot.loading.arguments import package_folders
from trajevo.robot.locate import RobotSource, other_robot, robot_source
from trajevo.robot.masses import MovingBody, placeholders
from trajevo.robot.moveit_limits import examined_joint_limits
from trajevo.robot.robot import Robot, load_robot
from trajevo.robot.robot_toml import RobotFile, entry_problems
from trajevo.robot.urdf.bodies import Body, LinkRow, bodies, link_rows, massless_bodies, tips
from trajevo.robot.urdf.file import read_number, read_urdf, urdf_number
from trajevo.robot.urdf.joints import Follower, dynamics_of, followers
from trajevo.robot.urdf.likely_units import unit_warnings
from trajevo.robot.urdf.problems import urdf_problems

#: If no effort limit is below this one, all are taken for placeholders: the URDF format requires numbers [N·m or N].
PLACEHOLDER_EFFORT = 1000.0

_UNITS = {"revolute": "rad", "continuous": "rad", "prismatic": "m"}


@dataclass(frozen=True)
class JointRow:
    """One joint that is planned for, SI; NaN where the file gives no number.

    Attributes:
        name: name of the joint, or of the actuator that a transmission puts in its place.
        type: type in the URDF, or ``"actuator"`` for an actuator of a transmission.
        unit: ``"rad"`` or ``"m"``.
        lower: least position [unit].
        upper: greatest position [unit].
        velocity: limit [unit/s].
        acceleration: limit [unit/s²], which a URDF cannot hold.
        jerk: limit [unit/s³], which a URDF cannot hold.
        effort: limit [N·m or N].
        velocity_backward: that of the negative direction; None if it is the same, as the next ones.
        acceleration_backward: the same.
        effort_backward: the same.
    """

    name: str
    type: str
    unit: str
    lower: float
    upper: float
    velocity: float
    acceleration: float
    jerk: float
    effort: float
    velocity_backward: float | None = None
    acceleration_backward: float | None = None
    effort_backward: float | None = None


@dataclass(frozen=True)
class RobotExamination:
    """What :func:`examine` found.

    Attributes:
        name: name by which the robot was requested.
        file: the URDF, or the ``robot.toml`` if that leads to no URDF.
        robot_name: name of the robot in the URDF.
        dof: number of joints that are planned for.
        mass: mass of all links, the base included [kg].
        joints: joints that are planned for.
        links: links of the URDF.
        errors: reasons why the robot cannot be loaded, one sentence each.
        warnings: what is suspicious, or has to be given in addition, one sentence each.
        notes: joints that follow others, and friction that is used, one clause each.
    """

    name: str
    file: Path
    robot_name: str
    dof: int
    mass: float
    joints: tuple[JointRow, ...]
    links: tuple[LinkRow, ...]
    errors: tuple[str, ...]
    warnings: tuple[str, ...]
    notes: tuple[str, ...] = ()

    __repr__ = brief


def examine(
    name: str | Path,
    *,
    lock: Collection[str] = (),
    limits: str | Path | None = None,
    allow_massless: bool | None = None,
    xacro: Mapping[str, Any] | None = None,
    packages: str | Path | Sequence[str | Path] | None = None,
) -> RobotExamination:
    """All problems of a robot at once, even of one that :func:`~trajevo.robot.robot.load_robot` refuses.

    Args:
        name: as :func:`~trajevo.robot.robot.load_robot` takes it.
        lock: joints that will be locked.
        limits: a MoveIt file, whose limits take the place of the robot's own.
        allow_massless: as for :func:`~trajevo.robot.robot.load_robot`.
        xacro: as for :func:`~trajevo.robot.robot.load_robot`.
        packages: as for :func:`~trajevo.robot.robot.load_robot`.

    Returns:
        The joints, the links, and every error and warning, one sentence each.

    Raises:
        UnknownNameError: neither a known robot nor a folder with ``robot.toml`` nor a URDF.
        InvalidInputError: there is no such file, it is not XML, or xacro that cannot be evaluated.
    """
    source = robot_source(name)
    errors: list[str] = []
    settings = None if source.settings is None else _settings(source.settings, errors)
    urdf = source.urdf if source.settings is None else _urdf_of(source.settings)
    more = {"xacro": xacro, "packages": (*package_folders(packages), *source.packages)}
    found = Description("<robot/>") if urdf is None else _described(urdf, lock, errors, more)
    robot = _written(settings, errors) if urdf is None else ElementTree.fromstring(found.text)
    file = urdf or source.settings or source.urdf
    moving = [joint for joint in robot.iterfind("joint") if joint.get("type") in _UNITS]
    following, held = followers(robot, dict.fromkeys(lock, 0.0))
    still = {*held, *(follower.name for follower in following)}
    planned = [joint for joint in moving if joint.get("name") not in still]
    said: Mapping[str, Any] = found.limits
    rows = [replace(_row(joint), **said.get(joint.get("name", ""), {})) for joint in planned]
    if urdf is not None and (moving or found.kind != "MJCF"):
        errors += urdf_problems(robot, urdf, lock)
    if urdf is not None or moving:
        errors += _lock_problems(robot, file, lock)
    if source.settings is None:
        errors += _limit_problems(rows, file)
    elif settings is not None:
        rows = _rows_of_file(settings, rows, errors, lock)
    if limits is not None:
        rows = _rows_with_limits(Path(limits), rows, errors, held, following)
    links = link_rows(robot)
    files = {"xacro": xacro, "packages": packages}
    loaded = None if errors else _loaded(name, rows, lock=lock, links=links, errors=errors, **files)
    return RobotExamination(
        name=str(name),
        file=file,
        robot_name=robot.get("name", ""),
        dof=len(rows),
        mass=float(np.nansum([link.mass for link in links])),
        joints=tuple(rows),
        links=links,
        errors=tuple(errors),
        warnings=(
            *_warnings(source, file, robot, rows, found),
            *_mass_warnings(
                file,
                robot,
                held,
                bool(settings and settings.settings.allow_massless) if allow_massless is None else allow_massless,
                found.between,
            ),
        ),
        notes=() if loaded is None else (*map(str, loaded.followers), *loaded.friction_notes),
    )


def _settings(path: Path, errors: list[str]) -> RobotFile | None:
    """The ``robot.toml`` if its entries can be used; its problems are added to ``errors``."""
    try:
        wrong = entry_problems(path)
        if wrong:
            errors += wrong
            return None
        file = RobotFile(path)
        file.gravity()
    except TrajevoError as error:
        errors.append(str(error))
        return None
    return file


def _described(file: Path, lock: Collection[str], errors: list[str], more: Mapping[str, Any]) -> Description:
    """The description of a file; an empty one if it is MJCF that cannot be used, which is added to ``errors``."""
    try:
        return described(file, lock, **more)
    except InvalidInputError as error:
        if file.suffix.lower() != ENDING and read_urdf(file).tag == "mujoco":
            errors.append(str(error))
            return Description("<robot/>", kind="MJCF")
        raise


def _urdf_of(settings: Path) -> Path | None:
    """URDF of a ``robot.toml`` that may be broken: the one that it names, or else the only one in its folder."""
    try:
        content = read_toml(settings)[0]
    except InvalidInputError:  # is told as an error of the settings
        content = {}
    named = content.get("urdf")
    if isinstance(named, str) and "dh" not in content:
        return settings.parent / named
    there = sorted(settings.parent.glob("*.urdf")) if "dh" not in content else []
    return there[0] if len(there) == 1 else None


def _written(settings: RobotFile | None, errors: list[str]) -> ElementTree.Element:
    """What a Denavit-Hartenberg table describes; an empty robot if it, or ``robot.toml``, cannot be used."""
    try:
        if settings is not None and settings.settings.dh is not None:
            return ElementTree.fromstring(settings.written())
    except InvalidInputError as error:
        errors.append(str(error))
    return ElementTree.Element("robot")


def _row(joint: ElementTree.Element) -> JointRow:
    kind, limit = joint.get("type", ""), joint.find("limit")
    given: dict[str, str] = {} if limit is None else limit.attrib
    if kind == "continuous":  # which has no range, and without <limit> no limits at all
        lower, upper = -np.inf, np.inf
    else:  # in the URDF format a lower or upper limit that is missing is 0
        lower, upper = (_value(given.get(key, None if limit is None else "0")) for key in ("lower", "upper"))
    velocity, effort = (
        np.inf if limit is None and kind == "continuous" else _value(given.get(key)) for key in ("velocity", "effort")
    )
    return JointRow(joint.get("name", ""), kind, _UNITS[kind], lower, upper, velocity, np.nan, np.nan, effort)


def _value(text: str | None) -> float:
    value = urdf_number(text)
    return float("nan") if value is None else value


def _lock_problems(robot: ElementTree.Element, urdf: Path, lock: Collection[str]) -> Iterator[str]:
    types = {joint.get("name", ""): joint.get("type", "") for joint in robot.iterfind("joint")}
    movable = [name for name, kind in types.items() if kind in _UNITS]
    for name in lock:
        if name not in movable:
            yield f"{urdf}: lock: expected a joint that moves, got {name!r}; those that do: {', '.join(movable)}"
    if movable and all(name in lock for name in movable):
        yield f"{urdf}: lock: expected at least one joint that is not locked, got all {len(movable)}"


def _limit_problems(rows: list[JointRow], urdf: Path) -> Iterator[str]:
    """Limits of a URDF that can be read but make no sense; NaN marks those that cannot be read, reported elsewhere."""
    for row in rows:
        where = f"{urdf}: joint {row.name!r}: limit"
        if row.lower >= row.upper:
            yield f"{where}: lower must be below upper, got {row.lower:g} and {row.upper:g} {row.unit}"
        for key, unit in (("velocity", f"{row.unit}/s"), ("effort", "N" if row.unit == "m" else "N·m")):
            value = getattr(row, key)
            if value == 0.0:  # negative limits are reported by urdf_problems
                yield (
                    f"{where}: {key}: expected a positive number, got {value:g} {unit}: give it in robot.toml, in "
                    f'task.toml ([limits] {key} = ...) or as limits={{"{key}": ...}}; inf means no limit'
                )


def _rows_of_file(file: RobotFile, rows: list[JointRow], errors: list[str], lock: Collection[str]) -> list[JointRow]:
    """The actuators with the limits of ``robot.toml``; an actuator whose entry is wrong has those of the URDF."""
    try:
        names, units = file.transmission(tuple(row.name for row in rows), tuple(row.unit for row in rows))[1:]
        if set(names) != set(file.settings.joints) - set(lock):
            file.limits(names, units, lock)  # raises, since the names differ
    except InvalidInputError as error:
        errors.append(str(error))
        return rows
    found = []
    for row, name, unit in zip(rows, names, units, strict=True):
        kind = row.type if row.name == name else "actuator"
        try:
            limits = file.joint_limits(name, unit)
            file.friction((name,), (unit,))
        except InvalidInputError as error:
            errors.append(str(error))
            found.append(row)
            continue
        found.append(JointRow(name, kind, unit, **limits))
    return found


def _rows_with_limits(
    file: Path,
    rows: list[JointRow],
    errors: list[str],
    lock: Collection[str],
    following: Sequence[Follower],
) -> list[JointRow]:
    """The joints with the limits of a MoveIt file in the place of their own; what is wrong with it is an error."""
    names, units = tuple(row.name for row in rows), tuple(row.unit for row in rows)
    led, of_led = tuple(each.name for each in following), tuple(each.unit for each in following)
    try:
        found, problems = examined_joint_limits(file, names + led, units + of_led, lock)
    except InvalidInputError as error:
        errors.append(str(error))
        return rows
    errors += problems
    for limit, given in found.items():
        keys = ("lower", "upper") if limit == "position" else (limit,)
        si = [unit_of(limit, unit) for unit in units + of_led]
        table = per_joint(limit, given, names + led, si, size=len(keys))
        for k, row in enumerate(rows):
            if row.name in given:
                of_both: dict[str, Any] = {f"{limit}_backward": None} if limit in DIRECTED else {}
                rows[k] = replace(row, **dict(zip(keys, table[k].tolist(), strict=True)), **of_both)
                errors += _limit_problems_of(file, rows[k], limit)
        columns = {key: np.array([getattr(row, key) for row in rows]) for key in keys}
        for follower, values in zip(following, table[len(names) :], strict=True):
            if follower.name in given and follower.leader in names:
                try:
                    tighten(columns, names.index(follower.leader), follower, {limit: values}, file)
                except InvalidInputError as error:
                    errors.append(str(error))
        for k, row in enumerate(rows):
            kept: dict[str, Any] = {key: float(column[k]) for key, column in columns.items()}
            rows[k] = replace(row, **kept)
    return rows


def _limit_problems_of(file: Path, row: JointRow, limit: str) -> Iterator[str]:
    """A limit of a joint that can be read but makes no sense."""
    where = f"{file}: joint {row.name!r}: {limit}"
    if limit == "position" and not row.lower < row.upper:
        yield f"{where}: lower must be below upper, got {row.lower:g} and {row.upper:g} {row.unit}"
    if limit != "position" and not getattr(row, limit) > 0.0:
        yield f"{where}: expected a positive number, got {getattr(row, limit):g}"


def _loaded(
    name: str | Path,
    rows: list[JointRow],
    *,
    lock: Collection[str],
    links: tuple[LinkRow, ...],
    errors: list[str],
    **files: Any,
) -> Robot | None:
    """The robot if it can be loaded; everything that a caller has to give besides the files is filled in."""
    besides: dict[str, Any] = {}
    if robot_source(name).settings is None:
        lacking = {
            key: {row.name: np.inf for row in rows if np.isnan(getattr(row, key))} for key in ("velocity", "effort")
        }
        limits = {"acceleration": np.inf, "jerk": np.inf, **{key: given for key, given in lacking.items() if given}}
        besides = {"tool": links[-1].name, "limits": limits}
    try:
        with python_warnings.catch_warnings():
            python_warnings.simplefilter("ignore", UserWarning)
            return load_robot(name, lock=dict.fromkeys(lock, 0.0), **besides, **files)
    except TrajevoError as error:
        errors.append(str(error))
    return None


def _mass_warnings(
    file: Path, robot: ElementTree.Element, lock: Collection[str], meant: bool, between: Collection[str]
) -> Iterator[str]:
    """Links without mass, point masses, and masses and inertias that look like placeholders."""
    for link in link_rows(robot):
        if link.mass > 0.0 and not any(link.moments):
            yield f"{file}: link {link.name!r} is a point mass: {link.mass:g} kg without inertia"
    found = bodies(robot, lock)
    so = "as is meant: efforts leave them out" if meant else "so efforts are refused, unless allow_massless is set"
    for joint, links in massless_bodies(found):
        if set(links) <= set(between):
            continue
        yield f"{file}: joint {joint!r} moves a body without mass: {', '.join(links)}; {so}"
    for link in (link for body in found if body.joint is None for link in body.links):
        if link.mass == 0.0 and any(link.moments):  # NaN is true: told as an error
            yield f"{file}: link {link.name!r}, which stands still, has an inertia without a mass; neither is used"
    for clause in placeholders(_moving(found)):
        yield f"{file}: inertias look like placeholders: {clause}"


def _moving(found: tuple[Body, ...]) -> Iterator[MovingBody]:
    """Bodies that joints move, each with the moments of its heaviest link."""
    for body in found:
        heaviest = max(body.links, key=lambda link: link.mass)
        mass = sum(link.mass for link in body.links)
        if body.joint is not None and np.isfinite([mass, *heaviest.moments]).all():
            yield MovingBody(body.joint, tuple(link.name for link in body.links), mass, heaviest.moments)


def _warnings(
    source: RobotSource, file: Path, robot: ElementTree.Element, rows: list[JointRow], found: Description
) -> Iterator[str]:
    other = other_robot(source)
    if other is not None:
        yield other
    if source.settings is not None:
        return
    for clause in unit_warnings(robot, link_rows(robot)):
        yield f"{file}: {clause}; {A_FORMAT[found.kind]} is in m, kg, s and rad"
    yield from _continuous_warnings(file, robot, rows)
    for name, rubbing in dynamics_of(robot, ()).items():
        for row in (row for row in rows if row.name == name and 0.0 < row.effort <= rubbing.coulomb):
            by = "frictionloss" if found.kind == "MJCF" else "friction by <dynamics>"
            yield (
                f"{file}: joint {name!r} cannot move: its {by}, {rubbing.coulomb:g}, is not below its "
                f"effort limit, {row.effort:g}; lock it, or leave friction out by friction='none'"
            )
    efforts, velocities = {row.effort for row in rows}, {row.velocity for row in rows}
    if rows and all(row.effort >= PLACEHOLDER_EFFORT for row in rows):
        yield f"{file}: effort limits look like placeholders: {min(efforts):g} or more on every joint"
    elif len(rows) > 3 and len(efforts) == len(velocities) == 1 and np.isfinite([*efforts, *velocities]).all():
        yield (
            f"{file}: limits look like placeholders: effort {efforts.pop():g} and velocity {velocities.pop():g} "
            f"on every one of {len(rows)} joints"
        )
    keys = ("acceleration", "jerk") if found.kind != "MJCF" else ("velocity", "effort", "acceleration", "jerk")
    missing = [key for key in keys if any(np.isnan(getattr(row, key)) for row in rows)]
    if missing:
        of = ", ".join(missing[:-1]) + " and " * (len(missing) > 1) + missing[-1]
        lacking = A_FORMAT[found.kind] if found.kind != "MJCF" else "the file"
        yield (
            f"{file}: {of} limits are not in {lacking}: give them in robot.toml, in task.toml "
            "([limits]) or as limits={...}"
        )
    ends = tips(robot)
    if len(ends) > 1:
        yield f"{file}: several tips, so the tool must be named: tool= one of {', '.join(ends)}"


def _continuous_warnings(file: Path, robot: ElementTree.Element, rows: list[JointRow]) -> Iterator[str]:
    """Numbers of continuous joints that are not used, or that are missing."""
    endless = {row.name for row in rows if row.type == "continuous"}
    for joint in robot.iterfind("joint"):
        name, limit = joint.get("name"), joint.find("limit")
        if name not in endless:
            continue
        if limit is None:
            yield f"{file}: joint {name!r} is continuous and has no <limit>: its velocity and effort are not limited"
        elif read_number(limit, "lower") < read_number(limit, "upper"):
            yield (
                f"{file}: joint {name!r} is continuous, so the range of its <limit>, {limit.get('lower')} to "
                f"{limit.get('upper')} rad, is not used; if it is meant, give it as limits={{'position': ...}}"
            )
