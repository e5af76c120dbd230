"""Robots: a Pinocchio model with the limits that a URDF cannot hold, and how it is loaded.

:func:`load_robot` builds a robot from a folder ``<name>/`` with ``<name>.urdf``, ``robot.toml`` (limits with units,
tool) and ``SOURCE.md`` (where each number comes from), or from a bare URDF, for which the caller gives what it lacks.
"""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np

from trajevo.base.arrays import Array, numbers
from trajevo.base.plugins import deferred
from trajevo.base.shown import html
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError
from trajevo.robot.contacts.given import contacts_of, plain_contacts
from trajevo.robot.contacts.grip import Grip
from trajevo.robot.contacts.stand import Stand
from trajevo.robot.description import Description
from trajevo.robot.drive import Drive
from trajevo.robot.files.cell import placed
from trajevo.robot.files.opened import opened
from trajevo.robot.files.parts import drives_of, gravity_of, masses_meant, tool_of
from trajevo.robot.friction_sources import friction_notes, friction_of
from trajevo.robot.joints import Friction, JointLimits, limits_table
from trajevo.robot.limit_files import declared_limits, given_limits, limits_or_none
from trajevo.robot.loading.arguments import load_settings, package_folders, plain_settings
from trajevo.robot.loading.chain import TOOL
from trajevo.robot.loading.constructors import WithoutUrdf, Written, written_robot_of
from trajevo.robot.loading.drives import plain_drives, robot_drives, with_rotors
from trajevo.robot.loading.supply import Supply, plain_supply, supply_of
from trajevo.robot.masses import massless, moving_bodies, moving_mass, placeholders
from trajevo.robot.transmission import Direct, Transmission
from trajevo.robot.urdf.file import read_urdf
from trajevo.robot.urdf.joints import Follower, dynamics_of, followers
from trajevo.robot.urdf.look import without_look
from trajevo.robot.urdf.model import build_model
from trajevo.robot.urdf.problems import checked_urdf

if TYPE_CHECKING:
    import pinocchio as pin
else:  # which takes a tenth of the time of importing trajevo
    pin = deferred("pinocchio")


