"""The ways to a robot without a URDF: from a Denavit-Hartenberg table, from links in a plane, from limits alone."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np

from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError, checked_name
from trajevo.robot.limit_files import is_pair
from trajevo.robot.loading.arguments import STANDARD_GRAVITY, checked_gravity, plain_settings
from trajevo.robot.loading.chain import DhStep, Pose6, Segment, chain_urdf
from trajevo.robot.loading.dh import KINDS, DhTable, joint_names, planar_rows
from trajevo.robot.loading.drives import plain_drives


@dataclass(frozen=True, eq=False)
class Written:
    """A robot that no file describes.

    Attributes:
        name: its name.
        urdf: URDF text.
        origin: what it was made from, for the robot's reference.
        limits: limits as :func:`~trajevo.robot.robot.load_robot` takes them; a quantity that is missing is unlimited.
        gravity: in the base frame, shape (3,) [m/s²].
        has_body: whether it is more than joints and limits.
        allow_massless: as for :func:`~trajevo.robot.robot.load_robot`.
        settings: plain data from which it can be made again with its limits.
        base: pose of the base in the cell; None if they are one.
        drives: drives of joints by their names; None for none.
    """

    name: str
    urdf: str
    origin: str
    limits: Any
    gravity: Any
    has_body: bool
    allow_massless: bool
    settings: Mapping[str, Any]
    base: Any = None
    drives: Any = None

    __repr__ = brief


class WithoutUrdf(ABC):
    """What makes a robot without a URDF."""

    @classmethod
    @abstractmethod
    def _written(cls, given: Written) -> Self:
        """The robot that a text describes."""

    @classmethod
    def from_dh(
        cls,
        rows: Sequence[Mapping[str, Any]],
        *,
        convention: str,
        masses: Any = None,
        coms: Any = None,
        inertias: Any = None,
        names: Sequence[str] | None = None,
        tool: Mapping[str, Any] | None = None,
        limits: Mapping[str, Any] | str | Path | None = None,
        gravity: Any = STANDARD_GRAVITY,
        allow_massless: bool = False,
        base: Mapping[str, Any] | None = None,
        drives: Mapping[str, Any] | None = None,
        name: str = "dh_robot",
    ) -> Self:
        """A robot from a Denavit-Hartenberg table.

        Args:
            rows: one mapping per joint, from the base on, with ``a`` and ``d`` [m] and ``alpha`` and ``theta`` [rad],
                or text with a unit such as ``"90 deg"``, and ``joint``, ``"revolute"`` (if left out) or
                ``"prismatic"``. The ``theta`` of a revolute joint and the ``d`` of a prismatic one is added to its
                position; 0 if left out.
            convention: ``"standard"``, row i is Rz(θ) Tz(d) Tx(a) Rx(α), or ``"modified"`` (Craig), row i is
                Rx(α) Tx(a) Rz(θ) Tz(d), where a and α have the index i - 1 in books.
            masses: of the links, one per row [kg]; if None, the robot has no masses, and efforts are refused.
            coms: centres of mass, each in the frame of its row, shape (n, 3) [m].
            inertias: about the centres of mass, along the axes of these frames, each (3, 3) or its diagonal (3,)
                [kg·m²]; if None, the masses are points.
            names: of the joints; ``joint_1`` and so on if None.
            tool: pose of the tool in the last frame, a mapping with ``position`` [m] and ``rpy`` [rad]; that frame if
                None.
            limits: as for :func:`~trajevo.robot.robot.load_robot`; what is not given is unlimited.
            gravity: in the base frame, shape (3,) [m/s²].
            allow_massless: as for :func:`~trajevo.robot.robot.load_robot`.
            base: pose of the base in the cell, as for :func:`~trajevo.robot.robot.load_robot`.
            drives: drives of joints by their names, as for :func:`~trajevo.robot.robot.load_robot`.
            name: of the robot.

        Returns:
            The robot, with the frames ``base``, ``link_1`` and so on, ``flange`` (of the last row) and ``tool``.

        Raises:
            InvalidInputError: a number, a row, a name or a limit that cannot be used, or an inertia that no body has.
            UnknownNameError: no such convention, key of a row, kind of joint or limit.
        """
        _check_name(name)
        table = DhTable.of(
            rows, convention=convention, masses=masses, coms=coms, inertias=inertias, names=names, tool=tool
        )
        if not isinstance(allow_massless, bool):
            raise InvalidInputError(f"allow_massless: expected True or False, got {allow_massless!r}")
        down = checked_gravity(gravity)
        chosen = {"gravity": down, "allow_massless": allow_massless, "base": base, "drives": plain_drives(drives)}
        return cls._written(
            Written(
                name=name,
                urdf=table.urdf(name),
                origin=f"{convention} Denavit-Hartenberg table",
                limits=limits,
                gravity=down,
                has_body=True,
                allow_massless=allow_massless,
                base=base,
                drives=drives,
                settings={"name": name, "dh": table.settings, **plain_settings(chosen)},
            )
        )

    @classmethod
    def planar(
        cls,
        lengths: Any,
        masses: Any,
        coms: Any,
        inertias: Any,
        *,
        names: Sequence[str] | None = None,
        limits: Mapping[str, Any] | str | Path | None = None,
        gravity: Any = STANDARD_GRAVITY,
        base: Mapping[str, Any] | None = None,
        drives: Mapping[str, Any] | None = None,
        name: str = "planar_robot",
    ) -> Self:
        """A chain of links in the x-y plane of the base, all of whose joints turn about z.

        At position 0 all links lie along x. The links are laminas: their moment about an axis in the plane is half of
        that about z, which plays no part in their motion.

        Args:
            lengths: from each joint to the next, and from the last to the tool, shape (n,) [m].
            masses: of the links, shape (n,) [kg].
            coms: distances of the centres of mass from the joints, along the links, shape (n,) [m].
            inertias: moments of inertia about z through the centres of mass, shape (n,) [kg·m²].
            names: of the joints; ``joint_1`` and so on if None.
            limits: as for :func:`~trajevo.robot.robot.load_robot`; what is not given is unlimited.
            gravity: in the base frame, shape (3,) [m/s²]: along -z, so that the plane is level; an upright plane has
                ``(0.0, -9.80665, 0.0)``.
            base: pose of the base in the cell, as for :func:`~trajevo.robot.robot.load_robot`.
            drives: drives of joints by their names, as for :func:`~trajevo.robot.robot.load_robot`.
            name: of the robot.

        Raises:
            InvalidInputError: as for :meth:`from_dh`, or a negative length.
            UnknownNameError: no such limit.
        """
        rows, places, tensors = planar_rows(lengths, coms, inertias)
        return cls.from_dh(
            rows,
            convention="standard",
            masses=masses,
            coms=places,
            inertias=tensors,
            names=names,
            limits=limits,
            gravity=gravity,
            base=base,
            drives=drives,
            name=name,
        )

    @classmethod
    def from_limits(
        cls,
        *,
        velocity: Any,
        acceleration: Any,
        jerk: Any,
        position: Any = None,
        names: Sequence[str] | None = None,
        kind: str | Sequence[str] = "revolute",
        name: str = "joints",
    ) -> Self:
        """Joints and their limits alone: what needs a body, such as effort, energy or the tool, is refused by name.

        Args:
            velocity: limits, one number for all joints, one for each, or a mapping from names to numbers, SI or text
                with a unit such as ``"100 deg/s"``; ``inf`` means no limit. In the place of a number may stand
                ``{"backward": 60.0, "forward": 80.0}``, the magnitudes for both directions.
            acceleration: the same.
            jerk: the same, with one number for both directions.
            position: pairs of a lower and an upper limit, in the same ways; unlimited if None.
            names: of the joints; if None, ``joint_1`` and so on, as many as limits or kinds are listed.
            kind: ``"revolute"`` or ``"prismatic"``, for all joints or for each.
            name: of the robot.

        Raises:
            InvalidInputError: a limit or a name that cannot be used, a joint without a limit, or nothing that says how
                many joints there are.
            UnknownNameError: a limit of an unknown joint, or no such kind.
        """
        _check_name(name)
        limits = {"velocity": velocity, "acceleration": acceleration, "jerk": jerk}
        limits |= {} if position is None else {"position": position}
        called = joint_names(names, _count(names, kind, limits))
        kinds = [kind] * len(called) if isinstance(kind, str) else kind
        if not isinstance(kinds, list | tuple) or len(kinds) != len(called):
            raise InvalidInputError(f"kind: expected one or {len(called)}, one for each joint, got {kind!r}")
        for one in kinds:
            checked_name("kind of joint", one, KINDS)
        for key, values in limits.items():
            by_joint = isinstance(values, Mapping) and not is_pair(values, called)
            lacking = [joint for joint in called if by_joint and joint not in values]
            if lacking:
                raise InvalidInputError(f"{key}: expected a limit for {', '.join(lacking)}, got none; inf is no limit")
        nothing = 0.0, np.zeros(3), np.zeros((3, 3))
        segments = [Segment(joint, one, DhStep(), DhStep(), *nothing) for joint, one in zip(called, kinds, strict=True)]
        return cls._written(
            Written(
                name=name,
                urdf=chain_urdf(name, segments, DhStep(), Pose6(np.zeros(3), np.zeros(3))),
                origin="limits alone",
                limits=limits,
                gravity=np.array(STANDARD_GRAVITY),
                has_body=False,
                allow_massless=False,
                settings={"name": name, "joints": list(called), "kind": list(kinds)},
            )
        )


def _check_name(name: Any) -> None:
    if not isinstance(name, str) or not name or not name.isprintable():
        raise InvalidInputError(f"name: expected printable characters on one line, got {name!r}")


def _count(names: Any, kind: Any, limits: Mapping[str, Any]) -> int:
    """Number of joints: as many as are named, or else as limits or kinds are listed."""
    for given in (names, *(limits[key] for key in ("velocity", "acceleration", "jerk")), kind):
        if isinstance(given, list | tuple | np.ndarray | Mapping) and len(given) and not is_pair(given):
            return len(given)
    raise InvalidInputError("names: expected the names of the joints, as no limit is given for each of them, got none")


def written_robot_of(cls: type[Any], given: Mapping[str, Any]) -> Any:
    """The robot that a mapping with ``dh`` or ``joints`` describes, as in settings and in ``[robot]`` of a task.

    Args:
        cls: the class that makes it.
        given: ``name``, and ``dh`` (a mapping with the table's arguments of :meth:`WithoutUrdf.from_dh`), ``limits``,
            ``gravity``, ``allow_massless`` and ``drives``; or ``joints`` (names), ``kind`` and ``limits``.

    Raises:
        InvalidInputError: another key, or as for the two methods.
    """
    by_table = "dh" in given
    if not by_table and "joints" not in given:
        raise InvalidInputError("robot: kind: expected joints with it, the names of the robot's joints, got none")
    accepted = (
        ("name", "dh", "limits", "gravity", "allow_massless", "base", "drives")
        if by_table
        else ("name", "joints", "kind", "limits")
    )
    rest = [key for key in given if key not in accepted]
    if rest:
        raise InvalidInputError(
            f"robot: expected {', '.join(accepted)} of a robot that {accepted[1]!r} describes, got {rest[0]!r}"
        )
    others = {key: given[key] for key in given if key not in ("dh", "joints", "limits")}
    if by_table:
        return cls.from_dh(**_keywords(given["dh"], "dh", _TABLE), **others, limits=given.get("limits"))
    limits = _keywords(given.get("limits", {}), "limits", _ALONE)
    return cls.from_limits(names=given["joints"], **limits, **others)


_TABLE = {"rows": True, "convention": True} | dict.fromkeys(("masses", "coms", "inertias", "names", "tool"), False)
_ALONE = {"velocity": True, "acceleration": True, "jerk": True, "position": False}


def _keywords(given: Any, where: str, known: Mapping[str, bool]) -> Mapping[str, Any]:
    """A mapping with all the keys that are needed, and no unknown ones."""
    if not isinstance(given, Mapping):
        raise InvalidInputError(f"robot: {where}: expected a mapping, got {given!r}")
    if where == "limits" and "effort" in given:
        raise InvalidInputError(
            "robot: limits: effort: a robot of joints and limits alone has none, as effort needs a body: "
            "give a URDF or a Denavit-Hartenberg table"
        )
    for key in given:
        checked_name(f"key of {where}", key, known)
    lacking = [key for key, needed in known.items() if needed and key not in given]
    if lacking:
        raise InvalidInputError(f"robot: {where}: expected {', '.join(lacking)}, got none")
    return given
