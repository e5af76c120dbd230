"""Random robots and tasks: 2 to 8 joints that turn or slide, points on limits, joints that rest, loads, weak motors."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tests.helpers import suited
from trajevo import load_robot
from trajevo.trajectory.interpolants import THROUGH_POINTS

#: Standard gravity [m/s²], from which the motors are sized.
_G = 9.80665

#: Whether robots with links without mass can be loaded.
CAN_TELL = "allow_massless" in inspect.signature(load_robot).parameters

#: Directions of axes, placements and gravity that people choose, among which there are many special cases.
_AXES = ("1 0 0", "0 1 0", "0 0 1", "-1 0 0", "0 0 -1")


def random_urdf(
    generator: np.random.Generator,
    joints: int,
    *,
    kinds: Sequence[str] = ("revolute", "prismatic"),
    massless: bool = False,
) -> str:
    """A chain of links with mass, its limits included.

    Args:
        generator: all randomness.
        joints: their number.
        kinds: kinds of joints among which to draw.
        massless: whether links may have no mass, except the last one.
    """
    parts = ['<robot name="random">', '<link name="link_0"/>']
    masses, sizes = generator.uniform(0.2, 8.0, joints), generator.uniform(0.05, 0.6, joints)
    if massless:
        masses[:-1] *= generator.random(joints - 1) > 0.3
    for k in range(joints):
        kind = str(generator.choice(kinds))
        # What the joint carries at full stretch, times a factor: some motors are too weak, some far too strong.
        weight = _G * masses[k:].sum() * (1.0 if kind == "prismatic" else sizes[k:].sum() + 0.1)
        effort = (weight + 0.5) * 10.0 ** generator.uniform(0.0, 1.3)
        reach = generator.uniform(0.05, 1.0) if kind == "prismatic" else generator.uniform(0.3, 3.0)
        middle = generator.choice([0.0, generator.uniform(-1.0, 1.0) * reach])
        speed = generator.uniform(0.2, 3.0)
        parts.append(_link(f"link_{k + 1}", masses[k], sizes[k], generator))
        parts.append(
            f'<joint name="joint_{k + 1}" type="{kind}"><parent link="link_{k}"/><child link="link_{k + 1}"/>'
            f'<origin xyz="{_text(_offset(generator, sizes[k]))}" rpy="{_text(_turn(generator))}"/>'
            f'<axis xyz="{_axis(generator)}"/><limit lower="{middle - reach:.6g}" upper="{middle + reach:.6g}" '
            f'velocity="{speed:.6g}" effort="{effort:.6g}"/></joint>'
        )
    return "\n".join([*parts, "</robot>"])


def random_task(seed: int, folder: Path) -> dict[str, Any]:
    """Arguments of a :class:`~trajevo.ViaPointProblem` of a random robot, whose URDF is written into a folder."""
    generator = np.random.default_rng(seed)
    joints = int(generator.integers(2, 9))
    file = folder / f"random_{seed}.urdf"
    kinds = (("revolute", "prismatic"), ("revolute",), ("prismatic",))[int(generator.choice(3, p=[0.7, 0.2, 0.1]))]
    massless = bool(generator.random() < 0.15) and CAN_TELL
    file.write_text(random_urdf(generator, joints, kinds=kinds, massless=massless), encoding="utf-8")
    gravity = [[0.0, 0.0, -_G], [0.0, 0.0, 0.0], [0.0, -_G, 0.0]][int(generator.choice(3, p=[0.7, 0.15, 0.15]))]
    limits: dict[str, Any] = {
        "acceleration": float(generator.uniform(2.0, 20.0)),
        "jerk": float("inf") if generator.random() < 0.15 else float(generator.uniform(20.0, 500.0)),
    }
    robot = {"name": str(file), "limits": limits, "gravity": gravity, **({"allow_massless": True} if massless else {})}
    constraints = ["position", "velocity", "acceleration", "jerk"] + ["effort"] * (generator.random() < 0.7)
    objectives = [["time", "jerk"], ["time", "energy"], ["time", "square_effort", "tool_path"]][
        int(generator.integers(3))
    ]
    least = float(generator.choice([0.05, 0.2, 0.5]))
    given = {
        "robot": robot,
        "points": random_points(generator, file).tolist(),
        "duration_bounds": (least, float(generator.choice([6.0, 20.0]))),
        "interpolant": str(generator.choice(["quintic_spline", *sorted(THROUGH_POINTS)])),
        "objectives": objectives,
        "constraints": constraints,
        "payload": _payload(generator),
        "limits": str(generator.choice(["certified", "sampled"])),
    }
    return suited(given["interpolant"], given)


def random_points(generator: np.random.Generator, file: Path) -> np.ndarray[Any, Any]:
    """3 to 6 points within the ranges of a URDF's joints: some on limits, some equal to the point before."""
    limits = load_robot(file, limits={"acceleration": 1.0, "jerk": 1.0}).limits
    lower, upper = limits.lower, limits.upper
    count = int(generator.integers(3, 7))
    way = generator.uniform(0.05, 0.45)
    shares = 0.5 + way * generator.uniform(-1.0, 1.0, (count, len(lower)))
    points = lower + shares * (upper - lower)
    on_limits = generator.random() < 0.5
    for k in range(count):
        for joint in range(len(lower)):
            draw = generator.random()
            if on_limits and draw < 0.15:
                points[k, joint] = (lower if generator.random() < 0.5 else upper)[joint]
            elif k and draw > 0.8:
                points[k, joint] = points[k - 1, joint]
    if generator.random() < 0.2:  # a joint that never moves
        points[:, -1] = points[0, -1]
    for k in range(1, count):
        if (points[k] == points[k - 1]).all():
            points[k, 0] = 0.5 * (points[k, 0] + (lower if points[k, 0] > 0.5 * (lower + upper)[0] else upper)[0])
    return points


