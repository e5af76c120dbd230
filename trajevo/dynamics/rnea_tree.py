"""Kinematic trees as data: the joints of a model, its bodies, and both as arrays for compiled loops."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from trajevo.base.arrays import Array
from trajevo.robot.kinematics import frame_along, without_rounding


class Joint(NamedTuple):
    """One joint of a tree: number of its parent joint (0: the base), its placement there, and how it moves."""

    parent: int
    rotation: tuple[float, ...]
    origin: tuple[float, ...]
    slides: bool
    axis: tuple[float, ...]


def tree_of(model: Any) -> tuple[Joint, ...] | None:
    """The joints of a model; None if any of them neither turns about nor slides along a single axis."""
    joints = []
    for number, joint in enumerate(list(model.joints)[1:], start=1):
        moves = _axis(joint)
        if moves is None or joint.idx_v != number - 1 or joint.nq != 1:
            return None
        place = model.jointPlacements[number]
        rotation, origin = (tuple(without_rounding(x).ravel().tolist()) for x in (place.rotation, place.translation))
        joints.append(Joint(model.parents[number], rotation, origin, *moves))
    return tuple(joints)


class Inertias(NamedTuple):
    """Data of a model that a kernel needs besides the tree: bodies (n, 10), gravity (3,), armature (n,)."""

    bodies: Array
    gravity: Array
    armature: Array

    @classmethod
    def of(cls, model: Any) -> Inertias:
        """The data of a Pinocchio model."""
        bodies = []
        for inertia in list(model.inertias)[1:]:
            mass, lever = float(inertia.mass), np.array(inertia.lever)
            about_origin = np.array(inertia.inertia) + mass * (lever @ lever * np.eye(3) - np.outer(lever, lever))
            bodies.append([mass, *(mass * lever), *about_origin[np.triu_indices(3)]])
        return cls(np.array(bodies), np.array(model.gravity.linear), np.array(model.armature))


class Tree(NamedTuple):
    """A tree with its bodies for :mod:`trajevo.dynamics.rnea_loops`: the z-axis of every frame is its joint's axis.

    Attributes:
        parents: number of every joint's parent from 1, or 0 for the base, shape (n,).
        slides: which joints slide, shape (n,).
        places: rotation, row by row, and origin of every joint's frame in its parent's, shape (n, 12).
        bodies: mass, mass times centre of mass, inertia about the frame's origin, shape (n, 10).
        gravity: shape (3,) [m/s²].
        armature: shape (n,).
    """

    parents: Array
    slides: Array
    places: Array
    bodies: Array
    gravity: Array
    armature: Array

    @classmethod
    def of(cls, joints: tuple[Joint, ...], inertias: Inertias) -> Tree:
        """A tree in frames whose z-axes are the joints' axes."""
        frames = [np.eye(3), *(frame_along(joint.axis) for joint in joints)]
        places, bodies = [], []
        for number, joint in enumerate(joints, start=1):
            before, own = frames[joint.parent].T, frames[number]
            rotation = before @ np.reshape(joint.rotation, (3, 3)) @ own
            places.append([*rotation.ravel(), *(before @ joint.origin)])
            mass, *lever = inertias.bodies[number - 1, :4]
            inertia = np.zeros((3, 3))
            inertia[np.triu_indices(3)] = inertias.bodies[number - 1, 4:]
            inertia = own.T @ (inertia + np.triu(inertia, 1).T) @ own
            bodies.append([mass, *(own.T @ lever), *inertia[np.triu_indices(3)]])
        return cls(
            np.array([joint.parent for joint in joints], dtype=np.int64),
            np.array([joint.slides for joint in joints], dtype=np.bool_),
            np.array(places),
            np.array(bodies),
            inertias.gravity,
            inertias.armature,
        )


def _axis(joint: Any) -> tuple[bool, tuple[float, ...]] | None:
    """Whether a joint slides, and along or about which axis; None for other kinds of joints."""
    name = joint.shortname()
    for kind, slides in (("JointModelR", False), ("JointModelP", True)):
        if name in {kind + letter for letter in "XYZ"}:
            return slides, tuple(1.0 if letter == name[-1] else 0.0 for letter in "XYZ")
    if name in ("JointModelRevoluteUnaligned", "JointModelPrismaticUnaligned"):
        return "Prismatic" in name, tuple(float(x) for x in joint.extract().axis)
    return None