@dataclass(frozen=True, eq=False)
class Robot(WithoutUrdf):
    """A robot: Pinocchio model, transmission, limits, friction and tool frame.

    Motions are planned for its actuators: "joint" means an actuated coordinate everywhere. For most robots these are
    the joints of the model.

    Attributes:
        name: name of the robot.
        model: Pinocchio model with one configuration coordinate per joint (nq == nv), n_model in all, also those that
            mimic others, and the gravity in its base frame.
        transmission: actuator coordinates -> model coordinates.
        limits: joint limits, SI.
        friction: viscous and Coulomb friction and armature of the actuators.
        joint_names: names of the joints in the order of every (..., n_joints) array.
        joint_units: ``"rad"`` or ``"m"`` per joint.
        tool: name of the frame at the end effector.
        source: folder the robot was loaded from; None if from no file.
        reference: where its numbers come from, one line.
        urdf: the file that describes it, URDF, xacro or MJCF; None if it has none.
        packages: folders in which ``package://`` paths are looked up.
        locked: positions of the joints of the URDF that are locked [rad or m].
        settings: arguments of :func:`load_robot` as plain data: the name alone, or the given arguments by name.
        allow_massless: whether it is meant that links have no mass, so that efforts leave them out; otherwise efforts
            are refused.
        followers: joints of the model that mimic one of the robot's joints.
        friction_used: friction and damping by ``<dynamics>`` of the URDF that ``friction`` holds, one clause for each
            value, with its joints.
        friction_left_out: the same of what ``friction`` does not hold.
        written: the robot as URDF text if that is not the content of ``urdf``.
        file_kind: format of its file.
        file_notes: what its file says and efforts leave out, one clause each.
        has_body: whether it is more than joints and limits.
        drives: drives of joints by their names, of those that have one.
        grip: how it holds a payload; None if that is not told.
        stand: what it stands on; None if it is bolted down.
        supply: what feeds them.
    """

    name: str
    model: Any
    transmission: Transmission
    limits: JointLimits
    friction: Friction
    joint_names: tuple[str, ...]
    joint_units: tuple[str, ...]
    tool: str
    source: Path | None
    reference: str
    urdf: Path | None
    packages: tuple[Path, ...] = ()
    locked: Mapping[str, float] = field(default_factory=dict)
    settings: Any = None
    allow_massless: bool = False
    followers: tuple[Follower, ...] = ()
    friction_used: tuple[str, ...] = ()
    friction_left_out: tuple[str, ...] = ()
    written: str = ""
    file_kind: str = "URDF"
    file_notes: tuple[str, ...] = ()
    has_body: bool = True
    drives: Mapping[str, Drive] = field(default_factory=dict)
    grip: Grip | None = None
    stand: Stand | None = None
    supply: Supply = field(default_factory=Supply)

    __repr__ = brief

    def _repr_html_(self) -> str:
        told = {"mass": f"{self.mass:.4g} kg" if self.has_body else "", "tool": self.tool}
        told |= {"locked": ", ".join(self.locked), "from": str(self.urdf or self.reference)}
        told |= {"notes": "; ".join(self.mass_notes)}
        table = limits_table(self.limits, self.joint_names, self.joint_units)
        return html.shown(f"Robot {self.name}: {self.dof} joints", html.facts(told), table)

    @classmethod
    def _written(cls, given: Written) -> Robot:
        where = f"robot {given.name!r}"
        text = placed(Description(given.urdf), given.base, where).text
        model, units = build_model(text, where, {})
        model.gravity.linear = given.gravity
        names = tuple(model.names[1:])
        limits = given_limits(given.limits, names, units, ())
        drives = robot_drives(given.drives, {}, names, units)
        return cls(
            name=given.name,
            model=model,
            transmission=Direct(),
            limits=JointLimits(**limits_or_none(names, units, limits, where)),
            friction=with_rotors(Friction(*np.zeros((3, len(names)))), drives, names),
            joint_names=names,
            joint_units=units,
            tool=TOOL,
            source=None,
            reference=f"{given.origin}, {len(names)} joints" + (f", {moving_mass(model):.4g} kg" * given.has_body),
            urdf=None,
            settings={**given.settings, **plain_settings({"limits": limits or None})},
            allow_massless=given.allow_massless,
            written=text,
            has_body=given.has_body,
            drives=drives,
        )

    def __str__(self) -> str:
        if self.urdf is None:
            return f"{self.name}: {self.reference}"
        held = f", {len(self.locked)} locked" if self.locked else ""
        return f"{self.name}: {self.dof} joints{held}, {self.mass:.4g} kg, tool {self.tool}, {self.urdf}"

    @property
    def where(self) -> str:
        """What messages about its description begin with: the URDF file, or the robot's name."""
        return f"robot {self.name!r}" if self.urdf is None else str(self.urdf)

    def description(self) -> ElementTree.Element:
        """The top element of its URDF, read anew if that is the content of a file."""
        return ElementTree.fromstring(self.written) if self.urdf is None or self.written else read_urdf(self.urdf)

    def checked_text(self) -> str:
        """Its URDF as text for Pinocchio, read anew and checked if that is the content of a file; without looks."""
        if self.urdf is not None and not self.written:
            return checked_urdf(self.urdf, self.locked)
        document = ElementTree.fromstring(self.written)
        without_look(document)
        return ElementTree.tostring(document, encoding="unicode")

    def check_body(self, quantity: str) -> None:
        """Refuse a quantity, by an InvalidInputError that names it, if the robot is joints and limits alone."""
        if not self.has_body:
            raise InvalidInputError(
                f"robot {self.name!r}: {quantity} needs a body, and this robot is joints and limits alone: give a URDF "
                "(load_robot) or a Denavit-Hartenberg table (Robot.from_dh)"
            )

    @property
    def mass(self) -> float:
        """Mass of everything that moves [kg]."""
        return moving_mass(self.model)

    @cached_property
    def massless(self) -> tuple[str, ...]:
        """Links of all bodies without mass that a joint of the model moves."""
        return tuple(link for body in massless(moving_bodies(self.model)) for link in body.links)

    @property
    def gives_effort(self) -> bool:
        """Whether efforts can be computed: there is a body, and no link lacks its mass, or that is meant."""
        return self.has_body and (self.allow_massless or not self.massless)

    def check_masses(self, quantity: str) -> None:
        """Refuse a quantity that needs the masses of links that have none, unless ``allow_massless`` is set.

        Args:
            quantity: what is to be computed, such as ``"energy"``, for the message.

        Raises:
            InvalidInputError: a joint moves a body without mass, or none; the message names the links and joints.
        """
        self.check_body(quantity)
        if self.gives_effort:
            return
        missing = "; ".join(
            f"{', '.join(body.links)}, which {body.joint!r} moves" for body in massless(moving_bodies(self.model))
        )
        way = "masses" if self.urdf is None else "an <inertial> in the URDF"
        raise InvalidInputError(
            f"robot {self.name!r}: {quantity} needs masses, but these links have none in the model: {missing}; "
            f"give them {way}, or say that it is meant: allow_massless=True, or allow_massless = true in [robot] of a "
            "task"
        )

    @cached_property
    def mass_notes(self) -> tuple[str, ...]:
        """What efforts of this robot cover or not, one clause each: links without mass, placeholders, and friction."""
        if not self.has_body:
            return ("effort: not covered, the robot is joints and limits alone",)
        bodies, missing = moving_bodies(self.model), ", ".join(self.massless)
        told = [f"inertias look like placeholders: {clause}" for clause in placeholders(bodies)]
        told += self.friction_notes
        if self.massless and self.allow_massless:
            return (f"links {missing}: no mass in the model; efforts leave them out", *told)
        return (f"effort: not covered, links {missing} have no mass in the model",) if self.massless else tuple(told)

    @property
    def friction_notes(self) -> tuple[str, ...]:
        """What the file says and efforts hold or leave out, such as friction, one clause each."""
        return *friction_notes(self.file_kind, self.friction_used, self.friction_left_out), *self.file_notes

    @property
    def dof(self) -> int:
        """Number of joints."""
        return len(self.joint_names)

    def tool_poses(self, q: Array) -> tuple[Array, Array]:
        """Forward kinematics of the tool frame by Pinocchio, for pictures and checks.

        Args:
            q: joint positions, shape (T, n_joints) [rad or m].

        Returns:
            Positions (T, 3) [m] and rotation matrices (T, 3, 3) in the base frame.
        """
        positions, rotations = self.joint_poses(q)
        return positions[:, -1], rotations[:, -1]

    def joint_poses(self, q: Array) -> tuple[Array, Array]:
        """Forward kinematics of the whole chain by Pinocchio: every joint of the model, then the tool.

        Args:
            q: joint positions, shape (T, n_joints) [rad or m].

        Returns:
            Origins (T, n_model + 1, 3) [m] and rotation matrices (T, n_model + 1, 3, 3) in the base frame, from the
            base to the tool. A joint's frame moves with it.
        """
        self.check_body("the place of the tool")
        data = self.model.createData()
        tool = self.model.getFrameId(self.tool)
        actuated = numbers(q, name="q", shape=("T", self.dof))
        places = (len(actuated), self.model.njoints)  # njoints counts the base, whose place the tool takes here
        positions, rotations = np.empty((*places, 3)), np.empty((*places, 3, 3))
        still = np.zeros_like(actuated)
        for i, configuration in enumerate(self.transmission.motion(actuated, still, still)[0]):
            pin.forwardKinematics(self.model, data, configuration)
            for k, placement in enumerate((*data.oMi[1:], pin.updateFramePlacement(self.model, data, tool))):
                positions[i, k], rotations[i, k] = placement.translation, placement.rotation
        return positions, rotations

    @property
    def joint_axes(self) -> tuple[Array, Array]:
        """Unit axis of every joint of the model in its own frame, (n_model, 3), and whether it turns, (n_model,)."""
        subspaces = np.array([np.ravel(joint.createData().S) for joint in self.model.joints[1:]])
        turns: Array = np.any(subspaces[:, 3:], axis=1, keepdims=True)
        return np.where(turns, subspaces[:, 3:], subspaces[:, :3]), turns[:, 0]


