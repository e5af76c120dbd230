"""What a model does not know of the masses of a robot: links without mass, and numbers that look like placeholders."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np

#: Moving bodies lighter than this are taken for placeholders [kg].
LEAST_MASS = 1e-4

#: Share by which equal numbers of a file may differ.
_ROUNDING = 1e-9


def moving_mass(model: Any) -> float:
    """Mass of everything that a joint of a Pinocchio model moves [kg]."""
    return float(sum(inertia.mass for inertia in list(model.inertias)[1:]))


class MovingBody(NamedTuple):
    """Links that are rigidly connected, and the joint that moves them, SI.

    Attributes:
        joint: name of the joint.
        links: names of the links.
        mass: mass [kg].
        moments: principal moments of inertia about the centre of mass, ascending [kg·m²].
    """

    joint: str
    links: tuple[str, ...]
    mass: float
    moments: tuple[float, ...]


def moving_bodies(model: Any) -> tuple[MovingBody, ...]:
    """The bodies that the joints of a Pinocchio model move, in the order of the joints."""
    links: dict[int, list[str]] = {}
    for frame in model.frames:
        if frame.type.name == "BODY":
            links.setdefault(int(frame.parentJoint), []).append(str(frame.name))
    found = []
    for joint in range(1, model.njoints):
        body, name = model.inertias[joint], str(model.names[joint])
        moments = np.linalg.eigvalsh(np.array(body.inertia)) if body.mass > 0.0 or np.any(body.inertia) else np.zeros(3)
        named = tuple(links.get(joint, [f"body of {name}"]))
        found.append(MovingBody(name, named, float(body.mass), tuple(moments.tolist())))
    return tuple(found)


def massless(bodies: Iterable[MovingBody]) -> tuple[MovingBody, ...]:
    """The bodies without mass and inertia."""
    return tuple(body for body in bodies if body.mass == 0.0 and not any(body.moments))


def placeholders(bodies: Iterable[MovingBody]) -> Iterator[str]:
    """Masses and inertias that look as if nobody had filled them in, one clause each.

    These are masses below 0.1 g, and inertias that are the same in all directions and either 1 kg·m² or, like the mass,
    those of half of the bodies.
    """
    heavy = [body for body in bodies if body.mass > 0.0]
    light = [body for body in heavy if body.mass < LEAST_MASS]
    if light:
        yield f"{_links(light)}: less than {LEAST_MASS:g} kg"
    round_ = [body for body in heavy if body not in light and _same(body.moments, [body.moments[-1]] * 3)]
    suspects: dict[tuple[float, float], list[MovingBody]] = {}
    for body in round_:
        key = next((key for key in suspects if _same(key, (body.mass, body.moments[-1]))), None)
        suspects.setdefault(key or (body.mass, body.moments[-1]), []).append(body)
    for (mass, moment), same in suspects.items():
        if moment > 0.0 and (1 < len(same) >= 0.5 * len(heavy) or _same((moment,), (1.0,))):
            yield f"{_links(same)}: {mass:g} kg with {moment:g} kg·m² about every axis"


def _same(these: Iterable[float], those: Iterable[float]) -> bool:
    return bool(np.allclose(tuple(these), tuple(those), rtol=_ROUNDING, atol=0.0))


def _links(bodies: Iterable[MovingBody]) -> str:
    return f"links {', '.join(link for body in bodies for link in body.links)}"