def _payload(generator: np.random.Generator) -> Any:
    if generator.random() < 0.4:
        return 0.0
    mass = float(10.0 ** generator.uniform(-2.0, 0.7))
    return {"mass": mass, "com": generator.uniform(-0.2, 0.2, 3).tolist()}


def _link(name: str, mass: float, size: float, generator: np.random.Generator) -> str:
    if mass == 0.0:
        return f'<link name="{name}"/>'
    centre = generator.choice([0.0, 0.5]) * _offset(generator, size)
    # Moments of a cuboid, or of a point mass with hardly any.
    a, b, c = (size * generator.uniform(0.1, 1.0, 3)) ** 2 * (1.0 if generator.random() < 0.8 else 1e-6)
    moments = " ".join(
        f'{key}="{mass / 12.0 * value:.6g}"' for key, value in (("ixx", b + c), ("iyy", a + c), ("izz", a + b))
    )
    return (
        f'<link name="{name}"><inertial><origin xyz="{_text(centre)}"/><mass value="{mass:.6g}"/>'
        f'<inertia {moments} ixy="0" ixz="0" iyz="0"/></inertial></link>'
    )


def _offset(generator: np.random.Generator, size: float) -> np.ndarray[Any, Any]:
    kind = generator.random()
    if kind < 0.15:
        return np.zeros(3)
    if kind < 0.6:
        return size * np.eye(3)[generator.integers(3)]
    return size * generator.uniform(-1.0, 1.0, 3)


def _turn(generator: np.random.Generator) -> np.ndarray[Any, Any]:
    kind = generator.random()
    if kind < 0.4:
        return np.zeros(3)
    if kind < 0.7:
        return 0.5 * np.pi * generator.integers(-1, 3, 3)
    return generator.uniform(-np.pi, np.pi, 3)


def _axis(generator: np.random.Generator) -> str:
    if generator.random() < 0.7:
        return str(generator.choice(_AXES))
    axis = generator.normal(size=3)
    return _text(axis / np.linalg.norm(axis))


def _text(numbers: Any) -> str:
    return " ".join(f"{number:.9g}" for number in numbers)
