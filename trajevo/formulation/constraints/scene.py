"""Obstacles around a robot, bodies attached to its links, and how far it has to stay away from them and from itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, final

from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError
from trajevo.formulation.constraints.scenes.obstacles import (
    FARTHEST,
    SHAPES,
    Box,
    Capsule,
    Cylinder,
    Hull,
    Mesh,
    Obstacle,
    Plane,
    Sphere,
    check_keys,
    length_of,
    obstacle_of,
)
from trajevo.formulation.constraints.scenes.scene_files import read_obstacles

__all__ = [
    "SHAPES",
    "Attached",
    "Box",
    "Capsule",
    "Cylinder",
    "Hull",
    "Mesh",
    "Obstacle",
    "Plane",
    "Scene",
    "Sphere",
]

#: Clearance above which numbers are not believed [m].
_MOST_CLEARANCE = 5.0


@final
@dataclass(frozen=True)
class Attached:
    """A solid that is fixed to a link of the robot, such as a camera, a hose or a gripper that its file lacks.

    Attributes:
        solid: its shape, with name and place in the frame of the link. Its ``touches`` are names of links, obstacles
            and other attached bodies from which it need not stay away.
        on: name of a link, or of another frame of the robot.

    Raises:
        InvalidInputError: no solid of finite size, or no name.
    """

    solid: Obstacle
    on: str

    def __post_init__(self) -> None:
        if not isinstance(self.solid, Obstacle) or isinstance(self.solid, Plane):
            known = ", ".join(sorted(set(SHAPES) - {"plane"}))
            raise InvalidInputError(f"attached: expected a solid, one of {known}, got {self.solid!r}")
        if self.solid.motion is not None:
            raise InvalidInputError(
                f"attached {self.solid.name!r}: motion: expected none, as it moves with its link; poses over time are "
                "those of an obstacle"
            )
        if not isinstance(self.on, str) or not self.on:
            raise InvalidInputError(f"attached {self.solid.name!r}: on: expected the name of a link, got {self.on!r}")

    @property
    def settings(self) -> dict[str, Any]:
        """Plain data that makes an equal one."""
        return self.solid.settings | {"on": self.on}


@final
@dataclass(frozen=True)
class Scene:
    """Obstacles, and the clearances of a robot to them and to itself.

    Attributes:
        obstacles: in the base frame of the robot; those without a name are numbered.
        clearance: least distance from the robot to any of them, from 0 on [m].
        self_clearance: least distance between links of the robot, from 0 on [m]; not checked if None.
        attached: solids fixed to links, which keep both clearances as links do; those without a name are numbered.

    Raises:
        InvalidInputError: no obstacle and no ``self_clearance``, two solids of one name, or a distance that is
            negative or not finite.
    """

    obstacles: tuple[Obstacle, ...] = ()
    clearance: float = 0.0
    self_clearance: float | None = None
    attached: tuple[Attached, ...] = ()

    __repr__ = brief

    def __post_init__(self) -> None:
        given = self.obstacles if isinstance(self.obstacles, list | tuple) else None
        if given is None or not all(isinstance(entry, Obstacle) for entry in given):
            raise InvalidInputError(
                f"scene: obstacles: expected boxes, spheres, cylinders, meshes and planes, got {self.obstacles!r}"
            )
        fixed = self.attached if isinstance(self.attached, list | tuple) else None
        if fixed is None or not all(isinstance(entry, Attached) for entry in fixed):
            raise InvalidInputError(f"scene: attached: expected solids that are attached to links, got {fixed!r}")
        named = tuple(entry if entry.name else replace(entry, name=f"obstacle {k}") for k, entry in enumerate(given, 1))
        fixed = tuple(
            one if one.solid.name else Attached(replace(one.solid, name=f"attached {k}"), one.on)
            for k, one in enumerate(fixed, 1)
        )
        for entry in (*named, *(one.solid for one in fixed)):
            if entry.away > FARTHEST:
                raise InvalidInputError(
                    f"scene: obstacle {entry.name!r}: expected an obstacle within {FARTHEST:g} m of the base, got one "
                    f"that is {entry.away:.4g} m away and looks like mm: lengths are in m; leave it out if it is so "
                    "far away"
                )
        names = [entry.name for entry in named] + [one.solid.name for one in fixed]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise InvalidInputError(f"scene: obstacles: expected names that differ, got {twice[0]!r} twice")
        object.__setattr__(self, "obstacles", named)
        object.__setattr__(self, "attached", fixed)
        self._check_clearances()

    def _check_clearances(self) -> None:
        object.__setattr__(self, "clearance", length_of(self.clearance, "scene: clearance", least="from 0 on"))
        if self.self_clearance is not None:
            checked = length_of(self.self_clearance, "scene: self_clearance", least="from 0 on")
            object.__setattr__(self, "self_clearance", checked)
        if not self.obstacles and self.self_clearance is None:
            raise InvalidInputError("scene: expected obstacles or a self_clearance, got neither")
        for key in ("clearance", "self_clearance"):
            length = getattr(self, key) or 0.0
            if length > _MOST_CLEARANCE:
                raise InvalidInputError(
                    f"scene: {key}: {length:g} m looks like mm: expected at most {_MOST_CLEARANCE:g} m, "
                    f"{1e-3 * length:g} if it is mm"
                )

    @classmethod
    def of(cls, given: Scene | Mapping[str, Any]) -> Scene:
        """A scene from plain data; a scene is returned unchanged.

        Args:
            given: ``obstacles``, a list of mappings with ``shape`` (a key of
                :data:`~trajevo.formulation.constraints.scenes.obstacles.SHAPES`), ``position``, ``rpy`` or ``rotation``
                (3 x 3), ``name``, ``touches``, ``motion`` (poses over time) and the sizes of the shape; ``file``, a
                file with more of them, see :meth:`read`; ``attached``, such mappings with ``on``, the name of a link;
                ``clearance`` and ``self_clearance``.

        Raises:
            UnknownNameError: no such shape.
            InvalidInputError: a key that is unknown or missing, or a value that cannot be used; the message names
                obstacle and key.
        """
        if isinstance(given, Scene):
            return given
        if not isinstance(given, Mapping):
            raise InvalidInputError(f"scene: expected a mapping with obstacles and clearance, got {given!r}")
        check_keys(given, {key.name for key in fields(cls)} | {"file"}, set(), "scene")
        for key in ("obstacles", "attached"):
            if not isinstance(given.get(key, ()), list | tuple):
                raise InvalidInputError(f"scene: {key}: expected a list of solids, got {given[key]!r}")
        read = read_obstacles(given["file"]) if given.get("file") is not None else ()
        own = tuple(obstacle_of(entry, k) for k, entry in enumerate(given.get("obstacles", ()), 1))
        fixed = tuple(_attached(entry, k) for k, entry in enumerate(given.get("attached", ()), 1))
        values = {key: value for key, value in given.items() if key != "file"}
        return cls(**{**values, "obstacles": (*read, *own), "attached": fixed})

    @classmethod
    def read(
        cls,
        file: str | Path,
        *,
        clearance: float = 0.0,
        self_clearance: float | None = None,
        obstacles: Sequence[Obstacle | Mapping[str, Any]] = (),
        attached: Sequence[Attached | Mapping[str, Any]] = (),
    ) -> Scene:
        """A scene with the obstacles of a file, which is read now and never again.

        Args:
            file: a scene of MoveIt as text (``.scene``), or an MJCF file (``.xml``), of which the geoms of bodies
                without joints are taken.
            clearance: see the attributes [m].
            self_clearance: see the attributes [m].
            obstacles: more obstacles, as for :meth:`of`.
            attached: solids on links, as for :meth:`of`.

        Raises:
            InvalidInputError: the file cannot be read; the message names it and the line or the geom.
        """
        given = {"file": file, "clearance": clearance, "self_clearance": self_clearance}
        return cls.of({**given, "obstacles": list(obstacles), "attached": list(attached)})

    @property
    def moving(self) -> tuple[Obstacle, ...]:
        """The obstacles that move."""
        return tuple(obstacle for obstacle in self.obstacles if obstacle.motion is not None)

    @property
    def still(self) -> tuple[Obstacle, ...]:
        """The obstacles that stand still."""
        return tuple(obstacle for obstacle in self.obstacles if obstacle.motion is None)

    @property
    def settings(self) -> dict[str, Any]:
        """Plain data that makes an equal scene."""
        fixed = {"attached": [one.settings for one in self.attached]} if self.attached else {}
        return {
            "clearance": self.clearance,
            "self_clearance": self.self_clearance,
            "obstacles": [obstacle.settings for obstacle in self.obstacles],
        } | fixed


def _attached(given: Any, place: int) -> Attached:
    if isinstance(given, Attached):
        return given
    if not isinstance(given, Mapping):
        raise InvalidInputError(f"attached {place}: expected a mapping with shape and on, got {given!r}")
    name = given.get("name") or f"attached {place}"
    if "on" not in given:
        raise InvalidInputError(f"attached {name!r}: on: expected the name of a link, got none")
    solid = {"position": [0.0, 0.0, 0.0]} | {key: value for key, value in given.items() if key != "on"} | {"name": name}
    return Attached(obstacle_of(solid, place), given["on"])