def load_robot(
    name: str | Path,
    *,
    lock: Mapping[str, float] | None = None,
    tool: str | None = None,
    limits: Mapping[str, Any] | str | Path | None = None,
    gravity: Any = None,
    allow_massless: bool | None = None,
    friction: str | Mapping[str, Any] | None = None,
    packages: str | Path | Sequence[str | Path] | None = None,
    xacro: Mapping[str, Any] | None = None,
    base: Mapping[str, Any] | None = None,
    tools: Sequence[Mapping[str, Any]] | None = None,
    urdf: str | None = None,
    drives: Mapping[str, Any] | None = None,
    grip: Grip | Mapping[str, Any] | None = None,
    stand: Stand | Mapping[str, Any] | None = None,
    supply: Supply | Mapping[str, Any] | None = None,
) -> Robot:
    """Load a robot by name, from a folder, or from a URDF, xacro or MJCF file.

    Args:
        name: a name that ``trajevo list`` shows, or one of example-robot-data, the path of a folder with ``robot.toml``
            and the file that it names or a table ``[dh]``, or the path of a URDF, of xacro (ending ``.xacro``, by the
            package xacrodoc) or of MJCF (any file with ``<mujoco>`` at its top). A name of trajevo takes precedence
            over a folder of that name.
        lock: joints to lock, name -> position [rad or m]. A joint that mimics a locked one is held where that holds it;
            a locked joint mimics no other.
        tool: one of ``tools``, which is then mounted, or another frame at the end effector; if None, the only one of
            ``tools``, that of ``robot.toml`` or the only tip.
        limits: limits that complete or replace those of the files, a mapping from ``position``, ``velocity``,
            ``acceleration``, ``jerk`` or ``effort`` to one number for all joints, to one per joint in order, or to a
            mapping from joints to numbers; for positions, pairs of numbers. Numbers are SI, or text with a unit such as
            ``"180 deg/s"``; ``inf`` means no limit. A number for velocity, acceleration or effort may be
            ``{"backward": 60.0, "forward": 80.0}``, the magnitudes for both directions. Or the path of a MoveIt
            ``joint_limits.yaml``.
        gravity: in the frame of the cell, which is the base frame unless ``base`` is given, shape (3,) [m/s²]; if
            None, that of ``robot.toml``, of MJCF, or 9.80665 along -z.
        allow_massless: whether it is meant that links that a joint moves have no mass, so that efforts leave them out;
            if False, efforts, energies and capacities of such a robot are refused. If None, as ``robot.toml`` says, or
            False.
        friction: ``"file"`` (or ``"urdf"``) for what ``<dynamics>`` of the URDF says, ``damping`` [N·m·s/rad or N·s/m]
            as viscous and ``friction`` [N·m or N] as dry friction, or ``damping`` and ``frictionloss`` of MJCF;
            ``"none"``, or numbers that complete or replace those of the files, a mapping from ``viscous``,
            ``coulomb`` or ``armature`` [kg·m² or kg] to numbers as in ``limits``. If None, as ``robot.toml`` says, and
            where it says nothing, as the file does. Armature is that of ``robot.toml`` or MJCF unless it is given.
        packages: folders that hold the packages of ``package://NAME/...`` paths of meshes and ``$(find NAME)`` of
            xacro, besides the folder of the file, the three above it, and those in ``ROS_PACKAGE_PATH``.
        xacro: values of the arguments (``<xacro:arg>``) of a xacro file: texts, numbers, truth values.
        base: pose of the robot's first link in the cell, a mapping with ``position`` [m] and ``rpy`` [rad], numbers or
            text with a unit; points, obstacles and gravity are then in the frame of the cell. If None, that of
            ``robot.toml``, or none.
        tools: tools of which one can be mounted, in place of those of ``robot.toml``: mappings with ``name``,
            ``parent`` (a link), ``position`` [m] and ``rpy`` [rad] in it, ``mass`` [kg], ``com`` [m] and ``inertia``
            about it, (3, 3) or its diagonal [kg·m²], in the tool's frame. Masses are parts of the robot, no payload.
        urdf: the text of a URDF, in place of a file; ``name`` is then what the robot is called.
        drives: drives that complete or replace those of ``robot.toml``, a mapping from joints to a
            :class:`~trajevo.robot.drive.Drive` or to a mapping from its attributes to numbers [SI] or text with a unit.
        grip: how it holds a payload by friction, a :class:`~trajevo.robot.contacts.grip.Grip` or a mapping as for them.
        stand: what it stands on, not bolted down, a :class:`~trajevo.robot.contacts.stand.Stand` or a mapping.
        supply: of all drives, a :class:`~trajevo.robot.loading.supply.Supply` or a mapping; completes ``robot.toml``.

    Returns:
        The robot, with limits in SI. If there is a ``robot.toml``, its limits replace those of the file. Otherwise
        position, velocity and effort limits come from the URDF, or position and effort limits (``forcerange``,
        ``actuatorfrcrange``) from MJCF, and all others from ``limits``. A
        continuous joint has no range, whatever its ``<limit>`` says, unless ``limits`` or ``robot.toml`` gives one. A
        joint that mimics another is none of the robot's joints: what it bears and its friction are borne by the joint
        that it follows, which is limited to positions and velocities at which the limits of both are kept.

    Raises:
        UnknownNameError: neither a known robot nor a file or folder, or no such tool frame or joint; the message lists
            the known names.
        InvalidInputError: a file is refused by :class:`~trajevo.robot.robot_toml.RobotFile`,
            :func:`~trajevo.robot.urdf.problems.checked_urdf` or Pinocchio, an argument has another type, or a limit is
            missing. The message names the file and, where there is one, the joint or link and the value.
    """
    if not isinstance(lock, Mapping | None):
        raise InvalidInputError(f"lock: expected a mapping from joints to positions [rad or m], got {lock!r}")
    if not isinstance(allow_massless, bool | None):
        raise InvalidInputError(f"allow_massless: expected True or False, got {allow_massless!r}")
    folders = package_folders(packages, exist=urdf is None)
    files = opened(name, lock or {}, folders=folders, urdf=urdf, xacro=xacro, base=base, tool=tool, tools=tools)
    found, file, where = files.found, files.settings, files.where
    root = ElementTree.fromstring(found.text)
    following, locked = followers(root, lock or {})
    model, units = build_model(found.text, where, locked, found.limits)
    model.gravity.linear = gravity_of(gravity, file, found)
    transmission, names, units = drives_of(model, units, following, file)
    declared = None if file is None else file.limits(names, units, locked)
    given = given_limits(limits, names, units, locked, following)
    rubs = None if file is None else file.friction(names, units)
    rubbing = friction_of(friction, dynamics_of(root, locked, found.armature), following, names, units, rubs)
    motors = robot_drives(drives, {} if file is None else file.drives(names, units, locked), names, units, locked)
    return Robot(
        name=files.name if file is None else file.settings.name,
        model=model,
        transmission=transmission,
        limits=JointLimits(**declared_limits(model, names, units, declared, given, where, following, source=found)),
        friction=with_rotors(rubbing.friction, motors, names),
        joint_names=names,
        joint_units=units,
        tool=tool_of(model, files.tool, found.text, where, file),
        source=files.folder,
        reference=f"{files.called}, {len(names)} joints, {moving_mass(model):.4g} kg"
        if file is None
        else file.settings.reference,
        urdf=files.path,
        packages=files.packages,
        locked=locked,
        followers=following,
        settings=load_settings(
            files.name if files.text is not None else name,
            urdf=files.text,
            lock=lock,
            tool=tool,
            limits=given or None,
            gravity=gravity,
            allow_massless=allow_massless,
            friction=friction,
            packages=[str(folder) for folder in (folders if files.text is None else files.needed)] or None,
            base=base,
            tools=tools,
            drives=plain_drives(drives),
            **plain_contacts(grip=grip, stand=stand),
            supply=plain_supply(supply),
        ),
        allow_massless=masses_meant(allow_massless, file, model, found),
        friction_used=rubbing.used,
        friction_left_out=rubbing.left_out,
        written="" if found.as_written else found.text,
        file_kind=found.kind,
        file_notes=found.notes,
        drives=motors,
        **contacts_of({} if file is None else file.contacts, grip=grip, stand=stand),
        supply=supply_of(supply, None if file is None else file.supply),
    )


def robot_of(given: Any) -> Robot:
    """The robot that a caller passed: a robot, a name or path, or arguments by name, of :func:`load_robot` or settings.

    Raises:
        InvalidInputError: a robot that :func:`load_robot` did not load, a mapping with other keys, or as for
            :func:`load_robot`.
    """
    if isinstance(given, Robot):
        if given.settings is None:
            raise InvalidInputError(f"robot: {given.name!r} was not loaded by load_robot, so no file can refer to it")
        return given
    if not isinstance(given, Mapping):
        return load_robot(given)
    if not {"dh", "joints", "kind"}.isdisjoint(given):
        made: Robot = written_robot_of(Robot, given)
        return made
    accepted = tuple(inspect.signature(load_robot).parameters)
    unknown = sorted(set(given) - set(accepted))
    if unknown or "name" not in given:
        raise InvalidInputError(f"robot: expected name and, if wanted, {', '.join(accepted[1:])}, got {sorted(given)}")
    return load_robot(**given)
